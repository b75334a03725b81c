//! What gravity does to a joint: a cosine and a sine of its own angle, the other joints where they were recorded.

use backdrive_plant::robot::Tree;

/// Torque of gravity at a joint that turns, by sample, as `a cos q + b sin q + c` (N m). `positions`: of every joint of the tree, by sample.
///
/// About an axis the torque of a weight is a sine of the angle without a constant, wherever the other joints stand, so three angles say it all.
pub fn columns(tree: &Tree, positions: &[&[f64]], joint: usize) -> Vec<[f64; 3]> {
    let samples = positions.first().map_or(0, |p| p.len());
    let mut work = tree.workspace();
    let mut q = vec![0.0; tree.len()];
    let mut forces = vec![0.0; tree.len()];
    let mut at = |q: &mut Vec<f64>, angle: f64| {
        q[joint] = angle;
        tree.gravity(q, &mut work, &mut forces);
        forces[joint]
    };
    (0..samples)
        .map(|i| {
            for (q, p) in q.iter_mut().zip(positions) {
                *q = p[i];
            }
            let zero = at(&mut q, 0.0);
            let quarter = at(&mut q, std::f64::consts::FRAC_PI_2);
            let half = at(&mut q, std::f64::consts::PI);
            let c = 0.5 * (zero + half);
            [zero - c, quarter - c, c]
        })
        .collect()
}
