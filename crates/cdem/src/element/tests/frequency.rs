//! Highest frequencies and stable steps.

use nalgebra::DMatrix;

use crate::element::tests::*;
use crate::element::{highest_frequency, stable_step};

/// Returns the highest eigenfrequency of the assembled mesh with nodal masses.
fn assembled_frequency<const D: usize>(
    mesh: &Mesh<D>,
    set: &dyn ElementSet<D>,
    factor: &[f64],
) -> f64 {
    let order = mesh.nodes.len() * D;
    let (mut stiffness, mut mass) = (
        DMatrix::<f64>::zeros(order, order),
        vec![0.0; mesh.nodes.len()],
    );
    let (mut local, mut shares) = ([0.0; 24 * 24], [0.0; 8]);
    for i in 0..set.len() {
        set.stiffness(i, &mut local);
        set.lumped_mass(i, &mut shares);
        let nodes = set.nodes(mesh, i);
        let size = nodes.len() * D;
        let place = |at: usize| nodes[at / D] as usize * D + at % D;
        for row in 0..size {
            for column in 0..size {
                stiffness[(place(row), place(column))] += local[row * size + column];
            }
        }
        for (&node, share) in nodes.iter().zip(shares) {
            mass[node as usize] += share * factor[node as usize];
        }
    }
    let scaled = DMatrix::from_fn(order, order, |i, j| {
        stiffness[(i, j)] / (mass[i / D] * mass[j / D]).sqrt()
    });
    scaled.symmetric_eigenvalues().max().sqrt()
}

fn elements_bound_the_mesh<const D: usize>() {
    for kind in kinds::<D>() {
        for plane in PLANES {
            let mesh = distorted([2; D], kind, 0.1);
            let sets = sets_of(&mesh, rock(), Kinematics::Total, plane);
            let set = &*sets[0];
            let factor: Vec<f64> = (0..mesh.nodes.len())
                .map(|a| 1.0 + 0.3 * noise(a, 0))
                .collect();
            let bound = (0..set.len())
                .map(|i| set.frequency(i, &factor))
                .fold(0.0, f64::max);
            let exact = assembled_frequency(&mesh, set, &factor);
            // Irons' bound, loose if one element is much smaller than the rest.
            assert!(bound >= exact * (1.0 - 1e-12), "{kind:?}: {bound} {exact}");
            assert!(bound < 3.0 * exact, "{kind:?}: {bound} {exact}");
            let one = one_element::<D>(kind);
            let sets = sets_of(&one, rock(), Kinematics::Total, plane);
            // Nodes of the cell that are not in the element have no mass.
            let used = sets[0].nodes(&mesh, 0).len();
            if used == one.nodes.len() {
                let exact = assembled_frequency(&one, &*sets[0], &factor);
                let found = sets[0].frequency(0, &factor);
                assert!(
                    (found / exact - 1.0).abs() < 1e-12,
                    "{kind:?}: {found} {exact}"
                );
            }
        }
    }
}

#[test]
fn the_highest_element_frequency_bounds_the_meshs() {
    elements_bound_the_mesh::<2>();
    elements_bound_the_mesh::<3>();
}

/// Compares the short form for simplices with the dense eigenvalue problem. The values of λ over μ
/// belong to Poisson ratios of 0.29, 0.49, 0, and −0.75, at which shear is the stiffest.
fn short_form_is_exact<const D: usize>(kind: ElementKind) {
    let ratios = [1.4, 49.0, 0.0, -0.6];
    for (plane, ratio) in PLANES
        .into_iter()
        .flat_map(|p| ratios.map(|ratio| (p, ratio)))
    {
        let mesh = one_element::<D>(kind);
        let material = Elastic {
            lame_lambda: ratio * rock().shear_modulus,
            ..rock()
        };
        let sets = sets_of(&mesh, material, Kinematics::Total, plane);
        let nodes = D + 1;
        let (mut stiffness, mut shares) = ([0.0; 144], [0.0; 4]);
        sets[0].stiffness(0, &mut stiffness);
        sets[0].lumped_mass(0, &mut shares);
        let factor: Vec<f64> = (0..mesh.nodes.len())
            .map(|a| 1.0 + 0.5 * noise(a, 1))
            .collect();
        let mut mass = vec![0.0; nodes * nodes];
        for (a, &node) in sets[0].nodes(&mesh, 0).iter().enumerate() {
            mass[a * nodes + a] = shares[a] * factor[node as usize];
        }
        let size = nodes * D;
        let exact = highest_frequency(&stiffness[..size * size], &mass, nodes);
        let found = sets[0].frequency(0, &factor);
        assert!(
            (found / exact - 1.0).abs() < 1e-12,
            "{kind:?}, {ratio}: {found} {exact}"
        );
    }
}

/// Three equal frequencies, up to the root of round-off.
#[test]
fn an_element_as_stiff_in_all_directions_has_the_frequency_of_one() {
    let mut mesh = one_element::<3>(ElementKind::Tet4);
    mesh.nodes.truncate(4);
    let corners = [
        [1.0, 1.0, 1.0],
        [1.0, -1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.0],
    ];
    mesh.nodes.copy_from_slice(&corners);
    mesh.elements[0] = crate::mesh::Element::new(ElementKind::Tet4, &[0, 2, 1, 3]);
    mesh.blocks[0].nodes = 0..4;
    let material = Elastic {
        lame_lambda: 0.0,
        ..rock()
    };
    let sets = sets_of(&mesh, material, Kinematics::Total, Plane::Strain);
    // Gradients are a quarter of the corners: Σ g⊗g is a quarter of the unit tensor, and each mass
    // is a quarter of ρV.
    let exact = (2.0 * rock().shear_modulus / rock().density).sqrt();
    let found = sets[0].frequency(0, &[1.0; 4]);
    assert!((found / exact - 1.0).abs() < 1e-8, "{found} {exact}");
}

#[test]
fn the_short_form_for_simplices_is_exact() {
    short_form_is_exact::<2>(ElementKind::Tri3);
    short_form_is_exact::<3>(ElementKind::Tet4);
}

/// Returns the consistent over the lumped frequency of a single element.
fn ratio<const D: usize>(mesh: &Mesh<D>) -> f64 {
    let sets = sets_of(mesh, rock(), Kinematics::Total, Plane::Strain);
    let ones = vec![1.0; mesh.nodes.len()];
    sets[0].consistent_frequency(0, mesh) / sets[0].frequency(0, &ones)
}

#[test]
fn consistent_masses_raise_the_frequency_as_designed() {
    let triangle = ratio(&one_element::<2>(ElementKind::Tri3));
    let tetrahedron = ratio(&one_element::<3>(ElementKind::Tet4));
    let cube = ratio(&box_mesh([1.0; 3], [1; 3], ElementKind::Hex8, 0.3));
    // Exact for simplices of any shape: except for the constant mode, the mass matrix is that of
    // the nodes times a scalar.
    assert!((triangle - 2.0).abs() < 1e-12, "{triangle}");
    assert!((tetrahedron - 5f64.sqrt()).abs() < 1e-12, "{tetrahedron}");
    // The highest mode of a cube is linear, with inertia 1/3 of the lumped.
    assert!((cube - 3f64.sqrt()).abs() < 1e-12, "{cube}");
}

#[test]
fn closed_forms_are_safe() {
    // Δt ≤ 1/(c_p √Σ|∇N|²) for tet4 never exceeds the true limit 2/ω.
    let mesh = distorted([2; 3], ElementKind::Tet4, 0.2);
    let sets = sets_of(&mesh, rock(), Kinematics::Total, Plane::Strain);
    let ones = vec![1.0; mesh.nodes.len()];
    for i in 0..sets[0].len() {
        let nodes = sets[0].nodes(&mesh, i);
        let origin = mesh.nodes[nodes[0] as usize];
        let edges =
            nalgebra::Matrix3::from_fn(|k, a| mesh.nodes[nodes[a + 1] as usize][k] - origin[k]);
        let inverse = edges.try_inverse().expect("a sound tetrahedron");
        let first = -inverse.row_sum();
        let squares = inverse.norm_squared() + first.norm_squared();
        let limit = stable_step(sets[0].frequency(i, &ones), 0.0);
        let closed = 1.0 / (rock().p_wave_speed() * squares.sqrt());
        assert!(closed <= limit * (1.0 + 1e-12), "{closed} {limit}");
        assert!(limit < 2.0 * closed, "{closed} {limit}");
    }
}

/// Returns the spectral radius of v += Δt(−ω²x − βω²v), x += Δt v at ω = 1.
fn spectral_radius(step: f64, beta: f64) -> f64 {
    let (trace, determinant) = (2.0 - step * beta - step * step, 1.0 - step * beta);
    let discriminant = trace * trace / 4.0 - determinant;
    if discriminant < 0.0 {
        determinant.sqrt()
    } else {
        trace.abs() / 2.0 + discriminant.sqrt()
    }
}

#[test]
fn stiffness_damping_shortens_the_stable_step() {
    assert_eq!(stable_step(4.0, 0.0), 0.5);
    for ratio in [0.01, 0.05, 0.2, 1.0, 30.0] {
        let beta = 2.0 * ratio;
        let limit = stable_step(1.0, beta);
        assert!((limit - 2.0 * ((1.0f64 + ratio * ratio).sqrt() - ratio)).abs() < 1e-13);
        assert!(spectral_radius(0.999 * limit, beta) < 1.0, "{ratio}");
        assert!(spectral_radius(1.001 * limit, beta) > 1.0, "{ratio}");
    }
}

#[test]
fn a_flat_element_allows_no_step() {
    let mut mesh = one_element::<3>(ElementKind::Tet4);
    mesh.nodes.iter_mut().for_each(|x| x[2] = 0.0);
    let sets = sets_of(&mesh, rock(), Kinematics::Total, Plane::Strain);
    let ones = vec![1.0; mesh.nodes.len()];
    assert!(!sets[0].frequency(0, &ones).is_nan());
    assert_eq!(sets[0].frequency(0, &ones), f64::INFINITY);
    assert_eq!(sets[0].consistent_frequency(0, &mesh), f64::INFINITY);
}
