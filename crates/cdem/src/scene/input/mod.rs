//! Keys, units and defaults of a scene file, before any check of one key against another. The JSON
//! Schema is made from these types, so editors and the book show the docstrings of the fields.

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

/// A scene of deformable blocks that collide. Numbers are in SI units, angles in
/// degrees. A number may also be text with a unit, such as "40 GPa".
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["dimension", "time", "block"]))]
#[schemars(rename = "Scene")]
pub(crate) struct SceneInput {
    /// Version of the scene format: 1, which may be left out.
    #[schemars(extend("const" = 1))]
    pub(crate) version: Option<u32>,
    /// Free text.
    pub(crate) title: String,
    /// Dimension of space: 2 or 3.
    #[schemars(extend("enum" = [2, 3]))]
    pub(crate) dimension: Option<u32>,
    /// 2-D: assumption out of the plane.
    #[schemars(extend("default" = "strain"))]
    pub(crate) plane: Option<Plane>,
    /// 2-D: thickness of all blocks, m; larger than 0.
    #[schemars(extend("default" = 1.0))]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) thickness: Option<Quantity<Length>>,
    /// Acceleration of gravity, m/s²: a vector, or a table [[time, vector], …],
    /// linear between its rows and constant beyond its ends. Left out: none.
    pub(crate) gravity: Option<VaryingVector<Acceleration>>,
    /// Duration and steps.
    pub(crate) time: Option<TimeInput>,
    /// Materials.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) material: Vec<MaterialInput>,
    /// Blocks.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) block: Vec<BlockInput>,
    /// Prescribed velocities.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) boundary: Vec<BoundaryInput>,
    /// Pressures and tractions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) load: Vec<LoadInput>,
    /// Contact between blocks. A block has no contact with itself.
    pub(crate) contact: ContactInput,
    /// Contents and cadence of the result files. No effect on the steps.
    pub(crate) output: OutputInput,
    /// Probes: followed points, in probes.csv.
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
    /// Coarse step, s; larger than 0, at most `end`. Elements with a smaller stable step
    /// take a finer time level. Left out: the step with the fewest element updates, between
    /// half and all of `safety` times the largest stable step of an element, shortened so
    /// that `end` is a whole number of steps. This choice takes the finest step among
    /// blocks of consistent mass for all of them, as it is while they touch. If they
    /// rarely touch, a longer step is cheaper.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) step: Option<Quantity<Duration>>,
    /// Fraction of the stable step in use, in (0, 1]. The engine takes at most one half for
    /// blocks with consistent mass, because all their vibrations are near the limit, and
    /// for elements with a time level that a contact may change.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub(crate) safety: Quantity<Ratio>,
    /// Condition to stop before the end: all blocks at rest. Left out: none.
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

/// Condition to stop before the end: a kinetic energy below a threshold, at every
/// coarse step of a duration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["kinetic_energy_below"]))]
#[schemars(rename = "StopWhen")]
pub(crate) struct StopWhenInput {
    /// Threshold, J; larger than 0. It applies to the kinetic energy ½vMv of the
    /// velocities at the half step.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) kinetic_energy_below: Option<Quantity<Energy>>,
    /// Duration below the threshold, s; larger than 0, at most `end`. It should be
    /// longer than the slow moments at the top of a throw or bounce. The first one
    /// may begin at t = 0. Left out: a twentieth of `end`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) during: Option<Quantity<Duration>>,
}

/// A material.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["name", "young_modulus", "poisson_ratio", "density"]))]
#[schemars(rename = "Material")]
pub(crate) struct MaterialInput {
    /// Name; blocks refer to it.
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
    /// Mass-proportional damping, 1/s; at least 0.
    #[schemars(extend("minimum" = 0))]
    pub(crate) mass: Quantity<Rate>,
    /// Stiffness-proportional damping, s; at least 0.
    #[schemars(extend("minimum" = 0))]
    pub(crate) stiffness: Quantity<Duration>,
    /// Local damping (Cundall), a fraction of the force, in [0, 1).
    #[schemars(extend("minimum" = 0, "exclusiveMaximum" = 1))]
    pub(crate) local: Quantity<Ratio>,
}

/// A block, or several blocks of the same kind. A block moves and deforms on its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["name", "material"]))]
#[schemars(rename = "Block")]
pub(crate) struct BlockInput {
    /// Name. Parts of a split block have the names name.1, name.2, …
    pub(crate) name: Option<String>,
    /// Path of a Gmsh file (4.1 or 2.2, text or binary), relative to the scene.
    pub(crate) mesh: Option<String>,
    /// Physical group of the mesh. Left out: the whole mesh.
    pub(crate) group: Option<String>,
    /// Instead of a mesh: a box or a polygon.
    pub(crate) shape: Option<ShapeInput>,
    /// Element shape of a `shape`. Left out: tri3 in 2-D, tet4 in 3-D.
    pub(crate) element: Option<ElementKind>,
    /// Rule to split the mesh into blocks.
    pub(crate) split: Split,
    /// Name of the material.
    pub(crate) material: Option<String>,
    /// Initial velocity, m/s, in global axes. Left out: at rest.
    pub(crate) velocity: Option<Vec<Quantity<Velocity>>>,
    /// Initial angular velocity, rad/s, about the centre of mass of each part:
    /// a number in 2-D, a vector in 3-D. Left out: none.
    pub(crate) angular_velocity: Option<NumberOrVector<AngularVelocity>>,
    /// Factor on the coordinates; larger than 0; 1e-3 for a mesh in mm.
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
    /// true: the block never moves, such as a base.
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

/// A box, or (2-D) a polygon with the size of its elements. The sides become
/// groups. Those of a box in a block `floor` are floor.xmin, floor.xmax, floor.ymin, …
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(rename = "Shape")]
pub(crate) struct ShapeInput {
    /// A box with sides along the axes.
    #[serde(rename = "box")]
    pub(crate) cuboid: Option<Cuboid>,
    /// 2-D: corners [[x, y], …] of a polygon in order, m. Its edges must not cross.
    pub(crate) polygon: Option<Vec<Vec<Quantity<Length>>>>,
    /// Size of the elements in a polygon, m; larger than 0.
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
    /// Numbers of cells along the axes; each at least 1.
    pub(crate) divisions: Option<Vec<u32>>,
}

/// Prescribed velocity of a group or a whole block: by component, or as a rotation
/// about an axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(rename = "Boundary")]
pub(crate) struct BoundaryInput {
    /// Physical group of nodes, edges or faces. `block.group` is the part of it in one block.
    pub(crate) group: Option<String>,
    /// Instead of a group: name of a block; all its parts move.
    pub(crate) block: Option<String>,
    /// Velocity by component.
    pub(crate) velocity: Option<Components>,
    /// Instead of `velocity`: angular velocity of a rotation, rad/s, as a number or a
    /// table [[time, value], …].
    pub(crate) angular_velocity: Option<Varying<AngularVelocity>>,
    /// 3-D: axis of the rotation.
    pub(crate) axis: Option<Vec<Quantity<Ratio>>>,
    /// A point on the axis of the rotation, m. Left out: the origin.
    pub(crate) point: Option<Vec<Quantity<Length>>>,
    /// Start, s; at least 0.
    #[schemars(extend("minimum" = 0))]
    pub(crate) start: Quantity<Duration>,
    /// End, s; later than `start`. Left out: never.
    pub(crate) end: Option<Quantity<Duration>>,
}

/// Velocity by component: a number, or a table [[time, value], …], linear between
/// its rows and constant beyond its ends. A component that is left out stays free.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Components {
    /// Velocity along x, m/s.
    pub(crate) x: Option<Varying<Velocity>>,
    /// Velocity along y, m/s.
    pub(crate) y: Option<Varying<Velocity>>,
    /// 3-D: velocity along z, m/s.
    pub(crate) z: Option<Varying<Velocity>>,
}

/// A pressure or a traction on a group of edges (2-D) or faces (3-D).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["group"]))]
#[schemars(rename = "Load")]
pub(crate) struct LoadInput {
    /// Physical group of edges (2-D) or faces (3-D). A group of elements stands for their facets
    /// on the boundary. `block.group` is the part of it in one block.
    pub(crate) group: Option<String>,
    /// Pressure, Pa, as a number or a table [[time, value], …]. It is positive inward,
    /// and follows the normal and the area of the facets.
    pub(crate) pressure: Option<Varying<Pressure>>,
    /// Instead of `pressure`: traction, Pa, as a vector or a table
    /// [[time, vector], …]. Its direction is fixed; it acts on the area at rest.
    pub(crate) traction: Option<VaryingVector<Pressure>>,
    /// Start, s; at least 0.
    #[schemars(extend("minimum" = 0))]
    pub(crate) start: Quantity<Duration>,
    /// End, s; later than `start`. Left out: never.
    pub(crate) end: Option<Quantity<Duration>>,
}

/// Contact between blocks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(rename = "Contact")]
pub(crate) struct ContactInput {
    /// Contact model.
    pub(crate) model: ContactModel,
    /// Contact tolerance, m; larger than 0: gap that counts as closed at t = 0, and
    /// penetration that is tolerated. Left out: 1e-4 of the smallest boundary edge.
    /// It does not change when blocks touch in the run.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) tolerance: Option<Quantity<Length>>,
    /// Friction angle, degrees, in [0, 90).
    #[schemars(extend("minimum" = 0, "exclusiveMaximum" = 90))]
    pub(crate) friction_angle: Quantity<Angle>,
    /// Cohesion, Pa, of contact points closed at t = 0; at least 0. The first slip
    /// or opening ends it.
    #[schemars(extend("minimum" = 0))]
    pub(crate) cohesion: Quantity<Pressure>,
    /// Tensile strength, Pa, of contact points closed at t = 0; at least 0. The
    /// first slip or opening ends it.
    #[schemars(extend("minimum" = 0))]
    pub(crate) tensile_strength: Quantity<Pressure>,
    /// Two-scale: accepted impact loss as a fraction of the impact energy, in (0, 1). A smaller
    /// value asks for smaller elements.
    #[schemars(extend("default" = 0.01))]
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub(crate) energy_loss: Option<Quantity<Ratio>>,
    /// Two-scale: largest number of halvings of an element's size, 0 to 16. Some
    /// elements are halved once more, so that the mesh fits together.
    #[schemars(extend("default" = 5))]
    #[schemars(extend("minimum" = 0, "maximum" = 16))]
    pub(crate) max_level: Option<i64>,
    /// Two-scale: extent of the refinement zone.
    #[schemars(extend("default" = "graded"))]
    pub(crate) zone: Option<ZoneExtent>,
    /// Penalty: normal stiffness of a contact point, N/m; larger than 0.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) normal_stiffness: Option<Quantity<Stiffness>>,
    /// Penalty: shear stiffness of a contact point, N/m; larger than 0. Left
    /// out: the normal stiffness.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) shear_stiffness: Option<Quantity<Stiffness>>,
    /// Settings for pairs of blocks or materials. If several of them give a key for
    /// the same two blocks, a pair of blocks overrides a pair of materials, and a
    /// later pair overrides an earlier one. All override the table `contact`.
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

/// Contact of two blocks, or of blocks of two materials. A key that is left out has its
/// value from a pair of lower rank for the same blocks, else from `[contact]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["between"]))]
#[schemars(rename = "ContactPair")]
pub(crate) struct ContactPairInput {
    /// Names of two blocks or two materials. The name of a split block stands for all
    /// its parts.
    #[schemars(extend("minItems" = 2, "maxItems" = 2))]
    pub(crate) between: Option<Vec<String>>,
    /// Friction angle, degrees, in [0, 90).
    #[schemars(extend("minimum" = 0, "exclusiveMaximum" = 90))]
    pub(crate) friction_angle: Option<Quantity<Angle>>,
    /// Cohesion, Pa; at least 0.
    #[schemars(extend("minimum" = 0))]
    pub(crate) cohesion: Option<Quantity<Pressure>>,
    /// Tensile strength, Pa; at least 0.
    #[schemars(extend("minimum" = 0))]
    pub(crate) tensile_strength: Option<Quantity<Pressure>>,
    /// Penalty: normal stiffness, N/m; larger than 0.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) normal_stiffness: Option<Quantity<Stiffness>>,
    /// Penalty: shear stiffness, N/m; larger than 0.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) shear_stiffness: Option<Quantity<Stiffness>>,
    /// false: no contact between the two. Left out of all pairs: contact.
    pub(crate) enabled: Option<bool>,
}

/// Contents and cadence of the result files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(rename = "Output")]
pub(crate) struct OutputInput {
    /// Frames for ParaView: number of intervals over the run.
    #[schemars(extend("default" = 100))]
    #[schemars(extend("minimum" = 1))]
    pub(crate) frames: Option<u32>,
    /// Instead of `frames`: simulated time between two frames, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) frame_interval: Option<Quantity<Duration>>,
    /// Rows of history.csv: number of intervals over the run.
    #[schemars(extend("default" = 1000))]
    #[schemars(extend("minimum" = 1))]
    pub(crate) history: Option<u32>,
    /// Instead of `history`: simulated time between two rows, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) history_interval: Option<Quantity<Duration>>,
    /// Rows of each block in blocks.csv: number of intervals over the run.
    #[schemars(extend("default" = 1000))]
    #[schemars(extend("minimum" = 1))]
    pub(crate) blocks: Option<u32>,
    /// Instead of `blocks`: simulated time between two rows, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) blocks_interval: Option<Quantity<Duration>>,
    /// Names of the blocks in blocks.csv. Left out: all blocks.
    pub(crate) block_list: Option<Vec<String>>,
    /// Fields of the frames.
    pub(crate) fields: Vec<Field>,
    /// Wall-clock time between checkpoints, s; at least 0. 0: no checkpoints, not even at
    /// an interrupt. No effect on the results.
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

/// A followed point: the node nearest to it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(extend("required" = ["name", "block", "point"]))]
#[schemars(rename = "Probe")]
pub(crate) struct ProbeInput {
    /// Name.
    pub(crate) name: Option<String>,
    /// Name of the block.
    pub(crate) block: Option<String>,
    /// Coordinates in the placed mesh, m. A warning gives the distance of the nearest
    /// node if it is farther away than the longest element edge of the block.
    pub(crate) point: Option<Vec<Quantity<Length>>>,
}
