//! Free flight: momenta are conserved, and bodies rotate by Euler's equations.

use cdem::mesh::ElementKind;
use cdem::output::Frame;
use cdem::scene::{Kinematics, Mass};
use cdem_verify::{Case, load, tetrahedra};
use nalgebra::{Matrix3, Vector3};

use crate::shared::{cross, from_file, length, minus};

const BOTH: [Kinematics; 2] = [Kinematics::Total, Kinematics::Incremental];

/// Returns the second moments ∫ x xᵀ dV about the centroid, and the volume, of elements with plane
/// faces, as sums over tetrahedra.
fn moments(frame: &Frame) -> (Matrix3<f64>, f64) {
    let (mut second, mut first, mut volume) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
    let mut rest = frame.connectivity.as_slice();
    for &kind in &frame.kinds {
        let (nodes, after) = rest.split_at(kind.node_count());
        rest = after;
        for corners in tetrahedra(kind) {
            let corners = corners.map(|c| Vector3::from(frame.points[nodes[c] as usize]));
            let [a, b, c] = [1, 2, 3].map(|k| corners[k] - corners[0]);
            let part = a.dot(&b.cross(&c)).abs() / 6.0;
            let sum: Vector3<f64> = corners.iter().sum();
            let squares: Matrix3<f64> = corners.iter().map(|x| x * x.transpose()).sum();
            second += (squares + sum * sum.transpose()) * (part / 20.0);
            first += sum * (part / 4.0);
            volume += part;
        }
    }
    (second - first * first.transpose() / volume, volume)
}

/// A rigid body: attitude and constant angular momentum.
struct RigidBody {
    inverse_inertia: Matrix3<f64>,
    momentum: Vector3<f64>,
    attitude: Matrix3<f64>,
}

impl RigidBody {
    fn new(second: &Matrix3<f64>, spin: &[f64; 3]) -> Self {
        let inertia = Matrix3::identity() * second.trace() - second;
        Self {
            inverse_inertia: inertia.try_inverse().expect("a body has inertia"),
            momentum: inertia * Vector3::from(*spin),
            attitude: Matrix3::identity(),
        }
    }

    fn spin(&self, attitude: &Matrix3<f64>) -> Vector3<f64> {
        attitude * self.inverse_inertia * attitude.transpose() * self.momentum
    }

    /// Advances by `time` with the fourth-order Runge-Kutta method.
    fn advance(&mut self, time: f64) {
        const STEPS: usize = 20;
        let h = time / STEPS as f64;
        let rate = |r: &Matrix3<f64>| self.spin(r).cross_matrix() * r;
        let mut r = self.attitude;
        for _ in 0..STEPS {
            let k1 = rate(&r);
            let k2 = rate(&(r + k1 * (0.5 * h)));
            let k3 = rate(&(r + k2 * (0.5 * h)));
            let k4 = rate(&(r + k3 * h));
            r += (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
        }
        self.attitude = r;
    }
}

/// Worst errors of a flight.
#[derive(Default)]
struct Errors {
    substeps: u64,
    momentum: f64,
    angular_momentum: f64,
    path: f64,
    spin: f64,
}

/// Runs `case` to its end and compares it with the exact motion several hundred times.
fn fly(case: &Case) -> Errors {
    let mut simulation = case.start();
    let space = case.scene.dimension == 3;
    let start = simulation.history();
    let at_start = simulation.block_rows().remove(0);
    let spin_start = at_start.angular_velocity;
    let mut body = space.then(|| {
        let (second, _) = moments(&simulation.frame());
        RigidBody::new(&second, &spin_start)
    });
    let turning =
        |momentum: &[f64; 3], at: &[f64; 3], linear: &[f64; 3]| minus(momentum, &cross(at, linear));
    let about = turning(&start.angular_momentum, &at_start.position, &start.momentum);
    // At most Σm|v| and Σm|x − x_c||v|, to which the limits refer.
    let scales = [length(&start.momentum), length(&about)];
    let stride = (simulation.step_count() / 400).max(1);
    let (mut errors, mut last) = (Errors::default(), 0.0);
    let levels = simulation.overview().levels.len() as u32 - 1;
    while !simulation.finished() {
        simulation.step().expect("free flight goes on");
        if !simulation.step_index().is_multiple_of(stride) {
            continue;
        }
        let time = simulation.time();
        let row = simulation.history();
        let block = simulation.block_rows().remove(0);
        let now = turning(&row.angular_momentum, &block.position, &row.momentum);
        let momentum = length(&minus(&row.momentum, &start.momentum)) / scales[0];
        errors.momentum = errors.momentum.max(momentum);
        errors.angular_momentum = errors
            .angular_momentum
            .max(length(&minus(&now, &about)) / scales[1]);
        let straight = std::array::from_fn(|c| at_start.position[c] + at_start.velocity[c] * time);
        let path = length(&minus(&block.position, &straight));
        errors.path = errors.path.max(path / (length(&at_start.velocity) * time));
        let exact = match &mut body {
            Some(body) => {
                body.advance(time - last);
                body.spin(&body.attitude).into()
            }
            None => spin_start,
        };
        last = time;
        let spin = length(&minus(&block.angular_velocity, &exact)) / length(&spin_start);
        errors.spin = errors.spin.max(spin);
    }
    errors.substeps = simulation.step_index() << levels;
    errors
}

fn judge(what: &str, errors: &Errors) {
    println!(
        "{what}: {} substeps, momentum {:.1e}, angular momentum {:.1e}, path {:.1e}, spin {:.1e}",
        errors.substeps, errors.momentum, errors.angular_momentum, errors.path, errors.spin
    );
    // Round-off of sums: 1e-12 over 1e5 substeps and 1e-11 over 3e7. Both grow as the square root
    // of the number of substeps.
    let limit = 1e-12 * (errors.substeps as f64 / 1e5).max(1.0).sqrt();
    assert!(errors.momentum < limit, "momentum");
    assert!(errors.angular_momentum < limit, "angular momentum");
    assert!(errors.path < limit, "path");
    assert!(errors.spin < 0.01, "spin");
}

#[test]
fn blocks_spin_in_the_plane() {
    let shapes: [(&str, &[usize], ElementKind, Mass); 3] = [
        ("quad4, one", &[1, 1], ElementKind::Quad4, Mass::Auto),
        ("tri3, two", &[1, 1], ElementKind::Tri3, Mass::Auto),
        (
            "tri3, 6 × 3, fitted",
            &[6, 3],
            ElementKind::Tri3,
            Mass::Fitted,
        ),
    ];
    for kinematics in BOTH {
        for (what, divisions, shape, mass) in shapes {
            let mut case = load("free-flight-2d");
            case.divide("block", divisions, shape);
            if mass == Mass::Fitted {
                case.scene.time.end = 5.0;
            }
            let block = &mut case.scene.block[0];
            (block.kinematics, block.mass) = (kinematics, mass);
            judge(&format!("{what}, {kinematics:?}"), &fly(&case));
        }
        let mut case = load("free-flight-2d");
        from_file(&mut case, "triangle.msh");
        case.scene.block[0].kinematics = kinematics;
        judge(&format!("tri3, one, {kinematics:?}"), &fly(&case));
    }
}

/// Gmsh's tetrahedra have nodes far out: their lumped masses have a quarter too much inertia.
#[test]
fn a_freely_meshed_cube_has_the_inertia_of_a_cube() {
    let mut simulation = load("spinning-cube").start();
    let row = simulation.history();
    println!("{:?} N m s, {} J", row.angular_momentum, row.kinetic_energy);
    assert!((row.angular_momentum[2] / 400.0 - 1.0).abs() < 1e-12);
    assert!(
        row.angular_momentum[..2]
            .iter()
            .all(|l| l.abs() < 1e-12 * 400.0)
    );
    assert!((row.kinetic_energy / 200.0 - 1.0).abs() < 1e-12);
    assert_eq!(simulation.warnings(), [""; 0]);
}

/// Moments of inertia of the T-handle about the axes of its bar, its stem, and across both, in units
/// of the mass and squared edge of a cube.
fn handle_moments() -> [f64; 3] {
    // Centres of the cubes: along the stem, along the bar.
    let cubes = [(0, -2), (0, -1), (0, 0), (0, 1), (0, 2), (1, 0), (2, 0)];
    let count = cubes.len() as f64;
    let centre = cubes.iter().map(|&(stem, _)| f64::from(stem)).sum::<f64>() / count;
    let own = count / 6.0;
    let about_stem: f64 = cubes.iter().map(|&(_, bar)| f64::from(bar * bar)).sum();
    let arm = |&(stem, _): &(i32, i32)| (f64::from(stem) - centre).powi(2);
    let about_bar: f64 = cubes.iter().map(arm).sum();
    [
        about_bar + own,
        about_stem + own,
        about_bar + about_stem + own,
    ]
}

/// Returns K(m) by the arithmetic-geometric mean.
fn complete_elliptic_integral(m: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - m).sqrt());
    for _ in 0..8 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    std::f64::consts::FRAC_PI_2 / a
}

/// Returns the interval between two flips, s, of a body with these moments of inertia, smallest
/// first, and initial rates of turn about its intermediate and its largest axis, rad/s. The first
/// flip is after half of it.
fn flip_interval([a, b, c]: [f64; 3], [middle, largest]: [f64; 2]) -> f64 {
    let momentum = (b * middle).powi(2) + (c * largest).powi(2);
    let energy = b * middle * middle + c * largest * largest;
    let rate = ((c - b) * (momentum - energy * a) / (a * b * c)).sqrt();
    let m = (b - a) * (energy * c - momentum) / ((c - b) * (momentum - energy * a));
    2.0 * complete_elliptic_integral(m) / rate
}

/// Returns the instants, s, in the middle of the intervals in which `values` are above the mean of
/// their extremes.
fn middles_of_peaks(values: &[(f64, f64)]) -> Vec<f64> {
    let of = values.iter().map(|&(_, value)| value);
    let (low, high) = (of.clone().fold(f64::MAX, f64::min), of.fold(0.0, f64::max));
    let level = 0.5 * (low + high);
    let mut crossings = Vec::new();
    for pair in values.windows(2) {
        let [(start, a), (end, b)] = [pair[0], pair[1]];
        if (a > level) != (b > level) {
            crossings.push(start + (end - start) * (level - a) / (b - a));
        }
    }
    let peaks = crossings.chunks_exact(2);
    peaks.map(|pair| 0.5 * (pair[0] + pair[1])).collect()
}

/// The squared rate of turn is largest where the body turns over: energy and momentum leave one
/// free number, and the rate about the intermediate axis vanishes there.
#[test]
fn a_t_handle_flips_when_euler_says() {
    let case = load("t-handle");
    let mut simulation = case.start();
    let mut rates = Vec::new();
    while !simulation.finished() {
        simulation.step().expect("a sound run");
        if simulation.step_index().is_multiple_of(16) {
            let spin = simulation.block_rows()[0].angular_velocity;
            rates.push((simulation.time(), length(&spin).powi(2)));
        }
    }
    let interval = flip_interval(handle_moments(), [25.0, 1.25]);
    let flips = middles_of_peaks(&rates);
    assert_eq!(flips.len(), 3, "{flips:?}");
    for (number, flip) in flips.iter().enumerate() {
        let miss = flip / ((number as f64 + 0.5) * interval) - 1.0;
        println!("flip {number} at {flip} s, {miss:.1e} from the exact time");
        // Vibrations of the start change the rates by the square of the speed of the ends over that
        // of waves, 1e-4. The time to a flip is the logarithm of the small rate over the growth.
        assert!(miss.abs() < 1e-3, "{miss:e}");
    }
}

/// Flies single elements of three shapes.
fn single_elements_tumble(turns: f64) {
    for kinematics in BOTH {
        for file in ["", "tetrahedron.msh", "wedge.msh"] {
            let mut case = load("free-flight-3d");
            if !file.is_empty() {
                from_file(&mut case, file);
            }
            case.scene.time.end *= turns / 10.0;
            case.scene.block[0].kinematics = kinematics;
            judge(&format!("{file} {kinematics:?}"), &fly(&case));
        }
    }
}

#[test]
fn single_elements_tumble_as_euler_says() {
    single_elements_tumble(2.0);
}

#[test]
#[ignore = "slow study: ten turns of single elements"]
fn single_elements_tumble_for_ten_turns() {
    single_elements_tumble(10.0);
}

/// Flies meshed blocks with the default masses.
fn meshed_blocks_tumble(turns: f64) {
    let shapes: [(&[usize], ElementKind); 3] = [
        (&[6, 4, 2], ElementKind::Hex8),
        (&[6, 4, 2], ElementKind::Tet4),
        (&[6, 4, 2], ElementKind::Wedge6),
    ];
    for kinematics in BOTH {
        for (divisions, shape) in shapes {
            let mut case = load("free-flight-3d");
            case.divide("block", divisions, shape);
            case.scene.time.end *= turns / 10.0;
            case.scene.block[0].kinematics = kinematics;
            case.scene.block[0].mass = Mass::Auto;
            judge(
                &format!("{shape:?} {divisions:?} {kinematics:?}"),
                &fly(&case),
            );
        }
    }
}

#[test]
fn meshed_blocks_tumble_as_euler_says() {
    meshed_blocks_tumble(0.5);
}

#[test]
#[ignore = "slow study: ten turns of meshed blocks"]
fn meshed_blocks_tumble_for_ten_turns() {
    meshed_blocks_tumble(10.0);
}
