//! Scenarios drawn at random, and the bound of one.

use crate::common::{TestFolder, project};

fn dir() -> (TestFolder, String) {
    let ranges = project().join("assets/ranges/roadway.yaml");
    (TestFolder::new(), ranges.display().to_string())
}

#[test]
fn drawn_scenarios_are_whole_and_are_not_replaced() {
    let (dir, ranges) = dir();
    let draw = ["draw", &ranges, "--seed", "7", "--count", "2"];
    assert_eq!(dir.monorig(&draw).0, Some(0));
    let scenarios = ["drawn/drawn_7.yaml", "drawn/drawn_8.yaml"];
    let (code, told, err) = dir.monorig(&["check", scenarios[0], scenarios[1]]);
    assert_eq!(code, Some(0), "{told}{err}");
    let first = dir.read(scenarios[0]);
    assert_eq!(dir.monorig(&draw).0, Some(0));
    assert_eq!(dir.read(scenarios[0]), first);

    let mine = first.replace("seeds:", "# mine\nseeds:");
    dir.write(scenarios[0], mine.as_bytes());
    let told = dir.refused(&draw);
    assert!(
        told.contains("drawn_7.yaml") && told.contains("--out"),
        "{told}"
    );
    assert_eq!(dir.read(scenarios[0]), mine);
}

#[test]
fn bad_ranges_are_refused_with_their_place() {
    let (dir, ranges) = dir();
    let good = std::fs::read_to_string(&ranges).unwrap();
    let folder = project().join("assets");
    let good = good.replace("../", &format!("{}/", folder.display()));
    for (from, to, says) in [
        (
            "speed_mps: [0.4, 2]",
            "speed_mps: [2, 0.4]",
            "from 2 to 0.4",
        ),
        ("straight_share: 0.4", "straight_share: 4", "from 0 to 1"),
        (
            "  rail_fusion: {}",
            "  rail_fusoin: {}",
            "did you mean `rail_fusion`",
        ),
        (
            "  rail_fusion: {}",
            "  rail_fusion: {from: x.yaml}",
            "cannot name a parameter file",
        ),
        ("dx80_176y.yaml", "dx81_176y.yaml", "does not exist"),
    ] {
        assert!(good.contains(from), "{from}");
        dir.write("ranges.yaml", good.replace(from, to).as_bytes());
        for command in [&["draw", "ranges.yaml"][..], &["check", "ranges.yaml"]] {
            let told = dir.refused(command);
            assert!(
                told.contains("ranges.yaml") && told.contains(says),
                "{to}\n{told}"
            );
        }
        assert!(!dir.path("drawn").exists());
    }
}
