//! An estimator on a Cortex-M4F: lines of candump in, the answers out, by its UART or by semihosting. The estimator and
//! the vehicle are chosen when it is built.
#![no_std]
#![no_main]

#[cfg_attr(feature = "semihosting", path = "semihosting.rs")]
#[cfg_attr(not(feature = "semihosting"), path = "uart.rs")]
mod bus;
mod kept;
#[cfg(feature = "f32")]
mod single;

use bus::Bus;
use core::panic::PanicInfo;
use cortex_m_rt::entry;
use kept::Kept;
#[allow(unused_imports)] // a vehicle without a layout of its masses
use monorig_estimators::api::mass_layout::MassLayout;
use monorig_estimators::{Estimator, Vehicle, VehicleData};
use monorig_wire::candump;
use monorig_wire::ecu::Ecu;
use monorig_wire::signal::Numbers;

/// The estimator.
const NAME: &str = match option_env!("MONORIG_ESTIMATOR") {
    Some(name) => name,
    None => "rail_fusion",
};
/// Numbers of the signals.
const NUMBERS: Numbers = match option_env!("MONORIG_SIGNALS") {
    Some(_) => Numbers::Float,
    None => Numbers::Fixed,
};
/// Steps between two snapshots.
const STEPS: u32 = 20;
/// Identifier of a frame without data that resets the controller, as a brown-out does.
const RESET: u32 = 0x7FF;
const AIRCR: *mut u32 = 0xE000_ED0C as *mut u32;
const SYSRESETREQ: u32 = 0x05FA_0004;

/// The vehicle that the estimator is for.
fn vehicle() -> Option<Vehicle> {
    let data = include!(concat!(env!("OUT_DIR"), "/vehicle.rs"));
    Vehicle::new(data).ok()
}

/// The estimator for the vehicle; none if there is no such estimator, or if it is not made for the vehicle.
#[cfg(not(feature = "f32"))]
fn estimator(vehicle: Vehicle) -> Option<impl Estimator> {
    monorig_estimators::registry::build(NAME, &vehicle, []).ok()
}

/// The same in single precision.
#[cfg(feature = "f32")]
fn estimator(vehicle: Vehicle) -> Option<impl Estimator> {
    let vehicle = single::vehicle(&vehicle)?;
    let built = monorig_estimators_f32::registry::build(NAME, &vehicle, []);
    built.ok().map(single::Single)
}

/// Starts the controller anew.
fn reset() -> ! {
    // SAFETY: a register that is there on every Cortex-M.
    unsafe { AIRCR.write_volatile(SYSRESETREQ) };
    loop {}
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    reset()
}

#[entry]
fn main() -> ! {
    let mut bus = Bus::start();
    let Some(mut estimator) = vehicle().and_then(estimator) else {
        loop {}
    };
    let mut kept = Kept::restore(&mut estimator);
    let mut ecu = Ecu::new(NUMBERS);
    let (mut line, mut length, mut steps) = ([0_u8; candump::MAX_LINE], 0, 0);
    loop {
        let byte = bus.receive();
        if byte != b'\n' {
            // a line that is too long is none, and is passed over as a whole
            if let Some(place) = line.get_mut(length) {
                *place = byte;
            }
            length += 1;
            continue;
        }
        let read = line.get(..length).and_then(candump::read);
        length = 0;
        let Some(frame) = read.and_then(|read| read.frame) else {
            continue;
        };
        if frame.id == RESET {
            reset();
        }
        let mut answered = false;
        ecu.take(&mut estimator, &frame, &mut |f| {
            candump::write(f, 0, &mut bus);
            answered = true;
        });
        if answered {
            bus.flush();
            steps += 1;
            if steps % STEPS == 0 {
                kept.keep(&estimator);
            }
        }
    }
}
