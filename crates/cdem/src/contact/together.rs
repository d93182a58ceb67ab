//! Kicks and drifts of all islands that are due, many at once: each sees the others as they were
//! before, so that it does not matter who comes first, nor on how many threads.

use rayon::prelude::*;

use crate::contact::Interior;
use crate::contact::hold::Held;
use crate::contact::island::{Bodies, Books, Island, Receive, Setting};
use crate::contact::live::Record;
use crate::contact::trail::Trail;
use crate::model::motion::{Kicked, Motion};
use crate::profile::Stage;

/// Parts of the islands for each thread: one that is done early takes up another's.
const PARTS: usize = 4;

/// Nodes for each contact, at most, of which each part may have the velocities copied: a node
/// takes a thousandth of the time of a contact.
const NODES_A_CONTACT: usize = 50;

/// An island in its kick of `interval` seconds, before a drift of `drift` seconds.
pub(super) struct Due<'a, const D: usize> {
    pub(super) island: &'a mut Island<D>,
    pub(super) interval: f64,
    pub(super) drift: f64,
}

/// Holds all islands that are `due` in a kick at `time`; `before` are the velocities before it.
/// Returns the contacts that have ended.
pub(super) fn hold<const D: usize>(
    due: &mut [Due<D>],
    setting: &Setting<D>,
    motion: &mut Kicked<D>,
    (before, time): (&[[f64; D]], f64),
    receive: Receive<D>,
    books: &mut Books,
) -> Vec<Record> {
    let contacts: usize = due.iter().map(|due| due.island.live.len()).sum();
    let hold = |due: &mut Due<D>, motion: &mut Kicked<D>| {
        let timing = (time, due.interval, due.drift);
        let own = books.beside();
        due.island.hold(setting, motion, before, timing, own)
    };
    let parts = parts(contacts, motion.velocity.len()).min(due.len());
    let held: Vec<Held> = if parts > 1 {
        let now = &*motion;
        let of_part = |part: &mut [Due<D>]| {
            let mut velocity = now.velocity.to_vec();
            let mut motion = now.with(&mut velocity);
            let held = part.iter_mut().map(|due| hold(due, &mut motion));
            held.collect::<Vec<_>>()
        };
        let each = due.par_chunks_mut(due.len().div_ceil(parts));
        each.flat_map_iter(of_part).collect()
    } else {
        due.iter_mut().map(|due| hold(due, motion)).collect()
    };
    books.add(held.iter().map(|held| &held.books));
    for hold in due.iter().map(|due| &due.island.held) {
        hold.redo(motion.velocity);
        for solved in hold.solved() {
            solved.operator.deliver(&solved.impulse, &mut *receive);
        }
    }
    held.into_iter().flat_map(|held| held.ended).collect()
}

/// An island before a drift of `duration` seconds in which pairs of it touch.
pub(super) struct Meeting<'a, const D: usize> {
    pub(super) island: &'a mut Island<D>,
    pub(super) duration: f64,
}

/// What has become of it.
struct Met<const D: usize> {
    trail: Trail<D>,
    /// Impulses of contacts, and of elements on nodes that are held, N·s.
    received: [Vec<(u32, [f64; D])>; 2],
    books: Books,
}

/// Drifts all islands whose pairs touch, from a `time` on.
pub(super) fn drift<const D: usize, I: Interior<D>>(
    meetings: &mut [Meeting<D>],
    setting: &Setting<D>,
    motion: &mut Motion<D>,
    ((interior, taken), time): ((&I, &[bool]), f64),
    mut receive: [Receive<D>; 2],
    books: &mut Books,
) {
    let contacts = meetings.iter().map(|meeting| meeting.island.live.len());
    let parts = parts(contacts.sum(), motion.velocity.len()).min(meetings.len());
    let drift = |meeting: &mut Meeting<D>, motion: &mut Motion<D>| {
        let mut trail = Trail::new(&meeting.island.nodes, motion);
        let bodies = &mut Bodies {
            interior,
            taken,
            trail: &mut trail,
        };
        let [mut received, mut on_held] = [const { Vec::new() }; 2];
        let receive: &mut [Receive<D>; 2] = &mut [
            &mut |node, impulse| received.push((node, *impulse)),
            &mut |node, impulse| on_held.push((node, *impulse)),
        ];
        let (timing, mut own) = ((time, meeting.duration), books.beside());
        meeting
            .island
            .drift(setting, motion, timing, bodies, receive, &mut own);
        own.watch.lap(Stage::Geometry);
        trail.undo(motion);
        Met {
            trail,
            received: [received, on_held],
            books: own,
        }
    };
    let met: Vec<Met<D>> = if parts > 1 {
        let now = &*motion;
        let of_part = |part: &mut [Meeting<D>]| {
            let mut copied = now.copied();
            let mut motion = copied.motion(now.rest);
            let met = part.iter_mut().map(|meeting| drift(meeting, &mut motion));
            met.collect::<Vec<_>>()
        };
        let each = meetings.par_chunks_mut(meetings.len().div_ceil(parts));
        each.flat_map_iter(of_part).collect()
    } else {
        meetings
            .iter_mut()
            .map(|meeting| drift(meeting, motion))
            .collect()
    };
    books.add(met.iter().map(|met| &met.books));
    for met in &met {
        met.trail.redo(motion);
        for (receive, received) in receive.iter_mut().zip(&met.received) {
            received
                .iter()
                .for_each(|(node, impulse)| receive(*node, impulse));
        }
    }
}

/// Into how many parts islands with so many contacts are worth to be put, where each has the
/// velocities of all `nodes` for itself.
fn parts(contacts: usize, nodes: usize) -> usize {
    match rayon::current_num_threads() {
        1 => 1,
        threads => (PARTS * threads).min(NODES_A_CONTACT * contacts / nodes.max(1)),
    }
}
