//! Two hundred rocks of one element fall down steps: the impact loss over the impact energy, and
//! the cost of reducing it.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use cdem::Simulation;
use cdem::output::{BlockRow, ContactRow};
use cdem::scene::ContactModel;
use cdem_verify::{Balance, load};
use nalgebra::Vector3;

/// Steps between two checks of the balance.
const LOOK: u64 = 50;

/// Blocks by name.
type Rows = BTreeMap<String, BlockRow>;

/// Results of a run.
struct Outcome {
    impacts: usize,
    /// Impact loss over the energy of all impacts.
    share: f64,
    updates: u64,
    seconds: f64,
    balance: Balance,
}

fn rows(simulation: &mut Simulation) -> Rows {
    let rows = simulation.block_rows().into_iter();
    rows.map(|row| (row.block.clone(), row)).collect()
}

/// Returns ½ v_n² / W, J, of two blocks at a point, with W of their masses alone. For eccentric
/// impacts the true energy is smaller, by a factor that does not depend on the model.
fn impact_energy(rows: [&BlockRow; 2], point: [f64; 3], normal: [f64; 3], fixed: &str) -> f64 {
    let velocity = rows.map(|row| {
        let arm = Vector3::from(point) - Vector3::from(row.position);
        Vector3::from(row.velocity) + Vector3::from(row.angular_velocity).cross(&arm)
    });
    let approach = (velocity[0] - velocity[1]).dot(&Vector3::from(normal));
    let moving = rows.iter().filter(|row| !row.block.starts_with(fixed));
    let mobility: f64 = moving.map(|row| 1.0 / row.mass).sum();
    0.5 * approach.min(0.0).powi(2) / mobility
}

/// Returns the pairs of blocks in contact, sorted, with a contact point of each and the normal from
/// the second block to the first.
fn pairs(simulation: &Simulation) -> BTreeMap<[String; 2], [[f64; 3]; 2]> {
    let frame = simulation.contact_frame();
    let places = frame.points.into_iter().zip(frame.normals);
    let live = simulation.live_contacts().into_iter().zip(places);
    let pair = |(contact, (point, normal)): (ContactRow, ([f64; 3], [f64; 3]))| {
        if contact.main < contact.target {
            ([contact.main, contact.target], [point, normal])
        } else {
            let normal = normal.map(|x: f64| -x);
            ([contact.target, contact.main], [point, normal])
        }
    };
    live.map(pair).collect()
}

fn fall(model: ContactModel, end: f64) -> Outcome {
    let mut case = load("rockfall-of-200");
    case.scene.contact.model = model;
    case.scene.time.end = end;
    let mut simulation = case.start();
    let mut balance = Balance::new(&mut simulation);
    let (mut sum, mut impacts, mut seconds) = (0.0, 0, 0.0);
    let mut before = rows(&mut simulation);
    let mut touching: BTreeSet<[String; 2]> = BTreeSet::new();
    while !simulation.finished() {
        let begun = Instant::now();
        if let Err(error) = simulation.step() {
            panic!("{error}");
        }
        seconds += begun.elapsed().as_secs_f64();
        let now = pairs(&simulation);
        for (pair, [point, normal]) in now.iter().filter(|(pair, _)| !touching.contains(*pair)) {
            let rows = pair.each_ref().map(|name| &before[name]);
            sum += impact_energy(rows, *point, *normal, "step");
            impacts += 1;
        }
        touching = now.into_keys().collect();
        before = rows(&mut simulation);
        if simulation.step_index().is_multiple_of(LOOK) {
            balance.look(&mut simulation);
        }
    }
    let row = balance.look(&mut simulation);
    Outcome {
        impacts,
        share: row.impact_loss / sum,
        updates: simulation.element_updates(),
        seconds,
        balance,
    }
}

#[test]
#[ignore = "slow study: two hundred rocks"]
fn rocks_fall_down_steps() {
    let models = [ContactModel::UnifiedNode, ContactModel::TwoScale];
    let [coarse, fine] = models.map(|model| {
        let outcome = fall(model, 2.0);
        println!(
            "{model:?}: {} impacts, of whose energy {:.4} is lost at first touches; {:.3e} element \
             updates, {:.1} s; momentum {:.1e}, residual {:.1e}",
            outcome.impacts,
            outcome.share,
            outcome.updates as f64,
            outcome.seconds,
            outcome.balance.momentum,
            outcome.balance.residual,
        );
        assert!(outcome.balance.momentum < 1e-12);
        // Limit of the ledger for blocks of one element.
        assert!(outcome.balance.residual < 2e-2);
        outcome
    });
    println!("time {:.2} times as long", fine.seconds / coarse.seconds);
    assert!(coarse.share > 10.0 * fine.share);
}
