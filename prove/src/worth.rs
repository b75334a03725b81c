//! What cancellers are worth over several cases: the stable gain beside that of what a user has without a diagnosis.

use super::case::Case;
use super::chosen::AS_GOOD;
use super::gain::{ESTIMATED, Hand};
use super::statistics::Share;
use backdrive_signal::statistics::median;
use serde::Serialize;

/// The cancellers that a diagnosis makes possible, in this order everywhere.
pub const DIAGNOSED: [&str; 3] = ["diagnosed", "chosen", ESTIMATED];

/// What a canceller is worth with one hand.
#[derive(Debug, Clone, Serialize)]
pub struct OfOne {
    /// Which canceller.
    pub canceller: &'static str,
    /// Median of its stable gain over the best of none, second order and linear refitted: what it is worth to a user.
    pub over_others: Option<f64>,
    /// The same over the better of the two linear ones, which are often below none.
    pub over_linear: Option<f64>,
    /// In how many cases it is below no canceller.
    pub below_none: Share,
}

/// What the cancellers are worth with one hand.
#[derive(Debug, Clone, Serialize)]
pub struct Worth {
    /// The hand: a factor on the grip of the session, or `changing`.
    #[serde(rename = "grip")]
    pub hand: Hand,
    /// In the order of [`DIAGNOSED`].
    pub cancellers: Vec<OfOne>,
}

/// A group of cases.
#[derive(Debug, Clone, Serialize)]
pub struct Group {
    /// What they conceal.
    pub kind: &'static str,
    /// How many they are.
    pub cases: usize,
    /// By hand, the softest first, the changing one last.
    pub worths: Vec<Worth>,
    /// Median time to settle after a change of the grip, s.
    pub recovery_s: Option<f64>,
}

impl Group {
    /// Of cases; `None` of none, and where no gain was raised.
    pub fn of(kind: &'static str, cases: &[&Case]) -> Option<Group> {
        let mut hands = cases.first()?.hands();
        let place = |hand: &Hand| match hand {
            Hand::Grip(factor) => *factor,
            Hand::Changing => f64::INFINITY,
        };
        hands.sort_by(|a, b| place(a).total_cmp(&place(b)));
        if hands.is_empty() {
            return None;
        }
        let worths = hands.into_iter().map(|hand| Worth { hand, cancellers: DIAGNOSED.map(|c| of_one(cases, c, hand)).to_vec() }).collect();
        let recovery_s = median(cases.iter().filter_map(|c| c.recovery_s).collect());
        Some(Group { kind, cases: cases.len(), worths, recovery_s })
    }

    /// A line for each hand.
    pub fn text(&self) -> String {
        let number = |x: Option<f64>| x.map_or("-".to_string(), |x| format!("{x:.1}"));
        let mut text = String::new();
        for Worth { hand, cancellers } in &self.worths {
            let list = |of: &dyn Fn(&OfOne) -> String| {
                cancellers.iter().map(|c| format!("{} {}", c.canceller, of(c))).collect::<Vec<_>>().join(", ")
            };
            text += &format!(
                "\n{} ({} cases), {hand}: stable gain over the best of none, second order and linear refitted, median: {}; below no canceller: {}; over the better linear canceller: {}",
                self.kind,
                self.cases,
                list(&|c| number(c.over_others)),
                list(&|c| c.below_none.to_string()),
                list(&|c| number(c.over_linear)),
            );
        }
        if let Some(time) = self.recovery_s {
            text +=
                &format!("\n{}: after a change of the grip the loop with the hand estimated settles in {time:.2} s (median)", self.kind);
        }
        text
    }
}

fn of_one(cases: &[&Case], canceller: &'static str, hand: Hand) -> OfOne {
    let both = cases.iter().filter_map(|c| Some((c.gain(canceller, hand)?, c.gain("none", hand)?)));
    let (are, of) = both.fold((0, 0), |(are, of), (with, none)| (are + usize::from(with < AS_GOOD * none), of + 1));
    OfOne {
        canceller,
        over_others: median(cases.iter().filter_map(|c| c.over_others(canceller, hand)).collect()),
        over_linear: median(cases.iter().filter_map(|c| c.over_linear(canceller, hand)).collect()),
        below_none: Share { are, of },
    }
}
