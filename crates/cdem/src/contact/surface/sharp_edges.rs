//! Sharp edges of the triangulation, and the motion until the others become sharp.

use crate::contact::surface::geometry_cache::EdgeShape;
use crate::contact::surface::triangulation::{Edge, Triangulation, angle};
use crate::contact::surface::{Configuration, ConstantMotion};
use crate::contact::tolerances::{
    COSINE_OF_SHARP, FIRST_ORDER_TURN, FLAT_CAUTION, FLAT_EDGE, REENTRANT, SAGITTA, SHARP,
};
use crate::math::vector::{add, cross, dot, norm, sub};

impl Triangulation {
    /// Returns true if an edge can meet other edges: it is convex, and so sharp that an edge laid
    /// across it would sink in by more than a quarter of the resolution before its ends touch.
    pub(crate) fn is_sharp(&self, edge: u32, at: Configuration<3>) -> bool {
        self.is_sharp_under(edge, 0.0, at)
    }

    /// Returns true if an edge is sharp under another edge of a length, m, which may reach over
    /// many edges that turn alike.
    pub(crate) fn is_sharp_under(&self, edge: u32, length: f64, at: Configuration<3>) -> bool {
        let ridge = self.edge_shape(edge, at);
        let widened = self.arm_under(edge, &ridge, length) / ridge.arm;
        ridge.height * widened > SAGITTA * self.resolution
    }

    /// Returns the slope of the faces beside a straight edge against a plane that it is laid on, 1 or
    /// more: the height that a point loses over its distance from the edge.
    pub(crate) fn slope(&self, edge: u32, at: Configuration<3>) -> f64 {
        f64::max(1.0, (0.5 * self.turn(edge, at)).tan())
    }

    /// Returns true if an edge is surely not [sharp](Self::is_sharp_under), by a test without a
    /// root. Most edges of meshed faces that lie on each other are so.
    ///
    /// With e the edge, N₁ and N₂ the normals of its triangles with the lengths of twice their
    /// areas, and c the vector to the far corner of the first, the sine of the turn is −N₂·c
    /// |e|/|N₁||N₂|. The arm is 1/(|e|/|N₁| + |e|/|N₂|). Their product is −N₂·c/(|N₁| + |N₂|),
    /// which is no more than −N₂·c/|N₁ + N₂|.
    pub(crate) fn is_flat_under(&self, edge: u32, length: f64, at: Configuration<3>) -> bool {
        let Edge { ends, sides, .. } = &self.edges[edge as usize];
        let Some(sides) = *sides else {
            return false;
        };
        let start = self.point(ends[0], at);
        let from_start = |corner: u32| sub(&self.point(corner, at), &start);
        let along = from_start(ends[1]);
        let [one, other] = sides.map(|side| from_start(self.opposite_corner(side, edge)));
        let normals = [cross(&along, &one), cross(&other, &along)];
        let squares = normals.map(|normal| dot(&normal, &normal));
        let (square, below) = (dot(&along, &along), -dot(&normals[1], &one));
        let turns = below * below * square > FLAT_EDGE * FLAT_EDGE * squares[0] * squares[1];
        if turns || dot(&normals[0], &normals[1]) <= 0.0 {
            return false;
        }
        let length = length.min(self.sizes[self.block(ends[0]) as usize]);
        let arms = 2.0 * square * (1.0 / squares[0] + 1.0 / squares[1]);
        let widened = f64::max(1.0, length * length * arms / 16.0);
        let sum = add(&normals[0], &normals[1]);
        let allowed = FLAT_CAUTION * SAGITTA * self.resolution;
        below <= 0.0 || (below * widened).powi(2) <= allowed * allowed * dot(&sum, &sum)
    }

    /// Returns the ratio of height to turn for a straight edge of a length, m, laid across an edge,
    /// m. It is the [arm](EdgeShape::arm) a, or the sagitta of the length over the many edges of a
    /// face of curvature turn/2a, if that is larger. The length counts up to the size of the block.
    fn arm_under(&self, edge: u32, ridge: &EdgeShape, length: f64) -> f64 {
        let length = length.min(self.sizes[self.block(self.edges[edge as usize].ends[0]) as usize]);
        f64::max(ridge.arm, length * length / (16.0 * ridge.arm))
    }

    /// Returns a lower bound of the travel of the nodes beside an edge, each in its own direction,
    /// m, at which the edge becomes [sharp](Self::is_sharp_under); less than 0 if it is sharp.
    ///
    /// With m the least height, travels w of all nodes turn each of the two triangles by 2w/m at
    /// most, so they raise the edge by 4aw/m at first order. A fifth more covers the changes of m
    /// and of the arm a meanwhile.
    pub(crate) fn sharpens_after(&self, edge: u32, length: f64, at: Configuration<3>) -> f64 {
        let ridge = self.edge_shape(edge, at);
        let arm = self.arm_under(edge, &ridge, length);
        // The arm is half of the least height or more, so the least value is below the height of an
        // edge that turns by REENTRANT. Every edge that turns farther back must pass that height.
        let turn = f64::min(ridge.height / ridge.arm, SHARP);
        let height = (turn * arm).max(0.5 * REENTRANT * ridge.least_height);
        let sharp = f64::min(SAGITTA * self.resolution, SHARP * arm);
        (sharp - height) * ridge.least_height / (5.0 * arm)
    }

    /// Returns true if an edge is sharp or may become so before nodes beside it have moved by
    /// `margin`, m. Each triangle turns by no more than twice the margin over its smallest height.
    /// If that is no small angle, nothing is ruled out.
    pub(super) fn may_be_sharp(&self, edge: u32, at: Configuration<3>, margin: f64) -> bool {
        let turns = 4.0 * margin / self.edge_shape(edge, at).least_height;
        turns > FIRST_ORDER_TURN || self.turn(edge, at) > REENTRANT - turns
    }

    /// Returns the height of an edge over its triangles.
    #[inline]
    pub(crate) fn edge_shape(&self, edge: u32, at: Configuration<3>) -> EdgeShape {
        match at.cache() {
            Some(cache) => cache
                .edge_shapes
                .get(edge, || self.compute_edge_shape(edge, at)),
            None => self.compute_edge_shape(edge, at),
        }
    }

    /// Computes the height of an edge over its triangles without the cache.
    fn compute_edge_shape(&self, edge: u32, at: Configuration<3>) -> EdgeShape {
        let [a, b] = self.edge(edge, at);
        let along = sub(&b, &a);
        let length = norm(&along);
        let (mut bend, mut least_height) = (0.0, length);
        for side in self.edges[edge as usize].sides.into_iter().flatten() {
            let shape = self.triangle_shape(side, at);
            bend += length / shape.twice_area;
            least_height = least_height.min(shape.least_height);
        }
        let arm = 1.0 / bend;
        let sides = self.edges[edge as usize].sides;
        let turned = sides.map(|sides| self.turned(sides, &along, length, at));
        // NaN counts as not sharp: the height is NaN.
        let below = turned.filter(|[sine, cosine]| !(*sine >= 0.0 && *cosine <= COSINE_OF_SHARP));
        EdgeShape {
            height: below.map_or(f64::INFINITY, |[sine, cosine]| angle(sine, cosine) * arm),
            arm,
            least_height,
        }
    }

    /// Returns true if an edge that is not [sharp](Self::is_sharp_under) may become so within
    /// `duration` seconds at constant velocities, relative to one of its ends.
    pub(crate) fn may_sharpen(
        &self,
        edge: u32,
        length: f64,
        motion: ConstantMotion<3>,
        duration: f64,
    ) -> bool {
        let of = |corner: u32| self.mean(corner, |node| motion.velocity[node as usize]);
        let own = of(self.edges[edge as usize].ends[0]);
        let sides = self.edges[edge as usize].sides.into_iter().flatten();
        let corners = sides.flat_map(|side| self.triangles[side as usize].corners);
        let speeds = corners.map(|corner| norm(&sub(&of(corner), &own)));
        duration * speeds.fold(0.0, f64::max) > self.sharpens_after(edge, length, motion.at)
    }
}
