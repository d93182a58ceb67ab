//! Times of impact in 2-D against exact arithmetic.

#![allow(clippy::print_stdout)] // the figures are the report

use crate::contact::surface::boundary_2d::Boundary2d;
use crate::contact::surface::{
    Configuration, ConstantMotion, Distance, Pair, TimeOfImpact, Topology,
};
use crate::contact::verification::exact::{
    DEPTH, ExactTouch, Features, Polynomial, Query, QueryKind, bound, difference, dot,
    judge_sinking,
};
use crate::math::vector::cross2;

/// Number of judged first touches, within edges and at their ends.
#[derive(Clone, Copy, Debug, Default)]
struct Judged {
    within: usize,
    at_ends: usize,
    /// At ends, with the vertex going past without coming in.
    past: usize,
    /// Times of impact that were found.
    found: usize,
    /// Pairs that touch from behind and sink in.
    sinking: usize,
}

/// Two triangles, for the times of impact of their pairs.
struct Trial<'a> {
    query: &'a Query<2>,
    boundary: &'a Boundary2d,
    motion: ConstantMotion<'a, 2>,
}

impl Trial<'_> {
    fn nodes(&self, pair: Pair) -> [u32; 3] {
        let main = self.boundary.main_nodes(pair.main)[0];
        let target = self.boundary.target_nodes(pair.target);
        [main, target[0], target[1]]
    }

    fn features(&self, nodes: [u32; 3]) -> Features {
        let [p, a, b] = nodes.map(|node| self.query.path(node));
        let (from, along, back) = (difference(&p, &a), difference(&b, &a), difference(&b, &p));
        let quarter = [along[1].clone(), -&along[0]];
        Features {
            measure: dot(&from, &quarter),
            within: vec![dot(&from, &along), dot(&back, &along)],
            size: dot(&along, &along),
            bound: bound(&[&from, &along]),
        }
    }

    fn found(&self, pair: Pair) -> Option<f64> {
        self.boundary.time_of_impact(pair, self.motion, 1.0, DEPTH)
    }

    fn pairs(&self) -> impl Iterator<Item = Pair> {
        let pairs = (0..6).flat_map(|main| (0..6).map(move |target| Pair { main, target }));
        pairs.filter(|&pair| {
            let [p, a, _] = self.nodes(pair);
            (p < 3) != (a < 3)
        })
    }

    /// Checks that a found touch is one.
    fn judge_found(&self, pair: Pair, judged: &mut Judged) {
        let Some(found) = self.found(pair) else {
            return;
        };
        let outside = |time: f64| {
            let then = self.motion.after(time);
            self.boundary.project(pair, then).outside
        };
        // A vertex that comes in round an end is behind the line of the edge at that time.
        let deepest = DEPTH * self.boundary.target_size(pair.target, self.motion.at);
        let is_touch = self
            .features(self.nodes(pair))
            .touch_at(found, deepest, outside);
        assert!(is_touch, "no touch at {found}: {pair:?} {:?}", self.query);
        judged.found += 1;
    }

    /// Checks that every touch is found, and none late. A vertex that comes in at the end of an
    /// edge touches either edge there, or the end touches an edge of the vertex. A vertex that goes
    /// past does not touch.
    fn judge_touches(&self, pair: Pair, judged: &mut Judged) {
        let nodes = self.nodes(pair);
        for mut touch in self.features(nodes).touches() {
            if !touch.on_rim {
                let found = self.found(pair);
                let in_time = touch.is_found_by(found);
                assert!(
                    in_time,
                    "{found:?} for {touch:?}: {pair:?} {:?}",
                    self.query
                );
                judged.within += 1;
            } else if self.comes_in(nodes[0], &mut touch) {
                let around = self
                    .pairs()
                    .filter(|&other| self.are_neighbours(nodes, other));
                let found: Vec<_> = around.map(|other| (other, self.found(other))).collect();
                let in_time = found.iter().any(|&(_, found)| touch.is_found_by(found));
                assert!(
                    in_time,
                    "{found:?} for {touch:?}: {pair:?} {:?}",
                    self.query
                );
                judged.at_ends += 1;
            } else {
                judged.past += 1;
            }
        }
    }

    /// True if a vertex is inside the other triangle right after a touch.
    fn comes_in(&self, vertex: u32, touch: &mut ExactTouch) -> bool {
        let edges = (0..6).map(|target| Pair {
            main: vertex,
            target,
        });
        let mut others = edges.filter(|&edge| (self.nodes(edge)[1] < 3) != (vertex < 3));
        others.all(|edge| {
            let [_, a, b] = self.nodes(edge);
            let measure: Polynomial = self.features([vertex, a, b]).measure;
            touch.time.sign_after(&measure) < 0
        })
    }

    /// True if a pair is of the same vertex and an edge at a corner of this edge, or of the corner
    /// and an edge that ends at the vertex.
    fn are_neighbours(&self, [p, a, b]: [u32; 3], other: Pair) -> bool {
        let [q, c, d] = self.nodes(other);
        let same = q == p && [a, b].iter().any(|end| [c, d].contains(end));
        same || [a, b].contains(&q) && [c, d].contains(&p)
    }
}

fn judge(seed: u64, count: usize, draw: QueryKind) -> Judged {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut judged = Judged::default();
    for _ in 0..count.div_ceil(18) {
        let query = Query::random(&mut random, draw, |[a, b]| cross2(&a, &b));
        let (mesh, velocity) = query.mesh();
        let still = vec![[0.0; 2]; 6];
        let trial = Trial {
            query: &query,
            boundary: &Boundary2d::new(&mesh, 1.0),
            motion: ConstantMotion {
                at: Configuration::new(&mesh.nodes, &still),
                velocity: &velocity,
            },
        };
        for pair in trial.pairs() {
            trial.judge_found(pair, &mut judged);
            judged.sinking += usize::from(judge_sinking(trial.boundary, pair, trial.motion));
            trial.judge_touches(pair, &mut judged);
        }
    }
    println!("{draw:?}, {count} queries: {judged:?}");
    judged
}

/// Judges all draws, `count` times each. The least numbers of touches in a thousand queries are a
/// half to two thirds of the measured ones.
fn judge_all(count: usize) {
    for (seed, draw) in (0..).zip(QueryKind::ALL) {
        let judged = judge(seed, count, draw);
        let at_ends = if matches!(draw, QueryKind::Wide) {
            0
        } else {
            8
        };
        assert!(judged.sinking * 1000 >= count, "{judged:?}");
        assert!(judged.within * 1000 >= 30 * count, "{judged:?}");
        assert!(judged.at_ends * 1000 >= at_ends * count, "{judged:?}");
    }
}

#[test]
fn no_touch_in_the_plane_is_missed_or_late() {
    judge_all(4_000);
}

#[test]
#[ignore = "slow study: a million times of impact"]
fn no_touch_of_a_million_in_the_plane_is_missed_or_late() {
    judge_all(400_000);
}
