//! Jacobians under rigid motion, culling, tributary areas.

use proptest::prelude::*;
use rayon::prelude::*;

use crate::contact::narrow_phase::feature_selection::select_feature_pair;
use crate::contact::surface::boundary_3d::{Boundary3d, FeaturePair};
use crate::contact::surface::{
    Configuration, ContactGeometry, ContactJacobian, CullingResult, Distance, GapAllowance, Pair,
    TimeOfImpact, Topology,
};
use crate::contact::tolerances::{CULLING_RATE, VOLUME_ROUND_OFF};
use crate::math::vector::{add, add_scaled, cross, dot, norm, scale, sub};
use crate::mesh::{self, Element, ElementKind, Mesh, MeshBlock};
use crate::scene::Geometry;

/// One element for each block, each with its own nodes.
pub(super) fn mesh(cells: &[(ElementKind, &[[f64; 3]])]) -> Mesh<3> {
    let mut mesh = Mesh::default();
    for (number, (kind, nodes)) in cells.iter().enumerate() {
        let first = mesh.nodes.len() as u32;
        mesh.nodes.extend_from_slice(nodes);
        let numbers: Vec<u32> = (first..mesh.nodes.len() as u32).collect();
        mesh.elements.push(Element::new(*kind, &numbers));
        mesh.blocks.push(MeshBlock {
            name: format!("b{number}"),
            source: number,
            nodes: first..mesh.nodes.len() as u32,
            elements: number as u32..number as u32 + 1,
        });
    }
    mesh
}

pub(super) fn vector(size: f64) -> impl Strategy<Value = [f64; 3]> {
    [-size..size, -size..size, -size..size]
}

/// A unit cube with warped faces, moved by `shift`.
pub(super) fn warped_cube(shift: [f64; 3], warp: &[[f64; 3]; 8]) -> Vec<[f64; 3]> {
    let corners = [
        [0., 0., 0.],
        [1., 0., 0.],
        [1., 1., 0.],
        [0., 1., 0.],
        [0., 0., 1.],
        [1., 0., 1.],
        [1., 1., 1.],
        [0., 1., 1.],
    ];
    let moved = corners.iter().zip(warp);
    moved.map(|(x, w)| add(&add(x, w), &shift)).collect()
}

pub(super) fn all_pairs(boundary: &Boundary3d) -> Vec<Pair> {
    let (vertices, triangles) = (
        boundary.triangulation.vertex_count,
        boundary.triangulation.triangles.len() as u32,
    );
    let edges = boundary.triangulation.edges.len() as u32;
    let faces =
        (0..vertices).flat_map(|v| (0..triangles).map(move |t| Boundary3d::face_pair(v, t)));
    let crossings = (0..edges).flat_map(|a| (a + 1..edges).map(move |b| (a, b)));
    let mut pairs: Vec<Pair> = faces.collect();
    pairs.extend(crossings.map(|(a, b)| boundary.edge_pair(a, b)));
    pairs.retain(|&pair| {
        let [one, other] = boundary.blocks(pair);
        one != other
    });
    pairs
}

/// All results for the pairs of a drift, as text: numbers with all their digits.
fn answers(boundary: &Boundary3d, at: Configuration<3>, velocity: &[[f64; 3]]) -> Vec<String> {
    let slack = GapAllowance {
        within: 1e-6,
        depth: 1e-8,
        clear: f64::INFINITY,
    };
    let ask = |pair: &Pair| {
        let pair = *pair;
        let place = (
            boundary.project(pair, at),
            boundary.distance_lower_bound(pair, at),
        );
        let nearness = boundary.cull(pair, at, 0.1, 1e-4);
        let rests = boundary.stays_in_contact(pair, at, velocity, 0.1, slack);
        let time = boundary.time_of_impact(pair, at, velocity, 0.1, 1e-4);
        format!("{place:?} {nearness:?} {rests} {time:?}")
    };
    all_pairs(boundary).par_iter().map(ask).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// A geometry cache changes no bit, on any number of threads. Its values are cleared when it is
    /// used again for other positions.
    #[test]
    fn what_is_kept_has_the_same_bits(
        warp in [0, 1].map(|_| [0; 8].map(|_| vector(0.1))),
        moves in [0, 1].map(|_| [0; 16].map(|_| vector(0.1))),
        velocity in [0; 16].map(|_| vector(1.0)),
    ) {
        let cubes = [warped_cube([0.0; 3], &warp[0]), warped_cube([0.3, 0.2, 1.1], &warp[1])];
        let mesh = mesh(&cubes.each_ref().map(|cube| (ElementKind::Hex8, cube.as_slice())));
        let boundary = Boundary3d::new(&mesh, 1e-4);
        for threads in [1, 4] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            let mut room = boundary.geometry_cache(usize::MAX, None);
            for displacement in &moves {
                room = boundary.geometry_cache(0, room);
                prop_assert!(room.is_some());
                let at = Configuration::new(&mesh.nodes, displacement);
                let alone = answers(&boundary, at, &velocity);
                let together = pool.install(|| answers(&boundary, at.with(room.as_ref()), &velocity));
                prop_assert_eq!(alone, together);
            }
        }
    }
}

proptest! {
    /// Ridges that fall across each other touch in time, however small the angle between them.
    /// Either the edges touch, or the ends of the upper edge do. The ends do if they lie beside the
    /// lower edge by at most a tenth of the tolerance, or by a ten millionth of their length, and
    /// they sink in on its slopes by as much.
    #[test]
    fn ridges_that_are_all_but_parallel_touch_in_time(
        angle in (-9.0..-1.0_f64).prop_map(|power| 10.0_f64.powf(power)),
        tolerance in (-6.0..-3.0_f64).prop_map(|power| 10.0_f64.powf(power)),
        size in 0.5..50.0_f64,
    ) {
        let (s, c) = angle.sin_cos();
        let lower = [[-1.5, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, -1.0, -1.0], [0.0, 1.0, -1.0]];
        let upper = [[-c, -s, 0.1], [c, s, 0.1], [0.0, 1.0, 1.1], [0.0, -1.0, 1.1]];
        let [lower, upper] = [lower, upper].map(|nodes| nodes.map(|x| scale(size, &x)));
        let mesh = mesh(&[(ElementKind::Tet4, &lower), (ElementKind::Tet4, &upper)]);
        let boundary = Boundary3d::new(&mesh, tolerance);
        let still = [[0.0; 3]; 8];
        let falls = |node: usize| [0.0, 0.0, if node < 4 { 0.0 } else { -size }];
        let velocity: [[f64; 3]; 8] = std::array::from_fn(falls);
        let at = Configuration::new(&mesh.nodes, &still);
        let times = all_pairs(&boundary).into_iter().filter_map(|pair| {
            boundary.time_of_impact(pair, at, &velocity, 1.0, tolerance)
        });
        let first = times.fold(f64::MAX, f64::min);
        let late = size * (first - 0.1);
        prop_assert!(late <= 0.11 * tolerance + 1.1e-7 * size, "{late:e}");
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

/// Returns the time at which a tetrahedron that moves by `way` along a unit vector, at 1 m/s, first
/// touches a bed of one block. `held` is the normal of triangles that it already touches.
fn touches_bed(
    bed: &[(ElementKind, Vec<[f64; 3]>)],
    tip: [[f64; 3]; 4],
    (along, held): ([f64; 3], Option<[f64; 3]>),
    (way, tolerance): (f64, f64),
) -> Option<f64> {
    let mut mesh = joined(bed);
    let first = mesh.nodes.len() as u32;
    mesh.nodes.extend(tip);
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
    let boundary = Boundary3d::new(&mesh, tolerance);
    let still = vec![[0.0; 3]; mesh.nodes.len()];
    let mut velocity = still.clone();
    velocity[first as usize..].fill(along);
    let at = Configuration::new(&mesh.nodes, &still);
    let end = at.after(&velocity, way);
    let times = all_pairs(&boundary).into_iter().filter_map(|pair| {
        let is_near = boundary.cull(pair, at, way, tolerance) == CullingResult::Near;
        let time = boundary.time_of_impact(pair, at, &velocity, way, tolerance)?;
        let then = at.after(&velocity, time);
        let rightful = select_feature_pair(&boundary, pair, [then, end], tolerance, &|_| true)?;
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
    /// quarter of the tolerance at most.
    #[test]
    fn a_long_edge_touches_a_face_that_bulges_little(
        turn in (-7.0..-2.0_f64).prop_map(|power| 10.0_f64.powf(power)),
        half in 1..12_usize,
        turned in -0.2..0.2_f64,
    ) {
        let (middle, tolerance) = (half as f64, 1e-4);
        let bed = bed([2 * half, 3], |x, _| -0.5 * turn * (x - middle).powi(2));
        let (s, c) = turned.sin_cos();
        let place = |along: f64, across: f64, z: f64| {
            [middle + along * c - across * s, 1.5 + along * s + across * c, 0.1 + z]
        };
        let reach = middle + 1.0;
        let blade = [place(-reach, 0.0, 0.0), place(reach, 0.0, 0.0), place(0.0, 3.0, 3.0), place(0.0, -3.0, 3.0)];
        let time = touches_bed(&bed, blade, (DOWN, None), (0.2, tolerance));
        let late = time.map(|time| time - 0.1);
        prop_assert!(late.is_some_and(|late| (-1e-9..=0.25 * tolerance).contains(&late)), "{late:?}");
    }

    /// A point that slides down one side of a dent, with a small penetration, touches the other
    /// side before its penetration there is larger.
    #[test]
    fn what_slides_into_a_dent_touches_its_other_side(
        turn in 0.021..1.5_f64,
        depth in 0.0..0.9_f64,
        place in 0.1..0.9_f64,
    ) {
        let tolerance = 1e-4;
        let (s, c) = (0.5 * turn).sin_cos();
        let bed = bed([2, 1], |x, _| s / c * (x - 1.0).abs());
        let [way, deep] = [0.02, depth * tolerance];
        // On the left side, which falls to the right.
        let tip = [1.0 - 0.01 * c - deep * s, place, 0.01 * s - deep * c];
        let corner = |x: f64, y: f64| add(&tip, &[x, y, 0.5]);
        let tip = [tip, corner(0.05, -0.05), corner(0.0, 0.05), corner(-0.05, -0.05)];
        let time = touches_bed(&bed, tip, ([c, 0.0, -s], Some([s, 0.0, c])), (way, tolerance));
        // 0.01 m down to the middle, less or more by the penetration in the left side.
        let beyond = time.map(|time| (time - 0.01) * turn.sin());
        prop_assert!(beyond.is_some_and(|beyond| beyond <= tolerance), "{time:?}");
    }

    /// A point that starts in a dent with the largest allowed penetration touches, however flat the
    /// dent is.
    #[test]
    fn what_is_in_a_dent_touches(
        turn in (-7.0..0.0_f64).prop_map(|power| 10.0_f64.powf(power)),
        depth in 0.0..1.0_f64,
        aside in -1e-4..1e-4_f64,
    ) {
        let tolerance = 1e-4;
        let slope = (0.5 * turn).tan();
        let bed = bed([2, 2], |x, y| slope * ((x - 1.0).abs() + (y - 1.0).abs()));
        let tip = [1.0 + aside, 1.0, slope * aside.abs() - depth * tolerance];
        let corner = |x: f64, y: f64| add(&tip, &[x, y, 0.5]);
        let tip = [tip, corner(0.2, -0.15), corner(-0.05, 0.2), corner(-0.15, -0.15)];
        let time = touches_bed(&bed, tip, (DOWN, None), (tolerance, tolerance));
        prop_assert!(time.is_some());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// No rigid motion of both blocks together is a relative motion, and no impulse changes the
    /// linear or angular momentum, at any gap.
    #[test]
    fn rigid_motions_are_no_relative_motions(
        warp in proptest::array::uniform8(vector(0.15)),
        shift in vector(0.4),
        velocity in vector(1.0),
        spin in vector(1.0),
        anchor in [0.0..1.0_f64, 0.0..1.0_f64],
    ) {
        let one = warped_cube([0.0; 3], &warp);
        let other = warped_cube(add(&[0.2, 0.1, 1.6], &shift), &warp);
        let mesh = mesh(&[(ElementKind::Hex8, &one), (ElementKind::Hex8, &other)]);
        let boundary = Boundary3d::new(&mesh, 1e-6);
        let still = vec![[0.0; 3]; mesh.nodes.len()];
        let at = Configuration::new(&mesh.nodes, &still);
        let rigid: Vec<[f64; 3]> =
            mesh.nodes.iter().map(|x| add(&velocity, &cross(&spin, x))).collect();
        let mut used = ContactJacobian::default();
        for pair in all_pairs(&boundary).into_iter().step_by(7) {
            let projection = boundary.project(pair, at);
            if projection.outside > 1.0 {
                continue; // nearly parallel: no exact result
            }
            let jacobian = boundary.jacobian(pair, &anchor, at);
            // Nothing of the previous Jacobian in this storage remains.
            boundary.assemble_jacobian(&mut used, pair, &anchor, at, None);
            let of = |jacobian: &ContactJacobian<3>| {
                let rows = jacobian.rows[..jacobian.count].to_vec();
                (jacobian.nodes().to_vec(), rows, jacobian.frame, jacobian.offset)
            };
            prop_assert_eq!(of(&used), of(&jacobian));
            for r in 0..3 {
                // Round-off of some hundred operations on lengths of order 1, over the sine of the
                // angle between the edges.
                let relative = jacobian.relative_velocity(r, &rigid);
                prop_assert!(relative.abs() < 1e-10, "{pair:?} {relative}");
                let (mut momentum, mut drift_interval) = ([0.0; 3], [0.0; 3]);
                for (k, &node) in jacobian.nodes().iter().enumerate() {
                    let impulse = jacobian.rows[k][r];
                    add_scaled(&mut momentum, 1.0, &impulse);
                    add_scaled(&mut drift_interval, 1.0, &cross(&mesh.nodes[node as usize], &impulse));
                }
                prop_assert!(norm(&momentum) < 1e-12, "{pair:?} {momentum:?}");
                prop_assert!(norm(&drift_interval) < 1e-10, "{pair:?} {drift_interval:?}");
            }
        }
    }

    /// The length of [`CullingResult::ExcludedUntil`] shrinks by no more than the given rate.
    #[test]
    fn what_lacks_to_touch_stays_until_nodes_have_moved_far_enough(
        warp in proptest::array::uniform8(vector(0.1)),
        shift in vector(0.3),
        flat in 1e-2..1.0_f64,
        reach in 1e-6..1e-2_f64,
        ways in proptest::array::uniform16(vector(1.0)),
        of_one in 0.0..1.0_f64,
    ) {
        let tolerance = 1e-4;
        let squeeze = |[x, y, z]: [f64; 3]| [x, flat * y, z];
        let one = warped_cube([0.0; 3], &warp);
        let other = warped_cube(add(&[0.2, 0.1, 1.0], &shift), &warp);
        let [one, other] = [one, other].map(|cube| cube.into_iter().map(squeeze).collect::<Vec<_>>());
        let mesh = mesh(&[(ElementKind::Hex8, &one), (ElementKind::Hex8, &other)]);
        let boundary = Boundary3d::new(&mesh, tolerance);
        let still = vec![[0.0; 3]; 16];
        let at = Configuration::new(&mesh.nodes, &still);
        for pair in all_pairs(&boundary) {
            let CullingResult::ExcludedUntil(length) = boundary.cull(pair, at, reach, tolerance) else {
                continue;
            };
            if length <= reach {
                continue;
            }
            let way = (1.0 - 1e-9) * (length - reach) / CULLING_RATE;
            let moved: Vec<[f64; 3]> = (0..16).map(|node| {
                let own = if node < 8 { of_one } else { 1.0 - of_one };
                scale(own * way / norm(&ways[node]), &ways[node])
            }).collect();
            let then = Configuration::new(&mesh.nodes, &moved);
            let nearness = boundary.cull(pair, then, reach, tolerance);
            prop_assert!(nearness != CullingResult::Near, "{pair:?} {length:e}");
        }
    }

    /// The normal row is the rate of the gap at a closed pair.
    #[test]
    fn the_normal_row_is_the_rate_of_the_gap(
        warp in proptest::array::uniform8(vector(0.15)),
        shift in vector(0.3),
        rates in proptest::array::uniform16(vector(1.0)),
    ) {
        let one = warped_cube([0.0; 3], &warp);
        let mut other = warped_cube(add(&[0.4, 0.3, 1.0], &shift), &warp);
        let pairs = {
            let mesh = mesh(&[(ElementKind::Hex8, &one), (ElementKind::Hex8, &other)]);
            all_pairs(&Boundary3d::new(&mesh, 1e-6))
        };
        for pair in pairs.into_iter().step_by(11) {
            let close = |other: &[[f64; 3]]| {
                let mesh = mesh(&[(ElementKind::Hex8, &one), (ElementKind::Hex8, other)]);
                let boundary = Boundary3d::new(&mesh, 1e-6);
                let still = vec![[0.0; 3]; 16];
                let at = Configuration::new(&mesh.nodes, &still);
                let projection = boundary.project(pair, at);
                (projection, boundary.normal(pair, at), boundary.blocks(pair))
            };
            // The second block is moved until the gap of the pair is 0.
            let (projection, normal, blocks) = close(&other);
            let Some(normal) = normal.filter(|_| projection.outside < 1.0) else { continue };
            let sign = if blocks[0] == 1 { -1.0 } else { 1.0 };
            for node in &mut other {
                add_scaled(node, sign * projection.gap, &normal);
            }
            let mesh = mesh(&[(ElementKind::Hex8, &one), (ElementKind::Hex8, &other)]);
            let boundary = Boundary3d::new(&mesh, 1e-6);
            let still = vec![[0.0; 3]; 16];
            let at = Configuration::new(&mesh.nodes, &still);
            let foot = boundary.project(pair, at).foot;
            let row = boundary.jacobian(pair, &foot, at).relative_velocity(0, &rates);
            let step = 1e-6;
            let [ahead, back] = [step, -step].map(|t| {
                let then = at.after(&rates, t);
                (boundary.project(pair, then).gap, boundary.normal(pair, then))
            });
            // The normal of edges may reverse between the two times, if their faces do not tell
            // which side is outside.
            let steady = ahead.1.zip(back.1).is_some_and(|(a, b)| dot(&a, &b) > 0.0);
            if !steady {
                continue;
            }
            let [ahead, back] = [ahead.0, back.0];
            let slope = (ahead - back) / (2.0 * step);
            // Second derivatives of the gap over the sine of the angle between the edges.
            prop_assert!((row - slope).abs() < 1e-4 * (1.0 + slope.abs()), "{pair:?} {row} {slope}");
        }
    }
}

#[test]
fn a_quadrilateral_is_four_triangles_about_its_mean() {
    let cube = warped_cube([0.0; 3], &[[0.0; 3]; 8]);
    let mesh = mesh(&[(ElementKind::Hex8, &cube)]);
    let boundary = Boundary3d::new(&mesh, 1e-6);
    let still = vec![[0.0; 3]; 8];
    let at = Configuration::new(&mesh.nodes, &still);
    assert_eq!(boundary.triangulation.triangles.len(), 24);
    assert_eq!(boundary.triangulation.edges.len(), 12 + 24);
    let edges = 0..boundary.triangulation.edges.len() as u32;
    let sharp = edges.filter(|&edge| boundary.triangulation.is_sharp(edge, at));
    assert_eq!(sharp.count(), 12);
    for triangle in 0..24 {
        let centre = boundary.triangulation.triangle(triangle, at)[2];
        let out = sub(&centre, &[0.5; 3]);
        let normal = boundary.triangulation.normal(triangle, at);
        // The mean of a face of the unit cube lies half its edge from the centre.
        assert!(norm(&sub(&normal, &crate::math::vector::scale(2.0, &out))) < 1e-15);
    }
}

/// Closes touching pairs: the contacts of two blocks, each once.
fn contacts_of(boundary: &Boundary3d, at: Configuration<3>, tolerance: f64) -> Vec<Pair> {
    let mut contacts: Vec<Pair> = Vec::new();
    for pair in all_pairs(boundary) {
        let projection = boundary.project(pair, at);
        let touches = projection.gap.abs() <= tolerance && projection.outside <= tolerance;
        let counts = match boundary.feature_pair(pair) {
            FeaturePair::EdgeEdge { main, target } => [main, target]
                .iter()
                .all(|&edge| boundary.triangulation.is_sharp(edge, at)),
            FeaturePair::PointTriangle { .. } => true,
        };
        let known = |other: &Pair| boundary.same_contact(*other, pair, at, tolerance);
        if touches && counts && boundary.in_normal_cone(pair, at) && !contacts.iter().any(known) {
            contacts.push(pair);
        }
    }
    contacts
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// For two boxes in any position, with any divisions, the contacts of their faces share the
    /// area of the overlap.
    #[test]
    fn contacts_share_the_whole_area(
        shift in [-0.9..0.9_f64, -0.9..0.9_f64],
        angle in 0.0..3.0_f64,
        below in [1..4_usize, 1..4_usize],
        above in [1..4_usize, 1..4_usize],
        triangles in any::<bool>(),
    ) {
        let element = if triangles { ElementKind::Tet4 } else { ElementKind::Hex8 };
        let cube = |name: &str, low: f64, divisions: [usize; 2]| {
            let geometry = Geometry::Box {
                min: vec![-0.5, -0.5, low],
                max: vec![0.5, 0.5, low + 1.0],
                divisions: vec![divisions[0], divisions[1], 1],
                element,
            };
            mesh::tests::block(name, geometry)
        };
        let blocks = vec![cube("below", -1.0, below), cube("above", 0.0, above)];
        let mut mesh: Mesh<3> = mesh::tests::shapes(blocks).expect("boxes mesh");
        let (sine, cosine) = angle.sin_cos();
        for node in mesh.blocks[1].nodes.clone() {
            let [x, y, z] = mesh.nodes[node as usize];
            mesh.nodes[node as usize] =
                [cosine * x - sine * y + shift[0], sine * x + cosine * y + shift[1], z];
        }
        let still = vec![[0.0; 3]; mesh.nodes.len()];
        let at = Configuration::new(&mesh.nodes, &still);
        let boundary = Boundary3d::new(&mesh, 1e-6);
        let contacts = contacts_of(&boundary, at, 1e-6);
        let sum: f64 = contacts.iter().map(|&pair| boundary.classify(pair, at, 1e-6).1).sum();
        let corners = |number: usize| {
            let nodes = mesh.blocks[number].nodes.clone();
            let outer = nodes.filter(|&node| {
                let [x, y, z] = mesh.nodes[node as usize];
                let from = if number == 1 { [x - shift[0], y - shift[1]] } else { [x, y] };
                z == 0.0 && f64::hypot(from[0], from[1]) > 0.7
            });
            let mut outer: Vec<[f64; 2]> = outer
                .map(|node| [mesh.nodes[node as usize][0], mesh.nodes[node as usize][1]])
                .collect();
            let [mx, my] = if number == 1 { shift } else { [0.0; 2] };
            outer.sort_by(|a, b| {
                f64::atan2(a[1] - my, a[0] - mx).total_cmp(&f64::atan2(b[1] - my, b[0] - mx))
            });
            outer
        };
        let common = crate::contact::narrow_phase::tributary_area::common_area(&corners(0), &corners(1));
        // Pieces smaller than the tolerance have no corners of their own.
        prop_assert!((sum - common).abs() < 1e-5, "{sum} of {common}, {} contacts", contacts.len());
        let kinds = contacts.iter().map(|&pair| boundary.classify(pair, at, 1e-6).0);
        if common > 0.01 {
            for kind in kinds {
                prop_assert_eq!(kind, crate::contact::surface::contact_kind::ContactKind::FaceFace);
            }
        }
    }
}
