//! Refinement zones: their places and element sizes, and the overlays built for them.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::math::format::{quantity, short, significant};
use crate::math::vector::{add, norm, scale, sub};
use crate::mesh::{Mesh, MeshBlock};
use crate::model::time_levels::MAX_LEVEL;
use crate::refinement::base_model::BaseModel;
use crate::refinement::composite_mesh::refined;
use crate::refinement::impact_history::{Approach, LossyImpacts};
use crate::refinement::indicator::{ImpactPrediction, RefinementLimit, RefinementTarget};
use crate::refinement::refined_block::RefinedBlock;
use crate::refinement::state::AdaptivityState;
use crate::refinement::zone::{FLUSH_GRADING, GRADING, SAME_LENGTH, Zone};
use crate::scene::ZoneExtent;

/// Coarse steps between two checks for zones that are no longer needed. Each change of mesh costs
/// energy, so the checks are rare (design, section 3).
const COARSENING_INTERVAL: u64 = 8;

/// Levels by which simplices cut from an element may lie above it before they are halved. The worst
/// shape of bisected tetrahedra has 0.3 of the element's step, and careful steps are half of that.
const SIMPLEX_LEVELS: u32 = 3;

/// Mass of a node inside a face of its block, and of one on a straight edge in 3-D, over that of a
/// node inside the block.
const ON_FACE: f64 = 0.5;
const ON_EDGE: f64 = 0.25;

/// Overlays per task, in 2-D and 3-D. One in 2-D takes no longer than waking a thread.
const IN_A_ROW: [usize; 2] = [8, 1];

/// All overlays, and the zones for which they are built.
pub(crate) struct Adaptivity<const D: usize> {
    pub(crate) base_model: BaseModel<D>,
    pub(super) energy_loss: f64,
    pub(super) max_level: u32,
    extent: ZoneExtent,
    /// Size of each block, m: twice the largest distance of a node from their mean.
    pub(super) sizes: Vec<f64>,
    /// Refined block of each block that has an overlay, built from the zones of the state.
    pub(super) refined_blocks: Vec<Option<RefinedBlock<D>>>,
    pub(super) state: AdaptivityState<D>,
}

/// A new overlay for a block, or its removal, and the zones for which it is built.
pub(crate) struct BlockChange<const D: usize> {
    pub(crate) block: usize,
    pub(crate) refined_block: Option<RefinedBlock<D>>,
    /// Displacements of its nodes after a coarsening, m.
    pub(crate) displacement: Option<Vec<[f64; D]>>,
    zones: Vec<Zone<D>>,
}

/// A node at a predicted impact.
pub(crate) struct ImpactNode<const D: usize> {
    pub(crate) block: usize,
    /// Its number in the block.
    pub(crate) number: usize,
    /// Position at rest, m.
    pub(crate) rest: [f64; D],
    /// In 3-D, true on an edge of the block.
    pub(crate) is_on_edge: bool,
}

/// Builds a new overlay for a block in place of an old one, if possible.
type RefineBlock<const D: usize> = fn(
    &BaseModel<D>,
    usize,
    &[Zone<D>],
    Option<&RefinedBlock<D>>,
) -> Result<Option<RefinedBlock<D>>, RefinementLimit>;

impl<const D: usize> Adaptivity<D> {
    /// Returns the adaptivity of blocks without refinement.
    pub(crate) fn new(base_model: BaseModel<D>) -> Self {
        let contact = &base_model.scene.contact;
        let count = base_model.mesh.blocks.len();
        // Unlike the diagonal of a box along the axes, this does not depend on how a block lies.
        let size = |block: &MeshBlock| {
            let nodes = block.nodes.start as usize..block.nodes.end as usize;
            let nodes = &base_model.mesh.nodes[nodes];
            let sum = nodes.iter().fold([0.0; D], |sum, x| add(&sum, x));
            let middle = scale(1.0 / nodes.len() as f64, &sum);
            let farthest = nodes.iter().map(|x| norm(&sub(x, &middle)));
            2.0 * farthest.fold(0.0, f64::max)
        };
        Self {
            sizes: base_model.mesh.blocks.iter().map(size).collect(),
            energy_loss: contact.energy_loss,
            max_level: contact.max_level,
            extent: contact.zone,
            refined_blocks: vec![None; count],
            state: AdaptivityState::new(count),
            base_model,
        }
    }

    /// Returns the refined block of each block that has an overlay.
    pub(crate) fn refined_blocks(&self) -> &[Option<RefinedBlock<D>>] {
        &self.refined_blocks
    }

    /// Returns the mesh of all blocks with their overlays.
    pub(crate) fn mesh(&self) -> Mesh<D> {
        let overlays = self.refined_blocks.iter();
        let overlays = overlays.map(|refined_block| {
            refined_block
                .as_ref()
                .map(|refined_block| &refined_block.overlay)
        });
        refined(&self.base_model.mesh, &overlays.collect::<Vec<_>>())
    }

    /// Returns the size of the largest base element among `roots`, m.
    pub(crate) fn base_size(&self, roots: impl Iterator<Item = u32>) -> f64 {
        let size = |root: u32| self.base_model.size(root);
        roots.map(size).fold(0.0, f64::max)
    }

    /// Returns the number of halvings of the elements `roots` for which time levels exist.
    pub(crate) fn halvings(&self, roots: impl Iterator<Item = u32>) -> u32 {
        let level = |root: u32| u32::from(self.base_model.level[root as usize]) + SIMPLEX_LEVELS;
        let finest = roots.map(level).max().unwrap_or_default();
        u32::from(MAX_LEVEL).saturating_sub(finest)
    }

    /// Returns the mass of the base-mesh node in the place of `target`, kg. If there is none,
    /// returns the typical mass of a node inside a face (in 3-D, maybe on an edge) among elements
    /// like those of `roots`.
    pub(crate) fn base_mass(
        &self,
        target: &ImpactNode<D>,
        roots: impl Iterator<Item = u32>,
    ) -> f64 {
        let fraction = if target.is_on_edge { ON_EDGE } else { ON_FACE };
        let nodes = &self.base_model.mesh.blocks[target.block].nodes;
        let node = nodes.start as usize + target.number;
        let is_there = |node: usize| {
            let apart = norm(&sub(&self.base_model.mesh.nodes[node], &target.rest));
            apart <= SAME_LENGTH * self.sizes[target.block]
        };
        if target.number < nodes.len() && is_there(node) {
            return self.base_model.masses.nodal[node];
        }
        let of_cells = roots.map(|root| self.base_model.cell_mass(target.block, root));
        fraction * of_cells.fold(0.0, f64::max)
    }

    pub(super) fn wave_speed(&self, block: usize) -> f64 {
        self.base_model.material(block).p_wave_speed()
    }

    /// Returns true if a block is fixed or all its nodes are prescribed.
    pub(crate) fn is_prescribed(&self, block: usize) -> bool {
        self.state.is_prescribed[block]
    }

    /// Sets, for each block, if it is fixed or all its nodes are prescribed.
    pub(crate) fn set_prescribed(&mut self, of_blocks: impl Iterator<Item = bool>) {
        self.state.is_prescribed.clear();
        self.state.is_prescribed.extend(of_blocks);
    }

    /// Returns the blocks with an energy debt.
    pub(crate) fn blocks_in_debt(&self) -> Vec<usize> {
        let blocks = 0..self.state.energy_debts.len();
        blocks
            .filter(|&block| self.state.energy_debts[block] > 0.0)
            .collect()
    }

    /// Returns the sum of all energy debts, J.
    pub(crate) fn energy_in_debt(&self) -> f64 {
        self.state.energy_debts.iter().sum()
    }

    /// Returns the energy debt of a block, J.
    pub(crate) fn energy_debt(&self, block: usize) -> f64 {
        self.state.energy_debts[block]
    }

    /// Adds energy that a change of level or a position correction has made in a block, J.
    pub(crate) fn add_energy_debt(&mut self, block: usize, energy: f64) {
        self.state.energy_debts[block] += energy;
    }

    /// Drops the energy that such changes have taken from blocks in a coarse step. A later change
    /// must not give it back: that would be a gain from nothing.
    pub(crate) fn forget_credit(&mut self) {
        for debt in &mut self.state.energy_debts {
            *debt = debt.max(0.0);
        }
    }

    /// Returns the length that governs the contact of two blocks, m: the size of the smaller
    /// one. The larger one takes part up to about that distance only, as a half-space would. Blocks
    /// that are prescribed do not count. Infinite if both are.
    pub(crate) fn contact_length(&self, blocks: [usize; 2]) -> f64 {
        let lengths = self.moving(blocks).map(|block| self.sizes[block]);
        lengths.fold(f64::INFINITY, f64::min)
    }

    /// Returns the speed of compression waves in the slower of two blocks, m/s. Blocks that are
    /// prescribed do not count. Infinite if both are.
    pub(crate) fn contact_wave_speed(&self, blocks: [usize; 2]) -> f64 {
        let speeds = self.moving(blocks).map(|block| self.wave_speed(block));
        speeds.fold(f64::INFINITY, f64::min)
    }

    /// Returns the transit time of a contact, s: that of compression waves over its length in the
    /// slower of the two blocks.
    pub(crate) fn contact_transit(&self, blocks: [usize; 2]) -> f64 {
        self.contact_length(blocks) / self.contact_wave_speed(blocks)
    }

    /// Returns the fraction of a speed below which a touch with all its energy loses less than
    /// `energy_loss` of the energy at that speed.
    pub(crate) fn slight_speed_ratio(&self) -> f64 {
        self.energy_loss.sqrt()
    }

    /// Returns those of two blocks that are not prescribed.
    fn moving(&self, blocks: [usize; 2]) -> impl Iterator<Item = usize> {
        blocks
            .into_iter()
            .filter(|&block| !self.is_prescribed(block))
    }

    /// Requests elements of these `sizes`, m, on both sides of a predicted impact until the step
    /// `until`. Sizes that are no smaller than those of the base mesh request nothing.
    pub(crate) fn request_zone(
        &mut self,
        impact: &ImpactPrediction<D>,
        sizes: [f64; 2],
        is_flush: bool,
        until: u64,
    ) {
        for (side, finest) in sizes.into_iter().enumerate() {
            let block = impact.blocks[side];
            if finest >= impact.sizes[side] || self.is_prescribed(block) {
                continue;
            }
            let zone = self.zone(impact, side, finest, is_flush, until);
            if self.state.zones_refused[block]
                .iter()
                .any(|known| known.covers(&zone))
            {
                let blocks = impact.blocks.map(|block| block as u32);
                self.state
                    .impact_history
                    .refuse(blocks, block, self.state.why_refused[block]);
                continue;
            }
            let mut known = self.state.zones[block].iter_mut();
            match known.find(|known| known.covers(&zone)) {
                Some(known) => known.until = known.until.max(until),
                None => {
                    self.state.zones[block].push(zone);
                    self.state.waiting_blocks.push(block);
                }
            }
        }
    }

    /// Returns the zone on one side of a predicted impact.
    pub(super) fn zone(
        &self,
        impact: &ImpactPrediction<D>,
        side: usize,
        finest: f64,
        is_flush: bool,
        until: u64,
    ) -> Zone<D> {
        Zone {
            centre: impact.places[side],
            radius: match self.extent {
                ZoneExtent::Graded => 0.0,
                ZoneExtent::Wavefront => self.wave_speed(impact.blocks[side]) * impact.unified,
            },
            finest,
            grading: if is_flush && D == 2 {
                FLUSH_GRADING
            } else {
                GRADING
            },
            until,
        }
    }

    /// Keeps the zones around a place of a block until the step `until`. If the contact has slid
    /// out of all of them (by `slip` in all and in a step, m), a copy of the finest one is added
    /// there.
    pub(crate) fn keep(&mut self, block: usize, centre: &[f64; D], slip: [f64; 2], until: u64) {
        let (mut is_inside, mut left) = (false, None::<Zone<D>>);
        for zone in &mut self.state.zones[block] {
            if zone.has(centre) {
                zone.until = zone.until.max(until);
                is_inside = true;
            } else if zone.is_left_by(centre, slip)
                && left.is_none_or(|left| zone.finest < left.finest)
            {
                let centre = *centre;
                left = Some(Zone {
                    centre,
                    until,
                    ..*zone
                });
            }
        }
        if let Some(zone) = left.filter(|_| !is_inside) {
            self.state.zones[block].push(zone);
            self.state.waiting_blocks.push(block);
        }
    }

    /// Records an impact of two blocks until the step `until`, with the energy of one of its
    /// touches, J. Returns the energy of the impact.
    pub(crate) fn record_impact(&mut self, blocks: [u32; 2], energy: f64, until: u64) -> f64 {
        self.state
            .impact_history
            .record_energy(blocks, energy, until)
    }

    /// Allows zones of a block until the step `until`, if they are needed so long.
    pub(crate) fn keep_until(&mut self, block: usize, until: u64) {
        self.state.kept_until[block] = self.state.kept_until[block].max(until);
    }

    /// Continues the impact of two blocks, if there is one, until the step `until`.
    pub(crate) fn continue_impact(&mut self, blocks: [u32; 2], until: u64) {
        self.state.impact_history.go_on(blocks, until);
    }

    /// Records the refinement target of the impact of two blocks.
    pub(crate) fn record_target(
        &mut self,
        blocks: [u32; 2],
        target: &RefinementTarget,
        approach: Approach,
    ) {
        self.state
            .impact_history
            .record_target(blocks, target, approach);
    }

    /// Adds losses of pairs at first touches, J, to their impacts.
    pub(crate) fn record_losses(&mut self, losses: impl Iterator<Item = ([u32; 2], f64)>) {
        self.state.impact_history.record_losses(losses);
    }

    /// Returns true while an impact of two blocks goes on.
    pub(crate) fn has_impact(&self, blocks: [u32; 2]) -> bool {
        self.state.impact_history.has_impact(blocks)
    }

    /// Records that two blocks touch, which counts until the step `until`.
    pub(crate) fn record_touch(&mut self, blocks: [u32; 2], until: u64) {
        self.state.impact_history.record_touch(blocks, until);
    }

    /// Returns true if two blocks have touched lately.
    pub(crate) fn has_touched(&self, blocks: [u32; 2]) -> bool {
        self.state.impact_history.has_touched(blocks)
    }

    /// Returns warnings for the user: the impacts that have lost more than `energy_loss`, and the
    /// reasons.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let lossy = self.state.impact_history.lossy(self.energy_loss);
        let lossy = lossy.into_iter();
        lossy
            .map(|(limit, found)| self.warning(limit, &found))
            .collect()
    }

    /// Returns the warnings whose reason is new since the last call, of impacts that have ended.
    pub(crate) fn take_new_warnings(&mut self) -> Vec<String> {
        let new = self.state.impact_history.take_new();
        new.iter()
            .map(|(limit, found)| self.warning(*limit, found))
            .collect()
    }

    /// Returns the warning of impacts that have lost too much for one reason.
    fn warning(&self, limit: RefinementLimit, found: &LossyImpacts) -> String {
        let name = |block: u32| &self.base_model.mesh.blocks[block as usize].name;
        let [a, b] = found.blocks.map(name);
        // An impact that goes on gets more energy than that of its approach.
        let lost = if found.loss_fraction > 1.0 {
            "more than the energy of their approach".to_owned()
        } else {
            format!("{} %", significant(100.0 * found.loss_fraction, 3))
        };
        format!(
            "number of impacts that lost more than {} % (`energy_loss`) of their energy at first \
             touches: {}; {} (first of them: \"{a}\" and \"{b}\" at t = {}, at {} m/s, lost {lost})",
            short(100.0 * self.energy_loss),
            found.count,
            self.reason(limit),
            quantity(found.approach.time, "s"),
            significant(found.approach.speed, 3)
        )
    }

    /// Returns the reason of a limit, and what to try.
    fn reason(&self, limit: RefinementLimit) -> String {
        let reason = match limit {
            RefinementLimit::Speed => {
                "at these speeds, strains of smaller elements would leave the elastic range"
            }
            RefinementLimit::Damping => {
                "stiffness-proportional damping of smaller elements would need much shorter steps"
            }
            RefinementLimit::Level => return format!("`max_level` is {}", self.max_level),
            RefinementLimit::Step => {
                return format!(
                    "smaller elements need shorter steps than 1/{} of the coarse step: try a \
                     smaller `time.step`",
                    1 << MAX_LEVEL
                );
            }
            RefinementLimit::Crowd => "long or wide touches would need too many elements",
            RefinementLimit::Masses if self.max_level < 2 => {
                return format!(
                    "with `max_level` = {}, refined blocks have too few nodes to keep their \
                     moments of inertia: set it to 2, use finer meshes, or set mass = \"lumped\"",
                    self.max_level
                );
            }
            RefinementLimit::Masses => {
                "the masses of smaller elements could not keep the moments of inertia: use finer \
                 meshes of these blocks"
            }
            RefinementLimit::Rest => {
                "touches so slow, or after so short a fall, count as rest and are not refined: if \
                 they matter, use finer meshes of these blocks, or a smaller `time.step`"
            }
            RefinementLimit::Prediction => {
                "their touches took more than predicted: try a smaller `energy_loss`, or finer \
                 meshes of these blocks"
            }
        };
        reason.to_owned()
    }

    /// Returns the overlays that may change before coarse step `number`: finer ones for blocks with
    /// new zones, and, if this is the `first` call of a step, every [`COARSENING_INTERVAL`] steps coarser ones for
    /// blocks with zones that are no longer needed.
    pub(crate) fn changes(&mut self, number: u64, first: bool) -> Vec<BlockChange<D>> {
        self.state.impact_history.end(number, self.energy_loss);
        let mut waiting: Vec<usize> = self.state.waiting_blocks.drain(..).collect();
        waiting.sort_unstable();
        waiting.dedup();
        let with = |&block: &usize| (block, self.state.zones[block].clone());
        let more = waiting.iter().map(with).collect();
        let (mut changes, refused) = self.refined_blocks_for(more, RefinedBlock::finer);
        self.state.impact_history.refine(&waiting, &refused);
        for (&block, &limit) in &refused {
            self.state.why_refused[block] = limit;
            let new = self.state.zones[block].split_off(self.state.zones_made[block]);
            self.state.zones_refused[block].extend(new);
        }
        if first && number.is_multiple_of(COARSENING_INTERVAL) {
            for refused in &mut self.state.zones_refused {
                refused.retain(|zone| zone.until >= number);
            }
            let mut fewer = self.left(number);
            fewer.retain(|(block, _)| waiting.binary_search(block).is_err());
            changes.extend(self.refined_blocks_for(fewer, RefinedBlock::coarser).0);
        }
        let (differ, same): (Vec<_>, Vec<_>) = changes.into_iter().partition(|c| self.differs(c));
        for change in same {
            self.take_zones(change.block, change.zones);
        }
        differ
    }

    /// Builds new overlays of blocks, each independent of the others. Returns the changes, and the
    /// limits of the blocks that cannot have one.
    fn refined_blocks_for(
        &self,
        zones: Vec<(usize, Vec<Zone<D>>)>,
        make: RefineBlock<D>,
    ) -> (Vec<BlockChange<D>>, BTreeMap<usize, RefinementLimit>) {
        let change = |(block, zones): (usize, Vec<Zone<D>>)| {
            let refined_block = make(
                &self.base_model,
                block,
                &zones,
                self.refined_blocks[block].as_ref(),
            );
            let change = refined_block.map(|refined_block| BlockChange {
                block,
                refined_block,
                displacement: None,
                zones,
            });
            change.map_err(|limit| (block, limit))
        };
        let made: Vec<Result<BlockChange<D>, (usize, RefinementLimit)>> = zones
            .into_par_iter()
            .with_min_len(IN_A_ROW[D - 2])
            .map(change)
            .collect();
        let (mut changes, mut refused) = (Vec::new(), BTreeMap::new());
        for made in made {
            match made {
                Ok(change) => changes.push(change),
                Err((block, limit)) => drop(refused.insert(block, limit)),
            }
        }
        (changes, refused)
    }

    /// Returns the zones that are still needed, for blocks with zones that are not.
    fn left(&self, number: u64) -> Vec<(usize, Vec<Zone<D>>)> {
        let blocks = self
            .state
            .zones
            .iter()
            .zip(&self.state.kept_until)
            .enumerate();
        let left = blocks.filter_map(|(block, (zones, &stays))| {
            let needed = zones.iter().filter(|zone| zone.until.min(stays) >= number);
            let needed: Vec<Zone<D>> = needed.copied().collect();
            (needed.len() < zones.len()).then_some((block, needed))
        });
        left.collect()
    }

    /// Returns true if the overlay of a block changes.
    fn differs(&self, change: &BlockChange<D>) -> bool {
        let old = self.refined_blocks[change.block].as_ref();
        let [old, new] = [old, change.refined_block.as_ref()]
            .map(|refined_block| refined_block.map(|c| &c.overlay.elements));
        old != new
    }

    /// Records the zones that the overlay of a block has.
    fn take_zones(&mut self, block: usize, zones: Vec<Zone<D>>) {
        self.state.zones_made[block] = zones.len();
        self.state.zones[block] = zones;
        self.state.zones_refused[block].clear();
    }

    /// Sets the overlay of a block; returns the old one.
    pub(crate) fn exchange(&mut self, change: BlockChange<D>) -> Option<RefinedBlock<D>> {
        self.take_zones(change.block, change.zones);
        let halvings = change
            .refined_block
            .as_ref()
            .map(RefinedBlock::uniform_halvings);
        self.state.uniform_halvings[change.block] = halvings;
        std::mem::replace(&mut self.refined_blocks[change.block], change.refined_block)
    }
}
