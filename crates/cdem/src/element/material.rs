//! Materials for the kernels and the contact solver.

use crate::scene::{self, Damping, Plane};

/// Isotropic linear elasticity in Lamé's constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Elastic {
    /// First Lamé constant λ, Pa.
    pub lame_lambda: f64,
    /// Second Lamé constant μ, Pa.
    pub shear_modulus: f64,
    /// Density, kg/m³.
    pub density: f64,
    /// Damping of the blocks of this material.
    pub damping: Damping,
}

impl Elastic {
    /// Computes the constants of a material of the scene.
    #[must_use]
    pub(crate) fn new(material: &scene::Material) -> Self {
        let (young, poisson) = (material.young_modulus, material.poisson_ratio);
        Self {
            lame_lambda: young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
            shear_modulus: young / (2.0 * (1.0 + poisson)),
            density: material.density,
            damping: material.damping,
        }
    }

    /// Returns the speed of compression waves in the unbounded solid, √((λ+2μ)/ρ), m/s.
    #[must_use]
    pub(crate) fn p_wave_speed(&self) -> f64 {
        ((self.lame_lambda + 2.0 * self.shear_modulus) / self.density).sqrt()
    }

    /// Returns the λ that relates in-plane stress and strain in 2-D: λ itself in plane strain,
    /// 2λμ/(λ+2μ) in plane stress, Pa.
    #[must_use]
    pub(crate) fn in_plane_lambda(&self, plane: Plane) -> f64 {
        let (lambda, mu) = (self.lame_lambda, self.shear_modulus);
        match plane {
            Plane::Strain => lambda,
            Plane::Stress => 2.0 * lambda * mu / (lambda + 2.0 * mu),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::MaterialModel;

    fn granite() -> Elastic {
        Elastic::new(&scene::Material {
            name: "granite".into(),
            model: MaterialModel::Elastic,
            young_modulus: 40e9,
            poisson_ratio: 0.25,
            density: 2700.0,
            damping: Damping::default(),
        })
    }

    #[test]
    fn constants_and_speeds_of_the_papers_rock() {
        let rock = granite();
        // ν = 1/4 makes both Lamé constants 2E/5.
        assert!((rock.lame_lambda / 16e9 - 1.0).abs() < 1e-15);
        assert!((rock.shear_modulus / 16e9 - 1.0).abs() < 1e-15);
        // Compression waves are √3 times as fast as shear waves.
        let shear_waves = (rock.shear_modulus / rock.density).sqrt();
        assert!((rock.p_wave_speed() / shear_waves - 3f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn plane_stress_leaves_no_stress_across() {
        // E/(1-ν²) = λ* + 2μ.
        let rock = granite();
        let plane = rock.in_plane_lambda(Plane::Stress) + 2.0 * rock.shear_modulus;
        assert!((plane / (40e9 / (1.0 - 0.0625)) - 1.0).abs() < 1e-15);
        assert_eq!(rock.in_plane_lambda(Plane::Strain), rock.lame_lambda);
    }
}
