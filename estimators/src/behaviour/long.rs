//! A train of 18 m on ramps: the gain from a model of its length.

use super::*;
use crate::api::signals::VehicleData;

pub const TARE_SPAN_M: [Real; 2] = [0.0, 18.0];
pub const LOAD_SPAN_M: [Real; 2] = [5.0, 13.0];

pub fn long(seed: u64) -> World {
    World {
        tare_span_m: TARE_SPAN_M,
        load_span_m: LOAD_SPAN_M,
        grade: |s| 8f64.to_radians() * (smooth((s - 20.0) / 8.0) - smooth((s - 60.0) / 8.0)),
        seconds: 90.0,
        ..world(seed)
    }
}

const SEEDS: u64 = 2;

struct Errors {
    /// Root mean squares of grade, of effective grade, and of the difference of the two (as sines), deg.
    grade: Real,
    effective: Real,
    ahead: Real,
}

/// Mean over seeds, for an estimator built with the spans or with a point.
fn errors(name: &str, settings: &[(&str, Setting)], told: bool) -> Errors {
    let vehicle = if told {
        Vehicle::new(VehicleData {
            tare_span_m: TARE_SPAN_M,
            load_span_m: LOAD_SPAN_M,
            ..vehicle().data()
        })
        .unwrap()
    } else {
        vehicle()
    };
    let (mut grade, mut effective, mut ahead) = (0.0, 0.0, 0.0);
    for seed in 1..=SEEDS {
        let mut estimator = build(name, &vehicle, settings.iter().copied()).unwrap();
        let rows = long(seed).run(&mut estimator);
        let rms = |error: &dyn Fn(&Row) -> Real| {
            let late = rows.iter().filter(|row| row.t > 8.0);
            let errors: Vec<Real> = late.map(|row| error(row).to_degrees()).collect();
            crate::testing::rms(&errors) / SEEDS as Real
        };
        grade += rms(&|row| row.estimate.grade_rad.value - row.theta);
        effective += rms(&|row| row.estimate.effective_grade_rad.value - row.effective);
        ahead += rms(&|row| {
            let [imu, whole] = [row.estimate.grade_rad, row.estimate.effective_grade_rad];
            imu.value.sin() - whole.value.sin() - (row.theta.sin() - row.effective.sin())
        });
    }
    std::println!(
        "{name}, told {told}: grade {grade:.3}°, effective {effective:.3}°, ahead {ahead:.3}°"
    );
    Errors {
        grade,
        effective,
        ahead,
    }
}

/// The published methods under supervision.
fn methods() -> Vec<&'static str> {
    let supervised = |name: &&str| kind(name) == Some(Kind::Supervised);
    NAMES.iter().copied().filter(supervised).collect()
}

#[test]
fn with_its_length_every_pipeline_finds_the_offset_of_the_grade_at_the_imu() {
    let mass0 = [("mass0_kg", 15_000.0.into())];
    for name in methods() {
        let (long, point) = (errors(name, &mass0, true), errors(name, &mass0, false));
        assert!(long.ahead < 0.5 && point.ahead > 1.5, "{name}");
        let total = |e: &Errors| e.grade.hypot(e.effective);
        assert!(total(&long) < 0.6 * total(&point), "{name}");
    }
}

/// Largest errors of both grades, rad and in standard deviations, where they are valid, from an instant on, and how
/// often they are.
struct Worst {
    at_imu: [Real; 2],
    effective: [Real; 2],
    valid: usize,
}

fn worst(rows: &[Row], from_s: Real) -> Worst {
    let mut worst = Worst {
        at_imu: [0.0; 2],
        effective: [0.0; 2],
        valid: 0,
    };
    for row in rows.iter().filter(|row| row.t > from_s) {
        let (imu, whole) = (row.estimate.grade_rad, row.estimate.effective_grade_rad);
        for (most, grade, truth) in [
            (&mut worst.at_imu, imu, row.theta),
            (&mut worst.effective, whole, row.effective),
        ] {
            if grade.valid {
                let error = (grade.value - truth).abs();
                // A thousandth of a radian is the quiet error of the rail memory at an edge.
                let normalised = (error - 1e-3).max(0.0) / grade.sd;
                *most = [most[0].max(error), most[1].max(normalised)];
            }
        }
        worst.valid += usize::from(imu.valid && whole.valid);
    }
    worst
}

fn long_vehicle() -> Vehicle {
    Vehicle::new(VehicleData {
        tare_span_m: TARE_SPAN_M,
        load_span_m: LOAD_SPAN_M,
        ..vehicle().data()
    })
    .unwrap()
}

/// The ramp down begins at 60 m, which the instrument reaches after some 63 s: ten seconds of it without the
/// accelerometer, and with the gyro or without.
#[test]
fn without_its_accelerometer_a_long_train_says_how_well_it_knows_its_grades() {
    without_accelerometer(&methods(), true);
}

/// The force tells the effective grade. That at the IMU nobody knows then, and the attitude filter is overconfident of
/// it: off by 0.116 rad after ten seconds, which is 11 of its standard deviations.
#[test]
fn without_its_imu_the_effective_grade_is_known_by_the_force() {
    without_accelerometer(&methods(), false);
}

fn without_accelerometer(names: &[&str], gyro: bool) {
    let mut wrong = Vec::new();
    for name in names {
        let tamper = |z: &mut Measurements, _: &mut Command| {
            if (62.0..72.0).contains(&z.t.s()) {
                z.specific_force_mps2 = None;
                z.angular_rate_radps = z.angular_rate_radps.filter(|_| gyro);
            }
        };
        for seed in 1..=2 {
            let estimator = build(name, &long_vehicle(), []).unwrap();
            let rows = long(seed).run(&mut Tampered { estimator, tamper });
            let found = worst(&rows, 62.0);
            std::println!(
                "{name}, gyro {gyro}: {:.4} rad, {:.1} sd at the IMU, {:.4} rad, {:.1} sd effective, {} valid",
                found.at_imu[0],
                found.at_imu[1],
                found.effective[0],
                found.effective[1],
                found.valid
            );
            if gyro && found.at_imu[1] >= 3.5 || found.effective[1] >= 3.5 {
                wrong.push((*name, gyro, found.at_imu, found.effective));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// The memory of the rail is not much longer than the train: back at the foot of the ramp it has forgotten it, and the
/// instrument is at the tail.
#[test]
fn driving_back_over_forgotten_rail_the_grades_are_known_by_their_standard_deviations() {
    back_over_forgotten_rail(&["dffrls_aekf_robust", "rail_fusion"]);
}

fn back_over_forgotten_rail(names: &[&str]) {
    let mut wrong = Vec::new();
    for name in names {
        for seed in 1..=2 {
            // All of the way back counts, the reversal too, where innovations are large.
            let settings = [("nis_monitor", false.into())];
            let mut estimator = build(name, &long_vehicle(), settings).unwrap();
            let world = World {
                grade: |s| 8f64.to_radians() * smooth((s - 20.0) / 8.0),
                speed: |t| (0.25 * (t - 1.0)).clamp(0.0, 1.0) - (0.25 * (t - 90.0)).clamp(0.0, 1.9),
                seconds: 175.0,
                ..long(seed)
            };
            let rows = world.run(&mut estimator);
            let found = worst(&rows, 100.0);
            let back = rows.iter().filter(|row| row.t > 100.0);
            let lead = back.map(|row| (row.theta.sin() - row.effective.sin()).abs());
            let lead = lead.fold(0.0, Real::max);
            std::println!(
                "{name}: lead up to {lead:.3}; {:.4} rad, {:.1} sd at the IMU, {:.4} rad, {:.1} sd effective, {} valid",
                found.at_imu[0],
                found.at_imu[1],
                found.effective[0],
                found.effective[1],
                found.valid
            );
            // Without a grade by force it stops being valid over rail that nothing has read.
            assert!(lead > 0.08 && found.valid > 2_000, "{name}");
            assert!(found.at_imu[0] < 0.01, "{name}");
            if found.effective[1] >= 3.5 {
                wrong.push((*name, seed, found.effective));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}
