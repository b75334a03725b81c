//! Every sample of a bag by its step, and the events beside them.

use backdrive_bags::{BagError, Reader};
use backdrive_msgs::{Gains, Message, Sample};

/// A loop is examined over at most this number of steps, the first of its bag: 200 s at 5 kHz.
const MOST_STEPS: u64 = 1_000_000;

/// Samples and events of a bag, one row per step.
#[derive(Debug, Clone, Default)]
pub struct Recorded {
    /// Step of the first row.
    pub first: u64,
    /// Number of rows.
    pub rows: usize,
    /// One track per topic of samples.
    pub tracks: Vec<Track>,
    /// Events that nodes reported: kind, text, number.
    pub events: Vec<Told>,
    /// Gains in force, by topic.
    pub gains: Vec<(String, Gains)>,
}

/// A reported event.
#[derive(Debug, Clone, PartialEq)]
pub struct Told {
    /// Topic of the node that reported it.
    pub topic: String,
    /// Machine-readable kind.
    pub kind: String,
    /// In words.
    pub text: String,
    /// The number that belongs to it; NaN where there is none.
    pub value: f64,
}

/// The samples of one topic, one value per row and axis; NaN where nothing came or nothing was measured.
#[derive(Debug, Clone)]
pub struct Track {
    /// Name of the topic.
    pub topic: String,
    /// m or rad, per axis.
    pub position: Vec<Vec<f64>>,
    /// m/s or rad/s, per axis.
    pub velocity: Vec<Vec<f64>>,
    /// N or N m, per axis.
    pub effort: Vec<Vec<f64>>,
    /// Bits of [`backdrive_msgs::flag`].
    pub flags: Vec<u32>,
    /// Whether a sample came.
    pub came: Vec<bool>,
    /// Publishers that spoke on it, by the id in their samples.
    pub sources: Vec<u32>,
}

impl Recorded {
    /// Reads a bag.
    ///
    /// # Errors
    /// A bag that cannot be read.
    pub fn read(reader: &Reader) -> Result<Recorded, BagError> {
        let mut recorded = Recorded::default();
        let mut places: Vec<Option<usize>> = vec![None; reader.topics().len()];
        let mut first = None;
        for entry in reader.messages()? {
            let entry = entry?;
            match entry.message(reader.path())? {
                Some(Message::Sample(sample)) => {
                    recorded.first = *first.get_or_insert(sample.step);
                    if sample.step.checked_sub(recorded.first).is_some_and(|row| row < MOST_STEPS) {
                        recorded.put(&mut places, entry.topic.index, &entry.topic.name, &sample);
                    }
                }
                Some(Message::Gains(gains)) => recorded.gains.push((entry.topic.name.clone(), gains)),
                Some(Message::Event(event)) => recorded.events.push(Told {
                    topic: entry.topic.name.clone(),
                    kind: event.kind.as_str().to_string(),
                    text: event.text.as_str().to_string(),
                    value: event.value,
                }),
                _ => {}
            }
        }
        recorded.level();
        Ok(recorded)
    }

    /// Puts a sample into its row; one from before the first row is left out. `places`: where the track of each topic is.
    pub(crate) fn put(&mut self, places: &mut [Option<usize>], topic: usize, name: &str, sample: &Sample) {
        let Some(row) = sample.step.checked_sub(self.first) else { return };
        let known = places.get(topic).copied().flatten();
        let place = known.unwrap_or_else(|| {
            self.tracks.push(Track::new(name, sample.len()));
            self.tracks.len() - 1
        });
        if let Some(slot) = places.get_mut(topic) {
            *slot = Some(place);
        }
        self.rows = self.rows.max(row as usize + 1);
        if let Some(track) = self.tracks.get_mut(place) {
            track.put(row as usize, sample);
        }
    }

    /// Gives every track as many rows as there are.
    pub(crate) fn level(&mut self) {
        let rows = self.rows;
        self.tracks.iter_mut().for_each(|t| t.reach(rows));
    }

    /// Keeps the first `rows` rows, and returns those behind them.
    pub(crate) fn split_off(&mut self, rows: usize) -> Recorded {
        self.rows = self.rows.max(rows);
        self.level();
        let rest = Recorded {
            first: self.first + rows as u64,
            rows: self.rows - rows,
            tracks: self.tracks.iter_mut().map(|track| track.split_off(rows)).collect(),
            ..Recorded::default()
        };
        self.rows = rows;
        rest
    }

    /// The first `rows` rows.
    #[must_use]
    pub fn until(mut self, rows: usize) -> Recorded {
        if rows < self.rows {
            self.rows = rows;
            self.tracks.iter_mut().for_each(|t| t.reach(rows));
        }
        self
    }

    /// The rows before everything leaves all bounds: `bounds` is what a position of `topic` keeps within. What comes after is no motion of a device any
    /// more, and outweighs everything before it.
    pub fn bounded(mut self, topic: &str, bounds: f64) -> Recorded {
        let beyond = |track: &Track| track.position.iter().filter_map(|c| c.iter().position(|x| x.abs() > bounds)).min();
        let infinite = |track: &Track| {
            let columns = track.position.iter().chain(&track.effort);
            columns.filter_map(|c| c.iter().position(|x| x.is_infinite())).min()
        };
        let ends =
            self.tracks.iter().filter_map(|t| if t.topic == topic { beyond(t).into_iter().chain(infinite(t)).min() } else { infinite(t) });
        if let Some(end) = ends.min() {
            self.rows = end.max(1).min(self.rows);
            let rows = self.rows;
            self.tracks.iter_mut().for_each(|t| t.reach(rows));
        }
        self
    }

    /// The samples of a topic.
    pub fn track(&self, topic: &str) -> Option<&Track> {
        self.tracks.iter().find(|t| t.topic == topic)
    }
}

/// A quantity of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// m or rad.
    Position,
    /// N or N m.
    Effort,
}

impl Quantity {
    /// Its value on an axis; NaN where it was not measured.
    pub fn of(self, sample: &Sample, axis: usize) -> f64 {
        let values = match self {
            Quantity::Position => &sample.position,
            Quantity::Effort => &sample.effort,
        };
        values.get(axis).copied().filter(|_| axis < sample.len()).unwrap_or(f64::NAN)
    }

    /// Sets it.
    pub fn set(self, sample: &mut Sample, axis: usize, value: f64) {
        let values = match self {
            Quantity::Position => &mut sample.position,
            Quantity::Effort => &mut sample.effort,
        };
        if let Some(slot) = values.get_mut(axis) {
            *slot = value;
        }
    }
}

impl Track {
    fn new(topic: &str, axes: usize) -> Track {
        let columns = || vec![Vec::new(); axes];
        let (position, velocity, effort) = (columns(), columns(), columns());
        Track { topic: topic.to_string(), position, velocity, effort, flags: Vec::new(), came: Vec::new(), sources: Vec::new() }
    }

    fn reach(&mut self, rows: usize) {
        let columns = self.position.iter_mut().chain(&mut self.velocity).chain(&mut self.effort);
        columns.for_each(|c| c.resize(rows, f64::NAN));
        self.flags.resize(rows, 0);
        self.came.resize(rows, false);
    }

    fn split_off(&mut self, rows: usize) -> Track {
        let behind = |columns: &mut Vec<Vec<f64>>| columns.iter_mut().map(|column| column.split_off(rows)).collect();
        Track {
            topic: self.topic.clone(),
            position: behind(&mut self.position),
            velocity: behind(&mut self.velocity),
            effort: behind(&mut self.effort),
            flags: self.flags.split_off(rows),
            came: self.came.split_off(rows),
            sources: self.sources.clone(),
        }
    }

    fn put(&mut self, row: usize, sample: &Sample) {
        if self.came.len() <= row {
            self.reach(row + 1);
        }
        for axis in 0..self.position.len().min(sample.len()) {
            self.position[axis][row] = sample.position[axis];
            self.velocity[axis][row] = sample.velocity[axis];
            self.effort[axis][row] = sample.effort[axis];
        }
        self.flags[row] = sample.flags;
        self.came[row] = true;
        if !self.sources.contains(&sample.source) {
            self.sources.push(sample.source);
        }
    }

    /// Number of axes.
    pub fn axes(&self) -> usize {
        self.position.len()
    }

    /// The sample of a row; `None` where none came.
    pub fn sample(&self, row: usize) -> Option<Sample> {
        if !self.came.get(row).copied().unwrap_or(false) {
            return None;
        }
        let mut sample = Sample::new(self.axes());
        for axis in 0..sample.len() {
            sample.position[axis] = self.position[axis][row];
            sample.velocity[axis] = self.velocity[axis][row];
            sample.effort[axis] = self.effort[axis][row];
        }
        sample.flags = self.flags[row];
        Some(sample)
    }

    /// A quantity on an axis, one value per row; NaN where there is none.
    pub fn column(&self, quantity: Quantity, axis: usize) -> &[f64] {
        let columns = match quantity {
            Quantity::Position => &self.position,
            Quantity::Effort => &self.effort,
        };
        columns.get(axis).map_or(&[], Vec::as_slice)
    }
}
