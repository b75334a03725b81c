//! Loops of the deformed Dahl model.

/// The closed loop of a displacement between `-reversal` and `reversal`: Choi, Han & Kim 2006, eqs (11)-(13).
///
/// Both branches solve `df/dq = s ((f_c ∓ f)/(f_c + f_r))²`, which leaves a reversal with the slope s and runs towards ±f_c.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DahlLoop {
    /// f_c, what the force runs towards, N, above 0.
    pub force: f64,
    /// s, slope behind every reversal, N/m, above 0.
    pub slope: f64,
}

impl DahlLoop {
    /// f_r, the force at the reversals of a loop between `-reversal` and `reversal` (m, at least 0), N: eq (13).
    #[inline]
    pub fn reversal_force(&self, reversal: f64) -> f64 {
        let k = self.slope * reversal / self.force;
        // (f_c/2) { sqrt((1 + k)² + 4 k) - (1 + k) }, without the difference of near numbers.
        2.0 * self.force * k / (((1.0 + k) * (1.0 + k) + 4.0 * k).sqrt() + 1.0 + k)
    }

    /// The reversal at which the force is `force` (N, from 0 to below f_c), m: eq (13) turned round. With the static force it is the
    /// break-away at which `preisach_lugre` goes over into sliding smoothly.
    pub fn reversal_of(&self, force: f64) -> f64 {
        force * (self.force + force) / (self.slope * (self.force - force))
    }

    /// d f_r / d reversal, N/m.
    #[inline]
    pub fn reversal_slope(&self, reversal: f64) -> f64 {
        let k = self.slope * reversal / self.force;
        0.5 * self.slope * ((3.0 + k) / ((1.0 + k) * (1.0 + k) + 4.0 * k).sqrt() - 1.0)
    }

    /// Force at `q` on the way down from `reversal`, N: eq (11).
    pub fn falling(&self, q: f64, reversal: f64) -> f64 {
        let (f_c, f_r, way) = (self.force, self.reversal_force(reversal), self.slope * (reversal - q));
        (f_r * (f_c + f_r) - f_c * way) / (f_c + f_r + way)
    }

    /// Force at `q` on the way up from `-reversal`, N: eq (12).
    pub fn rising(&self, q: f64, reversal: f64) -> f64 {
        let (f_c, f_r, way) = (self.force, self.reversal_force(reversal), self.slope * (reversal + q));
        (-f_r * (f_c + f_r) + f_c * way) / (f_c + f_r + way)
    }

    /// What one loop takes, J: `2 [2 q_r f_c - (A²/s) ln(1 + 2 s q_r/A)]` with `A = f_c + f_r`.
    pub fn energy(&self, reversal: f64) -> f64 {
        let a = self.force + self.reversal_force(reversal);
        2.0 * (2.0 * reversal * self.force - a * a / self.slope * (2.0 * self.slope * reversal / a).ln_1p())
    }
}
