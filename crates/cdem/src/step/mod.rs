//! The step loop (design, sections 3 to 5).
//!
//! A coarse step is a binary tree of substeps. Each substep kicks the nodes that are due (forces),
//! solves the contact points or opens them, and drifts the nodes: freely up to a first touch, and
//! as unified nodes after it.

pub(crate) mod adapt;
pub(crate) mod assembly;
pub(crate) mod checkpoint;
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
pub(crate) mod synchronise;

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use crate::contact::Contacts;
use crate::contact::energy::ImpulseReceivers;
use crate::contact::prediction::PredictedImpacts;
use crate::math::adjacency::Adjacency;
use crate::math::profile::{Stage, Stopwatch};
use crate::math::vector::{add_scaled, cross, dot, pad, scale, sub};
use crate::mesh::Element;
use crate::model::kinematics::{NodalMotion, drift_node};
use crate::model::ledger::{ImpulseAccount, Ledger};
use crate::model::time_levels::{self, Levels};
use crate::model::{Model, State};
use crate::refinement::Adaptivity;
use crate::step::kick::KickImpulses;
use crate::step::mid_step_impact::MidStepImpact;
use crate::step::schedule::{KickSchedule, Substep};
use crate::step::speed_bounds::SpeedBounds;
pub(crate) use crate::step::synchronise::Synchronised;

/// The parts from which a run starts.
pub(crate) struct RunParts<const D: usize> {
    pub(crate) model: Model<D>,
    pub(crate) state: State<D>,
    /// Contact detection and solution, if blocks may touch.
    pub(crate) contacts: Option<Contacts<D>>,
    /// Refinement around impacts, if adaptivity is on.
    pub(crate) adaptivity: Option<Adaptivity<D>>,
}

/// A run in progress: the model, its state, and workspace that can be rebuilt.
pub(crate) struct Run<const D: usize> {
    pub(crate) model: Model<D>,
    pub(crate) state: State<D>,
    pub(crate) contacts: Option<Contacts<D>>,
    pub(crate) adaptivity: Option<Adaptivity<D>>,
    pub(crate) ledger: Ledger,
    /// Contact impulse of each block since the last query, N·s.
    pub(crate) block_impulse: Vec<[f64; 3]>,
    /// Contact impulse of each node in the last coarse step, N·s.
    pub(crate) node_impulse: Vec<[f64; D]>,
    /// Nodes with a nonzero `node_impulse`.
    touched_nodes: Vec<u32>,
    pub(crate) element_updates: u64,
    pub(crate) corrections: Corrections,
    pub(crate) schedule: KickSchedule,
    impulses: KickImpulses<D>,
    /// Nodal impulses of the contacts in a kick, N·s; kept to reuse its memory.
    received: Vec<(u32, [f64; D])>,
    /// Momenta of the prescribed nodes before the current drift, N·s.
    prescribed_momenta: Vec<[f64; D]>,
    /// Bounds on the speeds in the next coarse step.
    pub(crate) speed_bounds: SpeedBounds,
    /// Predicted impacts between blocks; kept to reuse its memory.
    predicted_impacts: PredictedImpacts<D>,
    /// Elements around each node; empty in a scene without contact.
    adjacency: Adjacency,
    /// For each boundary condition, true if it acts now.
    active_boundaries: Vec<bool>,
    /// Time of all stages except those that contact measures itself.
    pub(crate) watch: Stopwatch,
}

/// Position corrections so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Corrections {
    /// Number of coarse steps that ended with a correction.
    pub count: u64,
    /// Angular momentum added by the corrections, N·m·s.
    pub angular_momentum: [f64; 3],
}

impl Corrections {
    /// Returns a warning for the user, if there has been any correction.
    pub(crate) fn warning(&self) -> Option<String> {
        let [x, y, z] = self.angular_momentum;
        (self.count > 0).then(|| {
            format!(
                "blocks that lay too deep in each other were moved apart at the end of {} steps, \
                 which has added ({x:.1e}, {y:.1e}, {z:.1e}) N·m·s of angular momentum: judge spins \
                 with care, or try a smaller `time.step`",
                self.count
            )
        })
    }
}

impl<const D: usize> Run<D> {
    /// Builds a run at t = 0.
    pub(crate) fn new(built: RunParts<D>) -> Self {
        let RunParts {
            model,
            state,
            contacts,
            adaptivity: second_scale,
        } = built;
        let nodes = model.mesh.nodes.len();
        let around = match &contacts {
            Some(_) => Adjacency::new(model.mesh.elements.iter().map(Element::nodes), nodes),
            None => Adjacency::default(),
        };
        let mut run = Self {
            adjacency: around,
            impulses: KickImpulses::new(nodes),
            received: Vec::new(),
            prescribed_momenta: Vec::new(),
            speed_bounds: SpeedBounds::default(),
            predicted_impacts: PredictedImpacts::default(),
            block_impulse: vec![[0.0; 3]; model.blocks.len()],
            node_impulse: vec![[0.0; D]; nodes],
            touched_nodes: Vec::new(),
            element_updates: 0,
            corrections: Corrections::default(),
            schedule: KickSchedule::default(),
            watch: Stopwatch::default(),
            active_boundaries: model
                .boundaries
                .iter()
                .map(|motion| motion.acts(0.0))
                .collect(),
            ledger: Ledger::default(),
            model,
            state,
            contacts,
            adaptivity: second_scale,
        };
        run.prepare();
        run.ledger = Ledger::default();
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
            let held = self.model.inertia.prescribed(node);
            let wanted = field(pad(&self.model.mesh.nodes[node]));
            for c in (0..D).filter(|&c| !held[c]) {
                velocity[c] = wanted[c];
            }
        }
        self.prepare();
        self.ledger = Ledger::default();
    }

    /// Advances the run by one coarse step.
    pub(crate) fn step(&mut self) {
        self.watch.skip();
        for &node in &self.touched_nodes {
            self.node_impulse[node as usize] = [0.0; D];
        }
        self.touched_nodes.clear();
        let mut plan = std::mem::take(&mut self.schedule);
        let start = self.time();
        let was_settled = plan.is_settled;
        if self.state.number == 0 {
            self.collide_initial(&plan.substep(0, self.model.step, start));
        }
        for number in 0..1_u32 << plan.finest {
            let substep = plan.substep(number, self.model.step, start);
            self.substep(&substep);
            plan.is_settled = true;
        }
        plan.is_steady = was_settled;
        self.schedule = plan;
        self.state.number += 1;
        if let Some(contacts) = &mut self.contacts {
            contacts.end_step(self.model.step);
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
        let prescribed = self.model.boundaries.iter();
        let acts = prescribed.map(|motion| motion.acts(time));
        if !acts.clone().eq(self.active_boundaries.iter().copied()) {
            self.active_boundaries = acts.collect();
            self.model.set_prescribed_nodes(time);
            self.schedule.prescribed_nodes = self.model.prescribed_nodes();
        }
    }

    /// Sections 3 and 4: finds the candidate pairs, refines blocks, assigns the time levels and
    /// groups the pairs into islands.
    pub(crate) fn prepare(&mut self) {
        let join = self.find_contacts();
        if self.schedule.is_empty() {
            self.assign_levels();
            self.watch.lap(Stage::Plan);
        }
        let before = self.refine();
        self.watch.lap(Stage::Refinement);
        if join || self.schedule.is_empty() {
            self.assign_levels();
        }
        self.group_contacts();
        self.watch.lap(Stage::Plan);
        if let Some(before) = before {
            self.ledger.remesh_loss += before - self.balance();
            self.watch.lap(Stage::Refinement);
        }
    }

    fn group_contacts(&mut self) {
        let Some(contacts) = &mut self.contacts else {
            return;
        };
        let (levels, around) = (&self.schedule.levels.node, &self.adjacency);
        let elements = &self.model.mesh.elements;
        contacts.group(&self.model.inertia, &|node, visit| {
            let nodes = around.of(node).iter();
            let nodes = nodes.flat_map(|&e| elements[e as usize].nodes());
            let same = |other: &&u32| levels[**other as usize] == levels[node as usize];
            nodes.filter(same).for_each(|&other| visit(other));
        });
    }

    /// Section 4: finds the candidate pairs. Returns true if the levels must be assigned again.
    fn find_contacts(&mut self) -> bool {
        if self.contacts.is_none() {
            return false;
        }
        self.bound_speeds();
        if !self.speed_bounds.is_physical() {
            return false;
        }
        let speeds = self.speed_bounds.speeds();
        let at = self.model.positions(&self.state);
        let instant = (self.model.step, self.state.number);
        let contacts = self.contacts.as_mut();
        let join = contacts.is_some_and(|contacts| contacts.find(at.into(), speeds, instant));
        self.watch.lap(Stage::Search);
        join
    }

    /// Section 5: removes from the positions the penetration that simultaneous impacts have left,
    /// and books the energy of the correction.
    fn correct_positions(&mut self) {
        let Some(contacts) = &mut self.contacts else {
            return;
        };
        let moves = contacts.correct_positions(
            self.model.positions(&self.state).into(),
            &self.model.inertia,
        );
        if moves.is_empty() {
            return;
        }
        let gravity = self.model.gravity_at(self.time());
        let of_blocks = moves
            .iter()
            .map(|&(node, _)| self.model.block_of[node as usize] as usize);
        let blocks: BTreeSet<usize> = of_blocks.collect();
        let strain_energies = |run: &Self| -> Vec<f64> {
            let energy = |&block| run.model.strain_energy_of(block, &run.state.displacement);
            blocks.iter().map(energy).collect()
        };
        let before = strain_energies(self);
        for (node, shift) in &moves {
            let n = *node as usize;
            let weight = scale(self.model.inertia.mass()[n], &gravity);
            let work = dot(&weight, shift);
            self.ledger.gravity_work += work;
            self.ledger.correction_loss += work;
            let momentum = self.model.inertia.momentum(n, &self.state.velocity);
            let turn = cross(&pad(shift), &pad(&momentum));
            add_scaled(&mut self.corrections.angular_momentum, 1.0, &turn);
            add_scaled(&mut self.state.displacement[n], 1.0, shift);
        }
        self.corrections.count += 1;
        let after = strain_energies(self);
        for (&block, (old, new)) in blocks.iter().zip(before.iter().zip(&after)) {
            self.ledger.correction_loss += old - new;
            if let Some(second) = &mut self.adaptivity {
                second.add_energy_debt(block, new - old);
            }
        }
    }

    /// Assigns the levels that blocks and contacts require now.
    fn assign_levels(&mut self) {
        let levels = self.levels();
        if levels != self.schedule.levels || self.schedule.is_empty() {
            self.schedule = KickSchedule::new(&mut self.model, &self.state, levels);
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
        self.note_prescribed(first);
        let Some(contacts) = &mut self.contacts else {
            return;
        };
        let mut received: Vec<(u32, [f64; D])> = Vec::new();
        let mut motion = self.model.motion(&mut self.state);
        let receive = &mut |node, impulse: &[f64; D]| received.push((node, *impulse));
        contacts.collide_initial(&mut motion, &self.model.inertia, self.model.step, receive);
        // Contact measures its own time.
        self.watch.skip();
        self.book_reactions(first, &received);
        self.receive(&received);
    }

    fn substep(&mut self, substep: &Substep) {
        let mut velocity = std::mem::take(&mut self.state.velocity);
        self.model
            .kick(&mut self.state, &mut velocity, &mut self.impulses, substep);
        self.state.velocity = velocity;
        self.watch.lap(Stage::Forces);
        self.kick_contacts(substep);
        let velocity = &self.state.velocity;
        self.model
            .book_damping(velocity, &mut self.impulses, substep);
        let ledger = &mut self.ledger;
        let impulses = &mut self.impulses;
        self.model.book_kick(velocity, impulses, substep, ledger);
        if let Some(second) = &mut self.adaptivity {
            for (node, energy) in self.impulses.made_by_levels(&self.state.velocity) {
                second.add_energy_debt(self.model.block_of[node as usize] as usize, energy);
            }
        }
        self.impulses.clear();
        for node in substep.prescribed() {
            self.impulses.contact[node as usize] = [0.0; D];
        }
        self.drift(substep);
        self.element_updates += substep.element_count();
        self.watch.lap(Stage::Motion);
    }

    /// Section 5: applies the contact impulses of a kick, and opens the contact points that
    /// separate.
    fn kick_contacts(&mut self, substep: &Substep) {
        let Some(contacts) = &mut self.contacts else {
            return;
        };
        let mut received = std::mem::take(&mut self.received);
        received.clear();
        let mut motion = self.model.motion(&mut self.state);
        let interval = &self.impulses.interval;
        contacts.kick(
            &mut motion,
            &self.model.inertia,
            &self.impulses.before,
            substep.time,
            &|node| {
                let timing = || (interval[node as usize], substep.duration(node));
                substep.is_due(node).then(timing)
            },
            &mut |node, impulse: &[f64; D]| received.push((node, *impulse)),
        );
        self.watch.skip();
        for (node, impulse) in &received {
            if self
                .model
                .inertia
                .prescribed(*node as usize)
                .contains(&true)
            {
                let contact = &mut self.impulses.contact[*node as usize];
                add_scaled(contact, 1.0, impulse);
            }
        }
        if self.model.acting(substep.time).local_damping {
            self.store_contact_forces(substep, &received);
        }
        self.receive(&received);
        self.received = received;
    }

    /// Stores the contact forces of a kick for local damping in the next kick.
    fn store_contact_forces(&mut self, substep: &Substep, received: &[(u32, [f64; D])]) {
        let forces = [&mut *self.state.contact_force];
        substep.each_node(forces, &|_, [force]| *force = [0.0; D]);
        for (node, impulse) in received {
            let interval = self.impulses.interval[*node as usize];
            if interval > 0.0 {
                let force = &mut self.state.contact_force[*node as usize];
                add_scaled(force, 1.0 / interval, impulse);
            }
        }
    }

    /// Drifts the nodes: those in islands from touch to touch, the others freely.
    fn drift(&mut self, substep: &Substep) {
        if self.contacts.is_some() {
            self.note_prescribed(substep);
        }
        let mut received = Vec::new();
        let (model, state) = (&mut self.model, &mut self.state);
        let contacts = self.contacts.as_ref();
        let is_free = |node| !contacts.is_some_and(|contacts| contacts.moves_node(node));
        let velocity = &state.velocity;
        let moved = [&mut *state.displacement, &mut state.compensation];
        substep.each_row(moved, &|first, [displacement, carry]| {
            let row = displacement.iter_mut().zip(carry).zip(&velocity[first..]);
            for (((displacement, carry), velocity), node) in row.zip(first as u32..) {
                if is_free(node) {
                    drift_node(displacement, carry, velocity, substep.duration(node));
                }
            }
        });
        let Some(contacts) = &mut self.contacts else {
            return;
        };
        self.watch.lap(Stage::Motion);
        let split = MidStepImpact {
            sets: &model.sets,
            place: &model.numbering,
            elements: &model.mesh.elements,
            around: &self.adjacency,
            inertia: &model.inertia,
            levels: &substep.plan.levels,
            interval: &state.element_interval,
        };
        let mut motion = NodalMotion {
            rest: &model.mesh.nodes,
            displacement: &mut state.displacement,
            compensation: &mut state.compensation,
            velocity: &mut state.velocity,
        };
        let mut given = Vec::new();
        let duration = |node| substep.is_due(node).then(|| substep.duration(node));
        contacts.drift(
            &mut motion,
            &model.inertia,
            (substep.time, &duration),
            &split,
            &mut ImpulseReceivers {
                of_contacts: &mut |node, impulse| received.push((node, *impulse)),
                on_prescribed: &mut |node, impulse| given.push((node, *impulse)),
            },
        );
        self.watch.skip();
        if received.is_empty() {
            return;
        }
        given.extend(&received);
        self.book_reactions(substep, &given);
        self.receive(&received);
    }

    /// Stores the momenta of the prescribed nodes before a drift.
    fn note_prescribed(&mut self, substep: &Substep) {
        let (inertia, velocity) = (&self.model.inertia, &self.state.velocity);
        let momenta = substep
            .prescribed()
            .map(|n| inertia.momentum(n as usize, velocity));
        self.prescribed_momenta.clear();
        self.prescribed_momenta.extend(momenta);
    }

    /// Books the reactions of prescribed nodes in a drift: the change of momentum since
    /// [`Self::note_prescribed`] that the impulses in `given` do not explain.
    fn book_reactions(&mut self, substep: &Substep, given: &[(u32, [f64; D])]) {
        debug_assert_eq!(substep.prescribed().count(), self.prescribed_momenta.len());
        let inertia = &self.model.inertia;
        for (node, impulse) in given {
            add_scaled(&mut self.impulses.contact[*node as usize], 1.0, impulse);
        }
        for (node, old) in substep.prescribed().zip(&self.prescribed_momenta) {
            let change = sub(&inertia.momentum(node as usize, &self.state.velocity), old);
            let known = self.impulses.contact[node as usize];
            let held = inertia.prescribed(node as usize);
            let reaction =
                std::array::from_fn(|c| if held[c] { change[c] - known[c] } else { 0.0 });
            let velocity = &self.state.velocity[node as usize];
            self.ledger
                .book(ImpulseAccount::External, &reaction, [velocity; 2]);
        }
        for (node, _) in given {
            self.impulses.contact[*node as usize] = [0.0; D];
        }
    }

    /// Adds contact impulses to the sums of nodes and blocks; those on fixed blocks go to the
    /// ledger.
    fn receive(&mut self, received: &[(u32, [f64; D])]) {
        for (node, impulse) in received {
            let block = self.model.block_of[*node as usize] as usize;
            let padded = pad(impulse);
            add_scaled(&mut self.block_impulse[block], 1.0, &padded);
            if self.model.blocks[block].fixed {
                self.ledger.impulse.add_scaled(-1.0, &padded);
            }
            let sum = &mut self.node_impulse[*node as usize];
            add_scaled(sum, 1.0, impulse);
            self.touched_nodes.push(*node);
        }
    }
}
