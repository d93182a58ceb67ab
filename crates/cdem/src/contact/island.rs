//! Contacts that share nodes: their substep in two time stages (the paper's
//! sections 3 and 4).

use std::collections::BTreeSet;

use rayon::prelude::*;

use crate::contact::Interior;
use crate::contact::live::{Followed, Live, Moment, Record};
use crate::contact::near::Near;
use crate::contact::overlaps::Overlaps;
use crate::contact::solve::{Constraint, Limit, RESIDUAL, shear_norm};
use crate::contact::surface::{Pair, Positions, Surface};
use crate::contact::system::{SHARE, System};
use crate::contact::touches::{Touches, Wanted};
use crate::model::inertia::{Inertia, Mobility};
use crate::model::motion::Motion;
use crate::profile::{Stage, Stopwatch};
use crate::step::kick::Velocity;
use crate::vector::pad;

/// First touches within one substep that are taken at their own instants. Where
/// there are more, as when long faces meet at a small angle, those of the next
/// 1/16 of the substep become one event: closed a little early, never late.
const EVENTS: usize = 16;

/// How far the gaps of closed contacts may miss what they are to be at the end of
/// a drift, over the tolerance, and how often the island is solved again for it.
/// Gaps are asked for along their present gradients; those of points that slide
/// along a turning edge change besides, by the square of the drift.
pub(super) const MISS: f64 = 0.1;
pub(super) const AGAIN: usize = 2;

/// Gap, over the tolerance, at which a pair that is about to touch, and no farther aside of
/// its target than the tolerance, joins an event that comes before: a 1e-8th of the smallest boundary edge by default.
const EARLY: f64 = 1e-4;

/// Overlap, over the tolerance, that is none: a 1e-6th of the smallest boundary edge
/// by default. A pair too slow to come deeper in a drift waits for the next kick,
/// which holds it: stones that settle would open and close one after the other, each
/// touch an impact of the whole pile.
pub(in crate::contact) const SHALLOW: f64 = 1e-2;

/// Touches closer in time than this share of the substep are one event.
const SIMULTANEOUS: f64 = 1e-9;

/// Relative move that is round-off, over the tolerance: a 1e-14th of the smallest
/// boundary edge by default.
const LEAST_MOVE: f64 = 1e-10;

/// Round-off of a gap, over the coordinates of its nodes.
const ROUND_OFF: f64 = 8.0 * f64::EPSILON;

/// Residual of a solve of which the user should know: forces of contacts are
/// wrong by as much, until the next step goes on from there.
const UNSOLVED: f64 = 1e-2;

/// What contacts need to know of everything else.
#[derive(Clone, Copy)]
pub(crate) struct Setting<'a, const D: usize> {
    pub(crate) surface: &'a dyn Surface<D>,
    pub(crate) laws: &'a crate::contact::law::Laws,
    pub(crate) block_of: &'a [u32],
    pub(crate) inertia: &'a Inertia<D>,
    /// Mass-proportional damping of each block, 1/s.
    pub(crate) damping: &'a [f64],
    /// d_tol, m.
    pub(crate) tolerance: f64,
    /// Of blocks at t = 0.
    pub(crate) overlaps: &'a Overlaps,
    /// How often the elements at each node have been halved.
    pub(crate) halvings: &'a [u8],
}

impl<'a, const D: usize> Setting<'a, D> {
    /// Blocks of a pair: main and target.
    pub(super) fn blocks(&self, pair: Pair) -> [u32; 2] {
        let main = self.surface.main_nodes(pair.main)[0];
        let target = self.surface.target_nodes(pair.target)[0];
        [main, target].map(|node| self.block_of[node as usize])
    }

    /// How often the elements at a pair have been halved, on the finer side.
    fn halvings_at(&self, pair: Pair) -> u32 {
        let main = self.surface.main_nodes(pair.main).iter();
        let nodes = main.chain(self.surface.target_nodes(pair.target));
        let halvings = nodes.map(|&node| u32::from(self.halvings[node as usize]));
        halvings.max().unwrap_or_default()
    }

    /// Relative velocity that moves points by nothing but round-off over a drift
    /// of `drift` seconds, m/s.
    pub(super) fn least_speed(&self, drift: f64) -> f64 {
        LEAST_MOVE * self.tolerance / drift
    }

    /// What impulses do in a kick of `interval` seconds; 0: at an instant.
    pub(super) fn mobility(&self, interval: f64) -> Mobility<'a, D> {
        Mobility {
            inertia: self.inertia,
            block_of: self.block_of,
            damping: self.damping,
            interval,
        }
    }
}

/// The bodies of an island, and whether a node moves with any island.
pub(crate) struct Bodies<'a, const D: usize> {
    pub(crate) interior: &'a mut dyn Interior<D>,
    pub(crate) taken: &'a [bool],
}

/// Energies of contact, J, and other sums.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Books {
    pub(crate) impact_loss: f64,
    pub(crate) friction_loss: f64,
    pub(crate) fracture_loss: f64,
    pub(crate) touches: u64,
    /// Solves that ended with a residual above [`UNSOLVED`], and the worst.
    pub(crate) unsolved: u64,
    pub(crate) residual: f64,
    /// Steps of contacts that went farther in them than their target is across.
    pub(crate) hurried: u64,
    /// At which velocity impulses work.
    pub(crate) at: Velocity,
    /// Time that contact takes.
    pub(crate) watch: Stopwatch,
}

impl Books {
    /// Where the energy goes that a slip takes: of a joint, into fracture.
    pub(super) fn slip_loss(&mut self, joint: bool) -> &mut f64 {
        if joint {
            &mut self.fracture_loss
        } else {
            &mut self.friction_loss
        }
    }

    /// What to say of solves that have not got to their residual, and of contacts that
    /// slid too fast.
    pub(crate) fn warnings(&self) -> impl Iterator<Item = String> {
        let unsolved = (self.unsolved > 0).then(|| {
            format!(
                "contact impulses: solves that ended with a relative residual above {UNSOLVED:e}: {}, \
                 the worst {:.1e}; contacts press on each other through very different masses, or \
                 wedge: judge forces there with care",
                self.unsolved, self.residual
            )
        });
        let hurried = (self.hurried > 0).then(|| {
            format!(
                "contacts that slid farther in a step than the face is across that they were on: {} \
                 times; where such faces bend, contacts may be lost: try a smaller `time.step`",
                self.hurried
            )
        });
        unsolved.into_iter().chain(hurried)
    }

    /// Counts the time of work for a solve.
    fn solution<T>(&mut self, work: impl FnOnce() -> T) -> T {
        self.watch.lap(Stage::Geometry);
        let done = work();
        self.watch.lap(Stage::Solution);
        done
    }

    /// Counts a solve, and its time; it returns its residual.
    pub(super) fn count(&mut self, solve: impl FnOnce() -> f64) {
        let residual = self.solution(solve);
        self.unsolved += u64::from(residual > UNSOLVED);
        self.residual = self.residual.max(residual);
    }

    /// Books what impulses take whose points had the relative velocity `old` and
    /// have `new`, m/s. Those of closed points take nothing along the normal;
    /// points that an impact elsewhere has parted in a drift meet anew.
    pub(super) fn spend<const D: usize>(
        &mut self,
        impulse: &[f64; D],
        old: &[f64; D],
        new: &[f64; D],
        impact: bool,
    ) {
        let end = match self.at {
            Velocity::Mean => new,
            Velocity::Before => old,
        };
        let work = |r: usize| 0.5 * impulse[r] * (old[r] + end[r]);
        self.impact_loss -= work(0);
        let sheared: f64 = (1..D).map(work).sum();
        if impact {
            self.impact_loss -= sheared;
        } else {
            self.friction_loss -= sheared;
        }
    }
}

/// Receives each impulse on a node, N·s.
pub(crate) type Receive<'a, const D: usize> = &'a mut dyn FnMut(u32, &[f64; D]);

/// Live and possible contacts that share nodes, solved together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Island<const D: usize> {
    /// Open pairs that may touch in this coarse step.
    pub(crate) near: Near,
    /// Closed ones.
    pub(crate) live: Vec<Live<D>>,
    /// Nodes that move with the island, sorted.
    pub(crate) nodes: Vec<u32>,
    /// What its contacts do to each other: kept while they stay, and for its storage.
    pub(super) system: System<D>,
}

impl<const D: usize> Island<D> {
    /// After the kick of a substep: the impulses that keep closed pairs
    /// together, (11), or part them, (6)–(10). `before` are the velocities
    /// before the kick of `interval` seconds at `time`, which precedes a drift
    /// of `drift` seconds.
    pub(crate) fn hold(
        &mut self,
        setting: &Setting<D>,
        motion: &mut Motion<D>,
        before: &[[f64; D]],
        (time, interval, drift): (f64, f64, f64),
        receive: Receive<D>,
        books: &mut Books,
    ) -> Vec<Record> {
        let mut ended = Vec::new();
        self.follow(setting, motion.positions(), &mut ended, books);
        self.close_touching(setting, motion, (time, drift), books);
        if self.live.is_empty() {
            return ended;
        }
        let constraints = self.solve_closed(setting, motion, (interval, drift), books);
        let least = setting.least_speed(drift);
        for (live, constraint) in self.live.iter_mut().zip(&constraints) {
            let operator = &constraint.operator;
            let [old, new] = [before, motion.velocity].map(|v| operator.relative_velocities(v));
            books.spend(&constraint.impulse, &old, &new, live.fresh);
            live.fresh = false;
            (live.impulse, live.interval) = (constraint.impulse, interval);
            live.record.count(&[0.0; D], &constraint.impulse);
            operator.deliver(&constraint.impulse, &mut *receive);
            if constraint.slips(motion.velocity, least) {
                live.slide();
                live.record.slip += shear_norm(&new) * drift;
            } else if !live.sticks {
                live.stick();
            }
        }
        let mut opens = constraints
            .iter()
            .map(|constraint| constraint.opens(motion.velocity, least));
        let at = motion.positions();
        // One that is deeper than a touch may be would not be found again.
        let is_deep = |pair: Pair| setting.surface.project(pair, at).gap < -setting.tolerance;
        self.live.retain(|live| {
            let opens = opens.next().unwrap_or(false) && !is_deep(live.pair);
            if opens {
                ended.push(live.record.clone());
            }
            !opens
        });
        ended
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

    /// Closes the open pairs that touch already and that the kick has set
    /// moving towards each other: no impact, unless they did before.
    fn close_touching(
        &mut self,
        setting: &Setting<D>,
        motion: &Motion<D>,
        (time, drift): (f64, f64),
        books: &mut Books,
    ) {
        let touches =
            Touches::new(self, setting, motion, (Wanted::Now, drift)).first(0.0, |_, _| false);
        if let Some((0.0, pairs)) = touches {
            let moment = Wanted::Now.moment(motion.positions(), motion.velocity, [0.0, drift]);
            for pair in pairs {
                books.touches += self.touch(setting, moment, pair, time);
            }
        }
    }

    /// Solves the closed contacts; those beyond their strength break together,
    /// then the island is solved again.
    fn solve_closed(
        &mut self,
        setting: &Setting<D>,
        motion: &mut Motion<D>,
        (interval, drift): (f64, f64),
        books: &mut Books,
    ) -> Vec<Constraint<D>> {
        let at = motion.positions();
        let of = |live: &Live<D>, operator| {
            live.constraint(operator, (drift, interval), setting.tolerance)
        };
        let live = self.live.par_iter().with_min_len(SHARE);
        let live = live.map(|live| of(live, live.operator(setting.surface, at)));
        let mut constraints: Vec<_> = live.collect();
        let precision = (RESIDUAL, self.precision(setting, at, drift));
        let least = setting.least_speed(drift);
        books.solution(|| self.system.load(&constraints, setting.mobility(interval)));
        let nodes = self.system.nodes().iter();
        let start = nodes.map(|&node| (node, motion.velocity[node as usize]));
        let start: Vec<_> = start.collect();
        let (mut missed, mut again) = (vec![0.0; self.live.len()], 0);
        loop {
            let system = &mut self.system;
            books.count(|| system.solve(&mut constraints, motion.velocity, precision));
            let mut broken = false;
            for (live, constraint) in self.live.iter_mut().zip(&constraints) {
                broken |= live.breaks(constraint, motion.velocity, least);
            }
            if broken {
                let known = self.live.iter().zip(&missed);
                for (constraint, (live, missed)) in constraints.iter_mut().zip(known) {
                    *constraint = of(live, constraint.operator);
                    constraint.target[0] -= missed / drift;
                }
            } else if again < AGAIN
                && let Some(misses) = self.misses(setting, motion, drift, &constraints)
            {
                again += 1;
                for (k, miss) in misses.into_iter().enumerate() {
                    missed[k] += miss;
                    constraints[k].target[0] -= miss / drift;
                }
            } else {
                return constraints;
            }
            for (node, velocity) in &start {
                motion.velocity[*node as usize] = *velocity;
            }
        }
    }

    /// By how much the gaps of contacts that press will miss theirs after the drift, or
    /// sink in as they part, m; if that is too far of any.
    fn misses(
        &self,
        setting: &Setting<D>,
        motion: &Motion<D>,
        drift: f64,
        constraints: &[Constraint<D>],
    ) -> Option<Vec<f64>> {
        let then = motion.positions().after(motion.velocity, drift);
        let miss = |(live, constraint): (&Live<D>, &Constraint<D>)| {
            let projection = setting.surface.project(live.pair, then);
            let miss = projection.gap - live.offset[0];
            let sinks = miss < -MISS * setting.tolerance && projection.outside <= setting.tolerance;
            // Edges that have turned parallel have no gap.
            let presses = constraint.impulse[0] > 0.0 && projection.outside.is_finite();
            if presses || sinks { miss } else { 0.0 }
        };
        let pairs = self.live.par_iter().zip(constraints).with_min_len(SHARE);
        let misses: Vec<f64> = pairs.map(miss).collect();
        let is_far = |miss: &f64| miss.abs() > MISS * setting.tolerance;
        misses.iter().any(is_far).then_some(misses)
    }

    /// The drift of a substep: free flight to each first touch (time stage 1),
    /// then unified (time stage 2).
    pub(crate) fn drift(
        &mut self,
        setting: &Setting<D>,
        motion: &mut Motion<D>,
        (time, duration): (f64, f64),
        bodies: &mut Bodies<D>,
        receive: Receive<D>,
        books: &mut Books,
    ) {
        let mut touches = Touches::new(self, setting, motion, (Wanted::InDrift, duration));
        let mut elapsed = 0.0;
        for event in 0.. {
            let window = if event + touches.ahead() <= EVENTS {
                SIMULTANEOUS * (duration - elapsed)
            } else {
                duration / EVENTS as f64
            };
            let close = |instant: f64, pair: Pair| {
                let at = motion.positions();
                let then = at.after(motion.velocity, (instant - elapsed).max(0.0));
                let projection = setting.surface.project(pair, then);
                projection.gap <= EARLY * setting.tolerance
                    && projection.outside <= setting.tolerance
            };
            let Some((instant, pairs)) = touches.first(window, close) else {
                break;
            };
            let wait = (instant - elapsed).max(0.0);
            self.go(motion, wait);
            elapsed += wait;
            let remaining = [0.0, duration - elapsed];
            let moment = Wanted::InDrift.moment(motion.positions(), motion.velocity, remaining);
            let mut begun = 0;
            for pair in pairs {
                begun += self.touch(setting, moment, pair, time + elapsed);
            }
            books.touches += begun;
            let before = self.velocities(motion);
            let drift = (duration, duration - elapsed);
            self.meet(setting, motion, drift, bodies, receive, books);
            touches.update(
                self,
                setting,
                motion,
                (&before, begun > 0),
                (elapsed, duration),
            );
        }
        self.go(motion, duration - elapsed);
    }

    /// Moves the island at the velocities that the pairs near were looked at with.
    fn go(&mut self, motion: &mut Motion<D>, duration: f64) {
        motion.drift(&self.nodes, duration);
        self.near.go(duration);
    }

    /// Relative velocity below which contacts ask for what positions cannot say,
    /// m/s: their round-off over a drift of `drift` seconds.
    pub(super) fn precision(&self, setting: &Setting<D>, at: Positions<D>, drift: f64) -> f64 {
        let coordinates = self.nodes.iter().flat_map(|&node| at.at(node));
        let size = coordinates.fold(0.0_f64, |size, x| size.max(x.abs()));
        setting.least_speed(drift).max(ROUND_OFF * size / drift)
    }

    /// All nodes that constraints may move, once each, and their velocities, m/s:
    /// those of the island, then those beyond, which a contact that has slid on may
    /// reach; both sorted.
    pub(super) fn start(
        &self,
        constraints: &[Constraint<D>],
        motion: &Motion<D>,
    ) -> Vec<(u32, [f64; D])> {
        let reached = constraints.iter().flat_map(|c| c.operator.nodes()).copied();
        let mut beyond: Vec<u32> = reached.filter(|node| !self.has(*node)).collect();
        beyond.sort_unstable();
        beyond.dedup();
        let nodes = self.nodes.iter().chain(&beyond);
        nodes
            .map(|&node| (node, motion.velocity[node as usize]))
            .collect()
    }

    /// Whether a node moves with the island.
    fn has(&self, node: u32) -> bool {
        self.nodes.binary_search(&node).is_ok()
    }

    /// Velocities of the nodes, m/s.
    pub(super) fn velocities(&self, motion: &Motion<D>) -> Vec<[f64; D]> {
        let of = |&node: &u32| motion.velocity[node as usize];
        self.nodes.iter().map(of).collect()
    }

    /// Closes a pair at the moment of its touch, unless another one already says the
    /// same. Returns how many contacts have begun: one or none.
    pub(crate) fn touch(
        &mut self,
        setting: &Setting<D>,
        moment: Moment<D>,
        pair: Pair,
        time: f64,
    ) -> u64 {
        let (surface, at) = (setting.surface, moment.touch);
        let blocks = setting.blocks(pair);
        let mut known = self.live.iter().filter(|live| live.between(blocks));
        if known.any(|live| live.says(setting, pair, moment)) {
            return 0;
        }
        let projection = surface.project(pair, at);
        let (kind, area) = surface.classify(pair, at, setting.tolerance);
        let foot = projection.foot.map(|w| w.clamp(0.0, 1.0));
        let record = Record {
            kind,
            time_on: time,
            time_off: None,
            position: pad(&surface.point(pair, at)),
            area,
            step_impulse: 0.0,
            peak_normal_force: 0.0,
            normal_impulse: 0.0,
            shear_impulse: 0.0,
            slip: 0.0,
            level: setting.halvings_at(pair),
            blocks,
        };
        let offset = surface.operator(pair, &foot, at).offset;
        self.live.push(Live {
            pair,
            law: setting.laws.between(blocks[0], blocks[1]),
            foot,
            offset,
            given: setting.overlaps.given(blocks, offset[0]),
            sticks: true,
            joint: false,
            fresh: true,
            impulse: [0.0; D],
            interval: 0.0,
            shear_spring: [0.0; D],
            record,
        });
        1
    }
}

impl<const D: usize> Island<D> {
    /// Moves that take the penetration out of the island, m.
    pub(crate) fn part(&mut self, setting: &Setting<D>, at: Positions<D>) -> Vec<(u32, [f64; D])> {
        // The solver of velocities, over one second from rest, without shear.
        let mut constraints: Vec<Constraint<D>> = Vec::with_capacity(self.live.len());
        for live in &mut self.live {
            let operator = live.operator(setting.surface, at);
            let mut target = [0.0; D];
            target[0] = live.penetration();
            live.offset[0] += target[0];
            constraints.push(Constraint {
                operator,
                target,
                limit: Limit::default(),
                impulse: [0.0; D],
                borne: [0.0; D],
            });
        }
        let precision = self.precision(setting, at, 1.0);
        self.system.load(&constraints, setting.mobility(0.0));
        self.system.solve_from_rest(&constraints, precision);
        let moved = |(_, shift): &(u32, [f64; D])| *shift != [0.0; D];
        self.system.velocities().filter(moved).collect()
    }
}
