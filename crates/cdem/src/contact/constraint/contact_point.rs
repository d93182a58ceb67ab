//! Contact point: a closed feature pair, with its history.

use serde::{Deserialize, Serialize};

use crate::contact::constraint::contact_constraint::{Constraint, FrictionBounds, shear_norm};
use crate::contact::constraint::contact_history::ContactHistory;
use crate::contact::constraint::context::ContactContext;
use crate::contact::constraint::law::ContactLaw;
use crate::contact::penetration::Penetration;
use crate::contact::surface::{Configuration, ContactJacobian, JacobianAnchor, Pair, Surface};
use crate::contact::timing::KickSpan;
use crate::contact::tolerances::{FOOT_ROUND_OFF, GAP_CORRECTION, GAP_DEAD_BAND, GAP_ERROR};
use crate::math::serde_pod;
use crate::math::vector::{add_scaled, dot, sub};

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

impl<const D: usize> ContactPoint<D> {
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

    /// Returns the penetration at the positions of the Jacobian, beyond the initial overlap.
    pub(crate) fn penetration_at(&self, jacobian: &ContactJacobian<D>, time: f64) -> Penetration {
        Penetration {
            depth: self.initial_gap - jacobian.offset[0],
            time,
            blocks: self.history.blocks,
        }
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
    pub(super) fn friction_bounds(&self, interval: f64) -> FrictionBounds {
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
    pub(super) fn set_target(
        &self,
        constraint: &mut Constraint<D>,
        context: &ContactContext<D>,
        drift: f64,
    ) {
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

    /// True if it has opened after a drift at the solved velocities, in which its gap changes by this
    /// quadratic `change` besides, m: by more than [`GAP_DEAD_BAND`], and by more than the gap or overlap
    /// that it keeps, since no search finds the pair again as long as it is there. A contact without
    /// impulse that has opened less has not ended: it may carry one in the next kick.
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
        gap - self.offset[0] > self.offset[0].abs().max(GAP_DEAD_BAND * resolution)
    }

    /// True if it keeps a gap or an overlap: that of its blocks at t = 0, or one that a change of mesh
    /// has made.
    pub(crate) fn keeps_gap(&self, resolution: f64) -> bool {
        self.offset[0].abs() > GAP_ERROR * resolution
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
