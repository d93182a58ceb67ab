//! Impacts: the impulses of an island at the instant of a first touch, (4) and (5) of the
//! paper.

use std::collections::BTreeSet;

use rayon::prelude::*;

use crate::contact::constraint::contact_constraint::Constraint;
use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::constraint::context::ContactContext;
use crate::contact::energy::{ContactEnergies, ImpulseReceiver, ImpulseReceivers};
use crate::contact::interior::{BodyCoupling, VelocityJump};
use crate::contact::island::{Island, IslandBodies};
use crate::contact::solver::{Precision, Solver};
use crate::contact::tolerances::{
    CONTACTS_PER_TASK, CROWD_RESIDUAL, FEW_CONTACTS, GAP_ERROR, MOST_REPEATED_SOLVES, RESIDUAL,
};
use crate::model::kinematics::NodalMotion;

/// An impact, which may be solved several times.
struct ImpactSolve<const D: usize> {
    constraints: Vec<Constraint<D>>,
    /// Relative velocities of the contacts before the impact, m/s.
    approach: Vec<[f64; D]>,
    /// Nodes that the impact may move, each once, those of the island first, with their
    /// velocities before it, m/s.
    start: Vec<(u32, [f64; D])>,
    /// Change of a relative velocity that counts as none, m/s.
    precision: f64,
}

impl<const D: usize> ImpactSolve<D> {
    /// Adds nodes that the contacts do not move, with their present velocities.
    fn start_also(&mut self, nodes: impl Iterator<Item = u32>, motion: &NodalMotion<D>) {
        let known: BTreeSet<u32> = self.start.iter().map(|start| start.0).collect();
        let others: BTreeSet<u32> = nodes.filter(|node| !known.contains(node)).collect();
        let with_velocity = |node: u32| (node, motion.velocity[node as usize]);
        self.start.extend(others.into_iter().map(with_velocity));
    }

    /// Solves for the velocities after the impact, with `scale` times the `impulses` of the
    /// bodies, N·s, acting at the same instant.
    fn solve(
        &mut self,
        system: &mut Solver<D>,
        context: &ContactContext<D>,
        motion: &mut NodalMotion<D>,
        (impulses, scale): (&[(u32, [f64; D])], f64),
        energies: &mut ContactEnergies,
    ) {
        for (node, velocity) in &self.start {
            motion.velocity[*node as usize] = *velocity;
        }
        for (node, impulse) in impulses {
            let impulse = impulse.map(|x| scale * x);
            context
                .inertia
                .apply_impulse(*node as usize, &impulse, motion.velocity);
        }
        let is_small = self.constraints.len() <= FEW_CONTACTS;
        let precision = Precision {
            residual: if is_small { RESIDUAL } else { CROWD_RESIDUAL },
            velocity: self.precision,
        };
        energies.count_solve(|| system.solve(&mut self.constraints, motion.velocity, precision));
    }
}

impl<const D: usize> Island<D> {
    /// Solves the impact of the pairs that have just touched, in a drift of `duration` seconds
    /// of which `remaining` are left, together with the elements behind them.
    pub(super) fn solve_impact<I: BodyCoupling<D>>(
        &mut self,
        context: &ContactContext<D>,
        motion: &mut NodalMotion<D>,
        (before, (duration, remaining)): (&[[f64; D]], (f64, f64)),
        bodies: &mut IslandBodies<D, I>,
        receivers: &mut ImpulseReceivers<D>,
        energies: &mut ContactEnergies,
    ) {
        let mut impact = self.impact(context, motion, duration);
        bodies.rollback.track(self.solver.nodes(), motion);
        impact.solve(&mut self.solver, context, motion, (&[], 0.0), energies);
        let jump = VelocityJump {
            nodes: &self.nodes,
            before,
            taken: bodies.in_island,
            remaining,
        };
        let mut scale = 0.0;
        let (interior, touch) = (bodies.coupling, &mut bodies.touch);
        interior.begin_impact(motion, &jump, bodies.rollback, touch);
        let impulses = I::impulses(touch);
        if !impulses.is_empty() {
            impact.start_also(impulses.iter().map(|impulse| impulse.0), motion);
            impact.solve(&mut self.solver, context, motion, (impulses, 1.0), energies);
            scale = interior.balance(touch, motion);
            impact.solve(
                &mut self.solver,
                context,
                motion,
                (impulses, scale),
                energies,
            );
        }
        for _ in 0..MOST_REPEATED_SOLVES {
            let drift = (duration, remaining);
            if !self.correct_targets(context, motion, &mut impact.constraints, drift) {
                break;
            }
            impact.solve(
                &mut self.solver,
                context,
                motion,
                (impulses, scale),
                energies,
            );
        }
        self.end_impact(
            context,
            motion,
            (&impact, duration),
            receivers.of_contacts,
            energies,
        );
        let timing = (remaining, scale);
        energies.impact_loss -=
            interior.finish_impact(touch, motion, timing, receivers.on_prescribed);
    }

    /// Solves the impact of pairs that are closed at t = 0 and approach, before a drift of
    /// `duration` seconds.
    pub(crate) fn solve_initial_impact(
        &mut self,
        context: &ContactContext<D>,
        motion: &mut NodalMotion<D>,
        duration: f64,
        on_impulse: ImpulseReceiver<D>,
        energies: &mut ContactEnergies,
    ) {
        let mut impact = self.impact(context, motion, duration);
        impact.solve(&mut self.solver, context, motion, (&[], 0.0), energies);
        self.end_impact(context, motion, (&impact, duration), on_impulse, energies);
    }

    /// Sets up an impact: perfectly inelastic for the new contacts, within the shear limit.
    /// Contacts closed before stay closed as far as the impulse of their last kick allows.
    fn impact(
        &mut self,
        context: &ContactContext<D>,
        motion: &NodalMotion<D>,
        duration: f64,
    ) -> ImpactSolve<D> {
        let constraint = |contact: &ContactPoint<D>| {
            let within = (duration, context.tolerance);
            contact.impact_constraint(context.surface, motion.positions().into(), within)
        };
        let contact = self
            .contact_points
            .par_iter()
            .with_min_len(CONTACTS_PER_TASK);
        let constraints: Vec<_> = contact.map(constraint).collect();
        self.solver.load(&constraints, context.mobility(0.0));
        let approach = constraints.iter();
        let approach = approach.map(|c| c.jacobian.relative_velocities(motion.velocity));
        ImpactSolve {
            approach: approach.collect(),
            start: self.reached_nodes(&constraints, motion),
            precision: self.precision(context, motion.positions().into(), duration),
            constraints,
        }
    }

    /// Corrects the targets of closed pairs that would penetrate in the `remaining` seconds: a
    /// point that slides along a turning edge enters it by the square of the time. Returns true
    /// if any was corrected. Contacts closed before were corrected in their kick already. Their
    /// correction here is at most twice the velocity that the whole drift would need, however
    /// little time is left.
    fn correct_targets(
        &self,
        context: &ContactContext<D>,
        motion: &NodalMotion<D>,
        constraints: &mut [Constraint<D>],
        (duration, remaining): (f64, f64),
    ) -> bool {
        let then = motion.positions().after(motion.velocity, remaining);
        let mut too_far = false;
        for (contact, constraint) in self.contact_points.iter().zip(constraints) {
            let projection = context.surface.project(contact.pair, then.into());
            let miss = projection.gap - contact.offset[0];
            if miss < -GAP_ERROR * context.tolerance && projection.outside <= context.tolerance {
                let within = if contact.is_new {
                    remaining
                } else {
                    remaining.max(0.5 * duration)
                };
                constraint.target[0] -= miss / within;
                too_far = true;
            }
        }
        too_far
    }

    /// Books the impulses of a solved impact in the contact histories and the energies.
    fn end_impact(
        &mut self,
        context: &ContactContext<D>,
        motion: &NodalMotion<D>,
        (impact, duration): (&ImpactSolve<D>, f64),
        on_impulse: ImpulseReceiver<D>,
        energies: &mut ContactEnergies,
    ) {
        let least = context.least_speed(duration);
        let solved = impact.constraints.iter().zip(&impact.approach);
        for (contact, (constraint, old)) in self.contact_points.iter_mut().zip(solved) {
            let new = constraint.jacobian.relative_velocities(motion.velocity);
            let added = constraint.added();
            energies.book_work(&added, old, &new, true);
            contact
                .history
                .count(&constraint.impulse_before, &constraint.impulse);
            constraint
                .jacobian
                .apply_transpose(&added, &mut *on_impulse);
            contact.apply_impact(constraint, motion.velocity, least);
        }
    }
}
