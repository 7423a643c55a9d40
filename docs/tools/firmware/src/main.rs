//! One estimator on a Cortex-M4F: what it takes of memory and time; without one, what the rest of the program takes.
#![no_std]
#![no_main]

#[cfg(estimator)]
mod drive;
#[cfg_attr(not(estimator), allow(dead_code))]
mod timer;

use core::panic::PanicInfo;
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    debug::exit(debug::EXIT_FAILURE);
    loop {}
}

#[cfg(not(estimator))]
mod drive {
    /// Nothing is run.
    pub fn run() -> Option<super::Taken> {
        Some(super::Taken::default())
    }
}

/// Holds the bytes of an estimator and of its stack, the instructions of a step, and how many steps it refused.
#[derive(Default)]
pub struct Taken {
    ram: usize,
    stack: usize,
    mean: u32,
    worst: u32,
    refused: u32,
}

#[entry]
fn main() -> ! {
    timer::start();
    // its value is not known when the program is built, with an estimator or without
    if let Some(Taken { ram, stack, mean, worst, refused }) = core::hint::black_box(drive::run()) {
        let _ = hprintln!("ram {} stack {} mean {} worst {} refused {}", ram, stack, mean, worst, refused);
        debug::exit(debug::EXIT_SUCCESS);
    }
    debug::exit(debug::EXIT_FAILURE);
    loop {}
}
