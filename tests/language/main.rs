//! The language of pages, doc comments and messages, and the links of pages.
//!
//! Two counts may only fall: sentences that are too long, and words that mean something only within this project. [`COMMITTED`] has the counts.
//! `cargo test --test language -- --nocapture` lists every place.

mod links;
mod literals;
mod prose;

use prose::{Sentence, doc_comments, plain, sentences};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Most words of a sentence.
const MOST_WORDS: usize = 40;

/// Most words of a sentence in a message.
const MOST_WORDS_OF_A_MESSAGE: usize = 30;

/// Words and phrases that `docs/glossary.md` has a term of the field for, or that a plainer word replaces.
const BANNED: &[&str] = &[
    "a physics",
    "anew",
    "as it is",
    "as it was",
    "by so many",
    "edge",
    "edges",
    "elsewhere",
    "floors",
    "given back",
    "go together",
    "goes with",
    "in so many",
    "in the place of",
    "its numbers",
    "left over",
    "leftover",
    "let go",
    "loop run again",
    "lopsided",
    "no fit has seen",
    "says",
    "slowness",
    "so many times",
    "stated numbers",
    "tells",
    "told",
    "wrong numbers",
];

/// Further words and phrases that no message has.
const BANNED_IN_MESSAGES: &[&str] = &[
    "as it stands",
    "by itself",
    "cannot be told",
    "is heard",
    "means nothing",
    "no physics",
    "nobody",
    "nothing shakes",
    "physics is missing",
    "run again with",
    "runs away",
    "said",
    "says nothing",
    "so many",
    "speaks",
    "taken up",
    "throughout",
    "turned round",
];

/// What is counted, where, and how often it may be. A count above fails; so does one below 95 % of it, so that the number here is lowered with it.
const COMMITTED: &[(Kind, Group, usize)] = &[
    (Kind::LongSentence, Group::Pages, 0),
    (Kind::LongSentence, Group::DocComments, 0),
    (Kind::BannedWord, Group::Pages, 0),
    (Kind::BannedWord, Group::DocComments, 0),
    (Kind::LongSentence, Group::Messages, 19),
    (Kind::BannedWord, Group::Messages, 0),
];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    LongSentence,
    BannedWord,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Group {
    /// README, ARCHITECTURE, CHANGELOG and everything in `docs/`.
    Pages,
    /// `///` and `//!` of every Rust file.
    DocComments,
    /// String literals of every Rust file that a user runs.
    Messages,
}

/// A place that counts.
#[derive(Debug, PartialEq)]
struct Found {
    line: usize,
    /// Words of a long sentence; 1 for a word.
    size: usize,
    text: String,
}

impl Kind {
    fn find(self, group: Group, sentence: &Sentence) -> Vec<Found> {
        match self {
            Kind::LongSentence if sentence.words.len() > if group == Group::Messages { MOST_WORDS_OF_A_MESSAGE } else { MOST_WORDS } => {
                let begin: Vec<&str> = sentence.words.iter().take(8).map(|(word, _)| word.as_str()).collect();
                vec![Found { line: sentence.line, size: sentence.words.len(), text: begin.join(" ").replace('\u{1}', "`...`") }]
            }
            Kind::LongSentence => Vec::new(),
            Kind::BannedWord if group == Group::Messages => banned(sentence, &[BANNED, BANNED_IN_MESSAGES].concat()),
            Kind::BannedWord => banned(sentence, BANNED),
        }
    }
}

fn banned(sentence: &Sentence, phrases: &[&str]) -> Vec<Found> {
    let words: Vec<String> = sentence.words.iter().map(|(word, _)| plain(word)).collect();
    let at = |phrase: &str| {
        let phrase: Vec<&str> = phrase.split(' ').collect();
        (0..words.len()).filter(|at| words[*at..].len() >= phrase.len() && words[*at..].iter().zip(&phrase).all(|(a, b)| a == b)).collect()
    };
    let lines = |phrase: &&str| -> Vec<Found> {
        let found: Vec<usize> = at(phrase);
        found.into_iter().map(|at| Found { line: sentence.words[at].1, size: 1, text: phrase.to_string() }).collect()
    };
    phrases.iter().flat_map(lines).collect()
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The files below a folder whose names end so, without those of builds; paths from the root, sorted.
fn files(folder: &str, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![PathBuf::from(folder)];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(root().join(&folder)).expect("a folder can be read").flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let path = folder.join(&name);
            match entry.file_type().expect("an entry has a type") {
                kind if kind.is_dir() && !name.starts_with('.') && name != "target" => open.push(path),
                kind if kind.is_file() && name.ends_with(ending) => found.push(path),
                _ => {}
            }
        }
    }
    found.sort();
    found
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The sentences of a group, by file.
fn sentences_of(group: Group) -> Vec<(PathBuf, Vec<Sentence>)> {
    match group {
        Group::Pages => {
            let pages = ["README.md", "ARCHITECTURE.md", "CHANGELOG.md"].map(PathBuf::from).into_iter().chain(files("docs", ".md"));
            pages.map(|path| (path.clone(), sentences(&read(&path)))).collect()
        }
        Group::DocComments => files("", ".rs").into_iter().map(|path| (path.clone(), of_comments(&read(&path)))).collect(),
        Group::Messages => {
            let read_by_users = files("", ".rs").into_iter().filter(|path| !is_for_developers(path));
            read_by_users.map(|path| (path.clone(), of_messages(&read(&path)))).collect()
        }
    }
}

/// Whether a Rust file is a test, a bench, an example or a study.
fn is_for_developers(path: &Path) -> bool {
    let folders = ["tests", "benches", "examples", "studies"];
    path.ends_with("tests.rs") || path.components().any(|part| folders.iter().any(|folder| part.as_os_str() == *folder))
}

/// The sentences of a Rust file's doc comments, with lines of the file.
fn of_comments(rust: &str) -> Vec<Sentence> {
    shifted(doc_comments(rust))
}

/// The sentences of a Rust file's messages, with the line at which each message begins.
fn of_messages(rust: &str) -> Vec<Sentence> {
    let of_one = |(line, text): (usize, String)| {
        sentences(&text)
            .into_iter()
            .map(move |sentence| Sentence { line, words: sentence.words.into_iter().map(|(word, _)| (word, line)).collect() })
    };
    literals::messages(rust).into_iter().flat_map(of_one).collect()
}

fn shifted(texts: Vec<(usize, String)>) -> Vec<Sentence> {
    let shifted = |(first, comment): (usize, String)| {
        sentences(&comment).into_iter().map(move |sentence| Sentence {
            line: sentence.line + first - 1,
            words: sentence.words.into_iter().map(|(word, line)| (word, line + first - 1)).collect(),
        })
    };
    texts.into_iter().flat_map(shifted).collect()
}

/// What is wrong with a count, if anything.
fn against(committed: usize, count: usize) -> Option<&'static str> {
    match count {
        _ if count > committed => Some("too many: write shorter sentences and the terms of docs/glossary.md"),
        _ if count * 20 < committed * 19 => Some("fewer than committed: lower the number in COMMITTED, tests/language/main.rs"),
        _ => None,
    }
}

#[test]
fn long_sentences_and_private_words_only_become_fewer() {
    let mut wrong = Vec::new();
    for group in [Group::Pages, Group::DocComments, Group::Messages] {
        let files = sentences_of(group);
        for (kind, _, committed) in COMMITTED.iter().filter(|(_, of, _)| *of == group) {
            let mut all: Vec<(&Path, Found)> = Vec::new();
            for (path, sentences) in &files {
                all.extend(sentences.iter().flat_map(|sentence| kind.find(group, sentence)).map(|found| (path.as_path(), found)));
            }
            all.sort_by_key(|(_, found)| std::cmp::Reverse(found.size));
            let place = |(path, found): &(&Path, Found)| format!("    {}:{}  {} ({})", path.display(), found.line, found.text, found.size);
            all.iter().for_each(|found| println!("{kind:?} {group:?}{}", place(found)));
            let mut by_file: BTreeMap<&Path, usize> = BTreeMap::new();
            all.iter().for_each(|(path, _)| *by_file.entry(path).or_default() += 1);
            let mut by_file: Vec<(&Path, usize)> = by_file.into_iter().collect();
            by_file.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
            let by_file: Vec<String> = by_file.iter().take(12).map(|(path, count)| format!("{} {count}", path.display())).collect();
            println!("{kind:?} in {group:?}: {}, committed {committed}", all.len());
            if let Some(why) = against(*committed, all.len()) {
                let worst: Vec<String> = all.iter().take(15).map(place).collect();
                let head = format!("{kind:?} in {group:?}: {}, committed {committed}; {why}", all.len());
                wrong.push(format!("{head}\n  most: {}\n{}", by_file.join(", "), worst.join("\n")));
            }
        }
    }
    assert!(wrong.is_empty(), "{}\nall of them: cargo test --test language -- --nocapture", wrong.join("\n"));
}

#[test]
fn a_count_may_neither_rise_nor_stand_far_above_the_text() {
    let is_fine = |committed, count| against(committed, count).is_none();
    assert!(is_fine(0, 0) && is_fine(100, 100) && is_fine(100, 95));
    assert!(!is_fine(0, 1) && !is_fine(100, 101) && !is_fine(100, 94) && !is_fine(3, 2));
}

#[test]
fn sentences_are_separated_and_code_is_left_out() {
    let text = "# A heading\n\nOne two, e.g. three. *Four\nfive* (J. Doe and 1.5 m). Six?\n```\nNo word. Here.\n```\n- an item\n  goes on\n- another `one. two`\n\n\
                | a cell. of two | `a | b` |\n|---|---|\n\nBefore:\n\n    an = equation. here\n\nA [link of four](to/some where.md) <!-- no word --> ends. Last";
    let found: Vec<(usize, usize)> = sentences(text).iter().map(|s| (s.line, s.words.len())).collect();
    let expected = [(1, 2), (3, 4), (3, 7), (4, 1), (8, 4), (10, 2), (12, 2), (12, 2), (12, 1), (15, 1), (19, 5), (19, 1)];
    assert_eq!(found, expected);
}

#[test]
fn doc_comments_are_found_with_their_lines() {
    let rust = "//! Of the file.\n\n/// One\n/// sentence.\n//// none\n// none\n    /// Another.\nfn f() {}\n";
    assert_eq!(doc_comments(rust).iter().map(|(line, _)| *line).collect::<Vec<_>>(), [1, 3, 7]);
    let found: Vec<(usize, usize)> = of_comments(rust).iter().map(|s| (s.line, s.words.len())).collect();
    assert_eq!(found, [(1, 3), (3, 2), (7, 1)]);
}

#[test]
fn a_long_sentence_and_a_banned_word_are_found_at_their_line() {
    let long = format!("Short.\n{} end.", "word ".repeat(MOST_WORDS));
    let just = format!("{}end.", "word ".repeat(MOST_WORDS - 1));
    let count = |kind: Kind, text: &str| -> Vec<(usize, usize)> {
        sentences(text).iter().flat_map(|s| kind.find(Group::Pages, s)).map(|found| (found.line, found.size)).collect()
    };
    assert_eq!(count(Kind::LongSentence, &long), [(2, MOST_WORDS + 1)]);
    assert!(count(Kind::LongSentence, &just).is_empty());
    let text = "It is Told, as\nit is, at the edge's `edge`: *elsewhere*. Foretold, hedge.";
    let words: Vec<(String, usize)> =
        sentences(text).iter().flat_map(|s| Kind::BannedWord.find(Group::Pages, s)).map(|found| (found.text, found.line)).collect();
    let expected = [("as it is", 1), ("edge", 2), ("elsewhere", 2), ("told", 1)];
    assert_eq!(words, expected.map(|(word, line)| (word.to_string(), line)));
}

#[test]
fn messages_are_found_with_their_lines_and_without_holes_and_tests() {
    let rust = "// \"no one\"\nlet a = \"One {b:.3} two\"; let c = ['\"', '\\''];\nlet d = r#\"Three \"four\" five\"#;\n\
                let e = \"six \\\n    seven\"; \"eight\"\n\n#[cfg(test)]\nmod tests {\n\"no one\"\n}\n";
    let expected = [(2, "One `x` two"), (3, "Three \"four\" five"), (4, "six seven")];
    assert_eq!(literals::messages(rust), expected.map(|(line, text)| (line, text.to_string())));
    let said = of_messages("f(\"It tells\", 1);\ng(\"and says nothing of {a}.\");\n");
    let words: Vec<(usize, String)> =
        said.iter().flat_map(|s| Kind::BannedWord.find(Group::Messages, s)).map(|found| (found.line, found.text)).collect();
    assert_eq!(words, [(1, "tells".to_string()), (2, "says".to_string()), (2, "says nothing".to_string())]);
}
