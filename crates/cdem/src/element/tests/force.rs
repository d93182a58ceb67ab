//! Forces, energies and damping.

use crate::element::tests::*;
use proptest::prelude::*;

/// Returns minus the slope of the energy. The energy is a polynomial of degree 4, so five points
/// are exact at any spacing.
fn energy_slope<const D: usize>(sets: &Sets<D>, displacement: &[[f64; D]]) -> Vec<[f64; D]> {
    let step = 0.05;
    let mut slope = vec![[0.0; D]; displacement.len()];
    for a in 0..displacement.len() {
        for k in 0..D {
            let moved = |steps: f64| {
                let mut place = displacement.to_vec();
                place[a][k] += steps * step;
                energy(sets, &place)
            };
            let (near, far) = (moved(1.0) - moved(-1.0), moved(2.0) - moved(-2.0));
            slope[a][k] = (far - 8.0 * near) / (12.0 * step);
        }
    }
    slope
}

fn force_is_minus_the_energy_gradient<const D: usize>(seed: usize, size: f64) {
    for kind in kinds::<D>() {
        for plane in PLANES {
            let mesh = one_element::<D>(kind);
            let mut sets = sets_of(&mesh, rock(), Kinematics::Total, plane);
            let displacement: Vec<[f64; D]> = (0..mesh.nodes.len())
                .map(|a| std::array::from_fn(|k| size * noise(a + seed, k)))
                .collect();
            let force = forces(&mut sets, &displacement);
            let slope = energy_slope(&sets, &displacement);
            let scale = largest(&force);
            for (f, s) in force.iter().flatten().zip(slope.iter().flatten()) {
                // Round-off of the energy for a step of 0.05, divided by that step, against forces
                // of displacements from 0.001.
                assert!((f - s).abs() < 1e-11 * scale, "{kind:?} {plane:?}: {f} {s}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn force_of_total_kinematics_is_minus_the_energy_gradient(
        seed in 0usize..1000,
        size in 0.001f64..0.15,
    ) {
        force_is_minus_the_energy_gradient::<2>(seed, size);
        force_is_minus_the_energy_gradient::<3>(seed, size);
    }
}

/// Returns the moment of forces at the displaced nodes: xy, yz, zx.
fn moments<const D: usize>(
    mesh: &Mesh<D>,
    displacement: &[[f64; D]],
    force: &[[f64; D]],
) -> [f64; 3] {
    let mut moments = [0.0; 3];
    for ((x, u), f) in mesh.nodes.iter().zip(displacement).zip(force) {
        for (k, moment) in moments
            .iter_mut()
            .enumerate()
            .take(if D == 2 { 1 } else { 3 })
        {
            let l = (k + 1) % 3;
            *moment += (x[k] + u[k]) * f[l] - (x[l] + u[l]) * f[k];
        }
    }
    moments
}

fn forces_are_self_balanced<const D: usize>(kinematics: Kinematics) {
    for kind in kinds::<D>() {
        let mesh = one_element::<D>(kind);
        let mut material = rock();
        material.damping.stiffness = 1e-3;
        let mut sets = sets_of(&mesh, material, kinematics, Plane::Strain);
        let field = |size: f64, seed: usize| -> Vec<[f64; D]> {
            (0..mesh.nodes.len())
                .map(|a| std::array::from_fn(|k| size * noise(a + seed, k)))
                .collect()
        };
        advance(&mut sets, &field(0.1, 1));
        let (displacement, velocity) = (field(0.2, 5), field(3.0, 9));
        let [force, viscous] = kick(&mut sets, true, [&displacement, &velocity]);
        for force in [&force, &viscous] {
            let scale = largest(force);
            assert!(scale > 0.0, "{kind:?}");
            for k in 0..D {
                let sum: f64 = force.iter().map(|f| f[k]).sum();
                // A dozen roundings of the largest force.
                assert!(sum.abs() < 1e-14 * scale, "{kind:?} {kinematics:?}: {sum}");
            }
            for moment in moments(&mesh, &displacement, force) {
                assert!(
                    moment.abs() < 1e-14 * scale,
                    "{kind:?} {kinematics:?}: {moment}"
                );
            }
        }
    }
}

#[test]
fn an_elements_impulses_have_no_sum_and_no_moment() {
    for kinematics in KINEMATICS {
        forces_are_self_balanced::<2>(kinematics);
        forces_are_self_balanced::<3>(kinematics);
    }
}

/// For a small motion the viscous force is β times the rate of the elastic one.
fn viscous_force_is_the_rate_of_the_elastic<const D: usize>(kinematics: Kinematics, plane: Plane) {
    for kind in kinds::<D>() {
        let mesh = one_element::<D>(kind);
        let mut material = rock();
        material.damping.stiffness = 2e-3;
        let mut sets = sets_of(&mesh, material, kinematics, plane);
        let small: Vec<[f64; D]> = (0..mesh.nodes.len())
            .map(|a| std::array::from_fn(|k| 1e-9 * noise(a, k)))
            .collect();
        let rest = vec![[0.0; D]; mesh.nodes.len()];
        let elastic = forces(&mut sets, &small);
        let [force, viscous] = kick(&mut sets, false, [&rest, &small]);
        assert_eq!(largest(&force), 0.0, "no elastic force at rest");
        for (v, e) in viscous.iter().flatten().zip(elastic.iter().flatten()) {
            // The non-linear part is as small as the displacement.
            assert!(
                (v - 2e-3 * e).abs() < 1e-8 * 2e-3 * largest(&elastic),
                "{kind:?}"
            );
        }
    }
}

#[test]
fn viscous_force_is_stiffness_proportional() {
    for kinematics in KINEMATICS {
        for plane in PLANES {
            viscous_force_is_the_rate_of_the_elastic::<2>(kinematics, plane);
        }
        viscous_force_is_the_rate_of_the_elastic::<3>(kinematics, Plane::Strain);
    }
}

/// A kick that updates no record gives the same impulses as one that does, to the bit.
fn looking_changes_no_record<const D: usize>(kinematics: Kinematics) {
    for kind in kinds::<D>() {
        let mesh = one_element::<D>(kind);
        let mut sets = sets_of(&mesh, rock(), kinematics, Plane::Strain);
        let moved = |size: f64| -> Vec<[f64; D]> {
            let node = |a| std::array::from_fn(|k| size * noise(a, k));
            (0..mesh.nodes.len()).map(node).collect()
        };
        advance(&mut sets, &moved(0.05));
        let records = |sets: &Sets<D>| -> Vec<Vec<f64>> {
            let sets = sets.iter();
            sets.flat_map(|set| (0..set.len()).map(|i| set.record(i)))
                .collect()
        };
        let before = records(&sets);
        let looked = forces(&mut sets, &moved(0.1));
        assert_eq!(records(&sets), before, "{kind:?} {kinematics:?}");
        assert_eq!(advance(&mut sets, &moved(0.1)), looked);
        let has_past = kinematics == Kinematics::Incremental;
        assert_eq!(records(&sets) != before, has_past);
    }
}

#[test]
fn a_kick_that_keeps_nothing_changes_nothing() {
    for kinematics in KINEMATICS {
        looking_changes_no_record::<2>(kinematics);
        looking_changes_no_record::<3>(kinematics);
    }
}

#[test]
fn only_what_is_due_is_kicked() {
    let mesh = distorted([3, 2], ElementKind::Quad4, 0.1);
    for kinematics in KINEMATICS {
        let mut sets = sets_of(&mesh, rock(), kinematics, Plane::Strain);
        let pulled = linear_field(&mesh, |i, j| 1e-3 * (i + 2 * j) as f64);
        let still = vec![[0.0; 2]; mesh.nodes.len()];
        let levels = (0..mesh.elements.len()).map(|e| (e == 4).then_some(0));
        sets[0].arrange(&levels.collect::<Vec<_>>());
        let due = |intervals| Due {
            coarsest: 0,
            interval: Interval::OfLevel(intervals),
            updates_records: true,
        };
        let [impulse, _] = kick_over(&mut sets, &due(&[2.0]), [&pulled, &still]);
        let nodes = sets[0].nodes(&mesh, 4).to_vec();
        for (a, impulse) in impulse.iter().enumerate() {
            let touched = largest(&[*impulse]) > 0.0;
            assert_eq!(
                touched,
                nodes.contains(&(a as u32)),
                "{kinematics:?} node {a}"
            );
        }
        // The interval scales the impulse.
        let [double, _] = kick_over(&mut sets, &due(&[4.0]), [&pulled, &still]);
        for (one, two) in impulse.iter().flatten().zip(double.iter().flatten()) {
            assert_eq!(2.0 * one, *two);
        }
    }
}
