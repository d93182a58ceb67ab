//! Spatial index of the closed contacts of an island. An open pair is compared with those near
//! it before it may touch.
//!
//! Two blocks may have hundreds of contacts, for example round blocks pressed together. A touch
//! can only duplicate a contact whose main feature is at the same point.

use std::ops::Range;

use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::constraint::context::ContactContext;
use crate::contact::constraint::initial_overlap::ordered;
use crate::contact::surface::aabb::Aabb;
use crate::contact::surface::kicked::ConstantMotion;
use crate::contact::surface::{Configuration, Pair, Surface};
use crate::contact::tolerances::DUPLICATE_REACH;
use crate::math::vector::norm;

/// Index of the closed contacts for a drift from some positions. Its memory is reused.
#[derive(Debug, Default)]
pub(crate) struct ActiveSetIndex<const D: usize> {
    /// Pairs of blocks with contacts between them, sorted.
    between: Vec<BlockPairRange>,
    /// The contacts, grouped by pair of blocks, in rising order along the axis of the pair.
    places: Vec<IndexedContact<D>>,
    /// Largest speed of a node of a main feature, m/s.
    fastest: f64,
}

/// Contacts between two blocks.
#[derive(Debug)]
struct BlockPairRange {
    blocks: [u32; 2],
    places: Range<usize>,
    /// Axis along which the contacts are spread farthest.
    axis: usize,
    /// Largest extent of a main feature along the axis, m.
    longest: f64,
}

/// A contact, by its index, with the box around the nodes of its main feature.
#[derive(Debug)]
struct IndexedContact<const D: usize> {
    blocks: [u32; 2],
    nodes: Aabb<D>,
    number: u32,
}

impl<const D: usize> ActiveSetIndex<D> {
    /// Replaces the content by these contacts.
    pub(crate) fn rebuild(
        &mut self,
        contact: &[ContactPoint<D>],
        surface: &dyn Surface<D>,
        motion: ConstantMotion<D>,
    ) {
        let place = |(number, contact): (u32, &ContactPoint<D>)| IndexedContact {
            blocks: ordered(contact.history.blocks),
            nodes: around_nodes(surface, contact.pair, motion.at, 0.0),
            number,
        };
        self.places.clear();
        self.places.extend((0..).zip(contact).map(place));
        self.places
            .sort_unstable_by_key(|place| (place.blocks, place.number));
        self.between.clear();
        let mut first = 0;
        for same in self
            .places
            .chunk_by_mut(|one, other| one.blocks == other.blocks)
        {
            self.between.push(BlockPairRange::sort(same, first));
            first += same.len();
        }
        let nodes = contact
            .iter()
            .flat_map(|contact| surface.main_nodes(contact.pair.main));
        self.fastest = fastest(nodes, motion.velocity);
    }

    /// Returns the contacts that may duplicate a touch of `pair`, or of a pair beside it,
    /// within `duration` seconds; and possibly some more.
    pub(crate) fn nearby<'a>(
        &self,
        contact: &'a [ContactPoint<D>],
        context: &ContactContext<D>,
        motion: ConstantMotion<D>,
        pair: Pair,
        duration: f64,
    ) -> impl Iterator<Item = &'a ContactPoint<D>> + Clone {
        let surface = context.surface;
        let own = fastest(surface.main_nodes(pair.main), motion.velocity);
        let margin = DUPLICATE_REACH * context.resolution + (own + self.fastest) * duration;
        let touch = around_nodes(surface, pair, motion.at, margin);
        let blocks = ordered(context.blocks(pair));
        let between = self.between.binary_search_by_key(&blocks, |b| b.blocks);
        let (places, axis, lowest) = between.map_or((&self.places[..0], 0, 0.0), |number| {
            let between = &self.between[number];
            let axis = between.axis;
            let lowest = touch.min[axis] - between.longest;
            (&self.places[between.places.clone()], axis, lowest)
        });
        let first = places.partition_point(|place| place.nodes.min[axis] < lowest);
        let near = places[first..].iter();
        near.take_while(move |place| place.nodes.min[axis] <= touch.max[axis])
            .filter(move |place| place.nodes.overlaps(&touch))
            .map(|place| &contact[place.number as usize])
    }
}

impl BlockPairRange {
    /// Sorts the contacts of two blocks, which begin at index `first`.
    fn sort<const D: usize>(places: &mut [IndexedContact<D>], first: usize) -> Self {
        let lower = Aabb::around(places.iter().map(|place| place.nodes.min), 0.0);
        let spread = |c: &usize| lower.max[*c] - lower.min[*c];
        let farthest = (0..D).max_by(|a, b| spread(a).total_cmp(&spread(b)));
        let axis = farthest.unwrap_or(0);
        places.sort_unstable_by(|one, other| {
            let along = one.nodes.min[axis].total_cmp(&other.nodes.min[axis]);
            along.then(one.number.cmp(&other.number))
        });
        let lengths = places.iter().map(|p| p.nodes.max[axis] - p.nodes.min[axis]);
        Self {
            blocks: places[0].blocks,
            places: first..first + places.len(),
            axis,
            longest: lengths.fold(0.0, f64::max),
        }
    }
}

/// Returns the box around the nodes of a pair's main feature, grown by a margin, m.
fn around_nodes<const D: usize>(
    surface: &dyn Surface<D>,
    pair: Pair,
    at: Configuration<D>,
    margin: f64,
) -> Aabb<D> {
    let nodes = surface.main_nodes(pair.main).iter();
    Aabb::around(nodes.map(|&node| at.at(node)), margin)
}

/// Returns the largest speed of nodes, m/s.
fn fastest<'a, const D: usize>(
    nodes: impl IntoIterator<Item = &'a u32>,
    velocity: &[[f64; D]],
) -> f64 {
    let speeds = nodes
        .into_iter()
        .map(|&node| norm(&velocity[node as usize]));
    speeds.fold(0.0, f64::max)
}
