//! Whole pipelines against oracles of their own (`tests/reference/pipeline_*.py` and `published_*.py`): from the
//! samples to the estimate, every fourth or tenth step of a recorded drive.

use crate::fusion_drive;
use crate::reference::{Table, assert_agrees};
use monorig_estimators::Setting;
use monorig_estimators::Time;
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::signals::{
    Command, Estimate, Measurements, RoadVehicle, Sample, Vehicle, VehicleData,
};
use monorig_estimators::registry::build;

const DT: f64 = 0.05;

/// The train of the oracles, a point.
fn rail() -> Vehicle {
    Vehicle::new(VehicleData {
        tare_kg: 5_000.0,
        drives: 2,
        wheel_radius_m: 0.17,
        gear_ratio: 20.0,
        efficiency: 0.9,
        rotating_mass_kg: 1_045.0,
        running_resistance: 0.02,
        mass_range_kg: [5_000.0, 27_000.0],
        ..VehicleData::default()
    })
    .unwrap()
}

/// The road vehicle of the oracles.
fn road() -> Vehicle {
    Vehicle::new(VehicleData {
        tare_kg: 1_900.0,
        drives: 2,
        wheel_radius_m: 0.335,
        gear_ratio: 7.235,
        efficiency: 0.95,
        rotating_mass_kg: 65.0,
        running_resistance: 0.0092,
        mass_range_kg: [1_500.0, 3_000.0],
        road: Some(RoadVehicle {
            drag_area_m2: 0.332 * 2.574,
            air_density_kgpm3: 1.2258,
            front_axle_m: 1.3,
            rear_axle_m: 1.5,
            front_cornering_npr: 120e3,
            rear_cornering_npr: 130e3,
        }),
        ..rail().data()
    })
    .unwrap()
}

/// Measurements and command of a row of a recorded drive: torque and wheel speed only where it is fresh.
fn samples(row: &[f64; 11]) -> (Measurements, Command) {
    let [
        fresh,
        t_s,
        f,
        across,
        yaw,
        steer,
        torque1,
        torque2,
        speed1,
        speed2,
        brake,
    ] = *row;
    let at = |value| Sample {
        t: Time::from_s(t_s),
        value,
    };
    let mut z = Measurements {
        t: Time::from_s(t_s),
        specific_force_mps2: Some(Sample {
            t: Time::from_s(t_s),
            value: [f, across, 9.81],
        }),
        angular_rate_radps: Some(Sample {
            t: Time::from_s(t_s),
            value: [0.0, 0.0, yaw],
        }),
        steering_angle_rad: Some(at(steer)),
        ..Default::default()
    };
    if fresh != 0.0 {
        z.motor_torque_nm[0] = Some(at(torque1));
        z.motor_torque_nm[1] = Some(at(torque2));
        z.wheel_speed_mps[0] = Some(at(speed1));
        z.wheel_speed_mps[1] = Some(at(speed2));
    }
    let u = Command {
        brake,
        ..Default::default()
    };
    (z, u)
}

/// Every fourth step of a named pipeline over the recorded drive, as `row` has it from the estimate and the internals
/// named.
fn drive(
    input: &str,
    vehicle: &Vehicle,
    (name, settings, internals): (&str, &[(&str, f64)], &[&str]),
    row: impl Fn(&Estimate) -> Vec<f64>,
) -> Vec<Vec<f64>> {
    let mut pipeline = build(
        name,
        vehicle,
        settings.iter().map(|&(key, value)| (key, value.into())),
    )
    .unwrap();
    let place = |wanted: &&str| {
        pipeline
            .internals()
            .iter()
            .position(|i| i.name == *wanted)
            .unwrap()
    };
    let places: Vec<usize> = internals.iter().map(place).collect();
    let mut rows = Vec::new();
    for (k, line) in Table::read(input).arrays::<11>().iter().enumerate() {
        let (z, u) = samples(line);
        let estimate = pipeline.step(&z, &u, DT).unwrap();
        if k % 4 == 3 {
            let mut values = [0.0; 16];
            pipeline.internal_values(&mut values);
            let own = places.iter().map(|place| values[*place]);
            rows.push(row(&estimate).into_iter().chain(own).collect());
        }
    }
    rows
}

/// Puts the number of the run before each of its rows.
fn number(run: usize, rows: Vec<Vec<f64>>) -> impl Iterator<Item = Vec<f64>> {
    rows.into_iter()
        .map(move |row| [vec![run as f64], row].concat())
}

/// The supervised method, in the core of a train, on the drive of `fusion.py` on a rail.
mod supervised {
    use super::*;
    use crate::fusion_drive::{Drive, RAIL};

    /// Every tenth step: what is estimated with its standard deviations, and the internals named.
    fn compare(
        (oracle, over): (&str, &Drive),
        name: &str,
        settings: &[(&'static str, f64)],
        internals: &[&str],
    ) {
        // They have laws of their own.
        let outside = [
            ("torque_monitor", Setting::Flag(false)),
            ("outlier_hold", Setting::Flag(false)),
            ("noise", Setting::Choice("told")),
        ];
        let numbers = settings
            .iter()
            .map(|(key, value)| (*key, Setting::Number(*value)));
        let settings: Vec<_> = numbers.chain(outside).collect();
        let row = |e: &Estimate| {
            let found = [
                e.total_mass_kg,
                e.grade_rad,
                e.effective_grade_rad,
                e.speed_mps,
            ];
            let found = found.iter().flat_map(|value| [value.value, value.sd]);
            found.chain([e.innovation, e.nis]).collect()
        };
        let rows = fusion_drive::drive(over, name, &settings, internals, row);
        assert_agrees(oracle, &rows);
    }

    #[test]
    fn liu_2023() {
        let settings = [("mass0_kg", 21e3), ("delta", 0.995), ("load_change", 8.0)];
        let internals = [
            "running_resistance",
            "accel_bias_mps2",
            "load_changes",
            "wheel_speed_sd_mps",
            "method_grade_rad",
            "method_grade_sd_rad",
        ];
        compare(
            ("pipeline_liu", &RAIL),
            "dffrls_aekf_robust",
            &settings,
            &internals,
        );
    }
}

/// The textbook baseline with its gate, from the samples on.
#[test]
fn baseline() {
    let mut pipeline = build(
        "ekf_v_theta_biases",
        &rail(),
        [("nis_monitor", false.into()), ("lag_share", 0.0.into())],
    )
    .unwrap();
    let dt = 0.02;
    let mut rows = Vec::new();
    let input = Table::read("pipeline_baseline_input.csv").arrays::<5>();
    for (k, [fresh, t_s, f, pitch, speed]) in input.into_iter().enumerate() {
        let t = Time::from_s(t_s);
        let mut z = Measurements::at(t);
        z.specific_force_mps2 = Some(Sample {
            t,
            value: [f, 0.0, 9.81],
        });
        z.angular_rate_radps = Some(Sample {
            t,
            value: [0.0, -pitch, 0.0],
        });
        if fresh != 0.0 {
            z.wheel_speed_mps[0] = Some(Sample { t, value: speed });
        }
        let e = pipeline.step(&z, &Command::default(), dt).unwrap();
        if k % 4 == 3 {
            let mut values = [0.0; 4];
            pipeline.internal_values(&mut values);
            let [gyro, _, accel, accel_sd] = values;
            let (grade, speed) = (e.grade_rad, e.speed_mps);
            let state = vec![grade.value, grade.sd, speed.value, speed.sd];
            let rest = [e.innovation, e.nis, gyro, accel, accel_sd];
            rows.push(state.into_iter().chain(rest).collect());
        }
    }
    assert_agrees("pipeline_baseline", &rows);
}

/// The published methods, errata corrected and nothing else, on the same drives (`tests/reference/published_*.py`).
mod published {
    use super::*;

    /// Mass, grade, speed, innovation.
    fn whole_row(e: &Estimate) -> Vec<f64> {
        let (mass, grade) = (e.total_mass_kg, e.grade_rad);
        let found = [mass.value, mass.sd, grade.value, grade.sd];
        let filter = [e.speed_mps.value, e.innovation, e.nis];
        [&found[..], &filter[..]].concat()
    }

    #[test]
    fn liu_2023() {
        const WHEEL_SPEED_SD: f64 = 0.005;
        let two_stages = &["lambda", "chi1", "chi2", "wheel_speed_sd_mps"][..];
        let joint = &["inverse_mass", "inverse_mass_sd"][..];
        let resistance = &["running_resistance", "running_resistance_sd", "lambda"][..];
        let mut rows = Vec::new();
        for (run, (name, key, internals, rest)) in [
            ("dffrls_aekf", "mass0_kg", two_stages, &[][..]),
            ("rls_ekf", "mass0_kg", two_stages, &[]),
            ("ffrls", "mass0_kg", two_stages, &[]),
            ("joint_ekf", "mass0_kg", joint, &[0.0, WHEEL_SPEED_SD]),
            (
                "resistance_dffrls",
                "known_mass_kg",
                resistance,
                &[WHEEL_SPEED_SD],
            ),
        ]
        .into_iter()
        .enumerate()
        {
            let named = (name, &[(key, 15e3)][..], internals);
            let run_rows = drive("published_liu_input.csv", &rail(), named, whole_row);
            rows.extend(number(run, run_rows).map(|row| [&row[..], rest].concat()));
        }
        assert_agrees("published_liu", &rows);
    }

    #[test]
    fn curvature_and_inclination() {
        let names = [
            "dffrls_aukf",
            "dffrls_ukf",
            "dffrls_aekf_inclination",
            "ffrls_aukf",
            "rls_mff_aukf",
        ];
        let internals = [
            "curvature_per_m",
            "curvature_sd_per_m",
            "lambda",
            "wheel_speed_sd_mps",
        ];
        let run = |name| {
            let named = (name, &[][..], &internals[..]);
            drive("published_inertial_input.csv", &rail(), named, |e| {
                whole_row(e).split_off(2)
            })
        };
        let rows: Vec<_> = names
            .into_iter()
            .enumerate()
            .flat_map(|(k, name)| number(k, run(name)))
            .collect();
        assert_agrees("published_inertial", &rows);
    }

    #[test]
    fn guo_2024() {
        let settings = [
            ("mass0_kg", 2230.0),
            ("q_i", 1e-4),
            ("force_sd_mps2", 0.1),
            ("accel_sd_mps2", 0.02),
            ("wheel_speed_sd_mps", 0.01),
        ];
        let mut rows = Vec::new();
        for (run, name) in [
            "imm_stf",
            "imm_stf_fixed",
            "imm_stf_no_lateral",
            "imm_ekf",
            "imm_ekf_fixed",
            "kinematic_stf",
            "dynamic_stf",
        ]
        .into_iter()
        .enumerate()
        {
            let alone = run >= 5;
            let internals = if alone {
                &["mass_residual_n", "fading"][..]
            } else {
                &[
                    "mass_residual_n",
                    "dynamic_fading",
                    "dynamic_model_probability",
                ][..]
            };
            let row = |e: &Estimate| {
                let mut row = whole_row(e);
                row.insert(5, e.speed_mps.sd);
                row
            };
            let named = (name, &settings[..], internals);
            let run_rows = drive("published_guo_input.csv", &road(), named, row);
            rows.extend(number(run, run_rows).map(|mut row| {
                if alone {
                    row.push(0.0);
                }
                row
            }));
        }
        assert_agrees("published_guo", &rows);
    }

    #[test]
    fn patent() {
        let settings = [
            ("mass0_kg", 2400.0),
            ("wheel_speed_sd_mps", 0.01),
            ("q_i", 1e-5),
            ("gamma", 4.0),
        ];
        let internals = [
            "straight_mass_kg",
            "turning_mass_kg",
            "straight_weight",
            "fading",
            "wheel_speed_sd_mps",
        ];
        let named = ("mmrls_sh_stf", &settings[..], &internals[..]);
        let rows = drive("published_patent_input.csv", &road(), named, whole_row);
        assert_agrees("published_patent", &rows);
    }
}
