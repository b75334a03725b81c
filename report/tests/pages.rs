//! Whole pages: well formed, self-contained, the same twice, and true to odd data.

#[path = "../../tests/common/naming.rs"]
mod naming;

use backdrive_report::{Cell, Figure, Page, Plot, Series, Table, Tone};
use naming::assert_names;
use quick_xml::events::Event;
use serde_json::Value;

/// Elements of a document that a strict XML parser reads to its end: (name, attributes as text, depth), and all text.
fn parse(document: &str) -> (Vec<(String, String)>, String) {
    let mut reader = quick_xml::Reader::from_str(document);
    reader.config_mut().check_end_names = true;
    let (mut elements, mut text, mut open) = (Vec::new(), String::new(), 0);
    loop {
        match reader.read_event().unwrap_or_else(|e| panic!("not well formed at byte {}: {e}", reader.error_position())) {
            Event::Eof => break,
            Event::Start(e) | Event::Empty(e) if e.attributes().any(|a| a.is_err()) => panic!("bad attribute in {e:?}"),
            Event::Start(e) => {
                open += 1;
                elements.push((e.name().as_ref().to_string(), e.to_string()));
            }
            Event::Empty(e) => elements.push((e.name().as_ref().to_string(), e.to_string())),
            Event::End(_) => open -= 1,
            Event::Text(t) => text.push_str(&t),
            Event::GeneralRef(r) => text.push_str(&format!("&{};", &*r)),
            _ => {}
        }
    }
    assert_eq!(open, 0, "all elements are closed");
    (elements, text)
}

fn page_of(figure: impl Into<Figure>) -> String {
    let mut page = Page::new("t");
    page.figure(figure, "");
    page.html()
}

/// The data of each stack of a page, as the script there finds them.
fn stacks(html: &str) -> Vec<Value> {
    let json = html.split("<script type=\"application/json\">").skip(1).map(|rest| rest.split("</script>").next().unwrap());
    json.map(|json| serde_json::from_str(json).unwrap()).collect()
}

/// The data of the only stack of a figure.
fn stack(figure: impl Into<Figure>) -> Value {
    stacks(&page_of(figure)).remove(0)
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap_or(f64::NAN)).collect()
}

/// The points of a series of the first panel; gaps are NaN.
fn points(stack: &Value, series: usize) -> Vec<(f64, f64)> {
    let s = &stack["panels"][0]["series"][series];
    numbers(&s["x"]).into_iter().zip(numbers(&s["y"])).collect()
}

/// Axes go from less to more, and all that is drawn is a number or a gap.
fn data_are_sane(html: &str) {
    for stack in stacks(html) {
        let axes = std::iter::once(&stack["x"]).chain(stack["panels"].as_array().unwrap().iter().map(|p| &p["y"]));
        for axis in axes {
            let (lo, hi) = (axis["lo"].as_f64().unwrap(), axis["hi"].as_f64().unwrap());
            assert!(lo < hi && (axis["log"] == false || lo > 0.0), "{axis}");
        }
        for series in stack["panels"].as_array().unwrap().iter().flat_map(|p| p["series"].as_array().unwrap()) {
            let (x, y) = (series["x"].as_array().unwrap(), series["y"].as_array().unwrap());
            assert_eq!(x.len(), y.len(), "{series}");
            assert!(x.iter().chain(y).all(|v| v.is_null() || v.as_f64().unwrap().abs() < 1e300), "{series}");
        }
    }
}

fn everything() -> Page {
    let x: Vec<f64> = (1..500).map(|k| f64::from(k) * 0.1).collect();
    let y: Vec<f64> = x.iter().map(|x| (x * 0.7).sin() / x).collect();
    let r: Vec<f64> = x.iter().map(|x| 0.01 * x).collect();
    let mut page = Page::new("A <title> & \"more\"");
    page.lead(Tone::Bad, "5 < 6 & 'so on'").note("note").warning("careful <b>").section("s & t").text("one\n\ntwo <i>");
    page.table(Table::new(["a", "<b>"]).row([Cell::from("1"), Cell::tone("bad & worse", Tone::Bad)]).caption("c & d"));
    page.details("more <details>", |inside| {
        inside.text("within").figure(Plot::new("p").bars_of(&x, &y), "cap");
    });
    let all = Plot::new("All & <everything>")
        .x_axis("x <&>", "m/<s>")
        .x_log()
        .y_axis("y | z", "")
        .band("band", &x, &y, &r)
        .line("line \"1\"", &x, &y)
        .points("points", &x, &y)
        .discs("discs", &x, &y, &r)
        .region(1.0, 10.0, Tone::Good, "stable <ok>")
        .region(10.0, 10.5, Tone::Unsure, "narrow <one>")
        .region(11.0, f64::INFINITY, Tone::Bad, "bad")
        .vertical(3.0, "here <&", Tone::Limited)
        .horizontal(0.1, "level", Tone::Warning)
        .vertical(-3.0, "not on a log axis", Tone::Warning)
        .annotate(2.0, 0.3, "a <point>", Tone::Neutral);
    page.figure(Figure::beside([Figure::from(all.clone()), Figure::stacked([all.clone(), all])]), "caption <x>");
    page
}

trait Bars {
    fn bars_of(self, x: &[f64], y: &[f64]) -> Self;
}
impl Bars for Plot {
    fn bars_of(self, x: &[f64], y: &[f64]) -> Self {
        self.series(Series::bars("bars", x, y))
    }
}

#[test]
fn a_page_is_well_formed_and_escapes_all_text() {
    let html = everything().html();
    let (elements, text) = parse(&html);
    for wrong in ["<title> &", "<b>\"", "<i>", "<details>\"", "<everything>", "<&>", "<point>", "<ok>", "<s>)"] {
        assert!(!html.contains(&format!("{wrong}<")) && !text.contains(wrong), "{wrong} is markup");
    }
    assert_names(&html, &["<h1>A &lt;title&gt; &amp; &quot;more&quot;</h1>"]);
    assert_names(&html, &["5 &lt; 6 &amp; &#39;so on&#39;", "All &amp; &lt;everything&gt;"]);
    assert!(elements.iter().filter(|e| e.0 == "h1").count() == 1 && !elements.iter().any(|e| e.0 == "b" && e.1 != "b"));
    data_are_sane(&html);
}

#[test]
fn nothing_outside_the_file_is_referred_to() {
    let html = everything().html();
    // The library names the name spaces of SVG, which are not places.
    let addresses: Vec<&str> =
        html.split("http").skip(1).filter(|rest| !rest.starts_with("://www.w3.org/")).map(|r| r.get(..40).unwrap_or(r)).collect();
    assert!(addresses.is_empty() && !html.contains("@import"), "{addresses:?}");
    let (elements, _) = parse(&html);
    for (name, attributes) in &elements {
        assert!(!["link", "img", "iframe", "object", "use", "image", "base"].contains(&name.as_str()), "{name}");
        assert!(!attributes.contains(" src=") && !attributes.contains("href="), "{attributes}");
    }
}

#[test]
fn the_library_is_in_a_page_once_and_only_with_a_figure() {
    let library = include_str!("../vendor/echarts/echarts.min.js").lines().next().unwrap();
    assert_names(library, &["Apache License"]);
    assert_eq!(everything().html().matches(library).count(), 1);
    let mut page = Page::new("words only");
    page.text("No figure.").figure(Figure::default(), "");
    let html = page.html();
    assert!(!html.contains(library) && !html.contains("<script") && html.len() < 12_000, "{}", html.len());
    page.todo("What to do now", &[("Look.".into(), Some("backdrive doctor".into()))]);
    assert!(!page.html().contains(library));
    assert_names(page.html(), &["<script"]);
    // An XML parser and an HTML parser must find the same end of each script.
    let html = everything().html();
    assert_eq!(html.matches("<script").count(), html.matches("</script>").count());
    assert_eq!(html.matches("]]>").count(), html.matches("<script>//<![CDATA[").count());
}

#[test]
fn a_reader_without_scripts_gets_the_numbers() {
    let html = page_of(Plot::new("").x_axis("time", "s").y_axis("force", "N").line("F_s", &[0.0, 2.0], &[-3.0, 5.5]).vertical(
        1.25,
        "contact",
        Tone::Bad,
    ));
    let part = html.split("<noscript>").nth(1).unwrap().split("</noscript>").next().unwrap();
    for said in ["F_s", "-3.00 N", "5.50 N", "2.00 s", "contact", "1.25 s"] {
        assert!(part.contains(said), "{said}: {part}");
    }
}

#[test]
fn the_same_data_give_the_same_bytes() {
    assert_eq!(everything().html(), everything().html());
    let dir = std::env::temp_dir().join(format!("backdrive-report-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    let file = dir.join("page.html");
    everything().write(&file).unwrap();
    assert_eq!(std::fs::read_to_string(&file).unwrap(), everything().html());
    assert!(everything().write(dir.join("no/such/place.html")).is_err());
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn odd_data_draw_what_can_be_drawn() {
    let nan = f64::NAN;
    let odd: [&[f64]; 8] = [
        &[],
        &[1.0],
        &[2.0, 2.0, 2.0],
        &[nan, nan],
        &[0.0, -1.0, -5.0],
        &[f64::INFINITY, f64::NEG_INFINITY, 1.0],
        &[f64::MAX, f64::MIN, 0.0],
        &[1e-308, 5e-324, 0.0],
    ];
    for x in odd {
        for y in odd {
            for (x_log, y_log, equal) in [(false, false, false), (true, true, false), (false, true, false), (false, false, true)] {
                let mut plot = Plot::new("odd").x_axis("x", "m").y_axis("y", "°").line("l", x, y).points("p", x, y).discs("d", x, y, y);
                plot = plot.band("b", x, y, x).series(Series::bars("q", x, y));
                for v in x {
                    plot = plot.vertical(*v, "v", Tone::Bad).region(*v, 2.0 * v, Tone::Unsure, "r").annotate(*v, *v, "a", Tone::Good);
                }
                plot = if x_log { plot.x_log() } else { plot };
                plot = if y_log { plot.y_log() } else { plot };
                plot = if equal { plot.equal_aspect() } else { plot };
                data_are_sane(&page_of(plot.clone()));
                data_are_sane(&page_of(Figure::stacked([plot.clone(), plot.x_limits(nan, 3.0).y_limits(5.0, 5.0)])));
            }
        }
    }
    parse(&page_of(Figure::stacked([])));
    parse(&page_of(Figure::beside::<Plot>([])));
    assert_names(page_of(Plot::new("").line("F", &[], &[])), &["There are no data"]);
    assert!(!page_of(Plot::new("").line("F", &[1.0], &[1.0])).contains("There are no data"));
}

#[test]
fn what_an_axis_cannot_show_is_said() {
    let html = page_of(Plot::new("").y_log().line("G", &[0.0, 1.0, 2.0, 3.0], &[1.0, 0.0, -2.0, 4.0]));
    assert_names(&html, &["G: 2 of 4"]);
    let html = page_of(Plot::new("").line("G", &[0.0, 1.0, 2.0], &[1.0, 0.0]));
    assert_names(&html, &["G: ", "first 2 samples"]);
    let html = page_of(Plot::new("").x_limits(0.0, 1.0).line("G", &[0.0, 1.0], &[1.0, 0.0]).vertical(60.0, "edge", Tone::Bad));
    assert!(stacks(&html)[0]["panels"][0]["markers"].as_array().unwrap().is_empty());
    assert_names(&html, &["edge: at 60.0, beyond the axis"]);
    assert!(!page_of(Plot::new("").line("G", &[0.0, 1.0], &[1.0, 0.0])).contains("class=\"remark\""));
}

#[test]
fn a_missing_sample_breaks_the_line() {
    let y = [1.0, 2.0, f64::NAN, 2.0, 1.0];
    let found = stack(Plot::new("").line("y", &[0.0, 1.0, 2.0, 3.0, 4.0], &y));
    let drawn: Vec<Option<f64>> = points(&found, 0).iter().map(|p| Some(p.1).filter(|y| y.is_finite())).collect();
    assert_eq!(drawn, [Some(1.0), Some(2.0), None, Some(2.0), Some(1.0)]);
}

#[test]
fn a_hundred_thousand_samples_draw_small_and_keep_their_extremes() {
    let n = 100_000;
    let t: Vec<f64> = (0..n).map(|k| f64::from(k) * 1e-4).collect();
    let mut y: Vec<f64> = t.iter().map(|t| (t * 700.0).sin()).collect();
    y[12_345] = 9.0;
    y[54_321] = -7.0;
    let found = stack(Plot::new("").y_limits(-10.0, 10.0).line("y", &t, &y));
    assert!(found.to_string().len() < 80_000, "{} bytes", found.to_string().len());
    let drawn = points(&found, 0);
    for spike in [(1.2345, 9.0), (5.4321, -7.0)] {
        assert!(drawn.iter().any(|p| (p.0 - spike.0).abs() < 1e-3 && (p.1 - spike.1).abs() < 2e-3), "{spike:?}");
    }
    // A straight line needs its two ends.
    assert_eq!(points(&stack(Plot::new("").line("y", &t, &t)), 0).len(), 2);
}

#[test]
fn values_are_given_in_the_unit_that_the_axis_shows() {
    let found =
        stack(Plot::new("").x_axis("time", "s").y_axis("position", "m").line("x", &[0.0, 1.0, 2.0], &[1e-3, 4e-3, 2e-3]).horizontal(
            3e-3,
            "wall",
            Tone::Bad,
        ));
    assert_eq!(found["panels"][0]["y"]["unit"], "mm");
    assert_eq!(points(&found, 0), [(0.0, 1.0), (1.0, 4.0), (2.0, 2.0)]);
    assert_eq!(found["panels"][0]["markers"][0]["at"], 3.0);
    // Over many decades no prefix serves.
    let found = stack(Plot::new("").y_axis("amplitude", "m").y_log().line("a", &[0.0, 1.0], &[1e-7, 1.0]));
    assert_eq!((&found["panels"][0]["y"]["unit"], points(&found, 0)[0].1), (&Value::from("m"), 1e-7));
}

#[test]
fn equal_aspect_makes_circles_round() {
    let angle: Vec<f64> = (0..100).map(|k| f64::from(k) * 0.1).collect();
    let (x, y): (Vec<f64>, Vec<f64>) = angle.iter().map(|a| (3.0 * a.cos(), 3.0 * a.sin())).unzip();
    for (dx, dy) in [(10.0, 0.0), (0.0, 10.0), (0.0, 0.0)] {
        let plot = Plot::new("").equal_aspect().line("c", &x, &y).include(dx, dy).series(Series::discs("d", &[0.0], &[0.0], &[3.0]));
        let found = stack(plot);
        let span = |axis: &Value| axis["hi"].as_f64().unwrap() - axis["lo"].as_f64().unwrap();
        let aspect = found["aspect"].as_f64().unwrap();
        assert!(
            (span(&found["panels"][0]["y"]) / span(&found["x"]) / aspect - 1.0).abs() < 1e-9 && (0.5..=1.0).contains(&aspect),
            "{found}"
        );
        assert!(span(&found["x"]) > 6.0 && span(&found["panels"][0]["y"]) > 6.0, "the circle is within");
        assert_eq!(numbers(&found["panels"][0]["series"][1]["z"]), [3.0]);
    }
}

#[test]
fn a_line_coloured_by_a_value_keeps_each_point_and_its_value() {
    let x: Vec<f64> = (0..50).map(f64::from).collect();
    let hz: Vec<f64> = x.iter().map(|x| 1.5 * 1.1f64.powf(*x)).collect();
    let found = stack(Plot::new("").series(Series::line("L", &x, &x).by("frequency", "Hz", &hz)));
    let series = &found["panels"][0]["series"][0];
    assert_eq!((points(&found, 0).len(), numbers(&series["by"]["values"]).len()), (50, 50), "a straight line, but not thinned");
    assert_eq!((series["by"]["label"].as_str(), numbers(&series["by"]["values"])[0]), (Some("frequency"), 1.5));
}

#[test]
fn regions_lie_where_they_are_said_to_and_join() {
    let mut plot = Plot::new("").x_log().x_limits(1.0, 100.0).y_axis("y", "");
    for k in 0..10 {
        let at = |k: i32| 10f64.powf(f64::from(k) / 10.0);
        plot = plot.region(at(k), at(k + 1), Tone::Good, "stable");
    }
    plot = plot.region(10.0, f64::INFINITY, Tone::Bad, "unstable");
    let found = stack(plot);
    let regions = found["panels"][0]["regions"].as_array().unwrap();
    assert_eq!(regions.len(), 2, "neighbours alike are one: {regions:?}");
    let of = |k: usize| (regions[k]["from"].as_f64().unwrap(), regions[k]["to"].as_f64().unwrap(), regions[k]["tone"].as_str().unwrap());
    assert_eq!((of(0), of(1)), ((1.0, 10.0, "good"), (10.0, 100.0, "bad")), "no end is the end of the axis");
}

#[test]
fn bars_with_names_stand_over_their_names() {
    let names = ["none", "nominal", "diagnosed"];
    let mut plot = Plot::new("").x_names(names);
    for (at, height) in [(1.0, 20.0), (2.0, 10.0), (3.0, 40.0)] {
        plot = plot.series(Series::bars("", &[at], &[height]));
    }
    let found = stack(plot);
    assert_eq!(found["x"]["names"], serde_json::json!(names));
    assert!(found["panels"][0]["y"]["lo"].as_f64().unwrap() <= 0.0, "bars stand on 0");
}

#[test]
fn a_link_leads_to_a_file_beside_the_page_only() {
    let mut page = Page::new("t");
    page.link("its page", "case-001/report.html").link("elsewhere", "javascript:alert(1)").link("root", "/etc/passwd");
    let html = page.html();
    assert_names(&html, &["<a href=\"case-001/report.html\">its page</a>"]);
    assert_eq!(html.matches("href=").count(), 1);
    parse(&html);
}
