//! A kick that a report has computed in advance. The run takes its result over, if its inputs are
//! the same to the bit.

use crate::contact::island::Island;
use crate::contact::island::parallel::IslandKicks;
use crate::contact::timing::KickSpan;

/// The islands after a kick, with the inputs of that kick beside their state.
#[derive(Debug)]
pub(crate) struct KickPreview<const D: usize> {
    /// The islands, with the results of the kick.
    islands: Vec<Island<D>>,
    inputs: KickInputs<D>,
}

/// Inputs of a kick of all islands.
#[derive(Debug)]
pub(crate) struct KickInputs<const D: usize> {
    /// Time of the kick, s.
    time: f64,
    /// Interval and drift of each island that is due.
    spans: Vec<Option<KickSpan>>,
    /// Velocities of all nodes before the kick, m/s.
    before: Vec<[f64; D]>,
    /// Velocities of all nodes after the impulses of elements and loads, m/s.
    velocity: Vec<[f64; D]>,
}

impl<const D: usize> KickInputs<D> {
    /// Copies the inputs of a kick to nodes with these velocities, m/s.
    pub(crate) fn new(islands: &[Island<D>], kick: &IslandKicks<D>, velocity: &[[f64; D]]) -> Self {
        let spans = islands.iter().map(|island| island.kick_span(kick.times));
        Self {
            time: kick.times.time,
            spans: spans.collect(),
            before: kick.before.to_vec(),
            velocity: velocity.to_vec(),
        }
    }

    /// True if a kick has these inputs, to the bit.
    fn are_of(&self, islands: &[Island<D>], kick: &IslandKicks<D>, velocity: &[[f64; D]]) -> bool {
        let spans = islands.iter().map(|island| island.kick_span(kick.times));
        self.time.to_bits() == kick.times.time.to_bits()
            && spans.eq(self.spans.iter().copied())
            && same_bits(&self.before, kick.before)
            && same_bits(&self.velocity, velocity)
    }
}

impl<const D: usize> KickPreview<D> {
    /// Keeps the `islands` after a kick with these inputs.
    pub(crate) fn new(islands: Vec<Island<D>>, inputs: KickInputs<D>) -> Self {
        Self { islands, inputs }
    }

    /// Returns the islands after a kick, if it is this one. `islands` are those before it, `velocity`
    /// the velocities after the impulses of elements and loads, m/s.
    pub(crate) fn islands_after(
        self,
        islands: &[Island<D>],
        kick: &IslandKicks<D>,
        velocity: &[[f64; D]],
    ) -> Option<Vec<Island<D>>> {
        let is_this = self.inputs.are_of(islands, kick, velocity);
        is_this.then_some(self.islands)
    }
}

/// True if all components have the same bits.
fn same_bits<const D: usize>(a: &[[f64; D]], b: &[[f64; D]]) -> bool {
    let (a, b) = (a.as_flattened(), b.as_flattened());
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::timing::{KickTimes, NodeDrifts};

    /// Returns the kick at `time`, s, after the velocities `before`, m/s, over `interval`, s.
    fn kick<'a>(time: f64, before: &'a [[f64; 2]], interval: &'a [f64]) -> IslandKicks<'a, 2> {
        let drift = NodeDrifts::OfNodes(interval);
        IslandKicks {
            before,
            times: KickTimes {
                time,
                interval,
                drift,
            },
        }
    }

    #[test]
    fn only_the_same_kick_takes_a_preview_over() {
        let islands = || {
            vec![Island::<2> {
                nodes: vec![0],
                ..Island::default()
            }]
        };
        let (before, velocity, interval) = ([[0.0, 1.0]], [[0.0, 2.0]], [0.5]);
        let taken = |other: &IslandKicks<2>, velocity_then: &[[f64; 2]]| {
            let inputs = KickInputs::new(&islands(), &kick(3.0, &before, &interval), &velocity);
            let preview = KickPreview::new(islands(), inputs);
            preview
                .islands_after(&islands(), other, velocity_then)
                .is_some()
        };
        assert!(taken(&kick(3.0, &before, &interval), &velocity));
        assert!(!taken(&kick(3.1, &before, &interval), &velocity));
        assert!(!taken(&kick(3.0, &[[0.0, 1.1]], &interval), &velocity));
        assert!(!taken(&kick(3.0, &before, &[0.25]), &velocity));
        assert!(!taken(&kick(3.0, &before, &interval), &[[-0.0, 2.0]]));
    }
}
