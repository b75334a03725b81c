//! What is known of a device and its recordings before anything is asked.

use std::path::PathBuf;

/// What is known before anything is asked; a question that none of it answers is asked, or takes its default.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Folder of the recordings, and of the files that are written.
    pub folder: PathBuf,
    /// A recording (CSV, MCAP, NumPy, MATLAB or parquet); may be given several times. Without this all in the folder.
    pub recording: Vec<PathBuf>,
    /// The recording that no fit sees. Without this the one that is driven neither most nor least.
    pub held_out: Option<PathBuf>,
    /// Names of the columns of tables that have no heading, in their order; a name may state its unit.
    pub columns: Vec<String>,
    /// Rows per second of tables in which no column is the time.
    pub rate: Option<f64>,
    /// Whether it moves along a line or turns.
    pub motion: Option<Motion>,
    /// What is prescribed and recorded: a force (a torque), a motor's current, or a motion whose reaction force is measured.
    pub driven: Option<Driven>,
    /// The column of it.
    pub drive: Option<String>,
    /// Its unit, where the heading names none.
    pub drive_unit: Option<String>,
    /// The motor's constant, N/A or N m/A; a gear's ratio is part of it.
    pub constant: Option<f64>,
    /// The column of the time; without this t or time.
    pub time: Option<String>,
    /// Its unit, where the heading names none: s, ms, us, ns, min.
    pub time_unit: Option<String>,
    /// The column of a measured position or angle; `none` where there is none.
    pub position: Option<String>,
    /// Its unit, where the heading names none.
    pub position_unit: Option<String>,
    /// Size of one count, m or rad, where the position (or, without --position, the prescribed motion) is in counts.
    pub per_count: Option<f64>,
    /// Step of the position's encoder, m or rad; without this what the samples show.
    pub resolution: Option<f64>,
    /// The column of a measured velocity; `none` where there is none.
    pub velocity: Option<String>,
    /// Its unit, where the heading names none.
    pub velocity_unit: Option<String>,
    /// The column of a measured force (or torque): of a prescribed motion its reaction, else that in the joint to a load; `none` where there is none.
    pub force: Option<String>,
    /// Its unit, where the heading names none.
    pub force_unit: Option<String>,
    /// What the driven body holds on to: nothing, a spring to the frame (a specimen, a return spring), or a load behind a joint that yields.
    pub attached: Option<Attached>,
    /// Roughly where a load rings against the motor, Hz.
    pub resonance: Option<f64>,
    /// A hand that nobody measured holds the device: it becomes a slow curve that is found with the rest.
    pub hand: Option<bool>,
    /// The moving mass, kg, or inertia, kg m^2; without this an estimate from the recordings.
    pub inertia: Option<f64>,
    /// How each recording begins. Without this what the samples show.
    pub start: Option<Start>,
    /// Take the default of every question that no option answers.
    pub yes: bool,
    /// Replace model.toml and set.toml if they exist.
    pub overwrite: bool,
}

/// A word of several that an option or an answer on a terminal may be.
pub trait Choice: Copy + PartialEq + 'static {
    /// All of them, with their words.
    const ALL: &'static [(&'static str, Self)];

    /// Its word.
    fn word(self) -> &'static str {
        Self::ALL.iter().find(|(_, choice)| *choice == self).map_or("", |(word, _)| word)
    }

    /// The one of this word, in whichever case.
    fn of(text: &str) -> Option<Self> {
        Self::ALL.iter().find(|(word, _)| word.eq_ignore_ascii_case(text)).map(|(_, choice)| *choice)
    }
}

/// See [`Options::motion`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Along a line: m, kg, N.
    Translation,
    /// It turns: rad, kg m², N m.
    Rotation,
}

impl Choice for Motion {
    const ALL: &'static [(&'static str, Motion)] = &[("translation", Motion::Translation), ("rotation", Motion::Rotation)];
}

impl Motion {
    /// One word or another.
    pub fn pick<T>(self, translation: T, rotation: T) -> T {
        match self {
            Motion::Translation => translation,
            Motion::Rotation => rotation,
        }
    }
}

/// See [`Options::driven`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Driven {
    /// A force or a torque.
    Force,
    /// A motor's current.
    Current,
    /// A prescribed motion.
    Motion,
}

impl Choice for Driven {
    const ALL: &'static [(&'static str, Driven)] = &[("force", Driven::Force), ("current", Driven::Current), ("motion", Driven::Motion)];

    fn of(text: &str) -> Option<Driven> {
        let is = |word: &str| word.eq_ignore_ascii_case(text);
        // A torque is the force of what turns.
        if is("torque") { Some(Driven::Force) } else { Driven::ALL.iter().find(|(word, _)| is(word)).map(|(_, driven)| *driven) }
    }
}

/// See [`Options::attached`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Attached {
    /// Nothing but its own mass and bearing.
    Nothing,
    /// A spring to the frame.
    Spring,
    /// A second body behind a joint that yields.
    Load,
}

impl Choice for Attached {
    const ALL: &'static [(&'static str, Attached)] =
        &[("nothing", Attached::Nothing), ("spring", Attached::Spring), ("load", Attached::Load)];
}

/// See [`Options::start`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// At rest at the first sample.
    Rest,
    /// In any state.
    Free,
}

impl Choice for Start {
    const ALL: &'static [(&'static str, Start)] = &[("rest", Start::Rest), ("free", Start::Free)];
}

impl Choice for bool {
    const ALL: &'static [(&'static str, bool)] = &[("yes", true), ("no", false)];
}
