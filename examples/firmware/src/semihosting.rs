//! Standard input and output of the machine that a debugger or QEMU runs on: many bytes at a time, where QEMU's UART
//! takes some 50 µs for each.

use core::arch::asm;

const OPEN: u32 = 0x01;
const WRITE: u32 = 0x05;
const READ: u32 = 0x06;
const EXIT: u32 = 0x18;
const FOR_READING: u32 = 0;
const FOR_WRITING: u32 = 4;
const DONE: u32 = 0x2_0026;
/// Bytes that are taken and sent at a time.
const BYTES: usize = 8192;

/// A call to the debugger: its number, and where its arguments are.
fn call(what: u32, with: u32) -> u32 {
    let answer;
    // SAFETY: the call of semihosting; the arguments live until it is over.
    unsafe { asm!("bkpt #0xAB", inlateout("r0") what => answer, in("r1") with) };
    answer
}

fn open(mode: u32) -> u32 {
    let name = b":tt\0";
    let with = [name.as_ptr() as u32, mode, 3];
    call(OPEN, with.as_ptr() as u32)
}

/// The two streams.
pub struct Bus {
    from: u32,
    to: u32,
    received: [u8; BYTES],
    /// Bytes that were received, and those of them that were given away.
    length: usize,
    given: usize,
    sent: [u8; BYTES],
    waiting: usize,
}

impl Bus {
    /// Opens them.
    pub fn start() -> Self {
        Self {
            from: open(FOR_READING),
            to: open(FOR_WRITING),
            received: [0; BYTES],
            length: 0,
            given: 0,
            sent: [0; BYTES],
            waiting: 0,
        }
    }

    /// Waits for a byte. The end of the input ends the program.
    pub fn receive(&mut self) -> u8 {
        while self.given == self.length {
            let with = [self.from, self.received.as_mut_ptr() as u32, BYTES as u32];
            // the bytes for which there was room and that did not come
            let missing = call(READ, with.as_ptr() as u32) as usize;
            (self.given, self.length) = (0, BYTES.saturating_sub(missing));
            if self.length == 0 {
                call(EXIT, DONE);
            }
        }
        let byte = self.received.get(self.given).copied().unwrap_or_default();
        self.given += 1;
        byte
    }

    /// Sends what waits.
    pub fn flush(&mut self) {
        let with = [self.to, self.sent.as_ptr() as u32, self.waiting as u32];
        call(WRITE, with.as_ptr() as u32);
        self.waiting = 0;
    }
}

impl Extend<u8> for Bus {
    fn extend<T: IntoIterator<Item = u8>>(&mut self, bytes: T) {
        for byte in bytes {
            if self.waiting == BYTES {
                self.flush();
            }
            if let Some(place) = self.sent.get_mut(self.waiting) {
                *place = byte;
                self.waiting += 1;
            }
        }
    }
}
