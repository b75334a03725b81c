//! Loss of a gear or screw, by the direction in which power flows.

use super::described::{Checked, Described, Facts, Read};
use super::draw::{Draw, Here};
use super::families::FRICTION;
use super::force::{ForceLaw, Load};
use crate::network::allowed::Allowed::{Any, NotNegative, Positive};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Dry friction in proportion to the force L that the joint passes on. Moving against L, the friction's bodies give the joint the share eta of what
/// they are driven with: `L (1/eta - 1)` is lost. Moving with L, the joint gives them the share eta_b: `L (1 - eta_b)` is lost, and where that is
/// L or more the joint moves nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GearLoss {
    /// eta, above 0, at most 1.
    pub efficiency: f64,
    /// eta_b, at most 1.
    pub back_efficiency: f64,
}

impl ForceLaw for GearLoss {
    fn dry(&self, _: f64, load: f64, _: &[f64]) -> [f64; 2] {
        let against = load.abs() * (1.0 - self.efficiency) / self.efficiency;
        let with = load.abs() * (1.0 - self.back_efficiency);
        if load > 0.0 { [against, with] } else { [with, against] }
    }

    fn is_dry(&self) -> bool {
        true
    }

    fn load(&self) -> Load<'_> {
        Load::Joint
    }
}

impl Described for GearLoss {
    const NAME: &'static str = "gear_loss";
    const FACTS: Facts =
        Facts { takes_energy: true, is_friction: true, is_linear: false, family: &[&["gear_loss", "load_friction"], FRICTION] };
    const READ: Read<GearLoss> = Some(|section| {
        let (efficiency, back_efficiency) = (section.need_number("efficiency", Positive)?, section.need_number("back_efficiency", Any)?);
        for (key, value) in [("efficiency", efficiency), ("back_efficiency", back_efficiency)] {
            if value > 1.0 {
                return Err(section.error(key, format!("expected at most 1, found {value}")));
            }
        }
        Ok(GearLoss { efficiency, back_efficiency })
    });
    const DRAWS: &'static [Draw] = &[];

    fn to_force(&self) -> Box<dyn ForceLaw> {
        Box::new(self.clone())
    }

    fn numbers(&self) -> Vec<Checked> {
        let loss = 1.0 - self.back_efficiency;
        vec![
            ("efficiency", self.efficiency, Positive),
            ("1 - efficiency", 1.0 - self.efficiency, NotNegative),
            ("1 - back_efficiency", loss, NotNegative),
        ]
    }

    fn draw(_: &Here, _: &mut ChaCha8Rng) -> Option<GearLoss> {
        None
    }
}
