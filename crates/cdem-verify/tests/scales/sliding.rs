//! Contacts that slide along a block; refinement zones follow them.

use cdem_verify::{Balance, load, run};

use crate::halvings::halvings_at;

/// Each foot slides over more than twenty elements of the strip. The impulse along the strip
/// follows from Coulomb's law and the normal impulse.
#[test]
fn feet_slide_along_a_strip() {
    let mut simulation = load("sliding-feet").start();
    let friction = 5_f64.to_radians().tan();
    // Load on 1.2 m of the top of the sled.
    let load = 1.2 * 6956.0;
    let mut balance = Balance::new(&mut simulation);
    let (mut most, mut checked) = (0, 0);
    run(&mut simulation, |simulation| {
        let row = balance.look(simulation);
        most = most.max(row.elements);
        if row.contacts == 2 && row.step.is_multiple_of(20) {
            let feet = simulation.contact_frame().points;
            for foot in feet {
                checked += 1;
                let halvings = halvings_at(simulation, foot);
                assert_eq!(halvings, 2, "{foot:?} {row:?}");
            }
        }
    });
    let sled = &simulation.block_rows()[1];
    let time = simulation.time();
    let pressed = sled.velocity[1] + 0.03 + load * time / sled.mass;
    let exact = friction * pressed;
    let lost = 24.0 - sled.velocity[0];
    // The feet may lift off for a moment when the mesh becomes coarse, which begins a new contact.
    let ended = simulation.ended_contacts();
    let live = simulation.live_contacts();
    let slips = ended.iter().chain(&live).map(|contact| contact.slip);
    let slip = 0.5 * slips.sum::<f64>();
    println!(
        "slid {slip:.2} m, {most} elements at most; {lost:.6} m/s lost along the strip, exact {exact:.6}; \
         remesh loss {:.1e}, {balance:?}",
        simulation.history().remesh_loss,
    );
    assert!(checked > 40, "{checked}");
    assert!(slip > 20.0 * 0.25, "{slip}");
    // 0.6 % more is measured: the effect of first touches and vibration.
    assert!((lost / exact - 1.0).abs() < 1e-2, "{lost} {exact}");
    // A strip refined along its whole length would have thousands of elements.
    assert!(most < 1200, "{most}");
    assert!(balance.momentum < 1e-12, "{balance:?}");
    assert!(balance.residual < 1e-3, "{balance:?}");
}
