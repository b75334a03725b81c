//! The sentences of a Markdown text, without its code.

/// A sentence, or the whole text of a heading or table cell.
#[derive(Debug)]
pub struct Sentence {
    /// The line on which it begins, from 1.
    pub line: usize,
    /// Its words with the line of each. A code span is one word.
    pub words: Vec<(String, usize)>,
}

/// What stands for a code span.
const CODE: char = '\u{1}';

/// Words with a full stop that end no sentence.
const ABBREVIATIONS: [&str; 14] =
    ["e.g.", "i.e.", "etc.", "vs.", "cf.", "fig.", "eq.", "no.", "al.", "approx.", "ca.", "sec.", "pp.", "vol."];

/// Characters with the line of each.
type Chars = Vec<(char, usize)>;

/// Every sentence of a Markdown text, in its order.
pub fn sentences(markdown: &str) -> Vec<Sentence> {
    blocks(markdown).into_iter().flat_map(|block| split(&without_markup(&block))).collect()
}

/// The doc comments of a Rust file (`///` and `//!`), each as Markdown with the number of its first line, from 1.
pub fn doc_comments(rust: &str) -> Vec<(usize, String)> {
    let mut found: Vec<(usize, String)> = Vec::new();
    let mut last = (0, "");
    for (number, line) in (1..).zip(rust.lines()) {
        let line = line.trim_start();
        let marker = if line.starts_with("//!") {
            "//!"
        } else if line.starts_with("///") && !line.starts_with("////") {
            "///"
        } else {
            continue;
        };
        let text = line[3..].strip_prefix(' ').unwrap_or(&line[3..]);
        match found.last_mut().filter(|_| last == (number - 1, marker)) {
            Some((_, comment)) => *comment += &format!("\n{text}"),
            None => found.push((number, text.to_string())),
        }
        last = (number, marker);
    }
    found
}

/// The lines of a Markdown text that are no code block, each with its number, from 1.
pub fn lines_outside_code(markdown: &str) -> Vec<(usize, &str)> {
    let (mut fence, mut in_list, mut after_blank, mut in_code) = (None, false, true, false);
    let mut found = Vec::new();
    for (number, line) in (1..).zip(markdown.lines()) {
        let trimmed = line.trim_start();
        let mark = ["```", "~~~"].into_iter().find(|mark| trimmed.starts_with(mark));
        match (fence, mark) {
            (None, Some(_)) => fence = mark,
            (Some(open), Some(mark)) if open == mark => fence = None,
            (Some(_), _) => {}
            (None, None) => {
                in_code = line.starts_with("    ") && !in_list && (after_blank || in_code);
                if !in_code {
                    found.push((number, line));
                }
                if item(trimmed).is_some() {
                    in_list = true;
                } else if !trimmed.is_empty() && trimmed.len() == line.len() && after_blank {
                    in_list = false;
                }
            }
        }
        after_blank = trimmed.is_empty();
    }
    found
}

/// What stands behind the mark of a list's item.
fn item(line: &str) -> Option<&str> {
    let digits = line.len() - line.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let rest = match digits {
        0 => line.strip_prefix(['-', '*', '+'])?,
        _ => line[digits..].strip_prefix(['.', ')'])?,
    };
    rest.strip_prefix(' ')
}

/// Paragraphs, items, headings and cells.
fn blocks(markdown: &str) -> Vec<Chars> {
    let mut found: Vec<Chars> = vec![Vec::new()];
    let mut before = 0;
    for (number, line) in lines_outside_code(markdown) {
        let text = line.trim().trim_start_matches('>').trim_start();
        let is_new = number != before + 1 || text.is_empty();
        before = number;
        let chars = |text: &str| -> Chars { text.chars().map(|c| (c, number)).chain([(' ', number)]).collect() };
        if text.starts_with('#') {
            found.push(chars(text.trim_start_matches('#')));
            found.push(Vec::new());
        } else if text.starts_with('|') {
            let row = without_code(&chars(text));
            found.extend(row.split(|(c, _)| *c == '|').map(<[_]>::to_vec));
            found.push(Vec::new());
        } else if let Some(text) = item(text) {
            found.push(chars(text));
        } else if is_new {
            found.push(chars(text));
        } else if let Some(block) = found.last_mut() {
            block.extend(chars(text));
        }
    }
    found
}

/// Each code span as one character.
fn without_code(text: &[(char, usize)]) -> Chars {
    let run = |at: usize| text[at..].iter().take_while(|(c, _)| *c == '`').count();
    let mut found = Vec::new();
    let mut at = 0;
    while at < text.len() {
        let ticks = run(at);
        let mut end = at + ticks;
        while ticks > 0 && end < text.len() && run(end) != ticks {
            end += run(end).max(1);
        }
        if ticks > 0 && end < text.len() {
            found.push((CODE, text[at].1));
            at = end + ticks;
        } else {
            found.extend_from_slice(&text[at..at + ticks.max(1)]);
            at += ticks.max(1);
        }
    }
    found
}

/// Without code spans, tags, comments and the addresses of links.
fn without_markup(text: &[(char, usize)]) -> Chars {
    let text = without_code(text);
    let starts = |at: usize, mark: &str| mark.chars().enumerate().all(|(i, c)| text.get(at + i).is_some_and(|(t, _)| *t == c));
    let behind = |at: usize, mark: &str| (at..text.len()).find(|i| starts(*i, mark)).map(|i| i + mark.len());
    let mut found = Vec::new();
    let mut at = 0;
    while at < text.len() {
        let is_tag = starts(at, "<") && text.get(at + 1).is_some_and(|(c, _)| c.is_alphabetic() || *c == '/');
        let end = if starts(at, "<!--") {
            behind(at, "-->")
        } else if is_tag {
            behind(at, ">")
        } else if starts(at, "](") {
            behind(at, ")")
        } else {
            None
        };
        match end {
            Some(end) => at = end,
            None => {
                found.push(text[at]);
                at += 1;
            }
        }
    }
    found
}

/// The sentences of one block.
fn split(block: &[(char, usize)]) -> Vec<Sentence> {
    let mut found = Vec::new();
    let mut words: Vec<(String, usize)> = Vec::new();
    let end = |words: &mut Vec<(String, usize)>, found: &mut Vec<Sentence>| {
        if let Some((_, line)) = words.first() {
            found.push(Sentence { line: *line, words: std::mem::take(words) });
        }
    };
    for token in block.split(|(c, _)| c.is_whitespace()).filter(|token| !token.is_empty()) {
        let word: String = token.iter().map(|(c, _)| *c).collect();
        if word.contains(|c: char| c.is_alphanumeric() || c == CODE) {
            words.push((word.clone(), token[0].1));
        }
        if ends_a_sentence(&word) {
            end(&mut words, &mut found);
        }
    }
    end(&mut words, &mut found);
    found
}

fn ends_a_sentence(word: &str) -> bool {
    let word = word.trim_end_matches([')', ']', '"', '\'', '*', '_', '”', '’']).trim_start_matches(['(', '[', '"', '*', '_']);
    let initial = word.len() == 2 && word.starts_with(char::is_uppercase);
    word.ends_with(['.', '!', '?']) && !initial && !ABBREVIATIONS.contains(&word.to_lowercase().as_str())
}

/// A word for comparison: without signs about it and in lower case.
pub fn plain(word: &str) -> String {
    let word = word.trim_matches(|c: char| !c.is_alphanumeric() && c != CODE).to_lowercase();
    word.strip_suffix("'s").or(word.strip_suffix("’s")).map(str::to_string).unwrap_or(word)
}
