//! Logs that asammdf, mcap, mcap_ros2, python-can with cantools, pyarrow and pandas wrote (`reference/make.py`): every
//! stamp and value is read as it was written, and every file that breaks off is refused.

use monorig_logs::read::{ReadOptions, full_name, scan};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

/// By `table.column` and by `column`: stamps, arrivals and values, without those that are not numbers.
type Columns = BTreeMap<String, Vec<(i64, i64, f64)>>;

fn read_with(path: &Path, options: &ReadOptions) -> Result<Columns, monorig_sim::Error> {
    let mut columns = Columns::new();
    scan(path, options, &mut |chunk| {
        for row in &chunk.rows {
            let table = &chunk.tables[row.table as usize];
            for (column, value) in table.columns.iter().zip(chunk.values_of(row)) {
                if !value.is_nan() {
                    let full = full_name(&table.name, &column.name);
                    for name in [full, column.name.clone()] {
                        let values = columns.entry(name).or_default();
                        if values.last().is_none_or(|l| l.0 != row.stamp_ns) {
                            values.push((row.stamp_ns, row.arrival_ns, *value));
                        }
                    }
                }
            }
        }
        true
    })?;
    Ok(columns)
}

fn read(name: &str) -> Columns {
    let options = ReadOptions {
        dbc: Some(data("crane.dbc")),
        ..ReadOptions::default()
    };
    read_with(&data(name), &options).unwrap()
}

/// Columns of what was written: stamps in ns and values.
fn expected(name: &str) -> BTreeMap<String, Vec<(i64, f64)>> {
    let text = std::fs::read_to_string(data(&format!("expected_{name}.csv"))).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut columns: BTreeMap<String, Vec<(i64, f64)>> = BTreeMap::new();
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        for (name, field) in names.iter().zip(&fields).skip(1) {
            let sample = (fields[0].parse().unwrap(), field.parse().unwrap());
            columns.entry((*name).to_owned()).or_default().push(sample);
        }
    }
    columns
}

/// The column `read` is the column `written`, its stamps `from_ns` later and at most `within_ns` off.
fn same(
    file: &str,
    columns: &Columns,
    read: &str,
    written: &[(i64, f64)],
    from_ns: i64,
    within_ns: i64,
) {
    let found = columns
        .get(read)
        .unwrap_or_else(|| panic!("{file}: no {read} in {:?}", columns.keys()));
    assert_eq!(found.len(), written.len(), "{file}: {read}");
    for ((stamp, _, x), (t, y)) in found.iter().zip(written) {
        assert!(
            (stamp - from_ns - t).abs() <= within_ns,
            "{file}: {read} at {stamp}, not {t}"
        );
        assert_eq!(
            x.to_bits(),
            y.to_bits(),
            "{file}: {read} at {t} is {x}, not {y}"
        );
    }
}

const START_NS: i64 = 1_700_000_000_000_000_000;

#[test]
fn mdf_of_asammdf() {
    let (imu, drive, clamp) = (expected("imu"), expected("drive"), expected("clamp"));
    for version in ["410", "420"] {
        for packed in ["plain", "deflate", "transposed"] {
            let file = format!("asammdf_{version}_{packed}.mf4");
            let columns = read(&file);
            // asammdf writes the time of the making as the start
            let start = columns["ax"][0].0 - imu["ax"][0].0;
            for (name, written) in imu.iter().chain(&drive).chain(&clamp) {
                same(&file, &columns, name, written, start, 0);
            }
        }
    }
}

#[test]
fn mcap_with_json_and_with_messages_of_ros_2() {
    let (imu, drive, clamp) = (expected("imu"), expected("drive"), expected("clamp"));
    for packed in ["none", "lz4", "zstd"] {
        let file = format!("json_{packed}.mcap");
        let columns = read(&file);
        for (name, written) in &imu {
            same(
                &file,
                &columns,
                &format!("/imu.{name}"),
                written,
                START_NS,
                0,
            );
        }
        same(
            &file,
            &columns,
            "/drive.motor.torque.0",
            &drive["torque"],
            START_NS,
            0,
        );
        same(
            &file,
            &columns,
            "/drive.speed",
            &drive["speed"],
            START_NS,
            0,
        );

        let file = format!("cdr_{packed}.mcap");
        let columns = read(&file);
        for (name, axis) in [("ax", "x"), ("ay", "y"), ("az", "z")] {
            same(
                &file,
                &columns,
                &format!("/imu/data.linear_acceleration.{axis}"),
                &imu[name],
                START_NS,
                0,
            );
        }
        same(
            &file,
            &columns,
            "/imu/data.angular_velocity.y",
            &imu["gy"],
            START_NS,
            0,
        );
        same(
            &file,
            &columns,
            "/joints.velocity.left",
            &drive["speed"],
            START_NS,
            0,
        );
        same(
            &file,
            &columns,
            "/joints.effort.left",
            &drive["torque"],
            START_NS,
            0,
        );
        same(
            &file,
            &columns,
            "/twist.twist.linear.x",
            &drive["speed"],
            START_NS,
            0,
        );
        // without a header the stamp is that of the publication, which was written 2 ms late
        same(
            &file,
            &columns,
            "/pressure.data",
            &clamp["pressure"],
            START_NS + 2_000_000,
            0,
        );
        let late = columns["/imu/data.linear_acceleration.x"]
            .iter()
            .all(|(stamp, arrival, _)| arrival - stamp == 2_000_000);
        assert!(late, "{file}: the arrival is the time of logging");
    }
}

/// Intel and Motorola order, 29 bits, multiplexed signals, floats.
#[test]
fn can_of_python_can_with_the_values_of_cantools() {
    let mut files = vec![("can.log", 0)];
    if cfg!(feature = "blf") {
        // the library has seconds since 1970 as a floating-point number, in steps of 0.24 µs, and so has the writer
        files.extend([("can.blf", 500), ("can.asc", 480)]);
    }
    for (file, within_ns) in files {
        let columns = read(file);
        for name in [
            "Acc_X", "Acc_Z", "Gyro_Y", "Torque1", "Speed1", "Torque2", "Clamp_p",
        ] {
            let written = &expected(&format!("can_{name}"))[name];
            let from = match file {
                "can.asc" => columns["Clamp_p"][0].0,
                _ => START_NS,
            };
            same(file, &columns, name, written, from, within_ns);
        }
    }
}

/// Every DBC file in the sources of cantools: random frames have the values that cantools decodes, and no others.
#[test]
#[ignore = "needs a folder that reference/dbc_of_cantools.py makes; .ci/run does it"]
fn dbc_files_of_cantools() {
    let folder = std::env::var_os("MONORIG_DBC_FOLDER").expect("MONORIG_DBC_FOLDER");
    let (mut signals, mut wrong) = (0, Vec::new());
    for entry in std::fs::read_dir(folder).unwrap() {
        let written = entry.unwrap().path();
        if written.extension().is_none_or(|e| e != "csv") {
            continue;
        }
        let mut expected: BTreeMap<String, Vec<(i64, f64)>> = BTreeMap::new();
        for line in std::fs::read_to_string(&written).unwrap().lines() {
            let [t, name, value] = line.split(',').collect::<Vec<_>>()[..] else {
                panic!("{line}");
            };
            let sample = (t.parse().unwrap(), value.parse().unwrap());
            expected.entry(name.to_owned()).or_default().push(sample);
        }
        let options = ReadOptions {
            dbc: Some(written.with_extension("dbc")),
            ..ReadOptions::default()
        };
        let columns = read_with(&written.with_extension("log"), &options);
        let columns = columns.unwrap_or_else(|e| panic!("{}: {e}", written.display()));
        for (name, written_values) in &expected {
            let found = columns.get(name).map_or(&[][..], Vec::as_slice);
            let finite = found.iter().filter(|(.., x)| x.is_finite());
            let near = |((t, _, x), (u, y)): (&(i64, i64, f64), &(i64, f64))| {
                t == u && (x - y).abs() <= 1e-12 * y.abs().max(1.0)
            };
            let same = finite.clone().count() == written_values.len()
                && finite.zip(written_values).all(near);
            signals += 1;
            if !same {
                wrong.push(format!("{}: {name}", written.display()));
            }
        }
    }
    assert!(signals > 500 && wrong.is_empty(), "{signals}: {wrong:#?}");
}

#[test]
fn parquet_of_pyarrow_and_pandas() {
    for packed in ["none", "snappy", "zstd", "gzip"] {
        let file = format!("pyarrow_{packed}.parquet");
        let columns = read(&file);
        for (name, written) in &expected("imu") {
            same(&file, &columns, name, written, 0, 0);
        }
        assert!(!columns.contains_key("label"), "a column of text was read");
    }
    let file = "pandas_datetime.parquet";
    let (columns, mut drive) = (read(file), expected("drive"));
    same(file, &columns, "torque", &drive["torque"], START_NS, 0);
    drive.get_mut("speed").unwrap().remove(3); // there it has none
    same(file, &columns, "speed", &drive["speed"], START_NS, 0);
}

#[test]
fn mat_of_scipy_and_h5py() {
    let (imu, drive, clamp) = (expected("imu"), expected("drive"), expected("clamp"));
    for file in ["scipy_plain.mat", "scipy_deflate.mat", "h5py_73.mat"] {
        let columns = read(file);
        for (name, written) in [
            ("acc_1", "ax"),
            ("acc_2", "ay"),
            ("acc_3", "az"),
            ("gy", "gy"),
        ] {
            same(file, &columns, name, &imu[written], 0, 0);
        }
        for name in ["torque", "speed"] {
            same(file, &columns, &format!("drive.{name}"), &drive[name], 0, 0);
        }
        same(file, &columns, "valve.Data", &clamp["pressure"], 0, 0);
    }
}

/// Random files, plain, compressed and of version 7.3: every value is read as it was written, and no others.
#[test]
#[ignore = "needs a folder that reference/mat_of_scipy.py makes; .ci/run does it"]
fn mat_files_of_scipy() {
    let folder = std::env::var_os("MONORIG_MAT_FOLDER").expect("MONORIG_MAT_FOLDER");
    let mut signals = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let file = entry.unwrap().path();
        if file.extension().is_none_or(|e| e != "mat") {
            continue;
        }
        let mut expected: BTreeMap<String, Vec<(i64, f64)>> = BTreeMap::new();
        for line in std::fs::read_to_string(file.with_extension("csv"))
            .unwrap()
            .lines()
        {
            let [t, name, bits] = line.split(',').collect::<Vec<_>>()[..] else {
                panic!("{line}");
            };
            let sample = (t.parse().unwrap(), f64::from_bits(bits.parse().unwrap()));
            expected.entry(name.to_owned()).or_default().push(sample);
        }
        let what = file.display().to_string();
        let columns = read_with(&file, &ReadOptions::default()).unwrap();
        for (name, written) in &expected {
            same(&what, &columns, name, written, 0, 0);
        }
        signals += expected.len();
        let is_known = |name: &&String| {
            expected
                .keys()
                .any(|k| k.rsplit('.').next() == name.rsplit('.').next())
        };
        assert!(
            columns.keys().all(|name| is_known(&name)),
            "{what}: {:?}",
            columns.keys()
        );
    }
    assert!(signals > 300, "{signals}");
}

#[test]
fn csv_of_pandas() {
    let imu = expected("imu");
    let options = ReadOptions {
        time: Some("Zeit".into()),
        ..ReadOptions::default()
    };
    for file in [
        "comma.csv",
        "comma_bom.csv",
        "semicolon_decimal_comma.csv",
        "semicolon_latin1.csv",
    ] {
        let columns = read_with(&data(file), &options).unwrap();
        same(file, &columns, "Beschl. X [m/s²]", &imu["ax"], 0, 0);
        same(file, &columns, "Drehrate Y [rad/s]", &imu["gy"], 0, 0);
    }
    let told = read_with(&data("utf16.csv"), &options)
        .unwrap_err()
        .to_string();
    assert!(told.contains("UTF-16"), "{told}");
}

/// Every file cut short anywhere is refused, or read up to there where the format is lines of text; never a panic.
#[test]
fn files_that_break_off() {
    let dir = tempfile::tempdir().unwrap();
    for file in [
        "asammdf_410_plain.mf4",
        "asammdf_420_deflate.mf4",
        "json_lz4.mcap",
        "cdr_none.mcap",
        "pyarrow_snappy.parquet",
        "scipy_plain.mat",
        "scipy_deflate.mat",
        "h5py_73.mat",
    ] {
        let whole = std::fs::read(data(file)).unwrap();
        for share in [0, 1, 30, 50, 70, 95] {
            let path = dir.path().join(file);
            std::fs::write(&path, &whole[..whole.len() * share / 100]).unwrap();
            let read = read_with(&path, &ReadOptions::default());
            let Err(e) = read else {
                panic!("{file} cut to {share} % was read")
            };
            assert!(e.to_string().contains(file), "{e}");
        }
    }
}

#[test]
fn mistakes_are_told_with_file_and_place() {
    let dir = tempfile::tempdir().unwrap();
    let told = |name: &str, text: &[u8], options: &ReadOptions| {
        let path = dir.path().join(name);
        std::fs::write(&path, text).unwrap();
        read_with(&path, options).unwrap_err().to_string()
    };
    let all = ReadOptions::default();
    let wanted = |column: &str| ReadOptions {
        wanted: Some([column.to_owned()].into()),
        ..ReadOptions::default()
    };
    for (name, text, options, words) in [
        (
            "a.csv",
            &b"t,x\n0,1\n0.1\n"[..],
            &all,
            &["a.csv:3", "1 values"][..],
        ),
        (
            "b.csv",
            b"t,x\n0,1\n0.1,fast\n",
            &wanted("x"),
            &["b.csv:3:5", "`fast`", "`x`"],
        ),
        (
            "c.csv",
            b"t,x\n0,1\nnoon,1\n",
            &all,
            &["c.csv:3:1", "`noon`"],
        ),
        (
            "d.csv",
            b"x,y\n0,1\n",
            &all,
            &["d.csv:1", "has the name of a time"],
        ),
        ("e.csv", b"t,x,x\n0,1,1\n", &all, &["e.csv:1", "twice"]),
        ("f.csv", b"", &all, &["f.csv", "empty"]),
        (
            "g.mcap",
            b"t,x\n0,1\n",
            &all,
            &["g.mcap", "not in the format MCAP"],
        ),
        ("h.mf4", b"PAR1", &all, &["h.mf4"]),
        (
            "i.parquet",
            b"MDF",
            &all,
            &["i.parquet", "not in the format Parquet"],
        ),
        (
            "j.log",
            b"(1.0) can0 100#00\n(1.1) can0 100#0\n",
            &ReadOptions {
                dbc: Some(data("crane.dbc")),
                ..all.clone()
            },
            &["j.log:2", "not a frame"],
        ),
        (
            "k.log",
            b"(1.0) can0 123#00\n",
            &ReadOptions {
                dbc: Some(data("crane.dbc")),
                ..all.clone()
            },
            &["k.log", "none of the 1 frames"],
        ),
        (
            "l.log",
            b"(1.0) can0 123#00\n",
            &all,
            &["l.log", "database"],
        ),
        (
            "m.csv",
            b"t,x\n0,1e999\n",
            &wanted("x"),
            &["m.csv:2:3", "is no number"],
        ),
    ] {
        let told = told(name, text, options);
        assert!(words.iter().all(|w| told.contains(w)), "{name}: {told}");
    }
}

/// A broken file is recognised by its first bytes or its ending: its reader refuses it in its own words, and a program
/// that was built without this reader names the format and the feature.
#[test]
fn a_broken_file_is_refused_as_one_of_its_format() {
    let dir = tempfile::tempdir().unwrap();
    let (blf, can) = (cfg!(feature = "blf"), cfg!(feature = "can"));
    let (mdf, mcap) = (cfg!(feature = "mdf"), cfg!(feature = "mcap"));
    let frames = "a log of CAN frames needs a database";
    for (name, bytes, is_built, own, absent) in [
        (
            "drive.log",
            "LOGG\0\0",
            blf,
            "this BLF file",
            ["BLF", "blf"],
        ),
        ("bus.asc", "date Mon Nov 23", blf, "CAN", ["ASC", "blf"]),
        (
            "bus.log",
            "(1.0) can0 100#00",
            can,
            frames,
            ["candump", "can"],
        ),
        (
            "drive.mf4",
            "MDF     4.10",
            mdf,
            "this MDF file",
            ["MDF4", "mdf"],
        ),
        (
            "drive.mcap",
            "\u{89}MCAP0\r\n",
            mcap,
            "this MCAP file",
            ["MCAP", "mcap"],
        ),
    ] {
        let path = dir.path().join(name);
        // the letters up to ÿ are the bytes
        let bytes: Vec<u8> = bytes.chars().map(|c| u8::try_from(c).unwrap()).collect();
        std::fs::write(&path, bytes).unwrap();
        let refused = scan(&path, &ReadOptions::default(), &mut |_| true);
        let refused = refused.unwrap_err().to_string();
        let [format, feature] = absent;
        let words = match is_built {
            true => vec![own.to_owned()],
            false => vec![
                format!("the format {format},"),
                format!("feature `{feature}`"),
            ],
        };
        assert!(
            words.iter().all(|w| refused.contains(w)),
            "{name}: {refused}"
        );
    }
}
