//! Simplices with the marks that determine their bisection.

/// Sort key for the length of an edge; nodes break ties. All elements at an edge must find the same
/// order.
pub(crate) type EdgeLength = (i64, [u32; 2]);

/// A simplex with its refinement edge and the marks that its halves inherit.
///
/// The trees of neighbours conform, because the marks of a face depend on that face alone.
pub(crate) trait BisectedSimplex: Copy {
    /// Builds a simplex of the base mesh, marked at its longest edges.
    fn new(nodes: &[u32], length: impl Fn([u32; 2]) -> EdgeLength) -> Self;

    /// Returns its nodes, in an order of positive volume.
    fn nodes(&self) -> &[u32];

    /// Returns the edge at which it is bisected, the smaller number first.
    fn refinement_edge(&self) -> [u32; 2];

    /// Returns its halves, with `middle` the node in the middle of that edge. The half that keeps
    /// the smaller node comes first.
    fn halves(&self, middle: u32) -> [Self; 2];

    /// Returns all its edges, the smaller number first.
    fn edges(&self) -> impl Iterator<Item = [u32; 2]> {
        let nodes = self.nodes();
        let pairs = (0..nodes.len()).flat_map(|j| (0..j).map(move |i| [i, j]));
        pairs.map(|pair| edge(pair.map(|i| nodes[i])))
    }
}

/// A triangle with newest-vertex bisection (Mitchell 1991, ACM Transactions on Mathematical
/// Software 17). Its descendants have at most four shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BisectedTriangle {
    nodes: [u32; 3],
    /// The corner opposite to the refinement edge.
    newest: u8,
}

impl BisectedSimplex for BisectedTriangle {
    fn new(nodes: &[u32], length: impl Fn([u32; 2]) -> EdgeLength) -> Self {
        let nodes = [nodes[0], nodes[1], nodes[2]];
        let newest = opposite_to_longest(&nodes, [0, 1, 2], &length);
        Self { nodes, newest }
    }

    fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    fn refinement_edge(&self) -> [u32; 2] {
        let [_, i, j] = [0, 1, 2].map(|k| (self.newest as usize + k) % 3);
        edge([self.nodes[i], self.nodes[j]])
    }

    fn halves(&self, middle: u32) -> [Self; 2] {
        self.refinement_edge().map(|kept| {
            let replaced = (0..3_u8).find(|&i| {
                let node = self.nodes[i as usize];
                i != self.newest && node != kept
            });
            let newest = replaced.unwrap_or_default();
            let mut nodes = self.nodes;
            nodes[newest as usize] = middle;
            Self { nodes, newest }
        })
    }
}

/// A tetrahedron, bisected after Arnold, Mukherjee and Pouly (2000, SIAM Journal on Scientific
/// Computing 22). Every face has a marked edge; two faces have the same one, the refinement edge.
/// Any base mesh is allowed. The descendants of a tetrahedron have finitely many shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BisectedTetrahedron {
    nodes: [u32; 4],
    /// Corners of the refinement edge.
    edge: [u8; 2],
    /// For the face at the first of these without the second, and for the face at the second: the
    /// corner that is not on the marked edge.
    off: [u8; 2],
    /// True if its parent had all marked edges in one plane, and the parent's parent had not.
    planar_parent: bool,
}

impl BisectedSimplex for BisectedTetrahedron {
    fn new(nodes: &[u32], length: impl Fn([u32; 2]) -> EdgeLength) -> Self {
        let nodes = [nodes[0], nodes[1], nodes[2], nodes[3]];
        let pairs = (0..4_u8).flat_map(|j| (0..j).map(move |i| [i, j]));
        let longest = pairs.max_by_key(|pair| length(edge(pair.map(|i| nodes[i as usize]))));
        let [a, b] = longest.unwrap_or_default();
        let [c, d] = others([a, b]);
        Self {
            nodes,
            edge: [a, b],
            off: [a, b].map(|end| opposite_to_longest(&nodes, [end, c, d], &length)),
            planar_parent: false,
        }
    }

    fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    fn refinement_edge(&self) -> [u32; 2] {
        edge(self.edge.map(|i| self.nodes[i as usize]))
    }

    fn halves(&self, middle: u32) -> [Self; 2] {
        let halves = [self.half(0, middle), self.half(1, middle)];
        let [first, second] = self.edge.map(|i| self.nodes[i as usize]);
        if first < second {
            halves
        } else {
            let [a, b] = halves;
            [b, a]
        }
    }
}

impl BisectedTetrahedron {
    /// Returns the half that keeps one end of the refinement edge.
    fn half(&self, end: usize, middle: u32) -> Self {
        let (kept, replaced) = (self.edge[end], self.edge[1 - end]);
        let mut nodes = self.nodes;
        nodes[replaced as usize] = middle;
        // The marked edge of the face that stays whole is bisected next. Faces cut in two are
        // marked opposite to the new node. So is the new face, unless all marks of a third
        // generation would then lie in a plane.
        let off = self.off[end];
        let [c, d] = others(self.edge);
        let corners = [kept, c, d];
        let mut next = corners.into_iter().filter(|&corner| corner != off);
        let edge = [(); 2].map(|()| next.next().unwrap_or_default());
        let planar = self.off[0] == self.off[1];
        let mark = |other_end: u8| {
            if other_end == kept && planar && self.planar_parent {
                off
            } else {
                replaced
            }
        };
        Self {
            nodes,
            edge,
            off: [mark(edge[1]), mark(edge[0])],
            planar_parent: planar && !self.planar_parent,
        }
    }
}

/// Returns an edge by its nodes, the smaller first.
fn edge([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Returns the other two corners of a tetrahedron.
fn others(pair: [u8; 2]) -> [u8; 2] {
    let mut rest = (0..4_u8).filter(|i| !pair.contains(i));
    [(); 2].map(|()| rest.next().unwrap_or_default())
}

/// Returns the corner of a triangle opposite to its longest edge.
fn opposite_to_longest(
    nodes: &[u32],
    corners: [u8; 3],
    length: &impl Fn([u32; 2]) -> EdgeLength,
) -> u8 {
    let facing = |k: usize| {
        let ends = [corners[(k + 1) % 3], corners[(k + 2) % 3]];
        length(edge(ends.map(|i| nodes[i as usize])))
    };
    let longest = (0..3).max_by_key(|&k| facing(k));
    corners[longest.unwrap_or_default()]
}
