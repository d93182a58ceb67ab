//! What many pairs have in common of a surface at some positions: worked out when the first of
//! them asks, and kept for the others, on all threads.

use crate::contact::tolerances::CACHE_CHUNK;

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// A surface at some positions, as far as any pair has asked.
#[derive(Debug)]
pub(crate) struct GeometryCache<const D: usize> {
    /// Points of the surface by number, m.
    pub(super) points: Lazy<[f64; D]>,
    /// In space, how its triangles lie by number.
    pub(super) triangle_shapes: Lazy<TriangleShape>,
    /// In space, how its edges stand out by number.
    pub(super) edge_shapes: Lazy<EdgeShape>,
}

/// How a triangle lies, and how large it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleShape {
    /// Outward unit normal.
    pub(super) normal: [f64; 3],
    /// Twice its area, m².
    pub(super) twice_area: f64,
    /// The smallest of its heights over its edges, m.
    pub(super) least_height: f64,
}

/// How an edge between two triangles stands out.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeShape {
    /// How far a straight line laid across it, between the far corners of both
    /// triangles, is below it, m: ≤ 0 where it is re-entrant, infinite where it is
    /// clearly sharp, or between more than two triangles.
    pub(super) height: f64,
    /// That over its turn, rad, where it is small: 1/(1/h₁ + 1/h₂) of the heights of
    /// both triangles over the edge, m.
    pub(super) arm: f64,
    /// The smallest height of the two triangles over any of their edges, m; no more
    /// than its own length.
    pub(crate) least_height: f64,
}

impl<const D: usize> GeometryCache<D> {
    /// Of a surface with so many points, triangles and edges, of which nothing is known.
    pub(super) fn new([points, triangles, edges]: [usize; 3]) -> Self {
        Self {
            points: Lazy::new(points),
            triangle_shapes: Lazy::new(triangles),
            edge_shapes: Lazy::new(edges),
        }
    }

    /// Forgets all: positions have changed.
    pub(super) fn clear(&mut self) {
        self.points.clear();
        self.triangle_shapes.clear();
        self.edge_shapes.clear();
    }
}

/// Values by number, each from when it is first asked for.
#[derive(Debug)]
pub(super) struct Lazy<T>(Vec<LazyChunk<T>>);

/// Values that are cleared together.
#[derive(Debug)]
struct LazyChunk<T> {
    /// Whether there may be any.
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
    /// None yet of so many.
    fn new(count: usize) -> Self {
        let all = std::iter::repeat_with(LazyChunk::default);
        Self(all.take(count.div_ceil(CACHE_CHUNK)).collect())
    }

    /// The value with this number; `work` finds it if nobody has asked yet. Whoever does finds
    /// the same.
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
