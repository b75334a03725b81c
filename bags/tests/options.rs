//! Options of imports and exports that contradict each other, and recordings in memory.

use backdrive_bags::{
    BagError, ColumnMap, Contract, Export, ExportFormat, Import, ImportOptions, PlannedExport, Quantity, Reader, TableFormat, frame_of,
    import_frame,
};
use backdrive_plant::recording::Frame;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("a.csv", "t,x\n0,1\n0.1,2\n"), ("b.csv", "t,x\n0,3\n0.1,4\n")] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    std::fs::create_dir(folder.path().join("nothing")).unwrap();
    let dataset = folder.path().join("dataset/meta");
    std::fs::create_dir_all(&dataset).unwrap();
    std::fs::write(dataset.join("info.json"), "{\"codebase_version\": \"v3.0\", \"fps\": 30, \"features\": {}}").unwrap();
    folder
}

fn import(folder: &Path, recordings: &[&str], table: ImportOptions) -> Import {
    let recordings = recordings.iter().map(|name| folder.join(name)).collect();
    Import { recordings, bag: folder.join("out.mcap"), table, contract: None, episodes: None }
}

fn is_option(error: &BagError) -> bool {
    matches!(error, BagError::Option(_))
}

#[test]
fn an_option_of_another_format_is_an_error_before_anything_is_written() {
    let folder = folder();
    let own = ImportOptions::default;
    let map: ColumnMap = "x=/master/measured_js.position[0]".parse().unwrap();
    let of_tables = [
        ImportOptions { columns: vec![map], ..own() },
        ImportOptions { variable: Some("run".into()), ..own() },
        ImportOptions { time: "clock".into(), ..own() },
        ImportOptions { headings: Some(vec!["t".into()]), ..own() },
        ImportOptions { rate_hz: Some(10.0), ..own() },
    ];
    for options in of_tables {
        let error = import(folder.path(), &["dataset"], options.clone()).planned().unwrap_err();
        assert!(is_option(&error), "{options:?}: {error}");
    }
    let of_datasets = [
        Import { contract: Some(Contract::default()), ..import(folder.path(), &["a.csv"], own()) },
        Import { episodes: Some(vec![1]), ..import(folder.path(), &["a.csv"], own()) },
    ];
    assert!(of_datasets.iter().all(|import| is_option(&import.planned().unwrap_err())));
    let both = ImportOptions { rate_hz: Some(10.0), time: "clock".into(), ..own() };
    assert!(is_option(&import(folder.path(), &["a.csv"], both).planned().unwrap_err()));
    assert!(is_option(&import(folder.path(), &["a.csv", "a.csv"], own()).planned().unwrap_err()), "both would become one bag");
    for wrong in ["absent.csv", "nothing"] {
        let error = import(folder.path(), &[wrong], own()).planned().unwrap_err();
        assert!(matches!(&error, BagError::File { path, .. } if path.ends_with(wrong)), "{error}");
    }
    assert!(!folder.path().join("out.mcap").exists());
    let planned = import(folder.path(), &["a.csv", "b.csv"], own()).planned().unwrap();
    let targets: Vec<PathBuf> = planned.into_iter().map(|planned| planned.to).collect();
    assert_eq!(targets, ["out.mcap/a.mcap", "out.mcap/b.mcap"].map(|name| folder.path().join(name)));
}

#[test]
fn the_place_of_a_column_is_a_topic_a_field_and_an_axis() {
    let map: ColumnMap = "motor=/slave/measured_js.effort[2]".parse().unwrap();
    assert_eq!((map.column.as_str(), map.topic.as_str(), map.quantity, map.axis), ("motor", "/slave/measured_js", Quantity::Effort, 2));
    assert_eq!(map, ColumnMap::at("motor", "/slave/measured_js.effort[2]").unwrap());
    for wrong in ["motor", "motor=/slave", "motor=/slave.effort", "motor=/slave.current[0]", "motor=/slave.effort[x]"] {
        assert!(is_option(&wrong.parse::<ColumnMap>().unwrap_err()), "{wrong}");
    }
}

#[test]
fn an_export_takes_the_options_of_its_format_and_never_replaces_its_input() {
    let folder = folder();
    let bag = folder.path().join("in.mcap");
    let frame = Frame::new("memory", vec![("t".into(), vec![0.0, 0.1]), ("x".into(), vec![0.1, 1.0 / 3.0])]).unwrap();
    import_frame(frame, &bag, &ImportOptions::default()).unwrap();
    let asked = |out: &str, to: Option<ExportFormat>| Export {
        bags: vec![bag.clone()],
        out: folder.path().join(out),
        to,
        topics: None,
        contract: None,
        task: None,
        overwrite: false,
    };
    let table = |export: &Export| match export.planned() {
        Ok(PlannedExport::Table { format, .. }) => Some(format),
        _ => None,
    };
    assert_eq!(table(&asked("x.parquet", None)), Some(TableFormat::Parquet));
    assert_eq!(table(&asked("x.txt", None)), Some(TableFormat::Csv), "an unknown ending is a table of text");
    assert_eq!(table(&asked("x.parquet", Some(ExportFormat::Table(TableFormat::Mat)))), Some(TableFormat::Mat));
    let dataset = || asked("set", Some(ExportFormat::Lerobot));
    assert_eq!(dataset().planned().unwrap(), PlannedExport::Lerobot);
    let wrong = [
        Export { bags: vec![bag.clone(), bag.clone()], ..asked("x.csv", None) },
        Export { task: Some("push".into()), ..asked("x.csv", None) },
        Export { contract: Some(Contract::default()), ..asked("x.csv", None) },
        Export { topics: Some(vec!["/recording/x".into()]), ..dataset() },
    ];
    assert!(wrong.iter().all(|export| is_option(&export.planned().unwrap_err())));
    for taken in [asked("in.mcap", None), asked("nothing", Some(ExportFormat::Lerobot)), asked("..", Some(ExportFormat::Lerobot))] {
        match taken.planned() {
            Err(error) => assert!(matches!(error, BagError::File { .. }), "{error}"),
            Ok(planned) => assert!(taken.out.ends_with("nothing") && planned == PlannedExport::Lerobot, "an empty folder is free"),
        }
    }
    assert!(asked("x.csv", None).missing(&Reader::open(&bag).unwrap()).unwrap().faults.is_empty());
}

#[test]
fn a_recording_in_memory_comes_back_from_its_bag_bit_for_bit() {
    let folder = folder();
    let columns = vec![
        ("t".to_string(), vec![0.0, 0.1, 0.2]),
        ("x".to_string(), vec![1.0 / 3.0, -0.0, 5e-324]),
        ("angle [deg]".to_string(), vec![0.0, 90.0, 180.0]),
    ];
    let bag = folder.path().join("x.mcap");
    let report = import_frame(Frame::new("memory", columns.clone()).unwrap(), &bag, &ImportOptions::default()).unwrap();
    assert_eq!((report.rows, report.topics.len()), (3, 2));
    let reader = Reader::open(&bag).unwrap();
    let back = frame_of(&reader, None).unwrap();
    let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!((back[0].0.as_str(), bits(&back[0].1)), ("t", bits(&columns[0].1)));
    assert_eq!((back[1].0.as_str(), bits(&back[1].1)), ("x", bits(&columns[1].1)));
    assert!((back[2].1[1] - std::f64::consts::FRAC_PI_2).abs() < 1e-15, "a bag holds SI units: {:?}", back[2]);
    let gap = vec![("t".to_string(), vec![0.0, 0.1]), ("x".to_string(), vec![0.0, f64::NAN])];
    let error = import_frame(Frame::new("memory", gap).unwrap(), &folder.path().join("y.mcap"), &ImportOptions::default()).unwrap_err();
    assert!(matches!(&error, BagError::File { path, .. } if path == Path::new("memory")), "{error}");
    assert!(!folder.path().join("y.mcap").exists());
}
