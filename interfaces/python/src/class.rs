//! Fields of a class that Python reads.

/// The methods of a class: first the fields that Python reads, each by an expression of the object, then all others.
macro_rules! python_class {
    ($class:ident, $this:ident => { $($(#[$about:meta])* $name:ident: $of:ty = $value:expr;)+ } $($methods:tt)*) => {
        #[pymethods]
        impl $class {
            $($(#[$about])*
            #[getter]
            fn $name(&$this) -> $of {
                $value
            })+
            $($methods)*
        }
    };
}
pub(crate) use python_class;
