//! Steady forces at the borders of time levels.
//!
//! An element kicks its nodes once in its interval. A node of a finer level moves in between, so
//! that a block at rest would tremble at the border of two levels for ever. For this reason the mean
//! force of the coarser elements on such a node acts at the node's own rate, and only the rest acts
//! at the kicks of the elements. The impulse over an interval of the elements is the same. The mean
//! changes seldom, and less and less as the block comes to rest: then no kick changes a velocity.

use std::collections::BTreeMap;

use smallvec::SmallVec;

use crate::math::vector::{add_scaled, cross, norm, pad, scale};
use crate::model::inverse_mass::InverseMass;
use crate::model::positions::Positions;
use crate::model::steady_force::SteadyForce;
use crate::model::time_levels::Levels;
use crate::step::Run;
use crate::step::assembly::Assembly;
use crate::step::kick::KickPurpose;
use crate::step::schedule::{Substep, duration};

/// A node and the coarser elements of one level around it.
#[derive(Clone, Debug)]
pub(crate) struct LevelBorder {
    pub(super) node: u32,
    /// Level of the elements.
    pub(super) level: u8,
    /// Number of a group impulse of the node's own level, and those of the elements.
    pub(super) own: u32,
    pub(super) coarser: SmallVec<[u32; 4]>,
}

/// Round-off of the moment of a steady force in a coarse step, over that of the impulse that is
/// outstanding at its end: a few roundings in each of some kicks.
const MOMENT_ROUND_OFF: f64 = 64.0 * f64::EPSILON;

/// Moment of the steady forces of a block in a coarse step, N·m·s.
#[derive(Clone, Copy, Debug, Default)]
struct BlockMoment {
    sum: [f64; 3],
    round_off: f64,
}

impl Assembly {
    /// Returns the nodes with elements of coarser levels, the nodes of finer levels first.
    pub(super) fn level_borders(&self, levels: &Levels) -> Vec<LevelBorder> {
        let mut borders = Vec::new();
        for (node, own) in (0..).zip(self.of_nodes()) {
            for same in own.chunk_by(|one, other| one.level == other.level).skip(1) {
                borders.push(LevelBorder {
                    node,
                    level: same[0].level,
                    own: own[0].number,
                    coarser: same
                        .iter()
                        .map(|group_impulse| group_impulse.number)
                        .collect(),
                });
            }
        }
        borders.sort_by_key(|border| std::cmp::Reverse(levels.node[border.node as usize]));
        borders
    }
}

impl Substep<'_> {
    /// Lets the steady forces of the elements act at the rates of their nodes: changes the group
    /// impulses of a kick.
    pub(super) fn spread_steady_forces<const D: usize>(
        &self,
        forces: &mut [SteadyForce<D>],
        group_impulses: &mut [[f64; D]],
        at: Positions<D>,
        inertia: &InverseMass<D>,
    ) {
        // The intervals of the last kick and the next one differ after a change of levels. No force is
        // steady then.
        if !self.schedule.is_settled {
            return;
        }
        let borders = self.schedule.borders.iter().zip(forces);
        for (border, steady) in borders.take_while(|(border, _)| self.is_due(border.node)) {
            let mut acting = steady.force;
            let mut interval = self.duration(border.node);
            if border.level >= self.coarsest {
                let of_elements = self.duration_of(border.level);
                interval -= of_elements;
                if self.purpose == KickPurpose::Advance {
                    let mut impulse = [0.0; D];
                    for &number in &border.coarser {
                        add_scaled(&mut impulse, 1.0, &group_impulses[number as usize]);
                    }
                    acting = steady.update(&impulse, of_elements);
                }
            }
            add_scaled(&mut group_impulses[border.own as usize], interval, &acting);
            if self.purpose == KickPurpose::Advance {
                // Half of the first kick of a coarse step belongs to the step before.
                let in_step = match self.coarsest {
                    0 => scale(0.5 * interval, &steady.force),
                    _ => scale(interval, &acting),
                };
                let prescribed = inertia.prescribed(border.node as usize);
                add_moment(
                    &mut steady.moment,
                    &at.at(border.node),
                    &in_step,
                    prescribed,
                );
            }
        }
    }
}

impl<const D: usize> Run<D> {
    /// Begins with no steady force at the borders of new levels.
    pub(super) fn begin_steady_forces(&mut self) {
        let count = self.workspace.schedule.borders.len();
        self.state.steady_forces = vec![SteadyForce::NONE; count];
    }

    /// Ends a coarse step. Steady forces act at several instants, so their moments do not cancel in
    /// a block that turns. Gives each block the angular momentum that it lacks, or has too much of.
    pub(super) fn balance_steady_forces(&mut self) {
        let schedule = &self.workspace.schedule;
        let mut moments: BTreeMap<u32, BlockMoment> = BTreeMap::new();
        let mut steady_forces = std::mem::take(&mut self.state.steady_forces);
        let at = self.model.positions(&self.state);
        for (border, steady) in schedule.borders.iter().zip(&mut steady_forces) {
            let mut moment = std::mem::take(&mut steady.moment);
            if moment == [0.0; 3] && steady.force == [0.0; D] {
                continue;
            }
            let (point, impulse) = (at.at(border.node), self.outstanding(border, steady));
            let prescribed = self.model.inertia.prescribed(border.node as usize);
            add_moment(&mut moment, &point, &impulse, prescribed);
            let block = self.model.block_of[border.node as usize];
            let of_block = moments.entry(block).or_default();
            add_scaled(&mut of_block.sum, 1.0, &moment);
            of_block.round_off += MOMENT_ROUND_OFF * norm(&point) * norm(&impulse);
        }
        self.state.steady_forces = steady_forces;
        for (block, moment) in moments {
            if norm(&moment.sum) > moment.round_off {
                self.add_angular_momentum(block as usize, &scale(-1.0, &moment.sum));
            }
        }
    }

    /// Returns the accelerations over a coarse step, m/s², that nodes of blocks may get if the steady
    /// forces end now: by what is outstanding, and by the kicks of the elements after that.
    pub(super) fn accelerations_of_ending_forces(&self) -> Vec<(usize, f64)> {
        let borders = self.workspace.schedule.borders.iter();
        let active = borders.zip(&self.state.steady_forces);
        let active = active.filter(|(_, steady)| steady.force != [0.0; D]);
        let acceleration = |(border, steady): (&LevelBorder, &SteadyForce<D>)| {
            let n = border.node as usize;
            let speed = norm(&self.outstanding(border, steady)) / self.model.inertia.mass()[n];
            (
                self.model.block_of[n] as usize,
                2.0 * speed / self.model.step,
            )
        };
        active.map(acceleration).collect()
    }

    /// Returns the impulse of a steady force that belongs to the last interval of the elements and
    /// has not acted yet, N·s: half of its share of the next kick.
    fn outstanding(&self, border: &LevelBorder, steady: &SteadyForce<D>) -> [f64; D] {
        let own = self.workspace.schedule.levels.node[border.node as usize];
        let [own, of_elements] = [own, border.level].map(|level| duration(self.model.step, level));
        scale(0.5 * (own - of_elements), &steady.force)
    }

    /// Ends the steady forces before the levels change: what is outstanding acts now.
    pub(super) fn end_steady_forces(&mut self) {
        let forces = std::mem::take(&mut self.state.steady_forces);
        let borders = std::mem::take(&mut self.workspace.schedule.borders);
        for (border, steady) in borders.iter().zip(&forces) {
            let n = border.node as usize;
            let impulse = self.outstanding(border, steady);
            let velocity = &mut self.state.velocity;
            self.model.inertia.apply_impulse(n, &impulse, velocity);
            // The impulse on prescribed components goes to their supports.
            let prescribed = self.model.inertia.prescribed(n);
            let held: [f64; D] =
                std::array::from_fn(|c| if prescribed[c] { -impulse[c] } else { 0.0 });
            self.state.ledger.impulse.add_scaled(1.0, &pad(&held));
        }
    }
}

/// Adds the moment of an impulse at a point about the origin, N·m·s. Impulses on prescribed
/// components go to the supports.
fn add_moment<const D: usize>(
    moment: &mut [f64; 3],
    point: &[f64; D],
    impulse: &[f64; D],
    prescribed: [bool; D],
) {
    let free: [f64; D] = std::array::from_fn(|c| if prescribed[c] { 0.0 } else { impulse[c] });
    add_scaled(moment, 1.0, &cross(&pad(point), &pad(&free)));
}
