//! The table of measured quantities, and the measurements of a step.
//!
//! A row of the table `measurements!` makes the field of [`Measurements`], the [`Measurand`] and its [`Slot`]s. Data
//! sheets, faults, replays, recorded logs, exports and recorded columns go through [`Measurand::ALL`] or [`Slot::all`],
//! so a new row reaches all of them.

use crate::{Real, Time};

/// Largest number of drive units of a train.
pub const MAX_DRIVES: usize = 16;

/// Largest number of readings of a user's own instruments.
pub const MAX_AUXILIARY: usize = 4;

/// A measured value and its instant on the sensor's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<T> {
    /// Instant of the value.
    pub t: Time,
    /// The value, in the unit of the field that holds it.
    pub value: T,
}

impl<T> Sample<T> {
    /// Returns a sample of the same instant with another value.
    pub fn map<U>(self, change: impl FnOnce(T) -> U) -> Sample<U> {
        Sample {
            t: self.t,
            value: change(self.value),
        }
    }
}

/// Form of a measured quantity: how many samples it has, and of how many values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One sample of three values: forward, left, up.
    Vector,
    /// One sample of one value.
    Scalar,
    /// A sample of one value for each drive unit, counted from the front.
    PerDrive,
    /// Samples of one value for a user's own estimators.
    Auxiliary,
}

impl Shape {
    /// Number of slots.
    pub const fn slots(self) -> usize {
        match self {
            Self::Vector | Self::Scalar => 1,
            Self::PerDrive => MAX_DRIVES,
            Self::Auxiliary => MAX_AUXILIARY,
        }
    }

    /// Number of values of a sample.
    pub const fn values(self) -> usize {
        match self {
            Self::Vector => 3,
            _ => 1,
        }
    }
}

/// Type of the field of a shape.
macro_rules! samples {
    (Vector) => { Option<Sample<[Real; 3]>> };
    (Scalar) => { Option<Sample<Real>> };
    (PerDrive) => { [Option<Sample<Real>>; MAX_DRIVES] };
    (Auxiliary) => { [Option<Sample<Real>>; MAX_AUXILIARY] };
}

macro_rules! measurements {
    ($($(#[doc = $about:literal])+ $measurand:ident $name:literal: $shape:tt $field:ident, $unit:literal;)+) => {
        /// New samples since the last call. `None` = no new sample: rates differ, samples drop out, samples arrive
        /// late.
        ///
        /// IMU axes: x forward (growing chainage), y left, z up, so a grade that grows shows as a *negative* rate about
        /// y.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct Measurements {
            /// Present instant.
            pub t: Time,
            $($(#[doc = $about])+ #[doc = concat!(" Unit: ", $unit, ".")] pub $field: samples!($shape),)+
        }

        /// A measured quantity: a row of the table.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Measurand {
            $($(#[doc = $about])+ $measurand,)+
        }

        impl Measurand {
            /// All rows of the table, in its order.
            pub const ALL: &'static [Self] = &[$(Self::$measurand),+];

            /// Name in map files, exports and recorded columns.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$measurand => $name,)+ }
            }

            /// Unit of its values.
            pub const fn unit(self) -> &'static str {
                match self { $(Self::$measurand => $unit,)+ }
            }

            /// Form of its samples.
            pub const fn shape(self) -> Shape {
                match self { $(Self::$measurand => Shape::$shape,)+ }
            }

            /// Description, in sentences.
            pub const fn about(self) -> &'static str {
                match self { $(Self::$measurand => concat!($($about),+).trim_ascii(),)+ }
            }
        }

        impl Slot {
            /// Number of all slots.
            pub const COUNT: usize = 0 $(+ Shape::$shape.slots())+;

            /// The sample in the slot. One of a single value has zeros behind it.
            #[inline]
            pub fn get(self, z: &Measurements) -> Option<Sample<[Real; 3]>> {
                match self.measurand { $(Measurand::$measurand => z.$field.sample_at(self.index),)+ }
            }

            /// Replaces the sample in the slot. Of a single value only the first one counts.
            #[inline]
            pub fn set(self, z: &mut Measurements, sample: Option<Sample<[Real; 3]>>) {
                match self.measurand { $(Measurand::$measurand => z.$field.set_sample(self.index, sample),)+ }
            }
        }

        impl Measurements {
            /// True if there is any sample.
            pub fn any(&self) -> bool {
                $(self.$field.any())||+
            }

            /// Copies the samples of `newer` and keeps the others.
            pub fn merge(&mut self, newer: &Self) {
                $(self.$field.merge(&newer.$field);)+
            }
        }
    };
}

// A row: description; name of the measurand, and as text; form, field with the unit in its name; unit.
measurements! {
    /// Specific force (acceleration minus gravity) in IMU axes: at rest on the level it is 1 g upwards.
    SpecificForce "specific_force": Vector specific_force_mps2, "m/s²";
    /// Angular rate in IMU axes.
    AngularRate "angular_rate": Vector angular_rate_radps, "rad/s";
    /// Torque at the motor shaft of each drive unit.
    MotorTorque "motor_torque": PerDrive motor_torque_nm, "N·m";
    /// Circumferential speed of the friction wheels of each drive unit (rate × nominal radius).
    WheelSpeed "wheel_speed": PerDrive wheel_speed_mps, "m/s";
    /// Clamp cylinder pressure of each drive unit.
    ClampPressure "clamp_pressure": PerDrive clamp_pressure_mpa, "MPa";
    /// Steering angle of a road vehicle's front wheels, + left. Never on a rail.
    SteeringAngle "steering_angle": Scalar steering_angle_rad, "rad";
    /// Pitch of the inclinometer against the apparent vertical, + nose up: acceleration along the rail is in it.
    Inclination "inclination": Scalar inclination_rad, "rad";
    /// Readings of a user's own instruments, in their own units.
    Auxiliary "auxiliary": Auxiliary auxiliary, "1";
}

impl Measurements {
    /// Makes measurements without a sample, at this instant.
    pub fn at(t: Time) -> Self {
        Self {
            t,
            ..Self::default()
        }
    }
}

impl Measurand {
    /// The measurand of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|m| m.name() == name)
    }

    /// Slots of the measurand, for drive units from the front.
    pub fn slots(self) -> impl Iterator<Item = Slot> {
        (0..self.shape().slots()).map(move |index| self.slot(index))
    }

    /// Slot number `index` of the measurand.
    pub const fn slot(self, index: usize) -> Slot {
        Slot {
            measurand: self,
            index,
        }
    }
}

/// Place of one sample in the measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Slot {
    /// The measured quantity.
    pub measurand: Measurand,
    /// Number among the slots of the measurand, such as the number of the drive unit.
    pub index: usize,
}

impl Slot {
    /// All slots, in the order of the table.
    pub fn all() -> impl Iterator<Item = Self> {
        Measurand::ALL.iter().flat_map(|m| m.slots())
    }

    /// Name of its measurand.
    pub const fn name(self) -> &'static str {
        self.measurand.name()
    }

    /// Unit of its values.
    pub const fn unit(self) -> &'static str {
        self.measurand.unit()
    }
}

/// Samples of a field of the measurements, by their index.
trait Samples {
    fn sample_at(&self, index: usize) -> Option<Sample<[Real; 3]>>;
    fn set_sample(&mut self, index: usize, sample: Option<Sample<[Real; 3]>>);
    fn any(&self) -> bool;
    fn merge(&mut self, newer: &Self);
}

impl Samples for Option<Sample<[Real; 3]>> {
    fn sample_at(&self, _: usize) -> Option<Sample<[Real; 3]>> {
        *self
    }

    fn set_sample(&mut self, _: usize, sample: Option<Sample<[Real; 3]>>) {
        *self = sample;
    }

    fn any(&self) -> bool {
        self.is_some()
    }

    fn merge(&mut self, newer: &Self) {
        *self = newer.or(*self);
    }
}

impl Samples for Option<Sample<Real>> {
    fn sample_at(&self, _: usize) -> Option<Sample<[Real; 3]>> {
        self.map(|s| s.map(|x| [x, 0.0, 0.0]))
    }

    fn set_sample(&mut self, _: usize, sample: Option<Sample<[Real; 3]>>) {
        *self = sample.map(|s| s.map(|[x, ..]| x));
    }

    fn any(&self) -> bool {
        self.is_some()
    }

    fn merge(&mut self, newer: &Self) {
        *self = newer.or(*self);
    }
}

impl<const N: usize> Samples for [Option<Sample<Real>>; N] {
    fn sample_at(&self, index: usize) -> Option<Sample<[Real; 3]>> {
        self.get(index)?.sample_at(0)
    }

    fn set_sample(&mut self, index: usize, sample: Option<Sample<[Real; 3]>>) {
        if let Some(slot) = self.get_mut(index) {
            slot.set_sample(0, sample);
        }
    }

    fn any(&self) -> bool {
        self.iter().any(Option::is_some)
    }

    fn merge(&mut self, newer: &Self) {
        for (old, new) in self.iter_mut().zip(newer) {
            old.merge(new);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::vec::Vec;

    fn sample(x: Real) -> Option<Sample<[Real; 3]>> {
        let t = Time::from_s(1.5);
        let value = [x, 0.0, 0.0];
        Some(Sample { t, value })
    }

    /// A sample that is set in a slot is got there and nowhere else, and is one of the measurements.
    #[test]
    fn every_slot_holds_a_sample_of_its_own() {
        let all: Vec<Slot> = Slot::all().collect();
        assert_eq!(all.len(), Slot::COUNT);
        for slot in &all {
            let mut z = Measurements::default();
            assert!(!z.any());
            slot.set(&mut z, sample(7.0));
            let there: Vec<_> = all.iter().filter(|s| s.get(&z).is_some()).collect();
            assert_eq!(there, [slot]);
            assert_eq!(slot.get(&z), sample(7.0));
            assert!(z.any());
            slot.set(&mut z, None);
            assert_eq!(z, Measurements::default());
        }
    }

    #[test]
    fn slots_are_the_fields_of_their_names() {
        let mut z = Measurements::default();
        Measurand::WheelSpeed.slot(3).set(&mut z, sample(1.25));
        assert_eq!(z.wheel_speed_mps[3].map(|s| s.value), Some(1.25));
        let vector = Some(Sample {
            t: Time::from_s(2.0),
            value: [1.0, 2.0, 3.0],
        });
        z.specific_force_mps2 = vector;
        assert_eq!(Measurand::SpecificForce.slot(0).get(&z), vector);
        assert_eq!(Measurand::WheelSpeed.slot(MAX_DRIVES).get(&z), None);
    }

    #[test]
    fn names_are_given_once() {
        let names: BTreeSet<_> = Measurand::ALL.iter().map(|m| m.name()).collect();
        assert_eq!(names.len(), Measurand::ALL.len());
        for m in Measurand::ALL {
            assert_eq!(Measurand::named(m.name()), Some(*m));
            assert!(m.about().ends_with('.') && !m.unit().is_empty());
        }
        assert_eq!(Measurand::named("wheel"), None);
    }

    #[test]
    fn a_newer_sample_takes_the_place_of_the_older_one() {
        for slot in Slot::all() {
            let (mut old, mut new) = (Measurements::default(), Measurements::default());
            slot.set(&mut old, sample(1.0));
            old.merge(&new);
            assert_eq!(slot.get(&old), sample(1.0), "none is no sample");
            slot.set(&mut new, sample(2.0));
            old.merge(&new);
            assert_eq!(slot.get(&old), sample(2.0));
        }
    }
}
