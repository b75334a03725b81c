//! Gains that the roles file does not say, and signs that look turned round.

use super::file::Roles;
use crate::phases::contacts;
use crate::session::{AxisSignals, Session};

/// An estimated gain that explains less of its signal than this is reported as doubtful.
const GOOD_FIT: f64 = 0.8;

/// A gain by least squares: slope, share of the variance that it explains, rows by which the effect lags.
#[derive(Debug, Clone, Copy)]
struct Fit {
    slope: f64,
    explained: f64,
    lag: usize,
}

fn fit(cause: &[f64], effect: &[f64], rows: &[usize], most_lag: usize) -> Option<Fit> {
    (0..=most_lag).filter_map(|lag| fit_at(cause, effect, rows, lag)).max_by(|a, b| a.explained.total_cmp(&b.explained))
}

fn fit_at(cause: &[f64], effect: &[f64], rows: &[usize], lag: usize) -> Option<Fit> {
    let pair = |row: &usize| Some((*cause.get(row.checked_sub(lag)?)?, *effect.get(*row)?));
    let pairs: Vec<(f64, f64)> = rows.iter().filter_map(pair).filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    if pairs.len() < 16 {
        return None;
    }
    let n = pairs.len() as f64;
    let (mx, my) = (pairs.iter().map(|p| p.0).sum::<f64>() / n, pairs.iter().map(|p| p.1).sum::<f64>() / n);
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (x, y) in &pairs {
        xx += (x - mx) * (x - mx);
        yy += (y - my) * (y - my);
        xy += (x - mx) * (y - my);
    }
    (xx > 0.0 && yy > 0.0).then(|| Fit { slope: xy / xx, explained: xy * xy / (xx * yy), lag })
}

/// F_f without the dither.
fn reflected(axis: &AxisSignals) -> Vec<f64> {
    let dither = |row: usize| axis.dither.as_ref().and_then(|d| d.get(row)).copied().filter(|d| d.is_finite()).unwrap_or(0.0);
    axis.force.iter().enumerate().map(|(row, f)| f - dither(row)).collect()
}

fn touching(axis: &AxisSignals, period_s: f64) -> (Vec<usize>, Vec<usize>) {
    let mut touches = vec![false; axis.master.len()];
    for row in contacts(axis, period_s).into_iter().flatten() {
        if let Some(touches) = touches.get_mut(row) {
            *touches = true;
        }
    }
    (0..touches.len()).partition(|row| touches.get(*row).copied().unwrap_or(false))
}

/// Fills mu and lambda: from the roles file, else by least squares over the axis that explains most.
///
/// Two coupled motors have their own law, which is identified by itself: of theirs only a position scale is known, or taken to be 1.
pub(super) fn settle_gains(session: &mut Session, roles: &Roles) {
    if session.axes.iter().any(|a| a.slave_force.is_some() && a.slave.is_some()) {
        let rows = session.len();
        session.mu = vec![roles.mu.unwrap_or(1.0); rows];
        session.lambda = vec![roles.lambda.unwrap_or(f64::NAN); rows];
        return;
    }
    // A transport of 50 ms either way is the longest that is looked for.
    let most_lag = ((0.05 / session.period_s) as usize).min(200);
    let best = |fits: Vec<Option<Fit>>| fits.into_iter().flatten().max_by(|a, b| a.explained.total_cmp(&b.explained));
    let period_ms = session.period_s * 1e3;
    let mut told = Vec::new();
    let mut estimate = |name: &str, found: Option<Fit>, over: &str| match found {
        None => {
            told.push(format!("{name} is not in the roles file and cannot be estimated: the recording has too little motion or contact"));
            f64::NAN
        }
        Some(fit) => {
            let doubt = if fit.explained < GOOD_FIT { ": doubtful, give it in the roles file" } else { "" };
            let lag = if fit.lag > 0 { format!(", {:.2} ms late", fit.lag as f64 * period_ms) } else { String::new() };
            let share = fit.explained * 100.0;
            told.push(format!("{name} = {:.5} by least squares over {over} ({share:.1} % explained{lag}){doubt}", fit.slope));
            fit.slope
        }
    };
    let mu = roles.mu.unwrap_or_else(|| {
        let fits = session.axes.iter().map(|axis| {
            let (contact, free) = touching(axis, session.period_s);
            // A canceller changes the command in contact only.
            let free = fit(&axis.master, &axis.command, &free, most_lag);
            free.filter(|f| f.explained > GOOD_FIT).or_else(|| fit(&axis.master, &axis.command, &contact, most_lag))
        });
        estimate("mu", best(fits.collect()), "free motion")
    });
    let lambda = roles.lambda.unwrap_or_else(|| {
        let fits = session.axes.iter().map(|axis| fit(&axis.contact, &reflected(axis), &touching(axis, session.period_s).0, most_lag));
        estimate("lambda", best(fits.collect()), "contact")
    });
    session.notes.extend(told);
    let rows = session.len();
    (session.mu, session.lambda) = (vec![mu; rows], vec![lambda; rows]);
}

/// What a sign that is turned round looks like.
pub(super) fn check_signs(session: &mut Session) {
    let most_lag = ((0.05 / session.period_s) as usize).min(200);
    let mut warnings = Vec::new();
    for axis in session.axes.iter().filter(|a| a.slave_force.is_none() || a.slave.is_none()) {
        let (contact, _) = touching(axis, session.period_s);
        if contact.is_empty() {
            warnings.push(format!("axis {}: there was no contact", axis.name));
            continue;
        }
        let dents = fit(&axis.command, &axis.contact, &contact, most_lag);
        if dents.is_some_and(|f| f.slope > 0.0 && f.explained > 0.25) {
            warnings.push(format!(
                "axis {}: F_s rises with x_c, as if the contact pulled: is the sign of F_s or x_c wrong? Correct it with scale = -1",
                axis.name
            ));
        }
        let felt = fit(&axis.contact, &reflected(axis), &contact, most_lag);
        if felt.is_some_and(|f| f.slope < 0.0 && f.explained > 0.25) {
            warnings.push(format!(
                "axis {}: F_f has the opposite sign of lambda F_s; the reflected force should have the sign of the contact force: correct \
                    one with scale = -1",
                axis.name
            ));
        }
        let (_, free) = touching(axis, session.period_s);
        let follows = fit(&axis.master, &axis.command, &free, most_lag);
        if follows.is_some_and(|f| f.slope < 0.0 && f.explained > GOOD_FIT) {
            warnings.push(format!("axis {}: x_c moves opposite to x_m in free motion: correct one with scale = -1", axis.name));
        }
    }
    session.notes.extend(warnings);
}
