//! Columns of stones that stand on each other: many stacks side by side.

use cdem::Simulation;
use cdem::mesh::ElementKind;

use crate::pieces::{Body, stones_of};
use crate::rocks::{SEED, box_around};
use crate::{Random, load};

/// Half the width of a stone, m, in even and odd stories. The widths differ so that corners of
/// neighbouring stories do not coincide.
const HALVES: [f64; 2] = [0.45, 0.4];

/// Largest rotation of a stone, rad.
const TURN: f64 = 0.05;

/// Builds `along` × `along` columns, each of `stories` stones 1 m high. Each stone has `pieces`
/// hexahedra along an edge. The stones touch from the start and carry no load yet.
///
/// # Panics
/// If the scene `rocks-in-a-box` cannot be read.
#[must_use]
pub fn columns(along: usize, stories: usize, pieces: usize) -> Simulation {
    let mut case = load("rocks-in-a-box");
    box_around(&mut case, [along, along, stories]);
    let mut random = Random(SEED);
    let places =
        (0..along * along * stories).map(|i| [i % along, i / along % along, i / along / along]);
    let stones: Vec<Body> = places
        .map(|place| stone(place, pieces, &mut random))
        .collect();
    case.start_from(|_| stones_of(stones.iter().cloned()))
}

/// Builds the stone at index `place` (column, column, story).
fn stone(place: [usize; 3], pieces: usize, random: &mut Random) -> Body {
    let half = HALVES[place[2] % HALVES.len()];
    let [x, y, z] = place.map(|k| k as f64);
    let (sin, cos) = random.between(-TURN, TURN).sin_cos();
    let corners = [0.0, 1.0].iter().flat_map(|up| {
        let around = [(-half, -half), (half, -half), (half, half), (-half, half)];
        around.map(|(a, b)| {
            [
                x + 0.5 + cos * a - sin * b,
                y + 0.5 + sin * a + cos * b,
                z + up,
            ]
        })
    });
    Body {
        kind: ElementKind::Hex8,
        corners: corners.collect(),
        pieces,
    }
}
