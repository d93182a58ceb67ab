//! The refinement indicator: element sizes for two blocks that are about to touch (design, section
//! 6).

use serde::{Deserialize, Serialize};

use crate::math::vector::{add, dot, norm, scale, sub};
use crate::refinement::adaptivity::Adaptivity;
use crate::refinement::zone::SAME_LENGTH;

/// Number of halvings of the coarser side after which both sides have reached the finest time
/// level.
const LEVELS: u32 = 64;

/// Approximate number of layers of small elements between the contact and the largest elements that
/// the grading allows.
const LAYERS: f64 = 8.0;

/// Approximate number of elements of a block at one touch beyond which it is not refined further.
/// For faces that meet flush in 3-D, each halving would take four times as many.
const MAX_ELEMENTS: f64 = 8192.0;

/// Lower bound of the size of elements under a point load, over the length of the contact
/// ([`Adaptivity::contact_length`]) times approach speed over the speed of compression waves. The
/// smaller block gives the load. Strain grows towards the point as one over the distance: in smaller
/// elements it would leave the elastic range.
const PRESSED: f64 = 8.0;

/// Lower bound of the element size over the path of compression waves in the time of
/// stiffness-proportional damping. Smaller elements, damped within one wave, need steps
/// proportional to the square of their size. It is a bound of cost: a corner would be damped a
/// little less on them. The bound is at most the second constant times the base size, so that each
/// element may be halved twice.
const DAMPED: f64 = 0.5;
const DAMPED_OF_SIZE: f64 = 0.25;

/// Distance between touches, over the base size of the elements there, beyond which blocks meet
/// flush.
const FLUSH_DISTANCE: f64 = 0.25;

/// A predicted touch of two blocks.
#[derive(Clone, Debug)]
pub(crate) struct ImpactPrediction<const D: usize> {
    pub(crate) blocks: [usize; 2],
    /// True if no earlier prediction has the same node of the first block.
    pub(crate) is_first_of_node: bool,
    /// Material points of both sides, at rest, m.
    pub(crate) places: [[f64; D]; 2],
    /// Contact point, m, unit normal, and approach speed, m/s.
    pub(crate) point: [f64; D],
    pub(crate) normal: [f64; D],
    pub(crate) speed: f64,
    /// Rest of the coarse step after the touch, s: the time for which the points are unified in it.
    pub(crate) unified: f64,
    /// Base size of the elements there, m.
    pub(crate) sizes: [f64; 2],
    /// Number of halvings that these allow before there is no time level for them.
    pub(crate) halvings: [u32; 2],
    /// Mass of a node of the base mesh there, kg.
    pub(crate) masses: [f64; 2],
}

/// Refinement of two blocks at each of their predicted touches.
pub(crate) struct RefinementTarget {
    /// Sizes of elements on both sides of each touch, m.
    pub(crate) sizes: Vec<[f64; 2]>,
    /// Energy that the touches lose with these sizes, J.
    pub(crate) loss: f64,
    /// The reason why they lose more than wanted, if they do.
    pub(crate) limit: Option<RefinementLimit>,
}

/// Reason why elements are not as small as wanted. If the two sides of a touch have different
/// reasons, the first in this order is reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) enum RefinementLimit {
    /// Smaller ones would be strained beyond the elastic range: [`PRESSED`].
    Speed,
    /// Smaller ones would need much shorter steps for their damping: [`DAMPED`].
    Damping,
    /// `max_level`.
    Level,
    /// There are no more time levels.
    Step,
    /// The contact is so long or wide that there would be too many: [`MAX_ELEMENTS`].
    Crowd,
    /// No masses of a finer mesh keep the moments of inertia.
    Masses,
    /// The approach is so slow that it counts as rest.
    Rest,
    /// None: the touches have lost more than predicted.
    Prediction,
}

impl<const D: usize> ImpactPrediction<D> {
    /// Returns the length and, in 3-D, the width of the contact, m, from one end of it: the point
    /// farthest from the first.
    fn extents(all: &[Self]) -> [f64; 2] {
        let Some(first) = all.first() else {
            return [0.0; 2];
        };
        let farthest = |from: &[f64; D], aside: &dyn Fn([f64; D]) -> [f64; D]| {
            let ways = all.iter().map(|e| aside(sub(&e.point, from)));
            let longest = ways.max_by(|a, b| norm(a).total_cmp(&norm(b)));
            longest.unwrap_or([0.0; D])
        };
        let end = add(&first.point, &farthest(&first.point, &|way| way));
        let way = farthest(&end, &|way| way);
        let length = norm(&way);
        if D == 2 || length == 0.0 {
            return [length, 0.0];
        }
        let line = scale(1.0 / length, &way);
        let aside = |way| sub(&way, &scale(dot(&way, &line), &line));
        [length, norm(&farthest(&end, &aside))]
    }

    /// Returns true if faces meet flush: the touches are not all at one place or, in 3-D, along one
    /// line.
    pub(crate) fn are_flush(all: &[Self]) -> bool {
        let least = all.first().map_or(0.0, |first| {
            first.sizes[0].min(first.sizes[1]) * FLUSH_DISTANCE * (1.0 + SAME_LENGTH)
        });
        let [length, width] = Self::extents(all);
        length > least && (D == 2 || width > least)
    }
}

/// Returns the approximate number of elements of this `size`, m, and of those that grade to them,
/// for a contact of these extents, m: some layers with two triangles or six tetrahedra per cell.
fn element_estimate<const D: usize>(extents: [f64; 2], size: f64) -> f64 {
    let [across, wide] = extents.map(|extent| extent / size + LAYERS);
    if D == 2 {
        2.0 * across * LAYERS
    } else {
        6.0 * across * wide * LAYERS / 2.0
    }
}

impl<const D: usize> Adaptivity<D> {
    /// Returns the element sizes with which the touches of two blocks lose no more than the wanted
    /// fraction of the `energy` of their impact, J (design, section 6). Both sides have the same
    /// transit time of compression waves.
    pub(crate) fn refinement_target(
        &self,
        impacts: &[ImpactPrediction<D>],
        energy: f64,
    ) -> RefinementTarget {
        let points = impacts.iter().filter(|e| e.is_first_of_node).count();
        let across = (points.max(1) as f64).powf(1.0 / (D as f64 - 1.0));
        let pressed = PRESSED / across;
        let sizes_at = |level: u32| -> Vec<[f64; 2]> {
            let sizes = |e| self.sizes(e, level, pressed);
            impacts.iter().map(sizes).collect()
        };
        let extents = ImpactPrediction::extents(impacts);
        let is_too_much = |sizes: &[[f64; 2]]| {
            let sides = impacts.iter().zip(sizes).flat_map(|(e, sizes)| {
                let refined = |side: usize| sizes[side] < e.sizes[side];
                let sides = (0..2).filter(move |&side| refined(side));
                let sides = sides.filter(|&side| !self.is_prescribed(e.blocks[side]));
                sides.map(|side| sizes[side]).collect::<Vec<_>>()
            });
            element_estimate::<D>(extents, sides.fold(f64::INFINITY, f64::min)) > MAX_ELEMENTS
        };
        let finest = sizes_at(LEVELS);
        let mut sizes = sizes_at(0);
        let mut limit = None;
        let mut loss = self.loss(impacts, &sizes);
        for level in 1..=LEVELS {
            if loss <= self.energy_loss * energy {
                break;
            }
            if sizes == finest {
                limit = self.limit(impacts, &sizes, pressed);
                break;
            }
            let finer = sizes_at(level);
            if is_too_much(&finer) {
                limit = Some(RefinementLimit::Crowd);
                break;
            }
            sizes = finer;
            loss = self.loss(impacts, &sizes);
        }
        RefinementTarget { sizes, loss, limit }
    }

    /// Returns the target of touches that count as rest: the sizes of the base mesh.
    pub(crate) fn target_at_rest(&self, impacts: &[ImpactPrediction<D>]) -> RefinementTarget {
        let sizes: Vec<[f64; 2]> = impacts.iter().map(|impact| impact.sizes).collect();
        RefinementTarget {
            loss: self.loss(impacts, &sizes),
            limit: Some(RefinementLimit::Rest),
            sizes,
        }
    }

    /// Returns the element sizes on both sides, m, whose transit time is that of the slower side
    /// after `level` halvings. No size is below its least value or above its base size.
    fn sizes(&self, impact: &ImpactPrediction<D>, level: u32, pressed: f64) -> [f64; 2] {
        let ImpactPrediction { blocks, sizes, .. } = impact;
        let speed = blocks.map(|block| self.wave_speed(block));
        let transits = [sizes[0] / speed[0], sizes[1] / speed[1]];
        let moves = (0..2).filter(|&side| !self.is_prescribed(blocks[side]));
        let longest = moves.map(|side| transits[side]).fold(0.0, f64::max);
        let transit = longest * 0.5_f64.powi(level as i32);
        [0, 1].map(|side| {
            let (least, _) = self.least_size(impact, side, pressed);
            (speed[side] * transit).clamp(least, sizes[side])
        })
    }

    /// Returns the least size of elements on one side of a predicted touch, m, and its reason. If
    /// they may not be halved once, that is the base size.
    fn least_size(
        &self,
        impact: &ImpactPrediction<D>,
        side: usize,
        pressed: f64,
    ) -> (f64, RefinementLimit) {
        let (block, size) = (impact.blocks[side], impact.sizes[side]);
        let halved = |times: u32| 0.5_f64.powi(times as i32) * size;
        let length = self.contact_length(impact.blocks);
        let pressed = pressed * impact.speed / self.wave_speed(block) * length;
        let damping = self.base_model.material(block).damping.stiffness;
        let damped = DAMPED * damping * self.wave_speed(block);
        let limits = [
            (pressed, RefinementLimit::Speed),
            (damped.min(DAMPED_OF_SIZE * size), RefinementLimit::Damping),
            (halved(self.max_level), RefinementLimit::Level),
            (halved(impact.halvings[side]), RefinementLimit::Step),
        ];
        let larger =
            |a: (f64, RefinementLimit), b: (f64, RefinementLimit)| if b.0 > a.0 { b } else { a };
        let [first, rest @ ..] = limits;
        let (least, limit) = rest.into_iter().fold(first, larger);
        let least = if least > halved(1) { size } else { least };
        (least, limit)
    }

    /// Returns the reason why the `sizes`, m, cannot be smaller at the touch that loses most.
    fn limit(
        &self,
        impacts: &[ImpactPrediction<D>],
        sizes: &[[f64; 2]],
        pressed: f64,
    ) -> Option<RefinementLimit> {
        let touches = impacts.iter().zip(sizes);
        let loss = |(e, sizes): &(&ImpactPrediction<D>, &[f64; 2])| self.loss_at(e, sizes);
        let (worst, _) = touches.max_by(|a, b| loss(a).total_cmp(&loss(b)))?;
        let moves = (0..2).filter(|&side| !self.is_prescribed(worst.blocks[side]));
        let limits = moves.map(|side| self.least_size(worst, side, pressed).1);
        limits.min()
    }

    /// Returns the energy that the touches lose as their points become unified, J: the larger of
    /// the sums over the nodes of either block.
    fn loss(&self, impacts: &[ImpactPrediction<D>], sizes: &[[f64; 2]]) -> f64 {
        let of = |block: usize| {
            let touches = impacts.iter().zip(sizes);
            let own = touches.filter(|(e, _)| e.is_first_of_node && e.blocks[0] == block);
            own.map(|(e, sizes)| self.loss_at(e, sizes)).sum::<f64>()
        };
        let [a, b] = impacts.first().map_or([0; 2], |e| e.blocks);
        f64::max(of(a), of(b))
    }

    /// Returns the energy that two points lose as they become unified, (5) of the paper, J.
    fn loss_at(&self, impact: &ImpactPrediction<D>, sizes: &[f64; 2]) -> f64 {
        let inverse = |side: usize| {
            if self.is_prescribed(impact.blocks[side]) {
                return 0.0;
            }
            let halved = sizes[side] / impact.sizes[side];
            1.0 / (impact.masses[side] * halved.powi(D as i32))
        };
        0.5 * impact.speed * impact.speed / (inverse(0) + inverse(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a prediction of a touch at a point.
    fn at<const D: usize>(point: [f64; D]) -> ImpactPrediction<D> {
        ImpactPrediction {
            blocks: [0, 1],
            is_first_of_node: true,
            places: [point; 2],
            point,
            normal: [0.0; D],
            speed: 1.0,
            unified: 0.0,
            sizes: [1.0; 2],
            halvings: [0; 2],
            masses: [1.0; 2],
        }
    }

    /// The length was measured from the first touch, so it was half as long if that lay in the middle. Of
    /// other shapes than lines and rectangles the order may still matter a little.
    #[test]
    fn extents_are_measured_from_an_end() {
        let mut line = vec![at([1.0, 0.0]), at([0.0, 0.0]), at([2.0, 0.0])];
        let mut face: Vec<_> = [[2.0, 1.0], [0.0, 0.0], [4.0, 0.0], [0.0, 2.0], [4.0, 2.0]]
            .map(|[x, y]| at([x, y, 1.0]))
            .to_vec();
        let diagonal = f64::sqrt(20.0);
        for _ in 0..5 {
            line.rotate_left(1);
            face.rotate_left(1);
            let [length, width] = ImpactPrediction::extents(&face);
            assert_eq!(ImpactPrediction::extents(&line), [2.0, 0.0]);
            assert!((length - diagonal).abs() < 1e-15, "{length}");
            assert!((width - 8.0 / diagonal).abs() < 1e-15, "{width}");
        }
    }
}
