//! Nonlinear CG between sweeps, on the velocities of SIMD blocks.
//!
//! The velocities that a search direction makes are known without a pass over the contacts,
//! because each sweep has added its part to them. A step along the direction visits each SIMD
//! block once.

use pulp::{Arch, Simd, WithSimd};

use crate::contact::solver::colouring::Colouring;
use crate::contact::solver::contact_rows::{ConstraintRows, ContactRows};
use crate::contact::solver::simd_block::{BlockList, SimdBlock};
use crate::contact::tolerances::BLOCKS_PER_TASK;
use crate::math::vector::scale;

/// Velocities that the search directions of the active contacts make.
#[derive(Clone, Debug, Default)]
pub(super) struct NonlinearCg<P> {
    /// These velocities, and the velocities before the last sweep, m/s.
    direction: Vec<P>,
    before: Vec<P>,
    /// Step that each impulse still has to take along its direction. The velocities have taken
    /// it.
    ratio: f64,
    /// The number of contacts whose SIMD blocks are moved. If not all are, the blocks are
    /// listed.
    of_contacts: usize,
    are_listed: bool,
    listed: Vec<u32>,
    is_listed: Vec<bool>,
}

impl<P: SimdBlock> NonlinearCg<P> {
    /// Restarts with direction zero from these velocities, m/s, of all SIMD blocks.
    pub(super) fn begin(&mut self, colours: &Colouring, velocity: &[P]) {
        self.direction.resize(velocity.len(), P::default());
        self.before.resize(velocity.len(), P::default());
        self.ratio = 0.0;
        self.list(colours);
        if !self.are_listed {
            self.direction.fill(P::default());
            self.before.copy_from_slice(velocity);
        }
        for &simd_block in &self.listed {
            let simd_block = simd_block as usize;
            (self.direction[simd_block], self.before[simd_block]) =
                (P::default(), velocity[simd_block]);
        }
    }

    /// Lists the SIMD blocks of the active contacts again, once these are fewer than half as
    /// many.
    pub(super) fn narrow(&mut self, colours: &Colouring) {
        if 2 * colours.active().len() < self.of_contacts {
            self.list(colours);
        }
    }

    fn list(&mut self, colours: &Colouring) {
        let awake = colours.active();
        self.of_contacts = awake.len();
        self.are_listed = awake.len() < colours.order().len();
        self.listed.clear();
        if !self.are_listed {
            return;
        }
        self.is_listed.clear();
        self.is_listed.resize(self.before.len(), false);
        for simd_block in awake
            .iter()
            .flat_map(|&place| colours.nodes(place as usize))
        {
            if !std::mem::replace(&mut self.is_listed[*simd_block as usize], true) {
                self.listed.push(*simd_block);
            }
        }
    }

    /// Removes a contact with these SIMD blocks: its direction, and its change in the last
    /// sweep.
    pub(super) fn leave<const D: usize>(
        &mut self,
        simd_blocks: &[u32],
        terms: &ConstraintRows<D, P>,
        point: &ContactRows<D>,
    ) {
        let back = scale(-1.0, &point.direction);
        Arch::new().dispatch(ApplyImpulses {
            simd_blocks,
            terms,
            point,
            changes: [
                (&back, &mut self.direction),
                (&point.step, &mut self.before),
            ],
        });
    }

    /// Moves velocities along the direction by `ratio` after a sweep.
    pub(super) fn advance(&mut self, ratio: f64, velocity: &mut [P]) {
        self.ratio = ratio;
        let simd_blocks = [velocity, &mut self.direction, &mut self.before];
        if self.are_listed {
            let listed = Some(&*self.listed);
            Arch::new().dispatch(AdvanceBlocks {
                ratio,
                simd_blocks,
                listed,
            });
        } else {
            advance_all(ratio, simd_blocks);
        }
    }

    /// Takes the step that each impulse still has to take, and sets it to 0.
    pub(super) fn take_ratio(&mut self) -> f64 {
        std::mem::replace(&mut self.ratio, 0.0)
    }
}

/// Moves a velocity along its last direction by `ratio`. The new direction is the whole change
/// since the last call.
#[inline(always)]
fn advance<P: SimdBlock>(ratio: f64, simd_blocks: [&mut P; 3]) {
    let [velocity, direction, before] = simd_blocks;
    let (velocity, direction) = (velocity.numbers_mut(), direction.numbers_mut());
    let before = before.numbers_mut();
    for c in 0..P::WIDTH {
        let ahead = ratio * direction[c];
        direction[c] = ahead + (velocity[c] - before[c]);
        velocity[c] += ahead;
        before[c] = velocity[c];
    }
}

/// Moves all SIMD blocks.
fn advance_all<P: SimdBlock>(ratio: f64, [velocity, direction, before]: [&mut [P]; 3]) {
    if velocity.len() > BLOCKS_PER_TASK {
        let middle = velocity.len() / 2;
        let (velocity, more) = velocity.split_at_mut(middle);
        let (direction, further) = direction.split_at_mut(middle);
        let (before, others) = before.split_at_mut(middle);
        let (own, rest) = ([velocity, direction, before], [more, further, others]);
        rayon::join(|| advance_all(ratio, own), || advance_all(ratio, rest));
        return;
    }
    Arch::new().dispatch(AdvanceBlocks {
        ratio,
        simd_blocks: [velocity, direction, before],
        listed: None,
    });
}

/// SIMD blocks to move, all or those listed, with the widest instructions of the machine.
struct AdvanceBlocks<'a, P> {
    ratio: f64,
    /// Velocities, directions, and velocities before the last sweep.
    simd_blocks: [&'a mut [P]; 3],
    listed: Option<&'a [u32]>,
}

impl<P: SimdBlock> WithSimd for AdvanceBlocks<'_, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let [velocity, direction, before] = self.simd_blocks;
        if let Some(listed) = self.listed {
            for &simd_block in listed {
                let simd_block = simd_block as usize;
                let own = [
                    &mut velocity[simd_block],
                    &mut direction[simd_block],
                    &mut before[simd_block],
                ];
                advance(self.ratio, own);
            }
            return;
        }
        for ((velocity, direction), before) in velocity.iter_mut().zip(direction).zip(before) {
            advance(self.ratio, [velocity, direction, before]);
        }
    }
}

/// Adds the response to two impulses of a contact, each to values of its own.
struct ApplyImpulses<'a, const D: usize, P> {
    simd_blocks: &'a [u32],
    terms: &'a ConstraintRows<D, P>,
    point: &'a ContactRows<D>,
    changes: [(&'a [f64; D], &'a mut [P]); 2],
}

impl<const D: usize, P: SimdBlock> WithSimd for ApplyImpulses<'_, D, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (impulse, all) in self.changes {
            let numbers = self.simd_blocks;
            let values = &mut BlockList { numbers, all };
            self.terms.push(simd, self.point, impulse, values);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::solver::simd_block::NodeBlock;

    #[test]
    fn many_packs_go_as_each_would() {
        let start = |k: usize| [0.0, 1.0, 2.0].map(|of| NodeBlock::of(&[(k as f64 + of).sin(); 4]));
        let count = 3 * BLOCKS_PER_TASK + 1;
        let of_all = |which: usize| (0..count).map(|k| start(k)[which]).collect::<Vec<_>>();
        let [mut velocity, mut direction, mut before] = [0, 1, 2].map(of_all);
        advance_all(0.7, [&mut velocity, &mut direction, &mut before]);
        for k in 0..count {
            let [mut one, mut of_one, mut once] = start(k);
            advance(0.7, [&mut one, &mut of_one, &mut once]);
            assert_eq!((one, of_one, once), (velocity[k], direction[k], before[k]));
        }
    }
}
