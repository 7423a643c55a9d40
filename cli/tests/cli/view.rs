//! `monorig report --view`: one page with viewer and recordings, opened by Chromium without a request. Skipped, with a
//! word, where the Python package rerun-sdk or Chromium is not there.

use crate::common::{TestFolder, project};
use std::process::{Command, Stdio};

/// Folders of two short runs of one scenario, and the dir they are in.
fn with_runs() -> (TestFolder, [&'static str; 2]) {
    let dir = TestFolder::new();
    let scenario = project().join("scenarios/minimal.yaml");
    let scenario = scenario.to_str().unwrap();
    for load in ["10000", "5000"] {
        let (load, name) = (format!("load.mass_kg={load}"), format!("load{load}"));
        let task = [
            "run",
            scenario,
            "--set",
            &load,
            "--set",
            "stop.after_s=3",
            "--name",
            &name,
        ];
        let (code, out, err) = dir.monorig(&task);
        assert!(matches!(code, Some(0 | 1)), "{out}{err}");
    }
    (dir, ["runs/minimal@load10000/1", "runs/minimal@load5000/1"])
}

/// Returns whether the viewer is installed; if not, the message must help.
fn written(dir: &TestFolder, task: &[&str]) -> bool {
    let (code, out, err) = dir.monorig(task);
    if code == Some(0) {
        return true;
    }
    assert_eq!(code, Some(2), "{out}{err}");
    assert!(
        err.contains("python3 -m pip install rerun-sdk==0.36.3"),
        "{err}"
    );
    eprintln!("skipped: no rerun-sdk 0.36.3 here");
    false
}

#[test]
fn two_recordings_are_in_one_page_and_chromium_opens_it_without_a_request() {
    let (dir, [a, b]) = with_runs();
    // one recording twice: the viewer could not tell them apart
    assert!(
        dir.refused(&["report", a, a, "--view"])
            .contains("would show them as one recording")
    );
    if !written(&dir, &["report", a, b, "--view", "--out", "both.html"]) {
        return;
    }
    let page = dir.read("both.html");
    for name in ["minimal@load10000-1", "minimal@load5000-1"] {
        assert!(page.contains(&format!("data-name=\"{name}\"")), "{name}");
    }
    assert!(page.len() < 60_000_000, "{}", page.len());
    let (code, out, _) = dir.monorig(&["check", "both.html"]);
    assert_eq!(code, Some(0), "{out}");
    let Some(dom) = opened(&dir, "both.html") else {
        eprintln!("skipped: no chromium here");
        return;
    };
    let state = dom.split("data-state=\"").nth(1).unwrap_or_default();
    assert!(
        state.starts_with("ready"),
        "{}",
        state.get(..40).unwrap_or(state)
    );
    let log = dir.read("net.json");
    assert!(
        log.contains("\"constants\""),
        "this is no log of the network"
    );
    assert!(!log.contains("rerun.io"), "the page asked for something");
}

/// The page as Chromium has it after a while of the page's own time; what it asks the network for goes to net.json.
/// None without Chromium.
fn opened(dir: &TestFolder, name: &str) -> Option<String> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let there = |name: &&str| {
        let mut asked = Command::new(name);
        asked
            .arg("--version")
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        asked.status().is_ok_and(|s| s.success())
    };
    let chromium = names.iter().find(|name| there(name))?;
    let mut command = Command::new(chromium);
    command.args([
        "--headless=new",
        "--no-sandbox",
        "--disable-dev-shm-usage",
        "--use-gl=angle",
        "--use-angle=swiftshader",
    ]);
    command.args([
        "--enable-unsafe-swiftshader",
        "--ignore-gpu-blocklist",
        "--disable-background-networking",
    ]);
    command.args(["--virtual-time-budget=1000000", "--dump-dom"]);
    command.arg(format!("--log-net-log={}", dir.path("net.json").display()));
    command.arg(format!(
        "--user-data-dir={}",
        dir.path("chromium").display()
    ));
    command.arg(format!(
        "file://{}?renderer=webgl",
        dir.path(name).display()
    ));
    let output = command.stderr(Stdio::null()).output().unwrap();
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}
