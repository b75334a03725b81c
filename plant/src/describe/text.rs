//! A description as text.

use super::{Description, NamedNumber, PointRow, RobotRow, Severity};
use std::fmt;

impl fmt::Display for Description {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.name)?;
        if !self.title.is_empty() {
            write!(f, ": {}", self.title)?;
        }
        writeln!(f)?;
        if !self.source.is_empty() {
            writeln!(f, "from {}", self.source)?;
        }
        writeln!(f, "\n{}", self.diagram)?;
        if let Some(robot) = &self.robot {
            robot.write(f)?;
        }
        let rows: Vec<Vec<String>> = self
            .elements
            .iter()
            .map(|e| {
                let parameters = e.parameters.iter().map(number).collect::<Vec<_>>().join(", ");
                vec![e.name.clone(), e.kind.to_string(), format!("{} - {}", e.between[0], e.between[1]), parameters]
            })
            .collect();
        table(f, &["element", "kind", "between", "parameters"], &rows)?;
        if let Some(reason) = &self.not_linear {
            writeln!(f, "\nno modes or responses: {reason}")?;
        } else {
            self.linear(f)?;
        }
        for remark in &self.remarks {
            let word = match remark.severity {
                Severity::Note => "note",
                Severity::Warning => "warning",
                Severity::Error => "error",
            };
            writeln!(f, "\n{word}: {}: {}", remark.about, remark.message)?;
        }
        Ok(())
    }
}

impl RobotRow {
    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.gravity.map(short);
        writeln!(f, "robot {}: {} joints move {} kg, gravity ({x}, {y}, {z}) m/s²", self.name, self.joints.len(), short(self.mass))?;
        let rows: Vec<Vec<String>> = self
            .joints
            .iter()
            .map(|j| {
                let (inertia, force) = if j.unit == "m" { ("kg", "N") } else { ("kg m²", "N m") };
                vec![
                    j.name.clone(),
                    j.kind.to_string(),
                    j.link.clone(),
                    format!("{} {}", short(j.pose), j.unit),
                    format!("{} {inertia}", short(j.inertia)),
                    format!("{} {force}", short(j.gravity)),
                ]
            })
            .collect();
        table(f, &["joint", "kind", "carries", "pose", "inertia there", "gravity there"], &rows)?;
        if self.gravity_compensated {
            writeln!(f, "the motors hold the weight of the links in every pose")?;
        }
        let vector = |v: [f64; 3]| format!("({})", v.map(short).join(", "));
        let row = |p: &PointRow| vec![p.name.clone(), p.link.clone(), vector(p.at), vector(p.axis), format!("{} kg", short(p.mass))];
        let rows: Vec<Vec<String>> = self.points.iter().map(row).collect();
        if !rows.is_empty() {
            writeln!(f)?;
            table(f, &["point", "of", "at, m", "along", "mass there"], &rows)?;
        }
        for line in &self.left_aside {
            writeln!(f, "left aside: {line}")?;
        }
        writeln!(f)
    }
}

impl Description {
    fn linear(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = if self.motion == "rotation" { "rad" } else { "m" };
        writeln!(f, "\nabout rest, hysteresis as a sine of {} {unit} sees it, dry friction left out", short(self.amplitude))?;
        let rows: Vec<Vec<String>> = self
            .modes
            .iter()
            .map(|m| {
                let moving = m.shape.iter().filter(|s| s.1 != 0.0).map(|(name, x)| format!("{name} {x:+.2}"));
                vec![short(m.frequency_hz), moving.collect::<Vec<_>>().join("  ")]
            })
            .collect();
        table(f, &["undamped Hz", "shape"], &rows)?;
        let rows: Vec<Vec<String>> = self.poles.iter().map(|p| vec![short(p.frequency_hz), format!("{:.3}", p.damping_ratio)]).collect();
        writeln!(f)?;
        table(f, &["damped Hz", "damping ratio"], &rows)?;
        for response in &self.responses {
            writeln!(f, "\n{} -> {}", response.input, response.output)?;
            let rows: Vec<Vec<String>> = response
                .points
                .iter()
                .map(|p| vec![short(p.frequency_hz), short(p.magnitude), format!("{:.1}", tenths(p.phase_deg))])
                .collect();
            let magnitude = format!("magnitude {}", response.unit);
            table(f, &["Hz", &magnitude, "phase deg"], &rows)?;
        }
        Ok(())
    }
}

/// Rounded to tenths, without the sign that a rounded -0.04 would keep.
fn tenths(x: f64) -> f64 {
    (x * 10.0).round() / 10.0 + 0.0
}

fn number(n: &NamedNumber) -> String {
    let values = n.values.iter().map(|x| short(*x)).collect::<Vec<_>>();
    let unit = if n.unit == "-" { String::new() } else { format!(" {}", n.unit) };
    match values.as_slice() {
        [one] => format!("{} {one}{unit}", n.name),
        list => format!("{} [{}]{unit}", n.name, list.join(", ")),
    }
}

/// Five significant digits, without an exponent where that is short.
fn short(x: f64) -> String {
    let rounded = crate::write::round_significant(x, 5);
    let plain = format!("{rounded}");
    if plain.len() <= 9 { plain } else { format!("{rounded:e}") }
}

/// Columns as wide as their widest cell, the last one ragged.
fn table(f: &mut fmt::Formatter<'_>, headings: &[&str], rows: &[Vec<String>]) -> fmt::Result {
    let width = |column: usize| {
        let cells = rows.iter().map(|r| r[column].chars().count());
        cells.chain(std::iter::once(headings[column].chars().count())).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..headings.len()).map(width).collect();
    let line = |cells: Vec<&str>| {
        let padded = cells.iter().zip(&widths).map(|(cell, w)| format!("{cell:<w$}")).collect::<Vec<_>>();
        padded.join("  ").trim_end().to_string()
    };
    writeln!(f, "{}", line(headings.to_vec()))?;
    for row in rows {
        writeln!(f, "{}", line(row.iter().map(String::as_str).collect()))?;
    }
    Ok(())
}
