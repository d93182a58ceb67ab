//! From scene and mesh to a model.

use crate::contact::Contacts;
use crate::element::mass::{self, Masses};
use crate::element::material::Elastic;
use crate::element::{self, BlockProperties, ElementSet, Places};
use crate::math::vector::{add, cross, pad, sub, truncate};
use crate::mesh::{Mesh, MeshError};
use crate::model::block_names;
use crate::model::boundary::Prescribed;
use crate::model::inverse_mass::Inertia;
use crate::model::load::SurfaceLoad;
use crate::model::time_step::{CAREFUL, Pace};
use crate::model::{BlockData, Model, ModelError, State};
use crate::refinement::{Cover, Foundation, SecondScale};
use crate::scene::{BoundaryTarget, ContactModel, Scene};
use crate::simulation::dimension::Space;
use crate::simulation::warnings::cautions;

/// Of light in vacuum, m/s.
pub(crate) const SPEED_OF_LIGHT: f64 = 299_792_458.0;

impl<const D: usize> Model<D> {
    /// Builds the model and the state at t = 0; fills in what the scene left
    /// to the mesh (step, tolerance).
    pub(crate) fn build(
        scene: &mut Scene,
        mut mesh: Mesh<D>,
        space: Space<D>,
    ) -> Result<Built<D>, ModelError> {
        if let Some(fault) = mesh.fault(scene.block.len()) {
            return Err(ModelError::Unsound(fault));
        }
        mesh.keep_boundary_facets();
        block_names::refuse_unknown(scene, &mesh)?;
        let thickness = thickness::<D>(scene);
        let Bodies {
            sets,
            masses,
            blocks,
        } = bodies(scene, &mesh, thickness)?;
        let is_refined = scene.contact.model == ContactModel::TwoScale && mesh.blocks.len() > 1;
        let safety = if is_refined {
            scene.time.safety.min(CAREFUL)
        } else {
            scene.time.safety
        };
        let pace = Pace::new(&mesh, &sets, &masses, &blocks, safety)?;
        let (step, step_count) = pace.choose_step(scene)?;
        let limits = pace.extremes();
        let shortest = pace.shortest(&mesh);
        let base_level = pace.levels(&mesh, step)?;
        let tolerance = contact_tolerance(scene, &mesh)?;
        let mut contacts = (mesh.blocks.len() > 1)
            .then(|| (space.surface)(&mesh, thickness, tolerance))
            .map(|surface| Contacts::new(scene, &mesh, surface, tolerance));
        let second_scale = is_refined.then(|| {
            let levels = (base_level.clone(), step);
            let foundation = Foundation::new(scene, &mesh, masses.clone(), levels, space);
            SecondScale::new(foundation)
        });
        let mut model = Self {
            inertia: inertia_of(&masses),
            gravity: scene.gravity.clone(),
            loads: Vec::new(),
            prescribed: Vec::new(),
            warnings: Vec::new(),
            limits,
            place: Places::new(&sets, mesh.elements.len()),
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
        model.prescribed = model.prescribed_motions(scene)?;
        let state = model.initial_state(scene);
        model.refuse_speed(&state)?;
        model.warnings = cautions(scene, &model, &shortest);
        model.hold(0.0);
        if let Some(contacts) = &mut contacts {
            contacts.close_initial(model.positions(&state), &model.inertia);
        }
        Ok(Built {
            model,
            state,
            contacts,
            second_scale,
        })
    }

    /// Makes the model anew for a refined mesh of the same blocks, at `time`.
    pub(crate) fn remesh(&mut self, second_scale: &SecondScale<D>, time: f64) {
        let (foundation, covers) = (&second_scale.foundation, second_scale.covers());
        let old = std::mem::replace(&mut self.mesh, second_scale.mesh());
        self.sets = foundation.all_sets(&self.mesh);
        self.place = Places::new(&self.sets, self.mesh.elements.len());
        self.block_of = block_of(&self.mesh);
        let meshes = [&old, &self.mesh];
        remesh_inertia(&mut self.inertia, foundation, covers, meshes);
        self.base_level = refined_levels(foundation, covers, &self.mesh);
        let had = "the mesh before refinement had these groups";
        self.loads = self.surface_loads(&foundation.scene).expect(had);
        self.prescribed = self.prescribed_motions(&foundation.scene).expect(had);
        self.hold(time);
    }

    fn surface_loads(&self, scene: &Scene) -> Result<Vec<SurfaceLoad<D>>, ModelError> {
        let mut loads = Vec::new();
        for (number, load) in scene.load.iter().enumerate() {
            let key = format!("load[{number}].group");
            let group = self
                .mesh
                .group(&load.group)
                .map_err(|source| ModelError::Group {
                    key: key.clone(),
                    source,
                })?;
            let facets = group.facets.iter();
            let facets = facets.map(|&facet| self.mesh.facet_nodes(facet).collect::<Vec<u32>>());
            let facets: Vec<Vec<u32>> = facets.filter(|facet| !self.is_fixed(facet[0])).collect();
            if facets.is_empty() {
                return Err(ModelError::NoFacets {
                    key,
                    group: load.group.clone(),
                });
            }
            let thickness = thickness::<D>(scene);
            loads.push(SurfaceLoad::new(load, facets, &self.mesh, thickness));
        }
        Ok(loads)
    }

    fn prescribed_motions(&self, scene: &Scene) -> Result<Vec<Prescribed>, ModelError> {
        let mut motions = Vec::new();
        for (number, boundary) in scene.boundary.iter().enumerate() {
            let key = |name: &str| format!("boundary[{number}].{name}");
            let nodes: Vec<u32> = match &boundary.target {
                BoundaryTarget::Group(name) => {
                    let blame = |source: MeshError| ModelError::Group {
                        key: key("group"),
                        source,
                    };
                    self.mesh.group(name).map_err(blame)?.nodes.clone()
                }
                BoundaryTarget::Block(name) => {
                    let parts = block_names::parts(scene, &self.mesh, name);
                    parts
                        .flat_map(|part| self.mesh.blocks[part].nodes.clone())
                        .collect()
                }
            };
            if let Some(&node) = nodes.iter().find(|&&node| self.is_fixed(node)) {
                let block = self.block_of[node as usize] as usize;
                return Err(ModelError::FixedBoundary {
                    key: key(match boundary.target {
                        BoundaryTarget::Group(_) => "group",
                        BoundaryTarget::Block(_) => "block",
                    }),
                    block: self.mesh.blocks[block].name.clone(),
                });
            }
            let motion = Prescribed::new(boundary, nodes);
            self.refuse_contradiction(number, &motion, &motions)?;
            motions.push(motion);
        }
        Ok(motions)
    }

    fn refuse_contradiction(
        &self,
        number: usize,
        motion: &Prescribed,
        earlier: &[Prescribed],
    ) -> Result<(), ModelError> {
        for (other_number, other) in earlier.iter().enumerate() {
            let Some(axis) = motion.contradicts::<D>(other) else {
                continue;
            };
            let both = |node: &&u32| other.nodes.binary_search(node).is_ok();
            if let Some(&node) = motion.nodes.iter().find(both) {
                let block = self.block_of[node as usize] as usize;
                return Err(ModelError::Contradiction {
                    key: format!("boundary[{number}]"),
                    earlier: other_number,
                    node: node - self.nodes(block).start as u32,
                    block: self.mesh.blocks[block].name.clone(),
                    axis: ['x', 'y', 'z'][axis],
                });
            }
        }
        Ok(())
    }

    fn initial_state(&self, scene: &Scene) -> State<D> {
        let count = self.mesh.nodes.len();
        let mut state = State {
            displacement: vec![[0.0; D]; count],
            carry: vec![[0.0; D]; count],
            velocity: vec![[0.0; D]; count],
            element_interval: vec![0.0; self.mesh.elements.len()],
            node_interval: vec![0.0; count],
            contact_force: vec![[0.0; D]; count],
            number: 0,
        };
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
        for motion in self.prescribed.iter().filter(|motion| motion.acts(0.0)) {
            for &node in &motion.nodes {
                let node = node as usize;
                motion.start(0.0, &self.mesh.nodes[node], &mut state.velocity[node]);
            }
        }
        state
    }

    fn refuse_speed(&self, state: &State<D>) -> Result<(), ModelError> {
        for (number, block) in self.mesh.blocks.iter().enumerate() {
            // Unlike the root of a sum of squares, this does not overflow.
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

    /// Centre of mass of a block, `at` giving the nodes' positions.
    pub(crate) fn centre(&self, block: usize, at: impl Fn(usize) -> [f64; D]) -> [f64; D] {
        let mut sum = [0.0; D];
        let mut mass = 0.0;
        for node in self.nodes(block) {
            let m = self.inertia.mass()[node];
            mass += m;
            crate::math::vector::add_scaled(&mut sum, m, &at(node));
        }
        sum.map(|x| x / mass)
    }

    /// Takes the components that are prescribed from `time` on out of the
    /// equations of motion.
    pub(crate) fn hold(&mut self, time: f64) {
        let mut held = vec![[false; D]; self.mesh.nodes.len()];
        for (number, block) in self.blocks.iter().enumerate() {
            if block.fixed {
                held[self.nodes(number)].fill([true; D]);
            }
        }
        for motion in self.prescribed.iter().filter(|motion| motion.acts(time)) {
            let components: [bool; D] = motion.holds();
            for &node in &motion.nodes {
                for c in 0..D {
                    held[node as usize][c] |= components[c];
                }
            }
        }
        self.inertia.hold(&held);
    }
}

/// A run at its start.
pub(crate) struct Built<const D: usize> {
    pub(crate) model: Model<D>,
    pub(crate) state: State<D>,
    /// Where blocks may touch.
    pub(crate) contacts: Option<Contacts<D>>,
    /// Where they are refined then.
    pub(crate) second_scale: Option<SecondScale<D>>,
}

/// What the blocks are made of.
struct Bodies<const D: usize> {
    sets: Vec<Box<dyn ElementSet<D>>>,
    masses: Masses,
    blocks: Vec<BlockData>,
}

/// Elements and masses of all blocks, one of which may move.
fn bodies<const D: usize>(
    scene: &Scene,
    mesh: &Mesh<D>,
    thickness: f64,
) -> Result<Bodies<D>, ModelError> {
    let materials: Vec<Elastic> = scene.material.iter().map(Elastic::new).collect();
    let sources = || mesh.blocks.iter().map(|block| block.source);
    let properties: Vec<_> = sources().map(|number| properties(scene, number)).collect();
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
    Ok(Bodies {
        sets,
        masses,
        blocks,
    })
}

/// Thickness of the blocks, m; 1 in space.
pub(crate) fn thickness<const D: usize>(scene: &Scene) -> f64 {
    if D == 2 { scene.thickness } else { 1.0 }
}

/// Block of each node.
fn block_of<const D: usize>(mesh: &Mesh<D>) -> Vec<u32> {
    let mut block_of = vec![0; mesh.nodes.len()];
    for (number, block) in mesh.blocks.iter().enumerate() {
        block_of[block.nodes.start as usize..block.nodes.end as usize].fill(number as u32);
    }
    block_of
}

/// The tolerance of contacts, m, filled in where the scene leaves it to the
/// mesh, which must suit it.
fn contact_tolerance<const D: usize>(scene: &mut Scene, mesh: &Mesh<D>) -> Result<f64, ModelError> {
    let tolerance = *scene
        .contact
        .tolerance
        .get_or_insert_with(|| default_tolerance(mesh));
    refuse_tolerance(mesh, tolerance)?;
    refuse_overlap(scene, mesh, tolerance)?;
    Ok(tolerance)
}

/// Contact tolerance where the scene gives none, m.
pub(super) fn default_tolerance<const D: usize>(mesh: &Mesh<D>) -> f64 {
    1e-4 * mesh.smallest_boundary_edge()
}

/// Key of the name of a block: where the scene shows which one is meant.
fn name_key<const D: usize>(mesh: &Mesh<D>, block: usize) -> String {
    format!("block[{}].name", mesh.blocks[block].source)
}

/// Where blocks can meet, neighbours on one boundary must not count as touching.
fn refuse_tolerance<const D: usize>(mesh: &Mesh<D>, tolerance: f64) -> Result<(), ModelError> {
    let edge = mesh.smallest_boundary_edge();
    if mesh.blocks.len() > 1 && tolerance > 0.5 * edge {
        return Err(ModelError::Tolerance { tolerance, edge });
    }
    Ok(())
}

/// Blocks that see each other must not overlap by more than the tolerance.
fn refuse_overlap<const D: usize>(
    scene: &Scene,
    mesh: &Mesh<D>,
    tolerance: f64,
) -> Result<(), ModelError> {
    let laws = crate::contact::constraint::law::Laws::new(scene, mesh);
    let see = |a: usize, b: usize| laws.between(a as u32, b as u32).enabled;
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

/// What the elements of a block of the scene are made of.
pub(crate) fn properties(scene: &Scene, source: usize) -> BlockProperties {
    let block = &scene.block[source];
    let material = scene
        .material
        .iter()
        .position(|material| material.name == block.material);
    BlockProperties {
        material: material.expect("the scene check has found every material"),
        kinematics: block.kinematics,
    }
}

fn inertia_of<const D: usize>(masses: &Masses) -> Inertia<D> {
    let dense = masses.consistent.iter();
    let dense = dense
        .map(|block| (block.first_node as usize, block.matrix.clone()))
        .collect();
    Inertia::new(masses.nodal.clone(), dense)
}

/// Gives the nodes of a mesh with covers over some blocks their masses, after those of
/// another such mesh.
fn remesh_inertia<const D: usize>(
    inertia: &mut Inertia<D>,
    foundation: &Foundation<D>,
    covers: &[Option<Cover<D>>],
    meshes: [&Mesh<D>; 2],
) {
    let mut nodal = Vec::with_capacity(meshes[1].nodes.len());
    for (block, cover) in foundation.mesh.blocks.iter().zip(covers) {
        let nodes = block.nodes.start as usize..block.nodes.end as usize;
        match cover {
            Some(cover) => nodal.extend(&cover.mass),
            None => nodal.extend(&foundation.masses.nodal[nodes]),
        }
    }
    let dense = foundation.masses.consistent.iter();
    let dense = dense.filter(|dense| covers[dense.block as usize].is_none());
    let dense = dense.map(|dense| {
        let first = meshes.map(|mesh| mesh.blocks[dense.block as usize].nodes.start as usize);
        (first, dense.matrix.as_slice())
    });
    inertia.remesh(nodal, dense);
}

/// Levels of the elements of such a mesh by their own stable steps.
fn refined_levels<const D: usize>(
    foundation: &Foundation<D>,
    covers: &[Option<Cover<D>>],
    mesh: &Mesh<D>,
) -> Vec<u8> {
    let roots = mesh.parts.iter().flat_map(|parts| &parts.root);
    let mut levels: Vec<u8> = if mesh.parts.is_some() {
        roots.map(|&root| foundation.level[root as usize]).collect()
    } else {
        foundation.level.clone()
    };
    for (block, cover) in mesh.blocks.iter().zip(covers) {
        let own = block.elements.start as usize..block.elements.end as usize;
        let changed = cover.iter().flat_map(|cover| &cover.level);
        for (level, changed) in levels[own].iter_mut().zip(changed) {
            *level = changed.unwrap_or(*level);
        }
    }
    levels
}
