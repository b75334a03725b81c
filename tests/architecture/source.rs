//! Rust source as words, without comments, texts and tests: enough to see which module a file speaks of.

/// What a file holds outside of its tests.
#[derive(Debug, Default)]
pub struct Source {
    /// Words and single signs, `::` as one.
    pub words: Vec<String>,
    /// Modules that it declares in files of their own.
    pub modules: Vec<String>,
    /// Modules that it declares for tests only.
    pub test_modules: Vec<String>,
    /// Names of its types, functions, constants and macros.
    pub items: Vec<String>,
    /// What it imports.
    pub uses: Vec<Import>,
}

/// One name of a `use`.
#[derive(Debug, Clone)]
pub struct Import {
    /// Its path, such as `["super", "graph", "Graph"]`; of a glob the last is `*`.
    pub path: Vec<String>,
    /// What it is called here.
    pub name: String,
}

impl Source {
    /// Reads a file's text.
    pub fn read(text: &str) -> Source {
        let mut source = Source::default();
        let words = without_tests(words(text), &mut source.test_modules);
        let mut at = 0;
        while at < words.len() {
            let (word, next) = (words[at].as_str(), words.get(at + 1).map(String::as_str));
            match word {
                "mod" if words.get(at + 2).is_some_and(|w| w == ";") => source.modules.extend(next.map(str::to_string)),
                "use" if at == 0 || [";", "}", "{", "]", ")", "pub"].contains(&words[at - 1].as_str()) => {
                    let end = (at..words.len()).find(|i| words[*i] == ";").unwrap_or(words.len());
                    tree(&words[at + 1..end], &[], &mut source.uses);
                    at = end;
                }
                "fn" | "struct" | "enum" | "trait" | "type" | "const" | "static" | "union" => source.items.extend(next.map(str::to_string)),
                "macro_rules" => source.items.extend(words.get(at + 2).cloned()),
                _ => {}
            }
            at += 1;
        }
        source.modules.extend(registered(&words));
        source.words = words;
        source
    }

    /// Paths of at least two names outside of `use`, such as `["cli", "Run"]`.
    pub fn paths(&self) -> Vec<Vec<String>> {
        let mut found = Vec::new();
        let mut at = 0;
        while at < self.words.len() {
            if self.words[at] == "use" {
                at = (at..self.words.len()).find(|i| self.words[*i] == ";").unwrap_or(self.words.len());
                continue;
            }
            let mut end = at;
            let mut path = Vec::new();
            while end < self.words.len() && is_name(&self.words[end]) {
                path.push(self.words[end].clone());
                if self.words.get(end + 1).is_none_or(|w| w != "::") || self.words.get(end + 2).is_none_or(|w| !is_name(w)) {
                    break;
                }
                end += 2;
            }
            let leads = at == 0 || self.words[at - 1] != "::";
            if path.len() > 1 && leads {
                found.push(path);
            }
            at = end + 1;
        }
        found
    }
}

/// Modules that a macro `register!` of the file declares (`mod $name;`): in each line of its call the word before `::`, or else the last one.
fn registered(words: &[String]) -> Vec<String> {
    let declares = words.windows(4).any(|w| w[0] == "mod" && w[1] == "$" && w[3] == ";");
    let call = words.windows(3).position(|w| w[0] == "register" && w[1] == "!" && w[2] == "(");
    let Some(at) = call.filter(|_| declares) else { return Vec::new() };
    let end = words[at..].iter().position(|w| w == ")").map_or(words.len(), |i| at + i);
    let name = |line: &[String]| {
        let before = line.iter().position(|w| w == "::").and_then(|i| line.get(i.checked_sub(1)?));
        before.or(line.last()).cloned()
    };
    words[at + 3..end].split(|w| w == ",").filter_map(name).collect()
}

fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// The names of a `use` tree.
fn tree(words: &[String], before: &[String], found: &mut Vec<Import>) {
    let mut path = before.to_vec();
    let mut at = 0;
    while at < words.len() {
        match words[at].as_str() {
            "::" => {}
            "{" => {
                // Behind a last comma is nothing.
                for part in parts(&words[at + 1..]).into_iter().filter(|part| !part.is_empty()) {
                    tree(part, &path, found);
                }
                return;
            }
            "as" => {
                let name = words.get(at + 1).cloned().unwrap_or_default();
                found.push(Import { path, name });
                return;
            }
            word => path.push(word.to_string()),
        }
        at += 1;
    }
    // `a::{self}` is `a`.
    if path.last().is_some_and(|w| w == "self") && path.len() > 1 {
        path.pop();
    }
    if let Some(name) = path.last().cloned() {
        found.push(Import { path, name });
    }
}

/// What commas part within one pair of braces, from behind the opening one.
fn parts(words: &[String]) -> Vec<&[String]> {
    let (mut found, mut depth, mut start) = (Vec::new(), 0, 0);
    for (at, word) in words.iter().enumerate() {
        match word.as_str() {
            "{" => depth += 1,
            "}" if depth == 0 => {
                found.push(&words[start..at]);
                return found;
            }
            "}" => depth -= 1,
            "," if depth == 0 => {
                found.push(&words[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    found
}

/// Drops every item that is for tests only; the modules among them in files of their own are named in `test_modules`.
fn without_tests(words: Vec<String>, test_modules: &mut Vec<String>) -> Vec<String> {
    let mut kept = Vec::new();
    let mut at = 0;
    while at < words.len() {
        let test = ["#", "[", "cfg", "(", "test"].iter().enumerate().all(|(i, w)| words.get(at + i).is_some_and(|x| x == w));
        if !test {
            kept.push(words[at].clone());
            at += 1;
            continue;
        }
        let mut depth = 0;
        at = (at..words.len()).find(|i| words[*i] == "]").unwrap_or(words.len());
        let start = at + 1;
        while at + 1 < words.len() {
            at += 1;
            match words[at].as_str() {
                "{" => depth += 1,
                "}" if depth <= 1 => break,
                "}" => depth -= 1,
                ";" if depth == 0 => {
                    let item = &words[start..at];
                    if let Some(i) = item.iter().position(|w| w == "mod") {
                        test_modules.extend(item.get(i + 1).cloned());
                    }
                    break;
                }
                _ => {}
            }
        }
        at += 1;
    }
    kept
}

/// Names and signs of a text, without comments and with every literal text, character and lifetime left out.
fn words(text: &str) -> Vec<String> {
    let chars: Vec<char> = text.chars().collect();
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let mut found = Vec::new();
    let mut i = 0;
    while i < chars.len() {
        let c = chars[i];
        if c.is_whitespace() {
            i += 1;
        } else if c == '/' && at(i + 1) == '/' {
            i = (i..chars.len()).find(|j| chars[*j] == '\n').unwrap_or(chars.len());
        } else if c == '/' && at(i + 1) == '*' {
            i = (i + 2..chars.len()).find(|j| chars[*j] == '*' && at(j + 1) == '/').map_or(chars.len(), |j| j + 2);
        } else if let Some(end) = raw_text(&chars, i) {
            i = end;
        } else if c == '"' {
            i = quoted(&chars, i, '"');
        } else if c == '\'' {
            // A character, or a lifetime, whose name (`'static`) is no word of the text.
            let name = || (i + 1..chars.len()).find(|j| !(chars[*j].is_alphanumeric() || chars[*j] == '_')).unwrap_or(chars.len());
            i = if at(i + 1) == '\\' || at(i + 2) == '\'' { quoted(&chars, i, '\'') } else { name() };
        } else if c.is_alphanumeric() || c == '_' {
            let end = (i..chars.len()).find(|j| !(chars[*j].is_alphanumeric() || chars[*j] == '_')).unwrap_or(chars.len());
            found.push(chars[i..end].iter().collect());
            i = end;
        } else if c == ':' && at(i + 1) == ':' {
            found.push("::".to_string());
            i += 2;
        } else {
            found.push(c.to_string());
            i += 1;
        }
    }
    found
}

/// The end of a text such as `r#"..."#` that begins here.
fn raw_text(chars: &[char], start: usize) -> Option<usize> {
    let before = start.checked_sub(1).and_then(|i| chars.get(i));
    if chars[start] != 'r' || before.is_some_and(|c| (c.is_alphanumeric() && *c != 'b') || *c == '_') {
        return None;
    }
    let hashes = chars[start + 1..].iter().take_while(|c| **c == '#').count();
    let open = start + 1 + hashes;
    if chars.get(open) != Some(&'"') {
        return None;
    }
    let closes = |j: &usize| chars[*j] == '"' && chars[j + 1..].iter().take_while(|c| **c == '#').count() >= hashes;
    Some((open + 1..chars.len()).find(closes).map_or(chars.len(), |j| j + 1 + hashes))
}

/// The end of what is quoted from here.
fn quoted(chars: &[char], start: usize, quote: char) -> usize {
    let mut i = start + 1;
    while i < chars.len() && chars[i] != quote {
        i += if chars[i] == '\\' { 2 } else { 1 };
    }
    i + 1
}
