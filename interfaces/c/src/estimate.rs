//! Estimate of a step, and the status of its measurements.

use monorig_estimators::Time;
use monorig_estimators::api::aid::{AidOutcome, AidStatus};
use monorig_estimators::api::signals::{Estimate, Flags, Protection, Value};

/// An estimated quantity: `monorig_value`.
#[repr(C)]
#[derive(Clone, Copy, Default)]
#[allow(missing_docs)] // the header has them
pub struct ValueOut {
    pub value: f64,
    pub sd: f64,
    pub valid: u64,
}

/// An estimate: `monorig_estimate`.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(missing_docs)] // the header has them
pub struct Estimated {
    pub size: u64,
    pub t_ns: i64,
    pub total_mass_kg: ValueOut,
    pub grade_rad: ValueOut,
    pub effective_grade_rad: ValueOut,
    pub speed_mps: ValueOut,
    pub innovation: f64,
    pub nis: f64,
    pub moving: u64,
    pub excited: u64,
    pub saturated: u64,
    pub total_mass_protection_kg: f64,
    pub grade_protection_rad: f64,
    pub effective_grade_protection_rad: f64,
}

impl From<Value> for ValueOut {
    fn from(v: Value) -> Self {
        Self {
            value: v.value,
            sd: v.sd,
            valid: v.valid.into(),
        }
    }
}

impl From<ValueOut> for Value {
    fn from(v: ValueOut) -> Self {
        Self {
            value: v.value,
            sd: v.sd,
            valid: v.valid != 0,
        }
    }
}

impl From<&Estimate> for Estimated {
    fn from(e: &Estimate) -> Self {
        Self {
            size: size_of::<Self>() as u64,
            t_ns: e.t.ns(),
            total_mass_kg: e.total_mass_kg.into(),
            grade_rad: e.grade_rad.into(),
            effective_grade_rad: e.effective_grade_rad.into(),
            speed_mps: e.speed_mps.into(),
            innovation: e.innovation,
            nis: e.nis,
            moving: e.flags.moving.into(),
            excited: e.flags.excited.into(),
            saturated: e.flags.saturated.into(),
            total_mass_protection_kg: e.protection.total_mass_kg,
            grade_protection_rad: e.protection.grade_rad,
            effective_grade_protection_rad: e.protection.effective_grade_rad,
        }
    }
}

impl From<&Estimated> for Estimate {
    fn from(e: &Estimated) -> Self {
        Self {
            t: Time::from_ns(e.t_ns),
            total_mass_kg: e.total_mass_kg.into(),
            grade_rad: e.grade_rad.into(),
            effective_grade_rad: e.effective_grade_rad.into(),
            speed_mps: e.speed_mps.into(),
            innovation: e.innovation,
            nis: e.nis,
            flags: Flags {
                moving: e.moving != 0,
                excited: e.excited != 0,
                saturated: e.saturated != 0,
            },
            protection: Protection {
                total_mass_kg: e.total_mass_protection_kg,
                grade_rad: e.grade_protection_rad,
                effective_grade_rad: e.effective_grade_protection_rad,
            },
        }
    }
}

/// Status of a measurement: `monorig_aid`.
#[repr(C)]
#[derive(Clone, Copy, Default)]
#[allow(missing_docs)] // the header has them
pub struct Aid {
    pub innovation: f64,
    pub innovation_variance: f64,
    pub test_ratio: f64,
    pub outcome: u64,
}

impl From<&AidStatus> for Aid {
    fn from(a: &AidStatus) -> Self {
        Self {
            innovation: a.innovation,
            innovation_variance: a.innovation_variance,
            test_ratio: a.test_ratio,
            outcome: a.outcome.code().into(),
        }
    }
}

impl From<&Aid> for AidStatus {
    /// An unknown outcome counts as stale.
    fn from(a: &Aid) -> Self {
        let code = u8::try_from(a.outcome).ok();
        Self {
            innovation: a.innovation,
            innovation_variance: a.innovation_variance,
            test_ratio: a.test_ratio,
            outcome: code.and_then(AidOutcome::from_code).unwrap_or_default(),
        }
    }
}
