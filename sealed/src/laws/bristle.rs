//! How one bristle bends.

/// The bristle after a way of `moved` (m), when it nears `±most` (m) as one over e on each way of `most`: exact while `most` stays.
pub(super) fn bent(deflection: f64, moved: f64, most: f64) -> f64 {
    if moved == 0.0 {
        return deflection;
    }
    let end = most.copysign(moved);
    end + (deflection - end) * (-moved.abs() / most).exp()
}
