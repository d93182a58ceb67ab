//! Jacobians under rigid motion, culling, the geometry cache; meshes for other tests.

use proptest::prelude::*;
use rayon::prelude::*;

use crate::contact::surface::boundary_3d::{Boundary3d, FeaturePair};
use crate::contact::surface::{
    Configuration, ConstantMotion, ContactGeometry, ContactJacobian, Distance, GapAllowance,
    JacobianAnchor, Pair, TimeOfImpact, Topology,
};
use crate::contact::tolerances::{BOUND_SLACK, CULLING_RATE};
use crate::math::vector::{add, add_scaled, cross, dot, norm, scale, sub};
use crate::mesh::{Element, ElementKind, Mesh, MeshBlock};

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

impl Boundary3d {
    /// Returns the blocks of a pair: main and target.
    pub(crate) fn blocks(&self, pair: Pair) -> [u32; 2] {
        let of_edge = |edge: u32| {
            self.triangulation
                .block(self.triangulation.edges[edge as usize].ends[0])
        };
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { vertex, triangle } => {
                let corner = self.triangulation.triangles[triangle as usize].corners[0];
                [
                    self.triangulation.block(vertex),
                    self.triangulation.block(corner),
                ]
            }
            FeaturePair::EdgeEdge { main, target } => [of_edge(main), of_edge(target)],
        }
    }
}

/// All results for the pairs of a drift, as text: numbers with all their digits.
fn answers(boundary: &Boundary3d, at: Configuration<3>, velocity: &[[f64; 3]]) -> Vec<String> {
    let slack = GapAllowance {
        within: 1e-6,
        depth: 1e-8,
    };
    let motion = ConstantMotion { at, velocity };
    let ask = |pair: &Pair| {
        let pair = *pair;
        let place = (boundary.project(pair, at), boundary.distance(pair, at));
        let exclusion = boundary.exclusion(pair, at, 1e-4);
        let rests = boundary.stays_in_contact(pair, motion, 0.1, slack);
        let time = boundary.time_of_impact(pair, motion, 0.1, 1e-4);
        format!("{place:?} {exclusion:?} {rests} {time:?}")
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
            let place = JacobianAnchor { foot: &anchor, along: None };
            boundary.assemble_jacobian(&mut used, pair, place, at);
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

    /// The exclusion length changes by no more than the given rate, up to the jump at parallel edges.
    #[test]
    fn exclusion_lengths_change_no_faster_than_nodes_move(
        warp in proptest::array::uniform8(vector(0.1)),
        shift in vector(0.3),
        flat in 1e-2..1.0_f64,
        part in 1e-4..1e-2_f64,
        ways in proptest::array::uniform16(vector(1.0)),
        of_one in 0.0..1.0_f64,
    ) {
        let (resolution, way) = (1e-4, part * flat);
        let squeeze = |[x, y, z]: [f64; 3]| [x, flat * y, z];
        let one = warped_cube([0.0; 3], &warp);
        let other = warped_cube(add(&[0.2, 0.1, 1.0], &shift), &warp);
        let [one, other] = [one, other].map(|cube| cube.into_iter().map(squeeze).collect::<Vec<_>>());
        let mesh = mesh(&[(ElementKind::Hex8, &one), (ElementKind::Hex8, &other)]);
        let boundary = Boundary3d::new(&mesh, resolution);
        let still = vec![[0.0; 3]; 16];
        let at = Configuration::new(&mesh.nodes, &still);
        for pair in all_pairs(&boundary) {
            let length = boundary.exclusion(pair, at, resolution);
            let moved: Vec<[f64; 3]> = (0..16).map(|node| {
                let own = if node < 8 { of_one } else { 1.0 - of_one };
                scale(own * way / norm(&ways[node]), &ways[node])
            }).collect();
            let then = Configuration::new(&mesh.nodes, &moved);
            let changed = boundary.exclusion(pair, then, resolution) - length;
            let allowed = CULLING_RATE * way + BOUND_SLACK * resolution;
            prop_assert!(changed.abs() <= allowed, "{pair:?} {length:e} {changed:e}");
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
