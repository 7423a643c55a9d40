//! Only the packages at the border to C may use `unsafe`. The lints of the workspace forbid it in all others.

use std::collections::BTreeSet;

/// The packages with lints of their own.
const MAY: [&str; 3] = ["interfaces/c", "interfaces/fmu", "interfaces/foreign"];

#[test]
fn three_packages_may_use_unsafe() {
    let read = |path: &str| std::fs::read_to_string(super::project().join(path)).unwrap();
    let manifest = read("Cargo.toml");
    assert!(manifest.contains("\nunsafe_code = \"forbid\""));
    let may = |folder: &String| {
        let own = read(&format!("{folder}/Cargo.toml"));
        let mut forbids = ["[lints]\nworkspace = true", "unsafe_code = \"forbid\""].into_iter();
        let all = forbids.any(|lints| own.contains(lints));
        let noted = own.contains("undocumented_unsafe_blocks = \"deny\"");
        assert!(
            all || noted,
            "{folder}: lints of the workspace, or a SAFETY line a block"
        );
        !all
    };
    let found: BTreeSet<String> = super::members().into_iter().filter(may).collect();
    assert_eq!(found, MAY.map(str::to_owned).into());
}
