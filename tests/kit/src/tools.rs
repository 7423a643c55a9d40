//! Tools of the machine that tests start. README names Rust and a C compiler; where another is missing, a test says so
//! and ends.

use std::env::consts::EXE_SUFFIX;
use std::ffi::OsStr;
use std::process::Command;

/// True where all of these tools are; else says which one is missing.
#[must_use]
pub fn tools(names: &[&str]) -> bool {
    let missing = names.iter().find(|name| !is_here(OsStr::new(name)));
    if let Some(name) = missing {
        eprintln!("skipped: no {name} here");
    }
    missing.is_none()
}

/// The compiler of C that the variable `CC` names, else `cc`; none, and said so, where it is missing.
#[must_use]
pub fn c_compiler() -> Option<Command> {
    let name = std::env::var_os("CC").unwrap_or("cc".into());
    if !is_here(&name) {
        eprintln!("skipped: no C compiler here");
        return None;
    }
    Some(Command::new(name))
}

/// True of a file with this name in a folder of `PATH`, or of a path that leads to one.
fn is_here(name: &OsStr) -> bool {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let mut file = name.to_owned();
    if !name.to_string_lossy().ends_with(EXE_SUFFIX) {
        file.push(EXE_SUFFIX);
    }
    // an absolute name takes the place of the folder
    std::env::split_paths(&paths).any(|folder| folder.join(&file).is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_missing() {
        assert!(!tools(&["no_tool_of_this_name"]));
        assert!(tools(&[]));
        assert!(!is_here(OsStr::new("/no/such/tool")));
        let ours = std::env::current_exe().unwrap();
        assert!(is_here(ours.as_os_str()));
    }
}
