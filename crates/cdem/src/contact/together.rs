//! The kick of all islands that are due, many at once: each sees the others as they were
//! before, so that it does not matter who comes first, nor on how many threads.

use rayon::prelude::*;

use crate::contact::hold::Held;
use crate::contact::island::{Books, Island, Receive, Setting};
use crate::contact::live::Record;
use crate::model::motion::Kicked;

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

/// Into how many parts islands with so many contacts are worth to be put, where each has the
/// velocities of all `nodes` for itself.
fn parts(contacts: usize, nodes: usize) -> usize {
    match rayon::current_num_threads() {
        1 => 1,
        threads => (PARTS * threads).min(NODES_A_CONTACT * contacts / nodes.max(1)),
    }
}
