//! Trees of halves over the refined elements.

use std::collections::{BTreeSet, HashMap};

use crate::math::vector::{add, norm, sub};
use crate::mesh::Element;
use crate::refinement::base_mesh::BaseMesh;
use crate::refinement::bisection::{BisectedSimplex, EdgeLength};
use crate::refinement::simplex_split;

/// Parents of a new node, base or new nodes; at rest it lies at their mean. They are the ends of an
/// edge, or the corners of a quadrilateral or of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Parents {
    nodes: [u32; 8],
    count: u8,
}

impl Parents {
    /// Builds the parents from nodes in any order.
    pub(super) fn new(of: &[u32]) -> Self {
        let mut nodes = [u32::MAX; 8];
        nodes[..of.len()].copy_from_slice(of);
        nodes.sort_unstable();
        let count = of.len() as u8;
        Self { nodes, count }
    }

    /// Returns the nodes, all of equal weight.
    pub(crate) fn nodes(&self) -> &[u32] {
        &self.nodes[..self.count as usize]
    }
}

/// A simplex that comes from an element.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leaf<'a, C> {
    /// Its nodes.
    pub(crate) cell: &'a C,
    /// The element that it comes from.
    pub(crate) root: u32,
    /// Fraction of its volume that it stands for: 1, or ½ where two simplices overlap (see
    /// [`simplex_split`]).
    pub(crate) weight: f64,
    /// The part of the root element that it is.
    pub(crate) lineage: Lineage,
}

/// The part of an element that a simplex is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Lineage {
    /// The piece of the element from which it is bisected.
    piece: u16,
    /// Choice of half in each generation, from the highest bit on.
    path: u64,
    /// Number of bisections.
    generation: u8,
}

/// Relative difference of the lengths of two edges up to which they count as equal, so that their
/// nodes decide. Lengths fall into classes of this width. The wider these are, the more rarely does
/// round-off move a length from one to another.
const EQUAL_EDGES: f64 = 1e-4;

/// Upper bound of the number of pieces over a facet.
const MOST_PIECES: u16 = 8;

/// First number of the pieces of half weight.
const HALVES: u16 = 64;

impl Lineage {
    fn of_piece(piece: u16) -> Self {
        Self {
            piece,
            path: 0,
            generation: 0,
        }
    }

    /// Returns the lineage of the first or the second half. Beyond 64 generations both are equal.
    fn half(self, second: bool) -> Self {
        let bit = 1_u64.checked_shl(63_u32.saturating_sub(u32::from(self.generation)));
        let bit = bit.filter(|_| second && self.generation < 64);
        Self {
            path: self.path | bit.unwrap_or(0),
            generation: self.generation + 1,
            ..self
        }
    }

    /// Returns true if `other` is the same part or lies in it.
    pub(crate) fn holds(&self, other: &Self) -> bool {
        let length = u32::from(self.generation.min(64));
        let differ = (self.path ^ other.path)
            .checked_shr(64 - length)
            .unwrap_or(0);
        self.piece == other.piece && self.generation <= other.generation && differ == 0
    }
}

/// The refined elements and the trees over them.
#[derive(Clone, Debug)]
pub(crate) struct Forest<const D: usize, C> {
    /// Number of base nodes; the new nodes follow them.
    node_count: u32,
    /// Parents of the new nodes, and their rest positions, m.
    parents: Vec<Parents>,
    points: Vec<[f64; D]>,
    /// Root elements of the base mesh, with their first trees.
    roots: Vec<(u32, u32)>,
    /// Halves come in pairs, after the tree that they halve.
    trees: Vec<Tree<C>>,
}

#[derive(Clone, Copy, Debug)]
struct Tree<C> {
    cell: C,
    /// The element that it comes from.
    root: u32,
    origin: TreeOrigin,
    lineage: Lineage,
    /// Index of the first half if it is bisected, else 0.
    halves: u32,
}

/// Origin of a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TreeOrigin {
    /// A whole element.
    Element,
    /// A piece of an element.
    Piece,
    /// One of two overlapping pieces of half weight next to the whole element `before`.
    Half { before: u32 },
}

impl<const D: usize, C: BisectedSimplex> Forest<D, C> {
    /// Builds the coarsest conforming mesh of halves in which no simplex is `wanted` smaller.
    /// `wanted` gets its corners and its root element; `seeds` are the elements of the base mesh to
    /// check.
    pub(crate) fn new(
        base: BaseMesh<D>,
        seeds: &[u32],
        wanted: impl Fn(&[[f64; D]], u32) -> bool,
    ) -> Self {
        let is_wanted = |&&element: &&u32| {
            let nodes = base.element(element).nodes().iter();
            let corners: Vec<_> = nodes.map(|&node| base.point(node)).collect();
            wanted(&corners, element)
        };
        let mut root_elements: BTreeSet<u32> = seeds.iter().filter(is_wanted).copied().collect();
        loop {
            let mut growth = Growth::new(base, &wanted, root_elements);
            growth.grow();
            if growth.missing_roots.is_empty() {
                return growth.forest;
            }
            // The pieces of an element change if its neighbour is split into pieces.
            root_elements = growth.root_elements;
            root_elements.extend(growth.missing_roots);
        }
    }

    /// Returns the parents of the new nodes, which are numbered after the base nodes.
    pub(crate) fn parents(&self) -> &[Parents] {
        &self.parents
    }

    /// Returns the replaced elements of the base mesh.
    pub(crate) fn roots(&self) -> impl Iterator<Item = u32> {
        let replaced = |&&(_, tree): &&(u32, u32)| !self.trees[tree as usize].is_untouched();
        self.roots
            .iter()
            .filter(replaced)
            .map(|&(element, _)| element)
    }

    /// Returns the simplices that replace them.
    pub(crate) fn leaves(&self) -> impl Iterator<Item = Leaf<'_, C>> {
        let leaves = self.trees.iter().filter(|tree| tree.halves == 0);
        leaves.filter(|tree| !tree.is_untouched()).map(|tree| Leaf {
            cell: &tree.cell,
            root: tree.root,
            weight: match tree.origin {
                TreeOrigin::Element | TreeOrigin::Piece => 1.0,
                TreeOrigin::Half { .. } => 0.5,
            },
            lineage: tree.lineage,
        })
    }

    /// Returns the rest position of a node, m.
    pub(crate) fn point(&self, base: BaseMesh<D>, node: u32) -> [f64; D] {
        match node.checked_sub(self.node_count) {
            None => base.point(node),
            Some(new) => self.points[new as usize],
        }
    }
}

impl<C> Tree<C> {
    /// Returns true if it is a whole base element.
    fn is_untouched(&self) -> bool {
        self.halves == 0 && self.lineage.generation == 0 && self.origin == TreeOrigin::Element
    }
}

/// A forest under construction.
struct Growth<'a, const D: usize, W, C> {
    base: BaseMesh<'a, D>,
    wanted: &'a W,
    forest: Forest<D, C>,
    /// New nodes by their parents.
    middles: HashMap<Parents, u32>,
    /// Elements that are roots.
    root_elements: BTreeSet<u32>,
    /// Elements that must become roots too; the forest is then rebuilt.
    missing_roots: BTreeSet<u32>,
    /// Trees without halves: those to check, and those that are small enough.
    pending: Vec<u32>,
    leaves: Vec<u32>,
}

impl<'a, const D: usize, W: Fn(&[[f64; D]], u32) -> bool, C: BisectedSimplex> Growth<'a, D, W, C> {
    fn new(base: BaseMesh<'a, D>, wanted: &'a W, root_elements: BTreeSet<u32>) -> Self {
        let mut growth = Self {
            base,
            wanted,
            middles: HashMap::new(),
            missing_roots: BTreeSet::new(),
            pending: Vec::new(),
            leaves: Vec::new(),
            root_elements,
            forest: Forest {
                node_count: base.node_count(),
                parents: Vec::new(),
                points: Vec::new(),
                roots: Vec::new(),
                trees: Vec::new(),
            },
        };
        for element in growth.root_elements.clone() {
            growth.add_roots(element);
        }
        growth
    }

    fn grow(&mut self) {
        loop {
            while let Some(tree) = self.pending.pop() {
                if self.is_wanted_smaller(tree) {
                    self.bisect(tree);
                } else {
                    self.leaves.push(tree);
                }
            }
            let leaves = std::mem::take(&mut self.leaves);
            let hangs = |&tree: &u32| self.has_middle(tree);
            let (hanging, whole): (Vec<u32>, _) = leaves.into_iter().partition(hangs);
            self.leaves = whole;
            if hanging.is_empty() {
                break;
            }
            for tree in hanging {
                self.bisect(tree);
            }
        }
    }

    /// Makes an element the root of one tree, or of one tree per piece.
    fn add_roots(&mut self, element: u32) {
        let Element { kind, .. } = *self.base.element(element);
        let nodes = self.base.element(element).nodes();
        let first = self.forest.trees.len() as u32;
        self.forest.roots.push((element, first));
        if simplex_split::is_simplex(kind) {
            self.add_tree(element, nodes, TreeOrigin::Element, 0);
            return;
        }
        let centre = self.middle(Parents::new(nodes));
        for (number, facet) in kind.facets().iter().enumerate() {
            let facet: Vec<u32> = facet.iter().map(|&i| nodes[i as usize]).collect();
            let across = self.base.across(element, number);
            let first = MOST_PIECES * number as u16;
            match across.filter(|beside| !self.root_elements.contains(beside)) {
                Some(before) if facet.len() == 4 => {
                    for (k, piece) in (first..).zip(simplex_split::halves_over(&facet, centre)) {
                        self.add_tree(element, &piece, TreeOrigin::Half { before }, HALVES + k);
                    }
                }
                _ => {
                    let middle = |facet: &[u32]| self.middle(Parents::new(facet));
                    for (k, piece) in
                        (first..).zip(simplex_split::pieces_over(&facet, centre, middle))
                    {
                        self.add_tree(element, &piece, TreeOrigin::Piece, k);
                    }
                }
            }
        }
    }

    fn add_tree(&mut self, root: u32, nodes: &[u32], origin: TreeOrigin, piece: u16) {
        let length = |edge: [u32; 2]| -> EdgeLength {
            let [a, b] = edge.map(|node| self.forest.point(self.base, node));
            ((norm(&sub(&b, &a)).ln() / EQUAL_EDGES).round() as i64, edge)
        };
        self.pending.push(self.forest.trees.len() as u32);
        self.forest.trees.push(Tree {
            cell: C::new(nodes, length),
            root,
            origin,
            lineage: Lineage::of_piece(piece),
            halves: 0,
        });
    }

    fn is_wanted_smaller(&self, tree: u32) -> bool {
        let tree = &self.forest.trees[tree as usize];
        let nodes = tree.cell.nodes().iter();
        let corners: Vec<_> = nodes.map(|&n| self.forest.point(self.base, n)).collect();
        (self.wanted)(&corners, tree.root)
    }

    /// Returns true if a neighbour is bisected at a common edge.
    fn has_middle(&self, tree: u32) -> bool {
        let mut edges = self.forest.trees[tree as usize].cell.edges();
        edges.any(|edge| self.middles.contains_key(&Parents::new(&edge)))
    }

    fn bisect(&mut self, tree: u32) {
        let parent = self.forest.trees[tree as usize];
        if let TreeOrigin::Half { before } = parent.origin {
            self.missing_roots.insert(before);
            return;
        }
        let edge = parent.cell.refinement_edge();
        let middle = self.middle(Parents::new(&edge));
        self.require_roots(edge);
        let halves = self.forest.trees.len() as u32;
        self.forest.trees[tree as usize].halves = halves;
        for (cell, number) in parent.cell.halves(middle).into_iter().zip(halves..) {
            self.forest.trees.push(Tree {
                cell,
                lineage: parent.lineage.half(number > halves),
                halves: 0,
                ..parent
            });
            self.pending.push(number);
        }
    }

    /// Returns the node at the mean of its parents; adds it if it is new.
    fn middle(&mut self, parents: Parents) -> u32 {
        let forest = &mut self.forest;
        if let Some(&node) = self.middles.get(&parents) {
            return node;
        }
        let node = forest.node_count + forest.points.len() as u32;
        let points = parents.nodes().iter().map(|&n| forest.point(self.base, n));
        let sum = points.fold([0.0; D], |sum, point| add(&sum, &point));
        let count = f64::from(parents.count);
        forest.points.push(sum.map(|x| x / count));
        forest.parents.push(parents);
        self.middles.insert(parents, node);
        node
    }

    /// Makes all elements at a bisected edge of the base mesh roots.
    fn require_roots(&mut self, edge: [u32; 2]) {
        if edge[1] >= self.forest.node_count {
            return;
        }
        let beside: Vec<u32> = self.base.at_edge(edge).collect();
        for element in beside {
            if self.root_elements.contains(&element) {
                continue;
            }
            if simplex_split::is_simplex(self.base.element(element).kind) {
                self.root_elements.insert(element);
                self.add_roots(element);
            } else {
                self.missing_roots.insert(element);
            }
        }
    }
}
