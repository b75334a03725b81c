//! What a plot shows, as data: axes, series, regions, marker lines, annotations.

use crate::style::Tone;

/// A colour by its role; the page's style sheet defines its look in a light and in a dark scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Colour {
    /// The next one of the palette (Okabe and Ito's, which colour-blind readers can distinguish).
    #[default]
    Auto,
    /// The one of the palette with this number, to pair a band with its line.
    Nth(usize),
    /// The colour of a verdict.
    Tone(Tone),
    /// The colour of the text.
    Ink,
    /// A grey that stays behind the rest.
    Muted,
}

/// How a line is broken, so that lines can be distinguished without colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Dash {
    /// The first line whole, each further one by a pattern of its own.
    #[default]
    Auto,
    /// Unbroken.
    Solid,
    /// Dashes.
    Dashed,
    /// Dots.
    Dotted,
    /// Dashes and dots.
    DashDot,
}

#[derive(Clone, Debug)]
pub(crate) enum Kind {
    Line,
    Points,
    Band { upper: Vec<f64> },
    Discs { radius: Vec<f64> },
    Bars,
}

/// One set of data with its name in the legend. Vectors of different length are drawn up to the shorter one, and the plot states this. What is not
/// finite is left out and breaks a line.
#[derive(Clone, Debug)]
pub struct Series {
    pub(crate) name: String,
    pub(crate) x: Vec<f64>,
    pub(crate) y: Vec<f64>,
    pub(crate) kind: Kind,
    pub(crate) colour: Colour,
    pub(crate) dash: Dash,
    pub(crate) width: f64,
    pub(crate) in_limits: bool,
    pub(crate) by: Option<By>,
}

/// What colours a line along its way.
#[derive(Clone, Debug)]
pub(crate) struct By {
    pub label: String,
    pub unit: String,
    pub values: Vec<f64>,
}

impl Series {
    fn new(name: &str, x: &[f64], y: &[f64], kind: Kind) -> Self {
        Self {
            name: name.into(),
            x: x.to_vec(),
            y: y.to_vec(),
            kind,
            colour: Colour::Auto,
            dash: Dash::Auto,
            width: 1.7,
            in_limits: true,
            by: None,
        }
    }

    /// A line through the points in their order. An empty name keeps it out of the legend.
    pub fn line(name: &str, x: &[f64], y: &[f64]) -> Self {
        Self::new(name, x, y, Kind::Line)
    }

    /// A mark at each point; each such series has a shape of its own.
    pub fn points(name: &str, x: &[f64], y: &[f64]) -> Self {
        Self::new(name, x, y, Kind::Points)
    }

    /// The area between two curves over x, for instance a 95 % interval.
    pub fn band(name: &str, x: &[f64], lower: &[f64], upper: &[f64]) -> Self {
        Self::new(name, x, lower, Kind::Band { upper: upper.to_vec() })
    }

    /// The area that the discs cover together: centres (re, im) and radii in units of x. Meant for equal aspect, as uncertainty discs in a Nyquist
    /// plot; with another aspect they become ellipses.
    pub fn discs(name: &str, re: &[f64], im: &[f64], radius: &[f64]) -> Self {
        Self::new(name, re, im, Kind::Discs { radius: radius.to_vec() })
    }

    /// A bar from 0 (from the lower end of a logarithmic axis) to y at each x, as wide as the narrowest distance in x allows.
    pub fn bars(name: &str, x: &[f64], y: &[f64]) -> Self {
        Self::new(name, x, y, Kind::Bars)
    }

    /// Sets the colour; default [`Colour::Auto`].
    pub fn colour(mut self, colour: Colour) -> Self {
        self.colour = colour;
        self
    }

    /// Sets the dash of a line; default [`Dash::Auto`]. A trace too dense to be followed by eye is drawn unbroken whatever is set.
    pub fn dash(mut self, dash: Dash) -> Self {
        self.dash = dash;
        self
    }

    /// Sets the width of a line or the radius of a mark, px; default 1.7.
    pub fn width(mut self, px: f64) -> Self {
        if px.is_finite() && px > 0.0 {
            self.width = px;
        }
        self
    }

    /// Colours a line along its way by these values, one for each point (for instance the frequency along a Nyquist curve); the legend
    /// shows the scale and hovering the value. Meant for curves of up to some thousand points: they are not thinned.
    pub fn by(mut self, label: &str, unit: &str, values: &[f64]) -> Self {
        self.by = Some(By { label: label.into(), unit: unit.into(), values: values.to_vec() });
        self
    }

    /// Keeps these data from widening the automatic limits: they are drawn as far as the others leave room.
    pub fn outside_limits(mut self) -> Self {
        self.in_limits = false;
        self
    }

    /// How many samples can be drawn, and whether the vectors differ in length.
    pub(crate) fn len(&self) -> (usize, bool) {
        let third = match &self.kind {
            Kind::Band { upper } => upper.len(),
            Kind::Discs { radius } => radius.len(),
            _ => self.y.len(),
        };
        let shortest = self.x.len().min(self.y.len()).min(third);
        (shortest, shortest != self.x.len() || shortest != self.y.len() || shortest != third)
    }
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Axis {
    pub label: String,
    pub unit: String,
    pub log: bool,
    pub limits: Option<(f64, f64)>,
    pub include: Vec<f64>,
    /// Names of the places 1, 2, ...; empty for numbers.
    pub names: Vec<String>,
}

#[derive(Clone, Debug)]
pub(crate) struct Region {
    pub from: f64,
    pub to: f64,
    pub tone: Tone,
    pub label: String,
}

#[derive(Clone, Debug)]
pub(crate) struct Marker {
    pub vertical: bool,
    pub at: f64,
    pub label: String,
    pub tone: Tone,
}

#[derive(Clone, Debug)]
pub(crate) struct Annotation {
    pub x: f64,
    pub y: f64,
    pub label: String,
    pub tone: Tone,
}

/// A plot with its axes. Values are given in base units (m, s, N, Hz); the axis chooses its prefix.
///
/// ```
/// use backdrive_report::{Plot, Tone};
/// let gain = [0.1, 1.0, 10.0];
/// let amplitude = [1e-5, 2e-5, 3e-3];
/// let plot = Plot::new("Sweep")
///     .x_axis("gain μλ", "").x_log()
///     .y_axis("amplitude", "m").y_log()
///     .region(0.1, 4.0, Tone::Good, "stable")
///     .region(4.0, 10.0, Tone::Bad, "unstable")
///     .vertical(4.0, "edge", Tone::Neutral)
///     .points("simulated", &gain, &amplitude);
/// ```
#[derive(Clone, Debug)]
pub struct Plot {
    pub(crate) title: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) series: Vec<Series>,
    pub(crate) regions: Vec<Region>,
    pub(crate) markers: Vec<Marker>,
    pub(crate) annotations: Vec<Annotation>,
    pub(crate) equal_aspect: bool,
    pub(crate) height: Option<f64>,
}

impl Plot {
    /// An empty plot with this title (which may be empty).
    pub fn new(title: &str) -> Self {
        Self {
            title: title.into(),
            x: Axis::default(),
            y: Axis::default(),
            series: Vec::new(),
            regions: Vec::new(),
            markers: Vec::new(),
            annotations: Vec::new(),
            equal_aspect: false,
            height: None,
        }
    }

    /// Sets the title.
    pub fn titled(mut self, title: &str) -> Self {
        self.title = title.into();
        self
    }

    /// Names the x axis and the unit of its values, `""` for none.
    pub fn x_axis(mut self, label: &str, unit: &str) -> Self {
        self.x.label = label.into();
        self.x.unit = unit.into();
        self
    }

    /// Writes these names at x = 1, 2, ... in place of numbers, for bars that each stand for a thing. Without effect on a logarithmic axis.
    pub fn x_names<S: Into<String>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        self.x.names = names.into_iter().map(Into::into).collect();
        self
    }

    /// Names the y axis and the unit of its values, `""` for none. An axis in `°` has its ticks at parts of the circle.
    pub fn y_axis(mut self, label: &str, unit: &str) -> Self {
        self.y.label = label.into();
        self.y.unit = unit.into();
        self
    }

    /// Makes the x axis logarithmic. Values that are not positive are left out, and the plot states their number.
    pub fn x_log(mut self) -> Self {
        self.x.log = true;
        self
    }

    /// Makes the y axis logarithmic. Values that are not positive are left out, and the plot states their number.
    pub fn y_log(mut self) -> Self {
        self.y.log = true;
        self
    }

    /// Fixes the limits of x; data beyond them are cut. Default: all data, with some air. Limits that make no axis are ignored.
    pub fn x_limits(mut self, from: f64, to: f64) -> Self {
        self.x.limits = Some((from, to));
        self
    }

    /// Fixes the limits of y; data beyond them are cut. Default: all data, with some air. Limits that make no axis are ignored.
    pub fn y_limits(mut self, from: f64, to: f64) -> Self {
        self.y.limits = Some((from, to));
        self
    }

    /// Makes the automatic limits hold this point.
    pub fn include(mut self, x: f64, y: f64) -> Self {
        self.x.include.push(x);
        self.y.include.push(y);
        self
    }

    /// Makes the automatic limits of y hold this value, for instance 0.
    pub fn include_y(mut self, y: f64) -> Self {
        self.y.include.push(y);
        self
    }

    /// One unit of x as long as one unit of y, as a Nyquist plot needs. Without effect on logarithmic axes.
    pub fn equal_aspect(mut self) -> Self {
        self.equal_aspect = true;
        self
    }

    /// Sets the height of the axes in a drawing 860 px wide, px; default 300, or 190 in a stack, or what equal aspect needs.
    pub fn height(mut self, px: f64) -> Self {
        if px.is_finite() {
            self.height = Some(px.clamp(60.0, 2000.0));
        }
        self
    }

    /// Adds a series.
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Adds a line; for its colour and dash use [`Plot::series`].
    pub fn line(self, name: &str, x: &[f64], y: &[f64]) -> Self {
        self.series(Series::line(name, x, y))
    }

    /// Adds points; for their colour use [`Plot::series`].
    pub fn points(self, name: &str, x: &[f64], y: &[f64]) -> Self {
        self.series(Series::points(name, x, y))
    }

    /// Adds a band in the colour of the series added next.
    pub fn band(self, name: &str, x: &[f64], lower: &[f64], upper: &[f64]) -> Self {
        self.series(Series::band(name, x, lower, upper))
    }

    /// Adds discs in the colour of the series added next.
    pub fn discs(self, name: &str, re: &[f64], im: &[f64], radius: &[f64]) -> Self {
        self.series(Series::discs(name, re, im, radius))
    }

    /// Colours a span of x, behind the data, for instance by the verdict there. Neighbours alike in tone and label become one. The label
    /// is written into the span where there is room, else it stands in the legend.
    pub fn region(mut self, from: f64, to: f64, tone: Tone, label: &str) -> Self {
        self.regions.push(Region { from, to, tone, label: label.into() });
        self
    }

    /// Marks an x by a line from bottom to top.
    pub fn vertical(mut self, x: f64, label: &str, tone: Tone) -> Self {
        self.markers.push(Marker { vertical: true, at: x, label: label.into(), tone });
        self
    }

    /// Marks a y by a line from left to right.
    pub fn horizontal(mut self, y: f64, label: &str, tone: Tone) -> Self {
        self.markers.push(Marker { vertical: false, at: y, label: label.into(), tone });
        self
    }

    /// Marks a point and writes the label where it hides least.
    pub fn annotate(mut self, x: f64, y: f64, label: &str, tone: Tone) -> Self {
        self.annotations.push(Annotation { x, y, label: label.into(), tone });
        self
    }
}
