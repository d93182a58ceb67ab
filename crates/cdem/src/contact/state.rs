//! State of contact, which a restart needs, and workspace, which can be rebuilt from it.

use serde::{Deserialize, Serialize};

use crate::contact::constraint::contact_history::ContactHistory;
use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::detection::candidates::CandidateSearch;
use crate::contact::energy::ContactEnergies;
use crate::contact::grouping::IslandIndex;
use crate::contact::island::Island;
use crate::contact::island::parallel::VelocityCopies;
use crate::contact::surface::Pair;
use crate::contact::surface::geometry_cache::GeometryCache;
use crate::math::restore::{ResumeError, require};

/// All of contact that a restart needs. Surfaces, laws and initial overlaps are built anew from
/// the scene and the mesh.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct ContactState<const D: usize> {
    /// True if nodes have moved farther in a coarse step than their motion bound, in any step
    /// since the flag was last taken.
    pub(super) search_overrun: bool,
    /// Near pairs of this coarse step, sorted; and the motion bound of each block in it, m.
    pub(super) near_pairs: Vec<Pair>,
    pub(super) motion_bounds: Vec<f64>,
    /// Pairs whose nodes share a time level, with the last coarse step that needed it.
    pub(super) joins: Vec<(Pair, u64)>,
    pub(super) islands: Vec<Island<D>>,
    /// The first coarse step since the islands were made in which a near pair dropped out.
    pub(super) first_dropout_step: Option<u64>,
    /// Contacts that have ended and have not been reported.
    pub(super) ended: Vec<ContactHistory>,
    /// The number of entries of `ended` from before this coarse step.
    pub(super) ended_before: usize,
    pub(super) energies: ContactEnergies,
}

impl<const D: usize> ContactState<D> {
    /// Returns all contact points.
    pub(super) fn contact_points(&self) -> impl Iterator<Item = &ContactPoint<D>> + Clone {
        let islands = self.islands.iter();
        islands.flat_map(|island| &island.contact_points)
    }

    /// Takes all contact points out of the islands, sorted by pair.
    pub(super) fn take_contact_points(&mut self) -> Vec<ContactPoint<D>> {
        let islands = self.islands.iter_mut();
        let points = islands.flat_map(|island| island.contact_points.drain(..));
        let mut points: Vec<_> = points.collect();
        points.sort_by_key(|point| point.pair);
        points
    }

    /// Checks that the state is of this number of nodes and blocks, and of a surface on which
    /// `has` is true for the pairs that exist.
    ///
    /// # Errors
    /// If it belongs to other blocks.
    pub(super) fn check(
        &self,
        nodes: usize,
        blocks: usize,
        has: impl Fn(Pair) -> bool,
    ) -> Result<(), ResumeError> {
        let pairs = self.contact_points().map(|point| point.pair);
        let pairs = pairs.chain(self.joins.iter().map(|&(pair, _)| pair));
        let mut pairs = pairs.chain(self.near_pairs.iter().copied());
        require(
            pairs.all(&has) && self.near_pairs.is_sorted(),
            "its contacts",
        )?;
        let is_known = |history: &ContactHistory| {
            let mut of = history.blocks.iter();
            of.all(|&block| (block as usize) < blocks)
        };
        let histories = self.contact_points().map(|point| &point.history);
        let bounds = self.motion_bounds.len();
        require(
            histories.chain(&self.ended).all(is_known) && (bounds == blocks || bounds == 0),
            "its blocks",
        )?;
        let is_node = |&node: &u32| (node as usize) < nodes;
        let are_sorted = |island: &Island<D>| {
            island.nodes.is_sorted_by(|a, b| a < b) && island.nodes.iter().all(is_node)
        };
        require(self.islands.iter().all(are_sorted), "its islands")?;
        require(
            self.ended_before <= self.ended.len(),
            "its list of contacts",
        )
    }
}

/// Memory of contact that [`ContactWorkspace::new`] rebuilds from the state between any two
/// steps.
pub(super) struct ContactWorkspace<const D: usize> {
    pub(super) search: CandidateSearch<D>,
    /// True if the near and joined pairs are no longer all in islands.
    pub(super) islands_outdated: bool,
    pub(super) index: IslandIndex,
    pub(super) lists: StepLists,
    /// Copies of the velocities, one for each thread in a kick.
    pub(super) velocity_copies: VelocityCopies<D>,
    /// Geometry cache of the surface in a kick.
    pub(super) geometry_cache: Option<GeometryCache<D>>,
}

impl<const D: usize> ContactWorkspace<D> {
    /// Returns the workspace of `islands` that contain all near pairs, in a mesh of this
    /// number of nodes.
    pub(super) fn new(nodes: usize, islands: &[Island<D>]) -> Self {
        Self {
            search: CandidateSearch::default(),
            islands_outdated: false,
            index: IslandIndex::new(nodes, islands),
            lists: StepLists::default(),
            velocity_copies: VelocityCopies::default(),
            geometry_cache: None,
        }
    }
}

/// Lists of a coarse step. Kept to reuse their memory.
#[derive(Default)]
pub(super) struct StepLists {
    /// Near pairs from the search, until they become those of the state.
    pub(super) near_pairs: Vec<Pair>,
    pub(super) near_or_closed: Vec<Pair>,
    pub(super) closed_beyond: Vec<Pair>,
    pub(super) joins: Vec<(Pair, u64)>,
    /// Pairs of blocks in contact.
    pub(super) touching: Vec<[u32; 2]>,
    /// Index of the island of each near pair.
    pub(super) islands: Vec<Option<usize>>,
}
