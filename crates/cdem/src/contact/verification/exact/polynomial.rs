//! Polynomials of time with integer coefficients, and vectors of them.

use std::ops::{Add, Mul, Neg, Sub};

use num_bigint::BigInt;
use num_traits::{Signed, ToPrimitive, Zero};

use crate::contact::verification::exact::Dyadic;

/// Coefficients of 1, t, t², …, the last not 0.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Polynomial(Vec<BigInt>);

impl Polynomial {
    fn new(mut coefficients: Vec<BigInt>) -> Self {
        while coefficients.last().is_some_and(Zero::is_zero) {
            coefficients.pop();
        }
        Self(coefficients)
    }

    /// start + rate·t.
    pub(crate) fn linear(start: i64, rate: i64) -> Self {
        Self::new(vec![start.into(), rate.into()])
    }

    pub(crate) fn is_zero(&self) -> bool {
        self.0.is_empty()
    }

    pub(crate) fn is_constant(&self) -> bool {
        self.0.len() <= 1
    }

    /// Returns a coefficient, rounded.
    pub(crate) fn coefficient(&self, power: usize) -> f64 {
        let exact = self.0.get(power).and_then(ToPrimitive::to_f64);
        exact.unwrap_or(0.0)
    }

    /// Returns the value at a time, rounded.
    pub(crate) fn about(&self, time: f64) -> f64 {
        let powers = (0..self.0.len()).rev();
        powers.fold(0.0, |sum, power| sum * time + self.coefficient(power))
    }

    /// Returns the sign at a time: −1, 0 or 1.
    pub(crate) fn sign_at(&self, time: &Dyadic) -> i32 {
        let mut value = BigInt::zero();
        for (beyond, coefficient) in self.0.iter().rev().enumerate() {
            value = value * &time.number + (coefficient << (time.bits as usize * beyond));
        }
        i32::from(value.is_positive()) - i32::from(value.is_negative())
    }

    pub(crate) fn derivative(&self) -> Self {
        let terms = self.0.iter().enumerate().skip(1);
        Self::new(terms.map(|(power, c)| c * BigInt::from(power)).collect())
    }

    /// Returns quotient and remainder of a positive multiple of this.
    pub(crate) fn divide(&self, by: &Self) -> [Self; 2] {
        let (divisor, leading) = (&by.0, by.0.last().expect("divisors are not 0"));
        let mut rest = self.0.clone();
        let mut quotient = vec![BigInt::zero(); (rest.len() + 1).saturating_sub(divisor.len())];
        while rest.len() >= divisor.len() {
            let shift = rest.len() - divisor.len();
            let top = rest.pop().expect("no shorter than the divisor") * leading.signum();
            for c in rest.iter_mut().chain(&mut quotient) {
                *c *= leading.abs();
            }
            for (k, c) in divisor[..divisor.len() - 1].iter().enumerate() {
                rest[shift + k] -= &top * c;
            }
            quotient[shift] += top;
        }
        [Self::new(quotient), Self::new(rest)]
    }

    /// Returns Sturm's chain, with the greatest common divisor of this and `next` at its end.
    pub(crate) fn chain(&self, next: Self) -> Vec<Self> {
        let mut chain = vec![self.clone()];
        let mut next = next;
        while !next.is_zero() {
            let [_, rest] = chain[chain.len() - 1].divide(&next);
            chain.push(next);
            next = -&rest;
        }
        chain
    }
}

impl Add for &Polynomial {
    type Output = Polynomial;

    fn add(self, other: Self) -> Polynomial {
        let of = |p: &Polynomial, k: usize| p.0.get(k).cloned().unwrap_or_default();
        let count = self.0.len().max(other.0.len());
        Polynomial::new((0..count).map(|k| of(self, k) + of(other, k)).collect())
    }
}

impl Neg for &Polynomial {
    type Output = Polynomial;

    fn neg(self) -> Polynomial {
        Polynomial(self.0.iter().map(|c| -c).collect())
    }
}

impl Sub for &Polynomial {
    type Output = Polynomial;

    fn sub(self, other: Self) -> Polynomial {
        self + &-other
    }
}

impl Mul for &Polynomial {
    type Output = Polynomial;

    fn mul(self, other: Self) -> Polynomial {
        let mut product = vec![BigInt::zero(); self.0.len() + other.0.len()];
        for (j, one) in self.0.iter().enumerate() {
            for (k, two) in other.0.iter().enumerate() {
                product[j + k] += one * two;
            }
        }
        Polynomial::new(product)
    }
}

/// a − b.
pub(crate) fn difference<const D: usize>(
    a: &[Polynomial; D],
    b: &[Polynomial; D],
) -> [Polynomial; D] {
    std::array::from_fn(|c| &a[c] - &b[c])
}

/// a·b.
pub(crate) fn dot<const D: usize>(a: &[Polynomial; D], b: &[Polynomial; D]) -> Polynomial {
    let terms = a.iter().zip(b).map(|(a, b)| a * b);
    terms.fold(Polynomial::linear(0, 0), |sum, term| &sum + &term)
}

/// a × b.
pub(crate) fn cross(a: &[Polynomial; 3], b: &[Polynomial; 3]) -> [Polynomial; 3] {
    std::array::from_fn(|c| {
        let (i, j) = ((c + 1) % 3, (c + 2) % 3);
        &(&a[i] * &b[j]) - &(&a[j] * &b[i])
    })
}
