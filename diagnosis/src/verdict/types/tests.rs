use super::*;
use crate::hypothesis::Place;

/// As earlier versions wrote it, without the keys that came later.
const EARLIER: &str = r#"{
  "schema": 1,
  "verdict": "missing",
  "findings": [
    { "physics": "coulomb", "between": ["drum", "ground"],
      "parameters": { "force": { "value": 0.101, "ci95": [0.098, 0.104], "unit": "N" },
                      "stiffness": { "value": [1.0, 2], "ci95": [[0.5, 1.5], [1.0, null]], "unit": "N/m" } },
      "replaces": [],
      "confidence": 0.97,
      "alternatives": [ { "physics": "delay", "signal": "force", "confidence": 0.03 } ] }
  ],
  "where": { "time": [[1.02, 1.09]], "band_hz": [20, 90], "state": "reversals of drum velocity" },
  "parameters": { "elements.cable.stiffness": { "value": 38900.0, "ci95": [38700.0, 39100.0], "nominal": 39500.0 } },
  "held_out": { "nrmse_before": 0.31, "nrmse_refit": 0.22, "nrmse_after": 0.012, "noise_floor": 0.010 },
  "model_after": "model.diagnosed.toml",
  "next_experiment": null
}"#;

#[test]
fn a_file_of_an_earlier_version_is_read() {
    let read: Verdict = serde_json::from_str(EARLIER).unwrap();
    assert_eq!((read.schema, read.word, read.audit.len(), read.remaining.is_none()), (SCHEMA, Word::Missing, 0, true));
    let finding = &read.findings[0];
    assert_eq!(finding.place, Place::Between("drum".to_string(), "ground".to_string()));
    assert_eq!(finding.alternatives[0].place, Place::Signal("force".to_string()));
    let list = Estimates { value: vec![1.0, 2.0], ci95: vec![[Some(0.5), Some(1.5)], [Some(1.0), None]], unit: "N/m".to_string() };
    assert_eq!(finding.parameters["stiffness"], Parameter::List(list));
    assert_eq!(read.parameters["elements.cable.stiffness"].moved_sd, None);
    assert_eq!(read.shows.as_ref().unwrap().class, None);
    // Its written text gives the same verdict.
    assert_eq!(serde_json::from_str::<Verdict>(&serde_json::to_string(&read).unwrap()).unwrap(), read);
}

#[test]
fn words_are_named_as_the_file_has_them() {
    let all = [Word::Missing, Word::Parameters, Word::NothingMissing, Word::Unexplained, Word::Ambiguous, Word::CannotTell];
    for word in all {
        assert_eq!(serde_json::to_value(word).unwrap(), word.name());
    }
    assert!(serde_json::from_str::<Word>("\"stable\"").is_err());
}

#[test]
fn a_class_that_is_null_stays_in_the_file() {
    for text in [r#"{"time":[[0.0,1.0]],"band_hz":[1.0,2.0],"state":null}"#, r#"{"time":[],"band_hz":[1.0,2.0],"state":null,"class":null}"#]
    {
        let read: Where = serde_json::from_str(text).unwrap();
        assert_eq!(serde_json::to_string(&read).unwrap(), text);
    }
}

#[test]
fn the_next_experiment_is_an_excitation_or_a_reason() {
    let refused = r#"{"sentence":"no excitation separates them"}"#;
    let read: NextExperiment = serde_json::from_str(refused).unwrap();
    assert_eq!((read.sentence(), read.file()), ("no excitation separates them", None));
    assert_eq!(serde_json::to_string(&read).unwrap(), refused);
    let planned = r#"{"file":"next-experiment.toml","input":"u","excitation":"sine","sentence":"Play it.","between":["a","b"],
        "separation_sd":7.1,"level_floors":2.0,"output":"y","repeats":3,"duration_s":2.0,"rate_hz":1000.0}"#;
    let read: NextExperiment = serde_json::from_str(planned).unwrap();
    assert_eq!((read.sentence(), read.file()), ("Play it.", Some("next-experiment.toml")));
    assert!(!serde_json::to_string(&read).unwrap().contains("sensor"));
    // With a sensor that has to be added.
    let text =
        planned.replace("\"rate_hz\":1000.0", "\"rate_hz\":1000.0,\"sensor\":{\"kind\":\"force\",\"element\":\"belt\",\"noise_sd\":0.01}");
    let read: NextExperiment = serde_json::from_str(&text).unwrap();
    let NextExperiment::Planned(Planned { sensor: Some(sensor), .. }) = &read else { panic!("{read:?}") };
    assert_eq!((sensor.kind.as_str(), sensor.of.as_deref(), sensor.element.as_deref()), ("force", None, Some("belt")));
    assert_eq!(serde_json::from_str::<NextExperiment>(&serde_json::to_string(&read).unwrap()).unwrap(), read);
}

#[test]
fn a_detectable_size_stands_under_its_parameters_name() {
    let text = r#"{"physics":"bias","between":["drum","ground"],"unit":"N","force":0.0123}"#;
    let read: Detectable = serde_json::from_str(text).unwrap();
    assert_eq!((read.size["force"], read.size.len()), (0.0123, 1));
    assert_eq!(serde_json::to_string(&read).unwrap(), text);
}
