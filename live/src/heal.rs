//! Why a loop shakes, asked of another process of low priority while the loop runs, and what is done about it.

use crate::hub::{Hub, text};
use crate::onset::Onset;
use crate::serve::NICE;
use crate::steer::Steer;
use crate::tap::Running;
use backdrive_msgs::NOT_MEASURED;
use backdrive_why::now::{Found, Seen};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Longest time that a cause is looked for.
const PATIENCE: Duration = Duration::from_secs(30);

/// Time after the ramp of a remedy after which it must have helped.
const HELPS_WITHIN: Duration = Duration::from_millis(600);

/// What of the oscillation may be left when a remedy has helped.
const LEFT: f64 = 0.5;

/// Causes that are shown.
const SHOWN: usize = 3;

/// How a run is watched for shaking.
#[derive(Debug, Clone, PartialEq)]
pub struct WhyOptions {
    /// Program and first arguments that answer `why-now`.
    pub program: Vec<String>,
    /// Whether the remedy is applied without being asked, and the least force scale that it may come to.
    pub heal: Option<f64>,
}

/// What a watch reports.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shakes {
    pub onset: Onset,
    /// Gains in force when it began.
    pub mu: f64,
    pub lambda: f64,
}

/// What the watch sees at the moment: RMS of the force above 8 Hz, N or N m.
pub(crate) type Level = Arc<Mutex<f64>>;

/// Who answers when a loop shakes.
pub(crate) struct Healer {
    pub hub: Arc<Hub<Running>>,
    pub steer: Arc<Steer>,
    pub options: WhyOptions,
    pub bag: Option<PathBuf>,
    /// Unit of a thousandth of the master's positions.
    pub unit: &'static str,
    pub level: Level,
    pub over: Arc<AtomicBool>,
    /// The force scale that is offered.
    pub offer: Arc<Mutex<Option<f64>>>,
    /// For the terminal.
    pub say: Arc<dyn Fn(&str) + Send + Sync>,
}

impl Healer {
    /// Answers until nobody watches any more.
    pub fn run(&self, shakes: &Receiver<Shakes>) {
        while let Ok(found) = shakes.recv() {
            self.answer(&found);
        }
    }

    fn answer(&self, shakes: &Shakes) {
        let Onset { axis, time_s, frequency_hz, amplitude, .. } = shakes.onset;
        let begun = Instant::now();
        let title = format!(
            "shakes at {frequency_hz:.0} Hz, master ±{:.3} {}, found at {time_s:.3} s, mu*lambda = {:.4}",
            1e3 * amplitude,
            self.unit,
            shakes.mu * shakes.lambda
        );
        let title = if axis > 0 { format!("{title}, axis {axis}") } else { title };
        self.tell("live_onset", 1, &title, frequency_hz);
        self.show(&title, &["the cause is looked for in what has been recorded so far".to_string()], None);
        let found = match self.ask(shakes) {
            Ok(found) => found,
            Err(why) => {
                self.tell("live_why", 1, &format!("the cause is not known: {why}"), NOT_MEASURED);
                return self.show(&title, &[format!("The cause is not known: {why}")], None);
            }
        };
        let mut lines: Vec<String> = found
            .causes
            .iter()
            .take(SHOWN)
            .map(|(cause, confidence)| format!("{cause} (confidence {:.0} %)", 100.0 * confidence))
            .collect();
        if lines.is_empty() {
            lines.push("No cause was found: every node does what the graph states, and that loop is calm.".to_string());
        }
        match found.edge {
            Some(edge) => lines.push(format!("The loop as recorded is stable up to mu*lambda = {edge:.3}.")),
            None => lines.push("No stability limit was found within a factor of 20.".to_string()),
        }
        if !found.reproduced {
            lines.push("Its re-simulation does not do what was recorded: take the cause as a hint.".to_string());
        }
        let named = lines.first().cloned().unwrap_or_default();
        let confidence = found.causes.first().map_or(NOT_MEASURED, |c| c.1);
        self.tell("live_why", 1, &format!("cause: {named}"), confidence);
        lines.iter().skip(1).for_each(|line| (self.say)(line));
        lines.push(format!("Named {:.1} s after the onset was found.", begun.elapsed().as_secs_f64()));
        let offered = found.lambda.filter(|lambda| self.now().is_some_and(|now| *lambda < now.1));
        *self.offer.lock().unwrap_or_else(PoisonError::into_inner) = offered;
        match (offered, self.options.heal) {
            (Some(lambda), Some(least)) if lambda >= least => {
                self.show(&title, &lines, None);
                lines.push(self.heal(lambda, found.robust));
                self.show(&title, &lines, None);
            }
            (Some(lambda), heal) => {
                if let Some(least) = heal {
                    lines.push(format!("Not applied: lambda = {lambda:.4} is below the bound of {least:.4}."));
                }
                let sure = if found.robust { "" } else { " (not with every grip and wall)" };
                let offer = format!("Lower λ to {lambda:.4}{sure}");
                (self.say)(&format!("to do    lower lambda to {lambda:.4}{sure}, on the page or with --heal"));
                self.show(&title, &lines, Some(json!({ "text": offer, "do": "heal" })));
            }
            (None, _) => {
                lines.push(match found.lambda {
                    Some(_) => "The gain in force is already below what would be offered.".to_string(),
                    None => "No lower gain that helps was found: stop the run, and ask `backdrive why` of its bag.".to_string(),
                });
                self.show(&title, &lines, None);
            }
        }
    }

    /// Applies what is offered, because somebody asks for it.
    pub fn apply_offer(&self) -> Result<String, String> {
        let offer = self.offer.lock().unwrap_or_else(PoisonError::into_inner).take();
        let lambda = offer.ok_or("nothing is offered now")?;
        Ok(self.heal(lambda, true))
    }

    /// Lowers the force scale by a ramp; raises it again where that does not help. What was done, in a sentence.
    fn heal(&self, lambda: f64, robust: bool) -> String {
        let Some((_, before)) = self.now() else { return "Not applied: the gains in force are not known.".to_string() };
        if lambda >= before {
            return "Not applied: the gain in force is lower already.".to_string();
        }
        let shaking = self.shaking();
        if let Err(why) = self.set(lambda) {
            return format!("Not applied: {why}.");
        }
        let until = Instant::now() + Duration::from_secs_f64(self.steer.bounds.ramp_s) + HELPS_WITHIN;
        while Instant::now() < until && !self.over.load(Ordering::SeqCst) {
            std::thread::sleep(Duration::from_millis(20));
        }
        let left = self.shaking() / shaking.max(f64::MIN_POSITIVE);
        let percent = 100.0 * left;
        let said = if left <= LEFT {
            let sure = if robust { "" } else { "; it does not hold with every grip and wall" };
            format!("lambda lowered from {before:.4} to {lambda:.4}: it helped, {percent:.0} % of the oscillation is left{sure}")
        } else {
            let undone = self.set(before).map_or_else(|why| format!("it could not be undone: {why}"), |()| "undone".to_string());
            format!("lambda lowered from {before:.4} to {lambda:.4}: it did not help ({percent:.0} % is left), {undone}")
        };
        self.tell("live_heal", u32::from(left > LEFT), &said, lambda);
        said
    }

    fn set(&self, lambda: f64) -> Result<(), String> {
        let known = self.hub.past().picture.known();
        self.steer.set(lambda, &known, "heal").map(|_| ())
    }

    fn shaking(&self) -> f64 {
        *self.level.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn now(&self) -> Option<(f64, f64)> {
        self.hub.past().picture.gains
    }

    /// Into the bag, from where it comes to the terminal; straight there where no node can record it.
    fn tell(&self, kind: &str, severity: u32, said: &str, value: f64) {
        if !self.steer.note(kind, severity, said, value) {
            (self.say)(said);
        }
    }

    /// Onto the page.
    fn show(&self, title: &str, lines: &[String], offer: Option<Value>) {
        let finding = json!({ "type": "finding", "title": title, "lines": lines, "offer": offer });
        let mut past = self.hub.past();
        self.hub.send(text(&finding));
        past.findings = vec![finding];
    }

    /// Has another process look for the cause in the bag so far.
    fn ask(&self, shakes: &Shakes) -> Result<Found, String> {
        let bag = self.bag.as_ref().ok_or("the run records no bag")?;
        let (program, first) = self.options.program.split_first().ok_or("there is no program to ask")?;
        let Onset { frequency_hz, amplitude, .. } = shakes.onset;
        let seen =
            serde_json::to_string(&Seen { frequency_hz, amplitude, mu: shakes.mu, lambda: shakes.lambda }).map_err(|e| e.to_string())?;
        let mut command = Command::new(program);
        command.args(first).arg("why-now").arg(bag).args(["--seen", &seen]);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // SAFETY: setpriority is safe between fork and exec; 0 is this process.
        unsafe {
            std::os::unix::process::CommandExt::pre_exec(&mut command, || {
                nix::libc::setpriority(nix::libc::PRIO_PROCESS, 0, NICE);
                Ok(())
            });
        }
        let mut child = command.spawn().map_err(|e| format!("{program} cannot be started: {e}"))?;
        let (until, mut ended) = (Instant::now() + PATIENCE, None);
        while Instant::now() < until && !self.over.load(Ordering::SeqCst) && ended.is_none() {
            std::thread::sleep(Duration::from_millis(10));
            ended = child.try_wait().map_err(|e| e.to_string())?;
        }
        if ended.is_none() {
            let _ = child.kill();
            let _ = child.wait();
            return Err("it was not found in time".to_string());
        }
        let output = child.wait_with_output().map_err(|e| e.to_string())?;
        serde_json::from_slice(&output.stdout).map_err(|_| {
            let said = String::from_utf8_lossy(&output.stderr);
            said.lines().last().unwrap_or("the program that looks for it has failed").trim_start_matches("error: ").to_string()
        })
    }
}
