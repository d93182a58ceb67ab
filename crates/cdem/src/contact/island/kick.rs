//! Kicks of an island: Jacobi between islands, projected Gauss–Seidel within an island.
//!
//! Each island sees the velocities of the others as they were before this contact kick, after
//! that of elements and loads. Within an island the impulses keep closed pairs together, (11)
//! of the paper, or open, slip or break them, (6) to (10). The solver is
//! [`solver`](crate::contact::solver).

use std::collections::BTreeSet;

use rayon::prelude::*;

use crate::contact::constraint::contact_constraint::{Constraint, shear_norm};
use crate::contact::constraint::contact_history::ContactHistory;
use crate::contact::constraint::context::ContactContext;
use crate::contact::constraint::duplicate::DriftInterval;
use crate::contact::constraint::quadratic_change::{ContactPairs, GapChanges, GapDrift};
use crate::contact::constraint::target_tracking::Tracking;
use crate::contact::energy::ContactEnergies;
use crate::contact::island::Island;
use crate::contact::island::handover::Departure;
use crate::contact::island::quick_check::ClosureRule;
use crate::contact::island::touch_events::{Event, TouchEvents};
use crate::contact::rollback::change;
use crate::contact::solver::Precision;
use crate::contact::surface::kicked::KickedView;
use crate::contact::surface::{Configuration, Pair};
use crate::contact::timing::{DriftProgress, KickSpan};
use crate::contact::tolerances::{
    CONTACTS_PER_TASK, GAP_DEAD_BAND, GAP_ERROR, KICK_RESIDUAL, PAIRS_WORTH_A_SOLVE,
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
    constraint_count: usize,
    precision: Precision,
    /// Quadratic changes of the gaps in the drift.
    gap_changes: GapChanges,
    /// Pairs of the contacts. For each contact: true if tracking has changed its pair.
    pairs: ContactPairs,
    changed_pair: Vec<bool>,
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
        self.constraint_count = 0;
        self.gap_changes.begin();
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
        let mut workspace = std::mem::take(&mut self.workspace.kick);
        workspace.energies = energies;
        self.track_contacts(context, motion.positions(), kick.time, &mut workspace);
        let mut touches = std::mem::take(&mut self.workspace.touch_events);
        self.solve_closed(context, motion, kick, &mut workspace, &mut touches);
        self.record_impulses(context, motion, kick, &mut workspace);
        self.open_released(context, motion, kick, &mut workspace);
        let has_released = !workspace.ended.is_empty();
        touches.reexamine(self, context, motion, kick.span.drift, has_released);
        self.workspace.touch_events = touches;
        workspace.end(motion.velocity);
        workspace.undo(motion);
        workspace.energies.watch.lap(Stage::Geometry);
        self.workspace.kick = workspace;
    }

    /// Records the solved impulses in the contacts, and books their work. Contacts that slip
    /// become free in the tangent, the others stick.
    fn record_impulses(
        &mut self,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        kick: Kick<D>,
        workspace: &mut KickWorkspace<D>,
    ) {
        let (constraints, energies) = (&workspace.constraints, &mut workspace.energies);
        let KickSpan { interval, drift } = kick.span;
        let least = context.least_speed(drift);
        let changes = &workspace.gap_changes;
        let solved = constraints
            .iter()
            .zip(changes.allowed.iter().zip(&changes.found));
        for (contact, (constraint, (allowed, found))) in self.contact_points.iter_mut().zip(solved)
        {
            let jacobian = &constraint.jacobian;
            contact.record_quadratic_change(*found, drift);
            contact.intended_gap = jacobian.offset[0] + drift * constraint.target[0] + allowed;
            let [old, new] =
                [kick.before, motion.velocity].map(|v| jacobian.relative_velocities(v));
            contact.history.step_loss +=
                energies.book_work(&constraint.impulse, [&old, &new], contact.is_new);
            energies
                .penetration
                .include(contact.penetration_at(jacobian, kick.time));
            (contact.is_new, contact.normal) = (false, jacobian.frame[0]);
            contact.record_impulse(&constraint.impulse, interval);
            if constraint.slips(motion.velocity, least) {
                contact.slide();
                // An open contact does not slip.
                let slip = if constraint.impulse[0] > 0.0 {
                    shear_norm(&new) * drift
                } else {
                    0.0
                };
                contact.history.slip += slip;
                let size = context
                    .surface
                    .target_size(contact.pair.target, motion.positions());
                energies.overtravel_count += u64::from(slip > size);
            } else if !contact.is_sticking {
                contact.stick();
            } else if contact.has_crept(jacobian, context.resolution) {
                contact.follow_creep(context.surface, motion.positions(), jacobian);
            }
        }
    }

    /// Ends the contacts without impulse that open in the drift.
    fn open_released(
        &mut self,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        kick: Kick<D>,
        workspace: &mut KickWorkspace<D>,
    ) {
        let drift = kick.span.drift;
        let least = context.least_speed(drift);
        let (moves, at) = (&*motion.velocity, motion.positions());
        // An open pair deeper than the contact resolution would not be found again.
        let is_deep = |pair: Pair| context.surface.gap_or_zero(pair, at) < -context.resolution;
        let mut solved = workspace
            .constraints
            .iter()
            .zip(&workspace.gap_changes.found);
        self.contact_points.retain(|contact| {
            let is_released = solved.next().is_some_and(|(constraint, change)| {
                let change = change.unwrap_or_default();
                constraint.opens(moves, least)
                    && contact.is_apart_after(constraint, moves, drift, change, context.resolution)
                    && !is_deep(contact.pair)
            });
            if is_released {
                workspace.ended.push(contact.history.clone());
            }
            !is_released
        });
    }

    /// Moves the feet of sliding contacts. Ends those that have left the surface or have moved
    /// on to the pair of another contact. [Hands over](crate::contact::island::handover) the gaps of
    /// those that have left.
    fn track_contacts(
        &mut self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        time: f64,
        workspace: &mut KickWorkspace<D>,
    ) {
        if self
            .contact_points
            .iter()
            .all(|contact| contact.is_sticking)
        {
            return;
        }
        workspace.pairs.list(&self.contact_points);
        let KickWorkspace {
            pairs,
            changed_pair,
            ended,
            ..
        } = workspace;
        let taken = |pair: Pair| pairs.contains(pair);
        let mut departures = Vec::new();
        changed_pair.clear();
        self.contact_points.retain_mut(|contact| {
            let before = contact.pair;
            let tracking = contact.track_target(context, at, taken);
            let continues = matches!(tracking, Tracking::Goes);
            if continues {
                changed_pair.push(contact.pair != before);
            } else {
                ended.push(contact.history.clone());
            }
            if let Tracking::HasLeft(last) = tracking {
                departures.extend(Departure::of(contact, last, context));
            }
            continues
        });
        if changed_pair.contains(&true) {
            self.merge(changed_pair, ended);
        }
        workspace.energies.touch_count += self.hand_over(context, at, &departures, time);
    }

    /// Ends the contacts that have moved on to the pair of another contact. `changed_pair` is true
    /// for each contact that has changed its pair.
    fn merge(&mut self, changed_pair: &[bool], ended: &mut Vec<ContactHistory>) {
        let stayed = self
            .contact_points
            .iter()
            .zip(changed_pair)
            .filter(|(_, changed_pair)| !**changed_pair);
        let mut known: BTreeSet<Pair> = stayed.map(|(contact, _)| contact.pair).collect();
        let mut changed_pair = changed_pair.iter();
        self.contact_points.retain(|contact| {
            let continues = changed_pair.next() == Some(&false) || known.insert(contact.pair);
            if !continues {
                ended.push(contact.history.clone());
            }
            continues
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
        workspace: &mut KickWorkspace<D>,
        touches: &mut TouchEvents<D>,
    ) {
        let drift = kick.span.drift;
        let precision = self.precision(context, motion.positions(), drift, KICK_RESIDUAL);
        workspace.begin(self.contact_points.len(), precision);
        let mut before: Option<Vec<[f64; D]>> = None;
        loop {
            if workspace.constraint_count < self.contact_points.len() {
                self.set_new_constraints(context, motion, workspace, kick.span);
            }
            self.solve_for_gaps(context, motion, workspace, drift);
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
                workspace.energies.touch_count += begun;
                begun > 0
            };
            if !closes && !self.break_joints(context, motion, workspace, kick.span) {
                return;
            }
            before = Some(self.velocities(motion.velocity));
            workspace.undo(motion);
        }
    }

    /// Sets the constraints of the contacts that have none yet.
    fn set_new_constraints(
        &mut self,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        workspace: &mut KickWorkspace<D>,
        span: KickSpan,
    ) {
        let at = motion.positions();
        let count = self.contact_points.len();
        workspace
            .constraints
            .resize_with(count, Constraint::default);
        let new = workspace.constraint_count..count;
        let pairs = workspace.constraints[new.clone()].par_iter_mut();
        let pairs = pairs
            .zip(&self.contact_points[new])
            .with_min_len(CONTACTS_PER_TASK);
        pairs.for_each(|(constraint, contact)| {
            contact.assemble_jacobian(&mut constraint.jacobian, context.surface, at);
            contact.set_constraint(constraint, context, span);
        });
        workspace.constraint_count = count;
        workspace.pairs.list(&self.contact_points);
        let changes = &mut workspace.gap_changes;
        let new = self.contact_points[changes.allowed.len()..].iter();
        changes.add(new.map(|contact| contact.expected_change(context, span.drift)));
        let constraints = &workspace.constraints;
        workspace.energies.time_solution(|| {
            self.workspace
                .solver
                .load(constraints, context.mobility(span.interval))
        });
        workspace.start(self.workspace.solver.nodes(), motion.velocity);
    }

    /// Solves the constraints, and again with targets that allow for the quadratic changes found of
    /// the gaps, at most [`MOST_REPEATED_SOLVES`] times.
    fn solve_for_gaps(
        &mut self,
        context: &ContactContext<D>,
        motion: &mut KickedView<D>,
        workspace: &mut KickWorkspace<D>,
        drift: f64,
    ) {
        if self.contact_points.is_empty() {
            return;
        }
        loop {
            let (system, constraints) = (&mut self.workspace.solver, &mut workspace.constraints);
            let (velocity, precision) = (&mut *motion.velocity, workspace.precision);
            let solve = || system.solve(constraints, velocity, precision);
            workspace.energies.count_solve(solve);
            if !self.correct_targets(context, motion, drift, workspace) {
                return;
            }
            workspace.undo(motion);
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
        workspace: &mut KickWorkspace<D>,
        span: KickSpan,
    ) -> bool {
        let least = context.least_speed(span.drift);
        let mut breaks = false;
        for (contact, constraint) in self.contact_points.iter_mut().zip(&workspace.constraints) {
            breaks |= contact.breaks(constraint, motion.velocity, least);
        }
        if breaks {
            let known = self
                .contact_points
                .iter()
                .zip(&workspace.gap_changes.allowed);
            for (constraint, (contact, allowed)) in workspace.constraints.iter_mut().zip(known) {
                contact.set_constraint(constraint, context, span);
                constraint.target[0] -=
                    (allowed - contact.expected_change(context, span.drift)) / span.drift;
            }
        }
        breaks
    }

    /// Corrects the targets if the quadratic change of any gap, at the solved velocities, is too far
    /// from the one that its target allows for. What is left of a change below [`GAP_ERROR`] the next
    /// kick makes good. A contact without impulse counts only if it sinks. Returns true if they were
    /// corrected.
    fn correct_targets(
        &self,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        drift: f64,
        workspace: &mut KickWorkspace<D>,
    ) -> bool {
        let (constraints, changes) = (&mut workspace.constraints, &mut workspace.gap_changes);
        let gap_drift = GapDrift {
            context,
            motion: motion.constant(),
            duration: drift,
            pairs: &workspace.pairs,
        };
        gap_drift.find(&self.contact_points, constraints, changes);
        let [most, least] = [GAP_ERROR, GAP_DEAD_BAND].map(|part| part * context.resolution);
        let differences = changes.correct(|i, found, allowed| {
            let counts = constraints[i].impulse[0] > 0.0 || found < allowed;
            counts.then_some(if found.abs() < most { most } else { least })
        });
        for (constraint, difference) in constraints.iter_mut().zip(differences.unwrap_or_default())
        {
            constraint.target[0] -= difference / drift;
        }
        differences.is_some()
    }
}
