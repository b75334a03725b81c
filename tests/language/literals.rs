//! The string literals of a Rust file that a user may read: those with a space, outside of tests.

/// String literals with the line of each, from 1. Continued lines are joined. Holes such as `{name}` and indented lines are code.
pub fn messages(rust: &str) -> Vec<(usize, String)> {
    let own = rust.find("\n#[cfg(test)]\nmod ").filter(|at| rust[*at + 1..].lines().nth(1).is_some_and(|line| line.ends_with('{')));
    let found = literals(&rust[..own.unwrap_or(rust.len())]);
    found
        .into_iter()
        .filter(|(_, text)| text.trim().contains(' '))
        .map(|(line, text)| (line, without_holes(&without_code(&text))))
        .collect()
}

/// All string literals of a file, in their order.
fn literals(rust: &str) -> Vec<(usize, String)> {
    let chars: Vec<char> = rust.chars().collect();
    let (mut at, mut line, mut found) = (0, 1, Vec::new());
    while at < chars.len() {
        let rest = &chars[at..];
        let length = match rest {
            ['/', '/', ..] => rest.iter().position(|c| *c == '\n').unwrap_or(rest.len()),
            ['\'', '\\', ..] => 3 + rest[3..].iter().position(|c| *c == '\'').unwrap_or(0),
            ['\'', _, '\'', ..] => 3,
            ['r', '"' | '#', ..] if at == 0 || !is_of_a_name(chars[at - 1]) => raw(rest).unwrap_or(1),
            ['"', ..] => quoted(rest),
            _ => 1,
        };
        let text: String = rest[..length].iter().collect();
        if matches!(rest[0], '"' | 'r') && length > 1 {
            found.push((line, joined(text.trim_start_matches('r').trim_matches('#').trim_matches('"'))));
        }
        line += text.matches('\n').count();
        at += length;
    }
    found
}

fn is_of_a_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The length of a raw literal, if the text begins with one.
fn raw(text: &[char]) -> Option<usize> {
    let hashes = text[1..].iter().take_while(|c| **c == '#').count();
    let begin = 2 + hashes;
    (text.get(begin - 1) == Some(&'"')).then_some(())?;
    let is_end = |at: &usize| text[*at] == '"' && text[at + 1..].iter().take_while(|c| **c == '#').count() >= hashes;
    (begin..text.len()).find(is_end).map(|end| end + 1 + hashes)
}

/// The length of a quoted literal.
fn quoted(text: &[char]) -> usize {
    let mut at = 1;
    while at < text.len() && text[at] != '"' {
        at += if text[at] == '\\' { 2 } else { 1 };
    }
    (at + 1).min(text.len())
}

/// A literal with its continued lines joined, and with its escaped ends of lines as ends of lines.
fn joined(text: &str) -> String {
    let mut parts = text.split("\\\n");
    let first = parts.next().unwrap_or_default().to_string();
    parts.fold(first, |all, part| all + part.trim_start()).replace("\\n", "\n").replace("\\\"", "\"")
}

/// A text without its lines of commands, which are indented.
fn without_code(text: &str) -> String {
    let lines: Vec<&str> = text.split('\n').map(|line| if line.starts_with("  ") { "" } else { line }).collect();
    lines.join("\n")
}

/// A text with `` `x` `` for each hole of a format, which is code.
fn without_holes(text: &str) -> String {
    let mut found = String::new();
    let mut rest = text;
    while let Some((before, behind)) = rest.split_once('{') {
        found += before;
        let end = behind.find('}').filter(|end| !behind[..*end].contains([' ', '\n', '{']));
        match end {
            Some(end) => {
                found += "`x`";
                rest = &behind[end + 1..];
            }
            None => rest = behind,
        }
    }
    found + rest
}
