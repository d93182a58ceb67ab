//! Contacts that share nodes: their substep in two time stages (the paper's
//! sections 3 and 4).

pub(crate) mod build;
pub(crate) mod impact;
pub(crate) mod kick;
pub(crate) mod parallel;
pub(crate) mod rollback;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::contact::ccd::touch_events::{Touches, Wanted};
use crate::contact::constraint::contact_point::{Live, Moment, Record};
use crate::contact::detection::initial_overlap::{Overlaps, ordered};
use crate::contact::detection::separation_bounds::Near;
use crate::contact::island::kick::Hold;
use crate::contact::island::rollback::Trail;
use crate::contact::kicked::Kicked;
use crate::contact::solver::Solver;
use crate::contact::solver::gauss_seidel::Constraint;
use crate::contact::surface::{Configuration, Pair, Surface};
use crate::contact::{Interior, Timing};
use crate::math::profile::{Stage, Stopwatch};
use crate::math::vector::pad;
use crate::model::inverse_mass::{Inertia, Mobility};
use crate::model::kinematics::Motion;
use crate::model::ledger::Velocity;

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
    pub(crate) laws: &'a crate::contact::constraint::law::Laws,
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
pub(crate) struct Bodies<'a, const D: usize, I: Interior<D>> {
    pub(crate) interior: &'a I,
    /// The touch in hand.
    pub(crate) touch: I::Touch,
    pub(crate) taken: &'a [bool],
    /// What the island moves in its drift.
    pub(crate) trail: &'a mut Trail<D>,
}

/// Energies of contact, J, and other sums.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// Deepest penetration at the start of a kick, m.
    pub(crate) penetration: f64,
    /// At which velocity impulses work.
    #[serde(skip)]
    pub(crate) at: Velocity,
    /// Time that contact takes.
    #[serde(skip)]
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

    /// Empty ones of the same kind, for another thread.
    pub(super) fn beside(&self) -> Self {
        Self {
            at: self.at,
            watch: self.watch.beside(),
            ..Self::default()
        }
    }

    /// Adds others, that have been kept since the last lap on any number of threads.
    pub(super) fn add<'a>(&mut self, others: impl Iterator<Item = &'a Self> + Clone) {
        for other in others.clone() {
            self.impact_loss += other.impact_loss;
            self.friction_loss += other.friction_loss;
            self.fracture_loss += other.fracture_loss;
            self.touches += other.touches;
            self.unsolved += other.unsolved;
            self.residual = self.residual.max(other.residual);
            self.hurried += other.hurried;
            self.penetration = self.penetration.max(other.penetration);
        }
        self.watch.lap_as(others.map(|other| &other.watch));
    }

    /// Counts the time of work for a solve.
    pub(super) fn solution<T>(&mut self, work: impl FnOnce() -> T) -> T {
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

/// Who receives the impulses of a drift.
pub(crate) struct Receivers<'a, const D: usize> {
    pub(crate) of_contacts: Receive<'a, D>,
    /// Those of elements on nodes that are held.
    pub(crate) on_held: Receive<'a, D>,
}

/// Live and possible contacts that share nodes, solved together.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Island<const D: usize> {
    /// Open pairs that may touch in this coarse step.
    #[serde(skip)]
    pub(crate) near: Near,
    /// Closed ones.
    pub(crate) live: Vec<Live<D>>,
    /// Nodes that move with the island, sorted.
    pub(crate) nodes: Vec<u32>,
    /// What its contacts do to each other: kept while they stay, and for its storage.
    #[serde(skip)]
    pub(super) system: Solver<D>,
    /// When open pairs touch: known from a kick on, through its drift; storage until the next.
    #[serde(skip)]
    pub(super) touches: Touches<D>,
    /// What its contacts bear in a kick.
    #[serde(skip)]
    pub(super) held: Hold<D>,
}

impl<const D: usize> Island<D> {
    /// One without pairs and nodes, which keeps what may serve it if they come back.
    pub(super) fn restart(self) -> Self {
        Self {
            system: self.system,
            touches: self.touches,
            held: self.held,
            ..Self::default()
        }
    }

    /// The drift of a substep after its kick: free flight to each first touch (time
    /// stage 1), then unified (time stage 2).
    pub(crate) fn drift(
        &mut self,
        setting: &Setting<D>,
        motion: &mut Motion<D>,
        (time, duration): (f64, f64),
        bodies: &mut Bodies<D, impl Interior<D>>,
        receivers: &mut Receivers<D>,
        books: &mut Books,
    ) {
        let mut touches = std::mem::take(&mut self.touches);
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
                let projection = setting.surface.project(pair, then.into());
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
            let moment = Moment::in_drift(motion.positions().into(), motion.velocity, remaining);
            let begun = self.touch(setting, moment, &pairs, time + elapsed);
            books.touches += begun;
            let before = self.velocities(motion.velocity);
            let drift = (duration, duration - elapsed);
            self.meet(setting, motion, (&before, drift), bodies, receivers, books);
            touches.update(
                self,
                setting,
                &Kicked::new(motion, None),
                (&before, begun > 0),
                (Wanted::InDrift, (elapsed, duration)),
            );
        }
        self.go(motion, duration - elapsed);
        self.touches = touches;
    }

    /// Kick interval and drift of its nodes, s, if they are due.
    pub(super) fn timing(&self, timing: Timing) -> Option<(f64, f64)> {
        timing(*self.nodes.first()?)
    }

    /// How many pairs are closed, or known to touch in the drift.
    pub(super) fn pairs(&self) -> usize {
        self.live.len() + self.touches.ahead()
    }

    /// Whether no pair is known to touch in the drift.
    pub(super) fn flies_freely(&self) -> bool {
        self.touches.ahead() == 0
    }

    /// Moves the island at the velocities that the pairs near were looked at with.
    pub(super) fn go(&mut self, motion: &mut Motion<D>, duration: f64) {
        motion.drift(&self.nodes, duration);
        self.near.go(duration);
    }

    /// Relative velocity below which contacts ask for what positions cannot say,
    /// m/s: their round-off over a drift of `drift` seconds.
    pub(super) fn precision(&self, setting: &Setting<D>, at: Configuration<D>, drift: f64) -> f64 {
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
    pub(super) fn velocities(&self, velocity: &[[f64; D]]) -> Vec<[f64; D]> {
        let of = |&node: &u32| velocity[node as usize];
        self.nodes.iter().map(of).collect()
    }

    /// Closes pairs at the moment of their touch, one after the other, each unless another one
    /// already says the same. Returns how many contacts have begun: they are the last ones.
    pub(crate) fn touch(
        &mut self,
        setting: &Setting<D>,
        moment: Moment<D>,
        pairs: &[Pair],
        time: f64,
    ) -> u64 {
        let before = self.live.len();
        let mut between = self.between(setting, pairs);
        for &pair in pairs {
            let known = between.entry(ordered(setting.blocks(pair))).or_default();
            let says = |&number: &usize| self.live[number].says(setting, pair, moment);
            if !known.iter().any(says) {
                known.push(self.live.len());
                self.begin(setting, moment.touch, pair, time);
            }
        }
        (self.live.len() - before) as u64
    }

    /// The contacts between the blocks of some pairs: found for all of them together, as an
    /// island may have very many.
    fn between(&self, setting: &Setting<D>, pairs: &[Pair]) -> BTreeMap<[u32; 2], Vec<usize>> {
        let blocks = pairs.iter().map(|&pair| ordered(setting.blocks(pair)));
        let mut between: BTreeMap<_, Vec<usize>> = blocks.map(|both| (both, vec![])).collect();
        if between.is_empty() {
            return between;
        }
        for (number, live) in self.live.iter().enumerate() {
            if let Some(known) = between.get_mut(&ordered(live.record.blocks)) {
                known.push(number);
            }
        }
        between
    }

    /// Begins a contact of a pair that touches.
    fn begin(&mut self, setting: &Setting<D>, at: Configuration<D>, pair: Pair, time: f64) {
        let (surface, blocks) = (setting.surface, setting.blocks(pair));
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
        let operator = surface.operator(pair, &foot, at);
        self.live.push(Live {
            pair,
            law: setting.laws.between(blocks[0], blocks[1]),
            foot,
            normal: operator.frame[0],
            offset: operator.offset,
            given: setting.overlaps.given(blocks, operator.offset[0]),
            sticks: true,
            joint: false,
            fresh: true,
            impulse: [0.0; D],
            interval: 0.0,
            force: [0.0; D],
            force_before: [0.0; D],
            shear_spring: [0.0; D],
            record,
        });
    }
}

impl<const D: usize> Island<D> {
    /// Moves that take the penetration out of the island, m.
    pub(crate) fn part(
        &mut self,
        setting: &Setting<D>,
        at: Configuration<D>,
    ) -> Vec<(u32, [f64; D])> {
        // The solver of velocities, over one second from rest, without shear.
        let mut constraints: Vec<Constraint<D>> = Vec::with_capacity(self.live.len());
        for live in &mut self.live {
            let mut constraint = Constraint::default();
            live.relate(&mut constraint.operator, setting.surface, at);
            constraint.target[0] = live.penetration();
            live.offset[0] += constraint.target[0];
            constraints.push(constraint);
        }
        let precision = self.precision(setting, at, 1.0);
        self.system.load(&constraints, setting.mobility(0.0));
        let mut shifts = self.system.solve_from_rest(&constraints, precision);
        shifts.retain(|(_, shift)| *shift != [0.0; D]);
        shifts
    }
}
