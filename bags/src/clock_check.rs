//! What is wrong with the times of a recording that can be used all the same.

/// A step that is longer than this many usual ones is a jump: samples are missing. The Python package has the same limits.
const MISSING: f64 = 1.5;
/// A step that differs from the usual one by more than this share of it is uneven.
const UNEVEN: f64 = 0.05;
/// Steps are told to be uneven where more than this share of them is.
const UNEVEN_SHARE: f64 = 0.01;

/// A sentence for each thing that is wrong with times, s: that they stand still, go back, jump, or that their steps are uneven, with the row of the first (rows count
/// from 1).
///
/// Of a table the first two are no matter of a remark: its import refuses them. Fewer than three times say nothing about a usual step.
pub fn clock_remarks(times: &[f64]) -> Vec<String> {
    let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut remarks = Vec::new();
    let place = |row: usize| format!("first between rows {} and {}, at {:?} s", row + 1, row + 2, times[row]);
    let of = |is_one: &dyn Fn(f64) -> bool| -> Vec<usize> { (0..steps.len()).filter(|row| is_one(steps[*row])).collect() };
    let (same, back) = (of(&|step| step == 0.0), of(&|step| step < 0.0));
    if let Some(first) = same.first() {
        remarks.push(format!("the clock stands still {}, {}: leave out what was recorded twice", count(same.len()), place(*first)));
    }
    if let Some(first) = back.first() {
        let most = back.iter().map(|row| -steps[*row]).fold(0.0, f64::max);
        remarks.push(format!(
            "the clock goes back {}, by up to {most:.6} s, {}: cut the recording there",
            count(back.len()),
            place(*first)
        ));
    }
    let mut sorted: Vec<f64> = steps.iter().copied().filter(|step| *step > 0.0).collect();
    if sorted.len() < 2 {
        return remarks;
    }
    sorted.sort_by(f64::total_cmp);
    // The lower of two in the middle: one gap among few rows is not taken for half of what is usual.
    let usual = sorted[(sorted.len() - 1) / 2];
    let is_jump = |step: f64| step > MISSING * usual;
    let jumps = of(&is_jump);
    if let Some(first) = jumps.first() {
        let longest = jumps.iter().map(|row| steps[*row]).fold(0.0, f64::max);
        let lost: f64 = jumps.iter().map(|row| steps[*row] / usual - 1.0).sum();
        remarks.push(format!(
            "the clock jumps {}, by up to {longest:.6} s where {usual:.6} s are usual, {}: about {lost:.0} samples are missing",
            count(jumps.len()),
            place(*first)
        ));
    }
    let is_step = |step: f64| step > 0.0 && !is_jump(step);
    let uneven = of(&|step| is_step(step) && (step - usual).abs() > UNEVEN * usual);
    if let Some(first) = uneven.first().filter(|_| uneven.len() as f64 > UNEVEN_SHARE * steps.len() as f64) {
        let within = steps
            .iter()
            .filter(|step| is_step(**step))
            .fold((f64::INFINITY, 0.0_f64), |(least, most), step| (least.min(*step), most.max(*step)));
        remarks.push(format!(
            "the steps are uneven: {usual:.6} s as a rule, but {:.6} to {:.6} s, {} of {}, first between rows {} and {}",
            within.0,
            within.1,
            uneven.len(),
            steps.len(),
            first + 1,
            first + 2
        ));
    }
    remarks
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
        assert!(remarks[0].contains("stands still once, first between rows 300 and 301"), "{remarks:?}");
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
