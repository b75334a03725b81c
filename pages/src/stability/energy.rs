//! Where the energy goes, and how the environment is displayed.

use crate::parts::sentence;
use backdrive_report::{Cell, Figure, Page, Plot, Table, Tone, number, percent, si};
use backdrive_stability::energy::{AxisEnergy, EnergyAnswer};
use backdrive_stability::transparency::Transparency;

pub(super) fn energy(page: &mut Page, answer: &EnergyAnswer, what: &str) {
    page.text(&sentence(&answer.reason));
    for axis in &answer.axes {
        let mut ports =
            Plot::new(&format!("{}: energy received by the ports, {what}", axis.name)).x_axis("time", "s").y_axis("energy", "J");
        ports = ports.line("displayed environment, at the master", &axis.time_s, &axis.master.energy_j);
        ports = ports.line("environment, at the slave", &axis.time_s, &axis.slave.energy_j);
        ports = ports.line("channel between them", &axis.time_s, &axis.two_port.energy_j);
        let mut plots = vec![ports.include_y(0.0)];
        if !axis.elements.is_empty() {
            let mut taken = Plot::new("").y_axis("energy dissipated in the master, by its model", "J").include_y(0.0);
            for e in &axis.elements {
                taken = taken.line(&format!("{} ({})", e.name, e.kind), &axis.time_s, &e.energy_j);
            }
            plots.push(taken);
        }
        page.figure(
            Figure::stacked(plots),
            "A port below zero has delivered more energy than it received. Passivity is sufficient for stability, but not necessary.",
        );
        energy_numbers(page, axis);
    }
}

fn energy_numbers(page: &mut Page, axis: &AxisEnergy) {
    let mut table = Table::new(["", "at the end", "least", "while the hand held still"]);
    let power = |t: &backdrive_stability::energy::Trend| format!("{} ± {}", si(t.mean_w, "W"), si(t.half_width_w, "W"));
    for (name, port) in [("master's port", &axis.master), ("slave's port", &axis.slave), ("channel", &axis.two_port)] {
        let hold = port.hold.as_ref().map_or("–".to_string(), power);
        table.push([
            name.to_string(),
            si(port.final_j, "J"),
            format!("{} at {}", si(port.minimum_j, "J"), si(port.minimum_at_s, "s")),
            hold,
        ]);
    }
    for e in axis.elements.iter().filter(|e| e.friction) {
        table.push([format!("{} ({})", e.name, e.kind), si(e.final_j, "J"), "–".into(), e.hold_w.map_or("–".into(), |w| si(w, "W"))]);
    }
    let friction: f64 = axis.elements.iter().filter(|e| e.friction).map(|e| e.final_j).sum();
    if axis.elements.iter().any(|e| e.friction) {
        table.push(["friction and hysteresis together".to_string(), si(friction, "J"), String::new(), String::new()]);
    }
    page.table(table);
    if let Some(why) = &axis.elements_reason {
        page.note(&format!("The energy dissipated by friction and hysteresis is not known: {why}"));
    }
    match (&axis.bounds, &axis.bounds_reason) {
        (Some(b), _) => {
            let within = |yes: bool| if yes { Cell::tone("within", Tone::Good) } else { Cell::tone("beyond", Tone::Warning) };
            let mut table = Table::new(["bound", "largest displayed stiffness", "largest μλ", "at this gain"]);
            table.push([
                Cell::from("Colgate: viscous damping and delay"),
                si(b.colgate_n_per_m, "N/m").into(),
                number(b.colgate_gain).into(),
                within(b.within_colgate),
            ]);
            table.push([
                Cell::from("Abbott: with Coulomb friction and encoder step"),
                si(b.abbott_n_per_m, "N/m").into(),
                number(b.abbott_gain).into(),
                within(b.within_abbott),
            ]);
            page.table(table.caption(&format!(
                "Displayed stiffness μλK_e here: {}, with K_e = {} ({}).",
                si(b.displayed_n_per_m, "N/m"),
                si(b.environment_n_per_m, "N/m"),
                b.environment_from
            )));
            for note in &b.notes {
                page.text(&sentence(note));
            }
        }
        (None, Some(why)) => {
            page.note(&format!("The classical bounds are not known: {why}"));
        }
        (None, None) => {}
    }
}

pub(super) fn transparency(page: &mut Page, axes: &[Transparency]) {
    let mut table = Table::new([
        "axis",
        "position error, free",
        "in contact",
        "force error in contact",
        "of a reflected",
        "induced motion",
        "cancelled in the first 50 ms",
        "impedance error",
    ]);
    let or_not = |value: Option<f64>, unit: &str| value.map_or("–".to_string(), |v| si(v, unit));
    for t in axes {
        table.push([
            t.name.clone(),
            or_not(t.position_free_rms, "m"),
            or_not(t.position_contact_rms, "m"),
            or_not(t.force_contact_rms, "N"),
            or_not(t.reflected_rms, "N"),
            t.induced_ratio.map_or("–".to_string(), percent),
            t.cancellation.as_ref().map_or("–".to_string(), |c| percent(c.quality)),
            t.impedance.as_ref().map_or("–".to_string(), |i| format!("factor {}", number(i.error.exp()))),
        ]);
    }
    page.table(
        table.caption("Rms values; induced motion as a share of the hand's motion; the impedance error is a mean factor, 1 is ideal."),
    );
    for t in axes {
        if let Some(i) = &t.impedance {
            let magnitude = Plot::new(&format!("{}: impedance transmitted to the hand", t.name)).x_axis("frequency", "Hz").x_log();
            let magnitude = magnitude.y_axis("magnitude", "N s/m").y_log().line("transmitted Z_t", &i.frequency_hz, &i.transmitted);
            let degrees: Vec<f64> = i.phase.iter().map(|p| p.to_degrees()).collect();
            let phase = Plot::new("").y_axis("phase of Z_t over μλZ_e", "°").include_y(0.0).line("", &i.frequency_hz, &degrees);
            page.figure(
                Figure::stacked([magnitude.line("environment μλZ_e", &i.frequency_hz, &i.environment), phase]),
                &format!(
                    "Estimated with the {}, where the coherence is at least {}. Ideally the curves coincide.",
                    i.against,
                    number(i.least_coherence)
                ),
            );
        }
        for note in &t.notes {
            page.text(&format!("{}: {note}", t.name));
        }
    }
}
