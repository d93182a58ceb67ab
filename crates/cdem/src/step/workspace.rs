//! Workspace of the step loop, which can be rebuilt from model and state between any two steps.

use crate::contact::prediction::PredictedImpacts;
use crate::contact::timing::ElementNeighbours;
use crate::math::adjacency::Adjacency;
use crate::mesh::{Element, Mesh};
use crate::model::{Model, State};
use crate::step::kick::KickImpulses;
use crate::step::schedule::KickSchedule;
use crate::step::speed_bounds::SpeedBounds;

/// Lists and caches of the step loop. They hold nothing that decides a result.
pub(crate) struct Workspace<const D: usize> {
    pub(crate) schedule: KickSchedule,
    pub(super) impulses: KickImpulses<D>,
    /// Nodal impulses of the contacts in a kick, N·s.
    pub(super) received: Vec<(u32, [f64; D])>,
    /// Nodes with a nonzero contact impulse in the last coarse step.
    pub(super) touched_nodes: Vec<u32>,
    /// Momenta of the prescribed nodes before the current drift, N·s.
    pub(super) prescribed_momenta: Vec<[f64; D]>,
    /// Bounds on the speeds in the next coarse step.
    pub(crate) speed_bounds: SpeedBounds,
    /// Predicted impacts between blocks.
    pub(super) predicted_impacts: PredictedImpacts<D>,
    /// Elements around each node; empty in a scene without contact.
    pub(super) adjacency: Adjacency,
    /// For each boundary condition, true if it acts now.
    pub(super) active_boundaries: Vec<bool>,
}

impl<const D: usize> Workspace<D> {
    /// Returns the workspace at the time of the state, still without a schedule.
    pub(super) fn new(model: &Model<D>, state: &State<D>, has_contacts: bool) -> Self {
        let nodes = model.mesh.nodes.len();
        let is_touched = |&node: &u32| state.node_impulse[node as usize] != [0.0; D];
        let time = state.number as f64 * model.step;
        Self {
            schedule: KickSchedule::default(),
            impulses: KickImpulses::new(nodes),
            received: Vec::new(),
            touched_nodes: (0..nodes as u32).filter(is_touched).collect(),
            prescribed_momenta: Vec::new(),
            speed_bounds: SpeedBounds::default(),
            predicted_impacts: PredictedImpacts::default(),
            adjacency: if has_contacts {
                elements_around_nodes(&model.mesh)
            } else {
                Adjacency::default()
            },
            active_boundaries: model.active_boundaries(time).collect(),
        }
    }

    /// Returns the elements around the nodes of the mesh, with the time levels of the nodes.
    pub(crate) fn neighbours<'a>(&'a self, mesh: &'a Mesh<D>) -> ElementNeighbours<'a> {
        ElementNeighbours {
            elements: &mesh.elements,
            around: &self.adjacency,
            levels: &self.schedule.levels.node,
        }
    }
}

/// Returns the elements around each node.
pub(super) fn elements_around_nodes<const D: usize>(mesh: &Mesh<D>) -> Adjacency {
    Adjacency::new(mesh.elements.iter().map(Element::nodes), mesh.nodes.len())
}
