//! The files of a test bench: an engine's maps, a dynamometer, a test cycle.
//!
//! `launch/engine-test-bench/` has one of each, with every key explained.

use backdrive_control::cycle::Cycle;
use backdrive_control::dynamometer::DynamometerModel;
use backdrive_control::engine::{Engine, Grid, Ripple};
use backdrive_plant::elements::Range;
use backdrive_plant::tomlfile::{FileError, Table};

/// An engine file, read.
#[derive(Debug, Clone, PartialEq)]
pub struct EngineFile {
    /// Map and lag.
    pub engine: Engine,
    /// What combustion adds.
    pub ripple: Ripple,
}

impl EngineFile {
    /// Reads an engine file; `path` is what errors name.
    ///
    /// # Errors
    /// Where a key is missing, unknown or out of range: file, line and key.
    pub fn from_toml(text: &str, path: &str) -> Result<EngineFile, FileError> {
        let mut top = Table::parse(text, path)?;
        for key in ["name", "title", "source"] {
            top.string(key)?;
        }
        let map = grid(&mut top, "map", "pedal", "torque", Range::Any)?.ok_or_else(|| top.missing("map"))?;
        let lag = grid(&mut top, "lag", "lag_pedal", "time_constant", Range::Positive)?.ok_or_else(|| top.missing("lag"))?;
        let ripple = match top.table("ripple")? {
            None => Ripple { per_revolution: 0.0, share: 0.0 },
            Some(mut table) => {
                let per_revolution = table.need_number("per_revolution", Range::Positive)?;
                let share = table.need_number("share", Range::NonNegative)?;
                table.finish()?;
                Ripple { per_revolution, share }
            }
        };
        top.finish()?;
        Ok(EngineFile { engine: Engine::new(map, lag), ripple })
    }

    /// The file's text.
    pub fn to_toml(&self, title: &str) -> String {
        let list = |values: &[f64], factor: f64| values.iter().map(|v| format!("{:?}", v * factor)).collect::<Vec<_>>().join(", ");
        let mut text = format!("title = {title:?}\n");
        for (table, pedals, key, grid) in
            [("map", "pedal", "torque", &self.engine.map), ("lag", "lag_pedal", "time_constant", &self.engine.lag)]
        {
            text.insert_str(0, &format!("{pedals} = [{}]\n", list(grid.pedals(), 100.0)));
            for (row, speed) in grid.values().chunks(grid.pedals().len()).zip(grid.speeds()) {
                text += &format!("\n[[{table}]]\nspeed = {speed:?}\n{key} = [{}]\n", list(row, 1.0));
            }
        }
        let Ripple { per_revolution, share } = self.ripple;
        if share > 0.0 {
            text += &format!("\n[ripple]\nper_revolution = {per_revolution:?}\nshare = {share:?}\n");
        }
        text
    }
}

/// `[[rows]]` with a speed and a value for each pedal of the list `pedals`, in percent; `None` where there is neither.
fn grid(top: &mut Table, rows: &str, pedals: &str, key: &str, range: Range) -> Result<Option<Grid>, FileError> {
    let Some(axis) = top.numbers(pedals, Range::Between(0.0, 100.0))? else { return Ok(None) };
    let (mut speeds, mut values) = (Vec::new(), Vec::new());
    for mut row in top.tables(rows)? {
        speeds.push(row.need_number("speed", Range::NonNegative)?);
        let list = row.numbers(key, range)?.ok_or_else(|| row.missing(key))?;
        if list.len() != axis.len() {
            return Err(row.error_at(key, format!("{} values for the {} pedals of \"{pedals}\"", list.len(), axis.len())));
        }
        values.extend(list);
        row.finish()?;
    }
    let shares = axis.iter().map(|p| p / 100.0).collect();
    Grid::new(shares, speeds, values).map(Some).map_err(|e| top.error_at(rows, e.to_string()))
}

/// A dynamometer file, read: the machine, and the deviation of its converter's estimate of the torque, N m.
///
/// # Errors
/// As [`EngineFile::from_toml`].
pub fn dynamometer_from_toml(text: &str, path: &str) -> Result<(DynamometerModel, f64), FileError> {
    let mut top = Table::parse(text, path)?;
    for key in ["name", "title", "source"] {
        top.string(key)?;
    }
    let wanted = top.numbers("wanted", Range::Any)?.unwrap_or_default();
    let torque = top.numbers("torque", Range::Any)?.unwrap_or_default();
    if wanted.len() != torque.len() {
        return Err(top.error_at("torque", format!("{} values for the {} torques of \"wanted\"", torque.len(), wanted.len())));
    }
    if wanted.windows(2).any(|pair| pair[1] <= pair[0]) {
        return Err(top.error_at("wanted", "must rise from point to point"));
    }
    let model = DynamometerModel {
        map: wanted.into_iter().zip(torque).map(|(w, t)| [w, t]).collect(),
        frequency_hz: top.need_number("frequency_hz", Range::Positive)?,
        damping_ratio: top.need_number("damping_ratio", Range::Positive)?,
        delay_s: top.number_or("delay_s", Range::Between(0.0, 10.0), 0.0)?,
        power: top.number("power_w", Range::Positive)?.unwrap_or(f64::INFINITY),
    };
    let noise = top.number_or("noise", Range::NonNegative, 0.0)?;
    top.finish()?;
    Ok((model, noise))
}

/// The file's text of a machine that was identified.
pub fn dynamometer_to_toml(model: &DynamometerModel, title: &str) -> String {
    let list = |which: usize| model.map.iter().map(|p| format!("{:?}", p[which])).collect::<Vec<_>>().join(", ");
    let power = if model.power.is_finite() { format!("power_w = {:?}\n", model.power) } else { String::new() };
    format!(
        "title = {title:?}\nwanted = [{}]\ntorque = [{}]\nfrequency_hz = {:?}\ndamping_ratio = {:?}\ndelay_s = {:?}\n{power}",
        list(0),
        list(1),
        model.frequency_hz,
        model.damping_ratio,
        model.delay_s
    )
}

/// A test cycle: a CSV table with the columns `t` (s), `pedal` (%), `speed` (rad/s), in any order; lines with # are remarks.
///
/// # Errors
/// A column that is missing, a cell that is no number, a pedal beyond 0 to 100 %, times that fall: file and line.
pub fn cycle_from_csv(text: &str, path: &str) -> Result<Cycle, FileError> {
    let mut lines = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'));
    let heading: Vec<&str> = lines.next().map_or(Vec::new(), |(_, l)| l.split(',').map(str::trim).collect());
    let mut places = [0; 3];
    for (place, name) in places.iter_mut().zip(["t", "pedal", "speed"]) {
        let found = heading.iter().position(|h| *h == name);
        *place = found.ok_or_else(|| FileError::at(path, 1, name, "there is no such column; a cycle has t, pedal and speed"))?;
    }
    let mut points: Vec<[f64; 3]> = Vec::new();
    for (index, line) in lines {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let mut point = [0.0; 3];
        for ((value, place), name) in point.iter_mut().zip(places).zip(["t", "pedal", "speed"]) {
            let parsed = cells.get(place).and_then(|c| c.parse::<f64>().ok()).filter(|v| v.is_finite());
            *value = parsed.ok_or_else(|| FileError::at(path, index + 1, name, "expected a number"))?;
        }
        if points.last().is_some_and(|last| point[0] < last[0]) {
            return Err(FileError::at(path, index + 1, "t", "must not fall"));
        }
        if !(0.0..=100.0).contains(&point[1]) {
            return Err(FileError::at(path, index + 1, "pedal", format!("must be from 0 to 100, is {}", point[1])));
        }
        point[1] /= 100.0;
        points.push(point);
    }
    if points.is_empty() {
        return Err(FileError::whole(path, "has no rows"));
    }
    Ok(Cycle::Points(points))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_reads_as_it_was() {
        let text = "pedal = [0, 100]\nlag_pedal = [0]\n[[map]]\nspeed = 0\ntorque = [0, 1]\n[[map]]\nspeed = 100\ntorque = [-20, 500]\n\
                    [[lag]]\nspeed = 0\ntime_constant = [0.4]\n[ripple]\nper_revolution = 2\nshare = 0.3\n";
        let file = EngineFile::from_toml(text, "engine.toml").unwrap();
        assert_eq!(file.engine.static_torque(0.5, 100.0), 240.0);
        assert_eq!(EngineFile::from_toml(&file.to_toml("again"), "again.toml").unwrap(), file);
        let text = "wanted = [-1, 1]\ntorque = [-0.9, 1]\nfrequency_hz = 20\ndamping_ratio = 0.7\npower_w = 2.4e5\n";
        let (model, _) = dynamometer_from_toml(text, "dyno.toml").unwrap();
        assert_eq!(dynamometer_from_toml(&dynamometer_to_toml(&model, "again"), "again.toml").unwrap().0, model);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        let short = "pedal = [0, 50, 100]\nlag_pedal = [0]\n[[map]]\nspeed = 0\ntorque = [0, 1]\n[[lag]]\nspeed = 0\ntime_constant = [1]\n";
        let told = EngineFile::from_toml(short, "engine.toml").unwrap_err().to_string();
        assert!(told.contains("engine.toml:5") && told.contains("2 values for the 3 pedals"), "{told}");
        let told = EngineFile::from_toml("pedal = [0]\n", "engine.toml").unwrap_err().to_string();
        assert!(told.contains("map") || told.contains("least one"), "{told}");
        let told = dynamometer_from_toml("wanted = [1, 0]\ntorque = [1, 0]\n", "dyno.toml").unwrap_err().to_string();
        assert!(told.contains("must rise"), "{told}");
        for (text, line, word) in
            [("t,pedal\n", "1", "speed"), ("t,pedal,speed\n0,0,x\n", "2", "number"), ("t,pedal,speed\n0,101,1\n", "2", "100")]
        {
            let told = cycle_from_csv(text, "cycle.csv").unwrap_err().to_string();
            assert!(told.contains(&format!("cycle.csv:{line}")) && told.contains(word), "{told}");
        }
    }
}
