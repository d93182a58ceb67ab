//! Transfer of nodal and element data of a block to another mesh of it.

use std::ops::Range;

use crate::math::vector::{add_scaled, scale, sub};
use crate::refinement::forest::Lineage;
use crate::refinement::prolongation::Prolongation;
use crate::refinement::refined_block::RefinedBlock;

/// Transfer from one mesh of a block to a finer or a coarser one.
pub(crate) struct MeshTransfer<'a, const D: usize> {
    prolongation: Prolongation<'a, D>,
    is_finer: bool,
    /// λ and μ of the block, Pa.
    lame: [f64; 2],
}

impl<'a, const D: usize> MeshTransfer<'a, D> {
    /// Builds the transfer; a mesh that is `None` is the base mesh. Returns `None` if neither mesh
    /// is a refinement of the other.
    pub(crate) fn between(
        old: Option<&'a RefinedBlock<D>>,
        new: Option<&'a RefinedBlock<D>>,
        lame: [f64; 2],
    ) -> Option<Self> {
        let overlay = |refined_block: Option<&'a RefinedBlock<D>>| {
            refined_block.map(|refined_block| &refined_block.overlay)
        };
        let [old, new] = [old, new].map(overlay);
        let to = |fine: Option<&'a _>, coarse, is_finer| {
            let prolongation = Prolongation::new(fine?, coarse)?;
            Some(Self {
                prolongation,
                is_finer,
                lame,
            })
        };
        to(new, old, true).or_else(|| to(old, new, false))
    }

    /// Returns true if nodes are added and none is removed.
    pub(crate) fn is_finer(&self) -> bool {
        self.is_finer
    }

    /// Transfers values that vary linearly between nodes.
    pub(crate) fn values<const C: usize>(&self, of: &[[f64; C]]) -> Vec<[f64; C]> {
        if self.is_finer {
            self.prolongation.prolongate(of)
        } else {
            self.prolongation.inject(of)
        }
    }

    /// Transfers velocities, m/s.
    pub(crate) fn velocities(&self, of: &[[f64; D]]) -> Vec<[f64; D]> {
        if self.is_finer {
            self.prolongation.prolongate_with_shape_functions(of)
        } else {
            self.prolongation.inject(of)
        }
    }

    /// Returns displacements on a finer mesh, m.
    pub(crate) fn prolongated_displacements(&self, of: &[[f64; D]]) -> Vec<[f64; D]> {
        self.prolongation.prolongate_with_shape_functions(of)
    }

    /// Returns, for each node of a coarser mesh, true if it stays in place: nothing changes around
    /// it, or a component of it is `prescribed`.
    pub(crate) fn kept(&self, prescribed: &[[bool; D]]) -> Vec<bool> {
        let mut kept = self.prolongation.stays();
        for (kept, prescribed) in kept.iter_mut().zip(self.prolongation.inject(prescribed)) {
            *kept |= prescribed.contains(&true);
        }
        kept
    }

    /// Returns the displacements on a coarser mesh with the least loss, m; nodes that are `kept`
    /// stay in place. If there are none, the centre of mass stays, for the nodal `masses` before
    /// and after, kg.
    pub(crate) fn smoothed(
        &self,
        of: &[[f64; D]],
        kept: &[bool],
        masses: [&[f64]; 2],
    ) -> Vec<[f64; D]> {
        let mut moved = self.prolongation.smooth(of, kept, self.lame);
        if !kept.contains(&true) {
            let translation = sub(&mean(of, masses[0]), &mean(&moved, masses[1]));
            for moved in &mut moved {
                add_scaled(moved, 1.0, &translation);
            }
        }
        moved
    }

    /// Returns the moves of the nodes in a change to a coarser mesh with the displacements `after`,
    /// m.
    pub(crate) fn moves(&self, before: &[[f64; D]], after: &[[f64; D]]) -> Vec<[f64; D]> {
        let after = self.prolongation.prolongate(after);
        let moves = before.iter().zip(&after);
        moves.map(|(old, new)| sub(new, old)).collect()
    }

    /// Transfers impulses, N·s: each stays at its node, or goes to the parents of a removed node.
    pub(crate) fn impulses(&self, of: &[[f64; D]]) -> Vec<[f64; D]> {
        if self.is_finer {
            self.prolongation.scatter(of)
        } else {
            self.prolongation.restrict(of.to_vec())
        }
    }

    /// Transfers momenta, N·s, of removed nodes to their parents; only for a change to a coarser
    /// mesh.
    pub(crate) fn restrict(&self, of: Vec<[f64; D]>) -> Vec<[f64; D]> {
        self.prolongation.restrict(of)
    }
}

/// Returns the mean of nodal values, weighted by mass.
fn mean<const D: usize>(of: &[[f64; D]], masses: &[f64]) -> [f64; D] {
    let mut sum = [0.0; D];
    for (of, mass) in of.iter().zip(masses) {
        add_scaled(&mut sum, *mass, of);
    }
    scale(1.0 / masses.iter().sum::<f64>(), &sum)
}

/// An element of a block: its root element, and the part of that root.
struct ElementLineage {
    root: u32,
    lineage: Option<Lineage>,
}

/// Returns the elements of a block in order; `own` are its base elements.
fn lineages<const D: usize>(
    own: Range<u32>,
    refined_block: Option<&RefinedBlock<D>>,
) -> Vec<ElementLineage> {
    let overlay = refined_block.map(|refined_block| &refined_block.overlay);
    let is_kept = |root: &u32| overlay.is_none_or(|overlay| !overlay.replaces(*root));
    let kept = own.filter(is_kept).map(|root| ElementLineage {
        root,
        lineage: None,
    });
    let new = overlay.iter().flat_map(|overlay| &overlay.elements);
    let new = new.map(|sub| ElementLineage {
        root: sub.root,
        lineage: Some(sub.lineage),
    });
    kept.chain(new).collect()
}

/// Returns, for each element of a block's new mesh, the old elements that are parts of it, or the
/// old element of which it is a part. Elements are numbered within the block; `own` are its base
/// elements.
pub(crate) fn predecessors<const D: usize>(
    own: Range<u32>,
    old: Option<&RefinedBlock<D>>,
    new: Option<&RefinedBlock<D>>,
) -> Vec<Vec<u32>> {
    let (old, new) = (lineages(own.clone(), old), lineages(own, new));
    let mut sorted: Vec<u32> = (0..old.len() as u32).collect();
    let old_element = |number: u32| &old[number as usize];
    sorted.sort_by_key(|&number| (old_element(number).root, old_element(number).lineage));
    let found = new.iter().map(|new| {
        let first = sorted.partition_point(|&number| old_element(number).root < new.root);
        let end = sorted.partition_point(|&number| old_element(number).root <= new.root);
        let of_root = &sorted[first..end];
        let Some(lineage) = new.lineage else {
            return of_root.to_vec();
        };
        let after = of_root.partition_point(|&number| old_element(number).lineage < Some(lineage));
        let holds = |one: Option<&Lineage>, other: Option<&Lineage>| {
            one.is_some_and(|one| other.is_some_and(|other| one.holds(other)))
        };
        let is_part = |number: &&u32| holds(Some(&lineage), old_element(**number).lineage.as_ref());
        let parts: Vec<u32> = of_root[after..]
            .iter()
            .take_while(is_part)
            .copied()
            .collect();
        if !parts.is_empty() {
            return parts;
        }
        let before = after.checked_sub(1).map(|before| of_root[before]);
        let is_whole = |number: &u32| holds(old_element(*number).lineage.as_ref(), Some(&lineage));
        match before.filter(is_whole) {
            Some(whole) => vec![whole],
            // Different pieces of the element, or the whole element.
            None => of_root.to_vec(),
        }
    });
    found.collect()
}
