//! Draws a truth and seals it, or is the device that a truth describes.

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

use backdrive_sealed::draw::{DrawOptions, draw};
use backdrive_sealed::master::{MasterOptions, Regrip, SealedMaster};
use backdrive_sealed::network::{Grip, Network};
use backdrive_sealed::process::serve;
use backdrive_sealed::seal::seal;
use backdrive_sealed::truth::Truth;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;

const USAGE: &str = "\
The hidden plant: draws what a device hides and seals it, or is that device.

backdrive-sealed draw --model FILE [--grip FILE] --seed N --out FILE [--effects N] [--nonlinear] [--masked PERCENT]
                      [--grip-differs PERCENT] [--rate HZ]
    Draws a truth from a seed, writes it, and prints its SHA-256 as sha256sum does. A file that is there is not replaced.
    --effects       number of effects, 0 to 3 (1)
    --nonlinear     only effects that no linear model can reproduce
    --masked        largest error of a nominal parameter, per cent, 0 to 50 (15)
    --grip-differs  largest error of the nominal grip, per cent, 0 to 50 (20)
    --rate          samples of the graph per second (5000)

backdrive-sealed run --model FILE [--grip FILE] --truth FILE [--number N] [--firmness FACTOR]
                     [--regrips T:FACTOR,...] [--rate HZ]
    Is the device that a truth describes, over standard input and output: documentation of the library, `process`.
    --number        number of the run, the seed of its sensor noise (0)
    --firmness      factor on the true grip in this run (1)
    --regrips       changes of the grip in this run: from T seconds on by FACTOR, 2:1.5,4:0.7
";

/// What stands behind the verb: `--name value`, and names that stand alone.
struct Options {
    values: BTreeMap<String, String>,
    alone: BTreeSet<String>,
}

impl Options {
    /// Sorts the arguments; every name must be one of `named` (with a value) or `alone`.
    fn sort(mut arguments: impl Iterator<Item = String>, named: &[&str], alone: &[&str]) -> Result<Options, Failure> {
        let mut options = Options { values: BTreeMap::new(), alone: BTreeSet::new() };
        while let Some(argument) = arguments.next() {
            let name = argument.strip_prefix("--").unwrap_or_default().to_string();
            if alone.contains(&name.as_str()) {
                options.alone.insert(name);
            } else if named.contains(&name.as_str()) {
                let value = arguments.next().ok_or_else(|| misused(format!("--{name} needs a value")))?;
                options.values.insert(name, value);
            } else {
                return Err(misused(format!("unknown argument \"{argument}\"")));
            }
        }
        Ok(options)
    }

    fn path(&self, name: &str) -> Option<PathBuf> {
        self.values.get(name).map(PathBuf::from)
    }

    fn need_path(&self, name: &str) -> Result<PathBuf, Failure> {
        self.path(name).ok_or_else(|| misused(format!("--{name} is missing")))
    }

    fn number<T: FromStr>(&self, name: &str) -> Result<Option<T>, Failure> {
        let wrong = |text: &String| misused(format!("--{name}: \"{text}\" is not a number that it takes"));
        self.values.get(name).map(|text| text.parse().map_err(|_| wrong(text))).transpose()
    }

    /// Pairs of a time and a factor.
    fn regrips(&self) -> Result<Vec<Regrip>, Failure> {
        let Some(text) = self.values.get("regrips") else { return Ok(Vec::new()) };
        let wrong = || misused(format!("--regrips: \"{text}\" is no list of times, ascending, and factors above 0, such as 2:1.5,4:0.7"));
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let mut regrips: Vec<Regrip> = Vec::new();
        for pair in text.split(',') {
            let (at, scale) = pair.split_once(':').ok_or_else(wrong)?;
            let (at_s, scale) = number(at).zip(number(scale)).filter(|(at, scale)| *at >= 0.0 && *scale > 0.0).ok_or_else(wrong)?;
            if regrips.last().is_some_and(|last| last.at_s >= at_s) {
                return Err(wrong());
            }
            regrips.push(Regrip { at_s, scale });
        }
        Ok(regrips)
    }

    /// s, from one sample to the next.
    fn period(&self) -> Result<f64, Failure> {
        Ok(1.0 / self.number("rate")?.unwrap_or(5000.0))
    }

    /// The nominal device, held by the nominal grip if there is one.
    fn network(&self) -> Result<Network, Failure> {
        let name = |path: &Path| path.display().to_string();
        let model = self.need_path("model")?;
        let free = Network::from_toml(&read(&model)?, &name(&model)).map_err(wrong)?;
        match self.path("grip") {
            None => Ok(free),
            Some(path) => Ok(free.held(&Grip::from_toml(&read(&path)?, &name(&path)).map_err(wrong)?)),
        }
    }
}

/// A sentence and the exit code that it ends with: 2 for a wrong request, 3 for the content of a file, 5 for an error of the system.
struct Failure(String, u8);

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let done = match arguments.next().as_deref() {
        Some("draw") => {
            let named = ["model", "grip", "seed", "out", "effects", "masked", "grip-differs", "rate"];
            Options::sort(arguments, &named, &["nonlinear"]).and_then(|options| draw_truth(&options))
        }
        Some("run") => {
            let named = ["model", "grip", "truth", "number", "firmness", "regrips", "rate"];
            Options::sort(arguments, &named, &[]).and_then(|options| run(&options))
        }
        Some("--help" | "-h" | "help") => put(USAGE),
        _ => Err(misused("say draw or run")),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure(sentence, code)) => {
            let _ = writeln!(std::io::stderr(), "{sentence}");
            ExitCode::from(code)
        }
    }
}

/// A result on standard output.
fn put(text: &str) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    let written = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush());
    written.map_err(|error| Failure(format!("standard output: cannot be written: {error}"), 5))
}

fn misused(what: impl std::fmt::Display) -> Failure {
    Failure(format!("{what}; see backdrive-sealed --help"), 2)
}

fn wrong(error: impl std::fmt::Display) -> Failure {
    Failure(error.to_string(), 3)
}

/// Reads a regular file: a named pipe waits for a writer that may never come, and a device has no end.
fn read(path: &Path) -> Result<String, Failure> {
    let no_file = "it is no regular file; copy what it holds into a file first";
    let text = match fs::metadata(path) {
        Ok(about) if !about.is_file() => Err(no_file.to_string()),
        Ok(_) => fs::read_to_string(path).map_err(|error| error.to_string()),
        Err(error) => Err(error.to_string()),
    };
    text.map_err(|why| Failure(format!("{}: cannot be read: {why}", path.display()), 3))
}

fn draw_truth(options: &Options) -> Result<(), Failure> {
    let usual = DrawOptions::default();
    let drawn = DrawOptions {
        effects: options.number("effects")?.unwrap_or(usual.effects),
        nonlinear_only: options.alone.contains("nonlinear"),
        masked_percent: options.number("masked")?.unwrap_or(usual.masked_percent),
        grip_percent: options.number("grip-differs")?.unwrap_or(usual.grip_percent),
        period_s: options.period()?,
        ..usual
    };
    let seed = options.number("seed")?.ok_or_else(|| misused("--seed is missing"))?;
    let out = options.need_path("out")?;
    let truth = draw(&options.network()?, seed, &drawn).map_err(wrong)?;
    let (bytes, hash) = seal(&truth).map_err(wrong)?;
    let mut file = OpenOptions::new().write(true).create_new(true).open(&out);
    if let Ok(made) = &mut file
        && let Err(error) = made.write_all(&bytes).and_then(|()| made.sync_all())
    {
        // Half a truth is none.
        let _ = fs::remove_file(&out);
        file = Err(error);
    }
    file.map_err(|error| Failure(format!("{}: cannot be written: {error}", out.display()), 5))?;
    put(&format!("{hash}  {}\n", out.display()))
}

fn run(options: &Options) -> Result<(), Failure> {
    let path = options.need_path("truth")?;
    let how = MasterOptions {
        period_s: options.period()?,
        run: options.number("number")?.unwrap_or(0),
        firmness: options.number("firmness")?.unwrap_or(1.0),
        regrips: options.regrips()?,
        coarse: false,
    };
    let network = options.network()?;
    let truth = Truth::from_json(read(&path)?.as_bytes()).map_err(|error| wrong(format!("{}: {error}", path.display())))?;
    let master = SealedMaster::new(&network, &truth, &how).map_err(wrong)?;
    // Not through the standard output's own buffer, which would cut answers at every byte that is a line feed in text.
    let output = io::stdout().as_fd().try_clone_to_owned().map(File::from);
    let served = output.and_then(|output| serve(master, io::stdin().lock(), output));
    served.map_err(|error| Failure(format!("the other end: {error}"), 5))
}
