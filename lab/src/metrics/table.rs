//! The table of metrics.

use crate::metrics::answers::share_of_asked;
use crate::metrics::of_estimator::{DEGREE, converged_max, end};
use crate::metrics::of_run::{energy, energy_per_metre, jerk};
use crate::metrics::percentile::{p95, p99_of_numbers};
use crate::metrics::series::{ErrorSample, Tracking};
use crate::metrics::statistics::{max, mean, rms, rms_over, scatter, share_in_band};
use crate::metrics::{Best, Marks, Metric, Of, Quantity};

/// Makes the table from one list of errors, each over all samples and over valid samples, and the lists of the others:
/// the table.
macro_rules! table {
    (
        errors: { $($quantity:ident $name:literal [$unit:literal, $best:ident] $doc:literal = $value:expr;)* }
        innovations: { $($nis:literal [$nis_unit:literal, $nis_best:ident] $nis_doc:literal = $nis_value:expr;)* }
        marks: { $($of:ident $kind:ident $mark:literal [$mark_unit:literal, $mark_best:ident] $mark_doc:literal;)* }
        others: { $($other:literal [$other_unit:literal, $other_best:ident] $other_doc:literal = $other_of:ident($other_value:expr);)* }
    ) => {
        /// All metrics: errors of an estimator, what its marks are worth, others, those of train and controller.
        pub const METRICS: &[Metric] = &[
            $(
                Metric {
                    name: $name,
                    unit: $unit,
                    doc: $doc,
                    best: Best::$best,
                    of: Of::Error { quantity: Quantity::$quantity, valid_only: false, referenced: true, start: || $value },
                },
                Metric {
                    name: concat!($name, "_valid"),
                    unit: $unit,
                    doc: concat!($doc, "; of valid samples"),
                    best: Best::$best,
                    of: Of::Error { quantity: Quantity::$quantity, valid_only: true, referenced: true, start: || $value },
                },
            )*
            $(
                Metric {
                    name: $nis,
                    unit: $nis_unit,
                    doc: $nis_doc,
                    best: Best::$nis_best,
                    of: Of::Error { quantity: Quantity::Slope, valid_only: false, referenced: false, start: || $nis_value },
                },
                Metric {
                    name: concat!($nis, "_valid"),
                    unit: $nis_unit,
                    doc: concat!($nis_doc, "; of valid samples"),
                    best: Best::$nis_best,
                    of: Of::Error { quantity: Quantity::Slope, valid_only: true, referenced: false, start: || $nis_value },
                },
            )*
            $(Metric {
                name: $mark,
                unit: $mark_unit,
                doc: $mark_doc,
                best: Best::$mark_best,
                of: Of::Marks { quantity: Quantity::$of, kind: Marks::$kind },
            },)*
            $(Metric {
                name: $other,
                unit: $other_unit,
                doc: $other_doc,
                best: Best::$other_best,
                of: Of::$other_of(|| $other_value),
            },)*
        ];
    };
}

table! {
    errors: {
        Mass "mass_rmse_kg" ["kg", Least] "root mean square error of the total mass"
            = rms(|x: &ErrorSample| x.mass_kg);
        Mass "mass_mae_kg" ["kg", Least] "mean absolute error of the total mass"
            = mean(|x: &ErrorSample| x.mass_kg.abs());
        Mass "mass_error_max_kg" ["kg", Least] "largest error of the total mass"
            = max(|x: &ErrorSample| x.mass_kg);
        Mass "mass_error_rel_max" ["1", Least] "largest error of the total mass over the total mass"
            = max(|x: &ErrorSample| x.mass_rel);
        Mass "mass_error_rel_p95" ["1", Least] "95th percentile of the absolute error of the total mass over the total mass"
            = p95(|x: &ErrorSample| x.mass_rel);
        Mass "mass_error_converged_max_kg" ["kg", Least] "largest error of the total mass after convergence: after it has first been valid and within 2 % for 1 s"
            = converged_max(|x: &ErrorSample| x.mass_kg);
        Mass "mass_error_converged_rel_max" ["1", Least] "largest error of the total mass after convergence, over the total mass"
            = converged_max(|x: &ErrorSample| x.mass_rel);
        Mass "mass_error_rel_end" ["1", Least] "error of the total mass over the total mass, mean of the last second, absolute"
            = end();
        Mass "mass_bias" ["1", Zero] "mean error of the total mass over the total mass"
            = mean(|x: &ErrorSample| x.mass_rel);
        Mass "mass_rmse_rel" ["1", Least] "root mean square error of the total mass over the total mass"
            = rms(|x: &ErrorSample| x.mass_rel);
        Mass "mass_scatter_rel" ["1", Least] "scatter: root mean square of the error of the total mass about its mean, over the total mass"
            = scatter(|x: &ErrorSample| x.mass_rel);
        Mass "mass_sd_mean_kg" ["kg", Least] "mean reported standard deviation of the mass"
            = mean(|x: &ErrorSample| x.mass_sd_kg);
        Mass "mass_sd_rel_mean" ["1", Least] "mean reported standard deviation of the mass over the total mass"
            = mean(|x: &ErrorSample| x.mass_sd_rel);
        Mass "mass_protection_rel_mean" ["1", Least] "mean protection level of the mass over the total mass, of an estimator that has one"
            = mean(|x: &ErrorSample| x.protection[0]);
        Mass "mass_nees_mean" ["1", OneOnAverage] "mean of (error / standard deviation)² of the mass; 1 when consistent"
            = mean(|x: &ErrorSample| x.mass_nees);
        Mass "mass_nees_in_band" ["1", InBand] "share of samples with a NEES of the mass within the 95 % band of χ²₁; 0.95 when consistent"
            = share_in_band(|x: &ErrorSample| x.mass_nees);
        Mass "mass_rmse_over_bound" ["1", Least] "root mean square relative error of the total mass over its Cramér-Rao bound, from the first valid sample on"
            = rms_over(|x: &ErrorSample| [x.mass_rel, x.mass_bound], |x: &ErrorSample| x.mass_valid);
        Slope "slope_rmse_deg" ["°", Least] "root mean square error of the slope against the grade at the IMU"
            = rms(|x: &ErrorSample| x.slope / DEGREE);
        Slope "slope_mae_deg" ["°", Least] "mean absolute error of the slope"
            = mean(|x: &ErrorSample| (x.slope / DEGREE).abs());
        Slope "slope_bias_deg" ["°", Zero] "mean error of the slope"
            = mean(|x: &ErrorSample| x.slope / DEGREE);
        Slope "slope_scatter_deg" ["°", Least] "scatter: root mean square of the error of the slope about its mean"
            = scatter(|x: &ErrorSample| x.slope / DEGREE);
        Slope "slope_error_max_deg" ["°", Least] "largest error of the slope"
            = max(|x: &ErrorSample| x.slope / DEGREE);
        Slope "slope_error_p95_deg" ["°", Least] "95th percentile of the absolute error of the slope"
            = p95(|x: &ErrorSample| x.slope / DEGREE);
        Slope "slope_rmse_percent" ["%", Least] "root mean square error of the slope in per cent, 100 tan θ, as for roads"
            = rms(|x: &ErrorSample| x.slope_percent);
        Slope "slope_error_max_percent" ["%", Least] "largest error of the slope in per cent, as for roads"
            = max(|x: &ErrorSample| x.slope_percent);
        Slope "slope_sd_mean_deg" ["°", Least] "mean reported standard deviation of the slope"
            = mean(|x: &ErrorSample| x.slope_sd / DEGREE);
        Slope "slope_protection_mean_deg" ["°", Least] "mean protection level of the slope, of an estimator that has one"
            = mean(|x: &ErrorSample| x.protection[1]);
        Slope "slope_nees_mean" ["1", OneOnAverage] "mean of (error / standard deviation)² of the slope; 1 when consistent"
            = mean(|x: &ErrorSample| x.slope_nees);
        Slope "slope_nees_in_band" ["1", InBand] "share of samples with a NEES of the slope within the 95 % band of χ²₁; 0.95 when consistent"
            = share_in_band(|x: &ErrorSample| x.slope_nees);
        Slope "slope_rmse_over_bound" ["1", Least] "root mean square error of the slope over its Cramér-Rao bound, from the first valid sample on"
            = rms_over(|x: &ErrorSample| [x.slope, x.slope_bound], |x: &ErrorSample| x.slope_valid);
        Slope "lagged_slope_rmse_deg" ["°", Least] "root mean square error of the delayed slope (internal `lagged_grade_rad`) against the grade under the middle of the unit that carries the IMU"
            = rms(|x: &ErrorSample| x.lagged / DEGREE);
        Slope "lagged_slope_error_max_deg" ["°", Least] "largest error of the delayed slope"
            = max(|x: &ErrorSample| x.lagged / DEGREE);
        Slope "lagged_slope_nees_mean" ["1", OneOnAverage] "mean of (error / standard deviation)² of the delayed slope; 1 when consistent"
            = mean(|x: &ErrorSample| x.lagged_nees);
        EffectiveSlope "effective_slope_rmse_deg" ["°", Least] "root mean square error of the effective slope against the effective grade of the whole vehicle"
            = rms(|x: &ErrorSample| x.slope_effective / DEGREE);
        EffectiveSlope "effective_slope_mae_deg" ["°", Least] "mean absolute error of the effective slope"
            = mean(|x: &ErrorSample| (x.slope_effective / DEGREE).abs());
        EffectiveSlope "effective_slope_bias_deg" ["°", Zero] "mean error of the effective slope"
            = mean(|x: &ErrorSample| x.slope_effective / DEGREE);
        EffectiveSlope "effective_slope_scatter_deg" ["°", Least] "scatter: root mean square of the error of the effective slope about its mean"
            = scatter(|x: &ErrorSample| x.slope_effective / DEGREE);
        EffectiveSlope "effective_slope_error_max_deg" ["°", Least] "largest error of the effective slope"
            = max(|x: &ErrorSample| x.slope_effective / DEGREE);
        EffectiveSlope "effective_slope_error_p95_deg" ["°", Least] "95th percentile of the absolute error of the effective slope"
            = p95(|x: &ErrorSample| x.slope_effective / DEGREE);
        EffectiveSlope "effective_slope_sd_mean_deg" ["°", Least] "mean reported standard deviation of the effective slope"
            = mean(|x: &ErrorSample| x.effective_sd / DEGREE);
        EffectiveSlope "effective_slope_protection_mean_deg" ["°", Least] "mean protection level of the effective slope, of an estimator that has one"
            = mean(|x: &ErrorSample| x.protection[2]);
        EffectiveSlope "effective_slope_nees_mean" ["1", OneOnAverage] "mean of (error / standard deviation)² of the effective slope; 1 when consistent"
            = mean(|x: &ErrorSample| x.effective_nees);
        EffectiveSlope "effective_slope_nees_in_band" ["1", InBand] "share of samples with a NEES of the effective slope within the 95 % band of χ²₁; 0.95 when consistent"
            = share_in_band(|x: &ErrorSample| x.effective_nees);
        EffectiveSlope "effective_slope_rmse_over_bound" ["1", Least] "root mean square error of the effective slope over its Cramér-Rao bound, from the first valid sample on"
            = rms_over(|x: &ErrorSample| [x.slope_effective, x.effective_bound], |x: &ErrorSample| x.effective_valid);
    }
    innovations: {
        "nis_mean" ["1", OneOnAverage] "mean normalised innovation squared; 1 when consistent"
            = mean(|x: &ErrorSample| x.nis);
        "nis_in_band" ["1", InBand] "share of samples with a NIS within the 95 % band of χ²₁; 0.95 when consistent"
            = share_in_band(|x: &ErrorSample| x.nis);
    }
    marks: {
        Mass Availability "mass_availability" ["1", One]
            "availability: share of samples whose mass is valid and credited";
        Mass Integrity "mass_misleading_share" ["1", Least]
            "integrity: share of the valid samples whose error of the mass exceeds protection level and alert limit";
        Mass Overconfidence "mass_overconfident_share" ["1", Least]
            "overconfidence: share of the valid samples whose error of the mass exceeds the protection level, for any size of the error";
        Mass BeyondLimit "mass_beyond_limit_share" ["1", Least]
            "share of the valid samples whose error of the mass exceeds the alert limit, for any standard deviation";
        Mass Convergence "mass_convergence_s" ["s", Least]
            "convergence: time of the first valid mass from which on every valid mass is within 2 % until the end; the value at the start does not count";
        Mass Recovery "mass_recovered_s" ["s", Least]
            "recovery: time of the first valid mass after which no mass misleads";
        Mass Continuity "mass_losses_per_h" ["1/h", Least]
            "continuity: losses of the mass's validity per hour";
        Mass Referenced "mass_reference_share" ["1", One]
            "share of samples with a reference of the mass, which errors and integrity use; 1 in a simulation";
        Slope Availability "slope_availability" ["1", One]
            "availability: share of samples whose slope is valid and credited";
        Slope Integrity "slope_misleading_share" ["1", Least]
            "integrity: share of the valid samples whose error of the slope exceeds protection level and alert limit";
        Slope Overconfidence "slope_overconfident_share" ["1", Least]
            "overconfidence: share of the valid samples whose error of the slope exceeds the protection level, for any size of the error";
        Slope BeyondLimit "slope_beyond_limit_share" ["1", Least]
            "share of the valid samples whose error of the slope exceeds the alert limit, for any standard deviation";
        Slope Recovery "slope_recovered_s" ["s", Least]
            "recovery: time of the first valid slope after which no slope misleads";
        Slope Continuity "slope_losses_per_h" ["1/h", Least]
            "continuity: losses of the slope's validity per hour";
        Slope Referenced "slope_reference_share" ["1", One]
            "share of samples with a reference of the slope, which errors and integrity use; 1 in a simulation";
        EffectiveSlope Availability "effective_slope_availability" ["1", One]
            "availability: share of samples whose effective slope is valid and credited";
        EffectiveSlope Integrity "effective_slope_misleading_share" ["1", Least]
            "integrity: share of the valid samples whose error of the effective slope exceeds protection level and alert limit";
        EffectiveSlope Overconfidence "effective_slope_overconfident_share" ["1", Least]
            "overconfidence: share of the valid samples whose error of the effective slope exceeds the protection level, for any size of the error";
        EffectiveSlope BeyondLimit "effective_slope_beyond_limit_share" ["1", Least]
            "share of the valid samples whose error of the effective slope exceeds the alert limit, for any standard deviation";
        EffectiveSlope Recovery "effective_slope_recovered_s" ["s", Least]
            "recovery: time of the first valid effective slope after which no effective slope misleads";
        EffectiveSlope Continuity "effective_slope_losses_per_h" ["1/h", Least]
            "continuity: losses of the effective slope's validity per hour";
        EffectiveSlope Referenced "effective_slope_reference_share" ["1", One]
            "share of samples with a reference of the effective slope, which errors and integrity use; 1 in a simulation";
    }
    others: {
        "running_resistance_rmse" ["1", Least]
            "root mean square error of the running-resistance coefficient, for estimators that identify it (internal `running_resistance`); all samples"
            = Estimator(rms(|x: &ErrorSample| x.running_resistance));
        "answer_latency_ms_p99" ["ms", Least]
            "99th percentile of the time from the sending of a step to its answer, of an external estimator in real time"
            = Estimator(p99_of_numbers(|x: &ErrorSample| { x.answers.map_or(f64::NAN, |a| a.latency_ms) }));
        "answers_late_share" ["1", Least]
            "share of the steps whose answer came after its deadline, of an external estimator in real time"
            = Estimator(share_of_asked(|a| a.late));
        "answers_lost_share" ["1", Least]
            "share of the steps without an answer, of an external estimator in real time"
            = Estimator(share_of_asked(|a| a.lost));
        "rig_late_share" ["1", Least]
            "share of the steps that monorig itself sent too late, in real time: the run then judges nothing"
            = Estimator(share_of_asked(|a| a.rig_late));
        "speed_rmse_mps" ["m/s", Least]
            "root mean square of speed minus reference"
            = Run(rms(|x: &Tracking| x.speed));
        "accel_rms_mps2" ["m/s²", Least]
            "root mean square acceleration along the track: comfort"
            = Run(rms(|x: &Tracking| x.accel));
        "jerk_rms_mps3" ["m/s³", Least]
            "root mean square change of the acceleration, both over steps of 0.1 s: comfort"
            = Run(jerk());
        "traction_energy_j" ["J", Least]
            "work that the wheels do on the vehicle while they drive it, ∫ max(F v, 0) dt; energy from braking is not subtracted"
            = Run(energy());
        "traction_energy_jpm" ["J/m", Least]
            "traction energy over the distance covered, ∫ |v| dt"
            = Run(energy_per_metre());
        "off_rail_max_m" ["m", Least]
            "largest distance of a wheel from its place on the rail; for a car from the middle of its lane"
            = Run(max(|x: &Tracking| x.off_rail));
    }
}
