//! Construction of islands from candidate and closed pairs, and of the sets of nodes that must
//! share a time level because of them.

use rayon::prelude::*;

use crate::contact::Contacts;
use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::detection::separation_bounds::SeparationBounds;
use crate::contact::interior::NeighbourNodes;
use crate::contact::island::Island;
use crate::contact::surface::Pair;
use crate::contact::tolerances::{JOIN_STEPS, PAIRS_PER_TASK};
use crate::math::disjoint_sets::DisjointSets;
use crate::model::inverse_mass::InverseMass;

impl<const D: usize> Contacts<D> {
    /// Builds the islands of candidate and closed pairs, if these or the time levels have
    /// changed. `beside` visits the nodes that share an element and their time level with a
    /// node.
    pub(crate) fn group(&mut self, inertia: &InverseMass<D>, beside: NeighbourNodes) {
        if !self.grouped {
            let contact = self.take_live();
            self.build_islands(contact, inertia, beside);
            (self.grouped, self.first_dropout_step) = (true, None);
        }
    }

    /// Takes the candidate pairs at the start of a coarse step. Keeps the islands if they
    /// contain all of these pairs; islands may contain pairs that are no longer candidates, for
    /// at most [`JOIN_STEPS`] steps.
    pub(crate) fn regroup(&mut self, number: u64) {
        std::mem::swap(&mut self.candidates, &mut self.lists.near);
        let before = std::mem::take(&mut self.lists.near);
        if self.grouped && before != self.candidates {
            let known = |pair: &Pair| before.binary_search(pair).is_ok();
            let mut anew = self.candidates.iter().filter(|pair| !known(pair));
            self.grouped = anew.all(|&pair| self.island_of_pair(pair).is_some());
            if self.grouped {
                self.update_near();
            }
            let stays = |pair: &Pair| self.candidates.binary_search(pair).is_ok();
            if !before.iter().all(stays) {
                self.first_dropout_step.get_or_insert(number);
            }
        }
        self.lists.near = before;
        let has_its_own = |(number, island): (usize, &Island<D>)| {
            let mut contact = island.contact_points.iter();
            contact.all(|contact| self.island_of_pair(contact.pair) == Some(number))
        };
        let is_late = self
            .first_dropout_step
            .is_some_and(|left| number > left + JOIN_STEPS);
        self.grouped = self.grouped && !is_late && self.islands.iter().enumerate().all(has_its_own);
    }

    /// Returns the island that contains all movable nodes of a pair.
    fn island_of_pair(&self, pair: Pair) -> Option<usize> {
        let island = |node: u32| {
            let node = node as usize;
            self.in_island[node].then(|| self.island_of[node] as usize)
        };
        let mut islands = self.moving_nodes(pair).map(island);
        let first = islands.next()??;
        islands.all(|island| island == Some(first)).then_some(first)
    }

    /// Returns each candidate pair that is in an island, with the index of the island and the
    /// distance of its features at the last test, m. `islands` is memory for a list.
    fn near_in_islands<'a>(
        &'a self,
        islands: &'a mut Vec<Option<usize>>,
    ) -> impl Iterator<Item = (Pair, usize, f64)> + 'a {
        let pairs = self.candidates.par_iter().with_min_len(PAIRS_PER_TASK);
        let of_pairs = pairs.map(|&pair| self.island_of_pair(pair));
        of_pairs.collect_into_vec(islands);
        let near = self
            .candidates
            .iter()
            .zip(islands)
            .zip(self.search.distances());
        near.filter_map(|((&pair, island), apart)| island.map(|island| (pair, island, apart)))
    }

    /// Updates the candidate pairs of the islands, and keeps the separation bounds of those
    /// they had.
    fn update_near(&mut self) {
        let mut islands = std::mem::take(&mut self.islands);
        islands
            .iter_mut()
            .for_each(|island| island.separation_bounds.restart());
        let blocks = self.model_data.blocks(&self.fixed);
        let mut list = std::mem::take(&mut self.lists.islands);
        for (pair, island, apart) in self.near_in_islands(&mut list) {
            let near = &mut islands[island].separation_bounds;
            if !near.keep(pair) {
                near.push(blocks.surface, pair, blocks.of(pair), apart);
            }
        }
        (self.islands, self.lists.islands) = (islands, list);
    }

    fn take_live(&mut self) -> Vec<ContactPoint<D>> {
        let mut contact: Vec<_> = self
            .islands
            .iter_mut()
            .flat_map(|i| i.contact_points.drain(..))
            .collect();
        contact.sort_by_key(|contact| contact.pair);
        contact
    }

    /// Updates the joined pairs. Returns true if any was added or removed.
    pub(crate) fn join(&mut self, number: u64) -> bool {
        self.list_near_or_closed();
        let listed = std::mem::take(&mut self.lists.near_or_closed);
        let mut now = listed.iter().copied().peekable();
        let mut joins = std::mem::take(&mut self.lists.joins);
        joins.clear();
        let mut changed = false;
        for &(pair, last) in &self.joins {
            while let Some(new) = now.next_if(|&other| other < pair) {
                joins.push((new, number));
                changed = true;
            }
            if now.next_if_eq(&pair).is_some() {
                joins.push((pair, number));
            } else if number <= last + JOIN_STEPS {
                joins.push((pair, last));
            } else {
                changed = true;
            }
        }
        changed |= now.peek().is_some();
        joins.extend(now.map(|pair| (pair, number)));
        self.lists.joins = std::mem::replace(&mut self.joins, joins);
        self.lists.near_or_closed = listed;
        changed
    }

    /// Lists all candidate and closed pairs, sorted.
    fn list_near_or_closed(&mut self) {
        let mut closed = std::mem::take(&mut self.lists.closed_beyond);
        let pairs = self.contact_points().map(|contact| contact.pair);
        closed.clear();
        closed.extend(pairs.filter(|pair| !self.search.is_near(*pair)));
        closed.sort_unstable();
        closed.dedup();
        let mut others = closed.iter().copied().peekable();
        let listed = &mut self.lists.near_or_closed;
        listed.clear();
        for &near in &self.candidates {
            while let Some(closed) = others.next_if(|closed| *closed < near) {
                listed.push(closed);
            }
            listed.push(near);
        }
        listed.extend(others);
        self.lists.closed_beyond = closed;
    }

    /// Joins the nodes that must share a time level.
    pub(crate) fn joined_nodes(&self, joined: &mut DisjointSets) {
        for &(pair, _) in &self.joins {
            let first = self.model_data.surface.main_nodes(pair.main)[0];
            let main = self.model_data.surface.main_nodes(pair.main).iter();
            for &node in main.chain(self.model_data.surface.target_nodes(pair.target)) {
                joined.join(first, node);
            }
        }
    }

    fn nodes_of(&self, pair: Pair) -> impl Iterator<Item = u32> + '_ {
        let main = self.model_data.surface.main_nodes(pair.main).iter();
        main.chain(self.model_data.surface.target_nodes(pair.target))
            .copied()
    }

    /// Returns the nodes of a pair that can move.
    fn moving_nodes(&self, pair: Pair) -> impl Iterator<Item = u32> + '_ {
        let moves = |node: &u32| !self.fixed[self.model_data.block_of[*node as usize] as usize];
        self.nodes_of(pair).filter(moves)
    }

    /// Builds the islands: sets of pairs whose nodes are coupled by a mass matrix or an
    /// element. Elements count because a touch in the middle of a drift acts on the elements
    /// around it.
    fn build_islands(
        &mut self,
        contact: Vec<ContactPoint<D>>,
        inertia: &InverseMass<D>,
        beside: NeighbourNodes,
    ) {
        for node in self.islands.iter().flat_map(|island| &island.nodes) {
            self.in_island[*node as usize] = false;
        }
        let nodes = self.take_nodes(&contact, inertia);
        let sets = self.coupled_sets(&nodes, &contact, inertia, beside);
        // An island often inherits the solver and memory of the one before with the same first
        // node.
        let before = std::mem::take(&mut self.islands).into_iter();
        let before = before.filter_map(|island| Some((*island.nodes.first()?, island)));
        let mut before = before.peekable();
        // The smallest node of a set comes first, and creates its island.
        let mut islands: Vec<Island<D>> = Vec::new();
        let mut island_of: Vec<u32> = Vec::with_capacity(nodes.len());
        for (place, &node) in (0..).zip(&nodes) {
            let root = sets.root(place);
            if root == place {
                island_of.push(islands.len() as u32);
                while before.next_if(|(first, _)| *first < node).is_some() {}
                let known = before.next_if(|(first, _)| *first == node);
                islands.push(
                    known
                        .map(|(_, island)| island.restart())
                        .unwrap_or_default(),
                );
            } else {
                island_of.push(island_of[root as usize]);
            }
            let island = island_of[place as usize];
            self.island_of[node as usize] = island;
            islands[island as usize].nodes.push(node);
        }
        for contact in contact {
            if let Some(island) = self.island_of_pair(contact.pair) {
                islands[island].contact_points.push(contact);
            }
        }
        self.islands = islands;
        self.give_near();
    }

    /// Gives the candidate pairs to new islands.
    pub(crate) fn give_near(&mut self) {
        let mut islands = std::mem::take(&mut self.islands);
        let terms = &self.model_data;
        for island in &mut islands {
            island.separation_bounds = SeparationBounds::new(
                &island.nodes,
                &terms.block_of,
                terms.tolerance,
                self.examined_distance,
            );
        }
        let blocks = terms.blocks(&self.fixed);
        let mut list = std::mem::take(&mut self.lists.islands);
        for (pair, island, apart) in self.near_in_islands(&mut list) {
            let near = &mut islands[island].separation_bounds;
            near.push(blocks.surface, pair, blocks.of(pair), apart);
        }
        (self.islands, self.lists.islands) = (islands, list);
    }

    /// Returns the nodes that move with candidate and closed pairs, sorted. Records the index
    /// of each.
    fn take_nodes(&mut self, contact: &[ContactPoint<D>], inertia: &InverseMass<D>) -> Vec<u32> {
        let mut taken = std::mem::take(&mut self.in_island);
        let mut nodes: Vec<u32> = Vec::new();
        let closed = contact.iter().map(|contact| contact.pair);
        for pair in self.candidates.iter().copied().chain(closed) {
            for node in self.moving_nodes(pair) {
                for coupled in inertia.coupled(node as usize) {
                    if !std::mem::replace(&mut taken[coupled], true) {
                        nodes.push(coupled as u32);
                    }
                }
            }
        }
        self.in_island = taken;
        nodes.sort_unstable();
        for (place, &node) in (0..).zip(&nodes) {
            self.island_node_index[node as usize] = place;
        }
        nodes
    }

    /// Returns the sets of coupled nodes among `nodes`, by index.
    fn coupled_sets(
        &self,
        nodes: &[u32],
        contact: &[ContactPoint<D>],
        inertia: &InverseMass<D>,
        beside: NeighbourNodes,
    ) -> DisjointSets {
        let mut sets = DisjointSets::new(nodes.len());
        let closed = contact.iter().map(|contact| contact.pair);
        for pair in self.candidates.iter().copied().chain(closed) {
            let mut first = None;
            for node in self.moving_nodes(pair) {
                let first = *first.get_or_insert(self.island_node_index[node as usize]);
                for coupled in inertia.coupled(node as usize) {
                    sets.join(first, self.island_node_index[coupled]);
                }
            }
        }
        for (place, &node) in (0..).zip(nodes) {
            beside(node, &mut |other| {
                if self.in_island[other as usize] {
                    sets.join(place, self.island_node_index[other as usize]);
                }
            });
        }
        sets.flatten();
        sets
    }
}
