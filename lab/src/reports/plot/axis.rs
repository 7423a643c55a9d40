//! An axis: its title, its scale, its range and its ticks.

use crate::text::number;

/// An axis. What it shows is set by its range; without one, by the data.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Title with unit, such as `time, s`.
    pub(crate) title: String,
    /// Range in the data's unit; none = from the data.
    pub(crate) range: Option<(f64, f64)>,
    scale: AxisScale,
}

#[derive(Clone, Debug)]
enum AxisScale {
    Linear,
    Log,
    Names(Vec<String>),
}

/// An axis whose range is known: positions on it are linear in the drawing.
#[derive(Clone, Debug)]
pub(super) struct FixedAxis {
    pub(crate) title: String,
    pub(crate) low: f64,
    pub(crate) high: f64,
    pub(crate) ticks: Vec<f64>,
    scale: AxisScale,
    decimals: usize,
}

impl Axis {
    /// A linear axis.
    pub fn linear(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            range: None,
            scale: AxisScale::Linear,
        }
    }

    /// A logarithmic axis: only values above zero are on it.
    pub fn log(title: impl Into<String>) -> Self {
        Self {
            scale: AxisScale::Log,
            ..Self::linear(title)
        }
    }

    /// Names side by side, at 0, 1, 2 …
    pub(crate) fn names(title: impl Into<String>, names: Vec<String>) -> Self {
        Self {
            range: Some((-0.5, names.len() as f64 - 0.5)),
            scale: AxisScale::Names(names),
            ..Self::linear(title)
        }
    }

    /// True for a logarithmic axis.
    pub(crate) fn is_log(&self) -> bool {
        matches!(self.scale, AxisScale::Log)
    }

    /// Sets the range.
    pub(crate) fn between(self, low: f64, high: f64) -> Self {
        Self {
            range: Some((low, high)),
            ..self
        }
    }

    /// Axis over these values; `None` without a value to show. `margin`: free room at both ends as a share of the
    /// range, if it comes from the data.
    pub(super) fn fix(&self, values: impl Iterator<Item = f64>, margin: f64) -> Option<FixedAxis> {
        let log = self.is_log();
        let shown = |x: f64| if log { x.log10() } else { x };
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for x in values.map(shown).filter(|x| x.is_finite()) {
            (low, high) = (low.min(x), high.max(x));
        }
        if low > high {
            return None;
        }
        match self.range {
            Some((a, b)) => (low, high) = (shown(a), shown(b)),
            None => {
                let least = if log { 0.15 } else { least_room(low, high) };
                let room = match high - low > least * 0.01 {
                    true => (high - low) * margin,
                    false => least,
                };
                (low, high) = (low - room, high + room);
            }
        }
        if !(low < high && low.is_finite() && high.is_finite()) {
            return None;
        }
        let (ticks, decimals) = match &self.scale {
            AxisScale::Names(names) => ((0..names.len()).map(|i| i as f64).collect(), 0),
            AxisScale::Log => (log_ticks(low, high), 0),
            AxisScale::Linear => ticks(low, high),
        };
        Some(FixedAxis {
            title: self.title.clone(),
            low,
            high,
            ticks,
            scale: self.scale.clone(),
            decimals,
        })
    }
}

impl FixedAxis {
    /// Position of a value on the scale.
    pub(crate) fn at(&self, x: f64) -> f64 {
        match self.scale {
            AxisScale::Log => x.log10(),
            _ => x,
        }
    }

    /// Text at a tick.
    pub(crate) fn label(&self, at: f64) -> String {
        match &self.scale {
            AxisScale::Names(names) => names
                .get(at.round() as usize)
                .filter(|_| (at - at.round()).abs() < 1e-6)
                .cloned()
                .unwrap_or_default(),
            AxisScale::Log => power_of_ten(10f64.powf(at)),
            AxisScale::Linear => {
                let x = if at.abs() < (self.high - self.low) * 1e-9 {
                    0.0
                } else {
                    at
                };
                match x.abs() {
                    a if a >= 1e6 => number(x),
                    a if a > 0.0 && self.decimals > 5 => format!("{x:.1e}"),
                    _ => format!("{x:.0$}", self.decimals),
                }
            }
        }
    }
}

/// A number from 0.001 to 1000 in full, else as a power.
fn power_of_ten(x: f64) -> String {
    match x {
        x if (0.999e-3..0.9999).contains(&x) => format!("{x:.4}").trim_end_matches('0').to_owned(),
        x if (0.9999..1e4).contains(&x) => format!("{x:.0}"),
        x => format!("{x:.0e}"),
    }
}

/// Four to eight round values, 1, 2 or 5 × 10ⁿ apart, and their number of decimals.
fn ticks(low: f64, high: f64) -> (Vec<f64>, usize) {
    let raw = (high - low) / 5.0;
    let power = 10f64.powf(raw.log10().floor());
    let step = match raw / power {
        r if r < 1.5 => power,
        r if r < 3.5 => 2.0 * power,
        r if r < 7.5 => 5.0 * power,
        _ => 10.0 * power,
    };
    let first = (low / step).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    let all = (first..=last.min(first + 20))
        .map(|i| i as f64 * step)
        .collect();
    // rounded first: 0.001 may be 9.99e-4
    let decimals = -(step.log10() + 1e-9).floor();
    (all, decimals.clamp(0.0, 9.0) as usize)
}

/// Whole powers of ten; over less than two of them, 2 and 5 times as well.
fn log_ticks(low: f64, high: f64) -> Vec<f64> {
    let whole = low.floor() as i64..=high.ceil() as i64;
    let factors: &[f64] = if high - low < 2.0 {
        &[1.0, 2.0, 5.0]
    } else {
        &[1.0]
    };
    let every = ((high - low) / 7.0).ceil().max(1.0) as i64;
    whole
        .filter(|n| n % every == 0)
        .flat_map(|n| factors.iter().map(move |f| n as f64 + f.log10()))
        .filter(|x| (low..=high).contains(x))
        .collect()
}

/// Room above and below a level line: it still needs some height.
fn least_room(low: f64, high: f64) -> f64 {
    match low.abs().max(high.abs()) {
        // zero, but for rounding
        size if size < 1e-9 => 1.0,
        size => size * 0.01,
    }
}

/// Range that shows nearly all values and ignores a few distant values: from the `share`-quantile to its opposite, with
/// `margin` of room, but no wider than the values.
pub(crate) fn without_outliers(
    values: impl Iterator<Item = f64>,
    share: f64,
    margin: f64,
) -> Option<(f64, f64)> {
    let mut all: Vec<f64> = values.filter(|x| x.is_finite()).collect();
    all.sort_unstable_by(f64::total_cmp);
    let last = all.len().checked_sub(1)?;
    let at = |p: f64| all[(p * last as f64).round() as usize];
    let (low, high) = (at(share), at(1.0 - share));
    let least = least_room(low, high);
    let room = match high - low > least * 0.01 {
        true => (high - low) * margin,
        false => least,
    };
    let edge = room.min((high - low).max(least) * 0.06);
    Some((
        (low - room).max(all[0] - edge),
        (high + room).min(all[last] + edge),
    ))
}

/// Limit of a common range, as a multiple of the range of the middle kind of values. A kind that reaches further is
/// cut, so that it does not flatten the others.
const FURTHER: f64 = 4.0;

/// Common range of several kinds of values, and true if some values lie beyond it.
pub(crate) fn common_range(ranges: &[(f64, f64)]) -> Option<((f64, f64), bool)> {
    let widest = |r: &(f64, f64)| r.0.abs().max(r.1.abs());
    let mut reach: Vec<f64> = ranges.iter().map(widest).collect();
    reach.sort_unstable_by(f64::total_cmp);
    // of two the smaller one
    let middle = *reach.get(reach.len().checked_sub(1)? / 2)?;
    let limit = FURTHER * middle;
    let cut = reach.last().is_some_and(|most| *most > limit) && middle > 0.0;
    let all = ranges
        .iter()
        .copied()
        .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    Some(match cut {
        true => ((all.0.max(-limit), all.1.min(limit)), true),
        false => (all, false),
    })
}

/// Largest reach of values that the axes need not show, as a multiple of the reach of the others.
const ASIDE: f64 = 2.0;

/// Values that set the range of an axis: `main`, and the other values as far as the main ones stay readable.
pub(crate) fn with_asides(
    main: impl Iterator<Item = f64>,
    asides: impl Iterator<Item = f64>,
) -> Vec<f64> {
    let mut all: Vec<f64> = main.filter(|x| x.is_finite()).collect();
    let limit = match ASIDE * all.iter().fold(0.0, |reach: f64, x| reach.max(x.abs())) {
        0.0 => f64::INFINITY,
        limit => limit,
    };
    let asides = asides.filter(|x| x.is_finite());
    all.extend(asides.map(|x| x.clamp(-limit, limit)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_judged_does_not_set_the_axis() {
        let of =
            |main: [f64; 2], asides: [f64; 2]| with_asides(main.into_iter(), asides.into_iter());
        assert_eq!(of([-0.5, 1.0], [-0.7, 1.5]), [-0.5, 1.0, -0.7, 1.5]);
        assert_eq!(of([-0.5, 1.0], [-90.0, f64::NAN]), [-0.5, 1.0, -2.0]);
        assert_eq!(of([0.0, 0.0], [0.1, 0.7]), [0.0, 0.0, 0.1, 0.7]);
    }

    #[test]
    fn ticks_are_round_and_inside() {
        for (low, high, expected, decimals) in [
            (0.0, 60.0, vec![0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0], 0),
            (-0.3, 0.7, vec![-0.2, 0.0, 0.2, 0.4, 0.6], 1),
            (0.0, 0.005, vec![0.0, 0.001, 0.002, 0.003, 0.004, 0.005], 3),
        ] {
            let (all, d) = ticks(low, high);
            assert_eq!(d, decimals, "{low} {high}");
            assert_eq!(all.len(), expected.len(), "{all:?}");
            assert!(
                all.iter()
                    .zip(&expected)
                    .all(|(a, b)| (a - b).abs() < 1e-12)
            );
        }
    }

    #[test]
    fn nothing_finite_is_no_axis() {
        let axis = Axis::linear("x");
        assert!(
            axis.fix([f64::NAN, f64::INFINITY].into_iter(), 0.0)
                .is_none()
        );
        assert!(Axis::log("x").fix([0.0, -1.0].into_iter(), 0.0).is_none());
        assert!(axis.fix([3.0].into_iter(), 0.05).is_some());
        // what is zero all along needs no tiny numbers
        let level = axis.fix([0.0, 1e-17].into_iter(), 0.05).unwrap();
        let labels = level.ticks.iter().map(|t| level.label(*t));
        assert!(labels.clone().any(|l| l == "0.0"));
        assert!(labels.clone().all(|l| l.len() <= 4), "{level:?}");
    }

    #[test]
    fn labels_say_the_value() {
        let log = Axis::log("x").fix([0.01, 100.0].into_iter(), 0.0).unwrap();
        let labels: Vec<String> = log.ticks.iter().map(|t| log.label(*t)).collect();
        assert_eq!(labels, ["0.01", "0.1", "1", "10", "100"]);
        let names = Axis::names("", vec!["a".into(), "b".into()]);
        let names = names.fix([0.0].into_iter(), 0.0).unwrap();
        assert_eq!(
            (names.label(1.0), names.label(0.5)),
            ("b".into(), "".into())
        );
    }

    #[test]
    fn one_bad_kind_does_not_flatten_the_others() {
        let good = [(-1.0, 1.0), (-0.5, 2.0), (-1.0, 1.5)];
        assert_eq!(common_range(&good), Some(((-1.0, 2.0), false)));
        let with_bad = [good.as_slice(), &[(-2.0, 90.0)]].concat();
        assert_eq!(common_range(&with_bad), Some(((-2.0, 6.0), true)));
        assert_eq!(
            common_range(&[(-1.0, 1.0), (0.0, 50.0)]),
            Some(((-1.0, 4.0), true))
        );
        assert_eq!(common_range(&[(0.0, 50.0)]), Some(((0.0, 50.0), false)));
        assert_eq!(
            common_range(&[(0.0, 0.0), (0.0, 3.0)]),
            Some(((0.0, 3.0), false))
        );
        assert_eq!(common_range(&[]), None);
    }

    #[test]
    fn a_few_far_values_do_not_blow_up_the_range() {
        let values = (0..1000).map(|i| if i == 3 { 1e9 } else { (i % 10) as f64 });
        let (low, high) = without_outliers(values, 0.01, 0.1).unwrap();
        assert!(low >= -1.0 && high <= 10.0, "{low} {high}");
    }
}
