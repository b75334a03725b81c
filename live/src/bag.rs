//! The window on recordings: one bag, or two over each other.

use crate::access::Role;
use crate::channels::Channels;
use crate::decimate::Range;
use crate::error::LiveError;
use crate::frames;
use crate::hub::{Hub, Past, text};
use crate::picture::{Picture, Shown};
use crate::scene::Scene;
use crate::serve::{Desk, Reply, Server};
use axum::extract::ws::Message as Frame;
use backdrive_bags::Reader;
use backdrive_msgs::Message;
use backdrive_nodes::graph::Overrides;
use backdrive_stability::summary::graph_of;
use serde_json::{Value, json};
use std::collections::HashMap;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tokio::sync::broadcast;

/// Most intervals of one answer.
const MOST_INTERVALS: u64 = 20_000;

/// Most recordings at once.
const MOST_BAGS: usize = 2;

/// A curve of a recording: steps that rise, and values.
#[derive(Default)]
struct Curve {
    steps: Vec<u32>,
    values: Vec<f32>,
}

/// A recording in memory.
struct Recording {
    rate_hz: f64,
    curves: Vec<Curve>,
}

/// A window on recordings, while it exists.
pub struct Window {
    server: Server,
}

struct BagDesk {
    hub: Arc<Hub<Headers>>,
    recordings: Vec<Recording>,
}

/// What a viewer is sent first.
struct Headers(Value);

impl Past for Headers {
    fn frames(&self) -> Vec<Frame> {
        vec![text(&self.0)]
    }
}

impl Window {
    /// Opens a window on one or two bags.
    ///
    /// # Errors
    /// A bag cannot be read or is not that of a run, there are more than two, or the address cannot be had.
    pub fn open(bags: &[&Path], address: SocketAddr) -> Result<Window, LiveError> {
        if bags.is_empty() || bags.len() > MOST_BAGS {
            return Err(LiveError::input(format!("{} bags are named; one is shown, or two over each other", bags.len())));
        }
        let (recordings, headers): (Vec<_>, Vec<_>) = bags.iter().map(|bag| read(bag)).collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        let title = headers.iter().filter_map(|header| header["name"].as_str()).collect::<Vec<_>>().join(" and ");
        let hub = Hub::new(Headers(json!({ "type": "hello", "mode": "bag", "title": title, "recordings": headers })));
        let server = Server::start(Arc::new(BagDesk { hub, recordings }), address)?;
        Ok(Window { server })
    }

    /// Address of the page.
    pub fn url(&self) -> String {
        let [_, watch] = self.server.urls();
        watch
    }

    /// Waits until `stop` is true.
    pub fn wait(&self, stop: &AtomicBool) {
        while !stop.load(Ordering::SeqCst) {
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

/// Reads a bag: its curves, and what a viewer is sent of it.
fn read(path: &Path) -> Result<(Recording, Value), LiveError> {
    let reader = Reader::open_begun(path).map_err(LiveError::input)?;
    let graph = graph_of(&reader, &Overrides::default()).map_err(LiveError::input)?;
    let (scene, mut channels, rate_hz) = (Scene::of(&graph), Channels::of(&graph), graph.timing.rate_hz);
    let places: HashMap<String, usize> = channels.topics().iter().enumerate().map(|(i, t)| (t.topic.name.clone(), i)).collect();
    let mut picture = Picture::of(&scene, rate_hz, channels.topics().len());
    let (mut curves, mut events, mut last): (Vec<Curve>, Vec<Shown>, u32) = (Vec::new(), Vec::new(), 0);
    for entry in reader.messages().map_err(LiveError::input)? {
        let entry = entry.map_err(LiveError::input)?;
        let Some(&index) = places.get(&entry.topic.name) else { continue };
        let Some(message) = entry.message(path).map_err(LiveError::input)? else { continue };
        events.extend(channels.topics().get(index).and_then(|topic| picture.take(index, topic, &message)));
        if let Message::Sample(sample) = &message
            && let Ok(step) = u32::try_from(sample.step)
        {
            last = last.max(step);
            channels.each(index, sample, |curve, value| {
                let curve = usize::from(curve);
                if curves.len() <= curve {
                    curves.resize_with(curve + 1, Curve::default);
                }
                // A sample that came after a later one has no place in a curve.
                if curves[curve].steps.last().is_none_or(|before| *before < step) {
                    curves[curve].steps.push(step);
                    curves[curve].values.push(value as f32);
                }
            });
        }
    }
    let name = path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned());
    let header = json!({
        "name": name,
        "title": graph.title,
        "rate_hz": rate_hz,
        "duration_s": f64::from(last) / rate_hz,
        "scene": scene,
        "channels": channels.known(),
        "events": events,
    });
    Ok((Recording { rate_hz, curves }, header))
}

impl Recording {
    /// Least and greatest value of every curve in `intervals` equal parts of the time from `from` to `to`, s, as a frame.
    fn range(&self, number: u8, from: f64, to: f64, intervals: u64, request: u64) -> Vec<u8> {
        let width = (to - from) / intervals as f64;
        let curves = self.curves.len();
        let mut ranges: Vec<Vec<Range>> = vec![vec![[f32::NAN; 2]; curves]; intervals as usize];
        for (place, curve) in self.curves.iter().enumerate() {
            let first = curve.steps.partition_point(|step| f64::from(*step) / self.rate_hz < from);
            for (step, value) in curve.steps[first..].iter().zip(&curve.values[first..]) {
                // Rounding must not put a sample that begins a part into the one before.
                let at = ((f64::from(*step) / self.rate_hz - from) / width + 1e-9) as usize;
                let Some(row) = ranges.get_mut(at) else { break };
                let range = &mut row[place];
                *range = [range[0].min(*value), range[1].max(*value)];
            }
        }
        // Finer than the samples, most intervals are empty: they are left out, and lines join the others.
        let filled: Vec<(usize, &Vec<Range>)> = ranges.iter().enumerate().filter(|(_, row)| row.iter().any(|r| !r[0].is_nan())).collect();
        let mut frame = frames::header(frames::ASKED, number, curves, filled.len(), request);
        for (at, row) in filled {
            frames::row(&mut frame, from + at as f64 * width, row, curves);
        }
        frame
    }
}

impl Desk for BagDesk {
    fn join(&self) -> (Vec<Frame>, broadcast::Receiver<Frame>) {
        self.hub.join()
    }

    fn answer(&self, asked: &Value, _: Role, _: &str) -> Reply {
        let refuse = |text: &str| Reply::Words(json!({ "done": false, "text": text }));
        if asked.get("do").and_then(Value::as_str) != Some("range") {
            return refuse("a recording can be looked at only: `do` must be range");
        }
        let number = |key: &str| asked.get(key).and_then(Value::as_f64);
        let whole = |key: &str| asked.get(key).and_then(Value::as_u64);
        let (Some(from), Some(to), Some(intervals), Some(request)) = (number("from"), number("to"), whole("intervals"), whole("id")) else {
            return refuse("a range needs from, to (s), intervals and id");
        };
        let place = whole("recording").unwrap_or(0);
        let Some(recording) = usize::try_from(place).ok().and_then(|p| self.recordings.get(p)) else {
            return refuse("there is no recording of this number");
        };
        if !(from.is_finite() && to.is_finite() && to > from && (1..=MOST_INTERVALS).contains(&intervals)) {
            return refuse("a range must end after it begins, and has 1 to 20000 intervals");
        }
        Reply::Frame(Frame::Binary(recording.range(place as u8, from, to, intervals, request).into()))
    }

    fn refused(&self, _: &str, _: &str) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_has_the_extremes_of_its_parts() {
        let steps: Vec<u32> = (0..1000).collect();
        let values = steps.iter().map(|s| *s as f32).collect();
        let recording = Recording { rate_hz: 1000.0, curves: vec![Curve { steps, values }] };
        let frame = recording.range(1, 0.5, 1.0, 5, 77);
        let header: Vec<u8> = frames::header(frames::ASKED, 1, 1, 5, 77);
        assert_eq!(frame[..16], header);
        let row = |i: usize| &frame[16 + 16 * i..][..16];
        let range = |i: usize| [&row(i)[8..12], &row(i)[12..]].map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        assert_eq!([range(0), range(4)], [[500.0, 599.0], [900.0, 999.0]]);
        assert_eq!(frame.len(), 16 + 5 * 16);
        // Beyond the recording there is nothing.
        assert_eq!(recording.range(0, 5.0, 6.0, 5, 1).len(), 16);
    }
}
