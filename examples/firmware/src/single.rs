//! An estimator in single precision behind signals in double precision, which are rounded on the way in.

use monorig_estimators::api::signals::{
    Command, Estimate, Flags, Measurements, Protection, Slot, Value,
};
use monorig_estimators::{Error, Estimator, Real, SnapshotError, Vehicle};
use monorig_estimators_f32 as single;
use single::api::{mass_layout::MassLayout, signals};

/// An estimator in single precision, to be given and asked for numbers in double precision.
pub struct Single<E>(pub E);

/// The vehicle with its numbers rounded; none if it is not one in single precision.
pub fn vehicle(v: &Vehicle) -> Option<single::Vehicle> {
    let pair = |pair: [Real; 2]| pair.map(|x| x as f32);
    let layout = v.layout.map(|layout| {
        let mut numbers = layout.numbers().map(|x| x as f32);
        MassLayout::from_numbers(|| numbers.next())
    });
    let data = single::VehicleData {
        tare_kg: v.tare_kg as f32,
        drives: v.drives,
        wheel_radius_m: v.wheel_radius_m as f32,
        gear_ratio: v.gear_ratio as f32,
        efficiency: v.efficiency as f32,
        rotating_mass_kg: v.rotating_mass_kg as f32,
        running_resistance: v.running_resistance as f32,
        mass_range_kg: pair(v.mass_range_kg),
        mass_guess_kg: v.mass_guess_kg.map(|kg| kg as f32),
        tare_span_m: pair(v.tare_span_m),
        load_span_m: pair(v.load_span_m),
        imu_arm_m: v.imu_arm_m as f32,
        layout: layout.flatten(),
        accel_bias_sd_mps2: v.accel_bias_sd_mps2.map(|sd| sd as f32),
        gyro_bias_sd_radps: v.gyro_bias_sd_radps.map(|sd| sd as f32),
        road: None,
    };
    single::Vehicle::new(data).ok()
}

/// The measurements, rounded.
pub fn measurements(z: &Measurements) -> signals::Measurements {
    let time = |t: monorig_estimators::Time| single::Time::from_ns(t.ns());
    let mut rounded = signals::Measurements::at(time(z.t));
    for (from, to) in Slot::all().zip(signals::Slot::all()) {
        let sample = from.get(z).map(|sample| signals::Sample {
            t: time(sample.t),
            value: sample.value.map(|x| x as f32),
        });
        to.set(&mut rounded, sample);
    }
    rounded
}

fn command(u: &Command) -> signals::Command {
    signals::Command {
        motor_torque_nm: u.motor_torque_nm.map(|x| x as f32),
        clamp_pressure_mpa: u.clamp_pressure_mpa as f32,
        brake: u.brake as f32,
    }
}

fn estimate(e: &signals::Estimate) -> Estimate {
    let value = |v: signals::Value| Value {
        value: v.value.into(),
        sd: v.sd.into(),
        valid: v.valid,
    };
    Estimate {
        t: monorig_estimators::Time::from_ns(e.t.ns()),
        total_mass_kg: value(e.total_mass_kg),
        grade_rad: value(e.grade_rad),
        effective_grade_rad: value(e.effective_grade_rad),
        speed_mps: value(e.speed_mps),
        innovation: e.innovation.into(),
        nis: e.nis.into(),
        flags: Flags {
            moving: e.flags.moving,
            excited: e.flags.excited,
            saturated: e.flags.saturated,
        },
        protection: Protection {
            total_mass_kg: e.protection.total_mass_kg.into(),
            grade_rad: e.protection.grade_rad.into(),
            effective_grade_rad: e.protection.effective_grade_rad.into(),
        },
    }
}

impl<E: single::Estimator> Estimator for Single<E> {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        let made = self.0.step(&measurements(z), &command(u), dt as f32);
        let made = made.map_err(|_| Error::own("refused in single precision"))?;
        Ok(estimate(&made))
    }

    fn reset(&mut self) {
        self.0.reset();
    }

    fn snapshot(&self, bytes: &mut [u8]) -> Result<usize, SnapshotError> {
        self.0.snapshot(bytes).map_err(|_| SnapshotError::NotKept)
    }

    fn restore(&mut self, snapshot: &[u8]) -> Result<(), SnapshotError> {
        self.0.restore(snapshot).map_err(|_| SnapshotError::Torn)
    }
}
