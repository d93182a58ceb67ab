//! A contact as its island sees it: what the velocities of nodes mean to it, and what
//! its impulses do to them.

use std::ops::Range;

use crate::contact::colours::Values;
use crate::contact::solve::{Limit, shear_norm, shear_square};
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
    /// Square of the largest change of a relative velocity in its last visit, m²/s²;
    /// infinite if it bears nothing.
    pub(super) change: f64,
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

/// Calls `fill` for each point with its part of operators and gains, which follow
/// each other as the points do.
pub(super) fn in_parts<const D: usize>(
    points: &mut [Point<D>],
    operators: &mut [Term<D>],
    gains: &mut [Rows<D>],
    fill: &(impl Fn(&mut Point<D>, &mut [Term<D>], &mut [Rows<D>]) + Sync),
) {
    if points.len() > SHARE {
        let (points, more) = points.split_at_mut(points.len() / 2);
        let ends = [points[0].operators.start, points[0].gains.start];
        let (operators, others) = operators.split_at_mut(more[0].operators.start - ends[0]);
        let (gains, other_gains) = gains.split_at_mut(more[0].gains.start - ends[1]);
        rayon::join(
            || in_parts(points, operators, gains, fill),
            || in_parts(more, others, other_gains, fill),
        );
        return;
    }
    let (mut operators, mut gains) = (operators, gains);
    for point in points {
        let (own, rest) = operators.split_at_mut(point.operators.len());
        let (own_gains, rest_gains) = gains.split_at_mut(point.gains.len());
        fill(point, own, own_gains);
        (operators, gains) = (rest, rest_gains);
    }
}

impl<const D: usize> Point<D> {
    /// Takes the operator, with what impulses do.
    pub(super) fn fill(
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
            for r in 0..D {
                unheld[r] += dot(&rows[r], &rows[r]) / mobility.inertia.mass()[node as usize];
            }
            let Some(term) = terms.next_if(|_| !held) else {
                continue;
            };
            term.rows = rows;
            for ((_, inverse), &slot) in mobility.column(node).zip(&mut slots) {
                let gain = &mut gains[slot as usize];
                for r in 0..D {
                    for c in 0..D {
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
