//! Overlap of blocks before anything has moved.

use std::borrow::Cow;

use crate::math::vector::{dot, norm, sub};
use crate::mesh::box_tree::{Box, BoxTree, widened};
use crate::mesh::simplex::{Piece, crossing, distance_to, normal};
use crate::mesh::vector::{between, bounds, centre, distance};
use crate::mesh::{Facet, Mesh};

/// Two blocks that overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap<const D: usize> {
    /// Indices into [`Mesh::blocks`]: the block of the point, and the block that the point lies in.
    pub blocks: [usize; 2],
    /// A point of the first inside the second, m.
    pub point: [f64; D],
    /// Its distance from the second's boundary, m.
    pub depth: f64,
}

/// Returns the deepest overlap of two blocks that is deeper than `tolerance`, m, among the pairs
/// for which `matters` is true (called with indices into [`Mesh::blocks`]).
///
/// The points tested are boundary vertices, the midpoints of the pieces into which facets of the
/// other block cut a boundary edge, the middle of the part of a facet inside an element of the
/// other block, and the centres of boundary elements. This finds any overlap that is not much
/// smaller than an element, also with flush sides. Blocks need not be convex. Cost: about n·log n
/// in the elements near other blocks.
#[must_use]
pub fn overlap<const D: usize>(
    mesh: &Mesh<D>,
    tolerance: f64,
    matters: &dyn Fn(usize, usize) -> bool,
) -> Option<Overlap<D>> {
    let mut search = OverlapSearch::new(mesh, tolerance, matters);
    let facets = search.facets.clone();
    for (point, blocks) in by_place(vertices(mesh, &facets)) {
        search.probe(point[0], &blocks);
    }
    let mut elements: Vec<_> = facets.iter().map(|facet| facet.element).collect();
    elements.dedup();
    for element in elements {
        let corners = mesh.elements[element as usize].nodes().iter();
        let centre = centre(corners.map(|&n| mesh.nodes[n as usize]));
        search.probe(centre, &[mesh.block_of(element)]);
    }
    for (edge, blocks) in by_place(edges(mesh, &facets)) {
        search.probe_edge(edge, &blocks);
    }
    for &facet in &*facets {
        search.probe_facet(facet);
    }
    search.deepest
}

impl<const D: usize> Mesh<D> {
    /// Returns the block of an element.
    fn block_of(&self, element: u32) -> usize {
        self.blocks
            .partition_point(|block| block.elements.end <= element)
    }

    fn element_box(&self, element: u32) -> Box<D> {
        let nodes = self.elements[element as usize].nodes().iter();
        bounds(nodes.map(|&n| self.nodes[n as usize]))
    }

    fn facet_box(&self, facet: Facet) -> Box<D> {
        bounds(self.facet_nodes(facet).map(|n| self.nodes[n as usize]))
    }
}

/// Returns the vertices of the facets, each once, with their blocks.
fn vertices<const D: usize>(mesh: &Mesh<D>, facets: &[Facet]) -> Vec<([[f64; D]; 1], usize)> {
    let mut nodes: Vec<_> = facets.iter().flat_map(|&f| mesh.facet_nodes(f)).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let block_of = |node: u32| mesh.blocks.partition_point(|block| block.nodes.end <= node);
    let with_block = |&node: &u32| ([mesh.nodes[node as usize]], block_of(node));
    nodes.iter().map(with_block).collect()
}

/// Returns the edges of the facets, each once, with their blocks.
fn edges<const D: usize>(mesh: &Mesh<D>, facets: &[Facet]) -> Vec<([[f64; D]; 2], usize)> {
    let mut edges = Vec::new();
    for &facet in facets {
        let block = mesh.block_of(facet.element);
        let nodes = mesh.facet_nodes(facet);
        let next = nodes.clone().cycle().skip(1);
        edges.extend(nodes.zip(next).map(|(a, b)| ([a.min(b), a.max(b)], block)));
    }
    edges.sort_unstable();
    edges.dedup();
    let place = |node: u32| mesh.nodes[node as usize];
    edges
        .into_iter()
        .map(|(edge, block)| (edge.map(place), block))
        .collect()
}

/// Merges items of several blocks at exactly one place, as in the parts of a split mesh. Testing
/// these once takes a tenth of the time.
fn by_place<const D: usize, const N: usize>(
    items: Vec<([[f64; D]; N], usize)>,
) -> Vec<([[f64; D]; N], Vec<usize>)> {
    let bits = |place: &[f64; D]| place.map(f64::to_bits);
    let key = |mut places: [[f64; D]; N]| {
        places.sort_unstable_by_key(bits);
        places.map(|place| bits(&place))
    };
    let mut keyed: Vec<_> = items
        .into_iter()
        .map(|(at, block)| (key(at), block, at))
        .collect();
    keyed.sort_unstable_by_key(|&(key, block, _)| (key, block));
    let same = keyed.chunk_by(|a, b| a.0 == b.0);
    same.map(|chunk| {
        (
            chunk[0].2,
            chunk.iter().map(|&(_, block, _)| block).collect(),
        )
    })
    .collect()
}

struct OverlapSearch<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    tolerance: f64,
    matters: &'a dyn Fn(usize, usize) -> bool,
    /// Elements near a block with which theirs must not overlap.
    elements: BoxTree<D>,
    /// Boundary facets of all blocks, sorted.
    facets: Cow<'a, [Facet]>,
    /// Boundary facets by position; numbers are indices into `facets`.
    facet_tree: BoxTree<D>,
    deepest: Option<Overlap<D>>,
}

/// Rounding allowed in the test of a point against the facets of an element, over the element's
/// size. The depth then decides.
const SIDE: f64 = 1e-9;

impl<'a, const D: usize> OverlapSearch<'a, D> {
    fn new(mesh: &'a Mesh<D>, tolerance: f64, matters: &'a dyn Fn(usize, usize) -> bool) -> Self {
        let block_box = |nodes: &std::ops::Range<u32>| {
            bounds(
                mesh.nodes[nodes.start as usize..nodes.end as usize]
                    .iter()
                    .copied(),
            )
        };
        let blocks = mesh.blocks.iter().map(|block| block_box(&block.nodes));
        let blocks = BoxTree::new(blocks.zip(0..).collect());
        let near_another = |element: u32| {
            let block = mesh.block_of(element);
            let mut near = false;
            blocks.visit(&mesh.element_box(element), |other| {
                near |= other as usize != block && matters(block, other as usize);
            });
            near
        };
        let elements = (0..mesh.elements.len() as u32).filter(|&element| near_another(element));
        let elements = elements
            .map(|element| (mesh.element_box(element), element))
            .collect();
        let facets = mesh.boundary_facets();
        let boxes = facets.iter().map(|&facet| mesh.facet_box(facet));
        Self {
            mesh,
            tolerance,
            matters,
            elements: BoxTree::new(elements),
            facet_tree: BoxTree::new(boxes.zip(0..).collect()),
            facets,
            deepest: None,
        }
    }

    /// Tests the depth of a point of some blocks in other blocks.
    fn probe(&mut self, point: [f64; D], blocks: &[usize]) {
        let mut hosts = Vec::new();
        self.elements.visit(&(point, point), |element| {
            if self.is_inside(element, point) {
                hosts.push((self.mesh.block_of(element), element));
            }
        });
        hosts.sort_unstable();
        hosts.dedup_by_key(|&mut (host, _)| host);
        hosts.retain(|&(host, _)| self.owner(blocks, host).is_some());
        if hosts.is_empty() {
            return;
        }
        // Most points that touch other blocks touch many of them, at their boundary.
        for host in self.close_hosts(point, self.tolerance) {
            hosts.retain(|&(other, _)| other != host);
        }
        for (host, element) in hosts {
            let depth = self.depth(point, host, element);
            let known = self.deepest.map_or(self.tolerance, |deepest| deepest.depth);
            if let Some(block) = self.owner(blocks, host).filter(|_| depth > known) {
                self.deepest = Some(Overlap {
                    blocks: [block, host],
                    point,
                    depth,
                });
            }
        }
    }

    /// Returns the first of some blocks that must not overlap `host`.
    fn owner(&self, blocks: &[usize], host: usize) -> Option<usize> {
        let asked = |&block: &usize| block != host && (self.matters)(block, host);
        blocks.iter().copied().find(asked)
    }

    /// Returns the blocks with a facet no farther from a point than `radius`.
    fn close_hosts(&self, point: [f64; D], radius: f64) -> Vec<usize> {
        let mut close = Vec::new();
        self.facet_tree
            .visit(&widened((point, point), radius), |number| {
                let facet = self.facets[number as usize];
                if self
                    .mesh
                    .pieces(facet)
                    .any(|piece| distance_to(&piece, point) <= radius)
                {
                    close.push(self.mesh.block_of(facet.element));
                }
            });
        close.sort_unstable();
        close.dedup();
        close
    }

    /// Tests the pieces into which other blocks cut an edge.
    fn probe_edge(&mut self, edge: [[f64; D]; 2], blocks: &[usize]) {
        let reach = SIDE * distance(edge[0], edge[1]);
        let mut cuts = Vec::new();
        self.facet_tree.visit(&bounds(edge.into_iter()), |number| {
            // The geometric test runs first: it rejects nearly all, at less cost.
            let facet = self.facets[number as usize];
            for piece in self.mesh.pieces(facet) {
                if let Some(share) = crossing(&piece, edge, reach) {
                    cuts.push((self.mesh.block_of(facet.element), share));
                }
            }
        });
        cuts.retain(|&(host, _)| self.owner(blocks, host).is_some());
        cuts.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        for cuts in cuts.chunk_by(|a, b| a.0 == b.0) {
            let mut start = 0.0;
            for end in cuts.iter().map(|&(_, share)| share).chain([1.0]) {
                self.probe(between(edge[0], edge[1], 0.5 * (start + end)), blocks);
                start = end;
            }
        }
    }

    /// Tests the part of a facet inside elements of other blocks. Blocks with flush sides may have
    /// neither corners nor edges inside each other.
    fn probe_facet(&mut self, facet: Facet) {
        let block = self.mesh.block_of(facet.element);
        let mut points = Vec::new();
        self.elements.visit(&self.mesh.facet_box(facet), |element| {
            let is_asked = self.owner(&[block], self.mesh.block_of(element)).is_some();
            if is_asked && !self.is_outside(facet, element) {
                let pieces = self.mesh.pieces(facet);
                points.extend(pieces.filter_map(|piece| self.middle_inside(&piece, element)));
            }
        });
        for point in points {
            self.probe(point, &[block]);
        }
    }

    /// True if a facet lies on the outer side of a facet of an element. Then none of its pieces has
    /// a [middle inside](Self::middle_inside). This holds for most facets that touch.
    fn is_outside(&self, facet: Facet, element: u32) -> bool {
        let corners = self.mesh.facet_nodes(facet);
        let corners = corners.map(|node| &self.mesh.nodes[node as usize]);
        self.sides(element).any(|facet| {
            let least = self.least_height(facet);
            let mut sides = self.mesh.pieces(facet);
            sides.any(|side| corners.clone().all(|corner| height(&side, corner) > least))
        })
    }

    /// Returns the smallest height above a facet of an element at which a point counts as outside
    /// it, m. At a boundary facet, blocks may overlap by the tolerance.
    fn least_height(&self, facet: Facet) -> f64 {
        match self.facets.binary_search(&facet) {
            Ok(_) => -self.tolerance,
            Err(_) => 0.0,
        }
    }

    /// Returns a point in the middle of the part of a piece that lies in an element; `None` if no
    /// part lies in it, or only within the tolerance of its boundary facets.
    fn middle_inside(&self, piece: &Piece<D>, element: u32) -> Option<[f64; D]> {
        let mut part = piece[..D].to_vec();
        for facet in self.sides(element) {
            let least = self.least_height(facet);
            for side in self.mesh.pieces(facet) {
                let above: Vec<f64> = part.iter().map(|point| height(&side, point)).collect();
                let lowest = above.iter().copied().fold(f64::INFINITY, f64::min);
                if lowest > least {
                    return None;
                }
                part = below(&part, &above);
            }
        }
        Some(centre(part.into_iter()))
    }

    /// Returns the facets of an element.
    fn sides(&self, element: u32) -> impl Iterator<Item = Facet> + use<D> {
        let count = self.mesh.elements[element as usize].kind.facets().len() as u8;
        (0..count).map(move |local| Facet { element, local })
    }

    fn is_inside(&self, element: u32, point: [f64; D]) -> bool {
        let (low, high) = self.mesh.element_box(element);
        let slack = SIDE * distance(low, high);
        self.sides(element)
            .flat_map(|facet| self.mesh.pieces(facet))
            .all(|side| height(&side, &point) <= slack)
    }

    /// Returns the distance from a point in an element of `host` to the boundary of `host`.
    fn depth(&self, point: [f64; D], host: usize, element: u32) -> f64 {
        let (low, high) = self.mesh.element_box(element);
        let mut radius = self.tolerance.max(0.1 * distance(low, high));
        loop {
            let mut nearest = f64::INFINITY;
            self.facet_tree
                .visit(&widened((point, point), radius), |number| {
                    let facet = self.facets[number as usize];
                    if self.mesh.block_of(facet.element) == host {
                        let pieces = self.mesh.pieces(facet);
                        nearest = pieces
                            .map(|p| distance_to(&p, point))
                            .fold(nearest, f64::min);
                    }
                });
            if nearest <= radius || !radius.is_finite() {
                return nearest;
            }
            radius *= 4.0;
        }
    }
}

/// Returns the height of a point above the plane of a facet's piece, outward positive, m.
fn height<const D: usize>(side: &Piece<D>, point: &[f64; D]) -> f64 {
    let normal = normal(side);
    dot(&normal, &sub(point, &side[0])) / norm(&normal)
}

/// Clips a convex polygon, in 2-D a segment, to the part below a plane; `above` is the height of
/// each corner above the plane, m (Sutherland and Hodgman).
fn below<const D: usize>(corners: &[[f64; D]], above: &[f64]) -> Vec<[f64; D]> {
    let mut kept = Vec::with_capacity(corners.len() + 1);
    for (k, (corner, &height)) in corners.iter().zip(above).enumerate() {
        let next = (k + 1) % corners.len();
        if height <= 0.0 {
            kept.push(*corner);
        }
        if (height < 0.0 && above[next] > 0.0) || (height > 0.0 && above[next] < 0.0) {
            let share = height / (height - above[next]);
            kept.push(between(*corner, corners[next], share));
        }
    }
    kept
}
