//! Notes on the meshes of blocks: one note for all blocks of which the same is to be told.

use crate::math::format::named_blocks;
use crate::mesh::error::coordinates;

/// Notes for the user on the meshes of all blocks.
#[derive(Debug, Default)]
pub(super) struct BlockNotes {
    turned: Finding,
    coincident: Finding,
    unjoined: Finding,
}

/// The same finding in the meshes of some blocks.
#[derive(Debug, Default)]
struct Finding {
    /// Names of the blocks.
    blocks: Vec<String>,
    /// Number of its places in all of them.
    count: usize,
    /// Number of elements of all of them, where it matters.
    elements: usize,
    /// Coordinates of the first place, m.
    first: String,
}

impl Finding {
    fn add<const D: usize>(&mut self, block: &str, places: &[[f64; D]]) {
        let Some(first) = places.first() else {
            return;
        };
        if self.blocks.is_empty() {
            self.first = coordinates(first);
        }
        self.blocks.push(block.to_owned());
        self.count += places.len();
    }

    /// Returns the note, if there is a block with this finding.
    fn note(&self, text: impl FnOnce(&Self) -> String) -> Option<String> {
        let names: Vec<_> = self.blocks.iter().map(String::as_str).collect();
        (!names.is_empty()).then(|| format!("{}: {}", named_blocks(&names), text(self)))
    }
}

impl BlockNotes {
    /// Adds a block in which `turned` of `elements` elements were numbered in reverse.
    pub(super) fn turned(&mut self, block: &str, [turned, elements]: [usize; 2]) {
        self.turned.blocks.push(block.to_owned());
        self.turned.count += turned;
        self.turned.elements += elements;
    }

    /// Adds the pairs of nodes at one place in a block.
    pub(super) fn coincident<const D: usize>(&mut self, block: &str, places: &[[f64; D]]) {
        self.coincident.add(block, places);
    }

    /// Adds the nodes of a block that lie on facets without being joined to them.
    pub(super) fn unjoined<const D: usize>(&mut self, block: &str, places: &[[f64; D]]) {
        self.unjoined.add(block, places);
    }

    /// Returns the notes in `dimension` dimensions.
    pub(super) fn finish(self, dimension: usize) -> impl Iterator<Item = String> {
        let turned = self.turned.note(|found| {
            format!(
                "{} of {} elements were numbered the wrong way round and have been turned",
                found.count, found.elements
            )
        });
        let coincident = self.coincident.note(|found| {
            format!(
                "{} pairs of boundary nodes lie at the same place without being joined, the first \
                 at {}; unless cracks are meant, use Coherence Mesh in Gmsh",
                found.count, found.first
            )
        });
        let (facets, what) = match dimension {
            2 => ("edges", "nodes"),
            _ => ("faces", "nodes or faces"),
        };
        let unjoined = self.unjoined.note(|found| {
            let gape = match found.blocks.len() {
                1 => "the block gapes there as it deforms",
                _ => "the blocks gape there as they deform",
            };
            format!(
                "{what} that lie on {facets} of elements without being joined to them: {}, the \
                 first at {}; {gape}; make neighbours share whole {facets}",
                found.count, found.first
            )
        });
        [turned, coincident, unjoined].into_iter().flatten()
    }
}
