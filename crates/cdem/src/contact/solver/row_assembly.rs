//! Assembly of the rows of contacts: Jacobian terms, responses, effective masses.

use pulp::{Arch, Simd, WithSimd};

use crate::contact::constraint::contact_constraint::Constraint;
use crate::contact::solver::contact_rows::{
    ConstraintRows, ContactRows, JacobianTerm, PaddedVector, nodes_of, truncated,
};
use crate::contact::solver::dof_map::DofMap;
use crate::contact::solver::inverse_mass_columns::{ColumnTerm, InverseMassColumns};
use crate::contact::solver::simd_block::{BlockFactors, SimdBlock};
use crate::contact::surface::ContactJacobian;
use crate::contact::tolerances::{CONTACTS_PER_TASK, SHORT_LEVER_SQUARED};
use crate::model::inverse_mass::KickMobility;

impl<const D: usize, P: SimdBlock> ConstraintRows<D, P> {
    /// Adds a node to a contact that moves the SIMD blocks of this list.
    pub(super) fn add_node(&mut self, map: &DofMap, node: u32, list: &[u32]) {
        let (place, slot, simd_blocks) = map.find(node);
        let first = slot.number(0);
        let position = list
            .iter()
            .position(|&simd_block| simd_block == simd_blocks.start);
        let position = position.expect("the list has all SIMD blocks of the contact");
        self.jacobian_terms.push(JacobianTerm {
            slot: (position + first / P::WIDTH - simd_blocks.start as usize) as u32,
            lane: (first % P::WIDTH) as u32,
            stride: slot.stride,
            columns: [[0.0; 4]; D],
        });
        if P::BY_COLUMNS {
            let positions = position..position + simd_blocks.len();
            let column_term = ColumnTerm::new(&self.columns, place, positions);
            self.column_terms.push(column_term);
        }
    }
}

/// Computes the response to impulses of a contact with this Jacobian, 1/kg. Nodes of one mass
/// matrix are next to each other in the Jacobian, and so are their SIMD blocks.
#[inline(always)]
fn respond<S: Simd, const D: usize, P: SimdBlock>(
    simd: S,
    mut responses: &mut [[P; D]],
    jacobian: &ContactJacobian<D>,
    mobility: KickMobility<D>,
) {
    let (inertia, nodes) = (mobility.inertia, jacobian.nodes());
    let mut first = 0;
    while first < nodes.len() {
        let coupled = inertia.coupled(nodes[first] as usize);
        let is_coupled = |node: &&u32| coupled.contains(&(**node as usize));
        let own = first..first + nodes[first..].iter().take_while(is_coupled).count();
        let share = mobility.damping_factor(nodes[first]);
        first = own.end;
        if own
            .clone()
            .all(|k| inertia.is_prescribed(nodes[k] as usize))
        {
            continue;
        }
        if coupled.len() == 1 {
            let (response, rest) = responses.split_at_mut(1);
            let inverse = inertia.lumped(nodes[own.start] as usize);
            for (row, response) in jacobian.rows[own.start].iter().zip(&mut response[0]) {
                let made: [f64; D] = std::array::from_fn(|c| share * (inverse[c] * row[c]));
                *response = P::of(&made);
            }
            responses = rest;
            continue;
        }
        let (of_own, rest) = responses.split_at_mut(D * coupled.len().div_ceil(P::WIDTH));
        for (number, response) in of_own.iter_mut().enumerate() {
            let (first, c) = (P::WIDTH * (number / D), number % D);
            let mut made = [P::default(); D];
            for k in own.clone() {
                let column = P::of(&inertia.column(nodes[k] as usize, c)[first..]);
                for r in 0..D {
                    let row = BlockFactors::new(simd, &[jacobian.rows[k][r][c]]);
                    made[r].add_scaled(simd, &row, &[column]);
                }
            }
            let share = BlockFactors::new(simd, &[share]);
            for r in 0..D {
                response[r] = P::default();
                response[r].add_scaled(simd, &share, &[made[r]]);
            }
        }
        responses = rest;
    }
}

/// Assembly of the rows of contacts. Their ranges of terms follow each other in the order of
/// the contacts.
pub(super) struct RowAssembly<'a, const D: usize, P> {
    pub(super) points: &'a mut [ContactRows<D>],
    pub(super) jacobian_terms: &'a mut [JacobianTerm<D>],
    pub(super) responses: &'a mut [[P; D]],
    pub(super) column_terms: &'a mut [ColumnTerm<D>],
    pub(super) columns: &'a InverseMassColumns<D, P>,
    pub(super) constraints: &'a [Constraint<D>],
    pub(super) mobility: KickMobility<'a, D>,
}

impl<const D: usize, P: SimdBlock> RowAssembly<'_, D, P> {
    /// Fills the rows, on as many threads as is worthwhile.
    pub(super) fn run(self) {
        if self.points.len() <= CONTACTS_PER_TASK {
            return Arch::new().dispatch(self);
        }
        let (points, more) = self.points.split_at_mut(self.points.len() / 2);
        let ends = [points[0].jacobian_terms.start, points[0].responses.start];
        let jacobian_terms = self.jacobian_terms;
        let count = more[0].jacobian_terms.start - ends[0];
        let (jacobian_terms, others) = jacobian_terms.split_at_mut(count);
        let (responses, other_responses) = self
            .responses
            .split_at_mut(more[0].responses.start - ends[1]);
        let (column_terms, other_column_terms) = self
            .column_terms
            .split_at_mut(column_term_count::<P>(count));
        let first = Self {
            points,
            jacobian_terms,
            responses,
            column_terms,
            ..self
        };
        let second = Self {
            points: more,
            jacobian_terms: others,
            responses: other_responses,
            column_terms: other_column_terms,
            ..self
        };
        rayon::join(|| first.run(), || second.run());
    }
}

impl<const D: usize, P: SimdBlock> WithSimd for RowAssembly<'_, D, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (mut jacobian_terms, mut responses, mut column_terms) =
            (self.jacobian_terms, self.responses, self.column_terms);
        for point in self.points {
            let (own, rest) = jacobian_terms.split_at_mut(point.jacobian_terms.len());
            let (own_responses, rest_responses) = responses.split_at_mut(point.responses.len());
            let (own_column_terms, rest_column_terms) =
                column_terms.split_at_mut(column_term_count::<P>(own.len()));
            let jacobian = &self.constraints[point.number as usize].jacobian;
            let squared_levers = fill_jacobian_terms(own, jacobian, self.mobility);
            let seen = if P::BY_COLUMNS {
                let moved = nodes_of(jacobian, self.mobility).filter(|(.., held)| !held);
                for (column_term, (_, node, _)) in own_column_terms.iter_mut().zip(moved) {
                    column_term.damping_factor = self.mobility.damping_factor(node);
                }
                mobility_from_columns(own, own_column_terms, self.columns)
            } else {
                respond(simd, own_responses, jacobian, self.mobility);
                mobility_from_responses(own, own_responses)
            };
            point.set_effective_mass(&seen, &squared_levers);
            (jacobian_terms, responses, column_terms) = (rest, rest_responses, rest_column_terms);
        }
    }
}

/// Fills the Jacobian terms. Returns the squared lever of each row: the sum of the squared weights of
/// the components that are not prescribed.
#[inline(always)]
fn fill_jacobian_terms<const D: usize>(
    jacobian_terms: &mut [JacobianTerm<D>],
    jacobian: &ContactJacobian<D>,
    mobility: KickMobility<D>,
) -> [f64; D] {
    let mut squared_levers = [0.0; D];
    let moved = nodes_of(jacobian, mobility).filter(|(.., held)| !held);
    for ((k, node, _), term) in moved.zip(jacobian_terms) {
        let prescribed = mobility.inertia.prescribed(node as usize);
        for r in 0..D {
            for c in 0..D {
                let weight = jacobian.rows[k][r][c];
                term.columns[c][r] = weight;
                if !prescribed[c] {
                    squared_levers[r] += weight * weight;
                }
            }
        }
    }
    squared_levers
}

/// Returns the number of column terms for a number of Jacobian terms.
const fn column_term_count<P: SimdBlock>(jacobian_terms: usize) -> usize {
    if P::BY_COLUMNS { jacobian_terms } else { 0 }
}

/// Returns the relative velocity in each row for a unit impulse in each row, 1/kg.
#[inline(always)]
fn mobility_from_responses<const D: usize, P: SimdBlock>(
    jacobian_terms: &[JacobianTerm<D>],
    responses: &[[P; D]],
) -> [PaddedVector; D] {
    let mut seen = [[0.0; 4]; D];
    for term in jacobian_terms {
        for c in 0..D {
            let lane = term.lane as usize + c * term.stride as usize;
            let response = &responses[term.slot as usize + lane / P::WIDTH];
            for s in 0..D {
                let response = response[s].numbers()[lane % P::WIDTH];
                for r in 0..4 {
                    seen[s][r] += response * term.columns[c][r];
                }
            }
        }
    }
    seen
}

/// Returns these relative velocities for a contact whose impulses act by columns.
#[inline(always)]
fn mobility_from_columns<const D: usize, P: SimdBlock>(
    jacobian_terms: &[JacobianTerm<D>],
    column_terms: &[ColumnTerm<D>],
    columns: &InverseMassColumns<D, P>,
) -> [PaddedVector; D] {
    let mut seen = [[0.0; 4]; D];
    for (s, seen) in seen.iter_mut().enumerate() {
        let mut unit = [0.0; D];
        unit[s] = 1.0;
        let pairs = jacobian_terms.iter().zip(column_terms);
        for (term, column_term) in pairs.clone() {
            let on_node = column_term.on_node(term, &unit);
            for (term, _) in pairs.clone().filter(|(_, other)| column_term.moves(other)) {
                let velocity = column_term.velocity_at(columns, &on_node, term);
                for c in 0..D {
                    for r in 0..4 {
                        seen[r] += velocity[c] * term.columns[c][r];
                    }
                }
            }
        }
    }
    seen
}

impl<const D: usize> ContactRows<D> {
    /// Sets the effective masses, from the relative velocity in each row for a unit impulse in
    /// each row, 1/kg, and the squared lever of each row.
    #[inline(always)]
    fn set_effective_mass(&mut self, own: &[PaddedVector; D], squared_levers: &[f64; D]) {
        self.by_normal = truncated(&own[0]);
        // A row with a short lever belongs to prescribed nodes.
        let seen = |r: usize| {
            if squared_levers[r] <= SHORT_LEVER_SQUARED {
                0.0
            } else {
                own[r][r]
            }
        };
        self.inverse_effective_mass = [seen(0), (1..D).map(seen).fold(0.0, f64::max)];
        self.effective_mass = std::array::from_fn(|r| {
            if seen(r) > 0.0 {
                1.0 / self.inverse_effective_mass[r.min(1)]
            } else {
                0.0
            }
        });
    }
}
