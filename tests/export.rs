//! `backdrive export` as a user meets it: text, list, figures, exit codes.

mod system;

use system::assert_names;
use system::{Place, file};

/// A cart with friction that falls with speed.
const CART: &str = "name = \"cart\"
[bodies]
cart = 0.4
[[elements]]
name = \"spring\"
kind = \"spring\"
between = [\"cart\", \"ground\"]
stiffness = 40.0
[[elements]]
name = \"bearing\"
kind = \"stribeck\"
between = [\"cart\", \"ground\"]
coulomb = 0.2
static = 0.6
velocity = 0.05
[[inputs]]
name = \"push\"
kind = \"force\"
on = \"cart\"
[[outputs]]
name = \"position\"
kind = \"position\"
of = \"cart\"
resolution = 1e-6
";

/// Two recordings of the cart.
fn recorded(place: &Place) {
    place.write("cart.toml", CART);
    for (name, drive) in [("one", "sweep:amplitude=2,from=0.3,to=3,duration=4"), ("two", "sweep:amplitude=1.2,from=2,to=0.2,duration=4")] {
        let done = place.backdrive(&["simulate", "cart.toml", drive, "--rate", "500", "--out", &format!("{name}.csv")]);
        assert_eq!(done.code, Some(0), "{done:?}");
    }
}

#[test]
fn the_text_goes_to_standard_output_and_what_is_left_out_to_standard_error() {
    let place = Place::new();
    place.write("cart.toml", CART);
    let done = place.backdrive(&["export", "cart.toml", "--to", "mjcf"]);
    assert_eq!(done.code, Some(1), "{done:?}");
    assert!(done.stdout.starts_with("<mujoco model=\"cart\">") && done.stdout.trim_end().ends_with("</mujoco>"), "{}", done.stdout);
    assert_names(&done.stdout, &["frictionloss=\"0.2\"", "<motor name=\"push\""]);
    for told in [
        "bearing (stribeck)",
        "in its place: Coulomb friction of its level at speed",
        "--on SET",
        "position (resolution)",
        "the motion is the same",
    ] {
        assert!(done.stderr.contains(told), "{told}: {}", done.stderr);
    }
    // A feed-forward has both levels, so nothing is left out.
    let done = place.backdrive(&["export", "cart.toml", "--to", "feedforward"]);
    assert_eq!((done.code, done.stderr.trim()), (Some(0), "nothing is left out"), "{done:?}");
    assert_names(&done.stdout, &["double cart_cart(double q, double dq, double load)"]);
    for (language, says) in [("python", "def cart_cart(q, dq, load=0.0):"), ("yaml", "term: stribeck")] {
        let done = place.backdrive(&["export", "cart.toml", "--to", "feedforward", "--language", language, "--width", "0.002"]);
        done.answers(0, &[says, "0.002"]);
    }
    place.assert_clean(&[]);
}

#[test]
fn recordings_tell_what_leaving_something_out_costs() {
    let place = Place::new();
    recorded(&place);
    let done = place.backdrive(&["export", "cart.toml", "--to", "mjcf", "--on", "one.csv", "two.csv", "--out", "cart.xml", "--json"]);
    assert_eq!(done.code, Some(1), "{done:?}");
    let all = done.json();
    let (with, as_exported) = (all["held_out"]["nrmse"].as_f64().unwrap(), all["held_out"]["nrmse_as_exported"].as_f64().unwrap());
    let bearing = &all["left_out"][0];
    assert_eq!(
        (bearing["name"].as_str(), bearing["kind"].as_str(), bearing["part"].as_str()),
        (Some("bearing"), Some("stribeck"), Some("element"))
    );
    let without = bearing["nrmse_without"].as_f64().unwrap();
    println!("nrmse {with:.5} with, {without:.5} without");
    assert!(with < 1e-3 && without > 0.02 && (without - as_exported).abs() < 1e-12, "{all}");
    assert!(all["left_out"][1]["nrmse_without"].is_null() && all["left_out"][1]["changes_the_motion"] == false, "{all}");
    assert!(all["text"].is_null(), "{all}");
    assert_names(all["held_out"]["of"].as_str().unwrap(), &["held-out"]);
    assert!(std::fs::read_to_string(place.path("cart.xml")).unwrap().starts_with("<mujoco"));
    // The same for a person, with the list on standard output.
    let again = place.backdrive(&["export", "cart.toml", "--to", "mjcf", "--on", "one.csv", "two.csv", "--out", "cart.xml", "--overwrite"]);
    assert_eq!(again.code, Some(1), "{again:?}");
    assert_names(&again.stdout, &["without it", "nrmse on the held-out recordings"]);
}

#[test]
fn what_cannot_be_exported_says_why_in_a_sentence() {
    let place = Place::new();
    place.write("cart.toml", CART);
    place.write("nothing.toml", "name = \"nothing\"\n");
    place.write("free.toml", "name = \"free\"\n[bodies]\na = 1.0\n");
    place.write("there.xml", "mine");
    let cases: [(&[&str], i32, &str); 9] = [
        (&["export", "cart.toml", "--to", "urdf"], 3, "no [robot]"),
        (&["export", "cart.toml", "--to", "isaac"], 3, "no [robot]"),
        (&["export", "free.toml", "--to", "feedforward"], 3, "nothing to compensate"),
        (&["export", "nothing.toml", "--to", "mjcf"], 3, "model of nothing"),
        (&["export", "absent.toml", "--to", "mjcf"], 3, "absent.toml"),
        (&["export", "cart.toml", "--to", "mjcf", "--out", "there.xml"], 3, "--overwrite"),
        (&["export", "cart.toml", "--to", "mjcf", "--on", "absent.csv"], 3, "absent.csv"),
        (&["export", "cart.toml", "--to", "mjcf", "--step", "0"], 2, "above 0"),
        (&["export", "cart.toml"], 2, "--to"),
    ];
    for (arguments, code, says) in cases {
        let done = place.backdrive(arguments);
        assert_eq!(done.code, Some(code), "{arguments:?}: {done:?}");
        assert!(done.stderr.contains(says) && done.stdout.is_empty(), "{arguments:?}: {done:?}");
    }
    assert_eq!(std::fs::read_to_string(place.path("there.xml")).unwrap(), "mine");
    // A fragment is no device.
    let done = place.backdrive(&["export", &file("plant/grips/normal.toml"), "--to", "mjcf"]);
    assert_eq!(done.code, Some(3), "{done:?}");
}
