//! Kicks: what the closed pairs of an island bear in one, (11) of the paper, and which
//! of them it parts, (6) to (10).

use std::collections::BTreeSet;

use rayon::prelude::*;

use crate::contact::constraint::contact_constraint::{Constraint, shear_norm};
use crate::contact::constraint::contact_point::{
    ContactHistory, ContactPoint, DriftInterval, TargetTracking,
};
use crate::contact::constraint::context::ContactContext;
use crate::contact::energy::ContactEnergies;
use crate::contact::island::Island;
use crate::contact::island::touch_events::{ClosureRule, TouchEvents};
use crate::contact::rollback::change;
use crate::contact::solver::gauss_seidel::RESIDUAL;
use crate::contact::solver::system::SHARE;
use crate::contact::surface::kicked::KickedView;
use crate::contact::surface::{Configuration, Pair};
use crate::contact::tolerances::{AGAIN, MISS};
use crate::math::profile::Stage;

/// Share of its contacts, one in so many, that must sink in for those closed before in the
/// same kick to have the island solved once more. Fewer wait for the next kick: those are
/// one or two at a time, for many rounds, in a large island that settles.
const WORTH_A_SOLVE: usize = 64;

/// What closed contacts are asked for in a kick, as often as it takes; its storage is kept.
#[derive(Debug, Default)]
pub(crate) struct KickWorkspace<const D: usize> {
    constraints: Vec<Constraint<D>>,
    /// Of how many, from the first on.
    asked: usize,
    /// By how much their gaps would have missed theirs, m; and what of it the last solve has
    /// left.
    missed: Vec<f64>,
    misses: Vec<f64>,
    /// How often that has been asked for.
    again: usize,
    /// Pairs of those that are followed, sorted, and which have moved on.
    followed: Vec<Pair>,
    moved: Vec<bool>,
    /// Nodes that they move, sorted, and their velocities before and after, m/s.
    nodes: Vec<u32>,
    start: Vec<[f64; D]>,
    end: Vec<[f64; D]>,
    /// Contacts that have ended, energies, and other sums.
    ended: Vec<ContactHistory>,
    books: ContactEnergies,
}

impl<const D: usize> Clone for KickWorkspace<D> {
    /// An empty one: a kick asks for all anew.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl<const D: usize> KickWorkspace<D> {
    /// Begins a kick of so many contacts, of which nothing has been asked for yet.
    fn begin(&mut self, contacts: usize) {
        self.constraints.resize_with(contacts, Constraint::default);
        self.asked = 0;
        self.missed.clear();
        self.again = 0;
        self.start(&[], &[]);
    }

    /// What has been solved.
    pub(super) fn solved(&self) -> &[Constraint<D>] {
        &self.constraints
    }

    /// Energies, and other sums.
    pub(super) fn books(&self) -> &ContactEnergies {
        &self.books
    }

    /// Contacts that have ended, once.
    pub(super) fn ended(&mut self) -> impl Iterator<Item = ContactHistory> + '_ {
        self.ended.drain(..)
    }

    /// Takes the velocities before.
    fn start(&mut self, nodes: &[u32], velocity: &[[f64; D]]) {
        self.nodes.clear();
        self.nodes.extend(nodes);
        self.start.clear();
        let velocities = nodes.iter().map(|&node| velocity[node as usize]);
        self.start.extend(velocities);
    }

    /// Gives the nodes the velocities that they had before.
    fn undo(&self, motion: &mut KickedView<D>) {
        for (&node, velocity) in self.nodes.iter().zip(&self.start) {
            motion.velocity[node as usize] = *velocity;
        }
    }

    /// Takes the velocities after.
    fn end(&mut self, velocity: &[[f64; D]]) {
        self.end.clear();
        let velocities = self.nodes.iter().map(|&node| velocity[node as usize]);
        self.end.extend(velocities);
    }

    /// Gives the nodes the velocities after; or what these have changed by where another island
    /// has moved the node, as one that a contact has slid on to.
    pub(super) fn redo(&self, velocity: &mut [[f64; D]]) {
        let changes = self.start.iter().zip(&self.end);
        for (&node, (old, new)) in self.nodes.iter().zip(changes) {
            change(&mut velocity[node as usize], [old, new]);
        }
    }
}

impl<const D: usize> Island<D> {
    /// After the kick of a substep: the impulses that keep closed pairs
    /// together, (11), or part them, (6)–(10). `before` are the velocities
    /// before the kick of `interval` seconds at `time`, which precedes a drift
    /// of `drift` seconds; `books` are empty. Velocities stay: what becomes of them, and of the
    /// rest, is [kept](KickWorkspace).
    pub(super) fn kick(
        &mut self,
        setting: &ContactContext<D>,
        motion: &mut KickedView<D>,
        before: &[[f64; D]],
        (time, interval, drift): (f64, f64, f64),
        mut books: ContactEnergies,
    ) {
        let mut hold = std::mem::take(&mut self.kick_workspace);
        let mut ended = std::mem::take(&mut hold.ended);
        let followed = (&mut hold.followed, &mut hold.moved);
        self.follow(
            setting,
            motion.positions(),
            followed,
            &mut ended,
            &mut books,
        );
        let timing = (time, interval, drift);
        let mut touches = std::mem::take(&mut self.touch_events);
        self.solve_held(
            setting,
            motion,
            (&mut hold, &mut touches),
            timing,
            &mut books,
        );
        let constraints = &hold.constraints;
        let least = setting.least_speed(drift);
        for (live, constraint) in self.contact_points.iter_mut().zip(constraints) {
            let operator = &constraint.jacobian;
            let [old, new] = [before, motion.velocity].map(|v| operator.relative_velocities(v));
            books.book_work(&constraint.impulse, &old, &new, live.is_new);
            books.penetration = books.penetration.max(live.depth(operator));
            (live.is_new, live.normal) = (false, operator.frame[0]);
            live.record_impulse(&constraint.impulse, interval);
            if constraint.slips(motion.velocity, least) {
                live.slide();
                live.history.slip += shear_norm(&new) * drift;
            } else if !live.is_sticking {
                live.stick();
            }
        }
        let (moves, at) = (&*motion.velocity, motion.positions());
        // One that is deeper than a touch may be would not be found again.
        let is_deep = |pair: Pair| setting.surface.project(pair, at).gap < -setting.tolerance;
        let mut solved = constraints.iter();
        self.contact_points.retain(|live| {
            let parts = solved.next().is_some_and(|constraint| {
                constraint.opens(moves, least)
                    && live.is_apart_after(constraint, moves, drift, setting.tolerance)
                    && !is_deep(live.pair)
            });
            if parts {
                ended.push(live.history.clone());
            }
            !parts
        });
        touches.reexamine(self, setting, motion, (drift, !ended.is_empty()));
        self.touch_events = touches;
        hold.end(motion.velocity);
        hold.undo(motion);
        books.watch.lap(Stage::Geometry);
        (hold.ended, hold.books) = (ended, books);
        self.kick_workspace = hold;
    }

    /// Moves sliding contacts on; those have `ended` that have left the surface, or slid
    /// on to where another is.
    fn follow(
        &mut self,
        setting: &ContactContext<D>,
        at: Configuration<D>,
        (pairs, moved): (&mut Vec<Pair>, &mut Vec<bool>),
        ended: &mut Vec<ContactHistory>,
        books: &mut ContactEnergies,
    ) {
        if self.contact_points.iter().all(|live| live.is_sticking) {
            return;
        }
        pairs.clear();
        pairs.extend(self.contact_points.iter().map(|live| live.pair));
        pairs.sort_unstable();
        let taken = |pair: Pair| pairs.binary_search(&pair).is_ok();
        moved.clear();
        self.contact_points.retain_mut(|live| {
            let before = live.pair;
            let followed = live.track_target(setting.surface, at, setting.tolerance, taken);
            books.overtravel_count += u64::from(followed == TargetTracking::InAHurry);
            let goes_on = followed != TargetTracking::Beyond;
            if goes_on {
                moved.push(live.pair != before);
            } else {
                ended.push(live.history.clone());
            }
            goes_on
        });
        if moved.contains(&true) {
            self.merge(moved, ended);
        }
    }

    /// Ends the contacts that have `moved` on to where another is.
    fn merge(&mut self, moved: &[bool], ended: &mut Vec<ContactHistory>) {
        let stayed = self
            .contact_points
            .iter()
            .zip(moved)
            .filter(|(_, moved)| !**moved);
        let mut known: BTreeSet<Pair> = stayed.map(|(live, _)| live.pair).collect();
        let mut moved = moved.iter();
        self.contact_points.retain(|live| {
            let goes_on = moved.next() == Some(&false) || known.insert(live.pair);
            if !goes_on {
                ended.push(live.history.clone());
            }
            goes_on
        });
    }

    /// Solves the closed contacts. Open pairs that touch already and still sink into each
    /// other then are closed: no impact, unless they did before the kick; contacts beyond
    /// their strength break together. After either, the island is solved again.
    fn solve_held(
        &mut self,
        setting: &ContactContext<D>,
        motion: &mut KickedView<D>,
        (hold, touches): (&mut KickWorkspace<D>, &mut TouchEvents<D>),
        (time, interval, drift): (f64, f64, f64),
        books: &mut ContactEnergies,
    ) {
        hold.begin(self.contact_points.len());
        let precision = (RESIDUAL, self.precision(setting, motion.positions(), drift));
        let mut before: Option<Vec<[f64; D]>> = None;
        loop {
            if hold.asked < self.contact_points.len() {
                self.set_new_constraints(setting, motion, hold, (interval, drift), books);
            }
            self.solve_for_gaps(setting, motion, hold, (precision, drift), books);
            let least = match &before {
                Some(before) => {
                    let interval = (ClosureRule::InKick, (0.0, drift));
                    touches.update(self, setting, motion, (before, true), interval);
                    self.contact_points.len() / WORTH_A_SOLVE
                }
                None => {
                    touches.begin(self, setting, motion, drift);
                    0
                }
            };
            let closes = self.close_touching(setting, motion, touches, (time, drift, least), books);
            if !closes && !self.break_joints(setting, motion, hold, (interval, drift)) {
                return;
            }
            before = Some(self.velocities(motion.velocity));
            hold.undo(motion);
        }
    }

    /// Asks something of the contacts that nothing has been asked of yet.
    fn set_new_constraints(
        &mut self,
        setting: &ContactContext<D>,
        motion: &KickedView<D>,
        hold: &mut KickWorkspace<D>,
        (interval, drift): (f64, f64),
        books: &mut ContactEnergies,
    ) {
        let at = motion.positions();
        let count = self.contact_points.len();
        hold.constraints.resize_with(count, Constraint::default);
        let new = hold.asked..count;
        let pairs = hold.constraints[new.clone()].par_iter_mut();
        let pairs = pairs.zip(&self.contact_points[new]).with_min_len(SHARE);
        pairs.for_each(|(constraint, live)| {
            live.assemble_jacobian(&mut constraint.jacobian, setting.surface, at);
            live.set_constraint(constraint, (drift, interval), setting.tolerance);
        });
        hold.asked = count;
        hold.missed.resize(count, 0.0);
        let constraints = &hold.constraints;
        books.time_solution(|| self.solver.load(constraints, setting.mobility(interval)));
        hold.start(self.solver.nodes(), motion.velocity);
    }

    /// Solves for what is asked, and again for what gaps miss of it.
    fn solve_for_gaps(
        &mut self,
        setting: &ContactContext<D>,
        motion: &mut KickedView<D>,
        hold: &mut KickWorkspace<D>,
        (precision, drift): ((f64, f64), f64),
        books: &mut ContactEnergies,
    ) {
        if self.contact_points.is_empty() {
            return;
        }
        loop {
            let (system, constraints) = (&mut self.solver, &mut hold.constraints);
            books.count_solve(|| system.solve(constraints, motion.velocity, precision));
            if hold.again >= AGAIN {
                return;
            }
            if !self.miss(setting, motion, drift, hold) {
                return;
            }
            hold.again += 1;
            for (k, miss) in hold.misses.iter().enumerate() {
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
        setting: &ContactContext<D>,
        motion: &KickedView<D>,
        touches: &mut TouchEvents<D>,
        (time, drift, least): (f64, f64, usize),
        books: &mut ContactEnergies,
    ) -> bool {
        let pairs = touches.take_due_now();
        if pairs.len() <= least {
            return false;
        }
        let moment = DriftInterval::in_drift(motion.positions(), motion.velocity, [0.0, drift]);
        let begun = self.activate_pairs(setting, moment, &pairs, time);
        books.touch_count += begun;
        begun > 0
    }

    /// Breaks the joints that bear more than their strength, and asks anew of all what
    /// they bear without those; whether there are any.
    fn break_joints(
        &mut self,
        setting: &ContactContext<D>,
        motion: &KickedView<D>,
        hold: &mut KickWorkspace<D>,
        (interval, drift): (f64, f64),
    ) -> bool {
        let least = setting.least_speed(drift);
        let mut breaks = false;
        for (live, constraint) in self.contact_points.iter_mut().zip(&hold.constraints) {
            breaks |= live.breaks(constraint, motion.velocity, least);
        }
        if breaks {
            let known = self.contact_points.iter().zip(&hold.missed);
            for (constraint, (live, missed)) in hold.constraints.iter_mut().zip(known) {
                live.set_constraint(constraint, (drift, interval), setting.tolerance);
                constraint.target[0] -= missed / drift;
            }
        }
        breaks
    }

    /// Finds by how much the gaps of contacts that press will miss theirs after the drift, or
    /// sink in as they part; whether that is too far of any.
    fn miss(
        &self,
        setting: &ContactContext<D>,
        motion: &KickedView<D>,
        drift: f64,
        hold: &mut KickWorkspace<D>,
    ) -> bool {
        let (surface, tolerance) = (setting.surface, setting.tolerance);
        let then = motion.positions().after(motion.velocity, drift);
        let miss = |(live, constraint): (&ContactPoint<D>, &Constraint<D>)| {
            // Edges that have turned parallel have no gap.
            let gap = surface.gap(live.pair, then, &constraint.jacobian.frame[0]);
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
        let pairs = self.contact_points.par_iter().zip(&hold.constraints);
        let misses = pairs.with_min_len(SHARE).map(miss);
        misses.collect_into_vec(&mut hold.misses);
        let is_far = |miss: &f64| miss.abs() > MISS * setting.tolerance;
        hold.misses.iter().any(is_far)
    }
}
