//! What recording costs: 300 s of a made-up run, 150 channels at 50 Hz, 18 bodies at 25 Hz.
//!
//!     cargo run --release -p monorig-viz --example recording_cost [folder [viewer]]
//!
//! With the address of a viewer (127.0.0.1:9876) the recording is shown there too. Writes `channels.parquet` and `run.rrd` into the folder (default: the system's folder for temporary files) and
//! prints processor time (all threads) and sizes.

mod synthetic;

use monorig_sim::error::Error;
use monorig_sim::record::Sink;
use monorig_sim::record::parquet::ParquetSink;
use monorig_viz::RerunSink;
use monorig_viz::sink::CHUNK_S;
use std::path::PathBuf;
use std::time::Instant;

const RUN_S: f64 = 300.0;

fn main() -> Result<(), Error> {
    let folder = std::env::args_os()
        .nth(1)
        .map_or_else(std::env::temp_dir, PathBuf::from);
    let run = synthetic::Run::new(150);
    let starts = (0..(RUN_S / CHUNK_S) as usize).map(|i| i as f64 * CHUNK_S);
    let chunks: Vec<_> = starts.map(|s| run.chunk(s, s + CHUNK_S)).collect();
    let parquet = folder.join("channels.parquet");
    let rrd = folder.join("run.rrd");
    let viewer = std::env::args().nth(2).and_then(|a| a.parse().ok());
    let rerun = match viewer {
        Some(address) => RerunSink::live(&rrd, address),
        None => RerunSink::file(&rrd),
    }
    .thinned();
    if viewer.is_some() && rerun.live_state().is_none() {
        println!("no viewer answers there");
    }
    let sinks: [(&PathBuf, Box<dyn Sink>); 2] = [
        (&parquet, Box::new(ParquetSink::create(&parquet)?)),
        (&rrd, Box::new(rerun)),
    ];
    for (path, mut sink) in sinks {
        let (start, cpu) = (Instant::now(), cpu_s());
        sink.begin(&run.layout())?;
        for chunk in &chunks {
            sink.chunk(chunk)?;
        }
        sink.finish()?;
        let bytes = std::fs::metadata(path).map_or(0, |m| m.len());
        println!(
            "{}: {:.2} s, {:.2} s of processor time, {:.1} MB",
            path.display(),
            start.elapsed().as_secs_f64(),
            cpu_s() - cpu,
            bytes as f64 / 1e6
        );
    }
    Ok(())
}

/// Processor time of this process so far, s; 0 where the system does not tell it the way Linux does.
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let ticks = after_name.split_whitespace().skip(11).take(2);
    ticks.filter_map(|t| t.parse::<f64>().ok()).sum::<f64>() / 100.0
}
