//! Links of pages: every one leads to a file and a heading that exist, and the index leads to every page.

use crate::prose::lines_outside_code;
use crate::{files, read, root};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

/// The targets of a page's links and pictures, each with its line.
fn links(markdown: &str) -> Vec<(usize, String)> {
    let of_line = |(number, line): (usize, &str)| {
        // Code spans alternate with text; a span over two lines holds no link.
        let text: String = line.split('`').step_by(2).collect::<Vec<_>>().join("x");
        let targets = text.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(target, _)| target.to_string());
        targets.map(|target| (number, target)).collect::<Vec<_>>()
    };
    lines_outside_code(markdown).into_iter().flat_map(of_line).collect()
}

/// The anchors of a page, as GitHub makes them of its headings.
fn anchors(markdown: &str) -> BTreeSet<String> {
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    let mut found = BTreeSet::new();
    for (_, line) in lines_outside_code(markdown).into_iter().filter(|(_, line)| line.starts_with('#')) {
        let slug = slug(line.trim_start_matches('#').trim());
        let count = seen.entry(slug.clone()).or_default();
        found.insert(if *count == 0 { slug } else { format!("{slug}-{count}") });
        *count += 1;
    }
    found
}

fn slug(heading: &str) -> String {
    // Of a link only its text counts.
    let mut text = String::new();
    let mut rest = heading;
    while let Some((before, after)) = rest.split_once("](") {
        text += before;
        rest = after.split_once(')').map_or("", |(_, behind)| behind);
    }
    text += rest;
    let kept = text.to_lowercase().chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_')).collect::<String>();
    kept.replace(' ', "-")
}

/// A path without `.` and `..`.
fn normal(path: &Path) -> PathBuf {
    let mut found = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if found.pop() => {}
            part => found.push(part),
        }
    }
    found
}

/// What is wrong with a link of a page, if anything.
fn wrong(page: &Path, target: &str) -> Option<String> {
    if target.contains("://") || target.starts_with("mailto:") {
        return None;
    }
    let (path, anchor) = target.split_once('#').map_or((target, None), |(path, anchor)| (path, Some(anchor)));
    let path = if path.is_empty() { page.to_path_buf() } else { normal(&page.parent().unwrap_or(Path::new("")).join(path)) };
    if !root().join(&path).exists() {
        return Some(format!("there is no {}", path.display()));
    }
    let anchor = anchor.filter(|_| path.extension().is_some_and(|e| e == "md"))?;
    (!anchors(&read(&path)).contains(anchor)).then(|| format!("{} has no heading of the anchor #{anchor}", path.display()))
}

#[test]
fn every_link_of_a_page_leads_to_a_file_and_a_heading() {
    let mut found = Vec::new();
    for page in files("", ".md") {
        for (line, target) in links(&read(&page)) {
            found.extend(wrong(&page, &target).map(|why| format!("{}:{line}  ({target}) {why}", page.display())));
        }
    }
    assert!(found.is_empty(), "{} links lead nowhere\n{}", found.len(), found.join("\n"));
}

#[test]
fn every_page_that_a_source_names_exists() {
    let mut found = Vec::new();
    // Of this test itself nothing counts: it names pages that must not exist.
    for path in files("", ".rs").into_iter().chain(files("", ".toml")).filter(|path| !path.starts_with("tests/language")) {
        for (number, line) in (1..).zip(read(&path).lines()) {
            for rest in line.split("docs/").skip(1) {
                let name: String = rest.chars().take_while(|c| c.is_alphanumeric() || matches!(c, '-' | '_' | '.' | '/')).collect();
                let name = name.trim_end_matches('.');
                if name.ends_with(".md") && !root().join("docs").join(name).exists() {
                    found.push(format!("{}:{number}  docs/{name}", path.display()));
                }
            }
        }
    }
    assert!(found.is_empty(), "pages that do not exist are named\n{}", found.join("\n"));
}

#[test]
fn the_index_and_the_book_lead_to_every_page() {
    let [index, summary] = ["docs/README.md", "docs/SUMMARY.md"].map(Path::new);
    for list in [index, summary] {
        let file = |target: String| normal(&Path::new("docs").join(target.split('#').next().unwrap_or_default()));
        let linked: BTreeSet<PathBuf> = links(&read(list)).into_iter().map(|(_, target)| file(target)).collect();
        let pages = files("docs", ".md").into_iter().filter(|page| page != index && page != summary && !linked.contains(page));
        let lone: Vec<String> = pages.map(|page| page.display().to_string()).collect();
        assert!(lone.is_empty(), "{} does not link {}", list.display(), lone.join(", "));
    }
}

#[test]
fn links_and_anchors_are_read_as_github_does() {
    let page = "# One *thing*, in order\n\n[a](b.md#c) and ![d](e/f.svg) `[no](link)` [g](https://h.i)\n\
                ```\n[no](link)\n# none\n```\n## One `x`\n## One x\n";
    assert_eq!(links(page), [(3, "b.md#c".to_string()), (3, "e/f.svg".to_string()), (3, "https://h.i".to_string())]);
    assert_eq!(anchors(page), BTreeSet::from(["one-thing-in-order", "one-x", "one-x-1"].map(str::to_string)));
    assert_eq!(slug("The [real](docs/x.md#y) one: `a_b`?"), "the-real-one-a_b");
    let page = Path::new("docs/guide.md");
    assert_eq!(wrong(page, "https://h.i/none.md"), None);
    assert_eq!(wrong(page, "../README.md#read-on"), None);
    assert!(wrong(page, "../README.md#none").is_some() && wrong(page, "none.md").is_some());
}
