//! What can be asked of a run and done to it between two steps. Asking changes nothing.

use std::ops::Range;

use crate::math::vector::{pad, scale, truncate};
use crate::mesh::ElementKind;
use crate::scene::{Field, LoadKind, Scene};
use crate::simulation::output::{BlockRow, FrameField};
use crate::simulation::{Simulation, TypedSimulation, each};

/// Where a block lies in the arrays of points and cells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BlockRange {
    /// Name of the block.
    pub name: String,
    /// Its points.
    pub points: Range<usize>,
    /// Its cells.
    pub cells: Range<usize>,
}

impl Simulation {
    /// Current positions of the points, m. On two scales there are more while blocks
    /// collide.
    #[must_use]
    pub fn positions(&self) -> Vec<[f64; 3]> {
        each!(self, driven => {
            let run = &driven.run;
            let at = run.model.positions(&run.state);
            let points = 0..run.model.mesh.nodes.len() as u32;
            points.map(|point| pad(&at.at(point))).collect()
        })
    }

    /// Shapes of the cells, and their points, one cell after the other.
    #[must_use]
    pub fn cells(&self) -> (Vec<ElementKind>, Vec<u32>) {
        each!(self, driven => {
            let elements = &driven.run.model.mesh.elements;
            let points = elements.iter().flat_map(|element| element.nodes());
            (elements.iter().map(|element| element.kind).collect(), points.copied().collect())
        })
    }

    /// Where each block lies in the arrays of points and cells now.
    #[must_use]
    pub fn block_ranges(&self) -> Vec<BlockRange> {
        each!(self, driven => {
            let model = &driven.run.model;
            let blocks = model.mesh.blocks.iter().enumerate();
            let range = |(number, block): (usize, &crate::mesh::Block)| BlockRange {
                name: block.name.clone(),
                points: model.nodes(number),
                cells: model.elements(number),
            };
            blocks.map(range).collect()
        })
    }

    /// A field now: of the points, or of the cells.
    pub fn field(&mut self, field: Field) -> FrameField {
        each!(mut self, driven => driven.field(field))
    }

    /// All blocks now. Unlike [`Self::block_rows`] it goes on averaging contact forces.
    pub fn blocks(&mut self) -> Vec<BlockRow> {
        each!(mut self, driven => driven.blocks())
    }

    /// Gives the points other velocities at this instant, m/s, one for each of
    /// [`Self::positions`]; what is fixed or follows a boundary condition stays as it is. What
    /// this brings in energy and momentum is external work and impulse.
    ///
    /// # Panics
    /// If there are not as many as points.
    pub fn set_velocities(&mut self, velocities: &[[f64; 3]]) {
        each!(mut self, driven => driven.set_velocities(velocities));
    }

    /// Has a load of the scene push otherwise from now on: [`Self::scene`] becomes
    /// [`Self::scene_with_load`].
    ///
    /// # Panics
    /// As there.
    pub fn set_load(&mut self, number: usize, kind: &LoadKind) {
        self.scene = self.scene_with_load(number, kind);
        let kind = &self.scene.load[number].kind;
        each!(mut self, driven => driven.set_load(number, kind));
    }

    /// The scene with a load that is as it was up to now, and then the one that is given, so
    /// that a run resumed with that scene goes on as after [`Self::set_load`].
    ///
    /// # Panics
    /// If the scene has no load of this number, or one of the other kind.
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
        let since = self.run.time() - self.last_block_rows;
        let row = |block: usize| BlockRow {
            force: match since > 0.0 {
                true => scale(1.0 / since, &self.run.block_impulse[block]),
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
        self.run.shift_velocities(&now.state, &wanted);
        self.instant = None;
        let after = self.energy();
        self.run.book_from_outside(after - before);
        // What may touch now is another.
        self.run.prepare();
        self.instant = None;
    }

    fn set_load(&mut self, number: usize, kind: &LoadKind) {
        self.run.set_load(number, kind);
        self.run.prepare();
        self.instant = None;
    }

    /// Kinetic and strain energy and all losses, less work done: what the ledger keeps.
    fn energy(&mut self) -> f64 {
        self.history().energy_residual
    }
}

/// Name of a field of cells in frames.
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
