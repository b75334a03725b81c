//! The hidden plant has no code in common with those who look for what it hides.

use std::collections::BTreeSet;
use std::path::PathBuf;
use toml_edit::Document;

#[test]
fn no_crate_of_the_fitting_side_is_behind_this_one() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../Cargo.lock");
    let text = std::fs::read_to_string(path).unwrap();
    let lock = Document::parse(text.as_str()).unwrap();
    let packages = lock["package"].as_array_of_tables().unwrap();
    let mut open = vec!["backdrive-sealed".to_string()];
    let mut reached = BTreeSet::new();
    while let Some(name) = open.pop() {
        if !reached.insert(name.clone()) {
            continue;
        }
        for package in packages.iter().filter(|package| package["name"].as_str() == Some(name.as_str())) {
            let needs = package.get("dependencies").and_then(|list| list.as_array());
            open.extend(needs.into_iter().flatten().filter_map(|d| d.as_str()).filter_map(|d| d.split(' ').next()).map(String::from));
        }
    }
    assert!(reached.contains("sha2"), "the lock file was read: {reached:?}");
    let ours: Vec<_> = reached.iter().filter(|name| name.starts_with("backdrive")).collect();
    assert_eq!(ours, ["backdrive-sealed"]);
}
