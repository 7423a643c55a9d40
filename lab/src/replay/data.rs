//! The recorded columns of a run, packed: per step a mask of what is there, and the values that are.

use crate::metrics::series::Target;
use monorig_estimators::Time;
use monorig_estimators::api::signals::{Command, MAX_DRIVES, Measurements, Sample, Vehicle};

/// Everything an estimator is given in a run, step by step, and the truth beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplayData {
    /// The vehicle as the estimators are given it.
    pub vehicle: Vehicle,
    /// Per step: the samples it has, one bit each; see [`COMMAND`].
    pub(super) masks: Vec<u64>,
    /// The values of all steps one after another, in the order of the bits.
    pub(super) values: Vec<f64>,
    /// The stamps of all samples, in the same order.
    pub(super) stamps: Vec<Time>,
    /// Per step: the truth.
    pub(super) truth: Vec<Target>,
}

/// Bit of a mask for a command; samples count from bit 0, in the order of [`Measurements::vectors`] and
/// [`Measurements::scalars`].
const COMMAND: u32 = 63;

impl ReplayData {
    /// Nothing recorded yet.
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
        let vectors = z.vectors();
        for (bit, sample) in (0..).zip(vectors) {
            if let Some(s) = sample {
                mask |= 1 << bit;
                stamps.push(s.t);
                values.extend(s.value);
            }
        }
        if let Some(command) = command {
            mask |= 1 << COMMAND;
            values.extend(command.motor_torque_nm);
            values.extend([command.clamp_pressure_mpa, command.brake]);
        }
        for (bit, sample) in (vectors.len()..).zip(z.scalars()) {
            if let Some(s) = sample {
                mask |= 1 << bit;
                stamps.push(s.t);
                values.push(s.value);
            }
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
    /// Samples of the step before, one bit each.
    there: u64,
    z: Measurements,
    command: Command,
}

impl Steps<'_> {
    /// The next step: samples, command, truth. Not an `Iterator`, because the samples are lent from one place.
    pub fn advance(&mut self) -> Option<(&Measurements, &Command, &Target)> {
        let mask = *self.columns.masks.get(self.step)?;
        let truth = self.columns.truth.get(self.step)?;
        self.step += 1;
        let has = |bit: u32| mask & (1 << bit) != 0;
        let mut next = || self.values.next().copied();
        let mut stamp = || self.stamps.next().copied();
        let z = &mut self.z;
        z.t = Time::from_s(truth.t_s);
        let vectors = z.vectors_mut();
        let first_scalar = vectors.len() as u32;
        for (bit, sample) in (0..).zip(vectors) {
            *sample = match has(bit) {
                true => Some(Sample {
                    t: stamp()?,
                    value: [next()?, next()?, next()?],
                }),
                false => None,
            };
        }
        if has(COMMAND) {
            for torque in &mut self.command.motor_torque_nm {
                *torque = next()?;
            }
            self.command.clamp_pressure_mpa = next()?;
            self.command.brake = next()?;
        }
        // Only what there is now, or was in the step before.
        let samples = mask & !(1 << COMMAND) & (u64::MAX << first_scalar);
        let mut touched = samples | self.there;
        while touched != 0 {
            let bit = touched.trailing_zeros();
            touched &= touched - 1;
            let place = scalar_mut(z, (bit - first_scalar) as usize)?;
            *place = match has(bit) {
                true => Some(Sample {
                    t: stamp()?,
                    value: next()?,
                }),
                false => None,
            };
        }
        self.there = samples;
        Some((&self.z, &self.command, truth))
    }
}

/// A slot with one value by its place in [`Measurements::scalars_mut`].
fn scalar_mut(z: &mut Measurements, place: usize) -> Option<&mut Option<Sample<f64>>> {
    let i = place % MAX_DRIVES;
    match place / MAX_DRIVES {
        0 => z.motor_torque_nm.get_mut(i),
        1 => z.wheel_speed_mps.get_mut(i),
        2 => z.clamp_pressure_mpa.get_mut(i),
        _ => match i {
            0 => Some(&mut z.steering_angle_rad),
            1 => Some(&mut z.inclination_rad),
            _ => z.auxiliary.get_mut(i - 2),
        },
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
            let scalar = |i: u32| {
                some(i).then(|| Sample {
                    t: Time::from_s(x(i)),
                    value: -x(i + 1),
                })
            };
            let vector = |i: u32| {
                some(i).then(|| Sample {
                    t: Time::from_s(x(i)),
                    value: [x(i), x(i + 1), x(i + 2)],
                })
            };
            let z = Measurements {
                t: Time::from_s(f64::from(k) * 0.005),
                specific_force_mps2: vector(0),
                angular_rate_radps: vector(1),
                motor_torque_nm: std::array::from_fn(|i| scalar(i as u32 + 3)),
                wheel_speed_mps: std::array::from_fn(|i| scalar(i as u32 + 20)),
                clamp_pressure_mpa: std::array::from_fn(|i| scalar(i as u32 + 40)),
                steering_angle_rad: scalar(2),
                inclination_rad: scalar(60),
                auxiliary: std::array::from_fn(|i| scalar(i as u32 + 61)),
            };
            let change = k % 3 == 0;
            if change {
                command.motor_torque_nm[k as usize % MAX_DRIVES] += 1.5;
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

    #[test]
    fn every_sample_has_its_bit() {
        let mut z = Measurements::default();
        let places: Vec<*const _> = z.scalars().map(std::ptr::from_ref).collect();
        for (i, place) in places.iter().enumerate() {
            assert_eq!(
                scalar_mut(&mut z, i).map(|p| std::ptr::from_ref(p)),
                Some(*place)
            );
        }
        assert!(scalar_mut(&mut z, places.len()).is_none());
        assert!(z.vectors().len() + z.scalars().count() <= COMMAND as usize);
    }
}
