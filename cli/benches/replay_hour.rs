//! How fast a log is replayed, and with how much memory: one hour at 200 Hz with 20 channels (14 million samples), as
//! Parquet and CSV, through one estimator and through four, with metrics and recording. `cargo bench --bench
//! replay_hour`; `MONORIG_SECONDS=60` for a shorter log.

#![allow(clippy::unwrap_used)] // a bench

use arrow_array::{ArrayRef, Float64Array, Int64Array, RecordBatch};
use parquet::arrow::ArrowWriter;
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

const RATE_HZ: usize = 200;
const WHEELS: usize = 6;
/// Specific force and angular rate, wheels, torques, clamp pressures.
const CHANNELS: usize = 6 + 2 * WHEELS + 2;
const ONE: &str = "ekf_v_theta_biases";
const FOUR: &str = "ekf_v_theta_biases,dffrls_aekf_robust,attitude,rail_fusion";

/// The values of a row: a drive up and down with something like noise on it.
fn row(k: usize) -> [f64; CHANNELS] {
    let t = k as f64 / RATE_HZ as f64;
    let (v, a) = (1.2 + 0.6 * (0.2 * t).sin(), 0.12 * (0.2 * t).cos());
    let (slope, rate) = (0.1 * (0.02 * t).sin(), 0.002 * (0.02 * t).cos());
    let noise = |i: usize| (((k * 31 + i * 17) * 2_654_435_761) % 1000) as f64 / 1000.0 - 0.5;
    let f = a + 9.81 * f64::sin(slope);
    let torque = 20_000.0 * (f + 0.02 * 9.81) * 0.17 / (20.0 * WHEELS as f64);
    std::array::from_fn(|i| match i {
        0 => f + 0.05 * noise(i),
        2 => 9.81 * f64::cos(slope) + 0.05 * noise(i),
        4 => -rate + 0.005 * noise(i),
        1 | 3 | 5 => 0.01 * noise(i),
        _ if i < 6 + WHEELS => v + 0.01 * noise(i),
        _ if i < 6 + 2 * WHEELS => torque + 0.2 * noise(i),
        _ => 11.0 + 0.1 * noise(i),
    })
}

fn names() -> Vec<String> {
    let fixed = ["fx", "fy", "fz", "wx", "wy", "wz"].map(str::to_owned);
    let wheels = (1..=WHEELS).map(|i| format!("v{i}"));
    let torques = (1..=WHEELS).map(|i| format!("m{i}"));
    fixed
        .into_iter()
        .chain(wheels)
        .chain(torques)
        .chain(["p1".into(), "p2".into()])
        .collect()
}

fn write_csv(path: &Path, rows: usize) {
    use std::io::Write as _;
    let mut file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let mut line = format!("t_ns,{}\n", names().join(","));
    for k in 0..rows {
        write!(line, "{}", k * (1_000_000_000 / RATE_HZ)).unwrap();
        row(k).iter().for_each(|x| write!(line, ",{x:.6}").unwrap());
        line.push('\n');
        file.write_all(line.as_bytes()).unwrap();
        line.clear();
    }
}

fn write_parquet(path: &Path, rows: usize) {
    let mut writer = None;
    for from in (0..rows).step_by(50_000) {
        let block: Vec<_> = (from..rows.min(from + 50_000)).map(row).collect();
        let stamps = (from..from + block.len()).map(|k| (k * (1_000_000_000 / RATE_HZ)) as i64);
        let mut columns: Vec<(String, ArrayRef)> = vec![(
            "t_ns".into(),
            Arc::new(Int64Array::from_iter_values(stamps)),
        )];
        for (i, name) in names().into_iter().enumerate() {
            let values = block.iter().map(|row| row[i]);
            columns.push((name, Arc::new(Float64Array::from_iter_values(values))));
        }
        let batch = RecordBatch::try_from_iter(columns).unwrap();
        let writer = writer.get_or_insert_with(|| {
            let file = std::fs::File::create(path).unwrap();
            ArrowWriter::try_new(file, batch.schema(), None).unwrap()
        });
        writer.write(&batch).unwrap();
    }
    writer.unwrap().close().unwrap();
}

/// Wall time (s), processor time of all threads (s) and peak memory (MB) of a replay; the last two on Linux only.
fn replay(folder: &Path, log: &str, estimators: &str) -> [f64; 3] {
    let begun = Instant::now();
    let mut child = Command::new(env!("CARGO_BIN_EXE_monorig"))
        .args([
            "replay",
            log,
            "--map",
            "hour.map.yaml",
            "--no-rerun",
            "--out",
            "runs",
        ])
        .args(["--estimators", estimators])
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let (mut peak_mb, mut cpu_s) = (f64::NAN, f64::NAN);
    loop {
        // user and system time are the 12th and 13th word behind the name, in hundredths of a second
        let stat =
            std::fs::read_to_string(format!("/proc/{}/stat", child.id())).unwrap_or_default();
        if let Some((_, words)) = stat.rsplit_once(')') {
            let ticks = words.split_whitespace().skip(11).take(2);
            let ticks: f64 = ticks.filter_map(|w| w.parse::<f64>().ok()).sum();
            cpu_s = if ticks > 0.0 { ticks / 100.0 } else { cpu_s };
        }
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id()));
        let line = status.unwrap_or_default();
        let peak = line.lines().find_map(|l| l.strip_prefix("VmHWM:"));
        let kb = peak.and_then(|l| l.trim().trim_end_matches(" kB").parse::<f64>().ok());
        peak_mb = kb.map_or(peak_mb, |kb| kb / 1024.0);
        if let Some(status) = child.try_wait().unwrap() {
            assert!(matches!(status.code(), Some(0 | 1)), "{status}");
            return [begun.elapsed().as_secs_f64(), cpu_s, peak_mb];
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn main() {
    let seconds = std::env::var("MONORIG_SECONDS")
        .ok()
        .and_then(|s| s.parse().ok());
    let seconds: usize = seconds.unwrap_or(3600);
    let dir = tempfile::tempdir().unwrap();
    let list = |letter: &str| -> String {
        let all: Vec<String> = (1..=WHEELS).map(|i| format!("{letter}{i}")).collect();
        all.join(", ")
    };
    let map = format!(
        "version: 1\nfiles: {{log: log}}\nstep: {{rate_hz: {RATE_HZ}}}\n\
nominal: {{tare_kg: 18000, mass_range_kg: [15000, 40000], wheel_radius_m: 0.17, gear_ratio: 20, running_resistance: 0.02}}\n\
channels:\n  specific_force: {{columns: [fx, fy, fz], unit: m/s2}}\n  angular_rate: {{columns: [wx, wy, wz], unit: rad/s}}\n  \
wheel_speed: [{{columns: [{}], unit: m/s}}]\n  traction: {{torque: [{}], unit: Nm}}\n  \
clamp_pressure: [{{column: p1, unit: MPa}}, {{column: p2, unit: MPa}}]\n\
reference: {{mass: {{kg: 20000, sd_kg: 100}}, slope: {{deg: 0, sd_deg: 6}}}}\n",
        list("v"),
        list("m")
    );
    std::fs::write(dir.path().join("hour.map.yaml"), map).unwrap();
    let rows = seconds * RATE_HZ;
    write_parquet(&dir.path().join("log.parquet"), rows);
    write_csv(&dir.path().join("log.csv"), rows);
    println!(
        "{seconds} s, {RATE_HZ} Hz, {CHANNELS} channels: {} samples",
        rows * CHANNELS
    );
    for (log, estimators, words) in [
        ("log.parquet", ONE, "one estimator"),
        ("log.parquet", FOUR, "four estimators"),
        ("log.csv", FOUR, "four estimators"),
    ] {
        let [wall_s, cpu_s, peak_mb] = replay(dir.path(), log, estimators);
        let (times, times_cpu) = (seconds as f64 / wall_s, seconds as f64 / cpu_s);
        println!("{log}, {words}: {wall_s:.2} s, {times:.0} times real time");
        println!(
            "    {cpu_s:.2} s of processor time ({times_cpu:.0} times real time), {peak_mb:.0} MB"
        );
    }
}
