//! Scene files: TOML text to [`Scene`] and back, errors with line and column.

mod error;
mod source;

use std::io;
use std::path::{Path, PathBuf};

use cdem::scene::{Problem, Scene, as_input, from_value};

pub use error::{SceneError, SceneProblem};
use error::{Source, line};

/// A scene with its text, so that later errors (a group that is missing in the mesh) can be shown
/// in the file.
#[derive(Clone, Debug)]
pub struct SceneFile {
    /// The checked scene, with defaults.
    pub scene: Scene,
    path: PathBuf,
    /// `None` for a scene made by a program.
    source: Option<Source>,
}

/// Reads and checks the scene file at `path`.
///
/// # Errors
/// [`SceneError::Unreadable`] if there is no such file or it is not text; [`SceneError::Invalid`]
/// if the scene has errors.
pub fn read(path: &Path) -> Result<SceneFile, SceneError> {
    let text = std::fs::read_to_string(path).map_err(|reason| {
        let inside = path.join("scene.toml");
        let reason = if inside.is_file() {
            let hint = format!("it is a folder; did you mean {}?", inside.display());
            io::Error::new(reason.kind(), hint)
        } else {
            reason
        };
        SceneError::Unreadable {
            path: path.to_owned(),
            reason,
        }
    })?;
    parse(&text, path)
}

/// Reads and checks the text of a scene that is, or could be, at `path`: messages name this file,
/// and mesh paths are relative to its folder.
///
/// # Errors
/// [`SceneError::Invalid`].
pub fn parse(text: &str, path: &Path) -> Result<SceneFile, SceneError> {
    let source = Source::new(&path.display().to_string(), text);
    let tree = source::read(text)
        .map_err(|(problem, span)| SceneError::Invalid(vec![source.at(problem, span)]))?;
    let checked = if tree.problems.is_empty() {
        from_value(tree.value)
    } else {
        Err(tree.problems)
    };
    let scene = checked.map_err(|problems| source.invalid(problems))?;
    Ok(SceneFile {
        scene,
        path: path.to_owned(),
        source: Some(source),
    })
}

/// Checks the scene of a program, a dictionary with the keys of a scene file. Mesh paths are
/// relative to `directory`.
///
/// # Errors
/// [`SceneError::Unwritten`].
pub fn check(value: serde_json::Value, directory: &Path) -> Result<SceneFile, SceneError> {
    Ok(SceneFile {
        scene: from_value(value).map_err(SceneError::Unwritten)?,
        path: directory.join("scene.toml"),
        source: None,
    })
}

/// Returns the scene as TOML, with every default filled in. Reading it gives the same scene, bit
/// for bit.
///
/// # Panics
/// Never: keys are words, values are numbers, texts and arrays of them.
#[must_use]
pub fn write(scene: &Scene) -> String {
    toml::to_string(&as_input(scene)).expect("a scene can be written as TOML")
}

impl SceneFile {
    /// Returns the path of the scene file; for a program's scene, a path where it could be.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the folder to which mesh paths are relative.
    #[must_use]
    pub fn directory(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Returns a line for a warning: file, line, column (if there is a file), problem, advice.
    #[must_use]
    pub fn warning(&self, noticed: &Problem) -> String {
        match &self.source {
            Some(source) => source.line(noticed),
            None => line(noticed),
        }
    }

    /// Returns the error that shows these problems in this file.
    #[must_use]
    pub fn error(&self, problems: Vec<Problem>) -> SceneError {
        match &self.source {
            Some(source) => source.invalid(problems),
            None => SceneError::Unwritten(problems),
        }
    }
}
