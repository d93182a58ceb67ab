//! Queries of a run between two steps, and changes to it. Queries change nothing.

use std::ops::Range;

use crate::math::vector::{pad, scale, truncate};
use crate::mesh::ElementKind;
use crate::scene::{Field, LoadKind, Scene};
use crate::simulation::output::{BlockRow, FrameField};
use crate::simulation::typed_simulation::TypedSimulation;
use crate::simulation::{Simulation, each};

/// Ranges of a block in the arrays of points and cells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BlockRange {
    /// Name of the block.
    pub name: String,
    /// Range of its points.
    pub points: Range<usize>,
    /// Range of its cells.
    pub cells: Range<usize>,
}

impl Simulation {
    /// Returns the current positions of the points, m. With adaptivity there are more points while
    /// blocks collide.
    #[must_use]
    pub fn positions(&self) -> Vec<[f64; 3]> {
        each!(self, driven => {
            let run = &driven.run;
            let at = run.model.positions(&run.state);
            let points = 0..run.model.mesh.nodes.len() as u32;
            points.map(|point| pad(&at.at(point))).collect()
        })
    }

    /// Returns the kinds of the cells, and the points of all cells, one cell after the other.
    #[must_use]
    pub fn cells(&self) -> (Vec<ElementKind>, Vec<u32>) {
        each!(self, driven => {
            let elements = &driven.run.model.mesh.elements;
            let points = elements.iter().flat_map(|element| element.nodes());
            (elements.iter().map(|element| element.kind).collect(), points.copied().collect())
        })
    }

    /// Returns the current range of each block in the arrays of points and cells.
    #[must_use]
    pub fn block_ranges(&self) -> Vec<BlockRange> {
        each!(self, driven => {
            let model = &driven.run.model;
            let blocks = model.mesh.blocks.iter().enumerate();
            let range = |(number, block): (usize, &crate::mesh::MeshBlock)| BlockRange {
                name: block.name.clone(),
                points: model.nodes(number),
                cells: model.elements(number),
            };
            blocks.map(range).collect()
        })
    }

    /// Returns a field at the current time, on points or on cells.
    pub fn field(&mut self, field: Field) -> FrameField {
        each!(mut self, driven => driven.field(field))
    }

    /// Returns the current rows of all blocks. Unlike [`Self::block_rows`] it does not restart the
    /// mean of the contact forces.
    pub fn blocks(&mut self) -> Vec<BlockRow> {
        each!(mut self, driven => driven.blocks())
    }

    /// Sets the velocities of the points now, m/s, one for each of [`Self::positions`]. Fixed
    /// blocks and prescribed components keep theirs. The change in energy and momentum counts as
    /// external work and impulse.
    ///
    /// # Panics
    /// If the number of velocities is not the number of points.
    pub fn set_velocities(&mut self, velocities: &[[f64; 3]]) {
        each!(mut self, driven => driven.set_velocities(velocities));
    }

    /// Changes a load of the scene from now on: [`Self::scene`] becomes [`Self::scene_with_load`].
    ///
    /// # Panics
    /// As [`Self::scene_with_load`].
    pub fn set_load(&mut self, number: usize, kind: &LoadKind) {
        self.scene = self.scene_with_load(number, kind);
        let kind = &self.scene.load[number].kind;
        each!(mut self, driven => driven.set_load(number, kind));
    }

    /// Returns the scene in which a load stays as it is up to now and is `kind` from then on. A run
    /// resumed with that scene continues as after [`Self::set_load`].
    ///
    /// # Panics
    /// If the scene has no load of this number, or if `kind` is of another kind.
    #[must_use]
    pub fn scene_with_load(&self, number: usize, kind: &LoadKind) -> Scene {
        let time = each!(self, driven => driven.run.time());
        let mut scene = self.scene.clone();
        match (&mut scene.load[number].kind, kind) {
            (LoadKind::Pressure(old), LoadKind::Pressure(new)) => *old = old.until(time, new),
            (LoadKind::Traction(old), LoadKind::Traction(new)) => *old = old.until(time, new),
            _ => panic!("a pressure stays a pressure, and a traction a traction"),
        }
        scene
    }
}

impl<const D: usize> TypedSimulation<D> {
    fn field(&mut self, field: Field) -> FrameField {
        let instant = self.instant();
        if let Some(vectors) = self.run.point_field(&instant, field) {
            return vectors;
        }
        let mut fields = self.run.cells(&[field]).into_fields();
        let wanted = fields.iter().position(|found| found.name == name(field));
        fields.swap_remove(wanted.expect("each field is of points or of cells"))
    }

    fn blocks(&mut self) -> Vec<BlockRow> {
        let instant = self.instant();
        let since = self.run.time() - self.report.last_block_rows;
        let row = |block: usize| BlockRow {
            force: match since > 0.0 {
                true => scale(1.0 / since, &self.run.state.block_impulse[block]),
                false => [0.0; 3],
            },
            ..self.run.block_row(&instant, block)
        };
        (0..self.run.model.blocks.len()).map(row).collect()
    }

    fn set_velocities(&mut self, velocities: &[[f64; 3]]) {
        assert_eq!(velocities.len(), self.run.model.mesh.nodes.len());
        let wanted: Vec<[f64; D]> = velocities.iter().map(|&v| truncate(&v)).collect();
        let before = self.energy();
        let now = self.instant();
        self.run.set_velocities_at(&now.state, &wanted);
        self.instant = None;
        let after = self.energy();
        self.run.add_external_work(after - before);
        // New velocities have new candidate pairs.
        self.run.prepare();
        self.instant = None;
    }

    fn set_load(&mut self, number: usize, kind: &LoadKind) {
        self.run.set_load(number, kind);
        self.run.prepare();
        self.instant = None;
    }

    /// Returns the energy residual, J: kinetic and strain energy and all losses, less the work
    /// done.
    fn energy(&mut self) -> f64 {
        self.history().energy_residual
    }
}

/// Returns the name of a field on cells in frames.
fn name(field: Field) -> &'static str {
    match field {
        Field::Level => "level",
        Field::VonMises => "von_mises",
        Field::PrincipalStress => "principal_stress",
        _ => "stress",
    }
}

#[cfg(test)]
#[path = "edit_tests.rs"]
mod tests;
