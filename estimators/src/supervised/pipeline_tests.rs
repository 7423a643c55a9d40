//! Tests of [`super`]: the samples that a method gets, and what its grade is worth.

use super::*;
use crate::Error;
use crate::api::estimator::Estimator;
use crate::api::signals::{Command, Measurements, Sample, VehicleData};
use crate::preprocess::front_end::FrontEnd;
use crate::testing::Random;
use crate::testing::vehicles::{Row, World, smooth, vehicle, world};
use std::vec::Vec;

/// A method that finds nothing and keeps its last sample.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Recorder {
    mass_kg: Real,
    grade: Value,
    last: Option<BalanceSample>,
    taken: usize,
    pauses: usize,
}

impl State for Recorder {
    fn visit(&mut self, _: &mut Archive) {}
}

impl SupervisedMethod for Recorder {
    const INTERNALS: &'static [Internal] = &[];

    fn sample(&mut self, sample: &BalanceSample) -> AidStatus {
        self.last = Some(*sample);
        self.taken += 1;
        control::fused(Some((0.0, 1.0)))
    }

    fn pause(&mut self) {
        self.pauses += 1;
    }

    fn step(&mut self, _: &Step) {}

    fn mass_kg(&self) -> Value {
        Value::new(self.mass_kg, 0.0, true)
    }

    fn effective_grade_rad(&self) -> Value {
        self.grade
    }

    fn is_excited(&self) -> bool {
        false
    }

    fn is_saturated(&self) -> bool {
        false
    }

    fn internal_values(&self, _: &mut [Real]) {}
}

/// A sample as the recorder got it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Noted {
    /// Instant, s.
    t: Real,
    /// Distance of its signals behind the train, m.
    late_m: Real,
    /// Doubt of what the instruments had read, m/s².
    read_mps2: Real,
    sample: BalanceSample,
}

impl Noted {
    /// Doubt of rail that was not read, under tare and load, m/s².
    fn unread_mps2(&self) -> [Real; 2] {
        self.sample.doubt_mps2.map(|doubt| doubt - self.read_mps2)
    }
}

/// The core around the recorder, with what the recorder got in each step.
struct Driven {
    signals: FrontEnd,
    core: Supervised<Recorder>,
    samples: Vec<Noted>,
}

impl Driven {
    fn new(vehicle: &Vehicle, supervision: Supervision, grade: Value) -> Self {
        let params = CoreParams {
            attitude: AttitudeParams::default(),
            attitude_supervision: AttitudeSupervision::default(),
            supervision,
            integrity: Integrity::default(),
            conditioning: ConditioningParams::default(),
        };
        let recorder = Recorder {
            mass_kg: 15_000.0,
            grade,
            last: None,
            taken: 0,
            pauses: 0,
        };
        Self {
            signals: FrontEnd::new(vehicle),
            core: Supervised::new(vehicle, &params, [1.0, 2.0, 1.5], recorder),
            samples: Vec::new(),
        }
    }
}

impl Estimator for Driven {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        let reading = self.signals.read(z, u, dt)?;
        let before = self.core.method.taken;
        let estimate = self.core.advance(&reading, z.t, dt);
        if self.core.method.taken > before {
            self.samples.push(Noted {
                t: z.t.s() as Real,
                late_m: self.core.late_m,
                read_mps2: 9.81 * self.core.source.read_sd(),
                sample: self.core.method.last.unwrap(),
            });
        }
        Ok(estimate)
    }

    fn reset(&mut self) {}
}

/// A train whose unit with the IMU has `ahead_m` of it before it and 18 m in all.
fn long(ahead_m: Real) -> Vehicle {
    Vehicle::new(VehicleData {
        tare_span_m: [-ahead_m, 18.0 - ahead_m],
        load_span_m: [5.0 - ahead_m, 13.0 - ahead_m],
        ..vehicle().data()
    })
    .unwrap()
}

/// A start, then onto a ramp, where the train of this vehicle stands as the vehicle says.
fn onto_a_ramp(vehicle: &Vehicle) -> World {
    World {
        tare_span_m: vehicle.tare_span_m,
        load_span_m: vehicle.load_span_m,
        grade: |s| 8f64.to_radians() * smooth((s - 25.0) / 8.0),
        disturbance: 0.0,
        seconds: 60.0,
        ..world(1)
    }
}

fn drive(vehicle: &Vehicle, supervision: Supervision) -> (World, Vec<Row>, Driven) {
    let mut driven = Driven::new(vehicle, supervision, Value::default());
    let world = onto_a_ramp(vehicle);
    let rows = world.run(&mut driven);
    (world, rows, driven)
}

/// Sines of the mean grades under tare, load and whole train with its unit at a chainage.
fn truth(world: &World, at_m: Real) -> [Real; 3] {
    let tare = vehicle().tare_kg;
    [tare, 1e9, world.mass_kg].map(|mass_kg| world.effective_grade(at_m, mass_kg).sin())
}

/// Chainage of the unit at an instant.
fn place_at(rows: &[Row], t: Real) -> Real {
    rows.iter().find(|row| row.t >= t).unwrap().s
}

/// On an edge of the ramp the grade at the instrument is 8° from that under the tail.
#[test]
fn a_sample_holds_the_mean_grades_under_the_masses() {
    let vehicle = long(0.0);
    let (world, rows, driven) = drive(&vehicle, Supervision::default());
    let mut most: Real = 0.0;
    for noted in driven.samples.iter().filter(|noted| noted.t > 24.0) {
        let Noted {
            t, late_m, sample, ..
        } = *noted;
        let place = place_at(&rows, t) - late_m;
        let [tare, load, whole] = truth(&world, place);
        let [found_tare, found_load] = sample.u_mps2.map(|u| u / 9.81);
        let [found, _] = sample.whole(vehicle.tare_kg, world.mass_kg);
        for (found, expected) in [
            (found_tare, tare),
            (found_load, load),
            (found / 9.81, whole),
        ] {
            assert!((found - expected).abs() < 3e-3, "{t}: {found} {expected}");
        }
        let unread = noted.unread_mps2();
        assert!(unread.iter().all(|sd| *sd < 0.01), "{t}: {unread:?}");
        // The signals are those of the same place.
        assert!((0.1..1.0).contains(&late_m), "{late_m}");
        assert!((sample.sample.period_s - 0.5).abs() < 0.011);
        most = most.max((tare - (world.grade)(place).sin()).abs());
    }
    assert!(driven.samples.len() > 100 && most > 0.06);
}

/// Rail that a train has not read since it was switched on makes a sample doubtful.
#[test]
fn at_the_start_the_rail_under_the_tail_is_doubtful() {
    let (_, _, driven) = drive(&long(0.0), Supervision::default());
    let doubt = |from: Real| {
        let noted = driven.samples.iter().find(|noted| noted.t > from);
        noted.unwrap().unread_mps2()
    };
    let [tare, load] = doubt(0.0);
    // The middles of both are 9 m behind the unit.
    assert!(
        tare > 0.02 && (load / tare - 1.0).abs() < 0.1,
        "{tare} {load}"
    );
    let [tare, load] = doubt(24.0);
    assert!(tare < 0.01 && load < 0.01);
}

#[test]
fn a_point_is_a_point_and_without_rail_memory_so_is_a_long_train() {
    let off = Supervision {
        rail_memory: false,
        ..Supervision::default()
    };
    let point = long(0.0).as_point();
    let (_, _, driven) = drive(&point, Supervision::default());
    for noted in &driven.samples {
        let [tare, load] = noted.sample.u_mps2;
        assert!((tare - load).abs() < 1e-9, "{noted:?}");
        let unread = noted.unread_mps2();
        assert!(unread.iter().all(|sd| *sd < 0.02), "{noted:?}");
    }
    let mut told_long = Driven::new(&long(0.0), off, Value::default());
    onto_a_ramp(&point).run(&mut told_long);
    assert_eq!(told_long.samples, driven.samples);
}

/// Samples wait until the unit has run over the rail under the masses before it.
#[test]
fn a_sample_waits_for_the_rail_ahead_of_it() {
    let ahead_m = 5.0;
    let vehicle = long(ahead_m);
    let (world, rows, driven) = drive(&vehicle, Supervision::default());
    let late: Vec<_> = driven
        .samples
        .iter()
        .filter(|noted| noted.t > 25.0)
        .collect();
    assert!(late.len() > 60);
    for noted in late {
        let Noted { t, sample, .. } = *noted;
        // The unit is 5 m on and up to a node of the memory.
        let [tare, load, _] = truth(&world, place_at(&rows, t) - ahead_m - 0.1);
        let [found_tare, found_load] = sample.u_mps2.map(|u| u / 9.81);
        assert!((found_tare - tare).abs() < 6e-3, "{t}: {found_tare} {tare}");
        assert!((found_load - load).abs() < 1e-2, "{t}: {found_load} {load}");
        let unread = noted.unread_mps2();
        assert!(unread.iter().all(|sd| *sd < 0.05), "{t}: {unread:?}");
    }
    assert!(driven.samples.iter().all(|noted| noted.t > ahead_m));
}

/// A train that stops will not read the rail ahead: what has waited is worked off with its doubt.
#[test]
fn a_train_that_stands_interrupts_the_balance() {
    let vehicle = long(5.0);
    let mut driven = Driven::new(&vehicle, Supervision::default(), Value::default());
    let world = World {
        speed: |t| if t < 20.0 { 1.0 } else { 0.0 },
        grade: |_| 0.0,
        ..onto_a_ramp(&vehicle)
    };
    world.run(&mut driven);
    assert!(driven.core.waiting.first().is_none());
    assert!(driven.core.method.pauses > 20);
    assert!(driven.samples.iter().all(|noted| noted.t < 27.0));
}

/// Masses on rail of a constant gradient, in the middle of which they weigh.
#[test]
fn the_sums_of_a_sample_weigh_tare_and_load() {
    use crate::api::mass_layout::MassLayout;
    use crate::rail::rail_memory::RailMemory;
    let train = TrainOnRail::new(&MassLayout::even(5_000.0, [0.0, 18.0], [5.0, 9.0]), false);
    let mut rail = RailMemory::new(18.0);
    for k in 0..4_000 {
        rail.step(0.01, Some([0.0001 * k as Real, 0.0]));
    }
    let means = train.at(&rail, rail.here());
    let new = |read_sd| BalanceSample::new(ResampledSample::default(), &means, 5_000.0, read_sd);
    let sample = new(0.0);
    let end = 0.4;
    let [tare, load] = sample.u_mps2.map(|u| u / 9.81);
    assert!((tare - (end - 0.09)).abs() < 1e-3, "{tare}");
    assert!((load - (end - 0.07)).abs() < 1e-3, "{load}");
    let [whole, doubt] = sample.whole(5_000.0, 15_000.0);
    assert!((whole / 9.81 - (end - 0.09 / 3.0 - 0.07 * 2.0 / 3.0)).abs() < 1e-3);
    assert!(doubt < 0.01);
    // Rail that was read badly is doubtful.
    let [_, worse] = new(0.01).whole(5_000.0, 15_000.0);
    assert!((worse - doubt - 0.0981).abs() < 1e-9);
    let [empty, _] = sample.whole(5_000.0, 5_000.0);
    assert!((empty / 9.81 - tare).abs() < 1e-12);
}

fn value(value: Real, sd: Real) -> Value {
    Value::new(value, sd, true)
}

/// Effective grade by [`MethodTrust::weigh`] alone.
fn weighed(trust: &mut MethodTrust, core: Value, method: Value, dt: Real) -> Value {
    let [effective, _] = trust.weigh([core, core], 0.0, method, dt);
    effective
}

#[test]
fn a_method_that_is_right_and_surer_takes_over() {
    let mut trust = MethodTrust::default();
    for _ in 0..6_000 {
        weighed(&mut trust, value(0.1, 0.001), value(0.101, 0.002), 0.01);
    }
    let found = weighed(&mut trust, value(0.0, 0.1), value(0.1, 0.002), 0.01);
    assert!((found.value - 0.1).abs() < 1e-3, "{found:?}");
    assert!(found.sd < 0.003, "{found:?}");
}

/// By a degree and more while the core knew, so as much now.
#[test]
fn a_method_that_was_off_is_believed_as_far_as_it_was_right() {
    let mut trust = MethodTrust::default();
    for _ in 0..6_000 {
        weighed(&mut trust, value(0.0, 0.001), value(0.05, 0.002), 0.01);
    }
    let (core, method) = (value(0.0, 0.02), value(0.05, 0.002));
    let found = weighed(&mut trust, core, method, 0.01);
    assert!(found.value < 0.2 * 0.05, "{found:?}");
    assert!(found.sd > 0.019, "{found:?}");
    // A core that knows nothing takes it with the error that it had.
    let found = weighed(&mut trust, value(0.0, 1.0), method, 0.01);
    assert!(found.value > 0.9 * 0.05, "{found:?}");
    assert!((0.04..0.06).contains(&found.sd), "{found:?}");
    // It is forgotten over some time constants of 20 s.
    for _ in 0..20_000 {
        weighed(&mut trust, value(0.0, 0.001), value(0.0, 0.002), 0.01);
    }
    let found = weighed(&mut trust, value(0.0, 0.1), value(0.05, 0.002), 0.01);
    assert!(found.value > 0.99 * 0.05, "{found:?}");
}

/// A core that does not know the grade itself is no judge.
#[test]
fn a_core_that_is_not_sure_judges_nobody() {
    let mut trust = MethodTrust::default();
    for _ in 0..6_000 {
        weighed(&mut trust, value(0.0, 0.02), value(0.3, 0.002), 0.01);
    }
    assert_eq!(trust, MethodTrust::default());
}

#[test]
fn the_weighed_standard_deviation_is_never_below_that_of_independent_errors() {
    let mut random = Random::new(51);
    for _ in 0..10_000 {
        let mut trust = MethodTrust {
            square: 100.0 * random.uniform() * random.uniform(),
        };
        let [a, b] = [0; 2].map(|_| (-8.0 * random.uniform()).exp());
        let core = value(0.1 * random.normal(), a);
        let method = value(0.1 * random.normal(), b);
        let found = weighed(&mut trust, core, method, 0.0);
        let method_sd = b * trust.square.max(1.0).sqrt();
        let independent = 1.0 / (1.0 / (a * a) + 1.0 / (method_sd * method_sd));
        assert!(found.sd * found.sd >= 0.999_999 * independent);
        assert!(found.sd <= 1.000_001 * a.max(method_sd));
        // Between the two.
        let [low, high] = [core.value.min(method.value), core.value.max(method.value)];
        assert!((low - 1e-12..=high + 1e-12).contains(&found.value));
    }
}

#[test]
fn equal_means_stay_and_a_method_without_a_grade_changes_nothing() {
    let mut trust = MethodTrust::default();
    let core = value(0.07, 0.01);
    assert_eq!(
        weighed(&mut trust, core, value(0.07, 0.02), 0.01).value,
        0.07
    );
    let none = Value {
        valid: false,
        ..value(0.5, 0.001)
    };
    assert_eq!(weighed(&mut trust, core, none, 0.01), core);
}

/// The grade at the IMU moves by what its error has in common with that of the effective grade.
#[test]
fn the_grade_at_the_imu_moves_by_the_common_part_of_the_error() {
    let (core, at_imu, method) = (value(0.0, 0.1), value(0.2, 0.1), value(0.05, 0.001));
    let moved = |common_sd: Real| {
        let [_, imu] = MethodTrust::default().weigh([core, at_imu], common_sd, method, 0.01);
        imu
    };
    assert_eq!(moved(0.0), at_imu);
    let all = moved(0.1);
    assert!((all.value - 0.25).abs() < 1e-4 && all.sd < 2e-3, "{all:?}");
    let half = moved(0.1 / Real::sqrt(2.0));
    assert!((half.value - 0.225).abs() < 1e-4, "{half:?}");
}

/// On a ramp that nothing but the method has seen the grade is the method's.
#[test]
fn without_the_imu_the_grade_is_that_of_the_method() {
    for (on, expected) in [(true, 0.1), (false, 0.0)] {
        let supervision = Supervision {
            method_grade: on,
            ..Supervision::default()
        };
        let mut driven = Driven::new(&vehicle(), supervision, value(0.0, 0.004));
        let level = World {
            grade: |_| 0.0,
            seconds: 20.0,
            ..onto_a_ramp(&vehicle())
        };
        level.run(&mut driven);
        // The method goes on with its sd, the core without its IMU.
        driven.core.method.grade.value = 0.1;
        let (mut last, mut random) = (Estimate::default(), Random::new(52));
        for k in 1..=4_000 {
            let t = Time::from_s(20.0 + 0.01 * k as Real);
            let mut z = Measurements::at(t);
            for wheel in z.wheel_speed_mps.iter_mut().take(8) {
                let value = 1.0 + 0.005 * random.normal();
                *wheel = Some(Sample { t, value });
            }
            last = driven.step(&z, &Command::default(), 0.01).unwrap();
        }
        let found = last.effective_grade_rad;
        assert!((found.value - expected).abs() < 0.02, "{on}: {found:?}");
        assert_eq!(found.sd < 0.02, on, "{on}: {found:?}");
    }
}
