//! The paper's two prisms, with any elements, any fineness and any direction of flight.

use cdem::Simulation;
use cdem::mesh::{CellKind, ElementKind, RawGroup, RawMesh};
use cdem::scene::{ContactModel, Mass, Rotation, Schedule};
use cdem_verify::{Balance, Case, load, run, tetrahedra};
use nalgebra::{Rotation3, Unit, Vector3};

/// Speed of the first prism, m/s.
const SPEED: f64 = 3.0;

/// Side of the triangles, m.
const SIDE: f64 = 8.0;

/// Two prisms 1 m thick, or two triangles, with divided sides.
#[derive(Clone, Debug)]
pub(super) struct Prisms {
    pub(super) element: ElementKind,
    /// Elements along a side of the triangle, and through the thickness of a prism.
    pub(super) pieces: usize,
    pub(super) layers: usize,
    /// Distance between the corner and the face that it hits, m. With 1 m and with 1 cm the touch
    /// falls at the same point of its coarse step.
    pub(super) gap: f64,
    /// Rotation of the blocks and of the direction of flight.
    pub(super) turn: Rotation,
}

/// Results of a run.
#[derive(Debug)]
pub(super) struct Outcome {
    /// First touch and last separation, s.
    pub(super) touch: f64,
    pub(super) parted: f64,
    /// Speed of the struck block along the flight of the other, m/s.
    pub(super) struck: f64,
    /// Impact loss over the energy at the start.
    pub(super) impact_loss: f64,
    /// Largest number of elements in the run, and that at its end.
    pub(super) elements: [u64; 2],
    /// Most element updates in a coarse step, and the finest time level.
    pub(super) updates: u64,
    pub(super) level: usize,
    pub(super) balance: Balance,
}

impl Prisms {
    /// Returns prisms of one element (or three tetrahedra) each, as in the paper.
    pub(super) fn whole(element: ElementKind) -> Self {
        Self {
            element,
            pieces: 1,
            layers: 1,
            gap: 1.0,
            turn: Rotation {
                axis: [0.0, 0.0, 1.0],
                angle: 0.0,
            },
        }
    }

    fn direction(&self) -> Vector3<f64> {
        let axis = Unit::new_normalize(Vector3::from(self.turn.axis));
        Rotation3::from_axis_angle(&axis, self.turn.angle) * Vector3::x()
    }

    /// Builds the scene with unified nodes, without refinement.
    pub(super) fn case(&self) -> Case {
        let mut case = load("two-prisms");
        let scene = &mut case.scene;
        let dimension = self.element.dimension();
        scene.dimension = dimension;
        scene.gravity = Schedule::Constant(vec![0.0; dimension]);
        scene.contact.tolerance = None;
        for block in &mut scene.block {
            block.mass = Mass::Auto;
            block.rotate = self.turn.clone();
            block.velocity = vec![0.0; dimension];
            block.angular_velocity = vec![0.0; 2 * dimension - 3];
            block.translate = vec![0.0; dimension];
        }
        let velocity = SPEED * self.direction();
        case.block("i")
            .velocity
            .copy_from_slice(&velocity.as_slice()[..dimension]);
        case
    }

    /// Builds the two-scale scene.
    pub(super) fn two_scale(&self, energy_loss: f64) -> Case {
        let mut case = self.case();
        case.scene.contact.model = ContactModel::TwoScale;
        case.scene.contact.energy_loss = energy_loss;
        case
    }

    /// Starts a case of these prisms.
    pub(super) fn start(&self, case: &Case) -> Simulation {
        case.start_from(|_| self.mesh())
    }

    /// Runs a case of these prisms.
    pub(super) fn run(&self, case: &Case) -> Outcome {
        let mut simulation = self.start(case);
        let mut balance = Balance::new(&mut simulation);
        let start = simulation.history().kinetic_energy;
        let (mut most, mut updates, mut level, mut before) = (0, 0, 0, 0);
        run(&mut simulation, |simulation| {
            most = most.max(balance.look(simulation).elements);
            updates = updates.max(simulation.element_updates() - before);
            before = simulation.element_updates();
            level = level.max(simulation.overview().levels.len() - 1);
        });
        let end = simulation.history();
        let contacts = simulation.ended_contacts();
        assert_eq!(simulation.live_contacts(), []);
        let touch = contacts.iter().map(|c| c.time_on).fold(f64::MAX, f64::min);
        let parted = contacts.iter().filter_map(|c| c.time_off);
        let velocity = Vector3::from(simulation.block_rows()[1].velocity);
        Outcome {
            touch,
            parted: parted.fold(0.0, f64::max),
            struck: velocity.dot(&self.direction()),
            impact_loss: end.impact_loss / start,
            elements: [most, end.elements],
            updates,
            level,
            balance,
        }
    }

    fn mesh(&self) -> RawMesh {
        let mut mesh = RawMesh {
            origin: "prisms".to_owned(),
            group_sets: vec![Vec::new()],
            ..RawMesh::default()
        };
        let height = SIDE * 0.75_f64.sqrt();
        let triangles = [
            [[-height, -0.5 * SIDE], [0.0, 0.0], [-height, 0.5 * SIDE]],
            [[0.0, -0.5 * SIDE], [height, 0.0], [0.0, 0.5 * SIDE]],
        ];
        for (number, (name, triangle)) in (0..).zip(["block_i", "block_j"].iter().zip(triangles)) {
            mesh.groups.push(RawGroup {
                dimension: self.element.dimension(),
                tag: number as i32 + 1,
                name: (*name).to_owned(),
            });
            mesh.group_sets.push(vec![number]);
            let ahead = f64::from(number) * self.gap;
            self.add(&mut mesh, triangle.map(|[x, y]| [ahead + x, y]), number + 1);
        }
        mesh.point_tags = (1..=mesh.points.len() as u64).collect();
        mesh
    }

    /// Adds a block. Nodes are numbered along the triangle, layer by layer.
    fn add(&self, mesh: &mut RawMesh, [a, b, c]: [[f64; 2]; 3], set: u32) {
        let first = mesh.points.len() as u32;
        let number = |i: usize, j: usize| (i * (i + 1) / 2 + j) as u32;
        let in_layer = number(self.pieces + 1, 0);
        let sheets = (self.element.dimension() - 2) * self.layers;
        for layer in 0..=sheets {
            let z = layer as f64 / self.layers as f64;
            for i in 0..=self.pieces {
                for j in 0..=i {
                    let [s, t] = [i - j, j].map(|k| k as f64 / self.pieces as f64);
                    let at = |k: usize| (1.0 - s - t) * a[k] + s * b[k] + t * c[k];
                    mesh.points.push([at(0), at(1), z]);
                }
            }
        }
        let upright = |i, j| [number(i, j), number(i + 1, j), number(i + 1, j + 1)];
        let hanging = |i, j| [number(i, j), number(i, j + 1), number(i + 1, j + 1)];
        let cells = mesh.cells_mut(CellKind::Element(self.element));
        for i in 0..self.pieces {
            let row = (0..=i).map(|j| upright(i, j));
            for triangle in row.chain((0..i).map(|j| hanging(i, j))) {
                for nodes in self.stack(triangle, in_layer) {
                    cells.nodes.extend(nodes.iter().map(|node| first + node));
                    cells.tags.push(cells.tags.len() as u64 + 1);
                    cells.sets.push(set);
                }
            }
        }
    }

    /// Returns the elements above a triangle. Its nodes are sorted by number, so that tetrahedra of
    /// neighbours divide their common face in the same way.
    fn stack(&self, triangle: [u32; 3], in_layer: u32) -> Vec<Vec<u32>> {
        if self.element == ElementKind::Tri3 {
            return vec![triangle.to_vec()];
        }
        let wedges = (0..self.layers as u32).map(|layer| {
            let at = |layer: u32| triangle.map(|node| node + layer * in_layer);
            [at(layer), at(layer + 1)].concat()
        });
        if self.element == ElementKind::Wedge6 {
            return wedges.collect();
        }
        let cut = |wedge: Vec<u32>| {
            let tetrahedra = tetrahedra(ElementKind::Wedge6).iter();
            tetrahedra.map(move |corners| corners.map(|k| wedge[k]).to_vec())
        };
        wedges.flat_map(cut).collect()
    }
}
