//! SIMD blocks: numbers of nodes that the solver changes together.

use std::fmt::Debug;

use bytemuck::{Pod, Zeroable};
use pulp::Simd;

/// Numbers side by side: the components of one node, or one component of several nodes that one
/// mass matrix couples.
pub(crate) trait SimdBlock: Pod + Debug + Default + Send + Sync {
    /// The number of numbers.
    const WIDTH: usize = size_of::<Self>() / size_of::<f64>();

    /// True if impulses act through the [columns of
    /// M⁻¹](crate::contact::solver::inverse_mass_columns::InverseMassColumns) of their nodes,
    /// not through a response stored for each contact.
    const BY_COLUMNS: bool = false;

    #[inline(always)]
    fn numbers(&self) -> &[f64] {
        bytemuck::cast_slice(std::slice::from_ref(self))
    }

    #[inline(always)]
    fn numbers_mut(&mut self) -> &mut [f64] {
        bytemuck::cast_slice_mut(std::slice::from_mut(self))
    }

    /// Adds multiples of other SIMD blocks.
    fn add_scaled<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        factors: &BlockFactors<S, N>,
        all: &[Self; N],
    );

    /// Returns the first numbers of a slice, padded with 0.
    #[inline(always)]
    fn of(numbers: &[f64]) -> Self {
        let mut simd_block = Self::default();
        if let Some(all) = numbers.get(..Self::WIDTH) {
            simd_block.numbers_mut().copy_from_slice(all);
        } else {
            simd_block.numbers_mut()[..numbers.len()].copy_from_slice(numbers);
        }
        simd_block
    }
}

/// SIMD blocks of a contact, for writing.
pub(super) trait SimdBlocks<P> {
    /// Returns the one with an index, from 0.
    fn simd_block(&mut self, number: usize) -> &mut P;

    /// Changes each in turn, with its entry of `of_each`.
    fn change<T>(&mut self, of_each: &[T], change: impl FnMut(&mut P, &T));
}

/// A selection of all SIMD blocks, by index.
pub(super) struct BlockList<'a, P> {
    pub(super) numbers: &'a [u32],
    pub(super) all: &'a mut [P],
}

impl<P: SimdBlock> SimdBlocks<P> for BlockList<'_, P> {
    #[inline(always)]
    fn simd_block(&mut self, number: usize) -> &mut P {
        &mut self.all[self.numbers[number] as usize]
    }

    #[inline(always)]
    fn change<T>(&mut self, of_each: &[T], mut change: impl FnMut(&mut P, &T)) {
        for (&number, own) in self.numbers.iter().zip(of_each) {
            change(&mut self.all[number as usize], own);
        }
    }
}

/// Factors of SIMD blocks, each also broadcast to a register.
pub(crate) struct BlockFactors<S: Simd, const N: usize> {
    numbers: [f64; N],
    registers: [S::f64s; N],
}

impl<S: Simd, const N: usize> BlockFactors<S, N> {
    #[inline(always)]
    pub(super) fn new(simd: S, numbers: &[f64; N]) -> Self {
        let mut registers = [simd.splat_f64s(0.0); N];
        for n in 0..N {
            registers[n] = simd.splat_f64s(numbers[n]);
        }
        Self {
            numbers: *numbers,
            registers,
        }
    }
}

/// The components of one node, padded with 0: for lumped masses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub(crate) struct NodeBlock([f64; 4]);

/// One component of 8 nodes: the width of the widest registers, and a multiple of the width of
/// others. For a node alone, where impulses do not act by columns: its components.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct CoupledBlock<const BY_COLUMNS: bool>(BlockNumbers);

#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
struct BlockNumbers([f64; 8]);

impl SimdBlock for NodeBlock {
    #[inline(always)]
    fn add_scaled<S: Simd, const N: usize>(
        &mut self,
        _: S,
        factors: &BlockFactors<S, N>,
        all: &[Self; N],
    ) {
        for n in 0..N {
            for c in 0..4 {
                self.0[c] += factors.numbers[n] * all[n].0[c];
            }
        }
    }
}

impl<const BY_COLUMNS: bool> SimdBlock for CoupledBlock<BY_COLUMNS> {
    const BY_COLUMNS: bool = BY_COLUMNS;

    /// Written register by register: compilers would gather numbers of several blocks into one.
    #[inline(always)]
    fn add_scaled<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        factors: &BlockFactors<S, N>,
        all: &[Self; N],
    ) {
        const { assert!(8 % S::F64_LANES == 0) };
        for n in 0..N {
            let registers = S::as_mut_simd_f64s(&mut self.0.0).0.iter_mut();
            for (own, other) in registers.zip(S::as_simd_f64s(&all[n].0.0).0) {
                *own = simd.add_f64s(*own, simd.mul_f64s(factors.registers[n], *other));
            }
        }
    }
}
