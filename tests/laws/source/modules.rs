//! The modules of a crate, from its `lib.rs` on through every `mod`. Modules for tests are left out.

use std::path::{Path, PathBuf};
use syn::{Attribute, Item, Meta, Visibility};

/// A module with its items.
pub struct Module {
    /// Names from the root of the crate on; empty for the root.
    pub path: Vec<String>,
    /// A path of `pub mod` leads to it.
    pub public: bool,
    /// The file it stands in.
    pub file: PathBuf,
    /// The items, modules below it left out.
    pub items: Vec<Item>,
}

/// All modules of the crate in this folder of the workspace.
pub fn of_crate(folder: &str) -> Vec<Module> {
    let root = super::project().join(folder).join("src/lib.rs");
    let mut found = Vec::new();
    walk(items(&root), &[], true, &Place::of_root(&root), &mut found);
    found
}

/// Items that are not there in a build without tests.
pub fn is_for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|a| match &a.meta {
        Meta::List(list) if list.path.is_ident("cfg") => {
            let condition = list.tokens.to_string();
            condition.contains("test") && !condition.starts_with("not")
        }
        _ => false,
    })
}

/// The file of a module, and the folder of the modules below it.
struct Place {
    file: PathBuf,
    below: PathBuf,
}

impl Place {
    fn of_root(root: &Path) -> Self {
        Self {
            file: root.into(),
            below: root.parent().unwrap().into(),
        }
    }

    fn of_module(above: &Self, name: &str) -> Self {
        let below = above.below.join(name);
        let beside = above.below.join(format!("{name}.rs"));
        let file = match beside.exists() {
            true => beside,
            false => below.join("mod.rs"),
        };
        Self { file, below }
    }
}

fn items(file: &Path) -> Vec<Item> {
    let text = std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let parsed = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    parsed.items
}

fn walk(all: Vec<Item>, path: &[String], public: bool, place: &Place, found: &mut Vec<Module>) {
    let mut own = Vec::new();
    for item in all {
        match item {
            Item::Mod(module) if is_for_tests(&module.attrs) => {}
            Item::Mod(module) => {
                let name = module.ident.to_string();
                let mut below = Place::of_module(place, &name);
                let inside = match module.content {
                    Some((_, inside)) => {
                        below.file.clone_from(&place.file);
                        inside
                    }
                    None => items(&below.file),
                };
                let public = public && matches!(module.vis, Visibility::Public(_));
                walk(inside, &[path, &[name]].concat(), public, &below, found);
            }
            other => own.push(other),
        }
    }
    found.push(Module {
        path: path.to_vec(),
        public,
        file: place.file.clone(),
        items: own,
    });
}
