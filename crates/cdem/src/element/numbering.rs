//! Set and set index of each element of the mesh.

use crate::element::ElementSet;

/// Set of each element of a mesh, and its index in the set.
#[derive(Debug, Default)]
pub(crate) enum ElementNumbering {
    /// One set with all elements in their order.
    #[default]
    Alike,
    /// Several sets.
    Each(Vec<(u32, u32)>),
}

impl ElementNumbering {
    /// Numbers the `count` elements of a mesh in these sets.
    pub(crate) fn new<const D: usize>(sets: &[Box<dyn ElementSet<D>>], count: usize) -> Self {
        if let [set] = sets {
            debug_assert!((0..count as u32).eq(set.mesh_elements().iter().copied()));
            return Self::Alike;
        }
        let mut places = vec![(0, 0); count];
        for (number, set) in sets.iter().enumerate() {
            for (i, &element) in set.mesh_elements().iter().enumerate() {
                places[element as usize] = (number as u32, i as u32);
            }
        }
        Self::Each(places)
    }

    /// Returns the set of an element and its index in the set.
    pub(crate) fn of(&self, element: usize) -> (usize, usize) {
        match self {
            Self::Alike => (0, element),
            Self::Each(places) => {
                let (set, i) = places[element];
                (set as usize, i as usize)
            }
        }
    }
}
