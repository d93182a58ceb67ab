//! Checks input and makes the scene: dependencies between keys, ranges, names, defaults.
//!
//! A function of this module returns `None` after it has reported the reason, so one run of the
//! check reports all problems.

pub(crate) mod block;
pub(crate) mod boundary;
pub(crate) mod contact;
pub(crate) mod names;
pub(crate) mod output;
pub(crate) mod value;

use crate::scene::check::names::Names;
use crate::scene::check::value::{BELOW_ONE, FRACTION, NOT_NEGATIVE, POISSON, POSITIVE};
use crate::scene::{
    Damping, Help, KeyPath, Material, Plane, Problem, Scene, Schedule, StopWhen, Time, input,
};

/// Returns the scene that `input` describes, with defaults filled in.
///
/// # Errors
/// All problems of the input.
pub(super) fn check(input: &input::SceneInput) -> Result<Scene, Vec<Problem>> {
    let mut check = Check {
        dimension: 0,
        problems: Vec::new(),
        warnings: Vec::new(),
        names: Names::new(input),
    };
    let scene = check.scene(input);
    scene
        .filter(|_| check.problems.is_empty())
        .ok_or(check.problems)
}

/// The only version of the scene format.
pub(super) const VERSION: u32 = 1;

/// Default of `time.stop_when.during`, as a fraction of the run.
const STOP_DURING: f64 = 0.05;

/// State of a check: the names in the scene, and the problems and warnings found.
struct Check {
    dimension: usize,
    problems: Vec<Problem>,
    warnings: Vec<Problem>,
    names: Names,
}

impl Check {
    fn scene(&mut self, input: &input::SceneInput) -> Option<Scene> {
        let at = KeyPath::root();
        let dimension = self.dimension(&at, input.dimension);
        self.dimension = dimension?;
        self.unique_names(input);
        let (plane, thickness) = self.plane(&at, input);
        let gravity = match &input.gravity {
            None => Some(Schedule::Constant(vec![0.0; self.dimension])),
            Some(gravity) => self.vector_schedule(&at.key("gravity"), gravity),
        };
        if input.time.is_none() {
            let help = Help {
                in_file: "for example: [time]\nend = 1.0".to_owned(),
                in_program: "for example: time = {\"end\": 1.0}".to_owned(),
            };
            self.missing(&at, "time", help);
        }
        let time = input.time.as_ref();
        let time = time.and_then(|time| self.time(&at.key("time"), time));
        if input.block.is_empty() {
            let help = Help::on_list("block", |block| format!("a scene has at least one {block}"));
            self.missing(&at, "block", help);
        }
        let material = self.each(&at.key("material"), &input.material, Self::material);
        let block = self.each(&at.key("block"), &input.block, Self::block);
        let boundary = self.each(&at.key("boundary"), &input.boundary, Self::boundary);
        let load = self.each(&at.key("load"), &input.load, Self::load);
        let contact = self.contact(&at.key("contact"), input);
        let output = self.output(&at.key("output"), &input.output);
        let probe = self.each(&at.key("probe"), &input.probe, Self::probe);
        Some(Scene {
            version: input.version.unwrap_or(VERSION),
            title: input.title.clone(),
            dimension: self.dimension,
            plane,
            thickness: thickness?,
            gravity: gravity?,
            time: time?,
            material: material?,
            block: block?,
            boundary: boundary?,
            load: load?,
            contact: contact?,
            output: output?,
            probe: probe?,
            warnings: std::mem::take(&mut self.warnings),
        })
    }

    fn dimension(&mut self, at: &KeyPath, dimension: Option<u32>) -> Option<usize> {
        match self.required(at, "dimension", dimension, "dimension = 2")? {
            2 => Some(2),
            3 => Some(3),
            other => {
                self.report(at.key("dimension"), format!("must be 2 or 3, got {other}"));
                None
            }
        }
    }

    fn plane(&mut self, at: &KeyPath, input: &input::SceneInput) -> (Plane, Option<f64>) {
        self.only_in(2, at, "plane", input.plane.is_some());
        self.only_in(2, at, "thickness", input.thickness.is_some());
        let thickness = match input.thickness {
            None => Some(1.0),
            Some(thickness) => self.number(&at.key("thickness"), thickness, POSITIVE),
        };
        (input.plane.unwrap_or(Plane::Strain), thickness)
    }

    fn time(&mut self, at: &KeyPath, input: &input::TimeInput) -> Option<Time> {
        let end = self.required(at, "end", input.end, "end = 1.0");
        let end = end.and_then(|end| self.number(&at.key("end"), end, POSITIVE));
        let step = self.optional(&at.key("step"), input.step, POSITIVE);
        if let (Some(end), Some(Some(step))) = (end, step)
            && step > end
        {
            let longer =
                format!("a step of {step} s is longer than the run, which ends at {end} s");
            self.report(at.key("step"), longer);
        }
        let safety = self.number(&at.key("safety"), input.safety, FRACTION);
        let stop_when = match &input.stop_when {
            None => Some(None),
            Some(stop) => self.stop_when(&at.key("stop_when"), stop, end).map(Some),
        };
        Some(Time {
            end: end?,
            step: step?,
            safety: safety?,
            stop_when: stop_when?,
        })
    }

    fn stop_when(
        &mut self,
        at: &KeyPath,
        input: &input::StopWhenInput,
        end: Option<f64>,
    ) -> Option<StopWhen> {
        let key = "kinetic_energy_below";
        let energy = self.required(
            at,
            key,
            input.kinetic_energy_below,
            "kinetic_energy_below = 1e-6",
        );
        let energy = energy.and_then(|energy| self.number(&at.key(key), energy, POSITIVE));
        let at = at.key("during");
        let during = self
            .optional(&at, input.during, POSITIVE)?
            .or(end.map(|end| STOP_DURING * end))?;
        if let Some(end) = end.filter(|&end| during > end) {
            let longer = format!("{during} s is longer than the run, which ends at {end} s");
            self.report(at, longer);
            return None;
        }
        Some(StopWhen {
            kinetic_energy_below: energy?,
            during,
        })
    }

    fn material(&mut self, at: &KeyPath, input: &input::MaterialInput) -> Option<Material> {
        let name = self.name(at, input.name.as_deref(), "name = \"rock\"");
        let (young, poisson, density) = ("young_modulus", "poisson_ratio", "density");
        let young_modulus =
            self.required(at, young, input.young_modulus, "young_modulus = \"40 GPa\"");
        let young_modulus = young_modulus.and_then(|e| self.number(&at.key(young), e, POSITIVE));
        let poisson_ratio = self.required(at, poisson, input.poisson_ratio, "poisson_ratio = 0.25");
        let poisson_ratio = poisson_ratio.and_then(|nu| self.number(&at.key(poisson), nu, POISSON));
        let rho = self.required(at, density, input.density, "density = 2700.0, in kg/m³");
        let density = rho.and_then(|rho| self.number(&at.key(density), rho, POSITIVE));
        let damping = self.damping(&at.key("damping"), &input.damping);
        Some(Material {
            name: name?,
            model: input.model,
            young_modulus: young_modulus?,
            poisson_ratio: poisson_ratio?,
            density: density?,
            damping: damping?,
        })
    }

    fn damping(&mut self, at: &KeyPath, input: &input::DampingInput) -> Option<Damping> {
        let mass = self.number(&at.key("mass"), input.mass, NOT_NEGATIVE);
        let stiffness = self.number(&at.key("stiffness"), input.stiffness, NOT_NEGATIVE);
        let local = self.number(&at.key("local"), input.local, BELOW_ONE);
        Some(Damping {
            mass: mass?,
            stiffness: stiffness?,
            local: local?,
        })
    }
}
