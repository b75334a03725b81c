//! Records of a real teleoperator as sessions: judged at their own gains, their dead sensor reported, the law that couples their motors recovered.
//! Where the recordings are not, a message and nothing else.

#[path = "../../tests/common/skipped.rs"]
mod skipped;

use backdrive_stability::coupling::{Kind, Signals, Term, identify};
use backdrive_stability::judgement::judge_with_decay;
use backdrive_stability::outcome::Outcome;
use backdrive_stability::roles::Roles;
use backdrive_stability::session::Session;
use backdrive_stability::verdict::recorded_traces;
use backdrive_studies::data::Data;
use backdrive_studies::study_named;
use std::path::Path;

#[test]
fn one_record_of_each_gains_is_stable_and_tells_its_law() {
    let folder = match Data::find(None).folder(study_named("tue_bilateral").unwrap()) {
        Ok(folder) => folder,
        Err(error) => return skipped::skipped(error),
    };
    let roles = Roles::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tue_bilateral/roles.toml")).unwrap();
    for (file, stiffness) in [("m2_a_foam2.csv", 8.0), ("m2_b_free_motion.csv", 15.0), ("m2_c_spring.csv", 25.0)] {
        let session = Session::from_roles(&folder.join(file), &roles).unwrap();
        let dead: Vec<&str> = session.sensors.iter().map(|s| s.signal.as_str()).collect();
        assert_eq!(dead, ["master_gauge_a"], "{file}");
        let (outcome, mode) = judge_with_decay(&recorded_traces(&session)[0]);
        assert_eq!(outcome, Outcome::Stable, "{file}: {mode:?}");
        let found = identify(&Signals::of(&session, 0).unwrap()).unwrap();
        assert_eq!(found.kind, Kind::PositionError, "{file}");
        for side in [&found.master, &found.slave] {
            let terms: Vec<Term> = side.gains.iter().map(|g| g.term).collect();
            assert_eq!(terms, [Term::Position, Term::Rate], "{file}");
            let gain = side.gains[0].estimate;
            assert!((gain.value / stiffness - 1.0).abs() < 1e-3 && gain.ci95[1] - gain.ci95[0] < 0.01, "{file}: {gain:?}");
            assert!(side.unexplained < 1e-4, "{file}: {}", side.unexplained);
        }
    }
}
