//! Sharp edges, and the motion until the others become sharp.

use proptest::prelude::*;

use crate::contact::surface::Configuration;
use crate::contact::surface::boundary_3d::Boundary3d;
use crate::contact::surface::boundary_3d::tests::{mesh, vector, warped_cube};
use crate::math::vector::{add, norm, scale};
use crate::mesh::{self, ElementKind};
use crate::scene::Geometry;

proptest! {
    /// The bound holds for random motion and for the worst motion of all nodes: the ends of an edge
    /// move out of the block, the far corners beside it into it.
    #[test]
    fn no_edge_is_sharp_before_its_nodes_have_moved_far_enough(
        warp in proptest::array::uniform8(vector(1e-2)),
        flat in 1e-3..1.0_f64,
        resolution in 1e-4..0.1_f64,
        length in 0.0..2.0_f64,
        share in 0.0..1.0_f64,
        ways in proptest::array::uniform8(vector(1.0)),
    ) {
        let squeeze = |[x, y, z]: [f64; 3]| [x, flat * y, z];
        // Diagonals of faces and their ends are nodes of the mesh, so the worst motion is possible.
        let cube = Geometry::Box {
            min: vec![0.0; 3],
            max: vec![1.0; 3],
            divisions: vec![1; 3],
            element: ElementKind::Tet4,
        };
        let mut mesh = mesh::tests::shapes(vec![mesh::tests::block("cube", cube)]).expect("meshes");
        for (node, warp) in mesh.nodes.iter_mut().zip(&warp) {
            *node = squeeze(add(node, warp));
        }
        let boundary = Boundary3d::new(&mesh, resolution * flat);
        let still = vec![[0.0; 3]; 8];
        let at = Configuration::new(&mesh.nodes, &still);
        for edge in 0..boundary.triangulation.edges.len() as u32 {
            let way = boundary.triangulation.sharpens_after(edge, length, at);
            if way <= 0.0 {
                continue;
            }
            prop_assert!(!boundary.triangulation.is_sharp_under(edge, length, at));
            let outward = boundary.triangulation.outward(edge, at);
            let ends = boundary.triangulation.edges[edge as usize].ends;
            let worst = |node: u32| {
                let sign = if ends.contains(&node) { 1.0 } else { -1.0 };
                scale(sign * way / norm(&outward), &outward)
            };
            let random = |node: u32| {
                let along = &ways[node as usize];
                scale(share * way / norm(along), along)
            };
            for moved in [(0..8).map(worst).collect::<Vec<_>>(), (0..8).map(random).collect()] {
                let then = Configuration::new(&mesh.nodes, &moved);
                prop_assert!(!boundary.triangulation.is_sharp_under(edge, length + 2.0 * way, then));
            }
        }
    }

    /// The test without a root calls no sharp edge flat. It calls every edge flat that turns by
    /// less than 0.09 rad and has at most a third of the height of a sharp one.
    #[test]
    fn what_is_flat_at_a_glance_is_not_sharp(
        warp in proptest::array::uniform8(vector(1.0)),
        size in (-8.0..-0.5_f64).prop_map(|power| 10.0_f64.powf(power)),
        flat in 1e-3..1.0_f64,
        resolution in (-6.0..-1.0_f64).prop_map(|power| 10.0_f64.powf(power)),
        length in 0.0..2.0_f64,
    ) {
        let warp: [[f64; 3]; 8] = std::array::from_fn(|k| scale(size, &warp[k]));
        let cube = warped_cube([0.0; 3], &warp).into_iter();
        let cube: Vec<[f64; 3]> = cube.map(|[x, y, z]| [x, flat * y, z]).collect();
        let mesh = mesh(&[(ElementKind::Hex8, &cube)]);
        let boundary = Boundary3d::new(&mesh, resolution);
        let still = vec![[0.0; 3]; 8];
        let at = Configuration::new(&mesh.nodes, &still);
        let strict = Boundary3d::new(&mesh, resolution / 3.0);
        for edge in 0..boundary.triangulation.edges.len() as u32 {
            let is_flat = boundary.triangulation.is_flat_under(edge, length, at);
            prop_assert!(!(is_flat && boundary.triangulation.is_sharp_under(edge, length, at)));
            let turns_little = boundary.triangulation.turn(edge, at).abs() < 0.09;
            prop_assert!(
                is_flat || !turns_little || strict.triangulation.is_sharp_under(edge, length, at)
            );
        }
    }
}
