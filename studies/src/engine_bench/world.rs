//! A bench drawn from a seed, written as files, and recorded on the graph.

use crate::StudyError;
use crate::error::failed;
use crate::run::{read, write};
use backdrive_control::dynamometer::DynamometerModel;
use backdrive_control::engine::{Engine, Grid};
use backdrive_control::observer::Shaft;
use backdrive_nodes::graph::bench::{EngineFile, dynamometer_from_toml, dynamometer_to_toml};
use backdrive_nodes::graph::{Graph, Overrides};
use backdrive_testbench::Identified;
use backdrive_testbench::lag::Observation;
use std::path::{Path, PathBuf};
use toml_edit::{DocumentMut, Item, value};

/// What data sheets say of every bench.
pub const SHEET: Shaft = Shaft { engine: 0.9, dynamometer: 0.7, stiffness: 2e4, damping: 12.0 };

/// The observer: noise of the order of what the sensors have, torque that changes by 200 N m in a second.
pub const OBSERVATION: Observation = Observation { noise: [0.02, 0.02], force_rate: 200.0, back_off: 1.2 };

const LAUNCH: &str = "engine-test-bench-identify.toml";

/// A drawn bench.
pub struct World {
    /// The true shaft.
    pub shaft: Shaft,
    /// The engine of the identification's day.
    pub engine: EngineFile,
    /// The engine of the validation's day.
    pub other_day: EngineFile,
    /// The true machine.
    pub dynamometer: DynamometerModel,
    folder: PathBuf,
}

/// A repeatable draw (SplitMix64).
struct Draw(u64);

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        low + (high - low) * (((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64)
    }
}

fn launch(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../launch").join(name)
}

impl World {
    /// Draws a bench and writes its files and its graph into a folder.
    ///
    /// # Errors
    /// When a file cannot be read or written.
    pub fn make(seed: u64, folder: &Path) -> Result<World, StudyError> {
        std::fs::create_dir_all(folder).map_err(|e| StudyError::Write(format!("{}: cannot be made: {e}", folder.display())))?;
        let folder = folder.canonicalize().map_err(|e| StudyError::Write(format!("{}: {e}", folder.display())))?;
        let mut draw = Draw(seed);
        let shaft = Shaft {
            engine: SHEET.engine * draw.between(0.93, 1.07),
            dynamometer: SHEET.dynamometer * draw.between(0.8, 1.2),
            stiffness: SHEET.stiffness * draw.between(0.95, 1.05),
            damping: SHEET.damping * draw.between(0.7, 1.3),
        };
        let own = |name: &str| launch("engine-test-bench").join(name);
        let mut engine = EngineFile::from_toml(&read(&own("engine.toml"))?, "engine.toml")?;
        let scale = draw.between(0.9, 1.1);
        engine.engine = scaled(&engine.engine, |torque| scale * torque, draw.between(0.85, 1.0));
        engine.ripple.share = draw.between(0.05, 0.12);
        // Another air inlet temperature: the torque is off by some per cent, by more or less from point to point, and by a constant.
        let (share, offset) = (draw.between(0.92, 0.97), draw.between(-8.0, 4.0));
        let mut point = |torque: f64| {
            let own = share + draw.between(-0.06, 0.06);
            if torque == 0.0 { 0.0 } else { own * torque + offset }
        };
        let other_day = EngineFile { engine: scaled(&engine.engine, &mut point, 1.0), ..engine.clone() };
        let (mut dynamometer, noise) = dynamometer_from_toml(&read(&own("dynamometer.toml"))?, "dynamometer.toml")?;
        dynamometer.frequency_hz *= draw.between(0.8, 1.2);
        dynamometer.damping_ratio *= draw.between(0.9, 1.1);
        dynamometer.delay_s = draw.between(2e-3, 8e-3);

        let put = |name: &str, text: &str| write(&folder.join(name), text);
        put("engine.toml", &engine.to_toml("engine of the identification's day"))?;
        put("engine-other-day.toml", &other_day.to_toml("engine of the validation's day"))?;
        put("dynamometer.toml", &format!("{}noise = {noise:?}\n", dynamometer_to_toml(&dynamometer, "dynamometer")))?;
        let mut model: DocumentMut = read(&own("shaft.toml"))?.parse().map_err(failed)?;
        model["bodies"]["engine"] = value(shaft.engine);
        model["bodies"]["dyno"] = value(shaft.dynamometer);
        for element in model["elements"].as_array_of_tables_mut().into_iter().flat_map(|e| e.iter_mut()) {
            match element.get("name").and_then(Item::as_str) {
                Some("shaft") => element["stiffness"] = value(shaft.stiffness),
                _ => element["damping"] = value(shaft.damping),
            }
        }
        put("shaft.toml", &model.to_string())?;
        put("graph.toml", &graph(&folder, seed)?)?;
        Ok(World { shaft, engine, other_day, dynamometer, folder })
    }

    /// Runs one of the graph's experiments in this process; gives its bag.
    ///
    /// # Errors
    /// When the run fails.
    pub fn record(&self, experiment: &str) -> Result<PathBuf, StudyError> {
        let bag = self.folder.join(format!("{experiment}.mcap"));
        let changes = Overrides { bag: Some(bag.clone()), ..Overrides::default() };
        let graph = Graph::load_experiment(&self.folder.join("graph.toml"), &changes, experiment)?;
        backdrive_runs::way::run_here(&graph, &backdrive_runs::Silent, &mut |_, _| {})?;
        Ok(bag)
    }

    /// Writes what was identified as files that a graph takes.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn keep(&self, found: &Identified) -> Result<(), StudyError> {
        let file = EngineFile { engine: found.bench.engine.clone(), ..self.engine.clone() };
        write(&self.folder.join("engine.identified.toml"), &file.to_toml("engine, identified"))?;
        write(&self.folder.join("dynamometer.identified.toml"), &dynamometer_to_toml(&found.bench.dynamometer, "dynamometer, identified"))
    }
}

/// An engine with its torques and its time constants changed.
fn scaled(engine: &Engine, mut torque: impl FnMut(f64) -> f64, slower: f64) -> Engine {
    let with = |grid: &Grid, change: &mut dyn FnMut(f64) -> f64| {
        let values = grid.values().iter().map(|v| change(*v)).collect();
        Grid::new(grid.pedals().to_vec(), grid.speeds().to_vec(), values).unwrap_or_else(|_| grid.clone())
    };
    Engine::new(with(&engine.map, &mut torque), with(&engine.lag, &mut |t| slower * t))
}

/// The text of the launch file with this bench's files in it.
fn graph(folder: &Path, seed: u64) -> Result<String, StudyError> {
    let mut document: DocumentMut = read(&launch(LAUNCH))?.parse().map_err(failed)?;
    document["seed"] = value(seed as i64);
    let beside = |name: &str| value(folder.join(name).display().to_string());
    let cycles = |item: &mut Item| {
        if let Some(path) = item.as_str().map(launch) {
            *item = value(path.display().to_string());
        }
    };
    for node in document["nodes"].as_array_of_tables_mut().into_iter().flat_map(|n| n.iter_mut()) {
        match node.get("kind").and_then(Item::as_str) {
            Some("engine") => node["map"] = beside("engine.toml"),
            Some("dynamometer") => node["map"] = beside("dynamometer.toml"),
            Some("shaft") => node["model"] = beside("shaft.toml"),
            Some("observer") => node["model"] = value(launch("../plant/models/engine-test-bench.toml").display().to_string()),
            Some("cycle") => cycles(&mut node["cycle"]),
            _ => {}
        }
    }
    for experiment in document["experiments"].as_array_of_tables_mut().into_iter().flat_map(|e| e.iter_mut()) {
        if let Some(operator) = experiment.get_mut("operator").and_then(Item::as_inline_table_mut)
            && let Some(path) = operator.get("cycle").and_then(|c| c.as_str()).map(launch)
        {
            operator.insert("cycle", path.display().to_string().into());
        }
        if experiment.get("name").and_then(Item::as_str) == Some("validation") {
            let mut other = toml_edit::InlineTable::new();
            other.insert("map", folder.join("engine-other-day.toml").display().to_string().into());
            experiment["engine"] = value(other);
        }
    }
    Ok(document.to_string())
}
