//! Checks the invariants of a [`Mesh`] on which all other code relies.

use crate::mesh::{Facet, Mesh};

impl<const D: usize> Mesh<D> {
    /// Returns the first broken invariant of the mesh for a scene with `sources` blocks. A mesh
    /// read from files and [assembled](fn@crate::mesh::assemble) is sound.
    pub(crate) fn fault(&self, sources: usize) -> Option<&'static str> {
        let rules: [(bool, &'static str); 5] = [
            (
                self.has_blocks(sources),
                "its blocks do not cover it exactly once",
            ),
            (self.has_elements(), "elements have nodes of other blocks"),
            (
                self.nodes.iter().flatten().all(|x| x.is_finite()),
                "nodes have coordinates that are not finite",
            ),
            (self.has_groups(), "groups have nodes that do not exist"),
            (self.parts.is_none(), "it is refined already"),
        ];
        let broken = rules.into_iter().find(|(holds, _)| !holds);
        broken.map(|(_, what)| what)
    }

    /// True if nodes and elements belong to one block each and are in the order of the blocks.
    fn has_blocks(&self, sources: usize) -> bool {
        let (mut node, mut element) = (0, 0);
        let follow = self.blocks.iter().all(|block| {
            let starts = block.nodes.start == node && block.elements.start == element;
            (node, element) = (block.nodes.end, block.elements.end);
            starts
                && !block.nodes.is_empty()
                && !block.elements.is_empty()
                && block.source < sources
        });
        follow && (node as usize, element as usize) == (self.nodes.len(), self.elements.len())
    }

    fn has_elements(&self) -> bool {
        self.blocks.iter().all(|block| {
            let own = block.elements.start as usize..block.elements.end as usize;
            let own = self.elements.get(own).unwrap_or_default();
            own.iter().all(|element| {
                let mut nodes = element.nodes().iter();
                element.kind.dimension() == D && nodes.all(|node| block.nodes.contains(node))
            })
        })
    }

    fn has_groups(&self) -> bool {
        let node = |node: &u32| (*node as usize) < self.nodes.len();
        let element = |element: &u32| (*element as usize) < self.elements.len();
        let facet = |facet: &Facet| {
            let of = self.elements.get(facet.element as usize);
            of.is_some_and(|of| (facet.local as usize) < of.kind.facets().len())
        };
        self.groups.iter().all(|group| {
            let inside = &group.inside;
            group.nodes.iter().all(node)
                && group.facets.iter().chain(&inside.facets).all(facet)
                && inside.elements.iter().all(element)
                && inside.edges.iter().flatten().all(node)
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::mesh::{Element, ElementKind, Facet, Group, Mesh};

    /// Returns a mesh of two triangles; each is a block.
    fn mesh() -> Mesh<2> {
        let block = |name: &str, first: u32| crate::mesh::MeshBlock {
            name: name.to_owned(),
            source: 0,
            nodes: 3 * first..3 * first + 3,
            elements: first..first + 1,
        };
        let corner = |x: f64| [[x, 0.0], [x + 1.0, 0.0], [x, 1.0]];
        Mesh {
            nodes: [corner(0.0), corner(5.0)].concat(),
            elements: vec![
                Element::new(ElementKind::Tri3, &[0, 1, 2]),
                Element::new(ElementKind::Tri3, &[3, 4, 5]),
            ],
            blocks: vec![block("a", 0), block("b", 1)],
            groups: vec![Group {
                nodes: vec![0, 1],
                facets: vec![Facet {
                    element: 0,
                    local: 2,
                }],
                ..Group::default()
            }],
            ..Mesh::default()
        }
    }

    #[test]
    fn a_mesh_is_sound() {
        assert_eq!(mesh().fault(1), None);
    }

    #[test]
    fn what_is_no_mesh_is_found() {
        let breaks: [fn(&mut Mesh<2>); 9] = [
            |mesh| mesh.elements[1].nodes[0] = 2,
            |mesh| mesh.elements[0].kind = ElementKind::Tet4,
            |mesh| mesh.nodes[3][1] = f64::NAN,
            |mesh| mesh.nodes.truncate(5),
            |mesh| mesh.blocks[0].nodes.end = 2,
            |mesh| mesh.blocks[1].source = 1,
            |mesh| mesh.groups[0].nodes[1] = 6,
            |mesh| mesh.groups[0].facets[0].local = 3,
            |mesh| mesh.blocks.clear(),
        ];
        for (number, damage) in breaks.into_iter().enumerate() {
            let mut mesh = mesh();
            damage(&mut mesh);
            assert!(mesh.fault(1).is_some(), "{number}");
        }
    }
}
