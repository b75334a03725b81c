//! What is played: the motion of a hand, and excitations.

use super::device::NodeReader;
use crate::graph::NodeKind;
use crate::graph::recorded::Recorded;
use backdrive_control::operator::Intent;
use backdrive_msgs::MAX_AXES;
use backdrive_plant::elements::Range;
use backdrive_plant::excitation::{Excitation, ExcitationError, Shape};
use backdrive_plant::tomlfile::{FileError, Table};
use std::path::Path;

impl NodeReader<'_> {
    pub(super) fn intents(&mut self, table: &mut Table) -> Result<Vec<Intent>, FileError> {
        let axes = table.tables("axes")?;
        if axes.is_empty() {
            return Ok(vec![self.intent(table)?]);
        }
        if axes.len() > MAX_AXES {
            return Err(table.error_at("axes", format!("at most {MAX_AXES} axes are possible")));
        }
        axes.into_iter()
            .map(|mut axis| {
                let intent = self.intent(&mut axis)?;
                axis.finish()?;
                Ok(intent)
            })
            .collect()
    }

    /// One axis: `waypoints = [{ t, x }, ..]`, or `sine = { amplitude, frequency }`, or nothing.
    fn intent(&mut self, table: &mut Table) -> Result<Intent, FileError> {
        let mut points: Vec<[f64; 2]> = Vec::new();
        for mut point in table.tables("waypoints")? {
            let (t, x) = (point.need_number("t", Range::NonNegative)?, point.need_number("x", Range::Any)?);
            if points.last().is_some_and(|last| t <= last[0]) {
                return Err(point.error_at("t", "times must increase"));
            }
            point.finish()?;
            points.push([t, x]);
        }
        if !points.is_empty() {
            return Ok(Intent::Waypoints(points));
        }
        if let Some(mut sine) = table.table("sine")? {
            let amplitude = sine.need_number("amplitude", Range::Any)?;
            let frequency = sine.need_number("frequency", Range::Positive)?;
            sine.finish()?;
            return Ok(Intent::Sine { amplitude, frequency });
        }
        Ok(Intent::Rest)
    }

    /// One multisine for a master of several axes (read before): each axis gets phases of its own, because the effects of two equal inputs cannot be
    /// separated.
    fn for_each_axis(&self, excitation: &Excitation) -> Vec<Excitation> {
        let axes = self.graph.nodes.iter().find(|n| n.kind == NodeKind::Master).map_or(1, |n| n.axes);
        let own = |axis: usize| {
            let mut own = excitation.clone();
            if let Shape::Multisine { seed, .. } = &mut own.shape {
                *seed = seed.wrapping_add(axis as u64);
            }
            own
        };
        (0..axes.max(1)).map(own).collect()
    }

    /// A string or a list of strings, an excitation or a recorded force per axis, as samples at the graph's rate.
    pub(super) fn excitations(&mut self, table: &mut Table, key: &str) -> Result<Vec<Vec<f64>>, FileError> {
        let Some(specs) = table.string_or_strings(key)? else { return Ok(Vec::new()) };
        if specs.len() > MAX_AXES {
            return Err(table.error_at(key, format!("at most {MAX_AXES} axes are possible")));
        }
        let one = specs.first().filter(|_| specs.len() == 1 && key == "dither").and_then(|spec| spec.parse::<Excitation>().ok());
        if let Some(one) = one.filter(|e| matches!(e.shape, Shape::Multisine { .. })) {
            let samples = |e: &Excitation| e.samples(self.graph.timing.rate_hz).map_err(|e| table.error_at(key, e.to_string()));
            return self.for_each_axis(&one).iter().map(samples).collect();
        }
        specs
            .iter()
            .map(|spec| {
                if let Some(recorded) = Recorded::parse(spec) {
                    let recorded = recorded.map_err(|e| table.error_at(key, e))?;
                    let text = self.files.read(Path::new(&recorded.file), &mut self.graph.files)?;
                    return recorded.samples(&text, self.graph.timing.rate_hz).map_err(|e| table.error_at(key, e));
                }
                let excitation: Excitation = spec.parse().map_err(|e: ExcitationError| table.error_at(key, e.to_string()))?;
                excitation.samples(self.graph.timing.rate_hz).map_err(|e| table.error_at(key, e.to_string()))
            })
            .collect()
    }
}
