//! Kicks of an island: Jacobi between islands, projected Gauss–Seidel within an island.
//!
//! Each island sees the velocities of the others as they were before this contact kick, after
//! that of elements and loads. Within an island the impulses keep closed pairs together, (11)
//! of the paper, or open, slip or break them, (6) to (10). The solver is
//! [`solver`](crate::contact::solver).

use std::collections::BTreeSet;

use rayon::prelude::*;

use crate::contact::constraint::contact_constraint::{Constraint, shear_norm};
use crate::contact::constraint::contact_point::{ContactHistory, ContactPoint, DriftInterval};
use crate::contact::constraint::context::ContactContext;
use crate::contact::constraint::target_tracking::TargetTracking;
use crate::contact::energy::ContactEnergies;
use crate::contact::island::Island;
use crate::contact::island::touch_events::{ClosureRule, Event, TouchEvents};
use crate::contact::rollback::change;
use crate::contact::solver::Precision;
use crate::contact::surface::kicked::KickedView;
use crate::contact::surface::{Configuration, Pair};
use crate::contact::timing::{DriftProgress, KickSpan};
use crate::contact::tolerances::{
    CONTACTS_PER_TASK, GAP_ERROR, MOST_REPEATED_SOLVES, PAIRS_WORTH_A_SOLVE, RESIDUAL,
};
use crate::math::profile::Stage;

/// A kick of an island.
#[derive(Clone, Copy)]
pub(super) struct Kick<'a, const D: usize> {
    /// Velocities of all nodes before it, m/s.
    pub(super) before: &'a [[f64; D]],
    /// Its time, s.
    pub(super) time: f64,
    pub(super) span: KickSpan,
}

/// Constraints of the closed pairs in a kick, and their results. Its memory is reused.
#[derive(Debug, Default)]
pub(crate) struct KickWorkspace<const D: usize> {
    constraints: Vec<Constraint<D>>,
    /// The number of constraints that are set, from the first on.
    asked: usize,
    precision: Precision,
    /// Sum of the gap errors that the targets have been corrected for, m; and the errors after
    /// the last solve.
    missed: Vec<f64>,
    misses: Vec<f64>,
    /// The number of corrections so far.
    again: usize,
    /// Pairs of the contacts before tracking, sorted; and whether each contact has changed its
    /// pair.
    followed: Vec<Pair>,
    moved: Vec<bool>,
    /// Nodes that the contacts move, sorted, with their velocities before and after, m/s.
    nodes: Vec<u32>,
    start: Vec<[f64; D]>,
    end: Vec<[f64; D]>,
    /// Contacts that have ended, and energies.
    ended: Vec<ContactHistory>,
    energies: ContactEnergies,
}

impl<const D: usize> Clone for KickWorkspace<D> {
    /// Returns an empty workspace: a kick sets all of it anew.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl<const D: usize> KickWorkspace<D> {
    /// Begins the solve of this many contacts, with no constraint set.
    fn begin(&mut self, contacts: usize, precision: Precision) {
        self.precision = precision;
        self.constraints.resize_with(contacts, Constraint::default);
        self.asked = 0;
        self.missed.clear();
        self.again = 0;
        self.start(&[], &[]);
    }

    /// Returns the solved constraints.
    pub(super) fn solved(&self) -> &[Constraint<D>] {
        &self.constraints
    }

    /// Returns the energies of the kick.
    pub(super) fn energies(&self) -> &ContactEnergies {
        &self.energies
    }

    /// Takes the contacts that have ended.
    pub(super) fn ended(&mut self) -> impl Iterator<Item = ContactHistory> + '_ {
        self.ended.drain(..)
    }

    /// Stores the velocities before the kick.
    fn start(&mut self, nodes: &[u32], velocity: &[[f64; D]]) {
        self.nodes.clear();
        self.nodes.extend(nodes);
        self.start.clear();
        let velocities = nodes.iter().map(|&node| velocity[node as usize]);
        self.start.extend(velocities);
    }

    /// Sets the velocities of the nodes back to those before the kick.
    fn undo(&self, motion: &mut KickedView<D>) {
        for (&node, velocity) in self.nodes.iter().zip(&self.start) {
            motion.velocity[node as usize] = *velocity;
        }
    }

    /// Stores the velocities after the kick.
    fn end(&mut self, velocity: &[[f64; D]]) {
        self.end.clear();
        let velocities = self.nodes.iter().map(|&node| velocity[node as usize]);
        self.end.extend(velocities);
    }

    /// Sets the velocities after the kick. Where another island has changed the node, as one
    /// reached by sliding, adds the change instead.
    pub(super) fn redo(&self, velocity: &mut [[f64; D]]) {
        let changes = self.start.iter().zip(&self.end);
        for (&node, (old, new)) in self.nodes.iter().zip(changes) {
            change(&mut velocity[node as usize], [old, new]);
        }
    }
}

impl<const D: usize> Island<D> {
    /// Finds the impulses of a substep that keep closed pairs together, (11), or open them,
    /// (6)–(10). `energies` must be empty. Velocities are not changed:
    /// the results stay in the [workspace](KickWorkspace).
    pub(super) fn kick(
        &mut self,
        context: &ContactContext<D>,
        motion: &mut KickedView<D>,
        kick: Kick<D>,
        energies: ContactEnergies,
    ) {
        let mut hold = std::mem::take(&mut self.workspace.kick);
        hold.energies = energies;
        self.track_contacts(context, motion.positions(), &mut hold);
        let mut touches = std::mem::take(&mut self.workspace.touch_events);
        self.solve_closed(context, motion, kick, &mut hold, &mut touches);
        self.record_impulses(context, motion, kick, &mut hold);
        self.open_released(context, motion, kick, &mut hold);
        let parted = !hold.ended.is_empty();
        touches.reexamine(self, context, motion, kick.span.drift, parted);
        self.workspace.touch_events = touches;
        hold.end(motion.velocity);
        hold.undo(motion);
        hold.energies.watch.lap(Stage::Geometry);
        self.workspace.kick = hold;
    }

    /// Records the solved impulses in the contacts, and books their work. Contacts that slip
    /// become free in the tangent, the others stick.
    fn record_impulses(
        &mut self,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        kick: Kick<D>,
        hold: &mut KickWorkspace<D>,
    ) {
        let (constraints, energies) = (&hold.constraints, &mut hold.energies);
        let KickSpan { interval, drift } = kick.span;
        let least = context.least_speed(drift);
        for (contact, constraint) in self.contact_points.iter_mut().zip(constraints) {
            let jacobian = &constraint.jacobian;
            let [old, new] =
                [kick.before, motion.velocity].map(|v| jacobian.relative_velocities(v));
            energies.book_work(&constraint.impulse, [&old, &new], contact.is_new);
            energies.penetration = energies.penetration.max(contact.depth(jacobian));
            (contact.is_new, contact.normal) = (false, jacobian.frame[0]);
            contact.record_impulse(&constraint.impulse, interval);
            if constraint.slips(motion.velocity, least) {
                contact.slide();
                contact.history.slip += shear_norm(&new) * drift;
            } else if !contact.is_sticking {
                contact.stick();
            }
        }
    }

    /// Ends the contacts without impulse that open in the drift.
    fn open_released(
        &mut self,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        kick: Kick<D>,
        hold: &mut KickWorkspace<D>,
    ) {
        let drift = kick.span.drift;
        let least = context.least_speed(drift);
        let (moves, at) = (&*motion.velocity, motion.positions());
        // An open pair deeper than the contact tolerance would not be found again.
        let is_deep = |pair: Pair| context.surface.project(pair, at).gap < -context.tolerance;
        let mut solved = hold.constraints.iter();
        self.contact_points.retain(|contact| {
            let parts = solved.next().is_some_and(|constraint| {
                constraint.opens(moves, least)
                    && contact.is_apart_after(constraint, moves, drift, context.tolerance)
                    && !is_deep(contact.pair)
            });
            if parts {
                hold.ended.push(contact.history.clone());
            }
            !parts
        });
    }

    /// Moves the feet of sliding contacts. Ends those that have left the surface or have moved
    /// on to the pair of another contact.
    fn track_contacts(
        &mut self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        hold: &mut KickWorkspace<D>,
    ) {
        if self
            .contact_points
            .iter()
            .all(|contact| contact.is_sticking)
        {
            return;
        }
        let KickWorkspace {
            followed: pairs,
            moved,
            ended,
            energies,
            ..
        } = hold;
        pairs.clear();
        pairs.extend(self.contact_points.iter().map(|contact| contact.pair));
        pairs.sort_unstable();
        let taken = |pair: Pair| pairs.binary_search(&pair).is_ok();
        moved.clear();
        self.contact_points.retain_mut(|contact| {
            let before = contact.pair;
            let followed = contact.track_target(context, at, taken);
            energies.overtravel_count += u64::from(followed == TargetTracking::InAHurry);
            let goes_on = followed != TargetTracking::Beyond;
            if goes_on {
                moved.push(contact.pair != before);
            } else {
                ended.push(contact.history.clone());
            }
            goes_on
        });
        if moved.contains(&true) {
            self.merge(moved, ended);
        }
    }

    /// Ends the contacts that have `moved` on to the pair of another contact.
    fn merge(&mut self, moved: &[bool], ended: &mut Vec<ContactHistory>) {
        let stayed = self
            .contact_points
            .iter()
            .zip(moved)
            .filter(|(_, moved)| !**moved);
        let mut known: BTreeSet<Pair> = stayed.map(|(contact, _)| contact.pair).collect();
        let mut moved = moved.iter();
        self.contact_points.retain(|contact| {
            let goes_on = moved.next() == Some(&false) || known.insert(contact.pair);
            if !goes_on {
                ended.push(contact.history.clone());
            }
            goes_on
        });
    }

    /// Solves the closed contacts. Closes open pairs that touch already and still approach: no
    /// impact unless they approached before the kick. Breaks all joints beyond their strength
    /// at once. After either, solves the island again.
    fn solve_closed(
        &mut self,
        context: &ContactContext<D>,
        motion: &mut KickedView<D>,
        kick: Kick<D>,
        hold: &mut KickWorkspace<D>,
        touches: &mut TouchEvents<D>,
    ) {
        let drift = kick.span.drift;
        let precision = Precision {
            residual: RESIDUAL,
            velocity: self.precision(context, motion.positions(), drift),
        };
        hold.begin(self.contact_points.len(), precision);
        let mut before: Option<Vec<[f64; D]>> = None;
        loop {
            if hold.asked < self.contact_points.len() {
                self.set_new_constraints(context, motion, hold, kick.span);
            }
            self.solve_for_gaps(context, motion, hold, drift);
            let least = match &before {
                Some(before) => {
                    let event = Event {
                        before,
                        has_begun: true,
                        now: DriftProgress::start(drift),
                    };
                    touches.update(self, context, motion, &event, ClosureRule::InKick);
                    self.contact_points.len() / PAIRS_WORTH_A_SOLVE
                }
                None => {
                    touches.begin(self, context, motion, drift);
                    0
                }
            };
            let pairs = touches.take_due_now();
            let closes = pairs.len() > least && {
                let begun = self.close_touching(context, motion, &pairs, kick);
                hold.energies.touch_count += begun;
                begun > 0
            };
            if !closes && !self.break_joints(context, motion, hold, kick.span) {
                return;
            }
            before = Some(self.velocities(motion.velocity));
            hold.undo(motion);
        }
    }

    /// Sets the constraints of the contacts that have none yet.
    fn set_new_constraints(
        &mut self,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        hold: &mut KickWorkspace<D>,
        span: KickSpan,
    ) {
        let at = motion.positions();
        let count = self.contact_points.len();
        hold.constraints.resize_with(count, Constraint::default);
        let new = hold.asked..count;
        let pairs = hold.constraints[new.clone()].par_iter_mut();
        let pairs = pairs
            .zip(&self.contact_points[new])
            .with_min_len(CONTACTS_PER_TASK);
        pairs.for_each(|(constraint, contact)| {
            contact.assemble_jacobian(&mut constraint.jacobian, context.surface, at);
            contact.set_constraint(constraint, context, span);
        });
        hold.asked = count;
        hold.missed.resize(count, 0.0);
        let constraints = &hold.constraints;
        hold.energies.time_solution(|| {
            self.workspace
                .solver
                .load(constraints, context.mobility(span.interval))
        });
        hold.start(self.workspace.solver.nodes(), motion.velocity);
    }

    /// Solves the constraints, and again with targets corrected for the gap errors, at most
    /// [`MOST_REPEATED_SOLVES`] times in a kick.
    fn solve_for_gaps(
        &mut self,
        context: &ContactContext<D>,
        motion: &mut KickedView<D>,
        hold: &mut KickWorkspace<D>,
        drift: f64,
    ) {
        if self.contact_points.is_empty() {
            return;
        }
        loop {
            let (system, constraints) = (&mut self.workspace.solver, &mut hold.constraints);
            let (velocity, precision) = (&mut *motion.velocity, hold.precision);
            let solve = || system.solve(constraints, velocity, precision);
            hold.energies.count_solve(solve);
            if hold.again >= MOST_REPEATED_SOLVES {
                return;
            }
            if !self.gap_errors_after_drift(context, motion, drift, hold) {
                return;
            }
            hold.again += 1;
            for (k, miss) in hold.misses.iter().enumerate() {
                hold.missed[k] += miss;
                hold.constraints[k].target[0] -= miss / drift;
            }
            hold.undo(motion);
        }
    }

    /// Closes open pairs that touch already. Returns the number of contacts that have begun.
    fn close_touching(
        &mut self,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        pairs: &[Pair],
        kick: Kick<D>,
    ) -> u64 {
        let remaining = [0.0, kick.span.drift];
        let drift_interval =
            DriftInterval::in_drift(motion.positions(), motion.velocity, remaining);
        self.activate_pairs(context, drift_interval, pairs, kick.time)
    }

    /// Breaks the joints loaded beyond their strength. Then sets all constraints anew. Returns
    /// true if any joint broke.
    fn break_joints(
        &mut self,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        hold: &mut KickWorkspace<D>,
        span: KickSpan,
    ) -> bool {
        let least = context.least_speed(span.drift);
        let mut breaks = false;
        for (contact, constraint) in self.contact_points.iter_mut().zip(&hold.constraints) {
            breaks |= contact.breaks(constraint, motion.velocity, least);
        }
        if breaks {
            let known = self.contact_points.iter().zip(&hold.missed);
            for (constraint, (contact, missed)) in hold.constraints.iter_mut().zip(known) {
                contact.set_constraint(constraint, context, span);
                constraint.target[0] -= missed / span.drift;
            }
        }
        breaks
    }

    /// Computes the gap errors after the drift: of contacts that press, and of those that open
    /// but still penetrate. Returns true if any is above [`GAP_ERROR`].
    fn gap_errors_after_drift(
        &self,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        drift: f64,
        hold: &mut KickWorkspace<D>,
    ) -> bool {
        let (surface, tolerance) = (context.surface, context.tolerance);
        let then = motion.positions().after(motion.velocity, drift);
        let miss = |(contact, constraint): (&ContactPoint<D>, &Constraint<D>)| {
            // Edges that have become parallel have no gap.
            let gap = surface.gap(contact.pair, then, &constraint.jacobian.frame[0]);
            let miss = gap.map_or(0.0, |gap| gap - contact.offset[0]);
            let sinks = || {
                miss < -GAP_ERROR * tolerance
                    && surface.project(contact.pair, then).outside <= tolerance
            };
            if constraint.impulse[0] > 0.0 || sinks() {
                miss
            } else {
                0.0
            }
        };
        let pairs = self.contact_points.par_iter().zip(&hold.constraints);
        let misses = pairs.with_min_len(CONTACTS_PER_TASK).map(miss);
        misses.collect_into_vec(&mut hold.misses);
        let is_far = |miss: &f64| miss.abs() > GAP_ERROR * context.tolerance;
        hold.misses.iter().any(is_far)
    }
}
