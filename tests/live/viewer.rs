//! A viewer of a page, without a browser.

use serde_json::{Value, json};
use std::net::TcpStream;
use std::time::{Duration, Instant};
use tungstenite::client::IntoClientRequest;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

const PATIENCE: Duration = Duration::from_secs(20);

/// A WebSocket to a page, and what came over it.
pub struct Viewer {
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    /// Every text that came, and how far each kind was looked through.
    heard: Vec<Value>,
    frames: Vec<Vec<u8>>,
    asked: u64,
}

type Ranges = Vec<Vec<[f32; 2]>>;

impl Viewer {
    pub fn try_open(page: &str, origin: Option<&str>) -> Result<Viewer, String> {
        let mut request = page.replace("http://", "ws://").replace("/?", "/ws?").into_client_request().unwrap();
        if let Some(origin) = origin {
            request.headers_mut().insert("Origin", origin.parse().unwrap());
        }
        let (socket, _) = tungstenite::connect(request).map_err(|e| e.to_string())?;
        if let MaybeTlsStream::Plain(stream) = socket.get_ref() {
            stream.set_read_timeout(Some(PATIENCE)).unwrap();
        }
        Ok(Viewer { socket, heard: Vec::new(), frames: Vec::new(), asked: 100 })
    }

    pub fn open(page: &str) -> Viewer {
        Viewer::try_open(page, None).unwrap()
    }

    fn hear(&mut self) {
        match self.socket.read().unwrap() {
            Message::Text(words) => self.heard.push(serde_json::from_str(&words).unwrap()),
            Message::Binary(frame) => self.frames.push(frame.to_vec()),
            _ => {}
        }
    }

    /// The first text, of those that came and those that come, that is right.
    fn find(&mut self, from: usize, right: impl Fn(&Value) -> bool) -> Value {
        let (until, mut at) = (Instant::now() + PATIENCE, from);
        loop {
            if let Some(found) = self.heard[at..].iter().find(|w| right(w)) {
                return found.clone();
            }
            at = self.heard.len();
            assert!(Instant::now() < until, "not heard; last: {:?}", self.heard.last());
            self.hear();
        }
    }

    pub fn until(&mut self, kind: &str) -> Value {
        self.find(0, |w| w["type"] == kind)
    }

    pub fn state(&mut self, right: impl Fn(&Value) -> bool) {
        let from = self.heard.len();
        self.find(from, |w| w["type"] == "state" && right(w));
    }

    pub fn event(&mut self, kind: &str) {
        self.find(0, |w| w["type"] == "events" && w["events"].as_array().unwrap().iter().any(|e| e["kind"] == kind));
    }

    pub fn send(&mut self, words: Value) {
        self.socket.send(Message::Text(words.to_string().into())).unwrap();
    }

    pub fn ask(&mut self, mut words: Value) -> Value {
        self.asked += 1;
        let id = self.asked;
        words["id"] = json!(id);
        self.send(words);
        self.find(0, |w| w["type"] == "answer" && w["id"] == id)
    }

    /// Sends whatever it is; the answer to it.
    pub fn ask_any(&mut self, words: &Value) -> Value {
        let from = self.heard.len();
        self.send(words.clone());
        self.find(from, |w| w["type"] == "answer")
    }

    /// Times and ranges of all intervals that came.
    pub fn curves(&self) -> (Vec<f64>, Ranges) {
        let parts = self.frames.iter().filter(|f| f[0] == 1).map(|f| parse(f));
        parts.fold((Vec::new(), Vec::new()), |(mut t, mut r), (times, ranges)| {
            t.extend(times);
            r.extend(ranges);
            (t, r)
        })
    }

    /// The answer to a request for a range.
    pub fn range(&mut self, recording: u8, id: u64) -> (Vec<f64>, Ranges) {
        loop {
            if let Some(frame) = self.frames.iter().find(|f| f[0] == 2 && f[1] == recording && f[8..16] == id.to_le_bytes()) {
                return parse(frame);
            }
            self.hear();
        }
    }
}

/// A frame, as its documentation describes it.
fn parse(frame: &[u8]) -> (Vec<f64>, Ranges) {
    let curves = usize::from(u16::from_le_bytes([frame[2], frame[3]]));
    let rows = frame[16..].chunks_exact(8 + 8 * curves);
    let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    rows.map(|row| {
        let time = f64::from_le_bytes(row[..8].try_into().unwrap());
        (time, row[8..].chunks_exact(8).map(|r| [number(r), number(&r[4..])]).collect::<Vec<_>>())
    })
    .unzip()
}
