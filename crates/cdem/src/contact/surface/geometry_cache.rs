//! Cache of the geometry of a surface at some positions. The first pair that needs a value computes
//! it; all pairs on all threads share it.

use crate::contact::tolerances::CACHE_CHUNK;

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Cached geometry of a surface at some positions.
#[derive(Debug)]
pub(crate) struct GeometryCache<const D: usize> {
    /// Points of the surface by number, m.
    pub(super) points: Lazy<[f64; D]>,
    /// Shapes of the triangles by number; in 3-D only.
    pub(super) triangle_shapes: Lazy<TriangleShape>,
    /// Shapes of the edges by number; in 3-D only.
    pub(super) edge_shapes: Lazy<EdgeShape>,
}

/// Normal and size of a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleShape {
    /// Outward unit normal.
    pub(super) normal: [f64; 3],
    /// Twice its area, m².
    pub(super) twice_area: f64,
    /// The smallest of its heights over its edges, m.
    pub(super) least_height: f64,
}

/// Height of an edge over the two triangles beside it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeShape {
    /// Height of the edge over a straight line between the far corners of both triangles, laid
    /// across it, m: ≤ 0 for a re-entrant edge, infinite for a clearly sharp edge or one of more
    /// than two triangles.
    pub(super) height: f64,
    /// The height over the turn, rad, for a small turn: 1/(1/h₁ + 1/h₂) of the heights of both
    /// triangles over the edge, m.
    pub(super) arm: f64,
    /// The smallest height of the two triangles over any of their edges, m; no more than the length
    /// of this edge.
    pub(crate) least_height: f64,
}

impl<const D: usize> GeometryCache<D> {
    /// Makes an empty cache of a surface with this many points, triangles and edges.
    pub(super) fn new([points, triangles, edges]: [usize; 3]) -> Self {
        Self {
            points: Lazy::new(points),
            triangle_shapes: Lazy::new(triangles),
            edge_shapes: Lazy::new(edges),
        }
    }

    /// Clears all values, because the positions have changed.
    pub(super) fn clear(&mut self) {
        self.points.clear();
        self.triangle_shapes.clear();
        self.edge_shapes.clear();
    }
}

/// Values by number, each computed when it is first needed.
#[derive(Debug)]
pub(super) struct Lazy<T>(Vec<LazyChunk<T>>);

/// Values that are cleared together.
#[derive(Debug)]
struct LazyChunk<T> {
    /// True if any value may be set.
    is_used: AtomicBool,
    values: [OnceLock<T>; CACHE_CHUNK],
}

impl<T> Default for LazyChunk<T> {
    fn default() -> Self {
        Self {
            is_used: AtomicBool::new(false),
            values: [const { OnceLock::new() }; CACHE_CHUNK],
        }
    }
}

impl<T: Copy> Lazy<T> {
    /// Makes room for `count` values, none set.
    fn new(count: usize) -> Self {
        let all = std::iter::repeat_with(LazyChunk::default);
        Self(all.take(count.div_ceil(CACHE_CHUNK)).collect())
    }

    /// Returns the value with this number; `work` computes it if it is not set. Every caller must
    /// compute the same value.
    #[inline]
    pub(super) fn get(&self, number: u32, work: impl FnOnce() -> T) -> T {
        let few = &self.0[number as usize / CACHE_CHUNK];
        *few.values[number as usize % CACHE_CHUNK].get_or_init(|| {
            few.is_used.store(true, Ordering::Relaxed);
            work()
        })
    }

    fn clear(&mut self) {
        for few in &mut self.0 {
            if *few.is_used.get_mut() {
                *few = LazyChunk::default();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_worked_out_once_until_it_is_forgotten() {
        let mut cache = GeometryCache::<3>::new([100; 3]);
        let ask = |cache: &GeometryCache<3>, x: f64| {
            for number in [0, 31, 32, 99] {
                let x = x + f64::from(number);
                let point = cache.points.get(number, || [x; 3]);
                let shape = cache.triangle_shapes.get(number, || TriangleShape {
                    normal: [x; 3],
                    twice_area: x,
                    least_height: x,
                });
                let ridge = cache.edge_shapes.get(number, || EdgeShape {
                    height: x,
                    arm: x,
                    least_height: x,
                });
                assert_eq!([point[0], shape.twice_area], [ridge.height; 2]);
            }
            cache.points.get(99, || unreachable!("it is known"))[0] - 99.0
        };
        assert_eq!([ask(&cache, 1.0), ask(&cache, 2.0)], [1.0, 1.0]);
        cache.clear();
        assert_eq!(ask(&cache, 2.0), 2.0);
    }
}
