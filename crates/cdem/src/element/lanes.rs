//! Numbers side by side: kernels are written once, and run for one element or for as many
//! as a register of the machine holds numbers, with the same bits.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use pulp::Simd;

/// Most numbers side by side.
pub(super) const MOST: usize = 8;

/// A number, or several side by side.
pub(crate) trait Real:
    Copy
    + Add<Output = Self>
    + AddAssign
    + Div<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + Sub<Output = Self>
    + SubAssign
{
    /// A constant, as many times as this has numbers.
    fn constant(self, value: f64) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        value
    }
}

/// How many elements a kernel takes at once.
pub(super) trait Lanes: Copy {
    type Number: Real;

    /// How many.
    const COUNT: usize;

    /// The numbers `of` each lane.
    #[inline(always)]
    fn gather(self, of: impl Fn(usize) -> f64) -> Self::Number {
        let mut all = [0.0; MOST];
        for lane in 0..Self::COUNT {
            all[lane] = of(lane);
        }
        self.load(&all)
    }

    /// The first [`Self::COUNT`] of these.
    fn load(self, all: &[f64; MOST]) -> Self::Number;

    /// The numbers of the lanes, the first [`Self::COUNT`] of these.
    fn each(self, numbers: Self::Number) -> [f64; MOST];
}

/// One.
#[derive(Clone, Copy)]
pub(super) struct Single;

impl Lanes for Single {
    type Number = f64;

    const COUNT: usize = 1;

    #[inline(always)]
    fn load(self, all: &[f64; MOST]) -> f64 {
        all[0]
    }

    #[inline(always)]
    fn each(self, number: f64) -> [f64; MOST] {
        let mut all = [0.0; MOST];
        all[0] = number;
        all
    }
}

/// As many as a register of some instructions holds.
#[derive(Clone, Copy)]
pub(super) struct Register<S>(pub(super) S);

impl<S: Simd> Lanes for Register<S> {
    type Number = Numbers<S>;

    const COUNT: usize = S::F64_LANES;

    #[inline(always)]
    fn load(self, all: &[f64; MOST]) -> Numbers<S> {
        Numbers {
            simd: self.0,
            numbers: S::as_simd_f64s(all).0[0],
        }
    }

    #[inline(always)]
    fn each(self, numbers: Numbers<S>) -> [f64; MOST] {
        let mut all = [0.0; MOST];
        S::as_mut_simd_f64s(&mut all).0[0] = numbers.numbers;
        all
    }
}

/// The numbers in a register.
#[derive(Clone, Copy)]
pub(super) struct Numbers<S: Simd> {
    simd: S,
    numbers: S::f64s,
}

impl<S: Simd> Real for Numbers<S> {
    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        Self {
            numbers: self.simd.splat_f64s(value),
            ..self
        }
    }
}

macro_rules! operator {
    ($operator:ident, $function:ident, $of:ident) => {
        impl<S: Simd> $operator for Numbers<S> {
            type Output = Self;

            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self {
                    numbers: self.simd.$of(self.numbers, other.numbers),
                    ..self
                }
            }
        }
    };
}

operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(Div, div, div_f64s);

impl<S: Simd> Neg for Numbers<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            numbers: self.simd.neg_f64s(self.numbers),
            ..self
        }
    }
}

impl<S: Simd> AddAssign for Numbers<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<S: Simd> SubAssign for Numbers<S> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
