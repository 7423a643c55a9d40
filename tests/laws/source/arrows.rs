//! Files and rooms of a crate use each other without circles.
//!
//! An arrow goes from a file to the file that defines an item it names: in a `use`, or in a path that begins with
//! `crate`, `self`, `super`, a module below or an imported name. A `pub use` is followed to the definition and is no
//! arrow itself: a `mod.rs` that only re-exports its modules stands in no circle. A room is a module right below
//! the root of a crate, with everything in it. Methods are not followed; modules for tests are left out.

use super::modules::{Module, is_for_tests, of_crate};
use std::collections::{BTreeMap, BTreeSet};
use syn::visit::Visit;
use syn::{Attribute, Item, UseTree, Visibility};

/// Arrows from a name to others, each with the items that make it.
type Arrows = BTreeMap<String, BTreeMap<String, BTreeSet<String>>>;

/// The module that a name of a `use` stands for, and the name there. A glob has the name `*`.
type Import = (Vec<String>, String);

/// Definitions and imports of a module.
#[derive(Default)]
struct Names {
    file: String,
    defined: BTreeSet<String>,
    imported: BTreeMap<String, Import>,
    globs: Vec<Vec<String>>,
}

/// All modules of a crate by their paths.
type Tree = BTreeMap<Vec<String>, Names>;

/// Every name of a `use` with its whole path.
fn imports(tree: &UseTree, before: &[String], found: &mut Vec<(String, Vec<String>)>) {
    let longer = |name: &syn::Ident| [before, &[name.to_string()]].concat();
    let is_self = |name: &syn::Ident| name == "self" && !before.is_empty();
    let last = || before.last().cloned().unwrap_or_default();
    match tree {
        UseTree::Path(path) => imports(&path.tree, &longer(&path.ident), found),
        UseTree::Name(name) if is_self(&name.ident) => found.push((last(), before.to_vec())),
        UseTree::Name(name) => found.push((name.ident.to_string(), longer(&name.ident))),
        UseTree::Rename(name) if is_self(&name.ident) => {
            found.push((name.rename.to_string(), before.to_vec()));
        }
        UseTree::Rename(name) => found.push((name.rename.to_string(), longer(&name.ident))),
        UseTree::Glob(_) => found.push(("*".into(), [before, &["*".into()]].concat())),
        UseTree::Group(group) => group.items.iter().for_each(|i| imports(i, before, found)),
    }
}

/// The name that an item defines, and its attributes.
fn definition(item: &Item) -> Option<(String, &[Attribute])> {
    let (name, attributes) = match item {
        Item::Const(i) => (&i.ident, &i.attrs),
        Item::Enum(i) => (&i.ident, &i.attrs),
        Item::Fn(i) => (&i.sig.ident, &i.attrs),
        Item::Macro(i) => (i.ident.as_ref()?, &i.attrs),
        Item::Static(i) => (&i.ident, &i.attrs),
        Item::Struct(i) => (&i.ident, &i.attrs),
        Item::Trait(i) => (&i.ident, &i.attrs),
        Item::Type(i) => (&i.ident, &i.attrs),
        Item::Union(i) => (&i.ident, &i.attrs),
        _ => return None,
    };
    Some((name.to_string(), attributes))
}

/// The module and the name that a path written in module `from` leads to, before re-exports are followed. None for a
/// path out of the crate, or for a name that the module does not import.
fn place(tree: &Tree, from: &[String], path: &[String]) -> Option<Import> {
    let mut at = from.to_vec();
    let mut rest = path;
    let mut rooted = false;
    while let Some((first, others)) = rest.split_first() {
        match first.as_str() {
            "crate" => at.clear(),
            "self" => {}
            "super" => {
                at.pop()?;
            }
            _ => break,
        }
        (rooted, rest) = (true, others);
    }
    while let Some((first, others)) = rest.split_first() {
        let below = [at.as_slice(), std::slice::from_ref(first)].concat();
        let imported = tree.get(&at).and_then(|names| names.imported.get(first));
        if tree.contains_key(&below) {
            (at, rest, rooted) = (below, others, true);
        } else if let Some((module, name)) = imported.filter(|_| !others.is_empty()) {
            let whole = [module.as_slice(), std::slice::from_ref(name)].concat();
            if !tree.contains_key(&whole) {
                break;
            }
            (at, rest, rooted) = (whole, others, true);
        } else {
            break;
        }
    }
    let name = rest.first().cloned().unwrap_or_default();
    let known = tree
        .get(&at)
        .is_some_and(|n| n.defined.contains(&name) || n.imported.contains_key(&name));
    (rooted || known).then_some((at, name))
}

/// The module that defines a name seen in `module`. None for a module, for what a macro makes, or out of the crate.
fn defining(tree: &Tree, module: &[String], name: &str, depth: usize) -> Option<Vec<String>> {
    let names = tree.get(module)?;
    if names.defined.contains(name) {
        return Some(module.to_vec());
    }
    if depth > 9 {
        return None;
    }
    if let Some((next, name)) = names.imported.get(name) {
        return defining(tree, next, name, depth + 1);
    }
    let mut globs = names.globs.iter();
    globs.find_map(|next| defining(tree, next, name, depth + 1))
}

/// The names of every module; imports are resolved as far as modules go.
fn names(modules: &[Module]) -> Tree {
    let mut tree: Tree = BTreeMap::new();
    for module in modules {
        let defined = module.items.iter().filter_map(definition);
        let defined = defined.filter(|(_, attributes)| !is_for_tests(attributes));
        let file = module.file.to_string_lossy();
        let names = Names {
            file: file.rsplit_once("/src/").unwrap().1.to_owned(),
            defined: defined.map(|(name, _)| name).collect(),
            ..Default::default()
        };
        tree.insert(module.path.clone(), names);
    }
    for module in modules {
        for item in &module.items {
            let Item::Use(item) = item else { continue };
            let mut all = Vec::new();
            imports(&item.tree, &[], &mut all);
            for (name, path) in all.into_iter().filter(|_| !is_for_tests(&item.attrs)) {
                let Some((at, there)) = place(&tree, &module.path, &path) else {
                    continue;
                };
                let (at, there) = match there.is_empty() {
                    false => (at, there),
                    // the module itself
                    true => match at.split_last() {
                        Some((last, above)) => (above.to_vec(), last.clone()),
                        None => continue,
                    },
                };
                let own = tree.get_mut(&module.path).unwrap();
                match there.as_str() {
                    "*" => own.globs.push(at),
                    _ => drop(own.imported.insert(name, (at, there))),
                }
            }
        }
    }
    tree
}

/// The paths that code names.
#[derive(Default)]
struct Paths(BTreeSet<Vec<String>>);

impl<'a> Visit<'a> for Paths {
    fn visit_item(&mut self, item: &'a Item) {
        let for_tests = definition(item).is_some_and(|(_, attributes)| is_for_tests(attributes));
        let for_tests = for_tests || matches!(item, Item::Impl(i) if is_for_tests(&i.attrs));
        match item {
            _ if for_tests => {}
            Item::Use(used) if is_for_tests(&used.attrs) => {}
            Item::Use(used) if matches!(used.vis, Visibility::Inherited) => {
                let mut all = Vec::new();
                imports(&used.tree, &[], &mut all);
                self.0.extend(all.into_iter().map(|(_, path)| path));
            }
            Item::Use(_) => {}
            other => syn::visit::visit_item(self, other),
        }
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        let names = path.segments.iter().map(|s| s.ident.to_string());
        self.0.insert(names.collect());
        syn::visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'a syn::Macro) {
        let text = call.tokens.to_string().replace(" :: ", "::");
        let words = text.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
        let paths = words.filter(|w| w.contains("::"));
        self.0
            .extend(paths.map(|w| w.split("::").map(str::to_owned).collect()));
        syn::visit::visit_macro(self, call);
    }
}

/// Arrows between the files of a crate.
fn arrows(modules: &[Module]) -> Arrows {
    let tree = names(modules);
    let mut arrows = Arrows::new();
    for module in modules {
        let mut paths = Paths::default();
        module.items.iter().for_each(|item| paths.visit_item(item));
        let from = &tree[&module.path].file;
        for path in paths.0 {
            let Some((at, name)) = place(&tree, &module.path, &path) else {
                continue;
            };
            let Some(defined) = defining(&tree, &at, &name, 0) else {
                continue;
            };
            let to = &tree[&defined].file;
            if to != from {
                let ends = arrows.entry(from.clone()).or_default();
                ends.entry(to.clone()).or_default().insert(name);
            }
        }
    }
    arrows
}

/// Arrows between rooms, made of the arrows between their files.
fn between_rooms(files: &Arrows) -> Arrows {
    let room = |file: &str| {
        let first = file.split('/').next().unwrap_or(file);
        first.trim_end_matches(".rs").to_owned()
    };
    let mut rooms = Arrows::new();
    for (from, ends) in files {
        for (to, items) in ends {
            let (a, b) = (room(from), room(to));
            if a != b {
                let items = items.iter().map(|item| format!("{from} {item}"));
                rooms
                    .entry(a)
                    .or_default()
                    .entry(b)
                    .or_default()
                    .extend(items);
            }
        }
    }
    rooms
}

/// Every place that arrows lead to from this one.
fn reached(arrows: &Arrows, from: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut open = vec![from.to_owned()];
    while let Some(at) = open.pop() {
        for to in arrows.get(&at).into_iter().flat_map(BTreeMap::keys) {
            if found.insert(to.clone()) {
                open.push(to.clone());
            }
        }
    }
    found
}

/// Groups in which every place leads to every other, with the arrows between them in words.
fn circles(arrows: &Arrows) -> Vec<String> {
    let all: BTreeMap<&String, _> = arrows.keys().map(|a| (a, reached(arrows, a))).collect();
    let mut groups: BTreeSet<Vec<&String>> = BTreeSet::new();
    for (a, ends) in all.iter().filter(|(a, ends)| ends.contains(**a)) {
        let back = |b: &&&String| ends.contains(**b) && all[**b].contains(*a);
        groups.insert(all.keys().filter(back).copied().collect());
    }
    let words = |group: &Vec<&String>| {
        let mut words = String::new();
        for from in group {
            for (to, items) in arrows[*from].iter().filter(|(to, _)| group.contains(to)) {
                let items: Vec<_> = items.iter().take(6).map(String::as_str).collect();
                words += &format!("    {from} -> {to}: {}\n", items.join(", "));
            }
        }
        format!("{} in a circle\n{words}", group.len())
    };
    groups.iter().map(words).collect()
}

#[test]
fn no_files_and_no_rooms_use_each_other_in_a_circle() {
    let mut wrong = String::new();
    for folder in super::libraries() {
        let files = arrows(&of_crate(&folder));
        assert!(
            !files.is_empty() || folder.starts_with("tests"),
            "{folder}: no arrows are found"
        );
        let of_files = circles(&files).into_iter().map(|c| format!("files, {c}"));
        let of_rooms = circles(&between_rooms(&files))
            .into_iter()
            .map(|c| format!("rooms, {c}"));
        let found = of_files.chain(of_rooms);
        wrong.extend(found.map(|circle| format!("{folder}: {circle}")));
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// A module of this text.
fn module(path: &str, file: &str, text: &str) -> Module {
    let path = path.split("::").filter(|p| !p.is_empty());
    Module {
        path: path.map(str::to_owned).collect(),
        public: true,
        file: format!("/src/{file}").into(),
        items: syn::parse_file(text).unwrap().items,
    }
}

#[test]
fn a_circle_is_found_and_a_re_export_is_none() {
    let root = module("", "lib.rs", "pub use a::A;");
    let a = module("a", "a/mod.rs", "pub use one::One; pub struct A;");
    let one = module("a::one", "a/one.rs", "use super::A; pub struct One(A);");
    let b = module("b", "b.rs", "use crate::a::One; pub const B: One = 1;");
    let open = arrows(&[root, a, one, b]);
    assert_eq!(circles(&open), Vec::<String>::new(), "{open:?}");
    assert!(open["b.rs"].contains_key("a/one.rs"), "{open:?}");

    let a = module("a", "a.rs", "fn f() -> usize { crate::b::g() }");
    let b = module(
        "b",
        "b.rs",
        "use crate::a; fn g() -> usize { vec![a::f()].len() }",
    );
    let closed = arrows(&[module("", "lib.rs", ""), a, b]);
    assert_eq!(circles(&closed).len(), 1, "{closed:?}");
    assert_eq!(circles(&between_rooms(&closed)).len(), 1);
}
