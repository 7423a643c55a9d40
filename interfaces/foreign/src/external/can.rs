//! Frames on a bus of SocketCAN. All messages but the commands need CAN FD.

use super::claim::Claim;
use super::link::Link;
use monorig_sim::closed_loop::registry::{BoxedEstimator, Refusal};
use monorig_wire::ecu::Ecu;
use monorig_wire::frame::Frame;
use monorig_wire::signal::Numbers;
use socketcan::{
    CanAnyFrame, CanDataFrame, CanFdFrame, CanFdSocket, EmbeddedFrame, ExtendedId, Frame as _, Id,
    Socket, StandardId,
};
use std::io::{self, ErrorKind};
use std::time::{Duration, Instant};

/// Time for frames to come before the step is sent again, and for the bus to take a frame.
const WAIT: Duration = Duration::from_millis(500);
const WRITE: Duration = Duration::from_secs(2);
/// Time before the next try while the queue of the interface is full.
const RETRY: Duration = Duration::from_micros(100);
/// The errors of Linux for a full queue of the interface, and for a frame that it cannot carry.
const NO_BUFFERS: i32 = 105;
const INVALID: i32 = 22;

/// A frame as SocketCAN has it; none if its identifier or its length is not one of a bus.
fn for_bus(frame: &Frame) -> Option<CanAnyFrame> {
    let id: Id = match frame.extended {
        true => ExtendedId::new(frame.id)?.into(),
        false => StandardId::new(frame.id.try_into().ok()?)?.into(),
    };
    Some(match frame.is_fd() {
        true => CanFdFrame::new(id, frame.data())?.into(),
        false => CanDataFrame::new(id, frame.data())?.into(),
    })
}

/// A frame with data from the bus.
fn from_bus(frame: &CanAnyFrame) -> Option<Frame> {
    let data = match frame {
        CanAnyFrame::Normal(frame) => frame.data(),
        CanAnyFrame::Fd(frame) => frame.data(),
        CanAnyFrame::Remote(_) | CanAnyFrame::Error(_) => return None,
    };
    Frame::with(frame.raw_id(), frame.is_extended(), data)
}

fn socket(interface: &str) -> Result<CanFdSocket, Refusal> {
    CanFdSocket::open(interface).map_err(|e| {
        let help = "use an active interface with CAN FD, for example after `ip link add vcan0 type vcan`, `ip \
                    link set vcan0 mtu 72 up`";
        Refusal::new(
            format!("the CAN bus `{interface}` cannot be opened: {e}"),
            help,
        )
    })
}

/// Sends a frame; waits for the queue of the interface to have room for it, as long as `patience`.
fn send(socket: &CanFdSocket, frame: &CanAnyFrame, patience: Duration) -> io::Result<()> {
    let begun = Instant::now();
    loop {
        match socket.write_frame(frame) {
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) if e.raw_os_error() == Some(NO_BUFFERS) || e.kind() == ErrorKind::WouldBlock => {
                if begun.elapsed() >= patience {
                    let why = "its queue is full: the bus is too slow, or needs `ip link set … txqueuelen 1000`";
                    return Err(io::Error::other(why));
                }
                std::thread::sleep(RETRY);
            }
            Err(e) if e.raw_os_error() == Some(INVALID) => {
                return Err(io::Error::other("the bus has no CAN FD (`mtu 72`)"));
            }
            sent => return sent,
        }
    }
}

/// Connection to an estimator on a bus.
struct Can {
    claim: Claim,
    socket: CanFdSocket,
    out: Vec<CanAnyFrame>,
    patience: Duration,
}

/// Opens the connection to the estimator on a bus.
pub(super) fn open(interface: &str) -> Result<Box<dyn Link>, Refusal> {
    let socket = socket(interface)?;
    let _ = socket.set_read_timeout(WAIT);
    Ok(Box::new(Can {
        claim: Claim::of(interface.to_owned())?,
        socket,
        out: Vec::new(),
        patience: WRITE,
    }))
}

impl Link for Can {
    fn at(&self) -> &str {
        self.claim.name()
    }

    fn begin(&mut self) {
        self.out.clear();
    }

    fn put(&mut self, frame: &Frame, _: i64) {
        self.out.extend(for_bus(frame));
    }

    fn send(&mut self) -> Result<(), String> {
        let mut frames = self.out.iter();
        let sent = frames.try_for_each(|frame| send(&self.socket, frame, self.patience));
        sent.map_err(|e| format!("cannot receive data: {e}"))
    }

    fn never_wait(&mut self) -> Result<(), String> {
        self.patience = Duration::ZERO;
        let set = self.socket.set_nonblocking(true);
        set.map_err(|e| format!("cannot be read: {e}"))
    }

    fn receive(&mut self, each: &mut dyn FnMut(&Frame)) -> Result<bool, String> {
        let mut came = false;
        loop {
            match self.socket.read_frame() {
                Ok(frame) => {
                    from_bus(&frame).iter().for_each(&mut *each);
                    came = true;
                    if !self.patience.is_zero() {
                        return Ok(came);
                    }
                }
                Err(e) => match e.kind() {
                    ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => {
                        return Ok(came);
                    }
                    _ => return Err(format!("cannot be read: {e}")),
                },
            }
        }
    }
}

/// Answers the frames on a bus, until the program ends.
pub fn serve_can(
    mut estimator: BoxedEstimator,
    numbers: Numbers,
    interface: &str,
) -> Result<(), Refusal> {
    let socket = socket(interface)?;
    let broken = |e: io::Error| {
        Refusal::new(
            format!("the CAN bus `{interface}`: {e}"),
            "check the bus or the address",
        )
    };
    let mut ecu = Ecu::new(numbers);
    loop {
        let came = match socket.read_frame() {
            Err(e) if e.kind() == ErrorKind::Interrupted => continue,
            came => came.map_err(broken)?,
        };
        let mut sent = Ok(());
        if let Some(frame) = from_bus(&came) {
            ecu.take(estimator.as_mut(), &frame, &mut |answer| {
                if let (Ok(()), Some(frame)) = (&sent, for_bus(answer)) {
                    sent = send(&socket, &frame, WRITE);
                }
            });
        }
        sent.map_err(broken)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames of both kinds and with identifiers of both lengths are the same behind SocketCAN; one that no bus has is
    /// none.
    #[test]
    fn a_frame_is_the_same_on_the_bus() {
        for (id, extended, bytes) in [
            (0x100, false, 8),
            (0x7FF, false, 0),
            (0x12, true, 3),
            (0x243, false, 16),
            (0x1FFF_FFFF, true, 64),
        ] {
            let data: Vec<u8> = (0..bytes).map(|k| 7 * k + 1).collect();
            let frame = Frame::with(id, extended, &data).unwrap();
            let there = for_bus(&frame).unwrap();
            assert_eq!(matches!(there, CanAnyFrame::Fd(_)), bytes > 8);
            assert_eq!(from_bus(&there), Some(frame));
        }
        assert!(for_bus(&Frame::new(0x800)).is_none());
    }
}
