//! The command line: its doc comments are the help.

mod init;

pub use init::{Answer, Attached, Driven, Init, Motion, Start};

use backdrive_nodes::graph::{MAX_RATE_HZ, Overrides};
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Run force-reflecting telerobots, record them, and ask whether they are stable.
///
/// Results go to standard output, everything else to standard error.
/// What is written is named alike in every verb: --bag a bag, --csv a table, --html a page, --out what else a verb makes (a model, a folder);
/// --json prints the result for programs.
/// Exit codes: 0 fine; 1 the finding is negative (not stable, bags differ); 2 usage; 3 bad input;
/// 4 data was lost; 5 this machine does not let it (shared memory, disk, permission); 6 a node failed;
/// 7 it cannot be told; 130 interrupted.
#[derive(Debug, Parser)]
#[command(name = "backdrive", version, propagate_version = true, arg_required_else_help = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

const STABILITY_HELP: &str = "Examples:
  backdrive run launch/push-and-hold.toml
  backdrive stability push-and-hold.mcap --gain 1
  backdrive stability push-and-hold.mcap --sweep 0.1:50:200 --html out/stability.html
  backdrive stability push-and-hold.mcap --gain 1 --canceller plant/models/impulse-engine.toml --canceller-grip plant/grips/normal.toml
  backdrive stability session/ --roles roles.toml --gain 1

Exit codes: 0 stable, 1 not, 2 usage, 3 the bag or a file is wrong, 5 the report cannot be written, 7 it cannot be told, 130 interrupted.";

const DIAGNOSE_HELP: &str = "Examples:
  backdrive run launch/identify.toml --out out/identify
  backdrive diagnose out/identify --model plant/models/impulse-engine-linear.toml --grip plant/grips/normal.toml --out out/diagnosis
  backdrive diagnose session.csv held-out.csv --model model.toml --out out/diagnosis --effort 3
  backdrive diagnose set/ --without coulomb --out out/diagnosis

Writes verdict.json, model.diagnosed.toml, report.html and time.txt. Ctrl-C ends the search and writes what was found until then.

Exit codes: 0 nothing is missing (numbers may be off), 1 something is missing, unexplained or ambiguous, 2 usage,
3 a recording or the model is wrong, 5 a file cannot be written, 7 it cannot be told, 130 interrupted.";

const FIT_HELP: &str = "Examples:
  backdrive fit model.toml set/ --out model.fitted.toml
  backdrive fit model.toml sweep.csv steps.csv --json

Exit codes: 0 fitted, 1 the records disagree: the structure is not the device's; 2 usage; 3 a recording or the model is wrong;
5 the model cannot be written; 130 interrupted.";

const TEST_BENCH_HELP: &str = "Example:
  backdrive run launch/engine-test-bench-identify.toml --out out/bench --transport inproc
  backdrive test-bench out/bench/unfired.mcap out/bench/map.mcap out/bench/lag.mcap --dragged out/bench/unfired-other.mcap --cycle out/bench/validation.mcap \\
    --engine-inertia 0.9 --stiffness 2e4 --power 240e3 --out out/identified

Exit codes: 0 identified, 2 usage, 3 a bag does not hold what is needed, 5 the folder cannot be written.";

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a graph: every node its own process, every topic recorded.
    ///
    /// Of a graph with a master, a scaling and a slave that can touch something the run says whether its loop was stable. It is judged while the hand
    /// holds still in contact for at least 0.45 s: a run that never does so, that lost messages or a node, or ended before its duration is not called
    /// stable (exit 7). Of a graph without such a loop, as of one that identifies a device, nothing is claimed, and a run that went well ends with 0.
    #[command(
        after_help = "Example:\n  backdrive run launch/contact.toml --master plant/models/rigid-mass.toml --lambda 0.2\n\nExit codes: 0 stable, or no loop to judge; 1 not stable; 7 it cannot be told; 4 data lost, 6 a node failed, 130 interrupted."
    )]
    Run(Run),
    /// Run a bag's graph again from its recorded operator, with what you change, and say whether it was stable.
    #[command(
        after_help = "Example:\n  backdrive replay contact.mcap --mu 1 --lambda 0.6 --bag again.mcap\n\nExit codes: 0 stable, or no loop to judge; 1 not stable; 7 it cannot be told, as of a bag that was cut short."
    )]
    Replay(Replay),
    /// Ask a bag whether its loop would be stable at another gain, and how far away the edge is.
    #[command(after_help = STABILITY_HELP)]
    Stability(Stability),
    /// Write a model and a set for recordings of your own: asks what is driven and what is measured, and checks what it wrote.
    #[command(after_help = init::HELP)]
    Init(Init),
    /// Find where a model and recordings part, and which physics the model leaves out.
    #[command(after_help = DIAGNOSE_HELP)]
    Diagnose(Diagnose),
    /// Refit a model's numbers to recordings, its structure as it is: standard errors, correlations, agreement between records.
    #[command(after_help = FIT_HELP)]
    Fit(Fit),
    /// Identify an engine test bench from its bags: inertias, shaft, maps, the dynamometer's linear part, the engine's lag.
    #[command(after_help = TEST_BENCH_HELP)]
    TestBench(TestBench),
    /// Check a graph file; errors point at the line.
    #[command(
        after_help = "Example:\n  backdrive check launch/contact.toml\n\nExit codes: 0 fine, 2 usage, 3 the graph or a file that it names is wrong."
    )]
    Check(Graph),
    /// Draw a graph.
    #[command(
        after_help = "Example:\n  backdrive graph launch/contact.toml\n\nExit codes: 0 drawn, 2 usage, 3 the graph is wrong, 5 standard output cannot be written."
    )]
    Graph(Graph),
    /// Run a model on a recording, a set of recordings, or a named excitation.
    #[command(after_help = "Examples:
  backdrive simulate plant/models/impulse-engine.toml sweep:amplitude=2,from=1,to=200,duration=10 --out sweep.csv
  backdrive simulate model.toml recording.csv --out predicted.csv

Exit codes: 0 simulated, 2 usage, 3 a file is wrong, 5 the prediction cannot be written.")]
    Simulate(Simulate),
    /// Look at a model file.
    #[command(subcommand)]
    Model(Model),
    /// Look at bags and convert them.
    #[command(subcommand)]
    Bag(Bag),
    /// Remove what dead runs left in shared memory and on disk; live runs are not touched.
    #[command(
        after_help = "Example:\n  backdrive clean\n\nExit codes: 0 removed, or nothing to remove; 2 usage; 5 something could not be removed."
    )]
    Clean,
    /// Put the topics of a local graph on ROS 2, and take what other hosts tell from there.
    #[command(
        after_help = "Example:\n  backdrive run launch/contact.toml --clock realtime &\n  backdrive bridge --domain 7\n\nExit codes: 0 carried until the run ended, 2 usage, 3 no run is alive or several are, 4 messages were lost, 5 the network does not let it."
    )]
    Bridge(Bridge),
    /// Say what of this machine would hurt a run: shared memory, real-time rights, timers, multicast, socket buffers.
    #[command(
        after_help = "Example:\n  backdrive doctor --interface eth0\n\nExit codes: 0 runs work here, 2 usage, 3 no such interface, 5 something is bad."
    )]
    Doctor(Doctor),
    /// Conceal effects in a master, find them from the bags of a session, and show what that is worth on the graph.
    #[command(after_help = PROVE_EXAMPLE)]
    Prove(Prove),
    /// Print what a shell needs to complete this program's verbs and options.
    #[command(after_help = "Examples:
  backdrive completions bash > ~/.local/share/bash-completion/completions/backdrive
  backdrive completions zsh > ~/.zfunc/_backdrive
  backdrive completions fish > ~/.config/fish/completions/backdrive.fish

Exit codes: 0 done, 2 usage, 5 standard output cannot be written.")]
    Completions(Completions),
    /// Write manual pages: one for this program and one for every verb.
    #[command(after_help = "Example:
  backdrive man --out ~/.local/share/man/man1 && man backdrive-run

Exit codes: 0 done, 2 usage, 5 the folder cannot be written.")]
    Man(Man),
    /// One node of a running graph; the supervisor starts it.
    #[command(hide = true)]
    Node(Node),
    /// The master of a proof; the supervisor starts it.
    #[command(hide = true)]
    SealedMaster(SealedMaster),
}

/// Parts of a graph that are swapped.
#[derive(Debug, Args)]
#[command(next_help_heading = "Swapped parts")]
pub struct Parts {
    /// Model of the master.
    #[arg(long, value_name = "FILE")]
    pub master: Option<PathBuf>,
    /// Grip that holds the master; `none` for no hand.
    #[arg(long, value_name = "FILE|none")]
    pub grip: Option<PathBuf>,
    /// Model of the slave.
    #[arg(long, value_name = "FILE")]
    pub slave: Option<PathBuf>,
    /// What the slave touches; `none` for nothing.
    #[arg(long, value_name = "FILE|none")]
    pub environment: Option<PathBuf>,
    /// Model that predicts the induced motion; `none` to cancel nothing. Without this it stays the graph's, whatever the master is.
    #[arg(long, value_name = "FILE|none")]
    pub canceller: Option<PathBuf>,
    /// Grip that the canceller assumes; without this it stays the graph's, whatever the real grip is.
    #[arg(long, value_name = "FILE|none")]
    pub canceller_grip: Option<PathBuf>,
    /// Corner of a high-pass on the canceller's estimate; 0 for none.
    #[arg(long, value_name = "HZ", value_parser = not_negative, allow_negative_numbers = true)]
    pub high_pass: Option<f64>,
    /// Whether sensors round and are noisy as the model files say.
    #[arg(long, value_enum)]
    pub sensors: Option<Sensors>,
    /// Whether the device's limits of force, rate and speed act; `ignored` asks what the loop would do with stronger motors.
    #[arg(long, value_enum)]
    pub limits: Option<Limits>,
}

impl Parts {
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
            sensors: self.sensors.map(|s| if matches!(s, Sensors::Ideal) { "ideal" } else { "as_modelled" }.to_string()),
            limits: self.limits.map(|l| if matches!(l, Limits::Ignored) { "ignored" } else { "enforced" }.to_string()),
            ..Overrides::default()
        }
    }
}

/// Changes to a graph file.
#[derive(Debug, Args)]
#[command(next_help_heading = "Changes to the graph")]
pub struct Changes {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub parts: Parts,
    /// Position scale from master to slave.
    #[arg(long, value_parser = not_negative, allow_negative_numbers = true)]
    pub mu: Option<f64>,
    /// Force scale from slave to master.
    #[arg(long, value_parser = not_negative, allow_negative_numbers = true)]
    pub lambda: Option<f64>,
    /// Add a small recorded multisine to the force channel, such as `multisine:peak=0.1,from=1,to=500,period=2`; from it the
    /// running loop tells its margin in contact, on the status line (`margin 2.4x at 71 Hz`) and on /scaling/margin.
    #[arg(long, value_name = "EXCITATION", num_args = 0..=1, default_missing_value = DEFAULT_DITHER)]
    pub dither: Option<String>,
    /// Watch the loop and back the force gain off when an oscillation grows or stays, when force and master run away together,
    /// or, with a dither, when the margin is below 1.25x; it stays down until new gains are asked for.
    #[arg(long)]
    pub guard: bool,
    /// Length of the run.
    #[arg(long, value_name = "S", value_parser = positive, allow_negative_numbers = true)]
    pub duration: Option<f64>,
    /// Steps per second, up to 10000.
    #[arg(long, value_name = "HZ", value_parser = rate, allow_negative_numbers = true)]
    pub rate: Option<f64>,
    /// Seed of everything random.
    #[arg(long)]
    pub seed: Option<u64>,
    /// The bag to record.
    #[arg(long, value_name = "FILE")]
    pub bag: Option<PathBuf>,
    /// Replace a bag that exists, whether --bag, --out or the graph file names it; without this it is an error. A bag that
    /// another run is writing is never replaced.
    #[arg(long)]
    pub overwrite: bool,
    /// Let the bag say on which machine and from which folders it was made. Without this it holds neither; in a graph file:
    /// record_origin = true.
    #[arg(long)]
    pub record_origin: bool,
}

fn number(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or("must be a finite number".to_string())
}

fn not_negative(text: &str) -> Result<f64, String> {
    number(text).and_then(|x| if x >= 0.0 { Ok(x) } else { Err("must be at least 0".to_string()) })
}

fn positive(text: &str) -> Result<f64, String> {
    number(text).and_then(|x| if x > 0.0 { Ok(x) } else { Err("must be above 0".to_string()) })
}

fn rate(text: &str) -> Result<f64, String> {
    positive(text).and_then(|x| if x <= MAX_RATE_HZ { Ok(x) } else { Err(format!("must be at most {MAX_RATE_HZ}")) })
}

/// A dither that is small beside a finger's force, and broad enough for a frequency response.
const DEFAULT_DITHER: &str = "multisine:peak=0.05,from=1,to=500,period=2";

/// See [`Parts::sensors`].
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Sensors {
    /// As the model files say.
    AsModelled,
    /// Exact.
    Ideal,
}

/// See [`Parts::limits`].
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Limits {
    /// As the model files say.
    Enforced,
    /// None act.
    Ignored,
}

impl Changes {
    /// As the graph's reader takes them.
    pub fn overrides(&self, clock: Option<Clock>) -> Overrides {
        Overrides {
            mu: self.mu,
            lambda: self.lambda,
            dither: self.dither.clone(),
            guard: self.guard.then_some(true),
            bag: self.bag.clone(),
            overwrite: self.overwrite,
            record_origin: self.record_origin,
            clock: clock.map(|c| if matches!(c, Clock::Lockstep) { "lockstep" } else { "realtime" }.to_string()),
            rate_hz: self.rate,
            duration_s: self.duration,
            seed: self.seed,
            ..self.parts.overrides()
        }
    }
}

/// How time runs.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Clock {
    /// As fast as the machine allows, and reproducible.
    Lockstep,
    /// With the wall clock.
    Realtime,
}

/// How messages travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Transport {
    /// A process per node over shared memory.
    Iceoryx2,
    /// A process per node over ROS 2 (DDS).
    Ros2,
    /// All nodes in this process.
    Inproc,
}

/// Where on the network ROS 2 is spoken.
#[derive(Debug, Clone, Default, Args)]
pub struct Network {
    /// ROS domain, 0 to 232, in place of ROS_DOMAIN_ID.
    #[arg(long, value_name = "N")]
    pub domain: Option<u16>,
    /// Name or address of a network interface to use; may be given again. All without.
    #[arg(long, value_name = "NAME")]
    pub interface: Vec<String>,
    /// Address (IPv4) or name of a host to tell by unicast, where there is no multicast; may be given again.
    #[arg(long, value_name = "HOST")]
    pub peer: Vec<String>,
}

/// `backdrive completions`
#[derive(Debug, Args)]
pub struct Completions {
    /// The shell.
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// `backdrive man`
#[derive(Debug, Args)]
pub struct Man {
    /// Folder for the pages; made if it is not there.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// `backdrive bridge`
#[derive(Debug, Args)]
pub struct Bridge {
    /// The beginning of the run's name; not needed while one run is alive.
    pub run: Option<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub network: Network,
    /// Print what crossed as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `backdrive doctor`
#[derive(Debug, Args)]
pub struct Doctor {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub network: Network,
    /// How long to listen for other hosts, s; ROS programs announce themselves every 10 to 30 s.
    #[arg(long = "listen", value_name = "S", default_value_t = 3.0)]
    pub listen_s: f64,
    /// Print the findings as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `backdrive run`
#[derive(Debug, Args)]
pub struct Run {
    /// The graph file.
    pub graph: PathBuf,
    /// How messages travel: shared memory without --host, else ROS 2.
    #[arg(long, value_enum)]
    pub transport: Option<Transport>,
    /// Run only the nodes of this host of the graph, together with the other hosts.
    #[arg(long, value_name = "NAME")]
    pub host: Option<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub network: Network,
    /// How time runs.
    #[arg(long, value_enum)]
    pub clock: Option<Clock>,
    /// Folder for the recordings of a graph with experiments.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Write a page about the run as one HTML file: what happened, signals, contact, timing, losses, events.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub changes: Changes,
}

/// `backdrive replay`
#[derive(Debug, Args)]
pub struct Replay {
    /// The bag of a run.
    pub recording: PathBuf,
    /// Write a page about the run as one HTML file: what happened, signals, contact, timing, losses, events.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub changes: Changes,
}

/// `backdrive stability`
#[derive(Debug, Args)]
pub struct Stability {
    /// The bag of a run; with --roles any MCAP file, or a rosbag2 folder.
    pub recording: PathBuf,
    /// The gain product mu*lambda asked about, reached by lambda; without it the bag's own.
    #[arg(long, value_name = "X", value_parser = positive, allow_negative_numbers = true, conflicts_with_all = ["mu", "lambda"])]
    pub gain: Option<f64>,
    /// Position scale asked about; the bag's own if not given.
    #[arg(long, value_parser = positive, allow_negative_numbers = true)]
    pub mu: Option<f64>,
    /// Force scale asked about; the bag's own if not given.
    #[arg(long, value_parser = positive, allow_negative_numbers = true)]
    pub lambda: Option<f64>,
    /// Draw the whole curve: this many gains from one to another, evenly spaced in their logarithm.
    #[arg(long, value_name = "FROM:TO:COUNT", value_parser = gains)]
    pub sweep: Option<Gains>,
    /// Factors on the stiffness and damping of the grip, over which the answer is given.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = positive, default_values_t = [0.7, 0.85, 1.0, 1.15, 1.3])]
    pub grips: Vec<f64>,
    /// A graph file whose operator's hand is played, in place of the hand in the bag.
    #[arg(long, value_name = "GRAPH")]
    pub script: Option<PathBuf>,
    /// Which topic is which, for a bag that we did not record; see docs/roles-example.toml.
    #[arg(long, value_name = "FILE")]
    pub roles: Option<PathBuf>,
    /// Write the report as one HTML file.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub parts: Parts,
}

/// s, how long a search may take on the clock where nothing else is said: the library's own.
const PATIENCE: f64 = backdrive_diagnosis::search::PATIENCE.as_secs() as f64;

/// `backdrive diagnose`
#[derive(Debug, Args)]
pub struct Diagnose {
    /// A folder with set.toml, a set.toml, a folder of recordings, or recordings (CSV or MCAP). Without a set.toml the last one is held out.
    #[arg(required = true, value_name = "SET")]
    pub set: Vec<PathBuf>,
    /// Folder for verdict.json, model.diagnosed.toml and report.html; made if it is not there.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// The nominal model; without this the set's own.
    #[arg(long, value_name = "FILE")]
    pub model: Option<PathBuf>,
    /// The grip that holds the nominal model, where it holds no hand itself; `none` for no hand.
    #[arg(long, value_name = "FILE|none")]
    pub grip: Option<PathBuf>,
    /// A recorded input that may have no place in the model, such as a hand that was at rest; may be given several times. In set.toml:
    /// ignore = ["NAME"].
    #[arg(long, value_name = "NAME")]
    pub ignore_signal: Vec<String>,
    /// A physics that is not to be considered, and with it all that contain it as a special case; may be given several times.
    #[arg(long, value_name = "KIND", value_parser = physics)]
    pub without: Vec<String>,
    /// How many physics may be missing at once, at most; more take more time.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u8).range(1..=8))]
    pub effects: u8,
    /// How much to search, as a multiple of the default, which takes up to about 20 s on two cores. The verdict depends on this alone, and is the same on
    /// every machine.
    #[arg(long, value_name = "FACTOR", value_parser = positive, default_value_t = 1.0, allow_negative_numbers = true)]
    pub effort: f64,
    /// A limit on the clock. Where it cuts the search off, the verdict may depend on the machine, and says so.
    #[arg(long, value_name = "SECONDS", value_parser = positive, default_value_t = PATIENCE, allow_negative_numbers = true)]
    pub patience: f64,
    /// Print the verdict as JSON.
    #[arg(long)]
    pub json: bool,
    /// Where the report goes; without this report.html in the folder of --out.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Write no report.
    #[arg(long, conflicts_with = "html")]
    pub no_report: bool,
}

/// `backdrive fit`
#[derive(Debug, Args)]
pub struct Fit {
    /// The model file.
    pub model: PathBuf,
    /// A folder with set.toml, a set.toml, a folder of recordings, or recordings (CSV or MCAP).
    #[arg(required = true, value_name = "SET")]
    pub set: Vec<PathBuf>,
    /// The grip that holds the model, where it holds no hand itself; `none` for no hand.
    #[arg(long, value_name = "FILE|none")]
    pub grip: Option<PathBuf>,
    /// A recorded input that may have no place in the model, such as a hand that was at rest; may be given several times. In set.toml:
    /// ignore = ["NAME"].
    #[arg(long, value_name = "NAME")]
    pub ignore_signal: Vec<String>,
    /// Write the refitted model, with what was given and the intervals in comments. Parameters that the recordings do not determine keep
    /// their nominal values.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Let --out take the place of the model that is read.
    #[arg(long)]
    pub overwrite: bool,
    /// How much to compute at most, as a multiple of the default.
    #[arg(long, value_name = "FACTOR", value_parser = positive, default_value_t = 1.0, allow_negative_numbers = true)]
    pub effort: f64,
    /// A limit on the clock.
    #[arg(long, value_name = "SECONDS", value_parser = positive, default_value_t = PATIENCE, allow_negative_numbers = true)]
    pub patience: f64,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `backdrive test-bench`
#[derive(Debug, Args)]
pub struct TestBench {
    /// Bag of the bench dragged (pedal at 0) and shaken by the dynamometer.
    pub unfired: PathBuf,
    /// Bag of stationary points of pedal and speed.
    pub map: PathBuf,
    /// Bag of steps of the pedal at fixed speeds.
    pub lag: PathBuf,
    /// Bag of the bench dragged along other speeds, for validation; with --cycle.
    #[arg(long, value_name = "BAG", requires = "cycle")]
    pub dragged: Option<PathBuf>,
    /// Bag of a test cycle, for validation; with --dragged.
    #[arg(long, value_name = "BAG", requires = "dragged")]
    pub cycle: Option<PathBuf>,
    /// J_C of the data sheet, where the search starts, kg m2.
    #[arg(long, value_name = "KG_M2", value_parser = positive, allow_negative_numbers = true)]
    pub engine_inertia: f64,
    /// Torsional stiffness of the data sheet, where the search starts, N m/rad.
    #[arg(long, value_name = "NM_RAD", value_parser = positive, allow_negative_numbers = true)]
    pub stiffness: f64,
    /// Most power of the dynamometer by its plate, W.
    #[arg(long, value_name = "W", value_parser = positive, allow_negative_numbers = true)]
    pub power: f64,
    /// Folder for engine.toml, dynamometer.toml and shaft.toml.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Shortest stretch of one pedal and speed that counts as stationary, s.
    #[arg(long, value_name = "S", value_parser = positive, default_value_t = 3.5, allow_negative_numbers = true)]
    pub plateau: f64,
    /// Pedals between which the lag is linear, %, rising.
    #[arg(long, value_name = "PERCENT", value_delimiter = ',', default_values_t = [0.0, 50.0, 100.0])]
    pub pedals: Vec<f64>,
    /// Speeds between which the lag is linear, rad/s, rising; without them the lowest, middle and highest of the steps.
    #[arg(long, value_name = "RAD_S", value_delimiter = ',')]
    pub speeds: Vec<f64>,
    /// Order of magnitude of the speeds' noise, rad/s: the observer's D.
    #[arg(long, value_name = "RAD_S", value_parser = positive, default_value_t = 0.02, allow_negative_numbers = true)]
    pub noise: f64,
    /// How fast the engine's torque changes, N m/s: the observer's weight.
    #[arg(long, value_name = "NM_S", value_parser = positive, default_value_t = 200.0, allow_negative_numbers = true)]
    pub torque_rate: f64,
    /// m of the observer's matrix inequality over the least there is, above 1.
    #[arg(long, value_name = "FACTOR", value_parser = positive, default_value_t = 1.2, allow_negative_numbers = true)]
    pub back_off: f64,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

fn physics(name: &str) -> Result<String, String> {
    use backdrive_diagnosis::physics::{PHYSICS, physics_named};
    let known = || PHYSICS.iter().map(|p| p.name).collect::<Vec<_>>().join(", ");
    physics_named(name).map(|p| p.name.to_string()).ok_or_else(|| format!("no such physics; there are {}", known()))
}

/// Gains of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Gains(pub Vec<f64>);

/// Most gains in a sweep.
const MOST_GAINS: usize = 100_000;

fn gains(text: &str) -> Result<Gains, String> {
    let parts: Vec<&str> = text.split(':').collect();
    let [from, to, count] = parts.as_slice() else { return Err("must be FROM:TO:COUNT, such as 0.1:50:200".to_string()) };
    let (from, to) = (positive(from)?, positive(to)?);
    let count: usize = count.parse().ok().filter(|n| (1..=MOST_GAINS).contains(n)).ok_or(format!("COUNT must be 1 to {MOST_GAINS}"))?;
    if to < from {
        return Err("FROM must not be above TO".to_string());
    }
    let at = |i: usize| if count == 1 { from } else { from * (to / from).powf(i as f64 / (count - 1) as f64) };
    Ok(Gains((0..count).map(at).collect()))
}

/// `backdrive check`, `backdrive graph`
#[derive(Debug, Args)]
pub struct Graph {
    /// The graph file.
    pub graph: PathBuf,
}

/// `backdrive simulate`
#[derive(Debug, Args)]
pub struct Simulate {
    /// The model file.
    pub model: PathBuf,
    /// A recording (CSV or bag), a folder with a set.toml, an excitation file, or an excitation such as `steps:amplitude=1,duration=2`.
    pub drive: String,
    /// Replace files that exist.
    #[arg(long)]
    pub overwrite: bool,
    /// Where the prediction goes, as CSV; for a set a folder.
    #[arg(long, visible_alias = "csv", value_name = "FILE")]
    pub out: PathBuf,
    /// Grip or environment to attach at the model's user's body.
    #[arg(long, value_name = "FILE")]
    pub grip: Option<PathBuf>,
    /// Which input an excitation drives; the first one if not given.
    #[arg(long)]
    pub input: Option<String>,
    /// Samples per second of an excitation.
    #[arg(long, value_name = "HZ", default_value_t = 5000.0)]
    pub rate: f64,
    /// Substeps per sample; chosen from the model if not given.
    #[arg(long)]
    pub substeps: Option<usize>,
    /// Add the sensors' noise and rounding, with this seed.
    #[arg(long, value_name = "SEED")]
    pub noise: Option<u64>,
    /// Columns that are named differently: a set.toml whose `[columns]` are used.
    #[arg(long, value_name = "SET.TOML")]
    pub columns: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `backdrive model`
#[derive(Debug, Subcommand)]
pub enum Model {
    /// Print the network, its modes and its frequency response.
    #[command(
        after_help = "Example:\n  backdrive model show plant/models/impulse-engine.toml --grip plant/grips/normal.toml\n\nExit codes: 0 shown, 2 usage, 3 a file is wrong or too large to look at, 5 standard output cannot be written."
    )]
    Show(ModelFile),
    /// Check a model file; errors point at the line.
    #[command(
        after_help = "Example:\n  backdrive model check plant/models/impulse-engine.toml\n\nExit codes: 0 fine, 2 usage, 3 the file is wrong, or holds nothing that moves."
    )]
    Check(ModelFile),
}

/// A model file.
#[derive(Debug, Args)]
pub struct ModelFile {
    /// The model file, or a fragment.
    pub model: PathBuf,
    /// Grip or environment to attach at the model's user's body.
    #[arg(long, value_name = "FILE")]
    pub grip: Option<PathBuf>,
    /// Amplitude of motion at which hysteresis, friction and backlash are looked at, m or rad; very small if not given.
    #[arg(long, value_name = "M")]
    pub amplitude: Option<f64>,
    /// Print it as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `backdrive bag`
#[derive(Debug, Subcommand)]
pub enum Bag {
    /// What is in a bag, and whether it is complete.
    #[command(
        after_help = "Example:\n  backdrive bag info contact.mcap\n\nExit codes: 0 whole, 2 usage, 3 cannot be read, 4 damaged, cut off or with losses."
    )]
    Info {
        /// The bag; any MCAP file.
        bag: PathBuf,
        /// Print it as JSON.
        #[arg(long)]
        json: bool,
    },
    /// CSV recordings into a bag.
    #[command(
        after_help = "Example:\n  backdrive bag import sweep.csv --bag sweep.mcap\n\nExit codes: 0 imported, 2 usage, 3 a table is wrong or the bag exists, 5 the bag cannot be written."
    )]
    Import {
        /// CSV files with a column `t`, s.
        #[arg(required = true)]
        csv: Vec<PathBuf>,
        /// The new bag; of several CSV files the folder in which each becomes one.
        #[arg(long, visible_alias = "out", value_name = "FILE")]
        bag: PathBuf,
        /// Replace a bag that exists.
        #[arg(long)]
        overwrite: bool,
        /// Which column is what, as `motor_position=/master/measured_js.position[0]`; repeatable.
        #[arg(long, value_name = "COLUMN=TOPIC.FIELD[AXIS]")]
        map: Vec<String>,
    },
    /// A bag's signals as CSV.
    #[command(
        after_help = "Example:\n  backdrive bag export contact.mcap --csv contact.csv\n\nExit codes: 0 exported, 2 usage, 3 the bag is wrong or the table exists, 5 the table cannot be written."
    )]
    Export {
        /// The bag.
        bag: PathBuf,
        /// The CSV file.
        #[arg(long, visible_alias = "out", value_name = "FILE")]
        csv: PathBuf,
        /// Replace a file that exists.
        #[arg(long)]
        overwrite: bool,
        /// Only these topics; repeatable.
        #[arg(long)]
        topic: Vec<String>,
    },
    /// What can be saved of a bag that was cut off.
    #[command(
        after_help = "Example:\n  backdrive bag recover contact.mcap --bag saved.mcap\n\nExit codes: 0 all was saved, 2 usage, 3 it is no bag or the copy exists, 4 something was lost, 5 the copy cannot be written."
    )]
    Recover {
        /// The damaged bag; it is not changed.
        damaged: PathBuf,
        /// The new bag.
        #[arg(long, visible_alias = "out", value_name = "FILE")]
        bag: PathBuf,
        /// Replace a bag that exists.
        #[arg(long)]
        overwrite: bool,
    },
    /// One bag from those that two hosts recorded of the same run.
    #[command(
        after_help = "Example:\n  backdrive bag merge contact-desk.mcap contact-robot.mcap --bag contact.mcap\n\nExit codes: 0 merged, 2 usage, 3 a bag is wrong or the new one exists, 4 messages are missing, 5 the bag cannot be written."
    )]
    Merge {
        /// One bag; its clock is kept.
        a: PathBuf,
        /// The other.
        b: PathBuf,
        /// The new bag.
        #[arg(long, visible_alias = "out", value_name = "FILE")]
        bag: PathBuf,
        /// Replace a bag that exists.
        #[arg(long)]
        overwrite: bool,
        /// By how much the second's clock is ahead, s, in place of what the bags say.
        #[arg(long, value_name = "S", allow_negative_numbers = true)]
        offset: Option<f64>,
        /// Print the result as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Publish a bag's messages again, verbatim and at their times.
    #[command(
        after_help = "Example:\n  backdrive bag play contact.mcap --speed 0.5\n\nExit codes: 0 played, 2 usage, 3 the bag is wrong, 5 shared memory does not let it, 130 interrupted."
    )]
    Play {
        /// The bag.
        bag: PathBuf,
        /// Times real time.
        #[arg(long, default_value_t = 1.0)]
        speed: f64,
    },
    /// Where two bags part; exit code 1 if they do.
    #[command(
        after_help = "Example:\n  backdrive bag diff a.mcap b.mcap --tolerance /master/measured_js=1e-6\n\nExit codes: 0 the same, 1 they differ, 2 usage, 3 a bag cannot be read."
    )]
    Diff {
        /// One bag.
        a: PathBuf,
        /// The other.
        b: PathBuf,
        /// Largest difference of a topic that counts as none, in its units; repeatable. Without one every bit counts.
        #[arg(long, value_name = "TOPIC=VALUE")]
        tolerance: Vec<String>,
        /// A topic that is not compared; repeatable.
        #[arg(long, value_name = "TOPIC")]
        ignore: Vec<String>,
        /// Print it as JSON.
        #[arg(long)]
        json: bool,
    },
}

/// `backdrive node`
#[derive(Debug, Args)]
pub struct Node {
    /// The run's folder.
    #[arg(long)]
    pub run: PathBuf,
    /// Name of the node.
    #[arg(long)]
    pub name: String,
}

const PROVE_EXAMPLE: &str = "Examples:
  backdrive prove --seed 1 --out proof
  backdrive prove --cases 30 --same-grip --out proofs

The hidden plant is a program of its own: `cargo build --release --workspace` puts backdrive-sealed beside this one. The truth is sealed
first: its SHA-256 is printed before anything is recorded, and only that program opens it until the verdict is written. Of several cases
every fifth conceals nothing, and in every second one nobody measures the hand; its search may take 2.5 times as long. Each case has a
folder: sealed/, session/ (bags and set), diagnosis/, and logs; proof.json and proof.html are about all of them.
Exit code 0 when all was found by family and place and nothing where nothing was, 1 when not, 2 usage, 3 a file is wrong,
5 a file cannot be written, 6 a node failed, 130 interrupted.";

/// `backdrive prove`
#[derive(Debug, Args)]
pub struct Prove {
    /// What is concealed is drawn from this; further cases from the numbers after it.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Effects concealed at once.
    #[arg(long, default_value_t = 1, value_parser = at_most_three)]
    pub effects: usize,
    /// How many cases.
    #[arg(long, default_value_t = 1, value_parser = some)]
    pub cases: usize,
    /// Conceal only what no linear model can imitate.
    #[arg(long)]
    pub nonlinear: bool,
    /// Folder for the cases; a truth that is there already is not drawn anew.
    #[arg(long, value_name = "DIR", default_value = "proof")]
    pub out: PathBuf,
    /// The nominal master.
    #[arg(long, value_name = "FILE", default_value = "plant/models/impulse-engine-linear.toml")]
    pub model: PathBuf,
    /// The nominal grip.
    #[arg(long, value_name = "FILE", default_value = "plant/grips/normal.toml")]
    pub grip: PathBuf,
    /// The shape of the second-order model that is fitted for comparison.
    #[arg(long, value_name = "FILE", default_value = "plant/models/impulse-engine-second-order.toml")]
    pub second_order: PathBuf,
    /// The session that is recorded, a graph with experiments.
    #[arg(long, value_name = "FILE", default_value = "launch/prove.toml")]
    pub session: PathBuf,
    /// The task in which the gain is raised.
    #[arg(long, value_name = "FILE", default_value = "launch/contact.toml")]
    pub contact: PathBuf,
    /// Corner of the canceller's high-pass while the gain is raised, Hz.
    #[arg(long, value_name = "HZ", default_value_t = 1.0)]
    pub high_pass: f64,
    /// How much a diagnosis searches, as a multiple of the default; two and a half times that where nobody measured the hand.
    #[arg(long, value_name = "FACTOR", value_parser = positive, default_value_t = 1.0)]
    pub effort: f64,
    /// A limit on the clock for each diagnosis.
    #[arg(long, value_name = "SECONDS", value_parser = positive, default_value_t = PATIENCE)]
    pub patience: f64,
    /// Whether the bags hold what the hand wants: in a real session nobody measures it.
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = Operator::Half)]
    pub operator: Operator,
    /// Whether the nominal numbers were refitted to a session before: they have then taken on what they can of what is concealed.
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = Nominal::Half)]
    pub nominal: Nominal,
    /// Hz, up to which a hand moves that nobody measured.
    #[arg(long, value_name = "HZ", value_parser = positive, default_value_t = 5.0)]
    pub hand_bandwidth: f64,
    /// How firmly the hand grips in further runs at each gain: factors on the grip of the session.
    #[arg(long, value_name = "FACTORS", value_delimiter = ',', value_parser = positive, default_values_t = [0.8, 0.9, 0.95, 1.05, 1.1, 1.2])]
    pub grips: Vec<f64>,
    /// Only the grip of the session.
    #[arg(long, conflicts_with = "grips")]
    pub same_grip: bool,
    /// Only conceal, record and diagnose: no gain is raised.
    #[arg(long, conflicts_with_all = ["grips", "same_grip"])]
    pub no_gains: bool,
    /// Where the report goes; without this proof.html in the folder of the cases.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// The program of the hidden plant; without this `backdrive-sealed` beside this program, or on the path.
    #[arg(long, value_name = "FILE")]
    pub plant: Option<PathBuf>,
}

/// Which cases hide what the hand wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Operator {
    /// None.
    Shown,
    /// All.
    Hidden,
    /// Every second one.
    Half,
}

/// Which cases have a nominal model that was refitted to the hidden plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Nominal {
    /// None: its numbers are off as they were drawn.
    Given,
    /// All.
    Refitted,
    /// Two of every four.
    Half,
}

/// `backdrive sealed-master`
#[derive(Debug, Args)]
pub struct SealedMaster {
    /// The run's folder.
    #[arg(long)]
    pub run: PathBuf,
    /// Name of the node.
    #[arg(long)]
    pub name: String,
    /// The command line of the hidden plant, word by word.
    #[arg(long, allow_hyphen_values = true)]
    pub word: Vec<String>,
}

fn at_most_three(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n <= 3).ok_or_else(|| "must be a whole number from 0 to 3".to_string())
}

fn some(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| (1..=1000).contains(n)).ok_or_else(|| "must be a whole number from 1 to 1000".to_string())
}
