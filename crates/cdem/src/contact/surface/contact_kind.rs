//! Contact types of two blocks.

use serde::{Deserialize, Serialize};

/// The six contact types of the shrunken-edge method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[allow(missing_docs)] // the variants say it
pub enum ContactKind {
    VertexVertex,
    VertexEdge,
    VertexFace,
    EdgeEdge,
    EdgeFace,
    FaceFace,
}

impl ContactKind {
    /// Returns the name used in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::VertexVertex => "vertex-vertex",
            Self::VertexEdge => "vertex-edge",
            Self::VertexFace => "vertex-face",
            Self::EdgeEdge => "edge-edge",
            Self::EdgeFace => "edge-face",
            Self::FaceFace => "face-face",
        }
    }
}
