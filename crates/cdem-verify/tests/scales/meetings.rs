//! Boxes of any elements that meet in any way: what must hold in each.

use cdem::mesh::ElementKind;
use cdem::scene::{ContactModel, Geometry, Kinematics, Rotation};
use cdem_verify::{Balance, Case, Random, deepest_overlap, load, run};

const KINDS: [&[ElementKind]; 2] = [
    &[ElementKind::Tri3, ElementKind::Quad4],
    &[ElementKind::Tet4, ElementKind::Wedge6, ElementKind::Hex8],
];

/// How high a box of these half sides stands that is turned, m.
fn height(half: &[f64], rotate: &Rotation) -> f64 {
    let [x, y, z] = rotate.axis;
    let (sin, cos) = rotate.angle.sin_cos();
    // The row of the rotation that gives the last coordinate.
    let row = if half.len() == 2 {
        vec![sin, cos]
    } else {
        let share = 1.0 - cos;
        vec![
            z * x * share - y * sin,
            z * y * share + x * sin,
            z * z * share + cos,
        ]
    };
    row.iter().zip(half).map(|(r, h)| (r * h).abs()).sum()
}

/// A meeting drawn by number: boxes of one to three elements along each side, flush or
/// askew, on faces, edges or corners.
fn meeting(dimension: usize, seed: u64) -> Case {
    let mut random = Random(seed);
    let mut case = load(if dimension == 2 { "meetings" } else { "ties" });
    let scene = &mut case.scene;
    scene.material[0].young_modulus = 1e10;
    scene.contact.model = ContactModel::TwoScale;
    scene.contact.max_level = if dimension == 2 { 3 } else { 2 };
    scene.contact.strength.friction_angle = f64::to_radians([0.0, 30.0][random.whole(0, 1)]);
    for (block, sign) in scene.block.iter_mut().zip([-1.0, 1.0]) {
        let kinds = KINDS[dimension - 2];
        let half = (0..dimension).map(|_| [0.5, 0.35, 1.0][random.whole(0, 2)]);
        let half: Vec<f64> = half.collect();
        block.geometry = Geometry::Box {
            min: half.iter().map(|x| -x).collect(),
            max: half.clone(),
            divisions: (0..dimension).map(|_| random.whole(1, 2)).collect(),
            element: kinds[random.whole(0, kinds.len() - 1)],
        };
        let axes = [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.36, 0.48, 0.8],
        ];
        let any = random.between(0.0, 90.0);
        block.rotate = Rotation {
            axis: if dimension == 2 {
                axes[2]
            } else {
                axes[random.whole(0, 3)]
            },
            angle: f64::to_radians([0.0, 45.0, 30.0, any][random.whole(0, 3)]),
        };
        block.translate = vec![0.0; dimension];
        block.translate[dimension - 1] = sign * height(&half, &block.rotate);
        if random.whole(0, 4) == 0 {
            block.kinematics = Kinematics::Incremental;
        }
    }
    let above = case.block("above");
    above.translate[0] = [0.0, 0.25, random.between(-0.4, 0.4)][random.whole(0, 2)];
    above.translate[dimension - 1] += 0.003;
    above.velocity = vec![0.0; dimension];
    above.velocity[0] = [0.0, 2.0][random.whole(0, 1)];
    above.velocity[dimension - 1] = -[1.0, 3.0, 7.0][random.whole(0, 2)];
    let spin = [0.0, 2.0][random.whole(0, 1)];
    above.angular_velocity = if dimension == 2 {
        vec![spin]
    } else {
        vec![0.5 * spin, spin, 0.25 * spin]
    };
    case
}

/// Runs one; returns the most elements in it.
fn judge(dimension: usize, seed: u64) -> u64 {
    let mut simulation = meeting(dimension, seed).start();
    let tolerance = simulation.scene().contact.tolerance.expect("filled in");
    let mut balance = Balance::new(&mut simulation);
    let (mut most, mut deepest, mut lost) = (0, 0.0_f64, 0.0_f64);
    run(&mut simulation, |simulation| {
        let row = balance.look(simulation);
        most = most.max(row.elements);
        // A change of mesh makes no energy, but for what is left of its measure.
        assert!(
            row.remesh_loss > lost - 1e-4 * row.kinetic_energy,
            "{dimension} {seed}: {row:?}"
        );
        lost = row.remesh_loss;
        if simulation.step_index().is_multiple_of(10) {
            deepest = deepest.max(deepest_overlap(&simulation.frame()));
        }
    });
    println!(
        "{dimension}-D {seed}: {most} elements, overlap {:.2}, penetration {:.2} of the \
         tolerance, momenta {:.0e} {:.0e}, residual {:.1e}, rise {:.1e}",
        deepest / tolerance,
        simulation.max_penetration() / tolerance,
        balance.momentum,
        balance.angular_momentum,
        balance.residual,
        balance.rise,
    );
    assert!(deepest < tolerance, "{dimension} {seed}: {deepest:e}");
    assert!(
        simulation.max_penetration() < tolerance,
        "{dimension} {seed}"
    );
    assert!(
        balance.momentum < 1e-12 && balance.angular_momentum < 1e-12,
        "{seed}: {balance:?}"
    );
    // Between refined blocks, 1e-3, and of blocks of few elements, 2e-2 (design, section 7).
    let bound = if most > 40 { 5e-3 } else { 2e-2 };
    assert!(
        balance.residual < bound && balance.rise < bound,
        "{seed}: {balance:?}"
    );
    most
}

#[test]
fn boxes_meet_in_the_plane() {
    let refined = (0..40).filter(|&seed| judge(2, seed) > 40);
    assert!(refined.count() > 20, "most are refined");
}

#[test]
fn boxes_meet_in_space() {
    let refined = (0..6).filter(|&seed| judge(3, seed) > 40);
    assert!(refined.count() > 2, "most are refined");
}

#[test]
#[ignore = "slow study: a hundred meetings in space"]
fn boxes_meet_in_space_in_many_ways() {
    let refined = (6..106).filter(|&seed| judge(3, seed) > 40);
    assert!(refined.count() > 50, "most are refined");
}
