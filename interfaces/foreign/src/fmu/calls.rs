//! The functions of an FMU, 2.0 or 3.0, and an instance that calls them.

use super::description::{Description, NUMBERS, Port};
use crate::library::open;
use libloading::Library;
use monorig_sim::closed_loop::registry::Refusal;
use std::ffi::{CStr, CString, c_char, c_void};
use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};
use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, PoisonError};

type Handle = *mut c_void;
type Text = *const c_char;

/// Gets or sets variables: FMI 3.0 gives the number of values, too.
type Get2<T> = unsafe extern "C" fn(Handle, *const u32, usize, *mut T) -> i32;
type Get3<T> = unsafe extern "C" fn(Handle, *const u32, usize, *mut T, usize) -> i32;
type Set2<T> = unsafe extern "C" fn(Handle, *const u32, usize, *const T) -> i32;
type Set3<T> = unsafe extern "C" fn(Handle, *const u32, usize, *const T, usize) -> i32;
type HandleCall = unsafe extern "C" fn(Handle) -> i32;

/// Receiver of the messages of an instance. The logger in `log.c` knows the first field.
#[repr(C)]
struct Listener {
    tell: unsafe extern "C" fn(*const Listener, Text),
    last: Mutex<String>,
}

/// Callbacks of FMI 2.0. An FMU may keep the pointer: they live as long as the instance.
#[repr(C)]
struct Callbacks {
    logger: unsafe extern "C" fn(*const c_void, Text, i32, Text, Text, ...),
    allocate: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    free: unsafe extern "C" fn(*mut c_void),
    finished: *const c_void,
    /// Given to the logger.
    listener: *const Listener,
}

unsafe extern "C" {
    fn monorig_fmi2_log(
        to: *const c_void,
        name: Text,
        status: i32,
        category: Text,
        format: Text,
        ...
    );
    fn calloc(count: usize, size: usize) -> *mut c_void;
    fn free(memory: *mut c_void);
}

/// Keeps a message as the last one.
unsafe extern "C" fn tell(to: *const Listener, message: Text) {
    // SAFETY: NULL or the listener of an instance.
    let to = unsafe { to.as_ref() };
    if let Some(to) = to.filter(|_| !message.is_null()) {
        // SAFETY: a text, as the standards say.
        let message = unsafe { CStr::from_ptr(message) };
        let message = message.to_string_lossy().trim().to_owned();
        *to.last.lock().unwrap_or_else(PoisonError::into_inner) = message;
    }
}

/// The logger of FMI 3.0.
unsafe extern "C" fn log_three(to: *const Listener, _status: i32, _category: Text, message: Text) {
    // SAFETY: the listener of an instance, and a text.
    unsafe { tell(to, message) }
}

/// The functions that differ between the standards.
enum Differing {
    Two {
        instantiate:
            unsafe extern "C" fn(Text, i32, Text, Text, *const Callbacks, i32, i32) -> Handle,
        setup: unsafe extern "C" fn(Handle, i32, f64, f64, i32, f64) -> i32,
        enter: HandleCall,
        get_real: Get2<f64>,
        set_real: Set2<f64>,
        get_integer: Get2<i32>,
        set_integer: Set2<i32>,
        get_boolean: Get2<i32>,
        set_boolean: Set2<i32>,
        step: unsafe extern "C" fn(Handle, f64, f64, i32) -> i32,
    },
    Three {
        #[allow(clippy::type_complexity)]
        instantiate: unsafe extern "C" fn(
            Text,
            Text,
            Text,
            bool,
            bool,
            bool,
            bool,
            *const u32,
            usize,
            *const Listener,
            unsafe extern "C" fn(*const Listener, i32, Text, Text),
            *const c_void,
        ) -> Handle,
        enter: unsafe extern "C" fn(Handle, bool, f64, f64, bool, f64) -> i32,
        /// Functions of each type of numbers; none where the library lacks one.
        numbers: [Option<(Get3<c_void>, Set3<c_void>)>; NUMBERS.len()],
        get_boolean: Get3<bool>,
        set_boolean: Set3<bool>,
        step: unsafe extern "C" fn(
            Handle,
            f64,
            f64,
            bool,
            *mut bool,
            *mut bool,
            *mut bool,
            *mut f64,
        ) -> i32,
    },
}

/// The functions of states.
struct States {
    get: unsafe extern "C" fn(Handle, *mut Handle) -> i32,
    set: unsafe extern "C" fn(Handle, Handle) -> i32,
    free: unsafe extern "C" fn(Handle, *mut Handle) -> i32,
    size: unsafe extern "C" fn(Handle, Handle, *mut usize) -> i32,
    write: unsafe extern "C" fn(Handle, Handle, *mut u8, usize) -> i32,
    read: unsafe extern "C" fn(Handle, *const u8, usize, *mut Handle) -> i32,
}

/// The functions of an FMU.
pub(crate) struct Calls {
    exit: HandleCall,
    reset: HandleCall,
    free: unsafe extern "C" fn(Handle),
    differing: Differing,
    states: Option<States>,
}

impl Calls {
    /// Loads the shared library and finds its functions.
    pub fn load(at: &str, path: &Path, three: bool) -> Result<Self, Refusal> {
        let library: &'static Library = Box::leak(Box::new(open(path).map_err(|why| {
            Refusal::new(
                format!("{at}: its shared library cannot be loaded: {why}"),
                "use an FMU for this machine that contains all needed libraries",
            )
        })?));
        let version = if three { "fmi3" } else { "fmi2" };
        macro_rules! function {
            ($name:expr) => {{
                let name = format!("{version}{}", $name);
                // SAFETY: the type is that of the standard; the library is never closed.
                let found = unsafe { library.get(name.as_bytes()) };
                found.map(|symbol| *symbol).map_err(|_| {
                    Refusal::new(
                        format!("{at}: its shared library has no function `{name}`"),
                        "use an FMU whose library has the version of its description",
                    )
                })
            }};
        }
        let differing = match three {
            false => Differing::Two {
                instantiate: function!("Instantiate")?,
                setup: function!("SetupExperiment")?,
                enter: function!("EnterInitializationMode")?,
                get_real: function!("GetReal")?,
                set_real: function!("SetReal")?,
                get_integer: function!("GetInteger")?,
                set_integer: function!("SetInteger")?,
                get_boolean: function!("GetBoolean")?,
                set_boolean: function!("SetBoolean")?,
                step: function!("DoStep")?,
            },
            true => Differing::Three {
                instantiate: function!("InstantiateCoSimulation")?,
                enter: function!("EnterInitializationMode")?,
                numbers: NUMBERS.map(|of| {
                    let get = function!(format_args!("Get{of}")).ok()?;
                    Some((get, function!(format_args!("Set{of}")).ok()?))
                }),
                get_boolean: function!("GetBoolean")?,
                set_boolean: function!("SetBoolean")?,
                step: function!("DoStep")?,
            },
        };
        // two spellings in the two standards
        let state = if three { "FMUState" } else { "FMUstate" };
        let read = if three { "Deserialize" } else { "DeSerialize" };
        let states = || -> Result<States, Refusal> {
            Ok(States {
                get: function!(format_args!("Get{state}"))?,
                set: function!(format_args!("Set{state}"))?,
                free: function!(format_args!("Free{state}"))?,
                size: function!(format_args!("Serialized{state}Size"))?,
                write: function!(format_args!("Serialize{state}"))?,
                read: function!(format_args!("{read}{state}"))?,
            })
        };
        Ok(Self {
            exit: function!("ExitInitializationMode")?,
            reset: function!("Reset")?,
            free: function!("FreeInstance")?,
            differing,
            states: states().ok(),
        })
    }
}

/// An FMU of this program.
pub(crate) struct Fmu {
    /// Name of the FMU in messages.
    pub at: String,
    pub description: Description,
    pub calls: Calls,
    /// Folder of its resources.
    pub resources: PathBuf,
    /// True while the only possible instance is in use; `None` for an FMU that can have several instances.
    pub in_use: Option<AtomicBool>,
}

/// An instance of an FMU.
pub(crate) struct Instance {
    fmu: &'static Fmu,
    handle: Handle,
    listener: Box<Listener>,
    _callbacks: Box<Callbacks>,
    /// The worst status so far.
    worst: i32,
}

// SAFETY: the standards say that threads may use an instance one after the other.
unsafe impl Send for Instance {}

/// Statuses of both standards.
pub(crate) const WARNING: i32 = 1;
pub(crate) const DISCARD: i32 = 2;
const ERROR: i32 = 3;
const FATAL: i32 = 4;

impl Drop for Instance {
    fn drop(&mut self) {
        if self.worst < FATAL {
            // SAFETY: an instance that is used no more, and that has not said that it is beyond use.
            unsafe { (self.fmu.calls.free)(self.handle) };
        }
    }
}

/// Does something with the type of a number at this place in [`NUMBERS`].
macro_rules! with_type {
    ($place:expr, $t:ident => $work:expr) => {
        with_type!(@ $place, $t => $work; 1 i32, 2 f32, 3 i8, 4 u8, 5 i16, 6 u16, 7 u32, 8 i64, 9 u64)
    };
    (@ $place:expr, $t:ident => $work:expr; $($at:literal $of:ty),+) => {
        match $place {
            $($at => { type $t = $of; $work })+
            _ => { type $t = f64; $work }
        }
    };
}

impl Instance {
    /// Makes one.
    pub fn new(fmu: &'static Fmu) -> Result<Self, Refusal> {
        let listener = Box::new(Listener {
            tell,
            last: Mutex::default(),
        });
        let callbacks = Box::new(Callbacks {
            logger: monorig_fmi2_log,
            allocate: calloc,
            free,
            finished: null(),
            listener: &*listener,
        });
        let text = |text: &str| CString::new(text).unwrap_or_default();
        let (name, token) = (text("monorig"), text(&fmu.description.token));
        let place = fmu.resources.display();
        let handle = match &fmu.calls.differing {
            Differing::Two { instantiate, .. } => {
                const CO_SIMULATION: i32 = 1;
                let place = uri(&place.to_string());
                let (name, token, place) = (name.as_ptr(), token.as_ptr(), text(&place));
                // SAFETY: texts that live until it is over, and callbacks that live as long as the instance.
                unsafe {
                    instantiate(
                        name,
                        CO_SIMULATION,
                        token,
                        place.as_ptr(),
                        &*callbacks,
                        0,
                        0,
                    )
                }
            }
            Differing::Three { instantiate, .. } => {
                let place = text(&format!("{place}{}", std::path::MAIN_SEPARATOR));
                let (name, token, place) = (name.as_ptr(), token.as_ptr(), place.as_ptr());
                let to: *const Listener = &*listener;
                // SAFETY: texts that live until it is over, and a listener that lives as long as the instance.
                unsafe {
                    instantiate(
                        name,
                        token,
                        place,
                        false,
                        false,
                        false,
                        false,
                        null(),
                        0,
                        to,
                        log_three,
                        null(),
                    )
                }
            }
        };
        let instance = Self {
            fmu,
            handle,
            listener,
            _callbacks: callbacks,
            // nothing to free
            worst: if handle.is_null() { FATAL } else { 0 },
        };
        match handle.is_null() {
            true => Err(Refusal::new(
                format!("{} cannot be instantiated: {}", fmu.at, instance.told()),
                "use an FMU that also runs in another tool on this machine",
            )),
            false => Ok(instance),
        }
    }

    /// Removes and returns the last message.
    pub fn told(&self) -> String {
        let mut last = self
            .listener
            .last
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        match last.is_empty() {
            true => "the FMU gives no reason".to_owned(),
            false => std::mem::take(&mut *last),
        }
    }

    /// Checks a status; a status that the standards do not have is an error.
    fn status(&mut self, code: i32) -> i32 {
        let code = if code < 0 { ERROR } else { code };
        self.worst = self.worst.max(code);
        code
    }

    /// Initializes the instance after its parameters are set.
    pub fn initialize(&mut self) -> i32 {
        let h = self.handle;
        let code = match &self.fmu.calls.differing {
            Differing::Two { setup, enter, .. } => {
                // SAFETY: an instance.
                let code = unsafe { setup(h, 0, 0.0, 0.0, 0, 0.0) };
                // SAFETY: an instance.
                code.max(unsafe { enter(h) })
            }
            // SAFETY: an instance.
            Differing::Three { enter, .. } => unsafe { enter(h, false, 0.0, 0.0, false, 0.0) },
        };
        if self.status(code) > WARNING {
            return code;
        }
        // SAFETY: an instance that is being initialized.
        let code = unsafe { (self.fmu.calls.exit)(h) };
        self.status(code)
    }

    /// Resets the instance to its first state.
    pub fn reset(&mut self) -> i32 {
        // SAFETY: an instance.
        let code = unsafe { (self.fmu.calls.reset)(self.handle) };
        self.status(code)
    }

    /// Sets a number, or gets it.
    fn number(&self, (r, of): &Port, number: &mut f64, set: bool) -> i32 {
        let h = self.handle;
        with_type!(*of, T => {
            let mut value = *number as T;
            let at = (&raw mut value).cast::<c_void>();
            let (x, n) = (at.cast(), at.cast());
            let code = match &self.fmu.calls.differing {
                // SAFETY: one reference, and one value of this type.
                Differing::Two { set_real, .. } if *of == 0 && set => unsafe { set_real(h, r, 1, x) },
                // SAFETY: one reference, and one place of this type.
                Differing::Two { get_real, .. } if *of == 0 => unsafe { get_real(h, r, 1, x) },
                // SAFETY: one reference, and one value of this type.
                Differing::Two { set_integer, .. } if set => unsafe { set_integer(h, r, 1, n) },
                // SAFETY: one reference, and one place of this type.
                Differing::Two { get_integer, .. } => unsafe { get_integer(h, r, 1, n) },
                Differing::Three { numbers, .. } => match numbers[*of] {
                    // SAFETY: one reference, and one value of this type.
                    Some((_, of_type)) if set => unsafe { of_type(h, r, 1, at, 1) },
                    // SAFETY: one reference, and one place of this type.
                    Some((of_type, _)) => unsafe { of_type(h, r, 1, at, 1) },
                    None => ERROR,
                },
            };
            *number = value as f64;
            code
        })
    }

    /// Sets numbers.
    pub fn set_numbers(&mut self, ports: &[Port], values: &[f64]) -> i32 {
        let both = ports.iter().zip(values);
        let worst = both
            .map(|(port, x)| self.number(port, &mut { *x }, true))
            .max();
        self.status(worst.unwrap_or(0))
    }

    /// Sets a flag.
    pub fn set_boolean(&mut self, reference: u32, value: bool) -> i32 {
        let h = self.handle;
        let code = match &self.fmu.calls.differing {
            // SAFETY: one reference and one value.
            Differing::Two { set_boolean, .. } => unsafe {
                set_boolean(h, &reference, 1, &value.into())
            },
            // SAFETY: as above.
            Differing::Three { set_boolean, .. } => unsafe {
                set_boolean(h, &reference, 1, &value, 1)
            },
        };
        self.status(code)
    }

    /// Gets numbers.
    pub fn numbers(&mut self, ports: &[Port], values: &mut [f64]) -> i32 {
        let both = ports.iter().zip(values);
        let worst = both.map(|(port, x)| self.number(port, x, false)).max();
        self.status(worst.unwrap_or(0))
    }

    /// Gets flags.
    pub fn booleans(&mut self, references: &[u32], values: &mut [bool]) -> i32 {
        let (h, calls) = (self.handle, &self.fmu.calls.differing);
        let both = references.iter().zip(values);
        let got = both.map(|(r, to)| match calls {
            Differing::Two { get_boolean, .. } => {
                let mut x = 0;
                // SAFETY: one reference and one place.
                let code = unsafe { get_boolean(h, r, 1, &mut x) };
                *to = x != 0;
                code
            }
            // SAFETY: as above.
            Differing::Three { get_boolean, .. } => unsafe { get_boolean(h, r, 1, to, 1) },
        });
        let worst = got.max();
        self.status(worst.unwrap_or(0))
    }

    /// Makes a step.
    pub fn step(&mut self, t_s: f64, dt_s: f64) -> i32 {
        let h = self.handle;
        let code = match &self.fmu.calls.differing {
            // SAFETY: an instance that is initialized.
            Differing::Two { step, .. } => unsafe { step(h, t_s, dt_s, 1) },
            Differing::Three { step, .. } => {
                let (mut event, mut end, mut early, mut last_s) = (false, false, false, t_s);
                // SAFETY: as above, and places for what it answers.
                unsafe {
                    step(
                        h,
                        t_s,
                        dt_s,
                        true,
                        &mut event,
                        &mut end,
                        &mut early,
                        &mut last_s,
                    )
                }
            }
        };
        self.status(code)
    }

    /// Returns the state as bytes; `None` if the FMU cannot save its state.
    pub fn save(&self) -> Option<Vec<u8>> {
        let states = self.states()?;
        let mut state: Handle = null_mut();
        // SAFETY: an instance, and a place for a state.
        let got = unsafe { (states.get)(self.handle, &mut state) };
        let mut size = 0;
        // SAFETY: an instance and its state, if it has given one.
        let sized = got.max(unsafe { (states.size)(self.handle, state, &mut size) });
        let mut bytes = vec![0; if sized > WARNING { 0 } else { size }];
        // SAFETY: as above, and room for so many bytes.
        let written =
            unsafe { (states.write)(self.handle, state, bytes.as_mut_ptr(), bytes.len()) };
        // SAFETY: as above; the state is used no more.
        unsafe { (states.free)(self.handle, &mut state) };
        (sized.max(written) <= WARNING).then_some(bytes)
    }

    /// Goes on from a state.
    pub fn restore(&mut self, bytes: &[u8]) -> bool {
        let Some(states) = self.states() else {
            return false;
        };
        let mut state: Handle = null_mut();
        // SAFETY: an instance, so many bytes, and a place for a state.
        let read = unsafe { (states.read)(self.handle, bytes.as_ptr(), bytes.len(), &mut state) };
        if read > WARNING {
            return false;
        }
        // SAFETY: an instance and a state that it has made.
        let set = unsafe { (states.set)(self.handle, state) };
        // SAFETY: as above; the state is used no more.
        unsafe { (states.free)(self.handle, &mut state) };
        set <= WARNING
    }

    fn states(&self) -> Option<&'static States> {
        let keeps = self.fmu.description.keeps_state;
        self.fmu.calls.states.as_ref().filter(|_| keeps)
    }
}

/// A path as a URI.
fn uri(path: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"-_.~/:".contains(&b);
    let path = path.replace('\\', "/");
    let root = if path.starts_with('/') { "" } else { "/" };
    let escaped = path.bytes().map(|b| match plain(b) {
        true => char::from(b).to_string(),
        false => format!("%{b:02X}"),
    });
    format!("file://{root}{}", escaped.collect::<String>())
}
