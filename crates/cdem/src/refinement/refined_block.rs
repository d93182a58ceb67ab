//! A refined block: base block with overlay, its masses and the levels of its elements.

use std::ops::RangeInclusive;

use crate::element::ElementSet;
use crate::element::mass::MassKind;
use crate::mesh::{Element, Mesh, MeshBlock};
use crate::refinement::base_model::BaseModel;
use crate::refinement::composite_mesh;
use crate::refinement::indicator::RefinementLimit;
use crate::refinement::mass_fit::Moments;
use crate::refinement::overlay::Overlay;
use crate::refinement::zone::{SAME_LENGTH, Zone, size};

/// Least fraction of its lumped mass that the fit leaves each node. With less, elements would need
/// steps of half the length or less.
const LEAST: f64 = 0.3;

/// Maximum number of halvings of all elements of a block whose masses cannot be fitted; a simplex
/// needs two (design, section 6).
pub(super) const MOST_UNIFORM_HALVINGS: i32 = 3;

/// Tolerance of the comparison with the least size: round-off.
const ROUND_OFF: f64 = 1e-9;

/// A block with an overlay.
#[derive(Clone, Debug)]
pub(crate) struct RefinedBlock<const D: usize> {
    pub(crate) overlay: Overlay<D>,
    /// Mass of its nodes, kg.
    pub(crate) mass: Vec<f64>,
    /// Level of its elements by their own stable step, kept elements first, then the new ones;
    /// `None` for the level of the base mesh.
    pub(crate) level: Vec<Option<u8>>,
    /// Number of halvings of all elements, so that masses can be fitted.
    uniform_halvings: i32,
}

impl<const D: usize> RefinedBlock<D> {
    /// Refines a block to more zones than before. No element becomes coarser, so nothing is lost.
    /// Returns `None` if the base mesh is fine enough.
    ///
    /// # Errors
    /// The limit that prevents the refinement.
    pub(super) fn finer(
        base_model: &BaseModel<D>,
        block: usize,
        zones: &[Zone<D>],
        old: Option<&Self>,
    ) -> Result<Option<Self>, RefinementLimit> {
        let least = old.map_or(0, |old| old.uniform_halvings);
        let most = MOST_UNIFORM_HALVINGS.min(base_model.scene.contact.max_level as i32);
        Self::first(base_model, block, zones, least..=most)
    }

    /// Coarsens a block to some of its zones. No element becomes finer. Returns `None` if
    /// these zones need no overlay.
    ///
    /// # Errors
    /// The limit that prevents the coarsening.
    pub(super) fn coarser(
        base_model: &BaseModel<D>,
        block: usize,
        zones: &[Zone<D>],
        old: Option<&Self>,
    ) -> Result<Option<Self>, RefinementLimit> {
        let most = old.map_or(0, |old| old.uniform_halvings);
        Self::first(base_model, block, zones, 0..=most)
    }

    /// Returns the first refined block whose masses can be fitted, over the numbers of halvings of
    /// all elements in `halvings`.
    fn first(
        base_model: &BaseModel<D>,
        block: usize,
        zones: &[Zone<D>],
        mut halvings: RangeInclusive<i32>,
    ) -> Result<Option<Self>, RefinementLimit> {
        let found = halvings.find_map(|halvings| {
            let refined_block = Self::new(base_model, block, zones, halvings);
            // The other limits remain: a finer mesh never has longer steps.
            (!matches!(refined_block, Err(RefinementLimit::Masses))).then_some(refined_block)
        });
        found.unwrap_or(Err(RefinementLimit::Masses))
    }

    /// Builds a block refined to its zones, with all its elements halved `halvings` times.
    pub(super) fn new(
        base_model: &BaseModel<D>,
        block: usize,
        zones: &[Zone<D>],
        halvings: i32,
    ) -> Result<Option<Self>, RefinementLimit> {
        let most = match halvings {
            0 => f64::INFINITY,
            _ => base_model.largest_size(block) * 0.5_f64.powi(halvings),
        };
        let finest = 0.5_f64.powi(base_model.scene.contact.max_level as i32);
        let overlay = base_model.overlay(block, &|corners, root| {
            let wanted = zones.iter().map(|zone| zone.size_at(corners));
            let wanted = wanted.fold(f64::INFINITY, f64::min);
            let least = || finest * base_model.size(root) * (1.0 + ROUND_OFF);
            wanted.is_finite() && {
                let size = size(corners);
                size > wanted.min(most) * (1.0 + SAME_LENGTH) && size > least()
            }
        });
        let Some(overlay) = overlay else {
            return Ok(None);
        };
        Self::with_masses(base_model, block, overlay, halvings).map(Some)
    }

    /// Returns the number of halvings of all elements.
    pub(super) fn uniform_halvings(&self) -> i32 {
        self.uniform_halvings
    }

    /// Builds a block with an overlay, if its masses can be fitted and there are levels for its
    /// elements.
    fn with_masses(
        base_model: &BaseModel<D>,
        block: usize,
        overlay: Overlay<D>,
        halvings: i32,
    ) -> Result<Self, RefinementLimit> {
        let mesh = composite_mesh::of_block(&base_model.mesh, block, Some(&overlay));
        let sets = base_model.sets(block, &mesh);
        let kept = mesh.elements.len() - overlay.elements.len();
        let lumped = lumped(&mesh, &sets, kept);
        let fit = RefinedMassFit {
            base_model,
            block,
            overlay: &overlay,
            points: &mesh.nodes,
        };
        let factors = fit.factors(&lumped).ok_or(RefinementLimit::Masses)?;
        let mass = |node: usize| {
            (0..2)
                .map(|part| factors.of[part][node] * lumped[part][node])
                .sum()
        };
        let mut level = vec![None; mesh.elements.len()];
        for set in &sets {
            for (i, &element) in set.mesh_elements().iter().enumerate() {
                let is_new = element as usize >= kept;
                if is_new || factors.changes_kept {
                    let omega = set.frequency(i, &factors.of[usize::from(is_new)]);
                    let own = base_model
                        .level(block, omega)
                        .ok_or(RefinementLimit::Step)?;
                    level[element as usize] = Some(own);
                }
            }
        }
        Ok(Self {
            mass: (0..mesh.nodes.len()).map(mass).collect(),
            level,
            overlay,
            uniform_halvings: halvings,
        })
    }
}

/// Fit of the masses of a refined block.
struct RefinedMassFit<'a, const D: usize> {
    base_model: &'a BaseModel<D>,
    block: usize,
    overlay: &'a Overlay<D>,
    /// Rest positions of all nodes, m.
    points: &'a [[f64; D]],
}

/// Factors on the lumped masses of nodes.
pub(crate) struct MassFactors {
    /// Factors for the kept elements, and for the new ones.
    of: [Vec<f64>; 2],
    /// True if the factors of the kept elements differ from the base mesh.
    changes_kept: bool,
}

impl<const D: usize> RefinedMassFit<'_, D> {
    /// Returns the factors that give the block the mass, the centre and the second moments of the
    /// base block, if possible with factors on the new elements alone.
    fn factors(&self, [of_kept, of_new]: &[Vec<f64>; 2]) -> Option<MassFactors> {
        let kind = self.base_model.masses.kind[self.block];
        let before = self.factors_before();
        if kind != MassKind::Consistent
            && let Some(of_new) = self.fit(of_new, &self.replaced())
        {
            return Some(MassFactors {
                of: [before, of_new],
                changes_kept: false,
            });
        }
        let all = of_kept.iter().zip(of_new).zip(&before);
        let all: Vec<f64> = all
            .map(|((kept, new), factor)| factor * kept + new)
            .collect();
        if let Some(fitted) = self.fit(&all, &self.whole()) {
            let of_kept = before.iter().zip(&fitted).map(|(one, other)| one * other);
            return Some(MassFactors {
                of: [of_kept.collect(), fitted],
                changes_kept: true,
            });
        }
        // Too few nodes to correct the errors of lumped masses, which change with the mesh.
        let ones = vec![1.0; before.len()];
        (kind == MassKind::Lumped).then_some(MassFactors {
            of: [before, ones],
            changes_kept: false,
        })
    }

    /// Returns the factors on the lumped masses of the base nodes, and 1 for new nodes.
    fn factors_before(&self) -> Vec<f64> {
        let nodes = self.nodes();
        let mut factors = self.base_model.masses.factor[nodes].to_vec();
        factors.resize(self.points.len(), 1.0);
        factors
    }

    fn nodes(&self) -> std::ops::Range<usize> {
        let nodes = &self.base_model.mesh.blocks[self.block].nodes;
        nodes.start as usize..nodes.end as usize
    }

    /// Returns the factors on these nodal masses, kg, that give them the `wanted` moments; 1 for
    /// nodes without mass.
    fn fit(&self, masses: &[f64], wanted: &[(usize, usize, f64)]) -> Option<Vec<f64>> {
        let nodes: Vec<usize> = (0..masses.len()).filter(|&n| masses[n] > 0.0).collect();
        let points: Vec<[f64; D]> = nodes.iter().map(|&node| self.points[node]).collect();
        let own: Vec<f64> = nodes.iter().map(|&node| masses[node]).collect();
        let mut moments = Moments::new(&points, &own);
        for &(a, b, mass) in wanted {
            moments.add(mass, &self.points[a], &self.points[b]);
        }
        let fitted = moments.fit(&points, &own, LEAST)?;
        let mut factors = vec![1.0; masses.len()];
        for (node, fitted) in nodes.into_iter().zip(fitted) {
            factors[node] = fitted;
        }
        Some(factors)
    }

    /// Returns the entries of the mass matrix of the base block, kg. For fitted masses these are
    /// those of the consistent matrix, which has the same mass, centre and moments of inertia.
    fn whole(&self) -> Vec<(usize, usize, f64)> {
        let masses = &self.base_model.masses;
        if masses.kind[self.block] == MassKind::Lumped {
            let masses = masses.nodal[self.nodes()].iter().enumerate();
            return masses.map(|(node, &mass)| (node, node, mass)).collect();
        }
        let mesh = composite_mesh::of_block(&self.base_model.mesh, self.block, None);
        let mut entries = Vec::new();
        let mut matrix = [0.0; 64];
        for set in self.base_model.sets(self.block, &mesh) {
            for i in 0..set.len() {
                set.consistent_mass(i, &mesh, &mut matrix);
                let nodes: Vec<usize> = set.nodes(&mesh, i).iter().map(|&n| n as usize).collect();
                for (k, &a) in nodes.iter().enumerate() {
                    let row = nodes.iter().zip(&matrix[k * nodes.len()..]);
                    entries.extend(row.map(|(&b, &mass)| (a, b, mass)));
                }
            }
        }
        entries
    }

    /// Returns the diagonal mass entries of the replaced elements, kg.
    fn replaced(&self) -> Vec<(usize, usize, f64)> {
        let nodes = self.nodes();
        let (base_model, first) = (self.base_model, nodes.start as u32);
        let element = |&number: &u32| {
            let element = &base_model.mesh.elements[number as usize];
            let own: Vec<u32> = element.nodes().iter().map(|node| node - first).collect();
            Element::new(element.kind, &own)
        };
        let elements: Vec<Element> = self.overlay.replaced.iter().map(element).collect();
        let mesh = Mesh {
            blocks: vec![MeshBlock {
                name: String::new(),
                source: 0,
                nodes: 0..nodes.len() as u32,
                elements: 0..elements.len() as u32,
            }],
            nodes: base_model.mesh.nodes[nodes.clone()].to_vec(),
            elements,
            ..Mesh::default()
        };
        let sets = base_model.sets(self.block, &mesh);
        let [_, masses] = lumped(&mesh, &sets, 0);
        let shares = masses.iter().zip(&base_model.masses.factor[nodes]);
        let shares = shares.map(|(mass, factor)| mass * factor).enumerate();
        let shares = shares.filter(|(_, mass)| *mass > 0.0);
        shares.map(|(node, mass)| (node, node, mass)).collect()
    }
}

/// Returns the row sums of the masses of the first `kept` elements and of the others, kg.
fn lumped<const D: usize>(
    mesh: &Mesh<D>,
    sets: &[Box<dyn ElementSet<D>>],
    kept: usize,
) -> [Vec<f64>; 2] {
    let nodes = mesh.nodes.len();
    let mut masses = [vec![0.0; nodes], vec![0.0; nodes]];
    let mut shares = [0.0; 8];
    for set in sets {
        for (i, &element) in set.mesh_elements().iter().enumerate() {
            set.lumped_mass(i, &mut shares);
            let masses = &mut masses[usize::from(element as usize >= kept)];
            for (&node, share) in set.nodes(mesh, i).iter().zip(shares) {
                masses[node as usize] += share;
            }
        }
    }
    masses
}
