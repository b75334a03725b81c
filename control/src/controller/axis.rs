//! What a controller knows of its axis: inertia, viscous friction, and friction with a memory, from a model.

use super::ControllerError;
pub use backdrive_plant::elements::Bristles;
use backdrive_plant::elements::{Law, Role, Rubbing, Side};
use backdrive_plant::model::{InputKind, Model};

/// One body under a force, `J q'' = u - viscous q' - f`, as a model has it.
#[derive(Debug, Clone)]
pub struct AxisModel {
    /// J, kg or kg m².
    pub inertia: f64,
    /// σ2, of all dampers to ground, N s/m or N m s/rad.
    pub viscous: f64,
    /// Metres (or rad) at the tip per unit of q.
    pub scale: f64,
    /// Limits of the command at the tip, m or rad.
    pub travel: Option<[f64; 2]>,
    /// Largest speed of the command at the tip.
    pub speed: Option<f64>,
    friction: Vec<Copied>,
}

/// An element's law, run open loop beside the axis.
#[derive(Debug, Clone)]
struct Copied {
    law: Law,
    /// +1 where the body is the element's first end.
    sign: f64,
    memory: Vec<f64>,
}

impl AxisModel {
    /// Of an axis of a model whose feedback is a force on one body; all that touches this body is friction to ground.
    ///
    /// # Errors
    /// Where the model's axis is none of that sort; bodies and springs beyond are not for these laws.
    pub fn new(model: &Model, axis: usize) -> Result<AxisModel, ControllerError> {
        let failed = |reason: String| ControllerError::Model { model: model.name.clone(), axis, reason };
        let place = model.axes.get(axis).ok_or_else(|| failed("there is no such axis".to_owned()))?;
        let input = &model.inputs[place.feedback];
        if input.kind != InputKind::Force {
            return Err(failed("its feedback is a motion input; a controller is for axes that are driven by a force".to_owned()));
        }
        let body = input.on;
        let mut known = AxisModel {
            inertia: model.bodies[body].inertia,
            viscous: 0.0,
            scale: place.scale,
            travel: place.travel,
            speed: place.speed,
            friction: Vec::new(),
        };
        for element in model.elements.iter().filter(|e| e.between.contains(&Some(body))) {
            let sign = match element.between {
                [Some(_), None] => 1.0,
                [None, Some(_)] => -1.0,
                _ => {
                    let reason = format!("element \"{}\" leads from the driven body to another; these laws are for one body", element.name);
                    return Err(failed(reason));
                }
            };
            match element.law.role() {
                Role::Linear(linear) => {
                    if linear.stiffness != 0.0 {
                        return Err(failed(format!("element \"{}\" is a spring to ground, which these laws do not know", element.name)));
                    }
                    known.viscous += linear.damping;
                    known.inertia += linear.inertance;
                }
                Role::Friction | Role::Path => {
                    let memory = vec![0.0; element.law.memory_len()];
                    known.friction.push(Copied { law: element.law.clone(), sign, memory });
                }
            }
        }
        if known.inertia <= 0.0 {
            return Err(failed("its driven body has no inertia".to_owned()));
        }
        if known.scale == 0.0 {
            return Err(failed("its scale is 0".to_owned()));
        }
        Ok(known)
    }

    /// Carries the friction's memory along a straight path, m or rad, that takes `period_s`.
    pub fn advance(&mut self, from: f64, to: f64, period_s: f64) {
        for Copied { law, sign, memory } in &mut self.friction {
            match law.role() {
                Role::Friction => {
                    let way = *sign * (to - from);
                    let level = law.level(&Rubbing { side: Side::of(way), speed: Some(way / period_s), load: 0.0, memory });
                    law.rubbed(memory, level * way.abs(), period_s);
                }
                Role::Path => law.advance(memory, *sign * from, *sign * to, period_s),
                Role::Linear(_) => {}
            }
        }
    }

    /// Friction at speed `v`, viscous friction included, N or N m. Dry friction that sticks at 0 is 0 there.
    pub fn friction(&self, v: f64) -> f64 {
        let one = |c: &Copied| match c.law.role() {
            Role::Friction if v != 0.0 => {
                let speed = c.sign * v;
                c.law.level(&Rubbing { side: Side::of(speed), speed: Some(speed), load: 0.0, memory: &c.memory }).copysign(v)
            }
            Role::Friction | Role::Linear(_) => 0.0,
            Role::Path => c.sign * c.law.force(&c.memory, 0.0, c.sign * v),
        };
        self.viscous * v + self.friction.iter().map(one).sum::<f64>()
    }

    /// The bristles of friction that has some, such as `lugre` and `preisach_lugre`, at speed `v`, m/s or rad/s; `None` where the model has none.
    /// With the f(q') of eq (18), `leak` is f/σ0.
    pub fn bristles(&self, v: f64) -> Option<Bristles> {
        self.friction.iter().find_map(|c| {
            let own = c.law.bristles(&c.memory, c.sign * v)?;
            Some(Bristles { force: c.sign * own.force, ..own })
        })
    }
}
