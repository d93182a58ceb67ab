//! Contacts that share nodes: their substep in two time stages (the paper's
//! sections 3 and 4).

use crate::contact::live::{Live, Record};
use crate::contact::solve::{Constraint, Limit, shear_norm, solve};
use crate::contact::surface::{Pair, Positions, Surface};
use crate::contact::{Interior, Jump};
use crate::model::inertia::{Inertia, Mobility};
use crate::model::motion::Motion;
use crate::vector::{add_scaled, pad};

/// First touches within one substep that are taken one after the other; what
/// would touch later in it is left to the clean-up of positions.
const MAX_EVENTS: usize = 64;

/// Touches closer in time than this share of the substep are one event.
const SIMULTANEOUS: f64 = 1e-9;

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
}

impl<'a, const D: usize> Setting<'a, D> {
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
    pub(crate) touches: u64,
    /// Worst residual of a solve.
    pub(crate) residual: f64,
}

/// Receives each impulse on a node, N·s.
pub(crate) type Receive<'a, const D: usize> = &'a mut dyn FnMut(u32, &[f64; D]);

/// Live and possible contacts that share nodes, solved together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Island<const D: usize> {
    /// Open pairs that may touch in this coarse step.
    pub(crate) near: Vec<Pair>,
    /// Closed ones.
    pub(crate) live: Vec<Live<D>>,
    /// Nodes that move with the island, sorted.
    pub(crate) nodes: Vec<u32>,
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
        let at = motion.positions();
        self.live.retain_mut(|live| {
            let goes_on = live.follow(setting.surface, at, setting.tolerance);
            if !goes_on {
                ended.push(live.record.clone());
            }
            goes_on
        });
        self.close_touching(setting, motion, (time, drift), books);
        if self.live.is_empty() {
            return ended;
        }
        let mut constraints = self.solve_closed(setting, motion, (interval, drift), books);
        for (live, constraint) in self.live.iter_mut().zip(&mut constraints) {
            let [old, new] = [before, motion.velocity].map(|v| relative(constraint, v));
            let work = |r: usize| 0.5 * constraint.impulse[r] * (old[r] + new[r]);
            let sheared: f64 = (1..D).map(work).sum();
            if std::mem::take(&mut live.fresh) {
                books.impact_loss -= work(0) + sheared;
            } else {
                books.friction_loss -= sheared;
            }
            live.impulse = constraint.impulse;
            live.interval = interval;
            live.record.count(&constraint.impulse);
            deliver(constraint, &constraint.impulse, receive);
            if constraint.slips() {
                live.slide();
                live.record.slip += shear_norm(&new) * drift;
            } else if !live.sticks {
                live.stick();
            }
        }
        let mut opens = constraints.iter().map(|constraint| {
            // Clamped at what it bears, and parting by more than round-off.
            let parting = constraint.relative_velocity(0, motion.velocity) - constraint.target[0];
            constraint.impulse[0] <= -constraint.limit.tension
                && parting * drift > 1e-10 * setting.tolerance
        });
        self.live.retain(|live| {
            let opens = opens.next().unwrap_or(false);
            if opens {
                ended.push(live.record.clone());
            }
            !opens
        });
        ended
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
        for (wait, pair) in self.first_touches(setting, motion, drift) {
            if wait == 0.0 {
                books.touches += self.touch(setting, motion.positions(), pair, time);
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
        let mobility = setting.mobility(interval);
        let start = self.velocities(motion);
        loop {
            let at = motion.positions();
            let constraint = |live: &Live<D>| {
                live.constraint(live.operator(setting.surface, at), drift, interval)
            };
            let mut constraints: Vec<_> = self.live.iter().map(constraint).collect();
            let residual = solve(&mut constraints, mobility, motion.velocity);
            books.residual = books.residual.max(residual);
            let mut broken = false;
            for (live, constraint) in self.live.iter_mut().zip(&constraints) {
                let pulled = live.joint && constraint.impulse[0] <= -constraint.limit.tension;
                if live.joint && (pulled && constraint.limit.tension > 0.0 || constraint.slips()) {
                    live.slide();
                    broken = true;
                }
            }
            if !broken {
                return constraints;
            }
            for (&node, velocity) in self.nodes.iter().zip(&start) {
                motion.velocity[node as usize] = *velocity;
            }
        }
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
        let mut elapsed = 0.0;
        for _ in 0..MAX_EVENTS {
            let remaining = duration - elapsed;
            let touches = self.first_touches(setting, motion, remaining);
            let Some(&(wait, _)) = touches.first() else {
                break;
            };
            motion.drift(&self.nodes, wait);
            elapsed += wait;
            for (_, pair) in touches {
                books.touches += self.touch(setting, motion.positions(), pair, time + elapsed);
            }
            let before = self.velocities(motion);
            books.impact_loss += self.collide(setting, motion, duration, &|_| {}, receive);
            let jump = Jump {
                nodes: &self.nodes,
                before: &before,
                taken: bodies.taken,
                remaining: duration - elapsed,
            };
            let impulses = bodies.interior.split(motion, &jump);
            let kick = |motion: &mut Motion<D>| {
                for (node, impulse) in &impulses {
                    setting
                        .inertia
                        .push(*node as usize, impulse, motion.velocity);
                }
            };
            if !impulses.is_empty() {
                books.friction_loss += self.collide(setting, motion, duration, &kick, receive);
            }
            let remaining = duration - elapsed;
            books.impact_loss -= bodies.interior.settle(motion, remaining);
        }
        motion.drift(&self.nodes, duration - elapsed);
    }

    /// Velocities of the nodes, m/s.
    fn velocities(&self, motion: &Motion<D>) -> Vec<[f64; D]> {
        let of = |&node: &u32| motion.velocity[node as usize];
        self.nodes.iter().map(of).collect()
    }

    /// The open pairs that touch first within `remaining`, with their times.
    fn first_touches(
        &self,
        setting: &Setting<D>,
        motion: &Motion<D>,
        remaining: f64,
    ) -> Vec<(f64, Pair)> {
        let (surface, at) = (setting.surface, motion.positions());
        let mut touches: Vec<(f64, Pair)> = Vec::new();
        for &pair in &self.near {
            if self.live.iter().any(|live| live.pair == pair) {
                continue;
            }
            let impact =
                surface.time_of_impact(pair, at, motion.velocity, remaining, setting.tolerance);
            let Some(wait) = impact else { continue };
            let then = at.after(motion.velocity, wait);
            let known =
                |live: &Live<D>| surface.same_contact(live.pair, pair, then, setting.tolerance);
            if surface.admits(pair, then) && !self.live.iter().any(known) {
                touches.push((wait, pair));
            }
        }
        touches.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let first = touches.first().map_or(0.0, |touch| touch.0);
        touches.retain(|touch| touch.0 <= first + SIMULTANEOUS * remaining);
        touches
    }

    /// Closes a pair, unless another one already says the same. Returns how
    /// many contacts have begun: one or none.
    pub(crate) fn touch(
        &mut self,
        setting: &Setting<D>,
        at: Positions<D>,
        pair: Pair,
        time: f64,
    ) -> u64 {
        let surface = setting.surface;
        let known = |live: &Live<D>| surface.same_contact(live.pair, pair, at, setting.tolerance);
        if self.live.iter().any(known) {
            return 0;
        }
        let blocks = [
            surface.main_nodes(pair.main)[0],
            surface.target_nodes(pair.target)[0],
        ]
        .map(|node| setting.block_of[node as usize]);
        let projection = surface.project(pair, at);
        let (kind, area) = surface.classify(pair, at, setting.tolerance);
        let mut offset = [0.0; D];
        offset[0] = projection.gap.min(0.0);
        let record = Record {
            kind,
            time_on: time,
            time_off: None,
            position: pad(&at.at(surface.main_nodes(pair.main)[0])),
            area,
            step_impulse: 0.0,
            peak_normal_force: 0.0,
            normal_impulse: 0.0,
            shear_impulse: 0.0,
            slip: 0.0,
            level: 0,
            blocks,
        };
        self.live.push(Live {
            pair,
            law: setting.laws.between(blocks[0], blocks[1]),
            foot: projection.foot.map(|w| w.clamp(0.0, 1.0)),
            offset,
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

    /// The impact of the pairs that have just touched, (4): perfectly
    /// inelastic for the points, within the shear limit; and `kick` on the way,
    /// against which the pairs hold. Returns the loss (5), J.
    pub(crate) fn collide(
        &mut self,
        setting: &Setting<D>,
        motion: &mut Motion<D>,
        duration: f64,
        kick: &dyn Fn(&mut Motion<D>),
        receive: Receive<D>,
    ) -> f64 {
        let at = motion.positions();
        let mut constraints: Vec<Constraint<D>> = Vec::with_capacity(self.live.len());
        for live in &self.live {
            let mut bare = live.clone();
            bare.joint &= !live.fresh;
            bare.interval = 0.0; // no warm start: an impact is like no other
            let operator = bare.operator(setting.surface, at);
            constraints.push(bare.constraint(operator, duration, 0.0));
            if live.fresh
                && let Some(constraint) = constraints.last_mut()
            {
                constraint.target = [0.0; D];
            }
        }
        let before: Vec<[f64; D]> = constraints
            .iter()
            .map(|c| relative(c, motion.velocity))
            .collect();
        kick(motion);
        solve(&mut constraints, setting.mobility(0.0), motion.velocity);
        let mut loss = 0.0;
        for ((live, constraint), old) in self.live.iter_mut().zip(&constraints).zip(before) {
            let new = relative(constraint, motion.velocity);
            for r in 0..D {
                loss -= 0.5 * constraint.impulse[r] * (old[r] + new[r]);
            }
            live.record.count(&constraint.impulse);
            deliver(constraint, &constraint.impulse, receive);
            if live.fresh {
                live.fresh = false;
                if constraint.slips() && !live.joint {
                    live.slide();
                }
            }
        }
        loss
    }
}

impl<const D: usize> Island<D> {
    /// Moves that take the penetration out of the island, m.
    pub(crate) fn part(&mut self, setting: &Setting<D>, at: Positions<D>) -> Vec<(u32, [f64; D])> {
        // The solver of velocities, over one second from rest, without shear.
        let last = self.nodes.last().map_or(0, |&node| node as usize + 1);
        let mut moves = vec![[0.0; D]; last];
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
            });
        }
        solve(&mut constraints, setting.mobility(0.0), &mut moves);
        self.nodes
            .iter()
            .map(|&node| (node, moves[node as usize]))
            .collect()
    }
}

/// Relative velocity of all rows, m/s.
fn relative<const D: usize>(constraint: &Constraint<D>, velocity: &[[f64; D]]) -> [f64; D] {
    std::array::from_fn(|r| constraint.relative_velocity(r, velocity))
}

/// Tells `receive` of the impulses of a contact on its nodes.
fn deliver<const D: usize>(constraint: &Constraint<D>, impulse: &[f64; D], receive: Receive<D>) {
    for (k, &node) in constraint.operator.nodes().iter().enumerate() {
        let mut on = [0.0; D];
        add_scaled(&mut on, 1.0, &constraint.impulse_on(k, impulse));
        receive(node, &on);
    }
}
