//! Options of `backdrive compare`.

use super::changes::SwappedParts;
use super::values::{number, positive, rival};
use crate::compare::links;
use backdrive_stability::compare::Rival;
use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive compare launch/coupling.toml --html out/compare.html
  backdrive compare contact.mcap --laws canceller,wave --delays 0,50 --jitter none --loss none --grips 1

Each value of --loss and --grips is used at the delay --at; --jitter at its own mean. The values of the table are for the gain of the
graph, or of --lambda. The stability limit is the loop gain mu*lambda above which the loop is not stable.

Exit codes: 0 compared, 2 usage, 3 a file is wrong, 5 the page cannot be written, 130 interrupted: the results so far are shown.";

/// `backdrive compare`
#[derive(Debug, Args)]
pub struct Compare {
    /// A graph file with an operator, or the bag of a run, whose recorded hand is used.
    pub session: PathBuf,
    /// Laws to compare. `canceller` is the law direct with a canceller; if the graph's canceller subtracts nothing, it uses the exact master model.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = rival())]
    pub laws: Vec<Rival>,
    /// Delays of the link, ms each way.
    #[arg(long, value_name = "MS", value_delimiter = ',', value_parser = delay, default_values_t = links::DELAYS_MS)]
    pub delays: Vec<f64>,
    /// Delays with jitter: mean and largest deviation, ms each way; `none` for none.
    #[arg(long, value_name = "MEAN:DEVIATION", value_delimiter = ',', value_parser = jitter, default_value = "120:40")]
    pub jitter: Vec<Jitter>,
    /// Shares of lost packets each way, 0 to 1; `none` for none.
    #[arg(long, value_name = "SHARE", value_delimiter = ',', value_parser = loss, default_value = "0.05,0.3")]
    pub loss: Vec<Loss>,
    /// Further factors on stiffness and damping of the grip, in addition to 1.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = positive, default_values_t = links::GRIPS)]
    pub grips: Vec<f64>,
    /// Delay for the comparison of loss and grips, ms each way.
    #[arg(long, value_name = "MS", value_parser = delay, default_value_t = links::AT_MS)]
    pub at: f64,
    /// Force scale of the comparison; without this that of the session.
    #[arg(long, value_parser = positive, allow_negative_numbers = true)]
    pub lambda: Option<f64>,
    /// Write the report as one HTML file.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub parts: SwappedParts,
}

/// A delay that varies: mean and largest deviation, ms; `None` for the word none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jitter(pub Option<[f64; 2]>);

/// A share of lost packets; `None` for the word none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss(pub Option<f64>);

fn delay(text: &str) -> Result<f64, String> {
    number(text).and_then(links::delay)
}

fn jitter(text: &str) -> Result<Jitter, String> {
    if text == "none" {
        return Ok(Jitter(None));
    }
    let (mean, deviation) = text.split_once(':').ok_or("must be MEAN:DEVIATION in ms, such as 120:40, or none")?;
    links::jitter([number(mean)?, number(deviation)?]).map(|both| Jitter(Some(both)))
}

fn loss(text: &str) -> Result<Loss, String> {
    if text == "none" {
        return Ok(Loss(None));
    }
    number(text).and_then(links::loss).map(|share| Loss(Some(share)))
}
