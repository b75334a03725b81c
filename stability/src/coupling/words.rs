//! A recovered coupling as text.

use super::law::Term;
use super::types::{Coupling, Estimate, SideLaw};

impl Coupling {
    /// The laws of both motors, a line each: of the master, of the slave.
    pub fn lines(&self) -> [String; 2] {
        [self.master.line("tau_m", ["x_m", "x_s", "F_h", "F_s"]), self.slave.line("tau_s", ["x_s", "x_m", "F_s", "F_h"])]
    }
}

impl SideLaw {
    /// Whether it pushes away from the other side, which no coupling does: then a sign in the recording is turned round.
    pub fn pushes_apart(&self) -> bool {
        self.gains.iter().any(|g| g.term == Term::Position && g.estimate.ci95[1] < 0.0)
    }

    /// The law as a formula with its intervals; `names` are the own and the other's position, the own and the other's measured force.
    fn line(&self, force: &str, names: [&str; 4]) -> String {
        let [own, other, own_force, other_force] = names;
        let terms: Vec<String> = self
            .gains
            .iter()
            .map(|gain| {
                let number = interval(&gain.estimate, 1.0);
                match gain.term {
                    Term::Position => format!("{number} ({other} - {own})"),
                    Term::Rate => format!("{number} d/dt({other} - {own})"),
                    Term::Damping => format!("{number} (-d{own}/dt)"),
                    Term::Friction => format!("{number} sign(d{own}/dt)"),
                    Term::OtherForce => format!("{number} {other_force}"),
                    Term::OwnForce => format!("{number} {own_force}"),
                }
            })
            .collect();
        let mut more = Vec::new();
        let mut tell = |what: &str, estimate: &Option<Estimate>| {
            if let Some(e) = estimate {
                more.push(format!("{what} {} ms", interval(e, 1e3)));
            }
        };
        tell("speeds filtered by", &self.filter_s);
        tell("motion delayed by", &self.delay_s);
        tell("force delayed by", &self.force_delay_s);
        if let Some(limit) = self.limit {
            more.push(format!("clamped at {limit:.4}"));
        }
        more.push(format!("leaves {:.1e} of its variance unexplained in held-out time, up to {:.0} Hz", self.unexplained, self.band_hz));
        let law = if terms.is_empty() { "nothing".to_owned() } else { terms.join(" + ") };
        format!("{force} = {law}; {}", more.join(", "))
    }
}

/// A number with its interval, in as many digits as that allows.
fn interval(e: &Estimate, scale: f64) -> String {
    let (value, low, high) = (scale * e.value, scale * e.ci95[0], scale * e.ci95[1]);
    let width = (high - low).abs().max(1e-6 * value.abs()).max(1e-12);
    let digits = (1.0 - width.log10()).ceil().clamp(0.0, 8.0) as usize;
    format!("{value:.digits$} ({low:.digits$} to {high:.digits$})")
}
