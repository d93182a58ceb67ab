//! Checks of boundary conditions and loads.

use crate::scene::check::Check;
use crate::scene::check::names::Sort;
use crate::scene::check::value::{OneOf, OptionalKey};
use crate::scene::input::{self, Varying};
use crate::scene::{
    Boundary, BoundaryTarget, Help, KeyPath, Load, LoadKind, Motion, Problem, Schedule,
};

impl Check {
    pub(super) fn boundary(
        &mut self,
        at: &KeyPath,
        input: &input::BoundaryInput,
    ) -> Option<Boundary> {
        let target = self.target(at, input);
        let motion = self.motion(at, input);
        let interval = self.interval(at, input.start, input.end);
        let (start, end) = interval?;
        Some(Boundary {
            target: target?,
            motion: motion?,
            start,
            end,
        })
    }

    fn target(&mut self, at: &KeyPath, input: &input::BoundaryInput) -> Option<BoundaryTarget> {
        let group = OptionalKey::new("group", input.group.as_deref());
        let block = OptionalKey::new("block", input.block.as_deref());
        match self.one_of(at, group, block)? {
            OneOf::First(group) => self
                .not_empty(&at.key("group"), group)
                .map(BoundaryTarget::Group),
            OneOf::Second(block) => {
                if self.names.is_fixed(block) {
                    let problem = Problem::new(at.key("block"), "a fixed block does not move");
                    let help = Help::on_list("boundary", |boundary| {
                        format!("leave out `fixed` of the block, or this {boundary}")
                    });
                    self.problems.push(problem.help(help));
                    return None;
                }
                let block = self.reference(&at.key("block"), Sort::Block, block);
                block.map(BoundaryTarget::Block)
            }
        }
    }

    fn motion(&mut self, at: &KeyPath, input: &input::BoundaryInput) -> Option<Motion> {
        let velocity = OptionalKey::new("velocity", input.velocity.as_ref());
        let turn = OptionalKey::new("angular_velocity", input.angular_velocity.as_ref());
        match self.one_of(at, velocity, turn)? {
            OneOf::First(components) => {
                self.only_with(at, "axis", input.axis.is_some(), "`angular_velocity`");
                self.only_with(at, "point", input.point.is_some(), "`angular_velocity`");
                self.velocity(&at.key("velocity"), components)
            }
            OneOf::Second(angular_velocity) => self.turn(at, input, angular_velocity),
        }
    }

    fn velocity(&mut self, at: &KeyPath, input: &input::Components) -> Option<Motion> {
        self.only_in(3, at, "z", input.z.is_some());
        let components = [("x", &input.x), ("y", &input.y), ("z", &input.z)];
        if components.iter().all(|(_, value)| value.is_none()) {
            let problem = Problem::new(at.clone(), "prescribes no component");
            self.problems.push(
                problem.help("for example: velocity = { x = 0.0 } holds x and leaves y free"),
            );
            return None;
        }
        let checked = components.map(|(key, value)| match value {
            None => Some(None),
            Some(value) => self.schedule(&at.key(key), value).map(Some),
        });
        let [x, y, z] = checked;
        Some(Motion::Velocity([x?, y?, z?]))
    }

    fn turn(
        &mut self,
        at: &KeyPath,
        input: &input::BoundaryInput,
        angular_velocity: &Varying<input::AngularVelocity>,
    ) -> Option<Motion> {
        let axis = self.turn_axis(at, input);
        let point = match &input.point {
            None => Some([0.0; 3]),
            Some(point) => self.spatial(&at.key("point"), point),
        };
        let angular_velocity: Option<Schedule<f64>> =
            self.schedule(&at.key("angular_velocity"), angular_velocity);
        Some(Motion::Turn {
            axis: axis?,
            point: point?,
            angular_velocity: angular_velocity?,
        })
    }

    /// Checks the axis of rotation, which defaults to +z in 2-D.
    fn turn_axis(&mut self, at: &KeyPath, input: &input::BoundaryInput) -> Option<[f64; 3]> {
        if self.dimension == 2 {
            self.only_in(3, at, "axis", input.axis.is_some());
            return Some([0.0, 0.0, 1.0]);
        }
        let axis = self.required(at, "axis", input.axis.as_ref(), "axis = [0, 0, 1]")?;
        self.axis(&at.key("axis"), axis)
    }

    pub(super) fn load(&mut self, at: &KeyPath, input: &input::LoadInput) -> Option<Load> {
        let group = self.required(at, "group", input.group.as_deref(), "group = \"top\"");
        let group = group.and_then(|group| self.not_empty(&at.key("group"), group));
        let kind = self.load_kind(at, input);
        let interval = self.interval(at, input.start, input.end);
        let (start, end) = interval?;
        Some(Load {
            group: group?,
            kind: kind?,
            start,
            end,
        })
    }

    fn load_kind(&mut self, at: &KeyPath, input: &input::LoadInput) -> Option<LoadKind> {
        let pressure = OptionalKey::new("pressure", input.pressure.as_ref());
        let traction = OptionalKey::new("traction", input.traction.as_ref());
        match self.one_of(at, pressure, traction)? {
            OneOf::First(pressure) => {
                let pressure = self.schedule(&at.key("pressure"), pressure);
                pressure.map(LoadKind::Pressure)
            }
            OneOf::Second(traction) => {
                let traction = self.vector_schedule(&at.key("traction"), traction);
                traction.map(LoadKind::Traction)
            }
        }
    }
}
