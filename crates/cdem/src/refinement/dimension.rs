//! What differs between the plane and space.

use crate::contact::{MakeSurface, plane_surface, solid_surface};
use crate::refinement::{MakeOverlay, plane_overlay, solid_overlay};

/// How surfaces and overlays are made.
#[derive(Clone, Copy)]
pub(crate) struct Space<const D: usize> {
    pub(crate) surface: MakeSurface<D>,
    pub(crate) overlay: MakeOverlay<D>,
}

/// The plane: outlines of edges, overlays of triangles.
pub(crate) const PLANE: Space<2> = Space {
    surface: plane_surface,
    overlay: plane_overlay,
};

/// Space: shells of triangles, overlays of tetrahedra.
pub(crate) const SOLID: Space<3> = Space {
    surface: solid_surface,
    overlay: solid_overlay,
};
