//! Warnings about scene and mesh: valid input that is most likely not intended.

use std::collections::BTreeMap;

use crate::element::mass::MAX_CONSISTENT_NODES;
use crate::element::material::Elastic;
use crate::math::format::{named_blocks, short};
use crate::math::vector::{norm, sub};
use crate::mesh::{Mesh, MeshBlock, coordinates};
use crate::model::{Model, block_names};
use crate::scene::{Cadence, ContactModel, Geometry, KeyPath, Mass, Problem, Scene, Split};
use crate::simulation::build::contact_resolution;

/// Relative error of a block's moment of inertia above which a warning is given.
const INERTIA_ERROR: f64 = 0.01;

/// Factor by which damping may shorten the stable step without a warning. Above it, damping is the
/// first cause of a long run to check.
const STEP_RATIO_LIMIT: f64 = 10.0;

/// Contact tolerance over the default above which the user is warned.
const TOLERANCE_RATIO_LIMIT: f64 = 10.0;

/// Speeds of compression waves in solids, m/s: from soft gels up to diamond.
const WAVE_SPEEDS: [f64; 2] = [1.0, 2e4];

/// Returns all warnings before a run; `shortest` is the shortest stable step in each block, s.
pub(super) fn scene_warnings<const D: usize>(
    scene: &Scene,
    model: &Model<D>,
    shortest: &[f64],
) -> Vec<Problem> {
    let mut found = scene.warnings.clone();
    found.extend(inertia(scene, model));
    found.extend(unconnected_parts(scene, model));
    found.extend(materials(scene));
    found.extend(joints(scene));
    found.extend(tolerance(scene, &model.mesh));
    found.extend(damping(scene, model, shortest));
    found.extend(springs(scene, model, shortest));
    found.extend(late(scene));
    found.extend(intervals(scene, model.step));
    found.extend(probes(scene, &model.mesh));
    found
}

fn at(list: &str, number: usize, key: &str) -> KeyPath {
    KeyPath::root().key(list).index(number).key(key)
}

/// Returns the names of blocks.
fn names<'a>(blocks: &[&'a MeshBlock]) -> Vec<&'a str> {
    blocks.iter().map(|block| block.name.as_str()).collect()
}

/// Warns of wrong moments of inertia: one warning for all blocks with the same cure.
fn inertia<const D: usize>(scene: &Scene, model: &Model<D>) -> Vec<Problem> {
    let mut wrong_of = BTreeMap::<InertiaCure, (Vec<&MeshBlock>, f64)>::new();
    for (block, data) in model.mesh.blocks.iter().zip(&model.blocks) {
        if !data.fixed && data.inertia_error > INERTIA_ERROR {
            let cure = InertiaCure::new(scene.block[block.source].mass, block.nodes.len());
            let (blocks, worst) = wrong_of.entry(cure).or_default();
            blocks.push(block);
            *worst = worst.max(data.inertia_error);
        }
    }
    let warning = |(cure, (blocks, worst)): (InertiaCure, (Vec<&MeshBlock>, f64))| {
        let (has, up_to) = match blocks.len() {
            1 => ("its moment of inertia has", ""),
            _ => ("their moments of inertia have", "up to "),
        };
        let message = format!(
            "{}: {has} an error of {up_to}{:.1} %; {}",
            named_blocks(&names(&blocks)),
            100.0 * worst,
            cure.advice()
        );
        Problem::new(at("block", blocks[0].source, "mass"), message)
    };
    wrong_of.into_iter().map(warning).collect()
}

/// Cure of a wrong moment of inertia.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum InertiaCure {
    /// `mass = "auto"`.
    Auto,
    /// A finer mesh, or `mass = "consistent"`.
    FinerOrConsistent,
    /// A finer mesh.
    Finer,
}

impl InertiaCure {
    /// Returns the cure for a block of `nodes` nodes.
    fn new(mass: Mass, nodes: usize) -> Self {
        if mass == Mass::Lumped {
            Self::Auto
        } else if nodes <= MAX_CONSISTENT_NODES {
            Self::FinerOrConsistent
        } else {
            Self::Finer
        }
    }

    fn advice(self) -> &'static str {
        match self {
            Self::Auto => "use mass = \"auto\"",
            Self::FinerOrConsistent => {
                "use more elements across the thinnest part, so that nodes lie inside it, or mass \
                 = \"consistent\""
            }
            Self::Finer => {
                "use more elements across the thinnest part, so that nodes lie inside it"
            }
        }
    }
}

/// Warns of unconnected parts of blocks that pass through each other: one warning for all blocks.
fn unconnected_parts<const D: usize>(scene: &Scene, model: &Model<D>) -> Option<Problem> {
    let (mut blocks, mut most) = (Vec::new(), 1);
    for (number, (block, data)) in model.mesh.blocks.iter().zip(&model.blocks).enumerate() {
        let source = &scene.block[block.source];
        let whole = source.split == Split::None && matches!(source.geometry, Geometry::Mesh { .. });
        let parts = if whole && !data.fixed {
            model.mesh.part_count(number)
        } else {
            1
        };
        if parts > 1 {
            blocks.push(block);
            most = most.max(parts);
        }
    }
    let first = blocks.first()?.source;
    let named = named_blocks(&names(&blocks));
    let has = match blocks.len() {
        1 => format!("{named} has {most} unconnected parts"),
        _ => format!("{named} have up to {most} unconnected parts each"),
    };
    let message = format!(
        "{has}, and they have no contact with each other; use split = \"components\" to make each \
         a block"
    );
    Some(Problem::new(at("block", first, "mesh"), message))
}

/// Warns of joints that any shear breaks before they are pulled.
fn joints(scene: &Scene) -> Option<Problem> {
    let strength = &scene.contact.strength;
    let pulls = strength.tensile_strength > 0.0 && strength.cohesion == 0.0;
    let message = "without `cohesion`, any shear breaks a joint and ends its tensile strength; \
                   give it cohesion too";
    pulls.then(|| {
        Problem::new(
            KeyPath::root().key("contact").key("tensile_strength"),
            message,
        )
    })
}

/// Warns of a tolerance so large that it closes pairs which are clearly apart at t = 0.
fn tolerance<const D: usize>(scene: &Scene, mesh: &Mesh<D>) -> Option<Problem> {
    let default = contact_resolution(mesh);
    let tolerance = scene.contact.tolerance?;
    (tolerance > TOLERANCE_RATIO_LIMIT * default).then(|| {
        let message = format!(
            "blocks up to {} m apart count as touching at t = 0; this is {:.0} times the default, which is 1e-4 of \
             the smallest boundary edge: {} m; leave it out, unless gaps of that size should count \
             as closed",
            short(tolerance),
            tolerance / default,
            short(default)
        );
        Problem::new(KeyPath::root().key("contact").key("tolerance"), message)
    })
}

/// Warns of moduli and densities that look like a mistake in units.
fn materials(scene: &Scene) -> Vec<Problem> {
    let [slowest, fastest] = WAVE_SPEEDS;
    let caution = |(number, material): (usize, &crate::scene::Material)| {
        let speed = Elastic::new(material).p_wave_speed();
        let (odd, advice) = if speed < slowest {
            (
                "slower",
                "did you forget GPa, as in young_modulus = \"40 GPa\"?",
            )
        } else if speed > fastest {
            ("faster", "check the units of young_modulus and density")
        } else {
            return None;
        };
        let message = format!(
            "material \"{}\": its wave speed is {} m/s, {odd} than in any solid \
             ({slowest} to {fastest} m/s); {advice}",
            material.name,
            short(speed)
        );
        Some(Problem::new(
            at("material", number, "young_modulus"),
            message,
        ))
    };
    scene
        .material
        .iter()
        .enumerate()
        .filter_map(caution)
        .collect()
}

/// Warns of stiffness-proportional damping that dominates the cost of the run.
fn damping<const D: usize>(scene: &Scene, model: &Model<D>, shortest: &[f64]) -> Vec<Problem> {
    let slow = |(number, material): (usize, &crate::scene::Material)| {
        let blocks = model.blocks.iter().zip(shortest);
        let own = blocks.filter(|(block, _)| block.material == number && !block.fixed);
        let step = own.map(|(_, &step)| step).fold(f64::INFINITY, f64::min);
        // With ξ = βω/2, (2/ω)(√(1+ξ²) − ξ) = step solved for 2/ω.
        let factor = (1.0 + 2.0 * material.damping.stiffness / step).sqrt();
        (factor > STEP_RATIO_LIMIT).then(|| {
            let message = format!(
                "material \"{}\": this damping makes the stable step {factor:.0} times shorter, \
                 {} s instead of {} s, and the run longer by the same factor; reduce it, or use \
                 damping.mass or damping.local",
                material.name,
                short(step),
                short(step * factor)
            );
            let path = at("material", number, "damping").key("stiffness");
            Problem::new(path, message)
        })
    };
    scene.material.iter().enumerate().filter_map(slow).collect()
}

/// Warns of contact springs too stiff for the coarse step.
fn springs<const D: usize>(scene: &Scene, model: &Model<D>, shortest: &[f64]) -> Vec<Problem> {
    if scene.contact.model != ContactModel::Penalty {
        return vec![];
    }
    let most = stable_spring(model, shortest);
    let stiff = |(path, stiffness): (KeyPath, Option<f64>)| {
        let stiffness = stiffness.filter(|stiffness| *stiffness > most)?;
        let message = format!(
            "springs of {} N/m may be too stiff for steps of {} s, and then give energy to the blocks: \
             for the lightest nodes the limit is {} N/m; reduce it, or reduce `time.safety`",
            short(stiffness),
            short(model.step),
            short(most)
        );
        Some(Problem::new(path, message))
    };
    let keys = |path: KeyPath, normal, shear| {
        let normal = (path.clone().key("normal_stiffness"), normal);
        [normal, (path.key("shear_stiffness"), shear)]
    };
    let contact = &scene.contact;
    let root = KeyPath::root().key("contact");
    let pairs = contact.pair.iter().enumerate();
    let of_pairs = pairs.flat_map(|(number, pair)| {
        let path = root.clone().key("pair").index(number);
        keys(path, pair.normal_stiffness, pair.shear_stiffness)
    });
    let of_all = keys(
        root.clone(),
        contact.normal_stiffness,
        contact.shear_stiffness,
    );
    of_all
        .into_iter()
        .chain(of_pairs)
        .filter_map(stiff)
        .collect()
}

/// Returns the stiffness above which contact springs may be unstable in a coarse step, N/m.
fn stable_spring<const D: usize>(model: &Model<D>, shortest: &[f64]) -> f64 {
    let blocks = model.blocks.iter().zip(&model.mesh.blocks);
    let moving = blocks.filter(|(block, _)| !block.fixed);
    let mobilities = moving.flat_map(|(_, block)| {
        let nodes = block.nodes.clone();
        nodes.map(|node| model.inertia.mobility(node as usize))
    });
    let largest = mobilities.fold(0.0, f64::max);
    let stable = shortest.iter().copied().fold(f64::INFINITY, f64::min);
    // A corner that meets a corner has two springs between nodes of two blocks: ω² = 4k·mobility. With
    // the elements, ω² must not exceed (2/step)².
    let left = (1.0 - (model.step / stable).powi(2)).max(0.0);
    left / (largest * model.step * model.step)
}

/// Warns of loads and boundary conditions that start after the end.
fn late(scene: &Scene) -> Vec<Problem> {
    let end = scene.time.end;
    let loads = scene.load.iter().map(|load| load.start);
    let loads = loads.enumerate().map(|(n, start)| ("load", n, start));
    let motions = scene.boundary.iter().map(|boundary| boundary.start);
    let motions = motions.enumerate().map(|(n, start)| ("boundary", n, start));
    let late = loads.chain(motions).filter(|(_, _, start)| *start >= end);
    late.map(|(list, number, start)| {
        let message = format!(
            "starts at {} s, but the run ends at {} s, so it has no effect",
            short(start),
            short(end)
        );
        Problem::new(at(list, number, "start"), message)
    })
    .collect()
}

/// Warns of output intervals shorter than the coarse step.
fn intervals(scene: &Scene, step: f64) -> Vec<Problem> {
    let output = &scene.output;
    let short_of = |(key, cadence): (&str, Cadence)| match cadence {
        // An interval equal to the step up to round-off writes once a step.
        Cadence::Interval(interval) if interval < step * (1.0 - 1e-9) => {
            let message = format!(
                "{} s is shorter than the coarse step of {} s; there is at most one output per \
                 step: reduce `time.step` for more",
                short(interval),
                short(step)
            );
            let path = KeyPath::root().key("output").key(key);
            Some(Problem::new(path, message))
        }
        _ => None,
    };
    let cadences = [
        ("frame_interval", output.frames),
        ("history_interval", output.history),
        ("blocks_interval", output.blocks),
    ];
    cadences.into_iter().filter_map(short_of).collect()
}

/// Warns of probes whose nearest node is farther away than the largest element edge of their block.
/// Inside a mesh the nearest node is always nearer than that.
fn probes<const D: usize>(scene: &Scene, mesh: &Mesh<D>) -> Vec<Problem> {
    let mut found = Vec::new();
    for (number, probe) in scene.probe.iter().enumerate() {
        let point: [f64; D] = std::array::from_fn(|c| probe.point[c]);
        let blocks = block_names::parts(scene, mesh, &probe.block).map(|part| &mesh.blocks[part]);
        let nodes = blocks.clone().flat_map(|block| block.nodes.clone());
        let away = nodes.map(|node| {
            let place = mesh.nodes[node as usize];
            (norm(&sub(&place, &point)), place)
        });
        let Some((distance, place)) = away.min_by(|a, b| a.0.total_cmp(&b.0)) else {
            continue;
        };
        let edge = blocks.map(|block| mesh.largest_edge(block.elements.clone()));
        let edge = edge.fold(0.0, f64::max);
        if distance > edge {
            let message = format!(
                "probe \"{}\" is {} m away from the nearest node of block \"{}\", at {}; the \
                 longest element edge of the block is only {} m; the probe follows that node",
                probe.name,
                short(distance),
                probe.block,
                coordinates(&place),
                short(edge)
            );
            found.push(Problem::new(at("probe", number, "point"), message));
        }
    }
    found
}
