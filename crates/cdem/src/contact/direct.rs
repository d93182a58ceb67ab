//! The impulses of an island at once, for contacts of known state: those that
//! hold, stick or slide as the sweeps have left them, and as solving shows they
//! must.
//!
//! Sweeps crawl where two points all but coincide and on long chains of
//! contacts; a factorisation does not mind.

use nalgebra::{DMatrix, DVector};

use crate::contact::solve::{System, shear_norm};
use crate::vector::{add, add_scaled};

/// Added to the diagonal, over it, one after the other: of contacts that say the
/// same, all take their share. The first takes nothing from contacts of points
/// that all but coincide; the second calms those that contradict each other.
const SHIFTS: [f64; 2] = [1e-12, 1e-6];

/// Most that impulses may grow over what they and the missing velocities say:
/// contacts that all but contradict each other press and pull without bound, and
/// what cancels between them leaves round-off in the momenta.
const GROWTH: f64 = 1e3;

/// Refinements of a solution, each of which takes the shift's error down by the
/// shift over the equations' eigenvalue.
const REFINEMENTS: u32 = 3;

/// Most times that contacts beyond a bound change their state.
pub(super) const PASSES: u32 = 4;

/// What a contact does.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State<const D: usize> {
    /// At its bound in tension: no unknown.
    Open,
    Sticks,
    /// Its shear follows its normal impulse: the ratios of the tangents.
    Slides([f64; D]),
}

/// An unknown: an impulse of a contact in its frame, for one unit.
struct Unknown<const D: usize> {
    point: usize,
    row: usize,
    direction: [f64; D],
}

/// Moves impulses and velocities to where all contacts that hold have the
/// velocity they ask for and none is beyond a bound, if that is found. Whether
/// those that do not hold should, the next sweep says.
pub(super) fn leap<const D: usize>(system: &mut System<D>) -> bool {
    let mut states: Vec<State<D>> = system
        .points
        .iter()
        .map(|point| {
            if point.impulse[0] <= -point.limit.tension {
                State::Open
            } else if point.limit.slips(&point.impulse) {
                State::Slides(ratios(point.limit.friction, &point.impulse))
            } else {
                State::Sticks
            }
        })
        .collect();
    for _ in 0..PASSES {
        let Some(changes) = changes(system, &states) else {
            return false;
        };
        let mut allowed = true;
        for ((point, change), state) in system.points.iter().zip(&changes).zip(&mut states) {
            let impulse = add(&point.impulse, change);
            if point.limit.allows(&impulse) {
                continue;
            }
            allowed = false;
            *state = if impulse[0] < -point.limit.tension {
                State::Open
            } else {
                State::Slides(ratios(point.limit.friction, &impulse))
            };
        }
        if allowed {
            for (point, change) in changes.iter().enumerate() {
                system.add(point, change);
            }
            return true;
        }
    }
    false
}

/// Shear over normal impulse of a contact that slides.
fn ratios<const D: usize>(friction: f64, impulse: &[f64; D]) -> [f64; D] {
    let shear = shear_norm(impulse);
    let mut ratios = [0.0; D];
    if shear > 0.0 {
        for r in 1..D {
            ratios[r] = friction * impulse[r] / shear;
        }
    }
    ratios
}

/// Changes of all impulses with which contacts in these states have the
/// velocities that they ask for.
fn changes<const D: usize>(system: &System<D>, states: &[State<D>]) -> Option<Vec<[f64; D]>> {
    let mut velocity = system.velocity.clone();
    let mut changes = vec![[0.0; D]; states.len()];
    // To the bounds first.
    for (number, (point, state)) in system.points.iter().zip(states).enumerate() {
        let mut wanted = point.impulse;
        match state {
            State::Open => {
                wanted = [0.0; D];
                wanted[0] = -point.limit.tension;
            }
            State::Sticks => {}
            State::Slides(ratios) => {
                let bound = point.limit.shear(wanted[0]);
                let norm = shear_norm(ratios);
                for r in 1..D {
                    wanted[r] = if norm > 0.0 {
                        bound * ratios[r] / norm
                    } else {
                        0.0
                    };
                }
            }
        }
        add_scaled(&mut wanted, -1.0, &point.impulse);
        system.apply(number, &wanted, &mut velocity);
        changes[number] = wanted;
    }
    let unknowns = unknowns(system, states);
    if unknowns.is_empty() {
        return Some(changes);
    }
    let (matrix, missing) = equations(system, &unknowns, &velocity);
    let there = unknowns.iter().enumerate().map(|(i, unknown)| {
        let impulse = system.points[unknown.point].impulse[unknown.row];
        (impulse * matrix[(i, i)]).abs()
    });
    let scale = there.fold(missing.amax(), f64::max);
    let solution = solve(&matrix, &missing, GROWTH * scale)?;
    for (unknown, &change) in unknowns.iter().zip(solution.iter()) {
        add_scaled(&mut changes[unknown.point], change, &unknown.direction);
    }
    Some(changes)
}

fn unknowns<const D: usize>(system: &System<D>, states: &[State<D>]) -> Vec<Unknown<D>> {
    let mut unknowns = Vec::new();
    for (point, state) in states.iter().enumerate() {
        let moves = |&row: &usize| system.points[point].moves(row);
        let rows = match state {
            State::Open => 0,
            State::Sticks => D,
            State::Slides(_) => 1,
        };
        for row in (0..rows).filter(moves) {
            let mut direction = [0.0; D];
            direction[row] = 1.0;
            if let State::Slides(ratios) = state {
                add_scaled(&mut direction, 1.0, ratios);
            }
            unknowns.push(Unknown {
                point,
                row,
                direction,
            });
        }
    }
    unknowns
}

/// Response of each unknown's row to each unknown, 1/kg, and what is missing of
/// the velocities asked for, m/s.
fn equations<const D: usize>(
    system: &System<D>,
    unknowns: &[Unknown<D>],
    velocity: &[[f64; D]],
) -> (DMatrix<f64>, DVector<f64>) {
    let count = unknowns.len();
    let mut matrix = DMatrix::zeros(count, count);
    let mut response = vec![[0.0; D]; velocity.len()];
    for (j, unknown) in unknowns.iter().enumerate() {
        system.apply(unknown.point, &unknown.direction, &mut response);
        for (i, other) in unknowns.iter().enumerate() {
            matrix[(i, j)] = system.points[other.point].relative_velocity(other.row, &response);
        }
        response.fill([0.0; D]);
    }
    let missing = unknowns.iter().map(|unknown| {
        let point = &system.points[unknown.point];
        point.target[unknown.row] - point.relative_velocity(unknown.row, velocity)
    });
    let missing = DVector::from_iterator(count, missing);
    (matrix, missing)
}

/// The solution with the least shift whose terms' own velocities are at most
/// `bound`, m/s.
fn solve(matrix: &DMatrix<f64>, missing: &DVector<f64>, bound: f64) -> Option<DVector<f64>> {
    SHIFTS.iter().find_map(|shift| {
        let mut shifted = matrix.clone();
        for i in 0..shifted.nrows() {
            shifted[(i, i)] *= 1.0 + shift;
        }
        let factors = shifted.lu();
        let mut solution = factors.solve(missing)?;
        for _ in 0..REFINEMENTS {
            solution += factors.solve(&(missing - matrix * &solution))?;
        }
        let terms = solution.iter().enumerate();
        let tame = |(i, x): (usize, &f64)| (x * matrix[(i, i)]).abs() <= bound;
        terms.into_iter().all(tame).then_some(solution)
    })
}
