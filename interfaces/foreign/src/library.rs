//! A shared library: found, checked, its functions looked up once. It stays loaded as long as the program runs.

use core::ffi::{CStr, c_char, c_void};
use libloading::Symbol;
use monorig_c::{
    ABI, Aid, Estimated, Input, Label, NominalVehicle, OK, Parameter, Reason, SetParameter,
};
use monorig_estimators::api::params::Key;
use monorig_sim::closed_loop::interned;
use monorig_sim::closed_loop::registry::Refusal;
use std::collections::BTreeMap;
use std::error::Error;
use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, PoisonError};

/// Largest number of names, parameters or quantities; a longer list counts as endless.
const MAX_ITEMS: u64 = 1000;
/// Largest size of an instance, bytes.
const MAX_BYTES: u64 = 1 << 30;

/// The functions of a library, as the header declares them.
pub(crate) struct Library {
    /// Name of the library in messages.
    pub at: String,
    names: Vec<&'static str>,
    size: unsafe extern "C" fn(*const c_char) -> u64,
    pub create: unsafe extern "C" fn(
        *mut c_void,
        *const c_char,
        *const NominalVehicle,
        *const SetParameter,
        u64,
        *mut Reason,
    ) -> i32,
    pub step: unsafe extern "C" fn(*mut c_void, *const Input, *mut Estimated, *mut Reason) -> i32,
    pub reset: unsafe extern "C" fn(*mut c_void),
    pub destroy: Option<unsafe extern "C" fn(*mut c_void)>,
    parameter_at: Option<unsafe extern "C" fn(*const c_char, u64, *mut Parameter) -> i32>,
    pub internal_at: Option<LabelAt>,
    pub internal_values: Option<unsafe extern "C" fn(*const c_void, *mut f64, u64)>,
    pub aid_at: Option<LabelAt>,
    pub aid_status: Option<unsafe extern "C" fn(*const c_void, *mut Aid, u64)>,
    pub snapshot: Option<unsafe extern "C" fn(*const c_void, *mut u8, u64) -> i64>,
    pub restore: Option<unsafe extern "C" fn(*mut c_void, *const u8, u64, *mut Reason) -> i32>,
    /// True while its one instance is in use; none for a library that can have several.
    pub in_use: Option<AtomicBool>,
    /// Parameters of each name, once asked for.
    parameters: Mutex<BTreeMap<&'static str, &'static [&'static [Key]]>>,
}

/// A function that names the items of an instance.
pub(crate) type LabelAt = unsafe extern "C" fn(*const c_void, u64, *mut Label) -> i32;

/// The libraries of this program, each once.
static LOADED: Mutex<BTreeMap<PathBuf, &'static Library>> = Mutex::new(BTreeMap::new());

/// Loads a shared library with all that it needs: a symbol that is nowhere is found here, and not when it is called.
pub(crate) fn open(path: &Path) -> Result<libloading::Library, String> {
    #[cfg(unix)]
    use libloading::os::unix;
    // SAFETY: the user asks for the code of this library to be run; nothing can be known of it before.
    #[cfg(unix)]
    let opened = unsafe { unix::Library::open(Some(path), unix::RTLD_NOW | unix::RTLD_LOCAL) }
        .map(Into::into);
    // SAFETY: as above.
    #[cfg(not(unix))]
    let opened = unsafe { libloading::Library::new(path) };
    opened.map_err(|e| {
        e.source()
            .map_or_else(|| e.to_string(), ToString::to_string)
    })
}

impl Library {
    /// The library of this file, with all required functions.
    pub fn load(path: &Path) -> Result<&'static Self, Refusal> {
        let file = path.canonicalize().unwrap_or_else(|_| path.into());
        let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(library) = loaded.get(&file) {
            return Ok(library);
        }
        let opened = open(&file).map_err(|why| {
            Refusal::new(
                format!("{} cannot be loaded: {why}", path.display()),
                "use a shared library for this machine, such as from `cc -shared -fPIC -O2 -o mine.so mine.c -lm`",
            )
        })?;
        let library = Box::leak(Box::new(Self::of(path, Box::leak(Box::new(opened)))?));
        loaded.insert(file, library);
        Ok(library)
    }

    fn of(path: &Path, opened: &'static libloading::Library) -> Result<Self, Refusal> {
        let at = path.display().to_string();
        macro_rules! may {
            ($name:literal) => {{
                // SAFETY: the type is that of the header, whose number is compared below; the library is never closed.
                let found: Result<Symbol<'static, _>, _> = unsafe { opened.get($name) };
                found.ok().map(|function| *function)
            }};
        }
        macro_rules! must {
            ($name:literal) => {
                may!($name).ok_or_else(|| {
                    Refusal::new(
                        format!("{at} has no function `{}`", String::from_utf8_lossy($name)),
                        "write the function as monorig_estimator.h declares it; in C++ within extern \"C\"",
                    )
                })?
            };
        }
        let abi: unsafe extern "C" fn() -> u32 = must!(b"monorig_abi");
        // SAFETY: the header's function of this name, which takes nothing.
        let number = unsafe { abi() };
        if number != ABI {
            return Err(Refusal::new(
                format!(
                    "{at} was built with header number {number}; this program has number {ABI}"
                ),
                "build the library again with the monorig_estimator.h of this version",
            ));
        }
        let name_at: unsafe extern "C" fn(u64, *mut Label) -> i32 = must!(b"monorig_name_at");
        let labels = labels(|index, out| {
            // SAFETY: the header's function of this name, with a place for a label.
            unsafe { name_at(index, out) }
        });
        let names: Vec<&'static str> = labels.iter().map(|l| interned(l.name.as_str())).collect();
        if names.is_empty() {
            return Err(Refusal::new(
                format!("{at} has no estimator"),
                "monorig_name_at(0, …) fills in a name and returns MONORIG_OK",
            ));
        }
        let one: Option<unsafe extern "C" fn() -> u32> = may!(b"monorig_one_at_a_time");
        // SAFETY: the header's function of this name, which takes nothing.
        let one = one.is_some_and(|one| unsafe { one() } != 0);
        Ok(Self {
            size: must!(b"monorig_size"),
            create: must!(b"monorig_create"),
            step: must!(b"monorig_step"),
            reset: must!(b"monorig_reset"),
            destroy: may!(b"monorig_destroy"),
            parameter_at: may!(b"monorig_parameter_at"),
            internal_at: may!(b"monorig_internal_at"),
            internal_values: may!(b"monorig_internal_values"),
            aid_at: may!(b"monorig_aid_at"),
            aid_status: may!(b"monorig_aid_status"),
            snapshot: may!(b"monorig_snapshot"),
            restore: may!(b"monorig_restore"),
            in_use: one.then(AtomicBool::default),
            parameters: Mutex::default(),
            names,
            at,
        })
    }

    /// The estimator of this name; without a name the only estimator.
    pub fn choose(&self, name: Option<&str>) -> Result<&'static str, Refusal> {
        let found = match (name, &self.names[..]) {
            (None, [only]) => Some(only),
            (None, _) => None,
            (Some(name), names) => names.iter().find(|n| **n == name),
        };
        found.copied().ok_or_else(|| {
            let message = match name {
                Some(name) => format!("{} has no estimator `{name}`", self.at),
                None => format!("{} has {} estimators", self.at, self.names.len()),
            };
            Refusal::new(
                message,
                format!("`is` names one of them: {}", self.names.join(", ")),
            )
        })
    }

    /// The parameters of an estimator.
    pub fn parameters(&self, name: &'static str) -> Result<&'static [&'static [Key]], Refusal> {
        let mut known = self
            .parameters
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(groups) = known.get(name) {
            return Ok(groups);
        }
        let mut keys = Vec::new();
        let c_name = CString::new(name).unwrap_or_default();
        for index in 0..self.parameter_at.map_or(0, |_| MAX_ITEMS) {
            let mut parameter = Parameter::default();
            // SAFETY: the header's function of this name, with a text and a place for a parameter.
            let code = self
                .parameter_at
                .map(|f| unsafe { f(c_name.as_ptr(), index, &mut parameter) });
            if code != Some(OK) {
                break;
            }
            let words = |words: &mut dyn Iterator<Item = &'static str>| -> &'static [&'static str] {
                words.collect::<Vec<_>>().leak()
            };
            let key = parameter
                .key(interned, words)
                .filter(|key| !key.name.is_empty());
            keys.push(key.ok_or_else(|| {
                Refusal::new(
                    format!("{}: parameter {index} of `{name}` is not valid", self.at),
                    "a parameter needs a name, a kind of the header, least ≤ most for a number, and its words for a choice",
                )
            })?);
        }
        let groups: &'static [&'static [Key]] = vec![&*keys.leak()].leak();
        known.insert(name, groups);
        Ok(groups)
    }

    /// Bytes of an instance.
    pub fn size(&self, name: &CStr) -> Result<usize, Refusal> {
        // SAFETY: the header's function of this name, with a text.
        let bytes = unsafe { (self.size)(name.as_ptr()) };
        match usize::try_from(bytes) {
            Ok(size) if (1..=MAX_BYTES).contains(&bytes) => Ok(size),
            _ => Err(Refusal::new(
                format!("{}: an instance of {name:?} needs {bytes} bytes", self.at),
                format!("monorig_size must return 1…{MAX_BYTES}"),
            )),
        }
    }
}

/// All items of a list that ends with a refusal.
pub(crate) fn labels(at: impl Fn(u64, &mut Label) -> i32) -> Vec<Label> {
    let one = |index| {
        let mut label = Label::default();
        (at(index, &mut label) == OK).then_some(label)
    };
    (0..MAX_ITEMS).map_while(one).collect()
}
