//! Impacts: the impulses of an island at the instant of a first touch, (4) and (5) of the
//! paper.

use std::collections::BTreeSet;

use rayon::prelude::*;

use crate::contact::constraint::contact_constraint::Constraint;
use crate::contact::constraint::contact_history::ContactHistory;
use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::constraint::context::ContactContext;
use crate::contact::constraint::quadratic_change::{ContactPairs, GapChanges, GapDrift};
use crate::contact::energy::ContactEnergies;
use crate::contact::interior::{BodyCoupling, VelocityJump};
use crate::contact::island::touch_events::Event;
use crate::contact::island::{Island, IslandBodies};
use crate::contact::solver::Precision;
use crate::contact::surface::kicked::ConstantMotion;
use crate::contact::timing::DriftProgress;
use crate::contact::tolerances::{CONTACTS_PER_TASK, FLUSH, GAP_ERROR, IMPACT_RESIDUAL};
use crate::math::vector::{add, dot, norm};
use crate::model::kinematics::NodalMotion;

/// An impact, which may be solved several times.
struct ImpactSolve<const D: usize> {
    constraints: Vec<Constraint<D>>,
    /// Relative velocities of the contacts before the impact, m/s.
    approach: Vec<[f64; D]>,
    /// Nodes that the impact may move, each once, those of the island first, with their
    /// velocities before it, m/s.
    start: Vec<(u32, [f64; D])>,
    precision: Precision,
    /// Duration of the drift, s.
    duration: f64,
    /// Quadratic changes of the gaps in the rest of the drift.
    gap_changes: GapChanges,
    pairs: ContactPairs,
}

/// Impulses of the bodies on their nodes, N·s, and the factor with which they act.
#[derive(Clone, Copy)]
struct BodyImpulses<'a, const D: usize> {
    impulses: &'a [(u32, [f64; D])],
    factor: f64,
}

impl<const D: usize> BodyImpulses<'_, D> {
    const NONE: Self = Self {
        impulses: &[],
        factor: 0.0,
    };
}

impl<const D: usize> ImpactSolve<D> {
    /// Adds nodes that the contacts do not move, with their present velocities.
    fn start_also(&mut self, nodes: impl Iterator<Item = u32>, motion: &NodalMotion<D>) {
        let known: BTreeSet<u32> = self.start.iter().map(|start| start.0).collect();
        let others: BTreeSet<u32> = nodes.filter(|node| !known.contains(node)).collect();
        let with_velocity = |node: u32| (node, motion.velocity[node as usize]);
        self.start.extend(others.into_iter().map(with_velocity));
    }
}

impl<const D: usize> ImpactSolve<D> {
    /// Returns the work of the impulses of the contacts on the bodies, J, less the work that lifts their
    /// points along rises of [`FLUSH`], as on faces that bend.
    fn excess_work(&self, motion: &NodalMotion<D>) -> f64 {
        let work = |(constraint, old): (&Constraint<D>, &[f64; D])| {
            let new = constraint.jacobian.relative_velocities(motion.velocity);
            let added = constraint.added();
            0.5 * dot(&added, &add(old, &new)) - FLUSH * norm(&added) * norm(old).max(norm(&new))
        };
        self.constraints.iter().zip(&self.approach).map(work).sum()
    }
}

impl<const D: usize> Island<D> {
    /// Solves the impact of the pairs that have just touched in a drift, together with the
    /// elements behind them.
    pub(super) fn solve_impact<I: BodyCoupling<D>>(
        &mut self,
        context: &ContactContext<D>,
        motion: &mut NodalMotion<D>,
        event: &Event<D>,
        bodies: &mut IslandBodies<D, I>,
        energies: &mut ContactEnergies,
    ) {
        let remaining = event.now.remaining();
        let mut impact = self.impact(context, motion, event.now);
        bodies.rollback.track(self.workspace.solver.nodes(), motion);
        self.solve_for(&mut impact, context, motion, BodyImpulses::NONE, energies);
        let jump = VelocityJump {
            nodes: &self.nodes,
            before: event.before,
            in_island: bodies.of_all.in_island,
            remaining,
        };
        let (coupling, touch) = (bodies.of_all.coupling, &mut bodies.touch);
        coupling.begin_impact(motion, &jump, bodies.rollback, touch);
        let mut of_bodies = BodyImpulses {
            impulses: I::impulses(touch),
            factor: 0.0,
        };
        if !of_bodies.impulses.is_empty() {
            let nodes = of_bodies.impulses.iter().map(|impulse| impulse.0);
            impact.start_also(nodes, motion);
            of_bodies.factor = 1.0;
            self.solve_for(&mut impact, context, motion, of_bodies, energies);
            of_bodies.factor = coupling.balance(touch, motion);
            self.solve_for(&mut impact, context, motion, of_bodies, energies);
        }
        self.solve_impact_for_gaps(&mut impact, context, motion, of_bodies, event.now, energies);
        self.record_new_changes(&impact, event.now);
        self.end_impact(
            context,
            motion,
            &impact,
            &mut bodies.received.of_contacts,
            energies,
        );
        let recovered = coupling.finish_impact(
            touch,
            motion,
            remaining,
            of_bodies.factor,
            &mut bodies.received.on_prescribed,
        );
        energies.impact_loss -= recovered;
        self.share_recovery(recovered);
    }

    /// Solves again while a gap would miss the one intended for the end of the drift. Where edges turn, the
    /// end of a path may be wrong: if the contacts would then give energy, solves without such corrections.
    fn solve_impact_for_gaps(
        &mut self,
        impact: &mut ImpactSolve<D>,
        context: &ContactContext<D>,
        motion: &mut NodalMotion<D>,
        impulses: BodyImpulses<D>,
        now: DriftProgress,
        energies: &mut ContactEnergies,
    ) {
        let targets: Vec<f64> = impact.constraints.iter().map(|c| c.target[0]).collect();
        let mut is_corrected = false;
        while self.correct_impact_targets(context, motion, impact, now) {
            self.solve_for(impact, context, motion, impulses, energies);
            is_corrected = true;
        }
        if is_corrected && impact.excess_work(motion) > 0.0 {
            for (constraint, target) in impact.constraints.iter_mut().zip(targets) {
                constraint.target[0] = target;
            }
            self.solve_for(impact, context, motion, impulses, energies);
        }
    }

    /// Takes the energy that the bodies recover at a touch, J, from the losses of the new
    /// contacts, in equal shares.
    fn share_recovery(&mut self, recovered: f64) {
        let new = self
            .contact_points
            .iter_mut()
            .filter(|contact| contact.is_new);
        let histories: Vec<&mut ContactHistory> = new.map(|contact| &mut contact.history).collect();
        let share = recovered / histories.len() as f64;
        for history in histories {
            history.step_loss -= share;
        }
    }

    /// Solves for the velocities after the impact, with the `impulses` of the bodies acting at
    /// the same instant.
    fn solve_for(
        &mut self,
        impact: &mut ImpactSolve<D>,
        context: &ContactContext<D>,
        motion: &mut NodalMotion<D>,
        impulses: BodyImpulses<D>,
        energies: &mut ContactEnergies,
    ) {
        for (node, velocity) in &impact.start {
            motion.velocity[*node as usize] = *velocity;
        }
        for (node, impulse) in impulses.impulses {
            let impulse = impulse.map(|x| impulses.factor * x);
            context
                .inertia
                .apply_impulse(*node as usize, &impulse, motion.velocity);
        }
        let precision = impact.precision;
        let solver = &mut self.workspace.solver;
        let constraints = &mut impact.constraints;
        energies.count_solve(|| solver.solve(constraints, motion.velocity, precision));
    }

    /// Solves the impact of pairs that are closed at t = 0 and approach, before a drift of
    /// `duration` seconds.
    pub(crate) fn solve_initial_impact(
        &mut self,
        context: &ContactContext<D>,
        motion: &mut NodalMotion<D>,
        duration: f64,
        received: &mut Vec<(u32, [f64; D])>,
        energies: &mut ContactEnergies,
    ) {
        let mut impact = self.impact(context, motion, DriftProgress::start(duration));
        self.solve_for(&mut impact, context, motion, BodyImpulses::NONE, energies);
        self.end_impact(context, motion, &impact, received, energies);
    }

    /// Sets up an impact: perfectly inelastic for the new contacts, within the shear limit.
    /// Contacts closed before stay closed as far as the impulse of their last kick allows.
    fn impact(
        &mut self,
        context: &ContactContext<D>,
        motion: &NodalMotion<D>,
        now: DriftProgress,
    ) -> ImpactSolve<D> {
        let constraint = |contact: &ContactPoint<D>| {
            let at = motion.positions().into();
            contact.impact_constraint(context, at, motion.velocity, now)
        };
        let contacts = self.contact_points.par_iter();
        let contacts = contacts.with_min_len(CONTACTS_PER_TASK);
        let constraints: Vec<_> = contacts.clone().map(constraint).collect();
        self.workspace
            .solver
            .load(&constraints, context.mobility(0.0));
        let approach = constraints.iter();
        let approach = approach.map(|c| c.jacobian.relative_velocities(motion.velocity));
        // With this change, the present velocity leads to the intended gap.
        let intended_change = |(contact, constraint): (&ContactPoint<D>, &Constraint<D>)| {
            let (jacobian, gap) = (&constraint.jacobian, contact.intended_gap);
            let change = || jacobian.quadratic_change(gap, motion.velocity, now.remaining());
            contact.carries_impulse().then(change).unwrap_or_default()
        };
        let mut gap_changes = GapChanges::default();
        let intended = contacts.zip(&constraints).map(intended_change);
        gap_changes.allowed.par_extend(intended);
        let mut pairs = ContactPairs::default();
        pairs.list(&self.contact_points);
        ImpactSolve {
            approach: approach.collect(),
            start: self.reached_nodes(&constraints, motion),
            precision: self.precision(
                context,
                motion.positions().into(),
                now.duration,
                IMPACT_RESIDUAL,
            ),
            duration: now.duration,
            gap_changes,
            pairs,
            constraints,
        }
    }

    /// Corrects the targets if a gap would miss the one intended for the end of the drift: a point that
    /// slides along a turning edge enters it by the square of the time. A new contact, or one that does
    /// not press, counts only if it sinks. Returns true if they were corrected.
    ///
    /// However little time is left, each correction is limited. For a contact closed before, it is at most
    /// twice the velocity that the whole drift would need; for a new one its approach speed, or [`FLUSH`]
    /// times its relative speed if that is more, which is the rise of a flush boundary. Without this
    /// limit, edges all but parallel that a drift turned by 20 degrees gained 16 % of their energy.
    fn correct_impact_targets(
        &self,
        context: &ContactContext<D>,
        motion: &NodalMotion<D>,
        impact: &mut ImpactSolve<D>,
        now: DriftProgress,
    ) -> bool {
        let remaining = now.remaining();
        if remaining <= f64::EPSILON * now.duration {
            return false;
        }
        let gap_drift = GapDrift {
            context,
            motion: ConstantMotion::of(motion),
            duration: remaining,
            pairs: &impact.pairs,
        };
        let (constraints, changes) = (&mut impact.constraints, &mut impact.gap_changes);
        gap_drift.find(&self.contact_points, constraints, changes);
        let most = GAP_ERROR * context.resolution;
        let differences = changes.correct(|i, found, allowed| {
            let holds = !self.contact_points[i].is_new && constraints[i].presses();
            (holds || found < allowed).then_some(most)
        });
        let contacts = self.contact_points.iter().zip(constraints);
        let contacts = contacts.zip(&impact.approach);
        for (((contact, constraint), approach), difference) in
            contacts.zip(differences.unwrap_or_default())
        {
            constraint.target[0] -= if contact.is_new {
                (difference / remaining).max(approach[0].min(-FLUSH * norm(approach)))
            } else {
                difference / remaining.max(0.5 * now.duration)
            };
        }
        differences.is_some()
    }

    /// Records the quadratic changes of the gaps of new contacts, unless the rest of the drift is so
    /// short that they hold too much round-off.
    fn record_new_changes(&mut self, impact: &ImpactSolve<D>, now: DriftProgress) {
        if now.remaining() > 0.5 * now.duration {
            let contacts = self.contact_points.iter_mut();
            for (contact, found) in contacts.zip(&impact.gap_changes.found) {
                if contact.is_new {
                    contact.record_quadratic_change(*found, now.remaining());
                }
            }
        }
    }

    /// Books the impulses of a solved impact in the contact histories and the energies.
    fn end_impact(
        &mut self,
        context: &ContactContext<D>,
        motion: &NodalMotion<D>,
        impact: &ImpactSolve<D>,
        received: &mut Vec<(u32, [f64; D])>,
        energies: &mut ContactEnergies,
    ) {
        let least = context.least_speed(impact.duration);
        let solved = impact.constraints.iter().zip(&impact.approach);
        for (contact, (constraint, old)) in self.contact_points.iter_mut().zip(solved) {
            let new = constraint.jacobian.relative_velocities(motion.velocity);
            let added = constraint.added();
            contact.history.step_loss += energies.book_work(&added, [old, &new], true);
            contact
                .history
                .count(&constraint.impulse_before, &constraint.impulse);
            constraint
                .jacobian
                .apply_transpose(&added, |node, impulse| received.push((node, *impulse)));
            contact.apply_impact(constraint, motion.velocity, least);
        }
    }
}
