//! The first touch of two blocks, by the search and by brute force.

use crate::contact::detection::candidates::Clusters;
use crate::contact::narrow_phase::feature_selection::select_feature_pair;
use crate::contact::surface::{Configuration, ConstantMotion, Pair, Projection, Surface};
use crate::contact::verification::oracle::TOLERANCE;
use crate::contact::verification::oracle::meeting::BlockEncounter;
use crate::contact::verification::oracle::space::OracleSpace;
use crate::math::vector::{add_scaled, norm, scale};

/// The first touch of two blocks within a second.
#[derive(Debug)]
pub(super) struct First<const D: usize> {
    pub(super) time: f64,
    /// True if no other pair is within the resolution of a touch then.
    pub(super) is_only: bool,
    /// Nodes of main and target, sorted.
    features: [Vec<u32>; 2],
    normal: [f64; D],
}

/// Time of impact of a pair, and the feature pair of the touch.
#[derive(Clone, Copy)]
struct FirstTouch {
    pair: Pair,
    pub(crate) time: f64,
    rightful: Pair,
}

impl<const D: usize> First<D> {
    /// Returns the first touch of all pairs, and that of the pairs left by broad phase and culling.
    pub(super) fn of<S: OracleSpace<D>>(meeting: &BlockEncounter<D>) -> [Option<Self>; 2] {
        let surface = S::surface(&meeting.mesh);
        let still = vec![[0.0; D]; meeting.mesh.nodes.len()];
        let at = Configuration::new(&meeting.mesh.nodes, &still);
        let block = |node: u32| u32::from(node >= meeting.mesh.blocks[1].nodes.start);
        let mut all = Vec::new();
        for [mains, targets] in surface.families() {
            for main in mains {
                all.extend(targets.clone().map(|target| Pair { main, target }));
            }
        }
        all.retain(|&pair| {
            let main = block(surface.main_nodes(pair.main)[0]);
            main != block(surface.target_nodes(pair.target)[0]) && surface.is_canonical(pair)
        });
        let fastest = meeting.velocity.iter().map(norm).fold(0.0, f64::max);
        let reach = 2.0 * fastest;
        let block_of: Vec<u32> = (0..still.len() as u32).map(block).collect();
        let clusters = Clusters::new(&*surface, &block_of, &meeting.mesh.nodes);
        let margin = |_| 0.5 * (reach + TOLERANCE);
        let mut near = clusters.overlapping(&*surface, at, &margin, &|[a, b]| a != b);
        near.retain(|&pair| {
            surface.distance(pair, at) <= reach + TOLERANCE
                && surface.exclusion(pair, at, TOLERANCE) <= reach
        });
        let cache = surface.geometry_cache(all.len(), None);
        let at = at.with(cache.as_ref());
        let touch = |pair: &Pair| {
            let velocity = &meeting.velocity;
            let motion = ConstantMotion { at, velocity };
            let time = surface.time_of_impact(*pair, motion, 1.0, TOLERANCE)?;
            // A whole drift later, as for the touches of a step.
            let moments = [time, time + 1.0].map(|time| motion.after(time));
            let rightful = select_feature_pair(&*surface, *pair, moments, TOLERANCE, |_| true)?;
            Some(FirstTouch {
                pair: *pair,
                time,
                rightful,
            })
        };
        let touches: Vec<FirstTouch> = all.iter().filter_map(touch).collect();
        near.sort_unstable();
        let found = touches.iter().copied();
        let found = found.filter(|touch| near.binary_search(&touch.pair).is_ok());
        let found: Vec<FirstTouch> = found.collect();
        [touches, found].map(|touches| Self::among(&touches, &near, (meeting, &*surface, at)))
    }

    fn among(
        touches: &[FirstTouch],
        near: &[Pair],
        (meeting, surface, at): (&BlockEncounter<D>, &dyn Surface<D>, Configuration<D>),
    ) -> Option<Self> {
        let first = touches
            .iter()
            .min_by(|one, other| one.time.total_cmp(&other.time))?;
        let (time, pair) = (first.time, first.rightful);
        let then = at.after(&meeting.velocity, time);
        let is_close = |other: &Pair| {
            let Projection { gap, outside, .. } = surface.project(*other, then);
            gap.abs() <= TOLERANCE && outside <= TOLERANCE
        };
        let mut others = near.iter().filter(|&&other| other != pair);
        let foot = surface.project(pair, then).foot;
        Some(Self {
            time,
            is_only: !others.any(is_close),
            features: features(surface, pair),
            normal: surface.jacobian(pair, &foot, then).frame[0],
        })
    }

    /// Returns true if this equals `other` after a rotation, and with the blocks, of these numbers
    /// of nodes, swapped.
    pub(super) fn is_seen_as<S: OracleSpace<D>>(
        &self,
        other: &Self,
        angles: [f64; 3],
        swapped: Option<[u32; 2]>,
    ) -> bool {
        let number = |node: &u32| match swapped {
            Some([first, second]) if *node < first => node + second,
            Some([first, _]) => node - first,
            None => *node,
        };
        let named = |nodes: &Vec<u32>| {
            let mut nodes: Vec<u32> = nodes.iter().map(number).collect();
            nodes.sort_unstable();
            nodes
        };
        let [main, target] = self.features.each_ref().map(named);
        // Of two edges, the one with the smaller number is the main feature.
        let sense = if [&main, &target] == [&other.features[0], &other.features[1]] {
            1.0
        } else if [&target, &main] == [&other.features[0], &other.features[1]] {
            -1.0
        } else {
            return false;
        };
        let mut apart = S::turn(&self.normal, angles);
        add_scaled(&mut apart, -1.0, &scale(sense, &other.normal));
        // Round-off of positions, 1e-15, over the least sine of two edges that cross, 1e-7.
        norm(&apart) < 1e-8
    }
}

fn features<const D: usize>(surface: &dyn Surface<D>, pair: Pair) -> [Vec<u32>; 2] {
    [
        surface.main_nodes(pair.main),
        surface.target_nodes(pair.target),
    ]
    .map(|nodes| {
        let mut nodes = nodes.to_vec();
        nodes.sort_unstable();
        nodes
    })
}
