//! Lower bounds of the separation of the open pairs of an island: pairs that cannot touch in a
//! drift are skipped.
//!
//! Most of the pairs that may touch within a coarse step cannot touch within a substep. A pair
//! touches in t seconds only if its features are no farther apart than d_tol + t u at the start,
//! with u the largest relative speed of their nodes. That is the rule of
//! [`touch_events`](crate::contact::island::touch_events). Here it is applied without the geometry,
//! to a lower bound of the distance and an upper bound of u:
//! - The distance changes by no more than the nodes of both move. A distance d is not below d − w₁
//!   − w₂ as long as the blocks have travelled w₁ and w₂ since. A travel is the sum, over all
//!   drifts, of duration times largest speed.
//! - With s₁ and s₂ the largest speeds now, u is not above s₁ + s₂, or 3 s₁ + s₂ if the main
//!   feature has nodes that move against each other.
//!
//! So the full test would find that a skipped pair does not touch. The times of the full tests
//! change no result, and a resumed run may start from distances measured then.

use std::ops::Range;

use crate::contact::surface::kicked::KickedView;
use crate::contact::surface::{Pair, Surface};
use crate::contact::tolerances::{SEPARATION_DRIFTS, SEPARATION_ROUND_OFF, STALE_TRAVEL};
use crate::math::vector::dot;

/// The open pairs that may touch in this coarse step.
#[derive(Clone, Debug, Default)]
pub(crate) struct SeparationBounds {
    open: Vec<OpenPair>,
    /// The pairs before a restart, and how many of them have been passed.
    before: Vec<OpenPair>,
    passed: usize,
    /// The blocks of the island; the first stands for all fixed blocks.
    blocks: Vec<IslandBlock>,
    /// Distance within which no pair is skipped, m.
    within: f64,
    /// Travel at which all distances are measured again, m.
    longest: f64,
    /// Numbers of the only pairs that may touch for now, ascending. The list serves for `serves`:
    /// twice the longest travel from now on, plus the travel of the next drift, m.
    active: Vec<u32>,
    serves: f64,
}

/// An open pair.
#[derive(Clone, Copy, Debug)]
struct OpenPair {
    pair: Pair,
    /// Numbers of the blocks of main and target among those of the island.
    blocks: [u32; 2],
    /// True if nodes of the main feature move against each other.
    turns: bool,
    /// Travels of both blocks plus the remaining distance that lead to a touch, m.
    until: f64,
    /// True if the distance was within that of pairs that are always tested when it was measured.
    is_near: bool,
}

/// The nodes of one block in the island.
#[derive(Clone, Debug)]
struct IslandBlock {
    block: u32,
    /// Their indices among the nodes of the island.
    nodes: Range<usize>,
    /// Travel: sum of duration times largest speed over all drifts, m.
    travel: f64,
    /// Largest speed, m/s.
    speed: f64,
}

impl OpenPair {
    /// Returns true if the separation of the pair exceeds `distance`, m.
    #[inline]
    fn is_apart(&self, blocks: &[IslandBlock], distance: f64) -> bool {
        let [main, target] = self.blocks_in(blocks);
        self.until - (main.travel + target.travel) > distance
    }

    /// Returns the blocks of the pair among those of its island.
    #[inline]
    fn blocks_in<'a>(&self, blocks: &'a [IslandBlock]) -> [&'a IslandBlock; 2] {
        self.blocks.map(|block| &blocks[block as usize])
    }
}

impl SeparationBounds {
    /// Makes an empty list for an island of these sorted `nodes`. Pairs no farther apart than
    /// `within`, m, are always tested; it is the resolution or more.
    pub(crate) fn new(nodes: &[u32], block_of: &[u32], resolution: f64, within: f64) -> Self {
        let body = |block, nodes| IslandBlock {
            block,
            nodes,
            travel: 0.0,
            speed: 0.0,
        };
        let mut bodies = vec![body(u32::MAX, 0..0)];
        let block = |node: &u32| block_of[*node as usize];
        let mut first = 0;
        for same in nodes.chunk_by(|a, b| block(a) == block(b)) {
            bodies.push(body(block(&same[0]), first..first + same.len()));
            first += same.len();
        }
        Self {
            open: Vec::new(),
            before: Vec::new(),
            passed: 0,
            blocks: bodies,
            within: within + SEPARATION_ROUND_OFF * resolution,
            longest: STALE_TRAVEL * resolution,
            active: Vec::new(),
            serves: -1.0,
        }
    }

    /// Removes all pairs, but stores them for [`keep`](Self::keep).
    pub(crate) fn restart(&mut self) {
        self.serves = -1.0;
        std::mem::swap(&mut self.open, &mut self.before);
        self.open.clear();
        self.passed = 0;
    }

    /// Adds a pair with its bound from before the restart. Returns false if it was not there. Pairs
    /// come in order.
    pub(crate) fn keep(&mut self, pair: Pair) -> bool {
        let ahead = &self.before[self.passed..];
        self.passed += ahead.iter().take_while(|open| open.pair < pair).count();
        let known = self.before.get(self.passed);
        let known = known.filter(|open| open.pair == pair).copied();
        self.open.extend(known);
        known.is_some()
    }

    /// Adds a pair of two blocks whose features are `apart` now or farther, m.
    pub(crate) fn push<const D: usize>(
        &mut self,
        surface: &dyn Surface<D>,
        pair: Pair,
        blocks: [u32; 2],
        apart: f64,
    ) {
        let of = |block| {
            let moving = self.blocks[1..].binary_search_by_key(&block, |body| body.block);
            moving.map_or(0, |number| number as u32 + 1)
        };
        self.serves = -1.0;
        self.open.push(OpenPair {
            pair,
            blocks: blocks.map(of),
            turns: surface.main_nodes(pair.main).len() > 1,
            until: 0.0,
            is_near: false,
        });
        // The distance may be a lower bound, so the pair is not known to be near.
        self.set_until(self.open.len() - 1, apart);
    }

    pub(crate) fn pair(&self, number: usize) -> Pair {
        self.open[number].pair
    }

    /// Returns all pairs, in order.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = Pair> + '_ {
        self.open.iter().map(|open| open.pair)
    }

    /// Measures the present speeds of the `nodes` of the island.
    pub(crate) fn measure<const D: usize>(&mut self, nodes: &[u32], motion: &KickedView<D>) {
        for body in &mut self.blocks {
            let velocities = nodes[body.nodes.clone()].iter();
            let velocities = velocities.map(|&node| &motion.velocity[node as usize]);
            let squares = velocities.map(|velocity| dot(velocity, velocity));
            // NaN stays, so that no pair is skipped.
            let larger = |a: f64, b: f64| if b <= a || a.is_nan() { a } else { b };
            let largest = squares.fold(0.0, larger);
            body.speed = largest.sqrt();
        }
    }

    /// Returns the numbers of the pairs that may touch within `duration` at the measured
    /// velocities, in order.
    pub(crate) fn may_touch(&mut self, duration: f64) -> impl Iterator<Item = usize> + '_ {
        let fastest = self.blocks.iter().map(|body| body.speed);
        // Main features turn.
        let longest = 4.0 * duration * fastest.fold(0.0, f64::max);
        if longest.is_nan() || longest > self.serves {
            self.serves = SEPARATION_DRIFTS * longest;
            let tested = self.within + self.serves;
            let Self {
                open,
                blocks,
                active,
                ..
            } = self;
            let near = (0..).zip(&*open);
            let near = near.filter(|(_, open)| !open.is_apart(blocks, tested));
            active.clear();
            active.extend(near.map(|(number, _)| number));
        }
        let near = &*self;
        let soon = near.active.iter().map(|&number| number as usize);
        soon.filter(move |&number| !near.cannot_touch(number, duration))
    }

    /// Returns true if a pair cannot touch for `duration` at the measured velocities.
    #[inline]
    fn cannot_touch(&self, number: usize, duration: f64) -> bool {
        let travel = self.relative_travel(number, duration);
        self.open[number].is_apart(&self.blocks, self.within + travel)
    }

    /// Returns a bound of the motion of a pair's features against each other in `duration` at the
    /// measured velocities, m.
    #[inline]
    pub(crate) fn relative_travel(&self, number: usize, duration: f64) -> f64 {
        let open = &self.open[number];
        let [main, target] = open.blocks_in(&self.blocks);
        let turns = if open.turns { 3.0 } else { 1.0 };
        duration * (turns * main.speed + target.speed)
    }

    /// Returns true if a pair is known to be near: its distance need not be measured again until
    /// the bounds are discarded.
    pub(crate) fn is_near(&self, number: usize) -> bool {
        self.open[number].is_near
    }

    /// Sets the bound of a pair whose features have been measured to be `apart` now, m.
    pub(crate) fn set_bound(&mut self, number: usize, apart: f64) {
        self.set_until(number, apart);
        self.open[number].is_near = apart <= self.within;
    }

    /// Sets the travel at which a pair may touch whose features are `apart` now or farther, m.
    fn set_until(&mut self, number: usize, apart: f64) {
        let open = &mut self.open[number];
        let [main, target] = open.blocks_in(&self.blocks);
        open.until = apart + (main.travel + target.travel);
    }

    /// Adds the travel of a drift of `duration` seconds at the measured velocities.
    pub(crate) fn advance(&mut self, duration: f64) {
        let (mut longest, mut fastest) = (0.0_f64, 0.0_f64);
        for body in &mut self.blocks {
            body.travel += duration * body.speed;
            longest = longest.max(body.travel);
            fastest = fastest.max(body.speed);
        }
        self.serves -= 2.0 * duration * fastest;
        if longest > self.longest {
            self.forget();
        }
    }

    /// Discards all bounds, because nodes have moved in another way, or far.
    pub(crate) fn forget(&mut self) {
        self.serves = -1.0;
        for body in &mut self.blocks {
            body.travel = 0.0;
        }
        for open in &mut self.open {
            (open.until, open.is_near) = (0.0, false);
        }
    }
}
