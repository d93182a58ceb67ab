//! Which element of which set an element of the mesh is.

use crate::element::ElementSet;

/// Set of each element of a mesh, and number within it.
#[derive(Debug, Default)]
pub(crate) enum ElementNumbering {
    /// There is one set, with all elements in their order.
    #[default]
    Alike,
    /// There are several.
    Each(Vec<(u32, u32)>),
}

impl ElementNumbering {
    /// Of the elements of a mesh, so many, in these sets.
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

    /// Of an element.
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
