//! Functions of FMI 2.0 for co-simulation, and the code that they share with FMI 3.0.
#![allow(non_snake_case)]

use crate::instance::{ERROR, Instance, Log, LogTwo, OK};
use crate::variable::{Kind, number};
use std::ffi::{CStr, c_char, c_void};
use std::ptr::null_mut;

/// An instance, or a state of one, as the importer holds it.
pub(crate) type Handle = *mut c_void;
/// A text of the importer.
pub(crate) type TextIn = *const c_char;
/// References of variables.
pub(crate) type References = *const u32;

/// Callbacks of the importer.
#[repr(C)]
struct Callbacks {
    logger: Option<LogTwo>,
    allocate: *const c_void,
    free: *const c_void,
    finished: *const c_void,
    environment: *mut c_void,
}

/// A text; empty if there is none.
///
/// # Safety
/// NULL, or a text that ends with a zero byte.
pub(crate) unsafe fn text<'a>(at: TextIn) -> &'a CStr {
    if at.is_null() {
        return c"";
    }
    // SAFETY: as above.
    unsafe { CStr::from_ptr(at) }
}

/// A list.
///
/// # Safety
/// NULL, or so many items.
pub(crate) unsafe fn list<'a, T>(at: *const T, count: usize) -> &'a [T] {
    match at.is_null() || count == 0 {
        true => &[],
        // SAFETY: as above.
        false => unsafe { std::slice::from_raw_parts(at, count) },
    }
}

/// A list to be written.
///
/// # Safety
/// NULL, or so many items that nobody else uses.
pub(crate) unsafe fn list_mut<'a, T>(at: *mut T, count: usize) -> &'a mut [T] {
    match at.is_null() || count == 0 {
        true => &mut [],
        // SAFETY: as above.
        false => unsafe { std::slice::from_raw_parts_mut(at, count) },
    }
}

/// Runs an action on an instance.
///
/// # Safety
/// NULL, or an instance that nobody else uses.
pub(crate) unsafe fn act(
    handle: Handle,
    act: impl FnOnce(&mut Instance) -> Result<i32, String>,
) -> i32 {
    // SAFETY: as above.
    let instance = unsafe { handle.cast::<Instance>().as_mut() };
    instance.map_or(ERROR, |instance| instance.act(act))
}

/// Makes an instance.
///
/// # Safety
/// Texts or NULL.
pub(crate) unsafe fn make(name: TextIn, token: TextIn, resources: TextIn, log: Log) -> Handle {
    // SAFETY: as above.
    let name = unsafe { text(name) };
    // SAFETY: as above.
    let token = unsafe { text(token) };
    // SAFETY: as above.
    let resources = unsafe { text(resources) };
    let (token, resources) = (token.to_string_lossy(), resources.to_string_lossy());
    match Instance::new(name, &token, &resources, log) {
        Some(instance) => Box::into_raw(Box::new(instance)).cast(),
        None => null_mut(),
    }
}

/// Gets variables of a type.
///
/// # Safety
/// An instance, and so many references and places.
pub(crate) unsafe fn get<T>(
    handle: Handle,
    (references, count): (References, usize),
    values: *mut T,
    kind: fn(Kind) -> bool,
    of: fn(f64) -> T,
) -> i32 {
    // SAFETY: as above.
    let references = unsafe { list(references, count) };
    // SAFETY: as above.
    let values = unsafe { list_mut(values, count) };
    let get = |i: &mut Instance| {
        for (reference, to) in references.iter().zip(values) {
            *to = of(i.get(*reference, kind)?);
        }
        Ok(OK)
    };
    // SAFETY: as above.
    unsafe { act(handle, get) }
}

/// Sets variables of a type.
///
/// # Safety
/// An instance, and so many references and values.
pub(crate) unsafe fn set<T: Copy>(
    handle: Handle,
    (references, count): (References, usize),
    values: *const T,
    kind: fn(Kind) -> bool,
    of: fn(T) -> f64,
) -> i32 {
    // SAFETY: as above.
    let references = unsafe { list(references, count) };
    // SAFETY: as above.
    let values = unsafe { list(values, count) };
    let set = |i: &mut Instance| {
        let mut all = references.iter().zip(values);
        all.try_for_each(|(reference, x)| i.set(*reference, kind, of(*x)))?;
        Ok(OK)
    };
    // SAFETY: as above.
    unsafe { act(handle, set) }
}

/// True of a number.
pub(crate) fn real(kind: Kind) -> bool {
    kind == Kind::Real
}

/// True of a flag.
pub(crate) fn boolean(kind: Kind) -> bool {
    kind == Kind::Boolean
}

/// True of a whole number, and of a word, which FMI 2.0 takes for one.
fn integer(kind: Kind) -> bool {
    matches!(kind, Kind::Integer | Kind::Word(_))
}

#[unsafe(no_mangle)]
extern "C" fn fmi2GetTypesPlatform() -> TextIn {
    c"default".as_ptr()
}

#[unsafe(no_mangle)]
extern "C" fn fmi2GetVersion() -> TextIn {
    c"2.0".as_ptr()
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi2Instantiate(
    name: TextIn,
    kind: i32,
    token: TextIn,
    resources: TextIn,
    callbacks: *const Callbacks,
    _visible: i32,
    _logging: i32,
) -> Handle {
    // SAFETY: NULL or callbacks, as the standard says.
    let callbacks = unsafe { callbacks.as_ref() };
    let log = callbacks.map_or(Log::Two(None, null_mut()), |c| {
        Log::Two(c.logger, c.environment)
    });
    const CO_SIMULATION: i32 = 1;
    if kind != CO_SIMULATION {
        log.tell(c"monorig", ERROR, "this FMU is for co-simulation only");
        return null_mut();
    }
    // SAFETY: texts, as the standard says.
    unsafe { make(name, token, resources, log) }
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi2FreeInstance(handle: Handle) {
    if !handle.is_null() {
        // SAFETY: an instance that `make` has made, used no more.
        drop(unsafe { Box::from_raw(handle.cast::<Instance>()) });
    }
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi2ExitInitializationMode(handle: Handle) -> i32 {
    // SAFETY: an instance, as the standard says.
    unsafe { act(handle, Instance::begin) }
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi2Reset(handle: Handle) -> i32 {
    // SAFETY: an instance, as the standard says.
    unsafe { act(handle, Instance::reset) }
}

/// Functions of a standard that get or set variables: the place of the values, their kind, and how they are converted.
/// FMI 3.0 gives the number of values, too.
macro_rules! value_functions {
    ($($name:ident: $act:ident($at:ty, $kind:ident, $of:expr $(, $values:ident)?);)+) => {
        $(#[unsafe(no_mangle)]
        unsafe extern "C" fn $name(
            handle: Handle,
            references: References,
            count: usize,
            at: $at,
            $($values: usize,)?
        ) -> i32 {
            $(if count != $values {
                return ERROR;
            })?
            // SAFETY: as the standard says.
            unsafe { $act(handle, (references, count), at, $kind, $of) }
        })+
    };
}
pub(crate) use value_functions;

value_functions! {
    fmi2GetReal: get(*mut f64, real, |x| x);
    fmi2SetReal: set(*const f64, real, |x| x);
    fmi2GetInteger: get(*mut i32, integer, |x| x as i32);
    fmi2SetInteger: set(*const i32, integer, f64::from);
    fmi2GetBoolean: get(*mut i32, boolean, |x| x as i32);
    fmi2SetBoolean: set(*const i32, boolean, |x| number(x != 0));
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi2DoStep(handle: Handle, t_s: f64, dt_s: f64, _: i32) -> i32 {
    // SAFETY: an instance, as the standard says.
    unsafe { act(handle, |i| i.step(t_s, dt_s)) }
}

/// A state, as bytes behind a handle.
///
/// # Safety
/// NULL, or a state that `keep` has made.
unsafe fn state<'a>(state: Handle) -> Result<&'a [u8], String> {
    // SAFETY: as above.
    let bytes = unsafe { state.cast::<Vec<u8>>().as_ref() };
    bytes
        .map(Vec::as_slice)
        .ok_or("no state is given".to_owned())
}

/// Puts bytes behind a handle of the importer, in place of what was there.
///
/// # Safety
/// NULL, or a place with NULL or a state in it.
unsafe fn keep(at: *mut Handle, bytes: Vec<u8>) -> Result<i32, String> {
    // SAFETY: as above.
    let at = unsafe { at.as_mut() }.ok_or("no place for a state is given")?;
    // SAFETY: as above.
    match unsafe { at.cast::<Vec<u8>>().as_mut() } {
        Some(there) => *there = bytes,
        None => *at = Box::into_raw(Box::new(bytes)).cast(),
    }
    Ok(OK)
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi2GetFMUstate(handle: Handle, to: *mut Handle) -> i32 {
    // SAFETY: a place for a state, as the standard says.
    let get = |i: &mut Instance| unsafe { keep(to, i.save()?) };
    // SAFETY: an instance, as the standard says.
    unsafe { act(handle, get) }
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi2SetFMUstate(handle: Handle, from: Handle) -> i32 {
    // SAFETY: a state, as the standard says.
    let bytes = unsafe { state(from) };
    // SAFETY: an instance, as the standard says.
    unsafe { act(handle, |i| i.load(bytes?)) }
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi2FreeFMUstate(_: Handle, at: *mut Handle) -> i32 {
    // SAFETY: NULL or a place with a state, as the standard says.
    if let Some(at) = unsafe { at.as_mut() } {
        if !at.is_null() {
            // SAFETY: a state that `keep` has made, used no more.
            drop(unsafe { Box::from_raw(at.cast::<Vec<u8>>()) });
        }
        *at = null_mut();
    }
    OK
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi2SerializedFMUstateSize(
    handle: Handle,
    of: Handle,
    size: *mut usize,
) -> i32 {
    // SAFETY: a state, as the standard says.
    let bytes = unsafe { state(of) };
    // SAFETY: NULL or a place for a number, as the standard says.
    let size = unsafe { size.as_mut() };
    let tell = |_: &mut Instance| {
        *size.ok_or("no place for the size is given")? = bytes?.len();
        Ok(OK)
    };
    // SAFETY: an instance, as the standard says.
    unsafe { act(handle, tell) }
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi2SerializeFMUstate(
    handle: Handle,
    of: Handle,
    to: *mut u8,
    room: usize,
) -> i32 {
    // SAFETY: a state, as the standard says.
    let bytes = unsafe { state(of) };
    // SAFETY: room for so many, as the standard says.
    let to = unsafe { list_mut(to, room) };
    let write = |_: &mut Instance| {
        let bytes = bytes?;
        let to = to
            .get_mut(..bytes.len())
            .ok_or("the given memory is too small")?;
        to.copy_from_slice(bytes);
        Ok(OK)
    };
    // SAFETY: an instance, as the standard says.
    unsafe { act(handle, write) }
}

#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn fmi2DeSerializeFMUstate(
    handle: Handle,
    from: *const u8,
    size: usize,
    to: *mut Handle,
) -> i32 {
    // SAFETY: so many bytes, as the standard says.
    let bytes = unsafe { list(from, size) };
    // SAFETY: a place for a state, as the standard says.
    let read = |_: &mut Instance| unsafe { keep(to, bytes.to_vec()) };
    // SAFETY: an instance, as the standard says.
    unsafe { act(handle, read) }
}

/// Functions of a standard with a constant answer, for features that these FMUs do not have or need. They take what the
/// standard says and look at none of it.
macro_rules! functions_without_use {
    ($answer:expr => $($name:ident),+ $(,)?) => {
        $(#[unsafe(no_mangle)]
        extern "C" fn $name() -> i32 {
            $answer
        })+
    };
}
pub(crate) use functions_without_use;

functions_without_use! {
    OK => fmi2SetDebugLogging, fmi2SetupExperiment, fmi2EnterInitializationMode, fmi2Terminate,
}
functions_without_use! {
    ERROR => fmi2GetString, fmi2SetString, fmi2GetDirectionalDerivative, fmi2SetRealInputDerivatives,
    fmi2GetRealOutputDerivatives, fmi2CancelStep, fmi2GetStatus, fmi2GetRealStatus, fmi2GetIntegerStatus,
    fmi2GetBooleanStatus, fmi2GetStringStatus,
}
