//! Construction of islands from near and closed pairs, and of the sets of nodes that must
//! share a time level because of them.

use rayon::prelude::*;

use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::detection::separation_bounds::SeparationBounds;
use crate::contact::island::Island;
use crate::contact::surface::Pair;
use crate::contact::timing::ElementNeighbours;
use crate::contact::tolerances::{JOIN_STEPS, PAIRS_PER_TASK};
use crate::contact::{ContactModelData, Contacts};
use crate::math::disjoint_sets::DisjointSets;
use crate::model::inverse_mass::InverseMass;

impl<const D: usize> Contacts<D> {
    /// Builds the islands of near and closed pairs, if these or the time levels have
    /// changed.
    pub(crate) fn group(&mut self, inertia: &InverseMass<D>, neighbours: ElementNeighbours) {
        if self.workspace.islands_outdated {
            let contact_points = self.state.take_contact_points();
            self.build_islands(contact_points, inertia, neighbours);
            self.workspace.islands_outdated = false;
            self.state.first_dropout_step = None;
        }
    }

    /// Takes the near pairs at the start of a coarse step. Keeps the islands if they
    /// contain all of these pairs; islands may contain pairs that are no longer near, for
    /// at most [`JOIN_STEPS`] steps.
    pub(crate) fn regroup(&mut self, number: u64) {
        std::mem::swap(
            &mut self.state.near_pairs,
            &mut self.workspace.lists.near_pairs,
        );
        let (now, before) = (&self.state.near_pairs, &self.workspace.lists.near_pairs);
        let mut are_grouped = !self.workspace.islands_outdated;
        if are_grouped && before != now {
            let known = |pair: &Pair| before.binary_search(pair).is_ok();
            let mut anew = now.iter().filter(|pair| !known(pair));
            are_grouped = anew.all(|&pair| self.island_of_pair(pair).is_some());
            let stays = |pair: &Pair| now.binary_search(pair).is_ok();
            let drops_out = !before.iter().all(stays);
            if are_grouped {
                self.update_separation_bounds();
            }
            if drops_out {
                self.state.first_dropout_step.get_or_insert(number);
            }
        }
        let has_its_own = |(number, island): (usize, &Island<D>)| {
            let mut points = island.contact_points.iter();
            points.all(|point| self.island_of_pair(point.pair) == Some(number))
        };
        let dropout = self.state.first_dropout_step;
        let is_late = dropout.is_some_and(|step| number > step + JOIN_STEPS);
        let mut islands = self.state.islands.iter().enumerate();
        self.workspace.islands_outdated = !are_grouped || is_late || !islands.all(has_its_own);
    }

    /// Returns the island that contains all movable nodes of a pair.
    fn island_of_pair(&self, pair: Pair) -> Option<usize> {
        let nodes = self.model_data.moving_nodes(pair);
        self.workspace.index.common(nodes)
    }

    /// Updates the near pairs of the islands. Keeps the separation bounds of the pairs that
    /// they had.
    fn update_separation_bounds(&mut self) {
        for island in &mut self.state.islands {
            island.separation_bounds.restart();
        }
        self.give_near_pairs();
    }

    /// Updates the joined pairs. Returns true if any was added or removed.
    pub(crate) fn join(&mut self, number: u64) -> bool {
        self.list_near_or_closed();
        let lists = &mut self.workspace.lists;
        let mut now = lists.near_or_closed.iter().copied().peekable();
        lists.joins.clear();
        let mut changed = false;
        for &(pair, last) in &self.state.joins {
            while let Some(new) = now.next_if(|&other| other < pair) {
                lists.joins.push((new, number));
                changed = true;
            }
            if now.next_if_eq(&pair).is_some() {
                lists.joins.push((pair, number));
            } else if number <= last + JOIN_STEPS {
                lists.joins.push((pair, last));
            } else {
                changed = true;
            }
        }
        changed |= now.peek().is_some();
        lists.joins.extend(now.map(|pair| (pair, number)));
        std::mem::swap(&mut lists.joins, &mut self.state.joins);
        changed
    }

    /// Lists all near and closed pairs, sorted.
    fn list_near_or_closed(&mut self) {
        let (state, lists) = (&self.state, &mut self.workspace.lists);
        let closed = &mut lists.closed_beyond;
        let pairs = state.contact_points().map(|point| point.pair);
        closed.clear();
        closed.extend(pairs.filter(|pair| state.near_pairs.binary_search(pair).is_err()));
        closed.sort_unstable();
        closed.dedup();
        let mut others = closed.iter().copied().peekable();
        let listed = &mut lists.near_or_closed;
        listed.clear();
        for &near in &state.near_pairs {
            while let Some(closed) = others.next_if(|closed| *closed < near) {
                listed.push(closed);
            }
            listed.push(near);
        }
        listed.extend(others);
    }

    /// Joins the nodes that must share a time level.
    pub(crate) fn joined_nodes(&self, joined: &mut DisjointSets) {
        for &(pair, _) in &self.state.joins {
            let first = self.model_data.surface.main_nodes(pair.main)[0];
            for node in self.model_data.nodes_of(pair) {
                joined.join(first, node);
            }
        }
    }

    /// Builds the islands: sets of pairs whose nodes are coupled by a mass matrix or an
    /// element. Elements count because a touch in the middle of a drift acts on the elements
    /// around it.
    fn build_islands(
        &mut self,
        contact_points: Vec<ContactPoint<D>>,
        inertia: &InverseMass<D>,
        neighbours: ElementNeighbours,
    ) {
        let (data, state, index) = (&self.model_data, &mut self.state, &mut self.workspace.index);
        for node in state.islands.iter().flat_map(|island| &island.nodes) {
            index.in_island[*node as usize] = false;
        }
        let closed = contact_points.iter().map(|point| point.pair);
        let pairs = state.near_pairs.iter().copied().chain(closed);
        let nodes = index.set_nodes(pairs.clone(), data, inertia);
        let sets = index.coupled_sets(&nodes, pairs, data, inertia, neighbours);
        // An island often inherits the solver and memory of the one before with the same first
        // node.
        let before = state.islands.drain(..);
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
            index.island_of[node as usize] = island;
            islands[island as usize].nodes.push(node);
        }
        for point in contact_points {
            if let Some(island) = index.common(data.moving_nodes(point.pair)) {
                islands[island].contact_points.push(point);
            }
        }
        drop(before);
        state.islands = islands;
        self.set_separation_bounds();
    }

    /// Gives the near pairs to new islands.
    pub(super) fn set_separation_bounds(&mut self) {
        let data = &self.model_data;
        for island in &mut self.state.islands {
            island.separation_bounds = SeparationBounds::new(
                &island.nodes,
                &data.block_of,
                data.resolution,
                data.examined_distance,
            );
        }
        self.give_near_pairs();
    }

    /// Adds each near pair that is in an island to its separation bounds, with the distance of
    /// its features at the last test. A pair that is there already stays as it is.
    fn give_near_pairs(&mut self) {
        let Self {
            model_data: data,
            state,
            workspace,
        } = self;
        let pairs = state.near_pairs.par_iter().with_min_len(PAIRS_PER_TASK);
        let of_pairs = pairs.map(|&pair| workspace.index.common(data.moving_nodes(pair)));
        let islands = &mut workspace.lists.islands;
        of_pairs.collect_into_vec(islands);
        let context = data.search_context();
        let pairs = state.near_pairs.iter().zip(islands);
        for (index, (&pair, island)) in pairs.enumerate() {
            let Some(island) = island else { continue };
            let bounds = &mut state.islands[*island].separation_bounds;
            if !bounds.keep(pair) {
                let distance = workspace.search.distance(index);
                bounds.push(context.surface, pair, context.of(pair), distance);
            }
        }
    }
}

/// The islands by node.
pub(super) struct IslandIndex {
    /// True for each node that moves with an island.
    pub(super) in_island: Vec<bool>,
    /// Index of the island of each such node.
    island_of: Vec<u32>,
    /// Index of each such node in the sorted list of all of them. Set while islands are built.
    island_node_index: Vec<u32>,
}

impl IslandIndex {
    pub(super) fn new<const D: usize>(nodes: usize, islands: &[Island<D>]) -> Self {
        let mut index = Self {
            in_island: vec![false; nodes],
            island_of: vec![0; nodes],
            island_node_index: vec![0; nodes],
        };
        for (number, island) in (0..).zip(islands) {
            for &node in &island.nodes {
                index.in_island[node as usize] = true;
                index.island_of[node as usize] = number;
            }
        }
        index
    }

    /// Returns the island that contains all of these nodes.
    fn common(&self, nodes: impl Iterator<Item = u32>) -> Option<usize> {
        let island = |node: u32| {
            let node = node as usize;
            self.in_island[node].then(|| self.island_of[node] as usize)
        };
        let mut islands = nodes.map(island);
        let first = islands.next()??;
        islands.all(|island| island == Some(first)).then_some(first)
    }

    /// Sets and returns the nodes that move with these pairs, sorted.
    fn set_nodes<const D: usize>(
        &mut self,
        pairs: impl Iterator<Item = Pair>,
        data: &ContactModelData<D>,
        inertia: &InverseMass<D>,
    ) -> Vec<u32> {
        let mut nodes: Vec<u32> = Vec::new();
        for pair in pairs {
            for node in data.moving_nodes(pair) {
                for coupled in inertia.coupled(node as usize) {
                    if !std::mem::replace(&mut self.in_island[coupled], true) {
                        nodes.push(coupled as u32);
                    }
                }
            }
        }
        nodes.sort_unstable();
        for (place, &node) in (0..).zip(&nodes) {
            self.island_node_index[node as usize] = place;
        }
        nodes
    }

    /// Returns the sets of coupled nodes among `nodes`, by index.
    fn coupled_sets<const D: usize>(
        &self,
        nodes: &[u32],
        pairs: impl Iterator<Item = Pair>,
        data: &ContactModelData<D>,
        inertia: &InverseMass<D>,
        neighbours: ElementNeighbours,
    ) -> DisjointSets {
        let index_of = &self.island_node_index;
        let mut sets = DisjointSets::new(nodes.len());
        for pair in pairs {
            let mut first = None;
            for node in data.moving_nodes(pair) {
                let first = *first.get_or_insert(index_of[node as usize]);
                for coupled in inertia.coupled(node as usize) {
                    sets.join(first, index_of[coupled]);
                }
            }
        }
        for (place, &node) in (0..).zip(nodes) {
            for other in neighbours.of(node) {
                if self.in_island[other as usize] {
                    sets.join(place, index_of[other as usize]);
                }
            }
        }
        sets.flatten();
        sets
    }
}
