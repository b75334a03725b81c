//! Files damaged at random: the same number gives the same damage.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// One to three injuries.
pub fn mutate(whole: &[u8], is_text: bool, random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for _ in 0..random.random_range(1..=3) {
        if bytes.is_empty() {
            break;
        }
        let place = random.random_range(0..bytes.len());
        match random.random_range(0..if is_text { 6 } else { 4 }) {
            0 => bytes[place] ^= 1 << random.random_range(0..8),
            1 => bytes.truncate(place),
            // A length, a count or an offset that is huge, negative or 0.
            kind if !is_text => {
                let word = [u32::MAX, i32::MAX as u32, 0, 1 << 31, 0x0fff_ffff][random.random_range(0..5)].to_le_bytes();
                let near_end = kind == 3 && bytes.len() > 200;
                let place = if near_end { bytes.len() - 1 - random.random_range(0..200) } else { place };
                let end = (place + 4).min(bytes.len());
                bytes[place..end].copy_from_slice(&word[..end - place]);
            }
            kind => bytes = edit(&String::from_utf8_lossy(&bytes), kind, random).into_bytes(),
        }
    }
    bytes
}

fn edit(text: &str, kind: i32, random: &mut ChaCha8Rng) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_string).collect();
    if lines.is_empty() {
        return String::new();
    }
    let line = random.random_range(0..lines.len());
    match kind {
        // A number gives way to what is none, or to one that nothing has.
        2 | 3 => {
            let others = ["1e308", "-1e308", "nan", "inf", "-1", "0", "", "1e-308", "\"x\"", "99999999999999999999"];
            let other = others[random.random_range(0..others.len())];
            let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | 'e');
            let chars = &lines[line];
            if let Some(from) = chars.find(|c: char| c.is_ascii_digit()) {
                let rest = &chars[from..];
                let until = from + rest.find(|c: char| !is_number(c)).unwrap_or(rest.len());
                lines[line] = format!("{}{other}{}", &chars[..from], &chars[until..]);
            }
        }
        4 => drop(lines.remove(line)),
        // A section twice.
        _ => {
            let end = (line + random.random_range(1..12)).min(lines.len());
            let section = lines[line..end].to_vec();
            lines.splice(end..end, section);
        }
    }
    lines.join("\n") + "\n"
}
