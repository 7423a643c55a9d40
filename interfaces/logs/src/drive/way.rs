//! The distance by a reference of speed or distance, compared with the distance by the wheels.

use super::reference_columns::Columns;
use crate::map::{Map, WayReference};
use crate::notation::Quantity;
use monorig_sim::error::Error;

/// Longest gap over which a speed is integrated, ns.
const MAX_GAP_NS: i64 = 2_000_000_000;

/// A reference of the way, sample by sample.
#[derive(Clone, Debug, Default)]
pub(crate) struct Way {
    /// Time (ns of the replay), way (m) and stretch: of a speed a gap begins a new one.
    pub samples: Vec<(i64, f64, u32)>,
    /// Standard deviation of an error of the speed that stays the same, m/s; 0 of a distance.
    pub speed_sd_mps: f64,
    /// Standard deviation of each sample, m; 0 of a speed.
    pub sd_m: f64,
}

impl Way {
    /// Reads the reference of a map; none of a map without one. `origin_ns` is time zero of the replay.
    pub fn load(map: &Map, origin_ns: i64) -> Result<Option<Self>, Error> {
        let r = &map.file.reference;
        let read = |key, w: &WayReference, quantity: Quantity| {
            let unit = quantity.unit(w.unit.as_str());
            let columns = Columns {
                key,
                file: w.file.as_deref(),
                formulas: vec![(&w.column, unit)],
                valid_if: w.valid_if.as_ref(),
            };
            let sd = unit.map_or(f64::NAN, |u| u.to_si(w.sd.get()));
            columns.read(map, origin_ns).map(|rows| (rows, sd))
        };
        if let Some(w) = &r.distance {
            let (rows, sd_m) = read("reference.distance", w, Quantity::Length)?;
            let samples = rows.into_iter().map(|(t, [d, ..])| (t, d, 0)).collect();
            return Ok(Some(Self {
                samples,
                sd_m,
                ..Self::default()
            }));
        }
        let Some(w) = &r.speed else {
            return Ok(None);
        };
        let (rows, speed_sd_mps) = read("reference.speed", w, Quantity::Speed)?;
        let (mut way_m, mut stretch, mut last) = (0.0, 0, None);
        let mut samples = Vec::with_capacity(rows.len());
        for (t, [v, ..]) in rows {
            match last.replace((t, v)) {
                Some((before, u)) if t - before <= MAX_GAP_NS => {
                    way_m += 0.5 * (u + v) * (t - before) as f64 * 1e-9;
                }
                Some(_) => stretch += 1,
                None => {}
            }
            samples.push((t, way_m, stretch));
        }
        Ok(Some(Self {
            samples,
            speed_sd_mps,
            sd_m: 0.0,
        }))
    }
}
