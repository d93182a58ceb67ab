//! Who belongs to which group.

use std::collections::BTreeMap;

use super::assemble::Part;
use super::source::{Source, extent_name};
use super::{Facet, Group, Mesh};

/// Members of the groups of all sources, by source and raw group.
#[derive(Default)]
pub(super) struct Members {
    of: BTreeMap<(usize, u32), (Vec<u32>, Vec<Facet>)>,
}

impl Members {
    /// Adds what a part has of the groups of its source, numbered as it will
    /// be at the end of `mesh`.
    pub(super) fn add<const D: usize>(
        &mut self,
        number: usize,
        source: &Source,
        part: &Part<D>,
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
                let (nodes, _) = self.of.entry((number, group)).or_default();
                nodes.extend(element.nodes().iter().map(|n| n + first_node));
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
                        self.of.entry((number, group)).or_default().1.push(facet);
                    }
                }
                let nodes = corners.iter().map(|&c| element.nodes[c as usize]);
                let points = nodes.clone().map(|n| part.points[n as usize]);
                for group in source.facet_groups(points) {
                    let (members, facets) = self.of.entry((number, group)).or_default();
                    members.extend(nodes.clone().map(|n| n + first_node));
                    facets.extend(free.then_some(facet));
                }
            }
        }
        for (node, &point) in (first_node..).zip(&part.points) {
            for group in source.point_groups(point) {
                self.of.entry((number, group)).or_default().0.push(node);
            }
        }
    }

    /// The groups, sorted by name; those of one name and dimension in one
    /// source are one.
    pub(super) fn finish(mut self, sources: &[Source]) -> Vec<Group> {
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
                    group.nodes.extend(members.0);
                    group.facets.extend(members.1);
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
