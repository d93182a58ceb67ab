//! Tests of all shapes and formulations.

pub(crate) mod deformation;
pub(crate) mod force;
pub(crate) mod frequency;
pub(crate) mod interpolation;
pub(crate) mod patch;
pub(crate) mod rotation;
pub(crate) mod side_by_side;

use std::path::Path;

use crate::element::material::Elastic;
use crate::element::{BlockProperties, Due, ElementSet, Interval, build};
use crate::math::vector::add_scaled;
use crate::mesh::{ElementKind, Mesh, assemble, tests as mesh_tests};
use crate::scene::{Damping, Geometry, Kinematics, Plane, Rotation};

pub(crate) type Sets<const D: usize> = Vec<Box<dyn ElementSet<D>>>;

pub(super) const PLANES: [Plane; 2] = [Plane::Strain, Plane::Stress];
pub(super) const KINEMATICS: [Kinematics; 2] = [Kinematics::Total, Kinematics::Incremental];
const THICKNESS: f64 = 0.7;

/// A rock with round numbers, ν about 0.29.
pub(crate) fn rock() -> Elastic {
    Elastic {
        lame_lambda: 1.4e9,
        shear_modulus: 1.0e9,
        density: 2500.0,
        damping: Damping::default(),
    }
}

/// Returns the shapes of dimension `D`.
pub(crate) fn kinds<const D: usize>() -> Vec<ElementKind> {
    use ElementKind::{Hex8, Quad4, Tet4, Tri3, Wedge6};
    [Tri3, Quad4, Tet4, Wedge6, Hex8]
        .into_iter()
        .filter(|kind| kind.dimension() == D)
        .collect()
}

/// Creates a box with a corner at the origin, rotated about an axis oblique to its sides.
pub(crate) fn box_mesh<const D: usize>(
    size: [f64; D],
    divisions: [usize; D],
    element: ElementKind,
    angle: f64,
) -> Mesh<D> {
    let mut block = mesh_tests::block(
        "box",
        Geometry::Box {
            min: vec![0.0; D],
            max: size.to_vec(),
            divisions: divisions.to_vec(),
            element,
        },
    );
    let axis = if D == 2 {
        [0.0, 0.0, 1.0]
    } else {
        [0.48, 0.6, 0.64]
    };
    block.rotate = Rotation { axis, angle };
    let no_files = &mut |_: &Path| unreachable!("boxes are not read from files");
    assemble(&mesh_tests::scene(D, vec![block]), no_files).expect("a box is a sound block")
}

/// Creates a rotated box of cells of size 1 whose nodes are moved by up to `amount` per component.
/// The result is the same each time.
pub(crate) fn distorted<const D: usize>(
    divisions: [usize; D],
    element: ElementKind,
    amount: f64,
) -> Mesh<D> {
    let mut mesh = box_mesh(divisions.map(|n| n as f64), divisions, element, 0.4);
    for (a, node) in mesh.nodes.iter_mut().enumerate() {
        for (k, x) in node.iter_mut().enumerate() {
            *x += amount * noise(a, k);
        }
    }
    mesh
}

/// Returns a pseudo-random number in [−1, 1].
pub(super) fn noise(a: usize, k: usize) -> f64 {
    (12.9898 * (a as f64 + 1.0) + 78.233 * (k as f64 + 1.0)).sin()
}

/// Creates a mesh of one slightly distorted element of `kind`.
pub(super) fn one_element<const D: usize>(kind: ElementKind) -> Mesh<D> {
    let mut mesh = distorted([1; D], kind, 0.1);
    mesh.elements.truncate(1);
    mesh.blocks[0].elements = 0..1;
    mesh
}

/// Returns the sets of a mesh of blocks of one material.
pub(crate) fn sets_of<const D: usize>(
    mesh: &Mesh<D>,
    material: Elastic,
    kinematics: Kinematics,
    plane: Plane,
) -> Sets<D> {
    let properties = BlockProperties {
        material: 0,
        kinematics,
    };
    let properties = vec![properties; mesh.blocks.len()];
    build(mesh, &properties, &[material], plane, THICKNESS)
}

/// Kicks all elements over one second and returns the elastic and viscous impulses on all nodes.
pub(super) fn kick<const D: usize>(
    sets: &mut Sets<D>,
    is_kept: bool,
    motion: [&[[f64; D]]; 2],
) -> [Vec<[f64; D]>; 2] {
    let due = Due {
        coarsest: 0,
        interval: Interval::OfLevel(&[1.0; 8]),
        updates_records: is_kept,
    };
    kick_over(sets, &due, motion)
}

/// Kicks the due elements and returns the elastic and viscous impulses on all nodes.
pub(super) fn kick_over<const D: usize>(
    sets: &mut Sets<D>,
    due: &Due,
    motion: [&[[f64; D]]; 2],
) -> [Vec<[f64; D]>; 2] {
    let mut impulses = [0, 1].map(|_| vec![[0.0; D]; motion[0].len()]);
    for set in sets {
        let (mut nodes, mut levels): (Vec<u32>, Vec<Option<u8>>) = Default::default();
        for group in set.groups() {
            nodes.extend(group.nodes);
            levels.extend(group.nodes.iter().map(|_| group.level));
        }
        let mut group_impulses = [0, 1].map(|_| vec![[0.0; D]; nodes.len()]);
        let of_groups = group_impulses.each_mut().map(|all| &mut all[..]);
        set.kick(due, motion, of_groups);
        for (impulses, of_groups) in impulses.iter_mut().zip(&group_impulses) {
            for ((&node, level), impulse) in nodes.iter().zip(&levels).zip(of_groups) {
                if level.is_some_and(|level| level >= due.coarsest) {
                    add_scaled(&mut impulses[node as usize], 1.0, impulse);
                }
            }
        }
    }
    impulses
}

/// Returns the elastic nodal forces at `displacement`, N, without a change of records.
pub(super) fn forces<const D: usize>(
    sets: &mut Sets<D>,
    displacement: &[[f64; D]],
) -> Vec<[f64; D]> {
    let still = vec![[0.0; D]; displacement.len()];
    let [force, _] = kick(sets, false, [displacement, &still]);
    force
}

/// Updates the records of all elements to `displacement` and returns the forces.
pub(super) fn advance<const D: usize>(
    sets: &mut Sets<D>,
    displacement: &[[f64; D]],
) -> Vec<[f64; D]> {
    let still = vec![[0.0; D]; displacement.len()];
    let [force, _] = kick(sets, true, [displacement, &still]);
    force
}

/// Returns the strain energy of all elements, J, and checks it against that of each alone.
pub(super) fn energy<const D: usize>(sets: &Sets<D>, displacement: &[[f64; D]]) -> f64 {
    let mut sum = 0.0;
    for set in sets {
        let elements = set.mesh_elements();
        let mut is_counted = vec![false; elements.iter().max().map_or(0, |&e| e as usize + 1)];
        for (i, &e) in elements.iter().enumerate() {
            is_counted[e as usize] = true;
            let mut energy = 0.0;
            set.add_strain_energies(displacement, &is_counted, &mut energy);
            assert_eq!(energy, set.strain_energy(i, displacement));
            is_counted[e as usize] = false;
            sum += energy;
        }
    }
    sum
}

/// Returns the stress of each element of a set.
pub(super) fn stresses<const D: usize>(
    set: &dyn ElementSet<D>,
    displacement: &[[f64; D]],
) -> Vec<[f64; 6]> {
    let elements = set.mesh_elements();
    let count = elements.iter().max().map_or(0, |&e| e as usize + 1);
    let mut stresses = vec![[f64::NAN; 6]; count];
    set.stresses(displacement, &mut stresses);
    elements.iter().map(|&e| stresses[e as usize]).collect()
}

/// Returns G·X at every node.
pub(super) fn linear_field<const D: usize>(
    mesh: &Mesh<D>,
    gradient: impl Fn(usize, usize) -> f64,
) -> Vec<[f64; D]> {
    let at = |x: &[f64; D]| std::array::from_fn(|i| (0..D).map(|j| gradient(i, j) * x[j]).sum());
    mesh.nodes.iter().map(at).collect()
}

/// Returns the largest absolute component.
pub(super) fn largest<const D: usize>(vectors: &[[f64; D]]) -> f64 {
    vectors.iter().flatten().fold(0.0, |m, x| x.abs().max(m))
}

/// Returns a proper rotation by `angle` (2-D), or about a fixed oblique axis (3-D).
pub(crate) fn rotation<const D: usize>(angle: f64) -> [[f64; D]; D] {
    let (sine, cosine) = angle.sin_cos();
    let axis = [0.48, 0.6, 0.64];
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            if D == 2 {
                return [[cosine, -sine], [sine, cosine]][i][j];
            }
            let unit = if i == j { cosine } else { 0.0 };
            // −ε_ijk a_k, cyclic indices positive.
            let cross = match (j + 3 - i) % 3 {
                1 => -axis[(i + 2) % 3],
                2 => axis[(i + 1) % 3],
                _ => 0.0,
            };
            unit + (1.0 - cosine) * axis[i] * axis[j] + sine * cross
        })
    })
}
