//! `play EXCITATIONS.toml --rate HZ --out FILE.csv`: the samples of an excitation file, such as the `next-experiment.toml` beside a verdict. A program that
//! plays the excitation receives the same samples. The table has a column `t`, then one for each input that it drives.

use backdrive_plant::excitation::load_experiments;
use std::fmt::Write;
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let after = |key: &str| args.iter().position(|a| a == key).and_then(|i| args.get(i + 1));
    let usage = "usage: play EXCITATIONS.toml --rate HZ --out FILE.csv";
    let (file, out) = (args.first().ok_or(usage)?, after("--out").ok_or(usage)?);
    let rate: f64 = after("--rate").ok_or(usage)?.parse()?;
    if !(rate.is_finite() && rate > 0.0) {
        return Err(format!("--rate must be above 0, is {rate}").into());
    }
    let experiments = load_experiments(Path::new(file))?;
    let [experiment] = experiments.as_slice() else {
        return Err(format!("{file}: holds {} experiments, not one", experiments.len()).into());
    };
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut text = String::from("t");
    for (input, excitation) in &experiment.drives {
        write!(text, ",{}", input.as_deref().unwrap_or("input"))?;
        columns.push(excitation.samples(rate)?);
    }
    for k in 0..columns.iter().map(Vec::len).max().unwrap_or(0) {
        write!(text, "\n{}", k as f64 / rate)?;
        for column in &columns {
            write!(text, ",{}", column.get(k).copied().unwrap_or(0.0))?;
        }
    }
    text.push('\n');
    std::fs::write(out, text)?;
    Ok(())
}
