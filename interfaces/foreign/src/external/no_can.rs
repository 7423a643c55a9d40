//! No buses of SocketCAN: this program is built without them.

use super::link::Link;
use monorig_sim::closed_loop::registry::{BoxedEstimator, Refusal};
use monorig_wire::signal::Numbers;

/// Refuses a bus.
pub(super) fn open(interface: &str) -> Result<Box<dyn Link>, Refusal> {
    Err(Refusal::new(
        format!(
            "the CAN bus `{interface}` cannot be opened: this program was built without SocketCAN"
        ),
        "use a program built on Linux with `--features socketcan`; or use `udp` with cannelloni between the program and the bus",
    ))
}

/// Refuses a bus.
pub fn serve_can(_: BoxedEstimator, _: Numbers, interface: &str) -> Result<(), Refusal> {
    open(interface).map(drop)
}
