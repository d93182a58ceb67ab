//! Two simplices whose nodes have integer positions and velocities.

use crate::contact::verification::exact::Polynomial;
use crate::mesh::{Element, ElementKind, Mesh, MeshBlock};

/// A random distribution.
#[derive(Clone, Copy, Debug)]
pub(crate) enum QueryKind {
    /// Any positions and velocities: a touch at the rim is rare.
    Wide,
    /// Few positions and velocities: touches at rims and at round times are common, as are
    /// simplices that invert.
    Narrow,
    /// Few positions, and both move rigidly: parallel faces and edges stay parallel.
    Whole,
}

impl QueryKind {
    /// All distributions.
    pub(crate) const ALL: [Self; 3] = [Self::Wide, Self::Narrow, Self::Whole];
}

/// A triangle or tetrahedron, and another.
#[derive(Debug)]
pub(crate) struct Query<const D: usize> {
    pub(crate) start: Vec<[i64; D]>,
    pub(crate) velocity: Vec<[i64; D]>,
}

impl<const D: usize> Query<D> {
    /// Returns two simplices that are not flat or inverted at the start, by `measure` of their
    /// edges from the first node.
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

    /// Returns the mesh of both, and its velocities.
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
        let block = |number: u32| MeshBlock {
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

    /// Returns the position of a node as a function of time.
    pub(crate) fn path(&self, node: u32) -> [Polynomial; D] {
        let (x, v) = (&self.start[node as usize], &self.velocity[node as usize]);
        std::array::from_fn(|c| Polynomial::linear(x[c], v[c]))
    }
}
