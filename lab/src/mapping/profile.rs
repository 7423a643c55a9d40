//! A profile from the grades read along the track: cells of rail, bias of the end, standard deviations.

use super::Passage;
use std::fmt::Write;

/// g, m/s².
const GRAVITY: f64 = monorig_estimators::api::real::GRAVITY;
/// Standard deviation of the grade of unread rail, rad: as that of the rail behind a train in the estimator.
const UNREAD_SD_RAD: f64 = 0.02;
/// Largest standard deviations of sin θ + b/g and of the speed, m/s, of a row that is used.
const MAX_READ_SD: f64 = 0.003;
const MAX_SPEED_SD_MPS: f64 = 0.1;
/// Creep of the wheels under traction, as a standard deviation of their scale.
const CREEP: f64 = 0.001;
/// Uncertainty of the place at the start, m.
const START_SD_M: f64 = 0.05;
/// A unit on wheels 2 w apart pitches as the chord: off by w²/6 d²θ/ds² from the rail under its middle; w = 0.3 m.
const CHORD_M2: f64 = 0.015;
/// Heading of a unit against the rail, rad: play of its guide wheels, and sideslip of a car.
const PLAY_RAD: f64 = 0.003;
/// Sharpest bend of unread rail, 1/m: a radius of 4 m.
const MAX_BEND_PER_M: f64 = 0.25;
/// Length of rail added beyond the last read place, for the part of the train ahead of the unit's middle, m.
const BEYOND_M: f64 = 10.0;
/// Least number of cells that were read.
const MIN_CELLS: usize = 4;

/// A place of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapPoint {
    /// Chainage, m.
    pub s_m: f64,
    pub(crate) grade_rad: f64,
    /// Its standard deviation, rad.
    pub sd_rad: f64,
    /// Heading relative to the first read place, + left, rad.
    pub(crate) heading_rad: f64,
    /// Its standard deviation, rad.
    pub heading_sd_rad: f64,
    /// True if the unit has passed it. Otherwise grade and heading are those of the nearest rail that was read.
    pub read: bool,
}

/// Sums over the rows of a cell, weighted by distance.
#[derive(Clone, Copy, Debug, Default)]
struct MapCell {
    way: f64,
    place: f64,
    u: f64,
    variance: f64,
    place_variance: f64,
    heading: f64,
    heading_variance: f64,
}

impl MapCell {
    fn mean(&self, of: f64) -> f64 {
        of / self.way
    }
}

/// A read place: chainage, grade and heading, their variances.
#[derive(Clone, Copy, Debug, Default)]
struct Known {
    s: f64,
    grade: f64,
    variance: f64,
    place_variance: f64,
    heading: f64,
    heading_variance: f64,
}

/// The profile from chainage 0 to beyond the end of the way, a point every `every_m`; `start_m` is the chainage of
/// the IMU in the first row. An error gives the reason why there is none.
pub fn profile(p: &Passage, start_m: f64, every_m: f64) -> Result<Vec<MapPoint>, String> {
    let cells = cells(p, start_m - p.arm_m, every_m)?;
    let read = cells.iter().filter(|cell| cell.way > 0.0).count();
    if read < MIN_CELLS {
        return Err(format!(
            "the run read only {read} places of rail with a grade marked valid; a map needs {MIN_CELLS}"
        ));
    }
    let (bias, bias_sd) = end_bias(p).ok_or("the grade is never marked valid")?;
    let common = bias_sd / GRAVITY;
    let read = cells.iter().filter(|cell| cell.way > 0.0);
    let first = read.clone().next().map_or(0.0, |c| c.mean(c.heading));
    let known: Vec<Known> = read
        .map(|cell| {
            let sine = (cell.mean(cell.u) - bias / GRAVITY).clamp(-1.0, 1.0);
            Known {
                s: cell.mean(cell.place),
                grade: libm::asin(sine),
                variance: cell.mean(cell.variance) + common * common,
                place_variance: cell.mean(cell.place_variance),
                heading: cell.mean(cell.heading) - first,
                heading_variance: cell.mean(cell.heading_variance) + PLAY_RAD * PLAY_RAD,
            }
        })
        .collect();
    let last = cells.len() + (BEYOND_M / every_m).ceil() as usize;
    Ok((0..=last)
        .map(|i| point(i as f64 * every_m, &known, every_m))
        .collect())
}

/// The point at `s`, linear between the read places.
fn point(s: f64, known: &[Known], every_m: f64) -> MapPoint {
    let behind = known.partition_point(|k| k.s <= s);
    let (before, after) = (
        behind.checked_sub(1).and_then(|i| known.get(i)),
        known.get(behind),
    );
    let unread = |grade_rad: f64, heading_rad: f64| {
        let away = [before, after].into_iter().flatten();
        let away_m = away.map(|k| (k.s - s).abs()).fold(f64::INFINITY, f64::min);
        MapPoint {
            s_m: s,
            grade_rad,
            sd_rad: UNREAD_SD_RAD,
            heading_rad,
            heading_sd_rad: (MAX_BEND_PER_M * away_m).min(std::f64::consts::PI),
            read: false,
        }
    };
    let (Some(a), Some(b)) = (before, after) else {
        let nearest = before.or(after).copied().unwrap_or_default();
        return unread(nearest.grade, nearest.heading);
    };
    let share = (s - a.s) / (b.s - a.s);
    let mean = |of: fn(&Known) -> f64| of(a) + share * (of(b) - of(a));
    let (grade_rad, heading_rad) = (mean(|k| k.grade), mean(|k| k.heading));
    if b.s - a.s > 3.0 * every_m {
        return unread(grade_rad, heading_rad);
    }
    let near = known.get(behind.saturating_sub(3)..).unwrap_or_default();
    let near = near.get(..6).unwrap_or(near);
    let place_variance = a.place_variance.max(b.place_variance);
    let sd = |variance: f64, of: fn(&Known) -> f64| {
        (variance + by_shape(near, of, place_variance, every_m)).sqrt()
    };
    MapPoint {
        s_m: s,
        grade_rad,
        sd_rad: sd(a.variance.max(b.variance), |k| k.grade),
        heading_rad,
        heading_sd_rad: sd(a.heading_variance.max(b.heading_variance), |k| k.heading),
        read: true,
    }
}

/// Variance of an angle of the rail by its shape: the steepest gradient nearby where the place is uncertain, and what
/// the chord of the unit makes of how it changes.
fn by_shape(near: &[Known], of: fn(&Known) -> f64, place_variance: f64, every_m: f64) -> f64 {
    let gradients: Vec<f64> = near
        .windows(2)
        .map(|w| match w {
            [a, b] => (of(b) - of(a)) / (b.s - a.s),
            _ => 0.0,
        })
        .collect();
    let gradient = gradients.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let change = gradients
        .windows(2)
        .map(|w| match w {
            [a, b] => (b - a).abs() / every_m,
            _ => 0.0,
        })
        .fold(0.0, f64::max);
    let chord = CHORD_M2 * change;
    gradient * gradient * place_variance + chord * chord
}

/// The rows by place: `middle_m` is the chainage of the unit's middle in the first row.
fn cells(p: &Passage, middle_m: f64, every_m: f64) -> Result<Vec<MapCell>, String> {
    let mut cells: Vec<MapCell> = Vec::new();
    let (mut s, mut way) = (middle_m, 0.0);
    let mut heading = 0.0;
    let rows = p.t_s.len();
    for k in 1..rows {
        let (before, now) = (k - 1, k);
        let v = [before, now].map(|i| p.speed_mps.get(i).copied().unwrap_or(f64::NAN));
        let dt = p.t_s[now] - p.t_s[before];
        let step = 0.5 * (v[0] + v[1]) * dt;
        if !step.is_finite() {
            continue;
        }
        s += step;
        way += step.abs();
        let turn = p.heading_rad[now] - p.heading_rad[before];
        if turn.is_finite() {
            heading += wrapped(turn);
        }
        let sound = p.valid[now]
            && p.read_sd[now] < MAX_READ_SD
            && p.speed_sd_mps[now] < MAX_SPEED_SD_MPS
            && p.pitch_rad[now].is_finite()
            && p.bias_mps2[now].is_finite()
            && p.heading_sd_rad[now].is_finite();
        if !sound || s < 0.0 || step == 0.0 {
            continue;
        }
        let at = (s / every_m) as usize;
        if at > MAX_CELLS {
            return Err(format!("the track has more than {MAX_CELLS} places"));
        }
        if at >= cells.len() {
            cells.resize(at + 1, MapCell::default());
        }
        let scale = p.scale_sd[now].hypot(CREEP);
        let place_sd = START_SD_M.hypot(scale * way);
        let weight = step.abs();
        if let Some(cell) = cells.get_mut(at) {
            cell.way += weight;
            cell.place += weight * s;
            cell.u += weight * (libm::sin(p.pitch_rad[now]) + p.bias_mps2[now] / GRAVITY);
            cell.variance += weight * p.read_sd[now] * p.read_sd[now];
            cell.place_variance += weight * place_sd * place_sd;
            cell.heading += weight * heading;
            cell.heading_variance += weight * p.heading_sd_rad[now] * p.heading_sd_rad[now];
        }
    }
    Ok(cells)
}

/// An angle within ±π.
fn wrapped(angle: f64) -> f64 {
    let turn = 2.0 * std::f64::consts::PI;
    angle - turn * (angle / turn).round()
}

/// Largest number of places of a map.
const MAX_CELLS: usize = 1_000_000;

/// The bias of the last row whose grade is valid, and its standard deviation.
fn end_bias(p: &Passage) -> Option<(f64, f64)> {
    let last = p.valid.iter().rposition(|valid| *valid)?;
    Some((*p.bias_mps2.get(last)?, *p.bias_sd_mps2.get(last)?))
}

/// The map as the CSV file of a surveyed track; without `bends` its rail is straight.
pub fn to_csv(map: &[MapPoint], about: &str, bends: bool) -> String {
    let more = if bends {
        ",heading_deg,heading_sd_deg"
    } else {
        ""
    };
    let mut text = format!("# {about}\ns_m,grade_deg,sd_deg{more}\n");
    for p in map {
        let (grade, sd) = (p.grade_rad.to_degrees(), p.sd_rad.to_degrees());
        let _ = write!(text, "{:.3},{grade:.5},{sd:.5}", p.s_m); // a string takes it
        if bends {
            let (heading, sd) = (p.heading_rad.to_degrees(), p.heading_sd_rad.to_degrees());
            let _ = write!(text, ",{heading:.4},{sd:.4}");
        }
        text.push('\n');
    }
    text
}

/// Smoothing of the headings, degrees: the yawing of a unit in its play is no bend.
const HEADING_NOISE_DEG: f64 = 0.05;

/// Track file that names the map.
pub fn to_track(name: &str, about: &str, section: &str, csv: &str, bends: bool) -> String {
    // words of others are written as JSON strings, which YAML reads
    let quoted = |text: &str| serde_json::Value::from(text).to_string();
    let smoothing = match bends {
        true => format!(", heading_noise_deg: {HEADING_NOISE_DEG}"),
        false => String::new(),
    };
    format!(
        "version: 1\nname: {}\nabout: {}\n{section}\nsurvey: {{file: {}, height_noise_m: 0{smoothing}}}\n",
        quoted(name),
        quoted(about),
        quoted(csv)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run at 1 m/s from chainage 2 m over a grade of 0.1 rad, read with a bias that is known at the end only.
    fn passage() -> Passage {
        let rows = 3000;
        let bias = 0.02;
        let known_from = 1500;
        Passage {
            t_s: (0..rows).map(|i| 0.02 * f64::from(i)).collect(),
            speed_mps: vec![1.0; rows as usize],
            speed_sd_mps: vec![0.001; rows as usize],
            valid: vec![true; rows as usize],
            // before, the whole of the bias is taken for a pitch
            pitch_rad: (0..rows)
                .map(|i| match i < known_from {
                    true => libm::asin(libm::sin(0.1) + bias / GRAVITY),
                    false => 0.1,
                })
                .collect(),
            bias_mps2: (0..rows)
                .map(|i| if i < known_from { 0.0 } else { bias })
                .collect(),
            bias_sd_mps2: vec![0.001; rows as usize],
            read_sd: vec![1e-4; rows as usize],
            scale_sd: vec![0.003; rows as usize],
            // a bend of 20 m radius to the left, that goes round by more than half a turn
            heading_rad: (0..rows)
                .map(|i| wrapped(0.05 * 0.02 * f64::from(i)))
                .collect(),
            heading_sd_rad: vec![0.001; rows as usize],
            arm_m: 0.3,
            start_m: Some(2.0),
        }
    }

    /// With the bias of the end the first half is as good as the second.
    #[test]
    fn the_bias_of_the_end_mends_what_was_read_before() {
        let map = profile(&passage(), 2.0, 0.5).unwrap();
        let read: Vec<&MapPoint> = map.iter().filter(|p| p.read).collect();
        assert!((114..=122).contains(&read.len()), "{}", read.len());
        assert!(read.iter().all(|p| (p.grade_rad - 0.1).abs() < 1e-9));
        // 0.1 mrad of reading, 0.1 mrad of bias
        let sd = 1e-4f64.hypot(1e-3 / GRAVITY);
        assert!(read.iter().all(|p| (p.sd_rad / sd - 1.0).abs() < 0.01));
        let (first, last) = (read[0].s_m, read[read.len() - 1].s_m);
        assert!((1.5..=2.6).contains(&first) && (60.0..=62.0).contains(&last));
        assert!(
            map.iter()
                .filter(|p| !p.read)
                .all(|p| p.sd_rad == UNREAD_SD_RAD)
        );
        assert_eq!(map[0].s_m, 0.0);
    }

    /// Headings grow by 1/R a metre from the first place on, through the jump at half a turn.
    #[test]
    fn bends_are_read_off_the_heading() {
        let map = profile(&passage(), 2.0, 0.5).unwrap();
        let read: Vec<&MapPoint> = map.iter().filter(|p| p.read).collect();
        for p in &read {
            let heading = 0.05 * (p.s_m - read[0].s_m);
            assert!((p.heading_rad - read[0].heading_rad - heading).abs() < 1e-3);
            // play and reading, and the place of up to a third of a metre times 1/R
            assert!((0.003..0.02).contains(&p.heading_sd_rad), "{p:?}");
        }
        assert!(read[read.len() - 1].heading_rad > 2.9);
        // beyond the last place read, which is up to half a metre behind the last point: the tightest bend there may be
        let last = map[map.len() - 1];
        let away = last.s_m - read[read.len() - 1].s_m;
        let off = last.heading_sd_rad / MAX_BEND_PER_M - away;
        assert!(!last.read && off.abs() < 0.5 + 1e-9, "{last:?}");
    }

    #[test]
    fn a_run_that_reads_nothing_has_no_map() {
        let mut p = passage();
        p.valid = vec![false; p.valid.len()];
        assert!(profile(&p, 2.0, 0.5).unwrap_err().contains("marked valid"));
    }
}
