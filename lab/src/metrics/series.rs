//! Errors of every estimator, sample by sample.

use crate::bound::{BoundSample, RunningBound};
use crate::metrics::Pace;
use crate::metrics::lagged::GradeAtMiddle;
use monorig_estimators::api::signals::Estimate;
use monorig_sim::closed_loop::estimators::RunningEstimator;
use monorig_sim::closed_loop::run::{Observer, StepFrame};
use monorig_sim::closed_loop::{AnswerCounts, Simulation};
use monorig_sim::config::scenario::IntegrityLimits;
use monorig_sim::error::Error;
use monorig_sim::plant::Truth;
use monorig_sim::rail::Place;

/// The part of the truth with which an estimate is compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Target {
    /// s.
    pub t_s: f64,
    /// Total mass, kg.
    pub total_mass_kg: f64,
    /// Grade at the IMU, rad.
    pub grade_at_imu_rad: f64,
    /// Grade under the middle of the unit that carries the IMU, rad: what a grade that lags is held against.
    pub grade_at_middle_rad: f64,
    /// Effective grade of the train, rad.
    pub grade_effective_rad: f64,
    /// Running-resistance coefficient.
    pub running_resistance: f64,
    /// Standard deviation of the mass, kg, and of the grades, rad, where they are references of a recorded drive;
    /// else 0. Its square adds to the reported variance in the normalised square of an error.
    pub mass_sd_kg: f64,
    /// Standard deviation of the grades, rad, under the same condition.
    pub grade_sd_rad: f64,
    /// Present Cramér-Rao bound; `None` without a bound, as for a recorded drive.
    pub bound: Option<BoundSample>,
}

impl Target {
    /// Makes the truth from the plant's truth, the bound of the run and the grade under the middle of the unit, rad.
    pub(crate) fn of(truth: &Truth, bound: Option<BoundSample>, grade_at_middle_rad: f64) -> Self {
        Self {
            bound,
            grade_at_middle_rad,
            t_s: truth.t_s,
            total_mass_kg: truth.total_mass_kg,
            grade_at_imu_rad: truth.grade_at_imu_rad,
            grade_effective_rad: truth.grade_effective_rad,
            running_resistance: truth.running_resistance,
            mass_sd_kg: truth.sd.total_mass_kg,
            grade_sd_rad: truth.sd.grade_rad,
        }
    }
}

/// One estimator step against the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorSample {
    /// s.
    pub t_s: f64,
    /// True where there is no reference, of mass, slope and effective slope: their errors are not numbers.
    pub(crate) unreferenced: [bool; 3],
    /// Standard deviation of the references: of the mass as a share of it, of the slopes in degrees.
    pub(crate) reference_sd: [f64; 2],
    /// Estimate minus truth over truth, total mass.
    pub(crate) mass_rel: f64,
    /// Estimate minus truth, total mass, kg.
    pub mass_kg: f64,
    /// Reported standard deviation, total mass, kg.
    pub(crate) mass_sd_kg: f64,
    /// Reported standard deviation over truth, total mass.
    pub(crate) mass_sd_rel: f64,
    /// Protection levels, in the order of [`Quantity::ALL`](super::Quantity::ALL) and the units of its errors; NaN
    /// where the estimator has none.
    pub(crate) protection: [f64; 3],
    /// Normalised square of the error: (error / standard deviation)².
    pub mass_nees: f64,
    /// True where the estimator marks the mass valid.
    pub mass_valid: bool,
    /// True after the mass has changed from its value at the start: the value at the start is no estimate.
    pub(crate) mass_estimated: bool,
    /// Estimate minus grade at the IMU, rad.
    pub slope: f64,
    /// Error of the slope as roads state slopes, 100 tan θ, %.
    pub(crate) slope_percent: f64,
    /// Estimate minus effective grade of the train, rad.
    pub slope_effective: f64,
    /// Reported standard deviation of the slope, rad.
    pub(crate) slope_sd: f64,
    /// Reported standard deviation of the effective slope, rad.
    pub(crate) effective_sd: f64,
    /// Normalised square of the slope's error, against the grade at the IMU.
    pub slope_nees: f64,
    /// True where the estimator marks the slope valid.
    pub slope_valid: bool,
    /// Normalised square of the effective slope's error.
    pub(crate) effective_nees: f64,
    /// True where the estimator marks the effective slope valid.
    pub(crate) effective_valid: bool,
    /// Lagged grade minus the grade at its place, rad; NaN for estimators without a lagged grade.
    pub(crate) lagged: f64,
    /// Normalised square of this error.
    pub(crate) lagged_nees: f64,
    /// Normalised innovation squared.
    pub nis: f64,
    /// Estimate minus truth of the running-resistance coefficient; NaN for estimators that do not identify it.
    pub(crate) running_resistance: f64,
    /// Answers of an external estimator in real time.
    pub(crate) answers: Option<AnswerCounts>,
    /// Cramér-Rao bound of the mass, as a share of the mass; NaN without a bound. Likewise the next two.
    pub(crate) mass_bound: f64,
    /// Bound of the slope, rad.
    pub(crate) slope_bound: f64,
    /// Bound of the effective slope, rad.
    pub(crate) effective_bound: f64,
}

impl ErrorSample {
    /// An estimate and the internals of [`TOLD`] against the truth.
    fn of(
        e: &Estimate,
        internals: [Option<f64>; TOLD.len()],
        answers: Option<AnswerCounts>,
        t: &Target,
    ) -> Self {
        let p = &e.protection;
        let mass = e.total_mass_kg.value - t.total_mass_kg;
        let slope = e.grade_rad.value - t.grade_at_imu_rad;
        let effective = e.effective_grade_rad.value - t.grade_effective_rad;
        let internals = internals.map(|value| value.unwrap_or(f64::NAN));
        let [lagged, lagged_sd, resistance] = internals;
        let lagged = lagged - t.grade_at_middle_rad;
        Self {
            t_s: t.t_s,
            unreferenced: [t.total_mass_kg, t.grade_at_imu_rad, t.grade_effective_rad]
                .map(f64::is_nan),
            reference_sd: [t.mass_sd_kg / t.total_mass_kg, t.grade_sd_rad.to_degrees()],
            mass_rel: mass / t.total_mass_kg,
            mass_kg: mass,
            mass_sd_kg: e.total_mass_kg.sd,
            mass_sd_rel: e.total_mass_kg.sd / t.total_mass_kg,
            slope_sd: e.grade_rad.sd,
            effective_sd: e.effective_grade_rad.sd,
            protection: [
                p.total_mass_kg / t.total_mass_kg,
                p.grade_rad.to_degrees(),
                p.effective_grade_rad.to_degrees(),
            ]
            .map(|level| if level > 0.0 { level } else { f64::NAN }),
            mass_nees: normalised(mass, e.total_mass_kg.sd, t.mass_sd_kg),
            mass_valid: e.total_mass_kg.valid,
            mass_estimated: true,
            slope,
            slope_percent: 100.0 * (e.grade_rad.value.tan() - t.grade_at_imu_rad.tan()),
            slope_effective: effective,
            effective_nees: normalised(effective, e.effective_grade_rad.sd, t.grade_sd_rad),
            effective_valid: e.effective_grade_rad.valid,
            slope_nees: normalised(slope, e.grade_rad.sd, t.grade_sd_rad),
            slope_valid: e.grade_rad.valid,
            lagged,
            lagged_nees: normalised(lagged, lagged_sd, t.grade_sd_rad),
            nis: e.nis,
            running_resistance: resistance - t.running_resistance,
            answers,
            mass_bound: t.bound.map_or(f64::NAN, |b| b.mass_rel),
            slope_bound: t.bound.map_or(f64::NAN, |b| b.slope_rad),
            effective_bound: t.bound.map_or(f64::NAN, |b| b.effective_rad),
        }
    }
}

/// Names of internals: the lagged grade, rad; its standard deviation, rad; the running-resistance coefficient.
const TOLD: [&str; 3] = [
    "lagged_grade_rad",
    "lagged_grade_sd_rad",
    "running_resistance",
];

/// Makes error samples of one estimator, step by step. The places of its internals are found once, by name.
pub(crate) struct ErrorSampler {
    places: [Option<usize>; TOLD.len()],
    internals: Vec<f64>,
    /// The mass at the start, kg.
    start_kg: Option<f64>,
    /// True after the mass has changed.
    pub(crate) mass_estimated: bool,
}

impl ErrorSampler {
    /// Finds the internals of an estimator.
    pub(crate) fn of(member: &RunningEstimator) -> Self {
        let list = member.list_internals();
        Self {
            places: TOLD.map(|name| list.iter().position(|i| i.name == name)),
            internals: Vec::new(),
            start_kg: None,
            mass_estimated: false,
        }
    }

    /// Error of the last estimate.
    pub(crate) fn sample(&mut self, member: &RunningEstimator, t: &Target) -> ErrorSample {
        self.internals.clear();
        if self.places.iter().any(Option::is_some) {
            member.internals(&mut self.internals);
        }
        let internals = self.places.map(|at| self.internals.get(at?).copied());
        let mass_kg = member.estimate.total_mass_kg.value;
        self.mass_estimated |= *self.start_kg.get_or_insert(mass_kg) != mass_kg;
        ErrorSample {
            mass_estimated: self.mass_estimated,
            ..ErrorSample::of(&member.estimate, internals, member.answers(), t)
        }
    }
}

/// One step of the closed loop.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tracking {
    pub(crate) t_s: f64,
    /// Speed minus reference, m/s.
    pub(crate) speed: f64,
    /// Speed along the rail, m/s.
    pub(crate) way_speed: f64,
    /// Power of the driven wheels on the train, W.
    pub(crate) traction_w: f64,
    /// Acceleration along the rail, m/s².
    pub(crate) accel: f64,
    /// Distance from the rail's line, m.
    pub(crate) off_rail: f64,
    /// Chainage of the IMU, m.
    pub(crate) chainage: f64,
}

impl Tracking {
    /// Errors of a step.
    pub(crate) fn of(f: &StepFrame<'_>) -> Self {
        let t = f.truth;
        Self {
            t_s: t.t_s,
            speed: t.speed_mps - f.reference.speed_mps,
            way_speed: t.speed_mps,
            traction_w: t.traction_n * t.speed_mps,
            accel: t.accel_mps2,
            off_rail: t.off_rail_m,
            chainage: t.chainage_m,
        }
    }
}

/// Places of the track, and the positions of the vehicle's front and rear.
#[derive(Clone, Debug, Default)]
pub(crate) struct Geometry {
    /// Named places.
    pub(crate) places: Vec<Place>,
    /// Chainage of the IMU minus chainage of the front, m.
    pub(crate) imu_offset_m: f64,
    /// Length of the vehicle, m.
    pub(crate) length_m: f64,
}

impl Geometry {
    /// Geometry of a simulation.
    pub(crate) fn of(s: &Simulation) -> Self {
        Self {
            places: s.rail.places.clone(),
            imu_offset_m: s.imu_offset_m,
            length_m: s.train.limits.length_m,
        }
    }
}

/// Keeps every sample of a run: for plots, and for what is to be measured later. Its memory grows with the run, about
/// 10 MB per hour and estimator at 20 Hz; `WindowedMetrics` keeps none.
#[derive(Default)]
pub struct ErrorSeries {
    /// Per estimator, in their order in the run: name and samples.
    pub estimators: Vec<(String, Vec<ErrorSample>)>,
    /// Makes the samples of the estimators.
    pub(crate) samplers: Vec<ErrorSampler>,
    /// The closed loop.
    pub(crate) tracking: Vec<Tracking>,
    /// Limits beyond which a valid sample is misleading.
    pub(crate) limits: IntegrityLimits,
    /// The Cramér-Rao bound of the run, if there is one.
    pub(crate) bound: Option<RunningBound>,
    /// Grade under the middle of the unit.
    pub(crate) middle: Option<GradeAtMiddle>,
    /// Steps at which errors are computed.
    pub(crate) pace: Pace,
}

impl ErrorSeries {
    /// The samples of an estimator; `None` for an unknown estimator.
    pub(crate) fn of(&self, estimator: &str) -> Option<&[ErrorSample]> {
        let mut all = self.estimators.iter();
        let (_, samples) = all.find(|(name, _)| name == estimator)?;
        Some(samples)
    }
}

/// An error over its standard deviation, squared, including the standard deviation of the reference. Bit for bit the
/// plain quotient where the reference is the truth.
fn normalised(error: f64, sd: f64, reference_sd: f64) -> f64 {
    let sd = if reference_sd == 0.0 {
        sd
    } else {
        sd.hypot(reference_sd)
    };
    let x = error / sd;
    x * x
}

impl Observer for ErrorSeries {
    fn begin(&mut self, s: &Simulation) -> Result<(), Error> {
        self.limits = IntegrityLimits::of(&s.scenario.file);
        self.bound = RunningBound::of(s);
        self.middle = Some(GradeAtMiddle::of(s));
        Ok(())
    }

    fn on_step(&mut self, f: &StepFrame<'_>) -> Result<(), Error> {
        let bound = self.bound.as_mut().and_then(|bound| {
            bound.step(f.truth);
            bound.now()
        });
        if !self.pace.takes(f) {
            return Ok(());
        }
        if self.estimators.is_empty() {
            self.estimators = f
                .estimators
                .iter()
                .map(|m| (m.name.clone(), Vec::new()))
                .collect();
            self.samplers = f.estimators.iter().map(ErrorSampler::of).collect();
        }
        let middle = self.middle.as_mut();
        let middle = middle.map_or(f64::NAN, |m| m.at(f.truth.chainage_m));
        let target = Target::of(f.truth, bound, middle);
        let samplers = f.estimators.iter().zip(&mut self.samplers);
        for ((m, sampler), (_, samples)) in samplers.zip(&mut self.estimators) {
            samples.push(sampler.sample(m, &target));
        }
        self.tracking.push(Tracking::of(f));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Slopes of 10 and 2 %: 8 % between them, and not the tangent of the difference of the angles.
    #[test]
    fn slopes_in_per_cent_are_tangents() {
        let (mut e, mut t) = (Estimate::default(), Target::default());
        (e.grade_rad.value, t.grade_at_imu_rad) = (0.1f64.atan(), 0.02f64.atan());
        let x = ErrorSample::of(&e, [None; 3], None, &t).slope_percent;
        assert!((x - 8.0).abs() < 1e-12, "{x}");
    }

    /// The variance of a reference adds to that of the estimator: an error of 3 with 4 and 3 is 9/25.
    #[test]
    fn the_variance_of_the_reference_counts() {
        assert_eq!(normalised(3.0, 4.0, 3.0), 9.0 / 25.0);
        assert_eq!(normalised(3.0, 4.0, 0.0), 9.0 / 16.0);
    }
}
