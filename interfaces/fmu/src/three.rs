//! The functions of FMI 3.0 for co-simulation.
#![allow(non_snake_case, clippy::too_many_arguments)]

use crate::instance::{DISCARD, ERROR, Log, LogThree, OK};
use crate::two::{
    self, Handle, References, TextIn, boolean, functions_without_use, get, make, real, set,
    value_functions,
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

// words are numbers of 64 bits in FMI 3.0
value_functions! {
    fmi3GetFloat64: get(*mut f64, real, |x| x, values);
    fmi3SetFloat64: set(*const f64, real, |x| x, values);
    fmi3GetInt32: get(*mut i32, integer, |x| x as i32, values);
    fmi3SetInt32: set(*const i32, integer, f64::from, values);
    fmi3GetInt64: get(*mut i64, word, |x| x as i64, values);
    fmi3SetInt64: set(*const i64, word, |x| x as f64, values);
    fmi3GetBoolean: get(*mut bool, boolean, |x| x != 0.0, values);
    fmi3SetBoolean: set(*const bool, boolean, number, values);
}

/// Functions that do what a function of FMI 2.0 does.
macro_rules! same_as_two {
    ($($name:ident = $two:ident($($argument:ident: $of:ty),+) -> $answer:ty;)+) => {
        $(#[unsafe(no_mangle)]
        unsafe extern "C" fn $name($($argument: $of),+) -> $answer {
            // SAFETY: as the standard says.
            unsafe { two::$two($($argument),+) }
        })+
    };
}

same_as_two! {
    fmi3FreeInstance = fmi2FreeInstance(handle: Handle) -> ();
    fmi3ExitInitializationMode = fmi2ExitInitializationMode(handle: Handle) -> i32;
    fmi3Reset = fmi2Reset(handle: Handle) -> i32;
    fmi3GetFMUState = fmi2GetFMUstate(handle: Handle, to: *mut Handle) -> i32;
    fmi3SetFMUState = fmi2SetFMUstate(handle: Handle, from: Handle) -> i32;
    fmi3FreeFMUState = fmi2FreeFMUstate(handle: Handle, at: *mut Handle) -> i32;
    fmi3SerializedFMUStateSize = fmi2SerializedFMUstateSize(handle: Handle, of: Handle, size: *mut usize) -> i32;
    fmi3SerializeFMUState = fmi2SerializeFMUstate(handle: Handle, of: Handle, to: *mut u8, room: usize) -> i32;
    fmi3DeserializeFMUState = fmi2DeSerializeFMUstate(handle: Handle, from: *const u8, size: usize, to: *mut Handle) -> i32;
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

functions_without_use! {
    OK => fmi3SetDebugLogging, fmi3EnterInitializationMode, fmi3Terminate,
}
functions_without_use! {
    ERROR => fmi3EnterEventMode, fmi3EnterConfigurationMode, fmi3ExitConfigurationMode, fmi3EnterStepMode,
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
