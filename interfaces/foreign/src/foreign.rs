//! An estimator of a library in a run.

use crate::library::{LabelAt, Library, labels};
use core::ffi::c_void;
use monorig_c::{Aid, BROKEN, Estimated, Input, Label, NominalVehicle, OK, Reason, SetParameter};
use monorig_estimators::api::aid::AidStatus;
use monorig_estimators::api::estimator::Internal;
use monorig_estimators::api::signals::{Command, Estimate, Measurements};
use monorig_estimators::api::snapshot::SnapshotError;
use monorig_estimators::{Error, Estimator, Real, Vehicle};
use monorig_sim::closed_loop::interned;
use monorig_sim::closed_loop::registry::{NamedSettings, Refusal};
use std::cell::UnsafeCell;
use std::ffi::CString;
use std::sync::atomic::Ordering;

/// 16 bytes with the alignment of the header.
#[repr(align(16))]
struct Block(#[allow(dead_code)] [u8; 16]);

/// One instance of an estimator of a library.
pub(crate) struct Foreign {
    library: &'static Library,
    memory: Box<[UnsafeCell<Block>]>,
    input: Box<Input>,
    drives: usize,
    internals: Vec<Internal>,
    aids: Vec<&'static str>,
}

// SAFETY: the header says that threads may use an instance one after the other.
unsafe impl Send for Foreign {}

impl Drop for Foreign {
    fn drop(&mut self) {
        if let Some(destroy) = self.library.destroy {
            // SAFETY: an instance that is used no more.
            unsafe { destroy(self.at()) };
        }
        if let Some(in_use) = &self.library.in_use {
            in_use.store(false, Ordering::Release);
        }
    }
}

/// Refuses values that an estimate must not have.
pub(crate) fn checked(e: Estimate) -> Result<Estimate, Error> {
    let values = [
        ("total_mass_kg", e.total_mass_kg),
        ("grade_rad", e.grade_rad),
        ("effective_grade_rad", e.effective_grade_rad),
        ("speed_mps", e.speed_mps),
    ];
    for (name, v) in values {
        if !v.value.is_finite() {
            let valid = if v.valid { ", and is marked valid" } else { "" };
            return Err(Error::own(format_args!("{name} is {}{valid}", v.value)));
        }
        if !(v.sd >= 0.0 && v.sd.is_finite()) {
            return Err(Error::own(format_args!("the sd of {name} is {}", v.sd)));
        }
    }
    match e.is_finite() {
        true => Ok(e),
        false => Err(Error::own(
            "innovation, NIS or protection level is not finite",
        )),
    }
}

impl Foreign {
    /// Builds one; the settings are checked by the registry.
    pub fn build(
        library: &'static Library,
        name: &str,
        vehicle: &Vehicle,
        settings: NamedSettings<'_>,
    ) -> Result<Self, Refusal> {
        let c_name = CString::new(name).unwrap_or_default();
        let blocks = library.size(&c_name)?.div_ceil(size_of::<Block>());
        let memory = (0..blocks).map(|_| UnsafeCell::new(Block([0; 16])));
        let memory: Box<[_]> = memory.collect();
        let taken = library
            .in_use
            .as_ref()
            .map(|u| u.swap(true, Ordering::AcqRel));
        if taken == Some(true) {
            return Err(Refusal::new(
                format!("{} can have one instance at a time", library.at),
                "use one estimator of it in a scenario, and make one run at a time (`--jobs 1`); or remove its static variables",
            ));
        }
        let nominal = NominalVehicle::from(vehicle);
        let set: Vec<SetParameter> = settings
            .iter()
            .map(|(k, v)| SetParameter::new(k, *v))
            .collect();
        let mut reason = Reason::default();
        // SAFETY: memory as the library asks for, a text, and structs that live until it is over.
        let code = unsafe {
            (library.create)(
                memory.as_ptr().cast_mut().cast(),
                c_name.as_ptr(),
                &nominal,
                set.as_ptr(),
                set.len() as u64,
                &mut reason,
            )
        };
        if code != OK {
            if let Some(in_use) = &library.in_use {
                in_use.store(false, Ordering::Release);
            }
            let why = match reason.as_str() {
                "" => "without a reason",
                why => why,
            };
            return Err(Refusal::new(
                format!("{} refuses to build `{name}`: {why}", library.at),
                "use a vehicle and parameters for which this estimator can be built",
            ));
        }
        let mut built = Self {
            library,
            memory,
            input: Box::default(),
            drives: vehicle.drives,
            internals: Vec::new(),
            aids: Vec::new(),
        };
        let internals = built.labels(library.internal_at).into_iter();
        let of = |l: Label| Internal::new(interned(l.name.as_str()), interned(l.unit.as_str()));
        built.internals = internals.map(of).collect();
        let aids = built.labels(library.aid_at).into_iter();
        built.aids = aids.map(|l| interned(l.name.as_str())).collect();
        Ok(built)
    }

    fn labels(&self, function: Option<LabelAt>) -> Vec<Label> {
        let Some(f) = function else {
            return Vec::new();
        };
        labels(|index, out| {
            // SAFETY: an instance, and a place for a label.
            unsafe { f(self.at(), index, out) }
        })
    }

    /// The memory of the instance, which the library alone writes.
    fn at(&self) -> *mut c_void {
        self.memory.as_ptr().cast_mut().cast()
    }
}

impl Estimator for Foreign {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        self.input.fill(z, u, dt, self.drives);
        let mut out = Estimated::from(&Estimate::at(z.t));
        let mut reason = Reason::default();
        // SAFETY: an instance, and structs that live until it is over.
        let code = unsafe { (self.library.step)(self.at(), &*self.input, &mut out, &mut reason) };
        let why = match reason.as_str() {
            "" => "the library gives no reason",
            why => why,
        };
        match code {
            OK => checked(Estimate::from(&out)),
            BROKEN => Err(Error::broken(why)),
            _ => Err(Error::own(why)),
        }
    }

    fn reset(&mut self) {
        // SAFETY: an instance.
        unsafe { (self.library.reset)(self.at()) };
    }

    fn internals(&self) -> &[Internal] {
        &self.internals
    }

    fn internal_values(&self, values: &mut [Real]) {
        if let Some(f) = self.library.internal_values {
            // SAFETY: an instance, and room for so many.
            unsafe { f(self.at(), values.as_mut_ptr(), values.len() as u64) };
        }
    }

    fn aid_sources(&self) -> &[&'static str] {
        &self.aids
    }

    fn aid_status(&self, status: &mut [AidStatus]) {
        if let Some(f) = self.library.aid_status {
            let mut all = vec![Aid::default(); status.len().min(self.aids.len())];
            // SAFETY: an instance, and room for so many.
            unsafe { f(self.at(), all.as_mut_ptr(), all.len() as u64) };
            let both = status.iter_mut().zip(&all);
            both.for_each(|(to, from)| *to = from.into());
        }
    }

    fn snapshot(&self, bytes: &mut [u8]) -> Result<usize, SnapshotError> {
        let f = self.library.snapshot.ok_or(SnapshotError::NotKept)?;
        // SAFETY: an instance, and room for so many.
        let used = unsafe { f(self.at(), bytes.as_mut_ptr(), bytes.len() as u64) };
        match usize::try_from(used) {
            Ok(used) if used <= bytes.len() => Ok(used),
            Ok(used) => Err(SnapshotError::Room(used)),
            Err(_) => Err(SnapshotError::NotKept),
        }
    }

    fn restore(&mut self, snapshot: &[u8]) -> Result<(), SnapshotError> {
        let f = self.library.restore.ok_or(SnapshotError::NotKept)?;
        let mut reason = Reason::default();
        // SAFETY: an instance, so many bytes, and a place for a reason.
        let code = unsafe {
            f(
                self.at(),
                snapshot.as_ptr(),
                snapshot.len() as u64,
                &mut reason,
            )
        };
        match code {
            OK => Ok(()),
            _ => Err(SnapshotError::Corrupt),
        }
    }
}
