//! `cdem report`: the page, and its display in a browser.

use std::path::Path;

use serde_json::Value;

use crate::place::{FALL, Place};

/// Returns the report page of the run of a scene.
fn report(scene: &str) -> (Place, String) {
    let place = Place::with_scene(scene);
    place.cdem("run scene.toml").done();
    let told = place.cdem("report scene-results").done();
    assert!(told.stdout().contains("report.html"), "{}", told.stdout());
    let page = place.read("scene-results/report.html");
    (place, page)
}

/// Returns the data in the page.
fn data(page: &str) -> Value {
    let start = page.find("id=\"data\"").expect("an element with data");
    let start = start + page[start..].find('>').expect("it begins") + 1;
    let end = start + page[start..].find("</script>").expect("it ends");
    serde_json::from_str(&page[start..end]).expect("JSON")
}

fn length(list: &Value) -> usize {
    list.as_array().expect("a list").len()
}

#[test]
fn a_page_holds_what_the_results_hold() {
    let (place, page) = report(FALL);
    let data = data(&page);
    let rows = |table: &str| {
        let text = place.read(&format!("scene-results/{table}"));
        text.lines().count() - 1
    };
    assert_eq!(data["title"], "A fall");
    assert_eq!(length(&data["history"]["time"]), rows("history.csv"));
    assert_eq!(data["contacts"]["count"], rows("contacts.csv"));
    let names: Vec<&Value> = data["blocks"].as_array().expect("blocks").iter().collect();
    assert_eq!([&names[0]["name"], &names[1]["name"]], ["ground", "stone"]);
    assert_eq!([&names[0]["fixed"], &names[1]["fixed"]], [true, false]);
    // Only moving blocks have a speed to show.
    assert_eq!(length(&data["block_rows"]["blocks"]), 1);
    let motion = &data["motion"];
    assert_eq!(length(&motion["frames"]), 5);
    assert_eq!(length(&motion["topologies"]), 1);
    assert_eq!(motion["left_out"], 0);
    assert_eq!(motion["low"][1], -1.0);
    assert!(
        motion["impact"]
            .as_u64()
            .is_some_and(|frame| (1..4).contains(&frame))
    );
    assert_eq!(data["summary"]["status"], "done");
}

#[test]
fn a_page_needs_nothing_from_anywhere() {
    let (_, page) = report(FALL);
    for reference in ["src=", "href=\"http", "@import", "fetch(", "{{"] {
        assert!(!page.contains(reference), "{reference}");
    }
}

#[test]
fn names_are_names_in_a_page_whatever_they_say() {
    let title = "</script><script>document.title='taken'</script>&amp;";
    let (_, page) = report(&FALL.replace("A fall", title));
    assert_eq!(data(&page)["title"], title);
    assert_eq!(page.matches("<script>document").count(), 0);
}

#[test]
fn a_run_that_was_killed_has_a_page_too() {
    let (place, _) = report(FALL);
    std::fs::remove_file(place.path("scene-results/summary.json")).expect("a file");
    place.cdem("report scene-results").done();
    let page = place.read("scene-results/report.html");
    assert_eq!(data(&page)["summary"], Value::Null);
}

#[test]
fn what_is_no_run_has_no_page() {
    let place = Place::with_scene(FALL);
    insta::assert_snapshot!(place.cdem("report results").told());
    place.cdem("run scene.toml").done();
    place.write("scene-results/frames/00002.vtu", "<VTKFile>");
    insta::assert_snapshot!(place.cdem("report scene-results").told());
    assert!(!place.path("scene-results/report.html").exists());
}

/// Returns the DOM of a page in a headless browser after some seconds of its own time. Prints a
/// notice and returns `None` if there is no browser: `./test` sets `CDEM_BROWSER`.
fn browsed(page: &Path) -> Option<String> {
    let Some(browser) = std::env::var_os("CDEM_BROWSER") else {
        #[allow(clippy::print_stdout)] // the notice is for whoever runs the test
        {
            println!("left out: CDEM_BROWSER names no Chromium; ./test does where there is one");
        }
        return None;
    };
    let profile = tempfile::tempdir().expect("a folder");
    let mut command = std::process::Command::new(browser);
    command.args([
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--use-gl=angle",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--run-all-compositor-stages-before-draw",
        "--virtual-time-budget=8000",
        "--dump-dom",
    ]);
    command.arg(format!("--user-data-dir={}", profile.path().display()));
    command.arg(format!("file://{}#play", page.display()));
    let output = command.output().expect("the browser runs");
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Returns the value of a `data-` attribute of the page.
fn said(dom: &str, name: &str) -> String {
    let mark = format!("data-{name}=\"");
    let start = dom.find(&mark).map(|at| at + mark.len());
    let start = start.unwrap_or_else(|| panic!("no {mark}"));
    let end = start + dom[start..].find('"').expect("a quote");
    dom[start..end].to_owned()
}

#[test]
fn a_browser_draws_and_plays_a_page() {
    let solid = FALL
        .replace("dimension = 2", "dimension = 3")
        .replace("[0.0, -9.81]", "[0.0, 0.0, -9.81]")
        .replace(
            "[-1.0, -1.0], max = [2.0, 0.0], divisions = [3, 1]",
            "[-1, -1, -1], max = [2, 2, 0], divisions = [3, 3, 1]",
        )
        .replace(
            "[0.0, 0.001], max = [1.0, 0.501], divisions = [4, 2]",
            "[0, 0, 0.001], max = [1, 1, 0.501], divisions = [4, 4, 2]",
        )
        .replace("quad4", "hex8")
        .replace("[0.0, -1.0]", "[0.0, 0.0, -1.0]")
        .replace("point = [0.0, 0.0]", "point = [0.0, 0.0, 0.0]");
    for scene in [FALL, &solid] {
        let (place, _) = report(scene);
        let page = place.path("scene-results/report.html");
        let Some(dom) = browsed(&page.canonicalize().expect("a path")) else {
            return;
        };
        assert_eq!(said(&dom, "state"), "ready");
        assert_eq!(said(&dom, "errors"), "0");
        let drawn: u32 = said(&dom, "frames").parse().expect("a number");
        assert!(drawn > 5, "{drawn} frames drawn");
        let charts: u32 = said(&dom, "charts").parse().expect("a number");
        assert!(charts > 4, "{charts} charts");
    }
}
