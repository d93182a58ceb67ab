//! Blocks with some, all or none of their velocity components prescribed.

use std::collections::BTreeSet;

use cdem::output::{FieldValues, Frame};
use cdem::scene::{Boundary, BoundaryTarget, ContactModel, Motion, Schedule};
use cdem_verify::{Balance, Case, load, run};
use nalgebra::Vector3;

/// Prescribes some components of the velocity of a block, m/s.
fn hold(case: &mut Case, block: &str, velocity: [Option<f64>; 3]) {
    case.scene.boundary.push(Boundary {
        target: BoundaryTarget::Block(block.to_owned()),
        motion: Motion::Velocity(velocity.map(|v| v.map(Schedule::Constant))),
        start: 0.0,
        end: None,
    });
}

/// Two boxes between smooth planes keep their spin about the normal of the planes in every change
/// of mesh.
#[test]
fn boxes_between_planes_keep_their_spin() {
    let mut case = load("ties");
    case.scene.time.end = 0.1;
    case.scene.contact.model = ContactModel::TwoScale;
    for (name, place, degrees) in [("below", 0.0, 0.0), ("above", 1.25, 30.0_f64)] {
        let block = case.block(name);
        block.translate = vec![place, 0.3 * place, 0.0];
        block.rotate.axis = Vector3::z().into();
        block.rotate.angle = degrees.to_radians();
        hold(&mut case, name, [None, None, Some(0.0)]);
    }
    let above = case.block("above");
    above.velocity = vec![-5.0, 0.0, 0.0];
    above.angular_velocity = vec![0.0, 0.0, 3.0];
    let mut simulation = case.start();
    let mut balance = Balance::new(&mut simulation);
    let start = simulation.history();
    let (mut changes, mut elements, mut lost) = (0, start.elements, 0.0_f64);
    run(&mut simulation, |simulation| {
        let row = balance.look(simulation);
        changes += u64::from(row.elements != elements);
        elements = row.elements;
        let off = row.angular_momentum[2] / start.angular_momentum[2] - 1.0;
        lost = lost.max(off.abs());
    });
    println!("{changes} changes of mesh, of the spin {lost:.1e} lost");
    assert!(changes > 1 && elements == start.elements, "{changes}");
    assert!(lost < 1e-12, "{lost:e}");
}

/// Returns the numbers of the blocks with refined elements.
fn refined_blocks(frame: &Frame) -> BTreeSet<i32> {
    let field = |name: &str| {
        let field = frame.cell_fields.iter().find(|field| field.name == name);
        match field.map(|field| &field.values) {
            Some(FieldValues::Whole(values)) => values.as_slice(),
            _ => panic!("no field {name}"),
        }
    };
    let cells = field("block").iter().zip(field("refinement"));
    let refined = cells.filter(|(_, halvings)| **halvings > 0);
    refined.map(|(block, _)| *block).collect()
}

/// A plate with all nodes prescribed is not refined; the block that it hits is.
#[test]
fn driven_plates_are_not_refined() {
    let mut case = load("meetings");
    case.scene.contact.model = ContactModel::TwoScale;
    hold(&mut case, "below", [Some(0.0), Some(1.0), None]);
    let mut simulation = case.start();
    let start = simulation.history().elements;
    let (mut most, mut refined) = (0, BTreeSet::new());
    run(&mut simulation, |simulation| {
        let row = simulation.history();
        most = most.max(row.elements);
        if row.elements > start {
            refined.extend(refined_blocks(&simulation.frame()));
        }
    });
    let above = case.scene.block.iter().position(|b| b.name == "above");
    let above = above.map(|number| number as i32);
    assert!(most > start, "{most} elements");
    assert_eq!(
        refined.into_iter().collect::<Vec<_>>(),
        Vec::from_iter(above)
    );
}

/// The velocity of a free block does not change when it is coarsened.
#[test]
fn what_flies_goes_straight_on_when_it_is_coarse_again() {
    let mut case = load("meetings");
    case.scene.contact.model = ContactModel::TwoScale;
    let mut simulation = case.start();
    let start = simulation.history().elements;
    let (mut before, mut elements, mut changes) = (simulation.block_rows(), start, 0);
    let (mut off, mut contacts) = (0.0_f64, 0);
    run(&mut simulation, |simulation| {
        let (row, rows) = (simulation.history(), simulation.block_rows());
        if contacts == 0 && row.contacts == 0 {
            for (one, other) in before.iter().zip(&rows) {
                let duration = other.time - one.time;
                for c in 0..2 {
                    let way = other.position[c] - one.position[c];
                    let mean = 0.5 * (one.velocity[c] + other.velocity[c]);
                    off = off.max((way - mean * duration).abs());
                }
            }
            changes += u32::from(row.elements < elements);
        }
        (before, elements, contacts) = (rows, row.elements, row.contacts);
    });
    println!("{changes} changes of mesh in flight, {off:.1e} m aside");
    assert!(changes > 0 && elements == start, "{changes}");
    // Round-off of positions of about a metre, in sums over hundreds of nodes.
    assert!(off < 1e-13, "{off:e}");
}
