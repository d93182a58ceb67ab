//! Contacts that share nodes, solved together: projected Gauss–Seidel over an
//! island, on velocities (design, section 5).

use crate::contact::direct;
use crate::contact::surface::{MAX_NODES, Operator};
use crate::model::inertia::Mobility;
use crate::vector::{add_scaled, dot, norm};

/// Bounds of a contact's impulse.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Limit {
    /// Coulomb: tan φ.
    pub(crate) friction: f64,
    /// Shear impulse carried without normal impulse, c·A·δ, N·s.
    pub(crate) cohesion: f64,
    /// Tensile impulse carried, σ_t·A·δ, N·s.
    pub(crate) tension: f64,
}

impl Limit {
    /// Whether an impulse lies within the bounds, but for round-off.
    pub(super) fn allows<const D: usize>(&self, impulse: &[f64; D]) -> bool {
        let shear = shear_norm(impulse);
        impulse[0] >= -self.tension && shear <= self.shear(impulse[0]) * (1.0 + 1e-12)
    }

    /// Whether the shear of an impulse is at its limit.
    pub(super) fn slips<const D: usize>(&self, impulse: &[f64; D]) -> bool {
        shear_norm(impulse) >= self.shear(impulse[0]) * (1.0 - 1e-12)
    }

    /// Cuts the shear of an impulse back to its limit (10).
    pub(super) fn cut<const D: usize>(&self, impulse: &mut [f64; D]) {
        let (shear, bound) = (shear_norm(impulse), self.shear(impulse[0]));
        if shear > bound {
            for r in 1..D {
                impulse[r] *= bound / shear;
            }
        }
    }

    /// The shear limit (7) at a normal impulse, N·s.
    pub(super) fn shear(&self, normal: f64) -> f64 {
        (normal * self.friction + self.cohesion).max(0.0)
    }
}

/// One contact of an island.
#[derive(Clone, Debug)]
pub(crate) struct Constraint<const D: usize> {
    /// Relative velocity as a function of nodal velocities.
    pub(crate) operator: Operator<D>,
    /// Relative velocity asked for, row by row, m/s.
    pub(crate) target: [f64; D],
    /// Bounds of the impulse.
    pub(crate) limit: Limit,
    /// Impulse in the operator's frame, N·s: start value in, solution out.
    pub(crate) impulse: [f64; D],
}

impl<const D: usize> Constraint<D> {
    /// Whether the contact bears no more, and parts by more than `least`, m/s.
    pub(crate) fn opens(&self, velocity: &[[f64; D]], least: f64) -> bool {
        self.impulse[0] <= -self.limit.tension
            && self.operator.relative_velocity(0, velocity) - self.target[0] > least
    }

    /// Whether the shear impulse is at its limit, and not enough: the tangent
    /// misses the velocity asked for by more than `least`, m/s.
    pub(crate) fn slips(&self, velocity: &[[f64; D]], least: f64) -> bool {
        let mut missing = [0.0; D];
        for r in 1..D {
            missing[r] = self.operator.relative_velocity(r, velocity) - self.target[r];
        }
        self.limit.slips(&self.impulse) && shear_norm(&missing) > least
    }
}

/// Length of the tangential part.
pub(crate) fn shear_norm<const D: usize>(impulse: &[f64; D]) -> f64 {
    impulse[1..].iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Residual at which a solve is done: change of relative velocity in a sweep
/// over the largest that the impulses make. What is left is a position error
/// of 1e-8 of a kick's displacement, far below the positions' own round-off,
/// and the next step corrects it.
const RESIDUAL: f64 = 1e-8;

/// Residual that is good enough where sweeps no longer get on: contacts that
/// contradict each other a little, as flush faces with more points than
/// freedoms do, go on changing by the same amount in each sweep until one opens
/// or slips, after 1/RESIDUAL sweeps or so. The next step starts from there.
const GOOD_ENOUGH: f64 = 1e-4;

/// Sweeps in which the residual halves, or they do not get on.
const PATIENCE: u32 = 32;

/// Round-off of a relative velocity, over the largest velocity in it.
const ROUND_OFF: f64 = 8.0 * f64::EPSILON;

/// Inverse mass of a row whose nodes are held, over what it would be of free
/// ones: round-off.
const HELD: f64 = 1e-12;

/// Most sweeps of a solve.
const MAX_SWEEPS: u32 = 2000;

/// Sweeps before the first leap, at least; four times as many before each next.
const SWEEPS_TO_LEAP: u32 = 16;

/// Sweeps that cost as much as a leap, over the square of its unknowns: 2/3 n³
/// operations a pass against some 40 for each unknown in a sweep.
const SWEEPS_OF_A_LEAP: f64 = direct::PASSES as f64 / 60.0;

/// Finds the impulses of an island and adds them to the velocities. Returns
/// the residual: the largest change of a relative velocity in the last sweep
/// over the largest that the impulses make.
pub(crate) fn solve<const D: usize>(
    constraints: &mut [Constraint<D>],
    mobility: Mobility<D>,
    velocity: &mut [[f64; D]],
) -> f64 {
    let mut system = System::new(constraints, mobility, |node| velocity[node as usize]);
    let residual = system.solve();
    for (&node, solved) in system.nodes.iter().zip(&system.velocity) {
        velocity[node as usize] = *solved;
    }
    for (constraint, point) in constraints.iter_mut().zip(&system.points) {
        constraint.impulse = point.impulse;
    }
    residual
}

/// An island on its own: nodes numbered anew, velocities side by side.
pub(crate) struct System<const D: usize> {
    /// Nodes that impulses move, sorted.
    nodes: Vec<u32>,
    /// Their velocities, m/s.
    pub(super) velocity: Vec<[f64; D]>,
    pub(super) points: Vec<Point<D>>,
    columns: Vec<Column<D>>,
}

/// A constraint in its system.
pub(super) struct Point<const D: usize> {
    /// Rows of the operator, node by node, and the nodes' new numbers.
    count: usize,
    rows: [[[f64; D]; D]; MAX_NODES],
    nodes: [u32; MAX_NODES],
    /// What the impulse moves.
    columns: std::ops::Range<usize>,
    /// Inverse mass seen by each row, 1/kg.
    compliance: [f64; D],
    pub(super) target: [f64; D],
    pub(super) limit: Limit,
    pub(super) impulse: [f64; D],
}

/// Velocity of a node for a unit impulse in each row, 1/kg.
struct Column<const D: usize> {
    node: u32,
    gain: [[f64; D]; D],
}

impl<const D: usize> System<D> {
    /// The constraints and what `velocity` their nodes have, m/s.
    pub(crate) fn new(
        constraints: &[Constraint<D>],
        mobility: Mobility<D>,
        velocity: impl Fn(u32) -> [f64; D],
    ) -> Self {
        let mut columns: Vec<Column<D>> = Vec::with_capacity(constraints.len() * MAX_NODES);
        let mut points: Vec<Point<D>> = constraints
            .iter()
            .map(|constraint| Point::new(constraint, mobility, &mut columns))
            .collect();
        let operators = constraints.iter().flat_map(|c| c.operator.nodes().iter());
        let mut nodes: Vec<u32> = operators.copied().collect();
        nodes.extend(columns.iter().map(|column| column.node));
        nodes.sort_unstable();
        nodes.dedup();
        let number = |node: u32| nodes.partition_point(|&other| other < node) as u32;
        for column in &mut columns {
            column.node = number(column.node);
        }
        for node in points.iter_mut().flat_map(|p| &mut p.nodes[..p.count]) {
            *node = number(*node);
        }
        Self {
            velocity: nodes.iter().map(|&node| velocity(node)).collect(),
            nodes,
            points,
            columns,
        }
    }

    /// Nodes and their velocities, m/s.
    pub(crate) fn velocities(&self) -> impl Iterator<Item = (u32, [f64; D])> + '_ {
        self.nodes
            .iter()
            .copied()
            .zip(self.velocity.iter().copied())
    }

    /// Finds the impulses; returns the residual.
    ///
    /// Projected Gauss–Seidel, sped up as nonlinear conjugate gradients
    /// (Silcowitz, Niebe, Erleben 2010): two vertices that all but coincide,
    /// each on an edge of the other, are nearly dependent constraints, on which
    /// sweeps alone crawl. What takes as long as a factorisation is leapt over.
    pub(crate) fn solve(&mut self) -> f64 {
        for point in &self.points {
            point.apply(&point.impulse, &self.columns, &mut self.velocity);
        }
        let fastest = self.velocity.iter().map(norm).fold(0.0, f64::max);
        let mut search = Search::new(self.points.len());
        let (mut residual, mut last) = (0.0, f64::INFINITY);
        let unknowns = (D * self.points.len()) as f64;
        let mut next_leap = SWEEPS_TO_LEAP.max((unknowns * unknowns * SWEEPS_OF_A_LEAP) as u32);
        for sweep in 1..=MAX_SWEEPS {
            search.remember(&self.points);
            let (change, scale) = self.sweep();
            residual = change / scale;
            if change <= RESIDUAL * scale + ROUND_OFF * fastest {
                return residual.min(RESIDUAL); // of round-off alone it says nothing
            }
            if sweep == MAX_SWEEPS {
                break; // a solve ends with a sweep
            }
            if sweep == next_leap {
                next_leap *= 4;
                if direct::leap(self) {
                    search = Search::new(self.points.len());
                    continue;
                }
            }
            if sweep % PATIENCE == 0 {
                if residual <= GOOD_ENOUGH && residual > 0.5 * last {
                    break;
                }
                last = residual;
            }
            search.advance(self);
        }
        residual
    }

    /// One sweep: its largest change of a relative velocity, and the largest
    /// that a normal impulse makes, m/s.
    fn sweep(&mut self) -> (f64, f64) {
        let (mut change, mut scale) = (0.0_f64, f64::MIN_POSITIVE);
        for point in &mut self.points {
            change = change.max(point.relax(&self.columns, &mut self.velocity));
            scale = scale.max(point.impulse[0].abs() * point.compliance[0]);
        }
        (change, scale)
    }

    /// Adds to an impulse, and what that does to the velocities.
    pub(super) fn add(&mut self, point: usize, change: &[f64; D]) {
        let point = &mut self.points[point];
        add_scaled(&mut point.impulse, 1.0, change);
        point.apply(change, &self.columns, &mut self.velocity);
    }

    /// Velocities that an impulse of a contact makes alone, m/s; taken back by
    /// the opposite impulse.
    pub(super) fn apply(&self, point: usize, impulse: &[f64; D], velocity: &mut [[f64; D]]) {
        self.points[point].apply(impulse, &self.columns, velocity);
    }
}

impl<const D: usize> Point<D> {
    /// A constraint, its columns added to `columns`; nodes as they are.
    fn new(
        constraint: &Constraint<D>,
        mobility: Mobility<D>,
        columns: &mut Vec<Column<D>>,
    ) -> Self {
        let operator = &constraint.operator;
        let start = columns.len();
        let mut rows = [[[0.0; D]; D]; MAX_NODES];
        for (k, &node) in operator.nodes().iter().enumerate() {
            rows[k] = std::array::from_fn(|r| operator.rows[r][k]);
            for (other, inverse) in mobility.column(node) {
                let known = columns[start..].iter().position(|c| c.node == other);
                let at = known.map_or(columns.len(), |at| start + at);
                if known.is_none() {
                    columns.push(Column {
                        node: other,
                        gain: [[0.0; D]; D],
                    });
                }
                for (gain, row) in columns[at].gain.iter_mut().zip(&rows[k]) {
                    for c in 0..D {
                        gain[c] += inverse[c] * row[c];
                    }
                }
            }
        }
        let (mut compliance, mut unheld) = ([0.0; D], [0.0; D]);
        for (k, node) in operator.nodes().iter().enumerate() {
            let gain = columns[start..].iter().find(|column| column.node == *node);
            let mass = mobility.inertia.mass()[*node as usize];
            for r in 0..D {
                compliance[r] += gain.map_or(0.0, |column| dot(&rows[k][r], &column.gain[r]));
                unheld[r] += dot(&rows[k][r], &rows[k][r]) / mass;
            }
        }
        let mut impulse = constraint.impulse;
        for r in 0..D {
            // Between nodes that are held along the row there is nothing to push.
            if compliance[r] <= HELD * unheld[r] {
                (compliance[r], impulse[r]) = (0.0, 0.0);
            }
        }
        Self {
            count: operator.count,
            rows,
            nodes: operator.nodes,
            columns: start..columns.len(),
            compliance,
            target: constraint.target,
            limit: constraint.limit,
            impulse,
        }
    }

    /// Whether an impulse in row `r` moves anything.
    pub(super) fn moves(&self, r: usize) -> bool {
        self.compliance[r] > 0.0
    }

    /// Relative velocity of row `r`, m/s.
    #[inline]
    pub(super) fn relative_velocity(&self, r: usize, velocity: &[[f64; D]]) -> f64 {
        let mut sum = 0.0;
        for k in 0..self.count {
            let node = &velocity[self.nodes[k] as usize];
            for c in 0..D {
                sum += self.rows[k][r][c] * node[c];
            }
        }
        sum
    }

    #[inline]
    fn apply(&self, change: &[f64; D], columns: &[Column<D>], velocity: &mut [[f64; D]]) {
        for column in &columns[self.columns.clone()] {
            let node = &mut velocity[column.node as usize];
            for r in 0..D {
                for c in 0..D {
                    node[c] += change[r] * column.gain[r][c];
                }
            }
        }
    }

    /// One Gauss–Seidel update; the largest change of relative velocity, m/s.
    fn relax(&mut self, columns: &[Column<D>], velocity: &mut [[f64; D]]) -> f64 {
        let old = self.impulse;
        if self.compliance[0] > 0.0 {
            let wanted =
                (self.target[0] - self.relative_velocity(0, velocity)) / self.compliance[0];
            self.impulse[0] = (old[0] + wanted).max(-self.limit.tension);
            let mut change = [0.0; D];
            change[0] = self.impulse[0] - old[0];
            self.apply(&change, columns, velocity);
        }
        let bound = self.limit.shear(self.impulse[0]);
        let mut change = [0.0; D];
        // One compliance for all tangents keeps the friction disc a disc.
        let compliance = self.compliance[1..].iter().copied().fold(0.0, f64::max);
        if compliance > 0.0 && (bound > 0.0 || shear_norm(&old) > 0.0) {
            for r in (1..D).filter(|&r| self.compliance[r] > 0.0) {
                let wanted = self.target[r] - self.relative_velocity(r, velocity);
                self.impulse[r] += wanted / compliance;
            }
            self.limit.cut(&mut self.impulse);
            for r in 1..D {
                change[r] = self.impulse[r] - old[r];
            }
            self.apply(&change, columns, velocity);
        }
        let normal = (self.impulse[0] - old[0]).abs() * self.compliance[0];
        normal.max(shear_norm(&change) * compliance)
    }
}

/// Directions of search between sweeps, whose changes stand for gradients.
struct Search<const D: usize> {
    /// Impulses before the sweep, N·s.
    before: Vec<[f64; D]>,
    /// Last direction, N·s.
    direction: Vec<[f64; D]>,
    /// Square of the last sweep's change, J.
    square: f64,
}

impl<const D: usize> Search<D> {
    fn new(count: usize) -> Self {
        Self {
            before: vec![[0.0; D]; count],
            direction: vec![[0.0; D]; count],
            square: 0.0,
        }
    }

    fn remember(&mut self, points: &[Point<D>]) {
        for (before, point) in self.before.iter_mut().zip(points) {
            *before = point.impulse;
        }
    }

    /// Goes on along the last direction after a sweep. What then is beyond a
    /// bound, the next sweep brings back: a solve ends with a sweep.
    fn advance(&mut self, system: &mut System<D>) {
        let mut square = 0.0;
        for (before, point) in self.before.iter_mut().zip(&system.points) {
            for r in 0..D {
                before[r] = point.impulse[r] - before[r];
                square += point.compliance[r] * before[r] * before[r];
            }
        }
        // A change that grows says that bounds have changed hands: start anew.
        let goes_on = square <= self.square && self.square > 0.0;
        let ratio = if goes_on { square / self.square } else { 0.0 };
        self.square = square;
        let changes = self.before.iter().zip(&mut self.direction);
        for (number, (change, direction)) in changes.enumerate() {
            let mut step = direction.map(|x| ratio * x);
            let point = &system.points[number];
            step[0] = step[0].max(-point.limit.tension - point.impulse[0]);
            for r in 0..D {
                direction[r] = ratio * direction[r] + change[r];
            }
            if ratio > 0.0 {
                system.add(number, &step);
            }
        }
    }
}
