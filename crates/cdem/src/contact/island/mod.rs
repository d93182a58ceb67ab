//! Contacts that share nodes: their substep in two time stages (the paper's
//! sections 3 and 4).

pub(crate) mod impact;
pub(crate) mod kick;
pub(crate) mod parallel;
pub(crate) mod touch_events;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::contact::constraint::contact_constraint::Constraint;
use crate::contact::constraint::contact_point::{ContactHistory, ContactPoint, DriftInterval};
use crate::contact::constraint::context::ContactContext;
use crate::contact::constraint::initial_overlap::ordered;
use crate::contact::detection::separation_bounds::SeparationBounds;
use crate::contact::energy::{ContactEnergies, ImpulseReceivers};
use crate::contact::interior::{BodyCoupling, KickTiming};
use crate::contact::island::kick::KickWorkspace;
use crate::contact::island::touch_events::{ClosureRule, TouchEvents};
use crate::contact::rollback::Rollback;
use crate::contact::solver::Solver;
use crate::contact::surface::kicked::KickedView;
use crate::contact::surface::{Configuration, Pair};
use crate::contact::tolerances::{EARLY, EVENTS, GAP_ROUND_OFF, SIMULTANEOUS};
use crate::math::vector::pad;
use crate::model::kinematics::NodalMotion;

/// The bodies of an island, and whether a node moves with any island.
pub(crate) struct IslandBodies<'a, const D: usize, I: BodyCoupling<D>> {
    pub(crate) coupling: &'a I,
    /// The touch in hand.
    pub(crate) touch: I::Touch,
    pub(crate) in_island: &'a [bool],
    /// What the island moves in its drift.
    pub(crate) rollback: &'a mut Rollback<D>,
}

/// Live and possible contacts that share nodes, solved together.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Island<const D: usize> {
    /// Open pairs that may touch in this coarse step.
    #[serde(skip)]
    pub(crate) separation_bounds: SeparationBounds,
    /// Closed ones.
    pub(crate) contact_points: Vec<ContactPoint<D>>,
    /// Nodes that move with the island, sorted.
    pub(crate) nodes: Vec<u32>,
    /// What its contacts do to each other: kept while they stay, and for its storage.
    #[serde(skip)]
    pub(super) solver: Solver<D>,
    /// When open pairs touch: known from a kick on, through its drift; storage until the next.
    #[serde(skip)]
    pub(super) touch_events: TouchEvents<D>,
    /// What its contacts bear in a kick.
    #[serde(skip)]
    pub(super) kick_workspace: KickWorkspace<D>,
}

impl<const D: usize> Island<D> {
    /// One without pairs and nodes, which keeps what may serve it if they come back.
    pub(super) fn restart(self) -> Self {
        Self {
            solver: self.solver,
            touch_events: self.touch_events,
            kick_workspace: self.kick_workspace,
            ..Self::default()
        }
    }

    /// The drift of a substep after its kick: free flight to each first touch (time
    /// stage 1), then unified (time stage 2).
    pub(crate) fn drift(
        &mut self,
        context: &ContactContext<D>,
        motion: &mut NodalMotion<D>,
        (time, duration): (f64, f64),
        bodies: &mut IslandBodies<D, impl BodyCoupling<D>>,
        receivers: &mut ImpulseReceivers<D>,
        energies: &mut ContactEnergies,
    ) {
        let mut touches = std::mem::take(&mut self.touch_events);
        let mut elapsed = 0.0;
        for event in 0.. {
            let window = if event + touches.upcoming_count() <= EVENTS {
                SIMULTANEOUS * (duration - elapsed)
            } else {
                duration / EVENTS as f64
            };
            let close = |instant: f64, pair: Pair| {
                let at = motion.positions();
                let then = at.after(motion.velocity, (instant - elapsed).max(0.0));
                let projection = context.surface.project(pair, then.into());
                projection.gap <= EARLY * context.tolerance
                    && projection.outside <= context.tolerance
            };
            let Some((instant, pairs)) = touches.take_first(window, close) else {
                break;
            };
            let wait = (instant - elapsed).max(0.0);
            self.advance(motion, wait);
            elapsed += wait;
            let remaining = [0.0, duration - elapsed];
            let drift_interval =
                DriftInterval::in_drift(motion.positions().into(), motion.velocity, remaining);
            let begun = self.activate_pairs(context, drift_interval, &pairs, time + elapsed);
            energies.touch_count += begun;
            let before = self.velocities(motion.velocity);
            let drift = (duration, duration - elapsed);
            self.solve_impact(
                context,
                motion,
                (&before, drift),
                bodies,
                receivers,
                energies,
            );
            touches.update(
                self,
                context,
                &KickedView::new(motion, None),
                (&before, begun > 0),
                (ClosureRule::InDrift, (elapsed, duration)),
            );
        }
        self.advance(motion, duration - elapsed);
        self.touch_events = touches;
    }

    /// Kick interval and drift of its nodes, s, if they are due.
    pub(super) fn timing(&self, timing: KickTiming) -> Option<(f64, f64)> {
        timing(*self.nodes.first()?)
    }

    /// How many pairs are closed, or known to touch in the drift.
    pub(super) fn pair_count(&self) -> usize {
        self.contact_points.len() + self.touch_events.upcoming_count()
    }

    /// Whether no pair is known to touch in the drift.
    pub(super) fn flies_freely(&self) -> bool {
        self.touch_events.upcoming_count() == 0
    }

    /// Moves the island at the velocities that the pairs near were looked at with.
    pub(super) fn advance(&mut self, motion: &mut NodalMotion<D>, duration: f64) {
        motion.drift(&self.nodes, duration);
        self.separation_bounds.advance(duration);
    }

    /// Relative velocity below which contacts ask for what positions cannot say,
    /// m/s: their round-off over a drift of `drift` seconds.
    pub(super) fn precision(
        &self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        drift: f64,
    ) -> f64 {
        let coordinates = self.nodes.iter().flat_map(|&node| at.at(node));
        let size = coordinates.fold(0.0_f64, |size, x| size.max(x.abs()));
        context.least_speed(drift).max(GAP_ROUND_OFF * size / drift)
    }

    /// All nodes that constraints may move, once each, and their velocities, m/s:
    /// those of the island, then those beyond, which a contact that has slid on may
    /// reach; both sorted.
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

    /// Whether a node moves with the island.
    fn has(&self, node: u32) -> bool {
        self.nodes.binary_search(&node).is_ok()
    }

    /// Velocities of the nodes, m/s.
    pub(super) fn velocities(&self, velocity: &[[f64; D]]) -> Vec<[f64; D]> {
        let of = |&node: &u32| velocity[node as usize];
        self.nodes.iter().map(of).collect()
    }

    /// Closes pairs at the moment of their touch, one after the other, each unless another one
    /// already says the same. Returns how many contacts have begun: they are the last ones.
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
            let says = |&number: &usize| {
                self.contact_points[number].is_duplicate_of(context, pair, drift_interval)
            };
            if !known.iter().any(says) {
                known.push(self.contact_points.len());
                self.activate(context, drift_interval.at_touch, pair, time);
            }
        }
        (self.contact_points.len() - before) as u64
    }

    /// The contacts between the blocks of some pairs: found for all of them together, as an
    /// island may have very many.
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

    /// Begins a contact of a pair that touches.
    fn activate(
        &mut self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        pair: Pair,
        time: f64,
    ) {
        let (surface, blocks) = (context.surface, context.blocks(pair));
        let projection = surface.project(pair, at);
        let (kind, area) = surface.classify(pair, at, context.tolerance);
        let foot = projection.foot.map(|w| w.clamp(0.0, 1.0));
        let record = ContactHistory {
            kind,
            time_on: time,
            time_off: None,
            position: pad(&surface.point(pair, at)),
            area,
            step_impulse: 0.0,
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
            force_before: [0.0; D],
            shear_spring: [0.0; D],
            history: record,
        });
    }
}

impl<const D: usize> Island<D> {
    /// Moves that take the penetration out of the island, m.
    pub(crate) fn project_positions(
        &mut self,
        context: &ContactContext<D>,
        at: Configuration<D>,
    ) -> Vec<(u32, [f64; D])> {
        // The solver of velocities, over one second from rest, without shear.
        let mut constraints: Vec<Constraint<D>> = Vec::with_capacity(self.contact_points.len());
        for contact in &mut self.contact_points {
            let mut constraint = Constraint::default();
            contact.assemble_jacobian(&mut constraint.jacobian, context.surface, at);
            constraint.target[0] = contact.penetration();
            contact.offset[0] += constraint.target[0];
            constraints.push(constraint);
        }
        let precision = self.precision(context, at, 1.0);
        self.solver.load(&constraints, context.mobility(0.0));
        let mut shifts = self.solver.solve_from_rest(&constraints, precision);
        shifts.retain(|(_, shift)| *shift != [0.0; D]);
        shifts
    }
}
