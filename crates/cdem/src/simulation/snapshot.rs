//! Frames in two halves: a copy made while the run waits, and the work on the copy while the run
//! continues.

use std::ops::Range;

use rayon::prelude::*;

use crate::math::vector::{dot, pad, scale};
use crate::mesh::ElementKind;
use crate::scene::Field;
use crate::simulation::observe::SynchronisedInstant;
use crate::simulation::output::{FieldValues, Frame, FrameField};
use crate::step::Run;

/// Smallest number of elements for one thread.
const ELEMENTS_AT_ONCE: usize = 4096;

/// Copy of an instant. [`Self::into_frame`] works out the frame from it on any thread, while the
/// run continues.
#[derive(Clone, Debug)]
pub struct Snapshot {
    time: f64,
    points: Vec<[f64; 3]>,
    kinds: Vec<ElementKind>,
    connectivity: Vec<u32>,
    point_fields: Vec<FrameField>,
    cells: Cells,
}

impl Snapshot {
    /// Returns the time of the instant, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Makes the frame.
    #[must_use]
    pub fn into_frame(self) -> Frame {
        Frame {
            time: self.time,
            points: self.points,
            kinds: self.kinds,
            connectivity: self.connectivity,
            point_fields: self.point_fields,
            cell_fields: self.cells.into_fields(),
        }
    }
}

/// Data from which the fields on cells are made.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    /// Elements and material of each block.
    blocks: Vec<(Range<usize>, usize)>,
    levels: Vec<u8>,
    halvings: Vec<u8>,
    /// Stress of each element, if a field needs it: xx yy zz xy yz zx, Pa.
    stress: Option<Vec<[f64; 6]>>,
    wanted: Vec<Field>,
}

impl<const D: usize> Run<D> {
    /// Copies the whole model with the fields asked for. A node whose position is not finite is put
    /// at its initial position, because no viewer can draw it elsewhere.
    pub(crate) fn capture(&self, instant: &SynchronisedInstant<D>, fields: &[Field]) -> Snapshot {
        let at = self.model.positions(&self.state);
        let mesh = &self.model.mesh;
        let place = |node: u32| {
            let at = at.at(node);
            let is_place = dot(&at, &at).is_finite();
            pad(if is_place {
                &at
            } else {
                &mesh.nodes[node as usize]
            })
        };
        let of_points = [Field::Displacement, Field::Velocity, Field::ContactForce];
        let wanted = of_points.into_iter().filter(|field| fields.contains(field));
        let connectivity = || {
            let mut connectivity = Vec::with_capacity(mesh.elements.len() * (D + 1));
            for element in &mesh.elements {
                connectivity.extend_from_slice(element.nodes());
            }
            connectivity
        };
        let (connectivity, cells) = rayon::join(connectivity, || self.cells(fields));
        Snapshot {
            time: self.report_time(),
            points: (0..mesh.nodes.len() as u32).map(place).collect(),
            kinds: mesh.elements.iter().map(|element| element.kind).collect(),
            connectivity,
            point_fields: wanted
                .filter_map(|field| self.point_field(instant, field))
                .collect(),
            cells,
        }
    }

    /// Returns a vector field on the points; `None` if `field` is not one on points.
    pub(crate) fn point_field(
        &self,
        instant: &SynchronisedInstant<D>,
        field: Field,
    ) -> Option<FrameField> {
        let vector = |name, values: &[[f64; D]]| FrameField {
            name,
            components: &["x", "y", "z"],
            values: FieldValues::Real(values.iter().map(pad).collect::<Vec<_>>().into_flattened()),
        };
        match field {
            Field::Displacement => Some(vector("displacement", &self.state.displacement)),
            Field::Velocity => Some(vector("velocity", &instant.state.velocity)),
            Field::ContactForce => {
                let step = self.model.step;
                let force = self.state.node_impulse.iter();
                let force: Vec<_> = force.map(|impulse| scale(1.0 / step, impulse)).collect();
                Some(vector("contact_force", &force))
            }
            _ => None,
        }
    }

    /// Copies the data of the fields on cells: blocks and levels, and the stress if a field needs
    /// it.
    pub(crate) fn cells(&self, fields: &[Field]) -> Cells {
        let mesh = &self.model.mesh;
        let blocks = 0..mesh.blocks.len();
        let of_stress = [Field::Stress, Field::VonMises, Field::PrincipalStress];
        let wants_stress = of_stress.iter().any(|field| fields.contains(field));
        Cells {
            blocks: blocks
                .map(|block| {
                    (
                        self.model.elements(block),
                        self.model.blocks[block].material,
                    )
                })
                .collect(),
            levels: self.workspace.schedule.levels.element.clone(),
            halvings: (0..mesh.elements.len())
                .map(|element| mesh.halvings(element))
                .collect(),
            stress: wants_stress.then(|| self.model.stresses(&self.state.displacement)),
            wanted: fields.to_vec(),
        }
    }
}

impl Cells {
    /// Makes the fields on cells: block, material, level, refinement, and the wanted fields of
    /// stress.
    pub(crate) fn into_fields(self) -> Vec<FrameField> {
        let of_block = |value: &dyn Fn(usize) -> i32| {
            let mut values = vec![0; self.levels.len()];
            for (block, (elements, _)) in self.blocks.iter().enumerate() {
                values[elements.clone()].fill(value(block));
            }
            values
        };
        let whole = |name, values: Vec<i32>| FrameField {
            name,
            components: &[],
            values: FieldValues::Whole(values),
        };
        let widened = |values: &[u8]| values.iter().map(|&value| i32::from(value)).collect();
        let mut fields = vec![
            whole("block", of_block(&|block| block as i32)),
            whole("material", of_block(&|block| self.blocks[block].1 as i32)),
            whole("level", widened(&self.levels)),
            whole("refinement", widened(&self.halvings)),
        ];
        if let Some(stress) = self.stress {
            fields.extend(stress_fields(stress, &self.wanted));
        }
        fields
    }
}

/// Makes the wanted fields from stresses: xx yy zz xy yz zx, Pa.
fn stress_fields(stress: Vec<[f64; 6]>, wanted: &[Field]) -> Vec<FrameField> {
    let field = |name, components: &'static [&'static str], values: Vec<f64>| FrameField {
        name,
        components,
        values: FieldValues::Real(values),
    };
    let each = || stress.par_iter().with_min_len(ELEMENTS_AT_ONCE);
    let von_mises = wanted
        .contains(&Field::VonMises)
        .then(|| field("von_mises", &[], each().map(von_mises).collect()));
    let principal = wanted.contains(&Field::PrincipalStress).then(|| {
        let principal: Vec<_> = each().map(principal).collect();
        field(
            "principal_stress",
            &["1", "2", "3"],
            principal.into_flattened(),
        )
    });
    let tensor: &[&str] = &["xx", "yy", "zz", "xy", "yz", "zx"];
    let is_wanted = wanted.contains(&Field::Stress);
    let itself = is_wanted.then(|| field("stress", tensor, stress.into_flattened()));
    [itself, von_mises, principal]
        .into_iter()
        .flatten()
        .collect()
}

fn von_mises([xx, yy, zz, xy, yz, zx]: &[f64; 6]) -> f64 {
    let deviator = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
    (0.5 * deviator + 3.0 * (xy * xy + yz * yz + zx * zx)).sqrt()
}

/// Returns the principal stresses, largest first.
fn principal([xx, yy, zz, xy, yz, zx]: &[f64; 6]) -> [f64; 3] {
    let tensor = nalgebra::Matrix3::new(*xx, *xy, *zx, *xy, *yy, *yz, *zx, *yz, *zz);
    let mut values: [f64; 3] = tensor.symmetric_eigenvalues().into();
    values.sort_by(|a, b| b.total_cmp(a));
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn principal_stresses_of_pure_shear() {
        let stress = [0.0, 0.0, 0.0, 2.0, 0.0, 0.0];
        let [first, second, third] = principal(&stress);
        // Round-off of an iterative eigenvalue solver.
        assert!((first - 2.0).abs() < 1e-14 && second.abs() < 1e-14 && (third + 2.0).abs() < 1e-14);
        assert!((von_mises(&stress) - 2.0 * 3.0_f64.sqrt()).abs() < 1e-15);
    }
}
