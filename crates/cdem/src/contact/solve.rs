//! Contacts that share nodes, solved together: projected Gauss–Seidel over an
//! island, on velocities (design, section 5).

use crate::contact::direct;
use crate::contact::surface::Operator;
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

    /// The shear limit (7) at a normal impulse, N·s.
    fn shear(&self, normal: f64) -> f64 {
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
    /// Inverse mass seen by each row, 1/kg.
    compliance: [f64; D],
}

impl<const D: usize> Constraint<D> {
    /// A constraint; `impulse` is the warm start.
    pub(crate) fn new(
        operator: Operator<D>,
        target: [f64; D],
        limit: Limit,
        impulse: [f64; D],
        mobility: Mobility<D>,
    ) -> Self {
        let compliance = std::array::from_fn(|r| {
            let row = &operator.rows[r];
            let mut sum = 0.0;
            for (k, &i) in operator.nodes().iter().enumerate() {
                for (l, &j) in operator.nodes().iter().enumerate() {
                    sum += mobility.response(i, &row[k], j, &row[l]);
                }
            }
            sum
        });
        Self {
            operator,
            target,
            limit,
            impulse,
            compliance,
        }
    }

    /// Relative velocity of row `r`, m/s.
    pub(crate) fn relative_velocity(&self, r: usize, velocity: &[[f64; D]]) -> f64 {
        let nodes = self.operator.nodes().iter().enumerate();
        nodes
            .map(|(k, &node)| dot(&self.operator.rows[r][k], &velocity[node as usize]))
            .sum()
    }

    /// Impulse on the `k`-th node, N·s.
    pub(crate) fn impulse_on(&self, k: usize, impulse: &[f64; D]) -> [f64; D] {
        let mut on = [0.0; D];
        for r in 0..D {
            add_scaled(&mut on, impulse[r], &self.operator.rows[r][k]);
        }
        on
    }

    /// Relative velocity that an impulse `on` the frame of `other` gives row
    /// `r` of this contact, m/s.
    pub(super) fn response(
        &self,
        r: usize,
        other: &Self,
        on: &[f64; D],
        mobility: Mobility<D>,
    ) -> f64 {
        let mut sum = 0.0;
        for (l, &j) in other.operator.nodes().iter().enumerate() {
            let impulse = other.impulse_on(l, on);
            for (k, &i) in self.operator.nodes().iter().enumerate() {
                let row = &self.operator.rows[r][k];
                sum += mobility.response(i, row, j, &impulse);
            }
        }
        sum
    }

    /// Adds to the impulse, and what that does to the velocities.
    pub(super) fn add(
        &mut self,
        change: &[f64; D],
        mobility: Mobility<D>,
        velocity: &mut [[f64; D]],
    ) {
        add_scaled(&mut self.impulse, 1.0, change);
        self.apply(change, mobility, velocity);
    }

    fn apply(&self, change: &[f64; D], mobility: Mobility<D>, velocity: &mut [[f64; D]]) {
        for (k, &node) in self.operator.nodes().iter().enumerate() {
            mobility.push(node, &self.impulse_on(k, change), velocity);
        }
    }

    /// Whether the shear impulse is at its limit.
    pub(crate) fn slips(&self) -> bool {
        let shear = shear_norm(&self.impulse);
        shear >= self.limit.shear(self.impulse[0]) * (1.0 - 1e-12)
    }

    /// One Gauss–Seidel update; the largest change of relative velocity, m/s.
    fn relax(&mut self, mobility: Mobility<D>, velocity: &mut [[f64; D]]) -> f64 {
        let old = self.impulse;
        if self.compliance[0] > 0.0 {
            let wanted =
                (self.target[0] - self.relative_velocity(0, velocity)) / self.compliance[0];
            self.impulse[0] = (old[0] + wanted).max(-self.limit.tension);
            let mut change = [0.0; D];
            change[0] = self.impulse[0] - old[0];
            self.apply(&change, mobility, velocity);
        }
        let bound = self.limit.shear(self.impulse[0]);
        let mut change = [0.0; D];
        // One compliance for all tangents keeps the friction disc a disc.
        let compliance = self.compliance[1..].iter().copied().fold(0.0, f64::max);
        if compliance > 0.0 && (bound > 0.0 || shear_norm(&old) > 0.0) {
            for r in 1..D {
                let wanted = self.target[r] - self.relative_velocity(r, velocity);
                self.impulse[r] += wanted / compliance;
            }
            let shear = shear_norm(&self.impulse);
            if shear > bound {
                for r in 1..D {
                    self.impulse[r] *= bound / shear; // (10)
                }
            }
            for r in 1..D {
                change[r] = self.impulse[r] - old[r];
            }
            self.apply(&change, mobility, velocity);
        }
        let normal = (self.impulse[0] - old[0]).abs() * self.compliance[0];
        normal.max(shear_norm(&change) * compliance)
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

/// Round-off of a relative velocity, over the largest velocity in it.
const ROUND_OFF: f64 = 8.0 * f64::EPSILON;

/// Most sweeps of a solve.
const MAX_SWEEPS: u32 = 2000;

/// Sweeps before the first leap; four times as many before each next.
const SWEEPS_TO_LEAP: u32 = 16;

/// Finds the impulses of an island and adds them to the velocities. Returns
/// the residual: the largest change of a relative velocity in the last sweep
/// over the largest that the impulses make.
///
/// Projected Gauss–Seidel, sped up as nonlinear conjugate gradients (Silcowitz,
/// Niebe, Erleben 2010): two vertices that all but coincide, each on an edge of
/// the other, are nearly dependent constraints, on which sweeps alone crawl.
/// What takes long is leapt over where contacts are few.
pub(crate) fn solve<const D: usize>(
    constraints: &mut [Constraint<D>],
    mobility: Mobility<D>,
    velocity: &mut [[f64; D]],
) -> f64 {
    for constraint in constraints.iter() {
        constraint.apply(&constraint.impulse, mobility, velocity);
    }
    let fastest = constraints
        .iter()
        .flat_map(|constraint| constraint.operator.nodes());
    let fastest = fastest
        .map(|&node| norm(&velocity[node as usize]))
        .fold(0.0, f64::max);
    let mut search = Search::new(constraints.len());
    let mut residual = 0.0;
    let mut next_leap = SWEEPS_TO_LEAP;
    for sweep in 1..=MAX_SWEEPS {
        let mut change = 0.0_f64;
        let mut scale = f64::MIN_POSITIVE;
        search.remember(constraints);
        for constraint in constraints.iter_mut() {
            change = change.max(constraint.relax(mobility, velocity));
            scale = scale.max(constraint.impulse[0].abs() * constraint.compliance[0]);
        }
        residual = change / scale;
        if change <= RESIDUAL * scale + ROUND_OFF * fastest {
            break;
        }
        if sweep == next_leap {
            next_leap *= 4;
            if direct::leap(constraints, mobility, velocity) {
                search = Search::new(constraints.len());
            }
        } else {
            search.advance(constraints, mobility, velocity);
        }
    }
    residual
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

    fn remember(&mut self, constraints: &[Constraint<D>]) {
        for (before, constraint) in self.before.iter_mut().zip(constraints) {
            *before = constraint.impulse;
        }
    }

    /// Goes on along the last direction after a sweep. What then is beyond a
    /// bound, the next sweep brings back: a solve ends with a sweep.
    fn advance(
        &mut self,
        constraints: &mut [Constraint<D>],
        mobility: Mobility<D>,
        velocity: &mut [[f64; D]],
    ) {
        let mut square = 0.0;
        for (before, constraint) in self.before.iter_mut().zip(&*constraints) {
            for r in 0..D {
                before[r] = constraint.impulse[r] - before[r];
                square += constraint.compliance[r] * before[r] * before[r];
            }
        }
        // A change that grows says that bounds have changed hands: start anew.
        let goes_on = square <= self.square;
        let ratio = if goes_on { square / self.square } else { 0.0 };
        self.square = square;
        let changes = self.before.iter().zip(&mut self.direction);
        for (constraint, (change, direction)) in constraints.iter_mut().zip(changes) {
            let mut step = direction.map(|x| ratio * x);
            step[0] = step[0].max(-constraint.limit.tension - constraint.impulse[0]);
            for r in 0..D {
                constraint.impulse[r] += step[r];
                direction[r] = ratio * direction[r] + change[r];
            }
            if ratio > 0.0 {
                constraint.apply(&step, mobility, velocity);
            }
        }
    }
}
