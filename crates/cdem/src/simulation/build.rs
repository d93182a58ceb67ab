//! Builds the model from scene and mesh.

use crate::contact::Contacts;
use crate::contact::model_data::ContactLengths;
use crate::contact::tolerances::CONTACT_RESOLUTION;
use crate::element::mass::{self, Masses};
use crate::element::material::Elastic;
use crate::element::{self, ElementNumbering, ElementSet};
use crate::math::vector::{add, cross, pad, sub, truncate};
use crate::mesh::Mesh;
use crate::model::boundary::VelocityTime;
use crate::model::inverse_mass::InverseMass;
use crate::model::kinematics::SPEED_OF_LIGHT;
use crate::model::load::thickness;
use crate::model::time_step::{SAFETY_NEAR_LIMIT, TimeStepChoice};
use crate::model::{BlockData, Model, ModelError, State, block_names, block_of, block_properties};
use crate::refinement::dimension::Space;
use crate::refinement::{Adaptivity, BaseLevels, BaseModel};
use crate::scene::{ContactModel, Scene};
use crate::simulation::warnings::scene_warnings;
use crate::step::RunParts;

impl<const D: usize> Model<D> {
    /// Builds the model and the state at t = 0. Fills in the step and the contact tolerance if the
    /// scene leaves them to the mesh.
    pub(crate) fn build(
        scene: &mut Scene,
        mut mesh: Mesh<D>,
        space: Space<D>,
    ) -> Result<RunParts<D>, ModelError> {
        if let Some(fault) = mesh.fault(scene.block.len()) {
            return Err(ModelError::Unsound(fault));
        }
        mesh.keep_boundary_facets();
        block_names::refuse_unknown(scene, &mesh)?;
        let thickness = thickness::<D>(scene);
        let BlockSets {
            sets,
            masses,
            blocks,
        } = bodies(scene, &mesh, thickness)?;
        let is_refined = scene.contact.model == ContactModel::TwoScale && mesh.blocks.len() > 1;
        let safety = if is_refined {
            scene.time.safety.min(SAFETY_NEAR_LIMIT)
        } else {
            scene.time.safety
        };
        let pace = TimeStepChoice::new(&mesh, &sets, &masses, &blocks, safety)?;
        let (step, step_count) = pace.choose_step(scene)?;
        let limits = pace.extremes();
        let shortest = pace.shortest(&mesh);
        let base_level = pace.levels(&mesh, step)?;
        let lengths = contact_lengths(scene, &mesh)?;
        let mut contacts = (mesh.blocks.len() > 1)
            .then(|| (space.surface)(&mesh, thickness, lengths.resolution))
            .map(|surface| Contacts::new(scene, &mesh, surface, lengths, step));
        let adaptivity = is_refined.then(|| {
            let levels = BaseLevels {
                level: base_level.clone(),
                step,
            };
            let base_model = BaseModel::new(scene, &mesh, masses.clone(), levels, space);
            Adaptivity::new(base_model)
        });
        let mut model = Self {
            inertia: inertia_of(&masses),
            gravity: scene.gravity.clone(),
            loads: Vec::new(),
            boundaries: Vec::new(),
            warnings: Vec::new(),
            limits,
            numbering: ElementNumbering::new(&sets, mesh.elements.len()),
            block_of: block_of(&mesh),
            mesh,
            sets,
            blocks,
            step,
            step_count,
            end: scene.time.end,
            base_level,
        };
        model.loads = model.surface_loads(scene)?;
        model.boundaries = model.prescribed_motions(scene)?;
        let state = model.initial_state(scene);
        model.refuse_speed(&state)?;
        model.warnings = scene_warnings(scene, &model, &shortest);
        model.set_prescribed_nodes(0.0);
        if let Some(contacts) = &mut contacts {
            contacts.close_initial(model.positions(&state).into(), &model.inertia);
        }
        Ok(RunParts {
            model,
            state,
            contacts,
            adaptivity,
        })
    }

    fn initial_state(&self, scene: &Scene) -> State<D> {
        let mesh = &self.mesh;
        let mut state = State::new(mesh.nodes.len(), mesh.elements.len(), mesh.blocks.len());
        for (number, block) in self.mesh.blocks.iter().enumerate() {
            let source = &scene.block[block.source];
            if source.fixed {
                continue;
            }
            let centre = self.centre(number, |node| self.mesh.nodes[node]);
            let velocity: [f64; D] = std::array::from_fn(|c| source.velocity[c]);
            let spin = match *source.angular_velocity {
                [z] => [0.0, 0.0, z],
                [x, y, z] => [x, y, z],
                _ => [0.0; 3],
            };
            for node in self.nodes(number) {
                let arm = pad(&sub(&self.mesh.nodes[node], &centre));
                state.velocity[node] = add(&velocity, &truncate(&cross(&spin, &arm)));
            }
        }
        for motion in self.boundaries.iter().filter(|motion| motion.acts(0.0)) {
            for &node in &motion.nodes {
                let node = node as usize;
                let start = VelocityTime::Instant(0.0);
                motion.set_velocity(start, &self.mesh.nodes[node], &mut state.velocity[node]);
            }
        }
        state
    }

    fn refuse_speed(&self, state: &State<D>) -> Result<(), ModelError> {
        for (number, block) in self.mesh.blocks.iter().enumerate() {
            // Unlike the root of a sum of squares, `hypot` does not overflow.
            let speed = |node: usize| state.velocity[node].iter().copied().fold(0.0, f64::hypot);
            let speed = self.nodes(number).map(speed).fold(0.0, f64::max);
            if speed > SPEED_OF_LIGHT {
                return Err(ModelError::TooFast {
                    key: format!("block[{}].velocity", block.source),
                    block: block.name.clone(),
                    speed,
                });
            }
        }
        Ok(())
    }
}

/// Elements, masses and data of all blocks.
struct BlockSets<const D: usize> {
    sets: Vec<Box<dyn ElementSet<D>>>,
    masses: Masses,
    blocks: Vec<BlockData>,
}

/// Builds elements and masses of all blocks.
///
/// # Errors
/// If a mass matrix cannot be built, or if all blocks are fixed.
fn bodies<const D: usize>(
    scene: &Scene,
    mesh: &Mesh<D>,
    thickness: f64,
) -> Result<BlockSets<D>, ModelError> {
    let materials: Vec<Elastic> = scene.material.iter().map(Elastic::new).collect();
    let sources = || mesh.blocks.iter().map(|block| block.source);
    let properties: Vec<_> = sources()
        .map(|number| block_properties(scene, number))
        .collect();
    let sets = element::build(mesh, &properties, &materials, scene.plane, thickness);
    let requested: Vec<_> = sources().map(|number| scene.block[number].mass).collect();
    let masses = mass::build(mesh, &sets, &requested).map_err(|source| {
        let number = mesh.blocks[source.block].source;
        ModelError::Mass {
            key: format!("block[{number}].mass"),
            source,
        }
    })?;
    let data = |(b, number): (usize, usize)| BlockData {
        material: properties[b].material,
        fixed: scene.block[number].fixed,
        damping: materials[properties[b].material].damping,
        mass_kind: masses.kind[b],
        inertia_error: masses.inertia_error[b],
    };
    let blocks: Vec<_> = sources().enumerate().map(data).collect();
    if blocks.iter().all(|block| block.fixed) {
        return Err(ModelError::NothingMoves);
    }
    Ok(BlockSets {
        sets,
        masses,
        blocks,
    })
}

/// Returns the lengths of contact; fills in the tolerance if the scene gives none. Refuses a
/// tolerance that does not suit the mesh.
fn contact_lengths<const D: usize>(
    scene: &mut Scene,
    mesh: &Mesh<D>,
) -> Result<ContactLengths, ModelError> {
    let resolution = contact_resolution(mesh);
    let tolerance = *scene.contact.tolerance.get_or_insert(resolution);
    refuse_tolerance(mesh, tolerance)?;
    refuse_overlap(scene, mesh, tolerance)?;
    Ok(ContactLengths {
        tolerance,
        resolution,
    })
}

/// Returns the contact resolution, which is also the default contact tolerance, m.
pub(super) fn contact_resolution<const D: usize>(mesh: &Mesh<D>) -> f64 {
    CONTACT_RESOLUTION * mesh.smallest_boundary_edge()
}

/// Returns the key of a block's name, by which a message shows the block in the scene.
fn name_key<const D: usize>(mesh: &Mesh<D>, block: usize) -> String {
    format!("block[{}].name", mesh.blocks[block].source)
}

/// Refuses a tolerance above half the smallest edge: neighbours on one boundary would count as
/// touching.
fn refuse_tolerance<const D: usize>(mesh: &Mesh<D>, tolerance: f64) -> Result<(), ModelError> {
    let edge = mesh.smallest_boundary_edge();
    if mesh.blocks.len() > 1 && tolerance > 0.5 * edge {
        return Err(ModelError::Tolerance { tolerance, edge });
    }
    Ok(())
}

/// Refuses an overlap deeper than the tolerance between blocks that can touch each other: not if
/// both are fixed.
fn refuse_overlap<const D: usize>(
    scene: &Scene,
    mesh: &Mesh<D>,
    tolerance: f64,
) -> Result<(), ModelError> {
    let laws = crate::contact::constraint::law::ContactLaws::new(scene, mesh);
    let is_fixed = |block: usize| scene.block[mesh.blocks[block].source].fixed;
    let see = |a: usize, b: usize| {
        !(is_fixed(a) && is_fixed(b)) && laws.between(a as u32, b as u32).enabled
    };
    let Some(overlap) = crate::mesh::overlap(mesh, tolerance, &see) else {
        return Ok(());
    };
    Err(ModelError::Overlap {
        key: name_key(mesh, overlap.blocks[0].max(overlap.blocks[1])),
        blocks: overlap.blocks.map(|block| mesh.blocks[block].name.clone()),
        at: pad(&overlap.point),
        depth: overlap.depth,
        tolerance,
        edge: mesh.smallest_boundary_edge(),
    })
}

fn inertia_of<const D: usize>(masses: &Masses) -> InverseMass<D> {
    let dense = masses.consistent.iter();
    let dense = dense
        .map(|block| (block.first_node as usize, block.matrix.clone()))
        .collect();
    InverseMass::new(masses.nodal.clone(), dense)
}
