//! Prolongation from a mesh of a block to a bisection of it, and restriction back.

use std::collections::HashMap;

use nalgebra::DMatrix;

use crate::math::vector::{add, add_scaled, dot, scale, sub};
use crate::refinement::overlay::Overlay;

/// A fine mesh of a block and a coarse one of which it is a refinement. The coarse nodes are a
/// subset of the fine ones.
pub(crate) struct Prolongation<'a, const D: usize> {
    fine: &'a Overlay<D>,
    /// Fine number of each coarse node, and coarse number of each fine node that has one.
    fine_of: Vec<u32>,
    coarse_of: Vec<Option<u32>>,
    /// For each new fine node, true if it lies in an element that is whole in the coarse mesh.
    in_whole: Vec<bool>,
}

impl<'a, const D: usize> Prolongation<'a, D> {
    /// Builds the prolongation; `coarse` is `None` for the base mesh. Returns `None` if a coarse
    /// node is not a fine one.
    pub(crate) fn new(fine: &'a Overlay<D>, coarse: Option<&Overlay<D>>) -> Option<Self> {
        // Equal parents give bitwise equal positions. Nodes on the two faces of a crack have
        // different parents.
        let key = |overlay: &'_ Overlay<D>, new: usize| {
            let place = overlay.points[overlay.base_count + new].map(f64::to_bits);
            (place, overlay.hulls[new].clone())
        };
        let numbers = fine.base_count as u32..;
        let places = (0..fine.hulls.len()).map(|new| key(fine, new)).zip(numbers);
        let places: HashMap<_, u32> = places.collect();
        let new = coarse.into_iter().flat_map(|coarse| {
            let all = 0..coarse.hulls.len();
            all.map(|new| places.get(&key(coarse, new)).copied())
        });
        let base = (0..fine.base_count as u32).map(Some);
        let fine_of: Vec<u32> = base.chain(new).collect::<Option<_>>()?;
        let mut coarse_of = vec![None; fine.points.len()];
        for (number, &node) in (0..).zip(&fine_of) {
            coarse_of[node as usize] = Some(number);
        }
        let is_whole = |root: u32| coarse.is_none_or(|coarse| !coarse.replaces(root));
        let inside = fine.inside.iter();
        let in_whole =
            inside.map(|inside| inside.as_ref().is_some_and(|within| is_whole(within.root)));
        Some(Self {
            in_whole: in_whole.collect(),
            fine,
            fine_of,
            coarse_of,
        })
    }

    /// Returns the fine values of a field with these coarse values: new nodes have the mean of
    /// their parents. A field that is linear in an element is interpolated exactly.
    pub(crate) fn prolongate<const C: usize>(&self, coarse: &[[f64; C]]) -> Vec<[f64; C]> {
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

    /// Does the same for a field that varies in non-simplex elements by their shape functions.
    pub(crate) fn prolongate_with_shape_functions(&self, coarse: &[[f64; D]]) -> Vec<[f64; D]> {
        let mut fine = self.prolongate(coarse);
        for (new, inside) in self.fine.inside.iter().enumerate() {
            let node = self.fine.base_count + new;
            if let Some(within) = inside.as_ref().filter(|_| self.in_whole[new])
                && self.coarse_of[node].is_none()
            {
                let mut value = [0.0; D];
                for &(corner, weight) in &within.weights {
                    add_scaled(&mut value, weight, &fine[corner as usize]);
                }
                fine[node] = value;
            }
        }
        fine
    }

    /// Returns the fine values at the coarse nodes.
    pub(crate) fn inject<T: Copy>(&self, fine: &[T]) -> Vec<T> {
        let of = |&node: &u32| fine[node as usize];
        self.fine_of.iter().map(of).collect()
    }

    /// Returns the coarse values at the same nodes of the fine mesh, and zero at the others.
    pub(crate) fn scatter(&self, coarse: &[[f64; D]]) -> Vec<[f64; D]> {
        let of = |number: &Option<u32>| number.map_or([0.0; D], |number| coarse[number as usize]);
        self.coarse_of.iter().map(of).collect()
    }

    /// Returns, for each coarse node, true if it is no parent of a node of the fine mesh alone.
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

    /// Applies the transpose of [`Self::prolongate`]: values of nodes of the fine mesh alone go to
    /// their parents in equal parts.
    pub(crate) fn restrict(&self, mut fine: Vec<[f64; D]>) -> Vec<[f64; D]> {
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

    /// Returns the displacements of the coarse nodes when the fine mesh is given up; nodes that are
    /// `kept` stay in place. The lost part of the field has the least elastic energy, for small
    /// strain of a material with `lame`, λ and μ, Pa, in a body with its mean rotation. So the
    /// coarse mesh has no more energy than the fine one, if its elements consist of fine ones. A
    /// mean weighted by masses could add energy. Rotation without strain also counts a little.
    pub(crate) fn smooth(&self, fine: &[[f64; D]], kept: &[bool], lame: [f64; 2]) -> Vec<[f64; D]> {
        let stiffness = Stiffness::new(self.fine, fine, lame);
        let at = |&node: &u32| fine[node as usize];
        let mut moved: Vec<[f64; D]> = self.fine_of.iter().map(at).collect();
        let forces = |field: &[[f64; D]]| zero_kept(kept, self.restrict(stiffness.forces(field)));
        let lost = fine
            .iter()
            .zip(self.prolongate(&moved))
            .map(|(x, kept)| sub(x, &kept));
        let right = forces(&lost.collect::<Vec<_>>());
        let relaxation = conjugate_gradients(&right, |field| forces(&self.prolongate(field)));
        for (moved, relaxation) in moved.iter_mut().zip(&relaxation) {
            add_scaled(moved, 1.0, relaxation);
        }
        moved
    }
}

impl<const D: usize> Overlay<D> {
    /// Returns the displacements, m, that remove the deformation, for nodes that are not `kept` in
    /// place. They minimise the elastic energy, for small strain in a body with its mean rotation.
    pub(crate) fn relaxation(
        &self,
        displacement: &[[f64; D]],
        kept: &[bool],
        lame: [f64; 2],
    ) -> Vec<[f64; D]> {
        let stiffness = Stiffness::new(self, displacement, lame);
        let forces = |field: &[[f64; D]]| zero_kept(kept, stiffness.forces(field));
        let turned = self.points.iter().map(|point| stiffness.turned(point));
        let unturned = displacement.iter().zip(&self.points).zip(turned);
        let back: Vec<[f64; D]> = unturned
            .map(|((moved, point), turned)| sub(&turned, &add(point, moved)))
            .collect();
        conjugate_gradients(&forces(&back), forces)
    }
}

/// Returns the forces with zeros at nodes that are `kept` in place.
fn zero_kept<const D: usize>(kept: &[bool], mut forces: Vec<[f64; D]>) -> Vec<[f64; D]> {
    for (force, _) in forces.iter_mut().zip(kept).filter(|(_, kept)| **kept) {
        *force = [0.0; D];
    }
    forces
}

/// Stress of rotation without strain, over that of shear strain.
const ROTATION_STIFFNESS: f64 = 0.01;

/// Linear stiffness of the elements of an overlay, rotated as a whole.
struct Stiffness<'a, const D: usize> {
    overlay: &'a Overlay<D>,
    /// Gradients of the shape functions in space, 1/m, and volume, m^D.
    elements: Vec<(Vec<[f64; D]>, f64)>,
    lame: [f64; 2],
    /// Rotation of the body.
    rotation: DMatrix<f64>,
}

impl<'a, const D: usize> Stiffness<'a, D> {
    /// Builds the stiffness of an overlay with the rotation of these displacements, m.
    fn new(overlay: &'a Overlay<D>, displacement: &[[f64; D]], lame: [f64; 2]) -> Self {
        let mean = overlay.mean_gradient(displacement);
        let identity = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
        let deformation = DMatrix::from_fn(D, D, |i, j| identity(i, j) + mean[i][j]);
        let rotation = rotation(deformation);
        let mut stiffness = Self {
            overlay,
            elements: Vec::new(),
            lame,
            rotation,
        };
        let elements = overlay.gradients().map(|(gradients, volume)| {
            let gradients = gradients.iter().map(|gradient| stiffness.turned(gradient));
            (gradients.collect(), volume)
        });
        stiffness.elements = elements.collect();
        stiffness
    }

    /// Rotates a vector of the body at rest.
    fn turned(&self, vector: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|i| (0..D).map(|j| self.rotation[(i, j)] * vector[j]).sum())
    }

    /// Returns the nodal forces that maintain a field of displacements, N.
    fn forces(&self, field: &[[f64; D]]) -> Vec<[f64; D]> {
        let [lambda, mu] = self.lame;
        let mut forces = vec![[0.0; D]; field.len()];
        for (piece, (gradients, volume)) in self.overlay.elements.iter().zip(&self.elements) {
            let nodes = || piece.element.nodes().iter().zip(gradients);
            let mut gradient = [[0.0; D]; D];
            for (&node, of_node) in nodes() {
                for (row, component) in gradient.iter_mut().zip(field[node as usize]) {
                    add_scaled(row, component, of_node);
                }
            }
            let pressure = lambda * (0..D).map(|i| gradient[i][i]).sum::<f64>();
            let stress: [[f64; D]; D] = std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    let (one, other) = (gradient[i][j], gradient[j][i]);
                    let shear = mu * (one + other) + ROTATION_STIFFNESS * mu * (one - other);
                    if i == j { shear + pressure } else { shear }
                })
            });
            for (&node, of_node) in nodes() {
                for (force, row) in forces[node as usize].iter_mut().zip(&stress) {
                    *force += volume * dot(row, of_node);
                }
            }
        }
        forces
    }
}

/// Returns the rotation in a deformation gradient; the identity if it is not finite.
pub(super) fn rotation(deformation: DMatrix<f64>) -> DMatrix<f64> {
    let size = deformation.nrows();
    // The decomposition does not end for a NaN.
    if !deformation.iter().all(|entry| entry.is_finite()) {
        return DMatrix::identity(size, size);
    }
    let parts = deformation.svd(true, true);
    let rotation = parts.u.zip(parts.v_t).map(|(u, v)| u * v);
    rotation.unwrap_or_else(|| DMatrix::identity(size, size))
}

/// Relative residual at which conjugate gradients stop, and maximum steps per unknown.
const PRECISION: f64 = 1e-14;
const STEPS: usize = 4;

/// Solves `apply` x = `right` for a field x; `apply` is symmetric and positive semidefinite.
fn conjugate_gradients<const D: usize>(
    right: &[[f64; D]],
    apply: impl Fn(&[[f64; D]]) -> Vec<[f64; D]>,
) -> Vec<[f64; D]> {
    let product =
        |a: &[[f64; D]], b: &[[f64; D]]| -> f64 { a.iter().zip(b).map(|(a, b)| dot(a, b)).sum() };
    let add_to = |sum: &mut [[f64; D]], s: f64, of: &[[f64; D]]| {
        sum.iter_mut()
            .zip(of)
            .for_each(|(sum, x)| add_scaled(sum, s, x));
    };
    let mut found = vec![[0.0; D]; right.len()];
    let (mut residual, mut direction) = (right.to_vec(), right.to_vec());
    let mut square = product(&residual, &residual);
    let enough = PRECISION * PRECISION * square;
    for _ in 0..STEPS * D * right.len() {
        if square <= enough {
            break;
        }
        let image = apply(&direction);
        let step = square / product(&direction, &image);
        if !step.is_finite() {
            break;
        }
        add_to(&mut found, step, &direction);
        add_to(&mut residual, -step, &image);
        let last = std::mem::replace(&mut square, product(&residual, &residual));
        let next = direction.iter().zip(&residual);
        direction = next
            .map(|(old, new)| add(new, &scale(square / last, old)))
            .collect();
    }
    found
}
