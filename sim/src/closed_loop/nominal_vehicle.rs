//! Nominal vehicle: the parameters of the train given to estimators and controller, never its true values.

use super::mass_layout;
use super::told::Told;
use crate::checked::{Finite, NonNegative};
use crate::config::scenario::{PlantKind, Scenario};
use crate::sensors::instruments::{accelerometer, gyro};
use crate::sensors::spec::{InstrumentSpec, InstrumentSpecs};
use crate::train::Train;
use monorig_estimators::api::mass_layout::MassLayout;
use monorig_estimators::api::signals::VehicleData;

/// Nominal total mass, from which estimators and controller start unless the scenario gives a guess: tare and half the
/// rated load, kg.
pub fn nominal_mass_kg(train: &Train) -> f64 {
    train.tare_kg() + 0.5 * train.limits.max_load_kg
}

/// The nominal vehicle of a train: its data sheet with what is drawn about it, and the changes of the scenario. `imu`
/// is the mount of the IMU.
pub fn of_train(scenario: &Scenario, train: &Train, imu: usize, seed: u64) -> VehicleData {
    let nominal = &scenario.file.vehicle;
    let told = Told::new(scenario, seed);
    let first = train.drives.first();
    let tare = told.near("tare", nominal.tare_kg, train.tare_kg(), |t| t.tare);
    // The IMU pitches with its unit: it measures the grade under the middle of the unit.
    let unit = train
        .mounts
        .get(imu)
        .and_then(|m| train.bodies.get(m.body).map(|b| (m.pose.translation.x, b)));
    let (mount_x, middle_x, start_s) = unit.map_or((0.0, 0.0, 0.0), |(x, b)| {
        let n = b.stations.len();
        let middle = if n == 0 {
            x
        } else {
            b.stations.iter().map(|st| st.x_m).sum::<f64>() / n as f64
        };
        (x, middle, b.start_s)
    });
    let point = scenario.file.plant() == PlantKind::PointMass;
    let (tare_span_m, load_span_m, imu_arm_m) = match point {
        true => Default::default(),
        false => {
            let (tare, load) = train.spans_behind(start_s + middle_x);
            (tare, load, mount_x - middle_x)
        }
    };
    let resistance = train.nominal_running_resistance(
        nominal_mass_kg(train),
        scenario.file.physics.gravity_mps2.get(),
    );
    let layout = train.mounts.get(imu).and_then(|mount| {
        let at_m = start_s + middle_x;
        let layout = mass_layout::of_train(train, at_m, mount.body, -mount.pose.translation.z)?;
        let mut load = layout.load;
        load.chain_m = told.near("chain", nominal.chain_m, load.chain_m, |t| t.chain);
        Some(MassLayout {
            load_share_of_resistance: (train.resistance.running_wheel / resistance).min(1.0),
            load,
            ..layout
        })
    });
    let with_layout = !point && nominal.layout.unwrap_or(true);
    let wheel_radius_m = first.map_or(0.17, |d| d.wheel_radius_m);
    VehicleData {
        tare_kg: tare,
        drives: train.drives.len(),
        wheel_radius_m: told.near(
            "wheel_radius",
            nominal.wheel_radius_m,
            wheel_radius_m,
            |t| t.wheel_radius,
        ),
        gear_ratio: first.map_or(1.0, |d| d.gear_ratio),
        efficiency: told.efficiency(first.map_or(1.0, |d| d.efficiency_drive)),
        rotating_mass_kg: train.rotating_mass_kg(),
        running_resistance: told.near(
            "running_resistance",
            nominal.running_resistance,
            resistance,
            |t| t.running_resistance,
        ),
        mass_range_kg: [0.5 * tare, tare + 1.5 * train.limits.max_load_kg],
        mass_guess_kg: told.mass_guess_kg([tare, tare + train.limits.max_load_kg]),
        tare_span_m,
        load_span_m,
        imu_arm_m: nominal.imu_arm_m.map_or(imu_arm_m, f64::from),
        layout: layout.filter(|_| with_layout),
        accel_bias_sd_mps2: None,
        gyro_bias_sd_radps: None,
        road: None,
    }
}

/// Lower limit of the accelerometer bias given to estimators as a standard deviation, m/s²: temperature and mounting of
/// a calibrated one.
const MIN_ACCEL_BIAS_SD_MPS2: f64 = 0.01;

/// The vehicle with the biases along the train by the sensor sheet: bias, switch-on bias and, of the
/// accelerometer, the pitch of its mount times gravity. Standard deviations, never the values drawn.
pub fn with_biases(vehicle: VehicleData, specs: &InstrumentSpecs, gravity: f64) -> VehicleData {
    let accelerometer = specs.get(accelerometer::KIND.name);
    let gyro = specs.get(gyro::KIND.name);
    let tilted = |spec: &InstrumentSpec| {
        let tilt_deg = spec.misalignment_sd_deg.map_or(0.0, NonNegative::get);
        let tilt = gravity * tilt_deg.to_radians();
        spec.errors
            .drawn_bias_sd()
            .hypot(tilt)
            .max(MIN_ACCEL_BIAS_SD_MPS2)
    };
    VehicleData {
        accel_bias_sd_mps2: accelerometer.map(tilted),
        gyro_bias_sd_radps: gyro.map(|spec| spec.errors.drawn_bias_sd()),
        ..vehicle
    }
}

/// The specifications with the IMU's mount turned by a rotation vector, degrees.
pub fn turned(specs: &InstrumentSpecs, mount_deg: [f64; 3]) -> InstrumentSpecs {
    let mut specs = specs.clone();
    for name in [accelerometer::KIND.name, gyro::KIND.name] {
        if let Some(spec) = specs.get_mut(name) {
            let known = spec.misalignment_deg.unwrap_or_default().map(Finite::get);
            let sum: [f64; 3] = std::array::from_fn(|i| known[i] + mount_deg[i]);
            spec.misalignment_deg = Some(sum.map(Finite::new));
        }
    }
    specs
}
