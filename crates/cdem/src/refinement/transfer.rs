//! What the nodes and elements of a block have goes over to another mesh of it.

use std::ops::Range;

use crate::math::vector::{add_scaled, scale, sub};
use crate::refinement::forest::Lineage;
use crate::refinement::prolongation::Prolongation;
use crate::refinement::refined_block::RefinedBlock;

/// From one mesh of a block to a finer or a coarser one.
pub(crate) struct MeshTransfer<'a, const D: usize> {
    nesting: Prolongation<'a, D>,
    is_finer: bool,
    /// λ and μ of the block, Pa.
    lame: [f64; 2],
}

impl<'a, const D: usize> MeshTransfer<'a, D> {
    /// `None` is the base mesh; `None` comes out where neither mesh is a refinement of the
    /// other.
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
            let nesting = Prolongation::new(fine?, coarse)?;
            Some(Self {
                nesting,
                is_finer,
                lame,
            })
        };
        to(new, old, true).or_else(|| to(old, new, false))
    }

    /// Whether new nodes have come, and none has gone.
    pub(crate) fn is_finer(&self) -> bool {
        self.is_finer
    }

    /// What varies linearly between nodes.
    pub(crate) fn values<const C: usize>(&self, of: &[[f64; C]]) -> Vec<[f64; C]> {
        if self.is_finer {
            self.nesting.prolongate(of)
        } else {
            self.nesting.pick(of)
        }
    }

    /// Velocities, m/s.
    pub(crate) fn velocities(&self, of: &[[f64; D]]) -> Vec<[f64; D]> {
        if self.is_finer {
            self.nesting.grow(of)
        } else {
            self.nesting.pick(of)
        }
    }

    /// Displacements on a finer mesh, m.
    pub(crate) fn grown(&self, of: &[[f64; D]]) -> Vec<[f64; D]> {
        self.nesting.grow(of)
    }

    /// Which nodes of a coarser mesh stay where they are: those about which nothing changes,
    /// and those of which any component is `held`.
    pub(crate) fn kept(&self, held: &[[bool; D]]) -> Vec<bool> {
        let mut kept = self.nesting.stays();
        for (kept, held) in kept.iter_mut().zip(self.nesting.pick(held)) {
            *kept |= held.contains(&true);
        }
        kept
    }

    /// Displacements on a coarser mesh, m, as near as can be, but that some nodes are `kept`
    /// where they are; where none is, the centre of mass stays, nodes having these `masses`
    /// before and after, kg.
    pub(crate) fn smoothed(
        &self,
        of: &[[f64; D]],
        kept: &[bool],
        masses: [&[f64]; 2],
    ) -> Vec<[f64; D]> {
        let mut moved = self.nesting.smooth(of, kept, self.lame);
        if !kept.contains(&true) {
            let shift = sub(&mean(of, masses[0]), &mean(&moved, masses[1]));
            for moved in &mut moved {
                add_scaled(moved, 1.0, &shift);
            }
        }
        moved
    }

    /// How the nodes move of which some go over to a coarser mesh with other displacements,
    /// m.
    pub(crate) fn moves(&self, before: &[[f64; D]], after: &[[f64; D]]) -> Vec<[f64; D]> {
        let after = self.nesting.prolongate(after);
        let moves = before.iter().zip(&after);
        moves.map(|(old, new)| sub(new, old)).collect()
    }

    /// Impulses on nodes, N·s: they stay where they are, or go to those between which they are.
    pub(crate) fn impulses(&self, of: &[[f64; D]]) -> Vec<[f64; D]> {
        if self.is_finer {
            self.nesting.scatter(of)
        } else {
            self.nesting.restrict(of.to_vec())
        }
    }

    /// Momenta of nodes, N·s: of those that go, to those between which they lie. To be had
    /// of velocities of finer nodes for coarser ones alone.
    pub(crate) fn gather(&self, of: Vec<[f64; D]>) -> Vec<[f64; D]> {
        self.nesting.restrict(of)
    }
}

/// Mean of what nodes have, by their masses.
fn mean<const D: usize>(of: &[[f64; D]], masses: &[f64]) -> [f64; D] {
    let mut sum = [0.0; D];
    for (of, mass) in of.iter().zip(masses) {
        add_scaled(&mut sum, *mass, of);
    }
    scale(1.0 / masses.iter().sum::<f64>(), &sum)
}

/// An element of a block: the one that it is or has come of, and which part of that.
struct ElementLineage {
    root: u32,
    lineage: Option<Lineage>,
}

/// The elements of a block whose own are these, in order.
fn lines<const D: usize>(
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

/// For each element of a block's new mesh, by numbers within the block, the old ones that
/// are parts of it, or that which it is a part of. `own` are the elements of the block as
/// it was before refinement.
pub(crate) fn predecessors<const D: usize>(
    own: Range<u32>,
    old: Option<&RefinedBlock<D>>,
    new: Option<&RefinedBlock<D>>,
) -> Vec<Vec<u32>> {
    let (old, new) = (lines(own.clone(), old), lines(own, new));
    let mut sorted: Vec<u32> = (0..old.len() as u32).collect();
    let line = |number: u32| &old[number as usize];
    sorted.sort_by_key(|&number| (line(number).root, line(number).lineage));
    let found = new.iter().map(|new| {
        let first = sorted.partition_point(|&number| line(number).root < new.root);
        let end = sorted.partition_point(|&number| line(number).root <= new.root);
        let of_root = &sorted[first..end];
        let Some(lineage) = new.lineage else {
            return of_root.to_vec();
        };
        let after = of_root.partition_point(|&number| line(number).lineage < Some(lineage));
        let holds = |one: Option<&Lineage>, other: Option<&Lineage>| {
            one.is_some_and(|one| other.is_some_and(|other| one.holds(other)))
        };
        let is_part = |number: &&u32| holds(Some(&lineage), line(**number).lineage.as_ref());
        let parts: Vec<u32> = of_root[after..]
            .iter()
            .take_while(is_part)
            .copied()
            .collect();
        if !parts.is_empty() {
            return parts;
        }
        let before = after.checked_sub(1).map(|before| of_root[before]);
        let is_whole = |number: &u32| holds(line(*number).lineage.as_ref(), Some(&lineage));
        match before.filter(is_whole) {
            Some(whole) => vec![whole],
            // Other pieces of the element, or all of it.
            None => of_root.to_vec(),
        }
    });
    found.collect()
}
