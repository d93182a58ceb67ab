//! Report of a run, one self-contained page: scene, summary, frames, charts.
//!
//! Numbers are read from the results, put into the page as JSON, and drawn by the page's scripts.
//! The page loads nothing else.

mod motion;
mod pack;
mod surface;
mod tables;

use std::path::{Path, PathBuf};

use cdem::scene::Scene;
use serde::Serialize;
use serde_json::Value;

use crate::results::{
    BLOCKS, CONTACTS, HISTORY, REPORT, ResultsError, SCENE, SUMMARY, frame_files, write_page,
};
use motion::Motion;
use tables::{Blocks, Columns, Contacts};

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = concat!(
    include_str!("decode.js"),
    include_str!("charts.js"),
    include_str!("camera.js"),
    include_str!("viewer.js"),
    include_str!("page.js"),
);

/// Data of the page.
#[derive(Serialize)]
struct Report {
    title: String,
    version: &'static str,
    dimension: usize,
    /// Contents of `summary.json`; `None` if the run was killed.
    summary: Option<Value>,
    /// The text of the scene.
    scene: String,
    blocks: Vec<Block>,
    history: Columns,
    block_rows: Blocks,
    contacts: Contacts,
    motion: Option<Motion>,
}

#[derive(Serialize)]
struct Block {
    name: String,
    material: String,
    fixed: bool,
    mass: f64,
}

/// Writes `report.html` to a results folder; returns its path.
///
/// # Errors
/// If the folder has no run, if a file in it cannot be read, or if the page cannot be written.
pub fn write(folder: &Path) -> Result<PathBuf, ResultsError> {
    let report = Report::read(folder)?;
    let path = folder.join(REPORT);
    write_page(&path, &report.page())?;
    Ok(path)
}

impl Report {
    fn read(folder: &Path) -> Result<Self, ResultsError> {
        let frames = frame_files(folder)?;
        let path = folder.join(SCENE);
        let text =
            std::fs::read_to_string(&path).map_err(|error| ResultsError::read(&path, error))?;
        let scene = crate::scene::parse(&text, &path);
        let scene = scene.map_err(|error| ResultsError::Scene {
            why: error.render(false),
        })?;
        let scene = scene.scene;
        let history = tables::history(&folder.join(HISTORY))?;
        let end = history.get("time").and_then(|time| time.last());
        let end = end.map_or(0.0, |&end| f64::from(end));
        let contacts = tables::contacts(&folder.join(CONTACTS), end)?;
        let block_rows = tables::blocks(&folder.join(BLOCKS))?;
        let summary = std::fs::read(folder.join(SUMMARY)).ok();
        Ok(Self {
            title: scene.title.clone(),
            version: env!("CARGO_PKG_VERSION"),
            dimension: scene.dimension,
            summary: summary.and_then(|text| serde_json::from_slice(&text).ok()),
            blocks: listed(&scene, &block_rows),
            motion: Motion::read(&frames, contacts.first)?,
            scene: text,
            history,
            block_rows,
            contacts,
        })
    }

    fn page(&self) -> String {
        let data = serde_json::to_string(self).expect("memory takes all that has a form");
        // The data must not close the element that contains it.
        let data = data.replace('<', "\\u003c");
        let title = if self.title.is_empty() {
            "A run of cdem"
        } else {
            &self.title
        };
        let title = title.replace('&', "&amp;").replace('<', "&lt;");
        let parts = [
            ("{{title}}", title.as_str()),
            ("{{style}}", STYLE),
            ("{{script}}", SCRIPT),
            ("{{data}}", &data),
        ];
        let mut page = String::with_capacity(PAGE.len() + SCRIPT.len() + data.len());
        let mut rest = PAGE;
        for (mark, text) in parts {
            let (before, after) = rest.split_once(mark).expect("the page has all its marks");
            page.push_str(before);
            page.push_str(text);
            rest = after;
        }
        page + rest
    }
}

/// Returns the blocks in the order of the results, with their data from the scene.
fn listed(scene: &Scene, rows: &Blocks) -> Vec<Block> {
    let block = |(name, mass): &(String, f64)| {
        // Parts of a split block are called i.1, i.2, …
        let is_of = |whole: &str| {
            let part = name.strip_prefix(whole);
            part.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        let own = scene.block.iter().find(|block| block.name == *name);
        let own = own.or_else(|| scene.block.iter().find(|block| is_of(&block.name)));
        Block {
            name: name.clone(),
            material: own.map(|block| block.material.clone()).unwrap_or_default(),
            fixed: own.is_some_and(|block| block.fixed),
            mass: *mass,
        }
    };
    rows.all.iter().map(block).collect()
}
