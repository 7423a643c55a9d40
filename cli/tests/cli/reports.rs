//! `monorig report`: whole, well-formed, self-contained pages; clear errors for everything else.

use crate::common::TestFolder;
use monorig_lab::text::number;

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
estimators: {attitude: {}, dffrls_aekf_robust: {}}
events: [{at_s: 20, load_mass_kg: 1500}]
seeds: 1..3
expect:
  - {metric: speed_rmse_mps, at_most: 5}
  - {estimator: dffrls_aekf_robust, metric: slope_rmse_deg, after_s: 1, at_most: 0.00001, availability: 0.01}
integrity: {max_misleading_share: 1}
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

fn with_run() -> TestFolder {
    let dir = TestFolder::new();
    dir.write("quick & dirty.yaml", QUICK.as_bytes());
    let (code, out, err) = dir.monorig(&["run", "quick & dirty.yaml", "--no-rerun"]);
    assert_eq!(code, Some(1), "{out}{err}");
    dir
}

const RUN: &str = "runs/quick & dirty/1";

#[test]
fn of_a_run() {
    let dir = with_run();
    let (code, out, err) = dir.monorig(&["report", RUN]);
    assert_eq!(code, Some(0), "{out}{err}");
    let html = dir.read("runs/quick & dirty/1/report.html");
    self_contained(&html);
    let text = text(&html);
    for part in [
        "quick & dirty, seed 1",
        "Is 1 < 2 & 3 > 2?",
        "FAILED: 1 of ",
        "speed_rmse_mps",
        "≤ 5",
        "dffrls_aekf_robust slope_rmse_deg from 1 s",
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
    dir.monorig(&["report", RUN]);
    assert_eq!(dir.read("runs/quick & dirty/1/report.html"), html);
    std::fs::create_dir(dir.path("pages")).unwrap();
    let (code, ..) = dir.monorig(&["report", RUN, "--out", "pages/one.html"]);
    assert_eq!(code, Some(0));
    let elsewhere = dir.read("pages/one.html");
    let link = "href=\"../runs/quick &amp; dirty/1/channels.parquet\"";
    assert!(elsewhere.contains(link));
}

#[test]
fn of_a_run_without_estimators() {
    let dir = TestFolder::new();
    let without = QUICK
        .replace("estimators: {attitude: {}, dffrls_aekf_robust: {}}\n", "")
        .lines()
        .filter(|l| !l.contains("estimator: dffrls_aekf_robust"))
        .map(|l| format!("{l}\n"))
        .collect::<String>();
    dir.write("bare.yaml", without.as_bytes());
    let (code, out, err) = dir.monorig(&["run", "bare.yaml", "--no-rerun"]);
    assert_eq!(code, Some(0), "{out}{err}");
    let (code, out, err) = dir.monorig(&["report", "runs/bare/1"]);
    assert_eq!(code, Some(0), "{out}{err}");
    let html = dir.read("runs/bare/1/report.html");
    let banner = text(&html);
    assert!(banner.contains(": all 2 checks"), "{banner}");
    assert!(text(&html).contains("no data"));
}

#[test]
fn of_a_test_with_every_verdict() {
    let dir = TestFolder::new();
    dir.write("quick.yaml", QUICK.as_bytes());
    std::fs::create_dir_all(dir.path("out")).unwrap();
    let (code, ..) = dir.monorig(&["test", "quick.yaml", "--json", "out/verdicts.json"]);
    assert_eq!(code, Some(1));
    let (code, out, err) = dir.monorig(&["report", "out/verdicts.json"]);
    assert_eq!(code, Some(0), "{out}{err}");
    let html = dir.read("out/verdicts.html");
    self_contained(&html);
    let text = text(&html);
    let json: serde_json::Value = serde_json::from_str(&dir.read("out/verdicts.json")).unwrap();
    let checks = json["scenarios"][0]["checks"].as_array().unwrap();
    assert!(checks.len() >= 4, "{checks:?}");
    for check in checks {
        for key in ["what", "bound"] {
            let part = check[key].as_str().unwrap();
            assert!(text.contains(part), "{part}");
        }
    }
    assert!(text.contains("FAILED: 1 of 1 scenario") && text.contains("0 of 3"));
}

const STUDY: &str = "\
version: 1
why: A spread.
scenario: quick.yaml
runs: 4
vary:
  - {path: load.mass_kg, uniform: [0, 2500]}
  - {path: vehicle.total_mass_guess_kg, choice: [6000, 9000]}
";

/// Metrics stand over the values that were drawn; a last line that a kill has torn is left out.
#[test]
fn of_a_study() {
    let dir = TestFolder::new();
    dir.write("quick.yaml", QUICK.as_bytes());
    dir.write("masses.yaml", STUDY.as_bytes());
    let (code, out, err) = dir.monorig(&["study", "masses.yaml"]);
    assert_eq!(code, Some(1), "{out}{err}");
    let file = "runs/masses/results.jsonl";
    let report = || {
        let (code, out, err) = dir.monorig(&["report", file]);
        assert_eq!(code, Some(0), "{out}{err}");
        let html = dir.read("runs/masses/results.html");
        self_contained(&html);
        text(&html)
    };
    let whole = dir.read(file);
    let all: Vec<&str> = whole.lines().collect();
    let runs = all[1..].iter();
    let rmse: Vec<f64> = runs
        .map(|line| {
            let run: serde_json::Value = serde_json::from_str(line).unwrap();
            let of = &run["summary"]["estimators"]["attitude"]["slope_rmse_deg"];
            of.as_f64().unwrap()
        })
        .collect();
    let mean = number(rmse.iter().sum::<f64>() / 4.0);
    for part in [
        "Study masses",
        "4 of 4 runs, 4 of them finished",
        "of 11 checks", // those of availability and integrity of both estimators among them
        "dffrls_aekf_robust slope_rmse_deg from 1 s",
        "slope_rmse_deg over load.mass_kg",
        "slope_rmse_deg over vehicle.total_mass_guess_kg",
        mean.as_str(),
    ] {
        assert!(report().contains(part), "{part}\n{}", report());
    }
    // killed in the middle of the last line
    let torn = &all[4][..all[4].len() / 2];
    let killed = [&all[..4], &[torn]].concat();
    dir.write(file, killed.join("\n").as_bytes());
    assert!(report().contains("3 of 4 runs, 3 of them finished"));
    // torn in the middle it is broken
    let broken = [&all[..2], &[torn], &all[3..]].concat();
    dir.write(file, broken.join("\n").as_bytes());
    let (code, _, err) = dir.monorig(&["report", file]);
    assert_eq!(code, Some(2));
    assert!(err.contains("results.jsonl:3:"), "{err}");
}

/// Every figure of the table of `monorig compare` stands in the page, the published ones too; runs that are left out
/// are named.
#[test]
fn of_a_comparison() {
    let dir = TestFolder::new();
    let published = "published: [{source: 'A & B 2024, table 9', estimator: rail_fusion, metric: slope_mae_deg, value: 12.375}]\n";
    std::fs::create_dir_all(dir.path("out")).unwrap();
    dir.write("quick.yaml", (QUICK.to_owned() + published).as_bytes());
    let (code, out, err) = dir.monorig(&[
        "compare",
        "quick.yaml",
        "--estimators",
        "attitude,rail_fusion",
        "--metrics",
        "slope_mae_deg,slope_error_p95_deg",
        "--json",
        "out/both.json",
    ]);
    assert_eq!(code, Some(0), "{out}{err}");
    let report = || {
        let (code, out, err) = dir.monorig(&["report", "out/both.json"]);
        assert_eq!(code, Some(0), "{out}{err}");
        let html = dir.read("out/both.html");
        self_contained(&html);
        text(&html)
    };
    let json: serde_json::Value = serde_json::from_str(&dir.read("out/both.json")).unwrap();
    let page = report();
    let mut parts = vec![
        "Comparison on quick".to_owned(),
        "on the same samples".to_owned(),
        "minus attitude".to_owned(),
        "Published: A & B 2024, table 9.".to_owned(),
        number(12.375),
    ];
    let table = json["table"].as_array().unwrap();
    assert_eq!(table.len(), 4);
    for cell in table {
        for key in ["mean", "difference"] {
            let of = |end: &str| number(cell[key][end].as_f64().unwrap());
            if !cell[key].is_null() {
                parts.push(of("mean"));
                parts.push(format!("{} … {}", of("low"), of("high")));
            }
        }
        parts.push(number(cell["median"].as_f64().unwrap()));
    }
    assert_eq!(parts.len(), 5 + 4 * 3 + 2 * 2);
    for part in parts {
        assert!(page.contains(&part), "{part}\n{page}");
    }
    let mut cut = json.clone();
    cut["runs"][2]["summary"]["finished"] = false.into();
    dir.write("out/both.json", cut.to_string().as_bytes());
    let page = report();
    for part in ["1 of 3 runs did not come to their end", "Left out"] {
        assert!(page.contains(part), "{part}\n{page}");
    }
    cut["version"] = 2.into();
    dir.write("out/both.json", cut.to_string().as_bytes());
    let (code, _, err) = dir.monorig(&["report", "out/both.json"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("version 2 of kind `compare`"), "{err}");
}

#[test]
fn of_nothing_that_can_be_reported() {
    let dir = with_run();
    let refused = |path: &str, words: &str| {
        let (code, out, err) = dir.monorig(&["report", path, "--out", "none.html"]);
        assert_eq!(code, Some(2), "{path}: {out}{err}");
        assert!(
            err.contains(words) && err.contains("help:") && !err.contains("panicked"),
            "{path}: {err}"
        );
        assert!(!dir.path("none.html").exists());
    };
    refused("runs", "not the folder of a run");
    refused("no/such/run", "no such file");
    refused("quick & dirty.yaml", "a report cannot be made of this");
    for kind in [
        "the folder of a run",
        "monorig test --json",
        "monorig compare --json",
        "the results of a study",
        "monorig tune",
    ] {
        refused("runs", kind);
        refused("quick & dirty.yaml", kind);
    }
    let file = |name: &str| dir.path(RUN).join(name);
    let metrics = std::fs::read_to_string(file("metrics.json")).unwrap();
    std::fs::write(
        file("metrics.json"),
        metrics.replace("\"seed\": 1", "\"seed\": 2"),
    )
    .unwrap();
    refused(RUN, "check sum");
    std::fs::write(file("metrics.json"), &metrics[..metrics.len() / 2]).unwrap();
    refused(RUN, "metrics.json");
    std::fs::write(file("metrics.json"), metrics).unwrap();
    let channels = std::fs::read(file("channels.parquet")).unwrap();
    std::fs::write(file("channels.parquet"), &channels[..channels.len() / 2]).unwrap();
    refused(RUN, "channels.parquet");
    std::fs::remove_file(file("channels.parquet")).unwrap();
    refused(RUN, "no channels.parquet");
}

#[test]
fn two_runs_compared() {
    let dir = with_run();
    let more = [
        "run",
        "quick & dirty.yaml",
        "--no-rerun",
        "--name",
        "light",
        "--set",
        "load.mass_kg=500",
    ];
    let (code, out, err) = dir.monorig(&more);
    assert!(matches!(code, Some(0 | 1)), "{out}{err}");
    let light = "runs/quick & dirty@light/1";
    let (code, out, err) = dir.monorig(&["report", RUN, light]);
    assert_eq!(code, Some(0), "{out}{err}");
    let html = dir.read("runs/quick & dirty/1/against_quick & dirty@light-1.html");
    self_contained(&html);
    let text = text(&html);
    for part in [
        "quick & dirty@light, seed 1 against quick & dirty, seed 1",
        "load.mass_kg",
        "500",
        "B minus A",
        "attitude",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    // the difference of a metric is that of what the two runs measured
    let metrics = |run: &str| -> serde_json::Value {
        serde_json::from_str(&dir.read(&format!("{run}/metrics.json"))).unwrap()
    };
    let slope = |run: &str| {
        metrics(run)["estimators"]["dffrls_aekf_robust"]["slope_rmse_deg"]
            .as_f64()
            .unwrap()
    };
    let difference = number(slope(light) - slope(RUN));
    assert!(text.contains(&difference), "{difference}");
    // a run against itself has no difference
    let (code, _, err) = dir.monorig(&["report", RUN, RUN, "--out", "same.html"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(
        dir.read("same.html")
            .contains("Both runs were made from the same")
    );
    let told = dir.refused(&["report", RUN, "runs"]);
    assert!(told.contains("not the folder of a run"), "{told}");
}

#[test]
fn a_run_without_errors_has_no_budget() {
    let dir = TestFolder::new();
    let short = QUICK
        .replace("stop: {after_s: 60}", "stop: {after_s: 4}")
        .replace("events: [{at_s: 20, load_mass_kg: 1500}]\n", "");
    assert_ne!(short, QUICK);
    dir.write("short.yaml", short.as_bytes());
    let (code, out, err) = dir.monorig(&["run", "short.yaml", "--no-rerun"]);
    assert!(matches!(code, Some(0 | 1)), "{out}{err}");
    let told = dir.refused(&["explain", "runs/short/1", "--seeds", "1"]);
    assert!(
        told.contains("it ends after 4.0 s") && told.contains("from 5 s on"),
        "{told}"
    );
}

#[test]
fn an_error_budget_is_in_the_report() {
    let dir = with_run();
    let explain = ["explain", RUN, "--seeds", "1..2"];
    let (code, out, err) = dir.monorig(&explain);
    assert_eq!(code, Some(0), "{out}{err}");
    for part in ["slope_rmse", " % (", "2 seeds"] {
        assert!(out.contains(part), "{part}\n{out}");
    }
    // a sentence, three sources, a legend
    assert!(out.lines().count() <= 14, "{out}");
    let page = text(&dir.read("runs/quick & dirty/1/report.html"));
    for part in [
        "without noise",
        "without all of these",
        "with more excitation",
    ] {
        assert!(page.contains(part), "{part}\n{page}");
    }
    assert!(out.lines().all(|l| l.chars().count() <= 80), "{out}");
    let budget: serde_json::Value =
        serde_json::from_str(&dir.read("runs/quick & dirty/1/explain.json")).unwrap();
    let sources = budget["sources"].as_array().unwrap();
    assert!(sources.iter().all(|s| s["failed"].is_null()), "{sources:?}");
    // without errors of instruments and model next to nothing is left of those that the errors make
    let at = |name: &str| sources.iter().position(|s| s["name"] == name).unwrap();
    let slope = budget["errors"].as_array().unwrap().iter();
    let mut slope =
        slope.filter(|e| e["metric"] == "slope_rmse_deg" && e["estimator"] == "dffrls_aekf_robust");
    let slope = slope.next().unwrap();
    let (all, none) = (
        slope["with_all"].as_f64().unwrap(),
        slope["without"][at("all of these")].as_f64().unwrap(),
    );
    assert!(none < all, "{none} {all}");
    // what is explained is the run: the first seed with everything is its own metric
    let one = ["explain", RUN, "--seeds", "1"];
    assert_eq!(dir.monorig(&one).0, Some(0));
    let budget: serde_json::Value =
        serde_json::from_str(&dir.read("runs/quick & dirty/1/explain.json")).unwrap();
    let metrics: serde_json::Value =
        serde_json::from_str(&dir.read("runs/quick & dirty/1/metrics.json")).unwrap();
    for error in budget["errors"].as_array().unwrap() {
        let [name, metric] = ["estimator", "metric"].map(|k| error[k].as_str().unwrap());
        let measured = metrics["estimators"][name][metric].as_f64().unwrap();
        let explained = error["with_all"].as_f64().unwrap();
        assert!(
            (measured - explained).abs() < 1e-9 * measured.abs().max(1.0),
            "{name} {metric}"
        );
    }
    let text = text(&dir.read("runs/quick & dirty/1/report.html"));
    assert!(
        text.contains("Error budget") && text.contains("share of the mean square error"),
        "{text}"
    );
    let (code, out, err) = dir.monorig(&[
        "check",
        "runs/quick & dirty/1/explain.json",
        "runs/quick & dirty/1/report.html",
    ]);
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(
        out.contains("error budget ok") && out.contains("page ok"),
        "{out}"
    );
    // a scenario file that was changed since must be named
    dir.write(
        "quick & dirty.yaml",
        QUICK.replace("1 < 2", "1 < 3").as_bytes(),
    );
    assert!(dir.refused(&one).contains("--scenario"));
    let named = [
        "explain",
        RUN,
        "--seeds",
        "1",
        "--scenario",
        "quick & dirty.yaml",
    ];
    let (code, _, err) = dir.monorig(&named);
    assert_eq!(code, Some(0), "{err}");
    assert!(err.contains("were changed since"), "{err}");
    let page = dir.read("runs/quick & dirty/1/report.html");
    assert!(page.contains("were changed before the budget"));
    // that of another scenario is not this run's
    dir.write("other.yaml", QUICK.as_bytes());
    let other = ["explain", RUN, "--seeds", "1", "--scenario", "other.yaml"];
    assert!(dir.refused(&other).contains("not of other"));
}
