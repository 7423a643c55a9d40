//! The scalar of every estimator, and its elementary functions from libm: the same bits on every machine, and no
//! standard library.

use libm::Libm;

/// The scalar of every estimator: double precision here, single in the package `monorig-estimators-f32`.
#[cfg(not(single_precision))]
pub type Real = f64;

/// The scalar of every estimator: single precision here, double in the package `monorig-estimators`.
#[cfg(single_precision)]
pub type Real = f32;

/// Gravity of the force balances, m/s²: the default of the scenarios. It is a local value and no unit; standard
/// gravity, by which sheets count in g, is 9.80665 m/s².
pub const GRAVITY: Real = 9.81;

/// The circle constant.
pub const PI: Real = core::f64::consts::PI as Real;

/// Sine of an angle in rad.
#[inline]
pub fn sin(x: Real) -> Real {
    Libm::<Real>::sin(x)
}

/// Cosine of an angle in rad.
#[inline]
pub fn cos(x: Real) -> Real {
    Libm::<Real>::cos(x)
}

/// Sine and cosine of an angle in rad, the same bits as [`sin`] and [`cos`] in one call.
#[inline]
pub fn sin_cos(x: Real) -> [Real; 2] {
    let (sine, cosine) = Libm::<Real>::sincos(x);
    [sine, cosine]
}

/// Angle in rad whose sine is `x`; `x` is first limited to −1…1, so the answer is always finite for finite `x`.
#[inline]
pub(crate) fn asin(x: Real) -> Real {
    Libm::<Real>::asin(x.clamp(-1.0, 1.0))
}

/// Largest whole number not above `x`.
pub(crate) fn floor(x: Real) -> Real {
    Libm::<Real>::floor(x)
}

/// The figure in single precision, which halves what a memory of many takes.
#[allow(clippy::unnecessary_cast)] // not with double precision
pub(crate) fn stored(figure: Real) -> f32 {
    figure as f32
}

/// Square root; 0 for a negative argument, which only rounding can make here.
#[inline]
pub fn sqrt(x: Real) -> Real {
    Libm::<Real>::sqrt(x.max(0.0))
}

/// e to the power `x`.
#[inline]
pub(crate) fn exp(x: Real) -> Real {
    Libm::<Real>::exp(x)
}

/// Natural logarithm.
#[inline]
pub(crate) fn ln(x: Real) -> Real {
    Libm::<Real>::log(x)
}

/// `base` to the power `exponent`.
#[inline]
pub(crate) fn pow(base: Real, exponent: Real) -> Real {
    Libm::<Real>::pow(base, exponent)
}

/// Hyperbolic tangent.
#[inline]
pub(crate) fn tanh(x: Real) -> Real {
    Libm::<Real>::tanh(x)
}

/// `x` limited to `low`…`high`. Unlike `clamp` it never panics; NaN stays NaN.
#[inline]
pub(crate) fn within(x: Real, low: Real, high: Real) -> Real {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}

/// Share of a step a first-order lag of time constant `tau_s` makes in `dt_s`: 1 − exp(−dt/τ).
#[inline]
pub(crate) fn lag(dt_s: Real, tau_s: Real) -> Real {
    1.0 - exp(-dt_s / tau_s)
}
