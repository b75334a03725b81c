//! A hand that changes its grip while it holds the device.

use super::state::SealedPlant;

impl SealedPlant {
    /// Takes the laws of the elements that `of` names from `other`, the same device with another hand, which gets this one's. Nothing moves.
    pub(crate) fn exchange_laws(&mut self, other: &mut SealedPlant, of: &[usize]) {
        for element in of {
            if let (Some(mine), Some(theirs)) = (self.joints.get_mut(*element), other.joints.get_mut(*element)) {
                std::mem::swap(&mut mine.force, &mut theirs.force);
            }
        }
    }

    /// Puts the body on a moved input at another position without a motion between the two, m. Memories of what joins it go along.
    pub(crate) fn move_hand(&mut self, input: usize, to: f64) {
        let Some(drive) = self.drives.get_mut(input) else { return };
        drive.start(to);
        let body = drive.body();
        self.positions[body] = drive.position(1.0);
        for joint in self.joints.iter_mut().filter(|joint| joint.between.contains(&Some(body))) {
            joint.last = joint.relative(&self.positions);
        }
    }
}
