//! Limits that keep a collision above the wanted energy loss, and the warnings about them.

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem::scene::{ContactModel, Mass};
use cdem_verify::{Case, load, run};

use crate::prisms::Prisms;

/// Returns two triangles of one element that collide.
fn prisms() -> Prisms {
    Prisms {
        gap: 0.01,
        ..Prisms::whole(ElementKind::Tri3)
    }
}

fn case() -> Case {
    let mut case = prisms().two_scale(0.01);
    case.scene.time.end = 0.012;
    case
}

/// Returns the warnings of a collision and its largest number of elements.
fn told(case: &Case) -> (Vec<String>, u64) {
    told_of(prisms().start(case))
}

fn told_of(mut simulation: Simulation) -> (Vec<String>, u64) {
    let mut most = 0;
    run(&mut simulation, |simulation| {
        most = most.max(simulation.history().elements);
    });
    let warnings = simulation.warnings().into_iter();
    let limits = warnings.filter(|warning| warning.contains("energy_loss"));
    (limits.collect(), most)
}

/// The default settings give no warning.
#[test]
fn a_collision_that_is_refined_as_wanted_is_not_told_of() {
    let (told, most) = told(&case());
    assert!(told.is_empty() && most > 2, "{told:?} {most}");
}

#[test]
fn the_level_is_told() {
    let mut case = case();
    case.scene.contact.max_level = 0;
    let (unrefined, most) = told(&case);
    assert!(unrefined.len() == 1 && most == 2, "{unrefined:?} {most}");
    assert!(unrefined[0].contains("`max_level` is 0"), "{unrefined:?}");
    for block in &mut case.scene.block {
        block.mass = Mass::Lumped;
    }
    case.scene.contact.max_level = 1;
    let (told, most) = told(&case);
    assert!(told.len() == 1 && most > 2, "{told:?} {most}");
    assert!(told[0].contains("`max_level` is 1"), "{told:?}");
}

/// A triangle halved once has too few nodes for its moments of inertia.
#[test]
fn masses_are_told() {
    let mut case = case();
    case.scene.contact.max_level = 1;
    let (told, most) = told(&case);
    assert!(told.len() == 1 && most == 2, "{told:?} {most}");
    assert!(told[0].contains("moments of inertia"), "{told:?}");
}

/// At a tenth of the wave speed, finer elements would not be stable.
#[test]
fn the_speed_is_told() {
    let mut case = case();
    case.scene.block[0].velocity[0] = 400.0;
    case.scene.time.end = 3e-4;
    let (told, most) = told(&case);
    assert!(told.len() == 1 && most == 2, "{told:?} {most}");
    assert!(told[0].contains("at these speeds"), "{told:?}");
}

/// Cubes that meet flush would need too many elements.
#[test]
fn a_crowd_is_told() {
    let mut case = load("joint-3d");
    case.scene.contact.model = ContactModel::TwoScale;
    case.scene.contact.strength.tensile_strength = 0.0;
    case.scene.contact.strength.cohesion = 0.0;
    case.scene.load.clear();
    case.scene.boundary.clear();
    case.scene.contact.energy_loss = 1e-3;
    for name in ["lower", "upper"] {
        case.divide(name, &[1; 3], ElementKind::Hex8);
    }
    let upper = case.block("upper");
    upper.translate = vec![0.0, 0.0, 0.01];
    upper.velocity = vec![0.0, 0.0, -1.0];
    case.scene.time.end = 0.012;
    let (told, most) = told_of(case.start());
    assert!(told.len() == 1 && most > 2, "{told:?} {most}");
    assert!(told[0].contains("too many elements"), "{told:?}");
}
