//! The boundary of all blocks in space as triangles with their edges and vertices.

use crate::contact::surface::Configuration;
use crate::contact::surface::aabb::Aabb;
use crate::contact::surface::geometry_cache::{GeometryCache, TriangleShape};
use crate::contact::tolerances::{ANGLE_SERIES, MOST_NODES_OF_FEATURE};
use crate::math::adjacency::Adjacency;
use crate::math::vector::{add, add_scaled, cross, dot, norm, scale, sub};
use crate::mesh::{Mesh, MeshBlock};

/// A corner of triangles: a boundary node, or the mean of the four nodes of a quadrilateral.
#[derive(Clone, Debug)]
struct Corner {
    nodes: Nodes,
    block: u32,
}

/// Up to four nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Nodes {
    list: [u32; MOST_NODES_OF_FEATURE],
    count: usize,
}

impl Nodes {
    fn push(&mut self, node: u32) {
        if !self.contains(&node) {
            self.list[self.count] = node;
            self.count += 1;
        }
    }
}

impl FromIterator<u32> for Nodes {
    fn from_iter<I: IntoIterator<Item = u32>>(nodes: I) -> Self {
        let mut all = Self::default();
        nodes.into_iter().for_each(|node| all.push(node));
        all
    }
}

impl std::ops::Deref for Nodes {
    type Target = [u32];

    fn deref(&self) -> &[u32] {
        &self.list[..self.count]
    }
}

/// A triangle of the boundary, counter-clockwise seen from outside.
#[derive(Clone, Debug)]
pub(crate) struct Triangle {
    /// Its corners.
    pub(crate) corners: [u32; 3],
    /// Its edges: the k-th runs from corner k to corner k + 1.
    pub(crate) edges: [u32; 3],
    /// The facet of the mesh that contains it.
    pub(crate) facet: u32,
    nodes: Nodes,
}

/// An edge of triangles.
#[derive(Clone, Debug)]
pub(crate) struct Edge {
    /// The corners at its ends.
    pub(crate) ends: [u32; 2],
    /// The triangles on its sides; the first has the edge in the direction from its first end to
    /// its second, the other in the opposite direction. `None` if there are more than two.
    pub(crate) sides: Option<[u32; 2]>,
    nodes: Nodes,
}

/// The boundary of all blocks in space.
#[derive(Clone, Debug)]
pub(crate) struct Triangulation {
    /// Vertices first, one for each boundary node.
    corners: Vec<Corner>,
    pub(crate) vertex_count: u32,
    /// Vertices of the facets of the mesh, counter-clockwise seen from outside.
    facets: Vec<Nodes>,
    pub(crate) triangles: Vec<Triangle>,
    pub(crate) edges: Vec<Edge>,
    /// Edges and triangles around corners.
    edges_at: Adjacency,
    triangles_at: Adjacency,
    /// Diameter of the box around each block at rest, m.
    pub(super) sizes: Vec<f64>,
    /// Contact resolution, m.
    pub(crate) resolution: f64,
}

impl Triangulation {
    /// Returns the boundary of `mesh`, for contact within `resolution`, m.
    ///
    /// A quadrilateral becomes four triangles about the mean of its nodes. Then blocks that share
    /// it agree on its position, warped or not, and a force on its middle acts on all four nodes
    /// alike.
    pub(super) fn new(mesh: &Mesh<3>, resolution: f64) -> Self {
        let facets: Vec<Nodes> = mesh
            .boundary_facets()
            .iter()
            .map(|&facet| mesh.facet_nodes(facet).collect())
            .collect();
        let mut nodes: Vec<u32> = facets.iter().flat_map(|f| f.iter().copied()).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let block_of = |node: u32| mesh.blocks.partition_point(|b| b.nodes.end <= node) as u32;
        let corner = |nodes: Nodes| Corner {
            nodes,
            block: block_of(nodes[0]),
        };
        let mut corners: Vec<Corner> = nodes
            .iter()
            .map(|&node| corner(Nodes::from_iter([node])))
            .collect();
        let vertex_of = |node: u32| nodes.partition_point(|&other| other < node) as u32;
        let mut triangles = Vec::with_capacity(4 * facets.len());
        for (number, facet) in facets.iter().enumerate() {
            let mut add = |corners: [u32; 3]| {
                triangles.push(Triangle {
                    corners,
                    edges: [u32::MAX; 3], // set by `edges_of`
                    facet: number as u32,
                    nodes: *facet,
                });
            };
            let around: Vec<u32> = facet.iter().map(|&node| vertex_of(node)).collect();
            if let &[a, b, c] = around.as_slice() {
                add([a, b, c]);
                continue;
            }
            let mean = corners.len() as u32;
            corners.push(corner(*facet));
            for k in 0..around.len() {
                add([around[k], around[(k + 1) % around.len()], mean]);
            }
        }
        let of_vertices = |facet: &Nodes| facet.iter().map(|&node| vertex_of(node)).collect();
        let edges = edges_of(&mut triangles, &corners);
        let count = corners.len();
        let size = |block: &MeshBlock| {
            let nodes = block.nodes.start as usize..block.nodes.end as usize;
            let Aabb { min, max } = Aabb::around(mesh.nodes[nodes].iter().copied(), 0.0);
            norm(&sub(&max, &min))
        };
        Self {
            sizes: mesh.blocks.iter().map(size).collect(),
            vertex_count: nodes.len() as u32,
            facets: facets.iter().map(of_vertices).collect(),
            edges_at: Adjacency::new(edges.iter().map(|e| e.ends.as_slice()), count),
            triangles_at: Adjacency::new(triangles.iter().map(|t| t.corners.as_slice()), count),
            corners,
            triangles,
            edges,
            resolution,
        }
    }

    /// Returns the nodes of a corner, which all have the same weight.
    pub(crate) fn nodes_of_corner(&self, corner: u32) -> &[u32] {
        &self.corners[corner as usize].nodes
    }

    /// Returns the nodes of an edge.
    pub(crate) fn nodes_of_edge(&self, edge: u32) -> &[u32] {
        &self.edges[edge as usize].nodes
    }

    /// Returns the nodes of the facet of a triangle.
    pub(crate) fn nodes_of_triangle(&self, triangle: u32) -> &[u32] {
        &self.triangles[triangle as usize].nodes
    }

    /// Returns the vertices of a facet of the mesh.
    pub(crate) fn facet(&self, facet: u32) -> &[u32] {
        &self.facets[facet as usize]
    }

    /// Returns the edge between two vertices of a facet.
    pub(crate) fn edge_between(&self, one: u32, other: u32) -> Option<u32> {
        let edges = self.edges_at(one).iter().copied();
        let mut ends = edges.filter(|&e| self.edges[e as usize].ends.contains(&other));
        ends.next()
    }

    /// Returns the block of a corner.
    pub(crate) fn block(&self, corner: u32) -> u32 {
        self.corners[corner as usize].block
    }

    /// Returns the edges that end at a corner.
    pub(crate) fn edges_at(&self, corner: u32) -> &[u32] {
        self.edges_at.of(corner)
    }

    /// Returns the triangles at a corner.
    pub(crate) fn triangles_at(&self, corner: u32) -> &[u32] {
        self.triangles_at.of(corner)
    }

    /// Returns the mean of `of` over the nodes of a corner.
    pub(crate) fn mean(&self, corner: u32, of: impl Fn(u32) -> [f64; 3]) -> [f64; 3] {
        match self.nodes_of_corner(corner) {
            &[node] => of(node),
            nodes => {
                let sum = nodes
                    .iter()
                    .fold([0.0; 3], |sum, &node| add(&sum, &of(node)));
                scale(1.0 / nodes.len() as f64, &sum)
            }
        }
    }

    /// Returns the position of a corner, m.
    #[inline]
    pub(crate) fn point(&self, corner: u32, at: Configuration<3>) -> [f64; 3] {
        match at.cache() {
            Some(cache) => cache.points.get(corner, || self.compute_point(corner, at)),
            None => self.compute_point(corner, at),
        }
    }

    /// Computes the position of a corner without the cache, m.
    fn compute_point(&self, corner: u32, at: Configuration<3>) -> [f64; 3] {
        self.mean(corner, |node| at.at(node))
    }

    /// Returns the positions of the corners of a triangle, m.
    pub(crate) fn triangle(&self, triangle: u32, at: Configuration<3>) -> [[f64; 3]; 3] {
        let [a, b, c] = self.triangles[triangle as usize].corners;
        [self.point(a, at), self.point(b, at), self.point(c, at)]
    }

    /// Returns the positions of the ends of an edge, m.
    pub(crate) fn edge(&self, edge: u32, at: Configuration<3>) -> [[f64; 3]; 2] {
        let [a, b] = self.edges[edge as usize].ends;
        [self.point(a, at), self.point(b, at)]
    }

    /// Returns the outward unit normal of a triangle.
    #[inline]
    pub(crate) fn normal(&self, triangle: u32, at: Configuration<3>) -> [f64; 3] {
        match at.cache() {
            Some(_) => self.triangle_shape(triangle, at).normal,
            None => scaled_normal(&self.triangle(triangle, at)).0,
        }
    }

    /// Returns the normal and size of a triangle.
    #[inline]
    pub(super) fn triangle_shape(&self, triangle: u32, at: Configuration<3>) -> TriangleShape {
        match at.cache() {
            Some(cache) => cache
                .triangle_shapes
                .get(triangle, || self.compute_triangle_shape(triangle, at)),
            None => self.compute_triangle_shape(triangle, at),
        }
    }

    /// Computes the normal and size of a triangle without the cache.
    fn compute_triangle_shape(&self, triangle: u32, at: Configuration<3>) -> TriangleShape {
        let corners = self.triangle(triangle, at);
        let (normal, twice_area) = scaled_normal(&corners);
        let [a, b, c] = corners;
        let sides = [sub(&b, &a), sub(&c, &b), sub(&a, &c)];
        let longest = sides.iter().map(|side| dot(side, side)).fold(0.0, f64::max);
        TriangleShape {
            normal,
            twice_area,
            least_height: twice_area / longest.sqrt(),
        }
    }

    /// Returns an empty cache of all points, triangles and edges.
    pub(super) fn geometry_cache(&self) -> GeometryCache<3> {
        GeometryCache::new([self.corners.len(), self.triangles.len(), self.edges.len()])
    }

    /// Returns the vector from `corner` along an edge that ends there, with the length of the edge,
    /// m.
    pub(crate) fn away(&self, corner: u32, edge: u32, at: Configuration<3>) -> [f64; 3] {
        let [a, b] = self.edge(edge, at);
        if self.edges[edge as usize].ends[0] == corner {
            sub(&b, &a)
        } else {
            sub(&a, &b)
        }
    }

    /// Returns the unit vectors across an edge into the triangles on its two sides; `None` if there
    /// are more than two.
    pub(crate) fn directions_into_sides(
        &self,
        edge: u32,
        at: Configuration<3>,
    ) -> Option<[[f64; 3]; 2]> {
        let sides = self.edges[edge as usize].sides?;
        let [a, b] = self.edge(edge, at);
        let along = sub(&b, &a);
        let along = scale(1.0 / norm(&along), &along);
        let normals = sides.map(|side| self.normal(side, at));
        Some([cross(&normals[0], &along), cross(&along, &normals[1])])
    }

    /// Returns the turn of the boundary at an edge, rad: positive if the edge is convex, π if it
    /// has more than two triangles.
    pub(crate) fn turn(&self, edge: u32, at: Configuration<3>) -> f64 {
        let Some(sides) = self.edges[edge as usize].sides else {
            return std::f64::consts::PI;
        };
        let [a, b] = self.edge(edge, at);
        let along = sub(&b, &a);
        let [sine, cosine] = self.turned(sides, &along, norm(&along), at);
        angle(sine, cosine)
    }

    /// Returns the sine and cosine of the turn of the boundary from one triangle to another over
    /// the edge `along`, of a length, m.
    pub(super) fn turned(
        &self,
        sides: [u32; 2],
        along: &[f64; 3],
        length: f64,
        at: Configuration<3>,
    ) -> [f64; 2] {
        let [one, other] = sides.map(|side| self.normal(side, at));
        let sine = dot(&cross(&one, &other), along) / length;
        [sine, dot(&one, &other)]
    }

    /// Returns the corner of a triangle that is not on one of its edges.
    pub(super) fn opposite_corner(&self, triangle: u32, edge: u32) -> u32 {
        let Triangle { corners, edges, .. } = &self.triangles[triangle as usize];
        let k = edges.iter().position(|&of| of == edge).unwrap_or(0);
        corners[(k + 2) % 3]
    }

    /// Returns the sum of the normals on the two sides of an edge.
    pub(crate) fn outward(&self, edge: u32, at: Configuration<3>) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for side in self.edges[edge as usize].sides.into_iter().flatten() {
            add_scaled(&mut sum, 1.0, &self.normal(side, at));
        }
        sum
    }

    /// Returns the triangle on the other side of edge `k` of a triangle.
    pub(crate) fn across(&self, triangle: u32, k: usize) -> Option<u32> {
        let edge = self.triangles[triangle as usize].edges[k];
        let [one, other] = self.edges[edge as usize].sides?;
        Some(if one == triangle { other } else { one })
    }
}

/// Returns the angle of a sine and a cosine, rad. Most angles are small.
#[inline]
pub(super) fn angle(sine: f64, cosine: f64) -> f64 {
    if cosine > 0.0 && sine.abs() < ANGLE_SERIES {
        sine * (1.0 + sine * sine / 6.0)
    } else {
        sine.atan2(cosine)
    }
}

/// Returns the outward unit normal of a triangle, and twice its area, m².
#[inline]
pub(crate) fn scaled_normal([a, b, c]: &[[f64; 3]; 3]) -> ([f64; 3], f64) {
    let normal = cross(&sub(b, a), &sub(c, a));
    let twice_area = norm(&normal);
    (scale(1.0 / twice_area, &normal), twice_area)
}

/// Returns the edges of the triangles, and sets their edge numbers in these.
fn edges_of(triangles: &mut [Triangle], corners: &[Corner]) -> Vec<Edge> {
    let mut sides: Vec<([u32; 2], u32, usize)> = Vec::with_capacity(3 * triangles.len());
    for (number, triangle) in triangles.iter().enumerate() {
        for k in 0..3 {
            let ends = [triangle.corners[k], triangle.corners[(k + 1) % 3]];
            sides.push((ends, number as u32, k));
        }
    }
    let key = |ends: [u32; 2]| (ends[0].min(ends[1]), ends[0].max(ends[1]));
    sides.sort_unstable_by_key(|&(ends, triangle, k)| (key(ends), triangle, k));
    let mut edges = Vec::with_capacity(sides.len() / 2);
    for around in sides.chunk_by(|one, other| key(one.0) == key(other.0)) {
        let ends = around[0].0;
        let mut nodes = Nodes::default();
        for end in ends {
            let of_end = corners[end as usize].nodes.iter();
            of_end.for_each(|&node| nodes.push(node));
        }
        for &(_, triangle, k) in around {
            triangles[triangle as usize].edges[k] = edges.len() as u32;
        }
        let sides = match around {
            [one, other] if other.0 == [ends[1], ends[0]] => Some([one.1, other.1]),
            _ => None,
        };
        edges.push(Edge { ends, sides, nodes });
    }
    edges
}
