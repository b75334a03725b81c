//! Other people's bags: a roles file says which field of which topic is which signal.
//!
//! ```toml
//! axes = ["x"]                         # names; optional
//!
//! [signals]                            # "TOPIC.FIELD", or a table; for several axes a list of either
//! x_m = "/omega/joint_states.position[0]"
//! F_f = { topic = "/omega/wrench_cmd", field = "wrench.force.x", scale = -1.0 }
//! x_c = "/slave/target.data"
//! F_s = { topic = "/ft_sensor", field = "wrench.force.z", offset = 0.12 }
//! x_s = "/slave/pose.pose.position.x"  # optional, as are dither and operator
//!
//! [gains]                              # optional: estimated from the signals where absent
//! mu = 1.0
//! lambda = 0.3
//!
//! [resample]                           # optional: the rate of the most frequent signal where absent
//! rate_hz = 1000
//! ```
//!
//! `docs/roles-example.toml` has every key with its meaning. Any ROS 2 type can be read whose ros2msg schema is in the bag. Positions
//! are interpolated linearly between their samples; forces hold the last one, as a servo does (`hold` in a table changes either).

use crate::from_bag::{Role, SessionError};
use crate::grid::{Grid, Ordered, Resampled, Series, even_period, step_of};
use crate::phases::contacts;
use crate::rosbag::mcap_files;
use crate::session::{AxisSignals, Session};
use crate::unjudged::{BRIDGED_S, Unjudged};
use backdrive_bags::{FieldPath, Reader, Schema, Signal};
use backdrive_plant::elements::Range;
use backdrive_plant::model::Hold;
use backdrive_plant::tomlfile::{FileError, Table, unknown};
use std::collections::HashMap;
use std::path::Path;

/// What a roles file says.
#[derive(Debug, Clone, PartialEq)]
pub struct Roles {
    /// The signals of each axis.
    pub axes: Vec<AxisRoles>,
    /// Position scale mu; estimated where `None`.
    pub mu: Option<f64>,
    /// Force scale lambda; estimated where `None`.
    pub lambda: Option<f64>,
    /// Rows per second, Hz; the rate of the most frequent signal where `None`.
    pub rate_hz: Option<f64>,
    /// The roles file, for messages.
    file: String,
}

/// Where the signals of an axis are.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisRoles {
    /// Name of the axis.
    pub name: String,
    signals: Vec<(Role, Located)>,
}

/// A signal, and where the roles file names it.
#[derive(Debug, Clone, PartialEq)]
struct Located {
    signal: Signal,
    line: usize,
    key: String,
}

/// Keys of `[signals]`, whether they must be there, and how they run between their samples.
const KEYS: [(&str, Role, bool, Hold); 7] = [
    ("x_m", Role::Master, true, Hold::Linear),
    ("F_f", Role::Force, true, Hold::Zero),
    ("x_c", Role::Command, true, Hold::Linear),
    ("F_s", Role::Contact, true, Hold::Zero),
    ("x_s", Role::Slave, false, Hold::Linear),
    ("dither", Role::Dither, false, Hold::Zero),
    ("operator", Role::Intent, false, Hold::Linear),
];

impl Roles {
    /// Reads a roles file.
    ///
    /// # Errors
    /// What is wrong, at file, line and key.
    pub fn load(path: &Path) -> Result<Roles, FileError> {
        Roles::read(Table::open(path)?)
    }

    /// The same from text; `name` stands for the file in errors.
    pub fn from_toml(text: &str, name: &str) -> Result<Roles, FileError> {
        Roles::read(Table::parse(text, name)?)
    }

    fn read(mut top: Table) -> Result<Roles, FileError> {
        let names = top.strings("axes")?;
        let mut signals = top.table("signals")?.ok_or_else(|| top.missing("signals"))?;
        let mut axes: Vec<AxisRoles> = Vec::new();
        let mut first_key = "";
        for (key, role, required, hold) in KEYS {
            let found = read_signals(&mut signals, key, hold)?;
            if found.is_empty() {
                if required {
                    let what = format!("missing key \"{key}\": {}; without it {}", role.text(), role.without());
                    // A misspelt key is told as such.
                    let misspelt = signals.missing(key);
                    return Err(if misspelt.message.contains("did you mean") { misspelt } else { signals.error(what) });
                }
                continue;
            }
            if axes.is_empty() {
                first_key = key;
                let blank = |index| AxisRoles { name: format!("axis{index}"), signals: Vec::new() };
                axes = (0..found.len()).map(blank).collect();
            }
            if found.len() != axes.len() {
                return Err(signals.error_at(key, format!("has {} axes, but {first_key} has {}", found.len(), axes.len())));
            }
            for (axis, located) in axes.iter_mut().zip(found) {
                axis.signals.push((role, located));
            }
        }
        signals.finish()?;
        if let Some(names) = names {
            if names.len() != axes.len() {
                return Err(top.error_at("axes", format!("has {} names, but [signals] has {} axes", names.len(), axes.len())));
            }
            for (axis, name) in axes.iter_mut().zip(names) {
                axis.name = name;
            }
        }
        let (mut mu, mut lambda, mut rate_hz) = (None, None, None);
        if let Some(mut gains) = top.table("gains")? {
            mu = gains.number("mu", Range::Positive)?;
            lambda = gains.number("lambda", Range::NonNegative)?;
            gains.finish()?;
        }
        if let Some(mut resample) = top.table("resample")? {
            rate_hz = resample.number("rate_hz", Range::Positive)?;
            resample.finish()?;
        }
        let file = top.file_name().to_owned();
        top.finish()?;
        Ok(Roles { axes, mu, lambda, rate_hz, file })
    }

    fn at(&self, located: &Located, message: String) -> SessionError {
        SessionError::Roles(FileError::at(&self.file, located.line, &located.key, message))
    }
}

/// A string, a table, or a list of one of them, one entry per axis; none where the key is absent.
fn read_signals(table: &mut Table, key: &'static str, hold: Hold) -> Result<Vec<Located>, FileError> {
    let line = table.line_of(key);
    if table.is_table(key) {
        let one = table.table(key)?;
        return one.into_iter().map(|t| read_table(t, key, hold)).collect();
    }
    if table.is_list_of_tables(key) {
        return table.tables(key)?.into_iter().map(|t| read_table(t, key, hold)).collect();
    }
    let specs = table.string_or_strings(key)?.unwrap_or_default();
    let several = specs.len() > 1;
    let read = |(index, spec): (usize, &String)| {
        // Names of topics have no dots.
        let Some((topic, field)) = spec.split_once('.').filter(|(t, f)| !t.is_empty() && !f.is_empty()) else {
            let message = format!("expected \"TOPIC.FIELD\", such as \"/joint_states.position[0]\", found \"{spec}\"");
            return Err(table.error_at(key, message));
        };
        let key = if several { format!("signals.{key}[{index}]") } else { format!("signals.{key}") };
        Ok(Located { signal: Signal { hold, ..Signal::new(&key, topic, field) }, line, key })
    };
    specs.iter().enumerate().map(read).collect()
}

fn read_table(mut table: Table, key: &str, hold: Hold) -> Result<Located, FileError> {
    let line = table.line();
    let (topic, field) = (table.need_string("topic")?, table.need_string("field")?);
    let scale = table.number_or("scale", Range::Any, 1.0)?;
    if scale == 0.0 {
        return Err(table.error_at("scale", "must not be 0: the signal would be gone"));
    }
    let offset = table.number_or("offset", Range::Any, 0.0)?;
    let hold = table.one_of("hold", &[("linear", Hold::Linear), ("zero", Hold::Zero)])?.unwrap_or(hold);
    let key = if table.path().is_empty() { format!("signals.{key}") } else { table.path().to_owned() };
    let signal = Signal { name: key.clone(), topic, field, scale, offset, hold };
    table.finish()?;
    Ok(Located { signal, line, key })
}

/// Clocks that differ by more than this are not one clock, ns.
const SAME_CLOCK_NS: i64 = 100_000_000;
/// An estimated gain that explains less of its signal than this is told to be doubtful.
const GOOD_FIT: f64 = 0.8;

impl Session {
    /// Reads somebody else's recording: one `.mcap`, or a rosbag2 folder.
    ///
    /// The signals are put on one grid of rows over the time that x_m, F_f, x_c and F_s have in common. What was done to them, and what
    /// looks wrong with signs, clocks or gains, is in the notes.
    ///
    /// # Errors
    /// A storage that is not read, a damaged bag, a topic or field that is not there (at its line of the roles file), signals
    /// that have no time in common.
    pub fn from_roles(path: &Path, roles: &Roles) -> Result<Session, SessionError> {
        let wrong = |what: String| SessionError::Rows { path: path.to_owned(), what };
        let wanted: Vec<(Role, &Located)> = roles.axes.iter().flat_map(|a| a.signals.iter().map(|(r, l)| (*r, l))).collect();
        let (series, closed) = gather(path, roles, &wanted)?;
        let mut notes = Vec::new();
        let ordered = on_one_clock(&wanted, &series, &mut notes);

        let needed: Vec<&Ordered> = wanted.iter().zip(&ordered).filter(|((role, _), _)| is_required(*role)).map(|(_, o)| o).collect();
        for ((role, located), o) in wanted.iter().zip(&ordered) {
            if is_required(*role) && o.times.is_empty() {
                let (topic, field) = (&located.signal.topic, &located.signal.field);
                return Err(roles.at(located, format!("{topic}.{field} was never measured; without it {}", role.without())));
            }
        }
        let grid = Grid::over(&needed, roles.rate_hz).map_err(wrong)?;
        let period_s = grid.period * 1e-9;
        let cut_short = if closed { ends_apart(&needed, &grid) } else { Some(Unjudged::NotClosed) };
        notes.push(format!("{} rows at {:.6} Hz; {}", grid.rows, 1.0 / period_s, rate_source(roles)));

        let mut axes = Vec::new();
        let mut next = 0;
        for roles in &roles.axes {
            let mut axis = AxisSignals { name: roles.name.clone(), clamped: vec![false; grid.rows], ..AxisSignals::default() };
            for (role, located) in &roles.signals {
                let Some(signal) = ordered.get(next) else { break };
                next += 1;
                let laid = signal.on(&grid, located.signal.hold);
                note_resampled(located, signal, &laid, &grid, &mut notes);
                if *role == Role::Master {
                    axis.resolution = step_of(&signal.values);
                }
                put(&mut axis, *role, laid.values);
            }
            if axis.resolution > 0.0 {
                notes.push(format!("axis {}: x_m comes in steps of {:.3e}", axis.name, axis.resolution));
            }
            axes.push(axis);
        }
        let mut session = Session {
            name: path.display().to_string(),
            period_s,
            axes,
            mu: Vec::new(),
            lambda: Vec::new(),
            notes,
            cut_short,
            bridged_s: BRIDGED_S,
        };
        settle_gains(&mut session, roles);
        check_signs(&mut session);
        Ok(session)
    }
}

/// Whether one of the signals ends (or begins) so much before another that whoever sent it was gone for more than 1 % of the recording.
fn ends_apart(needed: &[&Ordered], grid: &Grid) -> Option<Unjudged> {
    let firsts = || needed.iter().filter_map(|o| o.times.first());
    let lasts = || needed.iter().filter_map(|o| o.times.last());
    let all = (lasts().max()? - firsts().min()?) as f64;
    let common = (lasts().min()? - firsts().max()?) as f64;
    let rows = |time: f64| (time / grid.period) as usize;
    (common < 0.99 * all).then(|| Unjudged::Gaps { steps: rows(all - common), of: rows(all) })
}

fn is_required(role: Role) -> bool {
    KEYS.iter().any(|(_, r, required, _)| *r == role && *required)
}

fn rate_source(roles: &Roles) -> &'static str {
    if roles.rate_hz.is_some() { "the rate is the roles file's" } else { "the rate is that of the most frequent signal" }
}

fn put(axis: &mut AxisSignals, role: Role, values: Vec<f64>) {
    match role {
        Role::Master => axis.master = values,
        Role::Force => axis.force = values,
        Role::Command => axis.command = values,
        Role::Contact => axis.contact = values,
        Role::Slave => axis.slave = Some(values),
        Role::Dither => axis.dither = Some(values),
        Role::Intent => axis.intent = Some(values),
        Role::Induced => axis.induced = Some(values),
    }
}

/// How the wanted fields of a topic are read.
struct Plan {
    schema: Schema,
    /// Seconds and ns of the header's stamp, where there is one.
    stamp: Option<[FieldPath; 2]>,
    fields: Vec<(usize, FieldPath)>,
}

/// Reads every wanted signal in one pass over each file.
fn gather(path: &Path, roles: &Roles, wanted: &[(Role, &Located)]) -> Result<(Vec<Series>, bool), SessionError> {
    let mut closed = true;
    let mut series: Vec<Series> = wanted.iter().map(|_| Series { stamped: true, ..Series::default() }).collect();
    let mut available: Vec<String> = Vec::new();
    let mut seen = vec![false; wanted.len()];
    for file in mcap_files(path)? {
        let reader = Reader::open(&file)?;
        closed &= reader.ended_cleanly();
        available.extend(reader.topics().iter().map(|t| t.name.clone()));
        let plans = plan(&reader, roles, wanted, &mut seen)?;
        for entry in reader.messages()? {
            let entry = entry?;
            let Some(plan) = plans.get(&entry.topic.index) else { continue };
            let first = plan.fields.first().and_then(|(place, _)| wanted.get(*place));
            let damaged = |what: String| match first {
                Some((_, located)) => roles.at(located, format!("{}, byte {}: {what}", file.display(), entry.offset)),
                None => SessionError::Rows { path: file.clone(), what },
            };
            let read = |field: &FieldPath| plan.schema.read(field, &entry.payload).map_err(&damaged);
            let logged = entry.log_time_ns as i64;
            let stamp = match &plan.stamp {
                // A stamp that nobody filled in is 0.
                Some([sec, nanosec]) => match (read(sec)?, read(nanosec)?) {
                    (Some(s), Some(ns)) if s != 0.0 || ns != 0.0 => {
                        Some((s as i64).saturating_mul(1_000_000_000).saturating_add(ns as i64))
                    }
                    _ => None,
                },
                None => None,
            };
            for (place, field) in &plan.fields {
                let value = read(field)?.unwrap_or(f64::NAN);
                let (Some(series), Some((_, located))) = (series.get_mut(*place), wanted.get(*place)) else { continue };
                series.stamped &= stamp.is_some();
                series.stamps.push(stamp.unwrap_or(logged));
                series.logged.push(logged);
                series.values.push(located.signal.scale * value + located.signal.offset);
            }
        }
    }
    available.sort();
    available.dedup();
    for (((role, located), series), seen) in wanted.iter().zip(&mut series).zip(&seen) {
        let topic = &located.signal.topic;
        if !seen {
            let what = unknown("topic", topic, available.iter().map(String::as_str));
            return Err(roles.at(located, format!("{what}; the bag has {}", available.join(", "))));
        }
        if series.values.is_empty() && is_required(*role) {
            return Err(roles.at(located, format!("{topic} has no message; without it {}", role.without())));
        }
        // Stamps of some messages only would mix two clocks.
        if !series.stamped {
            series.stamps.clone_from(&series.logged);
        }
    }
    Ok((series, closed))
}

fn plan(reader: &Reader, roles: &Roles, wanted: &[(Role, &Located)], seen: &mut [bool]) -> Result<HashMap<usize, Plan>, SessionError> {
    let mut plans: HashMap<usize, Plan> = HashMap::new();
    for (place, (_, located)) in wanted.iter().enumerate() {
        let Some(topic) = reader.topics().iter().find(|t| t.name == located.signal.topic) else { continue };
        if let Some(seen) = seen.get_mut(place) {
            *seen = true;
        }
        let plan = match plans.entry(topic.index) {
            std::collections::hash_map::Entry::Occupied(plan) => plan.into_mut(),
            std::collections::hash_map::Entry::Vacant(vacant) => {
                let schema = topic.parse_schema().map_err(|e| roles.at(located, e.to_string()))?;
                let stamp = schema.find("header.stamp.sec").ok().zip(schema.find("header.stamp.nanosec").ok());
                vacant.insert(Plan { stamp: stamp.map(|(s, ns)| [s, ns]), schema, fields: Vec::new() })
            }
        };
        let field = plan.schema.find(&located.signal.field);
        let field = field.map_err(|what| roles.at(located, format!("{} ({}): {what}", topic.name, topic.type_name)))?;
        plan.fields.push((place, field));
    }
    Ok(plans)
}

/// Orders every signal in time since the first message; signals whose stamps are of another clock are moved by the difference
/// that the log times show.
fn on_one_clock(wanted: &[(Role, &Located)], series: &[Series], notes: &mut Vec<String>) -> Vec<Ordered> {
    let offsets: Vec<i64> = series.iter().map(Series::clock_offset).collect();
    let told = || offsets.iter().zip(series).filter(|(_, s)| !s.values.is_empty()).map(|(o, _)| *o);
    let (least, most) = (told().min().unwrap_or(0), told().max().unwrap_or(0));
    let mixed = most.saturating_sub(least) > SAME_CLOCK_NS;
    if mixed {
        let name = |at: i64| {
            let place = offsets.iter().position(|o| *o == at).and_then(|i| wanted.get(i));
            place.map_or(String::new(), |(_, located)| located.signal.topic.clone())
        };
        notes.push(format!(
            "stamps of {} and {} are of different clocks: against the log times they are {:.3} s apart; they are aligned by their log \
             times, so what the messages took on their way is in the delay",
            name(least),
            name(most),
            most.saturating_sub(least) as f64 * 1e-9
        ));
    }
    let unstamped: Vec<&str> =
        wanted.iter().zip(series).filter(|(_, s)| !s.stamped && !s.values.is_empty()).map(|((_, l), _)| l.signal.topic.as_str()).collect();
    if !unstamped.is_empty() {
        let mut names = unstamped;
        names.dedup();
        notes.push(format!("{}: no header stamps; the times are those of the recorder", names.join(", ")));
    }
    let shift = |i: usize| if mixed { offsets.get(i).copied().unwrap_or(0) } else { 0 };
    let starts = series.iter().enumerate().flat_map(|(i, s)| s.stamps.iter().map(move |t| t.saturating_add(shift(i))));
    let origin = starts.min().unwrap_or(0);
    series.iter().enumerate().map(|(i, s)| s.ordered(shift(i), origin)).collect()
}

fn note_resampled(located: &Located, signal: &Ordered, laid: &Resampled, grid: &Grid, notes: &mut Vec<String>) {
    let name = format!("{}.{}", located.signal.topic, located.signal.field);
    if signal.disordered > 0 {
        notes.push(format!("{name}: {} messages were out of order or had the time of another", signal.disordered));
    }
    if laid.missing > 0 {
        notes.push(format!("{name}: {} of {} rows have no value: gaps of more than 4 of its intervals", laid.missing, grid.rows));
    }
    if signal.interval > 0 && signal.jitter as f64 > 0.1 * signal.interval as f64 {
        let (jitter, interval) = (signal.jitter as f64 * 1e-6, signal.interval as f64 * 1e-6);
        notes.push(format!("{name}: its intervals of {interval:.3} ms deviate by up to {jitter:.3} ms (nine in ten)"));
    }
    if laid.delay_s > 0.05 * grid.period * 1e-9 {
        notes.push(format!("{name}: holding it between its samples delays it by {:.3} ms on average", laid.delay_s * 1e3));
    }
    if signal.interval as f64 > 1.5 * grid.period {
        notes.push(format!("{name}: has {:.1} values per second, the rows {:.1}", 1e9 / even_period(signal), 1e9 / grid.period));
    }
}

/// A gain by least squares: slope, share of the variance that it explains, rows by which the effect lags.
#[derive(Debug, Clone, Copy)]
struct Fit {
    slope: f64,
    explained: f64,
    lag: usize,
}

fn fit(cause: &[f64], effect: &[f64], rows: &[usize], most_lag: usize) -> Option<Fit> {
    (0..=most_lag).filter_map(|lag| fit_at(cause, effect, rows, lag)).max_by(|a, b| a.explained.total_cmp(&b.explained))
}

fn fit_at(cause: &[f64], effect: &[f64], rows: &[usize], lag: usize) -> Option<Fit> {
    let pair = |row: &usize| Some((*cause.get(row.checked_sub(lag)?)?, *effect.get(*row)?));
    let pairs: Vec<(f64, f64)> = rows.iter().filter_map(pair).filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    if pairs.len() < 16 {
        return None;
    }
    let n = pairs.len() as f64;
    let (mx, my) = (pairs.iter().map(|p| p.0).sum::<f64>() / n, pairs.iter().map(|p| p.1).sum::<f64>() / n);
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (x, y) in &pairs {
        xx += (x - mx) * (x - mx);
        yy += (y - my) * (y - my);
        xy += (x - mx) * (y - my);
    }
    (xx > 0.0 && yy > 0.0).then(|| Fit { slope: xy / xx, explained: xy * xy / (xx * yy), lag })
}

/// F_f without the dither.
fn reflected(axis: &AxisSignals) -> Vec<f64> {
    let dither = |row: usize| axis.dither.as_ref().and_then(|d| d.get(row)).copied().filter(|d| d.is_finite()).unwrap_or(0.0);
    axis.force.iter().enumerate().map(|(row, f)| f - dither(row)).collect()
}

fn touching(axis: &AxisSignals, period_s: f64) -> (Vec<usize>, Vec<usize>) {
    let mut touches = vec![false; axis.master.len()];
    for row in contacts(axis, period_s).into_iter().flatten() {
        if let Some(touches) = touches.get_mut(row) {
            *touches = true;
        }
    }
    (0..touches.len()).partition(|row| touches.get(*row).copied().unwrap_or(false))
}

/// Fills mu and lambda: as the roles file says, else by least squares over the axis that explains most.
fn settle_gains(session: &mut Session, roles: &Roles) {
    // A transport of 50 ms either way is the longest that is looked for.
    let most_lag = ((0.05 / session.period_s) as usize).min(200);
    let best = |fits: Vec<Option<Fit>>| fits.into_iter().flatten().max_by(|a, b| a.explained.total_cmp(&b.explained));
    let period_ms = session.period_s * 1e3;
    let mut told = Vec::new();
    let mut estimate = |name: &str, found: Option<Fit>, over: &str| match found {
        None => {
            told.push(format!("{name} is not in the roles file and cannot be estimated: there is too little motion or contact"));
            f64::NAN
        }
        Some(fit) => {
            let doubt = if fit.explained < GOOD_FIT { ": doubtful, give it in the roles file" } else { "" };
            let lag = if fit.lag > 0 { format!(", {:.2} ms late", fit.lag as f64 * period_ms) } else { String::new() };
            let share = fit.explained * 100.0;
            told.push(format!("{name} = {:.5} by least squares over {over} ({share:.1} % explained{lag}){doubt}", fit.slope));
            fit.slope
        }
    };
    let mu = roles.mu.unwrap_or_else(|| {
        let fits = session.axes.iter().map(|axis| {
            let (contact, free) = touching(axis, session.period_s);
            // A canceller changes the command in contact only.
            let free = fit(&axis.master, &axis.command, &free, most_lag);
            free.filter(|f| f.explained > GOOD_FIT).or_else(|| fit(&axis.master, &axis.command, &contact, most_lag))
        });
        estimate("mu", best(fits.collect()), "free motion")
    });
    let lambda = roles.lambda.unwrap_or_else(|| {
        let fits = session.axes.iter().map(|axis| fit(&axis.contact, &reflected(axis), &touching(axis, session.period_s).0, most_lag));
        estimate("lambda", best(fits.collect()), "contact")
    });
    session.notes.extend(told);
    let rows = session.len();
    (session.mu, session.lambda) = (vec![mu; rows], vec![lambda; rows]);
}

/// What a sign that is turned round looks like.
fn check_signs(session: &mut Session) {
    let most_lag = ((0.05 / session.period_s) as usize).min(200);
    let mut warnings = Vec::new();
    for axis in &session.axes {
        let (contact, _) = touching(axis, session.period_s);
        if contact.is_empty() {
            warnings.push(format!("axis {}: nothing was touched", axis.name));
            continue;
        }
        let dents = fit(&axis.command, &axis.contact, &contact, most_lag);
        if dents.is_some_and(|f| f.slope > 0.0 && f.explained > 0.25) {
            warnings.push(format!(
                "axis {}: F_s rises with x_c, as if contact pulled; contact should push back: is the sign of F_s (or of x_c) turned round? \
                 scale = -1 turns it",
                axis.name
            ));
        }
        let felt = fit(&axis.contact, &reflected(axis), &contact, most_lag);
        if felt.is_some_and(|f| f.slope < 0.0 && f.explained > 0.25) {
            warnings.push(format!(
                "axis {}: F_f goes against lambda F_s; the reflected force should have the sign of the contact force: scale = -1 turns one",
                axis.name
            ));
        }
        let (_, free) = touching(axis, session.period_s);
        let follows = fit(&axis.master, &axis.command, &free, most_lag);
        if follows.is_some_and(|f| f.slope < 0.0 && f.explained > GOOD_FIT) {
            warnings.push(format!("axis {}: x_c runs against x_m in free motion: scale = -1 turns one", axis.name));
        }
    }
    session.notes.extend(warnings);
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "axes = [\"x\", \"y\"]\n[signals]\nx_m = [\"/m.position[0]\", \"/m.position[1]\"]\n\
        F_f = [{ topic = \"/f\", field = \"wrench.force.x\", scale = -1.0 }, { topic = \"/f\", field = \"wrench.force.y\" }]\n\
        x_c = [\"/c.data[0]\", \"/c.data[1]\"]\nF_s = [\"/s.wrench.force.x\", \"/s.wrench.force.y\"]\n[gains]\nmu = 2.0\n";

    #[test]
    fn strings_tables_and_lists_are_read() {
        let roles = Roles::from_toml(GOOD, "r.toml").unwrap();
        assert_eq!((roles.axes.len(), roles.axes[1].name.as_str(), roles.mu, roles.lambda), (2, "y", Some(2.0), None));
        let force = &roles.axes[0].signals.iter().find(|(role, _)| *role == Role::Force).unwrap().1.signal;
        assert_eq!((force.topic.as_str(), force.field.as_str(), force.scale, force.hold), ("/f", "wrench.force.x", -1.0, Hold::Zero));
        let position = &roles.axes[1].signals[0].1.signal;
        assert_eq!((position.topic.as_str(), position.field.as_str(), position.hold), ("/m", "position[1]", Hold::Linear));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let says = |text: &str, what: &[&str]| {
            let error = Roles::from_toml(text, "r.toml").unwrap_err().to_string();
            assert!(what.iter().all(|w| error.contains(w)), "{error}");
        };
        says("[signal]\n", &["r.toml:1", "signals"]);
        says(&GOOD.replace("F_s = [\"/s.wrench.force.x\", \"/s.wrench.force.y\"]\n", ""), &["F_s", "what the slave touches"]);
        says(&GOOD.replace("\"/c.data[1]\"", "\"/c/data\""), &["r.toml:5", "x_c", "TOPIC.FIELD"]);
        says(&GOOD.replace(", \"/c.data[1]\"", ""), &["r.toml:5", "x_c", "has 1 axes, but x_m has 2"]);
        says(&GOOD.replace("scale = -1.0", "skale = -1.0"), &["r.toml:4", "did you mean \"scale\""]);
        says(&GOOD.replace("scale = -1.0", "scale = 0"), &["r.toml:4", "must not be 0"]);
        says(&GOOD.replace("mu = 2.0", "mu = -2.0"), &["mu", "above 0"]);
        says(&GOOD.replace("\"x\", \"y\"", "\"x\""), &["r.toml:1", "axes"]);
        says(&format!("{GOOD}[resample]\nrate = 5\n"), &["resample", "rate"]);
    }
}
