//! Devices with known hidden effects: simulated with them, located without.

use super::filter::{Data, System};
use super::*;
use crate::hypothesis::Place;
use backdrive_plant::stepper::{Options as StepOptions, simulate};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};

const PERIOD: f64 = 5e-4;

/// A motor, a drum and a handle; `extra` is TOML that is added.
fn master(extra: &str, input: &str) -> Model {
    let text = format!(
        "name = 'master'\n[bodies]\nmotor = 0.02\ndrum = 0.03\nhandle = 0.1\n\
         [[elements]]\nname = 'cable'\nkind = 'spring'\nbetween = ['motor', 'drum']\nstiffness = 8000.0\n\
         [[elements]]\nname = 'cable_damping'\nkind = 'damper'\nbetween = ['motor', 'drum']\ndamping = 3.0\n\
         [[elements]]\nname = 'linkage'\nkind = 'spring'\nbetween = ['drum', 'handle']\nstiffness = 1500.0\n\
         [[elements]]\nname = 'linkage_damping'\nkind = 'damper'\nbetween = ['drum', 'handle']\ndamping = 1.0\n\
         [[elements]]\nname = 'user'\nkind = 'spring'\nbetween = ['handle', 'ground']\nstiffness = 400.0\n\
         [[elements]]\nname = 'user_damping'\nkind = 'damper'\nbetween = ['handle', 'ground']\ndamping = 6.0\n{extra}\n\
         [[inputs]]\nname = 'force'\nkind = 'force'\non = 'motor'\nhold = 'zero'\n{input}\n\
         [[outputs]]\nname = 'motor_position'\nkind = 'position'\nof = 'motor'\n\
         [[outputs]]\nname = 'handle_velocity'\nkind = 'velocity'\nof = 'handle'\n"
    );
    Model::from_toml(&text, "master").expect("a model")
}

/// A sweep and a sum of sines, s seconds each.
fn drives(amplitude: f64, seconds: f64) -> Vec<Vec<f64>> {
    let n = (seconds / PERIOD) as usize;
    let sweep = |k: usize| {
        let t = k as f64 * PERIOD;
        let (from, to) = (0.5_f64, 40.0_f64);
        let phase = std::f64::consts::TAU * from * seconds / (to / from).ln() * ((to / from).powf(t / seconds) - 1.0);
        amplitude * phase.sin()
    };
    let sines = |k: usize| {
        let t = k as f64 * PERIOD * std::f64::consts::TAU;
        0.5 * amplitude * ((0.7 * t).sin() + 0.8 * (1.9 * t).sin() + 0.6 * (4.3 * t).sin() + 0.4 * (11.0 * t).sin())
    };
    vec![(0..n).map(sweep).collect(), (0..n).map(sines).collect()]
}

/// Columns of the inputs and of the outputs of a run.
type Columns = (Vec<Vec<f64>>, Vec<Vec<f64>>);

/// What sensors of these noises see of a device in two runs: inputs and outputs.
fn recorded(truth: &Model, amplitude: f64, seconds: f64, noise: &[f64]) -> Vec<Columns> {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    let one = |drive: Vec<f64>| {
        let mut outputs =
            simulate(truth, std::slice::from_ref(&drive), PERIOD, &StepOptions { substeps: Some(20), ..StepOptions::default() })
                .expect("simulates");
        for (column, noise) in outputs.iter_mut().zip(noise) {
            let normal = Normal::new(0.0, *noise).expect("a noise");
            column.iter_mut().for_each(|y| *y += normal.sample(&mut random));
        }
        (vec![drive], outputs)
    };
    drives(amplitude, seconds).into_iter().map(one).collect()
}

fn located(truth: &Model, nominal: &Model, amplitude: f64, seconds: f64) -> Location {
    let noise = &[2e-6, 2e-4][..nominal.outputs.len()];
    let data = recorded(truth, amplitude, seconds, noise);
    let runs: Vec<Run> = data
        .iter()
        .map(|(inputs, outputs)| Run {
            name: "run",
            period: PERIOD,
            inputs,
            outputs: outputs.iter().map(|o| Some(o.as_slice())).collect(),
            model: None,
        })
        .collect();
    locate(nominal, &runs, noise, &Options::default()).expect("locates")
}

fn between(a: &str, b: &str) -> Place {
    Place::Between(a.to_string(), b.to_string())
}

#[test]
fn dry_friction_is_found_where_it_is() {
    for body in ["motor", "drum", "handle"] {
        let extra = format!("[[elements]]\nname = 'f'\nkind = 'coulomb'\nbetween = ['{body}', 'ground']\nforce = 0.3\n");
        let location = located(&master(&extra, ""), &master("", ""), 2.0, 5.0);
        let best = &location.ranking[0];
        assert_eq!(best.place, between(body, "ground"));
        let law = &best.laws[0];
        assert!(matches!(law.variable, Variable::Direction | Variable::Velocity), "{:?}", law.variable);
        assert!(law.held_out_share > 0.7, "{}", law.held_out_share);
        let character = best.character.expect("it moves");
        assert!(character.odd_share > 0.9 && character.dissipated_per_cycle > 0.0, "{character:?}");
        assert!((character.energy_exponent.expect("amplitudes differ") - 1.0).abs() < 0.35, "{character:?}");
    }
}

#[test]
fn a_stiffening_spring_is_found_in_its_joint() {
    let cubic = "[[elements]]\nname = 'f'\nkind = 'cubic_spring'\nbetween = ['drum', 'handle']\nstiffness = 0.0\ncubic = 3.0e8\n";
    let location = located(&master(cubic, ""), &master("", ""), 2.0, 5.0);
    let best = &location.ranking[0];
    assert_eq!(best.place, between("drum", "handle"));
    assert_eq!(best.laws[0].variable, Variable::Displacement);
}

#[test]
fn cogging_is_found_with_its_period() {
    let cogging =
        "[[elements]]\nname = 'f'\nkind = 'cogging'\nbetween = ['motor', 'ground']\namplitude = 0.15\nperiod = 1.3e-3\nphase = 0.4\n";
    let location = located(&master(cogging, ""), &master("", ""), 2.5, 5.0);
    let best = &location.ranking[0];
    assert_eq!(best.place, between("motor", "ground"));
    assert_eq!(best.laws[0].variable, Variable::Ripple);
    let ripple = best.ripples.first().expect("a ripple");
    assert!((ripple.period - 1.3e-3).abs() < 2e-5, "{ripple:?}");
    assert!((ripple.amplitude - 0.15).abs() < 0.04, "{ripple:?}");
    assert!((ripple.phase - 0.4).abs() < 0.5, "{ripple:?}");
}

#[test]
fn a_delay_shows_at_its_input() {
    let location = located(&master("", "delay = 0.002\n"), &master("", ""), 2.0, 5.0);
    let best = &location.ranking[0];
    assert_eq!(best.place, Place::Signal("force".to_string()));
    assert_eq!(best.laws[0].variable, Variable::SignalRate);
}

#[test]
fn a_sensor_offset_shows_at_its_output() {
    let mut truth = master("", "");
    truth.outputs[0].offset = 1e-4;
    let location = located(&truth, &master("", ""), 2.0, 5.0);
    assert_eq!(location.ranking[0].place, Place::Signal("motor_position".to_string()));
    assert_eq!(location.ranking[0].laws[0].variable, Variable::Constant);
}

#[test]
fn friction_in_the_nominal_model_is_taken_along() {
    let nominal = "[[elements]]\nname = 'n'\nkind = 'coulomb'\nbetween = ['drum', 'ground']\nforce = 0.2\n";
    let both = format!("{nominal}[[elements]]\nname = 'f'\nkind = 'quadratic_drag'\nbetween = ['handle', 'ground']\ncoefficient = 60.0\n");
    let location = located(&master(&both, ""), &master(nominal, ""), 4.0, 5.0);
    let best = &location.ranking[0];
    assert_eq!(best.place, between("handle", "ground"));
    assert_eq!(best.laws[0].variable, Variable::Velocity);
    // Without the friction's part along the true path nothing of the drag could be seen.
    assert!(best.laws[0].held_out_share > 0.95, "{}", best.laws[0].held_out_share);
    let drag: Vec<f64> = best.courses[0].velocity.iter().map(|v| 60.0 * v * v.abs()).collect();
    let error: f64 = drag.iter().zip(&best.courses[0].force).map(|(a, b)| (a - b).powi(2)).sum();
    assert!(error < 0.02 * drag.iter().map(|f| f * f).sum::<f64>(), "the latent force is not the drag");
}

/// The smoother against the posterior of the joint Gaussian of all samples, written out as one dense problem.
#[test]
fn the_smoother_is_the_posterior_mean() {
    let friction = "[[elements]]\nname = 'n'\nkind = 'coulomb'\nbetween = ['handle', 'ground']\nforce = 0.2\n";
    let noise = [2e-6, 2e-4];
    for (model, order) in [(master("", ""), 1), (master("", ""), 2), (master(friction, ""), 1)] {
        let linearisation = Linearisation::of(&model, 1e-3).expect("linear");
        let mut equations = linearisation.equations(Channel::Force([Some(1), None]), order, &[0, 1]);
        if !linearisation.nonlinear.is_empty() {
            equations = linearisation.with_force_errors(&equations, &[0.1], 200.0);
        }
        let system = System::of(&equations, PERIOD, [1e-3, 0.05, 0.3], &noise).expect("finite");
        let len = 25;
        let wave = |k: usize| 3.0 * (0.4 * k as f64).sin() + (k * k % 7) as f64 - 3.0;
        let residual: Vec<Vec<f64>> = noise.iter().map(|n| (0..len).map(|k| n * wave(k)).collect()).collect();
        let data = Data { residual: &residual, forces: &[], known: &[] };
        for (jumps, jump) in [(vec![], 0.0), (vec![10, 11], 0.5)] {
            let smoothed = system.smooth(2.0, data, &jumps, jump).expect("smooths");
            let (mean, deviation, log_likelihood) = system.dense(2.0, &residual, &jumps, jump);
            for k in 0..len {
                assert!((smoothed.value[k] - mean[k]).abs() < 1e-6 * mean.amax(), "{order} {k}: {} {}", smoothed.value[k], mean[k]);
            }
            assert!((smoothed.log_likelihood - log_likelihood).abs() < 1e-6 * log_likelihood.abs());
            if jumps.is_empty() {
                let filtered = system.log_likelihood(2.0, data).expect("finite");
                assert!((filtered - log_likelihood).abs() < 1e-6 * log_likelihood.abs(), "{filtered} {log_likelihood}");
            } else {
                // Without jumps the deviation is that of the middle of a long run.
                (0..len).for_each(|k| assert!((smoothed.deviation[k] / deviation[k] - 1.0).abs() < 1e-5, "{k}"));
            }
        }
    }
}

#[test]
fn a_known_part_and_known_forces_are_taken_off() {
    // A force known beforehand leaves nothing to be found, whether it comes as the unknown's own or as an element's.
    let friction = "[[elements]]\nname = 'n'\nkind = 'coulomb'\nbetween = ['drum', 'ground']\nforce = 0.2\n";
    let model = master(friction, "");
    let linearisation = Linearisation::of(&model, 1e-3).expect("linear");
    let noise = [2e-6, 2e-4];
    let system = System::of(&linearisation.equations(Channel::Force([Some(1), None]), 1, &[0, 1]), PERIOD, [1e-3, 0.05, 0.3], &noise)
        .expect("finite");
    let force: Vec<f64> = (0..2000).map(|k| 0.3 * (0.01 * k as f64).sin()).collect();
    // What the linear part does under that force, by the stepper, which holds the mean of two samples.
    let mut pushed = master("", "");
    pushed.inputs[0].on = 1;
    let held: Vec<f64> = (0..force.len()).map(|k| -0.5 * (force[k] + force[(k + 1).min(force.len() - 1)])).collect();
    let residual = simulate(&pushed, &[held], PERIOD, &StepOptions::default()).expect("simulates");
    for data in [
        Data { residual: &residual, forces: &[], known: &force },
        Data { residual: &residual, forces: std::slice::from_ref(&force), known: &[] },
    ] {
        let found = system.smooth(1.0, data, &[], 0.0).expect("smooths");
        let expected = |k: usize| if data.known.is_empty() { 0.0 } else { force[k] };
        let worst = (0..force.len()).map(|k| (found.value[k] - expected(k)).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-6, "{worst}");
    }
    // And unknown it is found.
    let found = system.smooth(1.0, Data { residual: &residual, forces: &[], known: &[] }, &[], 0.0).expect("smooths");
    let worst = (50..1950).map(|k| (found.value[k] - force[k]).abs()).fold(0.0, f64::max);
    assert!(worst < 0.01, "{worst}");
}

#[test]
fn a_ripple_is_found_among_trends() {
    let x: Vec<f64> = (0..5000).map(|k| 0.02 * (0.003 * k as f64).sin() + 0.01 * (0.00107 * k as f64).cos()).collect();
    let force: Vec<f64> = x.iter().map(|x| 0.3 * (std::f64::consts::TAU * x / 2.5e-3 + 1.1).sin() + 40.0 * x + 1e5 * x.powi(3)).collect();
    let v = vec![0.0; x.len()];
    let ripples = scan(&x, &v, &force);
    let ripple = ripples.first().expect("moves");
    assert!((ripple.period / 2.5e-3 - 1.0).abs() < 2e-3, "{ripple:?}");
    assert!((ripple.amplitude - 0.3).abs() < 0.02 && (ripple.phase - 1.1).abs() < 0.1, "{ripple:?}");
    assert!(ripple.share > 0.9 && ripple.prominence > 100.0, "{ripple:?}");
    assert!(scan(&vec![1.0; 100], &v[..100], &force[..100]).is_empty());
}

#[test]
fn one_sensor_on_the_motor_still_tells_motor_from_drum() {
    for body in ["motor", "drum"] {
        let extra = format!("[[elements]]\nname = 'f'\nkind = 'coulomb'\nbetween = ['{body}', 'ground']\nforce = 0.3\n");
        let mut truth = master(&extra, "");
        let mut nominal = master("", "");
        truth.outputs.truncate(1);
        nominal.outputs.truncate(1);
        let location = located(&truth, &nominal, 2.0, 5.0);
        assert_eq!(location.ranking[0].place, between(body, "ground"));
    }
}

#[test]
fn places_that_no_sensor_tells_apart_are_one_class() {
    // Two stiffly joined bodies, a slow force: the motor and the drum are one.
    let text = "name = 'a'\n[bodies]\na = 0.5\nb = 0.5\n[[elements]]\nname = 'k'\nkind = 'spring'\nbetween = ['a', 'b']\nstiffness = 1e8\n\
        [[elements]]\nname = 'd'\nkind = 'damper'\nbetween = ['a', 'b']\ndamping = 500.0\n\
        [[elements]]\nname = 'g'\nkind = 'spring'\nbetween = ['b', 'ground']\nstiffness = 500.0\n\
        [[elements]]\nname = 'h'\nkind = 'damper'\nbetween = ['b', 'ground']\ndamping = 5.0\nEXTRA\n\
        [[inputs]]\nname = 'u'\nkind = 'force'\non = 'a'\n[[outputs]]\nname = 'y'\nkind = 'position'\nof = 'a'\n\
        [[outputs]]\nname = 'w'\nkind = 'velocity'\nof = 'b'\n";
    let nominal = Model::from_toml(&text.replace("EXTRA", ""), "a").expect("a model");
    let extra = "[[elements]]\nname = 'f'\nkind = 'coulomb'\nbetween = ['b', 'ground']\nforce = 0.3\n";
    let location = located(&Model::from_toml(&text.replace("EXTRA", extra), "a").expect("a model"), &nominal, 2.0, 5.0);
    let index = |place: &Place| location.ranking.iter().position(|c| c.place == *place).expect("ranked");
    let (a, b) = (index(&between("a", "ground")), index(&between("b", "ground")));
    assert!(location.classes.iter().any(|c| c.members.contains(&a) && c.members.contains(&b)), "{:?}", location.classes);
    let all: usize = location.classes.iter().map(|c| c.members.len()).sum();
    assert_eq!(all, location.ranking.len());
    assert!(location.classes.len() > 1, "everything is one class");
}

#[test]
fn wrong_columns_are_refused() {
    let model = master("", "");
    let drive = vec![vec![0.0; 100]];
    let short = vec![vec![0.0; 5]];
    let zeros = vec![0.0; 100];
    let run = |inputs, outputs| Run { name: "r", period: PERIOD, inputs, outputs, model: None };
    let of = |run: Run, noise: &[f64]| locate(&model, &[run], noise, &Options::default());
    assert!(matches!(locate(&model, &[], &[1e-6, 1e-4], &Options::default()), Err(LocateError::NoRuns)));
    assert!(matches!(of(run(&drive, vec![Some(&zeros), None]), &[1e-6]), Err(LocateError::Noise { .. })));
    assert!(matches!(of(run(&drive, vec![Some(&zeros)]), &[1e-6, 1e-4]), Err(LocateError::Columns { .. })));
    assert!(matches!(of(run(&short, vec![Some(&zeros), None]), &[1e-6, 1e-4]), Err(LocateError::TooShort { .. })));
    assert!(matches!(of(run(&drive, vec![None, None]), &[1e-6, 1e-4]), Err(LocateError::NothingMeasured { .. })));
    // Constant signals and no noise at all: nothing is found, nothing breaks.
    assert!(of(run(&drive, vec![Some(&zeros), Some(&zeros)]), &[0.0, 0.0]).is_ok());
}

#[test]
fn friction_beside_the_nominal_friction_is_seen_at_its_place() {
    // The nominal model has the friction, but of too low a level: what is missing sits where an element is already.
    let friction = |force: f64| format!("[[elements]]\nname = 'n'\nkind = 'coulomb'\nbetween = ['drum', 'ground']\nforce = {force}\n");
    let location = located(&master(&friction(0.3), ""), &master(&friction(0.15), ""), 2.5, 5.0);
    let best = &location.ranking[0];
    assert_eq!(best.place, between("drum", "ground"));
    assert!(matches!(best.laws[0].variable, Variable::Direction | Variable::Velocity), "{:?}", best.laws[0].variable);
    let level = rms(&best.courses[0].force);
    assert!((0.08..0.22).contains(&level), "{level}");
}

#[test]
fn a_run_of_another_condition_takes_its_own_model() {
    let nominal = master("", "");
    let mut stiffer = nominal.clone();
    stiffer.set_values_at("elements.user.stiffness", &[900.0]).expect("there");
    let noise = [2e-6, 2e-4];
    let data = recorded(&stiffer, 2.0, 2.0, &noise);
    let of = |model| {
        let (inputs, outputs) = &data[0];
        let run = Run { name: "run", period: PERIOD, inputs, outputs: outputs.iter().map(|o| Some(o.as_slice())).collect(), model };
        locate(&nominal, &[run], &noise, &Options::default()).expect("locates").mismatch
    };
    assert!(of(None) > 10.0 && of(Some(&stiffer)) < 1.1, "{} {}", of(None), of(Some(&stiffer)));
}

impl System {
    /// Posterior mean and standard deviation of the unknown, and log-likelihood, from the covariance of all samples at once.
    pub fn dense(&self, intensity: f64, residual: &[Vec<f64>], jumps: &[usize], jump: f64) -> (DVector<f64>, Vec<f64>, f64) {
        let (n, p, len) = (self.n, self.p, residual[0].len());
        let q = self.process_noise(intensity);
        // Each state is a sum of the initial state and the noises before it.
        let mut state = vec![DMatrix::<f64>::zeros(n, n * len); len];
        let mut prior = DMatrix::<f64>::zeros(n * len, n * len);
        for k in 0..len {
            let mut own = if k == 0 { self.steady(intensity).expect("steady").predicted } else { q.clone() };
            if jumps.contains(&k) {
                own[(self.unknown, self.unknown)] += (jump / self.scale[self.unknown]).powi(2);
            }
            prior.view_mut((k * n, k * n), (n, n)).copy_from(&own);
            if k > 0 {
                state[k] = &self.f * &state[k - 1];
            }
            state[k].view_mut((0, k * n), (n, n)).fill_with_identity();
        }
        let mut reads = DMatrix::<f64>::zeros(p * len, n * len);
        let mut y = DVector::<f64>::zeros(p * len);
        for k in 0..len {
            reads.rows_mut(k * p, p).copy_from(&(&self.h * &state[k]));
            for r in 0..p {
                y[k * p + r] = residual[r][k] / self.noise[r];
            }
        }
        let covariance = &reads * &prior * reads.transpose() + DMatrix::identity(p * len, p * len);
        let factor = covariance.cholesky().expect("positive definite");
        let weights = factor.solve(&y);
        let scale = self.scale[self.unknown];
        let row = |k: usize| state[k].row(self.unknown) * &prior;
        let mean = DVector::from_fn(len, |k, _| (row(k) * reads.transpose() * &weights)[0] * scale);
        let deviation = (0..len).map(|k| {
            let cross = row(k) * reads.transpose();
            let own = (row(k) * state[k].row(self.unknown).transpose())[0];
            (own - (&cross * factor.solve(&cross.transpose()))[0]).max(0.0).sqrt() * scale
        });
        let log_det = 2.0 * factor.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        (mean, deviation.collect(), -0.5 * (y.dot(&weights) + log_det + len as f64 * self.log_likelihood_constant()))
    }
}
