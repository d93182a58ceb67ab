//! The first half of a substep: forces become velocities.

use super::ledger::{Account, Ledger};
use super::plan::Substep;
use crate::element::MAX_NODES;
use crate::model::prescribed::Prescribed;
use crate::model::{Model, State};
use crate::scene::Damping;
use crate::vector::{add, add_scaled, dot, scale, sub};

/// Nodal impulses of a kick, N·s, and velocities before it, m/s; zero where
/// nothing is due.
#[derive(Clone, Debug, Default)]
pub(crate) struct Impulses<const D: usize> {
    /// All but contact: internal, viscous, loads, gravity, damping.
    pub(crate) total: Vec<[f64; D]>,
    pub(crate) viscous: Vec<[f64; D]>,
    pub(crate) load: Vec<[f64; D]>,
    pub(crate) damping: Vec<[f64; D]>,
    /// Of contact, on nodes that are held.
    pub(crate) contact: Vec<[f64; D]>,
    pub(crate) before: Vec<[f64; D]>,
    /// What elements whose interval has changed would have given more in a kick
    /// of their last interval than of their next: node by node.
    pub(crate) relevelled: Vec<(u32, [f64; D])>,
    /// Kick interval of each node, s.
    pub(crate) interval: Vec<f64>,
    /// What groups of elements give their nodes, elastic and viscous; and sums: of these for the
    /// nodes that are due, one after the other, or of velocities of a block.
    shares: [Vec<[f64; D]>; 2],
    sums: Vec<[f64; D]>,
}

impl<const D: usize> Impulses<D> {
    pub(crate) fn new(nodes: usize) -> Self {
        // Zeros that come from the system take no memory until something acts; copies do.
        let zero = || vec![[0.0; D]; nodes];
        Self {
            total: zero(),
            viscous: zero(),
            load: zero(),
            damping: zero(),
            contact: zero(),
            before: zero(),
            relevelled: Vec::new(),
            interval: vec![0.0; nodes],
            shares: [Vec::new(), Vec::new()],
            sums: Vec::new(),
        }
    }

    /// Energy that changes of level make in a kick to the velocities `after`, J, node by
    /// node: ½v⁻·M·v⁺ measures an element by its interval; where that changes, by a quarter
    /// of the difference of its impulses on what the kick changes.
    pub(crate) fn made_by_levels(&self, after: &[[f64; D]]) -> impl Iterator<Item = (u32, f64)> {
        self.relevelled.iter().map(|(node, less)| {
            let n = *node as usize;
            let change = sub(&after[n], &self.before[n]);
            (*node, 0.25 * dot(less, &change))
        })
    }

    /// Notes the kick interval of each node that is due.
    fn take_intervals(&mut self, state: &mut State<D>, substep: &Substep, purpose: Purpose) {
        for &node in substep.nodes() {
            let n = node as usize;
            let next = substep.duration(node);
            self.interval[n] = match purpose {
                Purpose::Advance => 0.5 * (state.node_interval[n] + next),
                Purpose::Report => state.node_interval[n],
            };
            if purpose == Purpose::Advance {
                state.node_interval[n] = next;
            }
        }
    }

    /// Zeroes what a kick of `nodes` has left of what acts.
    pub(crate) fn clear(&mut self, nodes: &[u32], acting: Acting) {
        // Seldom there, and then of many elements: its memory goes with it.
        self.relevelled = Vec::new();
        let zero = |array: &mut [[f64; D]]| {
            for &node in nodes {
                array[node as usize] = [0.0; D];
            }
        };
        if acting.loads {
            zero(&mut self.load);
        }
        if acting.mass_damping || acting.local_damping {
            zero(&mut self.damping);
        }
    }
}

/// What there is beside elements and contact: the rest costs nothing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Acting {
    gravity: bool,
    loads: bool,
    mass_damping: bool,
    stiffness_damping: bool,
    pub(super) local_damping: bool,
}

impl Acting {
    fn anything(self) -> bool {
        self.gravity
            || self.loads
            || self.mass_damping
            || self.stiffness_damping
            || self.local_damping
    }
}

/// Whether a kick moves the run on, or only looks.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Kick from the middle of the last interval to the middle of the next.
    Advance,
    /// Kick over the last interval only; half of it is the state at its end.
    Report,
}

/// At which velocity the impulses of a kick do their work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Velocity {
    /// The mean of those before and after: the whole kick.
    #[default]
    Mean,
    /// That before: what of it belongs to the interval before.
    Before,
}

impl<const D: usize> Model<D> {
    /// Kicks what is due: internal forces, loads, gravity, damping, prescribed
    /// velocities; contact comes after.
    pub(crate) fn kick(
        &mut self,
        state: &mut State<D>,
        velocity: &mut [[f64; D]],
        impulses: &mut Impulses<D>,
        substep: &Substep,
        purpose: Purpose,
    ) {
        let (nodes, acting) = (substep.nodes(), self.acting(substep.time));
        if !substep.plan.is_steady {
            impulses.take_intervals(state, substep, purpose);
        }
        self.kick_elements(state, velocity, impulses, substep, purpose);
        let lumped = self.inertia.lumped().filter(|_| substep.takes_all());
        if let Some(inverse_mass) = lumped.filter(|_| !acting.anything()) {
            let shares = (substep.coarsest, &*impulses.shares[0]);
            let nodal = [&mut *impulses.total, &mut impulses.before, &mut *velocity];
            substep.plan.assembly.kick_all(shares, inverse_mass, nodal);
            return self.prescribe(state, velocity, substep, purpose);
        }
        if substep.takes_all() {
            impulses.before.copy_from_slice(velocity);
        } else {
            for &node in nodes {
                impulses.before[node as usize] = velocity[node as usize];
            }
        }
        sum_shares(impulses, substep);
        self.loads(state, impulses, substep);
        if acting.gravity || acting.local_damping {
            self.body_forces(state, velocity, impulses, substep);
        }
        if lumped.is_some() {
            self.inertia.kick_all(&impulses.total, velocity);
        } else {
            self.inertia.kick(nodes, &impulses.total, velocity);
        }
        if acting.mass_damping {
            self.damp_mass(velocity, impulses, nodes);
        }
        self.prescribe(state, velocity, substep, purpose);
    }

    /// Impulses of elements: the shares that the groups give their nodes.
    fn kick_elements(
        &mut self,
        state: &mut State<D>,
        velocity: &[[f64; D]],
        impulses: &mut Impulses<D>,
        substep: &Substep,
        purpose: Purpose,
    ) {
        let intervals = (!substep.plan.is_settled)
            .then(|| self.element_intervals(state, impulses, substep, purpose));
        let due = substep.due(intervals.as_deref(), purpose == Purpose::Advance);
        let assembly = &substep.plan.assembly;
        let is_damped = self
            .blocks
            .iter()
            .any(|block| block.damping.stiffness > 0.0);
        let counts = [assembly.len(), if is_damped { assembly.len() } else { 0 }];
        for (shares, count) in impulses.shares.iter_mut().zip(counts) {
            shares.resize(count, [0.0; D]);
        }
        for (number, set) in self.sets.iter_mut().enumerate() {
            let own = assembly.of_set(number);
            let shares = impulses.shares.each_mut().map(|shares| {
                let end = shares.len();
                &mut shares[own.start.min(end)..own.end.min(end)]
            });
            set.kick(&due, [&state.displacement, velocity], shares);
        }
    }

    /// Kick interval of each element, s, where some come from other levels; all are due.
    fn element_intervals(
        &self,
        state: &mut State<D>,
        impulses: &mut Impulses<D>,
        substep: &Substep,
        purpose: Purpose,
    ) -> Vec<f64> {
        let mut intervals = state.element_interval.clone();
        if purpose == Purpose::Report {
            return intervals;
        }
        for (element, interval) in intervals.iter_mut().enumerate() {
            let nodes = self.mesh.elements[element].nodes();
            if self.is_fixed(nodes[0]) {
                continue;
            }
            let (last, next) = (*interval, substep.element_duration(element));
            *interval = 0.5 * (last + next);
            state.element_interval[element] = next;
            if last != next {
                let (set, i) = self.place.of(element);
                let mut force = [[0.0; D]; MAX_NODES];
                self.sets[set].force(i, &state.displacement, &mut force);
                // So a run that begins at rest remembers nothing of its first kick.
                if force == [[0.0; D]; MAX_NODES] {
                    continue;
                }
                let less = nodes.iter().zip(&force);
                let less = less.map(|(&node, force)| (node, scale(last - next, force)));
                impulses.relevelled.extend(less);
            }
        }
        intervals
    }

    fn loads(&self, state: &State<D>, impulses: &mut Impulses<D>, substep: &Substep) {
        let at = self.positions(state);
        for load in &self.loads {
            load.forces(
                substep.time,
                |node| at.at(node),
                |node, force| {
                    let n = node as usize;
                    if substep.is_due(node) {
                        add_scaled(&mut impulses.load[n], impulses.interval[n], &force);
                        add_scaled(&mut impulses.total[n], impulses.interval[n], &force);
                    }
                },
            );
        }
    }

    /// Gravity, and local damping after Cundall: it opposes the velocity with
    /// a share of the unbalanced force, contact as it was in the last kick.
    fn body_forces(
        &self,
        state: &State<D>,
        velocity: &[[f64; D]],
        impulses: &mut Impulses<D>,
        substep: &Substep,
    ) {
        let gravity = self.gravity_at(substep.time);
        for &node in substep.nodes() {
            let n = node as usize;
            let weight = self.inertia.mass()[n] * impulses.interval[n];
            add_scaled(&mut impulses.total[n], weight, &gravity);
            let local = self.blocks[self.block_of[n] as usize].damping.local;
            if local > 0.0 {
                for c in 0..D {
                    let contact = state.contact_force[n][c] * impulses.interval[n];
                    let unbalanced = impulses.total[n][c] + contact;
                    let damping = -local * unbalanced.abs() * sign(velocity[n][c]);
                    impulses.damping[n][c] += damping;
                    impulses.total[n][c] += damping;
                }
            }
        }
    }

    /// Mass-proportional damping, centred in time: stable at any step. Contact
    /// impulses, which come later, see it in their [`Mobility`].
    ///
    /// [`Mobility`]: crate::model::inertia::Mobility
    fn damp_mass(&self, velocity: &mut [[f64; D]], impulses: &Impulses<D>, nodes: &[u32]) {
        for &node in nodes {
            let n = node as usize;
            let alpha = self.blocks[self.block_of[n] as usize].damping.mass;
            if alpha > 0.0 {
                let share = 0.5 * alpha * impulses.interval[n];
                for c in 0..D {
                    let free = velocity[n][c];
                    velocity[n][c] = (free - share * impulses.before[n][c]) / (1.0 + share);
                }
            }
        }
    }

    /// Impulses of mass-proportional damping, once contact is solved and the
    /// velocities are `after`.
    pub(crate) fn book_damping(
        &self,
        after: &[[f64; D]],
        impulses: &mut Impulses<D>,
        substep: &Substep,
    ) {
        if !self.acting(substep.time).mass_damping {
            return;
        }
        let mut due = substep.nodes();
        while let Some(&node) = due.first() {
            let nodes = self.inertia.coupled(node as usize);
            due = &due[nodes.len()..];
            let alpha = self.blocks[self.block_of[nodes.start] as usize]
                .damping
                .mass;
            if alpha == 0.0 {
                continue;
            }
            let (first, sums) = (nodes.start, &mut impulses.sums);
            let both = impulses.before[nodes.clone()]
                .iter()
                .zip(&after[nodes.clone()]);
            sums.clear();
            sums.extend(both.map(|(before, after)| add(before, after)));
            for n in nodes {
                let share = 0.5 * alpha * impulses.interval[n];
                let momenta = self.inertia.weighted(n, |other| sums[other - first]);
                for c in 0..D {
                    let damping = -share * momenta[c];
                    impulses.damping[n][c] += damping;
                    impulses.total[n][c] += damping;
                }
            }
        }
    }

    /// Gives held components what the drift needs to end where it must; for a
    /// report, the value of now as the mean of before and after.
    fn prescribe(
        &self,
        state: &State<D>,
        velocity: &mut [[f64; D]],
        substep: &Substep,
        purpose: Purpose,
    ) {
        let at = self.positions(state);
        let acting = |motion: &&Prescribed| motion.acts(substep.step_start);
        for motion in self.prescribed.iter().filter(acting) {
            for &node in motion.nodes.iter().filter(|&&node| substep.is_due(node)) {
                let n = node as usize;
                let mut wanted = velocity[n];
                if purpose == Purpose::Advance {
                    let drift = (substep.time, substep.duration(node));
                    motion.set(drift, &at.at(node), &mut wanted);
                } else {
                    motion.start(substep.time, &at.at(node), &mut wanted);
                    for (c, held) in motion.holds::<D>().into_iter().enumerate() {
                        if held {
                            wanted[c] = 2.0 * wanted[c] - state.velocity[n][c];
                        }
                    }
                }
                self.inertia.set(n, &wanted, velocity);
            }
        }
    }

    /// What acts at a time.
    pub(crate) fn acting(&self, time: f64) -> Acting {
        let mut acting = Acting {
            gravity: self.gravity_at(time).iter().any(|&g| g != 0.0),
            loads: !self.loads.is_empty(),
            mass_damping: false,
            stiffness_damping: false,
            local_damping: false,
        };
        for Damping {
            mass,
            stiffness,
            local,
        } in self.blocks.iter().map(|block| block.damping)
        {
            acting.mass_damping |= mass > 0.0;
            acting.stiffness_damping |= stiffness > 0.0;
            acting.local_damping |= local > 0.0;
        }
        acting
    }

    /// Acceleration of gravity, m/s².
    pub(crate) fn gravity_at(&self, time: f64) -> [f64; D] {
        self.gravity.vector(time)
    }

    /// Books the work of a kick once contact is solved, `after` being the
    /// velocities after all impulses.
    pub(crate) fn book_kick(
        &self,
        (after, at): (&[[f64; D]], Velocity),
        impulses: &Impulses<D>,
        substep: &Substep,
        ledger: &mut Ledger,
    ) {
        let end = |node: usize| match at {
            Velocity::Mean => &after[node],
            Velocity::Before => &impulses.before[node],
        };
        let (gravity, acting) = (self.gravity_at(substep.time), self.acting(substep.time));
        let nodes = if acting.anything() {
            substep.nodes()
        } else {
            &[]
        };
        for &node in nodes {
            let n = node as usize;
            let (before, end) = (&impulses.before[n], end(n));
            if acting.gravity {
                let weight = self.inertia.mass()[n] * impulses.interval[n];
                ledger.book(Account::Gravity, &gravity.map(|g| weight * g), before, end);
            }
            if acting.loads {
                ledger.book(Account::External, &impulses.load[n], before, end);
            }
            let damping = self.blocks[self.block_of[n] as usize].damping;
            if damping.mass > 0.0 || damping.local > 0.0 {
                ledger.book(Account::Damping, &impulses.damping[n], before, end);
            }
            if damping.stiffness > 0.0 {
                ledger.book(Account::Viscosity, &impulses.viscous[n], before, end);
            }
        }
        for (_, energy) in impulses.made_by_levels(after) {
            ledger.remesh_loss -= energy;
        }
        // What held nodes have needed beside these impulses and contact.
        for &node in substep.held() {
            let n = node as usize;
            let [old, new] = [&*impulses.before, after].map(|v| self.inertia.momentum(n, v));
            let holds = self.inertia.held(n);
            let reaction = std::array::from_fn(|c| {
                let given = impulses.total[n][c] + impulses.contact[n][c];
                if holds[c] {
                    new[c] - old[c] - given
                } else {
                    0.0
                }
            });
            ledger.book(Account::External, &reaction, &impulses.before[n], end(n));
        }
    }
}

/// Sums the shares of the nodes that are due.
fn sum_shares<const D: usize>(impulses: &mut Impulses<D>, substep: &Substep) {
    let (nodes, assembly) = (substep.nodes(), &substep.plan.assembly);
    let [elastic, viscous] = &impulses.shares;
    let sums = &mut impulses.sums;
    if substep.takes_all() {
        assembly.sum_all(substep.coarsest, elastic, &mut impulses.total);
    } else {
        assembly.sums(nodes, substep.coarsest, elastic, sums);
        for (&node, sum) in nodes.iter().zip(&*sums) {
            impulses.total[node as usize] = *sum;
        }
    }
    if !viscous.is_empty() {
        assembly.sums(nodes, substep.coarsest, viscous, sums);
        for (&node, sum) in nodes.iter().zip(&*sums) {
            impulses.viscous[node as usize] = *sum;
            add_scaled(&mut impulses.total[node as usize], 1.0, sum);
        }
    }
}

fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}
