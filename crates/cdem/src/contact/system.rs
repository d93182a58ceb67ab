//! An island on its own: what the impulses of its contacts do to each other.
//!
//! Storage is kept from solve to solve, and as large as the nodes in use.
//! Contacts mostly stay, so their nodes are numbered only when these change.

use std::ops::Range;

use crate::contact::face::Face;
use crate::contact::solve::{Constraint, Limit, Search, shear_norm};
use crate::contact::surface::Operator;
use crate::model::inertia::Mobility;
use crate::vector::{add_scaled, dot};

/// Inverse mass of a row whose nodes are held, over what it would be of free
/// ones: round-off.
const HELD: f64 = 1e-12;

/// Contacts that share nodes, their nodes numbered anew and side by side.
#[derive(Clone, Debug, Default)]
pub(crate) struct System<const D: usize> {
    /// Nodes that impulses move, sorted.
    nodes: Vec<u32>,
    /// Their velocities, m/s.
    pub(super) velocity: Vec<[f64; D]>,
    pub(super) points: Vec<Point<D>>,
    /// Relative velocities as functions of nodal velocities.
    operators: Vec<Term<D>>,
    /// Velocities that impulses make, 1/kg.
    gains: Vec<Term<D>>,
    /// For each operator and each node that it moves, the place of that among the
    /// gains of its point.
    slots: Vec<u32>,
    /// Scratch of the solver.
    pub(super) search: Search<D>,
    pub(super) face: Face<D>,
}

/// What a contact has to do with a node: a vector for each row of its frame.
#[derive(Clone, Debug)]
struct Term<const D: usize> {
    node: u32,
    rows: [[f64; D]; D],
}

/// A contact in its system.
#[derive(Clone, Debug)]
pub(super) struct Point<const D: usize> {
    /// Its part of the operators and of the gains.
    operators: Range<usize>,
    gains: Range<usize>,
    /// Where its slots begin.
    slots: usize,
    /// Relative velocity in each row for a unit impulse in each column, 1/kg.
    own: [[f64; D]; D],
    /// Inverse mass seen by the normal and by the tangents, 1/kg; 0 where the
    /// nodes are held. One for all tangents keeps the friction disc a disc.
    pub(super) compliance: [f64; 2],
    pub(super) target: [f64; D],
    pub(super) limit: Limit,
    pub(super) impulse: [f64; D],
    borne: f64,
}

impl<const D: usize> System<D> {
    /// Takes the geometry of the constraints.
    pub(crate) fn load(&mut self, constraints: &[Constraint<D>], mobility: Mobility<D>) {
        if !self.fits(constraints) {
            self.number(constraints, mobility);
        }
        for (number, constraint) in constraints.iter().enumerate() {
            self.fill(number, &constraint.operator, mobility);
        }
    }

    /// Whether the constraints are between the nodes that they were.
    fn fits(&self, constraints: &[Constraint<D>]) -> bool {
        let same = |(point, constraint): (&Point<D>, &Constraint<D>)| {
            let terms = self.operators[point.operators.clone()].iter();
            let nodes = terms.map(|term| self.nodes[term.node as usize]);
            nodes.eq(constraint.operator.nodes().iter().copied())
        };
        self.points.len() == constraints.len() && self.points.iter().zip(constraints).all(same)
    }

    /// Numbers the nodes.
    fn number(&mut self, constraints: &[Constraint<D>], mobility: Mobility<D>) {
        let term = |node: u32| Term {
            node,
            rows: [[0.0; D]; D],
        };
        self.points.clear();
        self.operators.clear();
        self.gains.clear();
        self.slots.clear();
        for constraint in constraints {
            let start = [self.operators.len(), self.gains.len()];
            let slots = self.slots.len();
            for &node in constraint.operator.nodes() {
                self.operators.push(term(node));
                for (other, _) in mobility.column(node) {
                    let gains = &self.gains[start[1]..];
                    let known = gains.iter().position(|gain| gain.node == other);
                    self.slots.push(known.unwrap_or(gains.len()) as u32);
                    if known.is_none() {
                        self.gains.push(term(other));
                    }
                }
            }
            self.points.push(Point {
                operators: start[0]..self.operators.len(),
                gains: start[1]..self.gains.len(),
                slots,
                own: [[0.0; D]; D],
                compliance: [0.0; 2],
                target: [0.0; D],
                limit: Limit::default(),
                impulse: [0.0; D],
                borne: 0.0,
            });
        }
        self.nodes.clear();
        self.nodes.extend(self.gains.iter().map(|gain| gain.node));
        self.nodes.sort_unstable();
        self.nodes.dedup();
        for term in self.operators.iter_mut().chain(&mut self.gains) {
            term.node = self.nodes.partition_point(|&other| other < term.node) as u32;
        }
    }

    /// Takes the operator of a contact, with what its impulses do.
    fn fill(&mut self, number: usize, operator: &Operator<D>, mobility: Mobility<D>) {
        let point = &mut self.points[number];
        let gains = &mut self.gains[point.gains.clone()];
        let terms = &mut self.operators[point.operators.clone()];
        for gain in &mut *gains {
            gain.rows = [[0.0; D]; D];
        }
        let mut slots = self.slots[point.slots..].iter();
        for (k, term) in terms.iter_mut().enumerate() {
            term.rows = std::array::from_fn(|r| operator.rows[r][k]);
            for ((_, inverse), &slot) in mobility.column(operator.nodes[k]).zip(&mut slots) {
                let gain = &mut gains[slot as usize];
                for r in 0..D {
                    for c in 0..D {
                        gain.rows[r][c] += inverse[c] * term.rows[r][c];
                    }
                }
            }
        }
        let mut unheld = [0.0; D];
        point.own = [[0.0; D]; D];
        let mut slots = self.slots[point.slots..].iter();
        for (term, &node) in terms.iter().zip(operator.nodes()) {
            let mass = mobility.inertia.mass()[node as usize];
            for r in 0..D {
                unheld[r] += dot(&term.rows[r], &term.rows[r]) / mass;
            }
            let moved = mobility.inertia.coupled(node as usize).zip(&mut slots);
            for (_, &slot) in moved.filter(|(other, _)| *other == node as usize) {
                for r in 0..D {
                    for s in 0..D {
                        point.own[r][s] += dot(&term.rows[r], &gains[slot as usize].rows[s]);
                    }
                }
            }
        }
        // Between nodes that are held along the row there is nothing to push.
        for r in 0..D {
            if point.own[r][r] <= HELD * unheld[r] {
                point.own[r][r] = 0.0;
            }
        }
        let tangents = (1..D).map(|r| point.own[r][r]);
        point.compliance = [point.own[0][0], tangents.fold(0.0, f64::max)];
    }

    /// Begins a solve: impulses, bounds, and the velocities without impulses.
    pub(super) fn begin(
        &mut self,
        constraints: &[Constraint<D>],
        velocity: impl Fn(u32) -> [f64; D],
    ) {
        self.velocity.clear();
        let velocities = self.nodes.iter().map(|&node| velocity(node));
        self.velocity.extend(velocities);
        for (number, constraint) in constraints.iter().enumerate() {
            let point = &mut self.points[number];
            point.target = constraint.target;
            point.limit = constraint.limit;
            point.borne = constraint.borne;
            point.impulse = [0.0; D];
            let start = std::array::from_fn(|r| {
                if point.moves(r) {
                    constraint.impulse[r]
                } else {
                    0.0
                }
            });
            self.add(number, &start);
        }
    }

    /// Nodes and their velocities, m/s.
    pub(crate) fn velocities(&self) -> impl Iterator<Item = (u32, [f64; D])> + '_ {
        let velocities = self.velocity.iter().copied();
        self.nodes.iter().copied().zip(velocities)
    }

    /// One sweep of Gauss–Seidel: its largest change of a relative velocity,
    /// and the largest that a normal impulse of the substep makes, m/s.
    pub(super) fn sweep(&mut self) -> (f64, f64) {
        let (mut change, mut scale) = (0.0_f64, f64::MIN_POSITIVE);
        for number in 0..self.points.len() {
            let relative = self.relative_velocity(number, &self.velocity);
            let point = &mut self.points[number];
            let old = point.impulse;
            change = change.max(point.relax(&relative));
            let normal = point.impulse[0].abs().max(point.borne);
            scale = scale.max(normal * point.compliance[0]);
            let step = std::array::from_fn(|r| point.impulse[r] - old[r]);
            if step != [0.0; D] {
                let gains = &self.gains[point.gains.clone()];
                apply(gains, &step, &mut self.velocity);
            }
        }
        (change, scale)
    }

    /// Relative velocity of a contact, m/s.
    #[inline]
    pub(super) fn relative_velocity(&self, point: usize, velocity: &[[f64; D]]) -> [f64; D] {
        let mut sum = [0.0; D];
        for term in &self.operators[self.points[point].operators.clone()] {
            let node = &velocity[term.node as usize];
            for r in 0..D {
                sum[r] += dot(&term.rows[r], node);
            }
        }
        sum
    }

    /// Adds to an impulse, and what that does to the velocities.
    pub(super) fn add(&mut self, point: usize, change: &[f64; D]) {
        let point = &mut self.points[point];
        add_scaled(&mut point.impulse, 1.0, change);
        apply(&self.gains[point.gains.clone()], change, &mut self.velocity);
    }

    /// Velocities that an impulse of a contact makes alone, m/s.
    pub(super) fn apply(&self, point: usize, impulse: &[f64; D], velocity: &mut [[f64; D]]) {
        apply(
            &self.gains[self.points[point].gains.clone()],
            impulse,
            velocity,
        );
    }
}

/// Adds the velocities that an impulse makes, m/s.
#[inline]
fn apply<const D: usize>(gains: &[Term<D>], impulse: &[f64; D], velocity: &mut [[f64; D]]) {
    for gain in gains {
        let node = &mut velocity[gain.node as usize];
        for r in 0..D {
            add_scaled(node, impulse[r], &gain.rows[r]);
        }
    }
}

impl<const D: usize> Point<D> {
    /// Whether an impulse in row `r` moves anything.
    pub(super) fn moves(&self, r: usize) -> bool {
        self.own[r][r] > 0.0
    }

    /// The impulse with which this contact alone would do what is asked of it at
    /// a relative velocity, the normal first; the largest change of relative
    /// velocity, m/s.
    #[inline]
    fn relax(&mut self, relative: &[f64; D]) -> f64 {
        let old = self.impulse;
        let [normal, tangent] = self.compliance;
        if normal > 0.0 {
            let wanted = (self.target[0] - relative[0]) / normal;
            self.impulse[0] = (old[0] + wanted).max(-self.limit.tension);
        }
        let push = self.impulse[0] - old[0];
        let change = push.abs() * normal;
        let bound = self.limit.shear(self.impulse[0]);
        if tangent == 0.0 || (bound == 0.0 && old[1..].iter().all(|&x| x == 0.0)) {
            return change;
        }
        for r in 1..D {
            if self.moves(r) {
                let wanted = self.target[r] - relative[r] - self.own[r][0] * push;
                self.impulse[r] += wanted / tangent;
            }
        }
        self.limit.cut(&mut self.impulse);
        let mut shear = self.impulse;
        add_scaled(&mut shear, -1.0, &old);
        change.max(shear_norm(&shear) * tangent)
    }
}
