//! Time of impact against brute force.

use proptest::prelude::*;

use crate::contact::narrow_phase::feature_selection::select_feature_pair;
use crate::contact::surface::boundary_2d::Boundary2d;
use crate::contact::surface::{
    Configuration, ConstantMotion, ContactGeometry, Distance, Pair, TimeOfImpact, Topology,
};
use crate::math::vector::{add, scale};
use crate::mesh::{Element, ElementKind, Mesh, MeshBlock};

/// Instants that brute force tests.
const SAMPLES: usize = 4000;

/// A vertex (node 0) on a triangle far to its left, and an edge (nodes 4, 3) of a triangle to its
/// right. The outward normal of the edge is −x if it is upright.
struct Meeting {
    mesh: Mesh<2>,
    velocity: Vec<[f64; 2]>,
}

impl Meeting {
    fn new(vertex: [f64; 2], edge: [[f64; 2]; 2], velocity: [[f64; 2]; 3]) -> Self {
        let middle = scale(0.5, &add(&edge[0], &edge[1]));
        let nodes = vec![
            vertex,
            add(&vertex, &[-5.0, 4.0]),
            add(&vertex, &[-5.0, -4.0]),
            edge[0],
            edge[1],
            add(&middle, &[5.0, 0.0]),
        ];
        let block = |name: &str, source, first: u32| MeshBlock {
            name: name.to_owned(),
            source,
            nodes: first..first + 3,
            elements: source as u32..source as u32 + 1,
        };
        let mesh = Mesh {
            nodes,
            elements: vec![
                Element::new(ElementKind::Tri3, &[0, 1, 2]),
                Element::new(ElementKind::Tri3, &[4, 3, 5]),
            ],
            blocks: vec![block("main", 0, 0), block("target", 1, 3)],
            ..Mesh::default()
        };
        let [p, a, b] = velocity;
        let middle = scale(0.5, &add(&a, &b));
        Self {
            mesh,
            velocity: vec![p, p, p, a, b, middle],
        }
    }

    /// Returns the pair of the vertex and the edge.
    fn pair(&self, boundary: &Boundary2d) -> Pair {
        (0..6)
            .map(|target| Pair { main: 0, target })
            .find(|pair| boundary.target_nodes(pair.target) == [4, 3])
            .expect("the edge is there")
    }

    /// Returns the result of the search and that of brute force: the first touch between two
    /// instants with the foot on the edge.
    fn touches(&self, duration: f64, depth: f64) -> (Option<f64>, Option<f64>) {
        let boundary = Boundary2d::new(&self.mesh, 1.0);
        let pair = self.pair(&boundary);
        assert_eq!(boundary.main_nodes(0), [0]);
        let still = vec![[0.0; 2]; 6];
        let at = Configuration::new(&self.mesh.nodes, &still);
        let motion = ConstantMotion {
            at,
            velocity: &self.velocity,
        };
        let found = boundary.time_of_impact(pair, motion, duration, depth);
        let look = |k: usize| {
            let time = duration * k as f64 / SAMPLES as f64;
            let projection = boundary.project(pair, motion.after(time));
            (time, projection.gap, projection.outside)
        };
        let mut seen = None;
        for k in 1..=SAMPLES {
            let ((_, before, _), (time, gap, outside)) = (look(k - 1), look(k));
            if before > 0.0 && gap <= 0.0 && outside <= 0.0 {
                seen = Some(time);
                break;
            }
        }
        (found, seen)
    }

    fn gap(&self, time: f64) -> f64 {
        let boundary = Boundary2d::new(&self.mesh, 1.0);
        let still = vec![[0.0; 2]; 6];
        let at = Configuration::new(&self.mesh.nodes, &still).after(&self.velocity, time);
        let pairs = (0..6).map(|target| Pair { main: 0, target });
        let mut on_edge = pairs.filter(|pair| boundary.target_nodes(pair.target) == [4, 3]);
        let pair = on_edge.next().expect("the edge is there");
        boundary.project(pair, at).gap
    }
}

fn vector(size: f64) -> impl Strategy<Value = [f64; 2]> {
    [-size..size, -size..size]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_touch_is_missed_or_late(
        vertex in vector(0.5),
        edge in [vector(0.3), vector(0.3)],
        velocity in [vector(2.0), vector(1.0), vector(1.0)],
    ) {
        let edge = [add(&edge[0], &[1.0, -0.7]), add(&edge[1], &[1.0, 0.7])];
        let meeting = Meeting::new(vertex, edge, velocity);
        let (found, seen) = meeting.touches(1.0, 1e-9);
        if let Some(seen) = seen {
            prop_assert!(found.is_some_and(|found| found <= seen), "{found:?} {seen}");
        }
        if let Some(found) = found {
            // Positions of order 1, times of order 1: round-off.
            prop_assert!(meeting.gap(found).abs() < 1e-11, "{}", meeting.gap(found));
        }
    }

    /// Edge and path are nearly parallel, and the vertex is nearly on the line of the edge.
    #[test]
    fn grazing_touches_are_found(
        height in 1e-9_f64..1e-3,
        slide in -0.4_f64..0.4,
        sink in 1e-9_f64..1e-2,
        turn in -1e-3_f64..1e-3,
    ) {
        let edge = [[1.0, -1.0], [1.0, 1.0]];
        let velocity = [[sink, slide], [turn, 0.0], [-turn, 0.0]];
        let meeting = Meeting::new([1.0 - height, 0.1], edge, velocity);
        let (found, seen) = meeting.touches(1.0, 1e-9);
        if let Some(seen) = seen {
            prop_assert!(found.is_some_and(|found| found <= seen), "{found:?} {seen}");
        }
    }
}

proptest! {
    /// A point that slides down one side of a dent, with a small penetration, touches the other
    /// side before its penetration there is larger.
    #[test]
    fn what_slides_into_a_dent_touches_its_other_side(
        turn in 0.021..1.5_f64,
        depth in 0.0..0.9_f64,
    ) {
        let resolution = 1e-4;
        let (s, c) = (0.5 * turn).sin_cos();
        let [way, deep] = [0.02, depth * resolution];
        let tip = [-0.01 * c - deep * s, 0.01 * s - deep * c];
        let (top, side) = (s / c, -1.0);
        let nodes = vec![
            tip,
            add(&tip, &[0.03, 0.5]),
            add(&tip, &[-0.03, 0.5]),
            [-1.0, side], [0.0, side], [1.0, side],
            [-1.0, top], [0.0, 0.0], [1.0, top],
        ];
        let block = |name: &str, source, nodes, elements| MeshBlock {
            name: name.to_owned(),
            source,
            nodes,
            elements,
        };
        let mesh = Mesh {
            elements: vec![
                Element::new(ElementKind::Tri3, &[0, 1, 2]),
                Element::new(ElementKind::Quad4, &[3, 4, 7, 6]),
                Element::new(ElementKind::Quad4, &[4, 5, 8, 7]),
            ],
            blocks: vec![block("tip", 0, 0..3, 0..1), block("bed", 1, 3..9, 1..3)],
            nodes,
            ..Mesh::default()
        };
        let boundary = Boundary2d::new(&mesh, 1.0);
        let down = (0..9).map(|node| if node < 3 { [c, -s] } else { [0.0; 2] });
        let (still, velocity) = (vec![[0.0; 2]; 9], down.collect::<Vec<_>>());
        let at = Configuration::new(&mesh.nodes, &still);
        let motion = ConstantMotion { at, velocity: &velocity };
        let end = motion.after(way);
        let [_, targets] = &boundary.families()[0];
        let times = targets.clone().filter_map(|target| {
            let pair = Pair { main: 0, target };
            let time = boundary.time_of_impact(pair, motion, way, resolution)?;
            let moments = [motion.after(time), end];
            let rightful = select_feature_pair(&boundary, pair, moments, resolution, |_| true)?;
            let [x, _] = boundary.normal(rightful, at)?;
            (x < 0.0).then_some(time) // the right side
        });
        let time = times.min_by(f64::total_cmp);
        // 0.01 m down to the middle, less or more by the penetration in the left side.
        let beyond = time.map(|time| (time - 0.01) * turn.sin());
        prop_assert!(beyond.is_some_and(|beyond| beyond <= resolution), "{time:?}");
    }
}

#[test]
fn a_vertex_on_the_edge_touches_when_it_moves_in_and_only_then() {
    let edge = [[1.0, -1.0], [1.0, 1.0]];
    let still = [0.0; 2];
    // Not at the very ends, where the vertex slides along the other edge.
    for (height, foot) in [(0.0, 0.0), (0.0, 0.99), (0.0, -0.99), (1e-10, 0.3)] {
        let vertex = [1.0 + height, foot];
        let touch = |x: f64| {
            Meeting::new(vertex, edge, [[x, 0.0], still, still])
                .touches(1.0, 1e-9)
                .0
        };
        assert_eq!(touch(1.0), Some(0.0), "{vertex:?}");
        assert_eq!(touch(1e-12), Some(0.0), "{vertex:?}");
        assert_eq!(touch(0.0), None, "{vertex:?}");
        assert_eq!(touch(-1.0), None, "{vertex:?}");
    }
    // Deeper inside than a touch can be, so the search must not find it.
    let deep = Meeting::new([1.1, 0.0], edge, [[1.0, 0.0], still, still]);
    assert_eq!(deep.touches(1.0, 1e-9).0, None);
}

#[test]
fn a_vertex_that_rests_is_found_when_the_edge_turns_into_it() {
    // At rest on the edge, which turns about the position of the vertex: its far part comes up as
    // the vertex slides there.
    let edge = [[1.0, -1.0], [1.0, 1.0]];
    let meeting = Meeting::new([1.0, 0.0], edge, [[0.0, 0.5], [0.5, 0.0], [-0.5, 0.0]]);
    let (found, _) = meeting.touches(1.0, 1e-9);
    assert_eq!(found, Some(0.0));
    // The same from a little above, leaving first and coming back later.
    let velocity = [[-0.05, 0.5], [0.5, 0.0], [-0.5, 0.0]];
    let (found, seen) = Meeting::new([1.0, 0.0], edge, velocity).touches(1.0, 1e-9);
    assert!(seen.is_some(), "brute force sees it come back");
    assert!(
        found.zip(seen).is_some_and(|(found, seen)| found <= seen),
        "{found:?} {seen:?}"
    );
}

/// A point slides at u along an edge that turns at ω about its middle. The quadratic change of its gap
/// is the Coriolis term −ω u δ², up to the third order in δ.
#[test]
fn the_gap_to_a_turning_edge_changes_by_the_square_of_the_drift() {
    let (turn, slide, along) = (0.3, 0.7, 0.2);
    let edge = [[0.0, -1.0], [0.0, 1.0]];
    let velocity = [[0.0, slide], [turn, 0.0], [-turn, 0.0]];
    let meeting = Meeting::new([0.0, along], edge, velocity);
    let boundary = Boundary2d::new(&meeting.mesh, 1.0);
    let pair = meeting.pair(&boundary);
    let still = vec![[0.0; 2]; 6];
    let at = Configuration::new(&meeting.mesh.nodes, &still);
    let foot = boundary.project(pair, at).foot;
    let jacobian = boundary.jacobian(pair, &foot, at);
    for drift in [1e-2, 1e-3] {
        let then = at.after(&meeting.velocity, drift);
        let gap = boundary.gap(pair, then, None).expect("no parallel edges");
        let change = jacobian.quadratic_change(gap, &meeting.velocity, drift);
        let exact = -turn * slide * drift * drift;
        assert!((change / exact - 1.0).abs() < drift, "{change:e} {exact:e}");
    }
}
