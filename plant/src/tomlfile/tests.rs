use super::*;

fn table(text: &str) -> Table {
    Table::parse(text, "x.toml").unwrap()
}

fn message<T: std::fmt::Debug>(result: Result<T, FileError>) -> String {
    result.unwrap_err().to_string()
}

#[test]
fn takes_every_type() {
    let mut t =
        table("a = 1\nb = 2.5\nc = 'x'\nd = true\ne = [1, 2.5]\nf = ['p', 'q']\ng = 'one'\n[h]\ni = 3\n[[j]]\nk = 1\n[[j]]\nk = 2\n");
    assert_eq!(t.need_number("a", Range::Positive), Ok(1.0));
    assert_eq!(t.number("b", Range::Any), Ok(Some(2.5)));
    assert_eq!(t.number_or("none", Range::Any, 7.0), Ok(7.0));
    assert_eq!(t.need_string("c"), Ok("x".to_string()));
    assert_eq!(t.boolean("d"), Ok(Some(true)));
    assert_eq!(t.numbers("e", Range::Any), Ok(Some(vec![1.0, 2.5])));
    assert_eq!(t.strings("f"), Ok(Some(vec!["p".to_string(), "q".to_string()])));
    assert_eq!(t.string_or_strings("g"), Ok(Some(vec!["one".to_string()])));
    let mut h = t.table("h").unwrap().unwrap();
    assert_eq!((h.line(), h.path()), (8, "h"));
    assert_eq!(h.integer("i", 0, 5), Ok(Some(3)));
    h.finish().unwrap();
    let j = t.tables("j").unwrap();
    assert_eq!(j.iter().map(|t| (t.line(), t.path().to_string())).collect::<Vec<_>>(), [(10, "j[0]".into()), (12, "j[1]".into())]);
    t.finish().unwrap();
}

#[test]
fn errors_name_file_line_key_and_what_to_do() {
    assert_eq!(message(Table::open(Path::new("no/such.toml"))), "no/such.toml: there is no such file");
    assert_eq!(message(Table::parse("a = 1\nb = = 2\n", "x.toml")), "x.toml:2: is not valid TOML at column 5: extra `=`, expected nothing");
    assert_eq!(message(Table::parse("a = 1\na = 2\n", "x.toml")), "x.toml:2: is not valid TOML at column 1: duplicate key");
    let mut t = table("a = 1\n[b]\nc = 'x'\nd = -1\ne = [1, 'x']\nf = 'sprng'\nh = nan\n[[g]]\nstifness = 3\n");
    let mut b = t.table("b").unwrap().unwrap();
    assert_eq!(message(b.number("c", Range::Any)), "x.toml:3: b.c: expected a number, found the string \"x\"");
    assert_eq!(message(b.number("d", Range::NonNegative)), "x.toml:4: b.d: must be at least 0, is -1");
    assert_eq!(message(b.numbers("e", Range::Any)), "x.toml:5: b.e[1]: expected a number, found the string \"x\"");
    let kinds = [("spring", 1), ("damper", 2)];
    assert_eq!(message(b.one_of("f", &kinds)), "x.toml:6: b.f: unknown value \"sprng\"; did you mean \"spring\"?");
    assert_eq!(message(b.number("h", Range::Any)), "x.toml:7: b.h: must be a finite number, is NaN");
    assert_eq!(message(b.need_number("z", Range::Any)), "x.toml:2: b: missing key \"z\"");
    let mut g = t.tables("g").unwrap().remove(0);
    g.label("cable");
    assert_eq!(
        message(g.need_number("stiffness", Range::Any)),
        "x.toml:9: g[0] \"cable\": unknown key \"stifness\"; did you mean \"stiffness\"?"
    );
    assert_eq!(message(g.finish()), "x.toml:9: g[0] \"cable\": unknown key \"stifness\"; did you mean \"stiffness\"?");
    assert_eq!(message(t.finish()), "x.toml:1: unknown key \"a\"; known here: b, g");
    assert_eq!(message(table("[a]\n").tables("a")), "x.toml:1: a: expected a list of tables: write [[a]], not [a]");
}

#[test]
fn a_file_that_is_not_text_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("x.toml");
    std::fs::write(&path, b"a = 1\nb = \"\xff\"\n").unwrap();
    assert!(message(Table::open(&path)).ends_with("x.toml:2: is not UTF-8 text (byte 11)"));
    assert!(message(Table::open(dir.path())).ends_with(": is a folder, expected a file"));
}
