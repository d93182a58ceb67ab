//! System of an island: the effect of contact impulses on each other's relative velocities.
//!
//! Memory is kept from solve to solve. Contacts mostly stay, so they are numbered and coloured
//! only when their nodes change. Prescribed nodes do not take part: their velocities go into
//! the targets.

use pulp::Scalar;

use crate::contact::constraint::contact_constraint::{Constraint, FrictionBounds};
use crate::contact::solver::active_set_cg::ActiveSetCg;
use crate::contact::solver::coloured_pass::PassOrder;
use crate::contact::solver::colouring::{Colouring, NodesOf};
use crate::contact::solver::contact_rows::{ConstraintRows, ContactRows, nodes_of};
use crate::contact::solver::dof_map::{DofMap, DofSlot};
use crate::contact::solver::nonlinear_cg::NonlinearCg;
use crate::contact::solver::row_assembly::RowAssembly;
use crate::contact::solver::simd_block::{BlockList, SimdBlock};
use crate::contact::solver::system_visits::{
    ApplyImpulse, RelativeVelocityVisit, ResponseVisit, SweepVisit,
};
use crate::math::vector::{add_scaled, dot, norm, sub};
use crate::model::inverse_mass::KickMobility;

/// Contacts that share nodes, with their nodes numbered anew and stored side by side.
#[derive(Clone, Debug, Default)]
pub(crate) struct ContactSystem<const D: usize, P> {
    /// Nodes of each contact, each with true if it is prescribed, then `None`. The numbering
    /// holds for these, and for this number of changes of the prescribed components.
    known: Vec<Option<(u32, bool)>>,
    changes: u64,
    /// Map of the nodes that impulses may move.
    dof_map: DofMap,
    /// Velocities, m/s, in SIMD blocks: nodes that one mass matrix couples lie side by side.
    /// SIMD blocks are the nodes of the [colouring](Colouring).
    pub(super) velocity: Vec<P>,
    /// Velocities of the nodes without a slot, m/s; and the impulses that a solve has added to
    /// nodes with a slot, N·s.
    others: Vec<[f64; D]>,
    on_nodes: Vec<[f64; D]>,
    /// Prescribed nodes of contacts, and their largest speed, m/s.
    prescribed: Vec<PrescribedNode>,
    prescribed_speed: f64,
    /// Search directions of the velocities.
    nonlinear_cg: NonlinearCg<P>,
    /// Order in which contacts are visited.
    pub(super) colours: Colouring,
    /// Rows of the contacts, by position in that order.
    pub(super) points: Vec<ContactRows<D>>,
    terms: ConstraintRows<D, P>,
    /// Nodes that contacts move, sorted, and SIMD blocks of each contact. Kept to reuse their
    /// memory.
    moved: Vec<u32>,
    simd_blocks_of: NodesOf,
    /// Workspace of the solver.
    pub(super) active_set_cg: ActiveSetCg<D, P>,
}

/// A prescribed node of a contact.
#[derive(Clone, Copy, Debug)]
struct PrescribedNode {
    /// Position of the contact, and index of the node in its Jacobian.
    place: usize,
    of_constraint: usize,
    node: u32,
}

impl<const D: usize, P: SimdBlock> ContactSystem<D, P> {
    /// Takes the Jacobians of the constraints.
    pub(crate) fn load(&mut self, constraints: &[Constraint<D>], mobility: KickMobility<D>) {
        if !self.fits(constraints, mobility) {
            self.number(constraints, mobility);
        }
        let filling = RowAssembly {
            points: &mut self.points,
            jacobian_terms: &mut self.terms.jacobian_terms,
            responses: &mut self.terms.responses,
            column_terms: &mut self.terms.column_terms,
            columns: &self.terms.columns,
            constraints,
            mobility,
        };
        filling.run();
    }

    /// True if the constraints are between the same nodes as before.
    fn fits(&self, constraints: &[Constraint<D>], mobility: KickMobility<D>) -> bool {
        let mut known = self.known.iter();
        let same = |constraint: &Constraint<D>| {
            let mut nodes = nodes_of(&constraint.jacobian, mobility);
            nodes.all(|(_, node, is_prescribed)| known.next() == Some(&Some((node, is_prescribed))))
                && known.next() == Some(&None)
        };
        self.changes == mobility.inertia.changes()
            && self.points.len() == constraints.len()
            && constraints.iter().all(same)
    }

    /// Numbers the nodes and orders the contacts.
    fn number(&mut self, constraints: &[Constraint<D>], mobility: KickMobility<D>) {
        self.known.clear();
        self.changes = mobility.inertia.changes();
        let moved = &mut self.moved;
        moved.clear();
        for constraint in constraints {
            for (_, node, is_prescribed) in nodes_of(&constraint.jacobian, mobility) {
                self.known.push(Some((node, is_prescribed)));
                if !is_prescribed {
                    moved.push(node);
                }
            }
            self.known.push(None);
        }
        moved.sort_unstable();
        moved.dedup();
        self.dof_map
            .slot(moved, mobility.inertia, &mut self.terms.columns);
        let dof_map = &self.dof_map;
        self.simd_blocks_of.clear();
        for Constraint {
            jacobian: operator, ..
        } in constraints
        {
            let add = |simd_blocks: &mut Vec<u32>| {
                dof_map.add_simd_blocks(operator, mobility, simd_blocks)
            };
            self.simd_blocks_of.push(add);
        }
        self.colours
            .arrange(dof_map.simd_blocks(), &self.simd_blocks_of);
        self.arrange(constraints, mobility);
    }

    /// Creates the rows of the contacts, in their order.
    fn arrange(&mut self, constraints: &[Constraint<D>], mobility: KickMobility<D>) {
        self.points.clear();
        self.prescribed.clear();
        self.terms.clear();
        for place in 0..constraints.len() {
            let number = self.colours.order()[place];
            let list = self.simd_blocks_of.of(number as usize);
            let start = [self.terms.jacobian_terms.len(), self.terms.responses.len()];
            for (k, node, is_prescribed) in
                nodes_of(&constraints[number as usize].jacobian, mobility)
            {
                if is_prescribed {
                    self.prescribed.push(PrescribedNode {
                        place,
                        of_constraint: k,
                        node,
                    });
                } else {
                    self.terms.add_node(&self.dof_map, node, list);
                }
            }
            if !P::BY_COLUMNS {
                let responses = list.iter().map(|_| [P::default(); D]);
                self.terms.responses.extend(responses);
            }
            self.points.push(ContactRows {
                number,
                jacobian_terms: start[0]..self.terms.jacobian_terms.len(),
                responses: start[1]..self.terms.responses.len(),
                by_normal: [0.0; D],
                inverse_effective_mass: [0.0; 2],
                effective_mass: [0.0; D],
                target: [0.0; D],
                bounds: FrictionBounds::default(),
                impulse: [0.0; D],
                impulse_before: [0.0; D],
                step: [0.0; D],
                direction: [0.0; D],
            });
        }
    }

    /// Begins a solve: sets start impulses, bounds and velocities.
    pub(super) fn begin(
        &mut self,
        constraints: &[Constraint<D>],
        velocity: impl Fn(u32) -> [f64; D],
    ) {
        self.velocity.clear();
        self.velocity
            .resize(self.colours.node_count(), P::default());
        let numbers = bytemuck::cast_slice_mut::<P, f64>(&mut self.velocity);
        for (node, slot) in self.dof_map.slots() {
            for (c, component) in velocity(node).into_iter().enumerate() {
                numbers[slot.number(c)] = component;
            }
        }
        self.others.clear();
        let others = self.dof_map.others().iter();
        self.others.extend(others.map(|&node| velocity(node)));
        self.push(|_, point| {
            let constraint = &constraints[point.number as usize];
            point.target = constraint.target;
            point.bounds = constraint.bounds;
            point.impulse_before = constraint.impulse_before;
            point.impulse = std::array::from_fn(|r| {
                if point.moves(r) {
                    constraint.impulse[r]
                } else {
                    constraint.impulse_before[r]
                }
            });
            sub(&point.impulse, &point.impulse_before)
        });
        self.add_prescribed(constraints, velocity);
    }

    /// Ends a solve: computes the velocities of nodes without a slot.
    pub(super) fn end(&mut self) {
        if self.others.is_empty() {
            return;
        }
        self.on_nodes.clear();
        self.on_nodes.resize(self.dof_map.slots().len(), [0.0; D]);
        for point in &self.points {
            let made = sub(&point.impulse, &point.impulse_before);
            for (term, column_term) in self.terms.by_columns(point) {
                let own = &mut self.on_nodes[column_term.node as usize];
                add_scaled(own, 1.0, &column_term.on_node(term, &made));
            }
        }
        for group in self.dof_map.groups() {
            let others = &mut self.others[group.others.clone()];
            let columns = &self.terms.columns;
            columns.move_others(group.slots.clone(), &self.on_nodes, others);
        }
    }

    /// Subtracts the motion of prescribed nodes from the targets. Records their largest speed.
    fn add_prescribed(
        &mut self,
        constraints: &[Constraint<D>],
        velocity: impl Fn(u32) -> [f64; D],
    ) {
        self.prescribed_speed = 0.0;
        for prescribed in &self.prescribed {
            let point = &mut self.points[prescribed.place];
            let operator = &constraints[point.number as usize].jacobian;
            let velocity = velocity(prescribed.node);
            self.prescribed_speed = self.prescribed_speed.max(norm(&velocity));
            for r in 0..D {
                point.target[r] -= dot(&operator.rows[prescribed.of_constraint][r], &velocity);
            }
        }
    }

    /// Adds to the velocities the response to an impulse of each contact, N·s.
    fn push(&mut self, impulse: impl Fn(usize, &mut ContactRows<D>) -> [f64; D] + Sync) {
        let push = ApplyImpulse {
            terms: &self.terms,
            impulse,
        };
        let order = PassOrder::Forwards;
        self.colours
            .pass(order, &mut self.points, &mut self.velocity, &push);
    }

    /// Returns the largest speed of a node, m/s.
    pub(super) fn fastest(&self) -> f64 {
        let squares = self
            .velocities()
            .map(|(_, velocity)| dot(&velocity, &velocity));
        squares
            .fold(0.0, f64::max)
            .sqrt()
            .max(self.prescribed_speed)
    }

    /// Returns the nodes that may move, sorted.
    pub(crate) fn nodes(&self) -> &[u32] {
        self.dof_map.nodes()
    }

    /// Returns the nodes that may move, with their velocities, m/s. Those of nodes without a
    /// slot hold after [`Self::end`].
    pub(crate) fn velocities(&self) -> impl Iterator<Item = (u32, [f64; D])> + '_ {
        let numbers = bytemuck::cast_slice::<P, f64>(&self.velocity);
        let of = |slot: DofSlot| std::array::from_fn(|c| numbers[slot.number(c)]);
        let with_slot = self
            .dof_map
            .slots()
            .map(move |(node, slot)| (node, of(slot)));
        let others = self.dof_map.others().iter().copied();
        with_slot.chain(others.zip(self.others.iter().copied()))
    }

    /// Runs one Gauss–Seidel sweep.
    pub(super) fn sweep(&mut self, order: PassOrder) -> SweepResult {
        let sweep = SweepVisit {
            terms: &self.terms,
            ratio: self.nonlinear_cg.take_ratio(),
        };
        let [change, scale, square] =
            self.colours
                .pass(order, &mut self.points, &mut self.velocity, &sweep);
        SweepResult {
            change: change.sqrt(),
            scale: scale.max(f64::MIN_POSITIVE),
            square,
        }
    }

    /// Sets the search directions to zero.
    pub(super) fn forget_directions(&mut self) {
        for point in &mut self.points {
            (point.direction, point.step) = ([0.0; D], [0.0; D]);
        }
        self.nonlinear_cg.begin(&self.velocity);
    }

    /// Moves each contact by `ratio` along its last direction, after a sweep. Velocities move
    /// now, all at once. Impulses move in the next sweep, which also cuts them back to their
    /// bounds.
    pub(super) fn advance(&mut self, ratio: f64) {
        self.nonlinear_cg.advance(ratio, &mut self.velocity);
    }

    /// Computes the relative velocities of the contacts by position, m/s, without the motion of
    /// prescribed nodes.
    pub(super) fn relative_velocities(&self, velocity: &mut [P], relative: &mut [[f64; D]]) {
        let relate = RelativeVelocityVisit {
            terms: &self.terms,
            points: &self.points,
        };
        self.colours
            .pass(PassOrder::Forwards, relative, velocity, &relate);
    }

    /// Adds a change to the impulse of one contact, and its response to the velocities.
    pub(super) fn add_to(&mut self, place: usize, change: &[f64; D]) {
        let point = &mut self.points[place];
        add_scaled(&mut point.impulse, 1.0, change);
        let velocity = &mut BlockList {
            numbers: self.colours.nodes(place),
            all: &mut self.velocity,
        };
        self.terms.push(Scalar::new(), point, change, velocity);
    }

    /// Computes the velocities that impulses of the contacts make alone, m/s. `direct` returns the
    /// impulse of a contact, from its value in `own`, and a size. Returns the largest size.
    pub(super) fn respond<T: Send>(
        &self,
        own: &mut [T],
        velocity: &mut [P],
        direct: impl Fn(usize, &mut T) -> ([f64; D], f64) + Sync,
    ) -> f64 {
        let respond = ResponseVisit {
            terms: &self.terms,
            points: &self.points,
            direct,
        };
        let order = PassOrder::Forwards;
        let [largest] = self.colours.pass(order, own, velocity, &respond);
        largest
    }
}

/// Result of a sweep.
pub(super) struct SweepResult {
    /// Largest change of a relative velocity, and largest relative velocity that a normal
    /// impulse makes, m/s.
    pub(super) change: f64,
    pub(super) scale: f64,
    /// Square of the change, J.
    pub(super) square: f64,
}
