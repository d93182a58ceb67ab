//! The five element shapes and their topology.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Corners of the reference square (the first four; no third component) and cube.
pub(crate) const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// Shape of a finite element.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum ElementKind {
    /// Three-node triangle.
    Tri3,
    /// Four-node quadrilateral.
    Quad4,
    /// Four-node tetrahedron.
    Tet4,
    /// Six-node triangular prism (the paper's block).
    Wedge6,
    /// Eight-node hexahedron.
    Hex8,
}

impl ElementKind {
    /// Returns the number of nodes.
    #[must_use]
    pub const fn node_count(self) -> usize {
        match self {
            Self::Tri3 => 3,
            Self::Quad4 | Self::Tet4 => 4,
            Self::Wedge6 => 6,
            Self::Hex8 => 8,
        }
    }

    /// Returns the dimension of the element: 2 or 3.
    #[must_use]
    pub const fn dimension(self) -> usize {
        match self {
            Self::Tri3 | Self::Quad4 => 2,
            Self::Tet4 | Self::Wedge6 | Self::Hex8 => 3,
        }
    }

    /// Returns the facets as local node numbers: edges with the element to their left in 2-D, faces
    /// counter-clockwise seen from outside in 3-D.
    #[must_use]
    pub const fn facets(self) -> &'static [&'static [u8]] {
        match self {
            Self::Tri3 => &[&[0, 1], &[1, 2], &[2, 0]],
            Self::Quad4 => &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
            Self::Tet4 => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]],
            Self::Wedge6 => &[
                &[0, 2, 1],
                &[3, 4, 5],
                &[0, 1, 4, 3],
                &[1, 2, 5, 4],
                &[2, 0, 3, 5],
            ],
            Self::Hex8 => &[
                &[0, 3, 2, 1],
                &[4, 5, 6, 7],
                &[0, 1, 5, 4],
                &[1, 2, 6, 5],
                &[2, 3, 7, 6],
                &[3, 0, 4, 7],
            ],
        }
    }

    /// Returns the name used in scenes.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tri3 => "tri3",
            Self::Quad4 => "quad4",
            Self::Tet4 => "tet4",
            Self::Wedge6 => "wedge6",
            Self::Hex8 => "hex8",
        }
    }
}
