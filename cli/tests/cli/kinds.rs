//! `check` tells the kinds of files apart.

use crate::common::TestFolder;

/// Every kind by itself, and as the kind it is not.
#[test]
fn kinds_are_told_apart() {
    let dir = TestFolder::new();
    for (file, kind) in [
        ("scenario.yaml", "scenario"),
        ("track.yaml", "track"),
        ("surveyed.yaml", "track"),
        ("train.yaml", "train"),
        ("units/drive_unit.yaml", "unit"),
        ("units/load_block.yaml", "unit"),
        ("units/carrier_trolley.yaml", "unit"),
        ("units/cab.yaml", "unit"),
        ("sensors.yaml", "sensors"),
        ("rails/i140e.yaml", "rail-profile"),
        ("road/hongqi_ehs3.yaml", "car"),
    ] {
        let (code, out, err) = dir.monorig(&["check", file]);
        assert_eq!(
            (code, out.as_str()),
            (Some(0), format!("{file}: {kind} ok\n").as_str()),
            "{err}"
        );
        for other in [
            "scenario",
            "track",
            "train",
            "unit",
            "sensors",
            "rail-profile",
            "car",
            "parameters",
            "tuning",
        ] {
            if other != kind {
                let told = dir.refused(&["check", "--kind", other, file]);
                assert!(told.contains(file) && told.contains("help:"), "{told}");
            }
        }
    }
}
