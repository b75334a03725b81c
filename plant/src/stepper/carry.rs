//! A plant that carries the links of a robot.

use super::motion::Motion;
use super::slots::{SLOTS, Slots};
use super::state::Plant;

impl Plant {
    /// The links come to the middle of the substep.
    #[inline]
    pub(super) fn links_to_the_middle(&mut self, motion: &mut Motion) {
        if let Some(links) = &mut self.links {
            links.enter(&mut self.fixed, self.substep, &self.v, motion);
        }
    }

    /// What the links push with over the substep whose velocities are known now, by place; nothing without a robot.
    #[inline]
    pub(super) fn bias_over(&mut self, motion: &Motion) -> Slots {
        self.links.as_mut().map_or([0.0; SLOTS], |links| {
            links.bias_with(|slot| motion.end_velocity[slot]);
            links.bias
        })
    }

    /// The links at this instant.
    #[inline]
    pub(super) fn links_here(&mut self) {
        if let Some(links) = &mut self.links {
            links.at(&mut self.fixed, &mut self.x, &mut self.v);
        }
    }

    /// The points of the links at the end of a substep.
    #[inline]
    pub(super) fn bring_points(&mut self) {
        if let (false, Some(links)) = (self.fixed.points.is_empty(), &mut self.links) {
            links.bring_points(&mut self.fixed.points, &mut self.x, &mut self.v);
        }
    }
}
