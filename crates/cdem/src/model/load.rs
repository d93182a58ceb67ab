//! Pressure and traction on groups of facets.

use crate::math::vector::{cross, pad, scale, sub, truncate};
use crate::mesh::Mesh;
use crate::model::{Model, ModelError};
use crate::scene::{Load, LoadKind, Scene};

/// A load on its facets.
pub(crate) struct SurfaceLoad<const D: usize> {
    /// Nodes of each facet, ordered so that its normal points outward.
    facets: Vec<Vec<u32>>,
    /// Tributary area at rest of each node of each facet, m² (for traction).
    tributary_areas: Vec<Vec<f64>>,
    load: Load,
    thickness: f64,
}

impl<const D: usize> SurfaceLoad<D> {
    /// Creates the load on the given facets.
    pub(crate) fn new(load: &Load, facets: Vec<Vec<u32>>, mesh: &Mesh<D>, thickness: f64) -> Self {
        let at_rest = |facet: &Vec<u32>| {
            let points: Vec<[f64; 3]> = facet
                .iter()
                .map(|&node| pad(&mesh.nodes[node as usize]))
                .collect();
            nodal_areas(&points, thickness)[..facet.len()]
                .iter()
                .map(|area| area.iter().map(|x| x * x).sum::<f64>().sqrt())
                .collect()
        };
        let tributary_areas = facets.iter().map(at_rest).collect();
        Self {
            facets,
            tributary_areas,
            load: load.clone(),
            thickness,
        }
    }

    /// Replaces the pressure or traction from now on.
    pub(crate) fn set_kind(&mut self, kind: LoadKind) {
        self.load.kind = kind;
    }

    /// True if the load at `end` differs from that at `start`, s.
    pub(crate) fn changes(&self, start: f64, end: f64) -> bool {
        let varies = match &self.load.kind {
            LoadKind::Pressure(pressure) => pressure.value(start) != pressure.value(end),
            LoadKind::Traction(traction) => {
                let [one, other] = [start, end].map(|time| traction.vector::<D>(time));
                one != other
            }
        };
        self.acts(start) != self.acts(end) || self.acts(end) && varies
    }

    /// True if the load acts at `time`, s.
    fn acts(&self, time: f64) -> bool {
        time >= self.load.start && self.load.end.is_none_or(|end| time < end)
    }

    /// Calls `push(node, force)` with the nodal forces, N, at `time`; `at` gives current positions.
    pub(crate) fn forces(
        &self,
        time: f64,
        at: impl Fn(u32) -> [f64; D],
        mut push: impl FnMut(u32, [f64; D]),
    ) {
        if !self.acts(time) {
            return;
        }
        match &self.load.kind {
            LoadKind::Pressure(pressure) => {
                let pressure = pressure.value(time);
                for facet in &self.facets {
                    let mut points = [[0.0; 3]; 4];
                    for (point, &node) in points.iter_mut().zip(facet) {
                        *point = pad(&at(node));
                    }
                    let areas = nodal_areas(&points[..facet.len()], self.thickness);
                    for (&node, area) in facet.iter().zip(&areas) {
                        push(node, truncate(&scale(-pressure, area)));
                    }
                }
            }
            LoadKind::Traction(traction) => {
                let traction = traction.vector::<D>(time);
                for (facet, areas) in self.facets.iter().zip(&self.tributary_areas) {
                    for (&node, area) in facet.iter().zip(areas) {
                        push(node, scale(*area, &traction));
                    }
                }
            }
        }
    }
}

/// Returns the outward area vector ∫N_a n dA of each node of a facet: an edge (times `thickness`),
/// a triangle or a quadrilateral. It is exact for warped facets too. Entries beyond the nodes of
/// the facet have no meaning.
fn nodal_areas(points: &[[f64; 3]], thickness: f64) -> [[f64; 3]; 4] {
    match points {
        [a, b] => {
            let along = sub(b, a);
            [[0.5 * thickness * along[1], -0.5 * thickness * along[0], 0.0]; 4]
        }
        [a, b, c] => [scale(1.0 / 6.0, &cross(&sub(b, a), &sub(c, a))); 4],
        _ => quadrilateral_nodal_areas(points),
    }
}

fn quadrilateral_nodal_areas(points: &[[f64; 3]]) -> [[f64; 3]; 4] {
    const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let gauss = 1.0 / 3.0_f64.sqrt();
    let mut nodal_areas = [[0.0; 3]; 4];
    for at in CORNERS.map(|corner| corner.map(|x| x * gauss)) {
        let mut tangents = [[0.0; 3]; 2];
        for (corner, point) in CORNERS.iter().zip(points) {
            let slopes = [
                0.25 * corner[0] * (1.0 + corner[1] * at[1]),
                0.25 * corner[1] * (1.0 + corner[0] * at[0]),
            ];
            for (tangent, slope) in tangents.iter_mut().zip(slopes) {
                crate::math::vector::add_scaled(tangent, slope, point);
            }
        }
        let area = cross(&tangents[0], &tangents[1]);
        for (corner, nodal_area) in CORNERS.iter().zip(&mut nodal_areas) {
            let shape = 0.25 * (1.0 + corner[0] * at[0]) * (1.0 + corner[1] * at[1]);
            crate::math::vector::add_scaled(nodal_area, shape, &area);
        }
    }
    nodal_areas
}

impl<const D: usize> Model<D> {
    /// Returns the surface loads of a scene on the facets of the mesh.
    ///
    /// # Errors
    /// If a group is unknown, or none of its facets can move.
    pub(crate) fn surface_loads(&self, scene: &Scene) -> Result<Vec<SurfaceLoad<D>>, ModelError> {
        let mut loads = Vec::new();
        for (number, load) in scene.load.iter().enumerate() {
            let key = format!("load[{number}].group");
            let group = self
                .mesh
                .group(&load.group)
                .map_err(|source| ModelError::Group {
                    key: key.clone(),
                    source,
                })?;
            let facets = group.facets.iter();
            let facets = facets.map(|&facet| self.mesh.facet_nodes(facet).collect::<Vec<u32>>());
            let facets: Vec<Vec<u32>> = facets.filter(|facet| !self.is_fixed(facet[0])).collect();
            if facets.is_empty() {
                return Err(ModelError::NoFacets {
                    key,
                    group: load.group.clone(),
                });
            }
            let thickness = thickness::<D>(scene);
            loads.push(SurfaceLoad::new(load, facets, &self.mesh, thickness));
        }
        Ok(loads)
    }
}

/// Returns the thickness of the blocks, m; 1 in 3-D.
pub(crate) fn thickness<const D: usize>(scene: &Scene) -> f64 {
    if D == 2 { scene.thickness } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodal_areas_of_a_square_add_up_to_its_area_and_point_outward() {
        let square = [
            [0.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [2.0, 3.0, 0.0],
            [0.0, 3.0, 0.0],
        ];
        for area in nodal_areas(&square, 1.0) {
            // A quarter of 6 m², along +z; the tolerance allows round-off of three products.
            assert!((area[2] - 1.5).abs() < 1e-14 && area[0] == 0.0 && area[1] == 0.0);
        }
        let triangle = nodal_areas(&square[..3], 1.0);
        assert!((triangle[0][2] - 1.0).abs() < 1e-15);
        let edge = nodal_areas(&square[..2], 0.5);
        assert_eq!(edge[0], [0.0, -0.5, 0.0]);
    }
}
