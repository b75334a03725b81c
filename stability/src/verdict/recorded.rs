//! What the recording itself did.

use crate::collect::way;
use crate::judgement::judge;
use crate::outcome::{Closes, Outcome, Trace};
use crate::phases::contacts;
use crate::session::{AxisSignals, Session};
use crate::unjudged::{Gaps, Unjudged};

/// What the recording itself did: the same function as for a live run. What is missing in a recording is no run-away.
pub fn recorded_outcome(session: &Session) -> Option<Outcome> {
    let here = recorded_traces(session).into_iter().map(|trace| judge(&trace));
    let outcome = Outcome::worst(here.chain(session.elsewhere).map(|outcome| outcome.held_back(session.cut_short)))?;
    let open = session.is_one_way() && outcome.is_stable();
    Some(if open { Outcome::NotJudged { why: Unjudged::NoFeedback } } else { outcome })
}

/// What a verdict on a recording is drawn from, per axis.
pub fn recorded_traces(session: &Session) -> Vec<Trace> {
    let intents: Vec<Vec<f64>> = session.axes.iter().map(|a| a.intent.clone().unwrap_or_default()).collect();
    let way = (intents.len() > 1).then(|| way(&intents.iter().map(|x| held(x)).collect::<Vec<_>>()));
    let traced = session.axes.iter().map(|axis| {
        let stale = |row: usize| axis.stale.get(row).copied().unwrap_or(false);
        let intent = axis.intent.as_ref().filter(|x| x.iter().any(|x| x.is_finite()));
        let coupled = is_pair(axis);
        let signals = if coupled {
            [Some(&axis.master), axis.slave.as_ref(), Some(&axis.force), axis.slave_force.as_ref(), intent]
        } else {
            [Some(&axis.master), Some(&axis.contact), Some(&axis.command), intent, None]
        };
        let loops = || signals.into_iter().flatten();
        let lacks = |row: usize| stale(row) || loops().any(|c| c.get(row).is_none_or(|x| x.is_nan()));
        let touched = !contacts(axis, session.period_s).is_empty();
        Trace {
            period_s: session.period_s,
            intent: way.clone().unwrap_or_else(|| axis.intent.as_deref().map(held).unwrap_or_default()),
            position: held(&axis.master),
            contact: if touched { held(&axis.contact) } else { vec![0.0; axis.contact.len()] },
            slave: axis.slave.as_deref().map(held).unwrap_or_default(),
            mu: session.mu.iter().rev().copied().find(|mu| mu.is_finite()).unwrap_or(1.0),
            closes: if coupled { Closes::Always } else { axis.closes },
            unit: axis.unit,
            feedback: held(&axis.force),
            dither: axis.dither.clone().unwrap_or_default(),
            // A stale input opens the loop and limits nothing.
            clamped: axis.clamped.iter().enumerate().map(|(row, acted)| *acted && !stale(row)).collect(),
            travel: axis.travel,
            resolution: axis.resolution,
            noise: axis.noise,
            gaps: Gaps { at: (0..session.len()).map(lacks).collect(), bridged_s: session.bridged_s, planned: 0 },
        }
    });
    traced.collect()
}

/// Whether both motors' forces were recorded, so that the two act on each other's motion.
pub(super) fn is_pair(axis: &AxisSignals) -> bool {
    axis.slave_force.is_some() && axis.slave.is_some()
}

/// The column with what is missing in it filled by the value before it.
fn held(column: &[f64]) -> Vec<f64> {
    let mut before = column.iter().copied().find(|x| x.is_finite()).unwrap_or(0.0);
    let value = |x: &f64| {
        before = if x.is_finite() { *x } else { before };
        before
    };
    column.iter().map(value).collect()
}
