//! Files that come with the program: scenarios and what they name, templates, libraries.

use clap::builder::{PathBufValueParser, TypedValueParser};
use std::path::{Path, PathBuf};

/// A file that every such folder has.
const ONE: &str = "scenarios/minimal.yaml";

/// Folders that may have these files: at and above each start, then beside the program, as in an archive, and in
/// `share`, as in an installed package.
pub fn folders<'a>(starts: impl IntoIterator<Item = &'a Path>) -> Vec<PathBuf> {
    let program = std::env::current_exe().and_then(|p| p.canonicalize());
    let program = program.unwrap_or_default();
    let beside = program.parent().unwrap_or(Path::new(""));
    let share = beside.parent().unwrap_or(beside).join("share/monorig");
    let above = starts.into_iter().flat_map(Path::ancestors);
    let above = above.map(Path::to_owned);
    above.chain([beside.to_owned(), share]).collect()
}

/// A path that is named on the command line. Where nothing is at it, it is that of a file that comes with the program,
/// or the bare name of such a scenario.
pub fn named() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().map(find)
}

/// The same for one path.
pub fn find(path: PathBuf) -> PathBuf {
    let here = std::env::current_dir().unwrap_or_default();
    if path.symlink_metadata().is_ok() || !path.is_relative() {
        return path;
    }
    let all = folders([here.as_path()]);
    let Some(folder) = all.iter().find(|f| f.join(ONE).is_file()) else {
        return path;
    };
    let bare = path.components().count() == 1 && path.extension().is_none();
    let file = path.with_extension("yaml");
    let scenarios = ["", "harsh", "stress"].map(|f| folder.join("scenarios").join(f).join(&file));
    let scenarios = scenarios.into_iter().filter(|_| bare);
    let mut places = std::iter::once(folder.join(&path)).chain(scenarios);
    match places.find(|place| place.exists()) {
        Some(found) => found.strip_prefix(&here).map_or(found.clone(), Into::into),
        None => path,
    }
}
