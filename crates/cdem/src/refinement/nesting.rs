//! From a mesh of a block to one that has been made of it by bisection, and back.

use std::collections::HashMap;

use nalgebra::DMatrix;

use super::overlay::Overlay;
use crate::vector::{add, add_scaled, dot, scale, sub};

/// A fine mesh of a block and a coarse one of which it is a refinement: the nodes of the
/// coarse one are among those of the fine one.
pub(crate) struct Nesting<'a, const D: usize> {
    fine: &'a Overlay<D>,
    /// Fine number of each coarse node, and coarse number of each fine one that is both.
    fine_of: Vec<u32>,
    coarse_of: Vec<Option<u32>>,
}

impl<'a, const D: usize> Nesting<'a, D> {
    /// `None` for `coarse` is the base mesh. `None` if a coarse node is no fine one.
    pub(crate) fn new(fine: &'a Overlay<D>, coarse: Option<&Overlay<D>>) -> Option<Self> {
        // The same parents have given the same node the same bits.
        let bits = |point: &[f64; D]| point.map(f64::to_bits);
        let places = (0..).zip(&fine.points).skip(fine.base_count);
        let places: HashMap<_, u32> = places.map(|(n, point)| (bits(point), n)).collect();
        let new = coarse.map_or(&[][..], |coarse| &coarse.points[coarse.base_count..]);
        let new = new.iter().map(|point| places.get(&bits(point)).copied());
        let base = (0..fine.base_count as u32).map(Some);
        let fine_of: Vec<u32> = base.chain(new).collect::<Option<_>>()?;
        let mut coarse_of = vec![None; fine.points.len()];
        for (number, &node) in (0..).zip(&fine_of) {
            coarse_of[node as usize] = Some(number);
        }
        Some(Self {
            fine,
            fine_of,
            coarse_of,
        })
    }

    /// What the fine nodes have if the coarse ones have these values: new ones have the
    /// mean of those between which they lie. What varies linearly in an element is
    /// interpolated exactly.
    pub(crate) fn spread<const C: usize>(&self, coarse: &[[f64; C]]) -> Vec<[f64; C]> {
        let mut fine: Vec<[f64; C]> = Vec::with_capacity(self.coarse_of.len());
        for (node, number) in self.coarse_of.iter().enumerate() {
            fine.push(match number {
                Some(number) => coarse[*number as usize],
                None => {
                    let parents = &self.fine.parents[node - self.fine.base_count];
                    let of = parents.iter().map(|&parent| &fine[parent as usize]);
                    let sum = of.fold([0.0; C], |sum, value| add(&sum, value));
                    scale(1.0 / parents.len() as f64, &sum)
                }
            });
        }
        fine
    }

    /// What the coarse nodes have of a fine field.
    pub(crate) fn pick<const C: usize>(&self, fine: &[[f64; C]]) -> Vec<[f64; C]> {
        let of = |&node: &u32| fine[node as usize];
        self.fine_of.iter().map(of).collect()
    }

    /// Coarse nodes between which no other node of the fine mesh lies.
    pub(crate) fn stays(&self) -> Vec<bool> {
        let mut stays = vec![true; self.coarse_of.len()];
        for node in (self.fine.base_count..stays.len()).rev() {
            if self.coarse_of[node].is_none() {
                for &parent in &self.fine.parents[node - self.fine.base_count] {
                    stays[parent as usize] = false;
                }
            }
        }
        self.fine_of
            .iter()
            .map(|&node| stays[node as usize])
            .collect()
    }

    /// The transpose of [`Self::spread`]: what fine nodes have that are not coarse ones goes to those
    /// between which they lie, in equal parts.
    pub(crate) fn gather(&self, mut fine: Vec<[f64; D]>) -> Vec<[f64; D]> {
        for node in (self.fine.base_count..fine.len()).rev() {
            if self.coarse_of[node].is_none() {
                let parents = &self.fine.parents[node - self.fine.base_count];
                let share = scale(1.0 / parents.len() as f64, &fine[node]);
                for &parent in parents {
                    add_scaled(&mut fine[parent as usize], 1.0, &share);
                }
            }
        }
        self.fine_of
            .iter()
            .map(|&node| fine[node as usize])
            .collect()
    }

    /// Where the coarse nodes go when the fine mesh is given up, those but that are `kept`
    /// where they are: what is lost is as small as can be in its gradient, in the mean
    /// square over the volume. So a simplex keeps the mean of its deformation, and loses
    /// no more than what its parts deform beyond that: positions taken with masses for
    /// weights could make energy. If none is kept, the first stays where it is.
    pub(crate) fn smooth(&self, fine: &[[f64; D]], kept: &[bool]) -> Vec<[f64; D]> {
        let count = self.fine_of.len();
        let mut free: Vec<usize> = (0..count).filter(|&node| !kept[node]).collect();
        if free.len() == count {
            free.remove(0);
        }
        let at = |&node: &u32| fine[node as usize];
        let mut moved: Vec<[f64; D]> = self.fine_of.iter().map(at).collect();
        let kept_of = self.spread(&moved);
        let lost = fine.iter().zip(&kept_of).map(|(x, kept)| sub(x, kept));
        let right = self.roughness(&lost.collect::<Vec<_>>());
        let column = |&node: &usize| {
            let mut unit = vec![[0.0; D]; count];
            unit[node][0] = 1.0;
            self.roughness(&self.spread(&unit))
        };
        let columns: Vec<_> = free.iter().map(column).collect();
        let matrix = DMatrix::from_fn(free.len(), free.len(), |i, j| columns[j][free[i]][0]);
        let right = DMatrix::from_fn(free.len(), D, |i, c| right[free[i]][c]);
        if let Some(factor) = matrix.cholesky() {
            let shift = factor.solve(&right);
            for (row, node) in free.into_iter().enumerate() {
                let shift: [f64; D] = std::array::from_fn(|c| shift[(row, c)]);
                moved[node] = add(&moved[node], &shift);
            }
        }
        moved
    }

    /// How half of the square of a fine field's gradient, over the volume, changes with
    /// what the coarse nodes have.
    fn roughness(&self, fine: &[[f64; D]]) -> Vec<[f64; D]> {
        let mut change = vec![[0.0; D]; fine.len()];
        for (piece, (gradients, volume)) in self.fine.elements.iter().zip(self.fine.gradients()) {
            let nodes = || piece.element.nodes().iter().zip(&gradients);
            for (&a, gradient) in nodes() {
                for (&b, other) in nodes() {
                    let coupling = volume * dot(gradient, other);
                    add_scaled(&mut change[a as usize], coupling, &fine[b as usize]);
                }
            }
        }
        self.gather(change)
    }
}
