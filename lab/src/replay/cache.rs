//! Recordings on disk: found again by a hash of all that made them, written whole or not at all, checked when read.

use crate::bound::BoundSample;
use crate::metrics::series::Target;
use crate::replay::{ReplayData, record};
use monorig_estimators::Time;
use monorig_estimators::api::mass_layout::MassLayout;
use monorig_estimators::api::signals::{RoadVehicle, Vehicle, VehicleData};
use monorig_sim::closed_loop::SimulationBuilder;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::file::read_large;
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;
use monorig_sim::record::identity::Identity;
use monorig_sim::record::{manifest, whole};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// First bytes of a file; the number is the format's.
const MAGIC: &[u8; 16] = b"monorig replay 6";

/// A folder of recordings.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: PathBuf,
    monorig: Identity,
}

impl Cache {
    /// Makes a cache in this folder, which is made when needed; only for recordings of this program.
    pub fn new(folder: impl Into<PathBuf>, monorig: &Identity) -> Self {
        Self {
            folder: folder.into(),
            monorig: monorig.clone(),
        }
    }

    /// The file of a scenario and seed: its name is a hash of the program, every input file, the resolved scenario
    /// and the seed, so that what was recorded from anything else is never found.
    pub fn place(&self, scenario: &Scenario, seed: u64) -> Result<PathBuf, Error> {
        let bare = record::bare(scenario);
        let resolved = serde_json::to_value(&bare).unwrap_or_default();
        let name = bare.name.clone();
        // the files that the scenario names are read when a simulation is built of it
        let built = SimulationBuilder::from_scenario(bare)?;
        let inputs = built.scenario().input_digests();
        let hash = manifest::hash(&self.monorig, &inputs, &resolved);
        let short = hash.get(..32).unwrap_or(&hash);
        Ok(self.folder.join(format!("{name}-{seed}-{short}.replay")))
    }

    /// The recording of a scenario and seed: read if it is there and whole, else made and kept. None if `go_on`
    /// stopped it.
    pub fn get(
        &self,
        scenario: &Scenario,
        registry: &Registry,
        seed: u64,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Option<ReplayData>, Error> {
        let place = self.place(scenario, seed)?;
        if let Some(found) = load(&place) {
            return Ok(Some(found));
        }
        let made = record::record(scenario, registry, seed, go_on)?;
        if let Some(columns) = &made {
            save(&place, columns)?;
        }
        Ok(made)
    }
}

/// Write a recording under a temporary name, then move it into place.
pub fn save(place: &Path, columns: &ReplayData) -> Result<(), Error> {
    if let Some(folder) = place.parent() {
        std::fs::create_dir_all(folder).map_err(Error::at(folder))?;
    }
    whole::write(place, &encode(columns))
}

/// Reads a recording; `None` if the file is missing or not complete.
pub fn load(place: &Path) -> Option<ReplayData> {
    decode(&read_large(place).ok()?)
}

fn encode(columns: &ReplayData) -> Vec<u8> {
    let (steps, values, stamps) = (columns.len(), columns.values.len(), columns.stamps.len());
    let mut body = Vec::with_capacity(96 * steps + 8 * (values + stamps) + 256);
    for count in [steps, values, stamps] {
        body.extend((count as u64).to_le_bytes());
    }
    let mut put = |x: f64| body.extend(x.to_le_bytes());
    vehicle_numbers(&columns.vehicle)
        .into_iter()
        .for_each(&mut put);
    for t in &columns.truth {
        put(t.t_s);
        put(t.total_mass_kg);
        put(t.grade_at_imu_rad);
        put(t.grade_at_middle_rad);
        put(t.grade_effective_rad);
        put(t.running_resistance);
        numbers_of(t.bound).into_iter().for_each(&mut put);
    }
    columns.values.iter().copied().for_each(&mut put);
    for stamp in &columns.stamps {
        body.extend(stamp.ns().to_le_bytes());
    }
    for mask in &columns.masks {
        body.extend(mask.to_le_bytes());
    }
    let mut file = MAGIC.to_vec();
    file.extend(Sha256::digest(&body));
    file.extend(body);
    file
}

fn decode(file: &[u8]) -> Option<ReplayData> {
    let (hash, body) = file.strip_prefix(MAGIC)?.split_at_checked(32)?;
    if Sha256::digest(body).as_slice() != hash {
        return None;
    }
    let mut words = body
        .chunks_exact(8)
        .map(|b| u64::from_le_bytes(b.try_into().unwrap_or_default()));
    let mut count = || words.next().map(|n| n as usize);
    let (steps, values, stamps) = (count()?, count()?, count()?);
    if steps.max(values).max(stamps) > body.len() / 8 {
        return None;
    }
    let mut numbers = words.by_ref().map(f64::from_bits);
    let mut get = || numbers.next();
    let vehicle = vehicle_of(&mut get)?;
    let mut columns = ReplayData::new(vehicle);
    for _ in 0..steps {
        columns.truth.push(Target {
            t_s: get()?,
            total_mass_kg: get()?,
            grade_at_imu_rad: get()?,
            grade_at_middle_rad: get()?,
            grade_effective_rad: get()?,
            running_resistance: get()?,
            // a recording of a simulation: its truth is exact
            mass_sd_kg: 0.0,
            grade_sd_rad: 0.0,
            bound: bound_of([get()?, get()?, get()?, get()?]),
        });
    }
    columns.values = numbers.take(values).collect();
    let ns = words.by_ref().map(u64::cast_signed);
    columns.stamps = ns.take(stamps).map(Time::from_ns).collect();
    let mut halves = || words.next().map(u128::from);
    columns.masks = std::iter::from_fn(|| Some(halves()? | halves()? << 64)).collect();
    let lengths = [
        columns.masks.len(),
        columns.values.len(),
        columns.stamps.len(),
    ];
    (lengths == [steps, values, stamps]).then_some(columns)
}

/// Numbers of a bound; NaN without a bound.
fn numbers_of(bound: Option<BoundSample>) -> [f64; 4] {
    bound.map_or([f64::NAN; 4], |b| {
        [b.t_s, b.slope_rad, b.effective_rad, b.mass_rel]
    })
}

fn bound_of([t_s, slope_rad, effective_rad, mass_rel]: [f64; 4]) -> Option<BoundSample> {
    (!t_s.is_nan()).then_some(BoundSample {
        t_s,
        slope_rad,
        effective_rad,
        mass_rel,
    })
}

/// Number that stands for an unknown standard deviation.
const NOT_KNOWN: f64 = -1.0;

fn known(number: f64) -> Option<f64> {
    (number >= 0.0).then_some(number)
}

/// The numbers of a vehicle, in the order [`vehicle_of`] reads them.
fn vehicle_numbers(vehicle: &Vehicle) -> Vec<f64> {
    let VehicleData {
        tare_kg,
        drives,
        wheel_radius_m,
        gear_ratio,
        efficiency,
        rotating_mass_kg,
        running_resistance,
        mass_range_kg: [mass_low, mass_high],
        mass_guess_kg,
        tare_span_m: [tare_near, tare_far],
        load_span_m: [load_near, load_far],
        imu_arm_m,
        layout,
        accel_bias_sd_mps2,
        gyro_bias_sd_radps,
        road,
    } = vehicle.data();
    let mut numbers = vec![
        tare_kg,
        drives as f64,
        wheel_radius_m,
        gear_ratio,
        efficiency,
        rotating_mass_kg,
        running_resistance,
        mass_low,
        mass_high,
        mass_guess_kg.unwrap_or(NOT_KNOWN),
        tare_near,
        tare_far,
        load_near,
        load_far,
        imu_arm_m,
        accel_bias_sd_mps2.unwrap_or(NOT_KNOWN),
        gyro_bias_sd_radps.unwrap_or(NOT_KNOWN),
        if layout.is_some() { 1.0 } else { 0.0 },
        if road.is_some() { 1.0 } else { 0.0 },
    ];
    numbers.extend(layout.iter().flat_map(MassLayout::numbers));
    if let Some(RoadVehicle {
        drag_area_m2,
        air_density_kgpm3,
        front_axle_m,
        rear_axle_m,
        front_cornering_npr,
        rear_cornering_npr,
    }) = road
    {
        numbers.extend([
            drag_area_m2,
            air_density_kgpm3,
            front_axle_m,
            rear_axle_m,
            front_cornering_npr,
            rear_cornering_npr,
        ]);
    }
    numbers
}

fn vehicle_of(get: &mut impl FnMut() -> Option<f64>) -> Option<Vehicle> {
    let mut vehicle = VehicleData {
        tare_kg: get()?,
        drives: get()? as usize,
        wheel_radius_m: get()?,
        gear_ratio: get()?,
        efficiency: get()?,
        rotating_mass_kg: get()?,
        running_resistance: get()?,
        mass_range_kg: [get()?, get()?],
        mass_guess_kg: known(get()?),
        tare_span_m: [get()?, get()?],
        load_span_m: [get()?, get()?],
        imu_arm_m: get()?,
        layout: None,
        accel_bias_sd_mps2: known(get()?),
        gyro_bias_sd_radps: known(get()?),
        road: None,
    };
    let (layout, road) = (get()?, get()?);
    if layout != 0.0 {
        vehicle.layout = Some(MassLayout::from_numbers(&mut *get)?);
    }
    if road != 0.0 {
        vehicle.road = Some(RoadVehicle {
            drag_area_m2: get()?,
            air_density_kgpm3: get()?,
            front_axle_m: get()?,
            rear_axle_m: get()?,
            front_cornering_npr: get()?,
            rear_cornering_npr: get()?,
        });
    }
    Vehicle::new(vehicle).ok()
}
