//! Two bodies of any shape, each placed on one of its features.

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem::output::ContactKind;
use cdem::scene::Geometry;
use cdem_verify::{Body, Case, load, mesh_of};
use nalgebra::{Rotation3, Unit, Vector3};

pub(crate) const SHAPES: [ElementKind; 3] =
    [ElementKind::Tet4, ElementKind::Wedge6, ElementKind::Hex8];

/// The feature with which a body makes contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Feature {
    Vertex,
    Edge,
    Face,
}

/// All pairs of features, of hammer and anvil.
pub(crate) const PAIRS: [[Feature; 2]; 9] = {
    use Feature::{Edge, Face, Vertex};
    [
        [Vertex, Vertex],
        [Vertex, Edge],
        [Edge, Vertex],
        [Vertex, Face],
        [Face, Vertex],
        [Edge, Edge],
        [Edge, Face],
        [Face, Edge],
        [Face, Face],
    ]
};

/// Returns the contact type of two features.
pub(crate) fn kind_of([one, other]: [Feature; 2]) -> ContactKind {
    use Feature::{Edge, Face, Vertex};
    match (one.min(other), one.max(other)) {
        (Vertex, Vertex) => ContactKind::VertexVertex,
        (Vertex, Edge) => ContactKind::VertexEdge,
        (Vertex, Face) => ContactKind::VertexFace,
        (Edge, Edge) => ContactKind::EdgeEdge,
        (Edge, Face) => ContactKind::EdgeFace,
        _ => ContactKind::FaceFace,
    }
}

/// A body that touches the plane z = 0 with a feature.
#[derive(Clone, Debug)]
pub(crate) struct Posed {
    pub(crate) body: Body,
    /// Corners of the feature, in order around it.
    pub(crate) feature: Vec<Vector3<f64>>,
}

/// Returns the corners of an irregular shape of each kind, m.
fn corners(kind: ElementKind) -> Vec<Vector3<f64>> {
    let corners: &[[f64; 3]] = match kind {
        ElementKind::Tet4 => &[
            [0.0, 0.0, 0.0],
            [0.9, 0.1, 0.0],
            [0.2, 0.8, 0.1],
            [0.4, 0.3, 0.7],
        ],
        ElementKind::Wedge6 => &[
            [-0.1, 0.0, 0.0],
            [0.8, 0.0, 0.0],
            [0.2, 0.7, 0.0],
            [-0.1, 0.0, 0.8],
            [0.8, 0.0, 0.8],
            [0.2, 0.7, 0.8],
        ],
        _ => &[
            [0.0, 0.0, 0.0],
            [0.8, 0.0, 0.0],
            [0.8, 0.7, 0.0],
            [0.0, 0.7, 0.0],
            [0.0, 0.0, 0.6],
            [0.8, 0.0, 0.6],
            [0.8, 0.7, 0.6],
            [0.0, 0.7, 0.6],
        ],
    };
    corners.iter().map(|&corner| corner.into()).collect()
}

fn mean(points: &[Vector3<f64>]) -> Vector3<f64> {
    points.iter().sum::<Vector3<f64>>() / points.len() as f64
}

/// Returns the rotation of one direction onto another.
fn onto(from: &Vector3<f64>, to: &Vector3<f64>) -> Rotation3<f64> {
    Rotation3::rotation_between(from, to)
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}

impl Posed {
    /// Places a shape with a feature at the origin, from `above` or from below, rotated about z by
    /// an angle. Corners and edges are slightly inclined, so that no two adjacent faces are equally
    /// steep.
    pub(crate) fn new(
        kind: ElementKind,
        feature: Feature,
        (above, turn, pieces): (bool, f64, usize),
    ) -> Self {
        let mut corners = corners(kind);
        let centre = mean(&corners);
        let numbers: Vec<usize> = match feature {
            Feature::Vertex => vec![0],
            Feature::Edge => vec![0, 1],
            Feature::Face => kind.facets()[0].iter().map(|&k| usize::from(k)).collect(),
        };
        let own: Vec<_> = numbers.iter().map(|&k| corners[k]).collect();
        let outward = match own.as_slice() {
            [a] => (a - centre).normalize(),
            [a, b] => {
                let along = (b - a).normalize();
                let away = mean(&own) - centre;
                let straight = (away - along * along.dot(&away)).normalize();
                Rotation3::from_axis_angle(&Unit::new_unchecked(along), 0.1) * straight
            }
            [a, b, c, ..] => (b - a).cross(&(c - a)).normalize(),
            [] => Vector3::z(),
        };
        let down = if above { -Vector3::z() } else { Vector3::z() };
        let skew = Rotation3::from_axis_angle(&Vector3::y_axis(), 0.07);
        let mut rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), turn);
        if let [_] = own.as_slice() {
            rotation *= skew;
        }
        let mut rotation = rotation * onto(&outward, &down);
        if let [a, b] = own.as_slice() {
            // The rotation of an edge is its own angle to x.
            let along = rotation * (b - a);
            let angle = turn - along.y.atan2(along.x);
            rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), angle) * rotation;
        }
        // Away from the centre, which may be a node of the divided body.
        let share = |k: usize| {
            if k == 0 {
                0.45
            } else {
                0.55 / (own.len() - 1) as f64
            }
        };
        let place: Vector3<f64> = match own.as_slice() {
            [only] => *only,
            _ => own.iter().enumerate().map(|(k, p)| *p * share(k)).sum(),
        };
        for corner in &mut corners {
            *corner = rotation * (*corner - place);
        }
        let lowest = corners.iter().map(|corner| -down.dot(corner));
        assert!(
            lowest.fold(f64::INFINITY, f64::min) > -1e-12,
            "{kind:?} {feature:?}"
        );
        Self {
            feature: numbers.iter().map(|&k| corners[k]).collect(),
            body: Body {
                kind,
                corners: corners.iter().map(|&corner| corner.into()).collect(),
                pieces,
            },
        }
    }

    /// Returns the nodes of the feature in the divided body.
    fn nodes(&self) -> Vec<Vector3<f64>> {
        let nodes = mesh_of(&[("body", self.body.clone())]).points;
        let nodes = nodes.into_iter().map(Vector3::from);
        nodes.filter(|node| node.z.abs() < 1e-9).collect()
    }

    /// Returns the edges of the feature.
    fn edges(&self) -> Vec<[Vector3<f64>; 2]> {
        let next = self.feature.iter().cycle().skip(1);
        let edges = self.feature.iter().zip(next).map(|(a, b)| [*a, *b]);
        let count = if self.feature.len() == 2 {
            1
        } else {
            self.feature.len()
        };
        edges.take(count).collect()
    }

    /// True if the feature is a face and contains this point of the plane.
    fn holds(&self, point: &Vector3<f64>) -> bool {
        let sides = self
            .edges()
            .into_iter()
            .map(|[a, b]| (b - a).cross(&(point - a)).z);
        let sides: Vec<f64> = sides.collect();
        sides.len() > 2
            && (sides.iter().all(|&side| side > 0.0) || sides.iter().all(|&side| side < 0.0))
    }
}

/// Returns the contact points of two features by elementary geometry: nodes of one on the face of
/// the other, and crossings of their edges.
pub(crate) fn points(one: &Posed, other: &Posed) -> Vec<Vector3<f64>> {
    if one.feature.len() == 1 || other.feature.len() == 1 {
        return vec![Vector3::zeros()];
    }
    let mut points = Vec::new();
    for [from, to] in [[one, other], [other, one]] {
        points.extend(from.nodes().into_iter().filter(|node| to.holds(node)));
    }
    for [a, b] in one.edges() {
        for [c, d] in other.edges() {
            let (along, across, between) = (b - a, d - c, c - a);
            let turn = along.cross(&across).z;
            let s = between.cross(&across).z / turn;
            let t = between.cross(&along).z / turn;
            if [s, t].iter().all(|share| (0.0..=1.0).contains(share)) {
                points.push(a + along * s);
            }
        }
    }
    points
}

/// Builds the scene: the hammer falls at 0.2 m/s onto the free anvil, `gap` below it.
pub(crate) fn case(gap: f64, end: f64) -> Case {
    let mut case = load("contact-types-3d/vertex-face");
    for name in ["hammer", "anvil"] {
        let block = case.block(name);
        block.geometry = Geometry::Mesh {
            path: "../blocks.msh".into(),
            group: Some(name.to_owned()),
        };
        block.translate = vec![0.0; 3];
    }
    case.block("hammer").translate[2] = gap;
    case.scene.time.end = end;
    case
}

pub(crate) fn start(case: &Case, hammer: &Posed, anvil: &Posed) -> Simulation {
    let bodies = [
        ("hammer", hammer.body.clone()),
        ("anvil", anvil.body.clone()),
    ];
    case.start_from(|_| mesh_of(&bodies))
}
