//! How finely two blocks are refined where they are about to touch (design, section 6).

use serde::{Deserialize, Serialize};

use crate::math::vector::{dot, norm, scale, sub};
use crate::refinement::adaptivity::Adaptivity;

/// Halvings of the coarser side after which both are as fine as they may be, however they
/// differ: there are no more time levels.
const LEVELS: u32 = 64;

/// Layers of small elements between what touches and elements that are larger by as much as
/// they may, about.
const LAYERS: f64 = 8.0;

/// Elements of a block at one touch, about, from which on it is made no finer: of faces that
/// meet flush in space, each halving would take four times as many.
const CROWD: f64 = 8192.0;

/// Size of elements that are pressed on at a point, over that of their block and the
/// approach over the speed of compression waves, at least. Strain grows towards the point
/// as one over the distance: that of smaller elements would leave what is elastic.
const PRESSED: f64 = 8.0;

/// Size of elements over the way of compression waves in the time of damping in proportion to
/// stiffness, at least: smaller ones, damped within a wave, need steps as the square of their
/// size. It is a bound of cost: a corner would be damped a little less on them. Over the size of
/// the elements before refinement no more than that is asked for, so that each may be halved
/// twice.
const DAMPED: f64 = 0.5;
const DAMPED_OF_SIZE: f64 = 0.25;

/// Distance between touches over the size of the elements there before refinement, from
/// which on blocks meet flush.
const FLUSH: f64 = 0.25;

/// A touch that is about to be, of two blocks.
#[derive(Clone, Debug)]
pub(crate) struct ImpactPrediction<const D: usize> {
    pub(crate) blocks: [usize; 2],
    /// Whether no encounter before it is of the same node of the first block.
    pub(crate) is_first_of_node: bool,
    /// Where at rest, m.
    pub(crate) places: [[f64; D]; 2],
    /// Where, m, along which unit vector and how fast the two come nearer, m/s.
    pub(crate) point: [f64; D],
    pub(crate) normal: [f64; D],
    pub(crate) speed: f64,
    /// What is left of the coarse step after they touch, s: for that long their points are
    /// one in it.
    pub(crate) unified: f64,
    /// Size of the elements there as they were before refinement, m.
    pub(crate) sizes: [f64; 2],
    /// How often these may be halved before there is no time level for them.
    pub(crate) halvings: [u32; 2],
    /// What mass a node there had then, kg.
    pub(crate) masses: [f64; 2],
}

/// How finely two blocks are to be refined at each of their encounters.
pub(crate) struct RefinementTarget {
    /// Sizes of elements on both sides of each, m.
    pub(crate) sizes: Vec<[f64; 2]>,
    /// What the touches lose then, J.
    pub(crate) loss: f64,
    /// What keeps them from losing as little as is wanted.
    pub(crate) limit: Option<RefinementLimit>,
}

/// What keeps elements from being as small as is wanted. Where each side of an encounter has
/// its own reason, the first in this order is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) enum RefinementLimit {
    /// Finer ones would be strained beyond what is elastic: [`PRESSED`].
    Speed,
    /// Finer ones would need much shorter steps for their damping: [`DAMPED`].
    Damping,
    /// `max_level`.
    Level,
    /// There are no more time levels.
    Step,
    /// What touches is so long or wide that there would be too many: [`CROWD`].
    Crowd,
    /// Finer meshes have no masses that keep the moments of inertia.
    Masses,
}

impl<const D: usize> ImpactPrediction<D> {
    /// How long and, in space, how wide what touches is, m.
    fn extents(all: &[Self]) -> [f64; 2] {
        let Some(first) = all.first() else {
            return [0.0; 2];
        };
        let farthest = |aside: &dyn Fn([f64; D]) -> [f64; D]| {
            let ways = all.iter().map(|e| aside(sub(&e.point, &first.point)));
            let longest = ways.max_by(|a, b| norm(a).total_cmp(&norm(b)));
            longest.map_or((0.0, [0.0; D]), |way| (norm(&way), way))
        };
        let (length, way) = farthest(&|way| way);
        if D == 2 || length == 0.0 {
            return [length, 0.0];
        }
        let line = scale(1.0 / length, &way);
        let (width, _) = farthest(&|way| sub(&way, &scale(dot(&way, &line), &line)));
        [length, width]
    }

    /// Whether some are of faces that meet flush: not all at one place or, in space, along
    /// one line.
    pub(crate) fn are_flush(all: &[Self]) -> bool {
        let least = all
            .first()
            .map_or(0.0, |first| first.sizes[0].min(first.sizes[1]) * FLUSH);
        let [length, width] = Self::extents(all);
        length > least && (D == 2 || width > least)
    }
}

/// About how many elements of some `size`, m, and what leads to them are around what is so
/// long and so wide, m: some layers of two triangles or six tetrahedra a cell.
fn crowd<const D: usize>(extents: [f64; 2], size: f64) -> f64 {
    let [across, wide] = extents.map(|extent| extent / size + LAYERS);
    if D == 2 {
        2.0 * across * LAYERS
    } else {
        6.0 * across * wide * LAYERS / 2.0
    }
}

impl<const D: usize> Adaptivity<D> {
    /// How finely two blocks are to be refined where they meet, so that of the energy of
    /// their impact, J, the touches lose no more than is wanted (design, section 6): both to
    /// the same transit time of compression waves.
    pub(crate) fn depth(
        &self,
        encounters: &[ImpactPrediction<D>],
        energy: f64,
    ) -> RefinementTarget {
        let points = encounters.iter().filter(|e| e.is_first_of_node).count();
        let across = (points.max(1) as f64).powf(1.0 / (D as f64 - 1.0));
        let pressed = PRESSED / across;
        let sizes_at = |level: u32| -> Vec<[f64; 2]> {
            let sizes = |e| self.sizes(e, level, pressed);
            encounters.iter().map(sizes).collect()
        };
        let extents = ImpactPrediction::extents(encounters);
        let is_too_much = |sizes: &[[f64; 2]]| {
            let sides = encounters.iter().zip(sizes).flat_map(|(e, sizes)| {
                let refined = |side: usize| sizes[side] < e.sizes[side];
                let sides = (0..2).filter(move |&side| refined(side));
                let sides = sides.filter(|&side| !self.is_still(e.blocks[side]));
                sides.map(|side| sizes[side]).collect::<Vec<_>>()
            });
            crowd::<D>(extents, sides.fold(f64::INFINITY, f64::min)) > CROWD
        };
        let finest = sizes_at(LEVELS);
        let mut sizes = sizes_at(0);
        let mut limit = None;
        let mut loss = self.loss(encounters, &sizes);
        for level in 1..=LEVELS {
            if loss <= self.energy_loss * energy {
                break;
            }
            if sizes == finest {
                limit = self.limit(encounters, &sizes, pressed);
                break;
            }
            let finer = sizes_at(level);
            if is_too_much(&finer) {
                limit = Some(RefinementLimit::Crowd);
                break;
            }
            sizes = finer;
            loss = self.loss(encounters, &sizes);
        }
        RefinementTarget { sizes, loss, limit }
    }

    /// Sizes of the elements on both sides whose transit times are those of the slower,
    /// halved so often, m; none more often than it may be, or than it bears.
    fn sizes(&self, encounter: &ImpactPrediction<D>, level: u32, pressed: f64) -> [f64; 2] {
        let ImpactPrediction { blocks, sizes, .. } = encounter;
        let speed = blocks.map(|block| self.wave_speed(block));
        let transits = [sizes[0] / speed[0], sizes[1] / speed[1]];
        let moves = (0..2).filter(|&side| !self.is_still(blocks[side]));
        let longest = moves.map(|side| transits[side]).fold(0.0, f64::max);
        let transit = longest * 0.5_f64.powi(level as i32);
        [0, 1].map(|side| {
            let (least, _) = self.least_size(encounter, side, pressed);
            (speed[side] * transit).clamp(least, sizes[side])
        })
    }

    /// The least size of elements on one side of an encounter, m, and why; where they may not be
    /// halved once, their own.
    fn least_size(
        &self,
        encounter: &ImpactPrediction<D>,
        side: usize,
        pressed: f64,
    ) -> (f64, RefinementLimit) {
        let (block, size) = (encounter.blocks[side], encounter.sizes[side]);
        let halved = |times: u32| 0.5_f64.powi(times as i32) * size;
        let pressed = pressed * encounter.speed / self.wave_speed(block) * self.widths[block];
        let damping = self.base_model.material(block).damping.stiffness;
        let damped = DAMPED * damping * self.wave_speed(block);
        let limits = [
            (pressed, RefinementLimit::Speed),
            (damped.min(DAMPED_OF_SIZE * size), RefinementLimit::Damping),
            (halved(self.max_level), RefinementLimit::Level),
            (halved(encounter.halvings[side]), RefinementLimit::Step),
        ];
        let larger =
            |a: (f64, RefinementLimit), b: (f64, RefinementLimit)| if b.0 > a.0 { b } else { a };
        let [first, rest @ ..] = limits;
        let (least, limit) = rest.into_iter().fold(first, larger);
        let least = if least > halved(1) { size } else { least };
        (least, limit)
    }

    /// Why elements of the least `sizes`, m, are no smaller where they lose most.
    fn limit(
        &self,
        encounters: &[ImpactPrediction<D>],
        sizes: &[[f64; 2]],
        pressed: f64,
    ) -> Option<RefinementLimit> {
        let touches = encounters.iter().zip(sizes);
        let loss = |(e, sizes): &(&ImpactPrediction<D>, &[f64; 2])| self.loss_at(e, sizes);
        let (worst, _) = touches.max_by(|a, b| loss(a).total_cmp(&loss(b)))?;
        let moves = (0..2).filter(|&side| !self.is_still(worst.blocks[side]));
        let limits = moves.map(|side| self.least_size(worst, side, pressed).1);
        limits.min()
    }

    /// What the points of two blocks lose that become one, J: as seen from that of the two
    /// of which more nodes do.
    fn loss(&self, encounters: &[ImpactPrediction<D>], sizes: &[[f64; 2]]) -> f64 {
        let of = |block: usize| {
            let touches = encounters.iter().zip(sizes);
            let own = touches.filter(|(e, _)| e.is_first_of_node && e.blocks[0] == block);
            own.map(|(e, sizes)| self.loss_at(e, sizes)).sum::<f64>()
        };
        let [a, b] = encounters.first().map_or([0; 2], |e| e.blocks);
        f64::max(of(a), of(b))
    }

    /// What two points lose that become one, (5) of the paper, J.
    fn loss_at(&self, encounter: &ImpactPrediction<D>, sizes: &[f64; 2]) -> f64 {
        let inverse = |side: usize| {
            if self.is_still(encounter.blocks[side]) {
                return 0.0;
            }
            let halved = sizes[side] / encounter.sizes[side];
            1.0 / (encounter.masses[side] * halved.powi(D as i32))
        };
        0.5 * encounter.speed * encounter.speed / (inverse(0) + inverse(1))
    }
}
