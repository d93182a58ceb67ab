//! Impacts in the middle of a drift, inside the blocks (the paper's section 3): correction for the
//! elements around a touching point.
//!
//! Forces act only at the ends of a drift of L seconds. Let a touch change velocities from w₀ to
//! w₁, r seconds before the end. The force f then changes along two slopes, and its true impulse
//! over the drift, ∫f dt, exceeds the mean of the two end forces times L by p = c K (w₁ − w₀), c =
//! ½ r (L − r). This impulse p is applied at the touch and gives velocities w₂. So an impact in the
//! middle of a drift is of second order, like the rest of the scheme.
//!
//! The ledger's energy, ½v⁻·M·v⁺ + U, takes velocities in the middle of the drift and forces at its
//! ends. The touch removes from it the work of the contacts minus p·½(w₀ + w₂) + c (w₀·K·w₀ −
//! w₂·K·w₂) + (L/2 − r) f·(w₂ − w₀), with the force f at the touch. From undeformed bodies it
//! should remove no more than without p. Therefore p is scaled, by 1 + O((ωL)²), to s p with s
//! p·½(w₁ + w₂) = c (w₂·K·w₂ − w₀·K·w₁).

use rayon::prelude::*;

use crate::contact::interior::{BodyCoupling, VelocityJump};
use crate::contact::rollback::Rollback;
use crate::element::{ElementNumbering, ElementSet, MAX_NODES, PaddedNodal};
use crate::math::adjacency::Adjacency;
use crate::math::vector::{add, dot, scale, sub};
use crate::mesh::Element;
use crate::model::inverse_mass::InverseMass;
use crate::model::kinematics::NodalMotion;
use crate::model::time_levels::Levels;

/// Elements per task: some tens of microseconds of work, as long as a thread takes to wake.
const ELEMENTS_PER_TASK: usize = 128;

/// The data of the blocks that a touch needs.
pub(crate) struct MidStepImpact<'a, const D: usize> {
    pub(crate) sets: &'a [Box<dyn ElementSet<D>>],
    pub(crate) numbering: &'a ElementNumbering,
    pub(crate) elements: &'a [Element],
    pub(crate) around: &'a Adjacency,
    pub(crate) inertia: &'a InverseMass<D>,
    pub(crate) levels: &'a Levels,
    /// Interval before the next kick of each element, s.
    pub(crate) interval: &'a [f64],
}

/// Workspace of the current touch.
#[derive(Default)]
pub(crate) struct TouchedElements<const D: usize> {
    /// Elements at nodes whose velocity jumps, and the data of each.
    due: Vec<u32>,
    parts: Vec<ElementPart<D>>,
    /// Nodes of these elements outside the island.
    ring: Vec<u32>,
    /// Impulses of the elements on their nodes, N·s.
    impulses: Vec<(u32, [f64; D])>,
    /// Velocities of the island after the touch, m/s, while `motion` has those before it.
    after: Vec<[f64; D]>,
}

/// An element during a touch.
struct ElementPart<const D: usize> {
    element: u32,
    /// c, s².
    coefficient: f64,
    /// f, N, and p, N·s.
    force: PaddedNodal<D>,
    impulse: PaddedNodal<D>,
    /// w₀ and w₁, m/s.
    velocity: [PaddedNodal<D>; 2],
    /// −K·w₀ and −K·w₁, N/s.
    rate: [PaddedNodal<D>; 2],
}

impl<const D: usize> BodyCoupling<D> for MidStepImpact<'_, D> {
    type Touch = TouchedElements<D>;

    fn begin_impact(
        &self,
        motion: &mut NodalMotion<D>,
        jump: &VelocityJump<D>,
        rollback: &mut Rollback<D>,
        touch: &mut TouchedElements<D>,
    ) {
        let TouchedElements {
            due,
            parts,
            ring,
            impulses,
            after,
        } = touch;
        self.list_behind(motion, jump, due);
        self.list_ring(due, jump, ring);
        rollback.track(ring, motion);
        motion.drift(ring, -jump.remaining);
        let (now, due) = (&*motion, due.par_iter().with_min_len(ELEMENTS_PER_TASK));
        due.map(|&element| self.element_part(element, now, jump.remaining))
            .collect_into_vec(parts);
        jump.swap(motion.velocity, after);
        let (now, all) = (
            &*motion,
            parts.par_iter_mut().with_min_len(ELEMENTS_PER_TASK),
        );
        all.for_each(|part| self.compare(part, now));
        impulses.clear();
        impulses.extend(parts.iter().flat_map(|part| {
            let nodes = self.elements[part.element as usize].nodes().iter();
            nodes.copied().zip(part.impulse)
        }));
        for (&node, velocity) in jump.nodes.iter().zip(&*after) {
            motion.velocity[node as usize] = *velocity;
        }
    }

    fn impulses(touch: &TouchedElements<D>) -> &[(u32, [f64; D])] {
        &touch.impulses
    }

    fn balance(&self, touch: &TouchedElements<D>, motion: &NodalMotion<D>) -> f64 {
        let terms = |part: &ElementPart<D>| {
            let now = self.velocities(part.element, motion);
            let change = std::array::from_fn(|k| sub(&now[k], &part.velocity[1][k]));
            let rate = self.force_rate(part.element, &change, motion);
            [
                product(&part.impulse, &part.velocity[1]),
                product(&part.impulse, &change),
                -part.coefficient * product(&part.rate[1], &change),
                -part.coefficient * product(&rate, &change),
            ]
        };
        let sum = |sum: [f64; 4], terms: [f64; 4]| std::array::from_fn(|i| sum[i] + terms[i]);
        let [work, square, slope, curvature] =
            each(&touch.parts, terms).into_iter().fold([0.0; 4], sum);
        root(0.5 * square - curvature, work - 2.0 * slope, work)
    }

    fn finish_impact(
        &self,
        touch: &TouchedElements<D>,
        motion: &mut NodalMotion<D>,
        remaining: f64,
        factor: f64,
        on_prescribed: &mut Vec<(u32, [f64; D])>,
    ) -> f64 {
        let now = &*motion;
        let recovered = |part: &ElementPart<D>| {
            let timing = 0.5 * self.interval[part.element as usize] - remaining;
            let before = &part.velocity[0];
            let after = self.velocities(part.element, now);
            let rate = self.force_rate(part.element, &after, now);
            let mut recovered = [0.0; 1 + MAX_NODES];
            recovered[0] =
                part.coefficient * (product(&rate, &after) - product(&part.rate[0], before));
            for k in 0..MAX_NODES {
                recovered[1 + k] = timing * dot(&part.force[k], &sub(&after[k], &before[k]))
                    + 0.5 * factor * dot(&part.impulse[k], &add(&before[k], &after[k]));
            }
            recovered
        };
        let recovered = each(&touch.parts, recovered).into_iter().flatten().sum();
        for part in &touch.parts {
            let nodes = self.elements[part.element as usize].nodes().iter();
            for (&node, impulse) in nodes.zip(&part.impulse) {
                if self.inertia.prescribed(node as usize).contains(&true) {
                    on_prescribed.push((node, scale(factor, impulse)));
                }
            }
        }
        motion.drift(&touch.ring, remaining);
        recovered
    }
}

/// Returns the root of a s² + b s = c near 1, or 1 if there is none within a factor of two.
fn root(a: f64, b: f64, c: f64) -> f64 {
    let discriminant = b * b + 4.0 * a * c;
    let root = 2.0 * c / (b + discriminant.sqrt().copysign(b));
    if (0.5..=2.0).contains(&root) {
        root
    } else {
        1.0
    }
}

/// Evaluates `terms` for each element part, in parallel and in order.
fn each<const D: usize, const N: usize>(
    parts: &[ElementPart<D>],
    terms: impl Fn(&ElementPart<D>) -> [f64; N] + Sync + Send,
) -> Vec<[f64; N]> {
    let parts = parts.par_iter().with_min_len(ELEMENTS_PER_TASK);
    parts.map(terms).collect()
}

/// Returns the sum of the scalar products of two nodal fields of an element.
fn product<const D: usize>(a: &PaddedNodal<D>, b: &PaddedNodal<D>) -> f64 {
    a.iter().zip(b).map(|(a, b)| dot(a, b)).sum()
}

impl<const D: usize> MidStepImpact<'_, D> {
    /// Lists the elements with a node whose velocity jumps, if all their nodes have the time level
    /// of the jump and belong to no other island.
    fn list_behind(&self, motion: &NodalMotion<D>, jump: &VelocityJump<D>, due: &mut Vec<u32>) {
        let nodes = jump.nodes.iter().zip(jump.before);
        let jumps = nodes.filter(|(node, before)| motion.velocity[**node as usize] != **before);
        due.clear();
        due.extend(jumps.flat_map(|(&node, _)| self.around.of(node)));
        due.sort_unstable();
        due.dedup();
        let level = jump
            .nodes
            .first()
            .map_or(0, |&node| self.levels.node[node as usize]);
        due.retain(|&e| {
            let mut nodes = self.elements[e as usize].nodes().iter();
            self.levels.element[e as usize] == level
                && nodes.all(|&node| {
                    self.levels.node[node as usize] == level
                        && (!jump.in_island[node as usize]
                            || jump.nodes.binary_search(&node).is_ok())
                })
        });
    }

    /// Lists the nodes of the elements `due` outside the island; these have already drifted to the
    /// end.
    fn list_ring(&self, due: &[u32], jump: &VelocityJump<D>, ring: &mut Vec<u32>) {
        let nodes = due.iter().flat_map(|&e| self.elements[e as usize].nodes());
        ring.clear();
        ring.extend(nodes);
        ring.sort_unstable();
        ring.dedup();
        ring.retain(|node| jump.nodes.binary_search(node).is_err());
    }

    /// Returns an element at the touch, `remaining` seconds before the end of the drift, with the
    /// velocities after the touch.
    fn element_part(
        &self,
        element: u32,
        motion: &NodalMotion<D>,
        remaining: f64,
    ) -> ElementPart<D> {
        let zero = [[0.0; D]; MAX_NODES];
        let (set, i) = self.numbering.of(element as usize);
        let force = self.sets[set].force(i, motion.displacement);
        let after = self.velocities(element, motion);
        ElementPart {
            element,
            coefficient: 0.5 * remaining * (self.interval[element as usize] - remaining),
            force,
            impulse: zero,
            velocity: [zero, after],
            rate: [zero, self.force_rate(element, &after, motion)],
        }
    }

    /// Adds the velocities before the touch to an element, and computes its impulses p.
    fn compare(&self, part: &mut ElementPart<D>, motion: &NodalMotion<D>) {
        part.velocity[0] = self.velocities(part.element, motion);
        part.rate[0] = self.force_rate(part.element, &part.velocity[0], motion);
        for k in 0..MAX_NODES {
            part.impulse[k] = scale(part.coefficient, &sub(&part.rate[0][k], &part.rate[1][k]));
        }
    }

    /// Returns the velocities of the nodes of an element, m/s.
    fn velocities(&self, element: u32, motion: &NodalMotion<D>) -> PaddedNodal<D> {
        let mut velocities = [[0.0; D]; MAX_NODES];
        let nodes = self.elements[element as usize].nodes();
        for (velocity, &node) in velocities.iter_mut().zip(nodes) {
            *velocity = motion.velocity[node as usize];
        }
        velocities
    }

    /// Returns −K·w of an element for velocities w of its nodes, N/s.
    fn force_rate(
        &self,
        element: u32,
        velocity: &PaddedNodal<D>,
        motion: &NodalMotion<D>,
    ) -> PaddedNodal<D> {
        let (set, i) = self.numbering.of(element as usize);
        self.sets[set].force_rate(i, motion.displacement, velocity)
    }
}

impl<const D: usize> VelocityJump<'_, D> {
    /// Restores the velocities before the touch and lists those after it in `after`.
    fn swap(&self, velocity: &mut [[f64; D]], after: &mut Vec<[f64; D]>) {
        let nodes = self.nodes.iter().zip(self.before);
        after.clear();
        after.extend(
            nodes.map(|(&node, before)| std::mem::replace(&mut velocity[node as usize], *before)),
        );
    }
}
