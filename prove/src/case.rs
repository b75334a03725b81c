//! What one case gave: what was concealed beside what was found, and the stable gains.

use crate::gain::{ESTIMATED, Gain, Hand};
use crate::live::LiveRun;
use crate::score::{Finding, Mark};
use backdrive_diagnosis::verdict::Word;
use serde_json::{Value, json};

/// Least refitted error at which an effect counts as shown, in standard deviations of the sensor noise.
pub const SHOWS: f64 = 3.0;

/// What a user has without a diagnosis: the honest measure of a canceller is its stable gain over the best of these.
const OTHERS: [&str; 3] = ["none", "second order", "linear, refitted"];

/// Kinds of effects, by the names of the hidden laws.
pub const KINDS: [(&str, &[&str]); 3] = [
    ("dry friction", &["coulomb", "asymmetric_coulomb", "stribeck", "friction_deficit", "load_friction", "warm_friction", "gear_loss"]),
    ("hysteresis", &["hysteretic_spring", "bouc_wen", "dahl", "lugre", "maxwell_slip", "preisach_lugre", "bristle_field"]),
    ("backlash", &["backlash", "rounded_gap"]),
];

/// What a proof gave.
#[derive(Debug, Clone)]
pub struct Case {
    /// Its folder's name.
    pub name: String,
    /// Whether the bags hold what the hand wants.
    pub shows_hand: bool,
    /// Whether the nominal parameters were refitted to a session of the hidden plant first.
    pub refitted: bool,
    /// SHA-256 of the truth, as printed before anything was recorded.
    pub sealed: String,
    /// The verdict in a word.
    pub word: Word,
    /// And in a sentence.
    pub sentence: String,
    /// What was found.
    pub findings: Vec<Finding>,
    /// What was concealed.
    pub concealed: Vec<String>,
    /// How right that is, effect by effect.
    pub marks: Vec<Mark>,
    /// Whether something nonlinear was concealed.
    pub nonlinear: bool,
    /// Error on held-out data, as shares of their deviation: as given, refitted, diagnosed.
    pub held_out: [Option<f64>; 3],
    /// The refitted one of these over the noise floor: how far the recordings are from any prediction of the nominal model with other parameters.
    pub refit_floors: Option<f64>,
    /// Stable mu*lambda by canceller and grip.
    pub gains: Vec<Gain>,
    /// Time that the loop with the canceller that estimates the hand takes to settle after a change of the grip, at half its stable gain, s: the median.
    pub recovery_s: Option<f64>,
    /// The live graph at gains about the critical gains without a canceller and with the diagnosed and the chosen one.
    pub live: Vec<LiveRun>,
    /// Share of the diagnosed estimate that was chosen where the grip is uncertain, 0 for no canceller; `None` where no gain was raised.
    pub share: Option<f64>,
}

impl Case {
    /// The stable gain with a canceller and a hand.
    pub fn gain(&self, canceller: &str, hand: Hand) -> Option<f64> {
        self.gains.iter().find(|g| g.canceller == canceller && g.hand == hand).map(|g| g.stable_to)
    }

    /// The stable gain with a canceller over that with the better of the two linear ones.
    pub fn over_linear(&self, canceller: &str, hand: Hand) -> Option<f64> {
        let linear = self.gain("second order", hand)?.max(self.gain("linear, refitted", hand)?);
        Some(self.gain(canceller, hand)? / linear).filter(|r| r.is_finite())
    }

    /// The same over the best of what a user has without a diagnosis: no canceller, or one of the two linear ones.
    pub fn over_others(&self, canceller: &str, hand: Hand) -> Option<f64> {
        let best = OTHERS.iter().map(|other| self.gain(other, hand)).try_fold(0.0_f64, |best, gain| Some(best.max(gain?)))?;
        Some(self.gain(canceller, hand)? / best).filter(|r| r.is_finite())
    }

    /// The hands with which gains were measured, the session's first.
    pub fn hands(&self) -> Vec<Hand> {
        let mut hands = Vec::new();
        for gain in &self.gains {
            if !hands.contains(&gain.hand) {
                hands.push(gain.hand);
            }
        }
        hands
    }

    /// What kind of effect is concealed first: dry friction, hysteresis, backlash, something else; `None` where nothing is.
    pub fn kind(&self) -> Option<&'static str> {
        let name = self.concealed.first()?.split(' ').next()?;
        let kind = KINDS.iter().find(|(_, names)| names.contains(&name));
        Some(kind.map_or("another effect", |(kind, _)| kind))
    }

    /// Whether the recordings show what is concealed: the error of the nominal model on held-out data, with any refit, is at least [`SHOWS`] standard
    /// deviations of the sensor noise. Below that its parameters absorb the effect.
    pub fn shows(&self) -> bool {
        self.refit_floors.is_none_or(|floors| floors >= SHOWS)
    }

    /// Whether everything concealed was found by its family and place, and nothing where nothing was.
    pub fn is_right(&self) -> bool {
        if self.marks.is_empty() { self.findings.is_empty() } else { self.marks.iter().all(|m| m.family) }
    }

    /// A few lines for a person.
    pub fn text(&self) -> String {
        let list = |names: &[String]| if names.is_empty() { "nothing".to_string() } else { names.join(", ") };
        let found: Vec<String> = self.findings.iter().map(|f| format!("{} {}", f.physics, f.place.join("-"))).collect();
        let percent = |x: Option<f64>| x.map_or("-".to_string(), |x| format!("{:.2} %", 100.0 * x));
        let here = self.gains.iter().filter(|g| g.hand == Hand::SESSION);
        let gains: Vec<String> =
            here.map(|g| format!("{} {}{:.2}", g.canceller, if g.whole_range { "above " } else { "" }, g.stable_to)).collect();
        let [given, refitted, diagnosed] = self.held_out.map(percent);
        let floors = self.refit_floors.map_or_else(String::new, |floors| format!(" ({floors:.1} sd of the noise)"));
        let mut text = format!(
            "  concealed   {}\n  found       {} ({})\n  held out    {given} as given, {refitted} refitted{floors}, {diagnosed} diagnosed",
            list(&self.concealed),
            list(&found),
            self.word.name(),
        );
        if !gains.is_empty() {
            text += &format!("\n  stable to   {}", gains.join(", "));
            let worth = |hand: &Hand| Some(format!("{hand} {:.2}", self.over_others(ESTIMATED, *hand)?));
            let worths: Vec<String> = self.hands().iter().filter_map(worth).collect();
            text += &format!("\n  {ESTIMATED}, over the best of none, second order and linear refitted: {}", worths.join(", "));
            if let Some(time) = self.recovery_s {
                text += &format!("; settles {time:.2} s after a change of the grip");
            }
        }
        if !self.live.is_empty() {
            let agree = self.live.iter().filter(|run| run.agrees()).count();
            text += &format!("\n  live graph  {agree} of {} runs near those limits agree with them", self.live.len());
        }
        text
    }

    /// For programs.
    pub fn json(&self) -> Value {
        json!({
            "case": self.name, "sealed": self.sealed, "shows_hand": self.shows_hand, "nominal_refitted": self.refitted, "verdict": self.word, "sentence": self.sentence,
            "findings": self.findings, "concealed": self.concealed, "marks": self.marks, "nonlinear": self.nonlinear,
            "held_out": self.held_out, "refit_floors": self.refit_floors, "stable_gain": self.gains, "live": self.live, "share": self.share,
            "over_others": self.hands().iter().map(|hand| json!({ "hand": hand, "diagnosed": self.over_others("diagnosed", *hand),
                "chosen": self.over_others("chosen", *hand), "hand_estimated": self.over_others(ESTIMATED, *hand) })).collect::<Vec<_>>(),
            "recovery_s": self.recovery_s, "ratio": self.over_linear("diagnosed", Hand::SESSION),
        })
    }
}
