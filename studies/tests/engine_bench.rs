//! Paper 003 as a whole, on one bench.

use backdrive_studies::data::Data;
use backdrive_studies::study_named;

#[test]
fn a_bench_is_identified_from_its_bags_and_validates_as_the_papers() {
    let out = tempfile::tempdir().unwrap();
    let report = study_named("engine_bench").unwrap().run(&Data::find(None), out.path(), true, 1.0).unwrap();
    println!("{}", report.text());
    assert_eq!(report.missed(), 0, "{}", report.text());
    // Unfiltered, the observer is far ahead of a derivative of noisy speeds; behind a filter that is slower than both they are about equal.
    let error = |name: &str| report.figure_named(&format!("error of {name}"));
    assert!(error("observer") < 0.4 * error("derivative"));
    assert!(error("observer and Butterworth, 5 Hz") < 1.5 * error("derivative and Butterworth, 5 Hz"));
    assert!(error("observer") < error("engine model alone"));
    let page = std::fs::read_to_string(out.path().join("engine_bench/report.html")).unwrap();
    for figure in ["Fig. 4", "Fig. 6", "Fig. 7", "Fig. 8", "Fig. 9", "Fig. 10", "Fig. 11", "Fig. 12"] {
        assert!(page.contains(figure), "{figure}");
    }
}
