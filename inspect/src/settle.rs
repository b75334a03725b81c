//! Findings beside each other: a consequence of another finding is not reported twice.

use crate::finding::{Finding, FindingKind, Weight};
use crate::recording::Recording;
use crate::response::{RateLimit, Response};

/// A limit of speed as a finding.
pub fn limited(recording: &Recording, response: &Response, limit: &RateLimit) -> Finding {
    let [from, to] = limit.rows;
    let times = [from as f64 * recording.period, to as f64 * recording.period];
    let message = format!(
        "the speed of {:?} does not exceed {:.4} per s while {:?} moves on: {:.0} % of the time that it lags is spent at this speed",
        response.position,
        limit.speed,
        response.command,
        100.0 * limit.share
    );
    let mut finding =
        Finding::new(FindingKind::RateLimit, &recording.file, &[&response.position, &response.command], message).at(&response.joint);
    finding.time_s = Some(times);
    finding.todo("command slower motion, or state the limit in the model of the drive: a linear model is not valid there").sure(0.9)
}

/// Removes what another finding explains.
pub fn settled(mut findings: Vec<Finding>) -> Vec<Finding> {
    let is = |finding: &Finding, kind: FindingKind| finding.kind == kind && finding.weight == Weight::Wrong;
    let exchanged: Vec<String> = findings.iter().filter(|f| is(f, FindingKind::JointsExchanged)).flat_map(|f| f.signals.clone()).collect();
    let touches = |finding: &Finding, signals: &[String]| finding.signals.iter().any(|signal| signals.contains(signal));
    // Between exchanged joints nothing else goes together.
    findings.retain(|f| f.kind == FindingKind::JointsExchanged || exchanged.is_empty() || !(is_pair(f.kind) && touches(f, &exchanged)));
    // Columns that are exchanged are late, scaled and no derivatives of each other.
    let swapped: Vec<String> = findings.iter().filter(|f| is(f, FindingKind::SwappedColumns)).flat_map(|f| f.signals.clone()).collect();
    findings.retain(|f| f.kind == FindingKind::SwappedColumns || swapped.is_empty() || !(is_pair(f.kind) && touches(f, &swapped)));
    // A position against its command is also against its velocity and its torque; the same holds for its unit and its scale.
    for kind in [FindingKind::WrongSign, FindingKind::WrongUnit, FindingKind::WrongScale] {
        let of_position: Vec<String> = findings.iter().filter(|f| is(f, kind)).filter_map(|f| f.signals.first().cloned()).collect();
        let mut kept: Vec<Finding> = Vec::new();
        for finding in findings {
            let repeats = finding.kind == kind
                && kept.iter().any(|other| other.kind == kind && other.joint == finding.joint && touches(&finding, &other.signals))
                && finding.signals.last().is_some_and(|last| of_position.contains(last));
            if !repeats {
                kept.push(finding);
            }
        }
        findings = kept;
    }
    // Without its sign, a drive is no evidence of lag; nor is one that is stuck or white.
    let dead: Vec<String> = findings
        .iter()
        .filter(|f| is(f, FindingKind::Rectified) || is(f, FindingKind::Stuck) || is(f, FindingKind::Passive))
        .filter_map(|f| f.signals.first().cloned())
        .collect();
    findings.retain(|f| {
        !(matches!(f.kind, FindingKind::EffortLag | FindingKind::NotTheDerivative) && f.signals.first().is_some_and(|s| dead.contains(s)))
    });
    // Rows behind a time that goes back belong to another stretch of time.
    if findings.iter().any(|f| is(f, FindingKind::TimeGoesBack)) {
        findings.retain(|f| !is_pair(f.kind));
    }
    // Behind a stretch that was written twice signals jump.
    if findings.iter().any(|f| is(f, FindingKind::Repeated)) {
        findings.retain(|f| f.kind != FindingKind::Frozen);
    }
    // A command in another unit than its position seems to stand still beside it.
    let in_other: Vec<Option<String>> = findings.iter().filter(|f| is(f, FindingKind::WrongUnit)).map(|f| f.joint.clone()).collect();
    findings.retain(|f| !(f.kind == FindingKind::Passive && in_other.contains(&f.joint)));
    // A signal that is broken by itself is no evidence beside others until it is corrected.
    let broken: Vec<String> =
        findings.iter().filter(|f| f.weight == Weight::Wrong && is_broken(f.kind)).flat_map(|f| f.signals.clone()).collect();
    findings.retain(|f| !(is_pair(f.kind) && f.kind != FindingKind::Passive && touches(f, &broken)));
    findings
}

/// Whether a signal with such a finding is not what was measured.
fn is_broken(kind: FindingKind) -> bool {
    matches!(kind, FindingKind::Frozen | FindingKind::Quantised | FindingKind::Clipped | FindingKind::Stuck | FindingKind::Repeated)
}

fn is_pair(kind: FindingKind) -> bool {
    matches!(
        kind,
        FindingKind::WrongSign
            | FindingKind::WrongScale
            | FindingKind::WrongUnit
            | FindingKind::VelocityLag
            | FindingKind::NotTheDerivative
            | FindingKind::EffortLag
            | FindingKind::Passive
            | FindingKind::RateLimit
            | FindingKind::SwappedColumns
    )
}

/// Zeros that are shifted because the position has another sign, unit or scale are no zeros.
pub fn without_scaled(shifted: Vec<Finding>, findings: &[Finding]) -> Vec<Finding> {
    let is_other = |f: &Finding| is_pair(f.kind) || f.kind == FindingKind::JointsExchanged || f.kind == FindingKind::Stuck;
    let explains = |shift: &Finding| {
        findings.iter().any(|f| {
            f.weight == Weight::Wrong && f.file == shift.file && is_other(f) && shift.signals.iter().any(|s| f.signals.contains(s))
        })
    };
    shifted.into_iter().filter(|shift| !explains(shift)).collect()
}
