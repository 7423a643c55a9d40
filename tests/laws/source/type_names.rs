//! One meaning a type name within a crate.

use super::modules::{is_for_tests, of_crate};
use std::collections::BTreeMap;
use syn::Item;

/// The names of the types that are defined more than once in a crate, each with the modules it is in.
fn several(folder: &str) -> BTreeMap<String, Vec<String>> {
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for module in of_crate(folder) {
        for item in &module.items {
            let (name, attributes) = match item {
                Item::Enum(i) => (&i.ident, &i.attrs),
                Item::Struct(i) => (&i.ident, &i.attrs),
                Item::Trait(i) => (&i.ident, &i.attrs),
                Item::Type(i) => (&i.ident, &i.attrs),
                Item::Union(i) => (&i.ident, &i.attrs),
                _ => continue,
            };
            if !is_for_tests(attributes) {
                let place = module.path.join("::");
                places.entry(name.to_string()).or_default().push(place);
            }
        }
    }
    // two forms of one type, one of which is there in a build
    places.values_mut().for_each(|places| places.dedup());
    places.retain(|_, places| places.len() > 1);
    places
}

#[test]
fn a_type_name_has_one_meaning_in_its_crate() {
    let mut wrong = String::new();
    for folder in super::libraries() {
        for (name, places) in several(&folder) {
            wrong += &format!("{folder}: `{name}` is defined in {}\n", places.join(", "));
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}
