//! Adaptivity in time: blocks are refined before they collide and coarsened after it (design,
//! section 6; \[Li2015\], section 5). This module decides where, when and how finely.

use std::collections::BTreeSet;

use crate::contact::Contacts;
use crate::contact::constraint::initial_overlap::ordered;
use crate::contact::prediction::PredictedImpact;
use crate::math::profile::Stage;
use crate::math::vector::{add_scaled, norm, scale};
use crate::mesh::Mesh;
use crate::model::positions::Positions;
use crate::refinement::{
    Adaptivity, Approach, BlockChange, ImpactNode, ImpactPrediction, MeshTransfer, RigidModes,
};
use crate::step::Run;

/// Horizon of the impact prediction, in coarse steps. A velocity changes by less than half in one
/// step, unless another collision comes in between.
const PREDICTION_HORIZON: f64 = 1.5;

/// Maximum number of searches for contacts of new nodes on refined faces in one step.
const MAX_ROUNDS: usize = 8;

/// The approach of two blocks that have touched lately is rest up to the speed that gravity adds in
/// this many coarse steps: resting contacts open and close at such speeds.
const RESTING_STEPS: f64 = 4.0;

/// It is rest, too, up to the speed that gravity adds in this many transit times of the contact. A
/// collision lasts two: a wave goes through the smaller block and back. A slower approach gets more
/// momentum from gravity in that time than it brings, so it is a load that gravity puts on, not an
/// impact.
const SETTLING_TRANSITS: f64 = 2.0;

/// Duration for which a touch counts as lately, over the transit time of the contact: that in which
/// gravity brings a block back that has left at the speed of settling.
const LATELY_TRANSITS: f64 = 2.0 * SETTLING_TRANSITS;

/// It is rest, too, up to this speed, over the speed of compression waves: the strain of such an
/// impact. Blocks that loads or plates press together open and close at such speeds, without
/// gravity.
const SLIGHT_STRAIN: f64 = 1e-6;

/// Duration for which a contact counts as an impact, over its transit time: two round trips of
/// waves through the smaller block.
const IMPACT_TRANSITS: f64 = 4.0;

/// Duration for which a zone is kept while its blocks touch elsewhere, and after they have
/// separated, over the same transit time.
const ZONE_TRANSITS: f64 = 1.0;
const SEPARATED_TRANSITS: f64 = 0.25;

/// Fraction of its energy up to which an energy debt of a block is dropped, and fraction of the
/// free mobility of two blocks up to which both count as prescribed: round-off.
pub(super) const ROUND_OFF: f64 = 1e-12;

impl<const D: usize> Run<D> {
    /// Section 6: repays energy debts, refines blocks that are about to collide, and coarsens
    /// others. Returns the energy residual before the first change, J, or `None` if nothing has
    /// changed.
    pub(crate) fn refine(&mut self) -> Option<f64> {
        self.adaptivity.as_ref()?;
        if !self.workspace.speed_bounds.is_physical() {
            return None;
        }
        let mut adaptivity = self.adaptivity.take()?;
        adaptivity.set_prescribed(self.prescribed_blocks());
        let mut before = None;
        for block in adaptivity.blocks_in_debt() {
            let debt = adaptivity.energy_debt(block);
            if debt > ROUND_OFF * self.energy_of(block) {
                before.get_or_insert_with(|| self.balance());
                let paid = self.repay_energy(block, debt);
                adaptivity.add_energy_debt(block, -paid);
            } else {
                adaptivity.add_energy_debt(block, -debt);
            }
        }
        adaptivity.forget_credit();
        for round in 0..MAX_ROUNDS {
            self.request_zones(&mut adaptivity);
            let changes = adaptivity.changes(self.state.number, round == 0);
            let changes = self.without_lost_contacts(&adaptivity, changes);
            if changes.is_empty() {
                break;
            }
            before.get_or_insert_with(|| self.balance());
            self.remesh(&mut adaptivity, changes);
            self.watch.lap(Stage::Refinement);
            self.find_contacts();
        }
        self.adaptivity = Some(adaptivity);
        before
    }

    /// Returns the mesh without refinement.
    pub(crate) fn base_mesh(&self) -> &Mesh<D> {
        let adaptivity = self.adaptivity.as_ref();
        adaptivity.map_or(&self.model.mesh, |adaptivity| &adaptivity.base_model.mesh)
    }

    /// Returns the number of refined blocks.
    pub(crate) fn refined_blocks(&self) -> u64 {
        let refined_blocks = self.adaptivity.iter().flat_map(Adaptivity::refined_blocks);
        refined_blocks
            .filter(|refined_block| refined_block.is_some())
            .count() as u64
    }

    /// Returns the changes without those coarsenings that would move a surface into a neighbour or
    /// away from it, or that would need more energy than the block has.
    fn without_lost_contacts(
        &self,
        adaptivity: &Adaptivity<D>,
        changes: Vec<BlockChange<D>>,
    ) -> Vec<BlockChange<D>> {
        let Some(contacts) = self.contacts.as_ref().filter(|_| !changes.is_empty()) else {
            return changes;
        };
        let at = self.model.positions(&self.state);
        let mut moves = vec![[0.0; D]; self.model.mesh.nodes.len()];
        let can_be = |change: BlockChange<D>| {
            self.with_displacements(adaptivity, change, contacts, &mut moves)
        };
        let mut changes: Vec<BlockChange<D>> = changes.into_iter().filter_map(can_be).collect();
        if changes.iter().any(|change| change.displacement.is_some()) {
            let disturbing = contacts.nodes_that_disturb_contacts(at.into(), &moves);
            changes.retain(|change| !disturbing[self.model.nodes(change.block)].contains(&true));
        }
        changes
    }

    /// Returns a change with its displacements, and writes the moves of the nodes, m. Returns
    /// `None` if a coarsening would need more energy than the block has. If no node has to stay in
    /// place, the block is lifted off the neighbours that its faces would penetrate as they become
    /// plane.
    fn with_displacements(
        &self,
        adaptivity: &Adaptivity<D>,
        mut change: BlockChange<D>,
        contacts: &Contacts<D>,
        moves: &mut [[f64; D]],
    ) -> Option<BlockChange<D>> {
        let (block, refined_block) = (change.block, change.refined_block.as_ref());
        let (base_model, old) = (
            &adaptivity.base_model,
            adaptivity.refined_blocks()[block].as_ref(),
        );
        let transfer = MeshTransfer::between(old, refined_block, base_model.lame(block))?;
        if transfer.is_finer() {
            return Some(change);
        }
        let nodes = self.model.nodes(block);
        let own = &self.state.displacement[nodes.clone()];
        let kept = transfer.kept(&self.prescribed_components(block));
        let masses =
            [old, refined_block].map(|refined_block| base_model.nodal_masses(block, refined_block));
        let mut after = transfer.smoothed(own, &kept, masses);
        moves[nodes.clone()].copy_from_slice(&transfer.moves(own, &after));
        if !kept.contains(&true) {
            let at = self.model.positions(&self.state);
            let lift = contacts.remove_overlap(block as u32, at.into(), moves);
            for moved in after.iter_mut().chain(&mut moves[nodes.clone()]) {
                add_scaled(moved, 1.0, &lift.unwrap_or([0.0; D]));
            }
        }
        let strain_energy = base_model.strain_energy(block, refined_block, &after);
        if self.rigid_energy_of(block) + strain_energy > self.energy_of(block) {
            moves[nodes].fill([0.0; D]);
            return None;
        }
        change.displacement = Some(after);
        Some(change)
    }

    /// Returns the energy residual, J, for an initial energy of zero.
    pub(crate) fn balance(&mut self) -> f64 {
        // The report overwrites the data of the last kick, which the search uses.
        let last_kick = self.state.last_kick.clone();
        let state = self.synchronise();
        let balance = self.energy_balance(&state).residual(0.0);
        self.state.last_kick = last_kick;
        balance
    }

    /// Requests zones where blocks are about to collide, and keeps zones at impacts.
    fn request_zones(&mut self, adaptivity: &mut Adaptivity<D>) {
        let Some(contacts) = &self.contacts else {
            return;
        };
        let at = self.model.positions(&self.state).into();
        let rest = Positions::at_rest(&self.model.mesh.nodes).into();
        let (velocity, horizon) = (&self.state.velocity, PREDICTION_HORIZON * self.model.step);
        let predicted = &mut self.workspace.predicted_impacts;
        contacts.predict_impacts(at, velocity, rest, horizon, predicted);
        self.request_zones_at_contacts(adaptivity, contacts);
    }

    /// Does this for predicted impacts and for closed pairs.
    fn request_zones_at_contacts(&self, adaptivity: &mut Adaptivity<D>, contacts: &Contacts<D>) {
        let at = self.model.positions(&self.state).into();
        let rest = Positions::at_rest(&self.model.mesh.nodes).into();
        let velocity = &self.state.velocity;
        for (blocks, places) in self.workspace.predicted_impacts.by_blocks() {
            self.request_zones_for_impact(adaptivity, blocks, places);
        }
        for place in contacts.touching_pairs(at, velocity, rest) {
            self.keep_zones_at(adaptivity, &place);
        }
    }

    /// Keeps the zones at a closed pair while its contact is an impact, and records the touch.
    fn keep_zones_at(&self, adaptivity: &mut Adaptivity<D>, place: &PredictedImpact<D>) {
        let blocks = ordered(place.blocks);
        let transit = adaptivity.contact_transit(blocks.map(|block| block as usize));
        if !transit.is_finite() {
            return;
        }
        let since = place.since.unwrap_or_default();
        if since > 0.0 && !adaptivity.has_touched(blocks) && !adaptivity.has_impact(blocks) {
            self.record_unforeseen(adaptivity, place);
        }
        adaptivity.record_touch(blocks, self.until(LATELY_TRANSITS * transit));
        if self.time() - since > IMPACT_TRANSITS * transit {
            return;
        }
        let until = self.until(ZONE_TRANSITS * transit);
        adaptivity.continue_impact(blocks, until);
        let slip = [place.slip, place.slip_rate * self.model.step];
        for (block, rest) in place.blocks.iter().zip(&place.rest) {
            adaptivity.keep(*block as usize, rest, slip, until);
            adaptivity.keep_until(*block as usize, self.until(SEPARATED_TRANSITS * transit));
        }
    }

    /// Records a first touch that no prediction has seen, after a fall of a step or two.
    fn record_unforeseen(&self, adaptivity: &mut Adaptivity<D>, place: &PredictedImpact<D>) {
        let blocks = ordered(place.blocks);
        let speed = self.rest_speed(adaptivity, blocks);
        let place = PredictedImpact {
            speed,
            ..place.clone()
        };
        self.record_rest(adaptivity, blocks, &[place], [speed; 2]);
    }

    /// Returns the number of the coarse step that is `duration` seconds from now.
    fn until(&self, duration: f64) -> u64 {
        self.state.number + (duration / self.model.step).ceil() as u64 + 1
    }

    /// Returns the approach speed up to which a touch of two blocks is rest, m/s. After a free
    /// flight that is the speed of a fall as short as the prediction: longer falls are impacts.
    fn rest_speed(&self, adaptivity: &Adaptivity<D>, blocks: [u32; 2]) -> f64 {
        let gravity = norm(&self.model.gravity_at(self.time()));
        if !adaptivity.has_touched(blocks) {
            return gravity * PREDICTION_HORIZON * self.model.step;
        }
        let blocks = blocks.map(|block| block as usize);
        let settling = SETTLING_TRANSITS * adaptivity.contact_transit(blocks);
        let of_gravity = gravity * settling.max(RESTING_STEPS * self.model.step);
        of_gravity.max(SLIGHT_STRAIN * adaptivity.contact_wave_speed(blocks))
    }

    /// Requests zones for the predicted impacts of two blocks, unless these are at rest.
    fn request_zones_for_impact(
        &self,
        adaptivity: &mut Adaptivity<D>,
        blocks: [u32; 2],
        places: &[PredictedImpact<D>],
    ) {
        let transit = adaptivity.contact_transit(blocks.map(|block| block as usize));
        if !transit.is_finite() {
            return;
        }
        let rest_speed = self.rest_speed(adaptivity, blocks);
        let fastest = places.iter().map(|place| place.speed).fold(0.0, f64::max);
        if fastest <= rest_speed {
            self.record_rest(adaptivity, blocks, places, [fastest, rest_speed]);
            return;
        }
        let impacts = self.impact_predictions(adaptivity, places, rest_speed);
        let Some(mobility) = self.mobility(&impacts) else {
            return;
        };
        let until = self.until(ZONE_TRANSITS * transit);
        let energy = adaptivity.record_impact(blocks, 0.5 * fastest * fastest / mobility, until);
        let target = adaptivity.refinement_target(&impacts, energy);
        adaptivity.record_target(blocks, &target, self.approach_at(places, fastest));
        let are_flush = ImpactPrediction::are_flush(&impacts);
        for (impact, sizes) in impacts.iter().zip(target.sizes) {
            adaptivity.request_zone(impact, sizes, are_flush, until);
        }
        for block in blocks {
            adaptivity.keep_until(block as usize, self.until(SEPARATED_TRANSITS * transit));
        }
    }

    /// Records touches that are rest, so that a run can tell of their losses. They belong to the
    /// impact that goes on. If there is none, they are compared with the energy at the speed of rest.
    /// Far below that speed they cannot matter. Blocks that have touched lately lie, roll or slide:
    /// gravity feeds the losses of their touches.
    fn record_rest(
        &self,
        adaptivity: &mut Adaptivity<D>,
        blocks: [u32; 2],
        places: &[PredictedImpact<D>],
        [fastest, rest_speed]: [f64; 2],
    ) {
        if fastest <= adaptivity.slight_speed_ratio() * rest_speed {
            return;
        }
        let transit = adaptivity.contact_transit(blocks.map(|block| block as usize));
        let until = self.until(ZONE_TRANSITS * transit);
        if adaptivity.has_impact(blocks) {
            adaptivity.continue_impact(blocks, until);
            return;
        }
        if adaptivity.has_touched(blocks) {
            return;
        }
        let impacts = self.impact_predictions(adaptivity, places, 0.0);
        let Some(mobility) = self.mobility(&impacts) else {
            return;
        };
        let energy = 0.5 * rest_speed * rest_speed / mobility;
        adaptivity.record_impact(blocks, energy, until);
        let target = adaptivity.target_at_rest(&impacts);
        adaptivity.record_target(blocks, &target, self.approach_at(places, fastest));
    }

    /// Returns when two blocks first touch at these places, with their largest approach speed, m/s.
    fn approach_at(&self, places: &[PredictedImpact<D>], speed: f64) -> Approach {
        let times = places.iter();
        let times = times.map(|place| place.since.unwrap_or(self.time() + place.wait));
        let time = times.fold(f64::INFINITY, f64::min);
        Approach { time, speed }
    }

    /// Returns the impact predictions of the places that approach faster than `slowest`, m/s.
    fn impact_predictions(
        &self,
        adaptivity: &Adaptivity<D>,
        places: &[PredictedImpact<D>],
        slowest: f64,
    ) -> Vec<ImpactPrediction<D>> {
        let mut nodes = BTreeSet::new();
        let places = places.iter().filter(|place| place.speed > slowest);
        let prediction = |place: &PredictedImpact<D>| ImpactPrediction {
            is_first_of_node: nodes.insert(place.nodes[0]),
            ..self.impact_prediction(adaptivity, place)
        };
        places.map(prediction).collect()
    }

    /// Returns the impact prediction of a contact site: sizes, masses and halvings of its elements.
    fn impact_prediction(
        &self,
        adaptivity: &Adaptivity<D>,
        place: &PredictedImpact<D>,
    ) -> ImpactPrediction<D> {
        let root = |element: u32| {
            let parts = self.model.mesh.parts.as_ref();
            parts.map_or(element, |parts| parts.root[element as usize])
        };
        let around = |node: u32| {
            self.workspace
                .adjacency
                .of(node)
                .iter()
                .map(|&element| root(element))
        };
        let blocks = place.blocks.map(|block| block as usize);
        let sizes = place.nodes.map(|node| adaptivity.base_size(around(node)));
        let halvings = place.nodes.map(|node| adaptivity.halvings(around(node)));
        let mass = |side: usize| {
            let node = ImpactNode {
                block: blocks[side],
                number: place.nodes[side] as usize - self.model.nodes(blocks[side]).start,
                rest: place.rest[side],
                is_on_edge: place.are_edges[side],
            };
            adaptivity.base_mass(&node, around(place.nodes[side]))
        };
        ImpactPrediction {
            blocks,
            masses: [mass(0), mass(1)],
            is_first_of_node: true,
            places: place.rest,
            point: place.point,
            normal: place.normal,
            speed: place.speed,
            unified: self.model.step - place.wait % self.model.step,
            sizes,
            halvings,
        }
    }

    /// Returns the inverse effective mass of both blocks as rigid bodies at the mean point of the
    /// predicted impacts, along their mean normal, 1/kg; `None` without impacts.
    fn mobility(&self, impacts: &[ImpactPrediction<D>]) -> Option<f64> {
        let first = impacts.first()?;
        let count = impacts.len() as f64;
        let (mut point, mut normal) = ([0.0; D], [0.0; D]);
        for impact in impacts {
            add_scaled(&mut point, 1.0 / count, &impact.point);
            let sign = if impact.blocks == first.blocks {
                1.0
            } else {
                -1.0
            };
            add_scaled(&mut normal, sign, &impact.normal);
        }
        let normal = if norm(&normal) > 0.0 {
            scale(1.0 / norm(&normal), &normal)
        } else {
            first.normal
        };
        let of_both = |is_free: bool| {
            let of = |&block: &usize| self.rigid_mobility(block, &point, &normal, is_free);
            first.blocks.iter().map(of).sum::<f64>()
        };
        let constrained = of_both(false);
        if !first.blocks.iter().any(|&block| self.has_prescribed(block)) {
            return Some(constrained);
        }
        // Two blocks that are both prescribed where they meet collide by their elasticity.
        let free = of_both(true);
        Some(if constrained > ROUND_OFF * free {
            constrained
        } else {
            free
        })
    }

    /// Returns the inverse effective mass of a rigid block at a point along a direction, 1/kg. If
    /// it `is_free`, prescribed components are ignored.
    fn rigid_mobility(
        &self,
        block: usize,
        point: &[f64; D],
        normal: &[f64; D],
        is_free: bool,
    ) -> f64 {
        if self.model.blocks[block].fixed {
            return 0.0;
        }
        let at = self.model.positions(&self.state);
        let nodes = self.model.nodes(block);
        let points: Vec<[f64; D]> = nodes.clone().map(|node| at.at(node as u32)).collect();
        let body = self.body(block, &points);
        let (_, centre) = body.centre();
        let prescribed = if is_free {
            vec![[false; D]; points.len()]
        } else {
            self.prescribed_components(block)
        };
        RigidModes::new(&body, centre, &prescribed).mobility(point, normal)
    }

    /// For each block, returns true if it is fixed or all its nodes are prescribed.
    fn prescribed_blocks(&self) -> impl Iterator<Item = bool> + '_ {
        let is_prescribed = move |block: usize| {
            let inertia = &self.model.inertia;
            self.model.blocks[block].fixed
                || self
                    .model
                    .nodes(block)
                    .all(|node| inertia.is_prescribed(node))
        };
        (0..self.model.blocks.len()).map(is_prescribed)
    }
}
