//! The UART of the board: CMSDK APB, as on the mps2-an386.

const DATA: *mut u32 = 0x4000_4000 as *mut u32;
const STATE: *mut u32 = 0x4000_4004 as *mut u32;
const CONTROL: *mut u32 = 0x4000_4008 as *mut u32;
const DIVIDER: *mut u32 = 0x4000_4010 as *mut u32;
const FULL_TO_SEND: u32 = 1;
const FULL_OF_RECEIVED: u32 = 2;

/// The UART.
pub struct Bus;

impl Bus {
    /// Starts it: both directions, at the highest rate.
    pub fn start() -> Self {
        // SAFETY: registers of the board, which nothing else touches.
        unsafe {
            DIVIDER.write_volatile(16);
            CONTROL.write_volatile(3);
        }
        Self
    }

    /// Waits for a byte.
    pub fn receive(&mut self) -> u8 {
        // SAFETY: as above.
        unsafe {
            while STATE.read_volatile() & FULL_OF_RECEIVED == 0 {}
            DATA.read_volatile() as u8
        }
    }

    /// Sends what waits: nothing does.
    pub fn flush(&mut self) {}
}

impl Extend<u8> for Bus {
    fn extend<T: IntoIterator<Item = u8>>(&mut self, bytes: T) {
        for byte in bytes {
            // SAFETY: as above.
            unsafe {
                while STATE.read_volatile() & FULL_TO_SEND != 0 {}
                DATA.write_volatile(byte.into());
            }
        }
    }
}
