//! `cdem new`: scenes to start from.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use crate::failure::{Failure, Message, Outcome};
use crate::terminal::{print, strong};

/// A scene to start from, with all its files.
struct Template {
    name: &'static str,
    about: &'static str,
    /// Names and contents.
    files: &'static [(&'static str, &'static [u8])],
}

/// Includes the files of an example's folder.
macro_rules! files {
    ($folder:literal: $($file:literal),+) => {
        &[$((
            $file,
            include_bytes!(concat!("../../../examples/", $folder, "/", $file)).as_slice(),
        )),+]
    };
}

const TEMPLATES: [Template; 8] = [
    Template {
        name: "two-prisms-2d",
        about: "A triangular block hits another with its corner: the example of the paper",
        files: files!("two-prisms-2d": "README.md", "scene.toml", "prisms.geo", "prisms.msh"),
    },
    Template {
        name: "two-prisms-3d",
        about: "The same in 3-D: a prism hits another with its edge",
        files: files!("two-prisms-3d": "README.md", "scene.toml", "prisms.geo", "prisms.msh"),
    },
    Template {
        name: "crowd-2d",
        about: "Two groups of stones with coarse meshes collide and keep their energy",
        files: files!("crowd-2d": "README.md", "scene.toml", "stones.geo", "stones.msh"),
    },
    Template {
        name: "crowd-3d",
        about: "Four groups of rocks, one element each, collide in 3-D",
        files: files!("crowd-3d": "README.md", "scene.toml", "rocks.msh"),
    },
    Template {
        name: "bars-2d",
        about: "A bar hits the end of another bar and stops; compare with wave theory",
        files: files!("bars-2d": "README.md", "scene.toml"),
    },
    Template {
        name: "slope-2d",
        about: "A block slides down a slope with friction; compare with Coulomb",
        files: files!("slope-2d": "README.md", "scene.toml"),
    },
    Template {
        name: "wall-2d",
        about: "A boulder hits a dry-stone wall",
        files: files!("wall-2d": "README.md", "scene.toml"),
    },
    Template {
        name: "rockfall-3d",
        about: "Rocks of all shapes fall down a slope onto a dry-stone wall",
        files: files!("rockfall-3d": "README.md", "scene.toml", "rocks.msh", "slope.msh"),
    },
];

pub(crate) fn new(template: Option<&str>, folder: Option<PathBuf>) -> Result<Outcome, Failure> {
    let Some(name) = template else {
        list();
        return Ok(Outcome::Done);
    };
    let Some(template) = TEMPLATES.iter().find(|template| template.name == name) else {
        let names = TEMPLATES.map(|template| template.name);
        return Err(Failure::wrong(Message::new(
            format!("there is no template \"{name}\""),
            format!("choose one of: {}", names.join(", ")),
        )));
    };
    let folder = folder.unwrap_or_else(|| template.name.into());
    write(template, &folder)?;
    let scene = folder.join("scene.toml");
    print(format_args!("wrote {}; next:", folder.display()));
    print(format_args!("  cdem run {}", scene.display()));
    Ok(Outcome::Done)
}

fn list() {
    print("Templates of scenes; `cdem new TEMPLATE [DIR]` writes one:");
    print("");
    let width = TEMPLATES
        .iter()
        .map(|template| template.name.len())
        .max()
        .unwrap_or(0);
    for template in &TEMPLATES {
        let name = strong(&format!("{:width$}", template.name)).to_string();
        print(format_args!("  {name}   {}", template.about));
    }
}

/// Writes the files of a template; a folder that is not empty is left unchanged.
fn write(template: &Template, folder: &Path) -> Result<(), Failure> {
    let refused = |problem: String, help: &str| Err(Failure::wrong(Message::new(problem, help)));
    let is_free = match fs::read_dir(folder) {
        Ok(mut entries) => entries.next().is_none(),
        Err(error) => error.kind() == ErrorKind::NotFound,
    };
    if !is_free {
        return refused(
            format!("{} exists and is not an empty folder", folder.display()),
            "name a new folder: `cdem new TEMPLATE DIR`",
        );
    }
    let attempt = || {
        fs::create_dir_all(folder)?;
        template
            .files
            .iter()
            .try_for_each(|(name, contents)| fs::write(folder.join(name), contents))
    };
    attempt().or_else(|error| {
        refused(
            format!("cannot write to {}: {error}", folder.display()),
            "name a folder that you may write to",
        )
    })
}
