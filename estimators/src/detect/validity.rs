//! The validity rule, one for all supervised estimators.
//!
//! A value is valid while
//!
//! 1. it is initialised: its filter has had a measurement, and its foundations are there (a mass, an observable grade,
//!    wheels that do not slip)
//! 2. its inputs are fresh ([`SampleHold`](crate::preprocess::sample_hold::SampleHold))
//! 3. its standard deviation is below the limit of its quantity (`mass_sd_max`, `grade_sd_max_deg`, `speed_sd_max_mps`)
//! 4. no clamp acts on it: range of the mass, steepest grade
//! 5. the windowed NIS of each of its sources, on the noise given or learnt and not on the noise adapted, is within its
//!    χ² limit ([`NisMonitor`])
//! 6. its instruments are plausible ([`Plausibility`](crate::detect::plausibility::Plausibility))
//!
//! The standard deviation that is published and compared is that of the filter times the root of its windowed NIS where
//! that is above 1.9 (the a posteriori variance factor of least squares); regressions have that of their own
//! ([`Rls::spread`](crate::filters::rls::Rls::spread)). That of a grade has its [`DynamicLag`] added: what it moves by
//! while its filter settles.
//!
//! A load is changed while the train stands, where nothing shows it
//! ([`StandingLoad`](crate::detect::standing_load::StandingLoad)). A pipeline answers for that and for 1, 2 and 4 in
//! the marks that it hands over; the rest is added here, with the same limits for all.

use crate::Real;
use crate::api::params::params;
use crate::api::real::{PI, sqrt};
use crate::api::signals::{Estimate, Protection, Value};
use crate::api::snapshot::state;
use crate::detect::dynamic_lag::DynamicLag;
use crate::detect::nis_monitor::NisMonitor;
use crate::instruments::gate::Gate;
use crate::tuning::VALIDITY;

params! {
    /// Innovation gates and validity rule.
    Integrity {
        validity_gate [flag] = true, "Mark only values that meet the validity rule as valid; off: mark all estimated values.";
        gate_sd ["-"] = 5.0, 1.0 => 100.0, "Innovation gate, in standard deviations by the un-adapted noise, times the running scale of the innovations.";
        gate_timeout_s ["s"] = 0.5, 0.0 => 60.0, "Time with only rejections after which a gate reopens, with the covariance widened.";
        nis_monitor [flag] = true, "No value is valid while the windowed NIS by the un-adapted noise exceeds its limit.";
        nis_window_s ["s"] = 2.0, 0.1 => 600.0, "Time constant of the window of the NIS of state filters; five times that for regressions.";
        nis_quantile_sd ["-"] = 4.75, 0.0 => 10.0, "Limit of the windowed NIS, as the χ² quantile at this normal quantile; 4.75: exceeded once in a million windows.";
        plausibility [flag] = true, "No value is valid while instruments contradict gravity, the geometry of tracks or each other: wrong unit, sign or axis.";
        lag_s ["s"] = 0.5, 0.01 => 60.0, "Settling time of a grade: its change within this time counts as uncertain.";
        lag_share ["-"] = 0.5, 0.0 => 10.0, "Share of a grade's change in its settling time that is added to its standard deviation; 0: none.";
        protection_sd ["-"] = 3.89, 1.0 => 5.0, "Protection level over standard deviation; 3.89: exceeded by one sample in 10 000 of a normal error.";
        standing_load_s ["s"] = 5.0, 0.1 => 1e6, "Standstill after which another load may hang on the train: the mass is reopened, and is not valid until the force balance has confirmed it.";
        mass_sd_max ["-"] = 0.1, 1e-3 => 1.0, "Largest standard deviation of a valid mass, as a share of the mass.";
        grade_sd_max_deg ["deg"] = 3.0, 0.01 => 30.0, "Largest standard deviation of a valid grade angle.";
        speed_sd_max_mps ["m/s"] = 0.3, 1e-3 => 10.0, "Largest standard deviation of a valid speed.";
    }
}

params! {
    /// Innovation gate of a baseline: a filter without the attitude filter under it.
    BaselineIntegrity {
        innovation_gate [flag] = true, "Reject measurements whose innovation is beyond the gate.";
    }
}

impl Integrity {
    /// An innovation gate with these parameters, on or off.
    pub fn gate(&self, on: bool) -> Gate {
        Gate::new(on, self.gate_sd, self.gate_timeout_s)
    }
}

/// A source of innovations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Wheel speed, to a state filter: grade and speed rest on it.
    WheelSpeed,
    /// Accelerometer, to a state filter: grade and speed rest on it.
    Accelerometer,
    /// Force balance, to a regression: the mass rests on it.
    ForceBalance,
}

/// The validity rule of one estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Validity {
    params: Integrity,
    nis: [NisMonitor; 3],
    /// True if the instruments are plausible.
    plausible: bool,
    /// Dynamic lag of the grade at the IMU, and of the effective grade.
    lag: [DynamicLag; 2],
    dt: Real,
}

impl Validity {
    /// Builds the rule.
    pub fn new(params: Integrity) -> Self {
        let [state_hz, regression_hz] = VALIDITY.independent_hz;
        let monitor = |window_s: Real, hz: Real| {
            NisMonitor::new(params.nis_monitor, window_s, hz, params.nis_quantile_sd)
        };
        let state = monitor(params.nis_window_s, state_hz);
        let regression = monitor(
            state_hz / regression_hz * params.nis_window_s,
            regression_hz,
        );
        Self {
            params,
            nis: [state, state, regression],
            plausible: true,
            lag: [DynamicLag::new(params.lag_s, params.lag_share); 2],
            dt: 0.0,
        }
    }

    /// One step of `dt` seconds: whether the instruments are plausible.
    pub fn observe(&mut self, plausible: bool, dt: Real) {
        (self.plausible, self.dt) = (plausible, dt);
    }

    /// An innovation of a source: its NIS on the un-adapted noise, by its degrees of freedom, `period_s` after the one
    /// before.
    pub fn innovation(&mut self, source: Source, nis: Real, period_s: Real) {
        if let Some(monitor) = self.nis.get_mut(source as usize) {
            monitor.observe(nis, period_s);
        }
    }

    /// A posteriori variance factor of a source: its windowed NIS where that is more than chance makes of a consistent
    /// filter, else 1.
    fn variance_factor(&self, source: Source) -> Real {
        let monitor = self
            .nis
            .get(source as usize)
            .filter(|_| self.params.nis_monitor);
        monitor
            .map(NisMonitor::mean)
            .filter(|mean| *mean > VALIDITY.inconsistent)
            .unwrap_or(1.0)
    }

    fn consistent_in(&self, sources: &[Source]) -> bool {
        let of = |source: &Source| self.nis.get(*source as usize);
        self.plausible && sources.iter().filter_map(of).all(NisMonitor::consistent)
    }

    /// Marks the mass by the rule; on entry `valid` is true if the mass is initialised, fresh and not clamped.
    pub fn mass(&self, mass_kg: Value) -> Value {
        let most = self.params.mass_sd_max * mass_kg.value;
        let consistent = self.consistent_in(&[Source::ForceBalance]);
        mark(mass_kg, most, consistent)
    }

    /// Marks a grade angle by the rule.
    pub fn grade(&self, grade_rad: Value) -> Value {
        let most = self.params.grade_sd_max_deg * PI / 180.0;
        let consistent = self.consistent_in(&[Source::WheelSpeed, Source::Accelerometer]);
        mark(grade_rad, most, consistent)
    }

    /// Marks a speed by the rule.
    pub fn speed(&self, speed_mps: Value) -> Value {
        let consistent = self.consistent_in(&[Source::WheelSpeed]);
        mark(speed_mps, self.params.speed_sd_max_mps, consistent)
    }

    /// The estimate with all its marks by the rule; with the gate off every estimated value is marked. `mass`: whether
    /// a mass is estimated at all. Once a step.
    pub fn publish(&mut self, estimate: Estimate, mass: bool) -> Estimate {
        let [speed, force] =
            [Source::WheelSpeed, Source::Accelerometer].map(|s| self.variance_factor(s));
        let factor = speed.max(force);
        let [at_imu, effective] = &mut self.lag;
        let at_imu = at_imu.widen(widened(estimate.grade_rad, factor), self.dt);
        let effective = effective.widen(widened(estimate.effective_grade_rad, factor), self.dt);
        let mut marked = Estimate {
            total_mass_kg: self.mass(estimate.total_mass_kg),
            grade_rad: self.grade(at_imu),
            effective_grade_rad: self.grade(effective),
            speed_mps: self.speed(widened(estimate.speed_mps, speed)),
            ..estimate
        };
        let level = |value: Value| self.params.protection_sd * value.sd;
        let own = marked.protection.total_mass_kg;
        marked.protection = Protection {
            total_mass_kg: match mass {
                true if own == 0.0 => level(marked.total_mass_kg),
                _ => own,
            },
            grade_rad: level(marked.grade_rad),
            effective_grade_rad: level(marked.effective_grade_rad),
        };
        if !self.params.validity_gate {
            marked.total_mass_kg.valid |= mass;
            marked.grade_rad.valid = true;
            marked.effective_grade_rad.valid = true;
            marked.speed_mps.valid = true;
        }
        marked
    }
}

/// The value with a variance larger by a factor.
fn widened(value: Value, factor: Real) -> Value {
    Value {
        sd: value.sd * sqrt(factor),
        ..value
    }
}

fn mark(value: Value, max_sd: Real, consistent: bool) -> Value {
    Value {
        valid: value.valid && value.sd < max_sd && consistent,
        ..value
    }
}

state!(Validity { nis, plausible, lag, dt; params });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::reading::Reading;
    use crate::detect::plausibility::{Instruments, Plausibility};

    fn estimate() -> Estimate {
        let value = |value: Real, sd: Real| Value {
            value,
            sd,
            valid: true,
        };
        Estimate {
            total_mass_kg: value(1e4, 999.0),
            grade_rad: value(0.1, 0.052),
            effective_grade_rad: value(0.1, 0.052),
            speed_mps: value(1.0, 0.29),
            ..Estimate::default()
        }
    }

    fn marks(validity: &Validity, estimate: Estimate) -> [bool; 4] {
        let published = { *validity }.publish(estimate, true);
        [
            published.total_mass_kg,
            published.grade_rad,
            published.effective_grade_rad,
            published.speed_mps,
        ]
        .map(|value| value.valid)
    }

    fn validity(params: Integrity) -> Validity {
        Validity::new(params)
    }

    #[test]
    fn each_quantity_has_its_limit_of_standard_deviation() {
        let rule = validity(Integrity::default());
        let mut now = estimate();
        assert_eq!(marks(&rule, now), [true; 4]);
        now.total_mass_kg.sd = 1_001.0;
        assert_eq!(marks(&rule, now), [false, true, true, true]);
        now.grade_rad.sd = 0.053;
        assert_eq!(marks(&rule, now), [false, false, true, true]);
        now.speed_mps.sd = 0.31;
        assert_eq!(marks(&rule, now), [false, false, true, false]);
    }

    /// Every published standard deviation has its protection level; that of a mass may be the pipeline's own, and
    /// there is none where no mass is estimated.
    #[test]
    fn each_quantity_has_its_protection_level() {
        let params = Integrity {
            protection_sd: 4.0,
            ..Integrity::default()
        };
        let mut rule = validity(params);
        let published = rule.publish(estimate(), true);
        let of = |e: &Estimate| {
            let p = e.protection;
            [p.total_mass_kg, p.grade_rad, p.effective_grade_rad]
        };
        let sd = [
            published.total_mass_kg.sd,
            published.grade_rad.sd,
            published.effective_grade_rad.sd,
        ];
        assert_eq!(of(&published), sd.map(|sd| 4.0 * sd));
        let mut own = estimate();
        own.protection.total_mass_kg = 7_000.0;
        assert_eq!(of(&rule.publish(own, true))[0], 7_000.0);
        assert_eq!(of(&rule.publish(estimate(), false))[0], 0.0);
    }

    #[test]
    fn what_the_pipeline_does_not_answer_for_is_not_valid() {
        let rule = validity(Integrity::default());
        let mut now = estimate();
        now.total_mass_kg.valid = false;
        assert_eq!(marks(&rule, now), [false, true, true, true]);
    }

    #[test]
    fn inconsistent_innovations_end_validity_of_what_rests_on_them() {
        for (source, expected) in [
            (Source::WheelSpeed, [true, false, false, false]),
            (Source::Accelerometer, [true, false, false, true]),
            (Source::ForceBalance, [false, true, true, true]),
        ] {
            let mut rule = validity(Integrity::default());
            for _ in 0..100 {
                rule.innovation(source, 9.0, 0.5);
            }
            assert_eq!(marks(&rule, estimate()), expected);
        }
    }

    #[test]
    fn off_it_marks_all_that_is_estimated() {
        let mut rule = validity(Integrity {
            validity_gate: false,
            ..Integrity::default()
        });
        let nothing = Estimate::default();
        assert_eq!(marks(&rule, nothing), [true; 4]);
        assert!(!rule.publish(nothing, false).total_mass_kg.valid);
    }

    #[test]
    fn wrong_units_end_the_validity_of_all() {
        let mut rule = validity(Integrity::default());
        let mut checks = Plausibility::new(true, Instruments::default());
        let mut reading = Reading {
            specific_force_mps2: Some(0.0),
            lateral_force_mps2: Some(0.0),
            vertical_force_mps2: Some(9.81),
            pitch_rate_radps: Some(0.0),
            ..Reading::default()
        };
        for k in 0..400 {
            // A start at 1 m/s², in km/h.
            let t = 0.01 * Real::from(k);
            reading.specific_force_mps2 = Some(if t > 1.0 { 1.0 } else { 0.0 });
            reading.speed_mps = Some(3.6 * (t - 1.0).max(0.0));
            let plausible = checks.step(&reading, reading.pitch_rate_radps, 0.01);
            rule.observe(plausible, 0.01);
        }
        assert_eq!(marks(&rule, estimate()), [false; 4]);
    }

    /// The mean goes to 25 as 1 − e^(−t/T) and passes 3.3, the limit of 20 degrees, at t = T/10: 0.2 s at 2 s, 1 s at
    /// 10 s.
    #[test]
    fn the_window_of_a_regression_is_five_times_that_of_a_filter() {
        for (source, before, after) in [(Source::WheelSpeed, 3, 6), (Source::ForceBalance, 18, 23)]
        {
            let after_steps = |steps: usize| {
                let mut rule = validity(Integrity::default());
                (0..steps).for_each(|_| rule.innovation(source, 25.0, 0.05));
                rule.consistent_in(&[source])
            };
            assert!(after_steps(before) && !after_steps(after), "{source:?}");
        }
    }

    /// Innovations whose mean square is four times what was expected tell of standard deviations twice as large, of all
    /// that rests on their source; squares of 1.8 are chance. Without the monitor nothing is widened.
    #[test]
    fn standard_deviations_are_widened_by_the_root_of_the_squares() {
        for (on, nis, factor) in [
            (true, 4.0, 2.0),
            (true, 1.8, 1.0),
            (true, 0.2, 1.0),
            (false, 4.0, 1.0),
        ] {
            for (source, grade, speed) in [
                (Source::WheelSpeed, true, true),
                (Source::Accelerometer, true, false),
                (Source::ForceBalance, false, false),
            ] {
                let mut rule = validity(Integrity {
                    nis_monitor: on,
                    ..Integrity::default()
                });
                (0..2_000).for_each(|_| rule.innovation(source, nis, 0.1));
                let (before, after) = (estimate(), rule.publish(estimate(), true));
                let of = |widened: bool| if widened { factor } else { 1.0 };
                for (before, after, factor) in [
                    (before.grade_rad, after.grade_rad, of(grade)),
                    (
                        before.effective_grade_rad,
                        after.effective_grade_rad,
                        of(grade),
                    ),
                    (before.speed_mps, after.speed_mps, of(speed)),
                    (before.total_mass_kg, after.total_mass_kg, 1.0),
                ] {
                    assert!(
                        (after.sd / before.sd / factor - 1.0).abs() < 1e-6,
                        "{source:?} {nis}"
                    );
                    assert_eq!(after.value, before.value);
                }
            }
        }
    }
}
