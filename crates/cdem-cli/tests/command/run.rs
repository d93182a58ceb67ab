//! `cdem run` and `cdem check` on good scenes.

use std::process::Stdio;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::place::{FALL, Place, signal};

fn summary(place: &Place) -> Value {
    serde_json::from_str(&place.read("scene-results/summary.json")).expect("JSON")
}

/// Returns the numbers of a column.
fn column(table: &str, name: &str) -> Vec<f64> {
    let mut lines = table
        .lines()
        .map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().expect("a header");
    let place = header
        .iter()
        .position(|column| *column == name)
        .expect(name);
    lines
        .map(|line| line[place].parse().expect("a number"))
        .collect()
}

#[test]
fn a_run_writes_its_results() {
    let place = Place::with_scene(FALL);
    let told = place.cdem("run scene.toml").done();
    assert!(told.stdout().contains("ParaView"), "{}", told.stdout());
    assert!(told.stderr().is_empty(), "{}", told.stderr());
    assert_eq!(
        place.names("scene-results"),
        [
            "blocks.csv",
            "contacts",
            "contacts.csv",
            "contacts.pvd",
            "frames",
            "frames.pvd",
            "history.csv",
            "probes.csv",
            "scene.toml",
            "summary.json",
        ]
    );
    assert_eq!(place.names("scene-results/frames").len(), 5);

    let history = place.read("scene-results/history.csv");
    assert_eq!(column(&history, "time").len(), 11);
    let blocks = place.read("scene-results/blocks.csv");
    assert_eq!(column(&blocks, "mass").len(), 2 * 11);
    let contacts = place.read("scene-results/contacts.csv");
    let begun = column(&contacts, "time_on");
    assert!(!begun.is_empty(), "the stone falls on the ground");
    assert!(begun.is_sorted());

    let summary = summary(&place);
    assert_eq!(summary["status"], "done");
    assert_eq!(summary["contacts_begun"].as_u64(), Some(begun.len() as u64));
    assert_eq!(summary["time"], 0.02);
    assert!(summary["element_updates"].as_u64() > Some(0));
}

#[test]
fn the_last_row_is_at_the_end_to_the_bit() {
    // Step counts whose product with the step is not exactly the end.
    let misses = |count: &f64| count * (0.07 / count) != 0.07;
    let counts: Vec<f64> = (400..600).map(f64::from).filter(misses).take(2).collect();
    assert_eq!(counts.len(), 2);
    for count in counts {
        let step = format!("end = 0.07\nstep = {:?}", 0.07 / count);
        let scene = FALL.replace("end = \"20 ms\"", &step);
        let place = Place::with_scene(&scene);
        place.cdem("run scene.toml").done();
        for table in ["history.csv", "blocks.csv", "probes.csv"] {
            let last = column(&place.read(&format!("scene-results/{table}")), "time").pop();
            assert_eq!(last, Some(0.07), "{table}, {count} steps");
        }
    }
}

#[test]
fn the_scene_as_run_gives_the_same_results() {
    let place = Place::with_scene(FALL);
    place.cdem("run scene.toml").done();
    place.cdem("run scene-results/scene.toml -o again").done();
    for file in [
        "history.csv",
        "blocks.csv",
        "contacts.csv",
        "probes.csv",
        "scene.toml",
    ] {
        let [first, again] =
            ["scene-results", "again"].map(|run| place.read(&format!("{run}/{file}")));
        assert_eq!(first, again, "{file}");
    }
}

#[test]
fn the_scene_as_run_finds_its_meshes() {
    let place = Place::new();
    place.cdem("new two-prisms-2d").done();
    place
        .cdem("run two-prisms-2d/scene.toml -o results/deep/down")
        .done();
    place.cdem("check results/deep/down/scene.toml").done();
}

/// Frames are compressed in pieces beside the steps, also with one thread.
#[test]
fn large_frames_are_written_on_one_thread() {
    let scene = FALL.replace("divisions = [4, 2]", "divisions = [120, 60]");
    let place = Place::with_scene(&scene.replace("end = \"20 ms\"", "end = \"0.1 ms\""));
    place.cdem("run scene.toml --threads 1").done();
    assert_eq!(place.names("scene-results/frames").len(), 5);
}

#[test]
fn the_number_of_threads_is_told() {
    let place = Place::with_scene(FALL);
    place.cdem("run scene.toml --threads 3").done();
    assert_eq!(summary(&place)["threads"], 3);
}

#[test]
fn more_threads_than_processors_are_warned_of() {
    let place = Place::with_scene(FALL);
    let processors = std::thread::available_parallelism().expect("some").get();
    let call = format!("run scene.toml --threads {}", processors + 1);
    let told = place.cdem(&call).done().stderr();
    let warning = format!("warning: {} threads on {processors} ", processors + 1);
    assert!(told.contains(&warning), "{told}");
}

#[test]
fn a_profile_is_told_on_request() {
    // Includes contact from the start.
    let place =
        Place::with_scene(&FALL.replace("0.001], max = [1.0, 0.501]", "0.0], max = [1.0, 0.5]"));
    let told = place.cdem("run scene.toml --profile").done().stdout();
    for part in [
        "setup",
        "steps",
        "search for contacts",
        "forces of elements",
        "impulses of contacts",
        "output",
    ] {
        assert!(told.contains(part), "{told}");
    }
    let shares = |of_stage: bool| -> f64 {
        let rows = told
            .lines()
            .skip_while(|row| !row.contains("up to the last step"));
        let rows = rows.take_while(|row| !row.is_empty());
        let rows = rows.filter(|row| row.starts_with("    ") == of_stage);
        let share = |row: &str| {
            row.strip_suffix(" %")?
                .split_whitespace()
                .last()?
                .parse()
                .ok()
        };
        rows.map(|row| share(row).unwrap_or(0.0)).sum()
    };
    // Each row shows three digits, so each of a dozen rows is off by at most 0.05.
    assert!(
        (shares(false) - 200.0).abs() < 0.5,
        "all, and its parts: {told}"
    );
    let stepping = told
        .lines()
        .find(|row| row.trim_start().starts_with("steps"));
    let stepping = stepping.and_then(|row| row.split_whitespace().rev().nth(1));
    let stepping: f64 = stepping
        .and_then(|share| share.parse().ok())
        .expect("a share");
    assert!((shares(true) - stepping).abs() < 0.5, "{told}");
}

#[test]
fn a_check_sums_up_and_writes_nothing() {
    let place = Place::with_scene(FALL);
    let told = place.cdem("check scene.toml").done().stdout();
    for part in [
        "A fall",
        "stone",
        "1350 kg",
        "stable step",
        "levels",
        "memory",
        "time",
    ] {
        assert!(told.contains(part), "{part} is not in\n{told}");
    }
    assert_eq!(place.names("."), ["scene.toml"]);
}

#[test]
fn pipes_get_no_colours() {
    let place = Place::with_scene(FALL);
    let told = place.cdem("run scene.toml").done();
    assert!(!told.stdout().contains('\u{1b}'), "{}", told.stdout());
    let told = place.cdem("run scene.toml");
    assert!(!told.stderr().contains('\u{1b}'), "{}", told.stderr());
}

#[test]
fn a_run_that_stops_itself_leaves_whole_results_and_says_why() {
    // Too strong for an elastic block: it turns inside out.
    let scene = FALL.replace("[0.0, -1.0]", "[0.0, -2000.0]");
    let place = Place::with_scene(&scene);
    let ended = place.cdem("run scene.toml");
    assert_eq!(ended.status(), 3, "{}", ended.told());
    let summary = summary(&place);
    assert_eq!(summary["status"], "stopped");
    let reason = summary["reason"].as_str().expect("a reason");
    assert!(ended.stderr().contains(reason), "{}", ended.told());
    let history = place.read("scene-results/history.csv");
    let last = column(&history, "time").pop();
    assert_eq!(
        last,
        summary["time"].as_f64(),
        "the last row is that of the end"
    );
    assert_last_frame_is_of_the_end(&place);
}

#[cfg(unix)]
#[test]
fn a_disk_that_refuses_after_the_first_write_is_no_wrong_scene() {
    let place = Place::with_scene(FALL);
    let ended = place.cdem_within(0, "run scene.toml");
    assert_eq!(ended.status(), 3, "{}", ended.told());
    assert!(ended.stderr().contains("history.csv"), "{}", ended.told());
}

/// Builds a scene of a free block under a pressure on its left side.
fn pressed(pressure: &str) -> String {
    let at = FALL.find("[contact]").expect("a table");
    format!(
        "{}[[load]]\ngroup = \"stone.xmin\"\npressure = \"{pressure}\"\n\n{}",
        &FALL[..at],
        &FALL[at..]
    )
}

#[test]
fn no_row_holds_what_is_no_number() {
    // Far too strong: the block is torn to pieces in its first steps.
    for pressure in ["1e6 GPa", "1e290 GPa"] {
        let place = Place::with_scene(&pressed(pressure));
        let ended = place.cdem("run scene.toml");
        assert_eq!(ended.status(), 3, "{}", ended.told());
        let reason = summary(&place)["reason"].to_string();
        assert!(reason.contains("stone"), "{reason}");
        for table in ["history.csv", "blocks.csv", "probes.csv"] {
            let text = place.read(&format!("scene-results/{table}"));
            assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
        }
        assert_last_frame_is_of_the_end(&place);
        place.cdem("report scene-results").done();
    }
}

/// The last frame shows the end, even if it contains values that are not numbers.
fn assert_last_frame_is_of_the_end(place: &Place) {
    let end = summary(place)["time"].as_f64().expect("a time");
    let frames = place.read("scene-results/frames.pvd");
    let last = frames.rsplit("timestep=\"").next().expect("a frame");
    let last = last.split('"').next().expect("a time");
    assert_eq!(last.parse(), Ok(end), "{frames}");
    assert_eq!(
        frames.matches("<DataSet").count(),
        place.names("scene-results/frames").len()
    );
}

/// A cube, stuck at its base by friction, is pressed to a sheet whose volume is 0 up to round-off.
#[test]
fn an_impact_that_leaves_a_sheet_stops() {
    let scene = r#"
        version = 1
        dimension = 3
        gravity = [0.0, 0.0, -9.81]
        [time]
        end = 0.002
        [[material]]
        name = "rock"
        young_modulus = "1 GPa"
        poisson_ratio = 0.2
        density = 2500.0
        [[block]]
        name = "plate"
        shape = { box = { min = [-1, -1, -0.5], max = [2, 2, 0], divisions = [1, 1, 1] } }
        element = "hex8"
        material = "rock"
        fixed = true
        [[block]]
        name = "cube"
        velocity = [0, 0, -1e4]
        shape = { box = { min = [0, 0, 0.01], max = [1, 1, 1.01], divisions = [1, 1, 1] } }
        element = "hex8"
        material = "rock"
        [contact]
        model = "unified-node"
        friction_angle = 30
    "#;
    let ended = Place::with_scene(scene).cdem("run scene.toml");
    assert_eq!(ended.status(), 3, "{}", ended.told());
    assert!(
        ended.told().contains("is flat or inverted"),
        "{}",
        ended.told()
    );
}

#[test]
fn an_element_inside_out_is_the_reason_where_it_comes_first() {
    let place = Place::with_scene(&pressed("1e6 GPa"));
    let ended = place.cdem("run scene.toml").told();
    assert!(ended.contains("is flat or inverted"), "{ended}");
    let summary = summary(&place);
    let (time, step) = (summary["time"].as_f64(), summary["step"].as_f64());
    let steps = time.zip(step).map(|(time, step)| time / step);
    assert!(steps < Some(3.0), "it is found when it happens: {summary}");
}

#[test]
fn nodes_that_run_away_stop_a_run_before_elements_turn() {
    // In such short steps, speed grows before deformation.
    let scene = pressed("1e6 GPa").replace("end = \"20 ms\"", "end = 1e-6\nstep = 1e-7");
    let ended = Place::with_scene(&scene).cdem("run scene.toml");
    assert_eq!(ended.status(), 3, "{}", ended.told());
    assert!(
        ended.stderr().contains("relative to its block"),
        "{}",
        ended.told()
    );
}

#[test]
fn a_block_faster_than_its_waves_may_fly() {
    // Waves in it travel at about 600 m/s.
    let scene = FALL.replace("[0.0, -1.0]", "[0.0, 1e5]");
    Place::with_scene(&scene).cdem("run scene.toml").done();
}

#[test]
fn large_stretches_are_told_once_a_block() {
    // 0.15 of Young's modulus on one side, balanced by inertia alone.
    let place = Place::with_scene(&pressed("150 MPa"));
    let told = place.cdem("run scene.toml").stderr();
    assert_eq!(told.matches("principal stretch").count(), 1, "{told}");
    assert!(told.contains("warning: block \"stone\""), "{told}");
    let summary = summary(&place);
    assert_eq!(
        summary["warnings"].as_array().map(Vec::len),
        Some(1),
        "{summary}"
    );
}

#[test]
fn large_stretches_of_many_blocks_are_told_once() {
    let scene = pressed("150 MPa");
    let found = |mark: &str| scene.find(mark).expect("a table");
    let (first, after) = (found("[[block]]\nname = \"stone\""), found("[[load]]"));
    let second = scene[first..after]
        .replace("\"stone\"", "\"brick\"")
        .replace("0.001]", "5.001]")
        .replace("0.501]", "5.501]");
    let load = "[[load]]\ngroup = \"brick.xmin\"\npressure = \"150 MPa\"\n\n";
    let both = format!("{}{second}{load}{}", &scene[..after], &scene[after..]);
    let told = Place::with_scene(&both).cdem("run scene.toml").stderr();
    assert_eq!(told.matches("principal stretch").count(), 1, "{told}");
    let start = "warning: 2 blocks (\"stone\", \"brick\"): large principal stretches";
    assert!(told.contains(start), "{told}");
}

/// A block is pushed and brought to rest again: the net work is zero.
const CYCLE: &str = r#"
version = 1
dimension = 2

[time]
end = 0.5

[[material]]
name = "rock"
young_modulus = "1 GPa"
poisson_ratio = 0.0
density = 2000.0

[[block]]
name = "platen"
shape = { box = { min = [-1.0, 0.0], max = [0.0, 1.0], divisions = [4, 4] } }
element = "quad4"
material = "rock"

[[boundary]]
block = "platen"
velocity = { x = [[0.0, 0.0], [0.1, 1.0], [0.2, 1.0], [0.3, 0.0]], y = 0.0 }
"#;

#[test]
fn a_cycle_of_work_that_ends_with_none_balances() {
    let place = Place::with_scene(CYCLE);
    let told = place.cdem("run scene.toml").done().stdout();
    // ½ m v² of 2 t at 1 m/s went in and came out.
    assert!(told.contains("energy    1 kJ: "), "{told}");
    assert!(told.contains("work done 100 %"), "{told}");
}

/// The stone is thrown up at 1 m/s with 675 J. It flies for 0.2 s, longer than the time for which
/// the energy must stay low, and has less than 0.1 J for 2.5 ms.
const THROW: &str = "end = 0.15\nstop_when = { kinetic_energy_below = 0.1 }";

#[test]
fn a_throw_does_not_stop_at_its_highest_point() {
    let thrown = FALL.replace("[0.0, -1.0]", "[0.0, 1.0]");
    let place = Place::with_scene(&thrown.replace("end = \"20 ms\"", THROW));
    place.cdem("run scene.toml").done();
    assert_eq!(summary(&place)["reason"], "reached the end");
    let history = place.read("scene-results/history.csv");
    let velocity = column(&history, "momentum_y");
    assert!(
        velocity.last() < Some(&0.0),
        "it has passed its highest point"
    );
}

#[test]
fn a_fall_from_rest_does_not_stop_before_it_begins() {
    let dropped = FALL.replace("[0.0, -1.0]", "[0.0, 0.0]");
    let stop = "end = 0.02\nstop_when = { kinetic_energy_below = 0.01 }";
    let place = Place::with_scene(&dropped.replace("end = \"20 ms\"", stop));
    place.cdem("run scene.toml").done();
    assert_eq!(summary(&place)["reason"], "reached the end");
}

#[test]
fn what_rests_stops_after_the_time_it_must_rest_for() {
    let resting = FALL
        .replace("[0.0, -1.0]", "[0.0, 0.0]")
        .replace(
            "[0.0, 0.001], max = [1.0, 0.501]",
            "[0.0, 0.0], max = [1.0, 0.5]",
        )
        .replace("2700.0", "2700.0\ndamping = { local = 0.8 }");
    let stop = "end = 1.0\nstop_when = { kinetic_energy_below = 1e-6, during = \"10 ms\" }";
    let place = Place::with_scene(&resting.replace("end = \"20 ms\"", stop));
    place.cdem("run scene.toml").done();
    let summary = summary(&place);
    let reason = summary["reason"].as_str().expect("a reason");
    assert!(
        reason.ends_with("below the threshold for 10 ms"),
        "{reason}"
    );
    let time = summary["time"].as_f64();
    assert!(
        time > Some(0.0101) && time < Some(0.5),
        "{time:?}: first it settles"
    );
}

#[test]
fn a_later_pair_changes_what_it_names_and_nothing_else() {
    let begun = |pairs: &str| {
        let place = Place::with_scene(&FALL.replace("[output]", &format!("{pairs}\n[output]")));
        place.cdem("run scene.toml").done();
        summary(&place)["contacts_begun"].as_u64()
    };
    let off = "[[contact.pair]]\nbetween = [\"stone\", \"ground\"]\nenabled = false\n";
    let rough = "[[contact.pair]]\nbetween = [\"stone\", \"ground\"]\nfriction_angle = 10.0\n";
    assert_eq!(begun(&format!("{off}{rough}")), Some(0));
    assert_eq!(begun(&format!("{rough}{off}")), Some(0));
    assert!(begun(&format!("{off}{rough}enabled = true\n")) > Some(0));
}

#[test]
fn springs_that_make_energy_are_told_of() {
    let stiff = "model = \"penalty\"\nnormal_stiffness = 3e10";
    let scene = FALL.replace("model = \"unified-node\"", stiff);
    let place = Place::with_scene(&scene);
    let ended = place.cdem("run scene.toml");
    assert_eq!(ended.status(), 0, "{}", ended.told());
    assert!(
        ended
            .stderr()
            .contains("the residual of the energy ledger is"),
        "{}",
        ended.told()
    );
}

#[test]
fn frames_always_tell_block_material_and_levels() {
    let scene = FALL.replace("frames = 4", "frames = 4\nfields = []");
    let place = Place::with_scene(&scene);
    place.cdem("run scene.toml").done();
    let frame = std::fs::read(place.path("scene-results/frames/00000.vtu")).expect("a frame");
    let text = String::from_utf8_lossy(&frame);
    for name in ["block", "material", "level", "refinement"] {
        assert!(text.contains(&format!("Name=\"{name}\"")), "{name}");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_whole_results() {
    for name in ["INT", "TERM"] {
        let place = Place::with_scene(&FALL.replace("20 ms", "1e4 s"));
        let mut run = place
            .command(["run", "scene.toml"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the command runs");
        let begun = || place.path("scene-results/contacts.pvd").exists();
        let started = Instant::now();
        while !begun() {
            assert!(
                started.elapsed() < Duration::from_secs(60),
                "the run does not begin"
            );
            std::thread::sleep(Duration::from_millis(10));
        }
        signal(name, &run);
        assert_eq!(run.wait().expect("it ends").code(), Some(130));
        let summary = summary(&place);
        assert_eq!(summary["status"], "interrupted");
        let history = place.read("scene-results/history.csv");
        assert_eq!(column(&history, "time").pop(), summary["time"].as_f64());
    }
}
