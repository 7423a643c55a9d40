//! The schemas under docs/schema are those of the code; written anew with
//! `MONORIG_UPDATE=1 cargo test --release --workspace --test schema`.

mod common;

use common::TestFolder;
use std::collections::BTreeSet;
use std::path::Path;

#[test]
fn the_committed_schemas_are_fresh() {
    let dir = TestFolder::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/schema");
    let (code, kinds, _) = dir.monorig(&["schema"]);
    assert_eq!(code, Some(0));
    let mut known = BTreeSet::new();
    for kind in kinds
        .lines()
        .filter_map(|line| line.split_whitespace().next())
    {
        let (code, schema, err) = dir.monorig(&["schema", kind]);
        assert_eq!(code, Some(0), "{err}");
        let file = folder.join(format!("{kind}.json"));
        if std::env::var_os("MONORIG_UPDATE").is_some() {
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(&file, &schema).unwrap();
        }
        let committed = std::fs::read_to_string(&file).unwrap_or_default();
        assert!(
            committed == schema,
            "{} is stale; write all anew with\n  MONORIG_UPDATE=1 cargo test --release --workspace --test schema",
            file.display()
        );
        known.insert(format!("{kind}.json"));
    }
    assert!(!known.is_empty());
    let there: BTreeSet<String> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    assert_eq!(there, known, "a schema of no kind");
}
