//! What a finer mesh has no energy for goes out of its deformation (design, section 6:
//! coming and going).

use crate::math::vector::add_scaled;
use crate::refinement::Overlay;
use crate::step::Run;
use crate::step::adapt::conserve::share;

/// Looks at what is beside nodes that are to move, at most.
const LOOKS: usize = 4;

impl<const D: usize> Run<D> {
    /// Takes so much `energy`, J, of a block's deformation that has an overlay, and gives it
    /// its momenta back; returns how much it still has too much. The field of an element that
    /// is no simplex has more strain energy on simplices: in the middle of its vibration a
    /// block has no motion to take that from. Nothing moves that is beside others.
    pub(super) fn relax_energy(
        &mut self,
        block: usize,
        overlay: &Overlay<D>,
        lame: [f64; 2],
        energy: f64,
    ) -> f64 {
        let wanted = self.before(block).change(energy);
        let Some(shift) = self.relaxation(block, overlay, lame) else {
            return energy;
        };
        let first = self.model.nodes(block).start;
        let own = self.state.displacement[self.model.nodes(block)].to_vec();
        let mut energy_after = |part: f64| {
            for (node, (of, shift)) in (first..).zip(own.iter().zip(&shift)) {
                self.state.displacement[node] = *of;
                add_scaled(&mut self.state.displacement[node], part, shift);
            }
            self.energy_of(block)
        };
        let [all, half, none] = [0.0, 0.5, 1.0].map(&mut energy_after);
        // Of a share s of it, energy is square s² + linear s besides what none has.
        let square = 2.0 * (all + none - 2.0 * half);
        let left = share(square, all - none - square, energy).unwrap_or(1.0);
        energy_after(1.0 - left);
        self.restore_momenta(block, &wanted)
    }

    /// Where the nodes of a block that are not beside others would go without deformation, m.
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
            .map(|h| h.contains(&true))
            .collect();
        let mut moves = vec![[0.0; D]; self.model.mesh.nodes.len()];
        for _ in 0..LOOKS {
            let mut shift = overlay.slack(own, &kept, lame);
            if !kept.contains(&true) {
                self.centre(block, &mut shift);
            }
            moves[nodes.clone()].copy_from_slice(&shift);
            let harmed = contacts.blocks_harmed(at.into(), &moves);
            let harmed = &harmed[nodes.clone()];
            if !harmed.contains(&true) {
                return Some(shift);
            }
            for (kept, harmed) in kept.iter_mut().zip(harmed) {
                *kept |= harmed;
            }
        }
        None
    }

    /// Leaves the centre of a block where it is.
    fn centre(&self, block: usize, shift: &mut [[f64; D]]) {
        let points = shift.to_vec();
        let (_, centre) = self.body(block, &points).centre();
        for shift in shift {
            add_scaled(shift, -1.0, &centre);
        }
    }
}
