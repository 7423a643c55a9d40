//! One sample of the force balance for a published regression: the filtered signals, with the means of the grade under
//! the train where it was then.

use crate::Real;
use crate::api::real::GRAVITY;
use crate::api::snapshot::{Blank, state};
use crate::models::sample::ResampledSample;
use crate::rail::train_means::TrainMeans;

/// Standard deviation of the grade of rail that was not read, rad per m: the undulation of a roadway.
const UNREAD_RAD_PER_M: Real = 1e-3;

/// The sample. u = g sin θ + b, b the bias of the accelerometer, is what the rail memory keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BalanceSample {
    /// Signals behind one low-pass.
    pub sample: ResampledSample,
    /// Mean of u under the tare and under the load, m/s².
    pub u_mps2: [Real; 2],
    /// Standard deviations of both for rail that was not read, m/s².
    pub doubt_mps2: [Real; 2],
    /// Mean horizontal curvature under the tare without its sign, 1/m.
    pub curvature_per_m: Real,
}

impl BalanceSample {
    /// The sample of a train with this tare whose rail has been read; `read_sd` is the standard deviation of the sine
    /// of the grade read, beyond that of a calm instrument.
    pub fn new(sample: ResampledSample, means: &TrainMeans, tare_kg: Real, read_sd: Real) -> Self {
        let tare_kg = tare_kg.max(1.0);
        let per_m = GRAVITY * UNREAD_RAD_PER_M;
        let tare_doubt = per_m * (means.behind_tare_kgm + means.ahead_kgm);
        let read = GRAVITY * read_sd;
        Self {
            sample,
            u_mps2: [GRAVITY * means.tare_kg / tare_kg, GRAVITY * means.load],
            doubt_mps2: [
                tare_doubt / tare_kg + read,
                per_m * means.behind_load_m + read,
            ],
            curvature_per_m: means.bend_per_m,
        }
    }

    /// Mean of u over a whole train of `mass_kg` with a tare of `tare_kg`, m/s², and its doubt.
    pub fn whole(&self, tare_kg: Real, mass_kg: Real) -> [Real; 2] {
        let tare_share = (tare_kg / mass_kg.max(tare_kg)).min(1.0);
        let mix = |[tare, load]: [Real; 2]| load + tare_share * (tare - load);
        [mix(self.u_mps2), mix(self.doubt_mps2)]
    }

    /// Sign of the speed, ±1.
    pub fn direction(&self) -> Real {
        if self.sample.speed_mps < 0.0 {
            -1.0
        } else {
            1.0
        }
    }
}

impl Blank for BalanceSample {
    fn blank() -> Self {
        Self::default()
    }
}

state!(BalanceSample { sample, u_mps2, doubt_mps2, curvature_per_m; });
