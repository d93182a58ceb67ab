//! The kick of many elements: as many side by side as the machine's registers hold.

use std::marker::PhantomData;

use pulp::{Arch, Simd, WithSimd};

use super::geometry::{Geometry, Nodal};
use super::lanes::{Lanes, Register, Single};
use super::set::{Formulation, MAX_RECORD};

/// The records of all elements of a set.
pub(super) enum History<'a> {
    /// Each kick brings them up to date.
    Kept(&'a mut [f64]),
    /// They stay as they are.
    Seen(&'a [f64]),
}

impl History<'_> {
    #[inline(always)]
    fn get(&self, number: usize) -> f64 {
        match self {
            History::Kept(all) => all[number],
            History::Seen(all) => all[number],
        }
    }
}

/// What a kick reads and writes.
pub(super) struct Kick<'a, const D: usize, const N: usize, const Q: usize, F> {
    geometry: &'a Geometry<D, N, Q>,
    history: History<'a>,
    /// Of all nodes, m and m/s.
    displacement: &'a [[f64; D]],
    velocity: &'a [[f64; D]],
    /// N·s.
    impulse: &'a mut [[f64; D]],
    viscous: &'a mut [[f64; D]],
    formulation: PhantomData<F>,
}

impl<'a, const D: usize, const N: usize, const Q: usize, F> Kick<'a, D, N, Q, F>
where
    F: Formulation<D, N, Q>,
{
    /// Of displacements, m, and velocities, m/s, of all nodes, to impulses, elastic and
    /// viscous, N·s.
    pub(super) fn new(
        geometry: &'a Geometry<D, N, Q>,
        history: History<'a>,
        [displacement, velocity]: [&'a [[f64; D]]; 2],
        [impulse, viscous]: [&'a mut [[f64; D]]; 2],
    ) -> Self {
        Self {
            geometry,
            history,
            displacement,
            velocity,
            impulse,
            viscous,
            formulation: PhantomData,
        }
    }

    /// Kicks the elements that are `due`, each over its interval, s.
    pub(super) fn run(self, due: &[u32], interval: &[f64]) {
        assert_eq!(
            due.len(),
            interval.len(),
            "one interval for each element due"
        );
        Arch::new().dispatch(Task {
            kick: self,
            due,
            interval,
        });
    }

    #[inline(always)]
    fn side_by_side<L: Lanes>(&mut self, lanes: L, due: &[u32], interval: &[f64]) {
        let gathered = self.geometry.gather(lanes, due);
        let element = gathered.view();
        let u = self.geometry.relative(lanes, due, self.displacement);
        let force = if F::RECORD == 0 {
            F::respond(element, &u, &mut [])
        } else {
            let mut record = [u[0][0]; MAX_RECORD];
            let record = &mut record[..F::RECORD];
            for (k, number) in record.iter_mut().enumerate() {
                *number = lanes.gather(|lane| self.history.get(due[lane] as usize * F::RECORD + k));
            }
            let force = F::respond(element, &u, record);
            if let History::Kept(all) = &mut self.history {
                for (k, number) in record.iter().enumerate() {
                    let each = lanes.each(*number);
                    for lane in 0..L::COUNT {
                        all[due[lane] as usize * F::RECORD + k] = each[lane];
                    }
                }
            }
            force
        };
        let duration = lanes.gather(|lane| interval[lane]);
        scatter(
            lanes,
            self.geometry,
            due,
            (&force, duration),
            self.impulse,
            |_| true,
        );
        let damping = |lane: usize| self.geometry.moduli(due[lane] as usize).damping;
        if (0..L::COUNT).any(|lane| damping(lane) > 0.0) {
            let velocity = self.geometry.relative(lanes, due, self.velocity);
            let rate = F::force_rate(element, &u, &velocity);
            let duration = lanes.gather(|lane| damping(lane) * interval[lane]);
            let is_damped = |lane: usize| damping(lane) > 0.0;
            scatter(
                lanes,
                self.geometry,
                due,
                (&rate, duration),
                self.viscous,
                is_damped,
            );
        }
    }
}

/// Adds the impulses of forces over some durations, s, to the nodes, element by element.
#[inline(always)]
fn scatter<L: Lanes, const D: usize, const N: usize, const Q: usize>(
    lanes: L,
    geometry: &Geometry<D, N, Q>,
    elements: &[u32],
    (force, duration): (&Nodal<D, N, L::Number>, L::Number),
    impulse: &mut [[f64; D]],
    counts: impl Fn(usize) -> bool,
) {
    let each = force.map(|of_node| of_node.map(|force| lanes.each(duration * force)));
    for lane in (0..L::COUNT).filter(|&lane| counts(lane)) {
        let nodes = geometry.nodes(elements[lane] as usize);
        for (node, of_node) in nodes.iter().zip(&each) {
            let target = &mut impulse[*node as usize];
            for k in 0..D {
                target[k] += of_node[k][lane];
            }
        }
    }
}

/// A kick for whatever instructions the machine has.
struct Task<'a, 'b, const D: usize, const N: usize, const Q: usize, F> {
    kick: Kick<'a, D, N, Q, F>,
    due: &'b [u32],
    interval: &'b [f64],
}

impl<const D: usize, const N: usize, const Q: usize, F> WithSimd for Task<'_, '_, D, N, Q, F>
where
    F: Formulation<D, N, Q>,
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            mut kick,
            due,
            interval,
        } = self;
        let whole = due.len() / S::F64_LANES * S::F64_LANES;
        let batches = due[..whole].chunks_exact(S::F64_LANES);
        for (due, interval) in batches.zip(interval.chunks_exact(S::F64_LANES)) {
            kick.side_by_side(Register(simd), due, interval);
        }
        for (due, interval) in due[whole..].chunks(1).zip(interval[whole..].chunks(1)) {
            kick.side_by_side(Single, due, interval);
        }
    }
}
