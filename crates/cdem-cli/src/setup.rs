//! Sets up a run from a scene file.

use std::collections::BTreeMap;
use std::path::Path;

use cdem_io::scene::SceneFile;
use cdem_io::setup::{self, Blame, Built};

use crate::failure::{Failure, Message};

/// Reads and checks a scene.
pub(crate) fn read(scene: &Path) -> Result<SceneFile, Failure> {
    cdem_io::scene::read(scene).map_err(Failure::wrong)
}

/// Reads the meshes of a scene and builds its model.
pub(crate) fn build(file: &SceneFile) -> Result<Built, Failure> {
    setup::build(file, &mut BTreeMap::new()).map_err(|error| match error.into_blame() {
        Blame::Scene(error) => Failure::wrong(error),
        Blame::None(problem) => Failure::wrong(Message::new(problem, "")),
    })
}
