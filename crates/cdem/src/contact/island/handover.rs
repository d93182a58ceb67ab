//! Hand-over of a kept gap or overlap. A contact may keep one: that of its blocks at t = 0, or one that a change
//! of mesh has made. Pairs beside it have this gap too, so the search does not find that they touch.
//! When the contact leaves the end of its target, these pairs begin in its place, open as far as it was.

use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::constraint::context::ContactContext;
use crate::contact::constraint::duplicate::DriftInterval;
use crate::contact::island::Island;
use crate::contact::narrow_phase::feature_selection::successors;
use crate::contact::surface::{Configuration, Pair};
use crate::math::vector::{add_scaled, pad};

/// A contact that has left the end of its target.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Departure {
    /// Pair of the point with the last target.
    pair: Pair,
    /// Main block.
    block: u32,
    /// Gap that the contact kept, m.
    kept_gap: f64,
}

impl Departure {
    /// Returns the departure of a contact, with the last `pair` of its point; `None` if it kept no gap.
    pub(crate) fn of<const D: usize>(
        contact: &ContactPoint<D>,
        pair: Pair,
        context: &ContactContext<D>,
    ) -> Option<Self> {
        contact.keeps_gap(context.resolution).then_some(Self {
            pair,
            block: contact.history.blocks[0],
            kept_gap: contact.offset[0],
        })
    }

    /// Returns the positions of all nodes with the main block moved onto the target, by the present `gap`
    /// of the pair, m.
    fn closed_positions<const D: usize>(
        &self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        gap: f64,
    ) -> Option<Vec<[f64; D]>> {
        let normal = context.surface.normal(self.pair, at)?;
        let position = |(node, block): (u32, &u32)| {
            let mut position = at.at(node);
            if *block == self.block {
                add_scaled(&mut position, -gap, &normal);
            }
            position
        };
        Some((0..).zip(context.block_of).map(position).collect())
    }
}

impl<const D: usize> Island<D> {
    /// Begins the contacts that take over from those that have departed. They keep the gaps of their
    /// pairs, less what these and the departed contact have opened. Returns the number of these contacts.
    pub(super) fn hand_over(
        &mut self,
        context: &ContactContext<D>,
        at: Configuration<D>,
        departures: &[Departure],
        time: f64,
    ) -> u64 {
        let mut begun = 0;
        for departure in departures {
            let (surface, resolution) = (context.surface, context.resolution);
            let gap = surface.gap_or_zero(departure.pair, at);
            let Some(positions) = departure.closed_positions(context, at, gap) else {
                continue;
            };
            let closed = Configuration::at_rest(&positions);
            let reach = resolution + surface.project(departure.pair, closed).outside;
            let pairs = successors(surface, departure.pair, closed, reach, resolution);
            let number = self.activate_pairs(context, DriftInterval::at_rest(closed), &pairs, time);
            let first = self.contact_points.len() - number as usize;
            for contact in &mut self.contact_points[first..] {
                let opening = (contact.offset[0] + gap - departure.kept_gap).max(0.0);
                contact.offset[0] = surface.gap_or_zero(contact.pair, at) - opening;
                contact.initial_gap = context
                    .initial_overlaps
                    .allowed_gap(contact.history.blocks, contact.offset[0]);
                contact.history.position = pad(&surface.point(contact.pair, at));
                contact.is_new = false;
            }
            begun += number;
        }
        begun
    }
}
