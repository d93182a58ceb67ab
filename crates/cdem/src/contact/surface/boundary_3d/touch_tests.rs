//! Times of impact on ridges that are all but parallel, on faces that bulge, and in dents.

use proptest::prelude::*;

use crate::contact::narrow_phase::feature_selection::select_feature_pair;
use crate::contact::surface::boundary_3d::Boundary3d;
use crate::contact::surface::boundary_3d::tests::{all_pairs, mesh};
use crate::contact::surface::{Configuration, ConstantMotion, Distance, TimeOfImpact};
use crate::contact::tolerances::VOLUME_ROUND_OFF;
use crate::math::vector::{add, dot, scale};
use crate::mesh::{Element, ElementKind, Mesh, MeshBlock};

proptest! {
    /// Ridges that fall across each other touch in time, however small the angle between them.
    /// Either the edges touch, or the ends of the upper edge do. The ends do if each lies beside the
    /// lower edge by at most half of the resolution over the slope of its faces, or by a ten millionth
    /// of its length.
    #[test]
    fn ridges_that_are_all_but_parallel_touch_in_time(
        angle in (-9.0..-1.0_f64).prop_map(|power| 10.0_f64.powf(power)),
        resolution in (-6.0..-3.0_f64).prop_map(|power| 10.0_f64.powf(power)),
        size in 0.5..50.0_f64,
        slope in 0.3..5.0_f64,
    ) {
        let (s, c) = angle.sin_cos();
        let lower = [[-1.5, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, -1.0, -slope], [0.0, 1.0, -slope]];
        let upper = [[-c, -s, 0.1], [c, s, 0.1], [0.0, 1.0, 0.1 + slope], [0.0, -1.0, 0.1 + slope]];
        let [lower, upper] = [lower, upper].map(|nodes| nodes.map(|x| scale(size, &x)));
        let mesh = mesh(&[(ElementKind::Tet4, &lower), (ElementKind::Tet4, &upper)]);
        let boundary = Boundary3d::new(&mesh, resolution);
        let still = [[0.0; 3]; 8];
        let falls = |node: usize| [0.0, 0.0, if node < 4 { 0.0 } else { -size }];
        let velocity: [[f64; 3]; 8] = std::array::from_fn(falls);
        let at = Configuration::new(&mesh.nodes, &still);
        let motion = ConstantMotion { at, velocity: &velocity };
        let times = all_pairs(&boundary).into_iter().filter_map(|pair| {
            boundary.time_of_impact(pair, motion, 1.0, resolution)
        });
        let first = times.fold(f64::MAX, f64::min);
        let late = size * (first - 0.1);
        prop_assert!(late <= 0.51 * resolution + 1.1e-7 * slope.max(1.0) * size, "{late:e}");
        // Edges, their distance and its change in a second are at most 3 sizes long.
        let round_off = 3.0 * VOLUME_ROUND_OFF / f64::max(angle, 1e-7) * size;
        prop_assert!(late >= -round_off, "{late:e}");
    }
}

const DOWN: [f64; 3] = [0.0, 0.0, -1.0];

/// Hexahedra of 1 m in the plane, with the height of their tops given at each node.
fn bed(across: [usize; 2], top: impl Fn(f64, f64) -> f64) -> Vec<(ElementKind, Vec<[f64; 3]>)> {
    let columns = (0..across[0]).flat_map(|x| (0..across[1]).map(move |y| [x as f64, y as f64]));
    let cells = columns.map(|[x, y]| {
        let ring = [[x, y], [x + 1.0, y], [x + 1.0, y + 1.0], [x, y + 1.0]];
        let below = ring.map(|[x, y]| [x, y, top(x, y) - 1.0]);
        let above = ring.map(|[x, y]| [x, y, top(x, y)]);
        (ElementKind::Hex8, [below, above].concat())
    });
    cells.collect()
}

/// A tetrahedron that moves at 1 m/s.
struct SlidingTip {
    corners: [[f64; 3]; 4],
    /// Direction and length of its way, m.
    along: [f64; 3],
    way: f64,
    /// Normal of triangles that it already touches.
    held: Option<[f64; 3]>,
}

/// Returns the time at which a tip first touches a bed of one block.
fn touches_bed(
    bed: &[(ElementKind, Vec<[f64; 3]>)],
    tip: SlidingTip,
    resolution: f64,
) -> Option<f64> {
    let SlidingTip {
        corners,
        along,
        way,
        held,
    } = tip;
    let mut mesh = joined(bed);
    let first = mesh.nodes.len() as u32;
    mesh.nodes.extend(corners);
    mesh.elements.push(Element::new(
        ElementKind::Tet4,
        &[first, first + 1, first + 2, first + 3],
    ));
    let count = mesh.elements.len() as u32;
    mesh.blocks.push(MeshBlock {
        name: "tip".to_owned(),
        source: 1,
        nodes: first..first + 4,
        elements: count - 1..count,
    });
    let boundary = Boundary3d::new(&mesh, resolution);
    let still = vec![[0.0; 3]; mesh.nodes.len()];
    let mut velocity = still.clone();
    velocity[first as usize..].fill(along);
    let at = Configuration::new(&mesh.nodes, &still);
    let motion = ConstantMotion {
        at,
        velocity: &velocity,
    };
    let end = motion.after(way);
    let times = all_pairs(&boundary).into_iter().filter_map(|pair| {
        let is_near = boundary.distance(pair, at) <= way + resolution
            && boundary.exclusion(pair, at, resolution) <= way;
        let time = boundary.time_of_impact(pair, motion, way, resolution)?;
        let then = motion.after(time);
        let rightful = select_feature_pair(&boundary, pair, [then, end], resolution, |_| true)?;
        let normal = boundary.normal(rightful, then)?;
        let is_held = held.is_some_and(|held| dot(&held, &normal) > 1.0 - 1e-9);
        (is_near && !is_held).then_some(time)
    });
    times.min_by(f64::total_cmp)
}

/// One block of cells, which share nodes at the same position.
fn joined(cells: &[(ElementKind, Vec<[f64; 3]>)]) -> Mesh<3> {
    let mut mesh = Mesh::default();
    for (kind, corners) in cells {
        let numbers = corners.iter().map(|corner| {
            let known = mesh.nodes.iter().position(|node| node == corner);
            known.unwrap_or_else(|| {
                mesh.nodes.push(*corner);
                mesh.nodes.len() - 1
            }) as u32
        });
        let numbers: Vec<u32> = numbers.collect();
        mesh.elements.push(Element::new(*kind, &numbers));
    }
    mesh.blocks.push(MeshBlock {
        name: "bed".to_owned(),
        source: 0,
        nodes: 0..mesh.nodes.len() as u32,
        elements: 0..mesh.elements.len() as u32,
    });
    mesh
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// A straight edge that falls on many elements whose faces are slightly convex sinks in by a
    /// quarter of the resolution at most.
    #[test]
    fn a_long_edge_touches_a_face_that_bulges_little(
        turn in (-7.0..-2.0_f64).prop_map(|power| 10.0_f64.powf(power)),
        half in 1..12_usize,
        turned in -0.2..0.2_f64,
    ) {
        let (middle, resolution) = (half as f64, 1e-4);
        let bed = bed([2 * half, 3], |x, _| -0.5 * turn * (x - middle).powi(2));
        let (s, c) = turned.sin_cos();
        let place = |along: f64, across: f64, z: f64| {
            [middle + along * c - across * s, 1.5 + along * s + across * c, 0.1 + z]
        };
        let reach = middle + 1.0;
        let blade = [place(-reach, 0.0, 0.0), place(reach, 0.0, 0.0), place(0.0, 3.0, 3.0), place(0.0, -3.0, 3.0)];
        let time = touches_bed(&bed, SlidingTip { corners: blade, along: DOWN, way: 0.2, held: None }, resolution);
        let late = time.map(|time| time - 0.1);
        prop_assert!(late.is_some_and(|late| (-1e-9..=0.25 * resolution).contains(&late)), "{late:?}");
    }

    /// A point that slides down one side of a dent, with a small penetration, touches the other
    /// side before its penetration there is larger.
    #[test]
    fn what_slides_into_a_dent_touches_its_other_side(
        turn in 0.021..1.5_f64,
        depth in 0.0..0.9_f64,
        place in 0.1..0.9_f64,
    ) {
        let resolution = 1e-4;
        let (s, c) = (0.5 * turn).sin_cos();
        let bed = bed([2, 1], |x, _| s / c * (x - 1.0).abs());
        let [way, deep] = [0.02, depth * resolution];
        // On the left side, which falls to the right.
        let tip = [1.0 - 0.01 * c - deep * s, place, 0.01 * s - deep * c];
        let corner = |x: f64, y: f64| add(&tip, &[x, y, 0.5]);
        let tip = [tip, corner(0.05, -0.05), corner(0.0, 0.05), corner(-0.05, -0.05)];
        let time = touches_bed(&bed, SlidingTip { corners: tip, along: [c, 0.0, -s], way, held: Some([s, 0.0, c]) }, resolution);
        // 0.01 m down to the middle, less or more by the penetration in the left side.
        let beyond = time.map(|time| (time - 0.01) * turn.sin());
        prop_assert!(beyond.is_some_and(|beyond| beyond <= resolution), "{time:?}");
    }

    /// A point that starts in a dent with the largest allowed penetration touches, however flat the
    /// dent is.
    #[test]
    fn what_is_in_a_dent_touches(
        turn in (-7.0..0.0_f64).prop_map(|power| 10.0_f64.powf(power)),
        depth in 0.0..1.0_f64,
        aside in -1e-4..1e-4_f64,
    ) {
        let resolution = 1e-4;
        let slope = (0.5 * turn).tan();
        let bed = bed([2, 2], |x, y| slope * ((x - 1.0).abs() + (y - 1.0).abs()));
        let tip = [1.0 + aside, 1.0, slope * aside.abs() - depth * resolution];
        let corner = |x: f64, y: f64| add(&tip, &[x, y, 0.5]);
        let tip = [tip, corner(0.2, -0.15), corner(-0.05, 0.2), corner(-0.15, -0.15)];
        let time = touches_bed(&bed, SlidingTip { corners: tip, along: DOWN, way: resolution, held: None }, resolution);
        prop_assert!(time.is_some());
    }
}
