//! Impacts of two boxes with any elements in any position, and the checks that hold in each.

use cdem::mesh::ElementKind;
use cdem::output::HistoryRow;
use cdem::scene::{ContactModel, Geometry, Kinematics, Rotation};
use cdem_verify::{Balance, Case, Random, deepest_overlap, load, run};
use nalgebra::{Rotation3, Unit, Vector3};

const KINDS: [&[ElementKind]; 2] = [
    &[ElementKind::Tri3, ElementKind::Quad4],
    &[ElementKind::Tet4, ElementKind::Wedge6, ElementKind::Hex8],
];

/// Returns the highest point of a rotated box with half sides `half` about the origin, m; the
/// centre of an edge or face that is highest. The lowest point is opposite to it.
fn highest(half: &[f64], rotate: &Rotation) -> Vec<f64> {
    let axis = Unit::new_normalize(Vector3::from(rotate.axis));
    let turn = Rotation3::from_axis_angle(&axis, rotate.angle);
    let up = half.len() - 1;
    let corner = Vector3::from_fn(|c, _| {
        let height = if c <= up { turn[(up, c)] } else { 0.0 };
        let side = if height.abs() < 1e-9 {
            0.0
        } else {
            height.signum()
        };
        side * half.get(c).copied().unwrap_or(0.0)
    });
    (turn * corner).iter().copied().take(half.len()).collect()
}

/// Builds a random impact: boxes of one or two elements along each side, flush or oblique, on
/// faces, edges or corners.
fn meeting(dimension: usize, seed: u64) -> Case {
    let mut random = Random(seed);
    let mut case = load(if dimension == 2 { "meetings" } else { "ties" });
    let scene = &mut case.scene;
    scene.material[0].young_modulus = 1e10;
    scene.contact.model = ContactModel::TwoScale;
    scene.contact.max_level = if dimension == 2 { 3 } else { 2 };
    scene.contact.strength.friction_angle = f64::to_radians([0.0, 30.0][random.whole(0, 1)]);
    let mut height = vec![0.0; dimension];
    for block in &mut scene.block {
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
        // The lowest point of the upper box is above the highest point of the lower one.
        let point = highest(&half, &block.rotate);
        height.iter_mut().zip(&point).for_each(|(sum, x)| *sum += x);
        block.translate = vec![0.0; dimension];
        if random.whole(0, 4) == 0 {
            block.kinematics = Kinematics::Incremental;
        }
    }
    // A box that falls beside an upright edge or corner takes long to come down on its side.
    let reach = if case.block("below").rotate.angle == 0.0 {
        1.0
    } else {
        0.02
    };
    let above = case.block("above");
    above.translate = height;
    above.translate[0] += reach * [0.0, 0.25, random.between(-0.4, 0.4)][random.whole(0, 2)];
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

/// Runs an impact and checks it; returns the largest number of elements.
fn judge(dimension: usize, seed: u64) -> u64 {
    let mut simulation = meeting(dimension, seed).start();
    let tolerance = simulation.scene().contact.tolerance.expect("filled in");
    let mut balance = Balance::new(&mut simulation);
    let start = simulation.history().kinetic_energy;
    // Limits for blocks of few elements and for refined ones. The time integration of blocks of few
    // elements that vibrate after the contact is less precise: with a quarter of the step, the rise of
    // seed 85 in space falls from 1.2e-3 to 1e-5.
    let [coarse_bound, bound] = [2e-2, 1e-3];
    let is_refined = |row: &HistoryRow| row.elements > 80;
    let mut refined = balance.clone(); // at the last refined row
    let (mut most, mut deepest, mut lost) = (0, 0.0_f64, 0.0_f64);
    run(&mut simulation, |simulation| {
        let row = balance.look(simulation);
        most = most.max(row.elements);
        // A change of mesh adds no energy within the tolerance of the ledger. In the middle of a
        // kick, contact differs between two meshes.
        assert!(
            row.remesh_loss > lost - bound * start,
            "{dimension} {seed}: {lost:e} before {row:?}"
        );
        lost = row.remesh_loss;
        if is_refined(&row) {
            refined = balance.clone();
        }
        if simulation.step_index().is_multiple_of(10) {
            deepest = deepest.max(deepest_overlap(&simulation.frame()));
        }
    });
    println!(
        "{dimension}-D {seed}: {} contacts, {most} elements, overlap {:.2}, penetration {:.2} of the \
         tolerance, momenta {:.0e} {:.0e}, residual {:.1e}, rise {:.1e}",
        simulation.contacts_begun(),
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
    for (balance, bound) in [(&balance, coarse_bound), (&refined, bound)] {
        assert!(
            balance.residual < bound && balance.rise < bound,
            "{seed}: {balance:?}"
        );
    }
    most
}

#[test]
fn boxes_meet_in_the_plane() {
    let refined = (0..40).filter(|&seed| judge(2, seed) > 40);
    assert!(refined.count() > 30, "most are refined");
}

#[test]
fn boxes_meet_in_space() {
    let refined = (0..6).filter(|&seed| judge(3, seed) > 40);
    assert!(refined.count() > 3, "most are refined");
}

/// Single bent hexahedra have twice the strain energy when split into tetrahedra, and no motion
/// from which it could be taken when they are refined again.
#[test]
fn bent_boxes_gain_nothing() {
    for seed in [91, 99] {
        judge(3, seed);
    }
}

#[test]
#[ignore = "slow study: a hundred meetings in space"]
fn boxes_meet_in_space_in_many_ways() {
    let refined = (6..106).filter(|&seed| judge(3, seed) > 40);
    assert!(refined.count() > 50, "most are refined");
}
