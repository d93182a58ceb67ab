//! Pressed blocks: the patch test of contact, with matching and non-matching meshes.

use cdem::mesh::ElementKind::{self, Hex8, Quad4, Tet4, Tri3};
use cdem::output::Frame;

use crate::problem::Findings;
use crate::{load, run, stress_of};

/// Pressure on the upper block, Pa.
const PRESSURE: f64 = 1e6;
const POISSON_RATIO: f64 = 0.25;

/// Element and divisions along each side, of the lower and of the upper block.
pub type Blocks = [(ElementKind, usize); 2];

/// Errors of the elements' mean stress, over the pressure. The error of an element is that of its
/// worst component.
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    /// Largest error of all elements.
    pub largest: f64,
    /// Root mean square over all elements.
    pub rms: f64,
    /// Largest error of elements without a node at the interface.
    pub inside: f64,
    /// Relative error of the force between the blocks.
    pub force: f64,
    /// Deepest penetration, m.
    pub penetration: f64,
}

/// Presses two blocks on each other until they are at rest.
///
/// # Panics
/// If they do not come to rest.
#[must_use]
pub fn press(of: Blocks) -> Errors {
    let dimension = of[0].0.dimension();
    let (scene, across) = if dimension == 2 {
        ("pressed-blocks", 0.0)
    } else {
        let across = POISSON_RATIO / (1.0 - POISSON_RATIO);
        ("pressed-blocks-3d", across)
    };
    let mut case = load(scene);
    for (name, (element, divisions)) in ["lower", "upper"].into_iter().zip(of) {
        case.divide(name, &vec![divisions; dimension], element);
    }
    let mut simulation = case.start();
    run(&mut simulation, |_| {});
    let end = simulation.history();
    assert!(
        end.kinetic_energy.abs() < 1e-9 * end.strain_energy,
        "it rests: {end:?}"
    );

    let along = dimension - 1;
    let mut exact = [0.0; 6];
    exact[..along].fill(-across);
    exact[along] = -1.0;
    let contacts = simulation.contact_frame();
    let force: f64 = contacts.forces.iter().map(|force| force[along].abs()).sum();
    Errors {
        force: force / PRESSURE - 1.0,
        penetration: simulation.max_penetration(),
        ..errors(&simulation.frame(), &exact, along)
    }
}

/// Returns the errors of a frame whose exact stress over the pressure is `exact` everywhere.
fn errors(frame: &Frame, exact: &[f64; 6], along: usize) -> Errors {
    let stress = stress_of(frame);
    let mut rest = frame.connectivity.as_slice();
    let [mut largest, mut squares, mut inside] = [0.0_f64; 3];
    for (kind, stress) in frame.kinds.iter().zip(stress.chunks_exact(6)) {
        let (nodes, after) = rest.split_at(kind.node_count());
        rest = after;
        let wrong = stress
            .iter()
            .zip(exact)
            .map(|(s, e)| (s / PRESSURE - e).abs());
        let worst = wrong.fold(0.0, f64::max);
        largest = largest.max(worst);
        squares += worst * worst;
        // The interface is at a height of 1 m, less its displacement under the load.
        let height = |node: &u32| frame.points[*node as usize][along];
        if !nodes.iter().any(|node| (height(node) - 1.0).abs() < 1e-3) {
            inside = inside.max(worst);
        }
    }
    Errors {
        largest,
        rms: (squares / frame.kinds.len() as f64).sqrt(),
        inside,
        force: 0.0,
        penetration: 0.0,
    }
}

/// V11: a uniform pressure is transferred through the interface of two blocks.
pub(super) fn pressed_blocks() -> Findings {
    const SUNK: &str = "penetrations of a nanometre from the start remain: strains are 2.5e-5";
    let mut findings = Findings::default();
    let cases: [(Blocks, f64, &'static str); 6] = [
        ([(Quad4, 4), (Quad4, 4)], 5e-4, SUNK),
        ([(Quad4, 3), (Quad4, 7)], 5e-4, SUNK),
        ([(Tri3, 4), (Tri3, 7)], 5e-4, SUNK),
        ([(Hex8, 2), (Hex8, 3)], 5e-4, SUNK),
        ([(Tet4, 2), (Hex8, 3)], 1e-4, SUNK),
        (
            [(Tet4, 2), (Hex8, 2)],
            0.17,
            "triangles on quadrilaterals of the same nodes: contact at nodes cannot be uniform; a \
             finer mesh does not help",
        ),
    ];
    for (of, bound, why) in cases {
        let errors = press(of);
        let [(lower, m), (upper, n)] = of;
        let name = format!("{} {m} on {} {n}", lower.name(), upper.name());
        findings
            .figure(
                format!("{name}: largest error of a stress, over the pressure"),
                errors.largest,
            )
            .at_most(bound, why);
        findings
            .figure(
                format!("{name}: error of the force between them"),
                errors.force,
            )
            .at_most(5e-5, "true areas: strains are 2.5e-5");
    }
    findings
}
