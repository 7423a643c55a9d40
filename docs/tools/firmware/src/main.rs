//! A train of 8 drive units and 18 m runs a minute over a rail of changing grade; instructions per step are counted by the SysTick timer
//! (25 MHz), which under `qemu -icount shift=0` ticks once in 40 instructions.
#![no_std]
#![no_main]

use core::panic::PanicInfo;
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};

#[cfg(feature = "single")]
use estimators32 as estimators;
#[cfg(feature = "double")]
use estimators64 as estimators;

#[cfg(not(feature = "empty"))]
use estimators::{
    Command, Estimator, Measurements, Real, Sample, Time, Vehicle, VehicleData,
    api::real::{PI, cos, sin},
};

const INSTRUCTIONS_PER_TICK: u32 = 40;
const SYST_CSR: *mut u32 = 0xE000_E010 as *mut u32;
const SYST_RVR: *mut u32 = 0xE000_E014 as *mut u32;
const SYST_CVR: *mut u32 = 0xE000_E018 as *mut u32;
const FULL: u32 = 0x00FF_FFFF;

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    debug::exit(debug::EXIT_FAILURE);
    loop {}
}

#[cfg(not(feature = "empty"))]
fn ticks() -> u32 {
    // SAFETY: a register that is there on every Cortex-M.
    FULL - unsafe { SYST_CVR.read_volatile() }
}

#[cfg(feature = "empty")]
#[entry]
fn main() -> ! {
    // SAFETY: registers that are there on every Cortex-M.
    unsafe {
        SYST_RVR.write_volatile(FULL);
        SYST_CVR.write_volatile(0);
        SYST_CSR.write_volatile(5);
    }
    let _ = hprintln!("ram 0 stack 0 mean {} worst 0", INSTRUCTIONS_PER_TICK);
    debug::exit(debug::EXIT_SUCCESS);
    loop {}
}

#[cfg(not(feature = "empty"))]
fn vehicle() -> Option<Vehicle> {
    Vehicle::new(VehicleData {
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
    })
    .ok()
}

#[cfg(not(feature = "empty"))]
fn measurements(k: i64, dt: Real, place_m: &mut Real) -> Measurements {
    let t = Time::from_ns(k * 10_000_000);
    let phase = 0.4 * (k as Real) * dt;
    let (speed, acceleration) = (1.5 + sin(phase), 0.4 * cos(phase));
    *place_m += speed * dt;
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

#[cfg(feature = "named")]
fn estimator(vehicle: Vehicle) -> Option<impl Estimator> {
    estimators::registry::build("dffrls_aekf_robust", &vehicle, []).ok()
}

#[cfg(not(any(feature = "named", feature = "empty")))]
macro_rules! pipeline {
    ($($feature:literal: $($part:ident)::+;)*) => {
        $(
            #[cfg(feature = $feature)]
            fn estimator(vehicle: Vehicle) -> Option<impl Estimator> {
                use estimators::$($part)::+ as pipeline;
                let params = pipeline::Params::default();
                Some(estimators::Runner::new($feature, pipeline::new, &vehicle, &params))
            }
        )*
    };
}

#[cfg(not(any(feature = "named", feature = "empty")))]
pipeline! {
    "dffrls_aekf": methods::liu_2023::dffrls_aekf;
    "dffrls_aekf_robust": supervised::liu_2023::dffrls_aekf_robust;
    "dffrls_aukf_robust": supervised::huainan::dffrls_aukf_robust;
    "imm_stf_robust": supervised::guo_2024::imm_stf_robust;
    "mmrls_sh_stf_robust": supervised::patent::mmrls_sh_stf_robust;
}

/// Bytes below the stack pointer that are painted, to see how deep a step goes.
#[cfg(not(feature = "empty"))]
const PAINTED: usize = 128 * 1024;
#[cfg(not(feature = "empty"))]
const PAINT: u32 = 0xA5A5_5A5A;

#[cfg(not(feature = "empty"))]
#[inline(never)]
fn stack_words(paint: bool) -> usize {
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

#[cfg(not(feature = "empty"))]
#[inline(never)]
fn step(estimator: &mut dyn Estimator, z: &Measurements, dt: Real) -> bool {
    estimator.step(z, &Command::default(), dt).is_ok_and(|e| e.grade_rad.value.abs() < 1.0)
}

#[cfg(not(feature = "empty"))]
#[entry]
fn main() -> ! {
    // SAFETY: registers that are there on every Cortex-M.
    unsafe {
        SYST_RVR.write_volatile(FULL);
        SYST_CVR.write_volatile(0);
        SYST_CSR.write_volatile(5);
    }
    let run = || {
        let mut estimator = estimator(vehicle()?)?;
        let (mut sum, mut worst, mut place_m) = (0_u64, 0, 0.0);
        let (steps, dt) = (6_000_i64, 0.01);
        stack_words(true);
        for k in 1..=steps {
            let z = measurements(k, dt, &mut place_m);
            let before = ticks();
            let good = step(&mut estimator, &z, dt);
            let taken = ticks().wrapping_sub(before) & FULL;
            if !good {
                return None;
            }
            sum += u64::from(taken);
            worst = worst.max(taken);
        }
        let stack = stack_words(false);
        let mean = (sum / steps as u64) as u32 * INSTRUCTIONS_PER_TICK;
        let worst = worst * INSTRUCTIONS_PER_TICK;
        let ram = size_of_val(&estimator);
        let _ = hprintln!("ram {} stack {} mean {} worst {}", ram, stack, mean, worst);
        Some(())
    };
    debug::exit(if run().is_some() { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {}
}
