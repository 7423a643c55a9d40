//! The functions of `monorig_estimator.h`, implemented with monorig's estimators: no heap, no threads, no clock. What
//! each function does is in the header.
#![allow(clippy::missing_safety_doc)] // the header says what each pointer must be

use crate::{
    ABI, ALIGNMENT, Aid, BROKEN, Estimated, Input, Label, NominalVehicle, OK, Parameter, REFUSED,
    Reason, SetParameter, Text,
};
use core::ffi::{CStr, c_char, c_void};
use core::fmt::Display;
use monorig_estimators::api::aid::AidStatus;
use monorig_estimators::api::snapshot::SnapshotError;
use monorig_estimators::registry::{self, AnyEstimator};
use monorig_estimators::{Error, Estimator, Vehicle};

/// Panic handler, which the language needs; the estimators do not panic.
#[cfg(target_os = "none")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

/// An estimator in the memory of the caller. It owns nothing outside of it.
#[repr(align(16))]
struct Instance {
    estimator: AnyEstimator,
    drives: usize,
}

const _: () = assert!(align_of::<Instance>() == ALIGNMENT);

/// Largest number of sources of measurements of one estimator.
const MAX_AIDS: usize = 16;

/// The names there are.
fn names() -> impl Iterator<Item = &'static str> {
    let all = registry::NAMES.iter().chain(registry::PRINTED_NAMES);
    all.copied()
}

/// A name from C; empty if it is not valid.
///
/// # Safety
/// NULL, or a text that ends with a zero byte.
unsafe fn text<'a>(at: *const c_char) -> &'a str {
    if at.is_null() {
        return "";
    }
    // SAFETY: as above.
    let text = unsafe { CStr::from_ptr(at) };
    text.to_str().unwrap_or_default()
}

/// Writes through a pointer of C unless it is NULL.
///
/// # Safety
/// NULL, or a place for a `T`.
unsafe fn put<T>(at: *mut T, value: T) -> i32 {
    if at.is_null() {
        return REFUSED;
    }
    // SAFETY: as above.
    unsafe { at.write(value) };
    OK
}

/// Writes a reason.
///
/// # Safety
/// NULL, or a place for a reason.
unsafe fn tell(at: *mut Reason, why: impl Display, code: i32) -> i32 {
    // SAFETY: as above.
    unsafe { put(at, Reason::of(why)) };
    code
}

/// The item of this index as a label.
///
/// # Safety
/// NULL, or a place for a label.
unsafe fn label(item: Option<(&str, &str)>, out: *mut Label) -> i32 {
    let Some((name, unit)) = item else {
        return REFUSED;
    };
    let label = Label {
        name: Text::of(name),
        unit: Text::of(unit),
    };
    // SAFETY: as above.
    unsafe { put(out, label) }
}

/// The instance in the memory of the caller.
///
/// # Safety
/// NULL, or memory in which `monorig_create` has made an instance.
unsafe fn instance<'a>(memory: *const c_void) -> Option<&'a Instance> {
    // SAFETY: as above.
    unsafe { memory.cast::<Instance>().as_ref() }
}

/// Returns the instance in this memory for changes.
///
/// # Safety
/// As [`instance`], used by nobody else.
unsafe fn instance_mut<'a>(memory: *mut c_void) -> Option<&'a mut Instance> {
    // SAFETY: as above.
    unsafe { memory.cast::<Instance>().as_mut() }
}

/// A list of C.
///
/// # Safety
/// NULL, or so many items.
unsafe fn list<'a, T>(at: *const T, count: u64) -> &'a [T] {
    match usize::try_from(count) {
        // SAFETY: as above.
        Ok(count) if !at.is_null() => unsafe { core::slice::from_raw_parts(at, count) },
        _ => &[],
    }
}

/// A list of C to be written.
///
/// # Safety
/// NULL, or so many items that nobody else uses.
unsafe fn list_mut<'a, T>(at: *mut T, count: u64) -> &'a mut [T] {
    match usize::try_from(count) {
        // SAFETY: as above.
        Ok(count) if !at.is_null() => unsafe { core::slice::from_raw_parts_mut(at, count) },
        _ => &mut [],
    }
}

#[unsafe(no_mangle)]
extern "C" fn monorig_abi() -> u32 {
    ABI
}

#[unsafe(no_mangle)]
unsafe extern "C" fn monorig_name_at(index: u64, out: *mut Label) -> i32 {
    let item = usize::try_from(index).ok().and_then(|i| names().nth(i));
    // SAFETY: a place for a label, as the header says.
    unsafe { label(item.map(|name| (name, "-")), out) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn monorig_size(name: *const c_char) -> u64 {
    // SAFETY: a text, as the header says.
    let name = unsafe { text(name) };
    match names().any(|n| n == name) {
        true => size_of::<Instance>() as u64,
        false => 0,
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn monorig_create(
    memory: *mut c_void,
    name: *const c_char,
    vehicle: *const NominalVehicle,
    settings: *const SetParameter,
    count: u64,
    reason: *mut Reason,
) -> i32 {
    let memory = memory.cast::<Instance>();
    // SAFETY: a text, as the header says.
    let name = unsafe { text(name) };
    // SAFETY: NULL or a vehicle, as the header says.
    let vehicle = unsafe { vehicle.as_ref() };
    // SAFETY: so many settings, as the header says.
    let settings = unsafe { list(settings, count) };
    let refuse = |why: &dyn Display| {
        // SAFETY: NULL or a place for a reason, as the header says.
        unsafe { tell(reason, why, REFUSED) }
    };
    if memory.is_null() || !memory.is_aligned() {
        return refuse(&"the memory is not aligned to 16 bytes");
    }
    let Some(vehicle) = vehicle.filter(|v| v.size == size_of::<NominalVehicle>() as u64) else {
        return refuse(&"the size of the vehicle struct differs from this header");
    };
    let built = Vehicle::try_from(vehicle).and_then(|vehicle| {
        let estimator = registry::build(name, &vehicle, settings.iter().map(|s| s.setting()))?;
        let drives = vehicle.drives;
        Ok(Instance { estimator, drives })
    });
    match built {
        // SAFETY: memory for an instance, as the header says, aligned as checked.
        Ok(instance) => unsafe { put(memory, instance) },
        Err(why) => refuse(&why),
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn monorig_step(
    memory: *mut c_void,
    input: *const Input,
    out: *mut Estimated,
    reason: *mut Reason,
) -> i32 {
    // SAFETY: an instance, as the header says.
    let instance = unsafe { instance_mut(memory) };
    // SAFETY: NULL or an input, as the header says.
    let input = unsafe { input.as_ref() };
    // SAFETY: NULL or an estimate, as the header says.
    let out = unsafe { out.as_mut() };
    let (Some(instance), Some(input), Some(out)) = (instance, input, out) else {
        // SAFETY: NULL or a place for a reason, as the header says.
        return unsafe { tell(reason, "a struct is NULL", BROKEN) };
    };
    let sizes = [size_of::<Input>() as u64, size_of::<Estimated>() as u64];
    if [input.size, out.size] != sizes {
        let why = "the size of the input or estimate struct differs from this header";
        // SAFETY: NULL or a place for a reason, as the header says.
        return unsafe { tell(reason, why, BROKEN) };
    }
    let (z, u, dt) = input.read(instance.drives);
    match instance.estimator.step(&z, &u, dt) {
        Ok(estimate) => {
            *out = Estimated::from(&estimate);
            OK
        }
        Err(why) => {
            let code = match why {
                Error::Broken(_) => BROKEN,
                _ => REFUSED,
            };
            // SAFETY: NULL or a place for a reason, as the header says.
            unsafe { tell(reason, why, code) }
        }
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn monorig_reset(memory: *mut c_void) {
    // SAFETY: an instance, as the header says.
    if let Some(instance) = unsafe { instance_mut(memory) } {
        instance.estimator.reset();
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn monorig_parameter_at(
    name: *const c_char,
    index: u64,
    out: *mut Parameter,
) -> i32 {
    // SAFETY: a text, as the header says.
    let name = unsafe { text(name) };
    let mut keys = registry::keys(name).into_iter().flatten();
    let key = usize::try_from(index).ok().and_then(|i| keys.nth(i));
    match key {
        // SAFETY: a place for a parameter, as the header says.
        Some(key) => unsafe { put(out, Parameter::from(key)) },
        None => REFUSED,
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn monorig_internal_at(
    memory: *const c_void,
    index: u64,
    out: *mut Label,
) -> i32 {
    // SAFETY: an instance, as the header says.
    let all = unsafe { instance(memory) }.map_or(&[][..], |i| i.estimator.internals());
    let one = usize::try_from(index).ok().and_then(|i| all.get(i));
    // SAFETY: a place for a label, as the header says.
    unsafe { label(one.map(|i| (i.name, i.unit)), out) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn monorig_internal_values(memory: *const c_void, values: *mut f64, room: u64) {
    // SAFETY: an instance, as the header says.
    let instance = unsafe { instance(memory) };
    // SAFETY: room for so many, as the header says.
    let values = unsafe { list_mut(values, room) };
    if let Some(instance) = instance {
        instance.estimator.internal_values(values);
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn monorig_aid_at(memory: *const c_void, index: u64, out: *mut Label) -> i32 {
    // SAFETY: an instance, as the header says.
    let all = unsafe { instance(memory) }.map_or(&[][..], |i| i.estimator.aid_sources());
    let one = usize::try_from(index).ok().and_then(|i| all.get(i));
    // SAFETY: a place for a label, as the header says.
    unsafe { label(one.map(|name| (*name, "-")), out) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn monorig_aid_status(memory: *const c_void, status: *mut Aid, room: u64) {
    // SAFETY: an instance, as the header says.
    let instance = unsafe { instance(memory) };
    // SAFETY: room for so many, as the header says.
    let status = unsafe { list_mut(status, room) };
    if let Some(instance) = instance {
        let mut all = [AidStatus::default(); MAX_AIDS];
        instance.estimator.aid_status(&mut all);
        let there = all.iter().take(instance.estimator.aid_sources().len());
        let both = status.iter_mut().zip(there);
        both.for_each(|(to, from)| *to = Aid::from(from));
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn monorig_snapshot(memory: *const c_void, bytes: *mut u8, room: u64) -> i64 {
    // SAFETY: an instance, as the header says.
    let instance = unsafe { instance(memory) };
    // SAFETY: room for so many, as the header says.
    let bytes = unsafe { list_mut(bytes, room) };
    match instance.map(|i| i.estimator.snapshot(bytes)) {
        Some(Ok(used) | Err(SnapshotError::Room(used))) => i64::try_from(used).unwrap_or(-1),
        Some(Err(_)) | None => -1,
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn monorig_restore(
    memory: *mut c_void,
    bytes: *const u8,
    length: u64,
    reason: *mut Reason,
) -> i32 {
    // SAFETY: an instance, as the header says.
    let instance = unsafe { instance_mut(memory) };
    // SAFETY: so many bytes, as the header says.
    let bytes = unsafe { list(bytes, length) };
    match instance.map(|i| i.estimator.restore(bytes)) {
        Some(Ok(())) => OK,
        // SAFETY: NULL or a place for a reason, as the header says.
        Some(Err(why)) => unsafe { tell(reason, why, REFUSED) },
        None => REFUSED,
    }
}
