//! Contact in a checkpoint.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::contact::Contacts;
use crate::contact::constraint::contact_point::ContactHistory;
use crate::contact::detection::candidates::CandidateSearch;
use crate::contact::energy::ContactEnergies;
use crate::contact::island::Island;
use crate::contact::surface::Pair;
use crate::math::restore::{ResumeError, require};

/// State of contact between steps: fields of [`Contacts`]. Surfaces, laws and initial overlaps
/// are built anew.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct SavedContacts<'a, const D: usize> {
    search: Cow<'a, CandidateSearch<D>>,
    outrun: bool,
    near: Cow<'a, [Pair]>,
    joins: Cow<'a, [(Pair, u64)]>,
    islands: Cow<'a, [Island<D>]>,
    left: Option<u64>,
    ended: Cow<'a, [ContactHistory]>,
    ended_before: usize,
    energies: ContactEnergies,
}

impl<const D: usize> Contacts<D> {
    /// Returns the state for a checkpoint.
    pub(crate) fn saved(&self) -> SavedContacts<'_, D> {
        SavedContacts {
            search: Cow::Borrowed(&self.search),
            outrun: self.search_overrun,
            near: Cow::Borrowed(&self.candidates),
            joins: Cow::Borrowed(&self.joins),
            islands: Cow::Borrowed(&self.islands),
            left: self.first_dropout_step,
            ended: Cow::Borrowed(&self.ended),
            ended_before: self.ended_before,
            energies: self.energies,
        }
    }

    /// Restores a saved state. The surface must be that of the time of saving.
    ///
    /// # Errors
    /// If the saved state belongs to other blocks.
    pub(crate) fn restore(&mut self, saved: SavedContacts<D>) -> Result<(), ResumeError> {
        let nodes = self.model_data.block_of.len();
        self.check(&saved)?;
        let watch = self.energies.watch;
        self.search = saved.search.into_owned();
        self.search.restore();
        self.search_overrun = saved.outrun;
        self.candidates = saved.near.into_owned();
        self.joins = saved.joins.into_owned();
        self.islands = saved.islands.into_owned();
        self.in_island = vec![false; nodes];
        for (number, island) in (0..).zip(&self.islands) {
            for &node in &island.nodes {
                self.in_island[node as usize] = true;
                self.island_of[node as usize] = number;
            }
        }
        (self.grouped, self.first_dropout_step) = (true, saved.left);
        (self.ended, self.ended_before) = (saved.ended.into_owned(), saved.ended_before);
        self.energies = ContactEnergies {
            watch,
            ..saved.energies
        };
        self.give_near();
        Ok(())
    }

    /// Checks that the saved state fits these nodes, features and blocks.
    fn check(&self, saved: &SavedContacts<D>) -> Result<(), ResumeError> {
        let (nodes, blocks) = (self.model_data.block_of.len(), self.fixed.len());
        let families = self.model_data.surface.families();
        let has = |pair: Pair| {
            let mut families = families.iter();
            families
                .any(|[main, target]| main.contains(&pair.main) && target.contains(&pair.target))
        };
        let is_known = |history: &ContactHistory| {
            let mut of = history.blocks.iter();
            of.all(|&block| (block as usize) < blocks)
        };
        let contact = || {
            saved
                .islands
                .iter()
                .flat_map(|island| &island.contact_points)
        };
        let pairs = contact().map(|contact| contact.pair);
        let pairs = pairs.chain(saved.joins.iter().map(|&(pair, _)| pair));
        let mut pairs = pairs.chain(saved.near.iter().copied());
        require(
            pairs.all(has) && saved.search.is_of(nodes, blocks, &has),
            "its contacts",
        )?;
        let records = contact().map(|contact| &contact.history);
        require(records.chain(&*saved.ended).all(is_known), "its blocks")?;
        let is_node = |&node: &u32| (node as usize) < nodes;
        let are_sorted = |island: &Island<D>| {
            island.nodes.is_sorted_by(|a, b| a < b) && island.nodes.iter().all(is_node)
        };
        require(saved.islands.iter().all(are_sorted), "its islands")?;
        require(
            saved.ended_before <= saved.ended.len(),
            "its list of contacts",
        )
    }
}
