//! Context of contact: surfaces, laws and masses that all stages share.

use crate::contact::constraint::initial_overlap::InitialOverlaps;
use crate::contact::constraint::law::ContactLaws;
use crate::contact::surface::{Pair, Surface};
use crate::contact::tolerances::LEAST_MOVE;
use crate::model::inverse_mass::{InverseMass, KickMobility};

/// References to all that contact needs from the model.
#[derive(Clone, Copy)]
pub(crate) struct ContactContext<'a, const D: usize> {
    pub(crate) surface: &'a dyn Surface<D>,
    pub(crate) laws: &'a ContactLaws,
    pub(crate) block_of: &'a [u32],
    pub(crate) inertia: &'a InverseMass<D>,
    /// Mass-proportional damping of each block, 1/s.
    pub(crate) damping: &'a [f64],
    /// Contact resolution, m: points of boundaries no farther apart are not told apart.
    pub(crate) resolution: f64,
    /// Coarse step, s.
    pub(crate) coarse_step: f64,
    /// Overlaps of the blocks at t = 0.
    pub(crate) initial_overlaps: &'a InitialOverlaps,
    /// The number of halvings of the elements at each node.
    pub(crate) halvings: &'a [u8],
}

impl<'a, const D: usize> ContactContext<'a, D> {
    /// Returns the blocks of a pair: main and target.
    pub(crate) fn blocks(&self, pair: Pair) -> [u32; 2] {
        let main = self.surface.main_nodes(pair.main)[0];
        let target = self.surface.target_nodes(pair.target)[0];
        [main, target].map(|node| self.block_of[node as usize])
    }

    /// Returns the number of halvings of the elements at a pair, on its finer side.
    pub(crate) fn halvings_at(&self, pair: Pair) -> u32 {
        let main = self.surface.main_nodes(pair.main).iter();
        let nodes = main.chain(self.surface.target_nodes(pair.target));
        let halvings = nodes.map(|&node| u32::from(self.halvings[node as usize]));
        halvings.max().unwrap_or_default()
    }

    /// Returns the relative velocity, m/s, that moves points by no more than round-off over a
    /// drift of `drift` seconds.
    pub(crate) fn least_speed(&self, drift: f64) -> f64 {
        LEAST_MOVE * self.resolution / drift
    }

    /// Returns the response to impulses in a kick of `interval` seconds; 0 means at an instant.
    pub(crate) fn mobility(&self, interval: f64) -> KickMobility<'a, D> {
        KickMobility {
            inertia: self.inertia,
            block_of: self.block_of,
            damping: self.damping,
            interval,
        }
    }
}
