//! Broad phase: pairs of boxes that overlap, at linear cost.
//!
//! Boxes are hashed into grids whose cell is the power of two just above the
//! box's size, one grid a size class, so that a pebble and a cliff cost the
//! same. A box is looked up in all classes that are not finer than its own.

/// Axis-aligned box. It is empty where a lower corner is above the upper one:
/// no box overlaps it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Aabb<const D: usize> {
    /// Lower corner.
    pub(crate) min: [f64; D],
    /// Upper corner.
    pub(crate) max: [f64; D],
}

impl<const D: usize> Aabb<D> {
    /// The smallest box around points, grown by `margin` on all sides.
    pub(crate) fn around(points: impl IntoIterator<Item = [f64; D]>, margin: f64) -> Self {
        let mut aabb = Self {
            min: [f64::INFINITY; D],
            max: [f64::NEG_INFINITY; D],
        };
        for point in points {
            for (c, x) in point.into_iter().enumerate() {
                aabb.min[c] = aabb.min[c].min(x - margin);
                aabb.max[c] = aabb.max[c].max(x + margin);
            }
        }
        aabb
    }

    /// Whether it holds no point.
    fn is_empty(&self) -> bool {
        (0..D).any(|c| self.min[c] > self.max[c])
    }

    /// Whether the two, neither of them empty, share a point.
    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        (0..D).all(|c| self.min[c] <= other.max[c] && other.min[c] <= self.max[c])
    }

    /// Exponent of the smallest power of two that is not below its size.
    fn class(&self) -> i32 {
        let size = (0..D)
            .map(|c| self.max[c] - self.min[c])
            .fold(0.0, f64::max);
        size.max(f64::MIN_POSITIVE).log2().ceil() as i32
    }

    /// Cells of a grid of class `class` that it covers.
    fn cells(&self, class: i32) -> impl Iterator<Item = [i64; D]> + use<D> {
        let size = f64::from(class).exp2();
        let low: [i64; D] = std::array::from_fn(|c| (self.min[c] / size).floor() as i64);
        let high: [i64; D] = std::array::from_fn(|c| (self.max[c] / size).floor() as i64);
        let mut next = Some(low);
        std::iter::from_fn(move || {
            let cell = next?;
            let mut following = cell;
            next = (0..D).find_map(|c| {
                if following[c] < high[c] {
                    following[c] += 1;
                    Some(following)
                } else {
                    following[c] = low[c];
                    None
                }
            });
            Some(cell)
        })
    }
}

/// Features that are tested against each other: mains against targets only.
/// Numbers of features are those of the surface.
#[derive(Clone, Debug)]
pub(crate) struct Family<const D: usize> {
    /// Boxes of main features, in order of their number.
    pub(crate) mains: Vec<Aabb<D>>,
    /// Boxes of target features, in order of their number.
    pub(crate) targets: Vec<Aabb<D>>,
    /// Number of the first main feature.
    pub(crate) first_main: u32,
    /// Number of the first target feature.
    pub(crate) first_target: u32,
}

/// All boxes of one side, sorted by size class and cell.
struct Grid<const D: usize> {
    entries: Vec<((i32, [i64; D]), u32)>,
    classes: Vec<i32>,
}

impl<const D: usize> Grid<D> {
    fn new(boxes: &[Aabb<D>]) -> Self {
        let mut entries = Vec::new();
        let boxes = boxes.iter().enumerate();
        for (number, aabb) in boxes.filter(|(_, aabb)| !aabb.is_empty()) {
            let class = aabb.class();
            entries.extend(aabb.cells(class).map(|cell| ((class, cell), number as u32)));
        }
        entries.sort_unstable();
        let mut classes: Vec<i32> = entries.iter().map(|entry| entry.0.0).collect();
        classes.dedup();
        Self { entries, classes }
    }

    /// Calls `found` for every box in a cell that `aabb` covers, in the
    /// classes for which `wanted` holds; a box may come several times.
    fn query(&self, aabb: &Aabb<D>, wanted: impl Fn(i32) -> bool, mut found: impl FnMut(u32)) {
        for &class in self.classes.iter().filter(|&&class| wanted(class)) {
            for cell in aabb.cells(class) {
                let key = (class, cell);
                let first = self.entries.partition_point(|entry| entry.0 < key);
                for entry in self.entries[first..]
                    .iter()
                    .take_while(|entry| entry.0 == key)
                {
                    found(entry.1);
                }
            }
        }
    }
}

/// All `(main, target)` whose boxes overlap and which `accept` wants, sorted.
pub(crate) fn overlapping<const D: usize>(
    mains: &[Aabb<D>],
    targets: &[Aabb<D>],
    accept: impl Fn(u32, u32) -> bool,
) -> Vec<(u32, u32)> {
    let mut pairs = Vec::new();
    let mut test = |main: u32, target: u32| {
        if mains[main as usize].overlaps(&targets[target as usize]) && accept(main, target) {
            pairs.push((main, target));
        }
    };
    let grid = Grid::new(targets);
    let boxes = mains.iter().enumerate();
    for (main, aabb) in boxes.filter(|(_, aabb)| !aabb.is_empty()) {
        let own = aabb.class();
        grid.query(
            aabb,
            |class| class >= own,
            |target| test(main as u32, target),
        );
    }
    let grid = Grid::new(mains);
    let boxes = targets.iter().enumerate();
    for (target, aabb) in boxes.filter(|(_, aabb)| !aabb.is_empty()) {
        let own = aabb.class();
        grid.query(aabb, |class| class > own, |main| test(main, target as u32));
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn boxes() -> impl Strategy<Value = Vec<Aabb<2>>> {
        let size = prop_oneof![Just(0.0), 0.001..0.01_f64, 0.5..2.0_f64, 10.0..20.0_f64];
        let height = prop_oneof![4 => size.clone(), 1 => Just(-1.0)];
        let one = (-5.0..5.0_f64, -5.0..5.0_f64, size, height).prop_map(|(x, y, w, h)| Aabb {
            min: [x, y],
            max: [x + w, y + h],
        });
        proptest::collection::vec(one, 0..40)
    }

    proptest! {
        #[test]
        fn agrees_with_all_pairs(mains in boxes(), targets in boxes()) {
            let found = overlapping(&mains, &targets, |main, target| main != target);
            let mut all = Vec::new();
            for (m, main) in mains.iter().enumerate() {
                for (t, target) in targets.iter().enumerate() {
                    if m != t && !main.is_empty() && !target.is_empty() && main.overlaps(target) {
                        all.push((m as u32, t as u32));
                    }
                }
            }
            prop_assert_eq!(found, all);
        }
    }
}
