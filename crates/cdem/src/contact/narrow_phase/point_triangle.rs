//! A vertex against a triangle.

use crate::contact::surface::triangulation::scaled_normal;
use crate::math::vector::{add_scaled, cross, dot, norm, scale, sub};

/// A point and the plane of a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointTriangle {
    /// Outward unit normal of the triangle.
    pub(crate) normal: [f64; 3],
    /// Distance of the point from the plane, m; negative inside.
    pub(crate) gap: f64,
    /// Weights of the three corners at the foot point.
    pub(crate) weights: [f64; 3],
    /// Heights of the triangle over its edges, m; the k-th edge runs from corner k to the next.
    pub(crate) heights: [f64; 3],
}

impl PointTriangle {
    /// Computes the position of the point `p` relative to a triangle.
    pub(crate) fn new(p: &[f64; 3], triangle: &[[f64; 3]; 3]) -> Self {
        let [a, b, c] = triangle;
        let (normal, twice) = scaled_normal(triangle);
        let part =
            |one: &[f64; 3], other: &[f64; 3]| dot(&cross(&sub(one, p), &sub(other, p)), &normal);
        let weights = [part(b, c) / twice, part(c, a) / twice, part(a, b) / twice];
        Self {
            normal,
            gap: dot(&sub(p, a), &normal),
            weights,
            heights: std::array::from_fn(|k| {
                twice / norm(&sub(&triangle[(k + 1) % 3], &triangle[k]))
            }),
        }
    }

    /// Returns the distance of the foot point inside the line of edge `k`, m; negative beyond it.
    pub(super) fn inside(&self, k: usize) -> f64 {
        self.weights[(k + 2) % 3] * self.heights[k]
    }

    /// Returns the edge beyond which the foot point lies farthest, and the distance, m; ≤ 0 within.
    pub(crate) fn foot_distance(&self) -> (usize, f64) {
        let beyond = (0..3).map(|k| (k, -self.inside(k)));
        beyond
            .max_by(|one, other| one.1.total_cmp(&other.1))
            .unwrap_or((0, 0.0))
    }
}

/// Velocity of the material of a triangle at some point, as a linear map of the velocities of its
/// corners.
///
/// The normal turns by n' = −Σ (n·v) ∇N, and the triangle turns about it by half the curl of v.
/// Both are exact for a rigid motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct TriangleMotion {
    normal: [f64; 3],
    /// Weights of the corners, and their gradients in the plane, 1/m.
    weights: [f64; 3],
    gradients: [[f64; 3]; 3],
    /// From the point of the weights to the point of the material, m.
    offset: [f64; 3],
}

impl TriangleMotion {
    /// Makes the map at the point `p`, which moves with the point of these `weights`.
    pub(super) fn new(p: &[f64; 3], triangle: &[[f64; 3]; 3], weights: &[f64; 3]) -> Self {
        let [a, b, c] = triangle;
        let (normal, twice) = scaled_normal(triangle);
        let mut offset = *p;
        for (corner, weight) in triangle.iter().zip(weights) {
            add_scaled(&mut offset, -weight, corner);
        }
        // The weight of a corner is 0 on the opposite edge.
        let gradient =
            |from: &[f64; 3], to: &[f64; 3]| scale(1.0 / twice, &cross(&normal, &sub(to, from)));
        Self {
            normal,
            weights: *weights,
            gradients: [gradient(b, c), gradient(c, a), gradient(a, b)],
            offset,
        }
    }

    /// Returns the outward unit normal of the triangle.
    pub(super) fn normal(&self) -> &[f64; 3] {
        &self.normal
    }

    /// Returns the vector from the point of the weights to the point of the material, m.
    pub(super) fn offset(&self) -> &[f64; 3] {
        &self.offset
    }

    /// Returns the coefficients of each corner for a direction.
    pub(super) fn rows(&self, direction: &[f64; 3]) -> [[f64; 3]; 3] {
        let moment = cross(&self.offset, direction);
        let (tilt, spin) = (
            cross(&self.normal, &moment),
            0.5 * dot(&self.normal, &moment),
        );
        std::array::from_fn(|k| {
            let gradient = &self.gradients[k];
            let mut row = scale(self.weights[k], direction);
            add_scaled(&mut row, dot(gradient, &tilt), &self.normal);
            add_scaled(&mut row, spin, &cross(&self.normal, gradient));
            row
        })
    }
}
