//! The near pairs against all pairs, whatever the history of the search.

use proptest::prelude::*;

use crate::contact::detection::candidates::{CandidateSearch, SearchContext, StepSpeeds};
use crate::contact::detection::clusters::Clusters;
use crate::contact::surface::boundary_2d::Boundary2d;
use crate::contact::surface::boundary_3d::Boundary3d;
use crate::contact::surface::{Configuration, Distance, Pair, Topology};
use crate::math::vector::{add, cross, norm, scale};
use crate::mesh::{self, Element, ElementKind, Mesh, MeshBlock};
use crate::scene::Geometry;

const TOLERANCE: f64 = 1e-3;

/// Triangles with their own sizes, speeds and rotations. Every fifth is fixed.
#[derive(Clone, Debug)]
struct Stone {
    centre: [f64; 2],
    radius: f64,
    velocity: [f64; 2],
    spin: f64,
}

impl Stone {
    fn corner(&self, corner: u32, time: f64) -> [f64; 2] {
        let angle = std::f64::consts::TAU * f64::from(corner) / 3.0 + self.spin * time;
        let centre: [f64; 2] = std::array::from_fn(|c| self.centre[c] + time * self.velocity[c]);
        [
            centre[0] + self.radius * angle.cos(),
            centre[1] + self.radius * angle.sin(),
        ]
    }

    /// Largest speed of a corner, m/s.
    fn speed(&self) -> f64 {
        self.velocity[0].hypot(self.velocity[1]) + self.radius * self.spin.abs()
    }
}

fn stones() -> impl Strategy<Value = Vec<Stone>> {
    let radius = prop_oneof![0.05..0.1_f64, 0.4..1.0_f64, Just(6.0)];
    // Most are slow, and a few very fast.
    let speed = prop_oneof![4 => -0.1..0.1_f64, 1 => -20.0..20.0_f64, 1 => Just(0.0)];
    let stone = (
        [-3.0..3.0_f64, -3.0..3.0_f64],
        radius,
        [speed.clone(), speed],
        -1.0..1.0_f64,
    );
    let stone = stone.prop_map(|(centre, radius, velocity, spin)| Stone {
        centre,
        radius,
        velocity,
        spin,
    });
    proptest::collection::vec(stone, 2..20)
}

/// The stones, and their data for a search.
struct Crowd {
    stones: Vec<Stone>,
    boundary: Boundary2d,
    clusters: Clusters,
    block_of: Vec<u32>,
    fixed: Vec<bool>,
    speeds: Vec<f64>,
}

impl Crowd {
    fn new(mut stones: Vec<Stone>) -> Self {
        let fixed: Vec<bool> = (0..stones.len()).map(|number| number % 5 == 0).collect();
        for (stone, _) in stones.iter_mut().zip(&fixed).filter(|(_, fixed)| **fixed) {
            (stone.velocity, stone.spin) = ([0.0; 2], 0.0);
        }
        let mut mesh = Mesh::<2>::default();
        for (number, stone) in (0..).zip(&stones) {
            let nodes = [3 * number, 3 * number + 1, 3 * number + 2];
            mesh.nodes
                .extend((0..3).map(|corner| stone.corner(corner, 0.0)));
            mesh.elements.push(Element::new(ElementKind::Tri3, &nodes));
            mesh.blocks.push(MeshBlock {
                name: String::new(),
                source: 0,
                nodes: nodes[0]..nodes[2] + 1,
                elements: number..number + 1,
            });
        }
        let boundary = Boundary2d::new(&mesh, 1.0);
        let block_of: Vec<u32> = (0..mesh.nodes.len() as u32).map(|node| node / 3).collect();
        let speeds: Vec<f64> = stones.iter().map(Stone::speed).collect();
        Self {
            clusters: Clusters::new(&boundary, &block_of, &mesh.nodes),
            boundary,
            block_of,
            fixed,
            speeds,
            stones,
        }
    }

    fn positions(&self, time: f64) -> Vec<[f64; 2]> {
        let corners = |stone| (0..3).map(move |corner| Stone::corner(stone, corner, time));
        self.stones.iter().flat_map(corners).collect()
    }

    fn blocks(&self) -> SearchContext<'_, 2> {
        SearchContext {
            surface: &self.boundary,
            clusters: &self.clusters,
            block_of: &self.block_of,
            fixed: &self.fixed,
            resolution: TOLERANCE,
        }
    }

    fn may_meet(&self, [a, b]: [u32; 2]) -> bool {
        a != b && !(self.fixed[a as usize] && self.fixed[b as usize])
    }

    /// All pairs that are near for these motion bounds.
    fn near(&self, at: Configuration<2>, motion_bounds: &[f64]) -> Vec<Pair> {
        let blocks = self.blocks();
        let count = self.block_of.len() as u32;
        let all = (0..count).flat_map(|main| (0..count).map(move |target| Pair { main, target }));
        all.filter(|&pair| {
            let motion: f64 = blocks
                .of(pair)
                .map(|block| motion_bounds[block as usize])
                .iter()
                .sum();
            self.may_meet(blocks.of(pair)) && self.boundary.distance(pair, at) <= motion + TOLERANCE
        })
        .collect()
    }
}

fn motion_bounds(search: &CandidateSearch<2>) -> Vec<f64> {
    search
        .blocks
        .iter()
        .map(|bound| bound.motion_bound)
        .collect()
}

proptest! {
    #[test]
    fn all_pairs_near_are_found_whenever_boxes_were_searched(
        stones in stones(),
        step in 0.001..0.05_f64,
        from in 0..30_usize,
    ) {
        let crowd = Crowd::new(stones);
        let still = vec![[0.0; 2]; crowd.block_of.len()];
        let [mut whole, mut late] = [CandidateSearch::default(), CandidateSearch::default()];
        let (speeds, mut near) = (StepSpeeds { touching: &[], bounds: &crowd.speeds, step }, Vec::new());
        for number in 0..40 {
            let nodes = crowd.positions(step * number as f64);
            let at = Configuration::new(&nodes, &still);
            let may_meet = |blocks| crowd.may_meet(blocks);
            for (search, from) in [(&mut whole, 0), (&mut late, from)] {
                if number < from {
                    continue;
                }
                search.track(&crowd.blocks(), at, &[], &may_meet);
                search.find_near(&crowd.blocks(), at, speeds, &may_meet, &mut near);
                prop_assert_eq!(&near, &crowd.near(at, &motion_bounds(search)));
                for pair in &near {
                    // Blocks that may touch may hand on the largest velocity among them.
                    let [a, b] = crowd.blocks().of(*pair).map(|block| block as usize);
                    prop_assert!(crowd.fixed[a] || crowd.fixed[b] || search.blocks[a].motion_bound == search.blocks[b].motion_bound);
                }
            }
        }
    }
}

/// A fixed stone, one beside it and one far off. Neither of these is expected to move by more than
/// 23 mm in the step.
#[test]
fn who_goes_farther_than_reckoned_with_is_told_of_where_it_matters() {
    let stone = |x, radius| Stone {
        centre: [x, 0.0],
        radius,
        velocity: [0.0; 2],
        spin: 0.0,
    };
    let exceeded_bounds = |beside: f64, far: f64| {
        let mut crowd = Crowd::new(vec![stone(0.0, 1.0), stone(2.0, 0.5), stone(50.0, 0.5)]);
        crowd.speeds = vec![0.0, 0.1, 0.1];
        let still = vec![[0.0; 2]; crowd.block_of.len()];
        let mut search = CandidateSearch::default();
        let (mut near, mut exceeded) = (Vec::new(), false);
        for moved in [0.0, 1.0] {
            crowd.stones[1].centre[0] = 2.0 + moved * beside;
            crowd.stones[2].centre[0] = 50.0 + moved * far;
            let nodes = crowd.positions(0.0);
            let (at, may_meet) = (Configuration::new(&nodes, &still), |blocks| {
                crowd.may_meet(blocks)
            });
            let speeds = StepSpeeds {
                touching: &[],
                bounds: &crowd.speeds,
                step: 0.1,
            };
            exceeded = search.track(&crowd.blocks(), at, &near, &may_meet);
            search.find_near(&crowd.blocks(), at, speeds, &may_meet, &mut near);
        }
        exceeded
    };
    assert!(!exceeded_bounds(0.02, -0.02), "no farther than expected");
    assert!(!exceeded_bounds(0.1, 0.1), "farther, but nothing is there");
    assert!(exceeded_bounds(-1.0, 0.0), "to where the fixed stone is");
    assert!(!exceeded_bounds(0.0, 5.0), "far, but nothing is there");
    assert!(exceeded_bounds(0.0, -48.0), "far, to where the others are");
}

/// Blocks closed with a gap at t = 0 are farther apart than they move in a step.
#[test]
fn blocks_in_contact_share_their_motion_bound_across_any_gap() {
    let stone = |x| Stone {
        centre: [x, 0.0],
        radius: 0.5,
        velocity: [0.0; 2],
        spin: 0.0,
    };
    let mut crowd = Crowd::new([0.0, 20.0, 40.0, 60.0].map(stone).to_vec());
    crowd.speeds = vec![0.0, 0.1, 0.0, 0.0];
    let nodes = crowd.positions(0.0);
    let still = vec![[0.0; 2]; nodes.len()];
    let mut search = CandidateSearch::default();
    let speeds = StepSpeeds {
        touching: &[[0, 1], [1, 2], [0, 3]],
        bounds: &crowd.speeds,
        step: 0.1,
    };
    let at = Configuration::new(&nodes, &still);
    let may_meet = |blocks| crowd.may_meet(blocks);
    search.find_near(&crowd.blocks(), at, speeds, &may_meet, &mut Vec::new());
    let [fixed, fast, hit, slow] =
        [0, 1, 2, 3].map(|block: usize| search.blocks[block].motion_bound);
    assert_eq!(hit, fast);
    assert!(fast > 2.0 * slow && slow > fixed, "{fast} {slow} {fixed}");
}

/// Two meshed boxes, one of which overlaps the other at a corner.
fn corner_in_corner() -> Mesh<3> {
    let cube = |min: [f64; 3], max: [f64; 3], divisions: usize| Geometry::Box {
        min: min.to_vec(),
        max: max.to_vec(),
        divisions: vec![divisions; 3],
        element: ElementKind::Hex8,
    };
    let blocks = [
        cube([0.0; 3], [1.0; 3], 6),
        cube([0.8, 0.7, 0.6], [1.8, 1.7, 1.6], 5),
    ];
    let blocks = blocks.map(|geometry| mesh::tests::block("cube", geometry));
    mesh::tests::shapes(blocks.to_vec()).expect("boxes mesh")
}

#[test]
fn clusters_of_meshed_blocks_find_what_all_pairs_of_boxes_do() {
    let mesh = corner_in_corner();
    let boundary = Boundary3d::new(&mesh, TOLERANCE);
    let block_of: Vec<u32> = (0..mesh.nodes.len() as u32)
        .map(|node| u32::from(node >= mesh.blocks[1].nodes.start))
        .collect();
    let still = vec![[0.0; 3]; mesh.nodes.len()];
    let at = Configuration::new(&mesh.nodes, &still);
    let clusters = Clusters::new(&boundary, &block_of, &mesh.nodes);
    for margin in [0.0, 0.02, 0.3] {
        let mut all = Vec::new();
        for [mains, targets] in boundary.families() {
            for main in mains {
                let aabb = boundary.main_box(main, at, margin);
                let block = |nodes: &[u32]| block_of[nodes[0] as usize];
                let pairs = targets.clone().map(|target| Pair { main, target });
                all.extend(pairs.filter(|&pair| {
                    block(boundary.main_nodes(main)) != block(boundary.target_nodes(pair.target))
                        && boundary.is_canonical(pair)
                        && aabb.overlaps(&boundary.target_box(pair.target, at, margin))
                }));
            }
        }
        all.sort_unstable();
        let found = clusters.overlapping(&boundary, at, &|_| margin, &|[a, b]| a != b);
        assert!(all.len() > 100);
        assert_eq!(found, all, "grown by {margin}");
    }
}

/// Cubes side by side and one above the other, nearly flush. Each turns, shears and drifts on its
/// own, by nodes.
#[derive(Clone, Debug)]
struct Heap {
    mesh: Mesh<3>,
    velocity: Vec<[f64; 3]>,
}

fn heaps() -> impl Strategy<Value = Heap> {
    let motion = prop_oneof![Just(0.0), 1e-4..1e-2_f64, 0.02..0.1_f64];
    (motion, 0.0..2.0_f64, any::<u64>()).prop_map(|(motion, apart, seed)| {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut draw = |size: f64| [(); 3].map(|()| size * (2.0 * random.f64() - 1.0));
        let cube = |place: [f64; 3], divisions: usize| Geometry::Box {
            min: place.to_vec(),
            max: place.map(|x| x + 1.0).to_vec(),
            divisions: vec![divisions; 3],
            element: if divisions == 1 {
                ElementKind::Hex8
            } else {
                ElementKind::Tet4
            },
        };
        let gap = 1.0 + apart * TOLERANCE;
        let places = [
            [0.0; 3],
            [gap, 0.2, 0.0],
            [0.4, 0.1, gap],
            [1.5, 0.1, gap],
            [0.3, gap, 0.0],
        ];
        let blocks = places.iter().zip([1, 1, 2, 1, 1]);
        let blocks =
            blocks.map(|(place, divisions)| mesh::tests::block("cube", cube(*place, divisions)));
        let mesh = mesh::tests::shapes(blocks.collect()).expect("boxes mesh");
        let mut velocity = Vec::new();
        for block in &mesh.blocks {
            let (whole, spin) = (draw(motion), draw(motion));
            for node in block.nodes.clone() {
                let own = add(&whole, &draw(0.1 * motion));
                velocity.push(add(&own, &cross(&spin, &mesh.nodes[node as usize])));
            }
        }
        Heap { mesh, velocity }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    #[test]
    fn what_is_left_out_for_how_it_lies_is_found_once_it_may_touch(
        heap in heaps(),
        step in 0.001..0.05_f64,
        from in 0..20_usize,
    ) {
        let mesh = &heap.mesh;
        let boundary = Boundary3d::new(mesh, TOLERANCE);
        let block_of: Vec<u32> = (0..mesh.nodes.len() as u32)
            .map(|node| mesh.blocks.partition_point(|block| block.nodes.end <= node) as u32)
            .collect();
        let fixed = [true, false, false, false, false];
        let blocks = SearchContext {
            surface: &boundary,
            clusters: &Clusters::new(&boundary, &block_of, &mesh.nodes),
            block_of: &block_of,
            fixed: &fixed,
            resolution: TOLERANCE,
        };
        let speed = |node: usize| norm(&heap.velocity[node]);
        let fastest = |block: &MeshBlock| block.nodes.clone().map(|node| speed(node as usize)).fold(0.0, f64::max);
        let speeds: Vec<f64> = mesh.blocks.iter().map(fastest).collect();
        let all: Vec<Pair> = boundary.families().iter().flat_map(|[mains, targets]| {
            let targets = targets.clone();
            mains.clone().flat_map(move |main| targets.clone().map(move |target| Pair { main, target }))
        }).filter(|&pair| {
            let [a, b] = blocks.of(pair);
            a != b && boundary.is_canonical(pair)
        }).collect();
        let [mut whole, mut late] = [CandidateSearch::default(), CandidateSearch::default()];
        let may_meet = |[a, b]: [u32; 2]| a != b;
        let mut displacement = vec![[0.0; 3]; mesh.nodes.len()];
        for number in 0..30 {
            let time = step * f64::from(number);
            for (moved, (block, velocity)) in displacement.iter_mut().zip(block_of.iter().zip(&heap.velocity)) {
                if !fixed[*block as usize] {
                    // To and fro, so that rejected pairs come near again and again.
                    *moved = scale((0.7 * f64::from(number)).sin() * time, velocity);
                }
            }
            let at = Configuration::new(&mesh.nodes, &displacement);
            // The motion bounds are smaller than the displacements of nodes, so that more depends
            // on the bounds.
            let (speeds, mut near) = (StepSpeeds { touching: &[], bounds: &speeds, step: 0.05 * step }, Vec::new());
            for (search, from) in [(&mut whole, 0), (&mut late, from)] {
                if (number as usize) < from {
                    continue;
                }
                search.track(&blocks, at, &[], &may_meet);
                search.find_near(&blocks, at, speeds, &may_meet, &mut near);
                let expected: Vec<Pair> = all.iter().copied().filter(|&pair| {
                    let [a, b] = blocks.of(pair).map(|block| search.blocks[block as usize].motion_bound);
                    boundary.distance(pair, at) <= a + b + TOLERANCE
                        && boundary.exclusion(pair, at, TOLERANCE) <= a + b
                }).collect();
                prop_assert_eq!(&near, &expected);
            }
        }
    }
}

/// Two corners of the face of a cube move away from the cube beside it. The edges from the other
/// corners to the middle of the face sharpen: they could not touch at first, and then may.
#[test]
fn what_was_left_out_comes_near_as_a_face_warps() {
    let cube = |place: [f64; 3]| Geometry::Box {
        min: place.to_vec(),
        max: place.map(|x| x + 1.0).to_vec(),
        divisions: vec![1; 3],
        element: ElementKind::Hex8,
    };
    let blocks = [[0.0; 3], [1.0, 0.3, 0.0]].map(|place| mesh::tests::block("cube", cube(place)));
    let mesh = mesh::tests::shapes(blocks.to_vec()).expect("boxes mesh");
    let boundary = Boundary3d::new(&mesh, TOLERANCE);
    let block_of: Vec<u32> = (0..16).map(|node| node / 8).collect();
    let blocks = SearchContext {
        surface: &boundary,
        clusters: &Clusters::new(&boundary, &block_of, &mesh.nodes),
        block_of: &block_of,
        fixed: &[true, false],
        resolution: TOLERANCE,
    };
    let mut search = CandidateSearch::default();
    let mut left_out: Vec<Pair> = Vec::new();
    let mut near = Vec::new();
    for number in 0..200 {
        let back = 2e-5 * f64::from(number);
        let warped = mesh
            .nodes
            .iter()
            .zip(&block_of)
            .map(|(&[x, y, z], &block)| {
                let drawn = block == 1 && x == 1.0 && (y > 1.0) != (z > 0.5);
                [if drawn { back } else { 0.0 }, 0.0, 0.0]
            });
        let warped: Vec<[f64; 3]> = warped.collect();
        let at = Configuration::new(&mesh.nodes, &warped);
        let speeds = StepSpeeds {
            touching: &[],
            bounds: &[0.0, 1e-3],
            step: 1e-3,
        };
        search.track(&blocks, at, &near, &|[a, b]| a != b);
        search.find_near(&blocks, at, speeds, &|[a, b]| a != b, &mut near);
        if number == 0 {
            let lacking = search
                .candidates
                .iter()
                .filter(|candidate| candidate.exclusion.length > 0.0);
            left_out = lacking.map(|candidate| candidate.pair).collect();
        }
    }
    assert!(left_out.len() > 10, "{}", left_out.len());
    assert!(
        left_out.iter().any(|pair| near.contains(pair)),
        "{left_out:?} {near:?}"
    );
}
