//! Fixed blocks that overlap each other.

use cdem::scene::Rotation;
use cdem_verify::{Case, Random, load};
use nalgebra::Vector3;

/// Returns two fixed cubes of 1 m, turned in any way, whose centres are less than 0.8 m apart, and a
/// free cube above them.
fn any_overlap(random: &mut Random) -> Case {
    let mut case = load("aligned-edges");
    let mut free = case.block("top").clone();
    free.name = "free".into();
    free.translate = vec![0.0, 3.0, 0.0];
    for (name, reach) in [("base", 0.0), ("top", 0.8)] {
        let block = case.block(name);
        let mut direction = || Vector3::from([(); 3].map(|()| random.between(-1.0, 1.0)));
        let (axis, way) = (direction().normalize(), direction().normalize());
        block.rotate = Rotation {
            axis: axis.into(),
            angle: random.between(0.0, std::f64::consts::TAU),
        };
        block.translate = (way * reach * random.between(0.0, 1.0)).as_slice().to_vec();
        block.fixed = true;
    }
    case.scene.block.push(free);
    case
}

#[test]
fn fixed_blocks_may_overlap_in_any_way() {
    let mut random = Random(5);
    for _ in 0..1000 {
        let mut simulation = any_overlap(&mut random).start();
        simulation.step().expect("it falls");
        assert_eq!(simulation.contacts_begun(), 0);
        assert_eq!(simulation.warnings(), [""; 0]);
    }
}
