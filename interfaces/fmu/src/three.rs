//! The functions of FMI 3.0 for co-simulation.
#![allow(non_snake_case, clippy::too_many_arguments)]

use crate::instance::{DISCARD, ERROR, Log, LogThree, OK};
use crate::two::{
    self, Handle, References, TextIn, boolean, functions_without_use, get, make, real, set,
};
use crate::variable::{Kind, number};
use std::ffi::c_void;
use std::ptr::null_mut;

fn integer(kind: Kind) -> bool {
    kind == Kind::Integer
}

fn word(kind: Kind) -> bool {
    matches!(kind, Kind::Word(_))
}

#[unsafe(no_mangle)]
extern "C" fn fmi3GetVersion() -> TextIn {
    c"3.0".as_ptr()
}

#[unsafe(no_mangle)]
extern "C" fn fmi3SetDebugLogging(_: Handle, _: bool, _: usize, _: *const TextIn) -> i32 {
    OK
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3InstantiateCoSimulation(
    name: TextIn,
    token: TextIn,
    resources: TextIn,
    _visible: bool,
    _logging: bool,
    _events: bool,
    _early_return: bool,
    _intermediate: References,
    _count: usize,
    environment: *mut c_void,
    log: Option<LogThree>,
    _update: *const c_void,
) -> Handle {
    // SAFETY: texts, as the standard says.
    unsafe { make(name, token, resources, Log::Three(log, environment)) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3InstantiateModelExchange() -> Handle {
    null_mut()
}

#[unsafe(no_mangle)]
extern "C" fn fmi3InstantiateScheduledExecution() -> Handle {
    null_mut()
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3FreeInstance(handle: Handle) {
    // SAFETY: an instance that is used no more, as the standard says.
    unsafe { two::fmi2FreeInstance(handle) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3EnterInitializationMode(
    _: Handle,
    _: bool,
    _: f64,
    _: f64,
    _: bool,
    _: f64,
) -> i32 {
    OK
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3ExitInitializationMode(handle: Handle) -> i32 {
    // SAFETY: an instance, as the standard says.
    unsafe { two::fmi2ExitInitializationMode(handle) }
}

#[unsafe(no_mangle)]
extern "C" fn fmi3Terminate(_: Handle) -> i32 {
    OK
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3Reset(handle: Handle) -> i32 {
    // SAFETY: an instance, as the standard says.
    unsafe { two::fmi2Reset(handle) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3GetFloat64(
    h: Handle,
    r: References,
    count: usize,
    to: *mut f64,
    values: usize,
) -> i32 {
    match count == values {
        // SAFETY: as the standard says.
        true => unsafe { get(h, (r, count), to, real, |x| x) },
        false => ERROR,
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3SetFloat64(
    h: Handle,
    r: References,
    count: usize,
    x: *const f64,
    values: usize,
) -> i32 {
    match count == values {
        // SAFETY: as the standard says.
        true => unsafe { set(h, (r, count), x, real, |x| x) },
        false => ERROR,
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3GetInt32(
    h: Handle,
    r: References,
    count: usize,
    to: *mut i32,
    values: usize,
) -> i32 {
    match count == values {
        // SAFETY: as the standard says.
        true => unsafe { get(h, (r, count), to, integer, |x| x as i32) },
        false => ERROR,
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3SetInt32(
    h: Handle,
    r: References,
    count: usize,
    x: *const i32,
    values: usize,
) -> i32 {
    match count == values {
        // SAFETY: as the standard says.
        true => unsafe { set(h, (r, count), x, integer, f64::from) },
        false => ERROR,
    }
}

/// Words are numbers of 64 bits in FMI 3.0.
#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3GetInt64(
    h: Handle,
    r: References,
    count: usize,
    to: *mut i64,
    values: usize,
) -> i32 {
    match count == values {
        // SAFETY: as the standard says.
        true => unsafe { get(h, (r, count), to, word, |x| x as i64) },
        false => ERROR,
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3SetInt64(
    h: Handle,
    r: References,
    count: usize,
    x: *const i64,
    values: usize,
) -> i32 {
    match count == values {
        // SAFETY: as the standard says.
        true => unsafe { set(h, (r, count), x, word, |x| x as f64) },
        false => ERROR,
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3GetBoolean(
    h: Handle,
    r: References,
    count: usize,
    to: *mut bool,
    values: usize,
) -> i32 {
    match count == values {
        // SAFETY: as the standard says.
        true => unsafe { get(h, (r, count), to, boolean, |x| x != 0.0) },
        false => ERROR,
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3SetBoolean(
    h: Handle,
    r: References,
    count: usize,
    x: *const bool,
    values: usize,
) -> i32 {
    match count == values {
        // SAFETY: as the standard says.
        true => unsafe { set(h, (r, count), x, boolean, number) },
        false => ERROR,
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3DoStep(
    handle: Handle,
    t_s: f64,
    dt_s: f64,
    _no_state_before: bool,
    event: *mut bool,
    terminate: *mut bool,
    early: *mut bool,
    last_s: *mut f64,
) -> i32 {
    for flag in [event, terminate, early] {
        // SAFETY: NULL or a place for a flag, as the standard says.
        if let Some(flag) = unsafe { flag.as_mut() } {
            *flag = false;
        }
    }
    // SAFETY: an instance, as the standard says.
    let code = unsafe { two::fmi2DoStep(handle, t_s, dt_s, 1) };
    // SAFETY: NULL or a place for a time, as the standard says.
    if let Some(last_s) = unsafe { last_s.as_mut() } {
        *last_s = if code < DISCARD { t_s + dt_s } else { t_s };
    }
    code
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3GetFMUState(handle: Handle, to: *mut Handle) -> i32 {
    // SAFETY: as the standard says.
    unsafe { two::fmi2GetFMUstate(handle, to) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3SetFMUState(handle: Handle, from: Handle) -> i32 {
    // SAFETY: as the standard says.
    unsafe { two::fmi2SetFMUstate(handle, from) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3FreeFMUState(handle: Handle, at: *mut Handle) -> i32 {
    // SAFETY: as the standard says.
    unsafe { two::fmi2FreeFMUstate(handle, at) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3SerializedFMUStateSize(h: Handle, of: Handle, size: *mut usize) -> i32 {
    // SAFETY: as the standard says.
    unsafe { two::fmi2SerializedFMUstateSize(h, of, size) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3SerializeFMUState(h: Handle, of: Handle, to: *mut u8, room: usize) -> i32 {
    // SAFETY: as the standard says.
    unsafe { two::fmi2SerializeFMUstate(h, of, to, room) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3DeserializeFMUState(
    handle: Handle,
    from: *const u8,
    size: usize,
    to: *mut Handle,
) -> i32 {
    // SAFETY: as the standard says.
    unsafe { two::fmi2DeSerializeFMUstate(handle, from, size, to) }
}

functions_without_use! {
    fmi3EnterEventMode, fmi3EnterConfigurationMode, fmi3ExitConfigurationMode, fmi3EnterStepMode,
    fmi3EnterContinuousTimeMode, fmi3CompletedIntegratorStep, fmi3SetTime, fmi3SetContinuousStates,
    fmi3GetContinuousStateDerivatives, fmi3GetEventIndicators, fmi3GetContinuousStates,
    fmi3GetNominalsOfContinuousStates, fmi3GetNumberOfEventIndicators, fmi3GetNumberOfContinuousStates,
    fmi3ActivateModelPartition, fmi3UpdateDiscreteStates, fmi3EvaluateDiscreteStates, fmi3GetFloat32, fmi3GetInt8,
    fmi3GetUInt8, fmi3GetInt16, fmi3GetUInt16, fmi3GetUInt32, fmi3GetUInt64, fmi3GetString, fmi3GetBinary,
    fmi3GetClock, fmi3SetFloat32, fmi3SetInt8, fmi3SetUInt8, fmi3SetInt16, fmi3SetUInt16, fmi3SetUInt32,
    fmi3SetUInt64, fmi3SetString, fmi3SetBinary, fmi3SetClock, fmi3GetNumberOfVariableDependencies,
    fmi3GetVariableDependencies, fmi3GetDirectionalDerivative, fmi3GetAdjointDerivative, fmi3GetIntervalDecimal,
    fmi3GetIntervalFraction, fmi3GetShiftDecimal, fmi3GetShiftFraction, fmi3SetIntervalDecimal,
    fmi3SetIntervalFraction, fmi3SetShiftDecimal, fmi3SetShiftFraction, fmi3GetOutputDerivatives,
}
