//! A difference as a cause: what it is, where, and what was seen of it.

use crate::cause_kind::CauseKind;
use crate::device::{DeviceFound, NumberFound, PhysicsFound};
use crate::difference::Difference;
use crate::tuned::Tuned;
use backdrive_diagnosis::hypothesis::Family;
use backdrive_nodes::graph::{Graph, NodeKind};
use backdrive_stability::by_itself::compared::AsIf;
use backdrive_stability::by_itself::recorded::Quantity;

/// What a difference is, where, and what was seen of it.
pub fn named(difference: &Difference, graph: &Graph) -> (CauseKind, String, String) {
    let period_s = graph.period_s();
    let (node, share) = (&difference.node, 100.0 * difference.compared.share);
    let what = match (difference.kind, difference.quantity) {
        (NodeKind::Slave, Quantity::Effort) => "the contact force",
        (NodeKind::Master, Quantity::Position) => "the master's position",
        _ => "its output",
    };
    if let Some(port) = &difference.way {
        let place = format!("{node}.{port}");
        return match difference.compared.as_if {
            AsIf::Unsteady { late, jitter, missing } if jitter > 0 => (
                if missing > 0.3 && late == 0 { CauseKind::Loss } else { CauseKind::Delay },
                place,
                format!(
                    "the input {node}.{port} arrives {:.1} to {:.1} ms later than the graph states, and {:.0} % is lost",
                    1e3 * late as f64 * period_s,
                    1e3 * (late + jitter) as f64 * period_s,
                    100.0 * missing
                ),
            ),
            AsIf::Unsteady { late: 0, missing, .. } => {
                (CauseKind::Loss, place, format!("{:.1} % of the input {node}.{port} is lost", 100.0 * missing))
            }
            AsIf::Held { rows, .. } => (CauseKind::Rate, place, held(&format!("the input {node}.{port}"), rows, period_s)),
            AsIf::Filtered { order, corner_hz } => (
                CauseKind::FilterLag,
                place,
                format!(
                    "the input {node}.{port} comes through a low-pass of {corner_hz:.1} Hz (order {order}) that the graph does not state"
                ),
            ),
            AsIf::Unsteady { late, .. } | AsIf::Changed { late, .. } => (
                CauseKind::Delay,
                place,
                format!("the input {node}.{port} arrives {:.2} ms later than the graph states", 1e3 * late as f64 * period_s),
            ),
            _ => (CauseKind::Delay, place, String::new()),
        };
    }
    if let Some(device) = &difference.device {
        return of_device(device, (node, difference.kind == NodeKind::Master), share);
    }
    let place = node.clone();
    match difference.compared.as_if {
        AsIf::Dead { from_row } => {
            (CauseKind::DeadSensor, place, format!("{what} at {node} is constant from {:.2} s on", from_row as f64 * period_s))
        }
        AsIf::Railed { low, high } => {
            let end = if high.is_finite() { high } else { low };
            (CauseKind::RailedSensor, place, format!("{what} at {node} saturates at {end:.4}, which the model exceeds"))
        }
        AsIf::Stepped { step } => {
            (CauseKind::CoarseSensor, place, format!("{what} at {node} has a resolution of {step:.3e}, which is not in its model"))
        }
        AsIf::Noisy { deviation } => {
            (CauseKind::CoarseSensor, place, format!("{what} at {node} has noise of {deviation:.3e} rms, which is not in its model"))
        }
        AsIf::Held { rows, .. } => (CauseKind::Rate, place, held(&format!("{what} at {node}"), rows, period_s)),
        AsIf::Filtered { order, corner_hz } => (
            CauseKind::FilterLag,
            place,
            format!("{what} at {node} comes through a low-pass of {corner_hz:.1} Hz (order {order}) that is not in its model"),
        ),
        AsIf::Changed { gain, late: 0 } if gain < 0.0 => {
            (CauseKind::WrongSign, place, format!("{what} at {node} is {gain:.2} times the model's value: its sign is wrong"))
        }
        AsIf::Changed { gain, late: 0 } => {
            (CauseKind::ScaledSensor, place, format!("{what} at {node} is {gain:.3} times the model's value"))
        }
        AsIf::Changed { gain, late } if (gain - 1.0).abs() > 0.05 => {
            let late = 1e3 * late as f64 * period_s;
            let kind = if gain < 0.0 { CauseKind::WrongSign } else { CauseKind::ScaledSensor };
            (kind, place, format!("{what} at {node} is {gain:.3} times the model's value, and delayed by {late:.2} ms"))
        }
        AsIf::Changed { late, .. } => {
            (CauseKind::LateSensor, place, format!("{what} at {node} is delayed by {:.2} ms", 1e3 * late as f64 * period_s))
        }
        AsIf::Same | AsIf::Unsteady { .. } | AsIf::Otherwise => {
            (CauseKind::Unknown, place, format!("{what} at {node} differs by {share:.0} % from the response to its inputs"))
        }
    }
}

fn held(what: &str, rows: f64, period_s: f64) -> String {
    let (hz, graph) = (1.0 / (rows * period_s), 1.0 / period_s);
    format!("{what} is renewed at {hz:.1} Hz and held in between; the graph states {graph:.0} Hz")
}

/// One number of a device, as a cause.
pub fn of_number(number: &Tuned, node: &str) -> (CauseKind, String, String) {
    let give = if number.give.is_finite() && number.give < 0.5 * number.value.abs() {
        let unit = if number.knob.is_time() { format!("{:.2} ms", 1e3 * number.give) } else { format!("{:.3}", number.give) };
        format!(" (within {unit})")
    } else {
        String::new()
    };
    (number.knob.cause(number.value), node.to_string(), format!("{node}: {}{give}", number.knob.words(number.value)))
}

/// The diagnosis of a device, as a cause.
fn of_device(device: &DeviceFound, (node, is_master): (&str, bool), share: f64) -> (CauseKind, String, String) {
    let kind_of = |f: &PhysicsFound| match (f.family, f.of_signal) {
        (Some(Family::Friction), _) => CauseKind::DryFriction,
        (Some(Family::Hysteresis), _) => CauseKind::Hysteresis,
        (Some(Family::Contact), _) => CauseKind::Backlash,
        (Some(Family::Inertia), _) => CauseKind::Inertia,
        (Some(Family::Compliance), _) => CauseKind::Compliance,
        (Some(Family::Scale), _) => CauseKind::ScaledSensor,
        (Some(Family::Lag), true) if !is_master => CauseKind::Delay,
        (Some(Family::Lag), true) => CauseKind::LateSensor,
        (Some(Family::Limit), true) => CauseKind::Saturation,
        _ => CauseKind::OtherPhysics,
    };
    if let Some(first) = device.tuned.first() {
        let (kind, place, _) = of_number(first, node);
        let all: Vec<String> = device.tuned.iter().map(|n| n.knob.words(n.value)).collect();
        return (kind, place, format!("{node} differs by {share:.0} % from its model: {}", all.join(", and ")));
    }
    let size = |f: &PhysicsFound| f.size.as_ref().map_or_else(String::new, |(name, value, unit)| format!(", {name} {value:.4} {unit}"));
    if let Some(first) = device.physics.first() {
        let text = format!(
            "{node} differs by {share:.0} % from its model; a diagnosis of the bag finds {} at {}{} (confidence {})",
            first.physics.replace('_', " "),
            first.place,
            size(first),
            backdrive_diagnosis::verdict::words::share(first.confidence)
        );
        return (kind_of(first), if is_master { first.place.clone() } else { format!("{node}, {}", first.place) }, text);
    }
    let moved = |n: &NumberFound| (n.found / n.declared).abs().ln().abs();
    let most = device.numbers.iter().filter(|n| n.declared != 0.0 && n.found != 0.0).max_by(|a, b| moved(a).total_cmp(&moved(b)));
    match most {
        Some(n) => {
            let kind = if n.of_grip {
                CauseKind::Grip
            } else if n.path.starts_with("bodies.") {
                CauseKind::Inertia
            } else {
                CauseKind::OtherPhysics
            };
            let text =
                format!("{node} differs by {share:.0} % from its model: {} is {:.4}, and {:.4} in the graph", n.path, n.found, n.declared);
            (kind, n.path.clone(), text)
        }
        None => {
            let text = format!(
                "{node} differs by {share:.0} % from its model, and a diagnosis of the bag does not explain it: {}",
                device.sentence
            );
            (CauseKind::Unknown, node.to_string(), text)
        }
    }
}
