//! The first half of a substep: impulses of forces change the velocities.

use std::ops::Range;

use rayon::prelude::*;

use crate::element::MAX_NODES;
use crate::math::parallel::NODES_AT_ONCE;
use crate::math::vector::{add_scaled, dot, scale, sub};
use crate::model::boundary::{PrescribedMotion, VelocityTime};
use crate::model::ledger::{ImpulseAccount, Ledger};
use crate::model::positions::Positions;
use crate::model::state::LastKick;
use crate::model::{Model, State};
use crate::scene::Damping;
use crate::step::assembly::Assembly;
use crate::step::schedule::Substep;

/// Nodal impulses of a kick, N·s.
/// Impulses of loads and contact are zero between kicks.
#[derive(Clone, Debug, Default)]
pub(crate) struct KickImpulses<const D: usize> {
    /// Sum of all impulses except contact: internal, with the steady forces, viscous, loads,
    /// gravity, damping.
    pub(crate) total: Vec<[f64; D]>,
    pub(crate) viscous: Vec<[f64; D]>,
    pub(crate) load: Vec<[f64; D]>,
    pub(crate) damping: Vec<[f64; D]>,
    /// Contact impulses on prescribed nodes.
    pub(crate) contact: Vec<[f64; D]>,
    /// For elements whose interval changes: their impulse over the last interval minus that over
    /// the next, by node.
    pub(crate) level_changes: Vec<(u32, [f64; D])>,
    /// Elastic and viscous impulses of the element groups on their nodes.
    pub(super) group_impulses: [Vec<[f64; D]>; 2],
    /// The forces that act in the kick.
    pub(super) acting: ActiveLoads,
    /// Nodes with loads.
    loaded: Vec<u32>,
    /// Partial ledgers of the node ranges; kept to reuse their memory.
    ledgers: Vec<Ledger>,
}

impl<const D: usize> KickImpulses<D> {
    pub(crate) fn new(nodes: usize) -> Self {
        // Zeroed memory from the system is not committed until it is written; copies are.
        let zero = || vec![[0.0; D]; nodes];
        Self {
            total: zero(),
            viscous: zero(),
            load: zero(),
            damping: zero(),
            contact: zero(),
            level_changes: Vec::new(),
            group_impulses: [Vec::new(), Vec::new()],
            acting: ActiveLoads::default(),
            loaded: Vec::new(),
            ledgers: Vec::new(),
        }
    }

    /// Returns the energy that level changes make in a kick to the velocities `after`, J, by node.
    /// ½v⁻·M·v⁺ depends on the interval of an element. Where that changes, the energy made is a
    /// quarter of the difference of its impulses times the velocity change of the kick.
    pub(crate) fn made_by_levels(
        &self,
        before: &[[f64; D]],
        after: &[[f64; D]],
    ) -> impl Iterator<Item = (u32, f64)> {
        self.level_changes.iter().map(|(node, less)| {
            let n = *node as usize;
            let change = sub(&after[n], &before[n]);
            (*node, 0.25 * dot(less, &change))
        })
    }

    /// Allocates the element impulses; viscous ones only if stiffness damping acts.
    fn size_group_impulses(&mut self, assembly: &Assembly) {
        let count = assembly.len();
        let is_damped = self.acting.stiffness_damping;
        let counts = [count, if is_damped { count } else { 0 }];
        for (group_impulses, count) in self.group_impulses.iter_mut().zip(counts) {
            group_impulses.resize(count, [0.0; D]);
        }
    }

    /// Clears the sums to which the next kick adds.
    pub(crate) fn clear(&mut self) {
        // Rarely filled, and then from many elements: its memory is freed.
        self.level_changes = Vec::new();
        for node in self.loaded.drain(..) {
            self.load[node as usize] = [0.0; D];
        }
    }
}

/// Sets the kick interval of each node that is due.
fn take_intervals<const D: usize>(state: &mut State<D>, substep: &Substep) {
    let purpose = substep.purpose;
    let intervals = [&mut *state.last_kick.interval, &mut state.node_interval];
    substep.each_node(intervals, &|n, [interval, last]| {
        let next = substep.duration(n as u32);
        *interval = match purpose {
            KickPurpose::Advance => 0.5 * (*last + next),
            KickPurpose::Report => *last,
        };
        if purpose == KickPurpose::Advance {
            *last = next;
        }
    });
}

/// The velocities of a kick.
#[derive(Clone, Copy)]
pub(crate) struct KickVelocities<'a, const D: usize> {
    /// The velocities before the kick, m/s, and its intervals, s.
    pub(crate) last_kick: &'a LastKick<D>,
    /// The velocities after all impulses, m/s.
    pub(crate) after: &'a [[f64; D]],
}

/// The forces that act beside elements and contact; those absent are skipped.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ActiveLoads {
    pub(super) gravity: bool,
    pub(super) loads: bool,
    pub(super) mass_damping: bool,
    pub(super) stiffness_damping: bool,
    pub(super) local_damping: bool,
}

impl ActiveLoads {
    pub(super) fn anything(self) -> bool {
        self.gravity
            || self.loads
            || self.mass_damping
            || self.stiffness_damping
            || self.local_damping
    }
}

/// Purpose of a kick: to advance the run or to report its state.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum KickPurpose {
    /// Kicks from the middle of the last interval to the middle of the next.
    Advance,
    /// Kicks over the last interval only; half of that kick gives the state at its end.
    Report,
}

impl<const D: usize> Model<D> {
    /// Kicks the nodes that are due: internal forces, loads, gravity, damping, prescribed
    /// velocities. Contact comes after.
    pub(crate) fn kick(
        &mut self,
        state: &mut State<D>,
        velocity: &mut [[f64; D]],
        impulses: &mut KickImpulses<D>,
        substep: &Substep,
    ) {
        if !substep.schedule.is_steady {
            take_intervals(state, substep);
        }
        impulses.acting = self.acting(substep.time);
        impulses.size_group_impulses(&substep.schedule.assembly);
        self.kick_elements(state, velocity, impulses, substep);
        self.add_loads(state, impulses, substep);
        self.kick_nodes(state, velocity, impulses, substep);
        self.prescribe(state, velocity, substep);
    }

    /// Computes the impulses of the elements on their nodes, group by group.
    fn kick_elements(
        &mut self,
        state: &mut State<D>,
        velocity: &[[f64; D]],
        impulses: &mut KickImpulses<D>,
        substep: &Substep,
    ) {
        let intervals = (!substep.schedule.is_settled)
            .then(|| self.element_intervals(state, impulses, substep));
        let due = substep.due(intervals.as_deref());
        let assembly = &substep.schedule.assembly;
        for (number, set) in self.sets.iter_mut().enumerate() {
            let own = assembly.of_set(number);
            let group_impulses = impulses.group_impulses.each_mut().map(|group_impulses| {
                let end = group_impulses.len();
                &mut group_impulses[own.start.min(end)..own.end.min(end)]
            });
            set.kick(&due, [&state.displacement, velocity], group_impulses);
        }
        let [elastic, _] = &mut impulses.group_impulses;
        let at = Positions::new(&self.mesh.nodes, &state.displacement);
        substep.spread_steady_forces(&mut state.steady_forces, elastic, at, &self.inertia);
    }

    /// Returns the kick interval of each element, s, for the case that some levels have just
    /// changed. All elements are due then.
    fn element_intervals(
        &self,
        state: &mut State<D>,
        impulses: &mut KickImpulses<D>,
        substep: &Substep,
    ) -> Vec<f64> {
        let mut intervals = state.element_interval.clone();
        if substep.purpose == KickPurpose::Report {
            return intervals;
        }
        for (element, interval) in intervals.iter_mut().enumerate() {
            let nodes = self.mesh.elements[element].nodes();
            if self.is_fixed(nodes[0]) {
                continue;
            }
            let (last, next) = (*interval, substep.element_duration(element));
            *interval = 0.5 * (last + next);
            state.element_interval[element] = next;
            if last != next {
                let (set, i) = self.numbering.of(element);
                let force = self.sets[set].force(i, &state.displacement);
                // Thus a run that starts at rest does not depend on its first kick.
                if force == [[0.0; D]; MAX_NODES] {
                    continue;
                }
                let less = nodes.iter().zip(&force);
                let less = less.map(|(&node, force)| (node, scale(last - next, force)));
                impulses.level_changes.extend(less);
            }
        }
        intervals
    }

    /// Adds the impulses of loads.
    fn add_loads(&self, state: &State<D>, impulses: &mut KickImpulses<D>, substep: &Substep) {
        let at = self.positions(state);
        for load in &self.loads {
            load.forces(
                substep.time,
                |node| at.at(node),
                |node, force| {
                    let n = node as usize;
                    if substep.is_due(node) {
                        add_scaled(&mut impulses.load[n], state.last_kick.interval[n], &force);
                        impulses.loaded.push(node);
                    }
                },
            );
        }
    }

    /// Sets the prescribed components to the velocity with which the drift ends at the prescribed
    /// position. For a report, sets them so that the mean of before and after is the value now.
    fn prescribe(&self, state: &State<D>, velocity: &mut [[f64; D]], substep: &Substep) {
        let at = self.positions(state);
        let acting = |motion: &&PrescribedMotion| motion.acts(substep.step_start);
        for motion in self.boundaries.iter().filter(acting) {
            for &node in motion.nodes.iter().filter(|&&node| substep.is_due(node)) {
                let n = node as usize;
                let mut wanted = velocity[n];
                let position = at.at(node);
                match substep.purpose {
                    KickPurpose::Advance => {
                        let drift = VelocityTime::Drift {
                            start: substep.time,
                            duration: substep.duration(node),
                        };
                        motion.set_velocity(drift, &position, &mut wanted);
                    }
                    KickPurpose::Report => {
                        let now = VelocityTime::Instant(substep.time);
                        motion.set_velocity(now, &position, &mut wanted);
                        for (c, is_prescribed) in motion.components::<D>().into_iter().enumerate() {
                            if is_prescribed {
                                wanted[c] = 2.0 * wanted[c] - state.velocity[n][c];
                            }
                        }
                    }
                }
                self.inertia.set(n, &wanted, velocity);
            }
        }
    }

    /// Returns the forces that act at a time, beside elements and contact.
    pub(crate) fn acting(&self, time: f64) -> ActiveLoads {
        let mut acting = ActiveLoads {
            gravity: self.gravity_at(time).iter().any(|&g| g != 0.0),
            loads: !self.loads.is_empty(),
            mass_damping: false,
            stiffness_damping: false,
            local_damping: false,
        };
        for Damping {
            mass,
            stiffness,
            local,
        } in self.blocks.iter().map(|block| block.damping)
        {
            acting.mass_damping |= mass > 0.0;
            acting.stiffness_damping |= stiffness > 0.0;
            acting.local_damping |= local > 0.0;
        }
        acting
    }

    /// Returns the acceleration of gravity, m/s².
    pub(crate) fn gravity_at(&self, time: f64) -> [f64; D] {
        self.gravity.vector(time)
    }

    /// Books the work of a kick once contact is solved. The impulses of a report do their work at
    /// the velocity before the kick: it belongs to the interval before.
    pub(crate) fn book_kick(
        &self,
        velocities: KickVelocities<D>,
        impulses: &mut KickImpulses<D>,
        substep: &Substep,
        ledger: &mut Ledger,
    ) {
        let mut ledgers = std::mem::take(&mut impulses.ledgers);
        let kick = &*impulses;
        let KickVelocities { last_kick, after } = velocities;
        let before = &*last_kick.velocity_before;
        let end = match substep.purpose {
            KickPurpose::Advance => after,
            KickPurpose::Report => before,
        };
        if kick.acting.anything() {
            let work = ImpulseWork {
                model: self,
                kick,
                last_kick,
                end,
                gravity: self.gravity_at(substep.time),
            };
            let book = |range: &Range<u32>| {
                let mut ledger = Ledger::default();
                for n in range.start as usize..range.end as usize {
                    work.book(n, &mut ledger);
                }
                ledger
            };
            let ranges = substep.ranges();
            let nodes = ranges.iter().map(Range::len).sum::<usize>().max(1);
            // With many levels the node ranges are short.
            let at_once = (ranges.len() * NODES_AT_ONCE / (2 * nodes)).max(1);
            let ranges = ranges.par_iter().with_min_len(at_once);
            ranges.map(book).collect_into_vec(&mut ledgers);
            ledgers.iter().for_each(|part| ledger.add(1.0, part));
        }
        for (_, energy) in kick.made_by_levels(before, after) {
            ledger.remesh_loss -= energy;
        }
        // Reactions of prescribed nodes: the momentum that neither these impulses nor contact give.
        for node in substep.prescribed() {
            let n = node as usize;
            let [old, new] = [before, after].map(|v| self.inertia.momentum(n, v));
            let prescribed = self.inertia.prescribed(n);
            let reaction = std::array::from_fn(|c| {
                let given = kick.total[n][c] + kick.contact[n][c];
                if prescribed[c] {
                    new[c] - old[c] - given
                } else {
                    0.0
                }
            });
            ledger.book(ImpulseAccount::External, &reaction, [&before[n], &end[n]]);
        }
        impulses.ledgers = ledgers;
    }
}

/// The work of the impulses of a kick, except those of elements.
struct ImpulseWork<'a, const D: usize> {
    model: &'a Model<D>,
    kick: &'a KickImpulses<D>,
    last_kick: &'a LastKick<D>,
    /// Velocities whose mean with those before does the work, m/s.
    end: &'a [[f64; D]],
    gravity: [f64; D],
}

impl<const D: usize> ImpulseWork<'_, D> {
    /// Books the impulses on a node.
    fn book(&self, n: usize, ledger: &mut Ledger) {
        let Self {
            model,
            kick,
            last_kick,
            end,
            gravity,
        } = self;
        let velocities = [&last_kick.velocity_before[n], &end[n]];
        if kick.acting.gravity {
            let weight = model.inertia.mass()[n] * last_kick.interval[n];
            ledger.book(ImpulseAccount::Gravity, &scale(weight, gravity), velocities);
        }
        if kick.acting.loads {
            ledger.book(ImpulseAccount::External, &kick.load[n], velocities);
        }
        let damping = model.damping_of(n);
        if damping.mass > 0.0 || damping.local > 0.0 {
            ledger.book(ImpulseAccount::Damping, &kick.damping[n], velocities);
        }
        if damping.stiffness > 0.0 {
            ledger.book(ImpulseAccount::Viscosity, &kick.viscous[n], velocities);
        }
    }
}
