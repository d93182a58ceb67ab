//! The second scale in time: blocks are refined before they collide, and as they were
//! again after it (design, section 6; [Li2015], section 5).

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::Run;
use crate::around::Around;
use crate::contact::remesh::{Place, Sight};
use crate::contact::surface::Positions;
use crate::element::{ElementSet, MAX_NODES, Past};
use crate::mesh::{Element, Mesh};
use crate::model::{Model, State};
use crate::refinement::predecessors;
use crate::refinement::{Body, Change, Cover, Encounter, Momenta, SecondScale, Transfer};
use crate::step::kick::Impulses;
use crate::step::plan::Plan;
use crate::vector::{add_scaled, cross, dot, norm, pad, scale, sub};

/// How far collisions are foreseen, in coarse steps: velocities change by less than half
/// in one, but where other collisions are in between.
const AHEAD: f64 = 1.5;

/// Looks at what new nodes on refined faces meet in the same step, at most.
const LOOKS: usize = 8;

/// Approach over what gravity makes in a coarse step, up to which it is no impact: what
/// rests comes and goes with such speeds.
const RESTING: f64 = 4.0;

/// Way of an approach in the time that waves take across the larger block, over the
/// tolerance of contact, up to which it is no impact.
const SLIGHT: f64 = 1e-2;

/// Time for which a contact is an impact, over that which waves take across the larger of
/// its blocks: twice there and back.
const IMPACT: f64 = 4.0;

/// Time for which a zone stays while its blocks touch elsewhere, the same way; and after
/// they have parted.
const STAY: f64 = 1.0;
const PARTED: f64 = 0.25;

/// Move of a surface as it goes over to a coarser mesh, over the tolerance of contact, that
/// no contact on it feels.
const SLIGHT_JUMP: f64 = 0.1;

/// A block before a change of its mesh.
struct Before<const D: usize> {
    momenta: Momenta,
    centre: [f64; D],
    energy: f64,
}

/// How a block moves.
struct Motion<const D: usize> {
    /// Velocities of its nodes, m/s.
    velocities: Vec<[f64; D]>,
    /// What of them goes with none of its momenta, and is not held.
    loose: Vec<[f64; D]>,
}

impl<const D: usize> Motion<D> {
    /// Velocities without a share of the loose ones, m/s.
    fn but_loose(&self, share: f64) -> Vec<[f64; D]> {
        let all = self.velocities.iter().zip(&self.loose);
        all.map(|(velocity, loose)| sub(velocity, &scale(share, loose)))
            .collect()
    }
}

impl<const D: usize> Run<D> {
    /// Section 6: refines blocks where they are about to collide. Returns what the ledger
    /// lacked before, J, if any mesh has changed.
    pub(super) fn refine(&mut self) -> Option<f64> {
        let mut second = self.second_scale.take()?;
        let mut before = None;
        for block in second.debtors() {
            before.get_or_insert_with(|| self.balance());
            let paid = self.pay(block, second.debt(block));
            second.owe(block, -paid);
        }
        for _ in 0..LOOKS {
            self.ask_for_zones(&mut second);
            let changes = second.changes(self.state.number);
            let changes = self.without_harm(&second, changes);
            if changes.is_empty() {
                break;
            }
            before.get_or_insert_with(|| self.balance());
            self.remesh(&mut second, changes);
            self.find_contacts();
        }
        self.second_scale = Some(second);
        before
    }

    /// The mesh without what is refined now.
    pub(crate) fn base_mesh(&self) -> &Mesh<D> {
        let second = self.second_scale.as_ref();
        second.map_or(&self.model.mesh, |second| &second.foundation.mesh)
    }

    /// How many blocks are refined now.
    pub(crate) fn refined_blocks(&self) -> u64 {
        let covers = self.second_scale.iter().flat_map(SecondScale::covers);
        covers.filter(|cover| cover.is_some()).count() as u64
    }

    /// Changes but those to coarser meshes that would move a surface into, or away from,
    /// what is beside it, or would need more energy than there is.
    fn without_harm(&self, second: &SecondScale<D>, changes: Vec<Change<D>>) -> Vec<Change<D>> {
        let Some(contacts) = &self.contacts else {
            return changes;
        };
        let mut jumps = vec![0.0; self.model.mesh.nodes.len()];
        let can_be = |change: &Change<D>| {
            let of_block = self.jumps(second, change);
            let is_possible = of_block.is_some();
            let nodes = self.model.nodes(change.block);
            for (jump, of_node) in jumps[nodes].iter_mut().zip(of_block.unwrap_or_default()) {
                if of_node > SLIGHT_JUMP * contacts.tolerance() {
                    *jump = of_node;
                }
            }
            is_possible
        };
        let mut changes: Vec<Change<D>> = changes.into_iter().filter(can_be).collect();
        if jumps.iter().any(|&jump| jump > 0.0) {
            let close = contacts.has_close(self.model.positions(&self.state), &jumps);
            changes.retain(|change| !close[change.block]);
        }
        changes
    }

    /// How far the nodes of a block move with a change, m; nothing where that would need
    /// more energy than there is.
    fn jumps(&self, second: &SecondScale<D>, change: &Change<D>) -> Option<Vec<f64>> {
        let (block, cover) = (change.block, change.cover.as_ref());
        let (foundation, old) = (&second.foundation, second.covers()[block].as_ref());
        let transfer = Transfer::between(old, cover, foundation.lame(block))?;
        if transfer.is_finer() {
            return Some(Vec::new());
        }
        let own = &self.state.displacement[self.model.nodes(block)];
        let after = transfer.displacements(own, &self.held(block));
        let strain_energy = foundation.strain_energy(block, cover, &after);
        let is_enough = self.bound_energy_of(block) + strain_energy <= self.energy_of(block);
        is_enough.then(|| transfer.jumps(own, &after))
    }

    /// Components of the nodes of a block whose motion is prescribed.
    fn held(&self, block: usize) -> Vec<[bool; D]> {
        let nodes = self.model.nodes(block);
        nodes.map(|node| self.model.inertia.held(node)).collect()
    }

    /// Kinetic energy of a block without its loose motion, J.
    fn bound_energy_of(&self, block: usize) -> f64 {
        let motion = self.with_momenta(block, &self.before(block));
        self.kinetic_energy_of(block, &motion.but_loose(1.0))
    }

    /// What the ledger lacks, J, but for what was there at the start.
    pub(super) fn balance(&mut self) -> f64 {
        let instant = self.instant();
        self.history(&instant, 0.0).energy_residual
    }

    /// Asks for zones where blocks are about to collide, and keeps them where they do.
    fn ask_for_zones(&self, second: &mut SecondScale<D>) {
        let Some(contacts) = &self.contacts else {
            return;
        };
        let at = self.model.positions(&self.state);
        let zero = vec![[0.0; D]; self.model.mesh.nodes.len()];
        let rest = Positions::new(&self.model.mesh.nodes, &zero);
        let horizon = AHEAD * self.model.step;
        let mut of_pair: BTreeMap<[u32; 2], Vec<Place<D>>> = BTreeMap::new();
        for place in contacts.ahead(at, &self.state.velocity, rest, horizon) {
            let [a, b] = place.blocks;
            of_pair.entry([a.min(b), a.max(b)]).or_default().push(place);
        }
        for (blocks, places) in &of_pair {
            self.ask_for_encounter(second, *blocks, places, contacts.tolerance());
        }
        for place in contacts.present(at, rest) {
            let transit = self.transit(second, place.blocks);
            let since = place.since.unwrap_or_default();
            if self.time() - since <= IMPACT * transit {
                let until = self.until(STAY * transit);
                let [a, b] = place.blocks;
                second.impact([a.min(b), a.max(b)], 0.0, until);
                for (block, rest) in place.blocks.iter().zip(&place.rest) {
                    second.keep(*block as usize, rest, place.slip, until);
                    second.stay(*block as usize, self.until(PARTED * transit));
                }
            }
        }
    }

    /// The coarse step that is so many seconds from now.
    fn until(&self, duration: f64) -> u64 {
        self.state.number + (duration / self.model.step).ceil() as u64 + 1
    }

    /// Time that waves take across the larger of two blocks, s.
    fn transit(&self, second: &SecondScale<D>, blocks: [u32; 2]) -> f64 {
        let of = |block: u32| second.crossing(block as usize);
        let moves = blocks
            .into_iter()
            .filter(|&b| !self.model.blocks[b as usize].fixed);
        moves.map(of).fold(0.0, f64::max)
    }

    fn ask_for_encounter(
        &self,
        second: &mut SecondScale<D>,
        blocks: [u32; 2],
        places: &[Place<D>],
        tolerance: f64,
    ) {
        let transit = self.transit(second, blocks);
        let gravity = norm(&self.model.gravity_at(self.time()));
        let slight = f64::max(
            RESTING * gravity * self.model.step,
            SLIGHT * tolerance / transit,
        );
        let mut nodes = BTreeSet::new();
        let encounters: Vec<Encounter<D>> = places
            .iter()
            .filter(|place| place.speed > slight)
            .map(|place| Encounter {
                is_first_of_node: nodes.insert(place.nodes[0]),
                ..self.encounter(second, place)
            })
            .collect();
        let Some(mobility) = self.mobility(&encounters) else {
            return;
        };
        let fastest = encounters.iter().map(|e| e.speed).fold(0.0, f64::max);
        let until = self.until(STAY * transit);
        let energy = second.impact(blocks, 0.5 * fastest * fastest / mobility, until);
        let sizes = second.depth(&encounters, energy);
        let are_flush = Encounter::are_flush(&encounters);
        for (encounter, sizes) in encounters.iter().zip(sizes) {
            second.ask(encounter, sizes, are_flush, until);
        }
        for block in blocks {
            second.stay(block as usize, self.until(PARTED * transit));
        }
    }

    fn encounter(&self, second: &SecondScale<D>, place: &Place<D>) -> Encounter<D> {
        let root = |element: u32| {
            let parts = self.model.mesh.parts.as_ref();
            parts.map_or(element, |parts| parts.root[element as usize])
        };
        let around = |node: u32| self.around.of(node).iter().map(|&element| root(element));
        let blocks = place.blocks.map(|block| block as usize);
        let sizes = place.nodes.map(|node| second.base_size(around(node)));
        let mass = |side: usize| {
            let number = place.nodes[side] as usize - self.model.nodes(blocks[side]).start;
            second.base_mass(blocks[side], number, &place.rest[side], sizes[side])
        };
        Encounter {
            blocks,
            masses: [mass(0), mass(1)],
            is_first_of_node: true,
            places: place.rest,
            point: place.point,
            normal: place.normal,
            speed: place.speed,
            unified: self.model.step - place.wait % self.model.step,
            sizes,
        }
    }

    /// Inverse mass seen by both blocks as rigid bodies in the middle of some encounters,
    /// along their mean normal, 1/kg; of none, nothing.
    fn mobility(&self, encounters: &[Encounter<D>]) -> Option<f64> {
        let first = encounters.first()?;
        let count = encounters.len() as f64;
        let (mut point, mut normal) = ([0.0; D], [0.0; D]);
        for encounter in encounters {
            add_scaled(&mut point, 1.0 / count, &encounter.point);
            let sign = if encounter.blocks == first.blocks {
                1.0
            } else {
                -1.0
            };
            add_scaled(&mut normal, sign, &encounter.normal);
        }
        let normal = if norm(&normal) > 0.0 {
            scale(1.0 / norm(&normal), &normal)
        } else {
            first.normal
        };
        let of = |&block: &usize| self.rigid_mobility(block, &point, &normal);
        Some(first.blocks.iter().map(of).sum())
    }

    /// Inverse mass of a rigid block at a point along a direction, 1/kg.
    fn rigid_mobility(&self, block: usize, point: &[f64; D], normal: &[f64; D]) -> f64 {
        if self.model.blocks[block].fixed {
            return 0.0;
        }
        let at = self.model.positions(&self.state);
        let nodes = self.model.nodes(block);
        let points: Vec<[f64; D]> = nodes.clone().map(|node| at.at(node as u32)).collect();
        let body = self.body(block, &points);
        let (mass, centre) = body.centre();
        let turn = cross(&pad(&sub(point, &centre)), &pad(normal));
        let spin = body.spin_of(&turn);
        1.0 / mass + dot(&turn, &spin)
    }

    /// A block at its nodes' positions.
    fn body<'a>(
        &'a self,
        block: usize,
        points: &'a [[f64; D]],
    ) -> Body<'a, D, impl Fn(usize, &[[f64; D]]) -> [f64; D] + 'a> {
        let first = self.model.nodes(block).start;
        Body {
            points,
            momentum: move |node: usize, velocities: &[[f64; D]]| {
                let inertia = &self.model.inertia;
                inertia.weighted(first + node, |node| velocities[node - first])
            },
        }
    }

    /// Gives blocks other covers, and all that moves to their new nodes.
    fn remesh(&mut self, second: &mut SecondScale<D>, changes: Vec<Change<D>>) {
        let blocks: Vec<usize> = changes.iter().map(|change| change.block).collect();
        let before: Vec<Before<D>> = blocks.iter().map(|&block| self.before(block)).collect();
        let held: BTreeMap<usize, Vec<[bool; D]>> = blocks
            .iter()
            .map(|&block| (block, self.held(block)))
            .collect();
        let mut old_covers: BTreeMap<usize, Option<Cover<D>>> = BTreeMap::new();
        for change in changes {
            let block = change.block;
            old_covers.insert(block, second.exchange(change));
        }
        let covers = second.covers();
        let time = self.time();
        let old_mesh = self.model.mesh.clone();
        let old_state = std::mem::take(&mut self.state);
        self.bring_up(&blocks, &old_state);
        let momenta = self.momenta_of(&blocks, &old_mesh, &old_state);
        let old_elements = Elements {
            mesh: &old_mesh,
            sets: std::mem::take(&mut self.model.sets),
            place: std::mem::take(&mut self.model.place),
        };
        self.model.remesh(second, time);
        let transfers = old_covers.iter().map(|(&block, old)| {
            let lame = second.foundation.lame(block);
            let transfer = Transfer::between(old.as_ref(), covers[block].as_ref(), lame);
            (block, transfer.expect("zones come or go, not both"))
        });
        let transfers: BTreeMap<usize, Transfer<D>> = transfers.collect();
        let carry = Carry {
            old: &old_mesh,
            new: &self.model.mesh,
            transfers: &transfers,
            base: &second.foundation.mesh,
            covers: old_covers
                .iter()
                .map(|(&block, old)| (block, [old.as_ref(), covers[block].as_ref()]))
                .collect(),
        };
        let origins = carry.origins();
        let mut state = State {
            number: old_state.number,
            displacement: carry.vectors(&old_state.displacement, |block, transfer, of| {
                transfer.displacements(of, &held[&block])
            }),
            carry: carry.values(&old_state.carry),
            velocity: carry.vectors(&old_state.velocity, |_, transfer, of| {
                transfer.velocities(of)
            }),
            element_interval: origins.means(&old_state.element_interval),
            node_interval: carry.scalars(&old_state.node_interval),
            contact_force: carry.values(&old_state.contact_force),
        };
        let mut impulses = Impulses::new(self.model.mesh.nodes.len());
        impulses.before = carry.vectors(&self.impulses.before, |_, transfer, of| {
            transfer.velocities(of)
        });
        impulses.interval = carry.scalars(&self.impulses.interval);
        self.impulses = impulses;
        for (block, transfer) in &transfers {
            if !transfer.is_finer() {
                let gathered = transfer.gather(momenta[block].clone());
                let nodes = self.model.nodes(*block);
                self.model
                    .inertia
                    .solve(nodes.start, &gathered, &mut state.velocity[nodes]);
            }
        }
        self.model
            .remember(&old_elements, &origins, &state.displacement);
        let zeros = [&old_mesh, &self.model.mesh].map(|mesh| vec![[0.0; D]; mesh.nodes.len()]);
        self.state = state;
        for (&block, before) in blocks.iter().zip(&before) {
            self.give_back(block, before);
        }
        let mut changed = vec![false; covers.len()];
        blocks.iter().for_each(|&block| changed[block] = true);
        if let Some(contacts) = &mut self.contacts {
            let mesh = &self.model.mesh;
            let surface = second.foundation.surface(mesh, contacts.tolerance());
            let old = Sight {
                at: Positions::new(&old_mesh.nodes, &old_state.displacement),
                rest: Positions::new(&old_mesh.nodes, &zeros[0]),
            };
            let new = Sight {
                at: Positions::new(&mesh.nodes, &self.state.displacement),
                rest: Positions::new(&mesh.nodes, &zeros[1]),
            };
            let inertia = &self.model.inertia;
            contacts.remesh((old, new), mesh, surface, &changed, inertia, time);
        }
        let mesh = &self.model.mesh;
        self.around = Around::new(mesh.elements.iter().map(Element::nodes), mesh.nodes.len());
        self.node_impulse = carry_touched(&old_mesh, mesh, &self.node_impulse);
        self.touched = (0..mesh.nodes.len() as u32).collect();
        self.plan = Plan::default();
    }

    /// Brings the history of the elements of some blocks up to now.
    fn bring_up(&mut self, blocks: &[usize], state: &State<D>) {
        let model = &mut self.model;
        let mut nothing = vec![[0.0; D]; model.mesh.nodes.len()];
        let mut viscous = nothing.clone();
        for &block in blocks {
            for (set, i) in model.elements(block).map(|e| model.place[e]) {
                model.sets[set as usize].kick(
                    &[i],
                    &[0.0],
                    &state.displacement,
                    &state.velocity,
                    &mut nothing,
                    &mut viscous,
                );
            }
        }
    }

    /// Momenta and energy of a block, to be had again in another mesh.
    fn before(&self, block: usize) -> Before<D> {
        let (points, velocities) = self.motion_of(block);
        let body = self.body(block, &points);
        let (_, centre) = body.centre();
        Before {
            momenta: body.momenta(&velocities, &centre),
            centre,
            energy: self.energy_of(block),
        }
    }

    /// Positions, m, and velocities of the nodes of a block, m/s.
    fn motion_of(&self, block: usize) -> (Vec<[f64; D]>, Vec<[f64; D]>) {
        let at = self.model.positions(&self.state);
        let nodes = self.model.nodes(block);
        let points = nodes.clone().map(|node| at.at(node as u32)).collect();
        (points, self.state.velocity[nodes].to_vec())
    }

    /// Kinetic and strain energy of a block, J: as of the reports, ½v⁻·M·v⁺, but for loads
    /// and contact.
    fn energy_of(&self, block: usize) -> f64 {
        let velocities = &self.state.velocity[self.model.nodes(block)];
        self.kinetic_energy_of(block, velocities)
            + 0.5 * self.power_of(block, velocities)
            + self.model.strain_energy_of(block, &self.state.displacement)
    }

    /// Work of the last kick's forces of a block's elements, at these velocities, J.
    fn power_of(&self, block: usize, velocities: &[[f64; D]]) -> f64 {
        let first = self.model.nodes(block).start;
        let mut force = [[0.0; D]; MAX_NODES];
        let work = self.model.elements(block).map(|element| {
            let (set, i) = self.model.place[element];
            let set = &self.model.sets[set as usize];
            set.force(i as usize, &self.state.displacement, &mut force);
            let nodes = set.nodes(i as usize).iter().zip(&force);
            let power = nodes.map(|(&node, force)| dot(force, &velocities[node as usize - first]));
            self.state.element_interval[element] * power.sum::<f64>()
        });
        work.sum()
    }

    /// Gives a block its momenta back, and takes what energy it has gained. What holds a
    /// block gives it the momentum that it lacks then.
    fn give_back(&mut self, block: usize, before: &Before<D>) {
        let nodes = self.model.nodes(block);
        let motion = self.with_momenta(block, before);
        self.state.velocity[nodes].copy_from_slice(&motion.velocities);
        self.bear(block, &before.momenta);
        self.pay(block, self.energy_of(block) - before.energy);
    }

    /// Books what a block that is held has been given of momentum, and had not before.
    fn bear(&mut self, block: usize, before: &Momenta) {
        if self.held(block).iter().any(|held| held.contains(&true)) {
            let given = sub(&self.before(block).momenta.linear, &before.linear);
            self.ledger.impulse.add_scaled(1.0, &given);
        }
    }

    /// Takes some energy, J, of a block's loose motion; returns how much there was.
    fn pay(&mut self, block: usize, energy: f64) -> f64 {
        if energy <= 0.0 {
            return 0.0;
        }
        let before = self.before(block);
        let motion = self.with_momenta(block, &before);
        // Of a share s of it, s² of its kinetic energy is left, and s of the work.
        let bound = motion.but_loose(1.0);
        let kinetic = self.kinetic_energy_of(block, &motion.loose);
        let both = self.kinetic_energy_of(block, &motion.velocities);
        let mixed = both - kinetic - self.kinetic_energy_of(block, &bound);
        let work = 0.5 * self.power_of(block, &motion.loose);
        let Some(share) = share(kinetic, mixed + work, energy) else {
            return 0.0;
        };
        let nodes = self.model.nodes(block);
        self.state.velocity[nodes].copy_from_slice(&motion.but_loose(1.0 - share));
        self.bear(block, &before.momenta);
        before.energy - self.energy_of(block)
    }

    /// Motion of a block that has been given the momenta it had, as far as it is not held.
    fn with_momenta(&self, block: usize, before: &Before<D>) -> Motion<D> {
        let (points, mut velocities) = self.motion_of(block);
        let body = self.body(block, &points);
        let held = self.held(block);
        let mut wanted = before.momenta;
        if !held.iter().any(|held| held.contains(&true)) {
            let (_, centre) = body.centre();
            let arm = pad(&sub(&centre, &before.centre));
            add_scaled(&mut wanted.angular, -1.0, &cross(&arm, &wanted.linear));
            body.give_back(&mut velocities, &wanted);
            let mut rigid = vec![[0.0; D]; velocities.len()];
            body.give_back(&mut rigid, &wanted);
            let loose = velocities.iter().zip(&rigid).map(|(v, r)| sub(v, r));
            return Motion {
                loose: loose.collect(),
                velocities,
            };
        }
        let (mass, centre) = body.centre();
        let lack = sub(&wanted.linear, &body.momenta(&velocities, &centre).linear);
        let mut loose = velocities.clone();
        for c in 0..D {
            let of_held = velocities.iter().zip(&held).filter(|(_, held)| held[c]);
            let of_held: Vec<f64> = of_held.map(|(velocity, _)| velocity[c]).collect();
            let (shift, rigid) = if of_held.is_empty() {
                (lack[c] / mass, wanted.linear[c] / mass)
            } else {
                (0.0, of_held.iter().sum::<f64>() / of_held.len() as f64)
            };
            for ((velocity, loose), held) in velocities.iter_mut().zip(&mut loose).zip(&held) {
                velocity[c] += shift;
                loose[c] = if held[c] { 0.0 } else { velocity[c] - rigid };
            }
        }
        Motion { velocities, loose }
    }

    /// Kinetic energy of a block with these velocities of its nodes, J.
    fn kinetic_energy_of(&self, block: usize, velocities: &[[f64; D]]) -> f64 {
        let first = self.model.nodes(block).start;
        let energy = |(node, velocity): (usize, &[f64; D])| {
            let of = |node: usize| velocities[node - first];
            0.5 * dot(velocity, &self.model.inertia.weighted(first + node, of))
        };
        velocities.iter().enumerate().map(energy).sum()
    }

    /// Momenta of the nodes of blocks, N·s, before their mesh changes.
    fn momenta_of(
        &self,
        blocks: &[usize],
        mesh: &Mesh<D>,
        state: &State<D>,
    ) -> BTreeMap<usize, Vec<[f64; D]>> {
        let of = |&block: &usize| {
            let nodes = mesh.blocks[block].nodes.clone();
            let momentum = |node: u32| self.model.inertia.momentum(node as usize, &state.velocity);
            (block, nodes.map(momentum).collect())
        };
        blocks.iter().map(of).collect()
    }
}

/// Elements of a mesh: sets, and the place of each in them.
struct Elements<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    sets: Vec<Box<dyn ElementSet<D>>>,
    place: Vec<(u32, u32)>,
}

impl<const D: usize> Elements<'_, D> {
    fn past(&self, element: u32) -> Option<Past<D>> {
        let (set, i) = self.place[element as usize];
        self.sets[set as usize].past(i as usize)
    }

    fn corners(mesh: &Mesh<D>, element: usize) -> impl Iterator<Item = [f64; D]> {
        let nodes = mesh.elements[element].nodes().iter();
        nodes.map(|&node| mesh.nodes[node as usize])
    }
}

impl<const D: usize> Model<D> {
    /// Gives elements the pasts of those that they have come of.
    fn remember(&mut self, old: &Elements<D>, origins: &Origins, displacement: &[[f64; D]]) {
        for (element, of) in origins.iter().enumerate() {
            let (set, i) = self.place[element];
            let set = &mut self.sets[set as usize];
            let own = Elements::corners(&self.mesh, element);
            if own.eq(Elements::corners(old.mesh, of[0] as usize)) {
                let (old_set, old_i) = old.place[of[0] as usize];
                set.set_record(
                    i as usize,
                    old.sets[old_set as usize].record(old_i as usize),
                );
                continue;
            }
            let known: Vec<Past<D>> = of.iter().filter_map(|&e| old.past(e)).collect();
            if let Some(past) = Past::of_all(&known) {
                set.set_past(i as usize, &past, displacement);
            }
        }
    }
}

/// Arrays of one mesh to those of another.
struct Carry<'a, const D: usize> {
    old: &'a Mesh<D>,
    new: &'a Mesh<D>,
    transfers: &'a BTreeMap<usize, Transfer<'a, D>>,
    base: &'a Mesh<D>,
    /// Of blocks that change, before and after.
    covers: BTreeMap<usize, [Option<&'a Cover<D>>; 2]>,
}

impl<'a, const D: usize> Carry<'a, D> {
    /// Block by block: `of` it and its transfer where there is one, else as it is.
    fn vectors<const C: usize>(
        &self,
        all: &[[f64; C]],
        of: impl Fn(usize, &Transfer<'a, D>, &[[f64; C]]) -> Vec<[f64; C]>,
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

    /// For each new element, the old ones that it has come of.
    fn origins(&self) -> Origins {
        let mut origins = Origins::default();
        for (number, block) in self.old.blocks.iter().enumerate() {
            if !self.transfers.contains_key(&number) {
                block.elements.clone().for_each(|e| origins.push(&[e]));
                continue;
            }
            let own = self.base.blocks[number].elements.clone();
            let [old, new] = self.covers[&number];
            for mut of in predecessors(own, old, new) {
                of.iter_mut().for_each(|e| *e += block.elements.start);
                origins.push(&of);
            }
        }
        origins
    }
}

/// For each element of a mesh, those of another that it has come of.
#[derive(Debug, Default)]
struct Origins {
    all: Vec<u32>,
    end: Vec<usize>,
}

impl Origins {
    fn push(&mut self, of: &[u32]) {
        self.all.extend(of);
        self.end.push(self.all.len());
    }

    /// Element by element.
    fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let start = std::iter::once(&0).chain(&self.end);
        start
            .zip(&self.end)
            .map(|(&start, &end)| &self.all[start..end])
    }

    /// Means of what the others have.
    fn means(&self, of: &[f64]) -> Vec<f64> {
        let mean = |all: &[u32]| {
            let sum: f64 = all.iter().map(|&e| of[e as usize]).sum();
            sum / all.len() as f64
        };
        self.iter().map(mean).collect()
    }
}

/// The share s between 0 and 1 for which `kinetic` s² + `work` s is less than all of both
/// by `gained`; where there is none, that for which it is least.
fn share(kinetic: f64, work: f64, gained: f64) -> Option<f64> {
    let least = -0.5 * work / kinetic;
    let square = least * least + (kinetic + work - gained) / kinetic;
    let share = least + square.max(0.0).sqrt();
    share.is_finite().then(|| share.clamp(0.0, 1.0))
}

fn carry_touched<const D: usize>(
    old: &Mesh<D>,
    new: &Mesh<D>,
    impulse: &[[f64; D]],
) -> Vec<[f64; D]> {
    let mut carried = vec![[0.0; D]; new.nodes.len()];
    for (old, new) in old.blocks.iter().zip(&new.blocks) {
        let count = old.nodes.len().min(new.nodes.len());
        let [old, new] = [old, new].map(|block| block.nodes.start as usize);
        carried[new..new + count].copy_from_slice(&impulse[old..old + count]);
    }
    carried
}

fn as_usize(range: &Range<u32>) -> Range<usize> {
    range.start as usize..range.end as usize
}
