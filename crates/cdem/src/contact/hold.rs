//! Kicks: what the closed pairs of an island bear in one, (11) of the paper, and which
//! of them it parts, (6) to (10).

use std::collections::BTreeSet;

use rayon::prelude::*;

use crate::contact::island::{AGAIN, Books, Island, MISS, Setting};
use crate::contact::live::{Followed, Live, Moment, Record};
use crate::contact::solve::{Constraint, RESIDUAL, shear_norm};
use crate::contact::surface::{Pair, Positions};
use crate::contact::system::SHARE;
use crate::contact::touches::{Touches, Wanted};
use crate::model::motion::Kicked;
use crate::profile::Stage;
use crate::vector::sub;

/// Share of its contacts, one in so many, that must sink in for those closed before in the
/// same kick to have the island solved once more. Fewer wait for the next kick: those are
/// one or two at a time, for many rounds, in a large island that settles.
const WORTH_A_SOLVE: usize = 64;

/// What closed contacts are asked for in a kick, as often as it takes.
#[derive(Default)]
struct Hold<const D: usize> {
    constraints: Vec<Constraint<D>>,
    /// By how much their gaps would have missed theirs, m.
    missed: Vec<f64>,
    /// How often that has been asked for.
    again: usize,
    /// Nodes that they move, and their velocities before, m/s.
    start: AtNodes<D>,
}

/// Vectors at some nodes.
pub(super) type AtNodes<const D: usize> = Vec<(u32, [f64; D])>;

/// What has become of the contacts of an island in a kick.
pub(super) struct Held<const D: usize> {
    /// Contacts that have ended.
    pub(super) ended: Vec<Record>,
    /// Velocities of nodes of the island, m/s.
    pub(super) velocity: AtNodes<D>,
    /// Changes of the velocities of other nodes, m/s: of those that a contact has slid on to.
    pub(super) beyond: AtNodes<D>,
    /// What has been solved.
    pub(super) constraints: Vec<Constraint<D>>,
    /// Energies, and other sums.
    pub(super) books: Books,
}

impl<const D: usize> Hold<D> {
    /// Gives the nodes the velocities that they had before.
    fn undo(&self, motion: &mut Kicked<D>) {
        for (node, velocity) in &self.start {
            motion.velocity[*node as usize] = *velocity;
        }
    }
}

impl<const D: usize> Island<D> {
    /// After the kick of a substep: the impulses that keep closed pairs
    /// together, (11), or part them, (6)–(10). `before` are the velocities
    /// before the kick of `interval` seconds at `time`, which precedes a drift
    /// of `drift` seconds; `books` are empty. Velocities stay: what becomes of them is returned.
    pub(super) fn hold(
        &mut self,
        setting: &Setting<D>,
        motion: &mut Kicked<D>,
        before: &[[f64; D]],
        (time, interval, drift): (f64, f64, f64),
        mut books: Books,
    ) -> Held<D> {
        let mut ended = Vec::new();
        self.follow(setting, motion.positions(), &mut ended, &mut books);
        let timing = (time, interval, drift);
        let mut touches = std::mem::take(&mut self.touches);
        let hold = self.solve_held(setting, motion, &mut touches, timing, &mut books);
        let constraints = &hold.constraints;
        let least = setting.least_speed(drift);
        for (live, constraint) in self.live.iter_mut().zip(constraints) {
            let operator = &constraint.operator;
            let [old, new] = [before, motion.velocity].map(|v| operator.relative_velocities(v));
            books.spend(&constraint.impulse, &old, &new, live.fresh);
            live.fresh = false;
            live.bear(&constraint.impulse, interval);
            if constraint.slips(motion.velocity, least) {
                live.slide();
                live.record.slip += shear_norm(&new) * drift;
            } else if !live.sticks {
                live.stick();
            }
        }
        let (moves, at) = (&*motion.velocity, motion.positions());
        // One that is deeper than a touch may be would not be found again.
        let is_deep = |pair: Pair| setting.surface.project(pair, at).gap < -setting.tolerance;
        let mut solved = constraints.iter();
        self.live.retain(|live| {
            let parts = solved.next().is_some_and(|constraint| {
                constraint.opens(moves, least)
                    && live.is_apart_after(constraint, moves, drift, setting.tolerance)
                    && !is_deep(live.pair)
            });
            if parts {
                ended.push(live.record.clone());
            }
            !parts
        });
        touches.go_on(self, setting, motion, (drift, !ended.is_empty()));
        self.touches = touches;
        let (velocity, beyond) = self.moved(&hold.start, motion.velocity);
        hold.undo(motion);
        books.watch.lap(Stage::Geometry);
        Held {
            ended,
            velocity,
            beyond,
            constraints: hold.constraints,
            books,
        }
    }

    /// New velocities of nodes of the island, and by how much those of others are new, m/s;
    /// both by nodes, as their velocities at the `start` are.
    fn moved(&self, start: &[(u32, [f64; D])], velocity: &[[f64; D]]) -> (AtNodes<D>, AtNodes<D>) {
        let mut nodes = self.nodes.iter().peekable();
        let (mut own, mut beyond) = (Vec::with_capacity(start.len()), Vec::new());
        for (node, old) in start {
            while nodes.next_if(|own| *own < node).is_some() {}
            let new = &velocity[*node as usize];
            match nodes.next_if_eq(&node) {
                Some(_) => own.push((*node, *new)),
                None => beyond.push((*node, sub(new, old))),
            }
        }
        (own, beyond)
    }

    /// Moves sliding contacts on; those have `ended` that have left the surface, or slid
    /// on to where another is.
    fn follow(
        &mut self,
        setting: &Setting<D>,
        at: Positions<D>,
        ended: &mut Vec<Record>,
        books: &mut Books,
    ) {
        if self.live.iter().all(|live| live.sticks) {
            return;
        }
        let mut pairs: Vec<Pair> = self.live.iter().map(|live| live.pair).collect();
        pairs.sort_unstable();
        let taken = |pair: Pair| pairs.binary_search(&pair).is_ok();
        let mut moved = Vec::with_capacity(pairs.len());
        self.live.retain_mut(|live| {
            let before = live.pair;
            let followed = live.follow(setting.surface, at, setting.tolerance, taken);
            books.hurried += u64::from(followed == Followed::InAHurry);
            let goes_on = followed != Followed::Beyond;
            if goes_on {
                moved.push(live.pair != before);
            } else {
                ended.push(live.record.clone());
            }
            goes_on
        });
        if moved.contains(&true) {
            self.merge(&moved, ended);
        }
    }

    /// Ends the contacts that have `moved` on to where another is.
    fn merge(&mut self, moved: &[bool], ended: &mut Vec<Record>) {
        let stayed = self.live.iter().zip(moved).filter(|(_, moved)| !**moved);
        let mut known: BTreeSet<Pair> = stayed.map(|(live, _)| live.pair).collect();
        let mut moved = moved.iter();
        self.live.retain(|live| {
            let goes_on = moved.next() == Some(&false) || known.insert(live.pair);
            if !goes_on {
                ended.push(live.record.clone());
            }
            goes_on
        });
    }

    /// Solves the closed contacts. Open pairs that touch already and still sink into each
    /// other then are closed: no impact, unless they did before the kick; contacts beyond
    /// their strength break together. After either, the island is solved again.
    fn solve_held(
        &mut self,
        setting: &Setting<D>,
        motion: &mut Kicked<D>,
        touches: &mut Touches,
        (time, interval, drift): (f64, f64, f64),
        books: &mut Books,
    ) -> Hold<D> {
        let mut hold = Hold::default();
        let precision = (RESIDUAL, self.precision(setting, motion.positions(), drift));
        let mut before: Option<Vec<[f64; D]>> = None;
        loop {
            if hold.constraints.len() < self.live.len() {
                self.ask_of_new(setting, motion, &mut hold, (interval, drift), books);
            }
            self.solve_for_gaps(setting, motion, &mut hold, (precision, drift), books);
            let least = match &before {
                Some(before) => {
                    let interval = (Wanted::InKick, (0.0, drift));
                    touches.update(self, setting, motion, (before, true), interval);
                    self.live.len() / WORTH_A_SOLVE
                }
                None => {
                    touches.begin(self, setting, motion, drift);
                    0
                }
            };
            before = Some(self.velocities(motion.velocity));
            let closes = self.close_touching(setting, motion, touches, (time, drift, least), books);
            if !closes && !self.break_joints(setting, motion, &mut hold, (interval, drift)) {
                return hold;
            }
            hold.undo(motion);
        }
    }

    /// Asks something of the contacts that nothing has been asked of yet.
    fn ask_of_new(
        &mut self,
        setting: &Setting<D>,
        motion: &Kicked<D>,
        hold: &mut Hold<D>,
        (interval, drift): (f64, f64),
        books: &mut Books,
    ) {
        let at = motion.positions();
        let new = self.live[hold.constraints.len()..].par_iter();
        let constraint = |live: &Live<D>| {
            let operator = live.operator(setting.surface, at);
            live.constraint(operator, (drift, interval), setting.tolerance)
        };
        hold.constraints
            .par_extend(new.with_min_len(SHARE).map(constraint));
        hold.missed.resize(self.live.len(), 0.0);
        let constraints = &hold.constraints;
        books.solution(|| self.system.load(constraints, setting.mobility(interval)));
        let nodes = self.system.nodes().iter();
        let start = nodes.map(|&node| (node, motion.velocity[node as usize]));
        hold.start = start.collect();
    }

    /// Solves for what is asked, and again for what gaps miss of it.
    fn solve_for_gaps(
        &mut self,
        setting: &Setting<D>,
        motion: &mut Kicked<D>,
        hold: &mut Hold<D>,
        (precision, drift): ((f64, f64), f64),
        books: &mut Books,
    ) {
        if self.live.is_empty() {
            return;
        }
        loop {
            let (system, constraints) = (&mut self.system, &mut hold.constraints);
            books.count(|| system.solve(constraints, motion.velocity, precision));
            if hold.again >= AGAIN {
                return;
            }
            let Some(misses) = self.misses(setting, motion, drift, &hold.constraints) else {
                return;
            };
            hold.again += 1;
            for (k, miss) in misses.into_iter().enumerate() {
                hold.missed[k] += miss;
                hold.constraints[k].target[0] -= miss / drift;
            }
            hold.undo(motion);
        }
    }

    /// Closes the open pairs that touch already, if they are more than the `least`; whether
    /// any contact has begun.
    fn close_touching(
        &mut self,
        setting: &Setting<D>,
        motion: &Kicked<D>,
        touches: &mut Touches,
        (time, drift, least): (f64, f64, usize),
        books: &mut Books,
    ) -> bool {
        let pairs = touches.now();
        if pairs.len() <= least {
            return false;
        }
        let moment = Moment::in_drift(motion.positions(), motion.velocity, [0.0, drift]);
        let begun = pairs
            .into_iter()
            .map(|pair| self.touch(setting, moment, pair, time));
        let begun: u64 = begun.sum();
        books.touches += begun;
        begun > 0
    }

    /// Breaks the joints that bear more than their strength, and asks anew of all what
    /// they bear without those; whether there are any.
    fn break_joints(
        &mut self,
        setting: &Setting<D>,
        motion: &Kicked<D>,
        hold: &mut Hold<D>,
        (interval, drift): (f64, f64),
    ) -> bool {
        let least = setting.least_speed(drift);
        let mut breaks = false;
        for (live, constraint) in self.live.iter_mut().zip(&hold.constraints) {
            breaks |= live.breaks(constraint, motion.velocity, least);
        }
        if breaks {
            let known = self.live.iter().zip(&hold.missed);
            for (constraint, (live, missed)) in hold.constraints.iter_mut().zip(known) {
                let operator = constraint.operator;
                *constraint = live.constraint(operator, (drift, interval), setting.tolerance);
                constraint.target[0] -= missed / drift;
            }
        }
        breaks
    }

    /// By how much the gaps of contacts that press will miss theirs after the drift, or
    /// sink in as they part, m; if that is too far of any.
    fn misses(
        &self,
        setting: &Setting<D>,
        motion: &Kicked<D>,
        drift: f64,
        constraints: &[Constraint<D>],
    ) -> Option<Vec<f64>> {
        let (surface, tolerance) = (setting.surface, setting.tolerance);
        let then = motion.positions().after(motion.velocity, drift);
        let miss = |(live, constraint): (&Live<D>, &Constraint<D>)| {
            // Edges that have turned parallel have no gap.
            let gap = surface.gap(live.pair, then, &constraint.operator.frame[0]);
            let miss = gap.map_or(0.0, |gap| gap - live.offset[0]);
            let sinks = || {
                miss < -MISS * tolerance && surface.project(live.pair, then).outside <= tolerance
            };
            if constraint.impulse[0] > 0.0 || sinks() {
                miss
            } else {
                0.0
            }
        };
        let pairs = self.live.par_iter().zip(constraints).with_min_len(SHARE);
        let misses: Vec<f64> = pairs.map(miss).collect();
        let is_far = |miss: &f64| miss.abs() > MISS * setting.tolerance;
        misses.iter().any(is_far).then_some(misses)
    }
}
