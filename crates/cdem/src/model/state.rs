//! The state of the bodies, which a step changes and a restart needs.

use serde::{Deserialize, Serialize};

use crate::math::serde_pod;
use crate::model::ledger::Ledger;
use crate::model::steady_force::SteadyForce;

/// The state of the bodies: motion, impulses and accounts. Beside it a restart needs the states of
/// contact and adaptivity, and the records of the elements, which stay in the element sets.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct State<const D: usize> {
    /// Number of coarse steps made.
    pub(crate) number: u64,
    /// Displacements of the nodes, m, and their round-off, which the next drift adds.
    #[serde(with = "serde_pod")]
    pub(crate) displacement: Vec<[f64; D]>,
    #[serde(with = "serde_pod")]
    pub(crate) compensation: Vec<[f64; D]>,
    /// Velocities of the nodes, m/s, between two kicks.
    #[serde(with = "serde_pod")]
    pub(crate) velocity: Vec<[f64; D]>,
    /// Interval before the last kick of each element and node, s. It is 0 before the first kick, so
    /// that a run begins with half a kick.
    #[serde(with = "serde_pod")]
    pub(crate) element_interval: Vec<f64>,
    #[serde(with = "serde_pod")]
    pub(crate) node_interval: Vec<f64>,
    /// Contact force of the last kick, N, stored only where local damping needs it.
    #[serde(with = "serde_pod")]
    pub(crate) contact_force: Vec<[f64; D]>,
    pub(crate) last_kick: LastKick<D>,
    /// Steady forces at the borders of time levels.
    pub(crate) steady_forces: Vec<SteadyForce<D>>,
    /// Contact impulse of each node in the last coarse step, N·s.
    #[serde(with = "serde_pod")]
    pub(crate) node_impulse: Vec<[f64; D]>,
    /// Contact impulse of each block since the last query, N·s.
    pub(crate) block_impulse: Vec<[f64; 3]>,
    pub(crate) ledger: Ledger,
    pub(crate) corrections: Corrections,
    /// Number of element updates so far.
    pub(crate) element_updates: u64,
}

/// Data of the last kick of each node.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct LastKick<const D: usize> {
    /// Velocity before it, m/s.
    #[serde(with = "serde_pod")]
    pub(crate) velocity_before: Vec<[f64; D]>,
    /// Its kick interval, s.
    #[serde(with = "serde_pod")]
    pub(crate) interval: Vec<f64>,
}

impl<const D: usize> LastKick<D> {
    fn new(nodes: usize) -> Self {
        Self {
            velocity_before: vec![[0.0; D]; nodes],
            interval: vec![0.0; nodes],
        }
    }
}

impl<const D: usize> State<D> {
    /// Returns the state at rest at t = 0.
    pub(crate) fn new(nodes: usize, elements: usize, blocks: usize) -> Self {
        // Zeroed memory from the system is not committed until it is written; copies are.
        let zero = || vec![[0.0; D]; nodes];
        Self {
            number: 0,
            displacement: zero(),
            compensation: zero(),
            velocity: zero(),
            element_interval: vec![0.0; elements],
            node_interval: vec![0.0; nodes],
            contact_force: zero(),
            last_kick: LastKick::new(nodes),
            steady_forces: Vec::new(),
            node_impulse: zero(),
            block_impulse: vec![[0.0; 3]; blocks],
            ledger: Ledger::default(),
            corrections: Corrections::default(),
            element_updates: 0,
        }
    }

    /// True if the state is of this number of nodes, elements and blocks.
    pub(crate) fn is_of(&self, nodes: usize, elements: usize, blocks: usize) -> bool {
        let lists = [
            self.displacement.len(),
            self.compensation.len(),
            self.velocity.len(),
            self.node_interval.len(),
            self.contact_force.len(),
            self.last_kick.velocity_before.len(),
            self.last_kick.interval.len(),
            self.node_impulse.len(),
        ];
        lists.iter().all(|&length| length == nodes)
            && self.element_interval.len() == elements
            && self.block_impulse.len() == blocks
    }
}

/// Position corrections so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Corrections {
    /// Number of coarse steps that ended with a correction.
    pub count: u64,
    /// Angular momentum added by the corrections, N·m·s.
    pub angular_momentum: [f64; 3],
}
