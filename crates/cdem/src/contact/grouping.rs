//! Pairs that are or may come in contact, put into islands; and the nodes that
//! count as one in the levels because of them.

use crate::contact::island::Island;
use crate::contact::live::Live;
use crate::contact::surface::Pair;
use crate::contact::{Beside, Contacts, STAY};
use crate::model::inertia::Inertia;
use crate::step::levels::Joined;

impl<const D: usize> Contacts<D> {
    /// Puts pairs that are or may come in contact into islands, if they or the
    /// levels have changed. `beside` visits the nodes that share an element
    /// and their level with a node.
    pub(crate) fn group(&mut self, inertia: &Inertia<D>, beside: Beside) {
        if !self.grouped {
            let live = self.take_live();
            self.build_islands(live, inertia, beside);
            self.grouped = true;
        }
    }

    fn take_live(&mut self) -> Vec<Live<D>> {
        let mut live: Vec<_> = self
            .islands
            .iter_mut()
            .flat_map(|i| i.live.drain(..))
            .collect();
        live.sort_by_key(|live| live.pair);
        live
    }

    /// Brings the joins up to date; whether any has come or gone.
    pub(super) fn join(&mut self, number: u64) -> bool {
        let now = self.near.iter().copied();
        let now = now.chain(self.live().map(|live| live.pair));
        let mut joins: Vec<(Pair, u64)> = now.map(|pair| (pair, number)).collect();
        joins.extend(self.joins.iter().filter(|(_, last)| number <= last + STAY));
        joins.sort_by_key(|&(pair, last)| (pair, std::cmp::Reverse(last)));
        joins.dedup_by_key(|join| join.0);
        let changed = !joins
            .iter()
            .map(|join| join.0)
            .eq(self.joins.iter().map(|join| join.0));
        self.joins = joins;
        changed
    }

    /// Nodes that count as one in the levels.
    pub(crate) fn joined_nodes(&self, joined: &mut Joined) {
        for &(pair, _) in &self.joins {
            let first = self.terms.surface.main_nodes(pair.main)[0];
            let main = self.terms.surface.main_nodes(pair.main).iter();
            for &node in main.chain(self.terms.surface.target_nodes(pair.target)) {
                joined.join(first, node);
            }
        }
    }

    fn nodes_of(&self, pair: Pair) -> impl Iterator<Item = u32> + '_ {
        let main = self.terms.surface.main_nodes(pair.main).iter();
        main.chain(self.terms.surface.target_nodes(pair.target))
            .copied()
    }

    /// Nodes of a pair that may move.
    fn moving_nodes(&self, pair: Pair) -> impl Iterator<Item = u32> + '_ {
        let moves = |node: &u32| !self.fixed[self.terms.block_of[*node as usize] as usize];
        self.nodes_of(pair).filter(moves)
    }

    /// Pairs whose nodes a mass matrix couples, or an element: what touches in
    /// the middle of a drift acts on the elements around it.
    fn build_islands(&mut self, live: Vec<Live<D>>, inertia: &Inertia<D>, beside: Beside) {
        let near = &self.near;
        for island in &self.islands {
            for &node in &island.nodes {
                self.in_island[node as usize] = false;
            }
        }
        let (nodes, sets) = self.coupled_sets(&live, inertia, beside);
        let mut roots: Vec<u32> = nodes.iter().map(|&node| sets.root(node)).collect();
        roots.sort_unstable();
        roots.dedup();
        let mut islands = vec![Island::default(); roots.len()];
        let island_of = |node: u32| roots.partition_point(|&root| root < sets.root(node));
        for &node in &nodes {
            islands[island_of(node)].nodes.push(node);
            self.in_island[node as usize] = true;
        }
        let of_pair = |pair: Pair| self.moving_nodes(pair).next().map(island_of);
        for &pair in near {
            if let Some(island) = of_pair(pair) {
                islands[island].near.push(pair);
            }
        }
        for live in live {
            if let Some(island) = of_pair(live.pair) {
                islands[island].live.push(live);
            }
        }
        self.islands = islands;
    }

    /// Nodes of all pairs near and closed, sorted, and the sets of them that
    /// move each other.
    fn coupled_sets(
        &self,
        live: &[Live<D>],
        inertia: &Inertia<D>,
        beside: Beside,
    ) -> (Vec<u32>, Joined) {
        let mut sets = Joined::new(self.terms.block_of.len());
        let mut nodes: Vec<u32> = Vec::new();
        let closed = live.iter().map(|live| live.pair);
        for pair in self.near.iter().copied().chain(closed) {
            let mut first = None;
            for node in self.moving_nodes(pair) {
                for coupled in inertia.coupled(node as usize) {
                    sets.join(*first.get_or_insert(node), coupled as u32);
                    nodes.push(coupled as u32);
                }
            }
        }
        nodes.sort_unstable();
        nodes.dedup();
        for &node in &nodes {
            beside(node, &mut |other| {
                if nodes.binary_search(&other).is_ok() {
                    sets.join(node, other);
                }
            });
        }
        (nodes, sets)
    }
}
