//! Dates of recordings, in UTC.

/// Seconds of a day.
const DAY: i64 = 86_400;
/// Names of the months.
const MONTHS: [&str; 12] =
    ["January", "February", "March", "April", "May", "June", "July", "August", "September", "October", "November", "December"];

/// When a recording was made, s since 1970-01-01T00:00:00 UTC.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Date(pub i64);

impl Date {
    /// Reads `2026-11-03`, `2026-11-03T14:05`, or `2026-11-03T14:05:30Z`; a space may stand for the `T`.
    pub fn parse(text: &str) -> Option<Date> {
        let text = text.trim().trim_end_matches('Z');
        let (day, time) = match text.split_once(['T', ' ']) {
            Some((day, time)) => (day, Some(time)),
            None => (text, None),
        };
        let parts: Vec<&str> = day.split('-').collect();
        let [year, month, day] = parts[..] else { return None };
        let midnight = of_day(year.parse().ok()?, month.parse().ok()?, day.parse().ok()?)?;
        let Some(time) = time else { return Some(midnight) };
        let mut of_day = 0;
        let parts: Vec<&str> = time.split(':').collect();
        if !(2..=3).contains(&parts.len()) {
            return None;
        }
        for (part, (size, most)) in parts.iter().zip([(3600, 23), (60, 59), (1, 60)]) {
            let whole: i64 = part.split('.').next()?.parse().ok()?;
            if !(0..=most).contains(&whole) {
                return None;
            }
            of_day += size * whole;
        }
        Some(Date(midnight.0 + of_day))
    }

    /// The first date in the name of a file: `2026-11-03`, `2026_11_03` or `20261103`, with a time after `T`, `_` or `-` as `140530`.
    pub fn in_name(name: &str) -> Option<Date> {
        let letters: Vec<char> = name.chars().collect();
        (0..letters.len()).filter(|from| *from == 0 || !letters[from - 1].is_ascii_digit()).find_map(|from| at(&letters[from..]))
    }

    /// As `2026-11-03T14:05:30Z`; at midnight without the time.
    pub fn iso(self) -> String {
        let (year, month, day) = self.day();
        let of_day = self.0.rem_euclid(DAY);
        match of_day {
            0 => format!("{year:04}-{month:02}-{day:02}"),
            s => format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z", s / 3600, s / 60 % 60, s % 60),
        }
    }

    /// As `3 November 2026`.
    pub fn words(self) -> String {
        let (year, month, day) = self.day();
        format!("{day} {} {year}", MONTHS.get(month as usize - 1).copied().unwrap_or(""))
    }

    /// As `2026-11`.
    pub fn month(self) -> String {
        let (year, month, _) = self.day();
        format!("{year:04}-{month:02}")
    }

    /// Days since 1970-01-01.
    pub fn days(self) -> i64 {
        self.0.div_euclid(DAY)
    }

    /// Year, month and day (Hinnant, chrono-compatible low-level date algorithms).
    fn day(self) -> (i64, i64, i64) {
        let z = self.days() + 719_468;
        let era = z.div_euclid(146_097);
        let doe = z.rem_euclid(146_097);
        let yoe = (doe - doe / 1460 + doe / 36_524 - doe / 146_096) / 365;
        let doy = doe - (365 * yoe + yoe / 4 - yoe / 100);
        let mp = (5 * doy + 2) / 153;
        let month = if mp < 10 { mp + 3 } else { mp - 9 };
        (yoe + era * 400 + i64::from(month <= 2), month, doy - (153 * mp + 2) / 5 + 1)
    }
}

/// Midnight of a day of the calendar.
fn of_day(year: i64, month: i64, day: i64) -> Option<Date> {
    if !(1900..=2200).contains(&year) || !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    let y = if month <= 2 { year - 1 } else { year };
    let (era, yoe) = (y.div_euclid(400), y.rem_euclid(400));
    let doy = (153 * (month + if month > 2 { -3 } else { 9 }) + 2) / 5 + day - 1;
    let date = Date((era * 146_097 + yoe * 365 + yoe / 4 - yoe / 100 + doy - 719_468) * DAY);
    // The 31st of February is no day.
    (date.day() == (year, month, day)).then_some(date)
}

/// A date at the beginning of these letters.
fn at(letters: &[char]) -> Option<Date> {
    let mut place = 0;
    let mut number = |count: usize, separated: bool| -> Option<i64> {
        if separated && letters.get(place).is_some_and(|c| matches!(c, '-' | '_')) {
            place += 1;
        }
        let digits: String = letters.get(place..place + count)?.iter().collect();
        place += count;
        digits.chars().all(|c| c.is_ascii_digit()).then(|| digits.parse().ok())?
    };
    let (year, month, day) = (number(4, false)?, number(2, true)?, number(2, true)?);
    let midnight = of_day(year, month, day)?;
    let next = letters.get(place).copied();
    let time: String = letters.iter().skip(place + 1).filter(|c| !matches!(c, '-' | ':' | '_')).take(6).collect();
    let is_time = next.is_some_and(|c| matches!(c, 'T' | '_' | '-' | ' ')) && time.len() == 6 && time.chars().all(|c| c.is_ascii_digit());
    if !is_time {
        return (!next.is_some_and(|c| c.is_ascii_digit())).then_some(midnight);
    }
    let part = |from: usize| time[from..from + 2].parse::<i64>().unwrap_or(0);
    match (part(0), part(2), part(4)) {
        (h, m, s) if h < 24 && m < 60 && s < 60 => Some(Date(midnight.0 + 3600 * h + 60 * m + s)),
        _ => Some(midnight),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_read_and_written() {
        assert_eq!(Date::parse("1970-01-02"), Some(Date(86_400)));
        assert_eq!(Date::parse("2026-11-03T14:05:30Z").map(Date::iso).as_deref(), Some("2026-11-03T14:05:30Z"));
        assert_eq!(Date::parse("2024-02-29").map(Date::words).as_deref(), Some("29 February 2024"));
        for wrong in ["2026-02-30", "3 November", "2026-13-01", "2026-11-03T25:00", ""] {
            assert_eq!(Date::parse(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn dates_stand_in_names() {
        let iso = |name| Date::in_name(name).map(Date::iso);
        assert_eq!(iso("unit7_2026-11-03.csv").as_deref(), Some("2026-11-03"));
        assert_eq!(iso("log-20261103T140530.mcap").as_deref(), Some("2026-11-03T14:05:30Z"));
        assert_eq!(iso("rosbag2_2026_11_03-14_05_30").as_deref(), Some("2026-11-03T14:05:30Z"));
        assert_eq!(iso("episode_000017"), None);
        assert_eq!(iso("run-123456789012"), None);
    }
}
