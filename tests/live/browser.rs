//! A headless browser, driven by its DevTools protocol.

use nix::sys::signal::{Signal, killpg};
use nix::unistd::Pid;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

const PROGRAMS: [&str; 4] = ["chromium-headless-shell", "chromium", "chromium-browser", "google-chrome"];

/// A browser with one page; killed when dropped.
pub struct Browser {
    child: Child,
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    asked: u64,
    errors: Vec<String>,
    _profile: tempfile::TempDir,
}

impl Browser {
    /// `None` where none is installed.
    pub fn start() -> Option<Browser> {
        let profile = tempfile::tempdir().unwrap();
        let mut child = PROGRAMS.iter().find_map(|program| {
            let mut command = Command::new(program);
            command.args(["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0", "about:blank"]);
            command.arg(format!("--user-data-dir={}", profile.path().display()));
            command.stderr(Stdio::piped()).stdout(Stdio::null()).process_group(0).spawn().ok()
        })?;
        let mut lines = BufReader::new(child.stderr.take()?);
        let address = loop {
            let mut line = String::new();
            assert!(lines.read_line(&mut line).unwrap() > 0, "the browser did not start");
            if let Some((_, url)) = line.split_once("ws://") {
                break url.split('/').next().unwrap().to_string();
            }
        };
        std::thread::spawn(move || std::io::copy(&mut lines, &mut std::io::sink()));
        let mut stream = TcpStream::connect(&address).unwrap();
        write!(stream, "GET /json HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n").unwrap();
        // The browser keeps the connection open: what it says ends with its list.
        stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        let (mut answer, mut some) = (String::new(), [0; 4096]);
        while !answer.trim_end().ends_with(']') {
            let read = stream.read(&mut some).unwrap();
            answer.push_str(&String::from_utf8_lossy(&some[..read]));
        }
        let pages: Value = serde_json::from_str(&answer[answer.find('[').unwrap()..]).unwrap();
        let (socket, _) = tungstenite::connect(pages[0]["webSocketDebuggerUrl"].as_str().unwrap()).unwrap();
        if let MaybeTlsStream::Plain(stream) = socket.get_ref() {
            stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        }
        let mut browser = Browser { child, socket, asked: 0, errors: Vec::new(), _profile: profile };
        for domain in ["Runtime", "Log", "Page"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        Some(browser)
    }

    fn call(&mut self, method: &str, params: Value) -> Value {
        self.asked += 1;
        let id = self.asked;
        self.socket.send(Message::Text(json!({ "id": id, "method": method, "params": params }).to_string().into())).unwrap();
        loop {
            let Message::Text(words) = self.socket.read().unwrap() else { continue };
            let said: Value = serde_json::from_str(&words).unwrap();
            match said["method"].as_str() {
                Some("Runtime.exceptionThrown") => self.errors.push(said["params"]["exceptionDetails"].to_string()),
                Some("Log.entryAdded") if said["params"]["entry"]["level"] == "error" => {
                    self.errors.push(said["params"]["entry"].to_string())
                }
                _ if said["id"] == id => return said["result"].clone(),
                _ => {}
            }
        }
    }

    /// Opens an address in a window of this size.
    pub fn open(&mut self, url: &str, width: u32, height: u32) {
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", size);
        self.call("Page.navigate", json!({ "url": url }));
    }

    /// The value of an expression.
    pub fn value(&mut self, expression: &str) -> Value {
        self.call("Runtime.evaluate", json!({ "expression": expression, "returnByValue": true }))["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    pub fn until(&mut self, expression: &str) {
        let until = Instant::now() + Duration::from_secs(20);
        while self.value(expression) != json!(true) {
            assert!(Instant::now() < until, "never true: {expression}; errors: {:?}", self.errors);
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// What went wrong on its pages.
    pub fn errors(&self) -> Vec<String> {
        self.errors.clone()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // The program may be a script that has started another one.
        let _ = killpg(Pid::from_raw(self.child.id() as i32), Signal::SIGKILL);
        let _ = self.child.wait();
    }
}
