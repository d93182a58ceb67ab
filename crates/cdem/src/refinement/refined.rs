//! The mesh of all blocks, with overlays over some of them.

use super::overlay::Overlay;
use crate::mesh::{Block, Element, Facet, Group, Mesh};

/// A mesh like any other, and where it has come from. The nodes of a block that the base
/// mesh has come first and in the same order, then the new ones; so its elements.
#[derive(Clone, Debug)]
pub(crate) struct Refined<const D: usize> {
    pub(crate) mesh: Mesh<D>,
    /// The element of the base mesh that each element was, or is a part of.
    pub(crate) root: Vec<u32>,
    /// Share of its volume that each element stands for.
    pub(crate) weight: Vec<f64>,
}

impl<const D: usize> Refined<D> {
    /// `base` with an overlay over each block that has one.
    pub(crate) fn new(base: &Mesh<D>, overlays: &[Option<Overlay<D>>]) -> Self {
        let mut refined = Self {
            mesh: Mesh {
                notes: base.notes.clone(),
                ..Mesh::default()
            },
            root: Vec::new(),
            weight: Vec::new(),
        };
        let mut kept = vec![u32::MAX; base.elements.len()];
        for (block, overlay) in base.blocks.iter().zip(overlays) {
            refined.add_block(base, block, overlay.as_ref(), &mut kept);
        }
        let groups = base.groups.iter();
        let groups = groups.map(|group| refined.group(base, overlays, group, &kept));
        refined.mesh.groups = groups.collect();
        refined
    }

    /// Adds a block; elements that it keeps get their numbers in `kept`.
    fn add_block(
        &mut self,
        base: &Mesh<D>,
        block: &Block,
        overlay: Option<&Overlay<D>>,
        kept: &mut [u32],
    ) {
        let mesh = &mut self.mesh;
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
            let replaced = |overlay: &Overlay<D>| overlay.replaced.binary_search(&number).is_ok();
            if overlay.is_some_and(replaced) {
                continue;
            }
            kept[number as usize] = mesh.elements.len() as u32;
            let element = &base.elements[number as usize];
            mesh.elements.push(renumbered(element, block.nodes.start));
            self.root.push(number);
            self.weight.push(1.0);
        }
        for sub in overlay.iter().flat_map(|overlay| &overlay.elements) {
            mesh.elements.push(renumbered(&sub.element, 0));
            self.root.push(sub.root);
            self.weight.push(sub.weight);
        }
        mesh.blocks.push(Block {
            nodes: first[0]..mesh.nodes.len() as u32,
            elements: first[1]..mesh.elements.len() as u32,
            ..block.clone()
        });
    }

    /// A group as it is now: new nodes and facets on its facets belong to it.
    fn group(
        &self,
        base: &Mesh<D>,
        overlays: &[Option<Overlay<D>>],
        group: &Group,
        kept: &[u32],
    ) -> Group {
        let block_of = |node: u32| base.blocks.partition_point(|block| block.nodes.end <= node);
        let now = |node: u32| {
            let block = block_of(node);
            node - base.blocks[block].nodes.start + self.mesh.blocks[block].nodes.start
        };
        let mut nodes: Vec<u32> = group.nodes.iter().map(|&node| now(node)).collect();
        let mut facets = Vec::new();
        for &facet in &group.facets {
            let element = kept[facet.element as usize];
            if element != u32::MAX {
                facets.push(Facet { element, ..facet });
            }
            let corners: Vec<u32> = base.facet_nodes(facet).collect();
            let block = block_of(corners[0]);
            let Some(overlay) = &overlays[block] else {
                continue;
            };
            let start = base.blocks[block].nodes.start;
            let corners: Vec<u32> = corners.iter().map(|node| node - start).collect();
            let lies = overlay.on_facet(&corners);
            let Block {
                nodes: all,
                elements,
                ..
            } = &self.mesh.blocks[block];
            let on_it = |node: u32| lies[(node - all.start) as usize];
            nodes.extend(all.clone().filter(|&node| on_it(node)));
            let parts = elements
                .clone()
                .filter(|&e| self.root[e as usize] == facet.element);
            for part in parts.filter(|_| element == u32::MAX) {
                let of = (0..).zip(self.mesh.elements[part as usize].kind.facets());
                let of = of.map(|(local, _)| Facet {
                    element: part,
                    local,
                });
                facets.extend(of.filter(|&f| self.mesh.facet_nodes(f).all(on_it)));
            }
        }
        nodes.sort_unstable();
        nodes.dedup();
        facets.sort_unstable();
        Group {
            nodes,
            facets,
            ..group.clone()
        }
    }
}
