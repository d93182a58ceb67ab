//! Which open pairs of an island touch first, and when.

use rayon::prelude::*;
use smallvec::SmallVec;

use crate::contact::constraint::active_set::ActiveSetIndex;
use crate::contact::constraint::contact_point::{ContactPoint, DriftInterval};
use crate::contact::constraint::context::ContactContext;
use crate::contact::detection::separation_bounds::SeparationBounds;
use crate::contact::island::Island;
use crate::contact::narrow_phase::feature_selection::select_feature_pair;
use crate::contact::surface::kicked::KickedView;
use crate::contact::surface::{Configuration, GapAllowance, Pair, Surface};
use crate::contact::tolerances::{CONTACTS_PER_TASK, LEAST_DEPTH, SHALLOW};
use crate::math::vector::{norm, sub};

/// When the open pairs of an island touch in a drift.
#[derive(Debug, Default)]
pub(crate) struct TouchEvents<const D: usize> {
    /// Those that are not never, with their numbers among the pairs near, which
    /// rise.
    states: Vec<(usize, TouchState)>,
    /// Storage of a look: what there was before; places of the pairs looked at, and these; what
    /// glances tell, and looks; closed pairs, sorted, and by place.
    before: Vec<(usize, TouchState)>,
    anew: Vec<(usize, Pair)>,
    glances: Vec<(PairCheck, Option<f64>)>,
    looked: Vec<TouchState>,
    closed: Vec<Pair>,
    by_place: ActiveSetIndex<D>,
}

impl<const D: usize> Clone for TouchEvents<D> {
    /// An empty one: a kick looks at all pairs anew.
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// When a pair touches, s from the start of the drift.
#[derive(Clone, Copy, Debug, PartialEq)]
enum TouchState {
    Never,
    /// Then, and as a touch of that pair.
    At(f64, Pair),
    /// It would, but its surroundings do not let it as they move now.
    Refused,
    /// It did at an event, or another pair in its place, and is not closed for all that
    /// is known.
    Due,
    Closed,
}

/// When pairs that have touched already are to be closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ClosureRule {
    /// In a kick, before the drift: those that sink in at all.
    InKick,
    /// In the drift: those that cannot wait for the next kick.
    InDrift,
}

impl ClosureRule {
    /// Up to how deep a pair does not sink in, over the tolerance.
    fn depth(self) -> f64 {
        match self {
            Self::InKick => LEAST_DEPTH,
            Self::InDrift => SHALLOW,
        }
    }

    /// Gap, over the tolerance, above which a pair waits for the next kick that is too
    /// slow to come deep in the drift.
    fn waits_above(self) -> f64 {
        match self {
            Self::InKick => LEAST_DEPTH,
            Self::InDrift => -SHALLOW,
        }
    }
}

impl<const D: usize> TouchEvents<D> {
    /// Looks at all open pairs for a drift of `duration` seconds from now.
    pub(crate) fn begin(
        &mut self,
        island: &mut Island<D>,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        duration: f64,
    ) {
        self.states.clear();
        let interval = (ClosureRule::InKick, (0.0, duration));
        self.examine(island, context, motion, interval, |_, _, _| true);
    }

    /// The kick is over, in which contacts `parted`, or stood for pairs until they did, and
    /// pairs that touched were left open: what of them cannot wait for the next touches in
    /// the drift.
    pub(crate) fn reexamine(
        &mut self,
        island: &mut Island<D>,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        (duration, parted): (f64, bool),
    ) {
        let is_open = |touch: TouchState| match touch {
            TouchState::Due => true,
            TouchState::Closed | TouchState::Refused => parted,
            TouchState::Never | TouchState::At(..) => false,
        };
        if parted || self.states.iter().any(|(_, touch)| is_open(*touch)) {
            let again = |_: &[u32], old: TouchState, _: Pair| is_open(old);
            let interval = (ClosureRule::InDrift, (0.0, duration));
            self.examine(island, context, motion, interval, again);
        }
    }

    /// Pairs that touch in the rest of the drift, as far as is known.
    pub(crate) fn upcoming_count(&self) -> usize {
        let ahead = |(_, touch): &&(usize, TouchState)| matches!(touch, TouchState::At(..));
        self.states.iter().filter(ahead).count()
    }

    /// The pairs that touch already, as one.
    pub(crate) fn take_due_now(&mut self) -> Vec<Pair> {
        self.take(|time, _| time <= 0.0)
    }

    /// The first instant at which pairs touch, s from the start of the drift,
    /// and those that do within `window` seconds from then, in order of time;
    /// with them those that are `close` at that instant and touch in this drift.
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

    /// The pairs that touch at times that are `due`, in order of time: they are one event.
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

    /// After an event at `elapsed` that has changed the velocities `before` of
    /// the island: pairs of nodes that go on as they did touch as they would. Those
    /// that were due may not be what has closed, if any contact has begun.
    pub(crate) fn update(
        &mut self,
        island: &mut Island<D>,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        (before, has_begun): (&[[f64; D]], bool),
        (wanted, interval): (ClosureRule, (f64, f64)),
    ) {
        let again = |own: &[u32], old: TouchState, pair: Pair| match old {
            TouchState::Closed => false,
            TouchState::Due => has_begun,
            TouchState::Refused => true,
            TouchState::Never | TouchState::At(..) => {
                let main = context.surface.main_nodes(pair.main).iter();
                let mut nodes = main.chain(context.surface.target_nodes(pair.target));
                nodes.any(|node| match own.binary_search(node) {
                    Ok(number) => motion.velocity[*node as usize] != before[number],
                    Err(_) => false,
                })
            }
        };
        self.examine(island, context, motion, (wanted, interval), again);
    }

    /// Looks `again` at pairs, given the nodes of the island; leaves out those that
    /// cannot touch.
    fn examine(
        &mut self,
        island: &mut Island<D>,
        context: &ContactContext<D>,
        motion: &KickedView<D>,
        (wanted, (elapsed, duration)): (ClosureRule, (f64, f64)),
        again: impl Fn(&[u32], TouchState, Pair) -> bool,
    ) {
        let Island {
            separation_bounds: near,
            contact_points: contact,
            nodes,
            ..
        } = island;
        near.measure(nodes, motion);
        self.add_near(near, duration - elapsed);
        self.anew.clear();
        for (place, &(number, touch)) in self.states.iter().enumerate() {
            let pair = near.pair(number);
            if again(nodes, touch, pair) {
                self.anew.push((place, pair));
            }
        }
        let at = motion.positions();
        let cache = match at.cache() {
            Some(_) => None,
            None => context.surface.geometry_cache(self.anew.len(), None),
        };
        let at = at.with(at.cache().or(cache.as_ref()));
        self.closed.clear();
        self.closed
            .extend(contact.iter().map(|contact| contact.pair));
        self.closed.sort_unstable();
        let pairs = &self.closed;
        let is_closed = |pair: &Pair| pairs.binary_search(pair).is_ok();
        let remaining = duration - elapsed;
        let look = |&(_, pair): &(usize, Pair)| {
            if is_closed(&pair) {
                (PairCheck::Touch(TouchState::Closed), None)
            } else {
                check_pair(context, (motion, at), pair, (wanted, remaining))
            }
        };
        let pairs = self.anew.par_iter().with_min_len(CONTACTS_PER_TASK);
        pairs.map(look).collect_into_vec(&mut self.glances);
        // At rest most pairs are told at a glance.
        let more = |(look, _): &(PairCheck, _)| matches!(look, PairCheck::Within(_));
        if self.glances.iter().any(more) {
            self.by_place
                .rebuild(contact, context.surface, (motion, at));
        }
        let closed = (&self.by_place, &**contact);
        let touch = |(&(_, pair), &(look, _)): (&(usize, Pair), &(PairCheck, _))| match look {
            PairCheck::Touch(touch) => touch,
            PairCheck::Within(span) => {
                let interval = (span, elapsed, duration);
                touch(closed, context, (motion, at), pair, interval)
            }
        };
        let pairs = self
            .anew
            .par_iter()
            .zip(&self.glances)
            .with_min_len(CONTACTS_PER_TASK);
        pairs.map(touch).collect_into_vec(&mut self.looked);
        let told = self.glances.iter().zip(&self.looked);
        for (&(place, _), (&(_, apart), &touch)) in self.anew.iter().zip(told) {
            let (number, of_pair) = &mut self.states[place];
            *of_pair = touch;
            if let Some(apart) = apart {
                near.set_bound(*number, apart);
            }
        }
        self.states.retain(|(_, touch)| *touch != TouchState::Never);
    }

    /// Adds the pairs near that may touch within a duration, s, and of which nothing is known.
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

/// What a glance tells of an open pair.
#[derive(Clone, Copy, Debug)]
enum PairCheck {
    /// All.
    Touch(TouchState),
    /// That it may touch within so many seconds.
    Within(f64),
}

/// A glance at an open pair in what is `remaining` of a drift, s, at constant velocities, and
/// how far apart its features are now, m, or less, if that was asked.
fn check_pair<const D: usize>(
    context: &ContactContext<D>,
    (motion, at): (&KickedView<D>, Configuration<D>),
    pair: Pair,
    (wanted, remaining): (ClosureRule, f64),
) -> (PairCheck, Option<f64>) {
    let (surface, tolerance) = (context.surface, context.tolerance);
    let apart = surface.distance_lower_bound(pair, at);
    let way = remaining * fastest(surface, motion, pair);
    let end = at.after(motion.velocity, remaining);
    if apart > tolerance + way || !surface.may_touch_in_drift(pair, at, end) {
        return (PairCheck::Touch(TouchState::Never), Some(apart));
    }
    let is_slow = way <= SHALLOW * tolerance;
    let clear = if is_slow {
        wanted.waits_above() * tolerance
    } else {
        f64::INFINITY
    };
    let slack = GapAllowance {
        within: SHALLOW * tolerance,
        depth: wanted.depth() * tolerance,
        clear,
    };
    let look = if surface.stays_in_contact(pair, at, motion.velocity, remaining, slack) {
        PairCheck::Touch(TouchState::Never)
    } else {
        PairCheck::Within(if is_slow { 0.0 } else { remaining })
    };
    (look, Some(apart))
}

/// When a pair between the closed contacts of its blocks touches, within `span` seconds
/// after `elapsed`.
fn touch<const D: usize>(
    (closed, contact): (&ActiveSetIndex<D>, &[ContactPoint<D>]),
    context: &ContactContext<D>,
    (motion, at): (&KickedView<D>, Configuration<D>),
    pair: Pair,
    (span, elapsed, duration): (f64, f64, f64),
) -> TouchState {
    let (surface, tolerance) = (context.surface, context.tolerance);
    let remaining = duration - elapsed;
    let wait = surface.time_of_impact(pair, at, motion.velocity, span, tolerance);
    let Some(wait) = wait else {
        return TouchState::Never;
    };
    let beside = closed.nearby(contact, context, (motion, at), (pair, remaining));
    let drift_interval = DriftInterval::in_drift(at, motion.velocity, [wait, remaining]);
    // A whole drift on: by its end, a touch in the last instant of this one would
    // leave the choice between faces to round-off.
    let later = at.after(motion.velocity, wait + duration);
    match owning_pair(context, beside, pair, (drift_interval, later)) {
        Some(owner) => TouchState::At(elapsed + wait, owner),
        None => TouchState::Refused,
    }
}

/// The pair that a touch of `pair` belongs to, of those that closed contacts `beside` it
/// do not stand for, if any.
fn owning_pair<'a, const D: usize>(
    context: &ContactContext<D>,
    beside: impl Iterator<Item = &'a ContactPoint<D>> + Clone,
    pair: Pair,
    (drift_interval, later): (DriftInterval<D>, Configuration<D>),
) -> Option<Pair> {
    let (surface, tolerance, then) = (context.surface, context.tolerance, drift_interval.at_touch);
    let point = surface.point(pair, then);
    let is_here = |contact: &ContactPoint<D>| {
        norm(&sub(&surface.point(contact.pair, then), &point)) <= tolerance
    };
    // What is closed at the same place comes first: it costs less to ask.
    let mut gap = None;
    let bars = |contact: &ContactPoint<D>| {
        contact.is_duplicate_of(context, pair, drift_interval)
            || is_here(contact) && {
                let held = surface.project(contact.pair, later);
                let gap = gap.get_or_insert_with(|| surface.project(pair, later).gap);
                held.outside <= tolerance
                    && held.gap >= *gap
                    && !surface.is_reentrant_pair(contact.pair, pair, then)
                    && !contact.leaves_uncovered(context, pair, drift_interval)
            }
    };
    if beside.clone().any(bars) {
        return None;
    }
    let best = select_feature_pair(surface, pair, [then, later], tolerance, &|_| true);
    let says = |contact: &ContactPoint<D>| {
        best.is_some_and(|best| contact.is_duplicate_of(context, best, drift_interval))
    };
    if best.is_some() && !beside.clone().any(says) {
        return best;
    }
    // It belongs to what is closed, or goes past that, unless it is left to sink in.
    let held: SmallVec<[&ContactPoint<D>; 8]> = beside
        .filter(|contact| is_here(contact) || says(contact))
        .collect();
    let is_left = |pair| {
        held.iter()
            .all(|contact| contact.leaves_uncovered(context, pair, drift_interval))
    };
    if held.is_empty() {
        return None;
    }
    select_feature_pair(surface, pair, [then, later], tolerance, &is_left)
}

/// Most by which the nodes of the two features move against each other, m/s:
/// their velocities as seen from one of them.
fn fastest<const D: usize>(surface: &dyn Surface<D>, motion: &KickedView<D>, pair: Pair) -> f64 {
    let of = |node: &u32| &motion.velocity[*node as usize];
    let (main, target) = (
        surface.main_nodes(pair.main),
        surface.target_nodes(pair.target),
    );
    let seen = |nodes: &[u32]| {
        let speeds = nodes.iter().map(|node| norm(&sub(of(node), of(&main[0]))));
        speeds.fold(0.0, f64::max)
    };
    seen(main) + seen(target)
}
