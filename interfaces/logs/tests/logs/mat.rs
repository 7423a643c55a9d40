//! MAT files byte by byte, and what is told of those that are no logs.

use monorig_logs::read::{ReadOptions, full_name, scan};
use std::path::Path;

/// Text in 116 bytes, no data of objects in 8, version 1, lowest byte first.
fn header() -> Vec<u8> {
    let mut bytes = b"MATLAB 5.0 MAT-file, by hand".to_vec();
    bytes.resize(124, b' ');
    bytes.extend([0x00, 0x01, b'I', b'M']);
    bytes
}

/// `t = [0; 1; 2]`, as MATLAB writes it: doubles that fit into bytes are bytes.
#[rustfmt::skip]
const TIME: [u8; 56] = [
    14, 0, 0, 0, 48, 0, 0, 0, // a matrix of 48 bytes
    6, 0, 0, 0, 8, 0, 0, 0, 6, 0, 0, 0, 0, 0, 0, 0, // UINT32, 8 bytes: class 6 (double), no flags
    5, 0, 0, 0, 8, 0, 0, 0, 3, 0, 0, 0, 1, 0, 0, 0, // INT32, 8 bytes: 3 rows, 1 column
    1, 0, 1, 0, b't', 0, 0, 0, // INT8, 1 byte in the tag: the name
    2, 0, 3, 0, 0, 1, 2, 0, // UINT8, 3 bytes in the tag: the numbers
];

/// `log.v = [1.5 -2 0.1]`: a struct with one field, a row.
#[rustfmt::skip]
const LOG: [u8; 152] = [
    14, 0, 0, 0, 144, 0, 0, 0, // a matrix of 144 bytes
    6, 0, 0, 0, 8, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, // class 2 (struct)
    5, 0, 0, 0, 8, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, // 1 x 1
    1, 0, 3, 0, b'l', b'o', b'g', 0, // the name
    5, 0, 4, 0, 8, 0, 0, 0, // INT32, 4 bytes in the tag: 8 bytes for the name of a field
    1, 0, 0, 0, 8, 0, 0, 0, b'v', 0, 0, 0, 0, 0, 0, 0, // INT8, 8 bytes: the names of the fields
    14, 0, 0, 0, 72, 0, 0, 0, // the field: a matrix of 72 bytes
    6, 0, 0, 0, 8, 0, 0, 0, 6, 0, 0, 0, 0, 0, 0, 0, // class 6 (double)
    5, 0, 0, 0, 8, 0, 0, 0, 1, 0, 0, 0, 3, 0, 0, 0, // 1 row, 3 columns
    1, 0, 0, 0, 0, 0, 0, 0, // no name: the struct has it
    9, 0, 0, 0, 24, 0, 0, 0, // DOUBLE, 24 bytes
    0, 0, 0, 0, 0, 0, 0xF8, 0x3F, // 1.5
    0, 0, 0, 0, 0, 0, 0x00, 0xC0, // -2
    0x9A, 0x99, 0x99, 0x99, 0x99, 0x99, 0xB9, 0x3F, // 0.1
];

/// All rows: time in ns, column, value.
fn rows(path: &Path, options: &ReadOptions) -> Result<Vec<(i64, String, f64)>, String> {
    let mut all = Vec::new();
    let read = scan(path, options, &mut |chunk| {
        for row in &chunk.rows {
            let table = &chunk.tables[row.table as usize];
            for (column, x) in table.columns.iter().zip(chunk.values_of(row)) {
                all.push((row.stamp_ns, full_name(&table.name, &column.name), *x));
            }
        }
        true
    });
    read.map(|()| all).map_err(|e| e.to_string())
}

/// The struct has no time of its own: it has that of the top level.
#[test]
fn a_file_by_hand() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("hand.mat");
    let whole = [&header()[..], &TIME, &LOG].concat();
    std::fs::write(&path, &whole).unwrap();
    let v = |s: i64, x: f64| (s * 1_000_000_000, "log.v".to_owned(), x);
    let read = rows(&path, &ReadOptions::default()).unwrap();
    assert_eq!(read, [v(0, 1.5), v(1, -2.0), v(2, 0.1)]);
    for length in 0..whole.len() {
        std::fs::write(&path, &whole[..length]).unwrap();
        let read = rows(&path, &ReadOptions::default());
        // after the time there is a whole file, without a vector beside it
        let is_whole = length == header().len() + TIME.len();
        assert_eq!(read.is_err(), !is_whole, "{length} bytes: {read:?}");
        assert!(is_whole || read.unwrap_err().contains("hand.mat"));
    }
}

#[test]
fn what_is_no_log_says_why() {
    let dir = tempfile::tempdir().unwrap();
    let told = |bytes: &[&[u8]], options: &ReadOptions| {
        let path = dir.path().join("log.mat");
        std::fs::write(&path, bytes.concat()).unwrap();
        rows(&path, options).unwrap_err()
    };
    let (all, header) = (ReadOptions::default(), header());
    let wanted = |names: &[&str]| ReadOptions {
        wanted: Some(names.iter().map(|n| (*n).to_owned()).collect()),
        ..ReadOptions::default()
    };
    let mut opaque = LOG.to_vec();
    opaque[16] = 17; // an object, such as a timetable
    let mut short = LOG;
    short[108] = 2; // `log.v` has two values by its sizes
    let mut two = LOG;
    two[108] = 2;
    two[124] = 16; // and by its data
    let mut big = header.clone();
    big[126..].copy_from_slice(b"MI");
    let mut old = header.clone();
    old[7] = b'7';
    old[9] = b'3';
    for (bytes, options, words) in [
        (
            &[&header[..], &LOG][..],
            &all,
            &["log.v", "no vector of times like `t`", "save('x.mat'"][..],
        ),
        (&[&header, &opaque], &all, &["an object", "timetable"]),
        (&[&header, &TIME, &short], &all, &["breaks off"]),
        (
            &[&header, &TIME, &two],
            &wanted(&["log.v"]),
            &["log.v has the sizes [1, 2]", "`t` has 3 values"],
        ),
        (&[&big, &TIME], &all, &["is damaged", "-v7"]),
        (&[&old, &TIME], &all, &["-v7"]),
        (&[b"no MAT"], &all, &["not in the format MAT", "MATLAB 5.0"]),
    ] {
        let told = told(bytes, options);
        assert!(words.iter().all(|w| told.contains(w)), "{words:?}: {told}");
        assert!(told.contains("log.mat"), "{told}");
    }
}
