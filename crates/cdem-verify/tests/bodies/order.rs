//! Order of convergence in space and time together.

use cdem::mesh::ElementKind;
use cdem::scene::{Kinematics, Plane};
use cdem_verify::{fit, load};

use crate::shared::LameMode;

/// Runs the scene for each number of divisions; returns the fitted order of the errors at the end.
fn order(scene: &str, shape: ElementKind, kinematics: Kinematics, divisions: &[usize]) -> f64 {
    let mut points = Vec::new();
    for &n in divisions {
        let mut case = load(scene);
        let into = [n, n, n / 4];
        let dimension = case.scene.dimension;
        case.divide("block", &into[..dimension], shape);
        case.scene.block[0].kinematics = kinematics;
        let mode = LameMode::new(&case);
        let mut simulation = mode.start(&mut case);
        while !simulation.finished() {
            simulation.step().expect("small vibrations go on");
        }
        points.push(((1.0 / n as f64).ln(), mode.error(&mut simulation).ln()));
    }
    let order = fit::slope(&points);
    let errors: Vec<_> = points
        .iter()
        .map(|p| format!("{:.2e}", p.1.exp()))
        .collect();
    println!(
        "{shape:?} {kinematics:?}: {divisions:?} errors {}, order {order:.3}",
        errors.join(" ")
    );
    order
}

#[test]
fn displacements_converge_with_order_two() {
    for kinematics in [Kinematics::Total, Kinematics::Incremental] {
        for shape in [ElementKind::Tri3, ElementKind::Quad4] {
            assert!(order("lame-mode-2d", shape, kinematics, &[8, 16, 32]) > 1.9);
        }
        for shape in [ElementKind::Tet4, ElementKind::Wedge6, ElementKind::Hex8] {
            assert!(order("lame-mode-3d", shape, kinematics, &[8, 16]) > 1.9);
        }
    }
}

#[test]
#[ignore = "slow study: finer meshes in space"]
fn displacements_converge_with_order_two_on_finer_meshes() {
    for kinematics in [Kinematics::Total, Kinematics::Incremental] {
        for shape in [ElementKind::Tet4, ElementKind::Wedge6, ElementKind::Hex8] {
            assert!(order("lame-mode-3d", shape, kinematics, &[8, 16, 24, 32]) > 1.9);
        }
    }
}

#[test]
fn plane_stress_and_plane_strain_shear_alike() {
    // Lamé's mode has no out-of-plane stress, so both give the same answer.
    let mut errors = Vec::new();
    for plane in [Plane::Strain, Plane::Stress] {
        let mut case = load("lame-mode-2d");
        case.scene.plane = plane;
        case.divide("block", &[16, 16], ElementKind::Quad4);
        let mode = LameMode::new(&case);
        let mut simulation = mode.start(&mut case);
        while !simulation.finished() {
            simulation.step().expect("small vibrations go on");
        }
        errors.push(mode.error(&mut simulation));
    }
    println!("plane strain and stress: errors {errors:?}");
    // The error of 16 elements a side in plane strain, with a margin for the different
    // discretisation error in plane stress.
    assert!(errors.iter().all(|&error| error < 0.02));
}
