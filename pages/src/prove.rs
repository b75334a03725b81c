//! The report of a proof: what was concealed beside what was found, and what that is worth.

use crate::parts::ending;
use backdrive_bags::shell_word;
use backdrive_diagnosis::hypothesis::Place;
use backdrive_diagnosis::verdict::words;
use backdrive_prove::Options;
use backdrive_prove::case::{Case, SHOWS};
use backdrive_prove::gain::{ESTIMATED, Hand};
use backdrive_prove::headline::Headline;
use backdrive_prove::summary::Summary;
use backdrive_prove::worth::{DIAGNOSED, Group};
use backdrive_report::{Cell, Figure, Page, Plot, Series, Table, Tone, number, percent};

/// The cancellers in tables, in this order.
const CANCELLERS: [&str; 7] = ["none", "nominal", "second order", "linear, refitted", "diagnosed", "chosen", ESTIMATED];

/// The report over cases.
pub fn page(options: &Options, cases: &[Case]) -> Page {
    let mut page = Page::new("Concealed effects, and what was found");
    let summary = Summary::of(cases);
    if cases.len() == 1 {
        cases.iter().for_each(|case| lead(&mut page, case));
    } else {
        let headline = Headline::of(cases);
        page.lead(
            headline.tone(),
            &format!(
                "{} {} cases: {}; false alarms {}. Visible effects only (residual of at least {SHOWS} sd of the noise after a refit of the \
                    nominal model): {}.",
                headline.sentences().join(" "),
                cases.len(),
                summary.all,
                summary.false_alarms,
                summary.showing
            ),
        );
        if options.gains {
            page.figure(ratios(cases), "Stable μλ with the diagnosed, the chosen and the hand-estimating canceller, over the best of no canceller and the two linear ones; above 1 is better. Cases in their order, grip of the session.");
        }
        page.section("What was found");
        page.table(table(cases));
        page.section("Confusions");
        page.table(confusion(&summary));
        if options.gains {
            page.section("Effect on the stability limit");
        }
        for group in &summary.worth {
            page.text(&format!(
                "{}, {} cases: median of the stable gain, relative to the best available without a diagnosis (no canceller, second order, \
                 linear refitted). Then: cases below no canceller, and the gain relative to the better linear canceller alone, which is \
                 often far below none.{}",
                group.kind,
                group.cases,
                group.recovery_s.map_or_else(String::new, |s| format!(
                    " After a change of the grip the loop with the hand estimated settles in {s:.2} s (median)."
                ))
            ));
            page.table(worth(group));
        }
    }
    for case in cases {
        let fill = |page: &mut Page| one(page, case);
        if cases.len() == 1 {
            fill(&mut page);
        } else {
            page.details(&format!("{}: {}", case.name, concealed(case)), fill);
        }
    }
    page.section("How this was done");
    page.text(&format!(
        "A master has concealed effects, drawn from a seed (--seed {}). The file with the truth is sealed first: its SHA-256 is printed \
         before anything is recorded, and is in the title of every bag. Only the process of the hidden plant opens it, and, after \
         verdict.json is written, the scorer. The diagnosis is a separate process that receives the nominal model and the bags. \
         \"Refitted\" nominal parameters were first fitted to another session of the hidden plant, so they absorb part of the concealed \
         effects. The stable gain is that of the contact script {}, searched up to 50 to within 3 %, with a high-pass of {} Hz on the \
         canceller. \"Linear, refitted\" is the nominal model with its parameters fitted to the session. \"Second order\" is one mass \
         with spring and damper, fitted to the recordings in which the hand holds still. \"Chosen\" is the diagnosed model with the share \
         of its estimate that maximises the worst stable gain over grips 20 % softer to 20 % stiffer, for the diagnosed model and its \
         close rivals as the master. It is no canceller if the verdict leaves an effect unexplained, or a held-out residual of at least \
         {} sd of the noise. \"Hand estimated\" is the diagnosed model without high-pass, with the grip stiffness estimated during the run \
         (docs/canceller.md); it is no canceller if an effect is unexplained. The changing hand is that of {}. Limits are searched with \
         the loop in one process. Near the limits without canceller and with the diagnosed, chosen and hand-estimating cancellers, the \
         graph is also run live, with its processes over shared memory.",
        options.seed,
        options.contact.display(),
        options.high_pass_hz,
        SHOWS,
        options.regrip.display()
    ));
    page.text(
        "Some effects are equivalent to a changed parameter, or to a constant force of an unmeasured hand; no recording shows them, and \
         naming none is right. The count of visible effects excludes these.",
    );
    if let Some(case) = cases.first() {
        let truth = options.out.join(&case.name).join("sealed/truth.json");
        let command = format!("sha256sum {}", shell_word(&truth.display().to_string()));
        page.text(&format!("To check a seal: {command} gives the digest of the bags' title."));
    }
    ending(&mut page, &TERMS);
    page
}

/// The terms of the page.
const TERMS: [(&str, &str); 6] = [
    ("μλ", "the loop's gain: the position scale μ from master to slave times the force scale λ from slave to master"),
    ("stable to", "the highest gain found at which oscillations in contact decay"),
    ("canceller", "subtracts the master's induced motion from the command, using the named model"),
    ("noise floor", "standard deviation of the sensor noise: an error of 1 cannot be reduced further"),
    ("best of others", "the best of no canceller and the two with a linear model fitted to the session: available without a diagnosis"),
    ("over linear", "over the better of the two cancellers with a linear model alone"),
];

fn concealed(case: &Case) -> String {
    let all: Vec<String> = case.concealed.iter().map(|name| in_words(name)).collect();
    if all.is_empty() { "nothing".to_string() } else { all.join(", ") }
}

/// `stribeck drum-ground` as `dry friction that is lower once it moves at the drum`.
fn in_words(name: &str) -> String {
    let Some((physics, place)) = name.split_once(' ') else { return words::physics(name) };
    let place = match place.split_once('-') {
        Some((a, b)) => Place::Between(a.to_string(), b.to_string()),
        None => Place::Signal(place.to_string()),
    };
    words::named(physics, &place)
}

fn found(case: &Case) -> String {
    let names: Vec<String> = case.findings.iter().map(|f| in_words(&format!("{} {}", f.physics, f.place.join("-")))).collect();
    let word = case.word.spoken();
    if names.is_empty() { format!("nothing ({word})") } else { format!("{} ({word})", names.join(", ")) }
}

fn lead(page: &mut Page, case: &Case) {
    let headline = Headline::of([case]);
    page.lead(headline.tone(), &format!("Concealed: {}. Found: {}. {}", concealed(case), found(case), headline.sentences().join(" ")));
}

fn one(page: &mut Page, case: &Case) {
    if !case.gains.is_empty() {
        page.figure(gains(case), "Highest stable μλ against the grip stiffness relative to the session.");
    }
    let mut because = Table::new(["canceller", "hand", "stable to", "because"]);
    for gain in &case.gains {
        let stable = if gain.whole_range { format!("above {}", number(gain.stable_to)) } else { number(gain.stable_to) };
        because.push([gain.canceller.to_string(), gain.hand.to_string(), stable, gain.because.clone()]);
    }
    let [given, refitted, diagnosed] = case.held_out.map(|x| x.map_or("-".to_string(), percent));
    page.text(&format!("Concealed: {}. Found: {}. Verdict: {}.", concealed(case), found(case), case.sentence.trim_end_matches('.')));
    page.text(&format!("Error on held-out recordings: {given} as given, {refitted} refitted, {diagnosed} diagnosed."));
    let hand = if case.shows_hand {
        "The bags contain the intent of the hand."
    } else {
        "The hand was not measured: it was estimated with the \
        other unknowns."
    };
    let share = case.share.map_or_else(String::new, |share| format!(" Chosen share of the estimate: {}.", number(share)));
    let nominal = if case.refitted { " The nominal parameters were refitted to a session before." } else { "" };
    page.text(&format!("{hand}{nominal}{share} Seal: {}.", case.sealed));
    if !case.gains.is_empty() {
        page.table(by_hand(case));
        if let Some(time) = case.recovery_s {
            page.text(&format!(
                "After a change of the grip, at half the stable gain of the changing hand, the loop with the hand estimated settles in \
                {time:.2} s (median). The hand's own motion takes 0.15 s of it."
            ));
        }
        page.details("What limits each stable range", |inside| {
            inside.table(because);
        });
    }
    if !case.live.is_empty() {
        page.text("The running graph, with the hidden plant's process as its master, just below and just above those limits:");
        let mut table = Table::new(["canceller", "μλ", "should be", "was"]);
        for run in &case.live {
            let tone = if run.agrees() { Tone::Good } else { Tone::Warning };
            let should = if run.below_edge { "stable" } else { "not stable" };
            table.push([run.canceller.into(), number(run.gain).into(), should.into(), Cell::tone(run.outcome.replace('_', " "), tone)]);
        }
        page.table(table);
    }
    page.link("The diagnosis itself: its page", &format!("{}/diagnosis/report.html", case.name));
}

/// The grips in ascending order.
fn grips(case: &Case) -> Vec<f64> {
    let grip = |hand: &Hand| if let Hand::Grip(factor) = hand { Some(*factor) } else { None };
    let mut grips: Vec<f64> = case.hands().iter().filter_map(grip).collect();
    grips.sort_by(f64::total_cmp);
    grips
}

/// A row for each canceller, a column for each hand.
fn by_hand(case: &Case) -> Table {
    let mut hands: Vec<Hand> = grips(case).into_iter().map(Hand::Grip).collect();
    hands.extend(case.hands().contains(&Hand::Changing).then_some(Hand::Changing));
    let mut table = Table::new(["canceller".to_string()].into_iter().chain(hands.iter().map(Hand::to_string)));
    for canceller in CANCELLERS {
        let cells = hands.iter().map(|hand| case.gain(canceller, *hand).map_or("–".to_string(), number));
        table.push([canceller.to_string()].into_iter().chain(cells));
    }
    table.caption("Stable up to this μλ.")
}

/// Stable gain over grip, a line for each canceller; bars where there is one grip only.
fn gains(case: &Case) -> Figure {
    let grips = grips(case);
    let lowest = 0.05;
    let mut plot = Plot::new("Stable gain").y_axis("μλ", "").y_log();
    if grips.len() > 1 {
        plot = plot.x_axis("grip, over that of the session", "");
        for canceller in CANCELLERS {
            let at = |grip: &f64| Some((*grip, case.gain(canceller, Hand::Grip(*grip))?.max(lowest)));
            let (x, y): (Vec<f64>, Vec<f64>) = grips.iter().filter_map(at).unzip();
            plot = if x.len() > 1 { plot.line(canceller, &x, &y) } else { plot.points(canceller, &x, &y) };
        }
    } else {
        plot = plot.x_axis("canceller", "").x_names(CANCELLERS);
        for (index, canceller) in CANCELLERS.iter().enumerate() {
            let stable = case.gain(canceller, Hand::SESSION).unwrap_or(lowest).max(lowest);
            plot = plot.series(Series::bars(canceller, &[index as f64 + 1.0], &[stable]));
        }
    }
    plot.into()
}

fn ratios(cases: &[Case]) -> Figure {
    let title = "Stable gain over the best of none, second order and linear refitted";
    let mut plot = Plot::new(title).x_axis("case", "").y_axis("ratio", "").y_log().include_y(1.0);
    for canceller in DIAGNOSED {
        let known = cases.iter().enumerate().filter_map(|(i, c)| Some((i as f64 + 1.0, c.over_others(canceller, Hand::SESSION)?)));
        let (x, y): (Vec<f64>, Vec<f64>) = known.filter(|(_, r)| *r > 0.0).unzip();
        plot = plot.points(canceller, &x, &y);
    }
    plot.into()
}

fn table(cases: &[Case]) -> Table {
    let headers =
        ["case", "hand", "nominal parameters", "concealed", "found", "right", "error: refitted", "in sd of the noise", "diagnosed"];
    let mut table = Table::new(headers.into_iter().map(str::to_string).chain(CANCELLERS.iter().map(|c| format!("gain: {c}"))));
    for case in cases {
        let right = case.is_right();
        let error = |i: usize| case.held_out[i].map_or("-".to_string(), percent);
        let floors = case.refit_floors.map_or("-".to_string(), number);
        let hand = if case.shows_hand { "recorded" } else { "unknown" };
        let mark = Cell::tone(if right { "yes" } else { "no" }, if right { Tone::Good } else { Tone::Bad });
        let mut row: Vec<Cell> = vec![
            case.name.clone().into(),
            hand.into(),
            (if case.refitted { "refitted" } else { "given" }).into(),
            concealed(case).into(),
            found(case).into(),
            mark,
            error(1).into(),
            floors.into(),
            error(2).into(),
        ];
        row.extend(CANCELLERS.iter().map(|c| Cell::from(case.gain(c, Hand::SESSION).map_or("-".to_string(), number))));
        table.push(row);
    }
    table
}

fn confusion(summary: &Summary) -> Table {
    let mut table = Table::new(["concealed", "said", "times"]);
    for (concealed, said, count) in &summary.confusion {
        let tone = if concealed == said || concealed == "nothing" && said == "none" { Tone::Good } else { Tone::Neutral };
        table.push([Cell::from(concealed.clone()), Cell::tone(said.clone(), tone), Cell::from(count.to_string())]);
    }
    table
}

fn worth(group: &Group) -> Table {
    let columns = ["over the best of others", "below none", "over linear"];
    let headers = DIAGNOSED.iter().flat_map(|c| columns.map(|column| format!("{c}: {column}")));
    let mut table = Table::new(["hand".to_string()].into_iter().chain(headers));
    let of = |x: Option<f64>| x.map_or("-".to_string(), number);
    for worth in &group.worths {
        let cells = worth.cancellers.iter().flat_map(|c| [of(c.over_others), c.below_none.to_string(), of(c.over_linear)]);
        table.push([worth.hand.to_string()].into_iter().chain(cells));
    }
    table
}
