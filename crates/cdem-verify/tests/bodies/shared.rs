//! Functions shared by these tests.

use cdem::Simulation;
use cdem::output::{FieldValues, Frame};
use cdem::scene::{Field, Geometry};
use cdem_verify::Case;

/// Returns the shear wave speed of the first material, m/s.
pub(crate) fn shear_wave_speed(case: &Case) -> f64 {
    let rock = &case.scene.material[0];
    (rock.young_modulus / (2.0 * (1.0 + rock.poisson_ratio) * rock.density)).sqrt()
}

/// Replaces the block's mesh by a file in the folder of the scene.
pub(crate) fn from_file(case: &mut Case, path: &str) {
    case.scene.block[0].geometry = Geometry::Mesh {
        path: path.into(),
        group: None,
    };
}

pub(crate) fn length(v: &[f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

pub(crate) fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub(crate) fn minus(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[c] - b[c])
}

/// Returns initial positions and displacements of all nodes. The scene must write the field.
pub(crate) fn displacements(simulation: &mut Simulation) -> Vec<([f64; 3], [f64; 3])> {
    let frame = simulation.frame();
    let field = vectors(&frame, "displacement");
    let points = frame.points.iter().zip(field);
    points.map(|(now, u)| (minus(now, &u), u)).collect()
}

fn vectors(frame: &Frame, name: &str) -> Vec<[f64; 3]> {
    let field = frame.point_fields.iter().find(|field| field.name == name);
    let field = field.expect("the scene asks for the field");
    let FieldValues::Real(values) = &field.values else {
        panic!("{name} is real");
    };
    let width = field.components.len();
    let vector = |of: &[f64]| std::array::from_fn(|c| if c < width { of[c] } else { 0.0 });
    values.chunks_exact(width).map(vector).collect()
}

/// Lamé's mode of pure shear in a unit square (see the head of the scene).
#[derive(Clone, Copy)]
pub(crate) struct LameMode {
    /// Angular frequency, rad/s.
    pub(crate) omega: f64,
    /// Amplitude, m. Strains are 3e-6, so the geometry is linear to 1e-5.
    pub(crate) amplitude: f64,
}

impl LameMode {
    pub(crate) fn new(case: &Case) -> Self {
        let wave_number = std::f64::consts::PI;
        Self {
            omega: wave_number * 2.0_f64.sqrt() * shear_wave_speed(case),
            amplitude: 1e-6,
        }
    }

    /// Starts the scene from the undeformed state with the velocities of the mode.
    pub(crate) fn start(self, case: &mut Case) -> Simulation {
        case.scene.output.fields = vec![Field::Displacement, Field::Velocity];
        let mut simulation = case.start();
        simulation.set_initial_velocities(&|at| {
            Self::shape(&at).map(|u| self.amplitude * self.omega * u)
        });
        simulation
    }

    fn shape(at: &[f64; 3]) -> [f64; 3] {
        let [x, y] = [at[0], at[1]].map(|x| std::f64::consts::PI * x);
        [x.cos() * y.sin(), -x.sin() * y.cos(), 0.0]
    }

    /// Returns the rms error of the displacements over the rms of the mode at its largest.
    pub(crate) fn error(self, simulation: &mut Simulation) -> f64 {
        let factor = self.amplitude * (self.omega * simulation.time()).sin();
        let mut sums = [0.0; 2];
        for (at, u) in displacements(simulation) {
            let shape = Self::shape(&at);
            for c in 0..3 {
                sums[0] += (u[c] - factor * shape[c]).powi(2);
                sums[1] += (self.amplitude * shape[c]).powi(2);
            }
        }
        (sums[0] / sums[1]).sqrt()
    }
}
