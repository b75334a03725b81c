//! Recorded forces: `recorded:file=impacts.csv,column=effort` instead of an excitation.

const PREFIX: &str = "recorded:";

/// Most samples that a recording may become.
const MOST_SAMPLES: f64 = 1e8;

/// A column of a CSV file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Recorded {
    /// The file, as the graph names it.
    pub file: String,
    column: String,
    scale: f64,
    /// Rest before it, s.
    quiet: f64,
}

impl Recorded {
    /// The recording that `spec` asks for; `None` where it is an excitation. The error is one sentence.
    pub fn parse(spec: &str) -> Option<Result<Recorded, String>> {
        let keys = spec.strip_prefix(PREFIX)?;
        let mut recorded = Recorded { file: String::new(), column: String::new(), scale: 1.0, quiet: 0.0 };
        let number = |key: &str, value: &str| {
            value
                .parse::<f64>()
                .ok()
                .filter(|x| x.is_finite())
                .ok_or_else(|| format!("recorded: {key}: expected a number, found \"{value}\""))
        };
        for pair in keys.split(',').map(str::trim).filter(|p| !p.is_empty()) {
            let taken = match pair.split_once('=').map(|(key, value)| (key.trim(), value.trim())) {
                Some(("file", value)) => {
                    recorded.file = value.to_string();
                    Ok(())
                }
                Some(("column", value)) => {
                    recorded.column = value.to_string();
                    Ok(())
                }
                Some(("scale", value)) => number("scale", value).map(|x| recorded.scale = x),
                Some(("quiet", value)) => match number("quiet", value) {
                    Ok(x) if x < 0.0 => Err(format!("recorded: quiet: must be at least 0, is {x}")),
                    other => other.map(|x| recorded.quiet = x),
                },
                _ => Err(format!("recorded: expected file=..., column=..., scale=... or quiet=..., found \"{pair}\"")),
            };
            if let Err(message) = taken {
                return Some(Err(message));
            }
        }
        if recorded.file.is_empty() || recorded.column.is_empty() {
            return Some(Err("recorded: needs file=FILE.csv and column=NAME".to_string()));
        }
        Some(Ok(recorded))
    }

    /// A specification whose file has another name; what is no recording stays unchanged.
    pub fn with_file(spec: &str, change: &dyn Fn(&str) -> String) -> String {
        let Some(keys) = spec.strip_prefix(PREFIX) else { return spec.to_string() };
        let pairs = keys.split(',').map(|pair| match pair.split_once('=') {
            Some((key, file)) if key.trim() == "file" => format!("file={}", change(file.trim())),
            _ => pair.trim().to_string(),
        });
        format!("{PREFIX}{}", pairs.collect::<Vec<_>>().join(","))
    }

    /// One value per step at a rate, each held until the file's next row; time counts from its first row.
    ///
    /// `text` is the file's. A cell that is no number, such as the `nan` of a step without a message, is 0. The error
    /// is one sentence that names the file and its line.
    pub fn samples(&self, text: &str, rate_hz: f64) -> Result<Vec<f64>, String> {
        let mut lines = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'));
        let heading: Vec<&str> = lines.next().map_or(Vec::new(), |(_, l)| l.split(',').map(|c| c.trim().trim_matches('"')).collect());
        let column = |name: &str| {
            let known = || heading.iter().copied();
            let message = || format!("{}: {}", self.file, backdrive_plant::tomlfile::unknown("column", name, known().collect::<Vec<_>>()));
            known().position(|c| c == name).ok_or_else(message)
        };
        let (time, force) = (column("t")?, column(&self.column)?);
        let mut rows: Vec<(f64, f64)> = Vec::new();
        for (index, line) in lines {
            let cells: Vec<&str> = line.split(',').map(str::trim).collect();
            let wrong = |what: &str| format!("{}:{}: {what}", self.file, index + 1);
            let t =
                cells.get(time).and_then(|c| c.parse::<f64>().ok()).filter(|t| t.is_finite()).ok_or_else(|| wrong("t is not a number"))?;
            let value = cells.get(force).ok_or_else(|| wrong("has fewer cells than the heading"))?;
            let value = value.parse::<f64>().ok().filter(|f| f.is_finite()).unwrap_or(0.0);
            if rows.last().is_some_and(|last| t <= last.0) {
                return Err(wrong("t does not rise"));
            }
            rows.push((t, self.scale * value));
        }
        let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return Err(format!("{}: has no rows", self.file)) };
        let start = first.0 - self.quiet;
        let count = ((last.0 - start) * rate_hz).round() + 1.0;
        if count > MOST_SAMPLES {
            return Err(format!("{}: {} s at {rate_hz} Hz are more than {MOST_SAMPLES} samples", self.file, last.0 - start));
        }
        let mut next = 0;
        let mut value = 0.0;
        let samples = (0..count as u64).map(|step| {
            // A hundredth of a step more, so that a row of this very step is not missed by rounding.
            let now = start + (step as f64 + 0.01) / rate_hz;
            while rows.get(next).is_some_and(|row| row.0 <= now) {
                value = rows[next].1;
                next += 1;
            }
            value
        });
        Ok(samples.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recorded(spec: &str) -> Result<Recorded, String> {
        Recorded::parse(spec).expect("a recording")
    }

    #[test]
    fn rows_are_held_and_what_is_missing_is_zero() {
        let text = "# made by hand\nt,force\n1.0,nan\n1.002,2.0\n1.003,-1.0\n";
        let force = recorded("recorded:file=a.csv,column=force,scale=2").unwrap();
        assert_eq!(force.samples(text, 1000.0).unwrap(), [0.0, 0.0, 4.0, -2.0]);
        assert_eq!(force.samples(text, 2000.0).unwrap(), [0.0, 0.0, 0.0, 0.0, 4.0, 4.0, -2.0]);
        let late = recorded("recorded:file=a.csv,column=force,quiet=0.002").unwrap();
        assert_eq!(late.samples(text, 1000.0).unwrap(), [0.0, 0.0, 0.0, 0.0, 2.0, -1.0]);
    }

    #[test]
    fn what_is_wrong_is_said() {
        assert!(Recorded::parse("sweep:amplitude=1").is_none());
        assert!(recorded("recorded:file=a.csv").unwrap_err().contains("column=NAME"));
        assert!(recorded("recorded:file=a.csv,column=f,size=2").unwrap_err().contains("size=2"));
        let force = recorded("recorded:file=a.csv,column=forse").unwrap();
        assert!(force.samples("t,force\n0,1\n", 1e3).unwrap_err().contains("did you mean \"force\""));
        assert!(recorded("recorded:file=a.csv,column=f").unwrap().samples("t,f\n0,1\n0,1\n", 1e3).unwrap_err().starts_with("a.csv:3"));
    }

    #[test]
    fn only_the_file_gets_another_name() {
        let there = |name: &str| format!("/x/{name}");
        assert_eq!(Recorded::with_file("recorded:file=b.csv, column=f", &there), "recorded:file=/x/b.csv,column=f");
        assert_eq!(Recorded::with_file("steps:amplitude=1", &there), "steps:amplitude=1");
    }
}
