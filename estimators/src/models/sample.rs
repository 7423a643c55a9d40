//! A sample of the filtered signals that the regressions share.

use crate::Real;
use crate::api::snapshot::{Blank, state};

/// One filtered sample; all its numbers have the same delay.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ResampledSample {
    /// Traction at the rims, N.
    pub force_n: Real,
    /// Speed, m/s.
    pub speed_mps: Real,
    /// Acceleration of the wheels v̇, m/s².
    pub acceleration_mps2: Real,
    /// Specific force along the train v̇ + g sin θ, m/s²; `None` without an accelerometer.
    pub specific_force_mps2: Option<Real>,
    /// Horizontal curvature of the rail without its sign, |yaw rate|/|v|, 1/m; 0 without a gyro.
    pub curvature_per_m: Real,
    /// Time since the previous sample, s.
    pub period_s: Real,
}

impl Blank for ResampledSample {
    fn blank() -> Self {
        Self::default()
    }
}

state!(ResampledSample { force_n, speed_mps, acceleration_mps2, specific_force_mps2, curvature_per_m, period_s; });
