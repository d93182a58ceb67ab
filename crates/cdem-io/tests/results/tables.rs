//! The tables and the summary.

use cdem::scene::Cadence;

use crate::fake::{Fake, Place, awkward, names, scene};

#[test]
fn a_run_writes_every_file_of_the_contract() {
    let place = Place::new();
    place.run(&scene(Cadence::Count(5), Cadence::Count(2)), false);
    assert_eq!(
        names(&place.results()),
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
    assert_eq!(
        names(&place.results().join("frames")),
        ["00000.vtu", "00001.vtu", "00002.vtu"]
    );
    assert_eq!(
        names(&place.results().join("contacts")),
        ["00000.vtp", "00001.vtp", "00002.vtp"]
    );
    assert!(place.read("scene.toml").starts_with("version = 1\n"));
}

#[test]
fn headers_are_those_of_the_contract() {
    let place = Place::new();
    drop(place.recorder(&scene(Cadence::Count(5), Cadence::Count(2)), false));
    for (file, header) in [
        (
            "history.csv",
            "step,time,kinetic_energy,strain_energy,external_work,gravity_work,impact_loss,\
             friction_loss,damping_loss,fracture_loss,remesh_loss,correction_loss,energy_residual,\
             momentum_x,momentum_y,momentum_z,angular_momentum_x,angular_momentum_y,\
             angular_momentum_z,impulse_x,impulse_y,impulse_z,contacts,refined_blocks,elements\n",
        ),
        (
            "blocks.csv",
            "time,block,mass,x,y,z,vx,vy,vz,wx,wy,wz,fx,fy,fz\n",
        ),
        (
            "contacts.csv",
            "main,target,type,time_on,time_off,x,y,z,peak_normal_force,normal_impulse,\
             shear_impulse,slip,level\n",
        ),
        ("probes.csv", "time,probe,x,y,z,ux,uy,uz,vx,vy,vz\n"),
    ] {
        assert_eq!(place.read(file), header, "{file}");
    }
}

#[test]
fn rows_come_at_their_times_with_all_digits() {
    let place = Place::new();
    place.run(&scene(Cadence::Count(4), Cadence::Count(1)), false);
    let history = place.read("history.csv");
    let columns = history.lines().next().expect("a header").split(',').count();
    let steps: Vec<usize> = history
        .lines()
        .skip(1)
        .map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            assert_eq!(fields.len(), columns);
            let step = fields[0].parse().expect("a whole number");
            let energy: f64 = fields[2].parse().expect("a number");
            assert_eq!(energy.to_bits(), awkward(step).to_bits());
            step
        })
        .collect();
    assert_eq!(steps, [0, 3, 5, 8, 10]);
    assert_eq!(place.read("blocks.csv").lines().count(), 1 + 2 * 5);
    assert_eq!(place.read("probes.csv").lines().count(), 1 + 5);
}

#[test]
fn a_run_that_ends_early_writes_its_last_rows_once() {
    let place = Place::new();
    let mut recorder = place.recorder(&scene(Cadence::Count(5), Cadence::Count(2)), false);
    let mut run = Fake::default();
    recorder.observe(&mut run).expect("written");
    run.step = 1;
    recorder.observe(&mut run).expect("written");
    recorder
        .finish(&mut run, &crate::fake::summary())
        .expect("written");
    assert_eq!(place.read("history.csv").lines().count(), 1 + 2);
    assert_eq!(names(&place.results().join("frames")).len(), 2);

    let place = Place::new();
    let mut recorder = place.recorder(&scene(Cadence::Count(5), Cadence::Count(2)), false);
    let mut run = Fake::default();
    recorder.observe(&mut run).expect("written");
    recorder
        .finish(&mut run, &crate::fake::summary())
        .expect("written");
    assert_eq!(place.read("history.csv").lines().count(), 1 + 1);
    assert_eq!(names(&place.results().join("frames")).len(), 1);
}

#[test]
fn contacts_end_up_in_order_of_time() {
    let place = Place::new();
    place.run(&scene(Cadence::Count(4), Cadence::Count(1)), false);
    let mut contacts =
        csv::Reader::from_path(place.results().join("contacts.csv")).expect("a table");
    let rows: Vec<csv::StringRecord> = contacts.records().map(|row| row.expect("a row")).collect();
    let first: Vec<&str> = rows.iter().map(|row| &row[0]).collect();
    assert_eq!(first, ["early", "resting", "late"]);
    assert_eq!(&rows[0][1], "the, \"other\"");
    assert_eq!(&rows[0][2], "vertex-edge");
    assert_eq!(rows[0][4].parse(), Ok(0.5));
    assert_eq!(&rows[1][4], "", "a contact that lasts has no end");
    assert_eq!(&rows[0][12], "5");
}

#[test]
fn a_killed_run_leaves_whole_rows_and_frames() {
    let place = Place::new();
    let mut recorder = place.recorder(&scene(Cadence::Count(10), Cadence::Count(10)), false);
    let mut run = Fake::default();
    for step in 0..4 {
        run.step = step;
        recorder.observe(&mut run).expect("written");
    }
    // Frames are written beside the steps.
    recorder.wait().expect("written");
    // As after a kill: no destructor runs.
    std::mem::forget(recorder);
    assert_eq!(place.read("history.csv").lines().count(), 1 + 4);
    assert!(place.read("history.csv").ends_with('\n'));
    assert_eq!(place.read("contacts.csv").lines().count(), 1 + 1);
    for (list, ending) in [("frames", "vtu"), ("contacts", "vtp")] {
        let text = place.read(&format!("{list}.pvd"));
        for frame in 0..4 {
            let file = format!("{list}/{frame:05}.{ending}");
            assert!(text.contains(&format!("file=\"{file}\"")), "{text}");
            assert!(place.results().join(file).exists());
        }
        assert!(text.ends_with("</Collection>\n</VTKFile>\n"));
    }
}

#[test]
fn the_summary_has_every_key_of_the_contract() {
    let place = Place::new();
    place.run(&scene(Cadence::Count(4), Cadence::Count(1)), false);
    let summary: serde_json::Value =
        serde_json::from_str(&place.read("summary.json")).expect("JSON");
    for key in "status reason version steps time step levels wall_seconds setup_seconds \
                element_updates updates_per_second threads contacts_begun max_penetration \
                energy_residual peak_memory_bytes"
        .split_whitespace()
    {
        assert!(summary.get(key).is_some(), "{key}");
    }
    assert_eq!(summary["status"], "stopped");
    assert_eq!(summary["levels"], serde_json::json!([1, 4]));
    assert!(
        summary["max_penetration"].is_null(),
        "NaN has no number in JSON"
    );
}
