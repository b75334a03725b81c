//! The Python package, put together of the library that was built with this test, and tried by `check.py`.

#[path = "../../tests/common/python.rs"]
mod python;

use std::path::{Path, PathBuf};
use std::process::Command;

/// Where this build puts its programs: this test is in the folder `deps` there.
fn built() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    test.parent().and_then(Path::parent).unwrap().to_path_buf()
}

#[test]
fn the_package_gives_what_the_command_line_gives() {
    let Some(python) = python::python("that has tests/python/requirements.txt") else { return };
    let (here, built) = (Path::new(env!("CARGO_MANIFEST_DIR")), built());
    let program = built.join("backdrive");
    if !program.exists() {
        // A run of this package's tests alone has no program to compare with.
        python::skipped::skipped(format!("{} is not built: cargo build", program.display()));
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let package = folder.path().join("backdrive");
    std::fs::create_dir(&package).unwrap();
    for entry in std::fs::read_dir(here.join("backdrive")).unwrap().map(Result::unwrap).filter(|e| e.path().is_file()) {
        std::fs::copy(entry.path(), package.join(entry.file_name())).unwrap();
    }
    std::fs::copy(built.join("deps/lib_backdrive.so"), package.join("_backdrive.abi3.so")).unwrap();
    for (script, program) in [("check.py", Some(&program)), ("readers.py", None), ("fleet.py", Some(&program))] {
        let mut check = Command::new(&python);
        check.arg(here.join("tests").join(script)).args(program).arg(folder.path()).env("PYTHONDONTWRITEBYTECODE", "1");
        let done = check.output().unwrap();
        let said = format!("{script}:\n{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
        assert!(done.status.success(), "{said}");
        println!("{said}");
    }
}
