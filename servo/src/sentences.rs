//! A diagnosis of servo joints in words.

use crate::physics::named;
use backdrive_diagnosis::verdict::{Finding, ServoPart, Word};

/// An effect in words.
pub fn words(physics: &str) -> String {
    named(physics).map_or_else(|| backdrive_diagnosis::verdict::words::physics(physics), |p| p.words.to_string())
}

/// The joint of a finding.
pub fn joint_of(finding: &Finding) -> &str {
    use backdrive_diagnosis::hypothesis::Place;
    match &finding.place {
        Place::Between(joint, _) => joint,
        Place::Signal(signal) => signal.rsplit_once('.').map_or(signal, |(joint, _)| joint),
    }
}

/// The verdict in one sentence.
pub(crate) fn sentence(word: Word, findings: &[Finding], servo: &ServoPart) -> String {
    let of = |joint: &str| {
        let all: Vec<String> = findings.iter().filter(|f| joint_of(f) == joint && f.confidence >= 0.5).map(|f| words(&f.physics)).collect();
        (!all.is_empty()).then(|| format!("{} at the {joint}", all.join(", ")))
    };
    let joints: Vec<String> = servo.joints.iter().filter_map(|j| of(&j.joint)).collect();
    match word {
        Word::CannotTell => "the search ended before it found what delay, second order and offset do not explain".to_string(),
        Word::NothingMissing => "delay, second order and offset explain the response of every joint to its commands".to_string(),
        Word::Unexplained => {
            "delay, second order and offset do not explain the response of the joints, and no known effect explains more".to_string()
        }
        _ if joints.is_empty() => {
            "an effect beyond delay, second order and offset is present, but these recordings do not show which one".to_string()
        }
        _ => format!("delay, second order and offset leave out {}", joints.join("; ")),
    }
}
