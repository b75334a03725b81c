//! A test rig: a ram that a PID controller moves along a demanded displacement, a specimen on it, and what its sensors say.

use crate::core::{Core, Events, Port, Tick};
use crate::device::Device;
use backdrive_msgs::{MAX_AXES, Sample, flag};
use backdrive_signal::butterworth::Butterworth;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// The displacement controller, and the filters of the sensors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigSettings {
    /// Share of the full speed per m (or rad) of error.
    pub proportional: f64,
    /// Share of the full speed per m s (rad s) of the error's integral.
    pub integral: f64,
    /// Share of the full speed per m/s (rad/s) of the error's slope.
    pub derivative: f64,
    /// Corner of the analogue filters behind displacement and force, Hz; infinite when there are none.
    pub filter_hz: f64,
    /// Standard deviation of the load cell's noise before its filter, N or N m.
    pub force_noise: f64,
}

/// Plays a demanded displacement on a ram with a specimen. It has no inputs.
///
/// Output `demand`: position. Output `measured`: position and velocity of the ram, effort = force of the ram on the specimen, positive along +x.
///
/// The ram is a device whose command is the integral of the flow: its axis' `speed` is the speed with the valve fully open, its `travel` ends the
/// flow. The controller sees the filtered displacement of the step before and asks for a share of the full speed in -1..1; its integral stands
/// still while the valve is at its end.
pub struct Rig {
    device: Device,
    settings: RigSettings,
    demand: Vec<Vec<f64>>,
    axes: Vec<Loop>,
    flow: [f64; MAX_AXES],
    noise: Option<ChaCha8Rng>,
    started: bool,
    was_finite: bool,
    was_saturated: bool,
}

/// What one axis remembers.
#[derive(Debug, Clone)]
struct Loop {
    integral: f64,
    error: f64,
    measured: f64,
    position: Butterworth,
    velocity: Butterworth,
    force: Butterworth,
}

impl Rig {
    /// A ram with its specimen attached, and the demand per axis (one value per step, m or rad; it stays at its last value). The seed is for the load
    /// cell's noise, without which it has none.
    pub fn new(device: Device, settings: RigSettings, mut demand: Vec<Vec<f64>>, noise_seed: Option<u64>, period_s: f64) -> Rig {
        demand.truncate(MAX_AXES);
        let filter = Butterworth::new(2, settings.filter_hz, period_s);
        let (position, velocity, force) = (filter.clone(), filter.clone(), filter);
        let one = Loop { integral: 0.0, error: 0.0, measured: 0.0, position, velocity, force };
        let axes = vec![one; device.axes()];
        let noise = noise_seed.filter(|_| settings.force_noise > 0.0).map(ChaCha8Rng::seed_from_u64);
        Rig { device, settings, demand, axes, flow: [0.0; MAX_AXES], noise, started: false, was_finite: true, was_saturated: false }
    }

    /// The ram with its specimen.
    pub fn device(&self) -> &Device {
        &self.device
    }

    fn demanded(&self, axis: usize, step: u64) -> f64 {
        let samples = self.demand.get(axis).map_or(&[][..], Vec::as_slice);
        samples.get(step as usize).or(samples.last()).copied().unwrap_or(0.0)
    }

    /// Moves the valve of an axis; whether it is at its end.
    fn control(&mut self, axis: usize, demand: f64, period_s: f64) -> bool {
        let limits = self.device.axis(axis);
        let [low, high] = limits.travel.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let full_speed = limits.speed.unwrap_or(1.0);
        let (of, set) = (&mut self.axes[axis], &self.settings);
        let error = demand - of.measured;
        let slope = (error - of.error) / period_s;
        of.error = error;
        let asked = set.proportional * error + set.integral * (of.integral + error * period_s) + set.derivative * slope;
        let opening = asked.clamp(-1.0, 1.0);
        let saturated = opening != asked;
        if !saturated {
            of.integral += error * period_s;
        }
        self.flow[axis] = (self.flow[axis] + opening * full_speed * period_s).clamp(low, high);
        saturated
    }
}

impl Core for Rig {
    fn step(&mut self, tick: &Tick, _inputs: &[Port], outputs: &mut [Sample], events: &mut Events) {
        let axes = self.device.axes();
        let [demands, measured] = outputs else { return };
        let mut saturated = false;
        if self.started {
            for axis in 0..axes {
                let demand = self.demanded(axis, tick.step);
                saturated |= self.control(axis, demand, tick.period_s);
            }
            self.device.step(&self.flow[..axes], &[]);
        } else {
            // The ram stands where the demand begins.
            for axis in 0..axes {
                self.flow[axis] = self.demanded(axis, tick.step);
            }
            self.device.start(&self.flow[..axes], &[]);
            self.started = true;
            for axis in 0..axes {
                self.axes[axis].measured = self.flow[axis];
            }
        }
        if saturated && !self.was_saturated {
            events.push("valve_fully_open", tick.time_s, 1);
        }
        self.was_saturated = saturated;
        let finite = self.device.is_finite();
        if !finite && self.was_finite {
            events.push("state_not_finite", tick.time_s, 2);
        }
        self.was_finite = finite;
        for axis in 0..axes {
            demands.position[axis] = self.demanded(axis, tick.step);
            let noise: f64 = self.noise.as_mut().map_or(0.0, |random| StandardNormal.sample(random));
            let of = &mut self.axes[axis];
            of.measured = of.position.step(self.device.measured(axis));
            measured.position[axis] = of.measured;
            measured.velocity[axis] = of.velocity.step(self.device.user_velocity(axis));
            measured.effort[axis] = of.force.step(self.settings.force_noise * noise - self.device.port_force(axis));
        }
        measured.flags = if saturated { flag::LIMITED } else { 0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{DeviceOptions, DeviceRole};
    use backdrive_plant::model::{Fragment, Model};
    use std::f64::consts::TAU;

    const PERIOD: f64 = 1.0 / 2000.0;
    const SETTINGS: RigSettings = RigSettings { proportional: 200.0, integral: 500.0, derivative: 0.0, filter_hz: 500.0, force_noise: 0.0 };

    fn ram(specimen: Option<&str>, settings: RigSettings, demand: Vec<f64>) -> Rig {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../plant/");
        let model = Model::load(format!("{folder}models/hydraulic-ram.toml").as_ref()).unwrap();
        let specimen = specimen.map(|name| Fragment::load(format!("{folder}environments/{name}.toml").as_ref()).unwrap());
        let device = Device::new(&model, specimen.as_ref(), DeviceRole::Slave, PERIOD, &DeviceOptions::default()).unwrap();
        Rig::new(device, settings, vec![demand], None, PERIOD)
    }

    /// (demand, position, force) of every step.
    fn run(rig: &mut Rig, steps: u64) -> Vec<[f64; 3]> {
        let mut events = Events::default();
        (0..steps)
            .map(|step| {
                let mut outputs = [Sample::new(1), Sample::new(1)];
                rig.step(&Tick { step, time_s: step as f64 * PERIOD, period_s: PERIOD }, &[], &mut outputs, &mut events);
                [outputs[0].position[0], outputs[1].position[0], outputs[1].effort[0]]
            })
            .collect()
    }

    #[test]
    fn the_ram_goes_where_it_is_asked_and_the_cell_reads_the_spring() {
        // 5 kN/m that pushes and pulls: at rest the controller's integral has taken the error away.
        let mut rig = ram(Some("bilateral-wall"), SETTINGS, vec![2e-3; 4000]);
        // It starts where the demand begins, so the wall is stretched at once.
        let last = *run(&mut rig, 4000).last().unwrap();
        assert!((last[1] - 2e-3).abs() < 1e-8, "{last:?}");
        assert!((last[2] - 10.0).abs() < 1e-3, "{last:?}");
    }

    #[test]
    fn the_closed_loop_has_the_bandwidth_of_its_gain() {
        // Crossover at 200 * 0.5 m/s = 100 rad/s: without valve, filter and oil the closed loop is 1/(1 + j w/100) there.
        let f = 100.0 / TAU;
        let settings = RigSettings { integral: 0.0, ..SETTINGS };
        let demand: Vec<f64> = (0..8000).map(|k| 1e-3 * (TAU * f * PERIOD * f64::from(k)).sin()).collect();
        let found = run(&mut ram(None, settings, demand), 8000);
        let peak = found[4000..].iter().fold(0.0_f64, |p, s| p.max(s[1].abs()));
        // The valve's lag of 80 Hz raises it above 0.707; it must stay below resonance.
        assert!((0.7e-3..1.1e-3).contains(&peak), "{peak}");
    }

    #[test]
    fn the_valve_and_the_travel_limit_the_ram() {
        let found = run(&mut ram(None, SETTINGS, [vec![0.0], vec![0.2; 3000]].concat()), 3000);
        // Over 30 mm the oil's ringing averages out.
        let reaches = |x: f64| found.iter().position(|s| s[1] >= x).unwrap() as f64 * PERIOD;
        let speed = 0.03 / (reaches(0.04) - reaches(0.01));
        assert!((speed / 0.5 - 1.0).abs() < 0.05, "{speed}");
        assert!((found.last().unwrap()[1] - 0.05).abs() < 1e-6);
    }
}
