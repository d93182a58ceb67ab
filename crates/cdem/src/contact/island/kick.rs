//! Kicks of an island: Jacobi between islands, projected Gauss–Seidel within an island.
//!
//! Each island sees the velocities of the others as they were before this contact kick, after
//! that of elements and loads. Within an island the impulses keep closed pairs together, (11)
//! of the paper, or open, slip or break them, (6) to (10). The solver is
//! [`solver`](crate::contact::solver).

use std::collections::BTreeSet;

use rayon::prelude::*;

use crate::contact::constraint::contact_constraint::{Constraint, shear_norm};
use crate::contact::constraint::contact_point::{
    ContactHistory, ContactPoint, DriftInterval, TargetTracking,
};
use crate::contact::constraint::context::ContactContext;
use crate::contact::energy::ContactEnergies;
use crate::contact::island::Island;
use crate::contact::island::touch_events::{ClosureRule, TouchEvents};
use crate::contact::rollback::change;
use crate::contact::solver::Precision;
use crate::contact::surface::kicked::KickedView;
use crate::contact::surface::{Configuration, Pair};
use crate::contact::tolerances::{
    CONTACTS_PER_TASK, GAP_ERROR, MOST_REPEATED_SOLVES, PAIRS_WORTH_A_SOLVE, RESIDUAL,
};
use crate::math::profile::Stage;

/// Constraints of the closed pairs in a kick, and their results. Its memory is reused.
#[derive(Debug, Default)]
pub(crate) struct KickWorkspace<const D: usize> {
    constraints: Vec<Constraint<D>>,
    /// The number of constraints that are set, from the first on.
    asked: usize,
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
    /// Begins a kick of this many contacts, with no constraint set.
    fn begin(&mut self, contacts: usize) {
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
    /// (6)–(10). `before` are the velocities before the kick of `interval` seconds at `time`; a
    /// drift of `drift` seconds follows. `energies` must be empty. Velocities are not changed:
    /// the results stay in the [workspace](KickWorkspace).
    pub(super) fn kick(
        &mut self,
        context: &ContactContext<D>,
        motion: &mut KickedView<D>,
        before: &[[f64; D]],
        (time, interval, drift): (f64, f64, f64),
        mut energies: ContactEnergies,
    ) {
        let mut hold = std::mem::take(&mut self.kick_workspace);
        let mut ended = std::mem::take(&mut hold.ended);
        let followed = (&mut hold.followed, &mut hold.moved);
        self.track_contacts(
            context,
            motion.positions(),
            followed,
            &mut ended,
            &mut energies,
        );
        let timing = (time, interval, drift);
        let mut touches = std::mem::take(&mut self.touch_events);
        self.solve_closed(
            context,
            motion,
            (&mut hold, &mut touches),
            timing,
            &mut energies,
        );
        let constraints = &hold.constraints;
        let least = context.least_speed(drift);
        for (contact, constraint) in self.contact_points.iter_mut().zip(constraints) {
            let jacobian = &constraint.jacobian;
            let [old, new] = [before, motion.velocity].map(|v| jacobian.relative_velocities(v));
            energies.book_work(&constraint.impulse, &old, &new, contact.is_new);
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
        let (moves, at) = (&*motion.velocity, motion.positions());
        // An open pair deeper than the contact tolerance would not be found again.
        let is_deep = |pair: Pair| context.surface.project(pair, at).gap < -context.tolerance;
        let mut solved = constraints.iter();
        self.contact_points.retain(|contact| {
            let parts = solved.next().is_some_and(|constraint| {
                constraint.opens(moves, least)
                    && contact.is_apart_after(constraint, moves, drift, context.tolerance)
                    && !is_deep(contact.pair)
            });
            if parts {
                ended.push(contact.history.clone());
            }
            !parts
        });
        touches.reexamine(self, context, motion, (drift, !ended.is_empty()));
        self.touch_events = touches;
        hold.end(motion.velocity);
        hold.undo(motion);
        energies.watch.lap(Stage::Geometry);
        (hold.ended, hold.energies) = (ended, energies);
        self.kick_workspace = hold;
    }

    /// Moves the feet of sliding contacts. Ends those that have left the surface or have moved
    /// on to the pair of another contact.
    fn track_contacts(
        &mut self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        (pairs, moved): (&mut Vec<Pair>, &mut Vec<bool>),
        ended: &mut Vec<ContactHistory>,
        energies: &mut ContactEnergies,
    ) {
        if self
            .contact_points
            .iter()
            .all(|contact| contact.is_sticking)
        {
            return;
        }
        pairs.clear();
        pairs.extend(self.contact_points.iter().map(|contact| contact.pair));
        pairs.sort_unstable();
        let taken = |pair: Pair| pairs.binary_search(&pair).is_ok();
        moved.clear();
        self.contact_points.retain_mut(|contact| {
            let before = contact.pair;
            let followed = contact.track_target(context.surface, at, context.tolerance, taken);
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
        (hold, touches): (&mut KickWorkspace<D>, &mut TouchEvents<D>),
        (time, interval, drift): (f64, f64, f64),
        energies: &mut ContactEnergies,
    ) {
        hold.begin(self.contact_points.len());
        let precision = Precision {
            residual: RESIDUAL,
            velocity: self.precision(context, motion.positions(), drift),
        };
        let mut before: Option<Vec<[f64; D]>> = None;
        loop {
            if hold.asked < self.contact_points.len() {
                self.set_new_constraints(context, motion, hold, (interval, drift), energies);
            }
            self.solve_for_gaps(context, motion, hold, (precision, drift), energies);
            let least = match &before {
                Some(before) => {
                    let interval = (ClosureRule::InKick, (0.0, drift));
                    touches.update(self, context, motion, (before, true), interval);
                    self.contact_points.len() / PAIRS_WORTH_A_SOLVE
                }
                None => {
                    touches.begin(self, context, motion, drift);
                    0
                }
            };
            let closes =
                self.close_touching(context, motion, touches, (time, drift, least), energies);
            if !closes && !self.break_joints(context, motion, hold, (interval, drift)) {
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
        (interval, drift): (f64, f64),
        energies: &mut ContactEnergies,
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
            contact.set_constraint(constraint, (drift, interval), context.tolerance);
        });
        hold.asked = count;
        hold.missed.resize(count, 0.0);
        let constraints = &hold.constraints;
        energies.time_solution(|| self.solver.load(constraints, context.mobility(interval)));
        hold.start(self.solver.nodes(), motion.velocity);
    }

    /// Solves the constraints, and again with targets corrected for the gap errors, at most
    /// [`MOST_REPEATED_SOLVES`] times in a kick.
    fn solve_for_gaps(
        &mut self,
        context: &ContactContext<D>,
        motion: &mut KickedView<D>,
        hold: &mut KickWorkspace<D>,
        (precision, drift): (Precision, f64),
        energies: &mut ContactEnergies,
    ) {
        if self.contact_points.is_empty() {
            return;
        }
        loop {
            let (system, constraints) = (&mut self.solver, &mut hold.constraints);
            energies.count_solve(|| system.solve(constraints, motion.velocity, precision));
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

    /// Closes the open pairs that touch already, if they are more than `least`. Returns true if
    /// any contact has begun.
    fn close_touching(
        &mut self,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        touches: &mut TouchEvents<D>,
        (time, drift, least): (f64, f64, usize),
        energies: &mut ContactEnergies,
    ) -> bool {
        let pairs = touches.take_due_now();
        if pairs.len() <= least {
            return false;
        }
        let drift_interval =
            DriftInterval::in_drift(motion.positions(), motion.velocity, [0.0, drift]);
        let begun = self.activate_pairs(context, drift_interval, &pairs, time);
        energies.touch_count += begun;
        begun > 0
    }

    /// Breaks the joints loaded beyond their strength. Then sets all constraints anew. Returns
    /// true if any joint broke.
    fn break_joints(
        &mut self,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        hold: &mut KickWorkspace<D>,
        (interval, drift): (f64, f64),
    ) -> bool {
        let least = context.least_speed(drift);
        let mut breaks = false;
        for (contact, constraint) in self.contact_points.iter_mut().zip(&hold.constraints) {
            breaks |= contact.breaks(constraint, motion.velocity, least);
        }
        if breaks {
            let known = self.contact_points.iter().zip(&hold.missed);
            for (constraint, (contact, missed)) in hold.constraints.iter_mut().zip(known) {
                contact.set_constraint(constraint, (drift, interval), context.tolerance);
                constraint.target[0] -= missed / drift;
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
