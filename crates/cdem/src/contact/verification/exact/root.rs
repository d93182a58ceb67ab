//! Roots of polynomials, between integers over powers of two.

use std::cmp::Ordering;

use num_bigint::BigInt;

use crate::contact::verification::exact::Polynomial;

/// number / 2^bits.
#[derive(Clone, Debug)]
pub(crate) struct Dyadic {
    pub(super) number: BigInt,
    pub(super) bits: u32,
}

impl From<f64> for Dyadic {
    /// Converts a time that is not negative, exactly.
    fn from(time: f64) -> Self {
        let pattern = time.abs().to_bits(); // 0 may be −0
        let (exponent, fraction) = ((pattern >> 52) as u32, pattern & ((1 << 52) - 1));
        let number = if exponent == 0 {
            fraction
        } else {
            fraction | 1 << 52
        };
        let bits = 1075 - exponent.max(1);
        Self {
            number: number.into(),
            bits,
        }
    }
}

impl Dyadic {
    fn compare(&self, other: &Self) -> Ordering {
        (&self.number << other.bits).cmp(&(&other.number << self.bits))
    }

    fn middle(&self, other: &Self) -> Self {
        let bits = self.bits.max(other.bits);
        let at = |it: &Self| &it.number << (bits - it.bits);
        Self {
            number: at(self) + at(other),
            bits: bits + 1,
        }
    }

    /// Returns the value, rounded.
    fn value(&self) -> f64 {
        use num_traits::ToPrimitive;
        let surplus = self.bits.saturating_sub(60);
        let number = (&self.number >> surplus).to_f64().unwrap_or(f64::NAN);
        number / 2.0_f64.powi((self.bits - surplus) as i32)
    }
}

/// Bits of the ends of the first second, of which a little more is searched.
const BITS: u32 = 60;

/// A root of a polynomial, between two times at which it has opposite signs.
///
/// The ends come from halving the interval from −1/2^60 to 1 + 2/2^60. None is a fraction with a
/// smaller denominator. So none is a root of a polynomial with coefficients below 2^60, and none is
/// a round time.
#[derive(Clone, Debug)]
pub(crate) struct Root {
    /// The polynomial, without multiple roots.
    of: Polynomial,
    low: Dyadic,
    high: Dyadic,
}

/// Returns the number of roots in an interval of the polynomial with this Sturm chain.
fn count(chain: &[Polynomial], low: &Dyadic, high: &Dyadic) -> usize {
    let changes = |at: &Dyadic| {
        let signs = chain
            .iter()
            .map(|p| p.sign_at(at))
            .filter(|&sign| sign != 0);
        let signs: Vec<i32> = signs.collect();
        signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
    };
    changes(low) - changes(high)
}

fn sturm(of: &Polynomial) -> Vec<Polynomial> {
    of.chain(of.derivative())
}

impl Root {
    /// Returns all roots from 0 to 1, in order; none for the zero polynomial.
    pub(crate) fn all(of: &Polynomial) -> Vec<Self> {
        let chain = sturm(of);
        if of.is_constant() {
            return Vec::new();
        }
        let [of, _] = of.divide(&chain[chain.len() - 1]);
        let chain = sturm(&of);
        let end = |number: BigInt| Dyadic { number, bits: BITS };
        let [low, high] = [BigInt::from(-1), (BigInt::from(1) << BITS) + 2].map(end);
        let mut roots = Vec::new();
        Self::isolate(&of, &chain, (low, high), &mut roots);
        let [start, second] = [0.0, 1.0].map(Dyadic::from);
        roots.retain(|root| {
            root.compare(&start) != Ordering::Less && root.compare(&second) != Ordering::Greater
        });
        roots
    }

    fn isolate(
        of: &Polynomial,
        chain: &[Polynomial],
        (low, high): (Dyadic, Dyadic),
        roots: &mut Vec<Self>,
    ) {
        match count(chain, &low, &high) {
            0 => {}
            1 => roots.push(Self {
                of: of.clone(),
                low,
                high,
            }),
            _ => {
                let middle = low.middle(&high);
                Self::isolate(of, chain, (low, middle.clone()), roots);
                Self::isolate(of, chain, (middle, high), roots);
            }
        }
    }

    fn halve(&mut self) {
        let middle = self.low.middle(&self.high);
        if self.of.sign_at(&middle) == self.of.sign_at(&self.low) {
            self.low = middle;
        } else {
            self.high = middle;
        }
    }

    /// Halves the interval until another polynomial has no root in it except this one.
    fn part_from(&mut self, other: &Polynomial) {
        let chain = sturm(other);
        let common = usize::from(self.is_root_of(other));
        while count(&chain, &self.low, &self.high) > common {
            self.halve();
        }
    }

    fn is_root_of(&self, other: &Polynomial) -> bool {
        let chain = self.of.chain(other.clone());
        let divisor = &chain[chain.len() - 1];
        divisor.sign_at(&self.low) != divisor.sign_at(&self.high)
    }

    /// Returns the sign of a polynomial at the root.
    pub(crate) fn sign_of(&mut self, other: &Polynomial) -> i32 {
        if self.is_root_of(other) || other.is_zero() {
            return 0;
        }
        self.sign_after(other)
    }

    /// Returns the sign of a polynomial just before the root.
    pub(crate) fn sign_before(&mut self, other: &Polynomial) -> i32 {
        self.part_from(other);
        other.sign_at(&self.low)
    }

    /// Returns the sign of a polynomial just after the root.
    pub(crate) fn sign_after(&mut self, other: &Polynomial) -> i32 {
        self.part_from(other);
        other.sign_at(&self.high)
    }

    /// Compares the root with a time.
    pub(crate) fn compare(&self, time: &Dyadic) -> Ordering {
        if time.compare(&self.low) != Ordering::Greater {
            return Ordering::Greater;
        }
        if time.compare(&self.high) != Ordering::Less {
            return Ordering::Less;
        }
        match self.of.sign_at(time) {
            0 => Ordering::Equal,
            sign if sign == self.of.sign_at(&self.low) => Ordering::Greater,
            _ => Ordering::Less,
        }
    }

    pub(crate) fn is_at_start(&self) -> bool {
        self.compare(&Dyadic::from(0.0)) == Ordering::Equal
    }

    /// Returns two times on either side of the root, less than a millionth of a second apart.
    pub(crate) fn about(&mut self) -> [f64; 2] {
        while self.high.value() - self.low.value() > 1e-6 {
            self.halve();
        }
        [self.low.value().max(0.0), self.high.value().min(1.0)]
    }
}
