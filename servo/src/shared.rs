//! What the recordings of a servo joint do not distinguish, and the motion that would.

use crate::search::Found;
use backdrive_diagnosis::verdict::SharedCause;
use backdrive_plant::servo::Number;

/// A rival this many standard errors behind is rejected.
const APART: f64 = 2.5;

/// Causes that share what was seen.
pub fn shared(found: &Found) -> Vec<SharedCause> {
    let mut out = vec![cause(
        &["damper", "derivative_gain", "back_emf"],
        "damping is the sum of viscous friction, the servo's derivative term and the motor's back-EMF; positions alone do not separate \
            them",
        "move the joint by hand with the torque off: then only viscous friction acts",
    )];
    let delay = found.best.fit.numbers[Number::Delay];
    let spread = found.best.folds.iter().map(|n| (n[Number::Delay] - delay).abs()).fold(0.0, f64::max);
    if delay > 3.0 * spread.max(1e-3) {
        out.push(cause(
            &["delay", "series_compliance"],
            "the reported delay contains transport, the age of the logged position, and dynamics faster than the recording, such as a \
                soft gear",
            "command a chirp up to the highest frequency that the joint follows: a delay changes only the phase, in proportion to \
                frequency; a soft gear has a resonance peak",
        ));
    }
    if found.claims.iter().any(|c| c.name == "lead") {
        out.push(cause(
            &["lead", "delay"],
            "a derivative term on the command and a shorter delay both advance the response",
            "command steps: a derivative term kicks at the step, a delay only shifts the response",
        ));
    }
    for claim in &found.claims {
        for (rival, _) in claim.rivals.iter().filter(|(_, gain)| gain.is_none_or(|g| g.in_errors() < APART)) {
            let (sentence, motion) = told(claim.name, rival);
            out.push(cause(&[claim.name, rival], sentence, motion));
        }
    }
    out
}

fn cause(causes: &[&str], sentence: &str, motion: &str) -> SharedCause {
    SharedCause {
        causes: causes.iter().map(|c| (*c).to_string()).collect(),
        sentence: sentence.to_string(),
        separated_by: motion.to_string(),
    }
}

/// What two effects share, and what separates them.
fn told(one: &str, other: &str) -> (&'static str, &'static str) {
    let is = |a: &str, b: &str| (one, other) == (a, b) || (one, other) == (b, a);
    if is("coulomb", "dead_band") {
        return (
            "dry friction and a dead band cause the same range of angles at which the joint stays",
            "approach one angle under two loads or at two speeds: the range of friction does not depend on speed, that of a dead band \
                shrinks for a moving joint",
        );
    }
    if is("coulomb", "backlash") || is("dead_band", "backlash") {
        return (
            "play, dry friction and a dead band all delay the joint after a reversal by a fixed angle",
            "reverse under a steady load: it closes the play and does not change the friction",
        );
    }
    if is("coulomb", "load_friction") {
        return (
            "friction that grows with the load cannot be separated from friction that does not, where the load hardly changes",
            "repeat one motion with a known payload",
        );
    }
    if is("gravity", "payload") || is("gravity", "gain") || is("payload", "gain") {
        return (
            "droop under a weight and a wrong scale of the position both grow with the angle",
            "hold the same angle of this joint in two poses of the joints before it, so that its weight pulls both ways",
        );
    }
    if is("saturation", "speed_limit") || is("saturation", "acceleration_limit") || is("speed_limit", "acceleration_limit") {
        return (
            "limits of torque, speed and acceleration all slow down large steps",
            "command steps of 0.1, 0.3 and 1 rad. A speed limit gives ramps of one slope, an acceleration limit gives slopes that grow \
                with the step, a torque limit depends on the load",
        );
    }
    if is("stribeck", "dead_band") || is("stribeck", "backlash") {
        return (
            "friction that is larger at rest, a dead band and play all hold the joint a little longer at a reversal",
            "command ramps at four speeds under a steady load: the load closes the play, and only friction at rest makes the joint jump when \
                it starts",
        );
    }
    if is("quadratic_drag", "speed_limit") || is("quadratic_drag", "saturation") {
        return (
            "drag and a limit of speed or torque both hold back fast motions",
            "command steps of 0.1, 0.3 and 1 rad: a limit gives ramps of one slope, drag rounds them",
        );
    }
    if is("coulomb", "stribeck") {
        return (
            "friction that is larger at rest shows only at slow reversals",
            "command ramps at four speeds, from a hundredth of the \
            highest speed",
        );
    }
    ("both predict the held-out recordings equally well", "larger and smaller motions at several speeds")
}
