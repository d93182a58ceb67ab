//! Tests of [`Topology`](crate::contact::surface::Topology).

use super::{FLAT, ROOF, keel, over_roof_2d, over_roof_3d, pair, plane, space, tip_2d, tip_3d};
use crate::contact::surface::{Configuration, Pair, Topology};

#[test]
fn in_the_plane_features_are_vertices_and_edges() {
    let (_, boundary) = over_roof_2d(ROOF, tip_2d([0.0, 1.0]));
    // Four edges of the roof, without the one between its elements, and three of the tip.
    assert_eq!(boundary.families(), [[0..7, 0..7]]);
    assert_eq!(boundary.main_nodes(plane::TIP), [plane::TIP]);
    let side = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE).target;
    // The block lies to the left of its edge.
    assert_eq!(boundary.target_nodes(side), plane::RIGHT_SIDE);
}

#[test]
fn in_space_features_are_vertices_and_triangles_and_edges() {
    let (_, boundary) = over_roof_3d(ROOF, tip_3d([0.0, 0.0, 1.0]));
    // Six triangles of the roof and four of the tip; nine edges of the roof and six of the tip.
    assert_eq!(boundary.families(), [[0..9, 0..10], [9..24, 10..25]]);
    assert_eq!(boundary.main_nodes(space::TIP), [space::TIP]);
    let side = pair(&boundary, &[space::TIP], &space::SIDE).target;
    let mut nodes = boundary.target_nodes(side).to_vec();
    nodes.sort_unstable();
    assert_eq!(nodes, space::SIDE);
}

#[test]
fn an_edge_in_space_is_a_main_and_a_target() {
    let (_, boundary) = over_roof_3d(ROOF, keel([0.0, 0.0, 1.0]));
    let edges = pair(&boundary, &space::RIDGE, &space::KEEL);
    assert_eq!(boundary.main_nodes(edges.main), space::RIDGE);
    assert_eq!(boundary.target_nodes(edges.target), space::KEEL);
}

#[test]
fn boxes_in_the_plane_hold_the_nodes_and_the_margin() {
    let (mesh, boundary) = over_roof_2d(ROOF, tip_2d([1.0, 2.0]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE);
    let main = boundary.main_box(pair.main, at, 0.5);
    assert_eq!([main.min, main.max], [[0.5, 1.5], [1.5, 2.5]]);
    let target = boundary.target_box(pair.target, at, 0.5);
    assert_eq!([target.min, target.max], [[-0.5, -3.5], [4.5, 0.5]]);
}

#[test]
fn boxes_in_space_hold_the_nodes_and_the_margin() {
    let (mesh, boundary) = over_roof_3d(ROOF, tip_3d([1.0, 2.0, 3.0]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[space::TIP], &space::SIDE);
    let main = boundary.main_box(pair.main, at, 0.5);
    assert_eq!([main.min, main.max], [[0.5, 1.5, 2.5], [1.5, 2.5, 3.5]]);
    let target = boundary.target_box(pair.target, at, 0.5);
    let expected = [[-1.5, -0.5, -3.5], [3.5, 4.5, 0.5]];
    assert_eq!([target.min, target.max], expected);
}

#[test]
fn the_box_of_an_edge_is_empty_if_a_flat_edge_stays_so() {
    for (height, is_empty) in [(ROOF, false), (super::VALLEY, true)] {
        let (mesh, boundary) = over_roof_3d(height, keel([0.0, 0.0, 1.0]));
        let at = Configuration::at_rest(&mesh.nodes);
        let ridge = pair(&boundary, &space::RIDGE, &space::KEEL).main;
        assert_eq!(boundary.main_box(ridge, at, 0.0).is_empty(), is_empty);
    }
}

#[test]
fn every_pair_in_the_plane_is_canonical() {
    let (_, boundary) = over_roof_2d(ROOF, tip_2d([0.0, 1.0]));
    let sides = [&plane::RIGHT_SIDE, &plane::LEFT_SIDE];
    let pairs = sides.map(|side| pair(&boundary, &[plane::TIP], side));
    assert_eq!(pairs.map(|pair| boundary.is_canonical(pair)), [true; 2]);
}

#[test]
fn one_order_of_two_edges_is_canonical() {
    let (_, boundary) = over_roof_3d(ROOF, keel([0.0, 0.0, 1.0]));
    let one = pair(&boundary, &space::RIDGE, &space::KEEL);
    let other = pair(&boundary, &space::KEEL, &space::RIDGE);
    let vertex = pair(&boundary, &space::KEEL[..1], &space::SIDE);
    let canonical = [one, other, vertex].map(|pair| boundary.is_canonical(pair));
    assert_eq!(canonical, [true, false, true]);
    let edge = |pair: Pair| pair.main - boundary.families()[1][0].start;
    assert!(edge(one) < edge(other));
}

#[test]
fn the_plane_needs_no_geometry_cache() {
    let (_, boundary) = over_roof_2d(ROOF, tip_2d([0.0, 1.0]));
    assert!(boundary.geometry_cache(usize::MAX, None).is_none());
}

#[test]
fn a_geometry_cache_in_space_pays_for_many_pairs_or_if_there_is_one() {
    let (mesh, boundary) = over_roof_3d(FLAT, tip_3d([0.0, 1.0, 0.25]));
    // A third of ten triangles.
    assert!(boundary.geometry_cache(3, None).is_none());
    let cache = boundary.geometry_cache(4, None);
    assert!(cache.is_some());
    // An old cache holds nothing of the positions before.
    let at_rest = Configuration::at_rest(&mesh.nodes).with(cache.as_ref());
    assert_eq!(boundary.main_box(5, at_rest, 0.0).min, [0.0, 1.0, 0.25]);
    let displacement = vec![[0.0, 0.0, 1.0]; mesh.nodes.len()];
    let cache = boundary.geometry_cache(0, cache);
    assert!(cache.is_some());
    let moved = Configuration::new(&mesh.nodes, &displacement).with(cache.as_ref());
    assert_eq!(boundary.main_box(5, moved, 0.0).min, [0.0, 1.0, 1.25]);
}
