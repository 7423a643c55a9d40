//! `monorig report`: whole, well-formed, self-contained pages; clear errors for everything else.

#![allow(clippy::unwrap_used)] // helpers of tests

mod common;

use common::Rig;

/// A quick scenario whose words need escaping; one expectation holds, one does not.
const QUICK: &str = "\
version: 1
why: Is 1 < 2 & 3 > 2?
track: track.yaml
train: train.yaml
start: {chainage_m: 2}
stop: {after_s: 60}
physics: {plant: point-mass}
drive: {speed: [{at_s: 0, mps: 0}, {at_s: 3, mps: 1.5}]}
sensors: sensors.yaml
estimators: {dffrls_aukf: {}, rls_ekf: {}}
events: [{at_s: 20, load_mass_kg: 1500}]
seeds: 1..3
expect:
  - {metric: speed_rmse_mps, at_most: 5}
  - {estimator: rls_ekf, metric: slope_rmse_deg, after_s: 1, at_most: 0.00001}
";

/// All text of a page, read as XML, which is stricter than HTML; a page that is not well-formed panics.
fn text(html: &str) -> String {
    use quick_xml::events::Event;
    let mut reader = quick_xml::Reader::from_str(html);
    let (mut text, mut depth) = (String::new(), 0);
    loop {
        match reader.read_event().unwrap() {
            Event::Start(_) => depth += 1,
            Event::End(_) => depth -= 1,
            Event::Text(t) => text += &t.decode().unwrap(),
            Event::GeneralRef(r) => {
                let name = r.decode().unwrap();
                let character = quick_xml::escape::resolve_predefined_entity(&name);
                text += character.unwrap_or("'");
            }
            Event::Eof => break,
            _ => {}
        }
    }
    assert_eq!(depth, 0);
    text
}

fn self_contained(html: &str) {
    for outside in ["http:", "https:", "src=", "url(", "@import", "<script"] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(html.len() < 2_000_000, "{} bytes", html.len());
}

fn with_run() -> Rig {
    let rig = Rig::new();
    rig.write("quick & dirty.yaml", QUICK.as_bytes());
    let (code, out, err) = rig.monorig(&["run", "quick & dirty.yaml", "--no-rerun"]);
    assert_eq!(code, Some(1), "{out}{err}");
    rig
}

const RUN: &str = "runs/quick & dirty/1";

#[test]
fn of_a_run() {
    let rig = with_run();
    let (code, out, err) = rig.monorig(&["report", RUN]);
    assert_eq!(code, Some(0), "{out}{err}");
    let html = rig.read("runs/quick & dirty/1/report.html");
    self_contained(&html);
    let text = text(&html);
    for part in [
        "quick & dirty, seed 1",
        "Is 1 < 2 & 3 > 2?",
        "1 of 2 expectations FAILED",
        "speed_rmse_mps",
        "≤ 5",
        "rls_ekf slope_rmse_deg from 1 s",
        "held",
        "slope, °",
        "otal mass",
        "chainage of the IMU, m",
        "NIS, mean of 50 rows",
        "time, s",
        "1500 kg", // the event
        "SHA-256",
        "track.yaml",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    assert!(html.contains("href=\"channels.parquet\"") && !html.contains("href=\"run.rrd\""));
    // the same again, and elsewhere with links that lead back
    rig.monorig(&["report", RUN]);
    assert_eq!(rig.read("runs/quick & dirty/1/report.html"), html);
    let (code, ..) = rig.monorig(&["report", RUN, "--out", "pages/one.html"]);
    assert_eq!(code, Some(0));
    let elsewhere = rig.read("pages/one.html");
    let link = "href=\"../runs/quick &amp; dirty/1/channels.parquet\"";
    assert!(elsewhere.contains(link));
}

#[test]
fn of_a_run_without_estimators() {
    let rig = Rig::new();
    let without = QUICK
        .replace("estimators: {dffrls_aukf: {}, rls_ekf: {}}\n", "")
        .lines()
        .filter(|l| !l.contains("estimator: rls_ekf"))
        .map(|l| format!("{l}\n"))
        .collect::<String>();
    rig.write("bare.yaml", without.as_bytes());
    let (code, out, err) = rig.monorig(&["run", "bare.yaml", "--no-rerun"]);
    assert_eq!(code, Some(0), "{out}{err}");
    let (code, out, err) = rig.monorig(&["report", "runs/bare/1"]);
    assert_eq!(code, Some(0), "{out}{err}");
    let html = rig.read("runs/bare/1/report.html");
    assert!(text(&html).contains("The one expectation held"));
    assert!(text(&html).contains("no data"));
}

#[test]
fn of_a_test_with_every_verdict() {
    let rig = Rig::new();
    rig.write("quick.yaml", QUICK.as_bytes());
    let (code, ..) = rig.monorig(&["test", "quick.yaml", "--json", "out/verdicts.json"]);
    assert_eq!(code, Some(1));
    let (code, out, err) = rig.monorig(&["report", "out/verdicts.json"]);
    assert_eq!(code, Some(0), "{out}{err}");
    let html = rig.read("out/verdicts.html");
    self_contained(&html);
    let text = text(&html);
    let json: serde_json::Value = serde_json::from_str(&rig.read("out/verdicts.json")).unwrap();
    let checks = json["scenarios"][0]["checks"].as_array().unwrap();
    assert!(checks.len() >= 4, "{checks:?}");
    for check in checks {
        for key in ["what", "bound"] {
            let part = check[key].as_str().unwrap();
            assert!(text.contains(part), "{part}");
        }
    }
    assert!(text.contains("1 of 1 scenarios FAILED") && text.contains("0 of 3"));
    assert!(text.contains("Differences to dffrls_aukf"));
}

/// Metrics stand over the values that were drawn; a last line that a kill has torn is left out.
#[test]
fn of_a_study() {
    let rig = Rig::new();
    rig.write("quick.yaml", QUICK.as_bytes());
    let (code, ..) = rig.monorig(&["test", "quick.yaml", "--json", "verdicts.json"]);
    assert_eq!(code, Some(1));
    let json: serde_json::Value = serde_json::from_str(&rig.read("verdicts.json")).unwrap();
    let header = serde_json::json!({"format": "monorig study", "version": 1, "study": "masses", "runs": 4,
        "monorig": "0.1.0", "hash": "0"});
    let mut lines = vec![header.to_string()];
    for (i, run) in json["scenarios"][0]["runs"]
        .as_array()
        .unwrap()
        .iter()
        .enumerate()
    {
        let mut run = run.clone();
        let plant = ["a", "b", "a"][i];
        run["draws"] = serde_json::json!({"load.mass_kg": 1000 * i, "physics.plant": plant});
        lines.push(run.to_string());
    }
    let torn = lines[1][..lines[1].len() / 2].to_owned();
    rig.write("masses.jsonl", (lines.join("\n") + "\n" + &torn).as_bytes());
    let (code, out, err) = rig.monorig(&["report", "masses.jsonl"]);
    assert_eq!(code, Some(0), "{out}{err}");
    let html = rig.read("masses.html");
    self_contained(&html);
    let text = text(&html);
    for part in [
        "Study masses",
        "3 of 4 runs",
        "over load.mass_kg",
        "over physics.plant",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    // torn in the middle it is broken
    lines[2] = torn;
    rig.write("masses.jsonl", lines.join("\n").as_bytes());
    let (code, _, err) = rig.monorig(&["report", "masses.jsonl"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("masses.jsonl:3:"), "{err}");
}

#[test]
fn of_nothing_that_can_be_reported() {
    let rig = with_run();
    let refused = |path: &str, words: &str| {
        let (code, out, err) = rig.monorig(&["report", path, "--out", "none.html"]);
        assert_eq!(code, Some(2), "{path}: {out}{err}");
        assert!(
            err.contains(words) && err.contains("help:"),
            "{path}: {err}"
        );
        assert!(!rig.path("none.html").exists());
    };
    refused("runs", "not the folder of a run");
    refused("no/such/run", "no such file");
    refused("quick & dirty.yaml", "not the results of a test or a study");
    let file = |name: &str| rig.path(RUN).join(name);
    let metrics = std::fs::read_to_string(file("metrics.json")).unwrap();
    std::fs::write(
        file("metrics.json"),
        metrics.replace("\"seed\": 1", "\"seed\": 2"),
    )
    .unwrap();
    refused(RUN, "different runs");
    std::fs::write(file("metrics.json"), &metrics[..metrics.len() / 2]).unwrap();
    refused(RUN, "metrics.json");
    std::fs::write(file("metrics.json"), metrics).unwrap();
    let channels = std::fs::read(file("channels.parquet")).unwrap();
    std::fs::write(file("channels.parquet"), &channels[..channels.len() / 2]).unwrap();
    refused(RUN, "channels.parquet");
    std::fs::remove_file(file("channels.parquet")).unwrap();
    refused(RUN, "no channels.parquet");
}
