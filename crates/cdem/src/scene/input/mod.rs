//! A scene as it is written: keys, units and defaults, not yet checked
//! against each other. The JSON Schema is made from these types, so the
//! comments on their fields are what an editor shows.

pub(crate) mod quantity;
pub(crate) mod units;
pub(crate) mod varying;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub(crate) use crate::scene::input::quantity::{
    Acceleration, Angle, AngularVelocity, Density, Dimension, Duration, Energy, Length, Pressure,
    Quantity, Rate, Ratio, Stiffness, Velocity,
};
pub(crate) use crate::scene::input::varying::{
    AxisAngle, NumberOrVector, QuantityOr, Rotate, TimeRow, Varying, VaryingVector,
};

use crate::scene::element_kind::ElementKind;
use crate::scene::{
    ContactModel, Field, Kinematics, Mass, MaterialModel, Plane, Split, ZoneExtent,
};

/// A scene of colliding deformable blocks. Numbers are in SI units, angles in
/// degrees; a number may also be text with a unit, such as "40 GPa".
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["version", "dimension", "time", "block"]))]
#[schemars(rename = "Scene")]
pub(crate) struct SceneInput {
    /// Version of the scene format: 1.
    #[schemars(extend("const" = 1))]
    pub(crate) version: Option<u32>,
    /// Free text.
    pub(crate) title: String,
    /// Dimension of space: 2 or 3.
    #[schemars(extend("enum" = [2, 3]))]
    pub(crate) dimension: Option<u32>,
    /// 2-D: what is assumed out of the plane.
    #[schemars(extend("default" = "strain"))]
    pub(crate) plane: Option<Plane>,
    /// 2-D: thickness, m.
    #[schemars(extend("default" = 1.0))]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) thickness: Option<Quantity<Length>>,
    /// Acceleration of gravity, m/s²: a vector, or a table [[time, vector], …]
    /// that is linear between its rows and held beyond its ends. Left out: none.
    pub(crate) gravity: Option<VaryingVector<Acceleration>>,
    /// Duration and steps.
    pub(crate) time: Option<TimeInput>,
    /// Materials.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) material: Vec<MaterialInput>,
    /// Deformable bodies.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) block: Vec<BlockInput>,
    /// Prescribed velocities.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) boundary: Vec<BoundaryInput>,
    /// Pressures and tractions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) load: Vec<LoadInput>,
    /// Contact between blocks. Blocks do not touch themselves.
    pub(crate) contact: ContactInput,
    /// What is written, and how often. Never changes the steps.
    pub(crate) output: OutputInput,
    /// Points to watch, in probes.csv.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) probe: Vec<ProbeInput>,
}

/// Duration and steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["end"]))]
#[schemars(rename = "Time")]
pub(crate) struct TimeInput {
    /// End of the run, s; larger than 0.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) end: Option<Quantity<Duration>>,
    /// The coarsest step, s; finer levels are taken where elements need them.
    /// Left out: that between a half and the whole of `safety` times the largest
    /// element limit for which the elements need the fewest updates, shortened
    /// so that `end` is a whole number of steps. Blocks of consistent mass count as
    /// all going at the finest step among them, as they do where they touch; where they
    /// mostly fly, a longer one is cheaper.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) step: Option<Quantity<Duration>>,
    /// Share of the stable step that is used, in (0, 1]; at most one half in
    /// blocks with consistent mass, whose vibrations are all near the limit, and
    /// in elements whose level a contact may change.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub(crate) safety: Quantity<Ratio>,
    /// Stop before the end, once nothing moves any more. Left out: never.
    pub(crate) stop_when: Option<StopWhenInput>,
}

impl Default for TimeInput {
    fn default() -> Self {
        Self {
            end: None,
            step: None,
            safety: Quantity::new(0.8),
            stop_when: None,
        }
    }
}

/// When to stop before the end: when the kinetic energy has stayed below a
/// threshold at every coarse step for a time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["kinetic_energy_below"]))]
#[schemars(rename = "StopWhen")]
pub(crate) struct StopWhenInput {
    /// Threshold of the kinetic energy ½vMv of the half step, J; larger than 0.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) kinetic_energy_below: Option<Quantity<Energy>>,
    /// How long it must have stayed below, s; longer than the highest point of
    /// a throw or of a bounce lasts, where things stand still without resting.
    /// Counts from t = 0 on. Left out: a twentieth of `end`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) during: Option<Quantity<Duration>>,
}

/// A material.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["name", "young_modulus", "poisson_ratio", "density"]))]
#[schemars(rename = "Material")]
pub(crate) struct MaterialInput {
    /// Name that blocks refer to.
    pub(crate) name: Option<String>,
    /// Constitutive law.
    pub(crate) model: MaterialModel,
    /// Young's modulus, Pa; larger than 0.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) young_modulus: Option<Quantity<Pressure>>,
    /// Poisson's ratio, in (-1, 0.5).
    #[schemars(extend("exclusiveMinimum" = -1, "exclusiveMaximum" = 0.5))]
    pub(crate) poisson_ratio: Option<Quantity<Ratio>>,
    /// Density, kg/m³; larger than 0.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) density: Option<Quantity<Density>>,
    /// Damping of blocks of this material.
    pub(crate) damping: DampingInput,
}

/// Damping; none by default.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(rename = "Damping")]
pub(crate) struct DampingInput {
    /// Mass-proportional, 1/s; at least 0.
    #[schemars(extend("minimum" = 0))]
    pub(crate) mass: Quantity<Rate>,
    /// Stiffness-proportional, s; at least 0.
    #[schemars(extend("minimum" = 0))]
    pub(crate) stiffness: Quantity<Duration>,
    /// Local (Cundall), in [0, 1).
    #[schemars(extend("minimum" = 0, "exclusiveMaximum" = 1))]
    pub(crate) local: Quantity<Ratio>,
}

/// A deformable body, or several of the same kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["name", "material"]))]
#[schemars(rename = "Block")]
pub(crate) struct BlockInput {
    /// Name. Parts of a split block are named name.1, name.2, …
    pub(crate) name: Option<String>,
    /// Gmsh file (4.1 or 2.2, text or binary), relative to the scene.
    pub(crate) mesh: Option<String>,
    /// Physical group of the mesh. Left out: the whole mesh.
    pub(crate) group: Option<String>,
    /// A simple shape instead of a mesh.
    pub(crate) shape: Option<ShapeInput>,
    /// Element shape of a `shape`. Left out: tri3 in 2-D, tet4 in 3-D.
    pub(crate) element: Option<ElementKind>,
    /// Into how many blocks the mesh falls.
    pub(crate) split: Split,
    /// Name of its material.
    pub(crate) material: Option<String>,
    /// Initial velocity, m/s, in global axes. Left out: at rest.
    pub(crate) velocity: Option<Vec<Quantity<Velocity>>>,
    /// Initial angular velocity, rad/s, about the centre of mass of each part:
    /// a number in 2-D, a vector in 3-D. Left out: none.
    pub(crate) angular_velocity: Option<NumberOrVector<AngularVelocity>>,
    /// Factor on the coordinates; 1e-3 for a mesh in mm.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) scale: Quantity<Ratio>,
    /// Rotation about the origin, degrees, after scaling: an angle in 2-D, axis
    /// and angle in 3-D. Left out: none.
    pub(crate) rotate: Option<Rotate>,
    /// Shift, m, after rotation. Left out: none.
    pub(crate) translate: Option<Vec<Quantity<Length>>>,
    /// Kinematic formulation.
    pub(crate) kinematics: Kinematics,
    /// Mass matrix.
    pub(crate) mass: Mass,
    /// Immovable, for example a base.
    pub(crate) fixed: bool,
}

impl Default for BlockInput {
    fn default() -> Self {
        Self {
            name: None,
            mesh: None,
            group: None,
            shape: None,
            element: None,
            split: Split::None,
            material: None,
            velocity: None,
            angular_velocity: None,
            scale: Quantity::new(1.0),
            rotate: None,
            translate: None,
            kinematics: Kinematics::Total,
            mass: Mass::Auto,
            fixed: false,
        }
    }
}

/// A box, or (2-D) a polygon with the size of its elements. Its sides become
/// groups: of a block `floor`, floor.xmin, floor.xmax, floor.ymin, …
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(rename = "Shape")]
pub(crate) struct ShapeInput {
    /// A box with sides along the axes.
    #[serde(rename = "box")]
    pub(crate) cuboid: Option<Cuboid>,
    /// 2-D: corners [[x, y], …] of a simple polygon in order, m.
    pub(crate) polygon: Option<Vec<Vec<Quantity<Length>>>>,
    /// Element size of a polygon, m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) size: Option<Quantity<Length>>,
}

/// A box with sides along the axes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["min", "max", "divisions"]))]
pub(crate) struct Cuboid {
    /// Lower corner, m.
    pub(crate) min: Option<Vec<Quantity<Length>>>,
    /// Upper corner, m.
    pub(crate) max: Option<Vec<Quantity<Length>>>,
    /// Cells along each axis.
    pub(crate) divisions: Option<Vec<u32>>,
}

/// Prescribed velocity of a group or a whole block, by component or as a turn
/// about an axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(rename = "Boundary")]
pub(crate) struct BoundaryInput {
    /// Physical group of nodes, edges or faces. `block.group`: what one block has of it.
    pub(crate) group: Option<String>,
    /// Instead of a group: a block, with all its parts.
    pub(crate) block: Option<String>,
    /// Velocity by component.
    pub(crate) velocity: Option<Components>,
    /// Instead of a velocity: a turn, rad/s, a number or a table
    /// [[time, value], …].
    pub(crate) angular_velocity: Option<Varying<AngularVelocity>>,
    /// 3-D: axis of the turn.
    pub(crate) axis: Option<Vec<Quantity<Ratio>>>,
    /// A point on the axis of the turn, m. Left out: the origin.
    pub(crate) point: Option<Vec<Quantity<Length>>>,
    /// Active from, s; at least 0.
    #[schemars(extend("minimum" = 0))]
    pub(crate) start: Quantity<Duration>,
    /// Active until, s. Left out: always.
    pub(crate) end: Option<Quantity<Duration>>,
}

/// Velocity by component: a number, or a table [[time, value], …] that is
/// linear between its rows and held beyond its ends. Components left out stay
/// free.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Components {
    /// Along x, m/s.
    pub(crate) x: Option<Varying<Velocity>>,
    /// Along y, m/s.
    pub(crate) y: Option<Varying<Velocity>>,
    /// 3-D: along z, m/s.
    pub(crate) z: Option<Varying<Velocity>>,
}

/// A pressure or a traction on a group of edges (2-D) or faces (3-D).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["group"]))]
#[schemars(rename = "Load")]
pub(crate) struct LoadInput {
    /// Physical group of edges (2-D) or faces (3-D), or of elements: their sides on the boundary.
    /// `block.group`: what one block has of it.
    pub(crate) group: Option<String>,
    /// Pressure, Pa, a number or a table [[time, value], …]; inward positive;
    /// follows normal and area.
    pub(crate) pressure: Option<Varying<Pressure>>,
    /// Instead of a pressure: traction, Pa, a vector or a table
    /// [[time, vector], …]; dead, per reference area.
    pub(crate) traction: Option<VaryingVector<Pressure>>,
    /// Active from, s; at least 0.
    #[schemars(extend("minimum" = 0))]
    pub(crate) start: Quantity<Duration>,
    /// Active until, s. Left out: always.
    pub(crate) end: Option<Quantity<Duration>>,
}

/// Contact between blocks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(rename = "Contact")]
pub(crate) struct ContactInput {
    /// Contact model.
    pub(crate) model: ContactModel,
    /// Distance within which points touch, m; larger than 0. Left out: 1e-4 of
    /// the smallest boundary edge. Bounces do not depend on it, from a fifth of that
    /// to ten times as much.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) tolerance: Option<Quantity<Length>>,
    /// Friction angle, degrees, in [0, 90).
    #[schemars(extend("minimum" = 0, "exclusiveMaximum" = 90))]
    pub(crate) friction_angle: Quantity<Angle>,
    /// Cohesion, Pa, of contacts that are closed at t = 0; lost at the first
    /// slip or opening.
    #[schemars(extend("minimum" = 0))]
    pub(crate) cohesion: Quantity<Pressure>,
    /// Tensile strength, Pa, of contacts that are closed at t = 0; lost at the
    /// first slip or opening.
    #[schemars(extend("minimum" = 0))]
    pub(crate) tensile_strength: Quantity<Pressure>,
    /// Two-scale: accepted loss of a touch, share of its impact
    /// energy, in (0, 1).
    #[schemars(extend("default" = 0.01))]
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub(crate) energy_loss: Option<Quantity<Ratio>>,
    /// Two-scale: how often elements are halved in size at most, 0 to 16; once
    /// more where the mesh must fit together.
    #[schemars(extend("default" = 5))]
    #[schemars(extend("minimum" = 0, "maximum" = 16))]
    pub(crate) max_level: Option<i64>,
    /// Two-scale: extent of the refined zone.
    #[schemars(extend("default" = "graded"))]
    pub(crate) zone: Option<ZoneExtent>,
    /// Penalty: normal stiffness of a contact point, N/m; larger than 0.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) normal_stiffness: Option<Quantity<Stiffness>>,
    /// Penalty: shear stiffness of a contact point, N/m; larger than 0. Left
    /// out: the normal stiffness.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) shear_stiffness: Option<Quantity<Stiffness>>,
    /// Overrides by pair. Each key of two blocks has the value of the highest in
    /// rank that gives it: pairs of blocks rank above pairs of materials, later
    /// ones above earlier ones, and all above `[contact]`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) pair: Vec<ContactPairInput>,
}

impl Default for ContactInput {
    fn default() -> Self {
        Self {
            model: ContactModel::TwoScale,
            tolerance: None,
            friction_angle: Quantity::default(),
            cohesion: Quantity::default(),
            tensile_strength: Quantity::default(),
            energy_loss: None,
            max_level: None,
            zone: None,
            normal_stiffness: None,
            shear_stiffness: None,
            pair: Vec::new(),
        }
    }
}

/// Contact of two blocks, or of blocks of two materials. What is left out is
/// as in pairs of lower rank that mean the same blocks, and in `[contact]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["between"]))]
#[schemars(rename = "ContactPair")]
pub(crate) struct ContactPairInput {
    /// Two blocks or two materials; the block "i" stands for i.1, i.2, … too.
    #[schemars(extend("minItems" = 2, "maxItems" = 2))]
    pub(crate) between: Option<Vec<String>>,
    /// Friction angle, degrees, in [0, 90).
    #[schemars(extend("minimum" = 0, "exclusiveMaximum" = 90))]
    pub(crate) friction_angle: Option<Quantity<Angle>>,
    /// Cohesion, Pa.
    #[schemars(extend("minimum" = 0))]
    pub(crate) cohesion: Option<Quantity<Pressure>>,
    /// Tensile strength, Pa.
    #[schemars(extend("minimum" = 0))]
    pub(crate) tensile_strength: Option<Quantity<Pressure>>,
    /// Penalty: normal stiffness, N/m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) normal_stiffness: Option<Quantity<Stiffness>>,
    /// Penalty: shear stiffness, N/m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) shear_stiffness: Option<Quantity<Stiffness>>,
    /// Whether the two touch at all. Where no pair says: they do.
    pub(crate) enabled: Option<bool>,
}

/// What is written, and how often.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(rename = "Output")]
pub(crate) struct OutputInput {
    /// Frames for ParaView: so many intervals over the run.
    #[schemars(extend("default" = 100))]
    #[schemars(extend("minimum" = 1))]
    pub(crate) frames: Option<u32>,
    /// Instead of `frames`: simulated time between two, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) frame_interval: Option<Quantity<Duration>>,
    /// Rows of history.csv: so many intervals over the run.
    #[schemars(extend("default" = 1000))]
    #[schemars(extend("minimum" = 1))]
    pub(crate) history: Option<u32>,
    /// Instead of `history`: simulated time between two rows, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) history_interval: Option<Quantity<Duration>>,
    /// Rows per block of blocks.csv: so many intervals over the run.
    #[schemars(extend("default" = 1000))]
    #[schemars(extend("minimum" = 1))]
    pub(crate) blocks: Option<u32>,
    /// Instead of `blocks`: simulated time between two rows, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) blocks_interval: Option<Quantity<Duration>>,
    /// Blocks in blocks.csv. Left out: all.
    pub(crate) block_list: Option<Vec<String>>,
    /// Fields of the frames.
    pub(crate) fields: Vec<Field>,
    /// Wall-clock time between checkpoints, s; 0: none, and none at an interrupt. Never
    /// changes the results.
    #[schemars(extend("minimum" = 0))]
    pub(crate) checkpoint: Quantity<Duration>,
}

impl Default for OutputInput {
    fn default() -> Self {
        use Field::{Displacement, Level, Stress, Velocity};
        Self {
            frames: None,
            frame_interval: None,
            history: None,
            history_interval: None,
            blocks: None,
            blocks_interval: None,
            block_list: None,
            fields: vec![Displacement, Velocity, Stress, Level],
            checkpoint: Quantity::new(crate::scene::Output::CHECKPOINT),
        }
    }
}

/// The node nearest to a point.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["name", "block", "point"]))]
#[schemars(rename = "Probe")]
pub(crate) struct ProbeInput {
    /// Name.
    pub(crate) name: Option<String>,
    /// Its block.
    pub(crate) block: Option<String>,
    /// A point of the mesh as placed, m. Where the nearest node is farther away
    /// than the block's largest element edge, a warning tells how far.
    pub(crate) point: Option<Vec<Quantity<Length>>>,
}
