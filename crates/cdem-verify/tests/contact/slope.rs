//! A block on a slope: sliding and sticking.

use cdem::scene::{Block, ContactPair, Geometry};
use cdem_verify::Case;
use cdem_verify::problems::slope::{measure, sliding, slope};

/// Splits the base into twenty separate blocks that lie flush.
fn in_pieces(mut case: Case) -> Case {
    let base = case.scene.block.remove(0);
    let piece = |k: usize| {
        let x = -3.0 + 0.6 * k as f64;
        Block {
            name: format!("base{k}"),
            geometry: Geometry::Box {
                min: vec![x, -1.0],
                max: vec![x + 0.6, 0.0],
                divisions: vec![1, 1],
                element: cdem::mesh::ElementKind::Tri3,
            },
            ..base.clone()
        }
    };
    case.scene.block.splice(0..0, (0..20).map(piece));
    case
}

#[test]
fn joints_in_the_base_do_not_catch_the_block() {
    let mut case = in_pieces(slope(30.0, 20.0));
    case.scene.time.end = 0.6; // slides 0.33 m, over an edge of the base
    let mut tilted = 0.0_f64;
    let [found, _] = measure(&case, |simulation| {
        for normal in simulation.contact_frame().normals {
            tilted = tilted.max(normal[0].abs());
        }
    });
    let exact = sliding(30.0, 20.0);
    println!("twenty blocks: {found:.7}, exact {exact:.7}, normals tilted by {tilted:.1e}");
    assert!((found / exact - 1.0).abs() < 1e-4, "{found} {exact}");
    // Normals follow the block's bottom as it deforms: strains of 1e-6.
    assert!(tilted < 1e-5, "{tilted}");
}

fn pair(between: [&str; 2], friction: f64) -> ContactPair {
    ContactPair {
        between: between.map(str::to_owned),
        friction_angle: Some(friction.to_radians()),
        cohesion: None,
        tensile_strength: None,
        normal_stiffness: None,
        shear_stiffness: None,
        enabled: None,
    }
}

#[test]
fn block_pairs_rank_above_material_pairs_and_later_above_earlier() {
    let material = pair(["rock", "rock"], 45.0);
    let blocks = pair(["block", "base"], 20.0);
    let sticky = pair(["base", "block"], 45.0);
    let cases = [
        (vec![material.clone()], 0.0),
        (vec![blocks.clone(), material.clone()], sliding(30.0, 20.0)),
        (vec![sticky.clone(), blocks.clone()], sliding(30.0, 20.0)),
        (vec![blocks, sticky], 0.0),
    ];
    for (pairs, exact) in cases {
        let mut case = slope(30.0, 10.0);
        case.scene.contact.pair = pairs;
        case.scene.time.end = 0.1;
        let [found, _] = measure(&case, |_| {});
        println!("{found:.5}, exact {exact:.5}");
        // Sudden gravity leaves a vibration in so short a run.
        assert!((found - exact).abs() < 0.02, "{found} {exact}");
    }
}
