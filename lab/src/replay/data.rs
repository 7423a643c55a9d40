//! The recorded columns of a run, packed: per step a mask of what is there, and the values that are.

use crate::metrics::series::Target;
use monorig_estimators::Time;
use monorig_estimators::api::signals::{Command, Measurements, Sample, Slot, Vehicle};

/// All inputs of an estimator in a run, step by step, and the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplayData {
    /// Nominal vehicle for the estimators.
    pub vehicle: Vehicle,
    /// Per step: the samples it has, one bit each; see [`COMMAND`].
    pub(super) masks: Vec<u128>,
    /// The values of all steps one after another, in the order of the bits.
    pub(super) values: Vec<f64>,
    /// The stamps of all samples, in the same order.
    pub(super) stamps: Vec<Time>,
    /// Per step: the truth.
    pub(super) truth: Vec<Target>,
}

/// Bit of a mask for a command; samples count from bit 0, in the order of [`Slot::all`].
const COMMAND: usize = 127;

const _: () = assert!(Slot::COUNT <= COMMAND, "a mask has too few bits");

impl ReplayData {
    /// Makes an empty recording.
    pub fn new(vehicle: Vehicle) -> Self {
        Self {
            vehicle,
            masks: Vec::new(),
            values: Vec::new(),
            stamps: Vec::new(),
            truth: Vec::new(),
        }
    }

    /// Steps recorded.
    pub fn len(&self) -> usize {
        self.masks.len()
    }

    /// True without a step.
    pub fn is_empty(&self) -> bool {
        self.masks.is_empty()
    }

    /// Add a step; `command` if it is another than in the step before (before the first: all zero).
    pub fn push(&mut self, z: &Measurements, command: Option<&Command>, truth: Target) {
        let mut mask = 0;
        let (values, stamps) = (&mut self.values, &mut self.stamps);
        for (bit, slot) in Slot::all().enumerate() {
            if let Some(s) = slot.get(z) {
                mask |= 1 << bit;
                stamps.push(s.t);
                values.extend(&s.value[..slot.measurand.shape().values()]);
            }
        }
        if let Some(command) = command {
            mask |= 1 << COMMAND;
            values.extend(command.motor_torque_nm);
            values.extend([command.clamp_pressure_mpa, command.brake]);
        }
        self.masks.push(mask);
        self.truth.push(truth);
    }

    /// The steps from the first on.
    pub fn steps(&self) -> Steps<'_> {
        Steps {
            columns: self,
            step: 0,
            values: self.values.iter(),
            stamps: self.stamps.iter(),
            slots: Slot::all().collect(),
            there: 0,
            z: Measurements::default(),
            command: Command::default(),
        }
    }
}

/// Goes through recorded steps, unpacking one at a time.
pub struct Steps<'a> {
    columns: &'a ReplayData,
    step: usize,
    values: std::slice::Iter<'a, f64>,
    stamps: std::slice::Iter<'a, Time>,
    /// The slot of each bit.
    slots: Vec<Slot>,
    /// Samples of the previous step, one bit each.
    there: u128,
    z: Measurements,
    command: Command,
}

impl Steps<'_> {
    /// The next step: samples, command, truth. Not an `Iterator`, because the samples are lent from one place.
    pub fn advance(&mut self) -> Option<(&Measurements, &Command, &Target)> {
        let mask = *self.columns.masks.get(self.step)?;
        let truth = self.columns.truth.get(self.step)?;
        self.step += 1;
        let mut next = || self.values.next().copied();
        let z = &mut self.z;
        z.t = Time::from_s(truth.t_s);
        // Only what there is now, or was in the step before.
        let samples = mask & !(1 << COMMAND);
        let mut touched = samples | self.there;
        while touched != 0 {
            let bit = touched.trailing_zeros() as usize;
            touched &= touched - 1;
            let slot = self.slots.get(bit)?;
            let mut sample = None;
            if samples & (1 << bit) != 0 {
                let t = *self.stamps.next()?;
                let mut value = [0.0; 3];
                for x in value.iter_mut().take(slot.measurand.shape().values()) {
                    *x = next()?;
                }
                sample = Some(Sample { t, value });
            }
            slot.set(z, sample);
        }
        if mask & (1 << COMMAND) != 0 {
            for torque in &mut self.command.motor_torque_nm {
                *torque = next()?;
            }
            self.command.clamp_pressure_mpa = next()?;
            self.command.brake = next()?;
        }
        self.there = samples;
        Some((&self.z, &self.command, truth))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorig_sim::testing::vehicle;

    /// Every stream there and not there, commands that change and that stay.
    #[test]
    fn unpacks_what_was_packed() {
        let mut columns = ReplayData::new(vehicle());
        let mut kept = Vec::new();
        let mut command = Command::default();
        for k in 0..200_u32 {
            let x = |i: u32| f64::from(k) + f64::from(i) / 64.0;
            let some = |i: u32| !(k * 7 + i * 3).is_multiple_of(i + 2);
            let mut z = Measurements::at(Time::from_s(f64::from(k) * 0.005));
            for (i, slot) in (0..).zip(Slot::all()) {
                let mut value = [-x(i + 1), 0.0, 0.0];
                if slot.measurand.shape().values() == 3 {
                    value = [x(i), x(i + 1), x(i + 2)];
                }
                let t = Time::from_s(x(i));
                slot.set(&mut z, some(i).then_some(Sample { t, value }));
            }
            let change = k % 3 == 0;
            if change {
                command.motor_torque_nm[k as usize % 16] += 1.5;
                command.brake = f64::from(k % 2);
            }
            let truth = Target {
                t_s: z.t.s(),
                total_mass_kg: x(9),
                grade_at_imu_rad: x(10),
                grade_effective_rad: x(11),
                running_resistance: x(12),
                ..Target::default()
            };
            columns.push(&z, change.then_some(&command), truth);
            kept.push((z, command, truth));
        }
        let mut steps = columns.steps();
        for (z, command, truth) in &kept {
            assert_eq!(steps.advance(), Some((z, command, truth)));
        }
        assert_eq!(steps.advance(), None);
    }
}
