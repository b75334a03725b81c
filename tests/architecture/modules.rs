//! The modules of one crate, and which file uses which.

use crate::source::Source;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A module in a file of its own.
struct Module {
    file: PathBuf,
    /// Where its children are.
    folder: PathBuf,
    parent: Option<usize>,
    children: BTreeMap<String, usize>,
    source: Source,
    lines: usize,
}

/// All modules of a crate that are not for tests; the first is the root.
pub struct Modules(Vec<Module>);

/// How often a name may be handed on by `pub use` before it is given up.
const MOST_STEPS: usize = 12;

impl Modules {
    /// Reads `root`, such as `src/lib.rs`, and every file that it declares.
    ///
    /// # Panics
    /// Where a declared file cannot be read.
    pub fn read(root: &Path) -> Modules {
        let mut modules = Modules(Vec::new());
        let folder = root.parent().expect("a file is in a folder").to_path_buf();
        modules.add(root.to_path_buf(), folder, None);
        modules
    }

    fn add(&mut self, file: PathBuf, folder: PathBuf, parent: Option<usize>) -> usize {
        let text = std::fs::read_to_string(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        let source = Source::read(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        let (index, names) = (self.0.len(), source.modules.clone());
        self.0.push(Module { file, folder: folder.clone(), parent, children: BTreeMap::new(), source, lines: text.lines().count() });
        for name in names {
            let (flat, nested) = (folder.join(format!("{name}.rs")), folder.join(&name));
            let file = if flat.is_file() { flat } else { nested.join("mod.rs") };
            let child = self.add(file, nested, Some(index));
            self.0[index].children.insert(name, child);
        }
        index
    }

    /// Its files with their number of lines.
    pub fn files(&self) -> impl Iterator<Item = (&Path, usize)> {
        self.0.iter().map(|m| (m.file.as_path(), m.lines))
    }

    /// Files that only tests declare.
    pub fn test_files(&self) -> Vec<PathBuf> {
        let of = |m: &Module| {
            let names = m.source.test_modules.clone().into_iter();
            let folder = m.folder.clone();
            names
                .flat_map(move |name| [folder.join(format!("{name}.rs")), folder.join(&name).join("mod.rs"), folder.join(name)])
                .collect::<Vec<_>>()
        };
        self.0.iter().flat_map(of).collect()
    }

    /// Groups of files that use each other in a circle; each with the uses that hold it together.
    pub fn circles(&self) -> Vec<Vec<(PathBuf, PathBuf)>> {
        let uses: Vec<BTreeSet<usize>> = (0..self.0.len()).map(|m| self.used_by(m)).collect();
        let reach: Vec<BTreeSet<usize>> = (0..uses.len()).map(|m| reachable(&uses, m)).collect();
        let mut done = BTreeSet::new();
        let mut found = Vec::new();
        for start in 0..uses.len() {
            if !reach[start].contains(&start) || done.contains(&start) {
                continue;
            }
            let group: BTreeSet<usize> = reach[start].iter().copied().filter(|m| reach[*m].contains(&start)).collect();
            let file = |m: &usize| self.0[*m].file.clone();
            let inside = |m: &usize| uses[*m].intersection(&group).map(|to| (file(m), file(to))).collect::<Vec<_>>();
            found.push(group.iter().flat_map(inside).collect());
            done.extend(group);
        }
        found
    }

    /// The modules whose items a module uses.
    fn used_by(&self, module: usize) -> BTreeSet<usize> {
        let source = &self.0[module].source;
        let imports = source.uses.iter().map(|u| u.path.clone());
        let all = imports.chain(source.paths.iter().cloned());
        all.filter_map(|path| self.home(module, &path, MOST_STEPS)).filter(|m| *m != module).collect()
    }

    /// The module that a path seen in `module` leads to: where its last name is defined, not where it is handed on.
    fn home(&self, module: usize, path: &[String], steps: usize) -> Option<usize> {
        if steps == 0 {
            return None;
        }
        let first = path.first()?;
        let (mut at, mut rest) = match first.as_str() {
            "crate" => (0, &path[1..]),
            "self" => (module, &path[1..]),
            "super" => (self.0[module].parent?, &path[1..]),
            name => match (self.0[module].children.get(name), self.import(module, name)) {
                (Some(child), _) => (*child, &path[1..]),
                // A name that is imported here under itself would be looked for again and again.
                (None, Some(import)) if import[0] != *name => {
                    let whole: Vec<String> = import.iter().chain(&path[1..]).cloned().collect();
                    return self.home(module, &whole, steps - 1);
                }
                _ => return None,
            },
        };
        while let Some(name) = rest.first() {
            if name == "super" {
                at = self.0[at].parent?;
            } else if let Some(child) = self.0[at].children.get(name) {
                at = *child;
            } else if self.0[at].source.items.contains(name) {
                return Some(at);
            } else if let Some(import) = self.import(at, name) {
                let whole: Vec<String> = import.iter().chain(&rest[1..]).cloned().collect();
                return self.home(at, &whole, steps - 1).or(Some(at));
            } else {
                return self.by_glob(at, rest, steps).or(Some(at));
            }
            rest = &rest[1..];
        }
        Some(at)
    }

    fn import(&self, module: usize, name: &str) -> Option<&Vec<String>> {
        self.0[module].source.uses.iter().find(|u| u.name == name && u.path.last().is_some_and(|w| w != "*")).map(|u| &u.path)
    }

    /// The same through `use ...::*`, where a glob leads to a module that defines the name.
    fn by_glob(&self, module: usize, rest: &[String], steps: usize) -> Option<usize> {
        let globs = self.0[module].source.uses.iter().filter(|u| u.path.last().is_some_and(|w| w == "*"));
        globs.filter_map(|u| self.home(module, &u.path[..u.path.len() - 1], steps - 1)).find(|m| self.0[*m].source.items.contains(&rest[0]))
    }
}

fn reachable(uses: &[BTreeSet<usize>], from: usize) -> BTreeSet<usize> {
    let mut found = BTreeSet::new();
    let mut open: Vec<usize> = uses[from].iter().copied().collect();
    while let Some(next) = open.pop() {
        if found.insert(next) {
            open.extend(&uses[next]);
        }
    }
    found
}
