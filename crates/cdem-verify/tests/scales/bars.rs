//! Two-scale impact of flush bars of unequal impedance, compared with the force of wave theory.

use cdem::mesh::ElementKind;
use cdem::scene::{ContactModel, Mass, Time, ZoneExtent};
use cdem_verify::{Balance, Case, load, run};

const DENSITY: f64 = 2700.0;
const YOUNG_MODULUS: f64 = 40e9;
const SPEED: f64 = 3.0;
const LENGTH: f64 = 10.0;
/// Time of first touch: the bars start 1 cm apart.
const TOUCH: f64 = 0.01 / SPEED;

/// Results of a contact. Times are in wave transits through an element of the base mesh.
struct Outcome {
    /// Times after first touch, and the impulse until then over that of wave theory.
    impulse: Vec<[f64; 2]>,
    /// Mean force of each transit over that of wave theory.
    force: Vec<f64>,
    elements: u64,
}

/// Two bars with impedances 1 : `ratio`, meshed by square cells, `rows` across.
#[derive(Clone, Copy, Debug)]
struct Bars {
    ratio: f64,
    rows: usize,
    element: ElementKind,
    zone: ZoneExtent,
}

impl Bars {
    /// Returns all tested bars.
    fn all() -> impl Iterator<Item = Self> {
        let pairs = [
            (2.0, 1, ElementKind::Quad4),
            (2.0, 2, ElementKind::Quad4),
            (10.0, 1, ElementKind::Quad4),
            (10.0, 2, ElementKind::Tri3),
        ];
        [ZoneExtent::Graded, ZoneExtent::Wavefront]
            .into_iter()
            .flat_map(move |zone| {
                pairs.into_iter().map(move |(ratio, rows, element)| Self {
                    ratio,
                    rows,
                    element,
                    zone,
                })
            })
    }

    fn case(&self) -> Case {
        let mut case = load("unequal-bars");
        let contact = &mut case.scene.contact;
        contact.model = ContactModel::TwoScale;
        contact.tolerance = None;
        contact.zone = self.zone;
        case.scene.material[1].density = DENSITY * self.ratio * self.ratio;
        case.divide("left", &[10 * self.rows, self.rows], self.element);
        case.divide("right", &[5 * self.rows, self.rows], self.element);
        for block in &mut case.scene.block {
            block.mass = Mass::Auto;
        }
        case
    }

    /// Returns the time of a wave through an element of the lighter bar, s.
    fn transit(&self) -> f64 {
        LENGTH / (10 * self.rows) as f64 / (YOUNG_MODULUS / DENSITY).sqrt()
    }

    /// Returns the force of wave theory, N.
    fn force(&self) -> f64 {
        let light = (DENSITY * YOUNG_MODULUS).sqrt();
        SPEED * light * self.ratio / (1.0 + self.ratio)
    }

    /// Runs the contact in steps of a quarter of a transit.
    fn collide(&self) -> Outcome {
        let (transit, exact) = (self.transit(), self.force());
        let mut case = self.case();
        case.scene.time.step = Some(0.25 * transit);
        let mut simulation = case.start();
        let mut elements = 0;
        let mut impulse = vec![[0.0; 2]];
        run(&mut simulation, |simulation| {
            elements = elements.max(simulation.history().elements);
            // The impulse at an instant is the momentum of the struck bar. The reported forces are
            // those of earlier kicks and lack the half of the kick that is due at this instant.
            let struck = &simulation.block_rows()[1];
            let elapsed = simulation.time() - TOUCH;
            if elapsed > 0.0 {
                let momentum = struck.mass * struck.velocity[0];
                impulse.push([elapsed / transit, momentum / exact / transit]);
            }
        });
        let until = |time: f64| {
            let after = impulse.partition_point(|row| row[0] < time).max(1);
            let [[t0, sum0], [t1, sum1]] = [impulse[after - 1], impulse[after]];
            sum0 + (sum1 - sum0) * (time - t0) / (t1 - t0)
        };
        // Three quarters of the contact, because its end is spread over some elements.
        let transits = 15 * self.rows;
        let force = (1..=transits).map(|n| until(n as f64) - until((n - 1) as f64));
        Outcome {
            force: force.collect(),
            elements,
            impulse: impulse
                .into_iter()
                .filter(|row| row[0] <= transits as f64)
                .collect(),
        }
    }

    /// Returns the worst energy residual after `change` is applied to the time settings.
    fn residual(&self, change: impl FnOnce(&mut Time)) -> f64 {
        let mut case = self.case();
        change(&mut case.scene.time);
        let mut simulation = case.start();
        let mut balance = Balance::new(&mut simulation);
        run(&mut simulation, |simulation| {
            balance.look(simulation);
        });
        balance.residual
    }
}

/// Both sides are refined to equal transit times, so that first touch gives the velocity of wave
/// theory at once.
fn force_is_that_of_wave_theory(rows: usize) {
    for bars in Bars::all().filter(|bars| bars.rows == rows) {
        let outcome = bars.collide();
        let after = outcome.impulse.iter().filter(|row| row[0] >= 1.0);
        let means = after.map(|[time, impulse]| impulse / time);
        let [least, most] = means.fold([f64::INFINITY, 0.0_f64], |[least, most], mean| {
            [least.min(mean), most.max(mean)]
        });
        println!(
            "{bars:?}: {} elements, mean force from the first transit on {least:.3} to {most:.3}, of \
             each {:.3?}",
            outcome.elements, outcome.force
        );
        assert!(0.98 < least && most < 1.02, "{least} {most}");
    }
}

#[test]
fn unequal_bars_give_the_force_of_wave_theory() {
    force_is_that_of_wave_theory(1);
}

#[test]
#[ignore = "slow study: bars of two rows of elements"]
fn unequal_bars_of_two_rows_give_the_force_of_wave_theory() {
    force_is_that_of_wave_theory(2);
}

/// If the step changes by a factor of two under a stress σ, the impulses on a node balance only
/// over the longer step, 2δ. In between, the node moves at ±σ A δ / (2 m), and the ledger measures
/// ½v⁻·M·v⁺ = −(σ A δ)² / (8 m). That is δ² c² / (4 h²) of the strain energy of an element there.
/// It is not a loss: it vanishes with the stress.
fn ledger_lacks_the_square_of_the_step(all: impl Iterator<Item = Bars>) {
    for bars in all {
        let with = |safety| bars.residual(|time| time.safety = safety);
        let [most, half, quarter] = [0.5, 0.25, 0.125].map(with);
        println!("{bars:?}: residual {most:.2e}, with half the step {half:.2e}, {quarter:.2e}");
        assert!(most < 4e-3 && half < 1e-3, "{most} {half}");
        // The residual is sampled after coarse steps; the shortest run has nine.
        assert!((3.5..4.5).contains(&(half / quarter)), "{half} {quarter}");
    }
}

#[test]
fn what_the_ledger_lacks_falls_with_the_square_of_the_step() {
    ledger_lacks_the_square_of_the_step(Bars::all().take(1));
}

#[test]
#[ignore = "slow study: all bars"]
fn what_the_ledger_lacks_in_any_bar_falls_with_the_square_of_the_step() {
    ledger_lacks_the_square_of_the_step(Bars::all());
}

/// With several levels the residual is 3e-3. Here one step is stable for the finest elements.
#[test]
fn on_one_time_level_the_ledger_lacks_nothing() {
    let bars = Bars {
        ratio: 2.0,
        rows: 2,
        element: ElementKind::Quad4,
        zone: ZoneExtent::Graded,
    };
    let residual = bars.residual(|time| time.step = Some(0.05 * bars.transit()));
    println!("{bars:?}: residual {residual:.1e}");
    assert!(residual < 1e-5, "{residual}");
}
