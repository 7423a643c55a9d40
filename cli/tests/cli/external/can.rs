//! Estimators on a bus of SocketCAN, where this program is built with the feature `socketcan` and this machine has one.

use super::file;
use crate::common::{TestFolder, words};

/// A bus that there is not has a message, before a run and at the other end; so has a program without SocketCAN.
#[test]
fn a_bus_that_is_not_there_is_refused() {
    let dir = TestFolder::new();
    let at = file("minimal.yaml");
    let at = at.to_str().unwrap();
    let ecu = "estimators={ecu: {external: {can: nocan7}}}";
    for task in [
        &["run", at, "--no-rerun", "--set", ecu][..],
        &["ecu", "rail_fusion", "--scenario", at, "--can", "nocan7"],
    ] {
        let told = words(&dir.refused(task));
        let without = told.contains("this program was built without SocketCAN");
        let with = cfg!(all(feature = "socketcan", target_os = "linux"));
        assert!(
            told.contains("the CAN bus `nocan7` cannot be opened"),
            "{told}"
        );
        assert_eq!(without, !with, "{told}");
    }
}

/// On a bus an estimator with floating-point signals gives the estimates of the same one in the loop.
#[cfg(all(feature = "socketcan", target_os = "linux"))]
#[test]
fn an_estimator_on_a_bus_is_the_same() {
    use super::{OURS, bits, estimate_of, registry, scenario, watch};
    if !std::path::Path::new("/sys/class/net/vcan0").exists() {
        eprintln!("skipped: there is no bus vcan0 here");
        return;
    }
    let scene = file("minimal.yaml");
    let mut ecu = std::process::Command::new(OURS)
        .args(["ecu", "rail_fusion", "--signals", "float"])
        .args(["--can", "vcan0", "--scenario"])
        .arg(&scene)
        .spawn()
        .unwrap();
    let both = "{rail_fusion: {}, ecu: {external: {can: vcan0, signals: float}}}";
    let mut steps = 0;
    let ran = watch(
        scenario("minimal.yaml", both, "10"),
        &registry(),
        &mut |frame| {
            steps += 1;
            let [a, b] = ["rail_fusion", "ecu"].map(|name| estimate_of(frame, name));
            assert!(bits(&a) == bits(&b), "step {steps}:\n{a:?}\n{b:?}");
        },
    );
    ecu.kill().unwrap();
    ecu.wait().unwrap();
    ran.unwrap();
    assert!(steps > 1500, "{steps}");
}
