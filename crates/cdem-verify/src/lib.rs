//! Verification: scenes with exact answers under `verification/` at the top of the repository,
//! problems with a page in the book each, and tools for the tests that check a run.

mod balance;
mod columns;
pub mod fit;
mod halving;
pub mod machine;
mod overlap;
pub mod page;
mod pieces;
pub mod plot;
pub mod problem;
pub mod problems;
mod random;
pub mod readers;
pub mod reference;
mod rocks;
pub mod timing;

use std::path::{Path, PathBuf};

use cdem::mesh::{RawMesh, assemble};
use cdem::output::{FieldValues, Frame};
use cdem::scene::{Geometry, Scene};
use cdem::{AnyMesh, Simulation};

pub use balance::Balance;
pub use columns::columns;
pub use overlap::deepest_overlap;
pub use pieces::{Body, mesh_of, stones_of};
pub use random::Random;
pub use rocks::{SEED, box_around, rocks, rocks_of, tetrahedra};

/// A verification scene. Tests vary it, then start it.
#[derive(Clone, Debug)]
pub struct Case {
    /// The scene as read; tests change it.
    pub scene: Scene,
    directory: PathBuf,
}

/// Reads `verification/<name>/scene.toml`.
///
/// # Panics
/// With the message that a user would get, if the scene is wrong.
#[must_use]
pub fn load(name: &str) -> Case {
    read(&Path::new("verification").join(name))
}

/// Reads `examples/<name>/scene.toml`.
///
/// # Panics
/// With the message that a user would get, if the scene is wrong.
#[must_use]
pub fn example(name: &str) -> Case {
    read(&Path::new("examples").join(name))
}

/// Reads the scene in a folder of the repository.
fn read(folder: &Path) -> Case {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(folder);
    match cdem_io::scene::read(&directory.join("scene.toml")) {
        Ok(file) => Case {
            scene: file.scene,
            directory,
        },
        Err(error) => panic!("{}", error.render(false)),
    }
}

impl Case {
    /// Creates the run of the scene at t = 0.
    ///
    /// # Panics
    /// With the message that a user would get, if scene and mesh do not fit.
    #[must_use]
    pub fn start(&self) -> Simulation {
        self.start_from(|mesh| mesh)
    }

    /// Creates the run of the scene at t = 0. `change` is applied to each mesh file after it is
    /// read and before it is cut into blocks, for example to refine it.
    ///
    /// # Panics
    /// With the message that a user would get, if scene and mesh do not fit.
    #[must_use]
    pub fn start_from(&self, change: impl Fn(RawMesh) -> RawMesh) -> Simulation {
        let mut read = |path: &Path| cdem_io::gmsh::read(&self.directory.join(path)).map(&change);
        let mesh = if self.scene.dimension == 2 {
            assemble(&self.scene, &mut read).map(AnyMesh::Plane)
        } else {
            assemble(&self.scene, &mut read).map(AnyMesh::Solid)
        };
        let mesh = mesh.unwrap_or_else(|error| panic!("{error}"));
        Simulation::new(&self.scene, mesh).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Returns the block called `name`.
    ///
    /// # Panics
    /// If the scene has no such block.
    pub fn block(&mut self, name: &str) -> &mut cdem::scene::Block {
        let mut blocks = self.scene.block.iter_mut();
        let found = blocks.find(|block| block.name == name);
        found.unwrap_or_else(|| panic!("no block \"{name}\""))
    }

    /// Changes the divisions and the element of a block that is a box.
    ///
    /// # Panics
    /// If the block is not a box.
    pub fn divide(&mut self, block: &str, into: &[usize], shape: cdem::mesh::ElementKind) {
        match &mut self.block(block).geometry {
            Geometry::Box {
                divisions, element, ..
            } => {
                *divisions = into.to_vec();
                *element = shape;
            }
            other => panic!("\"{block}\" is no box: {other:?}"),
        }
    }
}

/// Returns the stresses of the elements of a frame, six components each, Pa.
///
/// # Panics
/// If the scene does not write stress.
fn stress_of(frame: &Frame) -> &[f64] {
    let mut fields = frame.cell_fields.iter();
    let field = fields.find(|field| field.name == "stress");
    let Some(FieldValues::Real(stress)) = field.map(|field| &field.values) else {
        panic!("a frame has stress");
    };
    stress
}

/// Steps to the end on the threads of the pool. Calls `look` after each coarse step.
///
/// # Panics
/// If a step fails.
pub fn run(simulation: &mut Simulation, mut look: impl FnMut(&mut Simulation) + Send) {
    rayon::scope(|_| {
        while !simulation.finished() {
            if let Err(error) = simulation.step() {
                panic!("{error}");
            }
            look(simulation);
        }
    });
}
