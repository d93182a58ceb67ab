//! Blocks that lie in each other before anything has moved.

use std::borrow::Cow;

use crate::math::vector::{dot, norm, sub};
use crate::mesh::box_tree::{Box, BoxTree, widened};
use crate::mesh::simplex::{Piece, crossing, distance_to, normal};
use crate::mesh::vector::{between, bounds, centre, distance};
use crate::mesh::{Facet, Mesh};

/// Two blocks that overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap<const D: usize> {
    /// Indices into [`Mesh::blocks`]: whose point it is, and in which it lies.
    pub blocks: [usize; 2],
    /// A point of the first inside the second, m.
    pub point: [f64; D],
    /// Its distance from the second's boundary, m.
    pub depth: f64,
}

/// The deepest overlap of two blocks that is deeper than `tolerance`, m, among
/// the pairs that `matters` (asked with indices into [`Mesh::blocks`]).
///
/// Looked at are vertices of the boundary, the pieces into which facets of the
/// other block cut its edges, what of its facets lies in elements of the other,
/// and the centres of its elements: enough for any overlap that is not much smaller
/// than an element, flush sides or not. Blocks need not be convex. Cost: about n·log n
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
    /// The block that an element belongs to.
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

/// Vertices of the facets, each once, with their blocks.
fn vertices<const D: usize>(mesh: &Mesh<D>, facets: &[Facet]) -> Vec<([[f64; D]; 1], usize)> {
    let mut nodes: Vec<_> = facets.iter().flat_map(|&f| mesh.facet_nodes(f)).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let block_of = |node: u32| mesh.blocks.partition_point(|block| block.nodes.end <= node);
    let with_block = |&node: &u32| ([mesh.nodes[node as usize]], block_of(node));
    nodes.iter().map(with_block).collect()
}

/// Edges of the facets, each once, with their blocks.
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

/// Joins what several blocks have at exactly one place, as the parts of a
/// split mesh do: looked at once, it costs a tenth.
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
    /// Elements that may lie in another block.
    elements: BoxTree<D>,
    /// Boundary facets of all blocks, sorted.
    facets: Cow<'a, [Facet]>,
    /// The same by place; numbers are indices into `facets`.
    facet_tree: BoxTree<D>,
    deepest: Option<Overlap<D>>,
}

/// Rounding that is forgiven where a point is asked for on which side of an
/// element's facet it lies, as a share of the element: the depth decides.
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

    /// Looks how deep a point of some blocks lies in others.
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
        // Most points that touch others touch many of them, at their boundary.
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

    /// The first of some blocks that must not lie in `host`.
    fn owner(&self, blocks: &[usize], host: usize) -> Option<usize> {
        let asked = |&block: &usize| block != host && (self.matters)(block, host);
        blocks.iter().copied().find(asked)
    }

    /// Blocks with a facet no farther from a point than `radius`.
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

    /// Probes the pieces into which other blocks cut an edge.
    fn probe_edge(&mut self, edge: [[f64; D]; 2], blocks: &[usize]) {
        let reach = SIDE * distance(edge[0], edge[1]);
        let mut cuts = Vec::new();
        self.facet_tree.visit(&bounds(edge.into_iter()), |number| {
            // The geometry first: it refuses nearly all, at less cost.
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

    /// Probes what of a facet lies in elements of others: blocks with flush sides may
    /// have neither corners nor edges inside each other.
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

    /// Whether a facet lies on the outer side of one of an element's: then nothing of its
    /// pieces has a [middle inside](Self::middle_inside). So it is with most that touch.
    fn is_outside(&self, facet: Facet, element: u32) -> bool {
        let corners = self.mesh.facet_nodes(facet);
        let corners = corners.map(|node| &self.mesh.nodes[node as usize]);
        self.sides(element).any(|facet| {
            let least = self.least_height(facet);
            let mut sides = self.mesh.pieces(facet);
            sides.any(|side| corners.clone().all(|corner| height(&side, corner) > least))
        })
    }

    /// How far outward of an element's facet all is that does not lie in it, m: boundaries may
    /// lie in each other by the tolerance.
    fn least_height(&self, facet: Facet) -> f64 {
        match self.facets.binary_search(&facet) {
            Ok(_) => -self.tolerance,
            Err(_) => 0.0,
        }
    }

    /// A point in the middle of what of a piece lies in an element; none where that
    /// is within the tolerance of a boundary facet of it.
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

    /// The facets of an element.
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

    /// Distance of a point in an element of `host` from the host's boundary.
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

/// How far a point lies outward of the plane of a facet's piece, m.
fn height<const D: usize>(side: &Piece<D>, point: &[f64; D]) -> f64 {
    let normal = normal(side);
    dot(&normal, &sub(point, &side[0])) / norm(&normal)
}

/// What of a convex polygon, in 2-D a segment, lies below a plane above which its
/// corners are by so much, m (Sutherland and Hodgman).
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
