//! The master's grip, and one that is firmer or softer.

use backdrive_nodes::graph::{Graph, NodeKind, Settings};
use backdrive_plant::model::Fragment;

/// The master's grip; `None` where nothing holds it, and where its model holds the user's hand itself.
pub fn grip(graph: &Graph) -> Option<&Fragment> {
    graph.node_of(NodeKind::Master).and_then(|node| match &node.settings {
        Settings::Master(files) => {
            let takes_it = files.model.as_ref().is_some_and(|m| m.axes.iter().any(|a| !a.holds_user));
            files.fragment.as_ref().filter(|f| takes_it && !f.network.elements.is_empty())
        }
        _ => None,
    })
}

/// Scales every force of a fragment: of a spring its stiffness, of a damper its damping, of friction its level. Masses stay.
pub fn scale(fragment: &mut Fragment, factor: f64) {
    fragment.scale(factor);
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_plant::elements::Law;

    #[test]
    fn a_grip_is_scaled_in_all_its_forces() {
        let text = r#"
            name = "g"
            kind = "fragment"
            [[elements]]
            name = "spring"
            kind = "spring"
            between = ["port", "hand"]
            stiffness = 400.0
            [[elements]]
            name = "damper"
            kind = "damper"
            between = ["port", "hand"]
            damping = 23.0
            [[elements]]
            name = "skin"
            kind = "hysteretic_spring"
            between = ["port", "hand"]
            stiffness_positive = 10.0
            stiffness_negative = 12.0
            offset_positive = 0.5
            offset_negative = -0.5
            bandwidth = 8500.0
        "#;
        let mut grip = Fragment::from_toml(text, "g.toml").unwrap();
        scale(&mut grip, 1.3);
        let law = |i: usize| grip.network.elements[i].law.clone();
        let Law::Spring(spring) = law(0) else { panic!() };
        let Law::Damper(damper) = law(1) else { panic!() };
        let Law::HystereticSpring(skin) = law(2) else { panic!() };
        assert_eq!((spring.stiffness, damper.damping), (400.0 * 1.3, 23.0 * 1.3));
        assert_eq!((skin.stiffness_positive, skin.offset_negative, skin.bandwidth), (13.0, -0.65, 8500.0));
    }
}
