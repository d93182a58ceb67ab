//! Data of the blocks for contact, which change only with the mesh.

use crate::contact::constraint::context::ContactContext;
use crate::contact::constraint::initial_overlap::InitialOverlaps;
use crate::contact::constraint::law::ContactLaws;
use crate::contact::detection::candidates::SearchContext;
use crate::contact::detection::clusters::Clusters;
use crate::contact::surface::{Configuration, Pair, Surface};
use crate::mesh::Mesh;
use crate::model::block_of;
use crate::model::inverse_mass::InverseMass;
use crate::scene::{ContactModel, Scene};

/// Lengths below which contact makes no difference, m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactLengths {
    /// Contact tolerance d_tol: pairs within it are closed at t = 0, and penetration up to it is
    /// tolerated.
    pub(crate) tolerance: f64,
    /// Contact resolution: points of boundaries no farther apart are not told apart. All that
    /// happens after t = 0 depends on it, and not on the contact tolerance, but for the correction
    /// of positions.
    pub(crate) resolution: f64,
}

/// Data that change only with the mesh, once contacts are closed at t = 0.
pub(super) struct ContactModelData<const D: usize> {
    pub(super) model: ContactModel,
    pub(super) surface: Box<dyn Surface<D>>,
    pub(super) clusters: Clusters,
    pub(super) laws: ContactLaws,
    /// Index of the block of each node, and the number of halvings of the elements around it.
    pub(super) block_of: Vec<u32>,
    pub(super) halvings: Vec<u8>,
    /// Mass-proportional damping of each block, 1/s.
    pub(super) damping: Vec<f64>,
    /// The [`ContactLengths`], m. The resolution is no less than any overlap at t = 0.
    pub(super) tolerance: f64,
    pub(super) resolution: f64,
    /// Coarse step, s.
    pub(super) coarse_step: f64,
    /// Distance, m, below which the separation bounds leave out no open pair in a drift: the
    /// contact resolution, or more where a test wants all pairs examined.
    pub(super) examined_distance: f64,
    /// True for each block that never moves.
    pub(super) fixed: Vec<bool>,
    /// Overlaps of the blocks at t = 0.
    pub(super) initial_overlaps: InitialOverlaps,
}

impl<const D: usize> ContactModelData<D> {
    /// Returns the data of the blocks of `mesh`, for coarse steps of this duration, s.
    pub(super) fn new(
        scene: &Scene,
        mesh: &Mesh<D>,
        surface: Box<dyn Surface<D>>,
        ContactLengths {
            tolerance,
            resolution,
        }: ContactLengths,
        coarse_step: f64,
    ) -> Self {
        let block_of = block_of(mesh);
        let blocks = mesh.blocks.iter();
        Self {
            model: scene.contact.model,
            clusters: Clusters::new(&*surface, &block_of, &mesh.nodes),
            surface,
            laws: ContactLaws::new(scene, mesh),
            halvings: vec![0; mesh.nodes.len()],
            block_of,
            damping: blocks
                .clone()
                .map(|block| damping_of(scene, block.source))
                .collect(),
            tolerance,
            resolution,
            coarse_step,
            examined_distance: resolution,
            fixed: blocks
                .map(|block| scene.block[block.source].fixed)
                .collect(),
            initial_overlaps: InitialOverlaps::default(),
        }
    }

    /// Returns the data of the blocks for a search.
    pub(super) fn search_context(&self) -> SearchContext<'_, D> {
        SearchContext {
            surface: &*self.surface,
            clusters: &self.clusters,
            block_of: &self.block_of,
            fixed: &self.fixed,
            resolution: self.resolution,
        }
    }

    /// True if two blocks may touch: contact between them is enabled and one can move.
    pub(super) fn may_touch(&self, [a, b]: [u32; 2]) -> bool {
        let are_fixed = self.fixed[a as usize] && self.fixed[b as usize];
        a != b && !are_fixed && self.laws.between(a, b).enabled
    }

    /// Returns the nodes of a pair.
    pub(super) fn nodes_of(&self, pair: Pair) -> impl Iterator<Item = u32> + '_ {
        let main = self.surface.main_nodes(pair.main).iter();
        main.chain(self.surface.target_nodes(pair.target)).copied()
    }

    /// Returns the nodes of a pair that can move.
    pub(super) fn moving_nodes(&self, pair: Pair) -> impl Iterator<Item = u32> + '_ {
        let moves = |node: &u32| !self.fixed[self.block_of[*node as usize] as usize];
        self.nodes_of(pair).filter(moves)
    }

    /// Returns the pairs with a gap of at most `within`, m, in their normal cones, between blocks that
    /// `may_meet` selects. A point beside the end of its target by more than the resolution does not
    /// touch, however far the tolerance reaches: the corner of the target does, if it faces the other block.
    pub(super) fn touching_pairs(
        &self,
        at: Configuration<D>,
        within: f64,
        may_meet: &impl Fn([u32; 2]) -> bool,
    ) -> Vec<Pair> {
        let surface = &*self.surface;
        let mut pairs = self.search_context().pairs_within(at, within, may_meet);
        pairs.retain(|&pair| {
            let projection = surface.project(pair, at);
            projection.gap.abs() <= within
                && projection.outside <= within.min(self.resolution)
                && surface.in_normal_cone(pair, at)
        });
        pairs
    }

    /// Returns the deepest penetration that is tolerated, m.
    pub(super) fn tolerated_penetration(&self) -> f64 {
        self.tolerance.min(self.resolution)
    }

    /// Returns all that contact needs from the model.
    pub(super) fn context<'a>(&'a self, inertia: &'a InverseMass<D>) -> ContactContext<'a, D> {
        ContactContext {
            surface: &*self.surface,
            laws: &self.laws,
            block_of: &self.block_of,
            inertia,
            damping: &self.damping,
            resolution: self.resolution,
            coarse_step: self.coarse_step,
            initial_overlaps: &self.initial_overlaps,
            halvings: &self.halvings,
        }
    }
}

/// Returns the mass-proportional damping of a block of the scene, 1/s.
fn damping_of(scene: &Scene, block: usize) -> f64 {
    let name = &scene.block[block].material;
    let material = scene
        .material
        .iter()
        .find(|material| material.name == *name);
    material.map_or(0.0, |material| material.damping.mass)
}
