//! Kicks and drifts of all islands that are due, in parallel: Jacobi between islands. Each
//! island sees the others as they were before, so the result depends neither on the order of
//! islands nor on the number of threads.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use crate::contact::constraint::contact_history::ContactHistory;
use crate::contact::constraint::context::ContactContext;
use crate::contact::energy::{ContactEnergies, DriftImpulses};
use crate::contact::interior::BodyCoupling;
use crate::contact::island::kick::Kick;
use crate::contact::island::{Bodies, Island, IslandBodies};
use crate::contact::rollback::Rollback;
use crate::contact::surface::kicked::KickedView;
use crate::contact::timing::{DriftStart, KickTimes};
use crate::contact::tolerances::{CONTACTS_WORTH_A_THREAD, NODES_PER_CONTACT, TASKS_PER_THREAD};
use crate::math::profile::Stage;
use crate::model::kinematics::NodalMotion;

/// Copies of the velocities of all nodes, m/s, one for each thread at work. Kept to reuse their
/// memory.
#[derive(Debug, Default)]
pub(crate) struct VelocityCopies<const D: usize>(Mutex<Vec<Vec<[f64; D]>>>);

impl<const D: usize> VelocityCopies<D> {
    /// Runs `work` on a copy of velocities.
    fn lend(&self, velocity: &[[f64; D]], work: impl FnOnce(&mut [[f64; D]])) {
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut copy = kept().pop().unwrap_or_default();
        copy.clear();
        copy.extend_from_slice(velocity);
        work(&mut copy);
        kept().push(copy);
    }
}

/// The islands, and copies of the velocities for the threads that kick them.
pub(crate) struct IslandsInKick<'a, const D: usize> {
    pub(crate) islands: &'a mut [Island<D>],
    pub(crate) copies: &'a VelocityCopies<D>,
}

/// A kick of all islands that are due.
pub(crate) struct IslandKicks<'a, const D: usize> {
    /// Velocities of all nodes before it, m/s.
    pub(crate) before: &'a [[f64; D]],
    pub(crate) times: KickTimes<'a>,
}

/// Kicks all islands that are due. `before` are the velocities before the kick, m/s. Adds the
/// impulses on nodes to a list, N·s. Returns the contacts that have ended.
pub(crate) fn kick<const D: usize>(
    all: IslandsInKick<D>,
    context: &ContactContext<D>,
    motion: &mut KickedView<D>,
    kick: &IslandKicks<D>,
    received: &mut Vec<(u32, [f64; D])>,
    energies: &mut ContactEnergies,
) -> Vec<ContactHistory> {
    let IslandsInKick { islands, copies } = all;
    let is_due = |island: &Island<D>| island.kick_span(kick.times).is_some();
    let due = islands.iter().filter(|island| is_due(island));
    let parts = parts(
        due.map(|island| island.contact_points.len()),
        motion.velocity.len(),
    );
    let of_all = &*energies;
    let kick_island = |island: &mut Island<D>, motion: &mut KickedView<D>| {
        if let Some(span) = island.kick_span(kick.times) {
            let kick = Kick {
                before: kick.before,
                time: kick.times.time,
                span,
            };
            island.kick(context, motion, kick, of_all.empty_copy());
        }
    };
    if parts > 1 {
        let now = &*motion;
        // An island without contacts still has to examine its open pairs.
        let weight =
            |island: &Island<D>| usize::from(is_due(island)) * (1 + island.contact_points.len());
        run_in_parts(islands, parts, &weight, &|part| {
            if part.iter().any(is_due) {
                copies.lend(now.velocity, |velocity| {
                    let mut motion = now.with(velocity);
                    part.iter_mut()
                        .for_each(|island| kick_island(island, &mut motion));
                });
            }
        });
    } else {
        islands
            .iter_mut()
            .for_each(|island| kick_island(island, motion));
    }
    let due = islands.iter().filter(|island| is_due(island));
    energies.add(due.clone().map(|island| island.workspace.kick.energies()));
    for workspace in due.map(|island| &island.workspace.kick) {
        workspace.redo(motion.velocity);
        for solved in workspace.solved() {
            let receive = |node, impulse: &[f64; D]| received.push((node, *impulse));
            solved.jacobian.apply_transpose(&solved.impulse, receive);
        }
    }
    let due = islands.iter_mut().filter(|island| is_due(island));
    due.flat_map(|island| island.workspace.kick.ended())
        .collect()
}

/// Moves all islands that are due through their drift. Adds the impulses on nodes to lists. An
/// island whose pairs touch sees the other islands as they were before the drift, and nodes of no
/// island as they are after it.
pub(crate) fn drift<const D: usize, I: BodyCoupling<D>>(
    islands: &mut [Island<D>],
    context: &ContactContext<D>,
    motion: &mut NodalMotion<D>,
    bodies: &Bodies<I>,
    start: DriftStart,
    received: &mut DriftImpulses<D>,
    energies: &mut ContactEnergies,
) {
    let due = |island: &Island<D>| start.durations.of(*island.nodes.first()?);
    let tasks = islands.iter_mut().enumerate();
    let mut tasks: Vec<DriftTask<D>> = tasks
        .filter_map(|(number, island)| {
            let duration = due(island).filter(|_| !island.flies_freely())?;
            Some(DriftTask {
                number,
                island,
                duration,
            })
        })
        .collect();
    let outcomes = drift_with_touches(&mut tasks, context, motion, bodies, start.time, energies);
    let mut meeting = outcomes.iter().map(|outcomes| outcomes.number).peekable();
    for (number, island) in islands.iter_mut().enumerate() {
        if meeting.next_if_eq(&number).is_none()
            && let Some(duration) = due(island)
        {
            island.advance(motion, duration);
        }
    }
    for outcomes in &outcomes {
        energies.impact_loss -= outcomes.rollback.redo(motion, context.inertia.mass());
        let DriftImpulses {
            of_contacts,
            on_prescribed,
        } = &outcomes.impulses;
        received.of_contacts.extend(of_contacts);
        received.on_prescribed.extend(on_prescribed);
    }
}

/// An island, with its index, before a drift of `duration` seconds in which pairs of it touch.
struct DriftTask<'a, const D: usize> {
    number: usize,
    island: &'a mut Island<D>,
    duration: f64,
}

/// Result of a [`DriftTask`].
struct DriftOutcome<const D: usize> {
    number: usize,
    rollback: Rollback<D>,
    impulses: DriftImpulses<D>,
    energies: ContactEnergies,
}

/// Computes the drift of islands whose pairs touch, from `time` on. Nodes stay where they are.
fn drift_with_touches<const D: usize, I: BodyCoupling<D>>(
    tasks: &mut [DriftTask<D>],
    context: &ContactContext<D>,
    motion: &mut NodalMotion<D>,
    bodies: &Bodies<I>,
    time: f64,
    energies: &mut ContactEnergies,
) -> Vec<DriftOutcome<D>> {
    let pairs = tasks.iter().map(|meeting| meeting.island.pair_count());
    let parts = parts(pairs, motion.velocity.len());
    let of_all = &*energies;
    let drift = |meeting: &mut DriftTask<D>, motion: &mut NodalMotion<D>| {
        let island = &mut *meeting.island;
        let mut outcomes = DriftOutcome {
            number: meeting.number,
            rollback: Rollback::new(&island.nodes, motion),
            impulses: DriftImpulses::default(),
            energies: of_all.empty_copy(),
        };
        let bodies = &mut IslandBodies {
            of_all: bodies,
            touch: I::Touch::default(),
            rollback: &mut outcomes.rollback,
            received: &mut outcomes.impulses,
        };
        island.drift(
            context,
            motion,
            time,
            meeting.duration,
            bodies,
            &mut outcomes.energies,
        );
        outcomes.energies.watch.lap(Stage::Geometry);
        outcomes.rollback.undo(motion);
        outcomes
    };
    let outcomes: Vec<DriftOutcome<D>> = if parts > 1 {
        let now = &*motion;
        let of_part = |part: &mut [DriftTask<D>]| {
            let mut copied = now.copied();
            let mut motion = copied.motion(now.rest);
            let outcomes = part.iter_mut().map(|meeting| drift(meeting, &mut motion));
            outcomes.collect::<Vec<_>>()
        };
        let each = tasks.par_chunks_mut(tasks.len().div_ceil(parts));
        each.flat_map_iter(of_part).collect()
    } else {
        let outcomes = tasks.iter_mut().map(|meeting| drift(meeting, motion));
        outcomes.collect()
    };
    energies.add(outcomes.iter().map(|outcomes| &outcomes.energies));
    outcomes
}

/// Runs `work` on all threads, on this many runs of islands, of about equal weight.
fn run_in_parts<const D: usize>(
    islands: &mut [Island<D>],
    parts: usize,
    weight: &(impl Fn(&Island<D>) -> usize + Sync),
    work: &(impl Fn(&mut [Island<D>]) + Sync),
) {
    if parts == 1 {
        work(islands);
        return;
    }
    let left = parts / 2;
    let all: usize = islands.iter().map(weight).sum();
    let mut so_far = 0;
    let has_its_middle_beyond = |island: &Island<D>| {
        let own = weight(island);
        so_far += own;
        (2 * so_far - own) * parts > 2 * all * left
    };
    let middle = islands.iter().position(has_its_middle_beyond);
    let (first, others) = islands.split_at_mut(middle.unwrap_or(islands.len()));
    rayon::join(
        || run_in_parts(first, left, weight, work),
        || run_in_parts(others, parts - left, weight, work),
    );
}

/// Returns the number of parts that are worthwhile for islands with these numbers of contacts,
/// if each part copies all `nodes`.
fn parts(contacts: impl Iterator<Item = usize>, nodes: usize) -> usize {
    let threads = rayon::current_num_threads();
    if threads == 1 {
        return 1;
    }
    let (mut islands, mut all, mut most) = (0, 0, 0);
    for contacts in contacts {
        (islands, all, most) = (islands + 1, all + contacts, most.max(contacts));
    }
    if all - most < CONTACTS_WORTH_A_THREAD {
        return 1;
    }
    (TASKS_PER_THREAD * threads)
        .min(NODES_PER_CONTACT * all / nodes.max(1))
        .min(islands)
}
