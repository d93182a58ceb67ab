//! A contact as its island sees it: what the velocities of nodes mean to it, and what
//! its impulses do to them.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use crate::contact::colours::Values;
use crate::contact::solve::{Constraint, Limit, shear_norm, shear_square};
use crate::contact::surface::Operator;
use crate::contact::system::SHARE;
use crate::model::inertia::Mobility;
use crate::vector::{add_scaled, dot};

/// Inverse mass of a row whose nodes are held, over what it would be of free
/// ones: round-off.
const HELD: f64 = 1e-12;

/// A vector as the registers hold it: components that there are not are 0.
pub(super) type Wide = [f64; 4];

/// A vector for each row of a contact's frame.
pub(super) type Rows<const D: usize> = [Wide; D];

/// The same vector, wide.
#[inline(always)]
pub(super) fn widen<const D: usize>(vector: &[f64; D]) -> Wide {
    std::array::from_fn(|c| if c < D { vector[c] } else { 0.0 })
}

/// What contacts have to do with the nodes.
#[derive(Clone, Debug, Default)]
pub(super) struct Terms<const D: usize> {
    /// Relative velocities as functions of nodal velocities.
    pub(super) operators: Vec<Term<D>>,
    /// Velocities that impulses make, 1/kg, for each of a contact's nodes in turn.
    pub(super) gains: Vec<Rows<D>>,
    /// For each operator and each node that it moves, the number of that among
    /// the nodes of its contact.
    pub(super) slots: Vec<u32>,
}

/// What the velocity of a node adds to a relative velocity.
#[derive(Clone, Debug)]
pub(super) struct Term<const D: usize> {
    /// The node's number among those of its contact.
    pub(super) slot: u32,
    pub(super) rows: Rows<D>,
}

/// A contact in its system.
#[derive(Clone, Debug)]
pub(super) struct Point<const D: usize> {
    /// Its constraint.
    pub(super) number: u32,
    /// Its part of the terms.
    pub(super) operators: Range<usize>,
    pub(super) gains: Range<usize>,
    pub(super) slots: Range<usize>,
    /// Relative velocity in each row for a unit impulse in each column, 1/kg.
    pub(super) own: [[f64; D]; D],
    /// Inverse mass seen by the normal and by the tangents, 1/kg; 0 where the
    /// nodes are held. One for all tangents keeps the friction disc a disc.
    pub(super) compliance: [f64; 2],
    /// 1 over that, kg; 0 where the nodes are held.
    pub(super) inertia: [f64; 2],
    pub(super) target: [f64; D],
    pub(super) limit: Limit,
    pub(super) impulse: [f64; D],
    /// The impulse that its solve began with, N·s.
    pub(super) start: [f64; D],
    pub(super) borne: [f64; D],
    /// What its last visit has changed of the impulse, N·s.
    pub(super) step: [f64; D],
    /// Square of the largest change of a relative velocity in that, m²/s²; infinite if it
    /// bears nothing.
    pub(super) change: f64,
    /// Direction of search between sweeps, N·s.
    pub(super) direction: [f64; D],
}

/// Nodes of a contact, with their rows and whether they are held in all components.
pub(super) fn nodes_of<'a, const D: usize>(
    operator: &'a Operator<D>,
    mobility: Mobility<'a, D>,
) -> impl Iterator<Item = (usize, u32, bool)> + 'a {
    let nodes = operator.nodes().iter().enumerate();
    nodes.map(move |(k, &node)| (k, node, mobility.inertia.is_held(node as usize)))
}

impl<const D: usize> Terms<D> {
    /// Relative velocity of a contact whose nodes have these velocities, m/s.
    #[inline(always)]
    pub(super) fn relative<'a>(
        &self,
        point: &Point<D>,
        velocity: impl Fn(usize) -> &'a Wide,
    ) -> [f64; D] {
        // Component by component, and these together at the end: a register at a time.
        let mut sum: Rows<D> = [[0.0; 4]; D];
        for term in &self.operators[point.operators.clone()] {
            let node = velocity(term.slot as usize);
            for r in 0..D {
                for c in 0..4 {
                    sum[r][c] += term.rows[r][c] * node[c];
                }
            }
        }
        sum.map(|of_row| (of_row[0] + of_row[1]) + (of_row[2] + of_row[3]))
    }

    /// Adds the velocities that an impulse of a contact makes, m/s.
    #[inline(always)]
    pub(super) fn push(&self, point: &Point<D>, impulse: &[f64; D], mut values: Values<Wide>) {
        for (slot, rows) in self.gains[point.gains.clone()].iter().enumerate() {
            push(rows, impulse, values.get_mut(slot));
        }
    }
}

/// Adds the velocity that an impulse makes, m/s.
#[inline(always)]
pub(super) fn push<const D: usize>(rows: &Rows<D>, impulse: &[f64; D], node: &mut Wide) {
    for r in 0..D {
        for c in 0..4 {
            node[c] += impulse[r] * rows[r][c];
        }
    }
}

/// Points that take their constraints' operators, with what impulses do: their parts of
/// operators and gains follow each other as they do.
pub(super) struct Filling<'a, const D: usize> {
    pub(super) points: &'a mut [Point<D>],
    pub(super) operators: &'a mut [Term<D>],
    pub(super) gains: &'a mut [Rows<D>],
    pub(super) slots: &'a [u32],
    pub(super) constraints: &'a [Constraint<D>],
    pub(super) mobility: Mobility<'a, D>,
}

impl<const D: usize> Filling<'_, D> {
    /// Fills them, on as many threads as it is worth.
    pub(super) fn run(self) {
        if self.points.len() <= SHARE {
            return Arch::new().dispatch(self);
        }
        let (points, more) = self.points.split_at_mut(self.points.len() / 2);
        let ends = [points[0].operators.start, points[0].gains.start];
        let operators = self.operators;
        let (operators, others) = operators.split_at_mut(more[0].operators.start - ends[0]);
        let (gains, other_gains) = self.gains.split_at_mut(more[0].gains.start - ends[1]);
        let first = Self {
            points,
            operators,
            gains,
            ..self
        };
        let second = Self {
            points: more,
            operators: others,
            gains: other_gains,
            ..self
        };
        rayon::join(|| first.run(), || second.run());
    }
}

impl<const D: usize> WithSimd for Filling<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (mut operators, mut gains) = (self.operators, self.gains);
        for point in self.points {
            let (own, rest) = operators.split_at_mut(point.operators.len());
            let (own_gains, rest_gains) = gains.split_at_mut(point.gains.len());
            let operator = &self.constraints[point.number as usize].operator;
            point.fill(own, own_gains, self.slots, operator, self.mobility);
            (operators, gains) = (rest, rest_gains);
        }
    }
}

impl<const D: usize> Point<D> {
    /// Takes the operator, with what impulses do.
    #[inline(always)]
    fn fill(
        &mut self,
        operators: &mut [Term<D>],
        gains: &mut [Rows<D>],
        slots: &[u32],
        operator: &Operator<D>,
        mobility: Mobility<D>,
    ) {
        gains.fill([[0.0; 4]; D]);
        let mut unheld = [0.0; D];
        let mut slots = slots[self.slots.clone()].iter();
        let mut terms = operators.iter_mut().peekable();
        for (k, node, held) in nodes_of(operator, mobility) {
            let rows: Rows<D> = std::array::from_fn(|r| widen(&operator.rows[r][k]));
            let inverse = 1.0 / mobility.inertia.mass()[node as usize];
            for r in 0..D {
                unheld[r] += dot(&rows[r], &rows[r]) * inverse;
            }
            let Some(term) = terms.next_if(|_| !held) else {
                continue;
            };
            term.rows = rows;
            for ((_, inverse), &slot) in mobility.column(node).zip(&mut slots) {
                let (gain, inverse) = (&mut gains[slot as usize], widen(&inverse));
                for r in 0..D {
                    for c in 0..4 {
                        gain[r][c] += inverse[c] * rows[r][c];
                    }
                }
            }
        }
        self.own = [[0.0; D]; D];
        for term in &*operators {
            for r in 0..D {
                for s in 0..D {
                    self.own[r][s] += dot(&term.rows[r], &gains[term.slot as usize][s]);
                }
            }
        }
        // Between nodes that are held along the row there is nothing to push.
        for r in 0..D {
            if self.own[r][r] <= HELD * unheld[r] {
                self.own[r][r] = 0.0;
            }
        }
        let tangents = (1..D).map(|r| self.own[r][r]);
        self.compliance = [self.own[0][0], tangents.fold(0.0, f64::max)];
        self.inertia = self
            .compliance
            .map(|own| if own > 0.0 { 1.0 / own } else { 0.0 });
    }

    /// Whether an impulse in row `r` moves anything.
    pub(super) fn moves(&self, r: usize) -> bool {
        self.own[r][r] > 0.0
    }

    /// A `share` of the relative velocities that the change of the impulse since the
    /// start makes alone, m/s.
    #[inline(always)]
    pub(super) fn held_back(&self, share: f64) -> [f64; D] {
        let change = |r: usize| self.impulse[r] - self.start[r];
        std::array::from_fn(|r| share * self.compliance[r.min(1)] * change(r))
    }

    /// The largest relative velocity that it misses for a `reluctance`, m/s: none along
    /// what is at its bound.
    pub(super) fn misses(&self, reluctance: f64) -> f64 {
        let mut missed = self.held_back(reluctance);
        if self.impulse[0] <= -self.limit.tension {
            return 0.0;
        }
        if self.limit.slips(&self.impulse) {
            missed[1..].fill(0.0);
        }
        missed[0].abs().max(shear_norm(&missed))
    }

    /// What its last visit has changed, as an energy, J.
    #[inline(always)]
    pub(super) fn square(&self) -> f64 {
        let of_row = |r: usize| self.compliance[r.min(1)] * self.step[r] * self.step[r];
        (0..D).map(of_row).sum()
    }

    /// Goes on by a `ratio` of the last direction, no farther than to where it opens. Returns
    /// the change of the impulse; the direction is then what has changed since it was one.
    #[inline(always)]
    pub(super) fn advance(&mut self, ratio: f64) -> [f64; D] {
        let mut ahead = [0.0; D];
        for r in 0..D {
            ahead[r] = ratio * self.direction[r];
            self.direction[r] = ahead[r] + self.step[r];
        }
        ahead[0] = ahead[0].max(-self.limit.tension - self.impulse[0]);
        add_scaled(&mut self.impulse, 1.0, &ahead);
        ahead
    }

    /// The impulse with which this contact alone would do what is asked of it at
    /// a relative velocity, held back by a `reluctance` to change it, the normal
    /// first; the square of the largest change of relative velocity, m²/s².
    #[inline(always)]
    pub(super) fn relax(&mut self, relative: &[f64; D], reluctance: f64) -> f64 {
        let old = self.impulse;
        let back = self.held_back(reluctance);
        let [normal, tangent] = self.compliance.map(|own| (1.0 + reluctance) * own);
        let give = 1.0 / (1.0 + reluctance);
        let [mass, sheared_mass] = self.inertia.map(|own| give * own);
        if normal > 0.0 {
            let impulse = old[0] + (self.target[0] - relative[0] - back[0]) * mass;
            // What is no number stays so, and is found.
            let opens = impulse < -self.limit.tension;
            self.impulse[0] = if opens { -self.limit.tension } else { impulse };
        }
        let push = self.impulse[0] - old[0];
        let change = (push * normal) * (push * normal);
        let bound = self.limit.shear(self.impulse[0]);
        if tangent == 0.0 || (bound == 0.0 && old[1..].iter().all(|&x| x == 0.0)) {
            return change;
        }
        for r in 1..D {
            if self.moves(r) {
                let wanted = self.target[r] - relative[r] - back[r] - self.own[r][0] * push;
                self.impulse[r] += wanted * sheared_mass;
            }
        }
        self.limit.cut(&mut self.impulse);
        let mut shear = self.impulse;
        add_scaled(&mut shear, -1.0, &old);
        let sheared = shear_square(&shear) * (tangent * tangent);
        if sheared <= change { change } else { sheared }
    }
}
