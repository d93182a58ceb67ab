//! Nonlinear CG between sweeps, on the velocities of SIMD blocks.
//!
//! The velocities that a search direction makes are known without a pass over the contacts,
//! because each sweep has added its part to them. A step along the direction visits each SIMD
//! block once.

use pulp::{Arch, Simd, WithSimd};

use crate::contact::solver::simd_block::SimdBlock;
use crate::contact::tolerances::BLOCKS_PER_TASK;

/// Velocities that the search directions of the contacts make.
#[derive(Clone, Debug, Default)]
pub(super) struct NonlinearCg<P> {
    /// These velocities, and the velocities before the last sweep, m/s.
    direction: Vec<P>,
    before: Vec<P>,
    /// Step that each impulse still has to take along its direction. The velocities have taken
    /// it.
    ratio: f64,
}

impl<P: SimdBlock> NonlinearCg<P> {
    /// Restarts with direction zero from these velocities, m/s.
    pub(super) fn begin(&mut self, velocity: &[P]) {
        self.direction.clear();
        self.direction.resize(velocity.len(), P::default());
        self.before.clear();
        self.before.extend_from_slice(velocity);
        self.ratio = 0.0;
    }

    /// Moves velocities along the direction by `ratio` after a sweep.
    pub(super) fn advance(&mut self, ratio: f64, velocity: &mut [P]) {
        self.ratio = ratio;
        advance_all(ratio, [velocity, &mut self.direction, &mut self.before]);
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
    });
}

/// SIMD blocks to move, with the widest instructions of the machine.
struct AdvanceBlocks<'a, P> {
    ratio: f64,
    /// Velocities, directions, and velocities before the last sweep.
    simd_blocks: [&'a mut [P]; 3],
}

impl<P: SimdBlock> WithSimd for AdvanceBlocks<'_, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let [velocity, direction, before] = self.simd_blocks;
        for ((velocity, direction), before) in velocity.iter_mut().zip(direction).zip(before) {
            advance(self.ratio, [velocity, direction, before]);
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
