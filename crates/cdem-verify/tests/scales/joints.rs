//! Joints beside which the mesh changes.

use cdem::scene::ContactModel;
use cdem_verify::{Balance, load, run};

/// A third block hits one of two joined blocks right beside the joint, and flies off. The points of
/// the joint carry tension through all changes of mesh and persist.
#[test]
fn joints_hold_while_the_mesh_beside_them_changes() {
    let mut case = load("joint");
    case.scene.contact.model = ContactModel::TwoScale;
    case.scene.time.end = 0.2;
    case.scene.load.clear();
    let mut hammer = case.block("upper").clone();
    hammer.name = "hammer".to_owned();
    // Its corner arrives 0.1 m above the joint, with a hundredth of the joint's strength.
    hammer.rotate.angle = 40.0_f64.to_radians();
    hammer.translate = vec![2.2862, -0.432];
    hammer.velocity = vec![-0.005, 0.0];
    case.scene.block.push(hammer);
    let mut simulation = case.start();
    let start = simulation.history().elements;
    let joint = simulation.live_contacts().len();
    let mut balance = Balance::new(&mut simulation);
    let (mut elements, mut changes, mut pulled) = (start, 0, 0.0_f64);
    run(&mut simulation, |simulation| {
        let row = balance.look(simulation);
        changes += u32::from(row.elements != elements);
        elements = row.elements;
        let rows = simulation.block_rows();
        let upper = rows.iter().find(|row| row.block == "upper");
        pulled = pulled.max(upper.map_or(0.0, |row| -row.force[1]));
    });
    // Other contacts between the same faces come and go as the faces bend.
    let is_of_joint = |contact: &&cdem::output::ContactRow| contact.time_on == 0.0;
    let live = simulation.live_contacts();
    let left = live.iter().filter(is_of_joint).count();
    let ended = simulation.ended_contacts();
    let parted = ended.iter().filter(is_of_joint).count();
    println!("{changes} changes of mesh, {left} of {joint} points, pulled by {pulled:.3e} N");
    assert!(changes > 1 && elements == start, "{changes} {elements}");
    assert_eq!((left, parted), (joint, 0));
    assert!(pulled > 0.0, "{pulled}");
    // The lower block is prescribed, so momentum is compared with its impulses.
    assert!(balance.momentum < 1e-12, "{balance:?}");
}
