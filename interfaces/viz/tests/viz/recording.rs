//! A small made-up run through both sinks, and read back: what is in the files is what was sent.

use crate::made_up::Run;
use arrow_array::{Array, Float64Array};
use monorig_sim::record::parquet::ParquetSink;
use monorig_sim::record::{Channel, Chunk, Sink};
use monorig_testing::{Random, mutants};
use monorig_viz::RerunSink;
use monorig_viz::readback::{Recording, read};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use std::fs::File;
use std::path::Path;
use std::time::{Duration, Instant};

const CHANNELS: usize = 80;

fn chunks(run: &Run) -> Vec<Chunk> {
    vec![run.chunk(0.0, 4.0), run.chunk(4.0, 7.0)]
}

fn record(mut sink: impl Sink, run: &Run) {
    sink.begin(&run.layout()).unwrap();
    for chunk in chunks(run) {
        sink.chunk(&chunk).unwrap();
    }
    sink.finish().unwrap();
}

fn recording(path: &Path, run: &Run) -> Recording {
    record(RerunSink::file(path), run);
    read(path).unwrap()
}

/// (time ns, value) of a column of a Parquet file, where there is one that can be drawn.
fn parquet_columns(path: &Path) -> Vec<(String, Vec<(i64, f64)>)> {
    let reader = ParquetRecordBatchReaderBuilder::try_new(File::open(path).unwrap()).unwrap();
    let schema = reader.schema().clone();
    let names = schema
        .fields()
        .iter()
        .map(|f| (f.name().clone(), Vec::new()));
    let mut columns: Vec<(String, Vec<(i64, f64)>)> = names.collect();
    for batch in reader.build().unwrap() {
        let batch = batch.unwrap();
        let column =
            |i: usize| -> &Float64Array { batch.column(i).as_any().downcast_ref().unwrap() };
        for (i, (_, rows)) in columns.iter_mut().enumerate() {
            let (time, values) = (column(0), column(i));
            let drawn = (0..batch.num_rows())
                .filter(|&r| !values.is_null(r) && values.value(r).is_finite());
            rows.extend(drawn.map(|r| ((time.value(r) * 1e9).round() as i64, values.value(r))));
        }
    }
    columns
}

#[test]
fn channels_are_the_same_in_parquet_and_rerun() {
    let dir = tempfile::tempdir().unwrap();
    let run = Run::new(CHANNELS);
    let parquet = dir.path().join("channels.parquet");
    record(ParquetSink::create(&parquet).unwrap(), &run);
    let rerun = recording(&dir.path().join("run.rrd"), &run);

    let columns = parquet_columns(&parquet);
    assert_eq!(columns.len(), CHANNELS + 1);
    let mut gaps = 0;
    for (name, rows) in &columns[1..] {
        let Some(entity) = rerun.entities.get(&format!("/{name}")) else {
            panic!("no entity for {name}");
        };
        let got: Vec<(i64, u64)> = std::iter::zip(&entity.times, &entity.scalars)
            .map(|(&t, x)| (t, x.to_bits()))
            .collect();
        let expected: Vec<(i64, u64)> = rows.iter().map(|&(t, x)| (t, x.to_bits())).collect();
        assert_eq!(got, expected, "{name}");
        assert_eq!(entity.times.len(), entity.scalars.len(), "{name}");
        gaps += usize::from(rows.len() < 350);
    }
    assert!(gaps > 3, "the run should have sensors that skip rows");
}

#[test]
fn everything_sent_is_in_the_recording() {
    let dir = tempfile::tempdir().unwrap();
    let run = Run::new(CHANNELS);
    let sent = chunks(&run);
    let rerun = recording(&dir.path().join("run.rrd"), &run);
    assert_eq!(rerun.application, "monorig");
    assert_eq!(rerun.id, "synthetic-1");
    assert_eq!(rerun.entities["/__properties"].fixed, 1, "its name");
    assert!(rerun.complete);

    // Poses relative to the start of the rail, in single precision.
    let start = run.rail[0].p;
    let drawn = |p: &[f64; 3]| [0, 1, 2].map(|k| (p[k] - start[k]) as f32);
    for (i, body) in run.train.bodies.iter().enumerate() {
        let entity = &rerun.entities[&format!("/world/train/{}", body.name.replace('/', "."))];
        let poses: Vec<_> = sent.iter().flat_map(|c| c.poses[i].clone()).collect();
        let positions: Vec<[f32; 3]> = poses.iter().map(|(p, _)| drawn(p)).collect();
        let quaternions: Vec<[f32; 4]> = poses.iter().map(|(_, q)| q.map(|x| x as f32)).collect();
        let times: Vec<i64> = sent.iter().flat_map(|c| c.pose_time_ns.clone()).collect();
        assert_eq!(entity.times, times, "{}", body.name);
        assert_eq!(entity.positions, positions, "{}", body.name);
        assert_eq!(entity.quaternions, quaternions, "{}", body.name);
        // Every shape is there, once.
        for shape in &body.shapes {
            let path = format!(
                "/world/train/{}/{}",
                body.name.replace('/', "."),
                shape.link
            );
            assert!(rerun.entities[&path].fixed >= 1, "{path}");
        }
    }

    // Wheels: one on each side of a drive, turned by the angle of its side.
    let wheels = rerun
        .entities
        .iter()
        .filter(|(path, _)| path.ends_with("/spin"));
    assert_eq!(wheels.count(), 2 * run.train.drives.len());
    let wheel = &rerun.entities["/world/train/drive_3/wheel_right/spin"];
    let angles = sent
        .iter()
        .flat_map(|c| c.wheel_angles[2].iter().map(|a| a[1]));
    for (q, angle) in wheel.quaternions.iter().zip(angles) {
        // A rotation by 2 atan2(z, w) about z; equal up to whole turns.
        let turned = 2.0 * f64::from(q[2]).atan2(f64::from(q[3]));
        let error = (turned - angle).rem_euclid(std::f64::consts::TAU);
        assert!(
            error.min(std::f64::consts::TAU - error) < 1e-5,
            "{turned} {angle}"
        );
    }

    // Chains, events, rail, obstacles, the viewer's layout.
    let chains = rerun
        .entities
        .iter()
        .filter(|(path, _)| path.starts_with("/world/links/chain_"));
    assert_eq!(chains.count(), run.train.connections.len());
    let events: Vec<(i64, String)> = sent.iter().flat_map(|c| c.events.clone()).collect();
    let log = &rerun.entities["/events"];
    let told = log.times.iter().copied().zip(log.texts.iter().cloned());
    let (changes, happened): (Vec<_>, Vec<_>) = told.partition(|(_, text)| text.ends_with("valid"));
    let with_time = |(t, text): &(i64, String)| (*t, format!("{:.1} s: {text}", *t as f64 * 1e-9));
    assert_eq!(happened, events.iter().map(with_time).collect::<Vec<_>>());
    assert!(
        changes.is_empty(),
        "the run is valid all the time or never: {changes:?}"
    );
    let rails = rerun
        .entities
        .iter()
        .filter(|(path, _)| path.starts_with("/world/track/rail/"));
    assert_eq!(rails.count(), (run.rail.len() - 1).div_ceil(200));
    assert_eq!(rerun.entities["/world/obstacles"].fixed, 1);
    assert!(rerun.layout.iter().any(|path| path == "/viewport"));
}

/// Parts of one wheel turn with it: only the wheel has angles. What turns about another axis has its own.
#[test]
fn parts_of_a_wheel_turn_with_it() {
    let dir = tempfile::tempdir().unwrap();
    let mut run = Run::new(CHANNELS);
    let body = run.train.drives[0].body;
    let name = run.train.bodies[body].name.clone();
    let shapes = &mut run.train.bodies[body].shapes;
    let wheel = shapes.iter().find(|s| s.link == "wheel_left").unwrap();
    let part = |link: &str, along: f64, across: f64| {
        let mut part = wheel.clone();
        part.link = link.into();
        part.pose = wheel.pose * nalgebra::Isometry3::translation(across, 0.0, along);
        part
    };
    let parts = [part("rim", 0.02, 0.0), part("apart", 0.0, 0.3)];
    shapes.extend(parts);
    let rerun = recording(&dir.path().join("run.rrd"), &run);
    let rows = |path: &str| {
        let found = rerun.entities.get(&format!("/world/train/{name}/{path}"));
        found.map(|e| (e.fixed > 0, e.times.len()))
    };
    let poses: usize = chunks(&run).iter().map(|c| c.pose_time_ns.len()).sum();
    assert_eq!(rows("wheel_left/spin"), Some((true, poses)));
    assert_eq!(rows("wheel_left/spin/rim"), Some((true, 0)));
    assert_eq!(rows("rim/spin"), None);
    assert_eq!(rows("apart/spin"), Some((true, poses)));
}

/// Degrees and bands, against the channels they are made from.
#[test]
fn what_is_made_for_the_eye_follows_from_the_channels() {
    let dir = tempfile::tempdir().unwrap();
    let run = Run::new(CHANNELS);
    let rerun = recording(&dir.path().join("run.rrd"), &run);
    let scalars = |path: &str| rerun.entities[path].scalars.clone();
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs().max(1.0);
    let radians = scalars("/truth/grade_at_imu");
    let degrees = scalars("/display/truth/grade_at_imu");
    assert!(
        radians
            .iter()
            .zip(&degrees)
            .all(|(r, d)| close(r.to_degrees(), *d))
    );
    let value = scalars("/estimates/jekf/grade");
    let sd = scalars("/estimates/jekf/grade_sd");
    let band = scalars("/display/estimates/jekf/grade/two_sigma");
    assert_eq!(band.len(), 2 * value.len());
    for ((x, sd), ends) in value.iter().zip(&sd).zip(band.chunks_exact(2)) {
        assert!(close(ends[0], (x - 2.0 * sd).to_degrees()));
        assert!(close(ends[1], (x + 2.0 * sd).to_degrees()));
    }
}

/// Mine-grid coordinates of millions of metres draw the same train: single precision would move it by half a metre.
#[test]
fn far_from_the_origin_the_picture_is_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let (near, mut far) = (Run::new(CHANNELS), Run::new(CHANNELS));
    let offset = nalgebra::Vector3::new(4.5e6, 3.2e6, -600.0);
    far.rail.iter_mut().for_each(|f| f.p += offset);
    far.obstacles
        .iter_mut()
        .for_each(|o| o.0.translation.vector += offset);
    let near = recording(&dir.path().join("near.rrd"), &near);
    let far = recording(&dir.path().join("far.rrd"), &far);
    let mut compared = 0;
    for (path, entity) in &near.entities {
        for (a, b) in entity.positions.iter().zip(&far.entities[path].positions) {
            let error = (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max);
            assert!(error < 1e-4, "{path}: {a:?} {b:?}");
            compared += 1;
        }
    }
    assert!(compared > 1000);
}

/// A value that is missing or not valid breaks the line: its first row is there and is not a number. Errors are against
/// the truth.
#[test]
fn lines_break_at_gaps_and_where_not_valid() {
    let dir = tempfile::tempdir().unwrap();
    let channel = |path: &str, unit| Channel {
        path: path.into(),
        unit,
    };
    let mut run = Run::new(0);
    run.channels = vec![
        channel("truth/total_mass", "kg"),
        channel("estimates/e/total_mass", "kg"),
        channel("estimates/e/total_mass_sd", "kg"),
        channel("estimates/e/total_mass_valid", "1"),
        channel("sensors/imu/specific_force_x", "m/s²"),
    ];
    // 60 s at 50 Hz: valid but from 10 to 40 s, samples at 10 Hz but from 20 to 50 s
    let time_ns: Vec<i64> = (0..3000).map(|i| i * 20_000_000).collect();
    let valid = |t: f64| !(10.0..40.0).contains(&t);
    let sampled = |t: f64| !(20.0..50.0).contains(&t) && (t * 10.0).fract().abs() < 1e-6;
    let column = |value: &dyn Fn(f64) -> f64| -> Vec<f64> {
        time_ns.iter().map(|&t| value(t as f64 * 1e-9)).collect()
    };
    let chunk = Chunk {
        values: vec![
            column(&|_| 20e3),
            column(&|_| 22e3),
            column(&|_| 400.0),
            column(&|t| f64::from(u8::from(valid(t)))),
            column(&|t| if sampled(t) { t } else { f64::NAN }),
        ],
        time_ns,
        ..Chunk::default()
    };
    let path = dir.path().join("run.rrd");
    let mut sink = RerunSink::file(&path);
    sink.begin(&run.layout()).unwrap();
    sink.chunk(&chunk).unwrap();
    sink.finish().unwrap();
    let read = read(&path).unwrap();
    let breaks = |path: &str| -> Vec<f64> {
        let entity = &read.entities[path];
        let width = entity.scalars.len() / entity.times.len();
        let rows = entity.times.iter().zip(entity.scalars.chunks_exact(width));
        let broken = rows.filter(|(_, v)| v.iter().any(|x| x.is_nan()));
        broken.map(|(t, _)| *t as f64 * 1e-9).collect()
    };
    let mass = "/display/estimates/e/total_mass";
    for path in [
        mass.to_owned(),
        format!("{mass}/two_sigma"),
        format!("{mass}/error"),
        format!("{mass}/error_band"),
    ] {
        assert_eq!(breaks(&path), [10.0], "{path}");
    }
    let hole = breaks("/sensors/imu/specific_force_x");
    assert!(
        hole.len() == 1 && (20.0..21.0).contains(&hole[0]),
        "{hole:?}"
    );
    assert!(breaks("/truth/total_mass").is_empty());
    let error = &read.entities[&format!("{mass}/error")].scalars;
    assert!(
        error
            .iter()
            .filter(|e| !e.is_nan())
            .all(|e| (e - 10.0).abs() < 1e-9)
    );
    // three states of the lane, and a read-out a second
    assert_eq!(
        read.entities["/validity/e"].times,
        [0, 10_000_000_000, 40_000_000_000]
    );
    assert_eq!(read.entities["/readout"].times.len(), 60);
}

/// The same run gives the same file, byte for byte, with the index at its end. (The encoder's hash maps have another
/// order each time.)
#[test]
fn same_run_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let run = Run::new(CHANNELS);
    let first = dir.path().join("first.rrd");
    let whole = recording(&first, &run);
    let bytes = std::fs::read(&first).unwrap();
    for i in 0..8 {
        let again = dir.path().join(format!("{i}.rrd"));
        assert_eq!(recording(&again, &run), whole);
        assert!(std::fs::read(&again).unwrap() == bytes, "file {i}");
    }
}

/// One byte less at its end, or more, and it is no whole recording.
#[test]
fn a_byte_less_or_more_is_seen() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.rrd");
    recording(&path, &Run::new(CHANNELS));
    let bytes = std::fs::read(&path).unwrap();
    for other in [&bytes[..bytes.len() - 1], &[&bytes[..], b"x"].concat()] {
        std::fs::write(&path, other).unwrap();
        assert!(read(&path).map_or(true, |r| !r.complete));
    }
}

#[test]
fn dropped_without_an_end_it_is_whole() {
    let dir = tempfile::tempdir().unwrap();
    let run = Run::new(CHANNELS);
    let path = dir.path().join("run.rrd");
    {
        let mut sink = RerunSink::file(&path);
        sink.begin(&run.layout()).unwrap();
        sink.chunk(&chunks(&run)[0]).unwrap();
    }
    let read = read(&path).unwrap();
    assert!(read.complete);
    assert_eq!(read.entities["/truth/speed"].times.len(), 200);
}

/// A recording cut off in the middle (a killed process, a full disk) is seen to be incomplete.
#[test]
fn a_truncated_file_is_told_from_a_whole_one() {
    let dir = tempfile::tempdir().unwrap();
    let run = Run::new(CHANNELS);
    let path = dir.path().join("run.rrd");
    assert!(recording(&path, &run).complete);
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    assert!(read(&path).map_or(true, |r| !r.complete));
    std::fs::write(&path, "no recording").unwrap();
    assert!(read(&path).is_err());
}

/// Whatever a file says of the lengths in it, no memory is asked for that it cannot need: each length field, and each
/// field of a message beside it, with numbers up to the largest.
#[test]
fn a_length_that_cannot_be_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.rrd");
    assert!(recording(&path, &Run::new(4)).complete);
    let good = std::fs::read(&path).unwrap();
    // the places of the lengths, by the layout that `frames.rs` describes
    let (mut at, mut places) = (12, Vec::new());
    while let Some(length) = good.get(at + 8..at + 16) {
        places.push(at + 8);
        let length = u64::from_le_bytes(length.try_into().unwrap());
        let kind = good[at];
        at += 16 + length as usize;
        if kind == 0 {
            break;
        }
    }
    let mut random = Random::new(mutants::first_seed());
    for place in places {
        for _ in 0..mutants::count(4) {
            let mut bytes = good.clone();
            let length = 1_u64 << (33 + random.below(31));
            bytes[place..place + 8].copy_from_slice(&length.to_le_bytes());
            std::fs::write(&path, &bytes).unwrap();
            assert!(
                read(&path).map_or(true, |r| !r.complete),
                "{length} at {place}"
            );
        }
    }
    // single bits in the first bytes of messages: fields of Protobuf, among them the length of what is unpacked
    for _ in 0..mutants::count(300) {
        let mut bytes = good.clone();
        let at = random.below(bytes.len().min(4096));
        bytes[at] ^= 1 << random.below(8);
        std::fs::write(&path, &bytes).unwrap();
        let _ = read(&path);
    }
}

#[test]
fn live_without_a_viewer_records_as_usual() {
    let dir = tempfile::tempdir().unwrap();
    let run = Run::new(CHANNELS);
    let (a, b) = (dir.path().join("a.rrd"), dir.path().join("b.rrd"));
    let nobody = std::net::TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let start = Instant::now();
    let sink = RerunSink::live(&a, nobody);
    assert!(sink.live_state().is_none());
    record(sink, &run);
    assert!(start.elapsed() < Duration::from_secs(5));
    assert_eq!(read(&a).unwrap(), recording(&b, &run));
}

#[test]
#[cfg(target_os = "linux")]
fn full_disk_and_missing_folder_are_errors_that_name_the_file() {
    let run = Run::new(CHANNELS);
    for path in ["/dev/full", "/no/such/folder/run.rrd"] {
        let mut sink = RerunSink::file(path);
        let result = sink
            .begin(&run.layout())
            .and_then(|()| sink.chunk(&run.chunk(0.0, 30.0)))
            .and_then(|()| sink.finish());
        match result {
            Err(monorig_sim::error::Error::Io { path: named, .. }) => {
                assert_eq!(named, Path::new(path))
            }
            other => panic!("{other:?}"),
        }
    }
}
