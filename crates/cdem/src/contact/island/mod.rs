//! Islands: contacts that share nodes, with their substep in two time stages (sections 3 and 4
//! of the paper).

pub(crate) mod handover;
pub(crate) mod impact;
pub(crate) mod kick;
pub(crate) mod parallel;
pub(crate) mod quick_check;
pub(crate) mod touch_events;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::contact::constraint::contact_constraint::Constraint;
use crate::contact::constraint::contact_history::ContactHistory;
use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::constraint::context::ContactContext;
use crate::contact::constraint::duplicate::DriftInterval;
use crate::contact::constraint::initial_overlap::ordered;
use crate::contact::detection::separation_bounds::SeparationBounds;
use crate::contact::energy::{ContactEnergies, DriftImpulses};
use crate::contact::interior::BodyCoupling;
use crate::contact::island::kick::KickWorkspace;
use crate::contact::island::quick_check::ClosureRule;
use crate::contact::island::touch_events::{Event, TouchEvents};
use crate::contact::rollback::Rollback;
use crate::contact::solver::{Precision, Solver};
use crate::contact::surface::kicked::KickedView;
use crate::contact::surface::{Configuration, Pair};
use crate::contact::timing::{DriftProgress, KickSpan, KickTimes};
use crate::contact::tolerances::{EARLY_GAP, EVENTS, GAP_ROUND_OFF, JOINT_RESIDUAL, RESIDUAL};
use crate::math::vector::pad;
use crate::model::kinematics::NodalMotion;

/// The bodies behind the surfaces of all islands.
pub(crate) struct Bodies<'a, I> {
    pub(crate) coupling: &'a I,
    /// For each node: true if it moves with an island.
    pub(crate) in_island: &'a [bool],
}

/// The bodies behind the surfaces of an island.
pub(crate) struct IslandBodies<'a, const D: usize, I: BodyCoupling<D>> {
    pub(crate) of_all: &'a Bodies<'a, I>,
    /// Data of the touch that is being solved.
    pub(crate) touch: I::Touch,
    /// Log of the nodes that the island moves in its drift.
    pub(crate) rollback: &'a mut Rollback<D>,
    /// Impulses on nodes in that drift.
    pub(crate) received: &'a mut DriftImpulses<D>,
}

/// Contact points and near pairs that share nodes, solved together.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Island<const D: usize> {
    /// Open pairs of this coarse step, with their separation bounds.
    #[serde(skip)]
    pub(crate) separation_bounds: SeparationBounds,
    /// Closed pairs.
    pub(crate) contact_points: Vec<ContactPoint<D>>,
    /// Nodes that move with the island, sorted.
    pub(crate) nodes: Vec<u32>,
    #[serde(skip)]
    pub(super) workspace: IslandWorkspace<D>,
}

/// All of an island that can be rebuilt between two steps, kept to reuse its memory.
#[derive(Clone, Debug, Default)]
pub(super) struct IslandWorkspace<const D: usize> {
    /// Solver of its contacts. Kept while the contacts stay.
    solver: Solver<D>,
    /// First touches of open pairs: valid from a kick to the end of its drift.
    touch_events: TouchEvents<D>,
    /// Constraints and results of a kick.
    kick: KickWorkspace<D>,
}

impl<const D: usize> Island<D> {
    /// Returns an island without pairs and nodes that keeps the solver and memory of this one.
    pub(super) fn restart(self) -> Self {
        Self {
            workspace: self.workspace,
            ..Self::default()
        }
    }

    /// Drops all that can be rebuilt between two steps.
    pub(super) fn drop_workspace(&mut self) {
        self.workspace = IslandWorkspace::default();
    }

    /// Moves the island through the drift of a substep, after its kick: separate up to each
    /// first touch (time stage 1), then as unified nodes (time stage 2).
    pub(crate) fn drift(
        &mut self,
        context: &ContactContext<D>,
        motion: &mut NodalMotion<D>,
        time: f64,
        duration: f64,
        bodies: &mut IslandBodies<D, impl BodyCoupling<D>>,
        energies: &mut ContactEnergies,
    ) {
        let mut touches = std::mem::take(&mut self.workspace.touch_events);
        let mut now = DriftProgress::start(duration);
        for event in 0.. {
            let window = if event + touches.upcoming_count() <= EVENTS {
                0.0
            } else {
                duration / EVENTS as f64
            };
            let close = |instant: f64, pair: Pair| {
                let at = motion.positions();
                let then = at.after(motion.velocity, (instant - now.elapsed).max(0.0));
                let projection = context.surface.project(pair, then.into());
                projection.gap <= EARLY_GAP * context.resolution
                    && projection.outside <= context.resolution
            };
            let Some((instant, pairs)) = touches.take_first(window, close) else {
                break;
            };
            let wait = (instant - now.elapsed).max(0.0);
            self.advance(motion, wait);
            now.elapsed += wait;
            let remaining = [0.0, now.remaining()];
            let drift_interval =
                DriftInterval::in_drift(motion.positions().into(), motion.velocity, remaining);
            let begun = self.activate_pairs(context, drift_interval, &pairs, time + now.elapsed);
            energies.touch_count += begun;
            let before = self.velocities(motion.velocity);
            let event = Event {
                before: &before,
                has_begun: begun > 0,
                now,
            };
            self.solve_impact(context, motion, &event, bodies, energies);
            let motion = &KickedView::new(motion, None);
            touches.update(self, context, motion, &event, ClosureRule::InDrift);
        }
        self.advance(motion, now.remaining());
        self.workspace.touch_events = touches;
    }

    /// Returns the kick interval and the drift of the island, if it is due.
    pub(super) fn kick_span(&self, times: KickTimes) -> Option<KickSpan> {
        times.of(*self.nodes.first()?)
    }

    /// Returns the number of pairs that are closed or will touch in the drift.
    pub(super) fn pair_count(&self) -> usize {
        self.contact_points.len() + self.workspace.touch_events.upcoming_count()
    }

    /// True if no pair will touch in the drift.
    pub(super) fn flies_freely(&self) -> bool {
        self.workspace.touch_events.upcoming_count() == 0
    }

    /// Moves the nodes at their present velocities, those that the separation bounds were
    /// measured with.
    pub(super) fn advance(&mut self, motion: &mut NodalMotion<D>, duration: f64) {
        motion.drift(&self.nodes, duration);
        self.separation_bounds.advance(duration);
    }

    /// Returns the precision of a solve: this residual, or that of joints; and the relative velocity
    /// below which a request is round-off: that of the positions over a drift of `drift` seconds.
    pub(super) fn precision(
        &self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        drift: f64,
        residual: f64,
    ) -> Precision {
        let has_joint = self.contact_points.iter().any(|contact| contact.is_joint);
        let coordinates = self.nodes.iter().flat_map(|&node| at.at(node));
        let size = coordinates.fold(0.0_f64, |size, x| size.max(x.abs()));
        Precision {
            residual: if has_joint {
                residual.min(JOINT_RESIDUAL)
            } else {
                residual
            },
            velocity: context.least_speed(drift).max(GAP_ROUND_OFF * size / drift),
        }
    }

    /// Returns all nodes that constraints may move, each once, with their velocities, m/s.
    /// First come the nodes of the island, then the others, which a contact may reach after
    /// sliding. Both parts are sorted.
    pub(super) fn reached_nodes(
        &self,
        constraints: &[Constraint<D>],
        motion: &NodalMotion<D>,
    ) -> Vec<(u32, [f64; D])> {
        let reached = constraints.iter().flat_map(|c| c.jacobian.nodes()).copied();
        let mut beyond: Vec<u32> = reached.filter(|node| !self.has(*node)).collect();
        beyond.sort_unstable();
        beyond.dedup();
        let nodes = self.nodes.iter().chain(&beyond);
        nodes
            .map(|&node| (node, motion.velocity[node as usize]))
            .collect()
    }

    /// True if a node moves with the island.
    fn has(&self, node: u32) -> bool {
        self.nodes.binary_search(&node).is_ok()
    }

    /// Returns the velocities of its nodes, m/s.
    pub(super) fn velocities(&self, velocity: &[[f64; D]]) -> Vec<[f64; D]> {
        let of = |&node: &u32| velocity[node as usize];
        self.nodes.iter().map(of).collect()
    }

    /// Closes pairs at the instant of their touch, one after the other. Skips a pair that
    /// duplicates a contact point. Returns the number of new contact points, which are the last
    /// ones.
    pub(crate) fn activate_pairs(
        &mut self,
        context: &ContactContext<D>,
        drift_interval: DriftInterval<D>,
        pairs: &[Pair],
        time: f64,
    ) -> u64 {
        let before = self.contact_points.len();
        let mut between = self.between(context, pairs);
        for &pair in pairs {
            let known = between.entry(ordered(context.blocks(pair))).or_default();
            let is_duplicate = |&number: &usize| {
                self.contact_points[number].is_duplicate_of(context, pair, drift_interval)
            };
            if !known.iter().any(is_duplicate) {
                known.push(self.contact_points.len());
                self.activate(context, drift_interval.at_touch, pair, time);
            }
        }
        (self.contact_points.len() - before) as u64
    }

    /// Returns the indices of the contact points between the blocks of some pairs. One pass
    /// serves all pairs, because an island may have very many contact points.
    fn between(
        &self,
        context: &ContactContext<D>,
        pairs: &[Pair],
    ) -> BTreeMap<[u32; 2], Vec<usize>> {
        let blocks = pairs.iter().map(|&pair| ordered(context.blocks(pair)));
        let mut between: BTreeMap<_, Vec<usize>> = blocks.map(|both| (both, vec![])).collect();
        if between.is_empty() {
            return between;
        }
        for (number, contact) in self.contact_points.iter().enumerate() {
            if let Some(known) = between.get_mut(&ordered(contact.history.blocks)) {
                known.push(number);
            }
        }
        between
    }

    /// Begins the contact of a pair that touches.
    fn activate(
        &mut self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        pair: Pair,
        time: f64,
    ) {
        let (surface, blocks) = (context.surface, context.blocks(pair));
        let projection = surface.project(pair, at);
        let (kind, area) = surface.classify(pair, at, context.resolution);
        let foot = projection.clamped_foot();
        let record = ContactHistory {
            kind,
            time_on: time,
            time_off: None,
            position: pad(&surface.point(pair, at)),
            area,
            step_impulse: 0.0,
            step_loss: 0.0,
            peak_normal_force: 0.0,
            normal_impulse: 0.0,
            shear_impulse: 0.0,
            slip: 0.0,
            level: context.halvings_at(pair),
            blocks,
        };
        let jacobian = surface.jacobian(pair, &foot, at);
        self.contact_points.push(ContactPoint {
            pair,
            law: context.laws.between(blocks[0], blocks[1]),
            foot,
            normal: jacobian.frame[0],
            offset: jacobian.offset,
            initial_gap: context
                .initial_overlaps
                .allowed_gap(blocks, jacobian.offset[0]),
            is_sticking: true,
            is_joint: false,
            is_new: true,
            impulse: [0.0; D],
            interval: 0.0,
            force: [0.0; D],
            gap_acceleration: 0.0,
            intended_gap: 0.0,
            shear_spring: [0.0; D],
            history: record,
        });
    }
}

impl<const D: usize> Island<D> {
    /// Returns the nodal moves, m, that take the penetration out of the island.
    pub(crate) fn project_positions(
        &mut self,
        context: &ContactContext<D>,
        at: Configuration<D>,
    ) -> Vec<(u32, [f64; D])> {
        // Uses the solver of velocities, over one second from rest, without shear.
        let mut constraints: Vec<Constraint<D>> = Vec::with_capacity(self.contact_points.len());
        for contact in &mut self.contact_points {
            let mut constraint = Constraint::default();
            contact.assemble_jacobian(&mut constraint.jacobian, context.surface, at);
            constraint.target[0] = contact.penetration();
            contact.offset[0] += constraint.target[0];
            constraints.push(constraint);
        }
        let precision = self.precision(context, at, 1.0, RESIDUAL);
        self.workspace
            .solver
            .load(&constraints, context.mobility(0.0));
        let mut shifts = self
            .workspace
            .solver
            .solve_from_rest(&constraints, precision);
        shifts.retain(|(_, shift)| *shift != [0.0; D]);
        shifts
    }
}
