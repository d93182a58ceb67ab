//! Random numbers that are the same on every machine.

/// SplitMix64 (Steele, Lea, Flood 2014) with its seed. It is written here, not taken from a
/// library, because some seeds reproduce a case that once failed and must keep doing so.
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// Returns a number in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        low + (high - low) * (z >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a whole number in `low..=high`.
    pub fn whole(&mut self, low: usize, high: usize) -> usize {
        self.between(low as f64, (high + 1) as f64) as usize
    }

    /// Returns a convex polygon of `count` corners on a circle, without very sharp corners.
    pub fn polygon(&mut self, centre: [f64; 2], radius: f64, count: usize) -> Vec<[f64; 2]> {
        let part = std::f64::consts::TAU / count as f64;
        let start = self.between(0.0, part);
        let corner = |k: usize, random: &mut Self| {
            let angle = start + part * (k as f64 + random.between(-0.25, 0.25));
            [
                centre[0] + radius * angle.cos(),
                centre[1] + radius * angle.sin(),
            ]
        };
        (0..count).map(|k| corner(k, self)).collect()
    }
}
