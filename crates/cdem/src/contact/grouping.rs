//! Pairs that are or may come in contact, put into islands; and the nodes that
//! count as one in the levels because of them.

use rayon::prelude::*;

use crate::contact::Contacts;
use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::detection::separation_bounds::SeparationBounds;
use crate::contact::interior::NeighbourNodes;
use crate::contact::island::Island;
use crate::contact::surface::Pair;
use crate::contact::tolerances::{JOIN_STEPS, PAIRS_PER_TASK};
use crate::model::inverse_mass::InverseMass;
use crate::model::time_levels::DisjointSets;

impl<const D: usize> Contacts<D> {
    /// Puts pairs that are or may come in contact into islands, if they or the
    /// levels have changed. `beside` visits the nodes that share an element
    /// and their level with a node.
    pub(crate) fn group(&mut self, inertia: &InverseMass<D>, beside: NeighbourNodes) {
        if !self.grouped {
            let contact = self.take_live();
            self.build_islands(contact, inertia, beside);
            (self.grouped, self.left) = (true, None);
        }
    }

    /// Takes the pairs found near at the start of a coarse step. Islands stay that have all of
    /// them, and of those that have left for no more than [`JOIN_STEPS`] steps.
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
                self.left.get_or_insert(number);
            }
        }
        self.lists.near = before;
        let has_its_own = |(number, island): (usize, &Island<D>)| {
            let mut contact = island.contact_points.iter();
            contact.all(|contact| self.island_of_pair(contact.pair) == Some(number))
        };
        let is_late = self.left.is_some_and(|left| number > left + JOIN_STEPS);
        self.grouped = self.grouped && !is_late && self.islands.iter().enumerate().all(has_its_own);
    }

    /// The island that has all nodes of a pair which may move.
    fn island_of_pair(&self, pair: Pair) -> Option<usize> {
        let island = |node: u32| {
            let node = node as usize;
            self.in_island[node].then(|| self.island_of[node] as usize)
        };
        let mut islands = self.moving_nodes(pair).map(island);
        let first = islands.next()??;
        islands.all(|island| island == Some(first)).then_some(first)
    }

    /// The pairs near that an island has, its number, and how far apart they were, m; `islands`
    /// is where to list those of all pairs.
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

    /// Gives islands the pairs near; what is known of those they had stays.
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

    /// Brings the joins up to date; whether any has come or gone.
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

    /// Lists all pairs that are near or closed, sorted.
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

    /// Nodes that count as one in the levels.
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

    /// Nodes of a pair that may move.
    fn moving_nodes(&self, pair: Pair) -> impl Iterator<Item = u32> + '_ {
        let moves = |node: &u32| !self.fixed[self.model_data.block_of[*node as usize] as usize];
        self.nodes_of(pair).filter(moves)
    }

    /// Pairs whose nodes a mass matrix couples, or an element: what touches in
    /// the middle of a drift acts on the elements around it.
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
        // What is known of the contacts of an island, and its storage, often serve its successor.
        let before = std::mem::take(&mut self.islands).into_iter();
        let before = before.filter_map(|island| Some((*island.nodes.first()?, island)));
        let mut before = before.peekable();
        // A set's smallest node comes first, and makes its island.
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

    /// Gives new islands the pairs near.
    pub(crate) fn give_near(&mut self) {
        let mut islands = std::mem::take(&mut self.islands);
        let terms = &self.model_data;
        for island in &mut islands {
            island.separation_bounds =
                SeparationBounds::new(&island.nodes, &terms.block_of, terms.tolerance, self.within);
        }
        let blocks = terms.blocks(&self.fixed);
        let mut list = std::mem::take(&mut self.lists.islands);
        for (pair, island, apart) in self.near_in_islands(&mut list) {
            let near = &mut islands[island].separation_bounds;
            near.push(blocks.surface, pair, blocks.of(pair), apart);
        }
        (self.islands, self.lists.islands) = (islands, list);
    }

    /// Nodes that move with the pairs near and closed, sorted; notes where each
    /// is among them.
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
            self.predicted_impact[node as usize] = place;
        }
        nodes
    }

    /// Sets of `nodes` that move each other, by their places.
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
                let first = *first.get_or_insert(self.predicted_impact[node as usize]);
                for coupled in inertia.coupled(node as usize) {
                    sets.join(first, self.predicted_impact[coupled]);
                }
            }
        }
        for (place, &node) in (0..).zip(nodes) {
            beside(node, &mut |other| {
                if self.in_island[other as usize] {
                    sets.join(place, self.predicted_impact[other as usize]);
                }
            });
        }
        sets.flatten();
        sets
    }
}
