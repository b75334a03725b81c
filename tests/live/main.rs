//! The window on a run: its page, what may be changed from it and by whom, and what the bag keeps of that.

mod browser;
mod cost;
mod shaking;
mod viewer;

use backdrive_bags::Reader;
use backdrive_msgs::Message;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use viewer::Viewer;

const FOLDER: &str = env!("CARGO_MANIFEST_DIR");

/// A run that is watched; killed when dropped.
struct Run {
    child: Child,
    stderr: BufReader<std::process::ChildStderr>,
    /// To change something, and to watch.
    pub pages: [String; 2],
    pub lines: Vec<String>,
    _temp: tempfile::TempDir,
    pub bag: PathBuf,
}

impl Run {
    /// Starts a graph in real time, with a page if it is to be shown.
    fn start(graph: &str, more: &[&str], shown: bool) -> Run {
        let temp = tempfile::tempdir().unwrap();
        let bag = temp.path().join("run.mcap");
        let mut command = Command::new(env!("CARGO_BIN_EXE_backdrive"));
        command
            .current_dir(FOLDER)
            .args(["run", graph, "--clock", "realtime", "--json"])
            .args(shown.then_some("--live"))
            .arg("--bag")
            .arg(&bag)
            .args(more);
        let mut child = command.env("TMPDIR", temp.path()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut run = Run {
            stderr: BufReader::new(child.stderr.take().unwrap()),
            child,
            pages: Default::default(),
            lines: Vec::new(),
            _temp: temp,
            bag,
        };
        if !shown {
            return run;
        }
        let control = run.line_with("page ");
        let watch = run.line_with("to watch ");
        run.pages = [control, watch].map(|line| line.split_whitespace().last().unwrap().to_string());
        run
    }

    fn line_with(&mut self, words: &str) -> String {
        loop {
            let mut line = String::new();
            assert!(self.stderr.read_line(&mut line).unwrap() > 0, "no `{words}` in {:#?}", self.lines);
            self.lines.push(line.clone());
            if line.contains(words) {
                return line;
            }
        }
    }

    /// Waits for the end: exit code, and the result.
    fn end(mut self) -> (Option<i32>, Value, PathBuf, tempfile::TempDir) {
        let (mut out, mut rest) = (String::new(), String::new());
        self.stderr.read_to_string(&mut rest).unwrap();
        self.child.stdout.take().unwrap().read_to_string(&mut out).unwrap();
        let code = self.child.wait().unwrap().code();
        let result = serde_json::from_str(&out).unwrap_or_else(|e| panic!("{e}: {out}\n{rest}"));
        let temp = std::mem::replace(&mut self._temp, tempfile::tempdir().unwrap());
        (code, result, self.bag.clone(), temp)
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The status of an answer to a plain request.
fn status(page: &str, host: Option<&str>, headers: &str, path: &str) -> u32 {
    let address = page.strip_prefix("http://").unwrap().split('/').next().unwrap();
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n{headers}\r\n", host.unwrap_or(address)).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer.split_whitespace().nth(1).unwrap_or("0").parse().unwrap()
}

/// Events of a bag: kind and text; and the force scales in force.
fn told(bag: &Path) -> (Vec<(String, String)>, Vec<f64>) {
    let reader = Reader::open(bag).unwrap();
    let (mut events, mut lambda) = (Vec::new(), Vec::new());
    for entry in reader.messages().unwrap() {
        match entry.unwrap().message(bag).unwrap() {
            Some(Message::Event(event)) => events.push((event.kind.as_str().to_string(), event.text.as_str().to_string())),
            Some(Message::Gains(gains)) => lambda.push(gains.lambda),
            _ => {}
        }
    }
    (events, lambda)
}

#[test]
fn a_viewer_sees_and_changes_a_run_others_may_not_and_the_bag_has_it_all() {
    let run = Run::start("launch/contact.toml", &["--rate", "1000", "--duration", "60"], true);
    let [control, watch] = run.pages.clone();
    let path = &control[control.rfind('/').unwrap()..];
    // Who has no token, a wrong one, or comes from another site.
    let none = format!("/?token={}", "0".repeat(32));
    assert_eq!(status(&control, None, "", path), 200);
    for (host, headers, path) in
        [(None, "", "/"), (None, "", none.as_str()), (Some("evil.example:80"), "", path), (None, "Origin: http://evil.example\r\n", path)]
    {
        assert_eq!(status(&control, host, headers, path), 403, "{host:?} {headers} {path}");
    }
    assert!(Viewer::try_open(&control, Some("http://evil.example")).is_err());
    assert!(Viewer::try_open(&control.replace("token=", "token=0"), None).is_err());

    let mut first = Viewer::open(&control);
    assert_eq!(first.until("role")["control"], json!(true));
    let hello = first.until("hello");
    assert_eq!(hello["mode"], json!("run"));
    let most = hello["bounds"]["most_lambda"].as_f64().unwrap();
    assert_eq!(most, 0.3, "no guard: no higher than the graph file");
    assert_eq!(hello["scene"]["devices"][1]["axes"][0]["walls"], json!([0.005]));
    let mut second = Viewer::open(&watch);
    assert_eq!(second.until("role")["control"], json!(false));

    // Gains: within the bounds, by a ramp.
    first.state(|s| s["lambda"] == json!(0.3));
    let refused = first.ask(json!({ "do": "gain", "lambda": 3.0 }));
    assert!(refused["done"] == json!(false) && refused["text"].as_str().unwrap().contains("between 0 and 0.3"), "{refused}");
    assert_eq!(first.ask(json!({ "do": "gain", "lambda": 0.1 }))["done"], json!(true));
    first.state(|s| s["lambda"] == json!(0.1));
    let refused = second.ask(json!({ "do": "stop" }));
    assert!(refused["done"] == json!(false), "{refused}");
    // The canceller.
    first.state(|s| s["canceller"] == json!(true));
    assert_eq!(first.ask(json!({ "do": "canceller", "on": false }))["done"], json!(true));
    first.state(|s| s["canceller"] == json!(false));
    // A remark reaches everybody, and one that is too long is refused.
    assert_eq!(first.ask(json!({ "do": "remark", "text": "here the wall is touched" }))["done"], json!(true));
    second.event("live_remark");
    assert_eq!(first.ask(json!({ "do": "remark", "text": "x".repeat(200) }))["done"], json!(false));
    for wrong in [json!({ "do": "what" }), json!({}), json!({ "do": "gain", "lambda": "high" }), json!([1])] {
        assert_eq!(first.ask_any(&wrong)["done"], json!(false), "{wrong}");
    }
    // One who comes later, or reloads, is shown the past.
    let mut third = Viewer::open(&control);
    third.until("state");
    let (times, _) = third.curves();
    assert!(times.first().is_some_and(|t| *t < 0.1) && times.len() > 30, "{:?}", times.first());
    third.event("live_remark");

    assert_eq!(first.ask(json!({ "do": "stop" }))["done"], json!(true));
    assert!(second.until("end")["text"].as_str().unwrap().contains("page"));
    let (code, result, bag, _temp) = run.end();
    assert_eq!(code, Some(130));
    assert_eq!(result["lost"], json!(0));
    let (events, lambda) = told(&bag);
    let has = |kind: &str, words: &str| events.iter().any(|(k, t)| k == kind && t.contains(words));
    assert!(has("live_remark", "here the wall is touched"), "{events:?}");
    assert!(has("live_gains", "lambda to 0.1") && has("live_canceller", "off") && has("canceller_switched_off", ""), "{events:?}");
    assert!(has("live_refused", "look only") && has("live_refused", "token") && has("live_stop", "stops the run"), "{events:?}");
    // The force was gone before the end.
    assert_eq!(lambda.last(), Some(&0.0));
}

#[test]
fn a_run_in_progress_gets_a_window_and_recordings_are_shown_over_each_other() {
    let run = Run::start("launch/contact.toml", &["--rate", "1000", "--duration", "4"], true);
    let temp = run.bag.parent().unwrap().to_path_buf();
    let serve = |words: &[&str]| {
        let mut child = Command::new(env!("CARGO_BIN_EXE_backdrive"))
            .arg("live")
            .args(words)
            .env("TMPDIR", &temp)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        (child, line.split_whitespace().last().unwrap_or_default().to_string())
    };
    let (mut child, page) = serve(&[]);
    let mut viewer = Viewer::open(&page);
    viewer.until("hello");
    assert_eq!(viewer.ask(json!({ "do": "remark", "text": "from outside" }))["done"], json!(true));
    viewer.event("live_remark");
    viewer.until("end");
    assert!(child.wait().unwrap().success());
    let (code, _, bag, _temp) = run.end();
    assert!(matches!(code, Some(0 | 7)), "{code:?}");
    assert!(told(&bag).0.iter().any(|(_, text)| text == "from outside"));

    let bag = bag.to_str().unwrap();
    let (mut child, page) = serve(&[bag, bag]);
    let mut viewer = Viewer::open(&page);
    let hello = viewer.until("hello");
    assert_eq!(hello["recordings"].as_array().unwrap().len(), 2);
    let channels = hello["recordings"][1]["channels"].as_array().unwrap();
    let force = channels.iter().position(|c| c["topic"] == json!("/slave/measured_js") && c["quantity"] == json!("effort")).unwrap();
    viewer.send(json!({ "id": 9, "do": "range", "recording": 1, "from": 0.0, "to": 4.0, "intervals": 400 }));
    let (times, ranges) = viewer.range(1, 9);
    assert!(times.len() > 390 && times.windows(2).all(|w| w[1] > w[0]));
    // The wall pushes back, and only while the hand is there.
    let least = |from: f64, to: f64| {
        times.iter().zip(&ranges).filter(|(t, _)| (from..to).contains(*t)).map(|(_, r)| r[force][0]).fold(0.0, f32::min)
    };
    assert!(least(0.0, 0.7) > -1e-3 && least(1.5, 2.5) < -0.3, "{} {}", least(0.0, 0.7), least(1.5, 2.5));
    assert_eq!(viewer.ask(json!({ "do": "stop" }))["done"], json!(false));
    let _ = child.kill();
    let _ = child.wait();
}

#[test]
fn the_page_is_driven_in_a_browser() {
    let Some(mut browser) = browser::Browser::start() else {
        eprintln!("skipped: no chromium-headless-shell, chromium or google-chrome is installed");
        return;
    };
    let run = Run::start("launch/contact.toml", &["--rate", "1000", "--duration", "60"], true);
    browser.open(&run.pages[0], 420, 1600);
    browser.until("document.querySelectorAll('.chart canvas').length >= 2 && !document.getElementById('stop').disabled");
    // Nothing is wider than a narrow screen.
    assert_eq!(browser.value("document.documentElement.scrollWidth"), json!(420));
    browser.value("$('lambdaText').value = '0.15'; $('set').click()");
    browser.until("state.lambda === 0.15");
    browser.value("$('canceller').click()");
    browser.until("state.canceller === false");
    browser.value("$('remark').value = '<b>touch</b>'; $('addRemark').click()");
    browser.until("[...document.querySelectorAll('#events li')].some((e) => e.textContent.includes('<b>touch</b>'))");
    // Reloaded, it has its past again.
    browser.open(&run.pages[0], 1280, 900);
    browser.until("document.querySelectorAll('#events li').length >= 3 && recordings[0].store.t[0] < 0.1");
    assert_eq!(browser.errors(), Vec::<String>::new());
    browser.value("$('stop').click()");
    browser.until("ended && !$('banner').hidden");
    let (code, _, bag, _temp) = run.end();
    assert_eq!(code, Some(130));
    assert!(told(&bag).0.iter().any(|(kind, text)| kind == "live_remark" && text == "<b>touch</b>"));
}
