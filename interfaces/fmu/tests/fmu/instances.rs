//! Many instances in one process.

use crate::common::{exported, imported, scenario, steps};
use monorig_fmu::Fmi;
use monorig_sim::config::scenario::Settings;

/// Made and freed two thousand times, an instance takes no more memory and no more open files than once. The count runs
/// in a process of its own: other tests take memory, too.
#[test]
fn two_thousand_instances_take_the_memory_of_one() {
    let mut alone = std::process::Command::new(std::env::current_exe().unwrap());
    let alone = alone.args(["instances::alone", "--exact", "--ignored"]);
    let out = alone.output().unwrap();
    let told = String::from_utf8_lossy(&out.stdout);
    assert!(out.status.success(), "{told}");
    assert!(told.contains("1 passed"), "{told}");
}

#[test]
#[ignore = "no test: the process that another starts"]
fn alone() {
    let resident = || {
        let status = std::fs::read_to_string("/proc/self/status").unwrap();
        let of = |key: &str| {
            let line = status.lines().find(|l| l.starts_with(key)).unwrap();
            line.split_whitespace()
                .nth(1)
                .unwrap()
                .parse::<u64>()
                .unwrap()
        };
        of("VmRSS:") / 1024
    };
    let open = || std::fs::read_dir("/proc/self/fd").unwrap().count();
    let (vehicle, steps) = steps("minimal.yaml", 0.1);
    let folder = tempfile::tempdir().unwrap();
    for fmi in [Fmi::Two, Fmi::Three] {
        let settings = Settings::of_type("rail_fusion");
        let file = exported(&settings, &scenario("minimal.yaml"), fmi, folder.path());
        let once = || {
            let mut estimator = imported(&file).build(&vehicle, &[]).unwrap();
            for (z, u, dt) in &steps {
                estimator.step(z, u, *dt).unwrap();
            }
        };
        (0..50).for_each(|_| once());
        let before = (resident(), open());
        (0..2000).for_each(|_| once());
        let after = (resident(), open());
        let more = after.0.saturating_sub(before.0);
        assert!(more < 8, "{more} MB more");
        assert_eq!(before.1, after.1, "open files");
    }
}
