//! Channel table: the columns of a recording, each with its name, its unit, and where its value comes from. A line adds
//! a channel.

use super::Channel;
use crate::closed_loop::AnswerCounts;
use crate::closed_loop::estimators::RunningEstimator;
use crate::control::{Perception, Reference};
use crate::plant::train::balance::ForceBalance;
use crate::plant::{DriveState, RoadState, Truth};
use crate::sensors::SensorChannel;
use monorig_estimators::api::aid::AidStatus;
use monorig_estimators::api::signals::{Command, Estimate};
use std::fmt::Arguments;

/// A column of a group of channels.
struct Column<T> {
    name: &'static str,
    unit: &'static str,
    doc: &'static str,
    value: fn(&T) -> f64,
}

/// Makes a table of columns from rows of name, unit, description and value.
macro_rules! columns {
    ($(#[$doc:meta])* $table:ident: $of:ty, |$x:ident| { $($name:literal [$unit:literal] $text:literal = $value:expr;)* }) => {
        $(#[$doc])*
        const $table: &[Column<$of>] = &[
            $(Column { name: $name, unit: $unit, doc: $text, value: |$x| $value }),*
        ];
    };
}

/// A kind of channel: where it is, its unit, and what it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChannelDescription {
    /// Path with `N` for the number of a drive unit, `NAME` for an estimator, `SOURCE` for a source of measurements.
    pub path: String,
    /// Unit of the channel; empty if it is the unit of the source.
    pub unit: &'static str,
    /// Description in one sentence.
    pub doc: &'static str,
}

/// Returns all kinds of channels except the channels of instruments and internals, which depend on the run.
pub fn descriptions() -> Vec<ChannelDescription> {
    fn add<T>(all: &mut Vec<ChannelDescription>, path: &str, columns: &[Column<T>]) {
        all.extend(columns.iter().map(|c| ChannelDescription {
            path: format!("{path}/{}", c.name),
            unit: c.unit,
            doc: c.doc,
        }));
    }
    let mut all = Vec::new();
    add(&mut all, "truth", TRUTH);
    add(&mut all, "truth/balance", TRUTH_BALANCE);
    add(&mut all, "truth/drive_N", TRUTH_DRIVE);
    add(&mut all, "truth/road", TRUTH_ROAD);
    add(&mut all, "control", CONTROL);
    add(&mut all, "estimates/NAME", ESTIMATE);
    add(&mut all, "internals/NAME", ANSWERS);
    add(&mut all, "aid/NAME/SOURCE", AID);
    all
}

columns! {
    /// `truth/…`
    TRUTH: Truth, |t| {
        "chainage" ["m"] "Chainage of the IMU." = t.chainage_m;
        "speed" ["m/s"] "Rate of the chainage, as wheels on the rail measure it." = t.speed_mps;
        "acceleration" ["m/s²"] "Mean change of the speed over the last physics step." = t.accel_mps2;
        "speed_at_imu" ["m/s"] "Speed of the IMU itself along the rail's tangent." = t.speed_at_imu_mps;
        "grade_at_imu" ["rad"] "Grade of the rail at the IMU: the truth for errors of the slope."
            = t.grade_at_imu_rad;
        "pitch_at_imu" ["rad"] "Pitch of the body that carries the IMU." = t.pitch_at_imu_rad;
        "grade_effective" ["rad"] "Slope in the force balance of the whole train: asin(Σ mᵢ sin θᵢ / Σ mᵢ)."
            = t.grade_effective_rad;
        "curvature_vertical" ["1/m"] "Vertical curvature of the rail at the IMU, + in a sag."
            = t.curvature_vertical_1pm;
        "curvature_horizontal" ["1/m"] "Horizontal curvature of the rail at the IMU, + in a left curve."
            = t.curvature_horizontal_1pm;
        "total_mass" ["kg"] "Mass of everything that moves." = t.total_mass_kg;
        "load_mass" ["kg"] "Mass of the payload." = t.load_mass_kg;
        "traction" ["N"] "Friction of all driven wheels on the train along the rail." = t.traction_n;
        "resistance" ["N"] "Running resistances, rolling of the clamped wheels included." = t.resistance_n;
        "brake" ["N"] "Clamp brakes, along the rail." = t.brake_n;
        "running_resistance" ["1"] "Resistance over Σ mᵢ g cos θᵢ: the μ of the estimators' models, here a result."
            = t.running_resistance;
        "sway_longitudinal" ["rad"] "Swing of the load against the vertical, + forward." = t.sway_rad[0];
        "sway_lateral" ["rad"] "Swing of the load against the vertical, + left." = t.sway_rad[1];
        "off_rail" ["m"] "Largest distance of a wheel station from the rail's line." = t.off_rail_m;
        "clearance" ["m"] "Least distance to obstacles and roadway; no value beyond 5 m." = finite(t.clearance_m);
        "clamp_pressure" ["MPa"] "Least clamp pressure of all drive units." = least_clamp_pressure(t);
        "largest_slip" ["m/s"] "Slip of the wheel that slips most." = largest_slip(t);
    }
}

columns! {
    /// `truth/balance/…`, of a train: the forces add up to `inertia`.
    TRUTH_BALANCE: ForceBalance, |b| {
        "drive" ["N"] "Torque of the gears over the wheels' radius." = b.drive_n;
        "clamped_rolling" ["N"] "Rolling of the clamped friction wheels." = b.clamped_rolling_n;
        "running_rolling" ["N"] "Rolling of the running wheels." = b.running_rolling_n;
        "guide_rolling" ["N"] "Rolling of the guide wheels: curve resistance." = b.guide_rolling_n;
        "bearing" ["N"] "Bearings." = b.bearing_n;
        "air" ["N"] "Air drag." = b.air_n;
        "brake" ["N"] "Clamp brakes." = b.brake_n;
        "grade" ["N"] "Weight along the rail." = b.grade_n;
        "curve" ["N"] "Force of a curve on the momentum along the rail without resistance." = b.curve_n;
        "contact" ["N"] "Contact with obstacles and flanges." = b.contact_n;
        "inertia" ["N"] "Effective mass times acceleration: the sum of the others." = b.inertia_n;
        "effective_mass" ["kg"] "Mass including the equivalent mass of rotating parts." = b.effective_mass_kg;
        "speed" ["m/s"] "Mean speed from the whole momentum along the rail." = b.speed_mps;
    }
}

columns! {
    /// `truth/drive_1/…`, one group for each drive unit.
    TRUTH_DRIVE: DriveState, |d| {
        "motor_torque" ["N·m"] "Torque at the motor shaft." = d.motor_torque_nm;
        "traction" ["N"] "Friction of both wheels of the unit." = d.traction_n;
        "slip" ["m/s"] "Slip of the wheel that slips more." = d.slip_mps;
        "adhesion" ["1"] "Adhesion coefficient under the wheels." = d.adhesion;
    }
}

columns! {
    /// `truth/road/…`, only of a car.
    TRUTH_ROAD: RoadState, |r| {
        "steering_angle" ["rad"] "Angle of the front wheels, + left." = r.steering_rad;
        "offset" ["m"] "Distance to the left of the lane's middle." = r.offset_m;
        "heading" ["rad"] "Heading against the lane, + left." = r.heading_rad;
        "sideslip" ["rad"] "Angle from the car's axis to its velocity, + left; no value below 0.1 m/s." = r.sideslip_rad;
        "yaw_rate" ["rad/s"] "Rate about the road's normal, + left." = r.yaw_rate_radps;
        "lateral_acceleration" ["m/s²"] "Force of the tyres to the left over the mass." = r.lateral_mps2;
        "load_front_left" ["N"] "Load of the wheel." = r.wheel_load_n[0];
        "load_front_right" ["N"] "Load of the wheel." = r.wheel_load_n[1];
        "load_rear_left" ["N"] "Load of the wheel." = r.wheel_load_n[2];
        "load_rear_right" ["N"] "Load of the wheel." = r.wheel_load_n[3];
    }
}

columns! {
    /// `control/…`
    CONTROL: ControlState, |c| {
        "reference_speed" ["m/s"] "Reference speed of the drive cycle." = c.reference.speed_mps;
        "reference_acceleration" ["m/s²"] "Reference acceleration of the drive cycle." = c.reference.accel_mps2;
        "measured_speed" ["m/s"] "Speed of the train by the vote of its wheels." = c.perception.speed_mps;
        "feedforward_grade" ["rad"] "Grade that the feed-forward uses." = c.perception.grade_rad;
        "feedforward_mass" ["kg"] "Mass that the feed-forward uses." = c.perception.total_mass_kg;
        "motor_torque" ["N·m"] "Commanded torque, mean of the drive units."
            = c.command.motor_torque_nm.iter().sum::<f64>() / c.drives.max(1) as f64;
        "brake" ["1"] "Commanded share of the clamp-brake force." = c.command.brake;
    }
}

columns! {
    /// `estimates/NAME/…`, one group for each estimator.
    ESTIMATE: Estimate, |e| {
        "total_mass" ["kg"] "Estimated total mass." = e.total_mass_kg.value;
        "total_mass_sd" ["kg"] "Its standard deviation." = e.total_mass_kg.sd;
        "total_mass_protection" ["kg"] "Its protection level; no value where the estimator has none." = level(e.protection.total_mass_kg);
        "total_mass_valid" ["1"] "1 where the estimate is marked valid." = flag(e.total_mass_kg.valid);
        "grade" ["rad"] "Estimated grade at the IMU." = e.grade_rad.value;
        "grade_sd" ["rad"] "Its standard deviation." = e.grade_rad.sd;
        "grade_protection" ["rad"] "Its protection level; no value where the estimator has none." = level(e.protection.grade_rad);
        "grade_valid" ["1"] "1 where the estimate is marked valid." = flag(e.grade_rad.valid);
        "effective_grade" ["rad"] "Estimated effective grade of the whole train." = e.effective_grade_rad.value;
        "effective_grade_sd" ["rad"] "Its standard deviation." = e.effective_grade_rad.sd;
        "effective_grade_protection" ["rad"] "Its protection level; no value where the estimator has none."
            = level(e.protection.effective_grade_rad);
        "effective_grade_valid" ["1"] "1 where the estimate is marked valid." = flag(e.effective_grade_rad.valid);
        "speed" ["m/s"] "Estimated speed along the rail." = e.speed_mps.value;
        "speed_sd" ["m/s"] "Its standard deviation." = e.speed_mps.sd;
        "innovation" ["m/s"] "Innovation of the slope filter's last measurement." = e.innovation;
        "nis" ["1"] "Normalised innovation squared, 1 on average when consistent." = e.nis;
        "moving" ["1"] "1 where the train moves fast enough for the force balance." = flag(e.flags.moving);
        "excited" ["1"] "1 where the mass regression is excited and updates." = flag(e.flags.excited);
        "saturated" ["1"] "1 where a limit acts (mass range, covariance, noise)." = flag(e.flags.saturated);
    }
}

columns! {
    /// `internals/NAME/…` of an estimator outside the program in real time: counts of the rig, beside internals of the
    /// estimator.
    ANSWERS: AnswerCounts, |a| {
        "answer_latency_ms" ["ms"] "Longest time to an answer in this step; this channel and the next four are of an estimator outside the program in real time."
            = a.latency_ms;
        "answers_asked" ["1"] "Steps that were sent to the estimator." = a.asked as f64;
        "answers_late" ["1"] "Answers that came too late." = a.late as f64;
        "answers_lost" ["1"] "Steps without an answer." = a.lost as f64;
        "rig_late" ["1"] "Steps that monorig itself sent too late." = a.rig_late as f64;
    }
}

columns! {
    /// `aid/NAME/SOURCE/…`, one group for each source of measurements of each estimator.
    AID: AidStatus, |a| {
        "innovation" [""] "Measurement minus prediction, in the unit of the source." = a.innovation;
        "innovation_sd" [""] "Its standard deviation by the filter." = libm::sqrt(a.innovation_variance);
        "test_ratio" ["1"] "Innovation squared over variance and over the gate's threshold: above 1 the gate acts."
            = a.test_ratio;
        "outcome" ["1"] "0 stale, 1 fused, 2 deweighted, 3 to 8 rejected." = f64::from(a.outcome.code());
    }
}

/// Reference, input and command of the controller.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ControlState {
    pub reference: Reference,
    pub perception: Perception,
    pub command: Command,
    pub drives: usize,
}

/// Sources of a row.
pub(super) struct RowSource<'a> {
    pub truth: &'a Truth,
    /// The columns of the instruments: each instrument lists its own.
    pub sensors: &'a [SensorChannel],
    /// Newest value of each instrument column since the last row; NaN if a column had none.
    pub samples: &'a [f64],
    pub control: ControlState,
    pub estimators: &'a [RunningEstimator],
}

/// Visits each group of channels.
trait Visitor {
    fn group<T>(&mut self, path: Arguments<'_>, columns: &[Column<T>], of: &T);
    fn sensors(&mut self, channels: &[SensorChannel], samples: &[f64]);
    fn internals(&mut self, estimator: &RunningEstimator);
}

/// The groups under `truth/`.
fn groups_of_truth(visitor: &mut impl Visitor, truth: &Truth) {
    visitor.group(format_args!("truth"), TRUTH, truth);
    if let Some(balance) = &truth.balance {
        visitor.group(format_args!("truth/balance"), TRUTH_BALANCE, balance);
    }
    for (drive, d) in truth.drives.iter().zip(1..) {
        visitor.group(format_args!("truth/drive_{d}"), TRUTH_DRIVE, drive);
    }
    if let Some(road) = &truth.road {
        visitor.group(format_args!("truth/road"), TRUTH_ROAD, road);
    }
}

/// All channels of a run, group by group, in the order of the columns.
fn visit(visitor: &mut impl Visitor, row: &RowSource<'_>) {
    groups_of_truth(visitor, row.truth);
    visitor.sensors(row.sensors, row.samples);
    visitor.group(format_args!("control"), CONTROL, &row.control);
    for estimator in row.estimators {
        let name = &estimator.name;
        let estimate = &estimator.estimate;
        visitor.group(format_args!("estimates/{name}"), ESTIMATE, estimate);
        visitor.internals(estimator);
        if let Some(answers) = estimator.answers() {
            visitor.group(format_args!("internals/{name}"), ANSWERS, &answers);
        }
        for (source, status) in estimator.aid_sources().iter().zip(estimator.aid_status()) {
            visitor.group(format_args!("aid/{name}/{source}"), AID, &status);
        }
    }
}

/// A column under `truth/`, with its value.
pub struct TruthColumn<'a> {
    /// Path such as `truth/drive_1/slip`.
    pub path: Arguments<'a>,
    /// Unit such as `m/s²`.
    pub unit: &'static str,
    /// Description in one sentence.
    pub doc: &'static str,
    /// The value; NaN where there is none.
    pub value: f64,
}

/// Visits all columns under `truth/`, in the order of the channels.
pub fn visit_truth(truth: &Truth, visit: &mut dyn FnMut(&TruthColumn<'_>)) {
    struct Columns<'a>(&'a mut dyn FnMut(&TruthColumn<'_>));
    impl Visitor for Columns<'_> {
        fn group<T>(&mut self, path: Arguments<'_>, columns: &[Column<T>], of: &T) {
            for c in columns {
                (self.0)(&TruthColumn {
                    path: format_args!("{path}/{}", c.name),
                    unit: c.unit,
                    doc: c.doc,
                    value: (c.value)(of),
                });
            }
        }
        fn sensors(&mut self, _: &[SensorChannel], _: &[f64]) {}
        fn internals(&mut self, _: &RunningEstimator) {}
    }
    groups_of_truth(&mut Columns(visit), truth);
}

/// The channels of a run.
pub(super) fn channels(row: &RowSource<'_>) -> Vec<Channel> {
    struct Names(Vec<Channel>);
    impl Visitor for Names {
        fn group<T>(&mut self, path: Arguments<'_>, columns: &[Column<T>], _: &T) {
            self.0.extend(columns.iter().map(|c| Channel {
                path: format!("{path}/{}", c.name),
                unit: c.unit,
            }));
        }
        fn sensors(&mut self, channels: &[SensorChannel], _: &[f64]) {
            self.0.extend(channels.iter().map(|c| Channel {
                path: c.path.clone(),
                unit: c.unit,
            }));
        }
        fn internals(&mut self, estimator: &RunningEstimator) {
            let internals = estimator.list_internals().iter();
            self.0.extend(internals.map(|i| Channel {
                path: format!("internals/{}/{}", estimator.name, i.name),
                unit: if i.unit == "-" { "1" } else { i.unit },
            }));
        }
    }
    let mut names = Names(Vec::new());
    visit(&mut names, row);
    names.0
}

/// Replaces `values` by the values of a row, in the order of the channels.
pub(super) fn values(row: &RowSource<'_>, values: &mut Vec<f64>) {
    struct Values<'a>(&'a mut Vec<f64>);
    impl Visitor for Values<'_> {
        fn group<T>(&mut self, _: Arguments<'_>, columns: &[Column<T>], of: &T) {
            self.0.extend(columns.iter().map(|c| (c.value)(of)));
        }
        fn sensors(&mut self, _: &[SensorChannel], samples: &[f64]) {
            self.0.extend(samples);
        }
        fn internals(&mut self, estimator: &RunningEstimator) {
            estimator.internals(self.0);
        }
    }
    values.clear();
    visit(&mut Values(values), row);
}

fn finite(x: f64) -> f64 {
    if x.is_finite() { x } else { f64::NAN }
}

fn level(protection: f64) -> f64 {
    if protection > 0.0 {
        protection
    } else {
        f64::NAN
    }
}

fn flag(b: bool) -> f64 {
    if b { 1.0 } else { 0.0 }
}

fn least_clamp_pressure(t: &Truth) -> f64 {
    let pressures = t.drives.iter().map(|d| d.clamp_mpa);
    finite(pressures.fold(f64::INFINITY, f64::min))
}

fn largest_slip(t: &Truth) -> f64 {
    let slips = t.drives.iter().map(|d| d.slip_mps);
    slips.fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_has_a_name_of_its_own_a_unit_and_a_value() {
        let truth = Truth {
            drives: vec![DriveState::default(); 3],
            road: Some(RoadState::default()),
            balance: Some(ForceBalance::default()),
            ..Truth::default()
        };
        let row = RowSource {
            truth: &truth,
            sensors: &[],
            samples: &[],
            control: ControlState::default(),
            estimators: &[],
        };
        let all = channels(&row);
        let mut paths: Vec<&str> = all.iter().map(|c| c.path.as_str()).collect();
        paths.sort_unstable();
        paths.dedup();
        assert_eq!(paths.len(), all.len());
        assert!(all.iter().all(|c| !c.unit.is_empty()));
        let described = descriptions();
        assert!(described.iter().all(|d| d.doc.ends_with('.')));
        let of_truth = described.iter().filter(|d| d.path.starts_with("truth/"));
        // three drive units have one description
        assert_eq!(
            of_truth.count(),
            all.iter().filter(|c| c.path.starts_with("truth/")).count() - 2 * TRUTH_DRIVE.len()
        );
        let mut row_values = vec![1.0; 3];
        values(&row, &mut row_values);
        assert_eq!(row_values.len(), all.len());
    }
}
