//! The first touch of two convex cells, as the search finds it, against brute
//! force over all pairs and against separating planes: convex bodies are apart
//! if and only if the normal of a face, or of two edges, has them apart.

use fastrand::Rng;

use super::outline::Outline;
use super::search::Patches;
use super::shell::Shell;
use super::surface::{Nearness, Pair, Positions, Surface};
use crate::mesh::{Block, Element, ElementKind, Mesh};
use crate::vector::{add, add_scaled, cross, dot, norm, sub};

/// Instants at which separating planes are looked for.
const SAMPLES: usize = 40;

/// Tolerance of contact of cells of size 1, m.
const TOLERANCE: f64 = 1e-6;

/// Two cells, and velocities that keep each of them convex and its faces plane:
/// x' = v + G (x − centre).
#[derive(Default)]
struct Meeting<const D: usize> {
    mesh: Mesh<D>,
    velocity: Vec<[f64; D]>,
}

/// A dimension: its cells, surfaces and the axes that may separate.
trait Space<const D: usize> {
    const KINDS: &'static [ElementKind];
    fn surface(mesh: &Mesh<D>) -> Box<dyn Surface<D>>;
    fn corners(kind: ElementKind) -> Vec<[f64; D]>;
    /// Directions whose span holds that of a separating plane's normal.
    fn axes(faces: [Vec<Vec<[f64; D]>>; 2]) -> Vec<[f64; D]>;
    /// A turn by some angles.
    fn turn(x: &[f64; D], angles: [f64; 3]) -> [f64; D];
}

struct Plane;

impl Space<2> for Plane {
    const KINDS: &'static [ElementKind] = &[ElementKind::Tri3, ElementKind::Quad4];

    fn surface(mesh: &Mesh<2>) -> Box<dyn Surface<2>> {
        Box::new(Outline::new(mesh, 1.0))
    }

    fn corners(kind: ElementKind) -> Vec<[f64; 2]> {
        match kind {
            ElementKind::Tri3 => vec![[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5]],
            _ => vec![[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]],
        }
    }

    fn axes(faces: [Vec<Vec<[f64; 2]>>; 2]) -> Vec<[f64; 2]> {
        let along = |face: &Vec<[f64; 2]>| sub(&face[1], &face[0]);
        let edges = faces.iter().flatten().map(along);
        edges.map(|[x, y]| [y, -x]).collect()
    }

    fn turn([x, y]: &[f64; 2], [angle, ..]: [f64; 3]) -> [f64; 2] {
        let (s, c) = angle.sin_cos();
        [c * x - s * y, s * x + c * y]
    }
}

struct Solid;

impl Space<3> for Solid {
    const KINDS: &'static [ElementKind] =
        &[ElementKind::Tet4, ElementKind::Wedge6, ElementKind::Hex8];

    fn surface(mesh: &Mesh<3>) -> Box<dyn Surface<3>> {
        Box::new(Shell::new(mesh, TOLERANCE))
    }

    fn corners(kind: ElementKind) -> Vec<[f64; 3]> {
        let square = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
        let base = if kind == ElementKind::Hex8 {
            &square[..]
        } else {
            &square[..3]
        };
        let at = |z: f64| base.iter().map(move |[x, y]| [*x, *y, z]);
        match kind {
            ElementKind::Tet4 => at(-0.5).chain([[-0.5, -0.5, 0.5]]).collect(),
            _ => at(-0.5).chain(at(0.5)).collect(),
        }
    }

    fn axes(faces: [Vec<Vec<[f64; 3]>>; 2]) -> Vec<[f64; 3]> {
        let normal =
            |face: &Vec<[f64; 3]>| cross(&sub(&face[1], &face[0]), &sub(&face[2], &face[0]));
        let mut axes: Vec<[f64; 3]> = faces.iter().flatten().map(normal).collect();
        let edges = faces.map(|faces| {
            let along = |face: Vec<[f64; 3]>| {
                let next = face.clone().into_iter().cycle().skip(1);
                face.into_iter()
                    .zip(next)
                    .map(|(a, b)| sub(&b, &a))
                    .collect::<Vec<_>>()
            };
            faces.into_iter().flat_map(along).collect::<Vec<_>>()
        });
        for one in &edges[0] {
            axes.extend(edges[1].iter().map(|other| cross(one, other)));
        }
        axes
    }

    fn turn(x: &[f64; 3], angles: [f64; 3]) -> [f64; 3] {
        let mut x = *x;
        for (axis, angle) in angles.into_iter().enumerate() {
            let (s, c) = angle.sin_cos();
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            (x[i], x[j]) = (c * x[i] - s * x[j], s * x[i] + c * x[j]);
        }
        x
    }
}

fn number(random: &mut Rng, size: f64) -> f64 {
    size * (2.0 * random.f64() - 1.0)
}

/// What is drawn at random.
#[derive(Clone, Copy, Debug)]
struct Draw {
    /// Positions, angles and velocities are few round numbers: much is parallel,
    /// flush and head-on.
    degenerate: bool,
    /// Thickness of the second cell, m.
    thickness: f64,
    /// Relative motion of the two, m.
    motion: f64,
}

impl<const D: usize> Meeting<D> {
    fn random<S: Space<D>>(random: &mut Rng, draw: Draw) -> Self {
        let mut meeting = Self::default();
        let direction: [f64; D] = std::array::from_fn(|_| number(random, 1.0));
        for number_of in 0..2 {
            let kind = S::KINDS[random.usize(..S::KINDS.len())];
            let quarter = std::f64::consts::FRAC_PI_4;
            let angles = [0; 3].map(|_| {
                if draw.degenerate {
                    quarter * f64::from(random.u8(..4))
                } else {
                    number(random, 4.0)
                }
            });
            let sign = if number_of == 0 { -1.0 } else { 1.0 };
            let away = sign * (0.6 + 0.5 * draw.motion) / norm(&direction).max(0.1);
            let centre: [f64; D] = std::array::from_fn(|c| {
                if draw.degenerate {
                    f64::from(random.i8(-4..=4)) * 0.25 + if c == 0 { 1.25 * sign } else { 0.0 }
                } else {
                    away * direction[c] + number(random, 0.4)
                }
            });
            let (mean, gradient) = Self::motion(random, draw, &direction, sign);
            let nodes = S::corners(kind).into_iter().map(|mut corner| {
                if number_of == 1 {
                    corner[D - 1] *= draw.thickness;
                }
                let from = S::turn(&corner, angles);
                let mut v = mean;
                for (v, row) in v.iter_mut().zip(&gradient) {
                    *v += dot(row, &from);
                }
                (add(&centre, &from), v)
            });
            meeting.push(kind, nodes);
        }
        meeting
    }

    /// Adds a cell with the places and velocities of its nodes.
    fn push(&mut self, kind: ElementKind, nodes: impl Iterator<Item = ([f64; D], [f64; D])>) {
        let number = self.mesh.blocks.len();
        let first = self.mesh.nodes.len() as u32;
        for (place, velocity) in nodes {
            self.mesh.nodes.push(place);
            self.velocity.push(velocity);
        }
        let nodes = first..self.mesh.nodes.len() as u32;
        let numbers: Vec<u32> = nodes.clone().collect();
        self.mesh.elements.push(Element::new(kind, &numbers));
        self.mesh.blocks.push(Block {
            name: String::new(),
            source: number,
            nodes,
            elements: number as u32..number as u32 + 1,
        });
    }

    fn motion(
        random: &mut Rng,
        draw: Draw,
        direction: &[f64; D],
        sign: f64,
    ) -> ([f64; D], [[f64; D]; D]) {
        if draw.degenerate {
            let mean = std::array::from_fn(|c| {
                let along = if c == 0 { -sign } else { 0.0 };
                along + 0.5 * f64::from(random.i8(-1..=1))
            });
            return (mean, [[0.0; D]; D]);
        }
        let towards = -sign * (0.6 + draw.motion) / norm(direction).max(0.1);
        let mean = std::array::from_fn(|c| towards * direction[c] + number(random, 0.3));
        let gradient = std::array::from_fn(|_| std::array::from_fn(|_| number(random, 0.3)));
        (mean, gradient)
    }

    /// The same, seen by an observer elsewhere, who may name the cells the other
    /// way round.
    fn seen_from<S: Space<D>>(&self, angles: [f64; 3], shift: [f64; D], swapped: bool) -> Self {
        let mut meeting = Self::default();
        let order = if swapped { [1, 0] } else { [0, 1] };
        for block in order.map(|old| &self.mesh.blocks[old]) {
            let kind = self.mesh.elements[block.elements.start as usize].kind;
            let turned = |node: u32| {
                let place = S::turn(&self.mesh.nodes[node as usize], angles);
                let velocity = S::turn(&self.velocity[node as usize], angles);
                (add(&place, &shift), velocity)
            };
            meeting.push(kind, block.nodes.clone().map(turned));
        }
        meeting
    }

    /// Distance of the two cells along the axis that has them farthest apart, m;
    /// negative where no plane separates them.
    fn separation<S: Space<D>>(&self, time: f64) -> f64 {
        let at = |node: u32| {
            let mut x = self.mesh.nodes[node as usize];
            add_scaled(&mut x, time, &self.velocity[node as usize]);
            x
        };
        let [one, other] = [0, 1].map(|b: usize| {
            let nodes = self.mesh.blocks[b].nodes.clone();
            nodes.map(at).collect::<Vec<_>>()
        });
        let faces = [0, 1].map(|e: usize| {
            let element = &self.mesh.elements[e];
            let facets = element.kind.facets().iter();
            let corners = |facet: &&[u8]| {
                let nodes = facet.iter().map(|&i| at(element.nodes()[i as usize]));
                nodes.collect::<Vec<_>>()
            };
            facets.map(corners).collect::<Vec<_>>()
        });
        let apart = |axis: &[f64; D]| {
            let range = |nodes: &[[f64; D]]| {
                let along = nodes.iter().map(|x| dot(x, axis));
                along.fold((f64::MAX, f64::MIN), |(low, high), x| {
                    (low.min(x), high.max(x))
                })
            };
            let (a, b) = (range(&one), range(&other));
            (b.0 - a.1).max(a.0 - b.1) / norm(axis)
        };
        let axes = S::axes(faces).into_iter().filter(|axis| norm(axis) > 1e-9);
        axes.map(|axis| apart(&axis)).fold(f64::MIN, f64::max)
    }

    /// The first touch within a second: of all pairs, and of those that the
    /// broad phase and nearness leave.
    fn first_touch<S: Space<D>>(&self) -> [Option<f64>; 2] {
        let surface = S::surface(&self.mesh);
        let still = vec![[0.0; D]; self.mesh.nodes.len()];
        let at = Positions::new(&self.mesh.nodes, &still);
        let end = at.after(&self.velocity, 1.0);
        let block = |nodes: &[u32]| u32::from(nodes[0] >= self.mesh.blocks[1].nodes.start);
        let apart = |pair: &Pair| {
            block(surface.main_nodes(pair.main)) != block(surface.target_nodes(pair.target))
                && surface.matches(*pair)
        };
        let touch = |pair: Pair| {
            let time = surface.time_of_impact(pair, at, &self.velocity, 1.0, TOLERANCE)?;
            let then = at.after(&self.velocity, time);
            surface.rightful(pair, [then, end], TOLERANCE).map(|_| time)
        };
        let first = |pairs: Vec<Pair>| pairs.into_iter().filter_map(touch).min_by(f64::total_cmp);
        let fastest = self.velocity.iter().map(norm).fold(0.0, f64::max);
        let reach = 2.0 * fastest;
        let mut all = Vec::new();
        for [mains, targets] in surface.families() {
            for main in mains {
                all.extend(targets.clone().map(|target| Pair { main, target }));
            }
        }
        all.retain(apart);
        let block_of: Vec<u32> = (0..self.mesh.nodes.len() as u32)
            .map(|node| block(&[node]))
            .collect();
        let patches = Patches::new(&*surface, &block_of, &self.mesh.nodes);
        let margin = |_| 0.5 * (reach + TOLERANCE);
        let mut near = patches.overlapping(&*surface, at, &margin, &|[a, b]| a != b);
        near.retain(|pair| surface.nearness(*pair, at, reach, TOLERANCE) == Nearness::Near);
        [first(all), first(near)]
    }
}

/// Judges `count` random meetings; returns how many touch.
fn judge<const D: usize, S: Space<D>>(seed: u64, count: usize, draw: Draw) -> usize {
    let mut random = Rng::with_seed(seed);
    let mut touching = 0;
    for case in 0..count {
        let meeting = Meeting::<D>::random::<S>(&mut random, draw);
        if meeting.separation::<S>(0.0) < 1e-3 * draw.thickness {
            continue;
        }
        let [brute, found] = meeting.first_touch::<S>();
        // Of pairs that touch at once, each has its own round-off.
        let same = brute.is_some() == found.is_some()
            && brute
                .zip(found)
                .is_none_or(|(one, other)| (one - other).abs() < 1e-10);
        assert!(same, "{draw:?} case {case}: {brute:?} {found:?}");
        let until = found.unwrap_or(1.0);
        // What sinks in is the tolerance of feet that pass a corner.
        for k in 0..=SAMPLES {
            let time = until * k as f64 / SAMPLES as f64;
            let apart = meeting.separation::<S>(time);
            assert!(
                apart > -1e-8,
                "{draw:?} case {case}: {apart:e} at {time} of {found:?}"
            );
        }
        if let Some(time) = found {
            touching += 1;
            let apart = meeting.separation::<S>(time);
            assert!(
                apart < 1e-8,
                "{draw:?} case {case}: {apart:e} apart at {time}"
            );
        }
        if !draw.degenerate && case % 4 == 0 {
            let angles = [0; 3].map(|_| number(&mut random, 3.0));
            let shift = std::array::from_fn(|_| number(&mut random, 5.0));
            let other = meeting.seen_from::<S>(angles, shift, case % 8 == 0);
            let [_, again] = other.first_touch::<S>();
            assert_eq!(found.is_some(), again.is_some(), "{draw:?} case {case}");
            let late = found
                .zip(again)
                .map_or(0.0, |(one, other)| (one - other).abs());
            // Round-off of positions, 1e-15, at the slowest approach drawn.
            assert!(late < 1e-9, "{draw:?} case {case}: {late:e}");
        }
    }
    touching
}

const PLAIN: Draw = Draw {
    degenerate: false,
    thickness: 1.0,
    motion: 1.0,
};

/// All draws, `count` times each in either dimension.
fn judge_all(count: usize) {
    let degenerate = Draw {
        degenerate: true,
        ..PLAIN
    };
    let plate = Draw {
        thickness: 0.01,
        ..PLAIN
    };
    let shot = Draw {
        thickness: 0.01,
        motion: 100.0,
        ..PLAIN
    };
    for (seed, draw) in [PLAIN, degenerate, plate, shot].into_iter().enumerate() {
        let seed = seed as u64;
        let touching = [
            judge::<2, Plane>(seed, count, draw),
            judge::<3, Solid>(seed, count, draw),
        ];
        assert!(
            touching.iter().all(|&n| n > count / 4),
            "{draw:?}: {touching:?}"
        );
    }
}

#[test]
fn search_brute_force_and_separating_planes_agree() {
    judge_all(300);
}

#[test]
#[ignore = "slow study: a hundred thousand meetings of each draw"]
fn search_brute_force_and_separating_planes_agree_a_hundred_thousand_times() {
    judge_all(100_000);
}
