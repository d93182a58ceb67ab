//! Quantities that a change of mesh preserves.

use nalgebra::{DMatrix, DVector};

use crate::element::tests::kinds;
use crate::math::vector::{add, add_scaled, cross, dot, norm, pad, sub};
use crate::mesh::{Facet, Group, GroupInterior, Mesh};
use crate::refinement::composite_mesh::refined;
use crate::refinement::mass_fit::Moments;
use crate::refinement::overlay::Overlay;
use crate::refinement::prolongation::Prolongation;
use crate::refinement::rigid_momenta::MovingBody;
use crate::refinement::tests::{Ground, size, volume};
use crate::refinement::{BisectedSimplex, BisectedTetrahedron, BisectedTriangle, Forest};
use fastrand::Rng;

/// A simplex of density 1 with its consistent mass, and an overlay over it.
struct Case<const D: usize> {
    ground: Ground<D>,
    overlay: Overlay<D>,
    /// Fitted masses of the overlay.
    masses: Vec<f64>,
    /// The largest factor of the fit.
    largest: f64,
}

/// Least fraction of its lumped mass that a node keeps.
const LEAST: f64 = 0.3;

/// Lamé constants, Pa.
const LAME: [f64; 2] = [0.7, 1.0];

impl<const D: usize> Case<D> {
    /// Builds a simplex with two halvings of all elements, and more around a point.
    fn new<C: BisectedSimplex>(rng: &mut Rng) -> Self {
        let ground = Ground::<D>::simplex(rng);
        let nodes = &ground.mesh.nodes;
        let weights = random::<D>(1, rng)[0].map(f64::abs);
        let mut near = nodes[0];
        for (corner, weight) in nodes[1..].iter().zip(weights) {
            add_scaled(&mut near, weight * rng.f64(), &sub(corner, &nodes[0]));
        }
        let finest = 0.5_f64.powi(rng.i32(2..=4));
        let forest: Forest<D, C> = Forest::new(ground.base(), &[0], |corners, _| {
            let apart = corners.iter().map(|corner| norm(&sub(corner, &near)));
            let apart = apart.fold(f64::INFINITY, f64::min) / size(nodes);
            let size = (volume(corners) / volume(nodes)).powf(1.0 / D as f64);
            size > 1.05 * (0.5 * apart).max(finest).min(0.25)
        });
        let overlay = Overlay::new(&ground.mesh, ground.base(), 0, &forest);
        let overlay = overlay.expect("a simplex as large as that is refined");
        assert_eq!(overlay.replaced, [0]);
        let lumped = overlay.lumped(1.0);
        let mut moments = Moments::new(&overlay.points, &lumped);
        for (a, b, mass) in consistent(nodes, &overlay) {
            moments.add(mass, &nodes[a], &nodes[b]);
        }
        let factors = moments.fit(&overlay.points, &lumped, LEAST);
        let factors = factors.expect("nodes enough");
        Self {
            masses: factors.iter().zip(&lumped).map(|(f, m)| f * m).collect(),
            largest: factors.iter().copied().fold(0.0, f64::max),
            overlay,
            ground,
        }
    }

    /// Returns the consistent mass matrix of the simplex before refinement.
    fn whole(&self) -> DMatrix<f64> {
        let count = self.ground.mesh.nodes.len();
        let mut matrix = DMatrix::zeros(count, count);
        for (a, b, mass) in consistent(&self.ground.mesh.nodes, &self.overlay) {
            matrix[(a, b)] = mass;
        }
        matrix
    }
}

/// Returns the momentum of a node, with a mass matrix.
fn momentum<const D: usize>(masses: &DMatrix<f64>) -> impl Fn(usize, &[[f64; D]]) -> [f64; D] + '_ {
    |node, velocity| {
        let mut sum = [0.0; D];
        for (b, velocity) in velocity.iter().enumerate() {
            add_scaled(&mut sum, masses[(node, b)], velocity);
        }
        sum
    }
}

/// Returns the entries of the consistent mass matrix of a simplex.
fn consistent<const D: usize>(
    nodes: &[[f64; D]],
    overlay: &Overlay<D>,
) -> Vec<(usize, usize, f64)> {
    let volume: f64 = overlay.volumes().sum();
    let share = volume / ((D + 1) * (D + 2)) as f64;
    let all = 0..nodes.len();
    all.clone()
        .flat_map(|a| all.clone().map(move |b| (a, b)))
        .map(|(a, b)| (a, b, if a == b { 2.0 * share } else { share }))
        .collect()
}

fn random<const D: usize>(count: usize, rng: &mut Rng) -> Vec<[f64; D]> {
    let one = |_| std::array::from_fn(|_| 2.0 * rng.f64() - 1.0);
    (0..count).map(one).collect()
}

fn kinetic_energy<const D: usize>(masses: &DMatrix<f64>, velocity: &[[f64; D]]) -> f64 {
    let momentum = momentum(masses);
    let nodes = velocity.iter().enumerate();
    nodes
        .map(|(a, v)| 0.5 * dot(v, &momentum(a, velocity)))
        .sum()
}

fn moved<const D: usize>(points: &[[f64; D]], by: &[[f64; D]]) -> Vec<[f64; D]> {
    points.iter().zip(by).map(|(x, u)| add(x, u)).collect()
}

/// Refinement of a simplex preserves the momenta and the energy of any linear field. The state on
/// the fine mesh returns to the simplex with both momenta and no more energy.
fn simplex_and_back<const D: usize, C: BisectedSimplex>(largest: f64) {
    for seed in 0..100 {
        let mut rng = Rng::with_seed(seed);
        let case = Case::<D>::new::<C>(&mut rng);
        assert!(case.largest < largest, "{seed}: {}", case.largest);
        let nodes = &case.ground.mesh.nodes;
        let whole = case.whole();
        let refined = DMatrix::from_diagonal(&DVector::from_column_slice(&case.masses));
        let prolongation = Prolongation::new(&case.overlay, None).expect("over its base");
        let displacement = random::<D>(nodes.len(), &mut rng);
        let velocity = random::<D>(nodes.len(), &mut rng);
        let at = moved(nodes, &displacement);
        let body = MovingBody {
            points: &at,
            momentum: momentum(&whole),
        };
        let before = body.momenta(&velocity, &nodes[0]);
        let energy = kinetic_energy(&whole, &velocity);
        let (mass, centre) = body.centre();
        let [displacement, velocity] =
            [displacement, velocity].map(|f| prolongation.prolongate(&f));
        let fine_at = moved(&case.overlay.points, &displacement);
        let fine = MovingBody {
            points: &fine_at,
            momentum: momentum(&refined),
        };
        let after = fine.momenta(&velocity, &nodes[0]);
        assert!(
            norm(&sub(&after.linear, &before.linear)) < 1e-13 * mass,
            "{seed}"
        );
        assert!(
            norm(&sub(&after.angular, &before.angular)) < 1e-13 * mass,
            "{seed}"
        );
        assert!(norm(&sub(&fine.centre().1, &centre)) < 1e-13, "{seed}");
        let now = kinetic_energy(&refined, &velocity);
        assert!(
            (now - energy).abs() < 1e-13 * mass,
            "{seed}: {energy} {now}"
        );

        // A simplex keeps the mean of its deformation, whatever the deformation of its parts. The
        // round-off is larger by the weight 0.01 of rotation and for flat simplices.
        let displacement = random::<D>(case.masses.len(), &mut rng);
        let smooth = prolongation.smooth(&displacement, &vec![false; nodes.len()], LAME);
        let smooth_everywhere = prolongation.prolongate(&smooth);
        let means =
            [&displacement, &smooth_everywhere].map(|field| case.overlay.mean_gradient(field));
        for (one, other) in means[0].iter().zip(&means[1]) {
            let off = norm(&sub(one, other)) / norm(one);
            assert!(off < 1e-10, "{seed}: {off:e}");
        }

        let velocity = random::<D>(case.masses.len(), &mut rng);
        let wanted = fine.momenta(&velocity, &centre);
        let energy = kinetic_energy(&refined, &velocity);
        let momenta = velocity.iter().zip(&case.masses);
        let mut back = prolongation.restrict(momenta.map(|(v, m)| v.map(|v| m * v)).collect());
        let solver = whole.clone().cholesky().expect("positive masses");
        let columns = DMatrix::from_fn(back.len(), D, |node, c| back[node][c]);
        let columns = solver.solve(&columns);
        for (node, velocity) in back.iter_mut().enumerate() {
            *velocity = std::array::from_fn(|c| columns[(node, c)]);
        }
        assert!(
            kinetic_energy(&whole, &back) < energy * (1.0 + 1e-13),
            "{seed}"
        );
        let linear = body.momenta(&back, &centre).linear;
        assert!(norm(&sub(&linear, &wanted.linear)) < 1e-13 * mass, "{seed}");
        body.restore_momenta(&mut back, &wanted);
        let now = body.momenta(&back, &centre);
        assert!(
            norm(&sub(&now.linear, &wanted.linear)) < 1e-13 * mass,
            "{seed}"
        );
        assert!(
            norm(&sub(&now.angular, &wanted.angular)) < 1e-13 * mass,
            "{seed}"
        );
    }
}

#[test]
fn a_triangle_is_refined_and_comes_back() {
    simplex_and_back::<2, BisectedTriangle>(1.5);
}

#[test]
fn a_tetrahedron_is_refined_and_comes_back() {
    simplex_and_back::<3, BisectedTetrahedron>(4.0);
}

/// A partly refined mesh has the boundary and the groups of its base mesh.
fn groups_stay<const D: usize, C: BisectedSimplex>() {
    for kind in kinds::<D>() {
        for seed in 0..10 {
            let mut rng = Rng::with_seed(seed);
            let ground = Ground::<D>::random(kind, &mut rng);
            let forest = ground.refined::<C>(&mut rng);
            let overlay = Overlay::new(&ground.mesh, ground.base(), 0, &forest);
            let refined = refined(&ground.mesh, &[overlay.as_ref()]);
            let [before, after] = [&ground.mesh, &refined];
            assert_eq!(
                after.nodes.len(),
                before.nodes.len() + forest.parents().len()
            );
            for (old, new) in before.groups.iter().zip(&after.groups) {
                let areas = [(before, old), (after, new)].map(|(mesh, group)| {
                    let facets = group.facets.iter();
                    facets.fold([0.0; 3], |sum, &facet| add(&sum, &area(mesh, facet)))
                });
                assert!(
                    norm(&sub(&areas[0], &areas[1])) < 1e-13,
                    "{kind:?} {seed} {areas:?}"
                );
                let mut nodes: Vec<u32> = new
                    .facets
                    .iter()
                    .flat_map(|&f| after.facet_nodes(f))
                    .collect();
                nodes.sort_unstable();
                nodes.dedup();
                assert_eq!(nodes, new.nodes, "{kind:?} {seed}");
            }
            let whole = crate::refinement::composite_mesh::refined(&ground.mesh, &[None]);
            assert_eq!(whole, ground.mesh);
        }
    }
}

/// Returns the area vector of a facet; a quadrilateral has four triangles about its middle.
fn area<const D: usize>(mesh: &Mesh<D>, facet: Facet) -> [f64; 3] {
    let corners: Vec<_> = mesh
        .facet_nodes(facet)
        .map(|n| pad(&mesh.nodes[n as usize]))
        .collect();
    if let &[a, b] = corners.as_slice() {
        return cross(&sub(&b, &a), &[0.0, 0.0, 1.0]);
    }
    let mut area = [0.0; 3];
    for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        add_scaled(
            &mut area,
            0.5,
            &cross(&sub(a, &corners[0]), &sub(b, &corners[0])),
        );
    }
    area
}

#[test]
fn groups_of_plane_meshes_stay() {
    groups_stay::<2, BisectedTriangle>();
}

#[test]
fn groups_of_solid_meshes_stay() {
    groups_stay::<3, BisectedTetrahedron>();
}

/// Nodal values of a coarse mesh return from a finer one unchanged, and restriction is the
/// transpose of prolongation.
fn goes_and_comes_back<const D: usize, C: BisectedSimplex>() {
    for kind in kinds::<D>() {
        for seed in 0..10 {
            let mut rng = Rng::with_seed(seed);
            let ground = Ground::<D>::random(kind, &mut rng);
            let corner = ground.mesh.nodes[0];
            let refined = |finest: f64| {
                let wanted = |corners: &[[f64; D]], _: u32| {
                    let apart = corners.iter().map(|other| norm(&sub(other, &corner)));
                    let apart = apart.fold(f64::INFINITY, f64::min);
                    size(corners) > (0.7 * apart).max(finest)
                };
                let forest: Forest<D, C> = Forest::new(ground.base(), &ground.all(), wanted);
                Overlay::new(&ground.mesh, ground.base(), 0, &forest).expect("refined")
            };
            let [coarse, fine] = [0.8, 0.4].map(refined);
            assert!(Prolongation::new(&coarse, Some(&fine)).is_none());
            let prolongation = Prolongation::new(&fine, Some(&coarse)).expect("made of it");
            let values = random::<D>(coarse.points.len(), &mut rng);
            let spread = prolongation.prolongate(&values);
            let back = prolongation.smooth(&spread, &vec![false; values.len()], LAME);
            for (value, back) in values.iter().zip(&back) {
                assert!(norm(&sub(value, back)) < 1e-10, "{kind:?} {seed}");
            }
            let other = random::<D>(fine.points.len(), &mut rng);
            let there = product(&spread, &other);
            let here = product(&values, &prolongation.restrict(other));
            assert!((there - here).abs() < 1e-11, "{kind:?} {seed}");
            // Impulses are equal at common nodes, and in sum.
            let scattered = prolongation.scatter(&values);
            assert_eq!(prolongation.inject(&scattered), values, "{kind:?} {seed}");
            assert_eq!(prolongation.restrict(scattered), values, "{kind:?} {seed}");
        }
    }
}

fn product<const D: usize>(a: &[[f64; D]], b: &[[f64; D]]) -> f64 {
    a.iter().zip(b).map(|(a, b)| dot(a, b)).sum()
}

#[test]
fn what_is_refined_in_the_plane_comes_back() {
    goes_and_comes_back::<2, BisectedTriangle>();
}

#[test]
fn what_is_refined_in_space_comes_back() {
    goes_and_comes_back::<3, BisectedTetrahedron>();
}

/// Checks overlays of random, partly refined meshes of each kind of element. `check` gets the mesh
/// before refinement, the overlay and the name of the case.
fn check_overlays<const D: usize, C: BisectedSimplex>(
    check: impl Fn(&Ground<D>, &Overlay<D>, &mut Rng, &str),
) {
    for kind in kinds::<D>() {
        for seed in 0..10 {
            let mut rng = Rng::with_seed(seed);
            let ground = Ground::<D>::random(kind, &mut rng);
            let forest = ground.refined::<C>(&mut rng);
            if let Some(overlay) = Overlay::new(&ground.mesh, ground.base(), 0, &forest) {
                check(&ground, &overlay, &mut rng, &format!("{kind:?} {seed}"));
            }
        }
    }
}

/// New nodes in an element, on an interior facet, or on an edge of a group belong to the group.
fn groups_inside_stay<const D: usize, C: BisectedSimplex>() {
    check_overlays::<D, C>(|ground, overlay, rng, case| {
        let mesh = &ground.mesh;
        let element = rng.usize(0..mesh.elements.len()) as u32;
        let shape = &mesh.elements[element as usize];
        let local = rng.usize(0..shape.kind.facets().len()) as u8;
        let facet = Facet { element, local };
        let corners: Vec<u32> = mesh.facet_nodes(facet).collect();
        let edge = [corners[0].min(corners[1]), corners[0].max(corners[1])];
        let inside = [
            GroupInterior {
                elements: vec![element],
                ..GroupInterior::default()
            },
            GroupInterior {
                facets: vec![facet],
                ..GroupInterior::default()
            },
            GroupInterior {
                edges: vec![edge],
                ..GroupInterior::default()
            },
        ];
        let cells = [shape.nodes().to_vec(), corners, edge.to_vec()];
        for (inside, mut nodes) in inside.into_iter().zip(cells) {
            nodes.sort_unstable();
            let group = Group {
                nodes: nodes.clone(),
                inside,
                ..Group::default()
            };
            let grouped = Mesh {
                groups: vec![group],
                ..mesh.clone()
            };
            let found = refined(&grouped, &[Some(overlay)]);
            let new = (overlay.base_count as u32..).zip(&overlay.hulls);
            let is_in = |hull: &[u32]| hull.iter().all(|node| nodes.contains(node));
            let new = new.filter(|(_, hull)| is_in(hull)).map(|(node, _)| node);
            let wanted: Vec<u32> = nodes.iter().copied().chain(new).collect();
            assert_eq!(found.groups[0].nodes, wanted, "{case}");
        }
    });
}

#[test]
fn groups_inside_plane_meshes_stay() {
    groups_inside_stay::<2, BisectedTriangle>();
}

#[test]
fn groups_inside_solid_meshes_stay() {
    groups_inside_stay::<3, BisectedTetrahedron>();
}

/// A field that is linear in space stays linear after refinement, in distorted elements too.
fn linear_fields_stay<const D: usize, C: BisectedSimplex>() {
    check_overlays::<D, C>(|ground, overlay, rng, case| {
        let gradient = random::<D>(D, rng);
        let field = |point: &[f64; D]| std::array::from_fn(|c| 0.3 + dot(&gradient[c], point));
        let prolongation = Prolongation::new(overlay, None).expect("over its base");
        let before: Vec<[f64; D]> = ground.mesh.nodes.iter().map(field).collect();
        for (after, point) in prolongation
            .prolongate_with_shape_functions(&before)
            .iter()
            .zip(&overlay.points)
        {
            assert!(norm(&sub(after, &field(point))) < 1e-13, "{case}");
        }
    });
}

#[test]
fn linear_fields_of_plane_meshes_stay() {
    linear_fields_stay::<2, BisectedTriangle>();
}

#[test]
fn linear_fields_of_solid_meshes_stay() {
    linear_fields_stay::<3, BisectedTetrahedron>();
}

/// Without its deformation a rotated and bent overlay is only rotated; a kept node stays.
fn slack_is_rigid<const D: usize, C: BisectedSimplex>() {
    check_overlays::<D, C>(|_, overlay, rng, case| {
        let bent = random::<D>(overlay.points.len(), rng);
        let field = |(point, bent): (&[f64; D], &[f64; D])| {
            // A quarter turn.
            let mut field = [-point[1] - point[0], point[0] - point[1], 0.0];
            add_scaled(&mut field, 1e-3, &pad(bent));
            std::array::from_fn(|c| field[c])
        };
        let field: Vec<[f64; D]> = overlay.points.iter().zip(&bent).map(field).collect();
        let mut kept = vec![false; field.len()];
        kept[overlay.elements[0].element.nodes()[0] as usize] = rng.bool();
        let relaxation = overlay.relaxation(&field, &kept, LAME);
        for (_, relaxation) in kept.iter().zip(&relaxation).filter(|(kept, _)| **kept) {
            assert_eq!(*relaxation, [0.0; D]);
        }
        let at = moved(&overlay.points, &moved(&field, &relaxation));
        for piece in &overlay.elements {
            let [a, b] = [0, 1].map(|i| piece.element.nodes()[i] as usize);
            let length = |of: &[[f64; D]]| norm(&sub(&of[a], &of[b]));
            let off = length(&at) / length(&overlay.points) - 1.0;
            assert!(off.abs() < 1e-9, "{case}: {off:e}");
        }
    });
}

#[test]
fn slack_of_plane_overlays_is_rigid() {
    slack_is_rigid::<2, BisectedTriangle>();
}

#[test]
fn slack_of_solid_overlays_is_rigid() {
    slack_is_rigid::<3, BisectedTetrahedron>();
}
