//! Checks of contact: models, strengths, pairs.

use crate::math::format::short;
use crate::scene::check::Check;
use crate::scene::check::names::Sort;
use crate::scene::check::value::{BETWEEN_ZERO_AND_ONE, NOT_NEGATIVE, POSITIVE};
use crate::scene::input::{self, Quantity, Stiffness};
use crate::scene::{Contact, ContactModel, ContactPair, KeyPath, Problem, Strength, ZoneExtent};

/// Defaults of `energy_loss` and `max_level`.
const DEFAULT_ENERGY_LOSS: f64 = 0.01;
const DEFAULT_LEVELS: u32 = 5;

/// Largest value of `max_level`.
const DEEPEST_LEVEL: u32 = 16;

impl Check {
    pub(super) fn contact(&mut self, at: &KeyPath, scene: &input::SceneInput) -> Option<Contact> {
        let input = &scene.contact;
        let tolerance = self.optional(&at.key("tolerance"), input.tolerance, POSITIVE);
        let strength = self.strength(at, input);
        let two_scale = self.two_scale(at, input);
        let stiffness = self.stiffness(at, scene);
        let pair = self.pairs(&at.key("pair"), input);
        let (energy_loss, max_level) = two_scale?;
        let (normal_stiffness, shear_stiffness) = stiffness?;
        Some(Contact {
            model: input.model,
            tolerance: tolerance?,
            strength: strength?,
            energy_loss,
            max_level,
            zone: input
                .zone
                .filter(|_| input.model == ContactModel::TwoScale)
                .unwrap_or(ZoneExtent::Graded),
            normal_stiffness,
            shear_stiffness,
            pair: pair?,
        })
    }

    fn strength(&mut self, at: &KeyPath, input: &input::ContactInput) -> Option<Strength> {
        let friction_angle = self.friction(at, input.friction_angle);
        let cohesion = self.number(&at.key("cohesion"), input.cohesion, NOT_NEGATIVE);
        let tensile = self.number(
            &at.key("tensile_strength"),
            input.tensile_strength,
            NOT_NEGATIVE,
        );
        Some(Strength {
            friction_angle: friction_angle?,
            cohesion: cohesion?,
            tensile_strength: tensile?,
        })
    }

    /// Checks accepted loss and largest level of refinement.
    fn two_scale(&mut self, at: &KeyPath, input: &input::ContactInput) -> Option<(f64, u32)> {
        if input.model != ContactModel::TwoScale {
            for (key, given) in [
                ("energy_loss", input.energy_loss.is_some()),
                ("max_level", input.max_level.is_some()),
                ("zone", input.zone.is_some()),
            ] {
                self.ignored_without(at, key, given, "contact.model = \"two-scale\"");
            }
        }
        let energy_loss = self.optional(
            &at.key("energy_loss"),
            input.energy_loss,
            BETWEEN_ZERO_AND_ONE,
        );
        let max_level = input.max_level.unwrap_or(i64::from(DEFAULT_LEVELS));
        let levels = u32::try_from(max_level).ok();
        let Some(levels) = levels.filter(|&levels| levels <= DEEPEST_LEVEL) else {
            let message = format!("must be 0 to {DEEPEST_LEVEL}, got {max_level}");
            self.report(at.key("max_level"), message);
            return None;
        };
        let is_used = input.model == ContactModel::TwoScale;
        let energy_loss = energy_loss?.filter(|_| is_used);
        let levels = if is_used { levels } else { DEFAULT_LEVELS };
        Some((energy_loss.unwrap_or(DEFAULT_ENERGY_LOSS), levels))
    }

    /// Checks normal and shear stiffness of the penalty model.
    fn stiffness(
        &mut self,
        at: &KeyPath,
        scene: &input::SceneInput,
    ) -> Option<(Option<f64>, Option<f64>)> {
        let input = &scene.contact;
        let (normal, shear) = self.stiffnesses(
            at,
            input.model,
            input.normal_stiffness,
            input.shear_stiffness,
        )?;
        if input.model == ContactModel::Penalty && normal.is_none() {
            let help = stiffness_hint(scene);
            let problem = Problem::new(
                at.key("normal_stiffness"),
                "the penalty model needs this key",
            );
            self.problems.push(problem.of_key().help(help));
            return None;
        }
        Some((normal, shear.or(normal)))
    }

    /// Checks the two stiffnesses of `[contact]` or of a pair.
    fn stiffnesses(
        &mut self,
        at: &KeyPath,
        model: ContactModel,
        normal: Option<Quantity<Stiffness>>,
        shear: Option<Quantity<Stiffness>>,
    ) -> Option<(Option<f64>, Option<f64>)> {
        let mut checked = [None, None];
        let keys = [("normal_stiffness", normal), ("shear_stiffness", shear)];
        for (out, (key, value)) in checked.iter_mut().zip(keys) {
            let checked = self.optional(&at.key(key), value, POSITIVE);
            let is_used = model == ContactModel::Penalty;
            let ignored = value.is_some() && !is_used;
            self.ignored_without(at, key, ignored, "contact.model = \"penalty\"");
            *out = checked.map(|value| value.filter(|_| is_used));
        }
        let [normal, shear] = checked;
        Some((normal?, shear?))
    }

    fn pairs(&mut self, at: &KeyPath, input: &input::ContactInput) -> Option<Vec<ContactPair>> {
        let pairs = input.pair.iter().enumerate();
        let checked: Vec<_> = pairs
            .map(|(i, pair)| self.pair(&at.index(i), input.model, pair))
            .collect();
        checked.into_iter().collect()
    }

    fn pair(
        &mut self,
        at: &KeyPath,
        model: ContactModel,
        input: &input::ContactPairInput,
    ) -> Option<ContactPair> {
        let between = self.between(at, input.between.as_deref());
        let friction_angle = match input.friction_angle {
            None => Some(None),
            Some(angle) => self.friction(at, angle).map(Some),
        };
        let cohesion = self.optional(&at.key("cohesion"), input.cohesion, NOT_NEGATIVE);
        let tensile = self.optional(
            &at.key("tensile_strength"),
            input.tensile_strength,
            NOT_NEGATIVE,
        );
        let stiffness = self.stiffnesses(at, model, input.normal_stiffness, input.shear_stiffness);
        let (normal_stiffness, shear_stiffness) = stiffness?;
        Some(ContactPair {
            between: between?,
            friction_angle: friction_angle?,
            cohesion: cohesion?,
            tensile_strength: tensile?,
            normal_stiffness,
            shear_stiffness,
            enabled: input.enabled,
        })
    }

    /// Checks that the names are two blocks or two materials.
    fn between(&mut self, at: &KeyPath, input: Option<&[String]>) -> Option<[String; 2]> {
        let input = self.required(at, "between", input, "between = [\"left\", \"right\"]")?;
        let path = at.key("between");
        let [first, second] = input else {
            self.report(path, format!("expected two names, got {}", input.len()));
            return None;
        };
        let both = |sort| self.names.contains(sort, first) && self.names.contains(sort, second);
        match (both(Sort::Block), both(Sort::Material)) {
            (true, true) => {
                let message = "these are names of blocks and of materials";
                let problem = Problem::new(path, message);
                self.problems
                    .push(problem.help("rename the blocks or the materials"));
                None
            }
            (false, false) => {
                self.neither(&path, [first, second]);
                None
            }
            (true, false) if first == second && !self.names.splits().any(|name| name == first) => {
                self.report(
                    path,
                    format!("\"{first}\" twice: a block does not touch itself"),
                );
                None
            }
            _ => Some([first.clone(), second.clone()]),
        }
    }

    /// Reports names that are neither two blocks nor two materials.
    fn neither(&mut self, path: &KeyPath, names: [&String; 2]) {
        let is = |sort, name: &str| self.names.contains(sort, name);
        let known = names.map(|name| is(Sort::Block, name) || is(Sort::Material, name));
        if known == [true, true] {
            let message = "expected two blocks or two materials, got one of each";
            self.report(path.clone(), message);
            return;
        }
        // If the other name is known, it tells which sort is meant.
        let material = names
            .iter()
            .any(|name| !is(Sort::Block, name) && is(Sort::Material, name));
        let sort = if material {
            Sort::Material
        } else {
            Sort::Block
        };
        for (i, name) in names.into_iter().enumerate() {
            if !known[i] {
                self.reference(&path.index(i), sort, name);
            }
        }
    }
}

/// Returns advice on a usual stiffness: that of the stiffest material, to the order of magnitude.
fn stiffness_hint(scene: &input::SceneInput) -> String {
    let moduli = scene.material.iter().filter_map(|m| m.young_modulus);
    let stiffest = moduli.map(Quantity::si).fold(0.0, f64::max);
    if scene.dimension == Some(2) {
        let thickness = scene.thickness.map_or(1.0, Quantity::si);
        let value = stiffest * thickness;
        return format!(
            "about young_modulus × thickness: normal_stiffness = {}, in N/m",
            short(value)
        );
    }
    format!(
        "about young_modulus × the edge of an element: {} times its length in m, in N/m",
        short(stiffest)
    )
}
