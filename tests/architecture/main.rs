//! What ARCHITECTURE.md promises of every crate: no circle of `use` among its files, and no file that is too long to be read at once.

mod exceptions;
mod modules;
mod source;

use exceptions::{CIRCLES, LONG};
use modules::Modules;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Most lines of a source file.
const MOST_LINES: usize = 500;

/// The folders of the workspace's crates.
fn crates() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let manifest = std::fs::read_to_string(root.join("Cargo.toml")).expect("the workspace has a manifest");
    let members = manifest.split("members = [").nth(1).and_then(|rest| rest.split(']').next()).expect("it names its members");
    let folders = members.split(',').map(|m| root.join(m.trim().trim_matches('"'))).filter(|f| f.join("src").is_dir());
    std::iter::once(root.to_path_buf()).chain(folders).collect()
}

/// All modules of all crates: of a crate with a library and a program each.
fn all() -> &'static [Modules] {
    static ALL: OnceLock<Vec<Modules>> = OnceLock::new();
    ALL.get_or_init(|| {
        let roots = crates().into_iter().flat_map(|folder| [folder.join("src/lib.rs"), folder.join("src/main.rs")]);
        roots.filter(|root| root.is_file()).map(|root| Modules::read(&root)).collect()
    })
}

fn name(file: &Path) -> String {
    let name = file.strip_prefix(env!("CARGO_MANIFEST_DIR")).unwrap_or(file);
    name.components().map(|c| c.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
}

#[test]
fn no_files_of_a_crate_use_each_other_in_a_circle() {
    let mut found = Vec::new();
    let mut excused = BTreeSet::new();
    for circle in all().iter().flat_map(Modules::circles) {
        let members: BTreeSet<String> = circle.iter().map(|(from, _)| name(from)).collect();
        if members.iter().all(|m| CIRCLES.contains(&m.as_str())) {
            excused.extend(members);
            continue;
        }
        let uses: Vec<String> = circle.iter().map(|(from, to)| format!("    {} uses {}", name(from), name(to))).collect();
        found.push(uses.join("\n"));
    }
    assert!(found.is_empty(), "{} circles: move what both sides need into a file of its own\n{}", found.len(), found.join("\n\n"));
    let clean: Vec<&&str> = CIRCLES.iter().filter(|c| !excused.contains(**c)).collect();
    assert!(clean.is_empty(), "no longer in a circle, so take them off CIRCLES in exceptions.rs: {clean:?}");
}

#[test]
fn no_source_file_is_too_long() {
    let all = all();
    let sizes: Vec<(String, usize)> = all.iter().flat_map(Modules::files).map(|(file, lines)| (name(file), lines)).collect();
    let long = |file: &str| sizes.iter().any(|(name, lines)| name == file && *lines > MOST_LINES);
    let found: Vec<String> = sizes
        .iter()
        .filter(|(file, lines)| *lines > MOST_LINES && !LONG.contains(&file.as_str()))
        .map(|(file, lines)| format!("{file} has {lines} lines"))
        .collect();
    assert!(found.is_empty(), "more than {MOST_LINES} lines: split by what the parts are about\n{}", found.join("\n"));
    let short: Vec<&&str> = LONG.iter().filter(|file| !long(file)).collect();
    assert!(short.is_empty(), "no longer too long, so take them off LONG in exceptions.rs: {short:?}");
}

#[test]
fn every_source_file_belongs_to_a_crate() {
    let all = all();
    let known: BTreeSet<PathBuf> = all.iter().flat_map(Modules::files).map(|(file, _)| file.to_path_buf()).collect();
    let tests: Vec<PathBuf> = all.iter().flat_map(Modules::test_files).collect();
    let mut found = Vec::new();
    let mut open: Vec<PathBuf> = crates().into_iter().map(|folder| folder.join("src")).collect();
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder can be read").flatten() {
            let path = entry.path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") && !known.contains(&path) && !tests.iter().any(|t| path.starts_with(t)) {
                found.push(name(&path));
            }
        }
    }
    assert!(found.is_empty(), "no `mod` names these files: {found:?}");
}

/// Of a crate in which `a` and `b` need each other through what their parent hands on, and `c` is used by both.
#[test]
fn a_circle_is_seen_through_what_is_handed_on_and_not_in_tests() {
    let folder = std::env::temp_dir().join(format!("backdrive-architecture-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder can be made");
    let put = |name: &str, text: &str| std::fs::write(folder.join(name), text).expect("a file can be written");
    put("lib.rs", "mod a;\nmod b;\nmod c;\npub use a::A;\nuse b::{self, B,};\npub const NONE: Option<&'static B> = None;\n");
    put("a.rs", "use super::B;\nuse crate::c::C;\npub struct A(B, C);\n");
    put("b.rs", "use crate::c::{self, C as Other};\npub struct B(Vec<Option<c::C>>, Other);\n#[cfg(test)]\nmod tests { use crate::A; }\n");
    put("c.rs", "// use super::A;\npub struct C(&'static str);\npub const TEXT: C = C(\"crate::A\");\n");
    let circles = || Modules::read(&folder.join("lib.rs")).circles().len();
    let before = circles();
    put("b.rs", "pub struct B(Box<super::A>);\n");
    let after = circles();
    std::fs::remove_dir_all(&folder).expect("the folder can be removed");
    assert_eq!((before, after), (0, 1));
}
