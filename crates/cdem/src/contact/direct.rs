//! The impulses of an island at once, for contacts of known state: those that
//! hold, stick or slide as the sweeps have left them.
//!
//! Sweeps crawl where two points all but coincide and on long chains of
//! contacts; a factorisation does not mind.

use nalgebra::{DMatrix, DVector};

use crate::contact::solve::{Constraint, shear_norm};
use crate::model::inertia::Mobility;
use crate::vector::{add, add_scaled};

/// Most unknowns: beyond, a sweep costs less than its share of a factorisation.
const MAX_UNKNOWNS: usize = 48;

/// Added to the diagonal, over it, one after the other: of contacts that say the
/// same, all take their share. The error is this share of an impulse's velocity.
const SHIFTS: [f64; 4] = [1e-12, 1e-10, 1e-8, 1e-6];

/// Most that impulses may grow over what they and the missing velocities say:
/// contacts that all but contradict each other press and pull without bound, and
/// what cancels between them leaves round-off in the momenta.
const GROWTH: f64 = 1e3;

/// An unknown: row `row` of a constraint, and what goes with a normal impulse
/// in the tangents of a contact that slides.
struct Unknown<const D: usize> {
    constraint: usize,
    row: usize,
    /// Impulse in the frame for one unit of the unknown.
    direction: [f64; D],
}

/// Moves impulses and velocities to where all contacts that hold have the
/// velocity they ask for, if there are few enough and none goes beyond a bound.
/// Whether those that do not hold should, the next sweep says.
pub(super) fn leap<const D: usize>(
    constraints: &mut [Constraint<D>],
    mobility: Mobility<D>,
    velocity: &mut [[f64; D]],
) -> bool {
    let unknowns = unknowns(constraints);
    let count = unknowns.len();
    if count == 0 || count > MAX_UNKNOWNS {
        return false;
    }
    let mut matrix = DMatrix::zeros(count, count);
    for (j, unknown) in unknowns.iter().enumerate() {
        for (i, other) in unknowns.iter().enumerate() {
            let row = &constraints[other.constraint];
            let column = &constraints[unknown.constraint];
            matrix[(i, j)] = row.response(other.row, column, &unknown.direction, mobility);
        }
    }
    let missing = unknowns.iter().map(|unknown| {
        let constraint = &constraints[unknown.constraint];
        constraint.target[unknown.row] - constraint.relative_velocity(unknown.row, velocity)
    });
    let missing = DVector::from_iterator(count, missing);
    let there = unknowns.iter().enumerate().map(|(i, unknown)| {
        (constraints[unknown.constraint].impulse[unknown.row] * matrix[(i, i)]).abs()
    });
    let scale = there.fold(missing.amax(), f64::max);
    let Some(change) = solve(&matrix, &missing, GROWTH * scale) else {
        return false;
    };
    let mut changes = vec![[0.0; D]; constraints.len()];
    for (unknown, &change) in unknowns.iter().zip(change.iter()) {
        add_scaled(&mut changes[unknown.constraint], change, &unknown.direction);
    }
    let allowed = |(constraint, change): (&Constraint<D>, &[f64; D])| {
        constraint.limit.allows(&add(&constraint.impulse, change))
    };
    if !constraints.iter().zip(&changes).all(allowed) {
        return false;
    }
    for (constraint, change) in constraints.iter_mut().zip(&changes) {
        constraint.add(change, mobility, velocity);
    }
    true
}

/// The solution with the least shift whose terms' own velocities are at most
/// `bound`, m/s.
fn solve(matrix: &DMatrix<f64>, missing: &DVector<f64>, bound: f64) -> Option<DVector<f64>> {
    SHIFTS.iter().find_map(|shift| {
        let mut shifted = matrix.clone();
        for i in 0..shifted.nrows() {
            shifted[(i, i)] *= 1.0 + shift;
        }
        let change = shifted.lu().solve(missing)?;
        let terms = change.iter().enumerate();
        let tame = |(i, x): (usize, &f64)| (x * matrix[(i, i)]).abs() <= bound;
        terms.into_iter().all(tame).then_some(change)
    })
}

fn unknowns<const D: usize>(constraints: &[Constraint<D>]) -> Vec<Unknown<D>> {
    let mut unknowns = Vec::new();
    for (number, constraint) in constraints.iter().enumerate() {
        if constraint.impulse[0] <= -constraint.limit.tension {
            continue;
        }
        let mut normal = [0.0; D];
        normal[0] = 1.0;
        let slips = constraint.slips();
        let shear = shear_norm(&constraint.impulse);
        if slips && shear > 0.0 {
            for r in 1..D {
                normal[r] = constraint.limit.friction * constraint.impulse[r] / shear;
            }
        }
        unknowns.push(Unknown {
            constraint: number,
            row: 0,
            direction: normal,
        });
        for row in (1..D).filter(|_| !slips) {
            let mut direction = [0.0; D];
            direction[row] = 1.0;
            unknowns.push(Unknown {
                constraint: number,
                row,
                direction,
            });
        }
    }
    unknowns
}
