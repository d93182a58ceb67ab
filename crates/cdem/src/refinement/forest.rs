//! Trees of halves over the elements that are refined.

use std::collections::{BTreeSet, HashMap};

use crate::math::vector::{add, norm, sub};
use crate::mesh::Element;
use crate::refinement::base_mesh::BaseMesh;
use crate::refinement::bisection::{BisectedSimplex, EdgeLength};
use crate::refinement::simplex_split;

/// Nodes of the base mesh or new ones, in the middle of which a new node lies at rest:
/// the ends of an edge, or the corners of a quadrilateral or of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Parents {
    nodes: [u32; 8],
    count: u8,
}

impl Parents {
    /// In any order.
    pub(super) fn new(of: &[u32]) -> Self {
        let mut nodes = [u32::MAX; 8];
        nodes[..of.len()].copy_from_slice(of);
        nodes.sort_unstable();
        let count = of.len() as u8;
        Self { nodes, count }
    }

    /// The nodes, each of the same weight.
    pub(crate) fn nodes(&self) -> &[u32] {
        &self.nodes[..self.count as usize]
    }
}

/// A simplex that has come of an element.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leaf<'a, C> {
    /// Its nodes.
    pub(crate) cell: &'a C,
    /// The element that it has come of.
    pub(crate) root: u32,
    /// Share of its volume that it stands for: 1, or ½ where two simplices lie in each
    /// other (see [`simplex_split`]).
    pub(crate) weight: f64,
    /// Of what part of that.
    pub(crate) lineage: Lineage,
}

/// Which part of an element a simplex is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Lineage {
    /// The piece of the element that it has grown from.
    piece: u16,
    /// Which half it is of which half, and so on, from the highest bit on.
    path: u64,
    /// How often it has been bisected.
    generation: u8,
}

/// Facets of an element have fewer pieces.
const MOST_PIECES: u16 = 8;

/// Pieces of half of the weight have numbers on from this.
const HALVES: u16 = 64;

impl Lineage {
    fn of_piece(piece: u16) -> Self {
        Self {
            piece,
            path: 0,
            generation: 0,
        }
    }

    /// That of a half, the first or the second. Beyond 64 generations both are one.
    fn half(self, second: bool) -> Self {
        let bit = 1_u64.checked_shl(63_u32.saturating_sub(u32::from(self.generation)));
        let bit = bit.filter(|_| second && self.generation < 64);
        Self {
            path: self.path | bit.unwrap_or(0),
            generation: self.generation + 1,
            ..self
        }
    }

    /// Whether another is it, or a part of it.
    pub(crate) fn holds(&self, other: &Self) -> bool {
        let length = u32::from(self.generation.min(64));
        let differ = (self.path ^ other.path)
            .checked_shr(64 - length)
            .unwrap_or(0);
        self.piece == other.piece && self.generation <= other.generation && differ == 0
    }
}

/// Elements that are refined, and what they have become.
#[derive(Clone, Debug)]
pub(crate) struct Forest<const D: usize, C> {
    /// Nodes of the base mesh come before the new ones.
    node_count: u32,
    /// Of the new nodes, with their rest positions, m.
    parents: Vec<Parents>,
    points: Vec<[f64; D]>,
    /// Elements of the base mesh that were looked at, with their first trees.
    roots: Vec<(u32, u32)>,
    /// Halves come in pairs, after what they are the halves of.
    trees: Vec<Tree<C>>,
}

#[derive(Clone, Copy, Debug)]
struct Tree<C> {
    cell: C,
    /// The element that it has grown from.
    root: u32,
    origin: TreeOrigin,
    lineage: Lineage,
    /// The first of its halves, if it is bisected; 0: it is not.
    halves: u32,
}

/// What a tree has grown from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TreeOrigin {
    /// An element as it was.
    Element,
    /// A piece of an element.
    Piece,
    /// One of two pieces that lie in each other before an element that is whole.
    Half { before: u32 },
}

impl<const D: usize, C: BisectedSimplex> Forest<D, C> {
    /// The coarsest mesh of halves that conforms and in which no simplex is `wanted`
    /// smaller, asked with its corners and the element that it has come of; `seeds` are the
    /// elements of the base mesh to ask about.
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
        let mut planted: BTreeSet<u32> = seeds.iter().filter(is_wanted).copied().collect();
        loop {
            let mut growth = Growth::new(base, &wanted, planted);
            growth.grow();
            if growth.asked.is_empty() {
                return growth.forest;
            }
            // Pieces of an element are others once one beside it is in pieces.
            planted = growth.planted;
            planted.extend(growth.asked);
        }
    }

    /// Between what the new nodes lie, which are numbered on from those of the base
    /// mesh.
    pub(crate) fn parents(&self) -> &[Parents] {
        &self.parents
    }

    /// Elements of the base mesh that are replaced.
    pub(crate) fn roots(&self) -> impl Iterator<Item = u32> {
        let replaced = |&&(_, tree): &&(u32, u32)| !self.trees[tree as usize].is_untouched();
        self.roots
            .iter()
            .filter(replaced)
            .map(|&(element, _)| element)
    }

    /// The simplices that replace them.
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

    /// Rest position of a node, m.
    pub(crate) fn point(&self, base: BaseMesh<D>, node: u32) -> [f64; D] {
        match node.checked_sub(self.node_count) {
            None => base.point(node),
            Some(new) => self.points[new as usize],
        }
    }
}

impl<C> Tree<C> {
    /// Whether it is an element as it was.
    fn is_untouched(&self) -> bool {
        self.halves == 0 && self.lineage.generation == 0 && self.origin == TreeOrigin::Element
    }
}

/// A forest in the making.
struct Growth<'a, const D: usize, W, C> {
    base: BaseMesh<'a, D>,
    wanted: &'a W,
    forest: Forest<D, C>,
    /// New nodes by what they lie between.
    middles: HashMap<Parents, u32>,
    /// Elements that are roots.
    planted: BTreeSet<u32>,
    /// Elements that must be so too, for which all must be done again.
    asked: BTreeSet<u32>,
    /// Trees without halves: to be asked about, and those that are small enough.
    pending: Vec<u32>,
    leaves: Vec<u32>,
}

impl<'a, const D: usize, W: Fn(&[[f64; D]], u32) -> bool, C: BisectedSimplex> Growth<'a, D, W, C> {
    fn new(base: BaseMesh<'a, D>, wanted: &'a W, planted: BTreeSet<u32>) -> Self {
        let mut growth = Self {
            base,
            wanted,
            middles: HashMap::new(),
            asked: BTreeSet::new(),
            pending: Vec::new(),
            leaves: Vec::new(),
            planted,
            forest: Forest {
                node_count: base.node_count(),
                parents: Vec::new(),
                points: Vec::new(),
                roots: Vec::new(),
                trees: Vec::new(),
            },
        };
        for element in growth.planted.clone() {
            growth.plant(element);
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

    /// Makes an element the root of one tree, or of those of its pieces.
    fn plant(&mut self, element: u32) {
        let Element { kind, .. } = *self.base.element(element);
        let nodes = self.base.element(element).nodes();
        let first = self.forest.trees.len() as u32;
        self.forest.roots.push((element, first));
        if simplex_split::is_simplex(kind) {
            self.plant_tree(element, nodes, TreeOrigin::Element, 0);
            return;
        }
        let centre = self.middle(Parents::new(nodes));
        for (number, facet) in kind.facets().iter().enumerate() {
            let facet: Vec<u32> = facet.iter().map(|&i| nodes[i as usize]).collect();
            let across = self.base.across(element, number);
            let first = MOST_PIECES * number as u16;
            match across.filter(|beside| !self.planted.contains(beside)) {
                Some(before) if facet.len() == 4 => {
                    for (k, piece) in (first..).zip(simplex_split::halves_over(&facet, centre)) {
                        self.plant_tree(element, &piece, TreeOrigin::Half { before }, HALVES + k);
                    }
                }
                _ => {
                    let middle = |facet: &[u32]| self.middle(Parents::new(facet));
                    for (k, piece) in
                        (first..).zip(simplex_split::pieces_over(&facet, centre, middle))
                    {
                        self.plant_tree(element, &piece, TreeOrigin::Piece, k);
                    }
                }
            }
        }
    }

    fn plant_tree(&mut self, root: u32, nodes: &[u32], origin: TreeOrigin, piece: u16) {
        let length = |edge: [u32; 2]| -> EdgeLength {
            let [a, b] = edge.map(|node| self.forest.point(self.base, node));
            // Lengths that differ by round-off count as equal.
            ((norm(&sub(&b, &a)).ln() * 1e6).round() as i64, edge)
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

    /// Whether a neighbour is bisected at an edge that it shares.
    fn has_middle(&self, tree: u32) -> bool {
        let mut edges = self.forest.trees[tree as usize].cell.edges();
        edges.any(|edge| self.middles.contains_key(&Parents::new(&edge)))
    }

    fn bisect(&mut self, tree: u32) {
        let parent = self.forest.trees[tree as usize];
        if let TreeOrigin::Half { before } = parent.origin {
            self.asked.insert(before);
            return;
        }
        let edge = parent.cell.refinement_edge();
        let middle = self.middle(Parents::new(&edge));
        self.bring_in(edge);
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

    /// The node between others, a new one if there is none yet.
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

    /// Makes all elements at an edge of the base mesh roots: it is bisected.
    fn bring_in(&mut self, edge: [u32; 2]) {
        if edge[1] >= self.forest.node_count {
            return;
        }
        let beside: Vec<u32> = self.base.at_edge(edge).collect();
        for element in beside {
            if self.planted.contains(&element) {
                continue;
            }
            if simplex_split::is_simplex(self.base.element(element).kind) {
                self.planted.insert(element);
                self.plant(element);
            } else {
                self.asked.insert(element);
            }
        }
    }
}
