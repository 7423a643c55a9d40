//! Estimators outside the program, which read CAN frames and answer with CAN frames: on a controller, in a process, in
//! firmware.
//!
//! | file | what it holds |
//! |---|---|
//! | `estimator` | one in a run: a step is sent, its answer is waited for |
//! | `real_time` | the same by the clock: what comes too late counts as not delivered |
//! | `link` | the ways to it |
//! | `process` | lines of candump through the standard input and output of a process |
//! | `udp` | datagrams of cannelloni |
//! | `can` | frames on a bus of SocketCAN |
//! | `no_can` | in its place without the feature `socketcan` or Linux: refuses every bus |
//! | `claim` | an address or a bus in use |
//! | `serve` | an estimator of ours at the other end of a pipe or of UDP |

#[cfg_attr(
    not(all(feature = "socketcan", target_os = "linux")),
    path = "no_can.rs"
)]
mod can;
mod claim;
mod estimator;
mod link;
#[cfg(unix)]
mod process;
mod real_time;
mod serve;
mod udp;

pub use can::serve_can;
pub use serve::{serve_lines, serve_udp};

use estimator::Outside;
use link::Link;
use monorig_estimators::Vehicle;
use monorig_sim::closed_loop::registry::{BoxedEstimator, EstimatorType, NamedSettings, Refusal};
use monorig_sim::closed_loop::{AnswerCounter, WallClock};
use monorig_sim::config::scenario::{External, SignalNumbers, Way};
use monorig_wire::signal::Numbers;
use std::sync::Arc;

/// Numbers of the frames.
pub fn numbers(signals: SignalNumbers) -> Numbers {
    match signals {
        SignalNumbers::Fixed => Numbers::Fixed,
        SignalNumbers::Float => Numbers::Float,
    }
}

/// The estimator at the end of a connection, in real time on a clock, else in lockstep. It is reached at its first
/// step.
pub(crate) fn estimator_of(
    external: &External,
    clock: Option<&Arc<WallClock>>,
) -> Result<EstimatorType, Refusal> {
    #[cfg(unix)]
    if let Way::Process(words) = &external.way {
        process::find(words, &external.folder)?;
    }
    let external = external.clone();
    let timed = clock.map(|clock| (clock.clone(), AnswerCounter::default()));
    let counter = timed.as_ref().map(|(_, counter)| counter.clone());
    let build = move |vehicle: &Vehicle, _: NamedSettings<'_>| {
        let numbers = numbers(external.signals);
        let link: Box<dyn Link> = match &external.way {
            Way::Udp(address) => Box::new(udp::Udp::open(*address)?),
            Way::Can(interface) => can::open(interface)?,
            #[cfg(unix)]
            Way::Process(words) => Box::new(process::Process::new(words, &external.folder)?),
            #[cfg(not(unix))]
            Way::Process(_) => {
                let help = "use `udp`, which works on this system too";
                return Err(Refusal::new(
                    "programs can be estimators only on Unix",
                    help,
                ));
            }
        };
        let mut outside = Outside::new(link, numbers, vehicle.drives, &external);
        if let Some((clock, counter)) = &timed {
            outside = outside.on_clock(clock.clone(), external.deadline(), counter.clone());
        }
        Ok(Box::new(outside) as BoxedEstimator)
    };
    let of_type = EstimatorType::new("external", &[], build);
    Ok(match counter {
        Some(counter) => of_type.counted_by(counter),
        None => of_type,
    })
}
