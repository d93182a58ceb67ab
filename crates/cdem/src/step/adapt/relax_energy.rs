//! Energy that a finer mesh has in excess is removed from its deformation (design, section 6:
//! coming and going).

use crate::math::vector::add_scaled;
use crate::refinement::Overlay;
use crate::step::Run;
use crate::step::adapt::conserve::scale_factor;

/// Maximum number of tries to exclude nodes whose move would disturb a contact.
const MAX_TRIES: usize = 4;

impl<const D: usize> Run<D> {
    /// Removes `energy`, J, from the deformation of a block with an overlay and restores its
    /// momenta. Returns the excess energy that remains. The displacement field of a non-simplex
    /// element has more strain energy on simplices. A block at its largest deflection has no motion
    /// from which that could be taken. Nodes whose move would disturb a contact stay in place.
    pub(super) fn relax_energy(
        &mut self,
        block: usize,
        overlay: &Overlay<D>,
        lame: [f64; 2],
        energy: f64,
    ) -> f64 {
        let wanted = self.before(block).with_less_energy(energy);
        let Some(relaxation) = self.relaxation(block, overlay, lame) else {
            return energy;
        };
        let first = self.model.nodes(block).start;
        let own = self.state.displacement[self.model.nodes(block)].to_vec();
        let mut energy_after = |part: f64| {
            for (node, (of, relaxation)) in (first..).zip(own.iter().zip(&relaxation)) {
                self.state.displacement[node] = *of;
                add_scaled(&mut self.state.displacement[node], part, relaxation);
            }
            self.energy_of(block)
        };
        let [all, half, none] = [0.0, 0.5, 1.0].map(&mut energy_after);
        // With a fraction s of the deformation left, the energy is square s² + linear s plus that
        // without deformation.
        let square = 2.0 * (all + none - 2.0 * half);
        let left = scale_factor(square, all - none - square, energy).unwrap_or(1.0);
        energy_after(1.0 - left);
        self.restore_momenta(block, &wanted)
    }

    /// Returns the displacements, m, that remove the deformation of a block, with zero for nodes
    /// whose move would disturb a contact.
    fn relaxation(
        &self,
        block: usize,
        overlay: &Overlay<D>,
        lame: [f64; 2],
    ) -> Option<Vec<[f64; D]>> {
        let contacts = self.contacts.as_ref()?;
        let nodes = self.model.nodes(block);
        let at = self.model.positions(&self.state);
        let own = &self.state.displacement[nodes.clone()];
        let mut kept: Vec<bool> = self
            .prescribed_components(block)
            .iter()
            .map(|prescribed| prescribed.contains(&true))
            .collect();
        let mut moves = vec![[0.0; D]; self.model.mesh.nodes.len()];
        for _ in 0..MAX_TRIES {
            let mut relaxation = overlay.relaxation(own, &kept, lame);
            if !kept.contains(&true) {
                self.centre(block, &mut relaxation);
            }
            moves[nodes.clone()].copy_from_slice(&relaxation);
            let disturbing = contacts.nodes_that_disturb_contacts(at.into(), &moves);
            let disturbing = &disturbing[nodes.clone()];
            if !disturbing.contains(&true) {
                return Some(relaxation);
            }
            for (kept, disturbing) in kept.iter_mut().zip(disturbing) {
                *kept |= disturbing;
            }
        }
        None
    }

    /// Removes the displacement of the centre of a block from a relaxation.
    fn centre(&self, block: usize, relaxation: &mut [[f64; D]]) {
        let points = relaxation.to_vec();
        let (_, centre) = self.body(block, &points).centre();
        for displacement in relaxation {
            add_scaled(displacement, -1.0, &centre);
        }
    }
}
