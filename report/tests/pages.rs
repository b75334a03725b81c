//! Whole pages: well formed, self-contained, the same twice, and true to odd data.

use backdrive_report::{Cell, Figure, Page, Plot, Series, Table, Tone};
use quick_xml::events::Event;

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

/// All numbers in the coordinates of paths, lines, rectangles and circles are finite and near the drawing.
fn coordinates_are_sane(html: &str) {
    let (elements, _) = parse(html);
    for (name, attributes) in &elements {
        if ["path", "line", "rect", "circle", "ellipse", "text"].contains(&name.as_str()) {
            assert!(!attributes.contains("NaN") && !attributes.contains("inf"), "{attributes}");
            for part in attributes.split('"').skip(1).step_by(2) {
                for number in part.split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-')).filter_map(|n| n.parse::<f64>().ok()) {
                    assert!(number.abs() < 2e6, "{number} in {attributes}");
                }
            }
        }
    }
}

/// The paths drawn as lines, each as its points.
fn lines(svg: &str) -> Vec<Vec<(f64, f64)>> {
    let (elements, _) = parse(svg);
    let line = |a: &str| a.contains("class=\"l c") && !a.contains("h24");
    let paths = elements.iter().filter(|(name, a)| name == "path" && line(a));
    paths
        .map(|(_, a)| {
            let d = a.split(" d=\"").nth(1).and_then(|d| d.split('"').next()).unwrap_or("");
            let numbers: Vec<f64> = d.split(['M', 'L', ' ']).filter_map(|n| n.parse().ok()).collect();
            numbers.chunks(2).map(|p| (p[0], p[1])).collect()
        })
        .collect()
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
    assert!(html.contains("<h1>A &lt;title&gt; &amp; &quot;more&quot;</h1>"));
    assert!(html.contains("5 &lt; 6 &amp; &#39;so on&#39;") && html.contains("All &amp; &lt;everything&gt;"));
    assert!(elements.iter().filter(|e| e.0 == "h1").count() == 1 && !elements.iter().any(|e| e.0 == "b" && e.1 != "b"));
    coordinates_are_sane(&html);
}

#[test]
fn nothing_outside_the_file_is_referred_to() {
    let html = everything().html();
    assert!(!html.contains("http") && !html.contains("url(") && !html.contains("@import"));
    let (elements, _) = parse(&html);
    for (name, attributes) in &elements {
        assert!(!["link", "img", "iframe", "object", "use", "image", "base"].contains(&name.as_str()), "{name}");
        assert!(!attributes.contains(" src=") && !attributes.contains("href="), "{attributes}");
    }
    let svg = Figure::from(Plot::new("alone").line("y", &[0.0, 1.0], &[0.0, 1.0])).svg();
    assert_eq!(svg.matches("http").count(), 1);
    assert!(svg.contains("xmlns=\"http://www.w3.org/2000/svg\"") && svg.contains("<style>"));
    parse(&svg);
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
                coordinates_are_sane(&page_of(plot.clone()));
                coordinates_are_sane(&page_of(Figure::stacked([plot.clone(), plot.x_limits(nan, 3.0).y_limits(5.0, 5.0)])));
            }
        }
    }
    parse(&page_of(Figure::stacked([])));
    parse(&page_of(Figure::beside::<Plot>([])));
    assert!(page_of(Plot::new("").line("F", &[], &[])).contains("no data"));
    assert!(!page_of(Plot::new("").line("F", &[1.0], &[1.0])).contains("no data"));
}

#[test]
fn what_an_axis_cannot_show_is_said() {
    let svg = Figure::from(Plot::new("").y_log().line("G", &[0.0, 1.0, 2.0, 3.0], &[1.0, 0.0, -2.0, 4.0])).svg();
    assert!(svg.contains("G: 2 of 4 values are not positive and left out on the logarithmic axis."));
    let svg = Figure::from(Plot::new("").line("G", &[0.0, 1.0, 2.0], &[1.0, 0.0])).svg();
    assert!(svg.contains("G: its vectors differ in length; drawn are the first 2 samples."));
    let svg = Figure::from(Plot::new("").x_limits(0.0, 1.0).line("G", &[0.0, 1.0], &[1.0, 0.0]).vertical(60.0, "edge", Tone::Bad)).svg();
    assert!(svg.contains("edge: at 60.0, beyond the axis"), "{svg}");
    let clean = Figure::from(Plot::new("").line("G", &[0.0, 1.0], &[1.0, 0.0])).svg();
    assert!(!clean.contains("class=\"w\""));
}

#[test]
fn a_missing_sample_breaks_the_line() {
    let y = [1.0, 2.0, f64::NAN, 2.0, 1.0];
    let svg = Figure::from(Plot::new("").line("y", &[0.0, 1.0, 2.0, 3.0, 4.0], &y)).svg();
    let (elements, _) = parse(&svg);
    let path = elements.iter().find(|(n, a)| n == "path" && a.contains("class=\"l c0\"") && !a.contains("h24")).unwrap();
    assert_eq!(path.1.matches('M').count(), 2, "{}", path.1);
}

#[test]
fn a_hundred_thousand_samples_draw_small_and_keep_their_extremes() {
    let n = 100_000;
    let t: Vec<f64> = (0..n).map(|k| f64::from(k) * 1e-4).collect();
    let mut y: Vec<f64> = t.iter().map(|t| (t * 700.0).sin()).collect();
    y[12_345] = 9.0;
    y[54_321] = -7.0;
    let svg = Figure::from(Plot::new("").y_limits(-10.0, 10.0).line("y", &t, &y)).svg();
    assert!(svg.len() < 60_000, "{} bytes", svg.len());
    let points = lines(&svg).concat();
    let (top, bottom) = points.iter().fold((f64::MAX, f64::MIN), |(a, b), p| (a.min(p.1), b.max(p.1)));
    let frame: Vec<f64> = {
        let (elements, _) = parse(&svg);
        let a = elements.iter().find(|(n, a)| n == "rect" && a.contains("class=\"f\"")).unwrap().1.clone();
        a.split('"').filter_map(|v| v.parse().ok()).collect()
    };
    let [x0, y0, w, h] = frame[..] else { panic!("{frame:?}") };
    let at = |v: f64| y0 + h * (10.0 - v) / 20.0;
    assert!((top - at(9.0)).abs() < 0.11 && (bottom - at(-7.0)).abs() < 0.11, "{top} {bottom}");
    let spike = points.iter().find(|p| p.1 == top).unwrap();
    assert!((spike.0 - (x0 + w * 1.2345 / 9.9999)).abs() < 0.11, "{spike:?}");
}

#[test]
fn equal_aspect_makes_circles_round() {
    let angle: Vec<f64> = (0..100).map(|k| f64::from(k) * 0.1).collect();
    let (x, y): (Vec<f64>, Vec<f64>) = angle.iter().map(|a| (3.0 * a.cos(), 3.0 * a.sin())).unzip();
    for (dx, dy) in [(10.0, 0.0), (0.0, 10.0), (0.0, 0.0)] {
        let plot = Plot::new("").equal_aspect().line("c", &x, &y).include(dx, dy).series(Series::discs("d", &[0.0], &[0.0], &[3.0]));
        let svg = Figure::from(plot).svg();
        let points = lines(&svg).concat();
        let span = |pick: fn(&(f64, f64)) -> f64| points.iter().map(pick).fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
        let (sx, sy) = (span(|p| p.0), span(|p| p.1));
        let (w, h) = (sx.1 - sx.0, sy.1 - sy.0);
        assert!((w / h - 1.0).abs() < 0.01, "{w} × {h}");
        let (elements, _) = parse(&svg);
        let disc = &elements.iter().find(|e| e.0 == "ellipse").unwrap().1;
        let numbers: Vec<f64> = disc.split('"').filter_map(|v| v.parse().ok()).collect();
        assert!((numbers[2] - w / 2.0).abs() < 0.6 && numbers[2] == numbers[3], "{disc} in {w}");
    }
}

#[test]
fn regions_lie_where_they_are_said_to_and_join() {
    let mut plot = Plot::new("").x_log().x_limits(1.0, 100.0).y_axis("y", "");
    for k in 0..10 {
        let at = |k: i32| 10f64.powf(f64::from(k) / 10.0);
        plot = plot.region(at(k), at(k + 1), Tone::Good, "stable");
    }
    plot = plot.region(10.0, f64::INFINITY, Tone::Bad, "unstable");
    let (elements, _) = parse(&Figure::from(plot).svg());
    let rects = |class: &str| -> Vec<Vec<f64>> {
        let found = elements.iter().filter(|(n, a)| n == "rect" && a.contains(&format!("class=\"{class}\"")));
        found.map(|(_, a)| a.split('"').filter_map(|v| v.parse().ok()).collect()).collect()
    };
    let (frame, good, bad) = (rects("f").remove(0), rects("r good"), rects("r bad"));
    assert_eq!((good.len(), bad.len()), (1, 1), "neighbours alike are one");
    assert!((good[0][2] - frame[2] / 2.0).abs() < 0.2 && (bad[0][0] - (frame[0] + frame[2] / 2.0)).abs() < 0.2, "a decade is half of two");
    assert!((bad[0][0] + bad[0][2] - frame[0] - frame[2]).abs() < 0.2, "no end is the end of the axis");
}

/// Labels at (x, y, width at least) in px.
fn labels(svg: &str, class: &str) -> Vec<(f64, f64, String)> {
    let mut out = Vec::new();
    for part in svg.split("<text class=\"").skip(1) {
        let (c, rest) = part.split_once('"').unwrap();
        if c.starts_with(class) {
            let number = |name: &str| rest.split(&format!("{name}=\"")).nth(1).and_then(|v| v.split('"').next()).unwrap().parse().unwrap();
            let text = rest.split_once('>').unwrap().1.split('<').next().unwrap();
            out.push((number(" x"), number(" y"), text.to_string()));
        }
    }
    out
}

#[test]
fn labels_of_crowded_markers_do_not_lie_on_each_other() {
    let mut plot = Plot::new("").x_limits(0.0, 10.0).line("y", &[0.0, 10.0], &[0.0, 1.0]);
    for k in 0..8 {
        plot = plot.vertical(5.0 + 0.01 * f64::from(k), &format!("marker {k}"), Tone::Neutral);
    }
    let svg = Figure::from(plot).svg();
    let found = labels(&svg, "i");
    assert_eq!(found.len(), 8);
    for (i, a) in found.iter().enumerate() {
        for b in &found[i + 1..] {
            assert!((a.0 - b.0).abs() > 40.0 || (a.1 - b.1).abs() >= 14.9, "{a:?} {b:?}");
        }
    }
}

#[test]
fn tick_labels_have_air_on_wide_and_narrow_drawings() {
    for (lo, hi, log) in
        [(0.0, 1e-3, false), (-123456.0, 654321.0, false), (0.1, 50.0, true), (1e-9, 1e6, true), (1000.0001, 1000.0004, false)]
    {
        let x = [lo, hi];
        let mut plot = Plot::new("").x_axis("x", "").y_axis("y", "").line("l", &x, &x);
        plot = if log { plot.x_log().y_log() } else { plot };
        for figure in [Figure::from(plot.clone()), Figure::stacked([plot.clone(), plot.clone()])] {
            let html = page_of(figure);
            for svg in html.split("<svg class=\"plot\"").skip(1) {
                let ticks = labels(svg, "k");
                assert!(ticks.len() >= 4, "{lo} {hi}: {ticks:?}");
                let lowest = ticks.iter().map(|t| t.1).fold(0.0, f64::max);
                let mut along: Vec<_> = ticks.iter().filter(|t| t.1 == lowest).collect();
                along.sort_by(|a, b| a.0.total_cmp(&b.0));
                for w in along.windows(2) {
                    let least = 3.0 * (w[0].2.chars().count() + w[1].2.chars().count()) as f64;
                    assert!(w[1].0 - w[0].0 > least, "{w:?}");
                }
            }
        }
    }
}

#[test]
fn bars_with_names_stand_over_their_names_and_not_over_numbers() {
    let names = ["none", "nominal", "diagnosed"];
    let mut plot = Plot::new("").x_names(names);
    for (at, height) in [(1.0, 20.0), (2.0, 10.0), (3.0, 40.0)] {
        plot = plot.series(Series::bars("", &[at], &[height]));
    }
    let svg = Figure::from(plot).svg();
    let ticks: Vec<String> = labels(&svg, "k").into_iter().map(|t| t.2).collect();
    assert!(names.iter().all(|n| ticks.contains(&n.to_string())), "{ticks:?}");
    assert!(!ticks.iter().any(|t| t == "1.5" || t == "2.5"), "{ticks:?}");
}

#[test]
fn a_link_leads_to_a_file_beside_the_page_only() {
    let mut page = Page::new("t");
    page.link("its page", "case-001/report.html").link("elsewhere", "javascript:alert(1)").link("root", "/etc/passwd");
    let html = page.html();
    assert!(html.contains("<a href=\"case-001/report.html\">its page</a>"));
    assert_eq!(html.matches("href=").count(), 1);
    parse(&html);
}
