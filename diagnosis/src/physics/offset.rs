//! A sensor that does not read 0 at 0.

use crate::hypothesis::ForceSpan;
use crate::hypothesis::builder::{even, key};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};
use backdrive_plant::model::{Output, OutputKind};

pub(super) const PHYSICS: Physics = Physics {
    name: "offset",
    family: Family::Bias,
    words: "a sensor offset",
    size: "offset",
    against: Against::Time,
    state: State::WithItsVariable,
    mark: Mark::Bias,
    facts: Facts {
        spans: |h, _| h.starts.first().map(|start| vec![ForceSpan::proportional(start.clone())]).unwrap_or_default(),
        ..Facts::NONE
    },
    propose: |sites| {
        let is_drive = |o: &Output| sites.scales.reads_drive && matches!(o.kind, OutputKind::Reaction(_));
        let outputs = sites.model.outputs.iter().enumerate().filter(|(_, o)| o.offset == 0.0 && !is_drive(o));
        let one = |(index, output): (usize, &Output)| {
            let span = sites.scales.output(index);
            let unit = output.kind.unit();
            let room = even(-10.0 * span.peak, 10.0 * span.peak, 0.0);
            (span.peak > 0.0).then(|| key(sites, &PHYSICS, "outputs", &output.name, unit, room, &[0.05 * span.rms, -0.05 * span.rms]))
        };
        outputs.filter_map(one).collect()
    },
};
