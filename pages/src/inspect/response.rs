//! The response of a joint in words and cells.

use backdrive_inspect::{Bandwidth, Interval, Response};
use backdrive_report::number;

/// Headers of the table of joints.
pub const HEADERS: [&str; 8] =
    ["joint", "lag, ms (95 %)", "-3 dB, Hz", "overshoot", "droop, mean (largest)", "dead band", "speed limit", "clock, Hz (jitter, ms)"];

/// One line of that table.
pub fn cells(response: &Response) -> Vec<String> {
    let unknown = || "-".to_string();
    vec![
        title(response),
        lag(response).unwrap_or_else(unknown),
        response.bandwidth.as_ref().map_or_else(unknown, bandwidth),
        response.overshoot.map_or_else(unknown, |share| format!("{:.0} %", 100.0 * share)),
        response.droop.map_or_else(unknown, |[mean, largest]| format!("{} ({})", number(mean), number(largest))),
        response.dead_band.map_or_else(unknown, |band| format!("{} ({} to {})", number(band.value), number(band.low), number(band.high))),
        response.rate_limit.map_or_else(unknown, |limit| format!("{} per s", number(limit))),
        clock(response),
    ]
}

/// The joint's name, else that of its position.
pub fn title(response: &Response) -> String {
    if response.joint.is_empty() { response.position.clone() } else { response.joint.clone() }
}

fn whole(interval: &Interval) -> String {
    format!("{:.0} ({:.0} to {:.0})", interval.value, interval.low, interval.high)
}

/// The lag, by direction where the two differ.
pub fn lag(response: &Response) -> Option<String> {
    let all = whole(response.lag_ms.as_ref()?);
    Some(match &response.lag_by_direction_ms {
        Some([up, down]) => format!("{all}; rising {}, falling {}", whole(up), whole(down)),
        None => all,
    })
}

fn bandwidth(bandwidth: &Bandwidth) -> String {
    let least = if bandwidth.at_least { ">= " } else { "" };
    format!("{least}{}", number(bandwidth.hz))
}

fn clock(response: &Response) -> String {
    let [position, command] = response.rates_hz;
    let rates = if (position / command - 1.0).abs() > 0.02 {
        format!("{}, command {}", number(position), number(command))
    } else {
        number(position)
    };
    let age = response.age_ms.map_or(String::new(), |[position, command]| format!(", age {} and {}", number(position), number(command)));
    format!("{rates} ({}{age})", number(response.jitter_ms))
}
