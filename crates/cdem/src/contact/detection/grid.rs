//! Broad phase: pairs of boxes that overlap, at linear cost.
//!
//! Boxes are put into a grid with cells of a power of two not below the size of the box. There is
//! one grid for each size class, so that a pebble and a cliff cost the same. All grids share one
//! table: a box has one entry, in the cell of its lower corner, and cells are hashed. A box is
//! compared with the classes that are not finer than its own, where it reaches three cells in a
//! direction at most.

use crate::contact::surface::aabb::Aabb;
use crate::contact::tolerances::{COARSEST_CLASS, GRID_RESOLUTION};
/// Size class of boxes: cells of 2^`0` m.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct SizeClass(i32);

impl SizeClass {
    /// Returns the finest class that is useful for boxes of both sides.
    fn finest<const D: usize>(sides: [&[Aabb<D>]; 2]) -> Self {
        let boxes = sides.into_iter().flatten().filter(|aabb| !aabb.is_empty());
        let corners = boxes.flat_map(|aabb| aabb.min.into_iter().chain(aabb.max));
        let largest = corners.map(f64::abs).filter(|x| x.is_finite());
        Self(exponent(largest.fold(0.0, f64::max)) - GRID_RESOLUTION)
    }

    /// Returns the class of a non-empty box, `finest` or coarser. The box reaches from the cell of
    /// its lower corner into the next one at most.
    #[inline]
    fn of<const D: usize>(aabb: &Aabb<D>, finest: Self) -> Self {
        let sizes = (0..D).map(|c| aabb.max[c] - aabb.min[c]);
        let mut class = Self(exponent(sizes.fold(0.0, f64::max))).max(finest);
        let reaches_on =
            |class: Self, c| class.cell(aabb.max[c]) > class.cell(aabb.min[c]).saturating_add(1);
        while class.0 < COARSEST_CLASS && (0..D).any(|c| reaches_on(class, c)) {
            class.0 += 1; // round-off of the size
        }
        class
    }

    /// Returns the number of the cell that contains a coordinate; it never falls as the coordinate
    /// rises.
    #[inline]
    fn cell(self, coordinate: f64) -> i64 {
        // 2 to the power of minus the class, from its bits.
        let per_cell = f64::from_bits(((1023 - self.0) as u64) << 52);
        let place = coordinate * per_cell;
        let cell = place as i64; // towards zero
        cell.saturating_sub(i64::from(place < cell as f64))
    }
}

/// Returns the smallest e with 2^e not below `size`, within the range of the classes.
#[inline]
fn exponent(size: f64) -> i32 {
    let finest = f64::from(GRID_RESOLUTION - COARSEST_CLASS);
    size.log2().ceil().clamp(finest, f64::from(COARSEST_CLASS)) as i32
}

/// Returns the hash of the row of cells that share all indices of `cell` but the first. Rows are
/// hashed; the cells of a row lie side by side.
#[inline]
fn row<const D: usize>(class: SizeClass, cell: &[i64; D]) -> u64 {
    let mut hash = class.0 as u64;
    for &index in &cell[1..] {
        hash = (hash ^ index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        hash ^= hash >> 29;
    }
    hash.wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 16
}

/// The non-empty boxes of one side, in the order of their buckets.
struct Grid<const D: usize> {
    boxes: Vec<(Aabb<D>, u32)>,
    /// Index of the first box of each bucket, and the end. The number of buckets is a power of two.
    start: Vec<u32>,
    /// Classes in use, finest first.
    classes: Vec<SizeClass>,
}

impl<const D: usize> Grid<D> {
    fn new(all: &[Aabb<D>], finest: SizeClass) -> Self {
        let buckets = (2 * all.len()).next_power_of_two();
        let mut classes: Vec<SizeClass> = Vec::new();
        let mut place = vec![u32::MAX; all.len()];
        let mut start = vec![0_u32; buckets + 1];
        for (aabb, place) in all.iter().zip(&mut place) {
            if aabb.is_empty() {
                continue;
            }
            let class = SizeClass::of(aabb, finest);
            if !classes.contains(&class) {
                classes.push(class);
            }
            let cell = aabb.min.map(|x| class.cell(x));
            let bucket = row(class, &cell).wrapping_add(cell[0] as u64) as usize & (buckets - 1);
            *place = bucket as u32;
            start[bucket + 1] += 1;
        }
        for bucket in 0..buckets {
            start[bucket + 1] += start[bucket];
        }
        classes.sort_unstable();
        let nowhere = Aabb::around([], 0.0);
        let mut boxes = vec![(nowhere, 0); start[buckets] as usize];
        let mut next = start.clone();
        for (number, (aabb, &place)) in all.iter().zip(&place).enumerate() {
            if let Some(next) = next.get_mut(place as usize) {
                boxes[*next as usize] = (*aabb, number as u32);
                *next += 1;
            }
        }
        Self {
            boxes,
            start,
            classes,
        }
    }

    /// Calls `found` for every box that overlaps `aabb`, in the classes selected by `wanted`, none
    /// of them finer than that of `aabb`. A box may come twice.
    fn query(
        &self,
        aabb: &Aabb<D>,
        wanted: impl Fn(SizeClass) -> bool,
        mut found: impl FnMut(u32),
    ) {
        let mask = self.start.len() - 2;
        for &class in self.classes.iter().filter(|&&class| wanted(class)) {
            // A box here may begin one cell before.
            let low = aabb.min.map(|x| class.cell(x).saturating_sub(1));
            let high = aabb.max.map(|x| class.cell(x));
            let mut cell = low;
            loop {
                let row = row(class, &cell);
                for x in low[0]..=high[0] {
                    let bucket = row.wrapping_add(x as u64) as usize & mask;
                    let entries = self.start[bucket] as usize..self.start[bucket + 1] as usize;
                    for (other, number) in &self.boxes[entries] {
                        if aabb.overlaps(other) {
                            found(*number);
                        }
                    }
                }
                let Some(c) = (1..D).find(|&c| cell[c] < high[c]) else {
                    break;
                };
                cell[1..c].copy_from_slice(&low[1..c]);
                cell[c] += 1;
            }
        }
    }
}

/// Returns all `(main, target)` whose boxes overlap and that `accept` selects, sorted.
pub(crate) fn overlapping<const D: usize>(
    mains: &[Aabb<D>],
    targets: &[Aabb<D>],
    accept: impl Fn(u32, u32) -> bool,
) -> Vec<(u32, u32)> {
    let finest = SizeClass::finest([mains, targets]);
    let grid = Grid::new(targets, finest);
    let mut pairs = Vec::new();
    let mut coarsest = finest;
    for (main, aabb, own) in with_class(mains, finest) {
        coarsest = coarsest.max(own);
        let first = pairs.len();
        let found = |target| pairs.extend(accept(main, target).then_some((main, target)));
        grid.query(aabb, |class| class >= own, found);
        pairs[first..].sort_unstable();
    }
    if grid.classes.first().is_some_and(|&class| class < coarsest) {
        let grid = Grid::new(mains, finest);
        for (target, aabb, own) in with_class(targets, finest) {
            let found = |main| pairs.extend(accept(main, target).then_some((main, target)));
            grid.query(aabb, |class| class > own, found);
        }
        pairs = by_main(&pairs, mains.len());
    }
    pairs.dedup();
    pairs
}

/// Returns number, box and class of all non-empty boxes.
fn with_class<const D: usize>(
    boxes: &[Aabb<D>],
    finest: SizeClass,
) -> impl Iterator<Item = (u32, &Aabb<D>, SizeClass)> {
    let boxes = (0..).zip(boxes).filter(|(_, aabb)| !aabb.is_empty());
    boxes.map(move |(number, aabb)| (number, aabb, SizeClass::of(aabb, finest)))
}

/// Sorts pairs of `mains` main boxes at linear cost.
fn by_main(pairs: &[(u32, u32)], mains: usize) -> Vec<(u32, u32)> {
    let mut start = vec![0_u32; mains + 1];
    for pair in pairs {
        start[pair.0 as usize + 1] += 1;
    }
    for main in 0..mains {
        start[main + 1] += start[main];
    }
    let mut next = start.clone();
    let mut sorted = vec![(0, 0); pairs.len()];
    for &pair in pairs {
        let next = &mut next[pair.0 as usize];
        sorted[*next as usize] = pair;
        *next += 1;
    }
    for range in start.windows(2) {
        sorted[range[0] as usize..range[1] as usize].sort_unstable();
    }
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Boxes of sizes from nothing to a multiple of the region that contains them, some of them
    /// empty; `scale` m each way around `origin`. Corners lie on cell borders as often as not.
    fn boxes<const D: usize>(origin: f64, scale: f64) -> impl Strategy<Value = Vec<Aabb<D>>> {
        let size = prop_oneof![
            Just(0.0),
            Just(0.5),
            1e-9..1e-8_f64,
            0.001..0.01_f64,
            0.5..2.0_f64,
            10.0..20.0_f64,
        ];
        let corner = prop_oneof![
            -5.0..5.0_f64,
            (-10..10_i32).prop_map(|k| f64::from(k) / 2.0)
        ];
        let one = (
            proptest::array::uniform::<_, D>(corner),
            proptest::array::uniform::<_, D>(size),
            0..10 * D,
        );
        let one = one.prop_map(move |(min, size, empty)| Aabb {
            min: min.map(|x| origin + scale * x),
            max: std::array::from_fn(|c| {
                let size = if c == empty { -1.0 } else { size[c] };
                origin + scale * (min[c] + size)
            }),
        });
        proptest::collection::vec(one, 0..40)
    }

    /// All overlapping pairs, by the definition of overlap.
    fn all_pairs<const D: usize>(mains: &[Aabb<D>], targets: &[Aabb<D>]) -> Vec<(u32, u32)> {
        let mut all = Vec::new();
        for (m, main) in mains.iter().enumerate() {
            for (t, target) in targets.iter().enumerate() {
                let holds = |aabb: &Aabb<D>| (0..D).all(|c| aabb.min[c] <= aabb.max[c]);
                let common = Aabb {
                    min: std::array::from_fn(|c| main.min[c].max(target.min[c])),
                    max: std::array::from_fn(|c| main.max[c].min(target.max[c])),
                };
                if m != t && [*main, *target, common].iter().all(holds) {
                    all.push((m as u32, t as u32));
                }
            }
        }
        all
    }

    fn both<const D: usize>() -> impl Strategy<Value = [Vec<Aabb<D>>; 2]> {
        // Coordinates of usual size, far off (few bits left for the boxes), huge, tiny, and with
        // all boxes in one cell.
        let place = prop_oneof![
            Just((0.0, 1.0)),
            Just((1e9, 1.0)),
            Just((-3e15, 1.0)),
            Just((0.0, 1e200)),
            Just((0.0, 1e-200)),
            Just((1.0, 1e-14)),
        ];
        place.prop_flat_map(|(origin, scale)| [boxes(origin, scale), boxes(origin, scale)])
    }

    proptest! {
        #[test]
        fn agrees_with_all_pairs_in_the_plane([mains, targets] in both::<2>()) {
            let found = overlapping(&mains, &targets, |main, target| main != target);
            prop_assert_eq!(found, all_pairs(&mains, &targets));
        }

        #[test]
        fn agrees_with_all_pairs_in_space([mains, targets] in both::<3>()) {
            let found = overlapping(&mains, &targets, |main, target| main != target);
            prop_assert_eq!(found, all_pairs(&mains, &targets));
        }
    }

    #[test]
    fn one_side_or_both_may_be_nothing() {
        let one = [Aabb::around([[0.0, 0.0]], 1.0)];
        let empty = [Aabb::around([], 1.0)];
        let none: [Aabb<2>; 0] = [];
        for [mains, targets] in [[&one[..], &none], [&none, &one], [&none, &none]] {
            assert!(overlapping(mains, targets, |_, _| true).is_empty());
        }
        for [mains, targets] in [[&one, &empty], [&empty, &one], [&empty, &empty]] {
            assert!(overlapping(mains, targets, |_, _| true).is_empty());
        }
        assert_eq!(overlapping(&one, &one, |_, _| true), [(0, 0)]);
    }
}
