//! Checks that a run is still physical. Cheap checks run after every coarse step, so that only
//! finite values are ever reported. Elements and energy ledger are checked at intervals, because
//! that costs as much as a step.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::element::Deformation;
use crate::element::material::Elastic;
use crate::math::format::{named_blocks, quantity, short, significant};
use crate::math::parallel::NODES_AT_ONCE;
use crate::math::restore::{ResumeError, require};
use crate::math::vector::{add_scaled, dot, pad, scale, sub};
use crate::scene::{Kinematics, Scene};
use crate::simulation::output::HistoryRow;
use crate::step::Run;

/// Reason for which a run stopped itself.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum StepError {
    /// A velocity or displacement is not a number.
    #[error(
        "t = {} s: block \"{block}\", node {node}: its speed or displacement is no finite number; \
         the loads or prescribed velocities are far too large, or the run is unstable: check their \
         units, and reduce `time.safety` and, in the penalty model, the stiffnesses",
        short(*time)
    )]
    #[allow(missing_docs)] // the message names them
    NotFinite { time: f64, block: String, node: u32 },
    /// A node leaves its block faster than any wave could carry it.
    #[error(
        "t = {} s: block \"{block}\", node {node} moves at {} m/s relative to its block, more than \
         ten times the speed of waves and blocks; the loads are too large for an elastic block, or \
         the run is unstable: check units and loads, and reduce `time.safety`",
        short(*time),
        short(*speed)
    )]
    #[allow(missing_docs)] // the message names them
    Runaway {
        time: f64,
        block: String,
        node: u32,
        speed: f64,
    },
    /// An element is inverted or nearly flat.
    #[error(
        "t = {} s: block \"{block}\", element {element} is flat or inverted \
         (det F = {}); the loads or the impact are too strong for an elastic block, or \
         the run is unstable: check units and velocities, and reduce `time.safety`",
        short(*time),
        short(*jacobian)
    )]
    #[allow(missing_docs)] // the message names them
    Inverted {
        time: f64,
        block: String,
        element: u32,
        jacobian: f64,
    },
    /// Two blocks overlap deeper than contact allows.
    #[error(
        "t = {} s: block \"{}\" lies {} deep in block \"{}\" at ({:.6}, {:.6}, \
         {:.6}); if no prescribed motion presses them together, a contact was missed: try a \
         smaller `time.step`, and report the scene as a defect",
        short(*time), blocks[0], quantity(*depth, "m"), blocks[1], at[0], at[1], at[2]
    )]
    #[allow(missing_docs)] // the message names them
    Penetration {
        time: f64,
        blocks: [String; 2],
        at: [f64; 3],
        depth: f64,
    },
    /// The energy ledger does not balance.
    #[error(
        "t = {} s: the residual of the energy ledger is {} J of {} J; \
         reduce `time.safety`, use more elements, or report the scene as a defect",
        short(*time),
        short(*residual),
        short(*scale)
    )]
    #[allow(missing_docs)] // the message names them
    Energy {
        time: f64,
        residual: f64,
        scale: f64,
    },
}

/// Energy residual, as a fraction of the energy exchanged, above which the user is warned: the
/// design limit for unrefined one-element blocks.
const RESIDUAL_WARNING: f64 = 0.02;

/// Energy residual, as a fraction of the energy exchanged, above which the run stops: five times
/// the design limit for unrefined one-element blocks.
const RESIDUAL_LIMIT: f64 = 0.1;

/// Range of principal stretches for which the total kinematics are meant (design, section 2).
const STRETCHES: [f64; 2] = [0.8, 1.1];

/// Norm of Green's strain up to which principal stretches are within √(1 − 0.2) and √(1 + 0.2), so
/// within `STRETCHES`. It costs a tenth of the stretches themselves.
const STRAIN_LIMIT: f64 = 0.1;

/// Principal stretch below which an element counts as flat. A hard impact may flatten an element
/// into a sheet whose volume round-off keeps above 0.
const FLAT: f64 = 1e-2;

/// Speed of a node relative to its block at which the run stops, over the sum of wave speed and
/// fastest initial speed. Nothing stable comes near.
const RUNAWAY: f64 = 10.0;

/// Coarse steps between two checks for overlapping blocks. A check costs about ten steps.
const OVERLAP_INTERVAL: u64 = 1024;

/// Depth at which blocks count as overlapping, over the contact resolution. A solved contact leaves
/// less than 1.
const OVERLAP_LIMIT: f64 = 10.0;

/// Strains below this are round-off. A ledger cannot tell their energy, and that of the speeds that
/// go with them, from zero.
const ROUND_OFF: f64 = 1e-12;

/// Reference of the energy residual: the largest energy so far that was in the blocks or has gone
/// through gravity, loads and boundary conditions. The current energy may be zero, at the end of a
/// cycle.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct ExchangedEnergy {
    /// Kinetic plus strain energy at t = 0, J.
    start: f64,
    /// Largest value so far, J.
    maximum: f64,
    /// Value up to which the energy is round-off, J.
    round_off: f64,
}

impl ExchangedEnergy {
    /// Creates the reference for a run that starts with the kinetic plus strain energy `start`, J.
    pub(crate) fn new<const D: usize>(run: &Run<D>, scene: &Scene, start: f64) -> Self {
        let blocks = run.model.blocks.iter().enumerate();
        let round_off = blocks.filter(|(_, data)| !data.fixed).map(|(block, data)| {
            let speed = ROUND_OFF * Elastic::new(&scene.material[data.material]).p_wave_speed();
            let nodes = run.model.nodes(block);
            let mass: f64 = nodes.map(|node| run.model.inertia.mass()[node]).sum();
            mass * speed * speed
        });
        Self {
            start,
            maximum: start.max(0.0),
            round_off: round_off.sum(),
        }
    }

    /// Updates the maximum with the work of external forces and gravity so far, J.
    pub(crate) fn count(&mut self, external_work: f64, gravity_work: f64) {
        let sums = [
            external_work.abs(),
            gravity_work.abs(),
            self.start + external_work + gravity_work,
        ];
        // `f64::max` ignores NaN.
        self.maximum = sums.into_iter().fold(self.maximum, f64::max);
    }

    /// Returns the largest energy exchanged so far, J; 0 if it is round-off.
    pub(crate) fn maximum(&self) -> f64 {
        if self.maximum > self.round_off {
            self.maximum
        } else {
            0.0
        }
    }

    /// Returns the reference of residuals, J.
    pub(crate) fn scale(&self) -> f64 {
        self.maximum.max(self.round_off)
    }
}

/// Limits and findings of the checks of a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct ValidityGuard {
    /// Speed of a node relative to its block that nothing stable reaches, m/s.
    limit: f64,
    /// Step of the last check of the elements.
    looked: Option<u64>,
    /// First large stretch of each block.
    stretches: Vec<Option<LargeStretch>>,
    /// True if there is a warning of blocks that moved farther than the search reached.
    search_overrun: bool,
    /// Warnings for the user, in order of time; those of large stretches are not among them.
    warnings: Vec<String>,
}

/// A principal stretch beyond [`STRETCHES`].
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct LargeStretch {
    /// Principal stretch.
    stretch: f64,
    /// Number of the element in its block.
    element: usize,
    /// Instant, s.
    time: f64,
}

/// True if all components of velocities and displacements are finite and no squared velocity
/// component is above `most`. Works in lanes, for SIMD.
fn are_moderate(velocity: &[f64], displacement: &[f64], most: f64) -> bool {
    const LANES: usize = 8;
    let (mut sum, mut fastest) = ([0.0; LANES], [0.0_f64; LANES]);
    let mut look = |velocity: &[f64], displacement: &[f64]| {
        for (lane, (v, u)) in velocity.iter().zip(displacement).enumerate() {
            let square = v * v;
            // One sum finds any value that is not finite.
            sum[lane] += square + u * u;
            fastest[lane] = if square > fastest[lane] {
                square
            } else {
                fastest[lane]
            };
        }
    };
    let (velocity, last_velocity) = velocity.as_chunks::<LANES>();
    let (displacement, last_displacement) = displacement.as_chunks::<LANES>();
    for (velocity, displacement) in velocity.iter().zip(displacement) {
        look(velocity, displacement);
    }
    look(last_velocity, last_displacement);
    sum.iter().sum::<f64>().is_finite() && fastest.iter().all(|&square| square <= most)
}

impl ValidityGuard {
    /// Creates the guard of a run at its start.
    pub(crate) fn new<const D: usize>(run: &Run<D>, scene: &Scene) -> Self {
        let waves = scene
            .material
            .iter()
            .map(|m| Elastic::new(m).p_wave_speed());
        let start = run.state.velocity.iter().map(|v| dot(v, v).sqrt());
        Self {
            limit: RUNAWAY * (waves.fold(0.0, f64::max) + start.fold(0.0, f64::max)),
            looked: None,
            stretches: vec![None; run.model.blocks.len()],
            search_overrun: false,
            warnings: Vec::new(),
        }
    }

    /// Checks that the guard is of a run with `blocks` blocks.
    ///
    /// # Errors
    /// If it is not.
    pub(crate) fn is_of(&self, blocks: usize) -> Result<(), ResumeError> {
        require(self.stretches.len() == blocks, "its blocks")
    }

    /// Checks velocities and displacements; runs after every step.
    pub(crate) fn check_motion<const D: usize>(&self, run: &Run<D>) -> Result<(), StepError> {
        let (velocity, displacement) = (&run.state.velocity, &run.state.displacement);
        let chunks = velocity.par_chunks(NODES_AT_ONCE);
        let chunks = chunks.zip(displacement.par_chunks(NODES_AT_ONCE));
        // If no component is above this, no node is above the limit.
        let most = self.limit * self.limit / D as f64;
        if chunks.all(|(v, u)| are_moderate(v.as_flattened(), u.as_flattened(), most)) {
            return Ok(());
        }
        let mut nodes = velocity.iter().zip(displacement);
        let finite = nodes.all(|(v, u)| f64::is_finite(dot(v, v) + dot(u, u)));
        let symptom = if finite {
            run.runaway(self.limit)
        } else {
            Some(run.not_finite())
        };
        // If an element is inverted, that is the cause, so it is reported instead.
        symptom.map_or(Ok(()), |symptom| {
            run.each_deformation(|_, _, _| ())?;
            Err(symptom)
        })
    }

    /// Checks that no element is inverted, at most once a step; warns of large stretches.
    pub(crate) fn check_elements<const D: usize>(&mut self, run: &Run<D>) -> Result<(), StepError> {
        let number = run.state.number;
        if self.looked == Some(number) {
            return Ok(());
        }
        let stretches = &mut self.stretches;
        run.each_deformation(|block, element, found| {
            let [least, most] = STRETCHES;
            let worst = if found.min_stretch < least {
                found.min_stretch
            } else {
                found.max_stretch
            };
            if stretches[block].is_some() || (least..=most).contains(&worst) {
                return;
            }
            let (set, _) = run
                .model
                .numbering
                .of(run.model.elements(block).start + element);
            if run.model.sets[set].kinematics() == Kinematics::Total {
                stretches[block] = Some(LargeStretch {
                    stretch: worst,
                    element,
                    time: run.time(),
                });
            }
        })?;
        self.looked = Some(number);
        Ok(())
    }

    /// Returns the warnings so far.
    pub(crate) fn warnings<const D: usize>(&self, run: &Run<D>) -> Vec<String> {
        let stretched = self.stretch_warning(run);
        self.warnings.iter().cloned().chain(stretched).collect()
    }

    /// Returns one warning for all blocks with large stretches; it describes the first of them.
    fn stretch_warning<const D: usize>(&self, run: &Run<D>) -> Option<String> {
        let name = |block: usize| run.model.mesh.blocks[block].name.as_str();
        let found = self.stretches.iter().enumerate();
        let found: Vec<_> = found.filter_map(|(n, &found)| Some((n, found?))).collect();
        let first = found.iter().min_by(|a, b| a.1.time.total_cmp(&b.1.time));
        let &(block, first) = first?;
        let names: Vec<_> = found.iter().map(|&(block, _)| name(block)).collect();
        let (stretch, which, these) = match names.len() {
            1 => ("principal stretch", String::new(), "this block's"),
            _ => (
                "large principal stretches, the first of them",
                format!(" of \"{}\"", name(block)),
                "these blocks'",
            ),
        };
        let [least, most] = STRETCHES;
        Some(format!(
            "{}: {stretch} {:.3} in element {}{which} at t = {}; the material law of kinematics = \
             \"total\" is meant for {least} to {most}: judge {these} stresses with care, or try \
             \"incremental\"",
            named_blocks(&names),
            first.stretch,
            first.element,
            quantity(first.time, "s")
        ))
    }

    /// Checks that no blocks overlap, which contact cannot notice if it has missed a pair. The
    /// check is expensive: it runs every [`OVERLAP_INTERVAL`] steps, at the end, and if nodes have
    /// moved farther than the search reached.
    pub(crate) fn check_overlap<const D: usize>(
        &mut self,
        run: &mut Run<D>,
    ) -> Result<(), StepError> {
        let number = run.state.number;
        let due = number.is_multiple_of(OVERLAP_INTERVAL) || number == run.model.step_count;
        let Some(contacts) = &mut run.contacts else {
            return Ok(());
        };
        let outrun = contacts.take_search_overrun();
        if !outrun && !due {
            return Ok(());
        }
        if outrun && !self.search_overrun {
            self.search_overrun = true;
            self.warnings.push(format!(
                "in the step before t = {}, nodes moved farther than the broad phase had assumed, \
                 so a block may have passed through another: try a smaller `time.step`",
                quantity(number as f64 * run.model.step, "s")
            ));
        }
        let contacts = &*contacts;
        let at = run.model.positions(&run.state);
        let mut mesh = run.model.mesh.clone();
        for (node, place) in (0..).zip(&mut mesh.nodes) {
            *place = at.at(node);
        }
        let apart = |a: usize, b: usize| contacts.keeps_apart(a as u32, b as u32);
        let depth = OVERLAP_LIMIT * contacts.resolution();
        match crate::mesh::overlap(&mesh, depth, &apart) {
            None => Ok(()),
            Some(found) => Err(StepError::Penetration {
                time: run.time(),
                blocks: found.blocks.map(|block| run.block_name(block)),
                at: pad(&found.point),
                depth: found.depth,
            }),
        }
    }

    /// Checks that the energy residual is finite and, if `enforced`, within its limit.
    pub(crate) fn check_energy(
        row: &HistoryRow,
        exchange: &ExchangedEnergy,
        enforced: bool,
    ) -> Result<(), StepError> {
        let (time, residual, scale) = (row.time, row.energy_residual, exchange.scale());
        // Comparisons with NaN are false.
        if residual.is_finite() && (!enforced || residual.abs() <= RESIDUAL_LIMIT * scale) {
            return Ok(());
        }
        Err(StepError::Energy {
            time,
            residual,
            scale,
        })
    }

    /// Returns a warning if the ledger does not balance well. If the balance is not `enforced`, a
    /// fatal residual is blamed on the contact springs.
    pub(crate) fn ledger_warning(
        row: &HistoryRow,
        exchange: &ExchangedEnergy,
        enforced: bool,
    ) -> Option<String> {
        let (residual, scale) = (row.energy_residual, exchange.scale());
        let fatal = residual.abs() > RESIDUAL_LIMIT * scale;
        let advice = if fatal && !enforced {
            "with these contact springs the run is unstable; reduce `time.safety` or the \
             stiffnesses"
        } else if !fatal && residual.abs() > RESIDUAL_WARNING * scale {
            "even blocks of one element have less, and the results have at least this error; \
             reduce `time.safety`, or use more elements"
        } else {
            return None;
        };
        Some(format!(
            "the residual of the energy ledger is {} J of {} J, {} %: {advice}",
            significant(residual, 3),
            significant(scale, 3),
            significant(100.0 * residual.abs() / scale, 2)
        ))
    }
}

impl<const D: usize> Run<D> {
    pub(crate) fn block_name(&self, block: usize) -> String {
        self.model.mesh.blocks[block].name.clone()
    }

    /// Visits (block, element number in the block, deformation) of all elements with a strain above
    /// [`STRAIN_LIMIT`]. Stops with an error at the first that is inverted or flat.
    fn each_deformation(
        &self,
        mut visit: impl FnMut(usize, usize, &Deformation),
    ) -> Result<(), StepError> {
        let displacement = &self.state.displacement;
        let sets = self.model.sets.iter();
        let mut strained: Vec<u32> = sets
            .flat_map(|set| set.strained(displacement, STRAIN_LIMIT))
            .collect();
        strained.sort_unstable();
        for element in strained {
            let node = self.model.mesh.elements[element as usize].nodes()[0];
            let block = self.model.block_of[node as usize] as usize;
            if self.model.blocks[block].fixed {
                continue;
            }
            let number = element as usize - self.model.elements(block).start;
            let (set, i) = self.model.numbering.of(element as usize);
            let found = self.model.sets[set].deformation(i, displacement);
            let jacobian = found.min_jacobian;
            if jacobian.is_finite() && (jacobian <= 0.0 || found.min_stretch < FLAT) {
                return Err(StepError::Inverted {
                    time: self.time(),
                    block: self.block_name(block),
                    element: number as u32,
                    jacobian,
                });
            }
            visit(block, number, &found);
        }
        Ok(())
    }

    /// Returns the error for the node with the largest motion; one that is not a number counts as
    /// infinite.
    fn not_finite(&self) -> StepError {
        let motions = self.state.velocity.iter().zip(&self.state.displacement);
        let size = |(v, u): (&[f64; D], &[f64; D])| {
            let size = dot(v, v) + dot(u, u);
            if size.is_nan() { f64::INFINITY } else { size }
        };
        let worst = motions.map(size).enumerate();
        let worst = worst.fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
        StepError::NotFinite {
            time: self.time(),
            block: self.block_name(self.model.block_of[worst.0] as usize),
            node: worst.0 as u32,
        }
    }

    /// Returns the error for the first node that is faster than `limit` relative to its block.
    fn runaway(&self, limit: f64) -> Option<StepError> {
        for block in 0..self.model.blocks.len() {
            let nodes = self.model.nodes(block);
            let mut sum = [0.0; D];
            for velocity in &self.state.velocity[nodes.clone()] {
                add_scaled(&mut sum, 1.0, velocity);
            }
            let mean = scale(1.0 / nodes.len() as f64, &sum);
            for node in nodes {
                let own = sub(&self.state.velocity[node], &mean);
                let speed = dot(&own, &own).sqrt();
                if speed > limit {
                    return Some(StepError::Runaway {
                        time: self.time(),
                        block: self.block_name(block),
                        node: node as u32,
                        speed,
                    });
                }
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ledger_is_told_of_where_more_than_2_per_cent_are_missing() {
        let exchange = ExchangedEnergy {
            start: 100.0,
            maximum: 100.0,
            round_off: 0.0,
        };
        let told = |energy_residual: f64, enforced: bool| {
            let row = HistoryRow {
                energy_residual,
                ..HistoryRow::default()
            };
            ValidityGuard::ledger_warning(&row, &exchange, enforced).unwrap_or_default()
        };
        assert_eq!(told(1.9, true), "");
        assert_eq!(told(-1.9, false), "");
        for enforced in [true, false] {
            let text = told(-2.345, enforced);
            let start = "the residual of the energy ledger is -2.35 J of 100 J, 2.3 %";
            assert!(
                text.starts_with(start) && text.contains("more elements"),
                "{text}"
            );
        }
        assert!(told(11.0, false).contains("springs"));
        // Such a run has stopped itself with an error.
        assert_eq!(told(11.0, true), "");
    }
}
