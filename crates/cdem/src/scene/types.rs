//! The types of a checked scene, in SI units.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::scene::element_kind::ElementKind;
use crate::scene::problem::Problem;
use crate::scene::schedule::Schedule;

/// A whole scene. Vectors have as many components as the dimension.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Version of the scene format: 1.
    pub version: u32,
    /// Free text.
    pub title: String,
    /// 2 or 3.
    pub dimension: usize,
    /// Plane strain or plane stress (2-D).
    pub plane: Plane,
    /// Thickness, m (2-D).
    pub thickness: f64,
    /// Acceleration of gravity, m/s².
    pub gravity: Schedule<Vec<f64>>,
    /// Duration and steps.
    pub time: Time,
    /// Materials.
    pub material: Vec<Material>,
    /// Blocks.
    pub block: Vec<Block>,
    /// Prescribed velocities.
    pub boundary: Vec<Boundary>,
    /// Pressures and tractions.
    pub load: Vec<Load>,
    /// Contact between blocks.
    pub contact: Contact,
    /// Kind and frequency of output.
    pub output: Output,
    /// Points to follow.
    pub probe: Vec<Probe>,
    /// Warnings of keys that have no effect.
    pub warnings: Vec<Problem>,
}

/// Out-of-plane assumption in 2-D.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Plane {
    /// No strain out of the plane.
    Strain,
    /// No stress out of the plane.
    Stress,
}

/// `[time]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Time {
    /// End of the run, s.
    pub end: f64,
    /// Coarse step, s; `None`: chosen from the elements.
    pub step: Option<f64>,
    /// Fraction of the stable step in use.
    pub safety: f64,
    /// Condition to stop before the end.
    pub stop_when: Option<StopWhen>,
}

/// `time.stop_when`: stops once the kinetic energy has been below a threshold at every coarse step
/// for some time.
#[derive(Clone, Debug, PartialEq)]
pub struct StopWhen {
    /// Threshold, J.
    pub kinetic_energy_below: f64,
    /// Duration, s.
    pub during: f64,
}

/// `[[material]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name that blocks refer to.
    pub name: String,
    /// Constitutive law.
    pub model: MaterialModel,
    /// Young's modulus, Pa.
    pub young_modulus: f64,
    /// Poisson's ratio.
    pub poisson_ratio: f64,
    /// Density, kg/m³.
    pub density: f64,
    /// Damping of blocks of this material.
    pub damping: Damping,
}

/// Constitutive laws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MaterialModel {
    /// Isotropic linear elasticity.
    #[default]
    Elastic,
}

/// `material.damping`; all zero by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Damping {
    /// Mass-proportional, 1/s.
    pub mass: f64,
    /// Stiffness-proportional, s.
    pub stiffness: f64,
    /// Local (Cundall), dimensionless, in [0, 1).
    pub local: f64,
}

/// `[[block]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Name.
    pub name: String,
    /// Mesh file or shape.
    pub geometry: Geometry,
    /// Rule by which the mesh is split into blocks.
    pub split: Split,
    /// Name of its material.
    pub material: String,
    /// Initial velocity, m/s.
    pub velocity: Vec<f64>,
    /// Initial angular velocity about each part's centre of mass, rad/s:
    /// one component in 2-D, three in 3-D.
    pub angular_velocity: Vec<f64>,
    /// Factor on the mesh's coordinates.
    pub scale: f64,
    /// Rotation about the origin, after scaling.
    pub rotate: Rotation,
    /// Shift after rotation, m.
    pub translate: Vec<f64>,
    /// Kinematic formulation.
    pub kinematics: Kinematics,
    /// Mass matrix.
    pub mass: Mass,
    /// True if the block cannot move.
    pub fixed: bool,
}

/// Origin of a block's mesh.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// A Gmsh file, and the physical group to use (`None`: all).
    Mesh {
        /// Path in the scene, relative to the scene file.
        path: PathBuf,
        /// Physical group.
        group: Option<String>,
    },
    /// A box of `divisions` elements between two corners.
    Box {
        /// Lower corner, m.
        min: Vec<f64>,
        /// Upper corner, m.
        max: Vec<f64>,
        /// Elements along each axis.
        divisions: Vec<usize>,
        /// Element shape.
        element: ElementKind,
    },
    /// A simple polygon (2-D), meshed with elements of about `size`.
    Polygon {
        /// Corners in order, m.
        corners: Vec<[f64; 2]>,
        /// Element size, m.
        size: f64,
        /// Element shape.
        element: ElementKind,
    },
}

/// `block.split`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// One block.
    None,
    /// One block per connected part.
    Components,
    /// One block per cell.
    Cells,
}

/// A rotation about the origin.
#[derive(Clone, Debug, PartialEq)]
pub struct Rotation {
    /// Unit axis; +z in 2-D.
    pub axis: [f64; 3],
    /// Angle, rad.
    pub angle: f64,
}

/// Kinematic formulation of a block's elements (design: bodies).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Kinematics {
    /// Total Lagrangian, Green–Lagrange strain.
    Total,
    /// Incremental, with a co-rotated stress rate: equation (2) of the paper.
    Incremental,
}

/// Mass matrix of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Mass {
    /// Fitted; consistent if no fit is exact and the block has at most 1024 nodes.
    Auto,
    /// Lumped: row sums of the mass matrix.
    Lumped,
    /// Lumped, corrected to the exact mass, centre of mass and inertia.
    Fitted,
    /// Consistent: the full mass matrix of each block.
    Consistent,
}

/// `[[boundary]]`: prescribed velocities on a group or a whole block.
#[derive(Clone, Debug, PartialEq)]
pub struct Boundary {
    /// Group or block that it acts on.
    pub target: BoundaryTarget,
    /// Prescribed motion.
    pub motion: Motion,
    /// Active from, s.
    pub start: f64,
    /// Active until, s; `None`: always.
    pub end: Option<f64>,
}

/// Target of a boundary condition.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BoundaryTarget {
    /// A group of the mesh.
    Group(String),
    /// A block (all its parts).
    Block(String),
}

/// Motion prescribed by a boundary condition.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// Velocity by component, m/s; `None` leaves the component free.
    Velocity([Option<Schedule<f64>>; 3]),
    /// A rotation about an axis through a point.
    Turn {
        /// Unit axis; +z in 2-D.
        axis: [f64; 3],
        /// A point on the axis, m.
        point: [f64; 3],
        /// Angular velocity, rad/s.
        angular_velocity: Schedule<f64>,
    },
}

/// `[[load]]` on a group of facets.
#[derive(Clone, Debug, PartialEq)]
pub struct Load {
    /// Group of facets.
    pub group: String,
    /// Pressure or traction.
    pub kind: LoadKind,
    /// Active from, s.
    pub start: f64,
    /// Active until, s; `None`: always.
    pub end: Option<f64>,
}

/// Kinds of surface load.
#[derive(Clone, Debug, PartialEq)]
pub enum LoadKind {
    /// Inward positive, on the current area and normal, Pa.
    Pressure(Schedule<f64>),
    /// Dead, per reference area, Pa.
    Traction(Schedule<Vec<f64>>),
}

/// `[contact]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Contact {
    /// Contact model.
    pub model: ContactModel,
    /// d_tol, m; `None`: 1e-4 of the smallest boundary edge.
    pub tolerance: Option<f64>,
    /// Strengths for pairs without their own.
    pub strength: Strength,
    /// Two-scale: accepted impact loss over the impact energy.
    pub energy_loss: f64,
    /// Two-scale: largest number of halvings of an element.
    pub max_level: u32,
    /// Two-scale: extent of the refinement zone.
    pub zone: ZoneExtent,
    /// Penalty: normal stiffness of a contact point, N/m.
    pub normal_stiffness: Option<f64>,
    /// Penalty: shear stiffness of a contact point, N/m.
    pub shear_stiffness: Option<f64>,
    /// Settings for pairs of blocks or materials.
    pub pair: Vec<ContactPair>,
}

/// Contact models.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ContactModel {
    /// Unified nodes, and sub-elements around predicted impacts.
    TwoScale,
    /// Unified nodes on the mesh of the scene.
    UnifiedNode,
    /// Springs in place of unified nodes, for comparison.
    Penalty,
}

/// Extent of the refinement zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Zone")]
pub enum ZoneExtent {
    /// Two rings of elements at the finest size; beyond them the size grows with distance.
    Graded,
    /// Finest size within the radius c_p·Δt₂ of an impact. Δt₂ is the rest of the step after it.
    Wavefront,
}

/// Strengths of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Strength {
    /// Friction angle, rad.
    pub friction_angle: f64,
    /// Cohesion of contacts closed at t = 0, Pa.
    pub cohesion: f64,
    /// Tensile strength of contacts closed at t = 0, Pa.
    pub tensile_strength: f64,
}

/// `[[contact.pair]]`. If several entries are for the same two blocks, each value comes from the
/// entry of highest rank that gives one: pairs of blocks rank above pairs of materials, later
/// entries above earlier ones, and all above `[contact]`.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactPair {
    /// Names of two blocks or two materials. The check refuses names that are both.
    pub between: [String; 2],
    /// Friction angle, rad.
    pub friction_angle: Option<f64>,
    /// Cohesion, Pa.
    pub cohesion: Option<f64>,
    /// Tensile strength, Pa.
    pub tensile_strength: Option<f64>,
    /// Penalty: normal stiffness, N/m.
    pub normal_stiffness: Option<f64>,
    /// Penalty: shear stiffness, N/m.
    pub shear_stiffness: Option<f64>,
    /// `false`: no contact between the two. Default: `true`.
    pub enabled: Option<bool>,
}

/// `[output]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// Frames for ParaView.
    pub frames: Cadence,
    /// Rows of `history.csv`.
    pub history: Cadence,
    /// Rows per block of `blocks.csv`.
    pub blocks: Cadence,
    /// Blocks in `blocks.csv`; `None`: all.
    pub block_list: Option<Vec<String>>,
    /// Fields of the frames.
    pub fields: Vec<Field>,
    /// Wall-clock seconds between checkpoints; 0: none.
    pub checkpoint: f64,
}

impl Output {
    /// Default time between checkpoints, wall-clock s.
    pub const CHECKPOINT: f64 = 60.0;
}

/// Frequency of an output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cadence {
    /// Number of equal intervals over the run.
    Count(usize),
    /// Simulated time between two outputs, s.
    Interval(f64),
}

/// Fields of a frame.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Field {
    /// Displacement of the nodes, m.
    Displacement,
    /// Velocity of the nodes, m/s.
    Velocity,
    /// Cauchy stress, Pa.
    Stress,
    /// Von Mises stress, Pa.
    VonMises,
    /// Principal stresses, Pa, largest first.
    PrincipalStress,
    /// Contact force on the nodes, N.
    ContactForce,
    /// Time level of the elements.
    Level,
}

/// `[[probe]]`: the node nearest to a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// Name.
    pub name: String,
    /// Block.
    pub block: String,
    /// Point in the placed mesh, m.
    pub point: Vec<f64>,
}

/// True if `name` is that of a part of the split block `whole`: its name, a point, and a number
/// from 1.
pub(crate) fn is_part(whole: &str, name: &str) -> bool {
    let number = name
        .strip_prefix(whole)
        .and_then(|rest| rest.strip_prefix('.'));
    number.is_some_and(|n| {
        !n.starts_with('0') && !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit())
    })
}
