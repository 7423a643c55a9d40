//! The public paths of each crate stand in `public/CRATE.txt`: what becomes public, or is so no more, changes the list
//! knowingly.
//!
//! Write the lists anew with `MONORIG_WRITE_LISTS=1 cargo test --release --test laws source::`, and look at
//! the difference. Fields, variants and what macros make are not listed.

use super::modules::{Module, is_for_tests, of_crate};
use std::collections::{BTreeMap, BTreeSet};
use syn::{ImplItem, Item, Type, UseTree, Visibility};

fn is_public(visibility: &Visibility) -> bool {
    matches!(visibility, Visibility::Public(_))
}

/// The name of an item that a crate makes public by itself.
fn public_name(item: &Item) -> Option<String> {
    let (visibility, attributes, name) = match item {
        Item::Const(i) => (&i.vis, &i.attrs, &i.ident),
        Item::Enum(i) => (&i.vis, &i.attrs, &i.ident),
        Item::Fn(i) => (&i.vis, &i.attrs, &i.sig.ident),
        Item::Static(i) => (&i.vis, &i.attrs, &i.ident),
        Item::Struct(i) => (&i.vis, &i.attrs, &i.ident),
        Item::Trait(i) => (&i.vis, &i.attrs, &i.ident),
        Item::Type(i) => (&i.vis, &i.attrs, &i.ident),
        Item::Union(i) => (&i.vis, &i.attrs, &i.ident),
        _ => return None,
    };
    (is_public(visibility) && !is_for_tests(attributes)).then(|| name.to_string())
}

/// The names that a `use` brings in.
fn used_names(tree: &UseTree) -> Vec<String> {
    match tree {
        UseTree::Path(path) => used_names(&path.tree),
        UseTree::Name(name) => vec![name.ident.to_string()],
        UseTree::Rename(rename) => vec![rename.rename.to_string()],
        UseTree::Glob(_) => vec!["*".into()],
        UseTree::Group(group) => group.items.iter().flat_map(used_names).collect(),
    }
}

/// The public paths of a crate, sorted.
fn paths(modules: &[Module]) -> BTreeSet<String> {
    let mut paths = BTreeSet::new();
    for module in modules.iter().filter(|m| m.public) {
        for item in &module.items {
            let names = match item {
                Item::Use(u) if is_public(&u.vis) && !is_for_tests(&u.attrs) => used_names(&u.tree),
                other => public_name(other).into_iter().collect(),
            };
            paths.extend(
                names
                    .into_iter()
                    .map(|name| [module.path.as_slice(), &[name]].concat().join("::")),
            );
        }
    }
    // methods stand under the longest path of their type: the others are shortcuts to it
    let mut places: BTreeMap<String, String> = BTreeMap::new();
    for path in &paths {
        let name = path.rsplit("::").next().unwrap_or(path).to_owned();
        let place = places.entry(name).or_default();
        if path.len() > place.len() {
            place.clone_from(path);
        }
    }
    for item in modules.iter().flat_map(|m| &m.items) {
        let Item::Impl(block) = item else { continue };
        let Type::Path(of) = &*block.self_ty else {
            continue;
        };
        let name = of.path.segments.last().unwrap().ident.to_string();
        let Some(place) = places.get(&name).filter(|_| block.trait_.is_none()) else {
            continue;
        };
        for inside in &block.items {
            let (visibility, name) = match inside {
                ImplItem::Fn(f) => (&f.vis, &f.sig.ident),
                ImplItem::Const(c) => (&c.vis, &c.ident),
                _ => continue,
            };
            if is_public(visibility) {
                paths.insert(format!("{place}::{name}"));
            }
        }
    }
    paths
}

#[test]
fn what_is_public_is_listed() {
    let folder = super::project().join("tests/laws/source/public");
    let mut wrong = String::new();
    for library in super::libraries() {
        let name = library.rsplit('/').next().unwrap();
        let file = folder.join(format!("{name}.txt"));
        let now = paths(&of_crate(&library));
        if std::env::var_os("MONORIG_WRITE_LISTS").is_some() {
            let lines: Vec<_> = now.iter().map(|path| format!("{path}\n")).collect();
            std::fs::write(&file, lines.concat()).unwrap();
        }
        let listed = std::fs::read_to_string(&file).unwrap_or_default();
        let listed: BTreeSet<String> = listed.lines().map(str::to_owned).collect();
        for new in now.difference(&listed) {
            wrong += &format!("{name}: {new} is public and not in {name}.txt\n");
        }
        for gone in listed.difference(&now) {
            wrong += &format!("{name}: {gone} is in {name}.txt and not public\n");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}
