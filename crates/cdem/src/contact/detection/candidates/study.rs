//! Cost of the contact search, for a step and block.

#![allow(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "times are the report"
)]

use std::time::{Duration, Instant};

use fastrand::Rng;

use crate::contact::detection::candidates::StepSpeeds;
use crate::mesh::{Element, ElementKind, Mesh, MeshBlock, tests};
use crate::model::Model;
use crate::refinement::dimension::PLANE;
use crate::scene::{Damping, Geometry, Kinematics, Mass, Material, MaterialModel};
use crate::step::Run;

/// Wave speed, m/s; blocks move at up to 1 m/s in each direction.
const WAVE_SPEED: f64 = 100.0;

/// `across`² triangles of one element, rotated at random, nearly packed.
fn crowd(across: usize) -> Run<2> {
    let geometry = Geometry::Polygon {
        corners: Vec::new(),
        size: 1.0,
        element: ElementKind::Tri3,
    };
    let mut source = tests::block("stone", geometry);
    source.mass = Mass::Lumped;
    source.kinematics = Kinematics::Incremental;
    let mut scene = tests::scene(2, vec![source]);
    scene.time.end = 1e3;
    scene.material.push(Material {
        name: "rock".to_owned(),
        model: MaterialModel::Elastic,
        young_modulus: WAVE_SPEED * WAVE_SPEED,
        poisson_ratio: 0.2,
        density: 1.0,
        damping: Damping::default(),
    });
    let mut random = Rng::with_seed(1);
    let mut mesh = Mesh::<2>::default();
    for number in 0..(across * across) as u32 {
        let [column, row] = [number as usize % across, number as usize / across];
        let start = std::f64::consts::TAU * random.f64();
        for corner in 0..3 {
            let angle = start + std::f64::consts::TAU * f64::from(corner) / 3.0;
            let centre = [column, row].map(|i| 2.02 * i as f64);
            mesh.nodes
                .push([centre[0] + angle.cos(), centre[1] + angle.sin()]);
        }
        let first = 3 * number;
        let nodes = [first, first + 1, first + 2];
        mesh.elements.push(Element::new(ElementKind::Tri3, &nodes));
        mesh.blocks.push(MeshBlock {
            name: format!("stone{number}"),
            source: 0,
            nodes: first..first + 3,
            elements: number..number + 1,
        });
    }
    let mut built = Model::build(&mut scene, mesh, PLANE).expect("the scene is whole");
    for nodes in built.state.velocity.chunks_mut(3) {
        nodes.fill([0.0; 2].map(|_: f64| 2.0 * random.f64() - 1.0));
    }
    Run::new(built)
}

/// Mean time of `count` calls.
fn time(count: u32, mut work: impl FnMut()) -> Duration {
    let began = Instant::now();
    (0..count).for_each(|_| work());
    began.elapsed() / count
}

/// Time of each part of the search at one instant.
#[derive(Default)]
struct Cost {
    outlook: Duration,
    broad_phase: Duration,
    filter: Duration,
    joins: Duration,
    grouping: Duration,
}

impl Cost {
    /// Adds the times for the present state, which does not change.
    fn add(&mut self, run: &mut Run<2>) {
        self.outlook += time(3, || run.bound_speeds());
        let speeds = run.workspace.speed_bounds.speeds().to_vec();
        let mut contacts = run.contacts.take().expect("blocks touch");
        let (at, step) = (run.model.positions(&run.state), run.model.step);
        let search = &mut contacts.workspace.search;
        let blocks = contacts.model_data.search_context();
        let may_meet = |blocks| contacts.model_data.may_touch(blocks);
        let near = &mut contacts.state.near_pairs;
        let speeds = StepSpeeds {
            touching: &[],
            bounds: &speeds,
            step,
        };
        let mut find = || {
            search.track(&blocks, at.into(), &[], &may_meet);
            search.find_near(&blocks, at.into(), speeds, &may_meet, near);
        };
        self.filter += time(3, &mut find);
        self.broad_phase += time(1, || search.broad_phase(&blocks, at.into(), &may_meet));
        search.find_near(
            &blocks,
            at.into(),
            speeds,
            &may_meet,
            &mut contacts.state.near_pairs,
        );
        contacts.join(run.state.number);
        let number = run.state.number;
        self.joins += time(3, || assert!(!contacts.join(number)));
        self.grouping += time(3, || {
            contacts.workspace.islands_outdated = true;
            let neighbours = run.workspace.neighbours(&run.model.mesh);
            contacts.group(&run.model.inertia, neighbours);
        });
        run.contacts = Some(contacts);
    }
}

/// Runs a crowd and prints the times of its steps and their searches.
fn measure(across: usize, steps: u32) {
    const LOOKS: u32 = 5;
    let blocks = (across * across) as f64;
    let mut run = crowd(across);
    // Advance until there are collisions.
    (0..steps).for_each(|_| run.step());
    let begun = |run: &Run<2>| {
        run.contacts
            .as_ref()
            .map_or(0, |contacts| contacts.contacts_begun())
    };
    let before = begun(&run);
    let (mut cost, mut searches, mut total) = (Cost::default(), 0_u32, Duration::ZERO);
    for _ in 0..steps {
        total += time(1, || run.step());
        let contacts = run.contacts.as_ref().expect("blocks touch");
        let just_searched = contacts
            .workspace
            .search
            .blocks
            .iter()
            .all(|bound| bound.travel == 0.0);
        searches += u32::from(just_searched);
    }
    let begun = begun(&run) - before;
    // Apart from the steps above, because each measurement makes a new broad phase.
    for _ in 0..LOOKS {
        cost.add(&mut run);
        run.step();
    }
    let contacts = run.contacts.as_ref().expect("blocks touch");
    let [looks, steps] = [LOOKS, steps].map(f64::from);
    let each = |time: Duration, times: f64| time.as_secs_f64() * 1e9 / times / blocks;
    println!(
        "{blocks:>6} blocks: a step takes {:5.0} ns a block; outlook {:3.0}, broad phase {:3.0} \
         ({:4.0} every {:2.0} steps), filter {:3.0}, joins {:3.0}, grouping {:3.0}. A block has \
         {:4.1} candidates, {:.2} near, {:.2} closed; {:.4} begin a step",
        each(total, steps),
        each(cost.outlook, looks),
        each(cost.broad_phase, looks) * f64::from(searches) / steps,
        each(cost.broad_phase, looks),
        steps / f64::from(searches),
        each(cost.filter, looks),
        each(cost.joins, looks),
        each(cost.grouping, looks),
        contacts.workspace.search.candidates.len() as f64 / blocks,
        contacts.state.near_pairs.len() as f64 / blocks,
        contacts.contact_points().count() as f64 / blocks,
        begun as f64 / steps / blocks,
    );
}

#[test]
#[ignore = "slow study: the search in crowds of 1e3 to 1e5 blocks"]
fn the_cost_of_a_search_is_linear() {
    measure(32, 400);
    measure(100, 100);
    measure(316, 50);
}
