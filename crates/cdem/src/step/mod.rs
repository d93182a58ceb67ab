//! The step loop (design, sections 3 to 5).
//!
//! A coarse step is a binary tree of substeps. Each substep kicks the nodes that are due (forces),
//! solves the contact points or opens them, and drifts the nodes: freely up to a first touch, and
//! as unified nodes after it.

pub(crate) mod adapt;
pub(crate) mod assembly;
pub(crate) mod checkpoint;
mod contact_impulses;
pub(crate) mod edit;
pub(crate) mod energy_balance;
pub(crate) mod kick;
#[cfg(test)]
mod level_tests;
pub(crate) mod mid_step_impact;
pub(crate) mod nodal_forces;
pub(crate) mod node_ranges;
pub(crate) mod schedule;
pub(crate) mod speed_bounds;
pub(crate) mod steady_forces;
pub(crate) mod synchronise;
pub(crate) mod workspace;
#[cfg(test)]
mod workspace_tests;

use std::collections::BTreeSet;

use crate::contact::Contacts;
use crate::contact::energy::DriftImpulses;
use crate::contact::island::parallel::IslandKicks;
use crate::contact::timing::{DriftStart, KickTimes};
use crate::math::profile::{Stage, Stopwatch};
use crate::math::vector::{add_scaled, cross, dot, pad, scale, sub};
use crate::model::kinematics::{NodalMotion, drift_node};
use crate::model::ledger::{ImpulseAccount, Ledger};
use crate::model::time_levels::{self, Levels};
use crate::model::{Model, State};
use crate::refinement::Adaptivity;
use crate::step::kick::KickVelocities;
use crate::step::mid_step_impact::MidStepImpact;
use crate::step::schedule::{KickSchedule, Substep};
pub(crate) use crate::step::synchronise::Synchronised;
use crate::step::workspace::Workspace;

/// The parts from which a run starts.
pub(crate) struct RunParts<const D: usize> {
    pub(crate) model: Model<D>,
    pub(crate) state: State<D>,
    /// Contact detection and solution, if blocks may touch.
    pub(crate) contacts: Option<Contacts<D>>,
    /// Refinement around impacts, if adaptivity is on.
    pub(crate) adaptivity: Option<Adaptivity<D>>,
}

/// A run in progress: the model; the state, with those of contact and adaptivity; and workspace.
pub(crate) struct Run<const D: usize> {
    pub(crate) model: Model<D>,
    pub(crate) state: State<D>,
    pub(crate) contacts: Option<Contacts<D>>,
    pub(crate) adaptivity: Option<Adaptivity<D>>,
    pub(crate) workspace: Workspace<D>,
    /// Time of all stages except those that contact measures itself.
    pub(crate) watch: Stopwatch,
}

impl<const D: usize> Run<D> {
    /// Builds a run at t = 0.
    pub(crate) fn new(built: RunParts<D>) -> Self {
        let RunParts {
            model,
            state,
            contacts,
            adaptivity,
        } = built;
        let mut run = Self {
            workspace: Workspace::new(&model, &state, contacts.is_some()),
            watch: Stopwatch::default(),
            model,
            state,
            contacts,
            adaptivity,
        };
        run.prepare();
        run.state.ledger = Ledger::default();
        run
    }

    /// Returns the time of the state, s.
    pub(crate) fn time(&self) -> f64 {
        self.state.number as f64 * self.model.step
    }

    /// Sets the free components of all nodes to the velocity of `field` at their rest position,
    /// before the first step.
    pub(crate) fn set_velocities(&mut self, field: &dyn Fn([f64; 3]) -> [f64; 3]) {
        for (node, velocity) in self.state.velocity.iter_mut().enumerate() {
            let prescribed = self.model.inertia.prescribed(node);
            let wanted = field(pad(&self.model.mesh.nodes[node]));
            for c in (0..D).filter(|&c| !prescribed[c]) {
                velocity[c] = wanted[c];
            }
        }
        self.prepare();
        self.state.ledger = Ledger::default();
    }

    /// Advances the run by one coarse step.
    pub(crate) fn step(&mut self) {
        self.watch.skip();
        for &node in &self.workspace.touched_nodes {
            self.state.node_impulse[node as usize] = [0.0; D];
        }
        self.workspace.touched_nodes.clear();
        let mut schedule = std::mem::take(&mut self.workspace.schedule);
        let start = self.time();
        let was_settled = schedule.is_settled;
        if self.state.number == 0 {
            self.collide_initial(&schedule.substep(0, self.model.step, start));
        }
        for number in 0..1_u32 << schedule.finest {
            let substep = schedule.substep(number, self.model.step, start);
            self.substep(&substep);
            schedule.is_settled = true;
        }
        schedule.is_steady = was_settled;
        self.workspace.schedule = schedule;
        self.state.number += 1;
        self.balance_steady_forces();
        if let Some(contacts) = &mut self.contacts {
            if let Some(adaptivity) = &mut self.adaptivity {
                adaptivity.record_losses(contacts.step_losses());
            }
            contacts.end_step();
        }
        // The next step is prepared now, so that a report between two steps sees the state as the
        // next step will.
        self.switch_boundaries();
        self.correct_positions();
        self.watch.lap(Stage::Geometry);
        self.prepare();
    }

    /// Updates the prescribed components if a boundary condition begins or ends now.
    fn switch_boundaries(&mut self) {
        let time = self.time();
        let active = &mut self.workspace.active_boundaries;
        if !self
            .model
            .active_boundaries(time)
            .eq(active.iter().copied())
        {
            *active = self.model.active_boundaries(time).collect();
            self.model.set_prescribed_nodes(time);
            self.workspace.schedule.prescribed_nodes = self.model.prescribed_nodes();
        }
    }

    /// Sections 3 and 4: finds the candidate pairs, refines blocks, assigns the time levels and
    /// groups the pairs into islands.
    pub(crate) fn prepare(&mut self) {
        let join = self.find_contacts();
        if self.workspace.schedule.is_empty() {
            self.assign_levels();
            self.watch.lap(Stage::Plan);
        }
        let before = self.refine();
        self.watch.lap(Stage::Refinement);
        if join || self.workspace.schedule.is_empty() {
            self.assign_levels();
        }
        self.group_contacts();
        self.watch.lap(Stage::Plan);
        if let Some(before) = before {
            self.state.ledger.remesh_loss += before - self.balance();
            self.watch.lap(Stage::Refinement);
        }
    }

    /// Groups the pairs into islands.
    fn group_contacts(&mut self) {
        let Some(contacts) = &mut self.contacts else {
            return;
        };
        let neighbours = self.workspace.neighbours(&self.model.mesh);
        contacts.group(&self.model.inertia, neighbours);
    }

    /// Section 4: finds the candidate pairs. Returns true if the levels must be assigned again.
    fn find_contacts(&mut self) -> bool {
        if self.contacts.is_none() {
            return false;
        }
        self.bound_speeds();
        if !self.workspace.speed_bounds.is_physical() {
            return false;
        }
        let speeds = self.workspace.speed_bounds.speeds();
        let at = self.model.positions(&self.state);
        let number = self.state.number;
        let contacts = self.contacts.as_mut();
        let join = contacts.is_some_and(|contacts| contacts.find(at.into(), speeds, number));
        self.watch.lap(Stage::Search);
        join
    }

    /// Section 5: removes from the positions the penetration that simultaneous impacts have left,
    /// and books the energy of the correction.
    fn correct_positions(&mut self) {
        let time = self.time();
        let Some(contacts) = &mut self.contacts else {
            return;
        };
        let moves = contacts.correct_positions(
            self.model.positions(&self.state).into(),
            &self.model.inertia,
            time,
        );
        if moves.is_empty() {
            return;
        }
        let gravity = self.model.gravity_at(time);
        let of_blocks = moves
            .iter()
            .map(|&(node, _)| self.model.block_of[node as usize] as usize);
        let blocks: BTreeSet<usize> = of_blocks.collect();
        let strain_energies = |run: &Self| -> Vec<f64> {
            let energy = |&block| run.model.strain_energy_of(block, &run.state.displacement);
            blocks.iter().map(energy).collect()
        };
        let before = strain_energies(self);
        for (node, displacement_correction) in &moves {
            let n = *node as usize;
            let weight = scale(self.model.inertia.mass()[n], &gravity);
            let work = dot(&weight, displacement_correction);
            self.state.ledger.gravity_work += work;
            self.state.ledger.correction_loss += work;
            let momentum = self.model.inertia.momentum(n, &self.state.velocity);
            let turn = cross(&pad(displacement_correction), &pad(&momentum));
            add_scaled(&mut self.state.corrections.angular_momentum, 1.0, &turn);
            add_scaled(
                &mut self.state.displacement[n],
                1.0,
                displacement_correction,
            );
        }
        self.state.corrections.count += 1;
        let after = strain_energies(self);
        for (&block, (old, new)) in blocks.iter().zip(before.iter().zip(&after)) {
            self.state.ledger.correction_loss += old - new;
            if let Some(adaptivity) = &mut self.adaptivity {
                adaptivity.add_energy_debt(block, new - old);
            }
        }
    }

    /// Assigns the levels that blocks and contacts require now.
    fn assign_levels(&mut self) {
        let levels = self.levels();
        if levels != self.workspace.schedule.levels || self.workspace.schedule.is_empty() {
            self.end_steady_forces();
            self.workspace.schedule = KickSchedule::new(&mut self.model, &self.state, levels);
            self.begin_steady_forces();
            if let Some(contacts) = &mut self.contacts {
                contacts.ungroup();
            }
        }
    }

    /// Section 3: returns the levels, with one buffer layer that crosses contacts.
    fn levels(&self) -> Levels {
        let (base, elements) = (&self.model.base_level, &self.model.mesh.elements);
        let node_count = self.model.mesh.nodes.len();
        Levels::uniform(base, node_count).unwrap_or_else(|| {
            let joined = self.model.joined_nodes(self.contacts.as_ref());
            time_levels::assign(base, |e| elements[e].nodes(), node_count, &joined)
        })
    }

    /// Solves the impacts of pairs that are closed at t = 0 and approach, before the first kick.
    fn collide_initial(&mut self, first: &Substep) {
        self.store_prescribed_momenta(first);
        let Some(contacts) = &mut self.contacts else {
            return;
        };
        let mut received: Vec<(u32, [f64; D])> = Vec::new();
        let mut motion = self.model.motion(&mut self.state);
        let step = self.model.step;
        contacts.collide_initial(&mut motion, &self.model.inertia, step, &mut received);
        // Contact measures its own time.
        self.watch.skip();
        self.book_reactions(first, &received);
        let touched_nodes = &mut self.workspace.touched_nodes;
        self.state
            .add_impulses(&self.model, &received, touched_nodes);
    }

    /// Runs one substep: kick, contact, ledger, drift.
    fn substep(&mut self, substep: &Substep) {
        let mut velocity = std::mem::take(&mut self.state.velocity);
        self.model.kick(
            &mut self.state,
            &mut velocity,
            &mut self.workspace.impulses,
            substep,
        );
        self.state.velocity = velocity;
        self.watch.lap(Stage::Forces);
        self.kick_contacts(substep);
        let State {
            last_kick,
            velocity,
            ledger,
            ..
        } = &mut self.state;
        let impulses = &mut self.workspace.impulses;
        self.model
            .book_damping(last_kick, velocity, impulses, substep);
        let velocities = KickVelocities {
            last_kick,
            after: velocity,
        };
        self.model.book_kick(velocities, impulses, substep, ledger);
        if let Some(adaptivity) = &mut self.adaptivity {
            for (node, energy) in self
                .workspace
                .impulses
                .made_by_levels(&self.state.last_kick.velocity_before, &self.state.velocity)
            {
                adaptivity.add_energy_debt(self.model.block_of[node as usize] as usize, energy);
            }
        }
        self.workspace.impulses.clear();
        for node in substep.prescribed() {
            self.workspace.impulses.contact[node as usize] = [0.0; D];
        }
        self.drift(substep);
        self.state.element_updates += substep.element_count();
        self.watch.lap(Stage::Motion);
    }

    /// Section 5: applies the contact impulses of a kick, and opens the contact points that
    /// separate.
    fn kick_contacts(&mut self, substep: &Substep) {
        let Some(contacts) = &mut self.contacts else {
            return;
        };
        let state = &mut self.state;
        let mut motion = NodalMotion {
            rest: &self.model.mesh.nodes,
            displacement: &mut state.displacement,
            compensation: &mut state.compensation,
            velocity: &mut state.velocity,
        };
        let kick = IslandKicks {
            before: &state.last_kick.velocity_before,
            times: KickTimes {
                time: substep.time,
                interval: &state.last_kick.interval,
                drift: substep.drifts(),
            },
        };
        let inertia = &self.model.inertia;
        let Workspace {
            received,
            impulses,
            touched_nodes,
            ..
        } = &mut self.workspace;
        received.clear();
        contacts.kick(&mut motion, inertia, &kick, received);
        self.watch.skip();
        for (node, impulse) in &*received {
            if inertia.prescribed(*node as usize).contains(&true) {
                add_scaled(&mut impulses.contact[*node as usize], 1.0, impulse);
            }
        }
        if self.model.acting(substep.time).local_damping {
            state.store_contact_forces(substep, received);
        }
        state.add_impulses(&self.model, received, touched_nodes);
    }

    /// Drifts the nodes: those in islands from touch to touch, the others freely.
    fn drift(&mut self, substep: &Substep) {
        if self.contacts.is_some() {
            self.store_prescribed_momenta(substep);
        }
        let (model, state) = (&mut self.model, &mut self.state);
        let contacts = self.contacts.as_ref();
        let is_free = |node| !contacts.is_some_and(|contacts| contacts.moves_node(node));
        let velocity = &state.velocity;
        let moved = [&mut *state.displacement, &mut state.compensation];
        substep.each_range(moved, &|first, [displacement, compensation]| {
            let range = displacement
                .iter_mut()
                .zip(compensation)
                .zip(&velocity[first..]);
            for (((displacement, compensation), velocity), node) in range.zip(first as u32..) {
                if is_free(node) {
                    drift_node(displacement, compensation, velocity, substep.duration(node));
                }
            }
        });
        let Some(contacts) = &mut self.contacts else {
            return;
        };
        self.watch.lap(Stage::Motion);
        let split = MidStepImpact {
            sets: &model.sets,
            numbering: &model.numbering,
            elements: &model.mesh.elements,
            around: &self.workspace.adjacency,
            inertia: &model.inertia,
            levels: &substep.schedule.levels,
            interval: &state.element_interval,
        };
        let mut motion = NodalMotion {
            rest: &model.mesh.nodes,
            displacement: &mut state.displacement,
            compensation: &mut state.compensation,
            velocity: &mut state.velocity,
        };
        let mut impulses = DriftImpulses::default();
        let start = DriftStart {
            time: substep.time,
            durations: substep.drifts(),
        };
        contacts.drift(&mut motion, &model.inertia, start, &split, &mut impulses);
        self.watch.skip();
        let DriftImpulses {
            of_contacts: received,
            on_prescribed: mut given,
        } = impulses;
        if received.is_empty() {
            return;
        }
        given.extend(&received);
        self.book_reactions(substep, &given);
        let touched_nodes = &mut self.workspace.touched_nodes;
        self.state
            .add_impulses(&self.model, &received, touched_nodes);
    }

    /// Stores the momenta of the prescribed nodes before a drift.
    fn store_prescribed_momenta(&mut self, substep: &Substep) {
        let (inertia, velocity) = (&self.model.inertia, &self.state.velocity);
        let momenta = substep
            .prescribed()
            .map(|n| inertia.momentum(n as usize, velocity));
        self.workspace.prescribed_momenta.clear();
        self.workspace.prescribed_momenta.extend(momenta);
    }

    /// Books the reactions of prescribed nodes in a drift: the change of momentum since
    /// [`Self::store_prescribed_momenta`] that the impulses in `given` do not explain.
    fn book_reactions(&mut self, substep: &Substep, given: &[(u32, [f64; D])]) {
        debug_assert_eq!(
            substep.prescribed().count(),
            self.workspace.prescribed_momenta.len()
        );
        let inertia = &self.model.inertia;
        for (node, impulse) in given {
            add_scaled(
                &mut self.workspace.impulses.contact[*node as usize],
                1.0,
                impulse,
            );
        }
        for (node, old) in substep.prescribed().zip(&self.workspace.prescribed_momenta) {
            let change = sub(&inertia.momentum(node as usize, &self.state.velocity), old);
            let known = self.workspace.impulses.contact[node as usize];
            let prescribed = inertia.prescribed(node as usize);
            let reaction = std::array::from_fn(|c| {
                if prescribed[c] {
                    change[c] - known[c]
                } else {
                    0.0
                }
            });
            let velocity = &self.state.velocity[node as usize];
            self.state
                .ledger
                .book(ImpulseAccount::External, &reaction, [velocity; 2]);
        }
        for (node, _) in given {
            self.workspace.impulses.contact[*node as usize] = [0.0; D];
        }
    }
}
