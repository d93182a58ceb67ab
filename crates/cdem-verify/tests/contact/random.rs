//! Random shapes and numbers.

use fastrand::Rng;

/// A number in [low, high).
pub(crate) fn between(random: &mut Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * random.f64()
}

/// A convex polygon of `count` corners on a circle, none too sharp.
pub(crate) fn polygon(
    random: &mut Rng,
    centre: [f64; 2],
    radius: f64,
    count: usize,
) -> Vec<[f64; 2]> {
    let part = std::f64::consts::TAU / count as f64;
    let start = between(random, 0.0, part);
    let mut corner = |k: usize| {
        let angle = start + part * (k as f64 + between(random, -0.25, 0.25));
        [
            centre[0] + radius * angle.cos(),
            centre[1] + radius * angle.sin(),
        ]
    };
    (0..count).map(&mut corner).collect()
}
