//! Datagrams of cannelloni.

use super::claim::Claim;
use super::link::Link;
use monorig_sim::closed_loop::registry::Refusal;
use monorig_wire::cannelloni;
use monorig_wire::frame::Frame;
use std::io::ErrorKind;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::time::Duration;

/// Time for frames to come before the step is sent again; where nobody listens, time before the next try.
const WAIT: Duration = Duration::from_millis(500);
const RETRY: Duration = Duration::from_millis(20);
/// Bytes of a datagram with which no further frame is begun: one of Ethernet has 1472.
const FULL: usize = 1400;
/// Most bytes of a datagram that comes.
const MAX_DATAGRAM: usize = 65_536;

/// Connection to an address.
pub(super) struct Udp {
    claim: Claim,
    socket: UdpSocket,
    /// Datagrams of a step with the number of their frames; the first `used` count.
    out: Vec<(Vec<u8>, u16)>,
    used: usize,
    sequence: u8,
    bytes: Vec<u8>,
    waits: bool,
}

impl Udp {
    /// The way to an address, from the loopback address if it is one.
    pub fn open(address: SocketAddr) -> Result<Self, Refusal> {
        let from = match (address.ip(), address.ip().is_loopback()) {
            (IpAddr::V4(_), true) => IpAddr::V4(Ipv4Addr::LOCALHOST),
            (IpAddr::V4(_), false) => IpAddr::V4(Ipv4Addr::UNSPECIFIED),
            (IpAddr::V6(_), true) => IpAddr::V6(Ipv6Addr::LOCALHOST),
            (IpAddr::V6(_), false) => IpAddr::V6(Ipv6Addr::UNSPECIFIED),
        };
        let opened = UdpSocket::bind((from, 0)).and_then(|socket| {
            socket.connect(address)?;
            socket.set_read_timeout(Some(WAIT))?;
            Ok(socket)
        });
        let socket = opened.map_err(|e| {
            let help = "use an address that this machine can reach, such as 127.0.0.1:47800";
            Refusal::new(format!("{address} cannot be reached: {e}"), help)
        })?;
        Ok(Self {
            claim: Claim::of(address.to_string())?,
            socket,
            out: Vec::new(),
            used: 0,
            sequence: 0,
            bytes: vec![0; MAX_DATAGRAM],
            waits: true,
        })
    }
}

impl Link for Udp {
    fn at(&self) -> &str {
        self.claim.name()
    }

    fn begin(&mut self) {
        self.used = 0;
    }

    fn put(&mut self, frame: &Frame, _: i64) {
        let full = |(datagram, _): &(Vec<u8>, u16)| datagram.len() > FULL;
        if self.used == 0 || self.out.get(self.used - 1).is_none_or(full) {
            self.used += 1;
            if self.out.len() < self.used {
                self.out.push((Vec::new(), 0));
            }
            if let Some((datagram, frames)) = self.out.get_mut(self.used - 1) {
                datagram.clear();
                datagram.extend(cannelloni::begin(self.sequence));
                *frames = 0;
            }
            self.sequence = self.sequence.wrapping_add(1);
        }
        if let Some((datagram, frames)) = self.out.get_mut(self.used - 1) {
            cannelloni::write(frame, datagram);
            *frames += 1;
            cannelloni::count(datagram, *frames);
        }
    }

    fn send(&mut self) -> Result<(), String> {
        for (datagram, _) in self.out.iter().take(self.used) {
            match self.socket.send(datagram) {
                Ok(_) => {}
                // nobody listens, which the answer that does not come will tell
                Err(e) if e.kind() == ErrorKind::ConnectionRefused => {}
                Err(e) => return Err(format!("cannot receive data: {e}")),
            }
        }
        Ok(())
    }

    fn never_wait(&mut self) -> Result<(), String> {
        self.waits = false;
        let set = self.socket.set_nonblocking(true);
        set.map_err(|e| format!("cannot be read: {e}"))
    }

    fn receive(&mut self, each: &mut dyn FnMut(&Frame)) -> Result<bool, String> {
        match self.socket.recv(&mut self.bytes) {
            Ok(count) => {
                let datagram = self.bytes.get(..count).unwrap_or_default();
                match cannelloni::read(datagram, &mut |frame| each(frame)) {
                    true => Ok(true),
                    false => Err(format!(
                        "sends {count} bytes, which are not a datagram of cannelloni"
                    )),
                }
            }
            Err(e) => match e.kind() {
                ErrorKind::ConnectionRefused => {
                    if self.waits {
                        std::thread::sleep(RETRY);
                    }
                    Ok(false)
                }
                ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => Ok(false),
                _ => Err(format!("cannot be read: {e}")),
            },
        }
    }
}
