//! Transfer of contacts to another mesh of the same blocks.

use crate::contact::constraint::contact_history::ContactHistory;
use crate::contact::constraint::contact_point::{ContactPoint, rotate_tangents};
use crate::contact::constraint::initial_overlap::ordered;
use crate::contact::detection::candidates::CandidateSearch;
use crate::contact::detection::clusters::Clusters;
use crate::contact::grouping::IslandIndex;
use crate::contact::island::Island;
use crate::contact::narrow_phase::feature_selection::has_one_normal;
use crate::contact::surface::{Configuration, ContactJacobian, JacobianAnchor, Pair, Surface};
use crate::contact::tolerances::{LIFT_STEPS, SLIGHT_OVERLAP};
use crate::contact::{Contacts, DriftInterval};
use crate::math::vector::{add_scaled, dot, norm, scale, sub};
use crate::mesh::Mesh;
use crate::model::block_of;
use crate::model::inverse_mass::InverseMass;

impl<const D: usize> Contacts<D> {
    /// For each node: true if these `moves` of all nodes, m, would make a feature of it
    /// penetrate another block, or leave its closed contact.
    pub(crate) fn nodes_that_disturb_contacts(
        &self,
        at: Configuration<D>,
        moves: &[[f64; D]],
    ) -> Vec<bool> {
        let resolution = self.model_data.resolution;
        let ways: Vec<f64> = moves.iter().map(norm).collect();
        let mut margins = vec![resolution; self.model_data.fixed.len()];
        for (way, &block) in ways.iter().zip(&self.model_data.block_of) {
            let margin = &mut margins[block as usize];
            *margin = margin.max(way + resolution);
        }
        let margin = |block: u32| margins[block as usize];
        let goes = |block: u32| margin(block) > resolution;
        let wanted = |[a, b]: [u32; 2]| (goes(a) || goes(b)) && self.model_data.may_touch([a, b]);
        let surface = &*self.model_data.surface;
        let clusters = &self.model_data.clusters;
        let mut closed: Vec<Pair> = self.contact_points().map(|contact| contact.pair).collect();
        closed.sort_unstable();
        let mut disturbing = vec![false; moves.len()];
        for pair in clusters.overlapping(surface, at, &margin, &wanted) {
            let sides = [
                surface.main_nodes(pair.main),
                surface.target_nodes(pair.target),
            ];
            let longest = |nodes: &[u32]| {
                let of = nodes.iter().map(|&node| ways[node as usize]);
                of.fold(0.0, f64::max)
            };
            let of_sides = sides.map(longest);
            let reach = of_sides[0] + of_sides[1] + 2.0 * resolution;
            if of_sides == [0.0; 2] || surface.distance(pair, at) > reach {
                continue;
            }
            let projection = surface.project(pair, at);
            let foot = projection.clamped_foot();
            let change = surface
                .jacobian(pair, &foot, at)
                .relative_velocity(0, moves);
            let after = projection.gap + change;
            let enters = after < projection.gap.min(0.0) - SLIGHT_OVERLAP * resolution;
            let leaves = change > resolution && closed.binary_search(&pair).is_ok();
            // Parallel edges have no gap.
            if enters || leaves || after.is_nan() {
                for (nodes, way) in sides.iter().zip(of_sides) {
                    let nodes = nodes.iter();
                    nodes.for_each(|&node| disturbing[node as usize] |= way > 0.0);
                }
            }
        }
        disturbing
    }

    /// Returns a translation of a block, in addition to these `moves` of all nodes, m, after
    /// which none of its contacts overlaps more than before. Removes the largest overlap, at
    /// most [`LIFT_STEPS`] times. Returns `None` if the translation exceeds the contact
    /// resolution.
    pub(crate) fn remove_overlap(
        &self,
        block: u32,
        at: Configuration<D>,
        moves: &[[f64; D]],
    ) -> Option<[f64; D]> {
        let of_block = self
            .contact_points()
            .filter(|contact| contact.history.blocks.contains(&block));
        let gaps = of_block.map(|contact| {
            let jacobian = contact.jacobian(&*self.model_data.surface, at);
            let main = self.model_data.surface.main_nodes(contact.pair.main)[0];
            let is_main = self.model_data.block_of[main as usize] == block;
            let out = scale(if is_main { 1.0 } else { -1.0 }, &jacobian.frame[0]);
            (jacobian.relative_velocity(0, moves), out)
        });
        let gaps: Vec<(f64, [f64; D])> = gaps.collect();
        let mut shift = [0.0; D];
        for _ in 0..LIFT_STEPS {
            let after = gaps
                .iter()
                .map(|(change, out)| (change + dot(out, &shift), out));
            match after.min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((least, out)) if least < 0.0 => add_scaled(&mut shift, -least, out),
                _ => return (norm(&shift) <= self.model_data.resolution).then_some(shift),
            }
            if norm(&shift) > self.model_data.resolution {
                return None;
            }
        }
        // The rest is round-off, or the next check finds it.
        Some(shift)
    }

    /// Transfers contacts to the `surface` of another mesh of the same blocks. A contact stays at
    /// its material point. If that point no longer exists, the contact continues as the nearest new
    /// contact of its blocks, or ends.
    pub(crate) fn remesh(
        &mut self,
        exchange: MeshExchange<D>,
        surface: Box<dyn Surface<D>>,
        inertia: &InverseMass<D>,
        time: f64,
    ) {
        // The next kick sees another surface.
        self.state.energies.penetration = self.deepest_penetration(exchange.old.at, time);
        let before = self.exchange_surface(exchange.mesh, surface);
        self.workspace.search = CandidateSearch::default();
        self.state.near_pairs.clear();
        self.state.motion_bounds.clear();
        self.state.joins.clear();
        self.workspace.islands_outdated = true;
        let all = self.state.islands.iter_mut();
        let all: Vec<ContactPoint<D>> = all
            .flat_map(|island| island.contact_points.drain(..))
            .collect();
        let carry = ContactRemap {
            before: &*before,
            after: &*self.model_data.surface,
            exchange,
        };
        let (mut kept, mut lost) = (Vec::new(), Vec::new());
        for contact in all {
            match carry.transferred(contact) {
                Ok(contact) => kept.push(contact),
                Err(of) => lost.push(of),
            }
        }
        // Of several contacts that have become one, a joint is kept if there is one.
        kept.sort_by_key(|contact| (contact.pair, !contact.is_joint));
        kept.dedup_by(|next, first| {
            let same = next.pair == first.pair;
            if same {
                self.state.ended.push(next.history.ended(time));
            }
            same
        });
        self.state.islands = vec![Island {
            contact_points: kept,
            ..Island::default()
        }];
        self.replace_lost(lost, exchange.new.at, inertia, time);
    }

    /// Replaces the surface by that of another mesh of the same blocks. Returns the old one.
    pub(crate) fn exchange_surface(
        &mut self,
        mesh: &Mesh<D>,
        surface: Box<dyn Surface<D>>,
    ) -> Box<dyn Surface<D>> {
        let before = std::mem::replace(&mut self.model_data.surface, surface);
        let nodes = mesh.nodes.len();
        self.model_data.block_of = block_of(mesh);
        self.model_data.halvings = mesh.halvings_at_nodes();
        self.model_data.clusters = Clusters::new(
            &*self.model_data.surface,
            &self.model_data.block_of,
            &mesh.nodes,
        );
        self.workspace.geometry_cache = None;
        self.workspace.index = IslandIndex::new::<D>(nodes, &[]);
        before
    }

    /// Begins contacts at the points where blocks with `lost` contacts touch. Each continues
    /// the nearest lost contact.
    fn replace_lost(
        &mut self,
        mut lost: Vec<LostContact<D>>,
        at: Configuration<D>,
        inertia: &InverseMass<D>,
        time: f64,
    ) {
        if lost.is_empty() {
            return;
        }
        let mut blocks: Vec<[u32; 2]> = lost
            .iter()
            .map(|of| ordered(of.contact.history.blocks))
            .collect();
        blocks.sort_unstable();
        blocks.dedup();
        let wanted = |pair: [u32; 2]| blocks.binary_search(&ordered(pair)).is_ok();
        let gap = |of: &LostContact<D>| of.contact.offset[0].abs();
        let within = self.model_data.resolution + lost.iter().map(gap).fold(0.0, f64::max);
        let mut pairs = self.model_data.touching_pairs(at, within, &wanted);
        let context = self.model_data.context(inertia);
        let surface = context.surface;
        pairs.retain(|&pair| has_one_normal(surface, pair, at, within));
        let island = &mut self.state.islands[0];
        let kept = island.contact_points.len();
        island.activate_pairs(&context, DriftInterval::at_rest(at), &pairs, time);
        for contact in &mut island.contact_points[kept..] {
            contact.is_new = false;
            match LostContact::nearest(&lost, contact, surface.point(contact.pair, at)) {
                Some(nearest) => contact.follow_on(&lost.swap_remove(nearest).contact),
                None => self.state.energies.touch_count += 1,
            }
        }
        self.state
            .ended
            .extend(lost.into_iter().map(|of| of.contact.history.ended(time)));
    }
}

/// A contact whose material point no longer exists.
struct LostContact<const D: usize> {
    contact: ContactPoint<D>,
    /// Position of its point, m.
    point: [f64; D],
}

impl<const D: usize> LostContact<D> {
    /// Returns the index of the contact of the same blocks that is nearest to a point, m.
    fn nearest(all: &[Self], contact: &ContactPoint<D>, point: [f64; D]) -> Option<usize> {
        let blocks = ordered(contact.history.blocks);
        let same = (0..all.len()).filter(|&i| ordered(all[i].contact.history.blocks) == blocks);
        let apart = |i: usize| norm(&sub(&all[i].point, &point));
        same.min_by(|&i, &j| apart(i).total_cmp(&apart(j)))
    }
}

impl<const D: usize> ContactPoint<D> {
    /// Continues the history of another contact, at its own point and in its own direction.
    fn follow_on(&mut self, other: &Self) {
        self.is_joint = other.is_joint;
        self.history = ContactHistory {
            area: self.history.area,
            blocks: self.history.blocks,
            ..other.history.clone()
        };
    }
}

/// Transfer of contacts from one surface to another.
struct ContactRemap<'a, const D: usize> {
    before: &'a dyn Surface<D>,
    after: &'a dyn Surface<D>,
    exchange: MeshExchange<'a, D>,
}

impl<const D: usize> ContactRemap<'_, D> {
    /// Returns the contact on the new surface, if its material point still exists there.
    fn transferred(&self, mut contact: ContactPoint<D>) -> Result<ContactPoint<D>, LostContact<D>> {
        let MeshExchange {
            old,
            new,
            mesh,
            changed,
        } = self.exchange;
        let blocks = contact.history.blocks;
        let nodes = blocks.map(|block| mesh.blocks[block as usize].nodes.clone());
        let marks = self
            .before
            .material_points(contact.pair, &contact.foot, old.rest);
        let Some((pair, foot)) = self.after.locate(&marks, nodes, new.rest) else {
            let point = self.before.point(contact.pair, old.at);
            return Err(LostContact { contact, point });
        };
        let mut after = ContactJacobian::default();
        let anchor = JacobianAnchor {
            foot: &foot,
            along: Some(&contact.normal),
        };
        self.after
            .assemble_jacobian(&mut after, pair, anchor, new.at);
        let before = contact.jacobian(self.before, old.at);
        let frames = [before.frame, after.frame];
        for vector in contact.frame_vectors() {
            *vector = rotate_tangents(vector, &frames);
        }
        if blocks.iter().any(|&block| changed[block as usize]) {
            // The new surface lies elsewhere by a little. The contact keeps its deviation, not its
            // offset: to move the blocks back would work against their pressure, and a wall of 14
            // stones gained 3 % of its energy.
            let deviation = sub(&before.offset, &contact.offset);
            let deviation = rotate_tangents(&deviation, &frames);
            contact.offset = sub(&after.offset, &deviation);
            contact.foot = foot;
        } else {
            contact.offset = rotate_tangents(&contact.offset, &frames);
        }
        (contact.pair, contact.normal) = (pair, frames[1][0]);
        Ok(contact)
    }
}

/// Exchange of the mesh of some blocks.
#[derive(Clone, Copy)]
pub(crate) struct MeshExchange<'a, const D: usize> {
    /// Configurations of the old mesh and of the new one.
    pub(crate) old: MeshConfiguration<'a, D>,
    pub(crate) new: MeshConfiguration<'a, D>,
    /// The new mesh.
    pub(crate) mesh: &'a Mesh<D>,
    /// For each block: true if its mesh has changed.
    pub(crate) changed: &'a [bool],
}

/// Configuration of a mesh: now, and at rest.
#[derive(Clone, Copy)]
pub(crate) struct MeshConfiguration<'a, const D: usize> {
    pub(crate) at: Configuration<'a, D>,
    pub(crate) rest: Configuration<'a, D>,
}
