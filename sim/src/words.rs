//! Lists of words.

/// An array of words, each as a text: `words![mass slope]` is `["mass", "slope"]`.
#[macro_export]
macro_rules! words {
    ($($word:ident)*) => { [$(stringify!($word)),*] };
}
