//! Forecast of the time of a run: its first steps, and the work that may come later.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

use cdem::scene::Schedule;
use cdem::{CollisionOverview, Overview, Simulation};
use cdem_io::setup::Built;
use indicatif::HumanDuration;

use crate::quantity::counted;

/// Wall-clock time of the sample of first steps, and the longest that a step under way and the next
/// ones may make of it.
const SAMPLE: Duration = Duration::from_secs(3);
const LONGEST_SAMPLE: Duration = Duration::from_secs(6);

/// Least number of steps whose mean stands for the steps to come.
const LEAST_STEPS: u32 = 3;

/// Ratio of the longest to the shortest forecast above which both are told.
const SPREAD: f64 = 2.0;

/// Number of blocks of the reference heap.
const HEAP_BLOCKS: usize = 6;

/// Wall-clock time after which a reference scene is not timed further.
const REFERENCE_SAMPLE: Duration = Duration::from_millis(500);

/// Time of an update of a refined block, with its contacts and changes of mesh, over the time of an
/// update of a free body: measured in the examples.
const REFINED_UPDATE: f64 = 4.0;

/// Returns the expected time of a run as text, from its first steps and from `collision`, the
/// predicted cost of a collision.
pub(crate) fn expected_time(
    overview: &Overview,
    simulation: &mut Simulation,
    collision: Option<&CollisionOverview>,
) -> String {
    let sample = match Sample::of(simulation) {
        Ok(sample) => sample,
        Err(stop) => return format!("unknown: the run stops itself: {stop}"),
    };
    if sample.seconds.is_empty() {
        return "none: the run is over before its first step".to_owned();
    }
    let from = format!(
        "from {} on {}",
        counted(sample.seconds.len() as u64, "step"),
        counted(rayon::current_num_threads() as u64, "thread")
    );
    if simulation.finished() {
        let whole: f64 = sample.seconds.iter().sum();
        return format!("{} without output, {from}: all of the run", about(whole));
    }
    let steps = overview.step_count as f64;
    let [low, high] = sample.range();
    let growth = Growth::after(high - low, overview, simulation, collision);
    let [low, high] = [steps * low, steps * (high + growth.seconds())];
    let beyond = beyond(overview, collision);
    if high <= SPREAD * low {
        return format!("{} without output, {from}{beyond}", about(high));
    }
    let [low, high] = [low, high].map(duration);
    let why = growth.why();
    format!("{low} to {high} without output, {from}: {why}{beyond}")
}

/// Tells of the time that no sample foretells: where many blocks meet with their faces on two scales,
/// the run of a heap of 36 polygons took 9.5 times the longer forecast.
fn beyond(overview: &Overview, collision: Option<&CollisionOverview>) -> &'static str {
    let moving = overview.blocks.iter().filter(|block| !block.fixed).count();
    if collision.is_some() && moving > 2 {
        "; ten times as long if many blocks meet with their faces, which two scales refine"
    } else {
        ""
    }
}

/// Durations of the first steps of a run.
struct Sample {
    /// Seconds of each step.
    seconds: Vec<f64>,
}

impl Sample {
    /// Times the first steps. Returns the reason if the run stops itself.
    fn of(simulation: &mut Simulation) -> Result<Self, String> {
        let began = Instant::now();
        let mut sample = Self {
            seconds: Vec::new(),
        };
        while !simulation.finished() && !sample.is_enough(began.elapsed()) {
            let step = Instant::now();
            simulation.step().map_err(|stop| stop.to_string())?;
            sample.seconds.push(step.elapsed().as_secs_f64());
        }
        Ok(sample)
    }

    /// True if the sample is long enough after `elapsed`: a touch makes a single step long.
    fn is_enough(&self, elapsed: Duration) -> bool {
        let stands_for_the_rest = || {
            let quarter = 0.25 * self.seconds.iter().sum::<f64>();
            within(quarter, self.seconds.iter().rev()).1 >= LEAST_STEPS
        };
        elapsed >= LONGEST_SAMPLE || (elapsed >= SAMPLE && stands_for_the_rest())
    }

    /// Returns the mean durations of a step, s, in the first and in the last quarter of the
    /// sample's time, the shorter one first.
    fn range(&self) -> [f64; 2] {
        // The first step fills caches.
        let seconds = match self.seconds.len() {
            0..=2 => &self.seconds[..],
            _ => &self.seconds[1..],
        };
        let quarter = 0.25 * seconds.iter().sum::<f64>();
        let mean = |(spent, count): (f64, u32)| spent / f64::from(count.max(1));
        let first = mean(within(quarter, seconds.iter()));
        let last = mean(within(quarter, seconds.iter().rev()));
        [first.min(last), first.max(last)]
    }
}

/// Returns the sum of the first of these durations that last for `time`, s, and their number; of
/// one at least.
fn within<'a>(time: f64, seconds: impl Iterator<Item = &'a f64>) -> (f64, u32) {
    let (mut spent, mut count) = (0.0, 0);
    for step in seconds {
        if count > 0 && spent + step > time {
            break;
        }
        (spent, count) = (spent + step, count + 1);
    }
    (spent, count)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Work that may come to a step and that the sample does not contain, s.
enum Growth {
    /// None is known that is more than the steps of the sample differ by.
    Sampled,
    /// All blocks rest on each other; now they do not.
    Rest { seconds: f64, fly_now: bool },
    /// The two blocks of a collision are refined.
    Refined { seconds: f64 },
}

impl Growth {
    /// Returns the largest growth after the first steps, which differ by `spread` seconds.
    fn after(
        spread: f64,
        overview: &Overview,
        simulation: &Simulation,
        collision: Option<&CollisionOverview>,
    ) -> Self {
        let contacts = simulation.live_contacts().len();
        let resting = rest(overview, simulation, contacts);
        let refined = refinement(overview, simulation.scene().dimension, collision);
        if resting.max(refined) <= spread {
            Self::Sampled
        } else if resting > refined {
            Self::Rest {
                seconds: resting,
                fly_now: contacts == 0,
            }
        } else {
            Self::Refined { seconds: refined }
        }
    }

    fn seconds(&self) -> f64 {
        match self {
            Self::Sampled => 0.0,
            Self::Rest { seconds, .. } | Self::Refined { seconds } => *seconds,
        }
    }

    /// Says what the shorter and the longer time stand for.
    fn why(&self) -> &'static str {
        match self {
            Self::Sampled => "the first steps and the last of these differ by as much",
            Self::Rest { fly_now: true, .. } => {
                "the first while blocks fly, the second once all rest on each other"
            }
            Self::Rest { fly_now: false, .. } => {
                "the first with these contacts, the second once all blocks rest on each other"
            }
            Self::Refined { .. } => {
                "the first without refinement, the second while the two blocks of a collision \
                 have it"
            }
        }
    }
}

/// Returns the time that contacts add to a step once all blocks rest on each other, s; 0 without
/// gravity.
fn rest(overview: &Overview, simulation: &Simulation, contacts: usize) -> f64 {
    let moving = overview.blocks.iter().filter(|block| !block.fixed).count();
    let has_weight = match &simulation.scene().gravity {
        Schedule::Constant(gravity) => gravity.iter().any(|g| *g != 0.0),
        Schedule::Table(rows) => rows.iter().any(|(_, g)| g.iter().any(|g| *g != 0.0)),
    };
    if !has_weight || overview.blocks.len() < 2 || moving == 0 {
        return 0.0;
    }
    let Some(heap) = ReferenceHeap::timed(simulation.scene().dimension) else {
        return 0.0;
    };
    let resting = moving as f64 * heap.contacts;
    let missing = (resting - contacts as f64).max(0.0);
    missing * heap.seconds * finest_rate(overview)
}

/// Returns the number of finest substeps in a coarse step.
fn finest_rate(overview: &Overview) -> f64 {
    let finest = overview.levels.iter().rposition(|&count| count > 0);
    2_f64.powi(finest.unwrap_or(0) as i32)
}

/// Returns the time that the refined blocks of one collision add to a step, s.
fn refinement(overview: &Overview, dimension: usize, collision: Option<&CollisionOverview>) -> f64 {
    let Some(collision) = collision.filter(|_| overview.blocks.len() > 1) else {
        return 0.0;
    };
    let [refined, now] = collision.updates_per_step;
    let body = body(dimension);
    let update = Timed::scene(&body).map_or(0.0, |timed| timed.seconds / timed.updates);
    2.0 * REFINED_UPDATE * refined.saturating_sub(now) as f64 * update
}

/// A reference scene, timed on this machine.
struct Timed {
    /// Duration of a step, s.
    seconds: f64,
    /// Element updates in a step.
    updates: f64,
    /// Contact points.
    contacts: f64,
    /// Finest substeps in a step.
    rate: f64,
}

impl Timed {
    /// Times steps of a scene.
    fn scene(text: &str) -> Option<Self> {
        let file = cdem_io::scene::parse(text, Path::new("reference.toml")).ok()?;
        let built = cdem_io::setup::build(&file, &mut BTreeMap::new()).ok()?;
        let Built { mut simulation, .. } = built;
        let overview = simulation.overview();
        let began = Instant::now();
        let mut seconds = Vec::new();
        while began.elapsed() < REFERENCE_SAMPLE && !simulation.finished() {
            let step = Instant::now();
            simulation.step().ok()?;
            seconds.push(step.elapsed().as_secs_f64());
        }
        // The first solves have no impulses to start from.
        let later = &seconds[seconds.len() / 2..];
        Some(Self {
            seconds: mean(later),
            updates: overview.updates_per_step.max(1) as f64,
            contacts: simulation.live_contacts().len().max(1) as f64,
            rate: finest_rate(&overview),
        })
    }
}

/// Small heap of boxes at rest, timed on this machine.
struct ReferenceHeap {
    /// Contact points for each block.
    contacts: f64,
    /// Time of a contact point in a step, with its share of all other work, s.
    seconds: f64,
}

impl ReferenceHeap {
    /// Times the heap in `dimension` dimensions.
    fn timed(dimension: usize) -> Option<Self> {
        let timed = Timed::scene(&heap(dimension))?;
        Some(Self {
            contacts: timed.contacts / HEAP_BLOCKS as f64,
            seconds: timed.seconds / timed.contacts / timed.rate,
        })
    }
}

/// Returns the scene of a block of some thousand simplices.
fn body(dimension: usize) -> String {
    let (element, max, divisions) = match dimension {
        3 => ("tet4", "[1.0, 1.0, 1.0]", "[8, 8, 8]"),
        _ => ("tri3", "[1.0, 1.0]", "[40, 40]"),
    };
    let min = if dimension == 3 {
        "[0.0, 0.0, 0.0]"
    } else {
        "[0.0, 0.0]"
    };
    format!(
        "dimension = {dimension}\n[time]\nend = 0.01\n\
         [[material]]\nname = \"rock\"\nyoung_modulus = 1e9\npoisson_ratio = 0.2\n\
         density = 2700.0\n\
         [[block]]\nname = \"body\"\nmaterial = \"rock\"\nelement = \"{element}\"\n\
         shape = {{ box = {{ min = {min}, max = {max}, divisions = {divisions} }} }}\n"
    )
}

/// Returns the scene of three boxes, two on them and one on top.
fn heap(dimension: usize) -> String {
    let in_space = dimension == 3;
    let point = |x: f64, y: f64, z: f64| match in_space {
        true => format!("[{x}, {y}, {z}]"),
        false => format!("[{x}, {z}]"),
    };
    let (element, gravity) = match in_space {
        true => ("hex8", "[0.0, 0.0, -9.81]"),
        false => ("quad4", "[0.0, -9.81]"),
    };
    let divisions = if in_space { "[1, 1, 1]" } else { "[1, 1]" };
    let block = |name: &str, min: String, max: String, fixed: bool| {
        format!(
            "[[block]]\nname = \"{name}\"\nmaterial = \"rock\"\nelement = \"{element}\"\n\
             fixed = {fixed}\n\
             shape = {{ box = {{ min = {min}, max = {max}, divisions = {divisions} }} }}\n"
        )
    };
    let mut scene = format!(
        "dimension = {dimension}\ngravity = {gravity}\n[time]\nend = 0.01\n\
         [contact]\nmodel = \"unified-node\"\nfriction_angle = 30.0\n\
         [[material]]\nname = \"rock\"\nyoung_modulus = 1e9\npoisson_ratio = 0.2\n\
         density = 2700.0\n"
    );
    scene += &block("floor", point(-1.0, -1.0, -1.0), point(2.0, 2.0, 0.0), true);
    for (layer, count) in [3, 2, 1].into_iter().enumerate() {
        for number in 0..count {
            let x = 0.3 * f64::from(number) + 0.15 * layer as f64;
            let z = 0.2 * layer as f64;
            // Shifted layers have no edges in line.
            let y = 0.01 * layer as f64;
            let (min, max) = (point(x, y, z), point(x + 0.2, y + 0.2, z + 0.2));
            scene += &block(&format!("b{layer}{number}"), min, max, false);
        }
    }
    scene
}

/// Returns a number of seconds as text, rounded.
fn about(seconds: f64) -> String {
    match duration(seconds) {
        text if text.starts_with(|c: char| c.is_ascii_digit()) => format!("about {text}"),
        text => text,
    }
}

fn duration(seconds: f64) -> String {
    match Duration::try_from_secs_f64(seconds) {
        Ok(run) if run < Duration::from_secs(1) => "less than a second".to_owned(),
        Ok(run) => HumanDuration(run).to_string(),
        Err(_) => "too long for a number".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(seconds: &[f64]) -> Sample {
        Sample {
            seconds: seconds.to_vec(),
        }
    }

    #[test]
    fn both_ends_of_a_sample_are_told() {
        // The first step does not count.
        let steps = sample(&[9.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0]);
        assert_eq!(steps.range(), [1.0, 2.0]);
        assert_eq!(sample(&[9.0, 4.0, 1.0, 1.0, 1.0, 1.0]).range(), [1.0, 4.0]);
        assert_eq!(sample(&[3.0]).range(), [3.0, 3.0]);
        assert_eq!(sample(&[3.0, 1.0]).range(), [1.0, 3.0]);
    }

    #[test]
    fn the_reference_scenes_run() {
        for (dimension, contacts) in [(2, 2.0..4.0), (3, 3.0..9.0)] {
            let heap = ReferenceHeap::timed(dimension).expect("a heap that runs");
            assert!(contacts.contains(&heap.contacts), "{}", heap.contacts);
            assert!(heap.seconds > 0.0);
            let body = Timed::scene(&body(dimension)).expect("a body that runs");
            assert!(body.seconds > 0.0 && body.updates > 1000.0);
        }
    }
}
