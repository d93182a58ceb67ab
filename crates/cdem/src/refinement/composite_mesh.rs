//! The composite mesh of all blocks, with overlays over some of them.

use std::collections::HashSet;
use std::ops::Range;

use crate::mesh::{Element, ElementOrigins, Facet, Group, GroupInterior, Known, Mesh, MeshBlock};
use crate::refinement::overlay::Overlay;

/// Maps facets of the base mesh to the composite mesh.
struct Facets<'a, const D: usize> {
    base: &'a Mesh<D>,
    overlays: &'a [Option<&'a Overlay<D>>],
    mesh: &'a Mesh<D>,
    /// Elements in place of each element of the base mesh.
    of: &'a [Range<u32>],
}

/// Returns `base` with an overlay over each block that has one, as an ordinary mesh. The base nodes
/// of a block come first and in the same order, then the new ones. Elements have the same order.
pub(crate) fn refined<const D: usize>(base: &Mesh<D>, overlays: &[Option<&Overlay<D>>]) -> Mesh<D> {
    let mut making = CompositeMesh {
        mesh: Mesh {
            notes: base.notes.clone(),
            ..Mesh::default()
        },
        parts: ElementOrigins::default(),
        of: vec![0..0; base.elements.len()],
        first: 0,
    };
    for (block, overlay) in base.blocks.iter().zip(overlays) {
        making.add_block(base, block, *overlay);
    }
    let CompositeMesh {
        mut mesh,
        parts,
        of,
        ..
    } = making;
    let facets = Facets {
        base,
        overlays,
        mesh: &mesh,
        of: &of,
    };
    let groups = base
        .groups
        .iter()
        .map(|group| facets.group(group))
        .collect();
    let boundary = facets.all(&base.boundary_facets());
    mesh.groups = groups;
    mesh.boundary = Known(Some(boundary));
    let is_refined = overlays.iter().any(Option::is_some);
    mesh.parts = is_refined.then_some(parts);
    mesh
}

/// Returns the mesh of one block alone, with its overlay, if any.
pub(super) fn of_block<const D: usize>(
    base: &Mesh<D>,
    block: usize,
    overlay: Option<&Overlay<D>>,
) -> Mesh<D> {
    let mut making = CompositeMesh {
        mesh: Mesh::default(),
        parts: ElementOrigins::default(),
        of: vec![0..0; base.blocks[block].elements.len()],
        first: base.blocks[block].elements.start,
    };
    making.add_block(base, &base.blocks[block], overlay);
    Mesh {
        parts: Some(making.parts),
        ..making.mesh
    }
}

/// A composite mesh under construction.
struct CompositeMesh<const D: usize> {
    mesh: Mesh<D>,
    parts: ElementOrigins,
    /// Elements in place of each element of the base mesh, beginning with `first`.
    of: Vec<Range<u32>>,
    first: u32,
}

impl<const D: usize> CompositeMesh<D> {
    fn add_block(&mut self, base: &Mesh<D>, block: &MeshBlock, overlay: Option<&Overlay<D>>) {
        let (mesh, parts, of) = (&mut self.mesh, &mut self.parts, &mut self.of);
        let first = [mesh.nodes.len() as u32, mesh.elements.len() as u32];
        let renumbered = |element: &Element, from: u32| {
            let nodes: Vec<u32> = element
                .nodes()
                .iter()
                .map(|n| n - from + first[0])
                .collect();
            Element::new(element.kind, &nodes)
        };
        match overlay {
            Some(overlay) => mesh.nodes.extend(&overlay.points),
            None => {
                let nodes = block.nodes.start as usize..block.nodes.end as usize;
                mesh.nodes.extend(&base.nodes[nodes]);
            }
        }
        for number in block.elements.clone() {
            if overlay.is_some_and(|overlay| overlay.replaces(number)) {
                continue;
            }
            let now = mesh.elements.len() as u32;
            of[(number - self.first) as usize] = now..now + 1;
            let element = &base.elements[number as usize];
            mesh.elements.push(renumbered(element, block.nodes.start));
            parts.root.push(number);
            parts.weight.push(1.0);
            parts.halvings.push(0);
        }
        for sub in overlay.iter().flat_map(|overlay| &overlay.elements) {
            let now = mesh.elements.len() as u32;
            let of = &mut of[(sub.root - self.first) as usize];
            of.start = if of.end == 0 { now } else { of.start };
            of.end = now + 1;
            mesh.elements.push(renumbered(&sub.element, 0));
            parts.root.push(sub.root);
            parts.weight.push(sub.weight);
            parts.halvings.push(sub.halvings);
        }
        mesh.blocks.push(MeshBlock {
            nodes: first[0]..mesh.nodes.len() as u32,
            elements: first[1]..mesh.elements.len() as u32,
            ..block.clone()
        });
    }
}

impl<const D: usize> Facets<'_, D> {
    fn block_of(&self, node: u32) -> usize {
        let blocks = &self.base.blocks;
        blocks.partition_point(|block| block.nodes.end <= node)
    }

    /// Returns a group on the composite mesh: new nodes in its elements, on its facets and on its
    /// edges belong to it, and new facets on its facets.
    fn group(&self, group: &Group) -> Group {
        let now = |&node: &u32| {
            let block = self.block_of(node);
            node - self.base.blocks[block].nodes.start + self.mesh.blocks[block].nodes.start
        };
        let inside = &group.inside;
        let facets = self.all(&group.facets);
        let of_facets = facets.iter().copied().chain(self.all(&inside.facets));
        let elements = inside.elements.iter();
        let elements = elements.flat_map(|&element| self.of[element as usize].clone());
        let of_element = |element: u32| self.mesh.elements[element as usize].nodes();
        let mut nodes: Vec<u32> = group.nodes.iter().map(now).collect();
        nodes.extend(of_facets.flat_map(|facet| self.mesh.facet_nodes(facet)));
        nodes.extend(elements.flat_map(of_element));
        nodes.extend(self.on_edges(&inside.edges));
        nodes.sort_unstable();
        nodes.dedup();
        Group {
            name: group.name.clone(),
            origin: group.origin.clone(),
            nodes,
            facets,
            inside: GroupInterior::default(),
        }
    }

    /// Returns the new nodes on edges of the base mesh.
    fn on_edges(&self, edges: &[[u32; 2]]) -> Vec<u32> {
        let edges: HashSet<[u32; 2]> = edges.iter().copied().collect();
        let mut nodes = Vec::new();
        if edges.is_empty() {
            return nodes;
        }
        let blocks = self.base.blocks.iter().zip(&self.mesh.blocks);
        for ((base, block), overlay) in blocks.zip(self.overlays) {
            let Some(overlay) = overlay else { continue };
            let first = block.nodes.start + overlay.base_count as u32;
            for (node, hull) in (first..).zip(&overlay.hulls) {
                if let &[a, b] = hull.as_slice()
                    && edges.contains(&[a, b].map(|node| node + base.nodes.start))
                {
                    nodes.push(node);
                }
            }
        }
        nodes
    }

    /// Returns the facets in place of these facets of the base mesh, sorted.
    fn all(&self, of: &[Facet]) -> Vec<Facet> {
        let mut facets = Vec::with_capacity(of.len());
        for &facet in of {
            self.add(facet, &mut facets);
        }
        facets.sort_unstable();
        facets
    }

    /// Adds the facets in place of a facet of the base mesh.
    fn add(&self, facet: Facet, facets: &mut Vec<Facet>) {
        let corners: Vec<u32> = self.base.facet_nodes(facet).collect();
        let block = self.block_of(corners[0]);
        let parts = self.of[facet.element as usize].clone();
        let Some(overlay) = self.overlays[block].filter(|o| o.replaces(facet.element)) else {
            let element = parts.start;
            facets.push(Facet { element, ..facet });
            return;
        };
        let start = self.base.blocks[block].nodes.start;
        let corners: Vec<u32> = corners.iter().map(|node| node - start).collect();
        let first = self.mesh.blocks[block].nodes.start;
        for element in parts {
            let shape = &self.mesh.elements[element as usize];
            for (local, nodes) in (0..).zip(shape.kind.facets()) {
                let mut nodes = nodes.iter().map(|&i| shape.nodes[i as usize] - first);
                if nodes.all(|node| overlay.lies_on(node, &corners)) {
                    facets.push(Facet { element, local });
                }
            }
        }
    }
}
