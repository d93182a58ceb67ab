//! Runs that skip pairs against runs that test all pairs.

use crate::contact::detection::separation_bounds::SeparationBounds;
use crate::mesh::{ElementKind, tests};
use crate::model::Model;
use crate::refinement::dimension::{PLANE, SOLID, Space};
use crate::scene::{Block, ContactModel, Damping, Geometry, Material, MaterialModel, Scene};
use crate::step::Run;

/// Distance of the centres of blocks, m.
const PITCH: f64 = 1.5;

/// Blocks in a row.
const ROW: usize = 3;

/// Index of the centre of a block in the grid.
fn cell<const D: usize>(number: usize) -> [f64; D] {
    std::array::from_fn(|c| ((number / ROW.pow(c as u32)) % ROW) as f64)
}

/// Boxes of sizes 1, 1/3 and 1/9 at all angles about a fixed one.
fn blocks<const D: usize>() -> Vec<Block> {
    let count = ROW.pow(D as u32);
    let boxes = (0..count).map(|number| {
        let half = 0.5 * 3.0_f64.powi(-((number * 7 % 3) as i32));
        let geometry = Geometry::Box {
            min: vec![-half; D],
            max: vec![half; D],
            divisions: vec![1; D],
            element: if D == 2 {
                ElementKind::Tri3
            } else {
                ElementKind::Hex8
            },
        };
        let mut block = tests::block(&format!("box{number}"), geometry);
        block.rotate.angle = 0.3 + number as f64;
        if D == 3 {
            let axis = [0.6, 0.0, 0.8];
            block.rotate.axis = axis;
        }
        block.translate = cell::<D>(number).map(|x| PITCH * x).to_vec();
        block.fixed = number == count / 2;
        block
    });
    boxes.collect()
}

/// The blocks, with waves of about 1 m/s, moving towards the one in their middle.
fn run<const D: usize>(space: Space<D>) -> Run<D> {
    let mut scene: Scene = tests::scene(D, blocks::<D>());
    scene.material.push(Material {
        name: "rock".to_owned(),
        model: MaterialModel::Elastic,
        young_modulus: 1.0,
        poisson_ratio: 0.2,
        density: 1.0,
        damping: Damping::default(),
    });
    scene.time.end = 1e3;
    scene.time.step = Some(1.0);
    scene.contact.model = ContactModel::UnifiedNode;
    let mesh = tests::shapes(scene.block.clone()).expect("boxes mesh");
    let built = Model::build(&mut scene, mesh, space).expect("the scene is whole");
    let mut run = Run::new(built);
    run.set_velocities(&|place| {
        let mut velocity = [0.0; 3];
        for (c, x) in place.into_iter().enumerate().take(D) {
            // One velocity for each block, towards the middle and a little past it.
            let cell = (x / PITCH).round();
            velocity[c] = -0.05 * (cell - 1.0) + 0.01 * (cell + c as f64);
        }
        velocity
    });
    run
}

/// Steps both runs until `enough` contacts have begun. Returns the number of skipped pairs.
fn compare<const D: usize>(space: Space<D>, enough: u64) -> usize {
    let mut runs = [run(space), run(space)];
    let all = runs[1].contacts.as_mut().expect("many blocks");
    all.model_data.examined_distance = f64::INFINITY;
    all.workspace.islands_outdated = true;
    runs[1].prepare();
    let mut left_out = 0;
    for step in 0.. {
        let contacts = runs[0].contacts.as_ref().expect("many blocks");
        if contacts.contacts_begun() > enough {
            break;
        }
        assert!(step < 300, "{} contacts", contacts.contacts_begun());
        for island in &contacts.state.islands {
            left_out += not_looked_at(&island.separation_bounds, 0.01 * runs[0].model.step);
        }
        runs.iter_mut().for_each(Run::step);
        let [one, other] = &runs;
        assert_eq!(one.state.velocity, other.state.velocity, "step {step}");
        assert_eq!(one.state.displacement, other.state.displacement, "{step}");
        let [one, other] = [one, other].map(|run| run.contacts.as_ref().expect("many blocks"));
        assert_eq!(one.energies(), other.energies(), "step {step}");
    }
    let contacts = runs[1].contacts.as_ref().expect("many blocks");
    let islands = &contacts.state.islands;
    assert!(
        islands
            .iter()
            .all(|island| not_looked_at(&island.separation_bounds, 0.0) == 0)
    );
    left_out
}

/// Number of pairs that are skipped in a drift of `duration` seconds.
fn not_looked_at(near: &SeparationBounds, duration: f64) -> usize {
    near.pairs().count() - near.clone().may_touch(duration).count()
}

#[test]
fn pairs_left_out_change_nothing_in_the_plane() {
    assert!(compare(PLANE, 12) > 100);
}

#[test]
fn pairs_left_out_change_nothing_in_space() {
    assert!(compare(SOLID, 4) > 100);
}
