//! Estimates of another program: a table of them as an estimator that plays it back, so that it is judged as those in
//! the loop are.

use crate::read::{self, ReadOptions};
use crate::wrong;
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::signals::{Command, Estimate, Measurements, Protection, Value};
use monorig_sim::closed_loop::registry::{Registry, RegistryError};
use monorig_sim::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

monorig_estimators::params! {
    /// Parameters of an estimator that plays a file.
    PlayedParams { max_age_s ["s"] = 1.0, 1e-3 => 3600.0, "Age after which an estimate is marked invalid; until then it counts until the next row."; }
}

/// A quantity of an estimate, the columns it may be in with their factors to SI units, and those of its standard
/// deviation and validity.
struct EstimatedQuantity {
    value: &'static [(&'static str, f64)],
    sd: &'static [(&'static str, f64)],
    valid: &'static [(&'static str, f64)],
    place: fn(&mut Estimate) -> &mut Value,
}

const DEG: f64 = std::f64::consts::PI / 180.0;

/// All quantities; names as users write them, and as `channels.parquet` has them behind `estimates/NAME/`.
const QUANTITIES: [EstimatedQuantity; 4] = [
    EstimatedQuantity {
        value: &[
            ("mass_kg", 1.0),
            ("total_mass_kg", 1.0),
            ("total_mass", 1.0),
        ],
        sd: &[("mass_sd_kg", 1.0), ("total_mass_sd", 1.0)],
        valid: &[("mass_valid", 1.0), ("total_mass_valid", 1.0)],
        place: |e| &mut e.total_mass_kg,
    },
    EstimatedQuantity {
        value: &[("slope_deg", DEG), ("slope_rad", 1.0), ("grade", 1.0)],
        sd: &[
            ("slope_sd_deg", DEG),
            ("slope_sd_rad", 1.0),
            ("grade_sd", 1.0),
        ],
        valid: &[("slope_valid", 1.0), ("grade_valid", 1.0)],
        place: |e| &mut e.grade_rad,
    },
    EstimatedQuantity {
        value: &[
            ("effective_slope_deg", DEG),
            ("effective_slope_rad", 1.0),
            ("effective_grade", 1.0),
        ],
        sd: &[
            ("effective_slope_sd_deg", DEG),
            ("effective_slope_sd_rad", 1.0),
            ("effective_grade_sd", 1.0),
        ],
        valid: &[
            ("effective_slope_valid", 1.0),
            ("effective_grade_valid", 1.0),
        ],
        place: |e| &mut e.effective_grade_rad,
    },
    EstimatedQuantity {
        value: &[("speed_mps", 1.0), ("speed", 1.0)],
        sd: &[("speed_sd_mps", 1.0), ("speed_sd", 1.0)],
        valid: &[("speed_valid", 1.0)],
        place: |e| &mut e.speed_mps,
    },
];

/// Protection levels: the columns they may be in, and their places.
const LEVELS: [EstimatedLevel; 3] = [
    (
        &[("mass_protection_kg", 1.0), ("total_mass_protection", 1.0)],
        |p| &mut p.total_mass_kg,
    ),
    (
        &[
            ("slope_protection_deg", DEG),
            ("slope_protection_rad", 1.0),
            ("grade_protection", 1.0),
        ],
        |p| &mut p.grade_rad,
    ),
    (
        &[
            ("effective_slope_protection_deg", DEG),
            ("effective_slope_protection_rad", 1.0),
            ("effective_grade_protection", 1.0),
        ],
        |p| &mut p.effective_grade_rad,
    ),
];

type EstimatedLevel = (
    &'static [(&'static str, f64)],
    fn(&mut Protection) -> &mut f64,
);

/// Estimates of a file by time.
#[derive(Clone, Debug)]
pub struct EstimatesFile {
    /// The file.
    pub path: PathBuf,
    /// Times on the clock of the log (ns) and estimates; what a file does not have is not a number and not valid.
    rows: Arc<Vec<(i64, Estimate)>>,
}

impl EstimatesFile {
    /// Reads a table with a column of time and one of `mass_kg`, `slope_deg`, `effective_slope_deg`, `speed_mps` at
    /// least, each with `…_sd_…`, `…_protection_…` and `…_valid` if there are.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let mut rows: Vec<(i64, Estimate)> = Vec::new();
        let (mut columns, mut backwards) = (Vec::new(), None);
        read::scan(path, &ReadOptions::default(), &mut |chunk| {
            for row in &chunk.rows {
                let Some(table) = chunk.tables.get(row.table as usize) else {
                    continue;
                };
                if columns.is_empty() {
                    columns = table.columns.iter().map(|c| c.name.clone()).collect();
                }
                if rows.last().is_some_and(|(t, _)| *t > row.stamp_ns) {
                    backwards = Some(row.place as usize);
                    return false;
                }
                rows.push((row.stamp_ns, estimate(&columns, chunk.values_of(row))));
            }
            true
        })?;
        if let Some(place) = backwards {
            let message = format!("the time goes back in row {place}");
            return Err(wrong(path, None, message, "sort the rows by time"));
        }
        let has =
            |q: &EstimatedQuantity| columns.iter().any(|c| q.value.iter().any(|(n, _)| n == c));
        if !QUANTITIES.iter().any(has) {
            let known: Vec<&str> = QUANTITIES
                .iter()
                .filter_map(|q| Some(q.value.first()?.0))
                .collect();
            return Err(wrong(
                path,
                None,
                format!("the columns {} have no estimate", columns.join(", ")),
                format!("give at least one of: {}", known.join(", ")),
            ));
        }
        Ok(Self {
            path: path.into(),
            rows: Arc::new(rows),
        })
    }

    /// Adds it to a registry under a name; `origin_ns` is time zero of the replay on the clock of the log.
    pub(super) fn add(
        &self,
        registry: &mut Registry,
        name: &str,
        origin_ns: i64,
    ) -> Result<(), RegistryError> {
        let rows = self.rows.clone();
        registry.estimator(name, move |_, params: &PlayedParams| Played {
            rows: rows.clone(),
            origin_ns,
            next: 0,
            max_age_ns: (params.max_age_s * 1e9) as i64,
        })?;
        Ok(())
    }
}

/// A row as an estimate.
fn estimate(columns: &[String], values: &[f64]) -> Estimate {
    let find = |names: &[(&str, f64)]| {
        names.iter().find_map(|(name, factor)| {
            let place = columns.iter().position(|c| c == name)?;
            Some(values.get(place)? * factor)
        })
    };
    let mut estimate = Estimate {
        nis: f64::NAN,
        innovation: f64::NAN,
        ..Estimate::default()
    };
    for q in &QUANTITIES {
        let value = find(q.value).unwrap_or(f64::NAN);
        *(q.place)(&mut estimate) = Value::new(
            value,
            find(q.sd).unwrap_or(f64::NAN),
            value.is_finite() && find(q.valid).is_none_or(|valid| valid > 0.5),
        );
    }
    for (names, place) in LEVELS {
        *place(&mut estimate.protection) = find(names).unwrap_or(0.0).max(0.0);
    }
    estimate
}

/// An estimator that plays the rows of a file.
struct Played {
    rows: Arc<Vec<(i64, Estimate)>>,
    origin_ns: i64,
    next: usize,
    max_age_ns: i64,
}

impl Estimator for Played {
    fn step(
        &mut self,
        z: &Measurements,
        _: &Command,
        _: f64,
    ) -> Result<Estimate, monorig_estimators::Error> {
        let now_ns = z.t.ns().saturating_add(self.origin_ns);
        while self.rows.get(self.next).is_some_and(|(t, _)| *t <= now_ns) {
            self.next += 1;
        }
        let row = self.next.checked_sub(1).and_then(|i| self.rows.get(i));
        let (age_ns, mut estimate) = match row {
            Some((t, estimate)) => (now_ns.saturating_sub(*t), *estimate),
            None => (i64::MAX, self::estimate(&[], &[])),
        };
        if age_ns > self.max_age_ns {
            QUANTITIES
                .iter()
                .for_each(|q| (q.place)(&mut estimate).valid = false);
        }
        estimate.t = z.t;
        Ok(estimate)
    }

    fn reset(&mut self) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorig_estimators::Time;

    #[test]
    fn rows_are_played_until_they_are_too_old() {
        let columns = ["slope_deg", "slope_sd_deg", "slope_valid", "mass_kg"].map(str::to_owned);
        let rows = [
            (10_000_000_000, [90.0, 1.0, 1.0, 5.0]),
            (10_500_000_000, [180.0, 1.0, 0.0, f64::NAN]),
        ];
        let rows = rows.map(|(t_ns, values)| (t_ns, estimate(&columns, &values)));
        let mut played = Played {
            rows: Arc::new(rows.to_vec()),
            origin_ns: 9_000_000_000,
            next: 0,
            max_age_ns: 1_000_000_000,
        };
        let mut at = |t_s: f64| {
            let z = Measurements::at(Time::from_s(t_s));
            played.step(&z, &Command::default(), 0.01).unwrap()
        };
        let early = at(0.9);
        assert!(early.grade_rad.value.is_nan() && !early.grade_rad.valid);
        let first = at(1.2);
        assert!((first.grade_rad.value - 0.5 * std::f64::consts::PI).abs() < 1e-12);
        assert!((first.grade_rad.sd - DEG).abs() < 1e-12 && first.grade_rad.valid);
        assert!(first.total_mass_kg.value == 5.0 && first.total_mass_kg.valid);
        let second = at(1.5);
        assert!(!second.grade_rad.valid && second.total_mass_kg.value.is_nan());
        assert!(!second.total_mass_kg.valid && second.speed_mps.value.is_nan());
        assert!(!at(9.0).grade_rad.valid);
    }
}
