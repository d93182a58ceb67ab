//! `cdem resume`: runs that were killed or interrupted, or whose files were damaged.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::Duration;

use crate::place::{FALL, Place, names, signal};

/// Bricks fall on each other, are refined and coarsened at impacts, and come to rest. Includes both
/// kinematics, damping, friction and joints.
const HEAP: &str = r#"
version = 1
dimension = 2
gravity = [0.0, -9.81]

[time]
end = 0.16

[[material]]
name = "brick"
young_modulus = "2 GPa"
poisson_ratio = 0.2
density = 1800.0
damping = { mass = 5.0, stiffness = "20 us" }

[[block]]
name = "ground"
shape = { box = { min = [-1.0, -0.5], max = [1.0, 0.0], divisions = [4, 1] } }
element = "quad4"
material = "brick"
fixed = true

[[block]]
name = "lower"
shape = { box = { min = [-0.3, 0.0], max = [0.3, 0.2], divisions = [2, 1] } }
element = "quad4"
material = "brick"

[[block]]
name = "upper"
shape = { box = { min = [-0.2, 0.22], max = [0.4, 0.42], divisions = [2, 1] } }
element = "tri3"
material = "brick"
kinematics = "incremental"
velocity = [0.1, -0.6]

[[block]]
name = "edge"
shape = { box = { min = [-0.1, -0.1], max = [0.1, 0.1], divisions = [1, 1] } }
element = "quad4"
material = "brick"
rotate = 30.0
translate = [0.0, 0.6]
velocity = [0.0, -1.0]

[contact]
model = "two-scale"
max_level = 3
friction_angle = 30.0
cohesion = 1e4
tensile_strength = 1e4

[output]
frames = 20
history = 200
blocks = 50
checkpoint = CHECKPOINT

[[probe]]
name = "top"
block = "upper"
point = [0.1, 0.42]
"#;

fn heap(checkpoint: &str) -> String {
    HEAP.replace("CHECKPOINT", checkpoint)
}

/// Returns all files of a run by name, except the file with timings and the scene.
fn results(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    for name in names(folder) {
        let path = folder.join(&name);
        if path.is_dir() {
            let within = results(&path).into_iter();
            files.extend(within.map(|(file, bytes)| (Path::new(&name).join(file), bytes)));
        } else if name != "summary.json" && name != "scene.toml" {
            files.insert(name.into(), fs::read(&path).expect("a file"));
        }
    }
    files
}

/// Asserts that the folders of two runs have the same contents.
fn assert_same(one: &Place, other: &Place) {
    let [one, other] = [one, other].map(|place| results(&place.path("scene-results")));
    let names = |files: &BTreeMap<PathBuf, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&one), names(&other));
    for (name, bytes) in &one {
        assert!(*bytes == other[name], "{} differs", name.display());
    }
}

/// Refinement zones and resting contacts: every file except the summary agrees to the last bit.
#[test]
fn files_are_the_same_on_any_number_of_threads() {
    let places = [1, 2, 7].map(|threads| {
        let place = Place::with_scene(&heap("0"));
        place
            .cdem(&format!("run scene.toml --threads {threads}"))
            .done();
        place
    });
    for place in &places[1..] {
        assert_same(&places[0], place);
        let scene = "scene-results/scene.toml";
        assert_eq!(places[0].read(scene), place.read(scene));
    }
}

fn begin(place: &Place, line: &str) -> Child {
    let mut command = place.command(line.split_whitespace());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().expect("the command runs")
}

/// Kills runs after random times until `kills` kills have hit one, and resumes each until it is
/// done. All must give the results of an undisturbed run. Returns the number of resumes.
fn kill(kills: usize, threads: &[u8]) -> usize {
    let whole = Place::with_scene(&heap("0"));
    let began = std::time::Instant::now();
    whole.cdem("run scene.toml --threads 1").done();
    let takes = began.elapsed();
    let mut random = fastrand::Rng::with_seed(7);
    let (mut killed, mut resumed) = (0, 0);
    while killed < kills {
        // Writes a checkpoint as soon as the last one is written.
        let place = Place::with_scene(&heap("1e-9"));
        let mut line = "run scene.toml".to_owned();
        loop {
            let threads = random.choice(threads).expect("some");
            let mut run = begin(&place, &format!("{line} --threads {threads}"));
            if killed < kills {
                std::thread::sleep(takes.mul_f64(random.f64()));
            }
            let over = killed == kills || run.try_wait().expect("a child").is_some();
            if !over {
                run.kill().expect("a child");
            }
            killed += usize::from(!over);
            let status = run.wait().expect("a child");
            match status.code() {
                Some(0) => break,
                // Before the first checkpoint was written.
                Some(2) => line = "run scene.toml --force".to_owned(),
                None => {
                    line = "resume scene-results".to_owned();
                    resumed += 1;
                }
                other => panic!("exit status {other:?}"),
            }
        }
        assert_same(&whole, &place);
        assert!(!place.path("scene-results/checkpoints").exists());
    }
    resumed
}

#[test]
fn killed_runs_come_to_the_same_end() {
    assert!(kill(6, &[1, 2]) > 2);
}

#[test]
#[ignore = "slow study: a hundred runs are killed"]
fn a_hundred_killed_runs_come_to_the_same_end() {
    assert!(kill(100, &[1, 2]) > 80);
}

/// Begins a run and waits until it has written two states.
fn begun(place: &Place) -> Child {
    let mut run = begin(place, "run scene.toml");
    let states = || {
        let folder = place.path("scene-results/checkpoints");
        folder.is_dir() && names(&folder).len() > 2
    };
    while !states() {
        assert!(run.try_wait().expect("a child").is_none(), "too short");
        std::thread::sleep(Duration::from_millis(2));
    }
    run
}

/// Runs until a checkpoint exists, and stops the run by a signal.
fn interrupted(scene: &str) -> Place {
    let place = Place::with_scene(scene);
    let run = begun(&place);
    signal("TERM", &run);
    let ended = run.wait_with_output().expect("a child");
    assert_eq!(ended.status.code(), Some(130));
    let told = String::from_utf8_lossy(&ended.stdout).into_owned();
    assert!(
        told.contains("resume    cdem resume scene-results"),
        "{told}"
    );
    place
}

#[test]
fn an_interrupted_run_goes_on() {
    let whole = Place::with_scene(&heap("60"));
    whole.cdem("run scene.toml").done();
    let place = interrupted(&heap("1e-9"));
    let kept = place.cdem("run scene.toml").told();
    assert!(
        kept.contains(
            "resume that run with `cdem resume` if it was interrupted, replace it with --force"
        ),
        "{kept}"
    );
    // Its tables list contacts in the order of their start, as those of any run.
    let told = place.cdem("resume scene-results --threads 1").done();
    assert!(told.stderr().contains("resuming at t ="), "{}", told.told());
    assert_same(&whole, &place);
    let again = place.cdem("resume scene-results").done();
    assert!(
        again.stdout().contains("is done: reached the end"),
        "{}",
        again.told()
    );
    assert_same(&whole, &place);
}

#[test]
fn a_moved_folder_goes_on_without_its_mesh_and_scene() {
    let whole = Place::with_scene(&heap("60"));
    whole.cdem("run scene.toml").done();
    let place = interrupted(&heap("1e-9"));
    fs::rename(place.path("scene-results"), place.path("moved")).expect("a folder");
    fs::remove_file(place.path("scene.toml")).expect("a file");
    fs::remove_file(place.path("moved/scene.toml")).expect("a file");
    place.cdem("resume moved").done();
    fs::rename(place.path("moved"), place.path("scene-results")).expect("a folder");
    assert_same(&whole, &place);
}

/// Returns the states of a run, the newest last.
fn states(place: &Place) -> Vec<PathBuf> {
    let folder = place.path("scene-results/checkpoints");
    let mut names = names(&folder);
    names.retain(|name| name.as_bytes()[0].is_ascii_digit());
    names.into_iter().map(|name| folder.join(name)).collect()
}

#[test]
fn a_damaged_checkpoint_leaves_the_one_before() {
    let whole = Place::with_scene(&heap("60"));
    whole.cdem("run scene.toml").done();
    let place = interrupted(&heap("1e-9"));
    let states = states(&place);
    assert_eq!(states.len(), 2);
    let mut bytes = fs::read(&states[1]).expect("a file");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&states[1], &bytes).expect("a file");
    let told = place.cdem("resume scene-results").done().stderr();
    assert!(told.contains("is damaged: its checksum is wrong"), "{told}");
    assert_same(&whole, &place);
}

#[test]
fn what_cannot_go_on_says_why_and_stays_as_it_is() {
    let place = interrupted(&heap("1e-9"));
    let before = results(&place.path("scene-results"));
    let mut told = String::new();
    let mut look = |what: &str| {
        let ended = place.cdem("resume scene-results");
        told += &format!("--- {what}\n{}\n", ended.told());
    };
    let states = states(&place);
    let kept: Vec<Vec<u8>> = states
        .iter()
        .map(|path| fs::read(path).expect("a file"))
        .collect();
    let write = |bytes: &dyn Fn(usize) -> Vec<u8>| {
        for (number, path) in states.iter().enumerate() {
            fs::write(path, bytes(number)).expect("a file");
        }
    };
    write(&|number| kept[number][..kept[number].len() / 2].to_vec());
    look("both cut short");
    write(&|_| b"something else".to_vec());
    look("both something else");
    write(&|number| {
        let rest = kept[number].iter().skip_while(|&&byte| byte != b'\n');
        [
            b"cdem checkpoint 99".as_slice(),
            &rest.copied().collect::<Vec<u8>>(),
        ]
        .concat()
    });
    look("both of another format");
    write(&|number| kept[number].clone());
    let history = place.read("scene-results/history.csv");
    place.write("scene-results/history.csv", &history[..300]);
    look("a table has been cut short");
    place.write(
        "scene-results/history.csv",
        &history.replacen("e0", "e1", 1),
    );
    look("a number in a table is another");
    place.write("scene-results/history.csv", &history);
    let log = "scene-results/checkpoints/contacts.csv";
    let contacts = place.read(log);
    place.write(log, &contacts.replacen("time", "tame", 1));
    look("a word in the list of contacts is another");
    place.write(log, &contacts);
    fs::remove_dir_all(place.path("scene-results/checkpoints")).expect("a folder");
    look("no checkpoints");
    let names = |line: &str| {
        states.iter().fold(line.to_owned(), |line, state| {
            let name = state
                .file_name()
                .expect("a name")
                .to_string_lossy()
                .into_owned();
            line.replace(&name, "STATE")
        })
    };
    let without_numbers = told
        .lines()
        .map(|line| match line.split_once(" bytes of ") {
            Some((start, end)) => {
                let start = start.trim_end_matches(|c: char| c.is_ascii_digit());
                format!("{}… bytes of {end}", names(start))
            }
            None => names(line),
        });
    insta::assert_snapshot!(without_numbers.collect::<Vec<_>>().join("\n"));
    let after = results(&place.path("scene-results"));
    for (name, bytes) in after {
        assert!(bytes == before[&name], "{} differs", name.display());
    }
}

#[test]
fn a_folder_that_goes_away_is_not_made_anew() {
    let place = Place::with_scene(&heap("1e-9"));
    let run = begun(&place);
    fs::rename(place.path("scene-results"), place.path("moved")).expect("a folder");
    let ended = run.wait_with_output().expect("a child");
    assert_eq!(ended.status.code(), Some(3));
    let told = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert!(told.contains("it was removed or moved"), "{told}");
    assert_eq!(place.names("."), ["moved", "scene.toml"], "{told}");
    place.cdem("resume moved").done();
}

#[test]
fn a_run_in_progress_is_left_alone() {
    let place = Place::with_scene(&heap("1e-9"));
    let mut run = begin(&place, "run scene.toml");
    while !place.path("scene-results/checkpoints/start.cdem").exists() {
        assert!(run.try_wait().expect("a child").is_none(), "too short");
    }
    let resumed = place.cdem("resume scene-results");
    let replaced = place.cdem("run scene.toml --force");
    assert_eq!(run.wait().expect("a child").code(), Some(0));
    for ended in [resumed, replaced] {
        assert_eq!(ended.status(), 2, "{}", ended.told());
        assert!(
            ended.stderr().contains("another run is writing"),
            "{}",
            ended.told()
        );
    }
}

#[test]
fn a_run_that_stopped_itself_says_so_again() {
    // Crushed completely; the last state is kept for inspection.
    let scene = FALL.replace("velocity = [0.0, -1.0]", "velocity = [0.0, -400.0]");
    let place = Place::with_scene(&scene);
    let stopped = place.cdem("run scene.toml");
    assert_eq!(stopped.status(), 3, "{}", stopped.told());
    assert_eq!(states(&place).len(), 1);
    let resumed = place.cdem("resume scene-results");
    assert_eq!(resumed.status(), 3, "{}", resumed.told());
    assert!(
        resumed.stderr().contains("stopped itself"),
        "{}",
        resumed.told()
    );
}

#[test]
fn no_checkpoint_is_written_where_none_is_wanted() {
    let place = Place::with_scene(&heap("0"));
    let mut run = begin(&place, "run scene.toml");
    while !place.path("scene-results/frames/00002.vtu").exists() {
        assert!(run.try_wait().expect("a child").is_none(), "too short");
    }
    signal("INT", &run);
    assert_eq!(run.wait().expect("a child").code(), Some(130));
    assert!(!place.path("scene-results/checkpoints").exists());
    let told = place.cdem("resume scene-results");
    assert_eq!(told.status(), 2, "{}", told.told());
    assert!(
        told.stderr().contains("has no checkpoint"),
        "{}",
        told.told()
    );
}

/// Asserts that all tables of a run have complete rows.
fn assert_whole_rows(place: &Place) {
    for table in ["history.csv", "blocks.csv", "probes.csv", "contacts.csv"] {
        let text = place.read(&format!("scene-results/{table}"));
        assert!(text.ends_with('\n'), "{table} ends in the middle of a row");
        let fields = |line: &str| line.split(',').count();
        let head = text.lines().next().map(fields);
        assert!(
            text.lines().all(|line| Some(fields(line)) == head),
            "{table}"
        );
    }
}

/// Files may not exceed a size, as on a full disk. At any point where this ends a run, the written
/// data stay intact, and the run can be resumed once there is room.
#[cfg(unix)]
#[test]
fn a_disk_that_fills_up_costs_nothing_but_time() {
    let whole = Place::with_scene(&heap("0"));
    whole.cdem("run scene.toml").done();
    let mut resumed = 0;
    // Blocks of 512 bytes; the longest table has some 200 of them.
    for blocks in [7, 61, 150] {
        let place = Place::with_scene(&heap("1e-9"));
        let ended = place.cdem_within(blocks, "run scene.toml");
        assert_eq!(ended.status(), 3, "{blocks}: {}", ended.told());
        assert!(
            ended.stderr().contains("cannot write"),
            "{blocks}: {}",
            ended.told()
        );
        assert_whole_rows(&place);
        let again = place.cdem("resume scene-results");
        match again.status() {
            0 => resumed += 1,
            // Before the first checkpoint was written.
            2 => drop(place.cdem("run scene.toml --force").done()),
            other => panic!("exit status {other}: {}", again.told()),
        }
        assert_same(&whole, &place);
    }
    assert!(resumed > 0, "{resumed}");
}

/// A whole file system that is full at random moments and then gets room.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "slow study: file systems of its own, for which it needs user namespaces"]
fn a_file_system_that_fills_up_costs_nothing_but_time() {
    const SCRIPT: &str = r#"
        mkdir full && mount -t tmpfs -o size=$1k none full || exit 99
        "$0" run scene.toml -o full/results
        ended=$?
        mount -o remount,size=64m full
        case $ended in
            0) ;;
            3) "$0" resume full/results || "$0" run scene.toml -o full/results --force ;;
            *) "$0" run scene.toml -o full/results ;;
        esac
        cp -r full/results scene-results
        exit $ended
    "#;
    let whole = Place::with_scene(&heap("0"));
    whole.cdem("run scene.toml").done();
    let mut random = fastrand::Rng::with_seed(3);
    let mut stopped = 0;
    for _ in 0..40 {
        let room = random.u32(8..900).to_string();
        let place = Place::with_scene(&heap("1e-9"));
        let command = place.command([""; 0]);
        let mut shell = std::process::Command::new("unshare");
        shell.args(["-rm", "sh", "-c", SCRIPT]);
        shell.arg(command.get_program()).arg(&room);
        let ended = shell.current_dir(place.path(".")).output();
        let ended = ended.expect("unshare runs");
        let told = String::from_utf8_lossy(&ended.stderr);
        let status = ended.status.code();
        assert!(matches!(status, Some(0 | 2 | 3)), "{room} KiB: {told}");
        stopped += u32::from(status == Some(3));
        assert_same(&whole, &place);
    }
    assert!(stopped > 20, "{stopped} of 40 runs were stopped");
}
