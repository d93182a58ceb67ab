//! Encounters of two random blocks.

use fastrand::Rng;

use crate::contact::verification::oracle::space::OracleSpace;
use crate::math::vector::{add, add_scaled, dot, norm, sub};
use crate::mesh::{Element, ElementKind, Mesh, MeshBlock};

/// Two blocks, with velocities that keep each of their cells convex and its faces plane: x' = v + G
/// (x − centre).
#[derive(Debug, Default)]
pub(super) struct BlockEncounter<const D: usize> {
    pub(super) mesh: Mesh<D>,
    pub(super) velocity: Vec<[f64; D]>,
}

/// A random distribution.
#[derive(Clone, Copy, Debug)]
pub(super) struct DrawnBlocks {
    /// Positions, angles and velocities are few round numbers: much is parallel, flush and head-on.
    pub(super) degenerate: bool,
    /// Nearly degenerate: by relative 1e-3 to 1e-12, different for each encounter.
    pub(super) noisy: bool,
    /// The blocks touch at the start.
    pub(super) rests: bool,
    /// Bars and corners of two or three cells; otherwise one cell.
    pub(super) bent: bool,
    /// Thickness of the second block, m.
    pub(super) thickness: f64,
    /// Relative motion of the two, m.
    pub(super) motion: f64,
}

pub(super) fn number(random: &mut Rng, size: f64) -> f64 {
    size * (2.0 * random.f64() - 1.0)
}

fn vector<const D: usize>(random: &mut Rng, size: f64) -> [f64; D] {
    std::array::from_fn(|_| number(random, size))
}

/// Nodes about 0, and their cells.
struct ConvexShape<const D: usize> {
    nodes: Vec<[f64; D]>,
    kind: ElementKind,
    cells: Vec<Vec<u32>>,
}

impl<const D: usize> ConvexShape<D> {
    fn random<S: OracleSpace<D>>(random: &mut Rng, bent: bool) -> Self {
        if bent {
            return Self::bent::<S>(random.usize(2..=3));
        }
        let kind = S::KINDS[random.usize(..S::KINDS.len())];
        let nodes = S::corners(kind);
        let cells = vec![(0..nodes.len() as u32).collect()];
        Self { nodes, kind, cells }
    }

    /// Two squares or cubes in a row, and one beside the first of them.
    fn bent<S: OracleSpace<D>>(count: usize) -> Self {
        let place = |x: u8, y: u8| [x, y].map(|c| 0.5 * f64::from(c) - 0.5);
        let rows = [
            [0, 0],
            [1, 0],
            [2, 0],
            [0, 1],
            [1, 1],
            [2, 1],
            [0, 2],
            [1, 2],
        ];
        let base: Vec<_> = rows.map(|[x, y]| place(x, y))[..2 + 2 * count].to_vec();
        let mut cells = vec![vec![0, 1, 4, 3], vec![1, 2, 5, 4], vec![3, 4, 7, 6]];
        cells.truncate(count);
        let nodes = S::layers(&base);
        if nodes.len() > base.len() {
            for cell in &mut cells {
                cell.extend_from_within(..);
                cell[4..]
                    .iter_mut()
                    .for_each(|node| *node += base.len() as u32);
            }
        }
        Self {
            nodes,
            kind: S::BOX,
            cells,
        }
    }
}

impl<const D: usize> BlockEncounter<D> {
    pub(super) fn random<S: OracleSpace<D>>(random: &mut Rng, draw: DrawnBlocks) -> Self {
        let mut meeting = Self::default();
        let direction: [f64; D] = vector(random, 1.0);
        let noise = if draw.noisy {
            10.0_f64.powf(-3.0 - 9.0 * random.f64())
        } else {
            0.0
        };
        for sign in [-1.0, 1.0] {
            meeting.add::<S>(random, draw, (&direction, sign), noise);
        }
        if draw.rests {
            meeting.close::<S>();
        }
        meeting
    }

    /// Adds a block on one side of the middle; its round numbers are changed by up to `noise`.
    fn add<S: OracleSpace<D>>(
        &mut self,
        random: &mut Rng,
        draw: DrawnBlocks,
        (direction, sign): (&[f64; D], f64),
        noise: f64,
    ) {
        let mut shape = ConvexShape::<D>::random::<S>(random, draw.bent);
        let quarter = std::f64::consts::FRAC_PI_4;
        let angles = [0; 3].map(|_| {
            if draw.degenerate {
                quarter * f64::from(random.u8(..4))
            } else {
                number(random, 4.0)
            }
        });
        let centre = Self::centre(random, draw, direction, sign);
        let (mean, mut gradient) = Self::motion(random, draw, direction, sign);
        let warp: [[f64; D]; D] = std::array::from_fn(|_| vector(random, noise));
        let centre = add(&centre, &vector(random, noise));
        let mean = add(&mean, &vector(random, noise));
        for row in &mut gradient {
            add_scaled(row, 1.0, &vector(random, noise));
        }
        for node in &mut shape.nodes {
            if !self.mesh.blocks.is_empty() {
                node[D - 1] *= draw.thickness;
            }
            let from = S::turn(node, angles);
            *node = add(&from, &std::array::from_fn(|c| dot(&warp[c], &from)));
        }
        let moving = |from: &[f64; D]| {
            let rate = std::array::from_fn(|c| mean[c] + dot(&gradient[c], from));
            (add(&centre, from), rate)
        };
        let nodes = shape.nodes.iter().map(moving);
        self.push(shape.kind, &shape.cells, nodes);
    }

    fn centre(random: &mut Rng, draw: DrawnBlocks, direction: &[f64; D], sign: f64) -> [f64; D] {
        let away = sign * (0.6 + 0.5 * draw.motion) / norm(direction).max(0.1);
        std::array::from_fn(|c| {
            if draw.degenerate {
                f64::from(random.i8(-4..=4)) * 0.25 + if c == 0 { 1.25 * sign } else { 0.0 }
            } else {
                away * direction[c] + number(random, 0.4)
            }
        })
    }

    fn motion(
        random: &mut Rng,
        draw: DrawnBlocks,
        direction: &[f64; D],
        sign: f64,
    ) -> ([f64; D], [[f64; D]; D]) {
        if draw.degenerate {
            let mean = std::array::from_fn(|c| {
                let along = if c == 0 { -sign } else { 0.0 };
                along + 0.5 * f64::from(random.i8(-1..=1))
            });
            return (mean, [[0.0; D]; D]);
        }
        let towards = -sign * (0.6 + draw.motion) / norm(direction).max(0.1);
        let mean = std::array::from_fn(|c| towards * direction[c] + number(random, 0.3));
        let gradient = std::array::from_fn(|_| vector(random, 0.3));
        (mean, gradient)
    }

    /// Adds a block of cells with the positions and velocities of its nodes.
    fn push(
        &mut self,
        kind: ElementKind,
        cells: &[Vec<u32>],
        nodes: impl Iterator<Item = ([f64; D], [f64; D])>,
    ) {
        let number = self.mesh.blocks.len();
        let first = self.mesh.nodes.len() as u32;
        for (place, velocity) in nodes {
            self.mesh.nodes.push(place);
            self.velocity.push(velocity);
        }
        let start = self.mesh.elements.len() as u32;
        for cell in cells {
            let numbers: Vec<u32> = cell.iter().map(|node| first + node).collect();
            self.mesh.elements.push(Element::new(kind, &numbers));
        }
        self.mesh.blocks.push(MeshBlock {
            name: String::new(),
            source: number,
            nodes: first..self.mesh.nodes.len() as u32,
            elements: start..self.mesh.elements.len() as u32,
        });
    }

    /// Moves the second block to the first until it touches.
    fn close<S: OracleSpace<D>>(&mut self) {
        let middle = |range: std::ops::Range<u32>| {
            let nodes = &self.mesh.nodes[range.start as usize..range.end as usize];
            let sum = nodes.iter().fold([0.0; D], |sum, x| add(&sum, x));
            sum.map(|c| c / nodes.len() as f64)
        };
        let second = self.mesh.blocks[1].nodes.clone();
        let way = sub(
            &middle(self.mesh.blocks[0].nodes.clone()),
            &middle(second.clone()),
        );
        let mut approach = Self {
            mesh: self.mesh.clone(),
            velocity: vec![[0.0; D]; self.velocity.len()],
        };
        for node in second.clone() {
            approach.velocity[node as usize] = way;
        }
        // Depth of contacts of blocks of size 1 after a few thousand roundings.
        let time = approach.deepens::<S>(1e-12, 1.0).unwrap_or(0.0);
        for node in second {
            add_scaled(&mut self.mesh.nodes[node as usize], time, &way);
        }
    }

    /// Returns the encounter as seen by an observer elsewhere, who may swap the blocks.
    pub(super) fn seen_from<S: OracleSpace<D>>(
        &self,
        angles: [f64; 3],
        shift: [f64; D],
        swapped: bool,
    ) -> Self {
        let mut meeting = Self::default();
        let order = if swapped { [1, 0] } else { [0, 1] };
        for block in order.map(|old| &self.mesh.blocks[old]) {
            let elements = block.elements.start as usize..block.elements.end as usize;
            let elements = &self.mesh.elements[elements];
            let own = |element: &Element| {
                let nodes = element.nodes().iter();
                nodes.map(|node| node - block.nodes.start).collect()
            };
            let cells: Vec<Vec<u32>> = elements.iter().map(own).collect();
            let turned = |node: u32| {
                let place = S::turn(&self.mesh.nodes[node as usize], angles);
                let velocity = S::turn(&self.velocity[node as usize], angles);
                (add(&place, &shift), velocity)
            };
            meeting.push(elements[0].kind, &cells, block.nodes.clone().map(turned));
        }
        meeting
    }
}
