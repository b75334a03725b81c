//! Changes to a graph, which several verbs take.

use super::values::{choices, law, not_negative, positive, rate};
use backdrive_control::coupling::LawKind;
use backdrive_nodes::graph::{Hand, Limits, Overrides, Sensors};
use backdrive_nodes::stage::Clock;
use clap::Args;
use std::path::PathBuf;

/// SwappedParts of a graph that are swapped.
#[derive(Debug, Args)]
#[command(next_help_heading = "Swapped parts")]
pub struct SwappedParts {
    /// Model of the master.
    #[arg(long, value_name = "FILE")]
    pub master: Option<PathBuf>,
    /// Grip that holds the master; `none` for no hand.
    #[arg(long, value_name = "FILE|none")]
    pub grip: Option<PathBuf>,
    /// Model of the slave.
    #[arg(long, value_name = "FILE")]
    pub slave: Option<PathBuf>,
    /// The slave's environment; `none` for no contact.
    #[arg(long, value_name = "FILE|none")]
    pub environment: Option<PathBuf>,
    /// Model that predicts the induced motion; `none` to cancel nothing, `master` for the model and the grip of the graph's master (a file of
    /// that name: `./master`). Without this the graph's model is used, independent of the master.
    #[arg(long, value_name = "FILE|none|master")]
    pub canceller: Option<PathBuf>,
    /// Grip that the canceller assumes; `none` for no hand, `master` for the grip of the graph's master. Without this the graph's grip is used,
    /// independent of the real grip.
    #[arg(long, value_name = "FILE|none|master")]
    pub canceller_grip: Option<PathBuf>,
    /// Corner frequency of a high-pass on the canceller's estimate; 0 for none.
    #[arg(long, value_name = "HZ", value_parser = not_negative, allow_negative_numbers = true)]
    pub high_pass: Option<f64>,
    /// Whether the canceller uses a fixed grip model, or estimates the grip stiffness during the run (docs/canceller.md). For several
    /// axes the estimate needs --edge-without.
    #[arg(long, value_parser = choices([("as-modelled", "As its grip file states", Hand::AsModelled), ("estimated", "Estimated", Hand::Estimated)]))]
    pub hand: Option<Hand>,
    /// Stability limit mu*lambda without a canceller, for all grips (`backdrive stability` computes it). A canceller that estimates the hand
    /// then cancels only as much as the gain requires.
    #[arg(long, value_name = "MU_LAMBDA", value_parser = positive, allow_negative_numbers = true)]
    pub edge_without: Option<f64>,
    /// Whether sensors have the quantisation and noise of the model files.
    #[arg(long, value_parser = choices([("as-modelled", "As the model files state", Sensors::AsModelled), ("ideal", "Exact", Sensors::Ideal)]))]
    pub sensors: Option<Sensors>,
    /// Whether the device's limits of force, rate and speed act; `ignored` simulates stronger motors.
    #[arg(long, value_parser = choices([("enforced", "As the model files state", Limits::Enforced), ("ignored", "None act", Limits::Ignored)]))]
    pub limits: Option<Limits>,
}

impl SwappedParts {
    /// As the graph's reader takes them.
    pub fn overrides(&self) -> Overrides {
        Overrides {
            master: self.master.clone(),
            grip: self.grip.clone(),
            slave: self.slave.clone(),
            environment: self.environment.clone(),
            canceller: self.canceller.clone(),
            canceller_grip: self.canceller_grip.clone(),
            high_pass_hz: self.high_pass,
            hand: self.hand,
            edge_without: self.edge_without,
            sensors: self.sensors,
            limits: self.limits,
            ..Overrides::default()
        }
    }
}

/// Swapped parts as words of a command line.
pub fn words_of(parts: &Overrides) -> Vec<String> {
    let mut words = Words::default();
    words.file("--master", parts.master.as_ref());
    words.file("--grip", parts.grip.as_ref());
    words.file("--slave", parts.slave.as_ref());
    words.file("--environment", parts.environment.as_ref());
    words.file("--canceller", parts.canceller.as_ref());
    words.file("--canceller-grip", parts.canceller_grip.as_ref());
    words.value("--high-pass", parts.high_pass_hz);
    words.value("--hand", parts.hand.map(|choice| choice.word().replace('_', "-")));
    words.value("--edge-without", parts.edge_without);
    words.value("--sensors", parts.sensors.map(|choice| choice.word().replace('_', "-")));
    words.value("--limits", parts.limits.map(|choice| choice.word().replace('_', "-")));
    words.0
}

/// Options with their values, as words of a command line.
#[derive(Debug, Default)]
pub struct Words(pub Vec<String>);

impl Words {
    /// An option with a value, where it has one.
    pub fn value(&mut self, name: &str, value: Option<impl ToString>) {
        if let Some(value) = value {
            self.0.extend([name.to_string(), value.to_string()]);
        }
    }

    /// The same of a file.
    fn file(&mut self, name: &str, path: Option<&PathBuf>) {
        self.value(name, path.map(|path| path.display()));
    }
}

/// Changes to a graph file.
#[derive(Debug, Args)]
#[command(next_help_heading = "Changes to the graph")]
pub struct Changes {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub parts: SwappedParts,
    /// Coupling law between master and slave. It replaces the law of the graph's coupling, or its scaling; see
    /// docs/couplings.md.
    #[arg(long, value_name = "LAW", value_parser = law())]
    pub coupling: Option<LawKind>,
    /// Position scale from master to slave.
    #[arg(long, value_parser = not_negative, allow_negative_numbers = true)]
    pub mu: Option<f64>,
    /// Force scale from slave to master.
    #[arg(long, value_parser = not_negative, allow_negative_numbers = true)]
    pub lambda: Option<f64>,
    /// Add a small recorded multisine to the force channel, such as `multisine:peak=0.1,from=1,to=500,period=2`. From it the
    /// running loop estimates its margin in contact, shown on the status line (`margin 2.4x at 71 Hz`) and on /scaling/margin.
    #[arg(long, value_name = "EXCITATION", num_args = 0..=1, default_missing_value = DEFAULT_DITHER)]
    pub dither: Option<String>,
    /// Supervise the loop: reduce the force gain when an oscillation grows or persists, when force and master diverge together,
    /// or, with a dither, when the margin is below 1.25x. The gain stays reduced until new gains are set.
    #[arg(long)]
    pub guard: bool,
    /// Length of the run.
    #[arg(long, value_name = "S", value_parser = positive, allow_negative_numbers = true)]
    pub duration: Option<f64>,
    /// Steps per second, up to 10000.
    #[arg(long, value_name = "HZ", value_parser = rate, allow_negative_numbers = true)]
    pub rate: Option<f64>,
    /// Seed of all random numbers.
    #[arg(long)]
    pub seed: Option<u64>,
    /// The bag to record.
    #[arg(long, value_name = "FILE")]
    pub bag: Option<PathBuf>,
    /// Replace a bag that exists, whether --bag, --out or the graph file names it. Without this a bag that --bag or --out names must not exist, and
    /// one that the graph file names gets a number: NAME-2.mcap. A bag that another run is writing is never replaced.
    #[arg(long)]
    pub overwrite: bool,
    /// Store the machine name and the folders of the run in the bag. Without this it contains neither. In a graph file:
    /// record_origin = true.
    #[arg(long)]
    pub record_origin: bool,
    /// Let nodes poll for their inputs instead of sleeping: lower latency, for machines with a free processor
    /// for each process. In a graph file: wait = "poll".
    #[arg(long)]
    pub poll: bool,
}

impl Changes {
    /// As the graph's reader takes them.
    pub fn overrides(&self, clock: Option<Clock>) -> Overrides {
        Overrides {
            mu: self.mu,
            lambda: self.lambda,
            coupling: self.coupling,
            dither: self.dither.clone(),
            guard: self.guard.then_some(true),
            bag: self.bag.clone(),
            overwrite: self.overwrite,
            record_origin: self.record_origin,
            poll: self.poll,
            clock,
            rate_hz: self.rate,
            duration_s: self.duration,
            seed: self.seed,
            ..self.parts.overrides()
        }
    }
}

/// A dither that is small beside a finger's force, and broad enough for a frequency response.
const DEFAULT_DITHER: &str = "multisine:peak=0.05,from=1,to=500,period=2";

#[cfg(test)]
mod tests {
    use crate::cli::{Cli, Command};
    use clap::Parser;

    #[test]
    fn the_words_of_swapped_parts_are_read_as_the_same_parts() {
        let given = [
            "--master m.toml --grip none --slave s.toml --environment none --canceller master --canceller-grip g.toml --high-pass 1.5",
            "--hand estimated --edge-without 2.06 --sensors ideal --limits ignored",
        ];
        let words: Vec<&str> = given.iter().flat_map(|line| line.split_whitespace()).collect();
        let parsed = |words: &[&str]| match Cli::try_parse_from([&["backdrive", "stability", "x.mcap"], words].concat()).unwrap().command {
            Command::Stability(options) => options.parts,
            _ => unreachable!(),
        };
        let parts = parsed(&words);
        // Every option of the parts stands above.
        let own = super::words_of(&parts.overrides());
        assert_eq!(own, words);
        let again = parsed(&own.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(again.overrides(), parts.overrides());
        let help = <Cli as clap::CommandFactory>::command();
        let stability = help.find_subcommand("stability").unwrap();
        let swapped = stability.get_arguments().filter(|a| a.get_help_heading() == Some("Swapped parts"));
        for option in swapped {
            assert!(own.contains(&format!("--{}", option.get_long().unwrap())), "{option:?}");
        }
    }
}
