//! What a collision will cost, before there is one.

use super::cover::Cover;
use super::depth::Encounter;
use super::second_scale::SecondScale;
use crate::mesh::Element;
use crate::vector::{add, norm, scale, sub};

/// Speed of the collision that is foreseen, m/s.
pub(crate) const SPEED: f64 = 1.0;

/// A block in a collision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Foreseen {
    pub(crate) block: usize,
    /// Its elements then.
    pub(crate) elements: usize,
    /// Their updates in a coarse step, and those of the block as it is.
    pub(crate) updates: u64,
    pub(crate) updates_before: u64,
}

impl<const D: usize> SecondScale<D> {
    /// What becomes of the heaviest block that moves where its corner hits its like, head on
    /// and at [`SPEED`].
    pub(crate) fn foresee(&self) -> Option<Foreseen> {
        let foundation = &self.foundation;
        let nodes = |block: usize| {
            let nodes = &foundation.mesh.blocks[block].nodes;
            nodes.start as usize..nodes.end as usize
        };
        let mass = |block: usize| -> f64 { foundation.masses.nodal[nodes(block)].iter().sum() };
        let moving = (0..foundation.mesh.blocks.len()).filter(|&block| !self.is_still(block));
        let block = moving.max_by(|&a, &b| mass(a).total_cmp(&mass(b)))?;
        let encounter = self.corner_hit(block);
        // Two of mass m that meet head on have ½·(m/2)·v² to lose.
        let energy = 0.25 * mass(block) * SPEED * SPEED;
        let sizes = self.depth(std::slice::from_ref(&encounter), energy).sizes;
        let zone = self.zone(&encounter, 0, sizes[0][0], false, 0);
        let cover = if zone.finest < encounter.sizes[0] {
            Cover::finer(foundation, block, &[zone], None).flatten()
        } else {
            None
        };
        let elements = foundation.mesh.blocks[block].elements.clone();
        let before = elements.clone().map(|e| foundation.level[e as usize]);
        let updates = |levels: &mut dyn Iterator<Item = u8>| levels.map(|level| 1 << level).sum();
        let (after, updates_after) = match &cover {
            None => (elements.len(), updates(&mut before.clone())),
            Some(cover) => {
                let kept = elements.filter(|&e| !cover.overlay.replaces(e));
                let kept = kept.map(|e| foundation.level[e as usize]);
                let all = cover
                    .level
                    .iter()
                    .zip(kept.map(Some).chain(std::iter::repeat(None)));
                let mut levels = all.filter_map(|(own, before)| own.or(before));
                (cover.level.len(), updates(&mut levels))
            }
        };
        Some(Foreseen {
            block,
            elements: after,
            updates: updates_after,
            updates_before: updates(&mut before.clone()),
        })
    }

    /// A block that is about to touch its like with its node that is farthest from its middle.
    fn corner_hit(&self, block: usize) -> Encounter<D> {
        let foundation = &self.foundation;
        let nodes = foundation.mesh.blocks[block].nodes.clone();
        let at = |node: u32| foundation.mesh.nodes[node as usize];
        let sum = nodes
            .clone()
            .fold([0.0; D], |sum, node| add(&sum, &at(node)));
        let middle = scale(1.0 / nodes.len() as f64, &sum);
        let apart = |node: u32| norm(&sub(&at(node), &middle));
        let corner = nodes.clone().max_by(|&a, &b| apart(a).total_cmp(&apart(b)));
        let corner = corner.unwrap_or(nodes.start);
        let is_there = |element: &u32| {
            let element: &Element = &foundation.mesh.elements[*element as usize];
            element.nodes().contains(&corner)
        };
        let roots = || {
            foundation.mesh.blocks[block]
                .elements
                .clone()
                .filter(is_there)
        };
        Encounter {
            blocks: [block; 2],
            is_first_of_node: true,
            places: [at(corner); 2],
            point: at(corner),
            normal: [0.0; D],
            speed: SPEED,
            unified: 0.0,
            sizes: [self.base_size(roots()); 2],
            halvings: [self.halvings(roots()); 2],
            masses: [foundation.masses.nodal[corner as usize]; 2],
        }
    }
}
