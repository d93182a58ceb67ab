//! A block with an overlay: its mesh, its masses, and how fast its elements may go.

use super::foundation::Foundation;
use super::mass::Moments;
use super::overlay::Overlay;
use super::refined;
use super::zone::{Zone, size};
use crate::element::ElementSet;
use crate::mass::MassKind;
use crate::mesh::{Block, Element, Mesh};

/// Share of its lumped mass that the fit leaves each node, at least: below it, elements
/// would need steps of half the length and less.
const LEAST: f64 = 0.3;

/// How often elements are made half as large again where their masses cannot be fitted.
const ATTEMPTS: i32 = 6;

/// A block with an overlay.
#[derive(Clone, Debug)]
pub(crate) struct Cover<const D: usize> {
    pub(crate) overlay: Overlay<D>,
    /// Mass of its nodes, kg.
    pub(crate) mass: Vec<f64>,
    /// Level of its elements by their own stable step: of those that it keeps, then of
    /// the new ones; `None` where it is as before.
    pub(crate) level: Vec<Option<u8>>,
}

impl<const D: usize> Cover<D> {
    /// A block refined to its zones; `None` where it is fine enough, or cannot be.
    pub(crate) fn new(foundation: &Foundation<D>, block: usize, zones: &[Zone<D>]) -> Option<Self> {
        (0..ATTEMPTS).find_map(|attempt| {
            let share = 0.5_f64.powi(attempt);
            let overlay = foundation.overlay(block, &|corners| {
                let wanted = zones.iter().map(|zone| zone.size_at(corners));
                let wanted = wanted.fold(f64::INFINITY, f64::min);
                let is_near = |zone: &Zone<D>| zone.size_at(corners) < size(corners);
                zones.iter().any(is_near) && size(corners) > share * wanted
            })?;
            Self::with_masses(foundation, block, overlay)
        })
    }

    /// The same with an overlay, if its masses can be fitted.
    fn with_masses(foundation: &Foundation<D>, block: usize, overlay: Overlay<D>) -> Option<Self> {
        let mesh = refined::of_block(&foundation.mesh, block, Some(&overlay));
        let sets = foundation.sets(block, &mesh);
        let kept = mesh.elements.len() - overlay.elements.len();
        let nodes = foundation.mesh.blocks[block].nodes.clone();
        let base_factor = &foundation.masses.factor[nodes.start as usize..nodes.end as usize];
        let is_dense = foundation.masses.kind[block] == MassKind::Consistent;
        let [of_kept, of_new] = lumped(&sets, mesh.nodes.len(), kept);
        let free: Vec<f64> = if is_dense {
            of_kept.iter().zip(&of_new).map(|(a, b)| a + b).collect()
        } else {
            of_new.clone()
        };
        let factor = Self::fit(foundation, block, &overlay, (&mesh, &free))?;
        let factor_of_kept = |node: usize| {
            if is_dense {
                factor[node]
            } else {
                base_factor.get(node).copied().unwrap_or(1.0)
            }
        };
        let masses = of_kept.iter().zip(&of_new).enumerate();
        let masses =
            masses.map(|(node, (kept, new))| factor_of_kept(node) * kept + factor[node] * new);
        let mut level = vec![None; mesh.elements.len()];
        for set in &sets {
            for (i, &element) in set.mesh_elements().iter().enumerate() {
                if is_dense || element as usize >= kept {
                    let omega = set.frequency(i, &factor);
                    level[element as usize] = Some(foundation.level(block, omega)?);
                }
            }
        }
        Some(Self {
            mass: masses.collect(),
            level,
            overlay,
        })
    }

    /// Factors on the masses `free` of nodes, kg, that give them the moments of what they
    /// replace; 1 where there is no such mass.
    fn fit(
        foundation: &Foundation<D>,
        block: usize,
        overlay: &Overlay<D>,
        (mesh, free): (&Mesh<D>, &[f64]),
    ) -> Option<Vec<f64>> {
        let nodes: Vec<usize> = (0..free.len()).filter(|&node| free[node] > 0.0).collect();
        let points: Vec<[f64; D]> = nodes.iter().map(|&node| mesh.nodes[node]).collect();
        let masses: Vec<f64> = nodes.iter().map(|&node| free[node]).collect();
        let mut moments = Moments::new(&points, &masses);
        let all = &foundation.masses;
        let dense = all
            .consistent
            .binary_search_by_key(&block, |dense| dense.block as usize);
        if let Ok(number) = dense {
            let dense = &all.consistent[number];
            for a in 0..dense.size {
                for b in 0..dense.size {
                    let mass = dense.matrix[a * dense.size + b];
                    moments.add(mass, &mesh.nodes[a], &mesh.nodes[b]);
                }
            }
        } else {
            for (node, mass) in replaced_masses(foundation, block, overlay) {
                moments.add(mass, &mesh.nodes[node], &mesh.nodes[node]);
            }
        }
        let fitted = moments.fit(&points, &masses, LEAST)?;
        let mut factor = vec![1.0; free.len()];
        for (node, fitted) in nodes.into_iter().zip(fitted) {
            factor[node] = fitted;
        }
        Some(factor)
    }
}

/// Row sums of the masses of the first `kept` elements and of the others, kg.
fn lumped<const D: usize>(
    sets: &[Box<dyn ElementSet<D>>],
    nodes: usize,
    kept: usize,
) -> [Vec<f64>; 2] {
    let mut masses = [vec![0.0; nodes], vec![0.0; nodes]];
    let mut shares = [0.0; 8];
    for set in sets {
        for (i, &element) in set.mesh_elements().iter().enumerate() {
            set.lumped_mass(i, &mut shares);
            let masses = &mut masses[usize::from(element as usize >= kept)];
            for (&node, share) in set.nodes(i).iter().zip(shares) {
                masses[node as usize] += share;
            }
        }
    }
    masses
}

/// What the elements that are replaced have had in the masses of the block's nodes, kg.
fn replaced_masses<const D: usize>(
    foundation: &Foundation<D>,
    block: usize,
    overlay: &Overlay<D>,
) -> Vec<(usize, f64)> {
    let Block { nodes, .. } = &foundation.mesh.blocks[block];
    let nodes = nodes.start as usize..nodes.end as usize;
    let element = |&number: &u32| {
        let element = &foundation.mesh.elements[number as usize];
        let own = element.nodes().iter().map(|node| node - nodes.start as u32);
        Element::new(element.kind, &own.collect::<Vec<_>>())
    };
    let elements: Vec<Element> = overlay.replaced.iter().map(element).collect();
    let mesh = Mesh {
        blocks: vec![Block {
            name: String::new(),
            source: 0,
            nodes: 0..nodes.len() as u32,
            elements: 0..elements.len() as u32,
        }],
        nodes: foundation.mesh.nodes[nodes.clone()].to_vec(),
        elements,
        ..Mesh::default()
    };
    let sets = foundation.sets(block, &mesh);
    let [_, masses] = lumped(&sets, mesh.nodes.len(), 0);
    let factor = &foundation.masses.factor[nodes];
    let shares = masses
        .iter()
        .zip(factor)
        .map(|(mass, factor)| mass * factor);
    shares.enumerate().filter(|(_, mass)| *mass > 0.0).collect()
}
