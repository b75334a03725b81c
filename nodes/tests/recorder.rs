//! A real-time recorder records when every message arrived, in that order, however rarely it polls.

mod common;

use backdrive_bags::Completeness;
use backdrive_msgs::{LAYOUT, Message, Sample};
use backdrive_nodes::clock::{Start, now_ns};
use backdrive_nodes::recorder::{RecorderPlan, RunningRecorder, Sink};
use backdrive_nodes::runner::RunError;
use backdrive_nodes::stage::Clock;
use backdrive_nodes::transport::Transport;
use backdrive_nodes::transport::inproc::Hub;
use common::{timing, topic};
use std::sync::{Arc, Mutex};
use std::time::Duration;

const STEPS: u64 = 300;

/// Topic, step, time of arrival, stamp.
type Told = Arc<Mutex<Vec<(usize, u64, i64, i64)>>>;

struct Keeping(Told);

impl Sink for Keeping {
    fn push(&mut self, topic: usize, message: Message, receive_ns: i64) -> Result<(), RunError> {
        self.0.lock().unwrap().push((topic, message.step(), receive_ns, message.stamp_ns()));
        Ok(())
    }

    fn health(&self) -> (u64, u64, u64) {
        (0, 0, 0)
    }

    fn finish(self: Box<Self>) -> Result<Completeness, RunError> {
        Ok(Completeness::default())
    }
}

#[test]
fn each_message_has_the_time_at_which_it_arrived() {
    let hub = Hub::default();
    let topics = vec![topic("/a/measured_js"), topic("/b/measured_js")];
    let plan = RecorderPlan { name: "recorder".into(), topics: topics.clone(), credit: None, by_wall_clock: false };
    let told = Told::default();
    let timing = timing(Clock::Realtime, 1000.0, Some(STEPS));
    let mut recording = RunningRecorder::new(&plan, &timing, Box::new(hub.join()), Box::new(Keeping(Arc::clone(&told)))).unwrap();
    // Another day than that of the machine's clock, which must not matter.
    let start = Start { t0_ns: now_ns(), unix_ns: 1_000_000_000_000_000_000 };
    let sent = std::thread::scope(|scope| {
        let speaker = scope.spawn(|| {
            let mut transport = hub.join();
            let mut publishers: Vec<_> = topics.iter().map(|topic| transport.publisher(topic, 1).unwrap()).collect();
            let mut sent = Vec::new();
            for step in 0..STEPS {
                for publisher in &mut publishers {
                    let stamp_ns = start.unix_at(now_ns());
                    let sample = Sample { layout: LAYOUT, step, sequence: step, stamp_ns, ..Sample::new(1) };
                    publisher.send(&Message::Sample(sample)).unwrap();
                    sent.push((stamp_ns, start.unix_at(now_ns())));
                }
                std::thread::sleep(Duration::from_micros(500));
            }
            sent
        });
        recording.run(start, Some(STEPS), || false, &mut |_| {}).unwrap();
        speaker.join().unwrap()
    });
    recording.finish().unwrap();
    let told = told.lock().unwrap();
    // The order in which they were sent, over both topics.
    let order: Vec<(usize, u64)> = told.iter().map(|(topic, step, ..)| (*topic, *step)).collect();
    assert_eq!(order, (0..STEPS).flat_map(|step| [(0, step), (1, step)]).collect::<Vec<_>>());
    for ((_, step, arrived, stamp), (from, to)) in told.iter().zip(sent) {
        assert_eq!(*stamp, from);
        assert!((from..=to).contains(arrived), "step {step}: sent from {from} to {to}, told as {arrived}");
    }
}
