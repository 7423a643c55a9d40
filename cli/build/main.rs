//! Tells the program from which git revision it is built: `MONORIG_REVISION`, `-dirty` behind it if a source file was
//! changed since. `MONORIG_BUILD`: for which system and by which compiler. Without git, or outside of a checkout of
//! monorig, the variable is not set, and the program says `unknown`.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Sources of the program and of the Python module, seen from the root of the checkout.
const SOURCES: &str = "Cargo.toml Cargo.lock estimators sim lab cli/src cli/build cli/Cargo.toml \
    interfaces/c interfaces/can interfaces/foreign interfaces/fmu interfaces/logs interfaces/python/src \
    interfaces/python/Cargo.toml interfaces/viz";

fn main() {
    built_by();
    // a package that was published: cargo has put the revision into it
    if let Ok(text) = std::fs::read_to_string(".cargo_vcs_info.json") {
        println!("cargo::rerun-if-changed=.cargo_vcs_info.json");
        if let Some(sha) = text.split('"').find(|part| is_revision(part)) {
            println!("cargo::rustc-env=MONORIG_REVISION={sha}");
        }
        return;
    }
    // a package may lie at any depth below the root
    let root = git(&["rev-parse", "--show-cdup"]).unwrap_or_default();
    let sources = SOURCES
        .split(' ')
        .map(|source| Path::new(&root).join(source));
    for source in sources.filter(|s| s.exists()) {
        println!("cargo::rerun-if-changed={}", source.display());
    }
    // a commit, a checkout or a reset: one of these changes
    for name in ["HEAD", "logs/HEAD", "packed-refs"] {
        let place = git(&["rev-parse", "--git-path", name]).map(PathBuf::from);
        if let Some(place) = place.filter(|p| p.exists()) {
            println!("cargo::rerun-if-changed={}", place.display());
        }
    }
    if let Some(revision) = revision() {
        println!("cargo::rustc-env=MONORIG_REVISION={revision}");
    }
}

/// `MONORIG_BUILD`: for which system, and by which compiler.
fn built_by() {
    let variable = |name: &str| std::env::var(name).unwrap_or_default();
    let rustc = Command::new(variable("RUSTC")).arg("--version").output();
    let rustc = rustc.ok().and_then(|o| String::from_utf8(o.stdout).ok());
    let rustc = rustc.as_deref().map_or("unknown rustc", str::trim);
    println!(
        "cargo::rustc-env=MONORIG_BUILD={}, {rustc}",
        variable("TARGET")
    );
}

fn revision() -> Option<String> {
    // unpacked somewhere in the checkout of another project, this is not its revision
    git(&["ls-files", "--error-unmatch", "Cargo.toml"])?;
    let revision = git(&["rev-parse", "HEAD"]).filter(|r| is_revision(r))?;
    let sources: Vec<String> = SOURCES.split(' ').map(|s| format!(":/{s}")).collect();
    let sources: Vec<&str> = sources.iter().map(String::as_str).collect();
    let changed = git(&[&["status", "--porcelain", "--"], &sources[..]].concat())?;
    Some(match changed.is_empty() {
        true => revision,
        false => format!("{revision}-dirty"),
    })
}

fn is_revision(text: &str) -> bool {
    text.len() >= 40 && text.bytes().all(|b| b.is_ascii_hexdigit())
}

/// Returns the output of git; none if it fails.
fn git(arguments: &[&str]) -> Option<String> {
    // `status` must not touch the index: that would look like a change to the next build
    let mut command = Command::new("git");
    let output = command
        .env("GIT_OPTIONAL_LOCKS", "0")
        .args(arguments)
        .output()
        .ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
