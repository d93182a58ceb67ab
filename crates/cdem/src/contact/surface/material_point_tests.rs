//! Material points on a block with a crack: those on one lip are not found on the other.

use crate::contact::detection::candidates::Clusters;
use crate::contact::surface::Configuration;
use crate::mesh::{Element, ElementKind, Mesh, MeshBlock};
use crate::refinement::dimension::{PLANE, SOLID, Space};

/// Two cells beside each other, joined at the bottom alone, and one above them.
fn cracked<const D: usize>(kind: ElementKind) -> Mesh<D> {
    let below = 1 << D;
    let corner = |cell: usize, number: usize| -> [f64; D] {
        // Counter-clockwise in each layer, as the shapes require.
        let (plane, layer) = (number % 4, number / 4);
        let x = [0.0, 1.0, 1.0, 0.0][plane];
        let y = [0.0, 0.0, 1.0, 1.0][plane];
        let [dx, dy] = [[0.0, 0.0], [1.0, 0.0], [0.5, 1.5]][cell];
        let all = [x + dx, y + dy, layer as f64];
        std::array::from_fn(|c| all[c])
    };
    let mut nodes: Vec<[f64; D]> = Vec::new();
    let mut elements = Vec::new();
    for cell in 0..3 {
        let numbers: Vec<u32> = (0..below)
            .map(|number| {
                let place = corner(cell, number);
                let known = nodes.iter().position(|node| *node == place);
                let joined = known.filter(|_| cell == 1 && place[1] == 0.0);
                joined.unwrap_or_else(|| {
                    nodes.push(place);
                    nodes.len() - 1
                }) as u32
            })
            .collect();
        elements.push(Element::new(kind, &numbers));
    }
    let first = (nodes.len() - below) as u32;
    let block = |name: &str, nodes, elements| MeshBlock {
        name: name.to_owned(),
        source: 0,
        nodes,
        elements,
    };
    let blocks = vec![
        block("cracked", 0..first, 0..2),
        block("above", first..nodes.len() as u32, 2..3),
    ];
    Mesh {
        nodes,
        elements,
        blocks,
        ..Mesh::default()
    }
}

fn are_found_again<const D: usize>(space: Space<D>, kind: ElementKind) {
    const ALL: f64 = 10.0;
    let mesh = cracked::<D>(kind);
    let surface = (space.surface)(&mesh, 1.0, 1e-6);
    let block_of = |node: u32| u32::from(!mesh.blocks[0].nodes.contains(&node));
    let blocks: Vec<u32> = (0..mesh.nodes.len() as u32).map(block_of).collect();
    let still = vec![[0.0; D]; mesh.nodes.len()];
    let rest = Configuration::new(&mesh.nodes, &still);
    let clusters = Clusters::new(&*surface, &blocks, &mesh.nodes);
    let pairs = clusters.overlapping(&*surface, rest, &|_| ALL, &|[a, b]| a != b);
    assert!(pairs.len() > 8 * D);
    for pair in pairs {
        let marks = surface.material_points(pair, &[0.3, 0.3], rest);
        let of = |nodes: &[u32]| mesh.blocks[block_of(nodes[0]) as usize].nodes.clone();
        let nodes = [
            of(surface.main_nodes(pair.main)),
            of(surface.target_nodes(pair.target)),
        ];
        let found = surface.locate(&marks, nodes, rest);
        assert_eq!(found.map(|(pair, _)| pair), Some(pair), "{kind:?}");
    }
}

#[test]
fn lips_in_the_plane_are_told_apart() {
    are_found_again(PLANE, ElementKind::Quad4);
}

#[test]
fn lips_in_space_are_told_apart() {
    are_found_again(SOLID, ElementKind::Hex8);
}
