//! Units of a translation, and the same quantities of a rotation.

use crate::model::Motion;

/// The unit that a key of a translation (`N/m`) has in a model of this motion (`N m/rad`).
pub fn unit_for(motion: Motion, unit: &str) -> String {
    if motion == Motion::Translation {
        return unit.to_string();
    }
    match unit {
        "kg" => "kg m²".to_string(),
        "-" | "rad" | "s" | "Hz" => unit.to_string(),
        "rad/m" => "rad/rad".to_string(),
        _ => unit.split_inclusive([' ', '/', '(', ')', '^', '²', '³', '+']).map(token).collect(),
    }
}

/// One letter group with the mark behind it: `N` is `N m`, `m` is `rad`.
fn token(part: &str) -> String {
    let (name, mark) = part.split_at(part.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(part.len()));
    let name = match name {
        "N" => "N m",
        "m" => "rad",
        other => other,
    };
    format!("{name}{mark}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotation_has_its_own_units() {
        let rotation = |unit: &str| unit_for(Motion::Rotation, unit);
        assert_eq!(rotation("N/m"), "N m/rad");
        assert_eq!(rotation("N s/m"), "N m s/rad");
        assert_eq!(rotation("kg"), "kg m²");
        assert_eq!(rotation("N s²/m²"), "N m s²/rad²");
        assert_eq!(rotation("N/m³"), "N m/rad³");
        assert_eq!(rotation("N/m^n"), "N m/rad^n");
        assert_eq!(rotation("m/s"), "rad/s");
        assert_eq!(unit_for(Motion::Translation, "N/m"), "N/m");
    }
}
