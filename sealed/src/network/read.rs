//! Model files and grips in.

use super::allowed::Allowed;
use super::data::{Axis, Body, Element, Hold, Input, InputKind, Named, Network, Output, OutputKind, Place};
use super::grip::Grip;
use super::section::{NetworkError, Section, Source};
use crate::effects::site::GROUND;
use crate::laws::Law;
use crate::seal::hash;
use toml_edit::Document;

/// Body of a grip that stands for the one it is attached to.
const PORT: &str = "port";

/// Body of a grip whose motion is the operator's intent.
const HAND: &str = "hand";

impl Network {
    /// The device that a model file's text describes; `file` is its name in errors.
    ///
    /// # Errors
    ///
    /// [`NetworkError`] with line and key: not TOML, an unknown or missing key, a number out of range, or a name that is nowhere or twice. Also for
    /// a kind that this plant does not know, a free body without inertia, or a fragment instead of a device.
    pub fn from_toml(text: &str, file: &str) -> Result<Network, NetworkError> {
        let source = Source { file, text };
        let document = parse(source)?;
        let mut top = Section::new(source, document.as_table(), None, "");
        if top.text("kind")?.is_some_and(|kind| kind != "device") {
            return Err(top.error("kind", "this is a fragment, not a device; give the model file of a device"));
        }
        let name = top.text("name")?.unwrap_or(file).to_string();
        let mut network = Network { nominal: Named { name, sha256: hash(text.as_bytes()) }, ..Network::default() };
        describe(&mut top)?;
        for (name, inertia) in top.named_numbers("bodies", Allowed::NotNegative)? {
            if name == GROUND {
                return Err(top.error("bodies", "ground is there already; omit it"));
            }
            network.bodies.push(Body { name: name.to_string(), inertia });
        }
        for mut section in top.sections("elements")? {
            let element = element(&mut section, &network.elements, |name| network.place(name))?;
            section.finish()?;
            network.elements.push(element);
        }
        for mut section in top.sections("inputs")? {
            let input = input(&mut section, &network)?;
            section.finish()?;
            network.inputs.push(input);
        }
        for mut section in top.sections("outputs")? {
            let output = output(&mut section, &network)?;
            section.finish()?;
            network.outputs.push(output);
        }
        for mut section in top.sections("axes")? {
            let axis = axis(&mut section, &network)?;
            section.finish()?;
            network.axes.push(axis);
        }
        for (index, body) in network.bodies.iter().enumerate() {
            let inerter = network.elements.iter().any(|e| e.between.contains(&Some(index)) && e.law.to_force().inertance() > 0.0);
            if body.inertia == 0.0 && !inerter && !network.is_moved(index) {
                let message = format!("\"{}\" moves freely without inertia; give it some, an inerter, or a motion input", body.name);
                return Err(top.error("bodies", message));
            }
        }
        top.finish()?;
        Ok(network)
    }
}

impl Grip {
    /// The hand that a grip file's text describes; `file` is its name in errors.
    ///
    /// # Errors
    ///
    /// As [`Network::from_toml`]; also bodies of its own, and places other than `port`, `hand` and `ground`.
    pub fn from_toml(text: &str, file: &str) -> Result<Grip, NetworkError> {
        let source = Source { file, text };
        let document = parse(source)?;
        let mut top = Section::new(source, document.as_table(), None, "");
        if top.text("kind")? != Some("fragment") {
            return Err(top.error("kind", "expected kind = \"fragment\"; give the file of a grip"));
        }
        let name = top.text("name")?.unwrap_or(file).to_string();
        describe(&mut top)?;
        let mut grip = Grip { file: Named { name, sha256: hash(text.as_bytes()) }, elements: Vec::new() };
        for mut section in top.sections("elements")? {
            let place = |name: &str| match name {
                GROUND => Some(None),
                PORT => Some(Some(Grip::PORT)),
                HAND => Some(Some(Grip::HAND)),
                _ => None,
            };
            let element = element(&mut section, &grip.elements, place)?;
            section.finish()?;
            grip.elements.push(element);
        }
        top.finish()?;
        Ok(grip)
    }
}

fn parse<'a>(source: Source<'a>) -> Result<Document<&'a str>, NetworkError> {
    Document::parse(source.text).map_err(|error| source.error(error.span(), "", format!("not TOML: {}", error.message())))
}

fn describe(top: &mut Section) -> Result<(), NetworkError> {
    top.text("title")?;
    top.text("source")?;
    match top.text("motion")? {
        None | Some("translation" | "rotation") => Ok(()),
        Some(other) => Err(top.error("motion", format!("expected \"translation\" or \"rotation\", found \"{other}\""))),
    }
}

/// Reads the name of a section, which no earlier one may have.
fn new_name<'a>(section: &mut Section<'a>, before: impl Fn(&str) -> bool) -> Result<&'a str, NetworkError> {
    let name = section.need_text("name")?;
    section.call(name);
    if before(name) {
        return Err(section.error("name", "another one has this name; choose a new one"));
    }
    Ok(name)
}

fn element(section: &mut Section, before: &[Element], place: impl Fn(&str) -> Option<Place>) -> Result<Element, NetworkError> {
    let name = new_name(section, |name| before.iter().any(|element| element.name == name))?;
    let between = section.texts("between")?;
    let &[first, second] = between.as_slice() else { return Err(section.error("between", "expected two names")) };
    let resolve =
        |name: &str| place(name).ok_or_else(|| section.error("between", format!("there is no body \"{name}\"; correct it or add it")));
    let between = [resolve(first)?, resolve(second)?];
    if between[0] == between[1] {
        return Err(section.error("between", "expected two different places"));
    }
    Ok(Element { name: name.to_string(), between, law: Law::read(section)?, of_grip: false })
}

fn input(section: &mut Section, network: &Network) -> Result<Input, NetworkError> {
    let name = new_name(section, |name| network.input(name).is_some() || network.output(name).is_some())?.to_string();
    let kind = match section.need_text("kind")? {
        "force" => InputKind::Force,
        "motion" => InputKind::Motion,
        other => return Err(section.error("kind", format!("expected \"force\" or \"motion\", found \"{other}\""))),
    };
    let on = body(section, "on", network)?;
    if kind == InputKind::Motion && network.is_moved(on) {
        return Err(section.error("on", "another input moves this body already"));
    }
    let hold = match (section.text("hold")?, kind) {
        (Some("zero"), InputKind::Motion) => {
            return Err(section.error("hold", "a motion that jumps has no finite force; choose \"linear\" or \"cubic\""));
        }
        (Some("zero"), _) | (None, InputKind::Force) => Hold::Zero,
        (Some("linear"), _) => Hold::Linear,
        (Some("cubic"), _) | (None, InputKind::Motion) => Hold::Cubic,
        (Some(other), _) => return Err(section.error("hold", format!("expected \"zero\", \"linear\" or \"cubic\", found \"{other}\""))),
    };
    let input = Input {
        name,
        kind,
        on,
        hold,
        gain: section.number("gain", Allowed::Any)?.unwrap_or(1.0),
        saturation: section.number("saturation", Allowed::Positive)?.unwrap_or(f64::INFINITY),
        delay: section.number("delay", Allowed::NotNegative)?.unwrap_or(0.0),
        bandwidth: section.number("bandwidth", Allowed::Positive)?.unwrap_or(f64::INFINITY),
        back_emf: section.number("back_emf", Allowed::NotNegative)?.unwrap_or(0.0),
    };
    if kind == InputKind::Motion
        && (input.saturation.is_finite() || input.bandwidth.is_finite() || input.back_emf != 0.0 || input.delay != 0.0)
    {
        return Err(section.error("kind", "delay, saturation, bandwidth and back_emf are for forces; remove them from this motion"));
    }
    Ok(input)
}

fn output(section: &mut Section, network: &Network) -> Result<Output, NetworkError> {
    let name = new_name(section, |name| network.input(name).is_some() || network.output(name).is_some())?.to_string();
    let kind = match section.need_text("kind")? {
        "position" => OutputKind::Position(body(section, "of", network)?),
        "velocity" => OutputKind::Velocity(body(section, "of", network)?),
        "acceleration" => OutputKind::Acceleration(body(section, "of", network)?),
        "reaction" => {
            let of = body(section, "of", network)?;
            if !network.is_moved(of) {
                return Err(section.error("of", "no motion input moves this body, so it has no reaction"));
            }
            OutputKind::Reaction(of)
        }
        "force" => {
            let mut elements = Vec::new();
            for name in section.texts("element")? {
                let index = network.element(name);
                elements
                    .push(index.ok_or_else(|| section.error("element", format!("there is no element \"{name}\"; correct it or add it")))?);
            }
            OutputKind::Force(elements)
        }
        other => {
            let expected = "expected \"position\", \"velocity\", \"acceleration\", \"force\" or \"reaction\"";
            return Err(section.error("kind", format!("{expected}, found \"{other}\"")));
        }
    };
    Ok(Output {
        name,
        kind,
        gain: section.number("gain", Allowed::Any)?.unwrap_or(1.0),
        delay: section.number("delay", Allowed::NotNegative)?.unwrap_or(0.0),
        offset: section.number("offset", Allowed::Any)?.unwrap_or(0.0),
        resolution: section.number("resolution", Allowed::NotNegative)?.unwrap_or(0.0),
    })
}

fn axis(section: &mut Section, network: &Network) -> Result<Axis, NetworkError> {
    let name = new_name(section, |name| network.axes.iter().any(|axis| axis.name == name))?.to_string();
    let user = body(section, "user", network)?;
    let feedback = section.need_text("feedback")?;
    let feedback = network.input(feedback).ok_or_else(|| section.error("feedback", format!("there is no input \"{feedback}\"")))?;
    let measured = section.need_text("measured")?;
    let measured = network.output(measured).ok_or_else(|| section.error("measured", format!("there is no output \"{measured}\"")))?;
    let scale = section.number("scale", Allowed::Any)?.unwrap_or(1.0);
    if scale == 0.0 {
        return Err(section.error("scale", "expected a number other than 0"));
    }
    // Limits are the graph's to keep; the device does not know them.
    if let Some(travel) = section.numbers("travel", Allowed::Any)?
        && !matches!(travel.as_slice(), [low, high] if low < high)
    {
        return Err(section.error("travel", "expected two numbers, the lower one first"));
    }
    for limit in ["force", "force_rate", "speed"] {
        section.number(limit, Allowed::Positive)?;
    }
    Ok(Axis { name, user, holds_user: section.flag("holds_user")?, hand: None, feedback, measured, scale })
}

fn body(section: &mut Section, key: &str, network: &Network) -> Result<usize, NetworkError> {
    let name = section.need_text(key)?;
    network.body(name).ok_or_else(|| section.error(key, format!("there is no body \"{name}\"; correct it or add it")))
}
