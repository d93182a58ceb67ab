//! Placement of a block's mesh: scaled, rotated, then shifted.

use crate::scene;

/// x = scale · R · X + shift.
pub(super) struct Placement {
    /// scale · R.
    matrix: [[f64; 3]; 3],
    shift: [f64; 3],
}

impl Placement {
    /// Creates the placement of a scene's block. The axis of rotation is a unit vector.
    pub(super) fn new(block: &scene::Block) -> Self {
        let [x, y, z] = block.rotate.axis;
        let (sin, cos) = block.rotate.angle.sin_cos();
        // Rodrigues' formula: R = cos·1 + sin·[k]× + (1 − cos)·k kᵀ.
        let cross = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
        let axis = [x, y, z];
        let rotation = |i: usize, j: usize| {
            let diagonal = if i == j { cos } else { 0.0 };
            diagonal + sin * cross[i][j] + (1.0 - cos) * axis[i] * axis[j]
        };
        Self {
            matrix: std::array::from_fn(|i| std::array::from_fn(|j| block.scale * rotation(i, j))),
            shift: std::array::from_fn(|i| block.translate.get(i).copied().unwrap_or(0.0)),
        }
    }

    /// Returns the placed position of a mesh point; in 2-D its z is dropped.
    pub(super) fn apply<const D: usize>(&self, mut point: [f64; 3]) -> [f64; D] {
        point[D..].fill(0.0);
        std::array::from_fn(|i| {
            let turned: f64 = (0..D).map(|j| self.matrix[i][j] * point[j]).sum();
            turned + self.shift[i]
        })
    }
}
