//! Warnings of penetration: how deep it was, and the positions that were corrected because of it.

use crate::contact::Contacts;
use crate::math::format::quantity;
use crate::math::vector::norm;
use crate::step::Run;

/// Returns the warnings of a run about penetration. In the penalty model it is no fault.
pub(crate) fn warnings<const D: usize>(run: &Run<D>) -> Vec<String> {
    let contacts = run.contacts.iter();
    let contacts = contacts.filter(|contacts| contacts.forbids_penetration());
    contacts
        .flat_map(|contacts| [too_deep(run, contacts), corrected(run, contacts)])
        .flatten()
        .collect()
}

/// Returns a warning if the deepest penetration was deeper than tolerated.
fn too_deep<const D: usize>(run: &Run<D>, contacts: &Contacts<D>) -> Option<String> {
    let at = run.model.positions(&run.state);
    let deepest = contacts.deepest_penetration(at.into(), run.time());
    (deepest.depth > contacts.tolerated_penetration()).then(|| {
        let [main, target] = deepest.blocks.map(|block| run.block_name(block as usize));
        format!(
            "t = {}: block \"{main}\" was {} deep in block \"{target}\", deeper than {}; this was \
             the deepest penetration of the run: try a smaller `time.safety`, or `time.step` if it \
             is set",
            quantity(deepest.time, "s"),
            quantity(deepest.depth, "m"),
            limit(contacts),
        )
    })
}

/// Returns a warning if positions were corrected.
fn corrected<const D: usize>(run: &Run<D>, contacts: &Contacts<D>) -> Option<String> {
    let corrections = run.state.corrections;
    (corrections.count > 0).then(|| {
        format!(
            "positions were corrected at the end of steps (number of steps: {}), because blocks were \
             deeper than half of {}; this added {} of angular momentum: try a smaller `time.safety`, \
             or `time.step` if it is set",
            corrections.count,
            limit(contacts),
            quantity(norm(&corrections.angular_momentum), "N·m·s"),
        )
    })
}

/// Names the deepest penetration that is tolerated.
fn limit<const D: usize>(contacts: &Contacts<D>) -> String {
    let tolerated = contacts.tolerated_penetration();
    let name = if tolerated < contacts.resolution() {
        "`contact.tolerance`"
    } else {
        "the contact resolution"
    };
    format!("{name} ({})", quantity(tolerated, "m"))
}
