//! Tests of the solver on handmade islands.

use crate::contact::constraint::contact_constraint::{Constraint, FrictionBounds, shear_norm};
use crate::contact::solver::{Precision, Solver};
use crate::contact::surface::ContactJacobian;
use crate::contact::tolerances::{KICK_RESIDUAL, RESIDUAL, SHORT_LEVER_SQUARED};
use crate::model::inverse_mass::{InverseMass, KickMobility};

/// All changes of velocity count.
const EXACT: Precision = Precision {
    residual: RESIDUAL,
    velocity: 0.0,
};

/// Returns the mobility of undamped blocks at an instant.
fn mobility<'a, const D: usize>(
    inertia: &'a InverseMass<D>,
    block_of: &'a [u32],
) -> KickMobility<'a, D> {
    KickMobility {
        inertia,
        block_of,
        damping: &[0.0],
        interval: 0.0,
    }
}

/// Returns a contact between nodes with these weights, with its normal along the last axis.
fn contact<const D: usize>(weights: &[(u32, f64)], friction: f64) -> Constraint<D> {
    let frame: [[f64; D]; D] = std::array::from_fn(|r| {
        let mut row = [0.0; D];
        row[(r + D - 1) % D] = 1.0;
        row
    });
    let mut operator = ContactJacobian {
        count: weights.len(),
        frame,
        ..ContactJacobian::default()
    };
    for (k, &(node, weight)) in weights.iter().enumerate() {
        operator.nodes[k] = node;
        for r in 0..D {
            operator.rows[k][r] = frame[r].map(|x| weight * x);
        }
    }
    Constraint {
        jacobian: operator,
        bounds: FrictionBounds {
            friction,
            ..FrictionBounds::default()
        },
        ..Constraint::default()
    }
}

/// Returns the contacts of two flush faces with `counts` nodes, each inner node on an edge of
/// the other face: more contacts than degrees of freedom.
fn flush_faces(counts: [u32; 2], friction: f64) -> Vec<Constraint<2>> {
    let mut constraints = Vec::new();
    for (side, sign) in [(0, -1.0), (1, 1.0)] {
        let (own, other) = (counts[side], counts[1 - side]);
        let first = [0, counts[0]];
        for i in 1..own - 1 {
            let at = f64::from(i * (other - 1)) / f64::from(own - 1);
            let edge = (at as u32).min(other - 2);
            let weight = at - f64::from(edge);
            let start = first[1 - side] + edge;
            constraints.push(contact(
                &[
                    (first[side] + i, sign),
                    (start, -sign * (1.0 - weight)),
                    (start + 1, -sign * weight),
                ],
                friction,
            ));
        }
    }
    constraints
}

/// Asserts that impulses are within their bounds and act only where contacts are closed, up to
/// `least`, m/s.
fn assert_solved(constraints: &[Constraint<2>], velocity: &[[f64; 2]], least: f64) {
    for constraint in constraints {
        let [normal, shear] = constraint.jacobian.relative_velocities(velocity);
        let [press, drag] = constraint.impulse;
        let limit = constraint.bounds.shear_bound(press);
        assert!(press >= 0.0 && normal >= constraint.target[0] - least);
        assert!(press == 0.0 || normal <= constraint.target[0] + least);
        assert!(drag.abs() <= limit * (1.0 + 1e-12));
        let slip = shear - constraint.target[1];
        assert!(slip.abs() <= least || (drag.abs() >= limit * (1.0 - 1e-9) && drag * slip <= 0.0));
    }
}

/// Returns velocities within ±1 m/s, with the faces approaching each other.
fn closing(counts: [u32; 2], seed: u64) -> Vec<[f64; 2]> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut velocity = |side: f64| [random.f64() - 0.5, side + 0.2 * random.f64()];
    let below = (0..counts[0]).map(|_| 0.5);
    let sides = below.chain((0..counts[1]).map(|_| -0.5));
    sides.map(&mut velocity).collect()
}

#[test]
fn flush_faces_that_contradict_each_other_are_solved_to_the_end() {
    for counts in [[7, 5], [12, 9], [30, 41]] {
        let nodes = (counts[0] + counts[1]) as usize;
        let inertia = InverseMass::<2>::new(vec![1.0; nodes], Vec::new());
        let block_of = vec![0; nodes];
        let mut random = fastrand::Rng::with_seed(7);
        let mut constraints = flush_faces(counts, 0.6);
        for constraint in &mut constraints {
            constraint.target = [0; 2].map(|_| 1e-3 * (random.f64() - 0.5));
        }
        let mut velocity = closing(counts, 3);
        let before: f64 = velocity.iter().map(|v| v[1]).sum();
        let mut system = Solver::default();
        system.load(&constraints, mobility(&inertia, &block_of));
        let residual = system.solve(&mut constraints, &mut velocity, EXACT);
        assert!(residual <= 1e-8, "{counts:?}: {residual:e}");
        assert_solved(&constraints, &velocity, 1e-6);
        let after: f64 = velocity.iter().map(|v| v[1]).sum();
        assert!((after - before).abs() < 1e-12, "{counts:?}");
    }
}

/// Pairs of faces close ever more slowly. The final velocities must be those that the impulses make.
#[test]
fn velocities_are_what_impulses_make_of_them() {
    let (counts, pairs) = ([21, 17], 12);
    let nodes = counts[0] + counts[1];
    let (mut constraints, mut start) = (Vec::new(), Vec::new());
    for pair in 0..pairs {
        for mut constraint in flush_faces(counts, 0.6) {
            let own = &mut constraint.jacobian.nodes;
            own.iter_mut().for_each(|node| *node += pair * nodes);
            constraints.push(constraint);
        }
        let speed = 0.1_f64.powi(pair as i32);
        let velocities = closing(counts, 5 + u64::from(pair));
        start.extend(
            velocities
                .into_iter()
                .map(|velocity| velocity.map(|v| speed * v)),
        );
    }
    let inertia = InverseMass::<2>::new(vec![2.0; start.len()], Vec::new());
    let block_of = vec![0; start.len()];
    let mut velocity = start.clone();
    let mut system = Solver::default();
    system.load(&constraints, mobility(&inertia, &block_of));
    let residual = system.solve(&mut constraints, &mut velocity, EXACT);
    assert!(residual <= RESIDUAL, "{residual:e}");
    for constraint in &constraints {
        let operator = &constraint.jacobian;
        operator.apply_transpose(&constraint.impulse, |node, impulse| {
            inertia.apply_impulse(node as usize, impulse, &mut start);
        });
    }
    // Velocities are up to 1 m/s: some hundred sweeps with one rounding each.
    for (solved, made) in velocity.iter().zip(&start) {
        assert!((0..2).all(|c| (solved[c] - made[c]).abs() < 1e-13));
    }
}

/// With redundant contacts, impulses are not unique, but velocities are.
#[test]
fn velocities_do_not_depend_on_the_impulses_a_solve_begins_with() {
    let counts = [12, 9];
    let inertia = InverseMass::<2>::new(vec![1.0; 21], Vec::new());
    let block_of = vec![0; 21];
    let solved = |start: f64| {
        let mut constraints = flush_faces(counts, 0.0);
        for constraint in &mut constraints {
            constraint.impulse[0] = start;
        }
        let mut velocity = closing(counts, 5);
        let mut system = Solver::default();
        system.load(&constraints, mobility(&inertia, &block_of));
        system.solve(&mut constraints, &mut velocity, EXACT);
        velocity
    };
    let (cold, warm) = (solved(0.0), solved(0.3));
    for (a, b) in cold.iter().flatten().zip(warm.iter().flatten()) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}

#[test]
fn storage_that_has_been_used_gives_the_same_bits_as_new() {
    let inertia = InverseMass::<2>::new(vec![1.0; 21], Vec::new());
    let block_of = vec![0; 21];
    let mut used = Solver::default();
    let mut other = flush_faces([9, 8], 0.2);
    used.load(&other, mobility(&inertia, &block_of));
    used.solve(&mut other, &mut closing([9, 8], 1), EXACT);
    let mut results = [used, Solver::default()].map(|mut system| {
        let mut constraints = flush_faces([12, 9], 0.4);
        let mut velocity = closing([12, 9], 2);
        system.load(&constraints, mobility(&inertia, &block_of));
        system.solve(&mut constraints, &mut velocity, EXACT);
        let impulses = constraints.iter().map(|constraint| constraint.impulse);
        (velocity, impulses.collect::<Vec<_>>())
    });
    assert_eq!(std::mem::take(&mut results[0]), results[1]);
}

/// A row of two-node blocks with consistent masses: an impact at one end must reach all of
/// them.
#[test]
fn a_long_row_of_rigid_masses_is_stopped_as_one() {
    const BLOCKS: u32 = 200;
    let matrix = vec![2.0, 1.0, 1.0, 2.0];
    let dense = (0..BLOCKS as usize).map(|block| (2 * block, matrix.clone()));
    let mut mass = vec![3.0; 2 * BLOCKS as usize];
    mass.push(1e12);
    let inertia = InverseMass::<2>::new(mass, dense.collect());
    let block_of = vec![0; 2 * BLOCKS as usize + 1];
    let mut constraints = vec![contact(&[(0, 1.0), (2 * BLOCKS, -1.0)], 0.0)];
    for block in 1..BLOCKS {
        constraints.push(contact(&[(2 * block, 1.0), (2 * block - 1, -1.0)], 0.0));
    }
    let mut velocity = vec![[0.0, -1.0]; 2 * BLOCKS as usize];
    velocity.push([0.0; 2]);
    let mut system = Solver::default();
    system.load(&constraints, mobility(&inertia, &block_of));
    let residual = system.solve(&mut constraints, &mut velocity, EXACT);
    assert!(residual <= 1e-8, "{residual:e}");
    assert_solved(&constraints, &velocity, 1e-5);
}

#[test]
fn shear_in_space_is_cut_back_along_its_own_direction() {
    let inertia = InverseMass::<3>::new(vec![2.0, 1e300], Vec::new());
    let mut constraints = vec![contact(&[(0, 1.0), (1, -1.0)], 0.5)];
    let mut velocity = vec![[3.0, -4.0, -1.0], [0.0; 3]];
    let mut system = Solver::default();
    system.load(&constraints, mobility(&inertia, &[0, 0]));
    system.solve(&mut constraints, &mut velocity, EXACT);
    let impulse = constraints[0].impulse;
    assert!((impulse[0] - 2.0).abs() < 1e-12 && (shear_norm(&impulse) - 1.0).abs() < 1e-12);
    // From 5 m/s, by μ times the normal impulse over the mass.
    for (got, start) in velocity[0].iter().zip([3.0, -4.0]) {
        assert!((got - 0.9 * start).abs() < 1e-12);
    }
}

/// Returns `of` blocks of `size` nodes with unequal masses. The first `dense` of them have a
/// dense mass matrix.
fn blocks<const D: usize>(
    [size, dense, of]: [usize; 3],
    random: &mut fastrand::Rng,
) -> InverseMass<D> {
    let mut mass: Vec<f64> = (0..of * size).map(|_| 0.5 + random.f64()).collect();
    let mut matrices = Vec::new();
    for first in (0..dense).map(|block| block * size) {
        let own = &mut mass[first..first + size];
        let mut matrix = vec![0.02; size * size];
        for (a, mass) in own.iter_mut().enumerate() {
            matrix[a * (size + 1)] += *mass;
            *mass += 0.02 * size as f64;
        }
        matrices.push((first, matrix));
    }
    InverseMass::new(mass, matrices)
}

/// Returns contacts between random nodes of one block and of another: more than one thread
/// solves alone.
fn contacts_between<const D: usize>(
    [size, _, count]: [usize; 3],
    random: &mut fastrand::Rng,
) -> Vec<Constraint<D>> {
    let mut pick = |block: usize| (block * size + random.usize(0..size)) as u32;
    let contact = |k: usize| {
        let [one, other] = [k % count, (k + 1 + k / 40) % count];
        let [a, b, c] = [pick(one), pick(other), pick(other)];
        let weights = [(a, 1.0), (b, -0.4), (c, -0.6)];
        contact(if b == c { &weights[..2] } else { &weights }, 0.3)
    };
    (0..400).map(contact).collect()
}

/// Nodes must get exactly the impulses of their contacts, with lumped and dense masses and
/// damping, and with prescribed nodes, some in one component, that change between solves.
/// Reused memory must give the same bits as new.
fn nodes_get_what_contacts_bear<const D: usize>(shape: [usize; 3]) {
    let mut random = fastrand::Rng::with_seed(11);
    let (size, mut inertia) = (shape[0], blocks::<D>(shape, &mut random));
    let nodes = inertia.mass().len();
    let constraints = contacts_between::<D>(shape, &mut random);
    let start: Vec<[f64; D]> = (0..nodes)
        .map(|_| [(); D].map(|()| random.f64() - 0.5))
        .collect();
    let damping: Vec<f64> = (0..shape[2]).map(|_| random.f64()).collect();
    let block_of: Vec<u32> = (0..nodes).map(|node| (node / size) as u32).collect();
    let mut used = Solver::default();
    for (whole, last) in [(17, 19), (13, 19), (1000, 1000), (17, 19)] {
        let hold = |node: usize| {
            let mut held = [node.is_multiple_of(whole); D];
            held[D - 1] |= node.is_multiple_of(last);
            held
        };
        inertia.set_prescribed(&(0..nodes).map(hold).collect::<Vec<_>>());
        let mobility = KickMobility {
            inertia: &inertia,
            block_of: &block_of,
            damping: &damping,
            interval: 0.5,
        };
        let solved = |system: &mut Solver<D>, from: &[[f64; D]]| {
            let (mut constraints, mut velocity) = (constraints.clone(), from.to_vec());
            system.load(&constraints, mobility);
            system.solve(&mut constraints, &mut velocity, EXACT);
            (constraints, velocity)
        };
        let (loaded, velocity) = solved(&mut used, &start);
        assert_eq!(velocity, solved(&mut Solver::default(), &start).1);
        let mut expected = start.clone();
        for constraint in &loaded {
            let push = |node, impulse: &[f64; D]| mobility.push(node, impulse, &mut expected);
            constraint
                .jacobian
                .apply_transpose(&constraint.impulse, push);
        }
        assert!(loaded.iter().any(|c| c.impulse[0] > 0.1));
        for (found, expected) in velocity.iter().flatten().zip(expected.iter().flatten()) {
            // Up to 2000 sweeps change a node some 50 times each, at velocities of some m/s.
            assert!(
                (found - expected).abs() < 5e-11,
                "{shape:?}: {found} {expected}"
            );
        }
        let mut asked = constraints.clone();
        for constraint in &mut asked {
            constraint.target[0] = 1.0;
        }
        used.load(&asked, mobility);
        let mut moved = vec![[0.0; D]; nodes];
        for (node, velocity) in used.solve_from_rest(&asked, EXACT) {
            moved[node as usize] = velocity;
        }
        let mut velocity = vec![[0.0; D]; nodes];
        used.solve(&mut asked, &mut velocity, EXACT);
        assert_eq!(moved, velocity);
    }
}

/// The blocks have more nodes than a SIMD block. Impulses on the large ones act by columns, and
/// some of their nodes have no contact.
#[test]
fn nodes_get_the_impulses_of_their_own_contacts() {
    for shape in [[12, 6, 12], [90, 6, 12]] {
        nodes_get_what_contacts_bear::<2>(shape);
    }
    nodes_get_what_contacts_bear::<3>([12, 6, 12]);
}

#[test]
#[ignore = "slow study: lumped and dense masses, alone and together"]
fn nodes_of_all_masses_get_the_impulses_of_their_own_contacts() {
    for shape in [
        [12, 0, 12],
        [12, 6, 12],
        [12, 12, 12],
        [90, 6, 12],
        [90, 12, 12],
    ] {
        nodes_get_what_contacts_bear::<2>(shape);
        nodes_get_what_contacts_bear::<3>(shape);
    }
}

/// In a block of consistent mass, components of nodes without a contact are prescribed and
/// freed.
#[test]
fn what_is_held_may_change_between_solves() {
    // Mass matrix of a square of 1 kg with nodes numbered 00, 01, 10, 11.
    let unit = [4.0, 2.0, 2.0, 1.0].map(|x: f64| x / 36.0);
    let matrix: Vec<f64> = (0..16).map(|k| unit[(k / 4) ^ (k % 4)]).collect();
    let mut inertia = InverseMass::<2>::new(vec![0.25, 0.25, 0.25, 0.25, 1.0], vec![(0, matrix)]);
    let block_of = [0; 5];
    let solve = |system: &mut Solver<2>, inertia: &InverseMass<2>| {
        let mut constraints = vec![contact(&[(0, 0.5), (1, 0.5), (4, -1.0)], 0.5)];
        let mut velocity = vec![[0.1, -1.0], [0.0, -1.0], [0.2, 0.3], [0.0, 0.5], [0.0, 0.4]];
        system.load(&constraints, mobility(inertia, &block_of));
        system.solve(&mut constraints, &mut velocity, EXACT);
        (constraints[0].impulse, velocity)
    };
    let mut kept = Solver::default();
    for held in [[false; 2], [true; 2], [true, false], [false; 2]] {
        inertia.set_prescribed(&[[false; 2], [false; 2], held, [false, held[0]], [false; 2]]);
        let found = solve(&mut kept, &inertia);
        assert_eq!(found, solve(&mut Solver::default(), &inertia), "{held:?}");
        if held == [true; 2] {
            assert_eq!(found.1[2], [0.2, 0.3], "held");
        }
    }
}

/// The first of two nodes of an edge is prescribed, wholly or along the normal. It moves against a
/// wall. The contact point is at any distance from it.
#[test]
fn a_contact_row_with_a_short_lever_has_no_impulse() {
    let short = SHORT_LEVER_SQUARED.sqrt();
    for held in [[true; 2], [false, true]] {
        let mut inertia = InverseMass::<2>::new(vec![1.0; 3], Vec::new());
        inertia.set_prescribed(&[held, [false; 2], [true; 2]]);
        for lever in [0.5, 0.1, 1.01 * short, 0.99 * short, 1e-3, 1e-6] {
            let weights = [(0, 1.0 - lever), (1, lever), (2, -1.0)];
            let mut constraints = vec![contact(&weights, 0.0)];
            let mut velocity = vec![[0.0, -1.0], [0.0; 2], [0.0; 2]];
            let mut system = Solver::default();
            system.load(&constraints, mobility(&inertia, &[0, 0, 0]));
            system.solve(&mut constraints, &mut velocity, EXACT);
            let followed = if lever > short {
                (1.0 - lever) / lever
            } else {
                0.0
            };
            let error = velocity[1][1] - followed;
            assert!(error.abs() <= 1e-12, "{held:?}, {lever}: {velocity:?}");
        }
    }
}

/// Two contacts between the same two nodes have targets that exclude each other. The solve is given
/// up. Impulses move apart by no more than their targets ask for in each sweep.
#[test]
fn contacts_that_contradict_each_other_stay_near_the_impulses_they_had() {
    let inertia = InverseMass::<2>::new(vec![1.0; 2], Vec::new());
    let asked = 1e-3;
    for start in [[0.5, 0.5], [2.0, -1.0]] {
        let mut constraints = vec![contact(&[(0, 1.0), (1, -1.0)], 0.0); 2];
        for (constraint, (sign, start)) in constraints.iter_mut().zip([1.0, -1.0].iter().zip(start))
        {
            constraint.target[0] = sign * asked;
            constraint.bounds.tension = f64::INFINITY;
            constraint.impulse[0] = start;
        }
        let mut velocity = vec![[0.0, -1.0], [0.0, 1.0]];
        let mut system = Solver::default();
        system.load(&constraints, mobility(&inertia, &[0, 0]));
        let kick = Precision {
            residual: 0.1 * KICK_RESIDUAL,
            velocity: 0.0,
        };
        let residual = system.solve(&mut constraints, &mut velocity, kick);
        let impulses = [0, 1].map(|k| constraints[k].impulse[0]);
        // A visit changes the relative velocity by the difference of the targets. An impulse of
        // 1 N·s makes 2 m/s. There are some 40 sweeps and two descents of a few steps, each of
        // which goes no farther than a few sweeps.
        let scale = 2.0 * f64::max(impulses[0].abs(), impulses[1].abs());
        assert!(
            (residual * scale / (2.0 * asked) - 1.0).abs() < 1e-9,
            "{residual:e}"
        );
        let apart = impulses[0] - impulses[1] - (start[0] - start[1]);
        assert!(apart.abs() <= 200.0 * asked, "{start:?}: {apart}");
        let speed = velocity[0][1] - velocity[1][1];
        assert!(speed.abs() <= asked * (1.0 + 1e-9), "{velocity:?}");
    }
}

#[test]
fn a_velocity_that_is_no_number_is_no_solution() {
    let inertia = InverseMass::<2>::new(vec![1.0; 2], Vec::new());
    let mut constraints = vec![contact(&[(0, 1.0), (1, -1.0)], 0.5)];
    let mut velocity = vec![[0.0, f64::NAN], [0.0, 1.0]];
    let mut system = Solver::default();
    system.load(&constraints, mobility(&inertia, &[0, 0]));
    let residual = system.solve(&mut constraints, &mut velocity, EXACT);
    assert_eq!(residual, f64::INFINITY);
}
