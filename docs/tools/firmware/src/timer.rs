//! Instructions, counted by the SysTick timer (25 MHz), which under `qemu -icount shift=0` ticks once in 40 of them.

/// Instructions between two ticks.
pub const INSTRUCTIONS_PER_TICK: u32 = 40;
const SYST_CSR: *mut u32 = 0xE000_E010 as *mut u32;
const SYST_RVR: *mut u32 = 0xE000_E014 as *mut u32;
const SYST_CVR: *mut u32 = 0xE000_E018 as *mut u32;
const FULL: u32 = 0x00FF_FFFF;

/// Starts the timer.
pub fn start() {
    // SAFETY: registers that are there on every Cortex-M.
    unsafe {
        SYST_RVR.write_volatile(FULL);
        SYST_CVR.write_volatile(0);
        SYST_CSR.write_volatile(5);
    }
}

/// Ticks up to now.
pub fn ticks() -> u32 {
    // SAFETY: as above.
    FULL - unsafe { SYST_CVR.read_volatile() }
}

/// Ticks since then.
pub fn since(before: u32) -> u32 {
    ticks().wrapping_sub(before) & FULL
}
