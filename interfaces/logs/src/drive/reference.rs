//! References: slope and mass over the time of the replay. The slope is read before the replay, so that it is linear
//! between its samples and that of altitude and distance is centred.

use super::reference_columns::Columns;
use crate::map::{Formula, Map, SlopeReference};
use crate::notation::{Quantity, Unit};
use geographiclib_rs::{Geodesic, InverseGeodesic};
use monorig_sim::config::checked::Finite;
use monorig_sim::error::Error;
use std::collections::BTreeSet;

/// Largest time between two samples between which the slope is known, ns.
const MAX_GAP_NS: i64 = 2_000_000_000;

/// The slope over time.
#[derive(Clone, Debug, Default)]
enum ReferenceSlope {
    /// Not known.
    #[default]
    None,
    /// Constant, rad.
    Constant(f64),
    /// Samples: ns of the replay and rad.
    Samples(Vec<(i64, f64)>),
}

/// A slope that is read at times that do not decrease.
#[derive(Clone, Debug, Default)]
struct SlopeOverTime {
    slope: ReferenceSlope,
    next: usize,
}

/// References with which estimates are compared.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reference {
    slope: SlopeOverTime,
    effective: Option<SlopeOverTime>,
    /// From a time on (ns of the replay), kg.
    masses: Vec<(i64, f64)>,
    /// Standard deviation of the slope, rad.
    pub slope_sd_rad: f64,
    /// Standard deviation of the mass, kg.
    pub mass_sd_kg: f64,
}

/// Adds the columns of the references to those that are wanted of each file.
pub(super) fn want(map: &Map, wanted: &mut [BTreeSet<String>]) -> Result<(), Error> {
    let r = &map.file.reference;
    for slope in [&r.slope, &r.effective_slope].into_iter().flatten() {
        if let Some((file, columns)) = columns(map, slope)? {
            let of_file = wanted.get_mut(file).into_iter();
            of_file.for_each(|w| w.extend(columns.iter().cloned()));
        }
    }
    Ok(())
}

/// The file and the columns of a slope; none of a constant.
fn columns(map: &Map, slope: &SlopeReference) -> Result<Option<(usize, Vec<String>)>, Error> {
    let formulas = formulas(slope);
    if formulas.is_empty() {
        return Ok(None);
    }
    let columns = formulas.iter().map(|(f, _)| &f.expression.columns);
    let mut columns: Vec<String> = columns.flatten().cloned().collect();
    columns.extend(
        slope
            .valid_if
            .iter()
            .flat_map(|c| c.0.columns.iter().cloned()),
    );
    Ok(Some((
        map.file_of("reference.slope", slope.file.as_deref())?,
        columns,
    )))
}

impl Reference {
    /// Reads the references of a map; `origin_ns` is time zero of the replay.
    pub fn load(map: &Map, origin_ns: i64) -> Result<Self, Error> {
        let r = &map.file.reference;
        let mut reference = Self::default();
        if let Some(m) = &r.mass {
            reference.mass_sd_kg = m.sd_kg.get();
            reference.masses.extend(m.kg.map(|kg| (i64::MIN, kg.get())));
            let steps = m.steps.iter().flatten();
            reference
                .masses
                .extend(steps.map(|s| ((s.at_s.get() * 1e9).round() as i64, s.kg.get())));
        }
        if let Some(s) = &r.slope {
            reference.slope_sd_rad = s.sd_deg.get().to_radians();
            reference.slope = SlopeOverTime::load(map, s, origin_ns)?;
        }
        let effective = r.effective_slope.as_ref();
        reference.effective = effective
            .map(|s| SlopeOverTime::load(map, s, origin_ns))
            .transpose()?;
        Ok(reference)
    }

    /// True for a mass that is known.
    pub fn has_mass(&self) -> bool {
        !self.masses.is_empty()
    }

    /// The effective slope (rad) at a time, which must not decrease; `None` without a reference.
    pub fn effective_at(&mut self, t_ns: i64) -> Option<f64> {
        self.effective.as_mut().map(|slope| slope.at(t_ns))
    }

    /// Slope (rad) and mass (kg) at a time, which must not decrease; NaN if unknown.
    pub fn at(&mut self, t_ns: i64) -> (f64, f64) {
        let mass = self
            .masses
            .iter()
            .take_while(|(from, _)| *from <= t_ns)
            .last()
            .map_or(f64::NAN, |m| m.1);
        (self.slope.at(t_ns), mass)
    }
}

impl SlopeOverTime {
    fn load(map: &Map, s: &SlopeReference, origin_ns: i64) -> Result<Self, Error> {
        let slope = match s.deg {
            Some(deg) => ReferenceSlope::Constant(Finite::get(deg).to_radians()),
            None => ReferenceSlope::Samples(samples(map, s, origin_ns)?),
        };
        Ok(Self { slope, next: 0 })
    }

    /// The slope at a time, rad.
    fn at(&mut self, t_ns: i64) -> f64 {
        match &self.slope {
            ReferenceSlope::None => f64::NAN,
            ReferenceSlope::Constant(slope) => *slope,
            ReferenceSlope::Samples(all) => {
                while all.get(self.next).is_some_and(|(t, _)| *t <= t_ns) {
                    self.next += 1;
                }
                let before = self.next.checked_sub(1).and_then(|i| all.get(i));
                match (before, all.get(self.next)) {
                    (Some((t, x)), None) if *t == t_ns => *x,
                    (Some((t0, x0)), Some((t1, x1))) if t1 - t0 <= MAX_GAP_NS && t1 > t0 => {
                        x0 + (x1 - x0) * ((t_ns - t0) as f64 / (t1 - t0) as f64)
                    }
                    _ => f64::NAN,
                }
            }
        }
    }
}

/// The formulas that a slope is made of, each with its unit; none of a constant.
fn formulas(s: &SlopeReference) -> Vec<(&Formula, Option<&'static Unit>)> {
    if let Some(column) = &s.column {
        let unit = s
            .unit
            .as_ref()
            .and_then(|u| Quantity::Slope.unit(u.as_str()));
        return vec![(column, unit)];
    }
    let Some(a) = &s.altitude else {
        return Vec::new();
    };
    let (length, degrees) = (
        Quantity::Length.unit(a.unit.as_str()),
        Quantity::Angle.unit("deg"),
    );
    let way = [
        (&a.distance, length),
        (&a.latitude, degrees),
        (&a.longitude, degrees),
    ];
    let way = way
        .into_iter()
        .filter_map(|(f, unit)| Some((f.as_ref()?, unit)));
    std::iter::once((&a.column, length)).chain(way).collect()
}

/// The samples of a slope.
fn samples(map: &Map, s: &SlopeReference, origin_ns: i64) -> Result<Vec<(i64, f64)>, Error> {
    let columns = Columns {
        key: "reference.slope",
        file: s.file.as_deref(),
        formulas: formulas(s),
        valid_if: s.valid_if.as_ref(),
    };
    let all = columns.read(map, origin_ns)?;
    Ok(match &s.altitude {
        None => all.into_iter().map(|(t, [slope, ..])| (t, slope)).collect(),
        Some(a) if a.distance.is_some() => from_altitude(&all, a.window_m.get(), f64::asin),
        Some(a) => from_altitude(&along(&all, a.window_m.get()), a.window_m.get(), f64::atan),
    })
}

/// Altitudes over the level way between positions (altitude, latitude, longitude; m, rad), the geodesic of WGS 84
/// (Karney 2013). The way goes on by whole tenths of the window, and in between by what lies beyond the last of them:
/// what a receiver wanders by while the vehicle stands adds up to no way.
fn along(all: &[(i64, [f64; 3])], window_m: f64) -> Vec<(i64, [f64; 3])> {
    let earth = Geodesic::wgs84();
    let (mut way, mut last, mut reached) = (0.0, None, 0.0_f64);
    let mut rows = Vec::with_capacity(all.len());
    for &(t, [altitude, latitude, longitude]) in all {
        let [lat, lon] = [latitude, longitude].map(f64::to_degrees);
        let (lat0, lon0) = *last.get_or_insert((lat, lon));
        let gone: f64 = earth.inverse(lat0, lon0, lat, lon);
        reached = reached.max(way + gone);
        if gone >= 0.1 * window_m {
            way += gone;
            last = Some((lat, lon));
        }
        rows.push((t, [altitude, reached, 0.0]));
    }
    rows
}

/// Regression of the altitude over the distance within half a window to both sides, by the angle of a ratio: rise over
/// way along the slope is its sine, over level way its tangent. Each piece counts by its length, so rows of a
/// stop have no weight.
fn from_altitude(all: &[(i64, [f64; 3])], window_m: f64, angle: fn(f64) -> f64) -> Vec<(i64, f64)> {
    let half = 0.5 * window_m;
    let (mut from, mut to) = (0, 0);
    let mut slopes = Vec::new();
    for &(t, [_, s, _]) in all {
        while all.get(from).is_some_and(|(_, x)| x[1] < s - half) {
            from += 1;
        }
        while all.get(to).is_some_and(|(_, x)| x[1] <= s + half) {
            to += 1;
        }
        let window = all.get(from..to).unwrap_or(&[]);
        let reaches =
            |end: Option<&(i64, [f64; 3])>| end.is_some_and(|(_, x)| (x[1] - s).abs() > 0.8 * half);
        if !reaches(window.first()) || !reaches(window.last()) {
            continue; // less than the window at both ends of the log, and where the vehicle stands
        }
        let pieces = || {
            window.windows(2).filter_map(|w| match w {
                [(_, [h0, s0, _]), (_, [h1, s1, _])] => {
                    Some((s1 - s0, 0.5 * (s0 + s1), 0.5 * (h0 + h1)))
                }
                _ => None,
            })
        };
        let (way, ms, mh) = pieces().fold((0.0, 0.0, 0.0), |(w, a, b), (ds, s, h)| {
            (w + ds, a + ds * s, b + ds * h)
        });
        let (ms, mh) = (ms / way, mh / way);
        let (sxx, sxy) = pieces().fold((0.0, 0.0), |(a, b), (ds, s, h)| {
            (a + ds * (s - ms).powi(2), b + ds * (s - ms) * (h - mh))
        });
        slopes.push((t, angle((sxy / sxx).clamp(-1.0, 1.0))));
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A climb of constant sine: the regression over a window finds it, and nothing within half a window of the ends.
    #[test]
    fn altitude_over_distance_is_the_sine() {
        let all: Vec<_> = (0..200)
            .map(|i| {
                let s = f64::from(i) * 0.2;
                (i64::from(i) * 100_000_000, [0.1 * s, s, 0.0])
            })
            .collect();
        let slopes = from_altitude(&all, 4.0, f64::asin);
        assert!(slopes.len() > 170 && slopes.len() < 190, "{}", slopes.len());
        assert!(slopes.iter().all(|(_, x)| (x - 0.1f64.asin()).abs() < 1e-9));
    }

    /// A climb to the north-east at 60° of latitude, where a degree of longitude is half of one of latitude: by the
    /// radii of curvature of the ellipsoid, another formula than that of the library, the slope is that of rise over
    /// level way, at every row but those within half a window of the ends. A stop on the way, where the position
    /// wanders, changes nothing that is seen.
    #[test]
    fn altitude_over_positions_is_the_tangent() {
        let (a, e2) = (6_378_137.0_f64, 0.006_694_379_990_14_f64);
        let latitude = 60.0_f64.to_radians();
        let w = 1.0 - e2 * latitude.sin().powi(2);
        let meridian = a * (1.0 - e2) / w.powf(1.5);
        let parallel = a / w.sqrt() * latitude.cos();
        let all: Vec<_> = (0..600)
            .map(|i| {
                let (k, t) = (f64::from(i), i64::from(i) * 100_000_000);
                let moved = if i < 300 { k } else { (k - 200.0).max(300.0) };
                let wander = if moved == 300.0 { 0.3 * k.sin() } else { 0.0 };
                let way = 0.5 * moved;
                let [north, east] = [0.6 * way + wander, 0.8 * way];
                (t, [0.1 * way, latitude + north / meridian, east / parallel])
            })
            .collect();
        let slopes = from_altitude(&along(&all, 20.0), 20.0, f64::atan);
        // 200 of 600 rows stand; 40 are near the ends
        assert!(slopes.len() > 540, "{}", slopes.len());
        let off = |x: f64| (x - 0.1f64.atan()).to_degrees().abs();
        assert!(slopes.iter().all(|(_, x)| off(*x) < 0.02), "{slopes:?}");
    }

    #[test]
    fn samples_are_linear_in_between_and_unknown_in_gaps() {
        let s = 1_000_000_000;
        let mut r = Reference {
            slope: SlopeOverTime {
                slope: ReferenceSlope::Samples(vec![(0, 0.0), (s, 0.1), (10 * s, 0.2)]),
                next: 0,
            },
            masses: vec![(0, 100.0), (2 * s, 200.0)],
            ..Reference::default()
        };
        assert_eq!(r.at(-1).0.to_bits(), f64::NAN.to_bits());
        assert_eq!(r.at(s / 2), (0.05, 100.0));
        assert!(r.at(3 * s).0.is_nan() && r.at(3 * s).1 == 200.0);
        assert!(r.at(11 * s).0.is_nan());
    }
}
