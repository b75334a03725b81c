//! Scores of answers beside what was hidden.

use crate::NEVER;
use crate::draw::{Case, hand_of};
use backdrive_stability::resimulate::{Gain, RunOptions};
use backdrive_why::answer::Answer;
use backdrive_why::cause_kind::CauseKind;
use backdrive_why::change::Change;
use backdrive_why::remedy::is_fine;

#[derive(Default)]
pub struct Scores {
    asked: usize,
    pairs: usize,
    both: usize,
    named: usize,
    stopped: usize,
    edges: usize,
    near: usize,
    nulls: usize,
    alarms: usize,
    boldly: usize,
    seconds: Vec<f64>,
}

impl Scores {
    pub fn add(&mut self, index: usize, case: &Case, answer: &Answer, seconds: f64) {
        self.seconds.push(seconds);
        let kind = case.kind;
        let first = answer.causes.first();
        if kind == "nothing" {
            self.nulls += 1;
            let alarm = answer.happening.is_trouble() || !answer.differs.is_empty();
            self.alarms += usize::from(alarm);
            println!(
                "{index:3} {kind:<16} {} {seconds:.1} s: {}; {:?}",
                if alarm { "ALARM" } else { "ok   " },
                answer.happens,
                answer.differs
            );
            return;
        }
        self.asked += 1;
        let named = first.is_some_and(|c| case.right.iter().any(|right| right.contains(&c.kind)));
        if case.right.len() > 1 {
            // Both have to be among the first three, by what they are.
            let has = |right: &&'static [CauseKind]| answer.causes.iter().take(3).any(|c| right.contains(&c.kind));
            let both = case.right.iter().all(has);
            self.pairs += 1;
            self.both += usize::from(both);
        }
        self.named += usize::from(named);
        self.boldly += usize::from(!named && first.is_some_and(|c| c.confidence >= 0.8 && c.kind != CauseKind::Unknown));
        let hand = hand_of(&case.truth.graph);
        let own = Gain { mu: case.truth.graph.gains.mu, lambda: case.truth.graph.gains.lambda };
        // What can be done to the real loop: a hidden plant takes no damper, and its friction is not this program's.
        let doable = |_: &Change| true;
        let remedy = answer.remedies.iter().find(|r| r.stops && r.changes.iter().all(doable));
        let stopped = remedy.is_some_and(|remedy| {
            let mut again = case.truth.clone();
            remedy.changes.iter().for_each(|c| c.apply(&mut again));
            let lambda = again.graph.gains.lambda;
            again
                .run(&hand, Gain { lambda, ..own }, &RunOptions::default(), &NEVER)
                .is_ok_and(|run| is_fine(&again, &hand, Gain { lambda, ..own }, &run, &NEVER).unwrap_or(false))
        });
        self.stopped += usize::from(stopped);
        let mut unlimited = case.truth.clone();
        if answer.beneath.is_some() {
            Change::NoLimits.apply(&mut unlimited);
        }
        let edge = unlimited.edge(&hand, own.product(), &NEVER).ok().and_then(|e| e.critical_gain);
        let near = match (edge, answer.edge) {
            (Some(a), Some(b)) => (a / b - 1.0).abs() < 0.1,
            (None, None) => true,
            _ => false,
        };
        self.edges += 1;
        self.near += usize::from(near);
        let mark = |good: bool| if good { "ok " } else { "NOT" };
        println!(
            "{index:3} {kind:<16} cause {} ({}) remedy {} edge {} {seconds:.1} s: {} | {} | said {:?} {:.2} {} | remedy {} | edge {:?} said {:?} | again {} {:?}",
            mark(named),
            answer.causes.iter().take(3).map(|c| format!("{:?} {:.2}", c.kind, c.confidence)).collect::<Vec<_>>().join(", "),
            mark(stopped),
            mark(near),
            case.how,
            answer.happens,
            first.map(|c| c.kind),
            first.map_or(0.0, |c| c.confidence),
            first.map_or("", |c| c.evidence.as_str()),
            remedy.map_or("none", |r| r.text.as_str()),
            edge,
            answer.edge,
            answer.reproduced,
            answer.differs,
        );
    }

    pub fn tell(&mut self) {
        let share =
            |a: usize, b: usize| if b == 0 { String::from("-") } else { format!("{a} of {b} ({:.0} %)", 100.0 * a as f64 / b as f64) };
        self.seconds.sort_by(f64::total_cmp);
        println!("cause named            {}", share(self.named, self.asked));
        println!("both of two named      {}", share(self.both, self.pairs));
        println!("first remedy stops it  {}", share(self.stopped, self.asked));
        println!("edge within 10 %       {}", share(self.near, self.edges));
        println!("false alarms           {}", share(self.alarms, self.nulls));
        println!("boldly wrong           {}", share(self.boldly, self.asked));
        println!(
            "seconds, median, most  {:.1} {:.1}",
            self.seconds.get(self.seconds.len() / 2).unwrap_or(&0.0),
            self.seconds.last().unwrap_or(&0.0)
        );
    }
}
