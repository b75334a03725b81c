//! Whose number a path leads to, and its unit.

#[path = "../../tests/common/naming.rs"]
mod naming;

use backdrive_plant::model::Model;
use backdrive_plant::parse::{InputKey, NumberOf, OutputKey};
use naming::assert_names;

const TEXT: &str = "name = 'pendulum'\nmotion = 'MOTION'\n[bodies]\narm = 2.0\n\
     [[elements]]\nname = 'bearing'\nkind = 'damper'\nbetween = ['arm', 'ground']\ndamping = 0.1\n\
     [[inputs]]\nname = 'drive'\nkind = 'force'\non = 'arm'\n\
     [[outputs]]\nname = 'speed'\nkind = 'velocity'\nof = 'arm'\n";

fn model(motion: &str) -> Model {
    Model::from_toml(&TEXT.replace("MOTION", motion), "pendulum.toml").unwrap()
}

#[test]
fn every_number_has_an_owner_and_the_unit_of_the_motion() {
    let (line, turn) = (model("translation"), model("rotation"));
    for (path, owner, units) in [
        ("bodies.arm", NumberOf::Body(0), ["kg", "kg m²"]),
        ("elements.bearing.damping", NumberOf::Element(0, 0), ["N s/m", "N m s/rad"]),
        ("inputs.drive.gain", NumberOf::Input(0, InputKey::Gain), ["-", "-"]),
        ("inputs.drive.saturation", NumberOf::Input(0, InputKey::Saturation), ["N", "N m"]),
        ("inputs.drive.bandwidth", NumberOf::Input(0, InputKey::Bandwidth), ["Hz", "Hz"]),
        ("inputs.drive.back_emf", NumberOf::Input(0, InputKey::BackEmf), ["N s/m", "N m s/rad"]),
        ("outputs.speed.delay", NumberOf::Output(0, OutputKey::Delay), ["s", "s"]),
        ("outputs.speed.offset", NumberOf::Output(0, OutputKey::Offset), ["m/s", "rad/s"]),
    ] {
        assert_eq!(line.number_at(path), Ok(owner), "{path}");
        assert_eq!([line.unit_at(path).unwrap(), turn.unit_at(path).unwrap()], units, "{path}");
    }
}

#[test]
fn what_there_is_instead_of_a_path_is_said() {
    let error = model("translation").unit_at("inputs.drive.delya").unwrap_err();
    assert_names(&error, &["delya", "delay"]);
    assert_names(model("translation").number_at("drive").unwrap_err(), &["bodies.NAME"]);
}
