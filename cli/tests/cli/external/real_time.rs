//! Estimators outside of the program in real time: what comes late, and what does not come.

use super::{ecu, file, registry, scenario, watch};
use crate::common::{TestFolder, words};
use monorig_sim::closed_loop::WallClock;
use std::sync::Arc;
use std::time::Instant;

/// In real time answers that are lost or held up on purpose are found: those lost exactly, and at least as many late,
/// since a busy machine may hold up others.
#[test]
fn answers_that_come_late_or_not_at_all_are_counted() {
    let clock = Arc::new(WallClock::new(0.1));
    let registry = registry().on_clock(Some(clock.clone()));
    let faults = "deadline_ms: 40, faults: {lose_every: 30, delay_every: 70, delay_ms: 150}";
    let ecu =
        ecu("attitude", "minimal.yaml", "fixed").replace("signals: fixed}", &format!("{faults}}}"));
    let mut answers = None;
    let mut steps = 0;
    let ran = watch(
        scenario("minimal.yaml", &format!("{{ecu: {ecu}}}"), "0.8"),
        &registry,
        &mut |frame| {
            let due = clock.due(frame.time_ns as f64 * 1e-9);
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            steps += 1;
            answers = frame.estimators[0].answers();
        },
    );
    let outcome = ran.unwrap();
    let counts = answers.expect("counts of the rig");
    let [asked, late, lost] = [counts.asked, counts.late, counts.lost].map(|n| n as f64);
    assert_eq!(
        asked,
        f64::from(steps - 1),
        "the first one is the beginning"
    );
    let planted = |every: i32| f64::from((steps - 1) / every);
    assert_eq!(lost, planted(30));
    assert!(late >= planted(70), "{late}");
    let [(_, refused, reason)] = &outcome.refusals[..] else {
        panic!("{:?}", outcome.refusals)
    };
    assert_eq!(*refused as f64, late + lost);
    assert_eq!(reason, "the answer did not come in time");
}

/// A run at a pace has the metrics of its answers; if this machine was too busy for the pace, it says so and is no
/// verdict.
#[test]
fn a_run_in_real_time_is_a_verdict_or_says_why_not() {
    let dir = TestFolder::new();
    let at = file("minimal.yaml");
    let ecu = format!(
        "estimators={{ecu: {}}}",
        ecu("attitude", "minimal.yaml", "fixed")
    );
    let task = [
        "run",
        at.to_str().unwrap(),
        "--no-rerun",
        "--pace",
        "8",
        "--set",
        &ecu,
        "--set",
        "stop.after_s=8",
        "--set",
        "integrity={max_misleading_share: 1}",
        "--name",
        "paced",
    ];
    let (code, out, err) = dir.monorig(&task);
    let metrics: serde_json::Value =
        serde_json::from_str(&dir.read("runs/minimal@paced/1/metrics.json")).unwrap();
    let metric = |name: &str| metrics["estimators"]["ecu"][name].as_f64().unwrap();
    let latency = metric("answer_latency_ms_p99");
    assert!(latency > 0.0 && latency < 2000.0, "{latency}");
    assert!(metric("answers_late_share") + metric("answers_lost_share") <= 1.0);
    let told = words(&err).contains("missed its own deadlines: the run does not judge ecu");
    match metric("rig_late_share") > 0.0 {
        true => assert!(code == Some(2) && told, "{out}{err}"),
        false => assert!(code == Some(0) && !told, "{out}{err}"),
    }
}
