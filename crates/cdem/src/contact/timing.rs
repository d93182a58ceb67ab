//! Times of kicks and drifts, as contact needs them.

use crate::math::adjacency::Adjacency;
use crate::mesh::Element;

/// Times of a kick of all nodes that are due, and of the drift after it.
#[derive(Clone, Copy)]
pub(crate) struct KickTimes<'a> {
    /// Time of the kick, s.
    pub(crate) time: f64,
    /// Kick interval of each node, s.
    pub(crate) interval: &'a [f64],
    pub(crate) drift: NodeDrifts<'a>,
}

impl KickTimes<'_> {
    /// Returns the interval and the drift of a node that is due.
    pub(super) fn of(&self, node: u32) -> Option<KickSpan> {
        let span = |drift| KickSpan {
            interval: self.interval[node as usize],
            drift,
        };
        self.drift.of(node).map(span)
    }
}

/// Drifts of the nodes.
#[derive(Clone, Copy)]
pub(crate) enum NodeDrifts<'a> {
    /// Nodes of a time level not below `coarsest` are due, each for the duration of its level, s.
    OfLevels {
        levels: &'a [u8],
        coarsest: u8,
        durations: &'a [f64],
    },
    /// All nodes are due, each for its own duration, s.
    OfNodes(&'a [f64]),
}

impl NodeDrifts<'_> {
    /// Returns the drift of a node, s, if it is due.
    pub(super) fn of(&self, node: u32) -> Option<f64> {
        match self {
            Self::OfLevels {
                levels,
                coarsest,
                durations,
            } => {
                let level = levels[node as usize];
                (level >= *coarsest).then(|| durations[level as usize])
            }
            Self::OfNodes(durations) => Some(durations[node as usize]),
        }
    }
}

/// Interval of a kick, and duration of the drift after it, s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KickSpan {
    pub(crate) interval: f64,
    pub(crate) drift: f64,
}

/// An instant in a drift: the time since its start, and its whole duration, s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DriftProgress {
    pub(crate) elapsed: f64,
    pub(crate) duration: f64,
}

impl DriftProgress {
    /// Returns the start of a drift of `duration` seconds.
    pub(super) fn start(duration: f64) -> Self {
        Self {
            elapsed: 0.0,
            duration,
        }
    }

    /// Returns the rest of the drift, s.
    pub(crate) fn remaining(self) -> f64 {
        self.duration - self.elapsed
    }
}

/// Elements around each node, and the time level of each node.
#[derive(Clone, Copy)]
pub(crate) struct ElementNeighbours<'a> {
    pub(crate) elements: &'a [Element],
    pub(crate) around: &'a Adjacency,
    pub(crate) levels: &'a [u8],
}

impl ElementNeighbours<'_> {
    /// Returns the nodes that share an element and their time level with a node.
    pub(super) fn of(&self, node: u32) -> impl Iterator<Item = u32> + '_ {
        let level = self.levels[node as usize];
        let elements = self.around.of(node).iter();
        let nodes = elements.flat_map(|&e| self.elements[e as usize].nodes());
        let nodes = nodes.copied();
        nodes.filter(move |&other| self.levels[other as usize] == level)
    }
}

/// Start of a drift, s, and the drifts of the nodes.
#[derive(Clone, Copy)]
pub(crate) struct DriftStart<'a> {
    pub(crate) time: f64,
    pub(crate) durations: NodeDrifts<'a>,
}
