//! Differences between 2-D and 3-D.

use crate::contact::{MakeSurface, plane_surface, solid_surface};
use crate::refinement::{MakeOverlay, plane_overlay, solid_overlay};

/// The constructors of surfaces and overlays.
#[derive(Clone, Copy)]
pub(crate) struct Space<const D: usize> {
    pub(crate) surface: MakeSurface<D>,
    pub(crate) overlay: MakeOverlay<D>,
}

/// 2-D: boundaries of edges, overlays of triangles.
pub(crate) const PLANE: Space<2> = Space {
    surface: plane_surface,
    overlay: plane_overlay,
};

/// 3-D: boundaries of triangles, overlays of tetrahedra.
pub(crate) const SOLID: Space<3> = Space {
    surface: solid_surface,
    overlay: solid_overlay,
};
