//! Small sampled loops whose critical gain is known exactly.

use super::*;
use crate::session::AxisSignals;
use crate::spectra::Window;
use backdrive_plant::excitation::Excitation;
use nalgebra::{Complex, DMatrix, DVector, Matrix2, Vector2};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

const PERIOD: f64 = 5e-4;
const WALL: f64 = 5000.0;

/// A held mass, stepped exactly under a force that is held from row to row.
#[derive(Clone)]
struct Mass {
    a: Matrix2<f64>,
    b: Vector2<f64>,
}

impl Mass {
    /// kg, N s/m, N/m.
    fn new(mass: f64, damping: f64, stiffness: f64) -> Mass {
        let a = Matrix2::new(0.0, 1.0, -stiffness / mass, -damping / mass);
        // The exponential of the matrix by its series, at a small step doubled up.
        let (mut ad, mut bd) = (Matrix2::identity(), Vector2::zeros());
        let small = PERIOD / 1024.0;
        let (mut term, mut sum) = (Matrix2::identity(), Matrix2::zeros());
        for n in 1..12 {
            sum += term * (small / f64::from(n));
            term = term * a * (small / f64::from(n));
            ad += term;
        }
        bd += sum * Vector2::new(0.0, 1.0 / mass);
        for _ in 0..10 {
            bd += ad * bd;
            ad *= ad;
        }
        Mass { a: ad, b: bd }
    }

    /// Response of the position at a row to a force that is held from it on.
    fn response(&self, hz: f64) -> Complex<f64> {
        let z = Complex::from_polar(1.0, TAU * hz * PERIOD);
        let m = self.a;
        let (p, q) = (z - m[(0, 0)], z - m[(1, 1)]);
        (q * self.b[0] + self.b[1] * m[(0, 1)]) / (p * q - m[(0, 1)] * m[(1, 0)])
    }
}

/// What the loop is made of.
#[derive(Clone)]
struct Setup {
    mass: Mass,
    /// Share of the induced motion that is cancelled.
    cancelled: f64,
    /// Rows of delay on F_s.
    delay: usize,
    lambda: f64,
    seconds: f64,
    dither: Vec<f64>,
    /// Encoder step, m.
    step: f64,
    /// Noise of the encoder, m, rms.
    noise: f64,
    seed: u64,
    /// What the hand adds to x_m, m.
    hand: Option<Vec<f64>>,
    /// Rows before which the wall is not there.
    wall_from: usize,
    /// Coulomb friction, N.
    friction: f64,
    /// Gains after half of the record.
    second_lambda: Option<f64>,
}

fn setup() -> Setup {
    Setup {
        mass: Mass::new(0.03, 4.0, 4000.0),
        cancelled: 0.0,
        delay: 3,
        lambda: 0.1,
        seconds: 10.0,
        dither: multisine("peak=0.3,from=1,to=300,period=1"),
        step: 2e-6,
        noise: 0.0,
        seed: 1,
        hand: None,
        wall_from: 0,
        friction: 0.0,
        second_lambda: None,
    }
}

fn multisine(keys: &str) -> Vec<f64> {
    format!("multisine:{keys}").parse::<Excitation>().unwrap().samples(1.0 / PERIOD).unwrap()
}

fn random(rms: f64, rows: usize, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // Smoothed over 4 rows: power up to 300 Hz or so.
    let mut state = [0.0; 2];
    (0..rows)
        .map(|_| {
            let white: f64 = StandardNormal.sample(&mut rng);
            state[0] += 0.5 * (white - state[0]);
            state[1] += 0.5 * (state[0] - state[1]);
            rms * 2.3 * state[1]
        })
        .collect()
}

impl Setup {
    /// `L` per unit of lambda.
    fn exact(&self, hz: f64) -> Complex<f64> {
        let delay = Complex::from_polar(1.0, -TAU * hz * PERIOD * self.delay as f64);
        -self.mass.response(hz) * (1.0 - self.cancelled) * WALL * delay
    }

    /// (critical lambda, Hz) by bisection on the phase of the exact loop.
    fn edge(&self) -> (f64, f64) {
        if self.cancelled > 1.0 {
            return (1.0 / self.exact(1e-6).re, 0.0);
        }
        let (mut low, mut high) = (20.0, 150.0);
        assert!(self.exact(low).im > 0.0 || self.exact(low).re < 0.0);
        while high - low > 1e-9 {
            let middle = 0.5 * (low + high);
            // The phase falls from -pi (at DC) to -2 pi.
            if self.exact(middle).im > 0.0 { low = middle } else { high = middle }
        }
        (1.0 / self.exact(low).re, low)
    }

    fn record(&self) -> Session {
        let n = (self.seconds / PERIOD).round() as usize;
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let (mut plant, mut model) = (Vector2::<f64>::zeros(), Vector2::<f64>::zeros());
        let mut axis = AxisSignals { name: "x".into(), resolution: self.step, clamped: vec![false; n], ..AxisSignals::default() };
        let (mut lambda, mut dither, mut induced) = (vec![self.lambda; n], Vec::new(), Vec::new());
        for row in 0..n {
            if let Some(second) = self.second_lambda.filter(|_| row >= n / 2) {
                lambda[row] = second;
            }
            let noise: f64 = StandardNormal.sample(&mut rng);
            let hand = self.hand.as_ref().map_or(0.0, |h| h[row]);
            let moved = plant[0] + hand + self.noise * noise;
            let x = if self.step > 0.0 { (moved / self.step).round() * self.step } else { moved };
            // Pressed 2 mm into the wall.
            let estimate = self.cancelled * model[0];
            let command = x - estimate + 0.002;
            let contact = if row >= self.wall_from { -WALL * command } else { 0.0 };
            let d = if self.dither.is_empty() { 0.0 } else { self.dither[row % self.dither.len()] };
            let felt = row.checked_sub(self.delay).map_or(0.0, |past| if self.delay == 0 { contact } else { axis.contact[past] });
            let force = lambda[row] * felt + d;
            axis.master.push(x);
            axis.command.push(command);
            axis.contact.push(contact);
            axis.force.push(force);
            dither.push(d);
            induced.push(estimate);
            let rubbed = force - self.friction * (plant[1] / 2e-3_f64).tanh();
            plant = self.mass.a * plant + self.mass.b * rubbed;
            model = self.mass.a * model + self.mass.b * force;
        }
        axis.dither = (!self.dither.is_empty()).then_some(dither);
        axis.induced = (self.cancelled != 0.0).then_some(induced);
        axis.intent = self.hand.clone();
        Session {
            name: "test".into(),
            period_s: PERIOD,
            axes: vec![axis],
            mu: vec![1.0; n],
            lambda,
            notes: Vec::new(),
            sensors: Vec::new(),
            cut_short: None,
            parts: Vec::new(),
            elsewhere: None,
            bridged_s: crate::unjudged::BRIDGED_S,
        }
    }

    fn answer(&self) -> Frequency {
        analyse(&self.record(), &Options::default()).unwrap()
    }
}

/// Errors of the stability limit and how often its interval holds the truth, over seeds.
fn coverage(setups: impl Iterator<Item = Setup>) -> (f64, f64, f64) {
    let (mut worst, mut inside, mut count, mut squares, mut widths) = (0.0_f64, 0.0, 0.0, 0.0, Vec::new());
    for s in setups {
        let (truth, _) = s.edge();
        let found = s.answer().edge;
        let (gain, (low, high)) = (found.gain.unwrap(), found.ci95.unwrap());
        worst = worst.max((gain / truth - 1.0).abs());
        squares += (gain / truth - 1.0).powi(2);
        inside += f64::from(u8::from(low <= truth && high.is_none_or(|h| truth <= h)));
        widths.push(0.5 * (high.unwrap_or(f64::INFINITY) - low) / gain);
        count += 1.0;
    }
    widths.sort_by(f64::total_cmp);
    println!("rms error {:.3} %", 100.0 * (squares / count).sqrt());
    (worst, inside / count, widths[widths.len() / 2])
}

#[test]
fn the_edge_of_a_second_order_loop_is_found() {
    let mut s = setup();
    let (truth, hz) = s.edge();
    s.lambda = 0.4 * truth;
    let found = s.answer();
    assert!(found.cannot_tell.is_none(), "{:?}", found.cannot_tell);
    let edge = found.edge;
    assert!((edge.gain.unwrap() / truth - 1.0).abs() < 0.01, "{edge:?} {truth} {hz}");
    assert!((edge.frequency_hz.unwrap() / hz - 1.0).abs() < 0.01, "{edge:?} {hz}");
    assert_eq!(found.levels[0].averaging.window, Window::Periods);
    let delay = found.delays.force.unwrap();
    assert!((delay.delay_s / PERIOD - 3.0).abs() < 1e-3 && (delay.gain - 1.0).abs() < 1e-3, "{delay:?}");
    let motion = found.delays.motion.unwrap();
    assert!(motion.delay_s.abs() < 1e-6 && (motion.gain - 1.0).abs() < 1e-6, "{motion:?}");
    assert_eq!(found.at(0.9 * truth).verdict, Verdict::Stable);
    assert_eq!(found.at(1.1 * truth).verdict, Verdict::Unstable);
    let close = found.at(edge.gain.unwrap());
    assert!(close.verdict == Verdict::CannotTell && close.reason.contains("too close"), "{close:?}");
    let margins = found.at(0.5 * truth).margins.unwrap();
    assert!((margins.gain_db.unwrap() - 6.02).abs() < 0.1, "{margins:?}");
    // Each factor against the exact one.
    let level = &found.levels[0];
    for (i, hz) in level.hz.iter().enumerate().filter(|(_, f)| **f > 3.0 && **f < 100.0) {
        let exact = s.mass.response(*hz);
        let [re, im] = level.axes[0].g_f.value[i];
        assert!((Complex::new(re, im) - exact).norm() < 0.03 * exact.norm() + 3.0 * level.axes[0].g_f.sigma[i], "{hz}");
        assert!((level.axes[0].h_se.value[i][0] + WALL).abs() < 1e-6 * WALL, "{hz}");
    }
}

/// Recordings over which a coverage is counted.
fn drawn() -> u64 {
    if std::env::var("BACKDRIVE_LONG").as_deref() == Ok("1") { 40 } else { 14 }
}

#[test]
fn intervals_hold_the_truth_with_a_periodic_dither() {
    let base = setup();
    let truth = base.edge().0;
    let setups = (0..drawn()).map(|seed| Setup { seed, noise: 3e-6, lambda: 0.4 * truth, seconds: 6.0, ..base.clone() });
    let (worst, inside, width) = coverage(setups);
    println!("periodic: worst error {:.2} %, coverage {:.0} %, half-width {:.2} %", worst * 100.0, inside * 100.0, width * 100.0);
    assert!(worst < 0.02, "{worst}");
    assert!(inside >= 0.85, "{inside}");
    assert!(width < 0.02, "{width}");
}

#[test]
fn intervals_hold_the_truth_with_a_random_dither() {
    let base = setup();
    let truth = base.edge().0;
    let setups = (0..drawn()).map(|seed| Setup {
        seed,
        noise: 5e-6,
        lambda: 0.4 * truth,
        seconds: 12.0,
        dither: random(0.15, 24_000, 100 + seed),
        ..base.clone()
    });
    let (worst, inside, width) = coverage(setups);
    println!("random: worst error {:.2} %, coverage {:.0} %, half-width {:.2} %", worst * 100.0, inside * 100.0, width * 100.0);
    assert!(worst < 0.02, "{worst}");
    assert!(inside >= 0.85, "{inside}");
    assert!(width < 0.02, "{width}");
}

#[test]
fn the_laws_of_cancelling_hold() {
    let none = setup();
    let bare = none.edge().0;
    for eps in [1.0 / 3.0, 0.1] {
        // Recorded at one gain, whatever is cancelled; the stability limit is 1/eps away.
        let s = Setup { cancelled: 1.0 - eps, lambda: 0.4 * bare, ..none.clone() };
        let edge = s.answer().edge;
        assert!((edge.gain.unwrap() * eps / bare - 1.0).abs() < 0.02, "{eps}: {edge:?} {bare}");
    }
    let over = Setup { cancelled: 1.3, lambda: 0.4 * bare, seconds: 20.0, ..none.clone() };
    let (truth, edge) = (over.edge().0, over.answer().edge);
    assert_eq!(edge.frequency_hz, Some(0.0), "{edge:?}");
    assert!((edge.gain.unwrap() / truth - 1.0).abs() < 0.04, "{edge:?} {truth}");
    let (low, high) = edge.ci95.unwrap();
    assert!(low <= truth && truth <= high.unwrap(), "{edge:?} {truth}");
    let exact = Setup { cancelled: 1.0, lambda: 0.4 * bare, ..none };
    let found = exact.answer();
    assert_eq!(found.edge.gain, None, "{:?}", found.edge);
    assert!(found.edge.at_least.unwrap() > 10.0 * bare, "{:?}", found.edge);
    assert_eq!(found.at(3.0 * bare).verdict, Verdict::Stable);
    assert_eq!(found.at(1e5).verdict, Verdict::CannotTell);
}

#[test]
fn two_gains_in_one_file_are_compared_and_combined() {
    let base = setup();
    let truth = base.edge().0;
    let s = Setup { lambda: 0.3 * truth, second_lambda: Some(0.5 * truth), seconds: 16.0, ..base };
    let found = s.answer();
    assert_eq!(found.gains.len(), 2);
    for gain in &found.gains {
        assert!((gain.edge.gain.unwrap() / truth - 1.0).abs() < 0.02, "{gain:?}");
    }
    assert!(!found.gains_disagree);
    assert!((found.edge.gain.unwrap() / truth - 1.0).abs() < 0.01, "{:?}", found.edge);
}

#[test]
fn dropouts_clamps_and_gains_that_nobody_recorded_are_lived_with() {
    let base = setup();
    let truth = base.edge().0;
    let mut session = Setup { lambda: 0.4 * truth, seconds: 20.0, ..base }.record();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for _ in 0..40 {
        let row = rng.random_range(0..session.len());
        session.axes[0].master[row] = f64::NAN;
    }
    let n = session.len();
    session.axes[0].force[n / 2..n / 2 + 50].fill(f64::NAN);
    session.axes[0].clamped[n / 4] = true;
    session.mu.fill(f64::NAN);
    session.lambda.fill(f64::NAN);
    let found = analyse(&session, &Options::default()).unwrap();
    assert_eq!((found.rows.missing, found.rows.clamped), (50, 1));
    assert!(found.rows.bridged >= 38 && !found.relative, "{:?} {:?}", found.rows, found.notes);
    assert!((found.edge.gain.unwrap() / truth - 1.0).abs() < 0.02, "{:?} {truth}", found.edge);
    // Without a row of contact, and cut to nothing.
    session.axes[0].contact.fill(0.0);
    let none = analyse(&session, &Options::default()).unwrap();
    assert_eq!(none.at(0.1).verdict, Verdict::CannotTell);
    session.axes[0].force.clear();
    assert!(matches!(analyse(&session, &Options::default()), Err(FrequencyError::Shape(_))));
}

#[test]
fn amplitudes_are_told_apart_and_friction_is_flagged() {
    let base = Setup { dither: multisine("peak=3,from=1,to=300,period=1,periods=5,levels=0.03/0.2/1"), seconds: 30.0, ..setup() };
    let truth = base.edge().0;
    let linear = Setup { lambda: 0.4 * truth, step: 0.0, ..base.clone() }.answer();
    assert_eq!(linear.levels.len(), 3, "{:?}", linear.levels.iter().map(|l| l.amplitude_rms).collect::<Vec<_>>());
    assert!(!linear.amplitude_dependent);
    for level in &linear.levels {
        assert!((level.edge.gain.unwrap() / truth - 1.0).abs() < 0.02, "{:?}", level.edge);
    }
    let rough = Setup { lambda: 0.4 * truth, step: 0.0, friction: 0.2, ..base }.answer();
    let edges: Vec<_> = rough.levels.iter().map(|l| l.edge).collect();
    assert!(rough.amplitude_dependent, "{edges:?}");
    // Friction takes the less from the loop the more it moves.
    assert!(edges.windows(2).all(|w| w[0].gain.unwrap_or(f64::INFINITY) > w[1].gain.unwrap_or(f64::INFINITY)), "{edges:?}");
    let (low, high) = rough.edge.ci95.unwrap();
    assert!(low < edges[2].gain.unwrap() && high.is_none_or(|h| h > edges[0].gain.unwrap()), "{:?}", rough.edge);
}

/// Smooth motion of a hand, or one that shakes up to 150 Hz.
fn hand(rows: usize, broad: bool) -> Vec<f64> {
    let noise = random(3e-5, rows, 77);
    let slow = |row: usize| {
        let t = row as f64 * PERIOD;
        1e-3 * ((TAU * 0.3 * t).sin() + 0.5 * (TAU * 0.71 * t).cos())
    };
    (0..rows).map(|row| slow(row) + if broad { noise[row] } else { 0.0 }).collect()
}

#[test]
fn operator_motion_alone_cannot_tell() {
    let base = setup();
    let truth = base.edge().0;
    let rows = 40_000;
    let mut s = Setup { lambda: 0.4 * truth, seconds: 20.0, dither: Vec::new(), hand: Some(hand(rows, true)), ..base };
    let contact_only = s.answer();
    let answer = contact_only.at(0.5 * truth);
    assert_eq!(answer.verdict, Verdict::CannotTell, "{answer:?}");
    assert!(answer.advice.unwrap().contains("--dither multisine:peak="), "{:?}", answer.reason);
    // Free motion, but nothing broad-band: it still cannot.
    s.wall_from = rows / 2;
    let smooth = Setup { hand: Some(hand(rows, false)), ..s.clone() };
    assert_eq!(smooth.answer().at(0.5 * truth).verdict, Verdict::CannotTell);
    // The intent was not recorded.
    let mut session = s.record();
    session.axes[0].intent = None;
    let unknown = analyse(&session, &Options::default()).unwrap().at(0.5 * truth);
    assert!(unknown.verdict == Verdict::CannotTell && unknown.reason.contains("1/(lambda H_se)"), "{unknown:?}");
}

#[test]
fn a_broad_band_operator_in_free_motion_and_contact_tells() {
    let base = setup();
    let truth = base.edge().0;
    let s = Setup {
        lambda: 0.4 * truth,
        seconds: 40.0,
        dither: Vec::new(),
        hand: Some(hand(80_000, true)),
        wall_from: 40_000,
        step: 1e-7,
        ..base
    };
    let found = s.answer();
    assert!(found.cannot_tell.is_none(), "{:?}", found.cannot_tell);
    let edge = found.edge;
    assert!((edge.gain.unwrap() / truth - 1.0).abs() < 0.03, "{edge:?} {truth}");
    let (low, high) = edge.ci95.unwrap();
    assert!(low <= truth && truth <= high.unwrap(), "{edge:?} {truth}");
}

/// Two held masses that a spring couples, each against its wall: the exact closed loop by the eigenvalues of its matrix.
#[test]
fn coupled_axes_have_the_edge_of_their_closed_loop() {
    let (masses, dampings, springs, coupling) = ([0.03, 0.05], [4.0, 5.0], [4000.0, 3000.0], 1500.0);
    let delay = 3;
    let a = DMatrix::from_row_slice(
        4,
        4,
        &[
            0.0,
            1.0,
            0.0,
            0.0, //
            -(springs[0] + coupling) / masses[0],
            -dampings[0] / masses[0],
            coupling / masses[0],
            0.0, //
            0.0,
            0.0,
            0.0,
            1.0, //
            coupling / masses[1],
            0.0,
            -(springs[1] + coupling) / masses[1],
            -dampings[1] / masses[1],
        ],
    );
    let b = DMatrix::from_row_slice(4, 2, &[0.0, 0.0, 1.0 / masses[0], 0.0, 0.0, 0.0, 0.0, 1.0 / masses[1]]);
    let mut both = DMatrix::zeros(6, 6);
    both.view_mut((0, 0), (4, 4)).copy_from(&(a * PERIOD));
    both.view_mut((0, 4), (4, 2)).copy_from(&(b * PERIOD));
    let stepped = both.exp();
    let (ad, bd) = (stepped.view((0, 0), (4, 4)).into_owned(), stepped.view((0, 4), (4, 2)).into_owned());
    // States: the plant, then the positions of the last rows.
    let closed = |lambda: f64| {
        let size = 4 + 2 * delay;
        let mut m = DMatrix::zeros(size, size);
        m.view_mut((0, 0), (4, 4)).copy_from(&ad);
        let oldest = size - 2;
        for axis in 0..2 {
            let column = bd.column(axis) * (-lambda * WALL);
            m.view_mut((0, oldest + axis), (4, 1)).copy_from(&column);
            m[(4 + axis, 2 * axis)] = 1.0;
        }
        for i in 6..size {
            m[(i, i - 2)] = 1.0;
        }
        m.complex_eigenvalues().iter().map(|z| z.norm()).fold(0.0, f64::max)
    };
    let (mut low, mut high) = (0.001, 10.0);
    while high / low > 1.0 + 1e-6 {
        let middle = f64::sqrt(low * high);
        if closed(middle) < 1.0 { low = middle } else { high = middle }
    }
    let (truth, lambda) = (low, 0.4 * low);
    let n = 40_000;
    let dithers = [multisine("peak=0.4,from=1,to=300,period=1,seed=3"), multisine("peak=0.4,from=1,to=300,period=1,seed=4")];
    let mut axes = vec![AxisSignals { clamped: vec![false; n], ..AxisSignals::default() }; 2];
    let mut x = DVector::<f64>::zeros(4);
    for row in 0..n {
        let mut force = DVector::zeros(2);
        for (i, axis) in axes.iter_mut().enumerate() {
            let position = (x[2 * i] / 1e-6).round() * 1e-6;
            let d = dithers[i][row % dithers[i].len()];
            axis.master.push(position);
            axis.command.push(position + 0.002);
            axis.contact.push(-WALL * (position + 0.002));
            force[i] = d + row.checked_sub(delay).map_or(0.0, |past| lambda * axis.contact[past]);
            axis.force.push(force[i]);
            axis.dither.get_or_insert_default().push(d);
        }
        x = &ad * &x + &bd * force;
    }
    let session = Session {
        name: "two".into(),
        period_s: PERIOD,
        axes,
        mu: vec![1.0; n],
        lambda: vec![lambda; n],
        notes: Vec::new(),
        sensors: Vec::new(),
        cut_short: None,
        parts: Vec::new(),
        elsewhere: None,
        bridged_s: crate::unjudged::BRIDGED_S,
    };
    let found = analyse(&session, &Options { draws: 100, ..Options::default() }).unwrap();
    let edge = found.edge;
    assert!((edge.gain.unwrap() / truth - 1.0).abs() < 0.02, "{edge:?} {truth}");
    assert_eq!((found.at(0.9 * truth).verdict, found.at(1.1 * truth).verdict), (Verdict::Stable, Verdict::Unstable));
    // One loop alone, the other's force open: another critical gain, that of the diagonal of the matrix.
    let alone: Vec<f64> = found.levels[0].axes.iter().map(|a| a.edge.gain.unwrap()).collect();
    assert!(alone.iter().any(|k| (k / truth - 1.0).abs() > 0.02), "coupling does nothing: {alone:?} {truth}");
}

#[test]
fn results_are_data() {
    let s = Setup { seconds: 4.0, ..setup() };
    let json = serde_json::to_value(s.answer()).unwrap();
    assert!(json["levels"][0]["axes"][0]["l"].as_array().unwrap().len() > 100);
    assert!(json["method"].as_str().unwrap().contains("whole periods"));
}
