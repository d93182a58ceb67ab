//! Numbers of the nodes of an island that its solver changes side by side.

use std::fmt::Debug;

use bytemuck::{Pod, Zeroable};
use pulp::Simd;

/// Numbers side by side: the components of one node, or one component of nodes that one mass
/// matrix couples.
pub(super) trait Pack: Pod + Debug + Default + Send + Sync {
    /// How many there are.
    const WIDTH: usize = size_of::<Self>() / size_of::<f64>();

    #[inline(always)]
    fn numbers(&self) -> &[f64] {
        bytemuck::cast_slice(std::slice::from_ref(self))
    }

    #[inline(always)]
    fn numbers_mut(&mut self) -> &mut [f64] {
        bytemuck::cast_slice_mut(std::slice::from_mut(self))
    }

    /// Adds multiples of others.
    fn add_scaled<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        factors: &Factors<S, N>,
        all: &[Self; N],
    );

    /// The first of some numbers, and 0 behind the last.
    #[inline(always)]
    fn of(numbers: &[f64]) -> Self {
        let mut pack = Self::default();
        if let Some(all) = numbers.get(..Self::WIDTH) {
            pack.numbers_mut().copy_from_slice(all);
        } else {
            pack.numbers_mut()[..numbers.len()].copy_from_slice(numbers);
        }
        pack
    }
}

/// Numbers that packs are multiplied by, each once and in a register.
pub(super) struct Factors<S: Simd, const N: usize> {
    numbers: [f64; N],
    registers: [S::f64s; N],
}

impl<S: Simd, const N: usize> Factors<S, N> {
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

/// Where the components of a node are among the numbers of all packs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seat {
    pub(super) first: u32,
    pub(super) stride: u32,
}

impl Seat {
    /// The seats of so many nodes that one mass matrix couples, in packs from the one with this
    /// number on; and how many packs they take.
    pub(super) fn of<const D: usize, P: Pack>(
        nodes: usize,
        pack: usize,
    ) -> (impl Iterator<Item = Self>, usize) {
        let (packs, stride) = if nodes == 1 {
            (1, 1)
        } else {
            (D * nodes.div_ceil(P::WIDTH), P::WIDTH)
        };
        let seats = (0..nodes).map(move |k| Self {
            first: (P::WIDTH * (pack + D * (k / P::WIDTH)) + k % P::WIDTH) as u32,
            stride: stride as u32,
        });
        (seats, packs)
    }

    /// Where a component is.
    #[inline(always)]
    pub(super) fn number(self, component: usize) -> usize {
        self.first as usize + component * self.stride as usize
    }
}

/// The components of one node, and 0: where masses are lumped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub(super) struct OfNode([f64; 4]);

/// A component of as many nodes as the widest registers hold, and a multiple of what the others
/// do; or, of a node alone, its components.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct OfBlock([f64; 8]);

impl Pack for OfNode {
    #[inline(always)]
    fn add_scaled<S: Simd, const N: usize>(
        &mut self,
        _: S,
        factors: &Factors<S, N>,
        all: &[Self; N],
    ) {
        for n in 0..N {
            for c in 0..4 {
                self.0[c] += factors.numbers[n] * all[n].0[c];
            }
        }
    }
}

impl Pack for OfBlock {
    /// Told register by register: compilers would gather numbers of several packs into one.
    #[inline(always)]
    fn add_scaled<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        factors: &Factors<S, N>,
        all: &[Self; N],
    ) {
        const { assert!(8 % S::F64_LANES == 0) };
        for n in 0..N {
            let registers = S::as_mut_simd_f64s(&mut self.0).0.iter_mut();
            for (own, other) in registers.zip(S::as_simd_f64s(&all[n].0).0) {
                *own = simd.add_f64s(*own, simd.mul_f64s(factors.registers[n], *other));
            }
        }
    }
}
