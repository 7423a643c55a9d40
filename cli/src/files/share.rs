//! Files that come with the program: scenarios and what they name, templates, libraries.

use clap::builder::{PathBufValueParser, TypedValueParser};
use std::path::{Path, PathBuf};

/// Folders that may have these files: at and above each start, then beside the program, as in an archive, and in
/// `share`, as in an installed package.
pub fn folders<'a>(starts: impl IntoIterator<Item = &'a Path>) -> Vec<PathBuf> {
    let program = std::env::current_exe().and_then(|p| p.canonicalize());
    let program = program.unwrap_or_default();
    let beside = program.parent().unwrap_or(&program);
    let share = beside.with_file_name("share").join("monorig");
    let starts = starts.into_iter().flat_map(Path::ancestors);
    let starts = starts.map(Path::to_owned);
    starts.chain([beside.to_owned(), share]).collect()
}

/// A path that is named on the command line. Where nothing is at it, it is that of a file that comes with the program,
/// or the name of such a scenario.
pub fn named() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().map(find)
}

/// The same for one path.
pub fn find(path: PathBuf) -> PathBuf {
    let here = std::env::current_dir().unwrap_or_default();
    let mut all = folders([here.as_path()]).into_iter();
    let folder = all.find(|folder| folder.join("scenarios/minimal.yaml").is_file());
    let Some(folder) = folder.filter(|_| path.symlink_metadata().is_err()) else {
        return path;
    };
    let scenario = folder.join("scenarios").join(&path).with_extension("yaml");
    let mut places = [folder.join(&path), scenario].into_iter();
    places.find(|place| place.exists()).unwrap_or(path)
}
