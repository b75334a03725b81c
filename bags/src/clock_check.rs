//! What is wrong with the times of a recording that can be used nevertheless.

/// A step that is longer than this many usual ones is a jump: samples are missing. The Python package has the same limits.
const MISSING: f64 = 1.5;
/// A step that differs from the usual one by more than this share of it is uneven.
const UNEVEN: f64 = 0.05;
/// Steps are reported as uneven where more than this share of them is.
const UNEVEN_SHARE: f64 = 0.01;

/// What is wrong with a clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClockFaultKind {
    /// A time stands in two rows.
    StandsStill,
    /// A time is before the one of the row above.
    GoesBack,
    /// A step is longer than one and a half usual ones.
    Jumps,
    /// Steps differ from the usual one by more than 5 %, and more than 1 in 100 do.
    Uneven,
}

/// A fault of a clock, with where it is first; displayed as a sentence.
#[derive(Debug, Clone, PartialEq)]
pub struct ClockFault {
    /// What is wrong.
    pub kind: ClockFaultKind,
    /// The row, from 0, before the first such step.
    pub row: usize,
    /// The time of that row, s.
    pub time: f64,
    /// Steps of which it is true.
    pub count: usize,
    /// Of all steps.
    pub steps: usize,
    /// The smallest and the largest step of which it is true; of uneven ones, of all that are no jump. s; 0 of a clock that stands still.
    pub range: [f64; 2],
    /// The usual step, s.
    pub usual: f64,
    /// Samples that are missing in the jumps, about.
    pub missing: f64,
}

impl std::fmt::Display for ClockFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let place = format!("first between rows {} and {}", self.row + 1, self.row + 2);
        let (times, at, usual) = (count(self.count), self.time, self.usual);
        let [least, most] = self.range;
        match self.kind {
            ClockFaultKind::StandsStill => {
                write!(f, "the clock stops {times}, {place}, at {at:?} s: remove the duplicate samples")
            }
            ClockFaultKind::GoesBack => {
                write!(f, "the clock goes back {times}, by up to {:.6} s, {place}, at {at:?} s: cut the recording there", -least)
            }
            ClockFaultKind::Jumps => write!(
                f,
                "the clock jumps {times}, by up to {most:.6} s where {usual:.6} s are usual, {place}, at {at:?} s: about {:.0} samples are missing",
                self.missing
            ),
            ClockFaultKind::Uneven => write!(
                f,
                "the steps are uneven: {usual:.6} s as a rule, but {least:.6} to {most:.6} s, {} of {}, {place}",
                self.count, self.steps
            ),
        }
    }
}

/// A sentence for each thing that is wrong with times, s: that they stand still, go back, jump, or that their steps are uneven, with the row of the first (rows count
/// from 1).
///
/// Of a table the first two are no matter of a remark: its import refuses them. Fewer than three times say nothing about a usual step.
pub fn clock_remarks(times: &[f64]) -> Vec<String> {
    clock_faults(times).iter().map(ClockFault::to_string).collect()
}

/// As [`clock_remarks`], as values.
pub fn clock_faults(times: &[f64]) -> Vec<ClockFault> {
    let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sorted: Vec<f64> = steps.iter().copied().filter(|step| *step > 0.0).collect();
    sorted.sort_by(f64::total_cmp);
    // The lower of two in the middle: one gap among few rows is not taken for half of what is usual.
    let usual = sorted.get(sorted.len().saturating_sub(1) / 2).copied().unwrap_or(0.0);
    let is_jump = |step: f64| step > MISSING * usual;
    let is_step = |step: f64| step > 0.0 && !is_jump(step);
    let is_uneven = |step: f64| is_step(step) && (step - usual).abs() > UNEVEN * usual;
    let of = |kind: ClockFaultKind, is_one: &dyn Fn(f64) -> bool, within: &dyn Fn(f64) -> bool| {
        let row = steps.iter().position(|step| is_one(*step))?;
        let found = || steps.iter().copied().filter(|step| is_one(*step));
        let range = steps.iter().filter(|step| within(**step)).fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], s| [a.min(*s), b.max(*s)]);
        let missing = if kind == ClockFaultKind::Jumps { found().map(|step| step / usual - 1.0).sum() } else { 0.0 };
        Some(ClockFault { kind, row, time: times[row], count: found().count(), steps: steps.len(), range, usual, missing })
    };
    let mut faults: Vec<ClockFault> = Vec::new();
    faults.extend(of(ClockFaultKind::StandsStill, &|step| step == 0.0, &|step| step == 0.0));
    faults.extend(of(ClockFaultKind::GoesBack, &|step| step < 0.0, &|step| step < 0.0));
    if sorted.len() < 2 {
        return faults;
    }
    faults.extend(of(ClockFaultKind::Jumps, &is_jump, &is_jump));
    let uneven = of(ClockFaultKind::Uneven, &is_uneven, &is_step);
    faults.extend(uneven.filter(|fault| fault.count as f64 > UNEVEN_SHARE * steps.len() as f64));
    faults
}

fn count(times: usize) -> String {
    if times == 1 { "once".to_owned() } else { format!("{times} times") }
}

#[cfg(test)]
mod tests {
    use super::clock_remarks;

    fn even(rows: usize) -> Vec<f64> {
        (0..rows).map(|row| row as f64 * 1e-3).collect()
    }

    #[test]
    fn an_even_clock_and_one_that_is_too_short_say_nothing() {
        assert!(clock_remarks(&even(1000)).is_empty());
        assert!(clock_remarks(&[]).is_empty());
        assert!(clock_remarks(&[0.0, 5.0]).is_empty());
    }

    #[test]
    fn a_jump_is_told_with_its_rows_and_what_is_missing() {
        let mut times = even(1000);
        times.drain(400..410);
        let remarks = clock_remarks(&times);
        assert_eq!(remarks.len(), 1, "{remarks:?}");
        assert!(remarks[0].contains("jumps once") && remarks[0].contains("between rows 400 and 401"), "{remarks:?}");
        assert!(remarks[0].contains("about 10 samples"), "{remarks:?}");
    }

    #[test]
    fn times_that_stand_still_or_go_back_are_told_and_hide_nothing_else() {
        let mut times = even(1000);
        (times[300], times[700]) = (times[299], times[600]);
        let remarks = clock_remarks(&times);
        assert!(remarks[0].contains("stops once, first between rows 300 and 301"), "{remarks:?}");
        assert!(remarks[1].contains("goes back once, by up to 0.099000 s, first between rows 700 and 701"), "{remarks:?}");
        assert!(remarks[2].contains("jumps 2 times"), "{remarks:?}");
        assert_eq!(clock_remarks(&[0.0, 0.0]).len(), 1);
    }

    #[test]
    fn uneven_steps_are_told_and_a_single_one_among_many_is_not() {
        let shaken: Vec<f64> = even(1000).iter().enumerate().map(|(row, t)| t + if row % 3 == 1 { 2e-4 } else { 0.0 }).collect();
        let remarks = clock_remarks(&shaken);
        assert!(remarks.len() == 1 && remarks[0].contains("uneven") && remarks[0].contains("between rows 1 and 2"), "{remarks:?}");
        let mut once = even(1000);
        once[500] += 2e-4;
        assert!(clock_remarks(&once).is_empty());
    }
}
