//! First touches of the open pairs of an island in a drift, in order of time.

use rayon::prelude::*;
use smallvec::SmallVec;

use crate::contact::ccd::instant::instant_of_touch;
use crate::contact::constraint::active_set::ActiveSetIndex;
use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::constraint::context::ContactContext;
use crate::contact::constraint::duplicate::DriftInterval;
use crate::contact::detection::separation_bounds::SeparationBounds;
use crate::contact::island::Island;
use crate::contact::island::quick_check::{ClosureRule, QuickCheck, quick_check};
use crate::contact::narrow_phase::feature_selection::select_feature_pair;
use crate::contact::surface::kicked::{ConstantMotion, KickedView};
use crate::contact::surface::{Configuration, Pair};
use crate::contact::timing::DriftProgress;
use crate::contact::tolerances::CONTACTS_PER_TASK;
use crate::math::vector::{norm, sub};

/// Times at which the open pairs of an island touch in a drift.
#[derive(Debug, Default)]
pub(crate) struct TouchEvents<const D: usize> {
    /// Pairs whose state is not [`TouchState::Never`], by their index among the separation
    /// bounds, in rising order.
    states: Vec<(usize, TouchState)>,
    /// Reused memory: the states before; examined pairs with their index in `states`; results
    /// of the quick check and of the full one; closed pairs, sorted, and their spatial index.
    before: Vec<(usize, TouchState)>,
    examined: Vec<(usize, Pair)>,
    quick_checks: Vec<(QuickCheck, Option<f64>)>,
    full_checks: Vec<TouchState>,
    closed: Vec<Pair>,
    active_set: ActiveSetIndex<D>,
}

impl<const D: usize> Clone for TouchEvents<D> {
    /// Returns an empty list: a kick examines all pairs anew.
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// Time of touch of a pair, s from the start of the drift.
#[derive(Clone, Copy, Debug, PartialEq)]
enum TouchState {
    Never,
    /// It touches at this time; the touch belongs to this pair.
    At(f64, Pair),
    /// It would touch, but the features around it rule that out at the present velocities.
    Refused,
    /// It, or a pair in its place, has touched at an event, and is not known to be closed.
    Due,
    Closed,
}

/// A change of the velocities of an island in a kick or a drift.
pub(crate) struct Event<'a, const D: usize> {
    /// Velocities of the nodes of the island before it, m/s.
    pub(crate) before: &'a [[f64; D]],
    /// True if a contact has begun.
    pub(crate) has_begun: bool,
    pub(crate) now: DriftProgress,
}

/// The closed pairs of an island: their spatial index, and the contact points.
#[derive(Clone, Copy)]
struct ActiveSet<'a, const D: usize> {
    index: &'a ActiveSetIndex<D>,
    contact_points: &'a [ContactPoint<D>],
}

impl<const D: usize> TouchEvents<D> {
    /// Examines all open pairs for a drift of `duration` seconds from now.
    pub(crate) fn begin(
        &mut self,
        island: &mut Island<D>,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        duration: f64,
    ) {
        self.states.clear();
        let now = DriftProgress::start(duration);
        self.examine(
            island,
            context,
            motion,
            ClosureRule::InKick,
            now,
            |_, _, _| true,
        );
    }

    /// Examines some pairs again after a kick: those left open though they touch and, if the kick
    /// `has_released` contacts, those closed or refused before. Those that would penetrate before
    /// the next kick become touch events.
    pub(crate) fn reexamine(
        &mut self,
        island: &mut Island<D>,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        duration: f64,
        has_released: bool,
    ) {
        let is_open = |touch: TouchState| match touch {
            TouchState::Due => true,
            TouchState::Closed | TouchState::Refused => has_released,
            TouchState::Never | TouchState::At(..) => false,
        };
        if has_released || self.states.iter().any(|(_, touch)| is_open(*touch)) {
            let again = |_: &[u32], old: TouchState, _: Pair| is_open(old);
            let now = DriftProgress::start(duration);
            self.examine(island, context, motion, ClosureRule::InDrift, now, again);
        }
    }

    /// Returns the number of pairs that are known to touch in the rest of the drift.
    pub(crate) fn upcoming_count(&self) -> usize {
        let ahead = |(_, touch): &&(usize, TouchState)| matches!(touch, TouchState::At(..));
        self.states.iter().filter(ahead).count()
    }

    /// Takes the pairs that touch already, as one event.
    pub(crate) fn take_due_now(&mut self) -> Vec<Pair> {
        self.take(|time, _| time <= 0.0)
    }

    /// Takes the first event: its time, s from the start of the drift, and its pairs in order
    /// of time. These are the pairs that touch within `window` seconds after it, and those that
    /// touch later in the drift but are `close` at that time.
    pub(crate) fn take_first(
        &mut self,
        window: f64,
        close: impl Fn(f64, Pair) -> bool,
    ) -> Option<(f64, Vec<Pair>)> {
        let times = self.states.iter().filter_map(|(_, touch)| match touch {
            TouchState::At(time, _) => Some(*time),
            _ => None,
        });
        let first = times.min_by(f64::total_cmp)?;
        let due = self.take(|time, pair| time <= first + window || close(first, pair));
        Some((first, due))
    }

    /// Takes the pairs for which `due` holds at their time of touch, in order of time. They are
    /// one event.
    fn take(&mut self, due: impl Fn(f64, Pair) -> bool) -> Vec<Pair> {
        let mut taken = Vec::new();
        for (_, touch) in &mut self.states {
            if let TouchState::At(time, pair) = *touch
                && due(time, pair)
            {
                taken.push((time, pair));
                *touch = TouchState::Due;
            }
        }
        taken.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        taken.into_iter().map(|(_, pair)| pair).collect()
    }

    /// Examines pairs again after an `event` has changed the velocities of the island. Pairs
    /// whose nodes kept their velocity keep their time of touch. Pairs that were due are
    /// examined if any contact has begun, since that may be the contact of another pair.
    pub(crate) fn update(
        &mut self,
        island: &mut Island<D>,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        event: &Event<D>,
        rule: ClosureRule,
    ) {
        let again = |own: &[u32], old: TouchState, pair: Pair| match old {
            TouchState::Closed => false,
            TouchState::Due => event.has_begun,
            TouchState::Refused => true,
            TouchState::Never | TouchState::At(..) => {
                let main = context.surface.main_nodes(pair.main).iter();
                let mut nodes = main.chain(context.surface.target_nodes(pair.target));
                nodes.any(|node| match own.binary_search(node) {
                    Ok(number) => motion.velocity[*node as usize] != event.before[number],
                    Err(_) => false,
                })
            }
        };
        self.examine(island, context, motion, rule, event.now, again);
    }

    /// Examines the pairs that `again` selects from the nodes of the island, the state and the
    /// pair. Drops those that cannot touch.
    fn examine(
        &mut self,
        island: &mut Island<D>,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        rule: ClosureRule,
        now: DriftProgress,
        again: impl Fn(&[u32], TouchState, Pair) -> bool,
    ) {
        let Island {
            separation_bounds: near,
            contact_points: contact,
            nodes,
            ..
        } = island;
        near.measure(nodes, motion);
        self.add_near(near, now.remaining());
        self.examined.clear();
        for (place, &(number, touch)) in self.states.iter().enumerate() {
            let pair = near.pair(number);
            if again(nodes, touch, pair) {
                self.examined.push((place, pair));
            }
        }
        let at = motion.positions();
        let cache = match at.cache() {
            Some(_) => None,
            None => context.surface.geometry_cache(self.examined.len(), None),
        };
        let motion = ConstantMotion {
            at: at.with(at.cache().or(cache.as_ref())),
            velocity: motion.velocity,
        };
        self.closed.clear();
        self.closed
            .extend(contact.iter().map(|contact| contact.pair));
        self.closed.sort_unstable();
        let pairs = &self.closed;
        let is_closed = |pair: &Pair| pairs.binary_search(pair).is_ok();
        let remaining = now.remaining();
        let (states, bounds) = (&self.states, &*near);
        let check = |&(place, pair): &(usize, Pair)| {
            let is_near = || bounds.is_near(states[place].0);
            if is_closed(&pair) {
                (QuickCheck::Closed, None)
            } else {
                let travel = bounds.relative_travel(states[place].0, remaining);
                quick_check(context, motion, pair, rule, [remaining, travel], is_near)
            }
        };
        let pairs = self.examined.par_iter().with_min_len(CONTACTS_PER_TASK);
        pairs.map(check).collect_into_vec(&mut self.quick_checks);
        // At rest the quick check settles most pairs, so the index is built only if needed.
        let more =
            |(check, _): &(QuickCheck, _)| matches!(check, QuickCheck::Now | QuickCheck::Within(_));
        if self.quick_checks.iter().any(more) {
            self.active_set.rebuild(contact, context.surface, motion);
        }
        let closed = ActiveSet {
            index: &self.active_set,
            contact_points: contact,
        };
        let touch = |(&(_, pair), &(check, _)): (&(usize, Pair), &(QuickCheck, _))| match check {
            QuickCheck::Closed => TouchState::Closed,
            QuickCheck::Never => TouchState::Never,
            QuickCheck::Now => touch_at(closed, context, motion, pair, 0.0, now),
            QuickCheck::Within(span) => touch(closed, context, motion, pair, span, now),
        };
        let pairs = self
            .examined
            .par_iter()
            .zip(&self.quick_checks)
            .with_min_len(CONTACTS_PER_TASK);
        pairs.map(touch).collect_into_vec(&mut self.full_checks);
        let checks = self.quick_checks.iter().zip(&self.full_checks);
        for (&(place, _), (&(_, apart), &touch)) in self.examined.iter().zip(checks) {
            let (number, of_pair) = &mut self.states[place];
            *of_pair = touch;
            if let Some(apart) = apart {
                near.set_bound(*number, apart);
            }
        }
        self.states.retain(|(_, touch)| *touch != TouchState::Never);
    }

    /// Adds the pairs that may touch within `duration` seconds and are not listed yet.
    fn add_near(&mut self, near: &mut SeparationBounds, duration: f64) {
        std::mem::swap(&mut self.states, &mut self.before);
        self.states.clear();
        let mut known = self.before.iter().copied().peekable();
        for number in near.may_touch(duration) {
            while let Some(before) = known.next_if(|(of, _)| *of < number) {
                self.states.push(before);
            }
            let old = known.next_if(|(of, _)| *of == number);
            self.states.push(old.unwrap_or((number, TouchState::Never)));
        }
        self.states.extend(known);
    }
}

/// Returns the time of touch of a pair within `span` seconds from now.
fn touch<const D: usize>(
    closed: ActiveSet<D>,
    context: &ContactContext<D>,
    motion: ConstantMotion<D>,
    pair: Pair,
    span: f64,
    now: DriftProgress,
) -> TouchState {
    let surface = context.surface;
    let Some(wait) = surface.time_of_impact(pair, motion, span, context.resolution) else {
        return TouchState::Never;
    };
    let wait = instant_of_touch(surface, pair, motion, wait, span);
    touch_at(closed, context, motion, pair, wait, now)
}

/// Returns the state of a pair that touches in `wait` seconds, with the closed contacts of its
/// blocks taken into account.
fn touch_at<const D: usize>(
    closed: ActiveSet<D>,
    context: &ContactContext<D>,
    motion: ConstantMotion<D>,
    pair: Pair,
    wait: f64,
    now: DriftProgress,
) -> TouchState {
    let (at, remaining) = (motion.at, now.remaining());
    let beside = closed
        .index
        .nearby(closed.contact_points, context, motion, pair, remaining);
    let drift_interval = DriftInterval::in_drift(at, motion.velocity, [wait, remaining]);
    // One whole drift later. At the end of this drift, a touch in its last instant would leave
    // the choice between faces to round-off.
    let later = at.after(motion.velocity, wait + now.duration);
    match owning_pair(context, beside, pair, drift_interval, later) {
        Some(owner) => TouchState::At(now.elapsed + wait, owner),
        None => TouchState::Refused,
    }
}

/// Returns the pair to which a touch of `pair` belongs. Returns `None` if the closed contacts
/// `beside` it already stand for that pair.
fn owning_pair<'a, const D: usize>(
    context: &ContactContext<D>,
    beside: impl Iterator<Item = &'a ContactPoint<D>> + Clone,
    pair: Pair,
    drift_interval: DriftInterval<D>,
    later: Configuration<D>,
) -> Option<Pair> {
    let (surface, resolution, then) =
        (context.surface, context.resolution, drift_interval.at_touch);
    let point = surface.point(pair, then);
    let is_here = |contact: &ContactPoint<D>| {
        norm(&sub(&surface.point(contact.pair, then), &point)) <= resolution
    };
    // Contacts at the same point come first: this test costs less.
    let mut gap = None;
    let excludes = |contact: &ContactPoint<D>| {
        contact.is_duplicate_of(context, pair, drift_interval)
            || is_here(contact) && {
                let held = surface.project(contact.pair, later);
                let gap = gap.get_or_insert_with(|| surface.gap_or_zero(pair, later));
                held.outside <= resolution
                    && held.gap >= *gap
                    && !surface.is_reentrant_pair(contact.pair, pair, then)
                    && !contact.leaves_uncovered(context, pair, drift_interval)
            }
    };
    if beside.clone().any(excludes) {
        return None;
    }
    let best = select_feature_pair(surface, pair, [then, later], resolution, |_| true);
    let is_duplicate = |contact: &ContactPoint<D>| {
        best.is_some_and(|best| contact.is_duplicate_of(context, best, drift_interval))
    };
    if best.is_some() && !beside.clone().any(is_duplicate) {
        return best;
    }
    // The touch belongs to a closed contact, or passes it, unless that lets the pair penetrate.
    let held: SmallVec<[&ContactPoint<D>; 8]> = beside
        .filter(|contact| is_here(contact) || is_duplicate(contact))
        .collect();
    let is_left = |pair| {
        held.iter()
            .all(|contact| contact.leaves_uncovered(context, pair, drift_interval))
    };
    if held.is_empty() {
        return None;
    }
    select_feature_pair(surface, pair, [then, later], resolution, is_left)
}
