//! SIMD numbers. A kernel is written once and runs for one element, or for as many as a register of
//! the machine has lanes, with the same bits.

use std::ops::{Add, AddAssign, Deref, DerefMut, Div, Mul, Neg, Sub, SubAssign};

use pulp::Simd;

/// Number of numbers side by side in memory: the lanes of the widest registers, and a multiple of
/// those of the others.
pub(super) const WIDTH: usize = 8;

/// One number of each of [`WIDTH`] elements, aligned for one load.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(super) struct SimdRow([f64; WIDTH]);

impl SimdRow {
    /// Creates a row of equal numbers.
    #[inline(always)]
    pub(super) fn splat(number: f64) -> Self {
        Self([number; WIDTH])
    }
}

impl Deref for SimdRow {
    type Target = [f64; WIDTH];

    #[inline(always)]
    fn deref(&self) -> &[f64; WIDTH] {
        &self.0
    }
}

impl DerefMut for SimdRow {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64; WIDTH] {
        &mut self.0
    }
}

/// A number, or several in SIMD lanes.
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
    /// Returns a constant in all lanes of this type.
    fn constant(self, value: f64) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        value
    }
}

/// The lanes of a kernel: the elements that it computes at once.
pub(super) trait Lanes: Copy {
    type Number: Real;

    /// Number of lanes, a divisor of [`WIDTH`].
    const COUNT: usize;

    /// Returns one number in all lanes.
    fn splat(self, value: f64) -> Self::Number;

    /// Returns the numbers of a row from `first` on.
    fn load(self, row: &SimdRow, first: usize) -> Self::Number;

    /// Stores the numbers in a row from `first` on.
    fn store(self, numbers: Self::Number, row: &mut SimdRow, first: usize);
}

/// One lane.
#[derive(Clone, Copy)]
pub(super) struct Single;

impl Lanes for Single {
    type Number = f64;

    const COUNT: usize = 1;

    #[inline(always)]
    fn splat(self, value: f64) -> f64 {
        value
    }

    #[inline(always)]
    fn load(self, row: &SimdRow, first: usize) -> f64 {
        row[first]
    }

    #[inline(always)]
    fn store(self, number: f64, row: &mut SimdRow, first: usize) {
        row[first] = number;
    }
}

/// The lanes of a register of an instruction set.
#[derive(Clone, Copy)]
pub(super) struct Register<S>(pub(super) S);

impl<S: Simd> Lanes for Register<S> {
    type Number = SimdNumbers<S>;

    const COUNT: usize = S::F64_LANES;

    #[inline(always)]
    fn splat(self, value: f64) -> SimdNumbers<S> {
        SimdNumbers {
            simd: self.0,
            numbers: self.0.splat_f64s(value),
        }
    }

    #[inline(always)]
    fn load(self, row: &SimdRow, first: usize) -> SimdNumbers<S> {
        SimdNumbers {
            simd: self.0,
            numbers: S::as_simd_f64s(&row[first..first + S::F64_LANES]).0[0],
        }
    }

    #[inline(always)]
    fn store(self, numbers: SimdNumbers<S>, row: &mut SimdRow, first: usize) {
        S::as_mut_simd_f64s(&mut row[first..first + S::F64_LANES]).0[0] = numbers.numbers;
    }
}

/// The numbers in a register.
#[derive(Clone, Copy)]
pub(super) struct SimdNumbers<S: Simd> {
    simd: S,
    numbers: S::f64s,
}

impl<S: Simd> Real for SimdNumbers<S> {
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
        impl<S: Simd> $operator for SimdNumbers<S> {
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

impl<S: Simd> Neg for SimdNumbers<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            numbers: self.simd.neg_f64s(self.numbers),
            ..self
        }
    }
}

impl<S: Simd> AddAssign for SimdNumbers<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<S: Simd> SubAssign for SimdNumbers<S> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
