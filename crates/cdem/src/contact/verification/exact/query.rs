//! Two simplices whose nodes have whole places and velocities.

use crate::contact::verification::exact::Polynomial;
use crate::mesh::{Block, Element, ElementKind, Mesh};

/// What is drawn at random.
#[derive(Clone, Copy, Debug)]
pub(crate) enum QueryKind {
    /// Places and velocities of any kind: a touch at the rim is rare.
    Wide,
    /// Few places and velocities: touches at rims and at round times are common, as
    /// are simplices that turn inside out.
    Narrow,
    /// Few places, and both move as wholes: faces and edges stay parallel, if they are.
    Whole,
}

/// A triangle or tetrahedron, and another.
#[derive(Debug)]
pub(crate) struct Query<const D: usize> {
    pub(crate) start: Vec<[i64; D]>,
    pub(crate) velocity: Vec<[i64; D]>,
}

impl<const D: usize> Query<D> {
    /// Neither is flat or inside out at the start, by `measure` of its edges from its
    /// first node.
    pub(crate) fn random(
        random: &mut fastrand::Rng,
        draw: QueryKind,
        measure: fn([[f64; D]; D]) -> f64,
    ) -> Self {
        let size = if matches!(draw, QueryKind::Wide) {
            40
        } else {
            2
        };
        loop {
            let mut point = || -> [i64; D] { std::array::from_fn(|_| random.i64(-size..=size)) };
            let start: Vec<_> = (0..2 * D + 2).map(|_| point()).collect();
            let velocity = if let QueryKind::Whole = draw {
                let both = [point(), point()];
                (0..2 * D + 2).map(|node| both[node / (D + 1)]).collect()
            } else {
                (0..2 * D + 2).map(|_| point()).collect()
            };
            let mut query = Self { start, velocity };
            let sizes = [0, D + 1].map(|first| {
                measure(std::array::from_fn(|k| {
                    let [a, b] = [query.start[first], query.start[first + 1 + k]];
                    std::array::from_fn(|c| (b[c] - a[c]) as f64)
                }))
            });
            for (first, size) in [0, D + 1].into_iter().zip(sizes) {
                if size < 0.0 {
                    query.start.swap(first, first + 1);
                    query.velocity.swap(first, first + 1);
                }
            }
            if sizes.iter().all(|size| size.abs() > 0.0) {
                return query;
            }
        }
    }

    /// The mesh of both, and its velocities.
    pub(crate) fn mesh(&self) -> (Mesh<D>, Vec<[f64; D]>) {
        let [nodes, velocity] =
            [&self.start, &self.velocity].map(|of| of.iter().map(|x| x.map(|c| c as f64)));
        let corners = D as u32 + 1;
        let kind = if D == 2 {
            ElementKind::Tri3
        } else {
            ElementKind::Tet4
        };
        let own = |number: u32| number * corners..(number + 1) * corners;
        let element = |number| Element::new(kind, &own(number).collect::<Vec<_>>());
        let block = |number: u32| Block {
            name: String::new(),
            source: number as usize,
            nodes: own(number),
            elements: number..number + 1,
        };
        let mesh = Mesh {
            nodes: nodes.collect(),
            elements: (0..2).map(element).collect(),
            blocks: (0..2).map(block).collect(),
            ..Mesh::default()
        };
        (mesh, velocity.collect())
    }

    /// Where a node is in time.
    pub(crate) fn path(&self, node: u32) -> [Polynomial; D] {
        let (x, v) = (&self.start[node as usize], &self.velocity[node as usize]);
        std::array::from_fn(|c| Polynomial::linear(x[c], v[c]))
    }
}
