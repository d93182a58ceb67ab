//! Overlap of cells in 3-D by separating axes (Gottschalk, Lin, Manocha 1996).

use cdem::output::Frame;

type Vector = [f64; 3];

/// A convex cell: its corners, and its unit normals and edges, which give the separating axes.
struct Cell {
    block: i32,
    corners: Vec<Vector>,
    /// Triangles of its boundary. A quadrilateral may be warped, so it is split into four triangles
    /// around its mean.
    triangles: Vec<[Vector; 3]>,
    normals: Vec<Vector>,
    edges: Vec<Vector>,
    low: Vector,
    high: Vector,
}

/// Returns the largest shift that separates two cells of different blocks, m.
pub(super) fn deepest(frame: &Frame, cells: &[(i32, Vec<u32>)]) -> f64 {
    let cells: Vec<Cell> = frame
        .kinds
        .iter()
        .zip(cells)
        .map(|(kind, (block, nodes))| {
            let corners = nodes.iter().map(|&node| frame.points[node as usize]);
            Cell::new(*block, corners.collect(), kind.facets())
        })
        .collect();
    let mut deepest = 0.0_f64;
    for (number, one) in cells.iter().enumerate() {
        for other in &cells[..number] {
            if one.block != other.block && one.may_meet(other) {
                deepest = deepest.max(one.exact_overlap(other));
            }
        }
    }
    deepest
}

impl Cell {
    fn new(block: i32, corners: Vec<Vector>, facets: &[&[u8]]) -> Self {
        let (mut triangles, mut edges) = (Vec::new(), Vec::new());
        for facet in facets {
            let points: Vec<Vector> = facet.iter().map(|&k| corners[k as usize]).collect();
            let mean = mean(points.iter());
            for (a, b) in points.iter().zip(points.iter().cycle().skip(1)) {
                edges.push(minus(b, a));
                if points.len() > 3 {
                    triangles.push([*a, *b, mean]);
                }
            }
            if let &[a, b, c] = points.as_slice() {
                triangles.push([a, b, c]);
            }
        }
        let normal = |[a, b, c]: &[Vector; 3]| unit(&cross(&minus(b, a), &minus(c, a)));
        let normals = triangles.iter().filter_map(normal).collect();
        let bound = |c: usize, of: fn(f64, f64) -> f64, from: f64| {
            corners.iter().map(|p| p[c]).fold(from, of)
        };
        Self {
            block,
            low: [0, 1, 2].map(|c| bound(c, f64::min, f64::INFINITY)),
            high: [0, 1, 2].map(|c| bound(c, f64::max, f64::NEG_INFINITY)),
            corners,
            triangles,
            normals,
            edges,
        }
    }

    fn may_meet(&self, other: &Self) -> bool {
        (0..3).all(|c| self.low[c] < other.high[c] && other.low[c] < self.high[c])
    }

    /// Returns the overlap of two cells that may have warped faces, m. If their hulls overlap, they
    /// are compared tetrahedron by tetrahedron.
    fn exact_overlap(&self, other: &Self) -> f64 {
        if self.is_tetrahedron() && other.is_tetrahedron() || self.overlap(other) == 0.0 {
            return self.overlap(other);
        }
        let [own, others] = [self, other].map(Self::tetrahedra);
        let pairs = own
            .iter()
            .flat_map(|one| others.iter().map(move |two| (one, two)));
        let meeting = pairs.filter(|(one, two)| one.may_meet(two));
        meeting
            .map(|(one, two)| one.overlap(two))
            .fold(0.0, f64::max)
    }

    fn is_tetrahedron(&self) -> bool {
        self.corners.len() == 4
    }

    /// Splits the cell into tetrahedra between its centre and the triangles of its boundary.
    fn tetrahedra(&self) -> Vec<Self> {
        let middle = mean(self.corners.iter());
        let with_middle = |triangle: &[Vector; 3]| {
            let [a, b, c] = *triangle;
            let facets: [&[u8]; 4] = [&[0, 1, 2], &[0, 3, 1], &[1, 3, 2], &[2, 3, 0]];
            Self::new(self.block, vec![a, b, c, middle], &facets)
        };
        self.triangles.iter().map(with_middle).collect()
    }

    /// Returns the shortest shift that separates the hulls of two cells, m; 0 if they do not
    /// overlap.
    fn overlap(&self, other: &Self) -> f64 {
        let crossings = self.edges.iter().flat_map(|one| {
            let edges = other.edges.iter();
            edges.filter_map(move |two| unit(&cross(one, two)))
        });
        let normals = self.normals.iter().chain(&other.normals).copied();
        let mut least = f64::INFINITY;
        for axis in normals.chain(crossings) {
            let [one, two] = [self, other].map(|cell| cell.extent(&axis));
            least = least.min((one[1] - two[0]).min(two[1] - one[0]));
            if least <= 0.0 {
                return 0.0;
            }
        }
        least
    }

    fn extent(&self, axis: &Vector) -> [f64; 2] {
        let along = self.corners.iter().map(|p| dot(p, axis));
        along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x), high.max(x)]
        })
    }
}

fn mean<'a>(points: impl ExactSizeIterator<Item = &'a Vector>) -> Vector {
    let share = 1.0 / points.len() as f64;
    let add = |sum: Vector, point: &Vector| [0, 1, 2].map(|c| sum[c] + share * point[c]);
    points.fold([0.0; 3], add)
}

fn minus(a: &Vector, b: &Vector) -> Vector {
    [0, 1, 2].map(|c| a[c] - b[c])
}

fn dot(a: &Vector, b: &Vector) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i] * b[j] - a[j] * b[i])
}

/// Returns the unit vector, or `None` if `v` is almost zero, as the product of parallel edges is.
fn unit(v: &Vector) -> Option<Vector> {
    let length = dot(v, v).sqrt();
    (length > 1e-9).then(|| v.map(|x| x / length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use cdem::mesh::ElementKind;

    /// Creates a cube of edge 1 centred at `at`, rotated by `turn` about z and then y.
    fn cube(block: i32, at: Vector, turn: f64) -> Cell {
        let (s, c) = turn.sin_cos();
        let corners = [
            [0, 0, 0],
            [1, 0, 0],
            [1, 1, 0],
            [0, 1, 0],
            [0, 0, 1],
            [1, 0, 1],
            [1, 1, 1],
            [0, 1, 1],
        ];
        let placed = corners.map(|corner| {
            let [x, y, z] = corner.map(|k| f64::from(k) - 0.5);
            let [x, y] = [c * x - s * y, s * x + c * y];
            [c * x + s * z + at[0], y + at[1], c * z - s * x + at[2]]
        });
        Cell::new(block, placed.to_vec(), ElementKind::Hex8.facets())
    }

    #[test]
    fn warped_faces_that_lie_in_each_other_do_not_overlap() {
        // Both saddles have the same shape, so the upper one fits into the lower one.
        let saddle = |block, [low, high]: [f64; 2]| {
            let warp = |x: f64, y: f64, z: f64| {
                if z == 0.0 {
                    0.1 * (2.0 * x - 1.0) * (2.0 * y - 1.0)
                } else {
                    z
                }
            };
            let base = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
            let at = |z: f64| base.map(|[x, y]| [x, y, warp(x, y, z)]);
            let corners = [at(low), at(high)].concat();
            Cell::new(block, corners, ElementKind::Hex8.facets())
        };
        let [lower, upper] = [saddle(0, [-1.0, 0.0]), saddle(1, [0.0, 1.0])];
        assert!(lower.overlap(&upper) > 0.05);
        assert!(lower.exact_overlap(&upper) < 1e-15);
    }

    #[test]
    fn cubes_overlap_by_what_parts_them() {
        let still = cube(0, [0.0; 3], 0.0);
        let beside = cube(1, [0.9, 0.3, 0.2], 0.0);
        assert!((still.overlap(&beside) - 0.1).abs() < 1e-15);
        assert_eq!(still.overlap(&cube(1, [1.1, 0.3, 0.2], 0.0)), 0.0);
        // Edge against edge: separate, although their boxes overlap.
        let quarter = std::f64::consts::FRAC_PI_4;
        let turned = cube(1, [0.0; 3], quarter);
        let reach = turned.high[0];
        for (gap, meets) in [(0.01, false), (-0.01, true)] {
            let found = still.overlap(&cube(1, [0.5 + reach + gap, 0.0, 0.0], quarter));
            assert_eq!(found > 0.0, meets, "{gap} {found}");
            assert!((found - f64::max(0.0, -gap)).abs() < 1e-12, "{gap} {found}");
        }
    }
}
