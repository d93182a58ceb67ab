//! Contact point: a closed feature pair, with its history.

use serde::{Deserialize, Serialize};

use crate::contact::constraint::contact_constraint::{Constraint, FrictionBounds, shear_norm};
use crate::contact::constraint::context::ContactContext;
use crate::contact::constraint::law::ContactLaw;
use crate::contact::narrow_phase::feature_selection::are_one_contact;
use crate::contact::surface::contact_kind::ContactKind;
use crate::contact::surface::{Configuration, ContactJacobian, JacobianAnchor, Pair, Surface};
use crate::contact::timing::{DriftProgress, KickSpan};
use crate::contact::tolerances::{
    CCD_SAMPLES, FOOT_ROUND_OFF, GAP_CORRECTION, GAP_DEAD_BAND, GAP_ERROR,
};
use crate::math::serde_pod;
use crate::math::vector::{add_scaled, dot, norm, sub};

/// A closed feature pair. Its two points are one unified node until a criterion opens it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct ContactPoint<const D: usize> {
    /// Main and target feature.
    pub(crate) pair: Pair,
    /// Strengths for its two blocks.
    pub(crate) law: ContactLaw,
    /// Foot on the target. While the contact sticks, the material point that it is bound to;
    /// while it slides, the last foot.
    pub(crate) foot: [f64; 2],
    /// Unit normal, out of the target, in the last kick. It fixes the sign of the normal
    /// between two edges, which their positions leave open.
    #[serde(with = "serde_pod")]
    pub(crate) normal: [f64; D],
    /// Offset from the foot in the frame, m, at the start of the contact: for example a gap within
    /// the contact tolerance at t = 0. The constraint keeps the gap, and in a joint the tangents.
    #[serde(with = "serde_pod")]
    pub(crate) offset: [f64; D],
    /// Gap that does not count as penetration, m: below 0 where blocks overlap at t = 0
    /// ([`InitialOverlaps`](crate::contact::constraint::initial_overlap::InitialOverlaps)).
    pub(crate) initial_gap: f64,
    /// True while the contact is bound to a material point of the target.
    pub(crate) is_sticking: bool,
    /// True while cohesion and tensile strength remain.
    pub(crate) is_joint: bool,
    /// True if the pair has touched but no solve has included it yet.
    pub(crate) is_new: bool,
    /// Impulse of the last solve in the frame, N·s, and its interval, s.
    #[serde(with = "serde_pod")]
    pub(crate) impulse: [f64; D],
    pub(crate) interval: f64,
    /// Force of the last kick, without the impulses of impacts, in the frame, N; 0 before the
    /// first.
    #[serde(with = "serde_pod")]
    pub(crate) force: [f64; D],
    /// Acceleration of the gap at constant velocities of its nodes, J̇v, m/s², in the last kick or, for
    /// a new contact, in its impact: points slide, and faces turn. 0 if it is not known.
    pub(crate) gap_acceleration: f64,
    /// Intended gap: the one that the last kick aims at for the end of its drift, m. Impacts in this
    /// drift use it, and checkpoints lie between drifts.
    #[serde(skip)]
    pub(crate) intended_gap: f64,
    /// Penalty model: elongation of the shear springs, m.
    #[serde(with = "serde_pod")]
    pub(crate) shear_spring: [f64; D],
    /// Row of `contacts.csv`.
    pub(crate) history: ContactHistory,
}

/// Contact history of a contact point so far.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct ContactHistory {
    pub(crate) kind: ContactKind,
    /// Time of the beginning, s.
    pub(crate) time_on: f64,
    /// Time of the end, s; `None` while the contact lasts.
    pub(crate) time_off: Option<f64>,
    /// Position of the contact, m.
    pub(crate) position: [f64; 3],
    /// Tributary area, m².
    pub(crate) area: f64,
    /// Normal impulse of the present coarse step, N·s.
    pub(crate) step_impulse: f64,
    /// Impact loss of the present coarse step by normal impulses, J.
    pub(crate) step_loss: f64,
    /// Largest normal impulse of a coarse step over the step, N.
    pub(crate) peak_normal_force: f64,
    /// Sum of normal impulses, N·s.
    pub(crate) normal_impulse: f64,
    /// Path length of shear impulses, N·s.
    pub(crate) shear_impulse: f64,
    /// Path length of the slip, m.
    pub(crate) slip: f64,
    /// Halvings of its elements.
    pub(crate) level: u32,
    pub(crate) blocks: [u32; 2],
}

impl ContactHistory {
    /// Returns the history of a contact that ends at `time`, s.
    pub(crate) fn ended(&self, time: f64) -> Self {
        Self {
            time_off: Some(time),
            ..self.clone()
        }
    }

    /// Adds an impulse in the frame, N·s, less the part `before` that was added already.
    pub(crate) fn count<const D: usize>(&mut self, before: &[f64; D], impulse: &[f64; D]) {
        self.step_impulse += impulse[0] - before[0];
        self.normal_impulse += impulse[0] - before[0];
        self.shear_impulse += shear_norm(impulse) - shear_norm(before);
    }

    /// Ends a coarse step of `step` seconds.
    pub(crate) fn end_step(&mut self, step: f64) {
        self.peak_normal_force = self.peak_normal_force.max(self.step_impulse / step);
        self.step_impulse = 0.0;
        self.step_loss = 0.0;
    }
}

/// A touch and the rest of the drift that it falls in.
#[derive(Clone, Copy)]
pub(crate) struct DriftInterval<'a, const D: usize> {
    /// Configuration at the touch.
    pub(crate) at_touch: Configuration<'a, D>,
    /// Configuration at the end of the drift, at the present velocities.
    pub(crate) at_end: Configuration<'a, D>,
    /// True if the present velocities satisfy the constraints of the closed contacts, except
    /// [new](ContactPoint::is_new) ones.
    pub(crate) is_solved: bool,
}

impl<'a, const D: usize> DriftInterval<'a, D> {
    /// Returns an interval of zero length, for a test of the present configuration.
    pub(crate) fn at_rest(at: Configuration<'a, D>) -> Self {
        Self {
            at_touch: at,
            at_end: at,
            is_solved: false,
        }
    }

    /// Returns the interval of a touch in `wait` seconds, with `remaining` seconds left in the
    /// drift, at velocities for which the closed contacts are solved.
    pub(crate) fn in_drift(
        at: Configuration<'a, D>,
        velocity: &'a [[f64; D]],
        [wait, remaining]: [f64; 2],
    ) -> Self {
        Self {
            at_touch: if wait > 0.0 {
                at.after(velocity, wait)
            } else {
                at
            },
            at_end: at.after(velocity, remaining),
            is_solved: true,
        }
    }

    /// Returns a bound of the change of the gap of a pair, m: how far nodes of the two features move
    /// against each other.
    fn relative_motion(&self, surface: &dyn Surface<D>, pair: Pair) -> f64 {
        let motion = |&node: &u32| sub(&self.at_end.at(node), &self.at_touch.at(node));
        let main = surface.main_nodes(pair.main);
        let first = motion(&main[0]);
        let of = |nodes: &[u32]| {
            let relative = nodes.iter().map(|node| norm(&sub(&motion(node), &first)));
            relative.fold(0.0, f64::max)
        };
        of(main) + of(surface.target_nodes(pair.target))
    }
}

impl<const D: usize> ContactPoint<D> {
    /// True if `pair`, between the same two blocks, would be the same physical contact as this
    /// one, both at its touch and at the end of the drift.
    pub(crate) fn is_duplicate_of(
        &self,
        context: &ContactContext<D>,
        pair: Pair,
        drift_interval: DriftInterval<D>,
    ) -> bool {
        let (surface, resolution) = (context.surface, context.resolution);
        if self.pair == pair {
            return true;
        }
        let continues = || {
            let projection = surface.project(self.pair, drift_interval.at_end);
            let foot = &projection.foot;
            projection.outside <= resolution
                || surface
                    .neighbour(self.pair, foot, drift_interval.at_end)
                    .is_some()
        };
        let (pairs, blocks) = (
            [self.pair, pair],
            [self.history.blocks, context.blocks(pair)],
        );
        are_one_contact(surface, pairs, blocks, drift_interval.at_touch, resolution)
            && continues()
            && !self.leaves_uncovered(context, pair, drift_interval)
    }

    /// True if this contact lets a pair beside it penetrate deeper than itself by the end of
    /// the drift: its point goes into a dent, or an edge moves from one ridge onto two.
    pub(crate) fn leaves_uncovered(
        &self,
        context: &ContactContext<D>,
        pair: Pair,
        drift_interval: DriftInterval<D>,
    ) -> bool {
        if !drift_interval.is_solved || self.is_new {
            return false;
        }
        let (surface, at_touch) = (context.surface, drift_interval.at_touch);
        // Most pairs, at rest all, cannot come that deep in a drift.
        let change = drift_interval.relative_motion(surface, pair);
        if surface.gap_or_zero(pair, at_touch).abs() + change < GAP_ERROR * context.resolution {
            return false;
        }
        if surface.project(pair, drift_interval.at_end).outside <= 0.0 {
            return self.is_shallower_than(context, pair, drift_interval.at_end);
        }
        // A pair that has passed by then may have been deep on the way.
        (1..CCD_SAMPLES).any(|look| {
            let share = f64::from(look) / f64::from(CCD_SAMPLES);
            self.is_shallower_than(
                context,
                pair,
                at_touch.towards(drift_interval.at_end, share),
            )
        })
    }

    /// True if a pair beside this contact is deeper than this contact, by more than [`GAP_ERROR`].
    fn is_shallower_than(
        &self,
        context: &ContactContext<D>,
        pair: Pair,
        at: Configuration<D>,
    ) -> bool {
        let surface = context.surface;
        let beside = surface.project(pair, at);
        let deep = -GAP_ERROR * context.resolution;
        if beside.outside > 0.0 || beside.gap >= deep {
            return false;
        }
        // The plane of a target that this contact has left by then does not hold the pair.
        let held = if self.is_sticking {
            self.pair
        } else {
            match self.followed(context, at, |_| false) {
                Some((held, _)) => held,
                None => return true,
            }
        };
        let normals = [held, pair].map(|pair| surface.normal(pair, at));
        let [Some(own_normal), Some(normal)] = normals else {
            return false;
        };
        // A pair that is apart along the normal of this contact does not penetrate.
        let is_swapped = context.blocks(pair) != self.history.blocks;
        let along = if is_swapped { -1.0 } else { 1.0 } * dot(&own_normal, &normal) * beside.gap;
        along - surface.gap_or_zero(held, at).min(0.0) < deep
    }

    /// Returns the impulse, force and springs, which rotate with the frame.
    pub(crate) fn frame_vectors(&mut self) -> [&mut [f64; D]; 3] {
        [&mut self.impulse, &mut self.force, &mut self.shear_spring]
    }

    /// True if it has a normal impulse, of its last kick or of an impact since then.
    pub(crate) fn carries_impulse(&self) -> bool {
        !self.is_new && self.impulse[0] != 0.0
    }

    /// Returns the penetration that the constraint keeps, m.
    pub(crate) fn penetration(&self) -> f64 {
        (self.initial_gap - self.offset[0]).max(0.0)
    }

    /// Returns the penetration at the positions of the Jacobian, m, beyond the initial overlap.
    pub(crate) fn depth(&self, jacobian: &ContactJacobian<D>) -> f64 {
        self.initial_gap - jacobian.offset[0]
    }

    /// Returns the Jacobian at the present positions.
    pub(crate) fn jacobian(
        &self,
        surface: &dyn Surface<D>,
        at: Configuration<D>,
    ) -> ContactJacobian<D> {
        let mut jacobian = ContactJacobian::default();
        self.assemble_jacobian(&mut jacobian, surface, at);
        jacobian
    }

    /// Assembles the Jacobian at the present positions in place.
    pub(crate) fn assemble_jacobian(
        &self,
        jacobian: &mut ContactJacobian<D>,
        surface: &dyn Surface<D>,
        at: Configuration<D>,
    ) {
        let anchor = JacobianAnchor {
            foot: &self.foot,
            along: Some(&self.normal),
        };
        surface.assemble_jacobian(jacobian, self.pair, anchor, at);
    }

    /// Returns the bounds of the impulse over `interval` seconds.
    fn friction_bounds(&self, interval: f64) -> FrictionBounds {
        let strength = if self.is_joint {
            self.history.area * interval
        } else {
            0.0
        };
        FrictionBounds {
            friction: self.law.friction,
            cohesion: self.law.cohesion * strength,
            tension: self.law.tensile_strength * strength,
        }
    }

    /// Sets target, bounds and start impulse of a constraint whose Jacobian is assembled, for a
    /// kick and the drift after it.
    pub(crate) fn set_constraint(
        &self,
        constraint: &mut Constraint<D>,
        context: &ContactContext<D>,
        KickSpan { interval, drift }: KickSpan,
    ) {
        self.set_target(constraint, context, drift);
        constraint.target[0] -= self.expected_change(context, drift) / drift;
        constraint.bounds = self.friction_bounds(interval);
        // No extrapolation: solves that leave more than half of an error would feed energy.
        constraint.impulse = self.force.map(|force| force * interval);
        constraint.impulse[0] = constraint.impulse[0].max(-constraint.bounds.tension);
        constraint.impulse_before = [0.0; D];
    }

    /// Sets the target of a constraint whose Jacobian is assembled. It keeps the pair together over a
    /// drift of `drift` seconds, and takes [`GAP_CORRECTION`] of g away in a coarse step, with g the
    /// deviation from the offset beyond [`GAP_DEAD_BAND`], for the gap and, in a joint, for the
    /// tangents. A contact that is open and carried no normal impulse, or is open by [`GAP_ERROR`],
    /// only keeps g ≥ 0, unless it is a joint. Friction has no memory: what a solve leaves of a slip
    /// is a slip, see [`Self::has_crept`].
    fn set_target(&self, constraint: &mut Constraint<D>, context: &ContactContext<D>, drift: f64) {
        let (jacobian, target) = (&constraint.jacobian, &mut constraint.target);
        *target = [0.0; D];
        let right = GAP_DEAD_BAND * context.resolution;
        for r in 0..if self.is_joint { D } else { 1 } {
            let wrong = self.offset[r] - jacobian.offset[r];
            target[r] = GAP_CORRECTION * (wrong - wrong.clamp(-right, right)) / context.coarse_step;
        }
        let apart = jacobian.offset[0] - self.offset[0];
        let is_near = self.is_joint || apart < GAP_ERROR * context.resolution;
        let is_held = self.impulse[0] != 0.0 && is_near;
        if apart > 0.0 && !is_held {
            target[0] = -apart / drift;
        }
    }

    /// True if a contact that sticks has come off its material point by more than [`GAP_ERROR`], by
    /// the slips that solves have left. A correction of such slips would work against friction, which
    /// has already been booked: a wall without damping gained 5e-4 of its strain energy in a second.
    pub(crate) fn has_crept(&self, jacobian: &ContactJacobian<D>, resolution: f64) -> bool {
        let slip = sub(&jacobian.offset, &self.offset);
        self.is_sticking && !self.is_joint && shear_norm(&slip) > GAP_ERROR * resolution
    }

    /// Binds a contact that has crept to the point under it, or keeps its foot at an end of the
    /// target.
    pub(crate) fn follow_creep(
        &mut self,
        surface: &dyn Surface<D>,
        at: Configuration<D>,
        jacobian: &ContactJacobian<D>,
    ) {
        self.history.slip += shear_norm(&sub(&jacobian.offset, &self.offset));
        self.offset[1..].copy_from_slice(&jacobian.offset[1..]);
        let projection = surface.project(self.pair, at);
        let size = surface.target_size(self.pair.target, at);
        if projection.outside <= FOOT_ROUND_OFF * size {
            self.foot = projection.foot;
            self.offset[1..].fill(0.0);
        }
    }

    /// Records the impulse of a kick of `interval` seconds, N·s.
    pub(crate) fn record_impulse(&mut self, impulse: &[f64; D], interval: f64) {
        (self.impulse, self.interval) = (*impulse, interval);
        self.force = impulse.map(|impulse| impulse / interval);
        self.history.count(&[0.0; D], impulse);
    }

    /// True if its gap is wider than [`GAP_DEAD_BAND`] after a drift at the solved velocities, in which
    /// it changes by this quadratic `change` besides, m. A contact without impulse but with a
    /// smaller gap has not ended: it may carry one in the next kick.
    pub(crate) fn is_apart_after(
        &self,
        solved: &Constraint<D>,
        velocity: &[[f64; D]],
        drift: f64,
        change: f64,
        resolution: f64,
    ) -> bool {
        let jacobian = &solved.jacobian;
        let gap = jacobian.offset[0] + drift * jacobian.relative_velocity(0, velocity) + change;
        gap - self.offset[0] > GAP_DEAD_BAND * resolution
    }

    /// Returns the constraint at the instant of an impact, at the present positions. A contact closed
    /// before starts with the impulse of its last kick. Its pressure may fall to the share of the drift
    /// that has passed, and its shear is bounded by that. If all could be given back, friction that has
    /// been at work would return at another speed, and such impacts gave up to 5 % of the energy. As long
    /// as the contact carries an impulse, it keeps the relative velocity that it has in `velocity`, with
    /// which its kick has set the gap at the end of the drift. The strength of a joint bounds the sum of
    /// both impulses.
    pub(crate) fn impact_constraint(
        &self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        velocity: &[[f64; D]],
        now: DriftProgress,
    ) -> Constraint<D> {
        let mut constraint = Constraint::default();
        self.assemble_jacobian(&mut constraint.jacobian, context.surface, at);
        if self.is_new {
            constraint.bounds = self.friction_bounds(0.0);
            return constraint;
        }
        self.set_target(&mut constraint, context, now.duration);
        (constraint.impulse, constraint.impulse_before) = (self.impulse, self.impulse);
        constraint.bounds = self.friction_bounds(now.duration.max(self.interval));
        if self.carries_impulse() {
            constraint.target[0] = constraint.jacobian.relative_velocity(0, velocity);
            if !self.is_joint {
                let passed = now.elapsed / now.duration * self.force[0] * self.interval;
                constraint.bounds.tension = -passed.clamp(0.0, self.impulse[0].max(0.0));
            }
        }
        constraint
    }

    /// Applies a solved impact: slip, broken joint and, for the next impact of this drift, the
    /// remaining impulse. A contact that opens has none: what it has carried stays done.
    pub(crate) fn apply_impact(
        &mut self,
        solved: &Constraint<D>,
        velocity: &[[f64; D]],
        least: f64,
    ) {
        if self.is_new {
            self.is_new = false;
        } else {
            self.impulse = solved.impulse;
            self.breaks(solved, velocity, least);
            if !self.is_joint && solved.opens(velocity, least) {
                self.impulse = [0.0; D];
            }
        }
        if solved.slips(velocity, least) && !self.is_joint {
            self.slide();
        }
    }

    /// Binds the contact to the material point of the target under it.
    pub(crate) fn stick(&mut self) {
        self.is_sticking = true;
        self.offset[1..].fill(0.0);
    }

    /// Breaks a joint whose solved constraint exceeds its strength. Returns true if it broke. The
    /// tension and shear that it has carried stay done: a later impact of the drift must not give them
    /// back.
    pub(crate) fn breaks(
        &mut self,
        constraint: &Constraint<D>,
        velocity: &[[f64; D]],
        least: f64,
    ) -> bool {
        let breaks = self.is_joint
            && (constraint.opens(velocity, least) || constraint.slips(velocity, least));
        if breaks {
            self.slide();
            let pressure = self.impulse[0].max(0.0);
            self.impulse = [0.0; D];
            self.impulse[0] = pressure;
        }
        breaks
    }

    /// Frees the tangents. Cohesion and tensile strength are lost.
    pub(crate) fn slide(&mut self) {
        self.is_sticking = false;
        self.is_joint = false;
    }
}

/// Returns a vector of one frame in another frame. Keeps its normal component.
pub(crate) fn rotate_tangents<const D: usize>(
    vector: &[f64; D],
    [old, new]: &[[[f64; D]; D]; 2],
) -> [f64; D] {
    let mut whole = [0.0; D];
    for r in 1..D {
        add_scaled(&mut whole, vector[r], &old[r]);
    }
    std::array::from_fn(|r| {
        if r == 0 {
            vector[0]
        } else {
            dot(&whole, &new[r])
        }
    })
}
