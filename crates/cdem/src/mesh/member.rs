//! Members of the groups.

use std::collections::BTreeMap;

use crate::mesh::assemble::BlockPart;
use crate::mesh::source::{MeshSource, extent_name};
use crate::mesh::{Facet, Group, Mesh};

/// Members of the groups of all sources, by source and raw group.
#[derive(Default)]
pub(super) struct Members {
    of: BTreeMap<(usize, u32), Group>,
}

impl Members {
    /// Adds the members of a part to the groups of its source, with the numbers that they will have
    /// at the end of `mesh`.
    pub(super) fn add<const D: usize>(
        &mut self,
        number: usize,
        source: &MeshSource,
        part: &BlockPart<D>,
        mesh: &Mesh<D>,
    ) {
        if source.raw.groups.is_empty() {
            return;
        }
        let first_node = mesh.nodes.len() as u32;
        let first_element = mesh.elements.len() as u32;
        let mut boundary = part.boundary.iter().copied().peekable();
        for (index, element) in (0..).zip(&part.elements) {
            let of_element = &source.raw.group_sets[part.sets[index as usize] as usize];
            for &group in of_element {
                let members = self.of.entry((number, group)).or_default();
                let nodes = element.nodes().iter();
                members.nodes.extend(nodes.map(|n| n + first_node));
                members.inside.elements.push(index + first_element);
            }
            for (local, corners) in (0..).zip(element.kind.facets()) {
                let free = boundary
                    .next_if_eq(&Facet {
                        element: index,
                        local,
                    })
                    .is_some();
                let facet = Facet {
                    element: index + first_element,
                    local,
                };
                if free {
                    for &group in of_element {
                        let members = self.of.entry((number, group)).or_default();
                        members.facets.push(facet);
                    }
                }
                let nodes = corners.iter().map(|&c| element.nodes[c as usize]);
                let points = nodes.clone().map(|n| part.points[n as usize]);
                for group in source.facet_groups(points) {
                    let members = self.of.entry((number, group)).or_default();
                    members.nodes.extend(nodes.clone().map(|n| n + first_node));
                    let facets = match free {
                        true => &mut members.facets,
                        false => &mut members.inside.facets,
                    };
                    facets.push(facet);
                }
            }
        }
        for (node, &point) in (first_node..).zip(&part.points) {
            for group in source.point_groups(point) {
                self.of.entry((number, group)).or_default().nodes.push(node);
            }
        }
        self.add_curves(number, source, &part.points, first_node);
    }

    /// Adds the edges of curves in 3-D between `points`; node numbers start at `first`.
    fn add_curves(&mut self, number: usize, source: &MeshSource, points: &[u32], first: u32) {
        if !source.has_curves() {
            return;
        }
        let node_at: BTreeMap<u32, u32> = points.iter().copied().zip(first..).collect();
        for (&point, &node) in &node_at {
            for (other, group) in source.curves_from(point) {
                if let Some(&other) = node_at.get(&other) {
                    let members = self.of.entry((number, group)).or_default();
                    let edge = [node.min(other), node.max(other)];
                    members.inside.edges.push(edge);
                }
            }
        }
    }

    /// Returns the groups, sorted by name. Groups of one source with equal name and dimension are
    /// merged.
    pub(super) fn finish(mut self, sources: &[MeshSource]) -> Vec<Group> {
        let mut groups = Vec::new();
        for (number, source) in sources.iter().enumerate() {
            for ((name, dimension), raw) in source.group_names() {
                let mut group = Group {
                    name: name.to_owned(),
                    origin: format!("{} of {}", extent_name(dimension), source.raw.origin),
                    ..Group::default()
                };
                for index in raw {
                    let members = self.of.remove(&(number, index)).unwrap_or_default();
                    group.nodes.extend(members.nodes);
                    group.facets.extend(members.facets);
                    let inside = &mut group.inside;
                    inside.elements.extend(members.inside.elements);
                    inside.facets.extend(members.inside.facets);
                    inside.edges.extend(members.inside.edges);
                }
                group.nodes.sort_unstable();
                group.nodes.dedup();
                group.facets.sort_unstable();
                group.facets.dedup();
                groups.push(group);
            }
        }
        groups.sort_by(|a, b| a.name.cmp(&b.name));
        groups
    }
}
