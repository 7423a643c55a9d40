//! Logs as strangers write them: each is read right, or refused with its place.

use monorig_logs::read::{ReadOptions, full_name, scan};
use monorig_testing::Random;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// By `table.column` the stamps, ns, and values of all rows.
type Columns = BTreeMap<String, Vec<(i64, f64)>>;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn put(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }
}

fn read(path: &Path, options: &ReadOptions) -> Result<Columns, String> {
    let mut columns = Columns::new();
    let all = scan(path, options, &mut |chunk| {
        for row in &chunk.rows {
            let table = &chunk.tables[row.table as usize];
            for (column, value) in table.columns.iter().zip(chunk.values_of(row)) {
                let of = columns.entry(full_name(&table.name, &column.name));
                of.or_default().push((row.stamp_ns, *value));
            }
        }
        true
    });
    all.map(|()| columns).map_err(|e| e.to_string())
}

/// A whole number below `n`.
fn below(random: &mut Random, n: usize) -> u64 {
    random.below(n) as u64
}

fn wanted(names: &[&str]) -> ReadOptions {
    ReadOptions {
        wanted: Some(names.iter().map(|n| (*n).to_owned()).collect()),
        ..ReadOptions::default()
    }
}

/// In a table with decimal commas a point before three digits is refused at its line, wherever the comma stands; in a
/// table without it is a decimal point.
#[test]
fn a_point_between_thousands_is_no_decimal_point() {
    let folder = Folder::new();
    let mut random = Random::new(1);
    for _ in 0..50 {
        let (rows, at) = (20, below(&mut random, 20));
        let (comma_at, number) = (below(&mut random, 20), 1000 + below(&mut random, 900_000));
        let (thousands, rest) = (number / 1000, number % 1000);
        let mut text = "t;speed;torque\n".to_owned();
        for k in 0..rows {
            let speed = if k == comma_at { "1,5" } else { "2" };
            let torque = match k == at {
                true => format!("{thousands}.{rest:03}"),
                false => "7".into(),
            };
            let _ = writeln!(text, "{k};{speed};{torque}");
        }
        let path = folder.put("a.csv", &text);
        let refused = read(&path, &ReadOptions::default()).unwrap_err();
        let place = format!("a.csv:{}:", at + 2);
        assert!(refused.contains(&place), "{refused}, not at {place}");
        assert!(refused.contains("thousands"), "{refused}");
        let points = folder.put("b.csv", text.replace("1,5", "1.5"));
        let torque = &read(&points, &ReadOptions::default()).unwrap()["torque"];
        let decimal: f64 = format!("{thousands}.{rest:03}").parse().unwrap();
        assert_eq!(torque[at as usize].1, decimal);
    }
    let small = folder.put("c.csv", "t;v\n0;0.125\n1;0,5\n");
    assert_eq!(
        read(&small, &ReadOptions::default()).unwrap()["v"][0].1,
        0.125
    );
}

/// A time of day goes on over midnight; a column of dates beside it says the day; a line `sep=,` is no line of names.
#[test]
fn a_time_of_day_goes_over_midnight() {
    let folder = Folder::new();
    let time = |k: i64| {
        let s = (86_398 + k) % 86_400;
        format!("{:02}:{:02}:{:02}.000", s / 3600, s / 60 % 60, s % 60)
    };
    let (mut alone, mut dated) = ("sep=,\ntime,v\n".to_owned(), "Date,Time,v\n".to_owned());
    for k in 0..100_000_i64 {
        if k % 1000 < 5 {
            let _ = writeln!(alone, "{},{k}", time(k));
            let day = 23 + (86_398 + k) / 86_400;
            let _ = writeln!(dated, "2026-11-{day},{},{k}", time(k));
        }
    }
    for text in [alone, dated] {
        let path = folder.put("a.csv", text);
        let v = &read(&path, &ReadOptions::default()).unwrap()["v"];
        assert_eq!(v.len(), 500);
        let origin = v[0].0;
        for (t, k) in v {
            assert_eq!(t - origin, *k as i64 * 1_000_000_000);
        }
    }
}

const BUS: &str = "VERSION \"\"\nNS_ :\nBS_:\nBU_: ECU\n";

fn bus(dbc: &str, log: &str, options: ReadOptions) -> Result<Columns, String> {
    let folder = Folder::new();
    let options = ReadOptions {
        dbc: Some(folder.put("bus.dbc", format!("{BUS}{dbc}"))),
        ..options
    };
    read(&folder.put("bus.log", log), &options)
}

/// Signals for ranges of a multiplexer, and below a multiplexer that is itself multiplexed, are there in the frames in
/// which both numbers are among theirs; drawn ranges.
#[test]
fn multiplexing_by_ranges_and_of_any_depth() {
    let mut random = Random::new(2);
    for _ in 0..30 {
        let mut range = || {
            let from = below(&mut random, 6);
            from..=from + below(&mut random, 6)
        };
        let (outer, inner, second) = (range(), range(), range());
        let mut dbc = "BO_ 512 M: 8 ECU\n SG_ A M : 0|8@1+ (1,0) [0|0] \"\" ECU\n".to_owned();
        dbc += &format!(" SG_ B m{}M : 8|8@1+ (1,0) [0|0] \"\" ECU\n", outer.start());
        dbc += &format!(" SG_ C m{} : 16|8@1+ (1,0) [0|0] \"\" ECU\n", inner.start());
        let list = |r: &std::ops::RangeInclusive<u64>| format!("{}-{}", r.start(), r.end());
        dbc += &format!("SG_MUL_VAL_ 512 B A {};\n", list(&outer));
        dbc += &format!("SG_MUL_VAL_ 512 C B {}, {};\n", list(&inner), list(&second));
        let mut log = String::new();
        for k in 0..144_u64 {
            let _ = writeln!(log, "({k}.0) can0 200#{:02X}{:02X}{k:02X}", k / 12, k % 12);
        }
        let columns = bus(&dbc, &log, ReadOptions::default()).unwrap();
        for k in 0..144_u64 {
            let (a, b) = (k / 12, k % 12);
            let has_b = outer.contains(&a);
            let has_c = has_b && (inner.contains(&b) || second.contains(&b));
            for (name, has, value) in [("M.B", has_b, b), ("M.C", has_c, k)] {
                let x = columns[name][k as usize].1;
                assert_eq!(x.is_finite(), has, "{name} at {a}, {b}: {dbc}");
                assert!(!has || x == value as f64);
            }
        }
    }
}

/// A signal that cannot be is refused where it is asked for, and nothing else of the bus is.
#[test]
fn a_signal_that_nobody_asks_for_refuses_no_bus() {
    let dbc = "BO_ 256 Good: 8 ECU\n SG_ V : 0|8@1+ (1,0) [0|0] \"\" ECU\nBO_ 257 Bad: 8 ECU\n \
               SG_ W : 0|80@1+ (1,0) [0|0] \"\" ECU\n";
    let log = "(1.0) can0 100#07\n(1.1) can0 101#07\n";
    for options in [ReadOptions::default(), wanted(&["Good.V"])] {
        assert_eq!(bus(dbc, log, options).unwrap()["Good.V"][0].1, 7.0);
    }
    let refused = bus(dbc, log, wanted(&["Bad.W"])).unwrap_err();
    assert!(refused.contains("`W` of `Bad` has 80 bits"), "{refused}");
}

/// A message of J1939 is found by its parameter group, whatever the priority, the sender and, below F000, the receiver.
/// Frames of another group are not, and another bus keeps its identifiers.
#[test]
fn j1939_goes_by_parameter_group() {
    let mut random = Random::new(3);
    let dbc = |id: u64| {
        let id = id | 0x8000_0000;
        format!("BO_ {id} M: 8 Vector__XXX\n SG_ V : 0|8@1+ (1,0) [0|0] \"\" Vector__XXX\n")
    };
    for _ in 0..100 {
        let (group, low) = (below(&mut random, 0x100), below(&mut random, 0x100));
        let (priority, sender) = (below(&mut random, 8), below(&mut random, 0xFE));
        // the receiver of a frame to one is another one than in the database
        let receiver = if group < 0xF0 { 0xFF - low } else { low };
        let id =
            |priority: u64, low: u64, sender: u64| priority << 26 | group << 16 | low << 8 | sender;
        let frame = |id: u64| format!("(1.0) can0 {id:08X}#2A\n");
        let log = frame(id(priority, receiver, sender));
        let columns = bus(&dbc(id(6, low, 0xFE)), &log, ReadOptions::default()).unwrap();
        assert_eq!(columns["M.V"][0].1, 42.0);
        let other = frame(id(priority, receiver, sender) ^ 0x0100_0000);
        assert!(bus(&dbc(id(6, low, 0xFE)), &other, ReadOptions::default()).is_err());
        if priority != 6 {
            let of_others = bus(&dbc(id(6, low, 0x10)), &log, ReadOptions::default());
            assert!(
                of_others.is_err(),
                "an identifier of a bus that is not J1939"
            );
        }
        let two = log.clone() + &frame(id(priority, receiver, sender ^ 1));
        let refused = bus(&dbc(id(6, low, 0xFE)), &two, wanted(&["M.V"])).unwrap_err();
        assert!(refused.contains("others from"), "{refused}");
    }
}

/// Lines of the screen with a time are those of `candump -L`; without one they are refused by name.
#[test]
fn candump_as_on_the_screen() {
    let dbc = "BO_ 256 S: 8 ECU\n SG_ V : 0|16@1+ (1,0) [0|0] \"\" ECU\n";
    let mut random = Random::new(4);
    let (mut log, mut screen) = (String::new(), String::new());
    for k in 0..50 {
        let bytes: Vec<u64> = (0..2 + below(&mut random, 7))
            .map(|_| below(&mut random, 256))
            .collect();
        let words: Vec<String> = bytes.iter().map(|b| format!("{b:02X}")).collect();
        let _ = writeln!(log, "({k}.250000) can0 100#{}", words.concat());
        let _ = writeln!(
            screen,
            " ({k}.250000)  can0  100   [{}]  {}",
            words.len(),
            words.join(" ")
        );
    }
    let of = |text: &str| bus(dbc, text, ReadOptions::default());
    assert_eq!(of(&screen).unwrap(), of(&log).unwrap());
    let remote = screen.clone() + " (50.25)  can0  100   [2]  remote request\n";
    assert_eq!(of(&remote).unwrap(), of(&log).unwrap());
    let refused = of("  can0  100   [2]  08 07\n").unwrap_err();
    assert!(
        refused.contains("lines with a time") && refused.contains(":1:"),
        "{refused}"
    );
}

/// A dictionary of numbers in Parquet is the column of its numbers.
#[test]
fn parquet_dictionaries() {
    use arrow_array::{ArrayRef, DictionaryArray, Float64Array, Int8Array, RecordBatch};
    use std::sync::Arc;
    let values: ArrayRef = Arc::new(Float64Array::from(vec![Some(1.5), None, Some(-2.0)]));
    let keys = Int8Array::from(vec![Some(2), Some(0), None, Some(1), Some(0)]);
    let coded: ArrayRef = Arc::new(DictionaryArray::new(keys, values));
    let t: ArrayRef = Arc::new(Float64Array::from(vec![0.0, 0.1, 0.2, 0.3, 0.4]));
    let batch = RecordBatch::try_from_iter_with_nullable([("t", t, false), ("v", coded, true)]);
    let folder = Folder::new();
    let path = folder.put("a.parquet", "");
    let batch = batch.unwrap();
    let file = std::fs::File::create(&path).unwrap();
    let mut writer = parquet::arrow::ArrowWriter::try_new(file, batch.schema(), None).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
    let v = &read(&path, &ReadOptions::default()).unwrap()["v"];
    let shown: Vec<String> = v.iter().map(|(_, x)| x.to_string()).collect();
    assert_eq!(shown, ["-2", "1.5", "NaN", "NaN", "1.5"]);
}

/// Messages of topics: name, schema, encoding, content; logged at a second each.
fn mcap_of(messages: &[(&str, &str, &str, Vec<u8>)]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::Writer::new(&mut bytes).unwrap();
    for (k, (topic, schema, encoding, data)) in (1..).zip(messages) {
        let schema = writer.add_schema(schema, "none", b"").unwrap();
        let channel = writer.add_channel(schema, topic, encoding, &BTreeMap::new());
        let header = mcap::records::MessageHeader {
            channel_id: channel.unwrap(),
            sequence: k,
            log_time: u64::from(k) * 1_000_000_000,
            publish_time: u64::from(k) * 1_000_000_000,
        };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

/// `NaN` and `Infinity` of JSON are no values; within a text they are letters. A topic that nobody asks for refuses
/// nothing.
#[test]
fn json_that_is_none() {
    let folder = Folder::new();
    let json = |text: &str| ("/gps", "Fix", "json", text.as_bytes().to_vec());
    let log = mcap_of(&[
        json(r#"{"note": "NaN \" Infinity", "lat": NaN, "up": -Infinity, "n": 1}"#),
        json(r#"{"note": "\\", "lat": 51.5, "up": Infinity, "n": 2}"#),
        json(r#"{"lat": null, "up": 3.5, "n": 3}"#),
    ]);
    let columns = read(&folder.put("a.mcap", log), &ReadOptions::default()).unwrap();
    let shown = |name: &str| -> Vec<String> {
        let each = columns[name].iter();
        each.map(|(_, x)| x.to_string()).collect()
    };
    assert_eq!(shown("/gps.lat"), ["NaN", "51.5", "NaN"]);
    assert_eq!(shown("/gps.up"), ["NaN", "NaN", "3.5"]);
    assert_eq!(shown("/gps.n"), ["1", "2", "3"]);

    let wheels = ("/wheels", "Wheels", "json", br#"{"v": 1.5}"#.to_vec());
    let broken = folder.put("b.mcap", mcap_of(&[wheels, json("{ no JSON")]));
    let v = &read(&broken, &wanted(&["/wheels.v"])).unwrap()["/wheels.v"];
    assert_eq!(v[0].1, 1.5);
    for options in [wanted(&["/gps.lat", "/wheels.v"]), ReadOptions::default()] {
        let refused = read(&broken, &options).unwrap_err();
        assert!(
            refused.contains("a message of /gps is not JSON"),
            "{refused}"
        );
    }
}

/// A header whose stamp is zero has the time of publication.
#[test]
fn stamps_of_zero_are_none() {
    let twist = |s: u32, v: f64| {
        let mut data = vec![0, 1, 0, 0];
        data.extend(s.to_le_bytes());
        data.extend(0_u32.to_le_bytes());
        data.extend(1_u32.to_le_bytes());
        data.push(0);
        data.extend([0; 3]);
        for x in [v, 0.0, 0.0, 0.0, 0.0, 0.0] {
            data.extend(x.to_le_bytes());
        }
        ("/v", "geometry_msgs/msg/TwistStamped", "cdr", data)
    };
    let log = mcap_of(&[twist(0, 1.0), twist(0, 2.0), twist(3, 3.0)]);
    let folder = Folder::new();
    let columns = read(&folder.put("a.mcap", log), &ReadOptions::default()).unwrap();
    let s = 1_000_000_000;
    let expected = [(s, 1.0), (2 * s, 2.0), (3 * s, 3.0)];
    assert_eq!(columns["/v.twist.linear.x"], expected);
}

/// The speed of an odometry, of either byte order, is read as it was written.
#[test]
fn odometry_has_a_speed() {
    let mut random = Random::new(9);
    for big in [false, true] {
        let speed = 10.0 * random.unit();
        let number = |x: f64| match big {
            true => x.to_be_bytes(),
            false => x.to_le_bytes(),
        };
        let whole = |x: u32| match big {
            true => x.to_be_bytes(),
            false => x.to_le_bytes(),
        };
        let mut data = vec![0, u8::from(!big), 0, 0];
        let begins = data.len();
        [5, 0].iter().for_each(|x| data.extend(whole(*x)));
        for name in ["odom\0", "base_link\0"] {
            while !(data.len() - begins).is_multiple_of(4) {
                data.push(0);
            }
            data.extend(whole(name.len() as u32));
            data.extend(name.as_bytes());
        }
        while !(data.len() - begins).is_multiple_of(8) {
            data.push(0);
        }
        for k in 0..3 + 4 + 36 + 6 + 36 {
            data.extend(number(if k == 43 { speed } else { f64::from(k) }));
        }
        let folder = Folder::new();
        let log = folder.put(
            "a.mcap",
            mcap_of(&[("/odom", "nav_msgs/msg/Odometry", "cdr", data)]),
        );
        let columns = read(&log, &ReadOptions::default()).unwrap();
        assert_eq!(
            columns["/odom.twist.twist.linear.x"],
            [(5_000_000_000, speed)]
        );
        assert_eq!(columns["/odom.pose.pose.position.z"][0].1, 2.0);
    }
}

/// A counter of so many bits goes on where it begins anew, however often.
#[test]
fn counters_that_begin_anew_go_on() {
    let folder = Folder::new();
    for (bits, unit, factor) in [
        (16, "ms", 1_000_000_i64),
        (32, "us", 1000),
        (24, "us", 1000),
    ] {
        let (period, mut text) = (1_i64 << bits, format!("t_{unit},v\n"));
        for k in 0..50 {
            let _ = writeln!(text, "{},{k}", (period - 7 + k * period / 10) % period);
        }
        let path = folder.put("a.csv", text);
        let options = ReadOptions {
            unit: serde_json::from_value(unit.into()).ok(),
            wraps: Some(bits),
            ..ReadOptions::default()
        };
        let v = &read(&path, &options).unwrap()["v"];
        for (t, k) in v {
            assert_eq!(*t, (period - 7 + *k as i64 * period / 10) * factor);
        }
        assert_eq!(v.len(), 50);
    }
}

/// A flag of MDF whose values have names is its number; so are values without a name.
#[test]
fn flags_of_mdf_with_names_are_numbers() {
    use falcon_mdf::model::SignalValues;
    use falcon_mdf::{Conversion, Mf4Writer, TableEntry};
    let mut random = Random::new(5);
    let raw: Vec<u8> = (0..100).map(|_| below(&mut random, 4) as u8).collect();
    let times: Vec<f64> = (0..100).map(f64::from).collect();
    let names = Conversion::ValueToText {
        keys: vec![0.0, 1.0, 2.0],
        entries: ["off", "on", "broken"]
            .map(|name| TableEntry::Text(name.to_owned()))
            .to_vec(),
        default: None,
    };
    let mut file = Mf4Writer::with_start_time_ns(0);
    let group = file.add_group(&times).unwrap();
    let values = SignalValues::U8(raw.clone());
    group
        .add_channel_typed_with("brake", "", values, None, Some(names))
        .unwrap();
    let folder = Folder::new();
    let path = folder.put("a.mf4", "");
    file.write_to_file(&path).unwrap();
    let columns = read(&path, &ReadOptions::default()).unwrap();
    let (_, brake) = columns
        .iter()
        .find(|(name, _)| name.ends_with("brake"))
        .unwrap();
    assert!(
        brake
            .iter()
            .zip(&raw)
            .all(|((_, x), raw)| *x == f64::from(*raw))
    );
}

/// A decimal comma between quotes in a table separated by commas is named; so are frames of a bus in MDF with a
/// database.
#[test]
fn what_is_not_read_is_named() {
    let folder = Folder::new();
    let commas = folder.put("a.csv", "\"Zeit [s]\",\"v\"\n\"0,00\",\"3,00\"\n");
    let refused = read(&commas, &ReadOptions::default()).unwrap_err();
    assert!(
        refused.contains("a.csv:2:") && refused.contains("a decimal point where"),
        "{refused}"
    );

    let mut file = falcon_mdf::Mf4Writer::with_start_time_ns(0);
    let group = file.add_group(&[0.0, 0.1]).unwrap();
    let ids = falcon_mdf::model::SignalValues::U16(vec![0x100, 0x100]);
    group
        .add_channel_typed("CAN_DataFrame.ID", "", ids)
        .unwrap();
    let path = folder.put("a.mf4", "");
    file.write_to_file(&path).unwrap();
    assert!(read(&path, &ReadOptions::default()).is_ok());
    let options = ReadOptions {
        dbc: Some(folder.put("bus.dbc", BUS)),
        ..ReadOptions::default()
    };
    let refused = read(&path, &options).unwrap_err();
    assert!(refused.contains("frames of a CAN bus"), "{refused}");
}

/// Lines before the names of columns are passed over, whether something is separated in them or not: the line of names
/// is the one with a time.
#[test]
fn heads_of_measuring_programs_are_passed_over() {
    let folder = Folder::new();
    let mut random = Random::new(2);
    for _ in 0..50 {
        let mut text = String::new();
        for k in 0..below(&mut random, 8) {
            text += [
                "Tool\tVersion\n",
                "***End***\t\n",
                "\n",
                "Author\n",
                "Separator\tTab\n",
            ][(k as usize * 3 + below(&mut random, 5) as usize) % 5];
        }
        let (names, options) = match below(&mut random, 3) {
            0 => ("X_Value\tv", ReadOptions::default()),
            1 => ("Zeit [s]\tv", ReadOptions::default()),
            _ => {
                let time = Some("Abtastung".into());
                (
                    "Abtastung\tv",
                    ReadOptions {
                        time,
                        ..ReadOptions::default()
                    },
                )
            }
        };
        let log = folder.put("a.lvm", format!("{text}{names}\n0,00\t3,00\n0,05\t3,10\n"));
        let v = &read(&log, &options).unwrap()["v"];
        assert_eq!(v.as_slice(), [(0, 3.0), (50_000_000, 3.1)], "{text}{names}");
    }
}

/// Topics of types that are not read are counted by name and type.
#[test]
fn topics_that_are_not_read_are_counted() {
    let path = || ("/path", "nav_msgs/msg/Path", "cdr", vec![0, 1, 0, 0]);
    let wheels = ("/wheels", "Wheels", "json", br#"{"v": 1.5}"#.to_vec());
    for (messages, rows, times) in [
        (vec![path(), path(), path()], 0, 3),
        (vec![path(), wheels, path()], 1, 2),
    ] {
        let folder = Folder::new();
        let log = folder.put("a.mcap", mcap_of(&messages));
        let found = monorig_logs::check::inspect(&log, &ReadOptions::default()).unwrap();
        let what = "topic /path: cdr nav_msgs/msg/Path".to_owned();
        assert_eq!(found.unread, [(what, times)].into());
        assert_eq!(found.tables.iter().map(|t| t.rows).sum::<u64>(), rows);
    }
}
