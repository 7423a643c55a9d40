//! Runs an estimator of monorig as an external estimator, as a controller would, on this machine.

use monorig_sim::closed_loop::registry::BoxedEstimator;
use monorig_sim::lines::read_line;
use monorig_wire::ecu::Ecu;
use monorig_wire::signal::Numbers;
use monorig_wire::{candump, cannelloni};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io::{BufRead, ErrorKind, Result, Write};
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

/// Largest number of bytes of a line.
const MAX_LINE: u64 = 4096;
/// Largest number of bytes of a datagram.
const MAX_DATAGRAM: usize = 65_536;

/// Answers lines of candump until they end. Lines that are none are passed over, as frames of others are.
pub fn serve_lines(
    mut estimator: BoxedEstimator,
    numbers: Numbers,
    mut from: impl BufRead,
    mut to: impl Write,
) -> Result<()> {
    let (mut ecu, mut line, mut out) = (Ecu::new(numbers), Vec::new(), Vec::new());
    while read_line(&mut from, MAX_LINE, &mut line)? {
        if let Some(frame) = candump::read(&line).and_then(|read| read.frame) {
            ecu.take(estimator.as_mut(), &frame, &mut |f| {
                candump::write(f, 0, &mut out)
            });
        }
        line.clear();
        if !out.is_empty() {
            match to.write_all(&out).and_then(|()| to.flush()) {
                Err(e) if e.kind() == ErrorKind::BrokenPipe => return Ok(()),
                sent => sent?,
            }
            out.clear();
        }
    }
    Ok(())
}

/// Largest number of runs at a time, and the silence after which a run counts as ended if there are more.
const MAX_RUNS: usize = 16;
const SILENT: Duration = Duration::from_secs(60);

/// The estimator of a run.
struct Run {
    ecu: Ecu,
    estimator: BoxedEstimator,
    sequence: u8,
    last: Instant,
}

/// Answers datagrams of cannelloni, each to its sender, until the program ends. Each asker has an estimator of its own,
/// which `build` makes.
pub fn serve_udp(
    mut build: impl FnMut() -> Result<BoxedEstimator>,
    numbers: Numbers,
    socket: &UdpSocket,
) -> Result<()> {
    let mut runs: BTreeMap<SocketAddr, Run> = BTreeMap::new();
    let (mut bytes, mut out) = (vec![0; MAX_DATAGRAM], Vec::new());
    loop {
        let (count, asker) = match socket.recv_from(&mut bytes) {
            Ok(came) => came,
            // one who asked before has gone
            Err(e) if e.kind() == ErrorKind::ConnectionRefused => continue,
            Err(e) if e.kind() == ErrorKind::Interrupted => continue,
            Err(e) => return Err(e),
        };
        if !runs.contains_key(&asker) {
            if runs.len() >= MAX_RUNS {
                runs.retain(|_, run| run.last.elapsed() < SILENT);
            }
            // its run ends for want of an answer
            if runs.len() >= MAX_RUNS {
                continue;
            }
        }
        let run = match runs.entry(asker) {
            Entry::Occupied(run) => run.into_mut(),
            Entry::Vacant(place) => place.insert(Run {
                ecu: Ecu::new(numbers),
                estimator: build()?,
                sequence: 0,
                last: Instant::now(),
            }),
        };
        run.last = Instant::now();
        out.clear();
        out.extend(cannelloni::begin(run.sequence));
        let mut frames = 0;
        cannelloni::read(bytes.get(..count).unwrap_or_default(), &mut |frame| {
            run.ecu.take(run.estimator.as_mut(), frame, &mut |f| {
                cannelloni::write(f, &mut out);
                frames += 1;
            });
        });
        if frames > 0 {
            cannelloni::count(&mut out, frames);
            run.sequence = run.sequence.wrapping_add(1);
            // one who has gone is answered no more
            let _ = socket.send_to(&out, asker);
        }
    }
}
