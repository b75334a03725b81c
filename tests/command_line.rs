//! The command line itself: its help on exit codes, its output for shells and `man`, and settings that cannot be meant.

mod system;

use std::process::{Command, Stdio};
use system::assert_names;
use system::{Place, file};

/// Every verb that a person may use, with its parent where it has one, as the help lists them.
fn verbs(place: &Place, parents: &[&str]) -> Vec<Vec<String>> {
    let done = place.backdrive(&[parents, &["--help"]].concat());
    assert_eq!(done.code, Some(0), "{parents:?}: {done:?}");
    let Some(list) = done.stdout.split("\nCommands:\n").nth(1) else { return Vec::new() };
    let listed = list.lines().take_while(|line| !line.is_empty());
    // Names stand two columns in; what they do, where it takes more lines, further.
    let names = listed.filter_map(|line| line.strip_prefix("  ").filter(|rest| !rest.starts_with(' '))).filter_map(|l| l.split(' ').next());
    let mut all = Vec::new();
    for name in names.filter(|name| *name != "help") {
        let verb = [parents, &[name]].concat();
        match verbs(place, &verb) {
            below if below.is_empty() => all.push(verb.iter().map(|word| word.to_string()).collect()),
            below => all.extend(below),
        }
    }
    all
}

#[test]
fn every_help_has_an_example_and_says_what_the_exit_codes_mean() {
    let place = Place::new();
    let verbs = verbs(&place, &[]);
    assert!(verbs.len() >= 20 && verbs.contains(&vec!["bag".to_string(), "info".to_string()]), "{verbs:?}");
    for verb in verbs {
        let words: Vec<&str> = verb.iter().map(String::as_str).collect();
        let done = place.backdrive(&[&words, &["--help"][..]].concat());
        assert_eq!(done.code, Some(0), "{verb:?}: {done:?}");
        assert_names(&done.stdout, &["Exit code", "Example"]);
    }
}

#[test]
fn bash_completes_verbs_and_options_with_what_completions_prints() {
    let place = Place::new();
    let done = place.backdrive(&["completions", "bash"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let script = place.write("completions.bash", &done.stdout);
    let asked = format!(
        "source {}; COMP_WORDS=(backdrive stab); COMP_CWORD=1; _backdrive backdrive stab backdrive; echo ${{COMPREPLY[@]}}; \
         COMP_WORDS=(backdrive stability --ht); COMP_CWORD=2; _backdrive backdrive --ht stability; echo ${{COMPREPLY[@]}}",
        script.display()
    );
    let bash = Command::new("bash").args(["--norc", "-c", &asked]).stdin(Stdio::null()).output().unwrap();
    assert_eq!(String::from_utf8_lossy(&bash.stdout), "stability\n--html\n", "{bash:?}");
    for shell in ["zsh", "fish"] {
        let done = place.backdrive(&["completions", shell]);
        done.answers(0, &["stability"]);
    }
}

#[test]
fn man_writes_a_page_for_every_verb() {
    let place = Place::new();
    let done = place.backdrive(&["man", "--out", "man1"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    for verb in verbs(&place, &[]) {
        let page = place.path("man1").join(format!("backdrive-{}.1", verb.join("-")));
        let text = std::fs::read_to_string(&page).unwrap_or_else(|e| panic!("{}: {e}", page.display()));
        assert_names(&text, &[".TH", "Exit code"]);
    }
    assert!(place.path("man1/backdrive.1").exists());
    assert!(!place.path("man1/backdrive-sealed-master.1").exists(), "what the supervisor starts is no verb of a person");
}

#[test]
fn what_cannot_be_meant_is_refused_with_what_to_do() {
    let place = Place::new();
    let (graph, grip) = (file("launch/contact.toml"), file("plant/grips/normal.toml"));
    place.write("empty.toml", "");
    let bodies: String = (0..10_000).map(|i| format!("b{i} = 1.0\n")).collect();
    place.write("huge.toml", &format!("name = \"huge\"\n[bodies]\n{bodies}"));
    let cases: &[(&[&str], &[&str])] = &[
        (&["run", &graph, "--transport", "inproc", "--lambda", "1e300"], &["lambda", "1e300", "at most 1e6"]),
        (&["run", &graph, "--transport", "inproc", "--mu", "1e300"], &["mu", "at most 1e6"]),
        (&["run", &graph, "--transport", "inproc", "--environment", &grip], &["is a grip", "--grip"]),
        (&["model", "check", "empty.toml"], &["empty.toml", "has no [bodies]"]),
        (&["model", "show", "empty.toml"], &["empty.toml", "has no [bodies]"]),
        (&["model", "show", "huge.toml"], &["10000 bodies", "at most 300"]),
        (&["doctor", "--listen", "0", "--peer", "::1"], &["::1", "IPv4 only"]),
        (&["doctor", "--listen", "0", "--peer", "no-such-host.invalid"], &["no-such-host.invalid", "no host of that name"]),
    ];
    for (verb, says) in cases {
        let done = place.backdrive(verb);
        assert_eq!(done.code, Some(3), "{verb:?}: {done:?}");
        for text in *says {
            assert!(done.stderr.contains(text), "{verb:?} does not say \"{text}\": {}", done.stderr);
        }
    }
    let named = place.backdrive(&["doctor", "--listen", "0", "--peer", "localhost"]);
    assert!(named.code != Some(2) && named.code != Some(3), "{named:?}");
}

#[test]
fn an_interrupt_ends_a_run_that_a_shell_has_put_into_the_background() {
    let place = Place::new();
    let mut command = Command::new("bash");
    // Without job control a shell has its background jobs ignore interrupts.
    let script = format!(
        "{} run {} --clock realtime --duration 30 --bag b.mcap & P=$!; sleep 3; kill -INT $P; for i in $(seq 50); do kill -0 $P 2>/dev/null || break; sleep 0.1; done; \
         if kill -0 $P 2>/dev/null; then kill -9 $P; echo deaf; else wait $P; echo code $?; fi",
        env!("CARGO_BIN_EXE_backdrive"),
        file("launch/contact.toml")
    );
    let like = place.command("true");
    command.args(["--norc", "-c", &script]).current_dir(like.get_current_dir().unwrap_or(std::path::Path::new(".")));
    for (name, value) in like.get_envs() {
        if let Some(value) = value {
            command.env(name, value);
        }
    }
    let done = command.stdin(Stdio::null()).output().unwrap();
    assert_eq!(String::from_utf8_lossy(&done.stdout).lines().last(), Some("code 130"), "{done:?}");
}

#[test]
fn a_set_that_names_recordings_elsewhere_is_simulated_into_the_folder_and_not_onto_them() {
    let place = Place::new();
    let model = file("plant/models/rigid-mass.toml");
    let done = place.backdrive(&["simulate", &model, "sweep:amplitude=1,from=1,to=20,duration=0.2", "--noise", "1", "--out", "mine.csv"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let before = std::fs::read(place.path("mine.csv")).unwrap();
    place.write("set.toml", &format!("model = \"{model}\"\nfit = [\"{}\"]\n", place.path("mine.csv").display()));
    let done = place.backdrive(&["simulate", &model, "set.toml", "--out", "out", "--overwrite"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    assert!(place.path("out/mine.csv").exists() && std::fs::read(place.path("mine.csv")).unwrap() == before);
}

#[test]
fn the_version_names_the_commit_that_it_was_built_from() {
    let place = Place::new();
    let done = place.backdrive(&["--version"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let said = done.stdout.trim().to_string();
    let head = Command::new("git").args(["-C", env!("CARGO_MANIFEST_DIR"), "log", "-1", "--format=%h, %cs", "--abbrev=10"]).output();
    let head = head.ok().filter(|git| git.status.success() && std::path::Path::new(&file(".git")).exists());
    let commit = std::env::var("BACKDRIVE_COMMIT").ok().or_else(|| head.map(|git| String::from_utf8_lossy(&git.stdout).trim().to_string()));
    let version = env!("CARGO_PKG_VERSION");
    assert_eq!(said, commit.map_or(format!("backdrive {version}"), |commit| format!("backdrive {version} ({commit})")));
}

#[test]
fn a_tarball_holds_the_program_and_what_belongs_to_it_and_runs_where_it_is_unpacked() {
    let place = Place::new();
    let mut pack = Command::new("bash");
    pack.arg(file("packaging/tarball")).args(["--program", env!("CARGO_BIN_EXE_backdrive"), "--out"]);
    let done = pack.arg(place.path("packed")).stdin(Stdio::null()).output().unwrap();
    assert!(done.status.success(), "{done:?}");
    let shell = format!("cd {} && tar xzf packed/backdrive-*.tar.gz && mv backdrive-* unpacked", place.path("").display());
    assert!(Command::new("bash").args(["-c", &shell]).status().unwrap().success());
    for piece in [
        "INSTALL",
        "share/man/man1/backdrive-stability.1.gz",
        "share/bash-completion/completions/backdrive",
        "share/zsh/site-functions/_backdrive",
        "share/fish/vendor_completions.d/backdrive.fish",
        "share/doc/backdrive/LICENSE-MIT",
        "share/doc/backdrive/LICENSE-APACHE",
    ] {
        assert!(place.path("unpacked").join(piece).is_file(), "no {piece}");
    }
    let check = ["check", "launch/contact.toml"];
    let run = Command::new("../../bin/backdrive").args(check).current_dir(place.path("unpacked/share/backdrive")).output().unwrap();
    assert!(run.status.success(), "{run:?}");
}
