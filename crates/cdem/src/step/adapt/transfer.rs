//! Change of the mesh of blocks: transfer of all data to the new nodes and elements.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::contact::remap::{MeshConfiguration, MeshExchange};
use crate::element::StressHistory;
use crate::math::vector::sub;
use crate::mesh::Mesh;
use crate::model::inverse_mass::SplitMotion;
use crate::model::positions::Positions;
use crate::model::state::LastKick;
use crate::model::{Model, State};
use crate::refinement::{Adaptivity, BlockChange, MeshTransfer, RefinedBlock, predecessors};
use crate::step::Run;
use crate::step::adapt::conserve::BlockBefore;
use crate::step::adapt::remesh::MeshElements;
use crate::step::adapt::when::ROUND_OFF;
use crate::step::kick::KickImpulses;
use crate::step::schedule::KickSchedule;
use crate::step::workspace::elements_around_nodes;

impl<const D: usize> Run<D> {
    /// Exchanges the overlays of blocks and transfers all data to the new nodes and elements.
    pub(super) fn remesh(&mut self, adaptivity: &mut Adaptivity<D>, changes: Vec<BlockChange<D>>) {
        self.end_steady_forces();
        let blocks: Vec<usize> = changes.iter().map(|change| change.block).collect();
        let before: Vec<BlockBefore<D>> = blocks.iter().map(|&block| self.before(block)).collect();
        let rigid = blocks.iter().zip(&before).map(|(&block, before)| {
            let rigid = self
                .with_momenta(block, &before.rigid)
                .without_vibration(1.0);
            (block, rigid)
        });
        let rigid = rigid.collect();
        let old_mesh = self.model.mesh.clone();
        let (old_state, kicks) = self.transfer_all(adaptivity, changes, &rigid, &old_mesh);
        let unpaid = blocks.iter().zip(&before);
        let unpaid: Vec<f64> = unpaid
            .map(|(&block, before)| self.restore_momenta(block, before))
            .collect();
        for (&block, before) in blocks.iter().zip(&before) {
            let work = self.work_of_gravity(block, before);
            self.state.ledger.gravity_work += work;
            adaptivity.add_energy_debt(block, -work);
        }
        let old = MeshConfiguration {
            at: Positions::new(&old_mesh.nodes, &old_state.displacement).into(),
            rest: Positions::at_rest(&old_mesh.nodes).into(),
        };
        self.remesh_contacts(adaptivity, &blocks, old);
        for (&block, unpaid) in blocks.iter().zip(unpaid) {
            let unpaid = self.repay_from_deformation(adaptivity, block, unpaid);
            adaptivity.add_energy_debt(block, unpaid);
        }
        // The change of velocity by a remesh is no acceleration.
        for node in blocks.iter().flat_map(|&block| self.model.nodes(block)) {
            self.state.last_kick.velocity_before[node] =
                sub(&self.state.velocity[node], &kicks[node]);
        }
        let mesh = &self.model.mesh;
        self.workspace.adjacency = elements_around_nodes(mesh);
        self.workspace.touched_nodes = (0..mesh.nodes.len() as u32).collect();
        self.workspace.schedule = KickSchedule::default();
    }

    /// Exchanges overlays and transfers model and state. Velocities of coarsened blocks follow from
    /// their momenta beyond those of their `rigid` motion, m/s. Returns the old state, and the
    /// velocity changes of the last kick, m/s.
    fn transfer_all(
        &mut self,
        adaptivity: &mut Adaptivity<D>,
        changes: Vec<BlockChange<D>>,
        rigid: &BTreeMap<usize, Vec<[f64; D]>>,
        old_mesh: &Mesh<D>,
    ) -> (State<D>, Vec<[f64; D]>) {
        let blocks: Vec<usize> = changes.iter().map(|change| change.block).collect();
        let momenta = self.vibration_momenta(rigid);
        let (mut old_covers, mut coarser) = (BTreeMap::new(), BTreeMap::new());
        for mut change in changes {
            let block = change.block;
            if let Some(displacement) = change.displacement.take() {
                coarser.insert(block, displacement);
            }
            old_covers.insert(block, adaptivity.exchange(change));
        }
        self.bring_up(&blocks);
        let time = self.time();
        let old_elements = self.model.remesh(adaptivity, time);
        let old_state = &self.state;
        let refined_blocks = old_covers.iter().map(|(&block, old)| {
            let refined_blocks = [old.as_ref(), adaptivity.refined_blocks()[block].as_ref()];
            (block, refined_blocks)
        });
        let refined_blocks: BTreeMap<usize, [Option<&RefinedBlock<D>>; 2]> =
            refined_blocks.collect();
        let transfers = refined_blocks.iter().map(|(&block, &[old, new])| {
            let transfer = MeshTransfer::between(old, new, adaptivity.base_model.lame(block));
            (block, transfer.expect("zones come or go, not both"))
        });
        let transfers: BTreeMap<usize, MeshTransfer<D>> = transfers.collect();
        let state_transfer = StateTransfer {
            old: old_mesh,
            new: &self.model.mesh,
            transfers: &transfers,
            base: &adaptivity.base_model.mesh,
            refined_blocks,
        };
        let origins = state_transfer.origins();
        let mut state = state_transfer.state(old_state, &origins, &coarser);
        let kicks = old_state
            .velocity
            .iter()
            .zip(&old_state.last_kick.velocity_before);
        let kicks: Vec<[f64; D]> = kicks.map(|(now, before)| sub(now, before)).collect();
        let kicks = state_transfer.values(&kicks);
        self.workspace.impulses = KickImpulses::new(self.model.mesh.nodes.len());
        for (block, transfer) in transfers.iter().filter(|(_, t)| !t.is_finer()) {
            let nodes = self.model.nodes(*block);
            let rigid = transfer.velocities(&rigid[block]);
            let restricted = transfer.restrict(momenta[block].clone());
            let own = &mut state.velocity[nodes.clone()];
            let inertia = &self.model.inertia;
            let motion = SplitMotion {
                rigid: &rigid,
                vibration_momenta: &restricted,
            };
            inertia.solve(nodes.start, motion, own);
        }
        self.model
            .restore_history(&old_elements, &origins, &state.displacement);
        let old_state = std::mem::replace(&mut self.state, state);
        (old_state, kicks)
    }

    /// Removes `energy`, J, from the deformation of a refined block; returns the excess energy that
    /// remains.
    fn repay_from_deformation(
        &mut self,
        adaptivity: &Adaptivity<D>,
        block: usize,
        energy: f64,
    ) -> f64 {
        match &adaptivity.refined_blocks()[block] {
            Some(refined_block) if energy > ROUND_OFF * self.energy_of(block) => {
                let lame = adaptivity.base_model.lame(block);
                self.relax_energy(block, &refined_block.overlay, lame, energy)
            }
            _ => energy,
        }
    }

    /// Transfers the contacts of blocks from the old mesh to the new one.
    fn remesh_contacts(
        &mut self,
        adaptivity: &Adaptivity<D>,
        blocks: &[usize],
        old: MeshConfiguration<D>,
    ) {
        let Some(contacts) = &mut self.contacts else {
            return;
        };
        let mesh = &self.model.mesh;
        let new = MeshConfiguration {
            at: Positions::new(&mesh.nodes, &self.state.displacement).into(),
            rest: Positions::at_rest(&mesh.nodes).into(),
        };
        let mut changed = vec![false; self.model.blocks.len()];
        blocks.iter().for_each(|&block| changed[block] = true);
        let surface = adaptivity.base_model.surface(mesh, contacts.resolution());
        let time = self.state.number as f64 * self.model.step;
        let inertia = &self.model.inertia;
        let exchange = MeshExchange {
            old,
            new,
            mesh,
            changed: &changed,
        };
        contacts.remesh(exchange, surface, inertia, time);
    }

    /// Updates the history of the elements of some blocks to the present instant.
    fn bring_up(&mut self, blocks: &[usize]) {
        let Self { model, state, .. } = self;
        for &block in blocks {
            for (set, i) in model.elements(block).map(|e| model.numbering.of(e)) {
                model.sets[set].update_record(i, &state.displacement);
            }
        }
    }

    /// Returns the nodal momenta of the vibration of blocks, N·s: those beyond their `rigid`
    /// motion, m/s. They are the same in every inertial frame.
    fn vibration_momenta(
        &self,
        rigid: &BTreeMap<usize, Vec<[f64; D]>>,
    ) -> BTreeMap<usize, Vec<[f64; D]>> {
        let of = |(&block, rigid): (&usize, &Vec<[f64; D]>)| {
            let nodes = self.model.nodes(block);
            let first = nodes.start;
            let vibration = |node: usize| sub(&self.state.velocity[node], &rigid[node - first]);
            let momentum = |node: usize| self.model.inertia.weighted(node, vibration);
            (block, nodes.map(momentum).collect())
        };
        rigid.iter().map(of).collect()
    }
}

impl<const D: usize> MeshElements<D> {
    fn past(&self, element: u32) -> Option<StressHistory<D>> {
        let (set, i) = self.numbering.of(element as usize);
        self.sets[set].stress_history(i)
    }

    fn corners(mesh: &Mesh<D>, element: usize) -> impl Iterator<Item = [f64; D]> {
        let nodes = mesh.elements[element].nodes().iter();
        nodes.map(|&node| mesh.nodes[node as usize])
    }
}

impl<const D: usize> Model<D> {
    /// Gives elements the stress histories of the elements that they come from.
    fn restore_history(
        &mut self,
        old: &MeshElements<D>,
        origins: &SourceElements,
        displacement: &[[f64; D]],
    ) {
        for (element, of) in origins.iter().enumerate() {
            let (set, i) = self.numbering.of(element);
            let set = &mut self.sets[set];
            let own = MeshElements::corners(&self.mesh, element);
            if own.eq(MeshElements::corners(&old.mesh, of[0] as usize)) {
                let (old_set, old_i) = old.numbering.of(of[0] as usize);
                set.set_record(i, &old.sets[old_set].record(old_i));
                continue;
            }
            let known: Vec<StressHistory<D>> = of.iter().filter_map(|&e| old.past(e)).collect();
            if let Some(past) = StressHistory::of_all(&known) {
                set.set_stress_history(i, &past, displacement);
            }
        }
    }
}

/// Transfer of arrays from one mesh to another.
struct StateTransfer<'a, const D: usize> {
    old: &'a Mesh<D>,
    new: &'a Mesh<D>,
    transfers: &'a BTreeMap<usize, MeshTransfer<'a, D>>,
    base: &'a Mesh<D>,
    /// Blocks that change, before and after.
    refined_blocks: BTreeMap<usize, [Option<&'a RefinedBlock<D>>; 2]>,
}

impl<'a, const D: usize> StateTransfer<'a, D> {
    /// Transfers a nodal array block by block: with `of` if the block has a transfer, else
    /// unchanged.
    fn vectors<const C: usize>(
        &self,
        all: &[[f64; C]],
        of: impl Fn(usize, &MeshTransfer<'a, D>, &[[f64; C]]) -> Vec<[f64; C]>,
    ) -> Vec<[f64; C]> {
        let mut new = Vec::with_capacity(self.new.nodes.len());
        for (number, block) in self.old.blocks.iter().enumerate() {
            let own = &all[as_usize(&block.nodes)];
            match self.transfers.get(&number) {
                Some(transfer) => new.extend(of(number, transfer, own)),
                None => new.extend(own),
            }
        }
        new
    }

    fn values<const C: usize>(&self, all: &[[f64; C]]) -> Vec<[f64; C]> {
        self.vectors(all, |_, transfer, of| transfer.values(of))
    }

    fn scalars(&self, all: &[f64]) -> Vec<f64> {
        let all: Vec<[f64; 1]> = all.iter().map(|&x| [x]).collect();
        self.values(&all).into_iter().map(|[x]| x).collect()
    }

    /// Returns the state of the old mesh on the new one. Coarsened blocks have the displacements of
    /// `coarser`, m; their velocities still lack their momenta.
    fn state(
        &self,
        old: &State<D>,
        origins: &SourceElements,
        coarser: &BTreeMap<usize, Vec<[f64; D]>>,
    ) -> State<D> {
        State {
            displacement: self.vectors(&old.displacement, |block, transfer, of| {
                let known = coarser.get(&block).cloned();
                known.unwrap_or_else(|| transfer.prolongated_displacements(of))
            }),
            compensation: self.values(&old.compensation),
            velocity: self.vectors(&old.velocity, |_, transfer, of| transfer.velocities(of)),
            element_interval: origins.means(&old.element_interval),
            node_interval: self.scalars(&old.node_interval),
            contact_force: self
                .vectors(&old.contact_force, |_, transfer, of| transfer.impulses(of)),
            last_kick: LastKick {
                velocity_before: self.vectors(&old.last_kick.velocity_before, |_, transfer, of| {
                    transfer.velocities(of)
                }),
                interval: self.scalars(&old.last_kick.interval),
            },
            node_impulse: self.vectors(&old.node_impulse, |_, transfer, of| transfer.impulses(of)),
            block_impulse: old.block_impulse.clone(),
            steady_forces: Vec::new(),
            ..*old
        }
    }

    /// Returns, for each new element, the old elements that it comes from.
    fn origins(&self) -> SourceElements {
        let mut origins = SourceElements::default();
        for (number, block) in self.old.blocks.iter().enumerate() {
            if !self.transfers.contains_key(&number) {
                block.elements.clone().for_each(|e| origins.push(&[e]));
                continue;
            }
            let own = self.base.blocks[number].elements.clone();
            let [old, new] = self.refined_blocks[&number];
            for mut of in predecessors(own, old, new) {
                of.iter_mut().for_each(|e| *e += block.elements.start);
                origins.push(&of);
            }
        }
        origins
    }
}

/// For each element of a mesh, the elements of another mesh that it comes from.
#[derive(Debug, Default)]
struct SourceElements {
    all: Vec<u32>,
    end: Vec<usize>,
}

impl SourceElements {
    fn push(&mut self, of: &[u32]) {
        self.all.extend(of);
        self.end.push(self.all.len());
    }

    /// Iterates over the elements.
    fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let start = std::iter::once(&0).chain(&self.end);
        start
            .zip(&self.end)
            .map(|(&start, &end)| &self.all[start..end])
    }

    /// Returns the mean of `of` over the source elements of each element.
    fn means(&self, of: &[f64]) -> Vec<f64> {
        let mean = |all: &[u32]| {
            let sum: f64 = all.iter().map(|&e| of[e as usize]).sum();
            sum / all.len() as f64
        };
        self.iter().map(mean).collect()
    }
}

fn as_usize(range: &Range<u32>) -> Range<usize> {
    range.start as usize..range.end as usize
}
