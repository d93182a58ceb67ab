//! Corrections to Hertz's theory of impact for a ball, which is not a half-space.

use std::f64::consts::{FRAC_PI_2, PI};

/// An elastic ball that hits a rigid wall, and Hertz's solution for it.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// Radius, m.
    pub radius: f64,
    /// Young's modulus, Pa.
    pub young_modulus: f64,
    /// Poisson's ratio.
    pub poisson_ratio: f64,
    /// Density, kg/m³.
    pub density: f64,
    /// Speed before the impact, m/s.
    pub speed: f64,
}

/// Number of points of each quadrature.
const POINTS: usize = 2000;

/// Number of Legendre polynomials in the series. With 3000, the sum for the ball of the scene
/// changes by less than a 100th of the correction.
const DEGREES: usize = 2000;

impl Ball {
    /// Returns the mass, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        4.0 / 3.0 * PI * self.radius.powi(3) * self.density
    }

    fn plane_modulus(&self) -> f64 {
        self.young_modulus / (1.0 - self.poisson_ratio.powi(2))
    }

    /// Returns Hertz's largest approach of the centre to the wall, m.
    fn approach(&self) -> f64 {
        let energy = self.mass() * self.speed.powi(2);
        let stiffness = 16.0 * self.plane_modulus() * self.radius.sqrt();
        (15.0 * energy / stiffness).powf(0.4)
    }

    /// Returns Hertz's contact time, s, and peak force, N.
    #[must_use]
    pub fn hertz(&self) -> [f64; 2] {
        let approach = self.approach();
        let force = 4.0 / 3.0 * self.plane_modulus() * self.radius.sqrt() * approach.powf(1.5);
        [2.94327 * approach / self.speed, force]
    }

    /// Returns contact time and peak force over Hertz's, with an approach that is smaller than
    /// Hertz's by k F/(E R).
    #[must_use]
    pub fn beyond_hertz(&self) -> [f64; 2] {
        let [hertz_time, hertz_force] = self.hertz();
        let less = self.shortfall() / (self.young_modulus * self.radius);
        let hertz = (9.0 / (16.0 * self.plane_modulus().powi(2) * self.radius)).cbrt();
        // The approach is hertz F^(2/3) - less F; its work:
        let work = |force: f64| 0.4 * hertz * force.powf(5.0 / 3.0) - 0.5 * less * force * force;
        let energy = 0.5 * self.mass() * self.speed.powi(2);
        let (mut low, mut high) = (0.5 * hertz_force, 2.0 * hertz_force);
        while high - low > 1e-9 * hertz_force {
            let middle = 0.5 * (low + high);
            *(if work(middle) < energy {
                &mut low
            } else {
                &mut high
            }) = middle;
        }
        let peak = low;
        // With F = peak sin³ the integrand of the time stays finite.
        let time: f64 = midpoints(FRAC_PI_2)
            .map(|(angle, width)| {
                let force = peak * angle.sin().powi(3);
                let rate = 3.0 * peak * angle.sin().powi(2) * angle.cos();
                let nearer = (2.0 / 3.0 * hertz * force.powf(-1.0 / 3.0) - less) * rate * width;
                let slowed = 2.0 * (energy - work(force)) / self.mass();
                2.0 * nearer / slowed.sqrt()
            })
            .sum();
        [time / hertz_time, peak / hertz_force]
    }

    /// Returns how much smaller the approach of the centre of mass is than Hertz's, over F/(E R).
    /// The displacement of the pole under Hertz's pressure is a sum over the spheroidal modes of a
    /// ball of radius 1 and modulus 1 (Love 1927, section 172 onwards). In the mode of degree 1, a
    /// uniform inertia force balances the contact force.
    fn shortfall(&self) -> f64 {
        let circle = (self.approach() / self.radius).sqrt();
        // Cosine of the angle from the pole, and pressure times the measure of the angle.
        let loaded: Vec<(f64, f64)> = midpoints(FRAC_PI_2)
            .map(|(angle, width)| {
                let sine = circle * angle.sin();
                let cosine = (1.0 - sine * sine).sqrt();
                let pressure = 1.5 / (PI * circle * circle) * angle.cos();
                (
                    cosine,
                    pressure * sine * circle * angle.cos() / cosine * width,
                )
            })
            .collect();
        let mut legendre = vec![[0.0, 1.0]; loaded.len()];
        let mut sunk = 0.0;
        for degree in 0..DEGREES {
            let n = degree as f64;
            let moments = legendre
                .iter()
                .zip(&loaded)
                .map(|([_, p], (_, load))| p * load);
            let load = (n + 0.5) * moments.sum::<f64>();
            sunk += load * self.compliance(n);
            for ([before, now], &(x, _)) in legendre.iter_mut().zip(&loaded) {
                let next = ((2.0 * n + 1.0) * x * *now - n * *before) / (n + 1.0);
                (*before, *now) = (*now, next);
            }
        }
        0.75 * (1.0 - self.poisson_ratio.powi(2)) / circle - sunk
    }

    /// Returns the radial displacement at θ = 0 of a ball of radius and modulus 1 under the normal
    /// traction P_n(cos θ).
    fn compliance(&self, n: f64) -> f64 {
        let ratio = self.poisson_ratio;
        let shear = 0.5 / (1.0 + ratio);
        let lame = ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio));
        if n == 0.0 {
            return 1.0 / (3.0 * lame + 2.0 * shear);
        }
        if n == 1.0 {
            return 1.2 / (6.0 * lame + 4.0 * shear);
        }
        // u = A ∇ω + B (r² ∇ω + α x ω), ω = rⁿ P_n; the surface is free of shear.
        let alpha =
            -2.0 * (n * lame + (3.0 * n + 1.0) * shear) / ((n + 3.0) * lame + (n + 5.0) * shear);
        let a = -(2.0 * n + alpha) / (2.0 * (n - 1.0));
        let traction = 2.0 * shear * n * (n - 1.0) * a
            + lame * (2.0 * n + alpha * (n + 3.0))
            + 2.0 * shear * (n + alpha) * (n + 1.0);
        (a * n + n + alpha) / traction
    }
}

/// Returns the midpoints of equal intervals from 0 to `end`, and their width.
fn midpoints(end: f64) -> impl Iterator<Item = (f64, f64)> {
    let width = end / POINTS as f64;
    (0..POINTS).map(move |k| ((k as f64 + 0.5) * width, width))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_ball_lacks_of_a_half_space_grows_with_its_contact_circle() {
        let ball = |speed| Ball {
            radius: 0.1,
            young_modulus: 70e9,
            poisson_ratio: 0.3,
            density: 2699.0,
            speed,
        };
        let [slow, fast] = [0.3, 1.0].map(|speed| ball(speed).beyond_hertz());
        for k in 0..2 {
            // F/(E R) over the approach F^(2/3), with F proportional to v^(6/5), gives v^0.4. The
            // logarithm of the contact circle adds a deviation: 2 % measured.
            let grown = (slow[k] - 1.0) / (fast[k] - 1.0);
            assert!((grown / 0.3_f64.powf(0.4) - 1.0).abs() < 0.05, "{grown}");
        }
    }
}
