//! Writes a scene as input, with every default filled in.

use serde::Serialize;

use crate::scene::input::{
    self, AxisAngle, Dimension, NumberOrVector, Quantity, QuantityOr, Varying, VaryingVector,
};
use crate::scene::{
    Block, Boundary, BoundaryTarget, Cadence, Contact, ContactModel, ContactPair, Geometry, Load,
    LoadKind, Material, Motion, Output, Probe, Rotation, Scene, Schedule, Time,
};

/// Returns the scene in the keys of the scene file, with every default filled in: SI units, angles
/// in degrees. Reading it again gives the same scene, bit for bit, without its warnings: keys that
/// have no effect are left out.
#[must_use]
pub fn as_input(scene: &Scene) -> impl Serialize + use<> {
    scene_input(scene)
}

pub(super) fn scene_input(scene: &Scene) -> input::SceneInput {
    let plane = scene.dimension == 2;
    input::SceneInput {
        version: Some(scene.version),
        title: scene.title.clone(),
        dimension: u32::try_from(scene.dimension).ok(),
        plane: plane.then_some(scene.plane),
        thickness: plane.then_some(Quantity::new(scene.thickness)),
        gravity: Some(varying_vector(&scene.gravity)),
        time: Some(time(&scene.time)),
        material: scene.material.iter().map(material).collect(),
        block: scene.block.iter().map(block).collect(),
        boundary: scene
            .boundary
            .iter()
            .map(|b| boundary(b, scene.dimension))
            .collect(),
        load: scene.load.iter().map(load).collect(),
        contact: contact(&scene.contact),
        output: output(&scene.output),
        probe: scene.probe.iter().map(probe).collect(),
    }
}

fn vector<M: Dimension>(value: &[f64]) -> Vec<Quantity<M>> {
    value.iter().copied().map(Quantity::new).collect()
}

fn varying<M: Dimension>(schedule: &Schedule<f64>) -> Varying<M> {
    match schedule {
        Schedule::Constant(value) => QuantityOr::Quantity(Quantity::new(*value)),
        Schedule::Table(rows) => {
            let rows = rows
                .iter()
                .map(|(t, value)| (Quantity::new(*t), Quantity::new(*value)));
            QuantityOr::Other(rows.collect())
        }
    }
}

fn varying_vector<M: Dimension>(schedule: &Schedule<Vec<f64>>) -> VaryingVector<M> {
    match schedule {
        Schedule::Constant(value) => VaryingVector::Constant(vector(value)),
        Schedule::Table(rows) => {
            let rows = rows
                .iter()
                .map(|(t, value)| (Quantity::new(*t), vector(value)));
            VaryingVector::Table(rows.collect())
        }
    }
}

fn time(time: &Time) -> input::TimeInput {
    input::TimeInput {
        end: Some(Quantity::new(time.end)),
        step: time.step.map(Quantity::new),
        safety: Quantity::new(time.safety),
        stop_when: time.stop_when.as_ref().map(|stop| input::StopWhenInput {
            kinetic_energy_below: Some(Quantity::new(stop.kinetic_energy_below)),
            during: Some(Quantity::new(stop.during)),
        }),
    }
}

fn material(material: &Material) -> input::MaterialInput {
    input::MaterialInput {
        name: Some(material.name.clone()),
        model: material.model,
        young_modulus: Some(Quantity::new(material.young_modulus)),
        poisson_ratio: Some(Quantity::new(material.poisson_ratio)),
        density: Some(Quantity::new(material.density)),
        damping: input::DampingInput {
            mass: Quantity::new(material.damping.mass),
            stiffness: Quantity::new(material.damping.stiffness),
            local: Quantity::new(material.damping.local),
        },
    }
}

fn block(block: &Block) -> input::BlockInput {
    let placed = input::BlockInput {
        name: Some(block.name.clone()),
        split: block.split,
        material: Some(block.material.clone()),
        velocity: Some(vector(&block.velocity)),
        angular_velocity: Some(match block.angular_velocity.as_slice() {
            [about_z] => NumberOrVector::Quantity(Quantity::new(*about_z)),
            by_axis => NumberOrVector::Other(vector(by_axis)),
        }),
        scale: Quantity::new(block.scale),
        rotate: Some(rotate(&block.rotate, block.translate.len())),
        translate: Some(vector(&block.translate)),
        kinematics: block.kinematics,
        mass: block.mass,
        fixed: block.fixed,
        ..input::BlockInput::default()
    };
    match &block.geometry {
        Geometry::Mesh { path, group } => input::BlockInput {
            mesh: Some(path.to_string_lossy().into_owned()),
            group: group.clone(),
            ..placed
        },
        Geometry::Box {
            min,
            max,
            divisions,
            element,
        } => input::BlockInput {
            shape: Some(input::ShapeInput {
                cuboid: Some(input::Cuboid {
                    min: Some(vector(min)),
                    max: Some(vector(max)),
                    divisions: Some(divisions.iter().map(|n| whole(*n)).collect()),
                }),
                ..input::ShapeInput::default()
            }),
            element: Some(*element),
            ..placed
        },
        Geometry::Polygon {
            corners,
            size,
            element,
        } => input::BlockInput {
            shape: Some(input::ShapeInput {
                polygon: Some(corners.iter().map(|corner| vector(corner)).collect()),
                size: Some(Quantity::new(*size)),
                ..input::ShapeInput::default()
            }),
            element: Some(*element),
            ..placed
        },
    }
}

/// Counts were read as 32-bit numbers, so none is truncated.
fn whole(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

fn rotate(rotation: &Rotation, dimension: usize) -> input::Rotate {
    let angle = Quantity::new(rotation.angle);
    if dimension == 2 {
        return QuantityOr::Quantity(angle);
    }
    QuantityOr::Other(AxisAngle {
        axis: vector(&rotation.axis),
        angle,
    })
}

fn boundary(boundary: &Boundary, dimension: usize) -> input::BoundaryInput {
    let (group, block) = match &boundary.target {
        BoundaryTarget::Group(group) => (Some(group.clone()), None),
        BoundaryTarget::Block(block) => (None, Some(block.clone())),
    };
    let timed = input::BoundaryInput {
        group,
        block,
        start: Quantity::new(boundary.start),
        end: boundary.end.map(Quantity::new),
        ..input::BoundaryInput::default()
    };
    match &boundary.motion {
        Motion::Velocity([x, y, z]) => input::BoundaryInput {
            velocity: Some(input::Components {
                x: x.as_ref().map(varying),
                y: y.as_ref().map(varying),
                z: z.as_ref().map(varying),
            }),
            ..timed
        },
        Motion::Turn {
            axis,
            point,
            angular_velocity,
        } => input::BoundaryInput {
            angular_velocity: Some(varying(angular_velocity)),
            axis: (dimension == 3).then(|| vector(axis)),
            point: Some(vector(&point[..dimension])),
            ..timed
        },
    }
}

fn load(load: &Load) -> input::LoadInput {
    let (pressure, traction) = match &load.kind {
        LoadKind::Pressure(pressure) => (Some(varying(pressure)), None),
        LoadKind::Traction(traction) => (None, Some(varying_vector(traction))),
    };
    input::LoadInput {
        group: Some(load.group.clone()),
        pressure,
        traction,
        start: Quantity::new(load.start),
        end: load.end.map(Quantity::new),
    }
}

fn contact(contact: &Contact) -> input::ContactInput {
    let two_scale = contact.model == ContactModel::TwoScale;
    input::ContactInput {
        model: contact.model,
        tolerance: contact.tolerance.map(Quantity::new),
        friction_angle: Quantity::new(contact.strength.friction_angle),
        cohesion: Quantity::new(contact.strength.cohesion),
        tensile_strength: Quantity::new(contact.strength.tensile_strength),
        energy_loss: two_scale.then_some(Quantity::new(contact.energy_loss)),
        max_level: two_scale.then_some(i64::from(contact.max_level)),
        zone: two_scale.then_some(contact.zone),
        normal_stiffness: contact.normal_stiffness.map(Quantity::new),
        shear_stiffness: contact.shear_stiffness.map(Quantity::new),
        pair: contact.pair.iter().map(pair).collect(),
    }
}

fn pair(pair: &ContactPair) -> input::ContactPairInput {
    input::ContactPairInput {
        between: Some(pair.between.to_vec()),
        friction_angle: pair.friction_angle.map(Quantity::new),
        cohesion: pair.cohesion.map(Quantity::new),
        tensile_strength: pair.tensile_strength.map(Quantity::new),
        normal_stiffness: pair.normal_stiffness.map(Quantity::new),
        shear_stiffness: pair.shear_stiffness.map(Quantity::new),
        enabled: pair.enabled,
    }
}

fn output(output: &Output) -> input::OutputInput {
    let count = |cadence| match cadence {
        Cadence::Count(count) => Some(whole(count)),
        Cadence::Interval(_) => None,
    };
    let interval = |cadence| match cadence {
        Cadence::Count(_) => None,
        Cadence::Interval(interval) => Some(Quantity::new(interval)),
    };
    input::OutputInput {
        frames: count(output.frames),
        frame_interval: interval(output.frames),
        history: count(output.history),
        history_interval: interval(output.history),
        blocks: count(output.blocks),
        blocks_interval: interval(output.blocks),
        block_list: output.block_list.clone(),
        fields: output.fields.clone(),
        checkpoint: Quantity::new(output.checkpoint),
    }
}

fn probe(probe: &Probe) -> input::ProbeInput {
    input::ProbeInput {
        name: Some(probe.name.clone()),
        block: Some(probe.block.clone()),
        point: Some(vector(&probe.point)),
    }
}
