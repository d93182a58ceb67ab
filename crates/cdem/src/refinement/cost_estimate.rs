//! Estimate of the cost of a collision in advance.

use crate::math::disjoint_sets::DisjointSets;
use crate::math::vector::{add, norm, scale, sub};
use crate::mesh::Element;
use crate::model::time_levels;
use crate::refinement::adaptivity::Adaptivity;
use crate::refinement::composite_mesh;
use crate::refinement::indicator::ImpactPrediction;
use crate::refinement::refined_block::RefinedBlock;

/// Speed of the assumed collision, m/s.
pub(crate) const ASSUMED_SPEED: f64 = 1.0;

/// Estimated cost of a block in a collision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CostEstimate {
    pub(crate) block: usize,
    /// Number of its elements then; `None` if it cannot be refined.
    pub(crate) elements: Option<usize>,
    /// Element updates in a coarse step, with refinement and without.
    pub(crate) updates: [u64; 2],
}

impl<const D: usize> Adaptivity<D> {
    /// Estimates the cost of the heaviest moving block if its corner hits an equal block head on at
    /// [`ASSUMED_SPEED`].
    pub(crate) fn estimate_cost(&self) -> Option<CostEstimate> {
        let base_model = &self.base_model;
        let mass = |block: usize| -> f64 {
            let nodes = &base_model.mesh.blocks[block].nodes;
            let nodes = nodes.start as usize..nodes.end as usize;
            base_model.masses.nodal[nodes].iter().sum()
        };
        let moving = (0..base_model.mesh.blocks.len()).filter(|&block| !self.is_prescribed(block));
        let masses = moving.map(|block| (block, mass(block)));
        let (block, mass) = masses.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let impact = self.corner_hit(block);
        // Two blocks of mass m that meet head on can lose ½·(m/2)·v².
        let energy = 0.25 * mass * ASSUMED_SPEED * ASSUMED_SPEED;
        let sizes = self
            .refinement_target(std::slice::from_ref(&impact), energy)
            .sizes;
        let zone = self.zone(&impact, 0, sizes[0][0], false, 0);
        let refined_block = if zone.finest < impact.sizes[0] {
            RefinedBlock::finer(base_model, block, &[zone], None)
        } else {
            Ok(None)
        };
        let [before, _] = self.updates(block, None);
        let [updates, elements] = refined_block.as_ref().map_or([before, 0], |refined_block| {
            self.updates(block, refined_block.as_ref())
        });
        Some(CostEstimate {
            block,
            elements: refined_block.ok().map(|_| elements as usize),
            updates: [updates, before],
        })
    }

    /// Returns the number of element updates of a block in a coarse step, and the number of its
    /// elements.
    fn updates(&self, block: usize, refined_block: Option<&RefinedBlock<D>>) -> [u64; 2] {
        let base_model = &self.base_model;
        let overlay = refined_block.map(|refined_block| &refined_block.overlay);
        let mesh = composite_mesh::of_block(&base_model.mesh, block, overlay);
        let replaced = |element: &u32| overlay.is_some_and(|overlay| overlay.replaces(*element));
        let kept = base_model.mesh.blocks[block].elements.clone();
        let kept = kept.filter(|element| !replaced(element));
        let before = kept.map(|element| Some(base_model.level[element as usize]));
        let own = refined_block.map_or(&[][..], |refined_block| &refined_block.level);
        let own = own.iter().copied().chain(std::iter::repeat(None));
        let all = own.zip(before.chain(std::iter::repeat(None)));
        let levels = all.take(mesh.elements.len());
        let levels: Vec<u8> = levels
            .map(|(own, before)| own.or(before).unwrap_or_default())
            .collect();
        let joined = DisjointSets::new(mesh.nodes.len());
        let nodes_of = |element: usize| mesh.elements[element].nodes();
        let levels = time_levels::assign(&levels, nodes_of, mesh.nodes.len(), &joined);
        let updates = levels.element.iter().map(|&level| 1_u64 << level).sum();
        [updates, mesh.elements.len() as u64]
    }

    /// Returns the impact of a block on an equal one with the node farthest from its middle.
    fn corner_hit(&self, block: usize) -> ImpactPrediction<D> {
        let base_model = &self.base_model;
        let nodes = base_model.mesh.blocks[block].nodes.clone();
        let at = |node: u32| base_model.mesh.nodes[node as usize];
        let sum = nodes
            .clone()
            .fold([0.0; D], |sum, node| add(&sum, &at(node)));
        let middle = scale(1.0 / nodes.len() as f64, &sum);
        let apart = |node: u32| norm(&sub(&at(node), &middle));
        let corner = nodes.clone().max_by(|&a, &b| apart(a).total_cmp(&apart(b)));
        let corner = corner.unwrap_or(nodes.start);
        let is_there = |element: &u32| {
            let element: &Element = &base_model.mesh.elements[*element as usize];
            element.nodes().contains(&corner)
        };
        let roots = || {
            base_model.mesh.blocks[block]
                .elements
                .clone()
                .filter(is_there)
        };
        ImpactPrediction {
            blocks: [block; 2],
            is_first_of_node: true,
            places: [at(corner); 2],
            point: at(corner),
            normal: [0.0; D],
            speed: ASSUMED_SPEED,
            unified: 0.0,
            sizes: [self.base_size(roots()); 2],
            halvings: [self.halvings(roots()); 2],
            masses: [base_model.masses.nodal[corner as usize]; 2],
        }
    }
}
