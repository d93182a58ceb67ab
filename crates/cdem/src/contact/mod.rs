//! Contact between blocks (design, sections 4 and 5): detection, islands, and the models
//! `unified-node` and `penalty`.

pub(crate) mod ccd;
pub(crate) mod checkpoint;
pub(crate) mod constraint;
pub(crate) mod detection;
pub(crate) mod energy;
pub(crate) mod grouping;
pub(crate) mod interior;
pub(crate) mod island;
pub(crate) mod model_data;
pub(crate) mod narrow_phase;
pub(crate) mod penalty;
pub(crate) mod penetration;
pub(crate) mod prediction;
pub(crate) mod remap;
pub(crate) mod rollback;
pub(crate) mod solver;
pub(crate) mod state;
pub(crate) mod surface;
pub(crate) mod timing;
pub(crate) mod tolerances;
#[cfg(test)]
mod verification;

use crate::contact::constraint::contact_history::ContactHistory;
use crate::contact::constraint::contact_point::ContactPoint;
use crate::contact::constraint::context::ContactContext;
use crate::contact::constraint::duplicate::DriftInterval;
use crate::contact::constraint::initial_overlap::{InitialOverlaps, ordered};
use crate::contact::detection::candidates::StepSpeeds;
use crate::contact::energy::{ContactEnergies, DriftImpulses};
use crate::contact::interior::BodyCoupling;
use crate::contact::island::parallel::{self, IslandKicks, IslandsInKick};
use crate::contact::island::{Bodies, Island};
use crate::contact::model_data::{ContactLengths, ContactModelData};
use crate::contact::narrow_phase::feature_selection::has_one_normal;
use crate::contact::penetration::Penetration;
use crate::contact::state::{ContactState, ContactWorkspace};
use crate::contact::surface::kicked::KickedView;
use crate::contact::surface::{Configuration, Surface, boundary_2d, boundary_3d};
use crate::contact::timing::DriftStart;
use crate::contact::tolerances::CORRECTED_PENETRATION;
use crate::math::profile::Stage;
use crate::mesh::Mesh;
use crate::model::inverse_mass::InverseMass;
use crate::model::kinematics::NodalMotion;
use crate::model::ledger::WorkVelocity;
use crate::scene::{ContactModel, Scene};

/// All contact between the blocks of a model.
pub(crate) struct Contacts<const D: usize> {
    model_data: ContactModelData<D>,
    state: ContactState<D>,
    workspace: ContactWorkspace<D>,
}

/// Makes the surfaces of the blocks of a mesh, from its thickness, m, and the contact
/// resolution, m.
pub(crate) type MakeSurface<const D: usize> = fn(&Mesh<D>, f64, f64) -> Box<dyn Surface<D>>;

/// Makes the surfaces in 2-D: vertices against edges.
pub(crate) fn plane_surface(
    mesh: &Mesh<2>,
    thickness: f64,
    _tolerance: f64,
) -> Box<dyn Surface<2>> {
    Box::new(boundary_2d::Boundary2d::new(mesh, thickness))
}

/// Makes the surfaces in 3-D: vertices against triangles, edges against edges.
pub(crate) fn solid_surface(
    mesh: &Mesh<3>,
    _thickness: f64,
    resolution: f64,
) -> Box<dyn Surface<3>> {
    Box::new(boundary_3d::Boundary3d::new(mesh, resolution))
}

impl<const D: usize> Contacts<D> {
    /// Creates the contact between the blocks of `mesh`, for coarse steps of this duration, s.
    pub(crate) fn new(
        scene: &Scene,
        mesh: &Mesh<D>,
        surface: Box<dyn Surface<D>>,
        lengths: ContactLengths,
        coarse_step: f64,
    ) -> Self {
        Self {
            model_data: ContactModelData::new(scene, mesh, surface, lengths, coarse_step),
            workspace: ContactWorkspace {
                islands_outdated: true,
                ..ContactWorkspace::new(mesh.nodes.len(), &[])
            },
            state: ContactState::default(),
        }
    }

    /// Closes the pairs within the contact tolerance at t = 0. Pairs with cohesion or tensile
    /// strength become joints. Each keeps its gap.
    pub(crate) fn close_initial(&mut self, at: Configuration<D>, inertia: &InverseMass<D>) {
        let may_meet = |blocks| self.model_data.may_touch(blocks);
        let tolerance = self.model_data.tolerance;
        let mut pairs = self.model_data.touching_pairs(at, tolerance, &may_meet);
        let overlaps = InitialOverlaps::of(&self.model_data.context(inertia), &pairs, at);
        let data = &mut self.model_data;
        data.resolution = data.resolution.max(overlaps.deepest());
        data.initial_overlaps = overlaps;
        let context = ContactContext {
            resolution: tolerance,
            ..data.context(inertia)
        };
        pairs.retain(|&pair| has_one_normal(context.surface, pair, at, context.resolution));
        let mut island = Island::default();
        self.state.energies.touch_count +=
            island.activate_pairs(&context, DriftInterval::at_rest(at), &pairs, 0.0);
        for contact in &mut island.contact_points {
            contact.is_joint = contact.law.cohesion > 0.0 || contact.law.tensile_strength > 0.0;
        }
        self.state.islands = vec![island];
    }

    /// Finds the near pairs of a coarse step, before it. Returns true if the set of nodes
    /// that must share a time level has changed.
    pub(crate) fn find(&mut self, at: Configuration<D>, speeds: &[f64], number: u64) -> bool {
        let blocks = self.model_data.search_context();
        let may_meet = |blocks| self.model_data.may_touch(blocks);
        let ContactWorkspace { search, lists, .. } = &mut self.workspace;
        lists.touching.clear();
        let contacts = self.state.contact_points();
        let touching = contacts.map(|contact| contact.history.blocks);
        lists.touching.extend(touching);
        lists.touching.dedup();
        let speeds = StepSpeeds {
            touching: &lists.touching,
            bounds: speeds,
            step: self.model_data.coarse_step,
        };
        self.state.search_overrun |= search.track(&blocks, at, &self.state.near_pairs, &may_meet);
        search.find_near(&blocks, at, speeds, &may_meet, &mut lists.near_pairs);
        self.state.motion_bounds.clear();
        let motion_bounds = search.blocks.iter().map(|block| block.motion_bound);
        self.state.motion_bounds.extend(motion_bounds);
        self.regroup(number);
        self.join(number)
    }

    /// Marks the islands as out of date, because the time levels of nodes have changed.
    pub(crate) fn ungroup(&mut self) {
        self.workspace.islands_outdated = true;
    }

    /// True if [`Self::drift`] moves this node.
    pub(crate) fn moves_node(&self, node: u32) -> bool {
        self.workspace.index.in_island[node as usize]
    }

    /// Solves the impacts of pairs that are closed at t = 0 and approach.
    pub(crate) fn collide_initial(
        &mut self,
        motion: &mut NodalMotion<D>,
        inertia: &InverseMass<D>,
        step: f64,
        received: &mut Vec<(u32, [f64; D])>,
    ) {
        if self.model_data.model == ContactModel::Penalty {
            return;
        }
        self.state.energies.watch.skip();
        let context = self.model_data.context(inertia);
        for island in &mut self.state.islands {
            island.solve_initial_impact(&context, motion, step, received, &mut self.state.energies);
        }
        self.state.energies.watch.lap(Stage::Geometry);
    }

    /// Applies the contact impulses of the islands that are due, after the kick by elements and
    /// loads. Adds them to a list, N·s.
    pub(crate) fn kick(
        &mut self,
        motion: &mut NodalMotion<D>,
        inertia: &InverseMass<D>,
        kick: &IslandKicks<D>,
        received: &mut Vec<(u32, [f64; D])>,
    ) {
        let Self {
            model_data: data,
            state,
            workspace,
        } = self;
        state.energies.watch.skip();
        let contacts = state.contact_points().count();
        let context = data.context(inertia);
        let cache = &mut workspace.geometry_cache;
        *cache = context.surface.geometry_cache(contacts, cache.take());
        let motion = &mut KickedView::new(motion, cache.as_ref());
        let islands = IslandsInKick {
            islands: &mut state.islands,
            copies: &workspace.velocity_copies,
        };
        let energies = &mut state.energies;
        let ended = kick_islands(
            data.model, islands, &context, motion, kick, received, energies,
        );
        let ended = ended.into_iter();
        state
            .ended
            .extend(ended.map(|history| history.ended(kick.times.time)));
        state.energies.watch.lap(Stage::Geometry);
    }

    /// Computes a kick as [`Self::kick`] does, but on a copy of the islands. Returns the
    /// energies of that kick, with the work taken at the velocities before it.
    pub(crate) fn preview_kick(
        &self,
        motion: &mut NodalMotion<D>,
        inertia: &InverseMass<D>,
        kick: &IslandKicks<D>,
        received: &mut Vec<(u32, [f64; D])>,
    ) -> ContactEnergies {
        let context = self.model_data.context(inertia);
        let mut energies = ContactEnergies {
            at: WorkVelocity::Before,
            ..ContactEnergies::default()
        };
        let contacts = self.contact_points().count();
        let cache = context.surface.geometry_cache(contacts, None);
        let motion = &mut KickedView::new(motion, cache.as_ref());
        let (model, islands) = (self.model_data.model, &mut self.state.islands.clone());
        let islands = IslandsInKick {
            islands,
            copies: &self.workspace.velocity_copies,
        };
        kick_islands(
            model,
            islands,
            &context,
            motion,
            kick,
            received,
            &mut energies,
        );
        energies
    }

    /// Moves the islands that are due through their drift, from one first touch to the next. Adds
    /// the impulses on nodes to lists.
    pub(crate) fn drift(
        &mut self,
        motion: &mut NodalMotion<D>,
        inertia: &InverseMass<D>,
        start: DriftStart,
        coupling: &impl BodyCoupling<D>,
        received: &mut DriftImpulses<D>,
    ) {
        self.state.energies.watch.skip();
        let context = &self.model_data.context(inertia);
        let bodies = &Bodies {
            coupling,
            in_island: &self.workspace.index.in_island,
        };
        let (islands, energies) = (&mut self.state.islands, &mut self.state.energies);
        parallel::drift(islands, context, motion, bodies, start, received, energies);
        self.state.energies.watch.lap(Stage::Geometry);
    }

    /// Returns the impact losses of the present coarse step by normal impulses, J, with the blocks
    /// of each contact, the smaller number first.
    pub(crate) fn step_losses(&self) -> impl Iterator<Item = ([u32; 2], f64)> {
        let ended = self.state.ended[self.state.ended_before..].iter();
        let live = self.contact_points().map(|contact| &contact.history);
        let lossy = ended.chain(live).filter(|history| history.step_loss != 0.0);
        lossy.map(|history| (ordered(history.blocks), history.step_loss))
    }

    /// Ends a coarse step: updates the peak normal forces, which are means over the step.
    pub(crate) fn end_step(&mut self) {
        let step = self.model_data.coarse_step;
        for history in &mut self.state.ended[self.state.ended_before..] {
            history.end_step(step);
        }
        self.state.ended_before = self.state.ended.len();
        for contact in self
            .state
            .islands
            .iter_mut()
            .flat_map(|island| &mut island.contact_points)
        {
            contact.history.end_step(step);
        }
    }

    /// Corrects positions, without a change of velocities: moves nodes by M⁻¹∇g so that the
    /// overlap of closed pairs vanishes, in islands deeper than [`CORRECTED_PENETRATION`].
    /// Returns the nodal moves, m.
    pub(crate) fn correct_positions(
        &mut self,
        at: Configuration<D>,
        inertia: &InverseMass<D>,
        time: f64,
    ) -> Vec<(u32, [f64; D])> {
        let mut moves = Vec::new();
        let limit = CORRECTED_PENETRATION * self.model_data.tolerated_penetration();
        let is_deep = self
            .contact_points()
            .any(|contact| contact.penetration() > limit);
        if !self.forbids_penetration() || !is_deep {
            return moves;
        }
        // The next kick can no longer measure this penetration.
        self.state.energies.penetration = self.deepest_penetration(at, time);
        let context = self.model_data.context(inertia);
        for island in &mut self.state.islands {
            let deepest = island
                .contact_points
                .iter()
                .map(ContactPoint::penetration)
                .fold(0.0, f64::max);
            if deepest > limit {
                moves.extend(island.project_positions(&context, at));
            }
        }
        if !moves.is_empty() {
            for island in &mut self.state.islands {
                island.separation_bounds.forget();
            }
        }
        moves
    }

    /// Returns all contact points.
    pub(crate) fn contact_points(&self) -> impl Iterator<Item = &ContactPoint<D>> {
        self.state.contact_points()
    }

    /// Returns the contacts that have ended since the last call.
    pub(crate) fn take_ended(&mut self) -> Vec<ContactHistory> {
        self.state.ended_before = 0;
        self.state.ended.drain(..).collect()
    }

    /// True if nodes have moved farther in a coarse step than their motion bound, in any step
    /// since the last call.
    pub(crate) fn take_search_overrun(&mut self) -> bool {
        std::mem::replace(&mut self.state.search_overrun, false)
    }

    /// True if two blocks must never overlap.
    pub(crate) fn keeps_apart(&self, a: u32, b: u32) -> bool {
        self.model_data.model != ContactModel::Penalty && self.model_data.may_touch([a, b])
    }

    /// Returns the contact resolution, m.
    pub(crate) fn resolution(&self) -> f64 {
        self.model_data.resolution
    }

    /// Returns the energies so far, J.
    pub(crate) fn energies(&self) -> &ContactEnergies {
        &self.state.energies
    }

    /// Starts to measure the time that contact takes.
    pub(crate) fn time_stages(&mut self) {
        self.state.energies.watch.start();
    }

    /// Returns the number of contacts that have begun so far.
    pub(crate) fn contacts_begun(&self) -> u64 {
        self.state.energies.touch_count
    }

    /// Returns the deepest penetration over the starts of all kicks so far and over now.
    pub(crate) fn deepest_penetration(&self, now: Configuration<D>, time: f64) -> Penetration {
        let mut deepest = self.state.energies.penetration;
        for contact in self.contact_points() {
            let gap = self.model_data.surface.gap_or_zero(contact.pair, now);
            deepest.include(Penetration {
                depth: contact.initial_gap - gap,
                time,
                blocks: contact.history.blocks,
            });
        }
        deepest
    }

    /// Returns the deepest penetration that is tolerated, m.
    pub(crate) fn tolerated_penetration(&self) -> f64 {
        self.model_data.tolerated_penetration()
    }

    /// True if penetration is an error: in the penalty model it carries the contact.
    pub(crate) fn forbids_penetration(&self) -> bool {
        self.model_data.model != ContactModel::Penalty
    }

    /// Returns the surfaces.
    pub(crate) fn surface(&self) -> &dyn Surface<D> {
        &*self.model_data.surface
    }

    /// Returns the energy of the penalty springs, J.
    pub(crate) fn spring_energy(&self, at: Configuration<D>) -> f64 {
        match self.model_data.model {
            ContactModel::Penalty => self
                .contact_points()
                .map(|contact| contact.spring_energy(&*self.model_data.surface, at))
                .sum(),
            _ => 0.0,
        }
    }
}

/// Applies the contact impulses of the islands that are due in a kick. Adds them to a list, N·s.
/// Returns the contacts that have ended.
fn kick_islands<const D: usize>(
    model: ContactModel,
    islands: IslandsInKick<D>,
    context: &ContactContext<D>,
    motion: &mut KickedView<D>,
    kick: &IslandKicks<D>,
    received: &mut Vec<(u32, [f64; D])>,
    energies: &mut ContactEnergies,
) -> Vec<ContactHistory> {
    if model != ContactModel::Penalty {
        return parallel::kick(islands, context, motion, kick, received, energies);
    }
    let press = |island: &mut Island<D>| {
        let span = island.kick_span(kick.times)?;
        Some(island.kick_penalty(context, motion, kick, span.interval, received, energies))
    };
    islands
        .islands
        .iter_mut()
        .filter_map(press)
        .flatten()
        .collect()
}
