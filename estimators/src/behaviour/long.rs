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
    /// Largest of the mass from the end of the first ramp on, as a share of it.
    mass: Real,
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
    let (mut mass, mut grade, mut effective, mut ahead) = (0.0, 0.0, 0.0, 0.0);
    for seed in 1..=SEEDS {
        let mut estimator = build(name, &vehicle, settings.iter().copied()).unwrap();
        let rows = long(seed).run(&mut estimator);
        let rms = |error: &dyn Fn(&Row) -> Real| {
            let late = rows.iter().filter(|row| row.t > 8.0);
            let errors: Vec<Real> = late.map(|row| error(row).to_degrees()).collect();
            crate::testing::rms(&errors) / SEEDS as Real
        };
        mass += mass_error(&rows, 50.0) / SEEDS as Real;
        grade += rms(&|row| row.estimate.grade_rad.value - row.theta);
        effective += rms(&|row| row.estimate.effective_grade_rad.value - row.effective);
        ahead += rms(&|row| {
            let [imu, whole] = [row.estimate.grade_rad, row.estimate.effective_grade_rad];
            imu.value.sin() - whole.value.sin() - (row.theta.sin() - row.effective.sin())
        });
    }
    std::println!(
        "{name}, told {told}: mass {:.2} %, grade {grade:.3}°, effective {effective:.3}°, ahead {ahead:.3}°",
        100.0 * mass
    );
    Errors {
        mass,
        grade,
        effective,
        ahead,
    }
}

/// The pipelines of the published methods.
const METHODS: &[&str] = &[
    "dffrls_aekf_robust",
    "dffrls_aukf_robust",
    "imm_stf_robust",
    "mmrls_sh_stf_robust",
];

#[test]
fn with_its_length_every_pipeline_finds_the_offset_of_the_grade_at_the_imu() {
    let mass0 = [("mass0_kg", 15_000.0.into())];
    for name in METHODS {
        let knows_mass = keys(name).unwrap().any(|key| key.name == "mass0_kg");
        let settings: &[_] = if knows_mass { &mass0 } else { &[] };
        let (long, point) = (errors(name, settings, true), errors(name, settings, false));
        assert!(long.ahead < 0.5 && point.ahead > 1.5, "{name}");
        let total = |e: &Errors| e.grade.hypot(e.effective);
        assert!(total(&long) < 0.6 * total(&point), "{name}");
    }
}

#[test]
fn with_its_length_the_patent_finds_the_mass_and_as_a_point_it_does_not() {
    let settings = [("mass0_kg", 12_000.0.into())];
    let long = errors("mmrls_sh_stf_robust", &settings, true);
    let point = errors("mmrls_sh_stf_robust", &settings, false);
    assert!(long.mass < 0.02 && point.mass > 0.05);
}

/// The first ramp begins at 20 m, which the instrument reaches after some 23 s.
#[test]
fn without_its_accelerometer_a_long_train_has_no_valid_grade_at_the_imu() {
    let vehicle = Vehicle::new(VehicleData {
        tare_span_m: TARE_SPAN_M,
        load_span_m: LOAD_SPAN_M,
        ..vehicle().data()
    })
    .unwrap();
    for name in ["dffrls_aekf_robust", "mmrls_sh_stf_robust"] {
        let tamper = |z: &mut Measurements, _: &mut Command| {
            if (62.0..72.0).contains(&z.t.s()) {
                z.specific_force_mps2 = None;
            }
        };
        let mut unread: Real = 0.0;
        for seed in 1..=4 {
            let estimator = build(name, &vehicle, [("mass0_kg", 15_000.0.into())]).unwrap();
            let rows = long(seed).run(&mut Tampered { estimator, tamper });
            for row in rows.iter().filter(|row| row.t > 62.0) {
                let [grade, whole] = [row.estimate.grade_rad, row.estimate.effective_grade_rad];
                let lead = grade.value.sin() - whole.value.sin();
                let of_lead = (lead - (row.theta.sin() - row.effective.sin())).abs();
                unread = unread.max(of_lead);
                assert!(
                    !grade.valid || of_lead < 2.0 * grade.sd + 0.01,
                    "{name} at {} s: {of_lead} rad, sd {}",
                    row.t,
                    grade.sd
                );
            }
        }
        std::println!("{name}: up to {:.1}° off", unread.to_degrees());
        assert!(
            unread > 0.06,
            "{name}: the ramp is not met without the accelerometer"
        );
    }
}

/// The memory of the rail is not much longer than the train: back at the foot of the ramp it has forgotten it, and the
/// instrument is at the tail.
#[test]
fn driving_back_over_forgotten_rail_the_grade_at_the_tail_is_known() {
    let vehicle = Vehicle::new(VehicleData {
        tare_span_m: TARE_SPAN_M,
        load_span_m: LOAD_SPAN_M,
        ..vehicle().data()
    })
    .unwrap();
    for name in ["dffrls_aekf_robust", "mmrls_sh_stf_robust"] {
        for seed in 1..=2 {
            // All of the way back counts, the reversal too, where innovations are large.
            let settings = [("mass0_kg", 15_000.0.into()), ("nis_monitor", false.into())];
            let mut estimator = build(name, &vehicle, settings).unwrap();
            let world = World {
                grade: |s| 8f64.to_radians() * smooth((s - 20.0) / 8.0),
                speed: |t| (0.25 * (t - 1.0)).clamp(0.0, 1.0) - (0.25 * (t - 90.0)).clamp(0.0, 1.9),
                seconds: 175.0,
                ..long(seed)
            };
            let rows = world.run(&mut estimator);
            let back = rows.iter().filter(|row| row.t > 100.0);
            let mut worst: Real = 0.0;
            let (mut most, mut valid) = (0.0 as Real, 0);
            for row in back.filter(|row| row.estimate.grade_rad.valid) {
                let [grade, whole] = [row.estimate.grade_rad, row.estimate.effective_grade_rad];
                let lead = row.theta.sin() - row.effective.sin();
                worst = worst.max((grade.value.sin() - whole.value.sin() - lead).abs());
                most = most.max(lead.abs());
                valid += 1;
            }
            std::println!("{name}: lead up to {most}, {worst} off, {valid} valid");
            assert!(most > 0.08 && valid > 10_000, "{name}: {most} {valid}");
            assert!(worst < 0.02, "{name}: {worst}");
        }
    }
}
