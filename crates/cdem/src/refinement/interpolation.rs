//! Interpolation at new nodes inside non-simplex elements by their shape functions.

use std::collections::HashMap;

use crate::element::{shape, tensor};
use crate::math::vector::{add, add_scaled, dot, scale, sub};
use crate::mesh::Element;

/// A refined non-simplex element, with the reference coordinates of new nodes.
pub(super) struct ElementInterpolation<'a, const D: usize> {
    /// The element, with its node numbers in the block.
    element: Element,
    /// Rest positions of all nodes of the block, m.
    points: &'a [[f64; D]],
    /// Number of base nodes of the block, and the parents of the new ones.
    base_count: usize,
    parents: &'a [Vec<u32>],
    /// Reference coordinates of nodes.
    places: HashMap<u32, [f64; 3]>,
}

impl<'a, const D: usize> ElementInterpolation<'a, D> {
    pub(super) fn new(
        element: Element,
        points: &'a [[f64; D]],
        base_count: usize,
        parents: &'a [Vec<u32>],
    ) -> Self {
        let corners = element.nodes().iter().enumerate();
        Self {
            places: corners
                .map(|(a, &node)| (node, shape::corner(element.kind, a)))
                .collect(),
            element,
            points,
            base_count,
            parents,
        }
    }

    /// Returns the weight of each corner in the value of a field at a node. The weights are the
    /// shape functions at the node's reference coordinates, plus the gradient at the centre times
    /// the remaining distance. So a field that is linear in space is interpolated exactly.
    pub(super) fn weights(&mut self, node: u32) -> Vec<(u32, f64)> {
        let place = self.place(node);
        let there = shape::shape(self.element.kind, place);
        let nodes: Vec<u32> = self.element.nodes().to_vec();
        let corners = nodes.iter().map(|&corner| self.points[corner as usize]);
        let corners: Vec<[f64; D]> = corners.collect();
        let mut reached = [0.0; D];
        for (corner, value) in corners.iter().zip(there.values) {
            add_scaled(&mut reached, value, corner);
        }
        let rest = sub(&self.points[node as usize], &reached);
        let middle = self.middle();
        let jacobian = tensor::filled::<D, f64>(|i, j| {
            let along = corners.iter().zip(&middle.gradients);
            along
                .map(|(corner, gradient)| corner[i] * gradient[j])
                .sum()
        });
        let (inverse, _) = tensor::inverse(&jacobian);
        let weight = |a: usize| {
            let gradient: [f64; D] = std::array::from_fn(|j| {
                (0..D).map(|k| middle.gradients[a][k] * inverse[k][j]).sum()
            });
            there.values[a] + dot(&gradient, &rest)
        };
        nodes
            .iter()
            .enumerate()
            .map(|(a, &node)| (node, weight(a)))
            .collect()
    }

    /// Returns the shape functions at the centre.
    fn middle(&self) -> shape::ShapeFunctions {
        let kind = self.element.kind;
        let count = kind.node_count();
        let corners = (0..count).map(|a| shape::corner(kind, a));
        let sum = corners.fold([0.0; 3], |sum, corner| add(&sum, &corner));
        shape::shape(kind, scale(1.0 / count as f64, &sum))
    }

    /// Returns the reference coordinates of a node: the mean of its parents'.
    fn place(&mut self, node: u32) -> [f64; 3] {
        if let Some(&place) = self.places.get(&node) {
            return place;
        }
        let parents = &self.parents[node as usize - self.base_count];
        let mut sum = [0.0; 3];
        for &parent in parents {
            sum = add(&sum, &self.place(parent));
        }
        let place = scale(1.0 / parents.len() as f64, &sum);
        self.places.insert(node, place);
        place
    }
}
