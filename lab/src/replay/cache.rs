//! Recordings on disk: found again by a hash of all that made them, written whole or not at all, checked when read.

use crate::bound::BoundSample;
use crate::metrics::series::Target;
use crate::replay::{ReplayData, record};
use monorig_estimators::Time;
use monorig_estimators::api::signals::Vehicle;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::{Simulation, SimulationBuilder};
use monorig_sim::config::file::read_large;
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;
use monorig_sim::record::identity::Identity;
use monorig_sim::record::{manifest, whole};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// First bytes of a file; the number is the format's.
const MAGIC: &[u8; 16] = b"monorig replay 7";

/// A folder of recordings.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: PathBuf,
    monorig: Identity,
}

impl Cache {
    /// In this folder, which is made when it is needed; recordings of this program only.
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
        if place.is_file() {
            let vehicle = Simulation::build(record::bare(scenario), registry, seed)?.vehicle;
            if let Some(found) = load(&place, vehicle) {
                return Ok(Some(found));
            }
        }
        let made = record::record(scenario, registry, seed, go_on)?;
        if let Some(columns) = &made {
            save(&place, columns)?;
        }
        Ok(made)
    }
}

/// Write a recording, all but its vehicle, under a temporary name, then move it into place.
pub fn save(place: &Path, columns: &ReplayData) -> Result<(), Error> {
    if let Some(folder) = place.parent() {
        std::fs::create_dir_all(folder).map_err(Error::at(folder))?;
    }
    whole::write(place, &encode(columns))
}

/// Read a recording of this vehicle; none if there is no file, or if it is not whole.
pub fn load(place: &Path, vehicle: Vehicle) -> Option<ReplayData> {
    decode(&read_large(place).ok()?, vehicle)
}

fn encode(columns: &ReplayData) -> Vec<u8> {
    let (steps, values, stamps) = (columns.len(), columns.values.len(), columns.stamps.len());
    let mut body = Vec::with_capacity(96 * steps + 8 * (values + stamps) + 256);
    for count in [steps, values, stamps] {
        body.extend((count as u64).to_le_bytes());
    }
    let mut put = |x: f64| body.extend(x.to_le_bytes());
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

fn decode(file: &[u8], vehicle: Vehicle) -> Option<ReplayData> {
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

/// Numbers of a bound; not numbers where there is none.
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
