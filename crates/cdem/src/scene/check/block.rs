//! Checks of blocks: geometry, placement, initial motion.

use crate::math::format::short;
use crate::scene::check::Check;
use crate::scene::check::names::Sort;
use crate::scene::check::value::{OneOf, OptionalKey, POSITIVE};
use crate::scene::element_kind::ElementKind;
use crate::scene::input::{self, Length, NumberOrVector, Quantity, QuantityOr};
use crate::scene::{Block, Geometry, KeyPath, Problem, Rotation};

/// Largest number of elements of a shape. More is most likely a typing error: they would take
/// minutes to make, and more memory than most machines have.
pub(crate) const MOST_ELEMENTS: f64 = 2e7;

impl Check {
    pub(super) fn block(&mut self, at: &KeyPath, input: &input::BlockInput) -> Option<Block> {
        let name = self.name(at, input.name.as_deref(), "name = \"left\"");
        let geometry = self.geometry(at, input);
        let material = self.required(
            at,
            "material",
            input.material.as_deref(),
            "material = \"rock\"",
        );
        let material =
            material.and_then(|m| self.reference(&at.key("material"), Sort::Material, m));
        let velocity = self.vector_or_zero(&at.key("velocity"), input.velocity.as_ref());
        let angular_velocity = self.angular_velocity(at, input);
        let scale = self.number(&at.key("scale"), input.scale, POSITIVE);
        let rotate = self.rotate(&at.key("rotate"), input.rotate.as_ref());
        let translate = self.vector_or_zero(&at.key("translate"), input.translate.as_ref());
        let block = Block {
            name: name?,
            geometry: geometry?,
            split: input.split,
            material: material?,
            velocity: velocity?,
            angular_velocity: angular_velocity?,
            scale: scale?,
            rotate: rotate?,
            translate: translate?,
            kinematics: input.kinematics,
            mass: input.mass,
            fixed: input.fixed,
        };
        self.at_rest_if_fixed(at, &block)?;
        Some(block)
    }

    fn at_rest_if_fixed(&mut self, at: &KeyPath, block: &Block) -> Option<()> {
        let speeds = [
            ("velocity", &block.velocity),
            ("angular_velocity", &block.angular_velocity),
        ];
        for (key, speed) in speeds {
            if block.fixed && speed.iter().any(|v| *v != 0.0) {
                let problem = Problem::new(at.key(key), "a fixed block does not move");
                self.problems
                    .push(problem.help("leave out `fixed`, or this velocity"));
                return None;
            }
        }
        Some(())
    }

    fn geometry(&mut self, at: &KeyPath, input: &input::BlockInput) -> Option<Geometry> {
        let mesh = OptionalKey::new("mesh", input.mesh.as_deref());
        let shape = OptionalKey::new("shape", input.shape.as_ref());
        match self.one_of(at, mesh, shape)? {
            OneOf::First(path) => {
                self.only_with(
                    at,
                    "element",
                    input.element.is_some(),
                    "`shape`; a mesh has its own elements",
                );
                let path = self.not_empty(&at.key("mesh"), path)?;
                let group = match &input.group {
                    None => None,
                    Some(group) => Some(self.not_empty(&at.key("group"), group)?),
                };
                Some(Geometry::Mesh {
                    path: path.into(),
                    group,
                })
            }
            OneOf::Second(shape) => {
                self.only_with(at, "group", input.group.is_some(), "`mesh`");
                let element = self.element(&at.key("element"), input.element);
                self.shape(&at.key("shape"), shape, element)
            }
        }
    }

    fn element(&mut self, path: &KeyPath, element: Option<ElementKind>) -> Option<ElementKind> {
        let default = if self.dimension == 2 {
            ElementKind::Tri3
        } else {
            ElementKind::Tet4
        };
        let element = element.unwrap_or(default);
        if element.dimension() == self.dimension {
            return Some(element);
        }
        let (name, own) = (element.name(), element.dimension());
        let message = format!(
            "{name} is a {own}-D element, but dimension = {}",
            self.dimension
        );
        let fit = if self.dimension == 2 {
            "tri3 or quad4"
        } else {
            "tet4, wedge6 or hex8"
        };
        self.problems
            .push(Problem::new(path.clone(), message).help(format!("use {fit}")));
        None
    }

    fn shape(
        &mut self,
        at: &KeyPath,
        input: &input::ShapeInput,
        element: Option<ElementKind>,
    ) -> Option<Geometry> {
        let cuboid = OptionalKey::new("box", input.cuboid.as_ref());
        let polygon = OptionalKey::new("polygon", input.polygon.as_ref());
        match self.one_of(at, cuboid, polygon)? {
            OneOf::First(cuboid) => {
                self.only_with(
                    at,
                    "size",
                    input.size.is_some(),
                    "`polygon`; a box has `divisions`",
                );
                self.cuboid(&at.key("box"), cuboid, element)
            }
            OneOf::Second(polygon) => {
                self.only_in(2, at, "polygon", true);
                let corners = self.corners(&at.key("polygon"), polygon);
                let size = self.required(at, "size", input.size, "size = 0.1");
                let size = size.and_then(|size| self.number(&at.key("size"), size, POSITIVE));
                if element.is_some_and(|element| element == ElementKind::Quad4) {
                    self.report(
                        at.clone(),
                        "a polygon is meshed with triangles: element = \"tri3\"",
                    );
                    return None;
                }
                Some(Geometry::Polygon {
                    corners: corners?,
                    size: size?,
                    element: element?,
                })
            }
        }
    }

    fn cuboid(
        &mut self,
        at: &KeyPath,
        input: &input::Cuboid,
        element: Option<ElementKind>,
    ) -> Option<Geometry> {
        let (zeros, ones) = if self.dimension == 2 {
            ("[0, 0]", "[1, 1]")
        } else {
            ("[0, 0, 0]", "[1, 1, 1]")
        };
        let min = self.required(at, "min", input.min.as_ref(), &format!("min = {zeros}"));
        let min = min.and_then(|min| self.vector(&at.key("min"), min));
        let max = self.required(at, "max", input.max.as_ref(), &format!("max = {ones}"));
        let max = max.and_then(|max| self.vector(&at.key("max"), max));
        let divisions = self.required(
            at,
            "divisions",
            input.divisions.as_ref(),
            &format!("divisions = {ones}"),
        );
        let divisions =
            divisions.and_then(|divisions| self.divisions(&at.key("divisions"), divisions));
        let (min, max) = (min?, max?);
        for (axis, (low, high)) in min.iter().zip(&max).enumerate() {
            if low >= high {
                let message = format!("must be larger than min: {high:?} m is not above {low:?} m");
                self.report(at.key("max").index(axis), message);
                return None;
            }
        }
        Some(Geometry::Box {
            min,
            max,
            divisions: divisions?,
            element: element?,
        })
    }

    fn divisions(&mut self, path: &KeyPath, divisions: &[u32]) -> Option<Vec<usize>> {
        self.components(path, divisions.len())?;
        if let Some(axis) = divisions.iter().position(|n| *n == 0) {
            self.report(path.index(axis), "must be at least 1");
            return None;
        }
        let cells: f64 = divisions.iter().map(|n| f64::from(*n)).product();
        if cells > MOST_ELEMENTS {
            let (cells, most) = (short(cells), short(MOST_ELEMENTS));
            let message = format!("{cells} cells are too many: at most {most}");
            self.report(path.clone(), message);
            return None;
        }
        Some(divisions.iter().map(|n| *n as usize).collect())
    }

    fn corners(
        &mut self,
        path: &KeyPath,
        corners: &[Vec<Quantity<Length>>],
    ) -> Option<Vec<[f64; 2]>> {
        let mut checked = Vec::new();
        for (i, corner) in corners.iter().enumerate() {
            let [x, y] = corner.as_slice() else {
                self.report(
                    path.index(i),
                    format!("a corner is [x, y], got {} numbers", corner.len()),
                );
                return None;
            };
            checked.push([x.si(), y.si()]);
        }
        if checked.len() < 3 {
            self.report(
                path.clone(),
                format!("a polygon has at least 3 corners, got {}", checked.len()),
            );
            return None;
        }
        for i in 0..checked.len() {
            let next = (i + 1) % checked.len();
            if checked[i] == checked[next] {
                let problem = Problem::new(
                    path.index(next),
                    format!("the same corner as number {i}, counted from 0"),
                );
                self.problems
                    .push(problem.help("leave it out; the polygon is closed by itself"));
                return None;
            }
        }
        Some(checked)
    }

    /// Checks the angular velocity: one component about z in 2-D, three in 3-D.
    fn angular_velocity(&mut self, at: &KeyPath, input: &input::BlockInput) -> Option<Vec<f64>> {
        let path = at.key("angular_velocity");
        match (&input.angular_velocity, self.dimension) {
            (None, 2) => Some(vec![0.0]),
            (None, _) => Some(vec![0.0; 3]),
            (Some(NumberOrVector::Quantity(about_z)), 2) => Some(vec![about_z.si()]),
            (Some(NumberOrVector::Other(vector)), 3) => self.vector(&path, vector),
            (Some(_), 2) => {
                self.report(
                    path,
                    "expected a number (about z), because dimension = 2, got an array",
                );
                None
            }
            (Some(_), _) => {
                self.report(
                    path,
                    "expected a vector [x, y, z], because dimension = 3, got a number",
                );
                None
            }
        }
    }

    fn rotate(&mut self, path: &KeyPath, input: Option<&input::Rotate>) -> Option<Rotation> {
        let about_z = |angle| Rotation {
            axis: [0.0, 0.0, 1.0],
            angle,
        };
        match (input, self.dimension) {
            (None, _) => Some(about_z(0.0)),
            (Some(QuantityOr::Quantity(angle)), 2) => Some(about_z(angle.si())),
            (Some(QuantityOr::Other(about)), 3) => {
                let axis = self.axis(&path.key("axis"), &about.axis)?;
                Some(Rotation {
                    axis,
                    angle: about.angle.si(),
                })
            }
            (Some(_), 2) => {
                self.report(
                    path.clone(),
                    "expected an angle in degrees, because dimension = 2, got axis and angle",
                );
                None
            }
            (Some(_), _) => {
                let problem = Problem::new(
                    path.clone(),
                    "expected axis and angle, because dimension = 3, got an angle",
                );
                self.problems
                    .push(problem.help("for example: rotate = { axis = [0, 0, 1], angle = 30 }"));
                None
            }
        }
    }
}
