//! Which places of which blocks are refined, and how finely.

use rayon::prelude::*;

use super::cover::Cover;
use super::foundation::Foundation;
use super::refined::refined;
use super::zone::Zone;
use crate::mesh::{Block, Mesh};
use crate::vector::norm;

/// Coarse steps between two looks whether any zone is needed no more: each change of mesh
/// costs energy, so they are seldom (design, section 3).
const SHED: u64 = 8;

/// Share of the mass of a cube of an element's size that moves with a point of its block:
/// half of the elements around a node inside would have it all.
const MOVED: f64 = 0.5;

/// Size of elements that are pressed on at a point, over that of their block and the
/// approach over the speed of compression waves, at least. Strain grows towards the point
/// as one over the distance: that of smaller elements would leave what is elastic.
const PRESSED: f64 = 8.0;

/// All overlays, and the zones that they are made for.
pub(crate) struct SecondScale<const D: usize> {
    pub(crate) foundation: Foundation<D>,
    energy_loss: f64,
    max_level: u32,
    /// How far each block is across, m.
    widths: Vec<f64>,
    zones: Vec<Vec<Zone<D>>>,
    covers: Vec<Option<Cover<D>>>,
    /// Blocks of which zones have come that their cover does not have.
    waiting: Vec<usize>,
}

/// A touch that is about to be, of two blocks.
#[derive(Clone, Debug)]
pub(crate) struct Encounter<const D: usize> {
    pub(crate) blocks: [usize; 2],
    /// Where at rest, m.
    pub(crate) places: [[f64; D]; 2],
    /// Where, m, along which unit vector and how fast the two come nearer, m/s.
    pub(crate) point: [f64; D],
    pub(crate) normal: [f64; D],
    pub(crate) speed: f64,
    /// Size of the elements there as they were before refinement, m.
    pub(crate) sizes: [f64; 2],
}

/// Another cover for a block, and the zones that it is made for.
pub(crate) struct Change<const D: usize> {
    pub(crate) block: usize,
    pub(crate) cover: Option<Cover<D>>,
    zones: Vec<Zone<D>>,
}

impl<const D: usize> SecondScale<D> {
    /// Of blocks that are as they were.
    pub(crate) fn new(foundation: Foundation<D>) -> Self {
        let contact = &foundation.scene.contact;
        let count = foundation.mesh.blocks.len();
        let width = |block: &Block| {
            let nodes = block.nodes.start as usize..block.nodes.end as usize;
            let extent = |c: usize| {
                let along = foundation.mesh.nodes[nodes.clone()].iter().map(|x| x[c]);
                let [low, high] = along.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| {
                    [a.min(x), b.max(x)]
                });
                high - low
            };
            norm(&std::array::from_fn::<f64, D, _>(extent))
        };
        Self {
            widths: foundation.mesh.blocks.iter().map(width).collect(),
            energy_loss: contact.energy_loss,
            max_level: contact.max_level,
            zones: vec![Vec::new(); count],
            covers: vec![None; count],
            waiting: Vec::new(),
            foundation,
        }
    }

    /// The cover of each block that has one.
    pub(crate) fn covers(&self) -> &[Option<Cover<D>>] {
        &self.covers
    }

    /// The mesh of all blocks with their covers.
    pub(crate) fn mesh(&self) -> Mesh<D> {
        let overlays = self.covers.iter();
        let overlays = overlays.map(|cover| cover.as_ref().map(|cover| &cover.overlay));
        refined(&self.foundation.mesh, &overlays.collect::<Vec<_>>())
    }

    /// Size of the elements before refinement among which those of `roots` are, m.
    pub(crate) fn base_size(&self, roots: impl Iterator<Item = u32>) -> f64 {
        let size = |root: u32| self.foundation.size(root);
        roots.map(size).fold(0.0, f64::max)
    }

    /// Time that compression waves take across a block, s.
    pub(crate) fn crossing(&self, block: usize) -> f64 {
        self.widths[block] / self.foundation.material(block).p_wave_speed()
    }

    /// Asks for elements as small as `finest`, m, at a place of a block until a step.
    pub(crate) fn ask(&mut self, block: usize, centre: &[f64; D], finest: f64, until: u64) {
        let mut known = self.zones[block].iter_mut();
        if let Some(zone) = known.find(|zone| zone.covers(centre, finest)) {
            zone.until = zone.until.max(until);
            return;
        }
        self.zones[block].push(Zone {
            centre: *centre,
            finest,
            until,
        });
        self.waiting.push(block);
    }

    /// Keeps the zones around a place of a block until a step.
    pub(crate) fn keep(&mut self, block: usize, centre: &[f64; D], until: u64) {
        for zone in &mut self.zones[block] {
            if zone.covers(centre, zone.finest) {
                zone.until = zone.until.max(until);
            }
        }
    }

    /// How finely both blocks of some encounters are to be refined where they meet, m, so
    /// that of the energy of their impact, ½ `speed`²/`mobility` with the inverse mass seen
    /// by both as rigid bodies, 1/kg, the touches lose no more than is wanted (design,
    /// section 6): both to the same transit time of compression waves.
    pub(crate) fn depth(&self, encounters: &[Encounter<D>], mobility: f64) -> Vec<[f64; 2]> {
        let fastest = encounters.iter().map(|e| e.speed).fold(0.0, f64::max);
        let available = 0.5 * fastest * fastest / mobility;
        let sizes_at = |level: u32| -> Vec<[f64; 2]> {
            encounters.iter().map(|e| self.sizes(e, level)).collect()
        };
        let loss = |sizes: &[[f64; 2]]| {
            let touches = encounters.iter().zip(sizes);
            touches.map(|(e, sizes)| self.loss(e, sizes)).sum::<f64>()
        };
        let mut sizes = sizes_at(0);
        for level in 1..=2 * self.max_level {
            if loss(&sizes) <= self.energy_loss * available {
                break;
            }
            sizes = sizes_at(level);
        }
        sizes
    }

    /// Sizes of the elements on both sides whose transit times are those of the slower,
    /// halved so often, m; none more often than it may be, or than it bears.
    fn sizes(&self, encounter: &Encounter<D>, level: u32) -> [f64; 2] {
        let Encounter { blocks, sizes, .. } = encounter;
        let speed = blocks.map(|block| self.foundation.material(block).p_wave_speed());
        let transits = [sizes[0] / speed[0], sizes[1] / speed[1]];
        let transit = transits[0].max(transits[1]) * 0.5_f64.powi(level as i32);
        let halved = 0.5_f64.powi(self.max_level as i32);
        [0, 1].map(|side| {
            let pressed = PRESSED * encounter.speed / speed[side] * self.widths[blocks[side]];
            let least = f64::max(halved * sizes[side], pressed).min(sizes[side]);
            (speed[side] * transit).clamp(least, sizes[side])
        })
    }

    /// What two points lose that become one, (5) of the paper, J.
    fn loss(&self, encounter: &Encounter<D>, sizes: &[f64; 2]) -> f64 {
        let inverse = |side: usize| {
            let density = self.foundation.density(encounter.blocks[side]);
            let mass = MOVED * density * sizes[side].powi(D as i32);
            if self.foundation.is_fixed(encounter.blocks[side]) {
                0.0
            } else {
                1.0 / mass
            }
        };
        0.5 * encounter.speed * encounter.speed / (inverse(0) + inverse(1))
    }

    /// The covers that may change before coarse step `number`: more zones where they have
    /// been asked for; now and then, fewer where they are needed no more.
    pub(crate) fn changes(&mut self, number: u64) -> Vec<Change<D>> {
        let mut waiting = std::mem::take(&mut self.waiting);
        waiting.sort_unstable();
        waiting.dedup();
        let wanted = if !waiting.is_empty() {
            let zones = waiting
                .into_iter()
                .map(|block| (block, self.zones[block].clone()));
            zones.collect()
        } else if number.is_multiple_of(SHED) {
            self.left(number)
        } else {
            Vec::new()
        };
        let covers = wanted.into_par_iter().map(|(block, zones)| Change {
            cover: Cover::new(&self.foundation, block, &zones),
            block,
            zones,
        });
        let covers: Vec<Change<D>> = covers.collect();
        let (differ, same): (Vec<_>, Vec<_>) = covers.into_iter().partition(|c| self.differs(c));
        for change in same {
            self.zones[change.block] = change.zones;
        }
        differ
    }

    /// The zones that are still needed, of blocks of which some are not.
    fn left(&self, number: u64) -> Vec<(usize, Vec<Zone<D>>)> {
        let is_needed = |zone: &&Zone<D>| zone.until >= number;
        let blocks = self.zones.iter().enumerate();
        let blocks = blocks.filter(|(_, zones)| !zones.iter().all(|zone| is_needed(&zone)));
        blocks
            .map(|(block, zones)| (block, zones.iter().filter(is_needed).copied().collect()))
            .collect()
    }

    /// Whether a change is one.
    fn differs(&self, change: &Change<D>) -> bool {
        let old = self.covers[change.block].as_ref();
        let [old, new] =
            [old, change.cover.as_ref()].map(|cover| cover.map(|c| &c.overlay.elements));
        old != new
    }

    /// Gives a block another cover; returns the old one.
    pub(crate) fn exchange(&mut self, change: Change<D>) -> Option<Cover<D>> {
        self.zones[change.block] = change.zones;
        std::mem::replace(&mut self.covers[change.block], change.cover)
    }
}
