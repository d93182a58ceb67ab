//! The step of an impact inside the bodies (the paper's section 3): the
//! elements around a point that touches in the middle of a drift.
//!
//! Forces act at the ends of a drift only. Let a touch change velocities from
//! w₀ to w₁, r seconds before the end. An element's energy ½v⁻·M·v⁺ + U, which
//! central differences keep, stays in balance when its force at the end acts
//! for the interval L' = r + ρ(L − r) that precedes, not for the whole interval
//! L: ρ is the energy of its strain rate before the touch over that after it, 0
//! for a body that flies undeformed. The impulse α f, α = ½(L − L'), that is taken
//! there is given at the touch, so that no force is lost; it makes velocities w₂.
//! And the touch loses its energy at its instant, not in the middle of the
//! drift for which velocities stand: (L/2 − r)·f·(w₂ − w₀) − ½α f·(w₂ − w₁) less,
//! and r·((L − r) q₀ − (L' − r) q₂) less with the rates' energies q₀ and q₂ at w₀
//! and w₂, which is nothing unless ρ had to be cut.

use crate::contact::{Interior, Jump};
use crate::element::ElementSet;
use crate::mesh::Element;
use crate::model::inertia::Inertia;
use crate::model::motion::Motion;
use crate::step::levels::Levels;
use crate::vector::{dot, scale, sub};

/// Largest ρ: a force never acts for longer than its interval.
const MAX_RATIO: f64 = 1.0;

/// Elements around each node, as one list.
#[derive(Clone, Debug, Default)]
pub(crate) struct Around {
    start: Vec<u32>,
    elements: Vec<u32>,
}

impl Around {
    /// Elements around each of `count` nodes.
    pub(crate) fn new(elements: &[Element], count: usize) -> Self {
        let mut start = vec![0_u32; count + 1];
        for &node in elements.iter().flat_map(Element::nodes) {
            start[node as usize + 1] += 1;
        }
        for node in 0..count {
            start[node + 1] += start[node];
        }
        let mut next = start.clone();
        let mut around = vec![0; start[count] as usize];
        for (number, element) in elements.iter().enumerate() {
            for &node in element.nodes() {
                around[next[node as usize] as usize] = number as u32;
                next[node as usize] += 1;
            }
        }
        Self {
            start,
            elements: around,
        }
    }

    /// Elements around a node.
    pub(crate) fn of(&self, node: u32) -> &[u32] {
        let node = node as usize;
        &self.elements[self.start[node] as usize..self.start[node + 1] as usize]
    }
}

/// What a touch needs of the bodies.
pub(crate) struct Split<'a, const D: usize> {
    pub(crate) sets: &'a mut [Box<dyn ElementSet<D>>],
    pub(crate) place: &'a [(u32, u32)],
    pub(crate) elements: &'a [Element],
    pub(crate) around: &'a Around,
    pub(crate) inertia: &'a Inertia<D>,
    pub(crate) levels: &'a Levels,
    /// Interval before the last kick of each element, s.
    pub(crate) interval: &'a mut [f64],
    /// Impulses of elements on nodes that are held, N·s.
    pub(crate) on_held: Vec<(u32, [f64; D])>,
    /// Forces and viscous forces of the element in hand, N; zero between.
    pub(crate) force: &'a mut [[f64; D]],
    pub(crate) viscous: &'a mut [[f64; D]],
    /// The touch in hand: elements, their numbers, nodes beyond the island.
    pub(crate) parts: Vec<Part<D>>,
    pub(crate) due: Vec<u32>,
    pub(crate) ring: Vec<u32>,
}

/// An element in a touch.
pub(crate) struct Part<const D: usize> {
    /// L and α, s, and q₀, W/s.
    last: f64,
    given: f64,
    rate: f64,
    /// Nodes: force, N, and w₀ and w₁, m/s.
    nodes: Vec<(u32, [[f64; D]; 3])>,
}

impl<const D: usize> Interior<D> for Split<'_, D> {
    fn split(&mut self, motion: &mut Motion<D>, jump: &Jump<D>) -> Vec<(u32, [f64; D])> {
        let due = self.elements_behind(motion, jump);
        self.ring = self.ring(&due, jump);
        motion.drift(&self.ring, -jump.remaining);
        let old = self.rates(&due, motion, Some(jump));
        let new = self.rates(&due, motion, None);
        let mut impulses = Vec::new();
        self.parts.clear();
        for (&element, (old, new)) in due.iter().zip(old.iter().zip(new)) {
            let ratio = if new > 0.0 { old / new } else { 1.0 };
            let last = self.interval[element as usize];
            let next = jump.remaining + ratio.min(MAX_RATIO) * (last - jump.remaining);
            self.interval[element as usize] = next;
            let given = 0.5 * (last - next);
            let nodes = self.forces(element, motion).into_iter();
            let nodes = nodes.map(|(node, force)| {
                impulses.push((node, scale(given, &force)));
                let after = motion.velocity[node as usize];
                (node, [force, jump.before(node).unwrap_or(after), after])
            });
            self.parts.push(Part {
                last,
                given,
                rate: *old,
                nodes: nodes.collect(),
            });
        }
        for (node, impulse) in &impulses {
            if self.inertia.held(*node as usize).contains(&true) {
                self.on_held.push((*node, *impulse));
            }
        }
        impulses.retain(|(node, impulse)| {
            let inside = jump.before(*node).is_some();
            if !inside {
                self.inertia.push(*node as usize, impulse, motion.velocity);
            }
            inside
        });
        self.due = due;
        impulses
    }

    fn settle(&mut self, motion: &mut Motion<D>, remaining: f64) -> f64 {
        let rates = self.rates(&self.due, motion, None);
        let mut recovered = 0.0;
        for (part, rate) in self.parts.iter().zip(rates) {
            let (before, after) = (
                part.last - remaining,
                part.last - 2.0 * part.given - remaining,
            );
            recovered += remaining * (before * part.rate - after * rate);
            for (node, [force, before, after]) in &part.nodes {
                let now = &motion.velocity[*node as usize];
                recovered += (0.5 * part.last - remaining) * dot(force, &sub(now, before))
                    - 0.5 * part.given * dot(force, &sub(now, after));
            }
        }
        motion.drift(&self.ring, remaining);
        recovered
    }
}

impl<const D: usize> Split<'_, D> {
    /// Elements with a node that jumps, all of whose nodes are where the jump
    /// is in time: of the same level, and in no other island.
    fn elements_behind(&self, motion: &Motion<D>, jump: &Jump<D>) -> Vec<u32> {
        let jumps = |node: &&u32| jump.before(**node) != Some(motion.velocity[**node as usize]);
        let around = jump.nodes.iter().filter(jumps);
        let mut due: Vec<u32> = around
            .flat_map(|&node| self.around.of(node))
            .copied()
            .collect();
        due.sort_unstable();
        due.dedup();
        let level = jump
            .nodes
            .first()
            .map_or(0, |&node| self.levels.node[node as usize]);
        due.retain(|&e| {
            let mut nodes = self.elements[e as usize].nodes().iter();
            self.levels.element[e as usize] == level
                && nodes.all(|&node| {
                    self.levels.node[node as usize] == level
                        && (!jump.taken[node as usize] || jump.nodes.binary_search(&node).is_ok())
                })
        });
        due
    }

    /// Nodes of elements that have drifted on without the island.
    fn ring(&self, due: &[u32], jump: &Jump<D>) -> Vec<u32> {
        let nodes = due.iter().flat_map(|&e| self.elements[e as usize].nodes());
        let mut ring: Vec<u32> = nodes.copied().collect();
        ring.sort_unstable();
        ring.dedup();
        ring.retain(|node| jump.nodes.binary_search(node).is_err());
        ring
    }

    /// Energy of the strain rate of elements, W/s: before the jump, or now.
    fn rates(&self, due: &[u32], motion: &mut Motion<D>, jump: Option<&Jump<D>>) -> Vec<f64> {
        let now: Vec<[f64; D]> = jump
            .iter()
            .flat_map(|jump| jump.swap(motion.velocity))
            .collect();
        let rate = |&e: &u32| {
            let (set, i) = self.place[e as usize];
            self.sets[set as usize].rate_energy(i as usize, motion.displacement, motion.velocity)
        };
        let rates = due.iter().map(rate).collect();
        if let Some(jump) = jump {
            for (&node, velocity) in jump.nodes.iter().zip(now) {
                motion.velocity[node as usize] = velocity;
            }
        }
        rates
    }

    /// Internal forces of an element, N, node by node.
    fn forces(&mut self, element: u32, motion: &Motion<D>) -> Vec<(u32, [f64; D])> {
        let (set, i) = self.place[element as usize];
        let (force, viscous) = (&mut *self.force, &mut *self.viscous);
        let set = &mut self.sets[set as usize];
        set.kick(
            &[i],
            &[1.0],
            motion.displacement,
            motion.velocity,
            force,
            viscous,
        );
        let nodes = self.elements[element as usize].nodes().iter();
        nodes
            .map(|&node| {
                self.viscous[node as usize] = [0.0; D];
                (
                    node,
                    std::mem::replace(&mut self.force[node as usize], [0.0; D]),
                )
            })
            .collect()
    }
}

impl<const D: usize> Jump<'_, D> {
    /// Velocity of a node of the island before the touch, m/s.
    fn before(&self, node: u32) -> Option<[f64; D]> {
        let number = self.nodes.binary_search(&node).ok()?;
        Some(self.before[number])
    }

    /// Puts the velocities before the touch back; returns those after it.
    fn swap(&self, velocity: &mut [[f64; D]]) -> Vec<[f64; D]> {
        let nodes = self.nodes.iter().zip(self.before);
        nodes
            .map(|(&node, before)| std::mem::replace(&mut velocity[node as usize], *before))
            .collect()
    }
}
