//! Kicks and drifts of all islands that are due, many at once: each sees the others as they were
//! before, so that it does not matter who comes first, nor on how many threads.

use rayon::prelude::*;

use crate::contact::island::{Bodies, Books, Island, Receive, Setting};
use crate::contact::live::Record;
use crate::contact::trail::Trail;
use crate::contact::{Interior, Timing};
use crate::model::motion::{Kicked, Motion};
use crate::profile::Stage;

/// Parts of the islands for each thread: one that is done early takes up another's.
const PARTS: usize = 4;

/// Nodes for each contact, at most, of which each part may have the velocities copied: a node
/// takes a thousandth of the time of a contact.
const NODES_A_CONTACT: usize = 50;

/// Holds all islands that are due in a kick at a time by its timing, velocities before which are
/// `before`. Returns the contacts that have ended.
pub(super) fn hold<const D: usize>(
    islands: &mut [Island<D>],
    setting: &Setting<D>,
    motion: &mut Kicked<D>,
    (before, time, timing): (&[[f64; D]], f64, Timing),
    receive: Receive<D>,
    books: &mut Books,
) -> Vec<Record> {
    let is_due = |island: &Island<D>| island.timing(timing).is_some();
    let (mut count, mut contacts) = (0, 0);
    for island in islands.iter().filter(|island| is_due(island)) {
        count += 1;
        contacts += island.live.len();
    }
    let of_all = &*books;
    let hold = |island: &mut Island<D>, motion: &mut Kicked<D>| {
        if let Some((interval, drift)) = island.timing(timing) {
            let timing = (time, interval, drift);
            island.hold(setting, motion, before, timing, of_all.beside());
        }
    };
    let parts = parts(contacts, motion.velocity.len()).min(count);
    if parts > 1 {
        let now = &*motion;
        let due = islands.iter_mut().filter(|island| is_due(island));
        let mut due: Vec<&mut Island<D>> = due.collect();
        due.par_chunks_mut(count.div_ceil(parts)).for_each(|part| {
            let mut velocity = now.velocity.to_vec();
            let mut motion = now.with(&mut velocity);
            part.iter_mut().for_each(|island| hold(island, &mut motion));
        });
    } else {
        islands.iter_mut().for_each(|island| hold(island, motion));
    }
    let due = islands.iter().filter(|island| is_due(island));
    books.add(due.clone().map(|island| island.held.books()));
    for hold in due.map(|island| &island.held) {
        hold.redo(motion.velocity);
        for solved in hold.solved() {
            solved.operator.deliver(&solved.impulse, &mut *receive);
        }
    }
    let due = islands.iter_mut().filter(|island| is_due(island));
    due.flat_map(|island| island.held.ended()).collect()
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
