//! A train of 8 drive units and 18 m runs a minute over a rail of changing grade; what a step takes is counted.

#[cfg(feature = "single")]
use estimators32 as estimators;
#[cfg(feature = "double")]
use estimators64 as estimators;

use crate::{Taken, timer};
use estimators::{
    Command, Estimator, Measurements, Real, Sample, Time, Vehicle, VehicleData,
    api::real::{PI, cos, sin},
};

// the estimator for a vehicle
include!(concat!(env!("OUT_DIR"), "/estimator.rs"));

/// Steps of the minute, and their time, s.
const STEPS: i64 = 6_000;
const DT: Real = 0.01;
/// Bytes below the stack pointer that are painted, to see how deep a step goes.
const PAINTED: usize = 128 * 1024;
const PAINT: u32 = 0xA5A5_5A5A;

fn vehicle() -> Option<Vehicle> {
    let data = VehicleData {
        tare_kg: 9_000.0,
        drives: 8,
        wheel_radius_m: 0.17,
        gear_ratio: 19.0,
        efficiency: 0.95,
        rotating_mass_kg: 1_300.0,
        running_resistance: 0.02,
        mass_range_kg: [4_500.0, 40_000.0],
        tare_span_m: [-2.0, 16.0],
        load_span_m: [5.0, 11.0],
        ..VehicleData::default()
    };
    Vehicle::new(data).ok()
}

fn measurements(k: i64, place_m: &mut Real) -> Measurements {
    let t = Time::from_ns(k * 10_000_000);
    let phase = 0.4 * (k as Real) * DT;
    let (speed, acceleration) = (1.5 + sin(phase), 0.4 * cos(phase));
    *place_m += speed * DT;
    let theta = 0.1 * sin(2.0 * PI * *place_m / 60.0);
    let force_n = 15_000.0 * (acceleration + 9.81 * (sin(theta) + 0.02 * cos(theta)))
        + 1_300.0 * acceleration;
    let loss = if force_n > 0.0 { 0.95 } else { 1.0 / 0.95 };
    let torque = force_n * 0.17 / (19.0 * loss * 8.0);
    let mut z = Measurements::at(t);
    for (wheel, motor) in z.wheel_speed_mps.iter_mut().zip(&mut z.motor_torque_nm).take(8) {
        *wheel = Some(Sample { t, value: speed });
        *motor = Some(Sample { t, value: torque });
    }
    let value = [acceleration + 9.81 * sin(theta), 0.0, 9.81 * cos(theta)];
    z.specific_force_mps2 = Some(Sample { t, value });
    z.angular_rate_radps = Some(Sample { t, value: [0.0; 3] });
    z
}

/// Paints the stack below, or tells how many bytes of it are painted no more.
#[inline(never)]
fn stack_bytes(paint: bool) -> usize {
    let here = 0_u32;
    let top = (&raw const here as usize - 256) & !3;
    let bottom = top - PAINTED;
    let mut deep = bottom;
    // SAFETY: this much RAM below the stack pointer is free: 4 MB, and the program has no heap.
    unsafe {
        if paint {
            for word in (bottom..top).step_by(4) {
                (word as *mut u32).write_volatile(PAINT);
            }
        } else {
            while deep < top && (deep as *const u32).read_volatile() == PAINT {
                deep += 4;
            }
        }
    }
    top - deep
}

#[inline(never)]
fn step(estimator: &mut dyn Estimator, z: &Measurements) -> bool {
    estimator.step(z, &Command::default(), DT).is_ok()
}

/// Runs the minute; none if there is no estimator for the vehicle.
pub fn run() -> Option<Taken> {
    let mut estimator = estimator(vehicle()?)?;
    let (mut sum, mut worst, mut refused, mut place_m) = (0_u64, 0, 0, 0.0);
    stack_bytes(true);
    for k in 1..=STEPS {
        let z = measurements(k, &mut place_m);
        let before = timer::ticks();
        let made = step(&mut estimator, &z);
        let taken = timer::since(before);
        refused += u32::from(!made);
        sum += u64::from(taken);
        worst = worst.max(taken);
    }
    Some(Taken {
        ram: size_of_val(&estimator),
        stack: stack_bytes(false),
        mean: (sum / STEPS as u64) as u32 * timer::INSTRUCTIONS_PER_TICK,
        worst: worst * timer::INSTRUCTIONS_PER_TICK,
        refused,
    })
}
