//! The loops of several axes together, from the models: eigenloci about +1, and what each axis would allow alone.

use super::measured::within_reach;
use backdrive_report::{Cell, Colour, Page, Plot, Series, Table, Tone, number, si};
use backdrive_stability::nyquist::{CoupledLoops, Limit};
use backdrive_stability::verdict::Answer;

/// What to make of loops that are nothing by the models.
pub const CANCELLED: &str = "By the models the loops have almost no feedback, because the canceller has exactly the master's model. This \
     does not show that a real device, which differs from its model, is stable.";

/// Eigenloci and limits; a sentence where the models do not tell; nothing of one axis.
pub(super) fn axes(page: &mut Page, found: &Answer) {
    let loops = match &found.loops {
        None => return,
        Some(Err(why)) => {
            page.section("Axes together, by the models");
            page.text(&format!("Their joint stability does not follow from the models: {why}."));
            return;
        }
        Some(Ok(loops)) => loops,
    };
    page.section("Axes together, by the models");
    page.text(&match loops.encirclements {
        0 => "At the requested gain the eigenloci do not encircle +1: the axes together are stable (generalised Nyquist criterion)."
            .to_string(),
        n => format!("At the requested gain the eigenloci encircle +1: {n} unstable poles (generalised Nyquist criterion)."),
    });
    if loops.is_cancelled() {
        page.note(CANCELLED);
    }
    page.figure(
        loci(loops, found.gain.product()),
        "Eigenvalues of the loop matrix at the requested gain, from the models linearised at the recorded contact, without dry friction \
         (which adds stability). The feedback is positive, so the critical point is +1 instead of the usual -1.",
    );
    let mut table = Table::new(["loops closed", "stable up to μλ", "limit at"]);
    let mut row = |name: &str, limit: &Limit| {
        let gain = limit.critical_gain.map_or("any gain".to_string(), number);
        let hz = limit.frequency_hz.filter(|hz| *hz > 0.0).map_or("–".to_string(), |hz| si(hz, "Hz"));
        table.push([Cell::from(name), gain.into(), hz.into()]);
    };
    row("all together", &loops.together);
    loops.alone.iter().for_each(|(axis, limit)| row(&format!("{axis} alone, the others open"), limit));
    page.table(table);
    if loops.alone_misleads() {
        page.note("The axes interact through the loop: their separate limits are no answer for all axes together.");
    }
}

fn loci(loops: &CoupledLoops, gain: f64) -> Plot {
    let mut plot = Plot::new("Eigenloci of all axes").x_axis("Re", "").y_axis("Im", "").equal_aspect().include(1.0, 0.0).include(0.0, 0.0);
    let mut seen = Vec::new();
    for (number, locus) in loops.loci.iter().enumerate() {
        let (re, im): (Vec<f64>, Vec<f64>) = locus.iter().map(|l| (gain * l[0], gain * l[1])).unzip();
        seen.extend(re.iter().copied().zip(im.iter().copied()));
        let curve = Series::line(&format!("locus {}", number + 1), &re, &im).colour(Colour::Nth(number));
        plot = plot.series(curve.by("frequency", "Hz", &loops.hz));
    }
    within_reach(plot, &seen).annotate(1.0, 0.0, "+1", Tone::Bad)
}
