//! The coarse step and the time level of each element, from their stable steps (design, section 3).

use std::ops::Range;

use rayon::prelude::*;

use crate::element::mass::{MassKind, Masses};
use crate::element::{ElementSet, stable_step};
use crate::math::disjoint_sets::DisjointSets;
use crate::math::vector::pad;
use crate::mesh::{Mesh, MeshBlock};
use crate::model::time_levels::{self, level_of};
use crate::model::{BlockData, ModelError};
use crate::scene::Scene;

/// Largest number of steps of a run. Beyond it the number is no exact float.
const MAX_STEPS: f64 = 9e15;

/// Upper bound of the safety where a step near the stability limit does harm. There, an element
/// whose level changes adds energy (a thousand changes: 1 % at 0.5, growth without bound at 0.8).
/// And a block of few nodes has all its vibrations near the limit: 16 to 24 % too fast at safety
/// 0.8 to 0.9, 5 % at 0.5.
pub(crate) const SAFETY_NEAR_LIMIT: f64 = 0.5;

/// Number of elements that a thread takes at once.
const ELEMENTS_AT_ONCE: usize = 256;

/// Stable steps of the elements, from which the coarse step and the levels are chosen.
pub(crate) struct TimeStepChoice {
    /// Stable step of each element, s: its own, or that of its block if the mass matrix is dense.
    /// Infinite in fixed blocks.
    limit: Vec<f64>,
    /// Safety of each element: the fraction of the stable step in use.
    safety_of: Vec<f64>,
    safety: f64,
    /// Elements of the blocks that move and whose mass matrix is dense.
    dense: Vec<Range<usize>>,
}

impl TimeStepChoice {
    /// Computes the stable steps of the elements of all blocks.
    ///
    /// # Errors
    /// If the stable step of an element is not a positive number.
    pub(crate) fn new<const D: usize>(
        mesh: &Mesh<D>,
        sets: &[Box<dyn ElementSet<D>>],
        masses: &Masses,
        blocks: &[BlockData],
        safety: f64,
    ) -> Result<Self, ModelError> {
        let count = mesh.elements.len();
        let mut pace = Self {
            limit: vec![f64::INFINITY; count],
            safety_of: vec![safety; count],
            safety,
            dense: Vec::new(),
        };
        let lumped = |e: usize| {
            let block = mesh
                .blocks
                .partition_point(|b| b.elements.end as usize <= e);
            let dense = blocks[block].mass_kind == MassKind::Consistent;
            (!dense && !blocks[block].fixed).then_some(&blocks[block])
        };
        for set in sets {
            let elements = set.mesh_elements();
            let limit = |(i, &e): (usize, &u32)| {
                let block = lumped(e as usize)?;
                let omega = set.frequency(i, &masses.factor);
                Some(stable_step(omega, block.damping.stiffness))
            };
            let each = elements
                .par_iter()
                .enumerate()
                .with_min_len(ELEMENTS_AT_ONCE);
            let limits: Vec<Option<f64>> = each.map(limit).collect();
            for (&e, limit) in elements.iter().zip(limits) {
                if let Some(limit) = limit {
                    pace.limit[e as usize] = limit;
                }
            }
        }
        for dense in &masses.consistent {
            let block = &blocks[dense.block as usize];
            let range = &mesh.blocks[dense.block as usize].elements;
            let elements = range.start as usize..range.end as usize;
            if !block.fixed {
                let omega = dense.frequency(mesh, sets);
                pace.limit[elements.clone()].fill(stable_step(omega, block.damping.stiffness));
                pace.safety_of[elements.clone()].fill(safety.min(SAFETY_NEAR_LIMIT));
                pace.dense.push(elements);
            }
        }
        pace.refuse_unstable(mesh, blocks)?;
        Ok(pace)
    }

    /// Returns an error if an element of a moving block has no positive, finite stable step.
    fn refuse_unstable<const D: usize>(
        &self,
        mesh: &Mesh<D>,
        blocks: &[BlockData],
    ) -> Result<(), ModelError> {
        let moving = mesh.blocks.iter().zip(blocks);
        for (block, _) in moving.filter(|(_, data)| !data.fixed) {
            let mut elements = block.elements.clone();
            let stable =
                |e: u32| self.limit[e as usize].is_finite() && self.limit[e as usize] > 0.0;
            if let Some(element) = elements.find(|&e| !stable(e)) {
                let node = mesh.elements[element as usize].nodes()[0];
                return Err(ModelError::Unstable {
                    key: format!("block[{}].material", block.source),
                    block: block.name.clone(),
                    element: element - block.elements.start,
                    at: pad(&mesh.nodes[node as usize]),
                    limit: self.limit[element as usize],
                });
            }
        }
        Ok(())
    }

    /// Returns the steps that elements will take, up to powers of two, s. Blocks in contact take
    /// the finest level among them. Blocks with dense matrices are small and mostly in contact, so
    /// all of them take the finest step among them.
    fn steps_in_use(&self) -> Vec<f64> {
        let steps = self.limit.iter().zip(&self.safety_of);
        let mut steps: Vec<f64> = steps.map(|(limit, safety_of)| limit * safety_of).collect();
        let small = self.dense.iter().cloned().flatten();
        let finest = small.map(|e| steps[e]).fold(f64::INFINITY, f64::min);
        for elements in &self.dense {
            steps[elements.clone()].fill(finest);
        }
        steps.retain(|step| step.is_finite());
        steps
    }

    /// Returns the largest and the smallest stable step of moving blocks, s.
    pub(crate) fn extremes(&self) -> [f64; 2] {
        let finite = self.limit.iter().filter(|limit| limit.is_finite());
        finite.fold([0.0_f64, f64::INFINITY], |[high, low], &limit| {
            [high.max(limit), low.min(limit)]
        })
    }

    /// Returns the smallest stable step in each block, s; infinite in fixed ones.
    pub(crate) fn shortest<const D: usize>(&self, mesh: &Mesh<D>) -> Vec<f64> {
        let shortest = |block: &MeshBlock| {
            let elements = block.elements.start as usize..block.elements.end as usize;
            let limits = self.limit[elements].iter().copied();
            limits.fold(f64::INFINITY, f64::min)
        };
        mesh.blocks.iter().map(shortest).collect()
    }

    /// Chooses the coarse step, s, and the number of steps, and writes the step to the scene.
    pub(crate) fn choose_step(&self, scene: &mut Scene) -> Result<(f64, u64), ModelError> {
        let end = scene.time.end;
        let cheapest = || cheapest_step(self.steps_in_use());
        let wanted = scene.time.step.unwrap_or_else(cheapest).min(end);
        // A step that divides the end up to round-off is taken as it is.
        let count = (end / wanted * (1.0 - 1e-12)).ceil().max(1.0);
        if count > MAX_STEPS {
            return Err(ModelError::TooManySteps {
                count,
                step: wanted,
                end,
            });
        }
        let step = end / count;
        scene.time.step = Some(step);
        Ok((step, count as u64))
    }

    /// Returns the level of each element by its own stable step.
    pub(crate) fn levels<const D: usize>(
        mut self,
        mesh: &Mesh<D>,
        step: f64,
    ) -> Result<Vec<u8>, ModelError> {
        let surface = surface_elements(mesh);
        loop {
            let levels = self.levels_now(mesh, step)?;
            let nodes = mesh.nodes.len();
            let own = |e: usize| mesh.elements[e].nodes();
            let used = time_levels::assign(&levels, own, nodes, &DisjointSets::new(nodes)).element;
            // Finest level on the boundary of each block: contact may raise other elements to it.
            let finest: Vec<u8> = mesh
                .blocks
                .iter()
                .map(|block| {
                    let at_surface = block.elements.clone().filter(|&e| surface[e as usize]);
                    let of = |e: u32| used[e as usize];
                    at_surface.map(of).max().unwrap_or(0)
                })
                .collect();
            let top = finest.iter().copied().max().unwrap_or(0);
            let alone = finest.iter().filter(|&&level| level == top).count() == 1;
            let lower = finest.iter().copied().filter(|&level| level < top);
            let second = lower.max().unwrap_or(0);
            let mut changed = false;
            for (block, own) in mesh.blocks.iter().zip(finest) {
                let other = if own == top && alone { second } else { top };
                for e in block.elements.clone().map(|e| e as usize) {
                    let may_change = surface[e] && levels[e] < other && self.limit[e].is_finite();
                    if may_change && self.safety_of[e] > SAFETY_NEAR_LIMIT {
                        self.safety_of[e] = self.safety.min(SAFETY_NEAR_LIMIT);
                        changed = true;
                    }
                }
            }
            if !changed {
                return Ok(levels);
            }
        }
    }

    fn levels_now<const D: usize>(&self, mesh: &Mesh<D>, step: f64) -> Result<Vec<u8>, ModelError> {
        let mut levels = vec![0; self.limit.len()];
        for block in &mesh.blocks {
            for e in block.elements.clone() {
                let (limit, safety_of) = (self.limit[e as usize], self.safety_of[e as usize]);
                levels[e as usize] = level_of(step, safety_of * limit).ok_or_else(|| {
                    let node = mesh.elements[e as usize].nodes()[0];
                    ModelError::TooFine {
                        block: block.name.clone(),
                        element: e - block.elements.start,
                        at: pad(&mesh.nodes[node as usize]),
                        limit,
                        needed: (step / (safety_of * limit)).log2().ceil() as u32,
                        step,
                    }
                })?;
            }
        }
        Ok(levels)
    }
}

/// Returns true for each element that has a node on the boundary of its block.
fn surface_elements<const D: usize>(mesh: &Mesh<D>) -> Vec<bool> {
    let mut on_surface = vec![false; mesh.nodes.len()];
    for &facet in &*mesh.boundary_facets() {
        for node in mesh.facet_nodes(facet) {
            on_surface[node as usize] = true;
        }
    }
    let elements = mesh.elements.iter();
    elements
        .map(|element| {
            element
                .nodes()
                .iter()
                .any(|&node| on_surface[node as usize])
        })
        .collect()
}

/// Returns the coarse step, s, of at most the largest of `allowed`, that needs the fewest element
/// updates per second. It counts levels alone, without the buffer layer. Levels are powers of two,
/// so only the steps within one octave differ.
fn cheapest_step(mut allowed: Vec<f64>) -> f64 {
    let largest = allowed.iter().copied().fold(0.0, f64::max);
    // Step of each element, doubled into the octave below the largest, and its substeps per such
    // step.
    let mut weight = 0.0;
    let mut octave: Vec<(f64, f64)> = Vec::with_capacity(allowed.len());
    for step in allowed.drain(..) {
        let mut in_octave = step;
        let mut substeps = 1.0;
        while in_octave <= 0.5 * largest {
            in_octave *= 2.0;
            substeps *= 2.0;
        }
        octave.push((in_octave, substeps));
        weight += substeps;
    }
    octave.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best = (f64::INFINITY, largest);
    let mut start = 0;
    while start < octave.len() {
        // Elements below this step need twice the substeps; those at it do not.
        let step = octave[start].0;
        let cost = weight / step;
        if cost <= best.0 * (1.0 + 1e-12) {
            best = (cost, step);
        }
        while start < octave.len() && octave[start].0 <= step {
            weight += octave[start].1;
            start += 1;
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::cheapest_step;

    #[test]
    fn the_cheapest_step_spares_the_many_a_finer_level() {
        assert_eq!(cheapest_step(vec![1.0]), 1.0);
        // One element is slightly stiffer than the rest: all take its step.
        assert_eq!(cheapest_step(vec![1.0, 0.99, 0.99]), 0.99);
        // One element is much stiffer: it takes two substeps.
        assert_eq!(cheapest_step(vec![1.0, 1.0, 1.0, 0.6]), 1.0);
        // An octave lower costs the same: 0.5 is two substeps of 1.
        assert_eq!(cheapest_step(vec![1.0, 0.5, 0.25]), 1.0);
        // Nine elements at 0.49 take two substeps of 0.98.
        let mut many = vec![0.49; 9];
        many.push(1.0);
        assert_eq!(cheapest_step(many), 0.98);
    }
}
