//! The varied parameters, as a unit cube: what optimisers see.

use crate::tuning::study::{Range, Scale, Values, as_number, bend, unbend};
use monorig_sim::config::checked::Finite;
use monorig_sim::config::scenario::ParameterValue;
use std::collections::BTreeMap;

/// The varied parameters, sorted by name.
#[derive(Clone, Debug)]
pub(crate) struct Space {
    axes: Vec<(String, Dimension)>,
}

#[derive(Clone, Debug)]
enum Dimension {
    Choices(Vec<ParameterValue>),
    Span {
        from: f64,
        to: f64,
        scale: Scale,
        integer: bool,
    },
}

impl Space {
    /// Makes the space from checked ranges.
    pub(crate) fn new(ranges: &BTreeMap<String, Range>) -> Self {
        let axis = |r: &Range| match &r.choices {
            Some(choices) => Dimension::Choices(choices.clone()),
            None => Dimension::Span {
                from: r.from.map_or(0.0, f64::from),
                to: r.to.map_or(1.0, f64::from),
                scale: r.scale,
                integer: r.integer,
            },
        };
        Self {
            axes: ranges.iter().map(|(k, r)| (k.clone(), axis(r))).collect(),
        }
    }

    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.axes.iter().map(|(name, _)| name.as_str())
    }

    /// Number of different values of each; `None` = any number.
    pub(crate) fn counts(&self) -> Vec<Option<usize>> {
        self.axes.iter().map(|(_, axis)| axis.count()).collect()
    }

    /// Values at a point of the unit cube; a point outside is moved to the surface.
    pub(crate) fn values(&self, point: &[f64]) -> Values {
        let all = self.axes.iter().zip(point);
        all.filter_map(|((name, axis), u)| Some((name.clone(), axis.value(*u)?)))
            .collect()
    }

    /// Point of the unit cube with these values, or the nearest point; missing parameters are in the middle.
    pub(crate) fn point(&self, values: &Values) -> Vec<f64> {
        let of =
            |(name, axis): &(String, Dimension)| values.get(name).map_or(0.5, |x| axis.share(x));
        self.axes.iter().map(of).collect()
    }
}

impl Dimension {
    fn count(&self) -> Option<usize> {
        match self {
            Dimension::Choices(list) => Some(list.len()),
            Dimension::Span {
                from,
                to,
                integer: true,
                ..
            } => Some((to - from) as usize + 1),
            Dimension::Span { .. } => None,
        }
    }

    /// The value at a place from 0 to 1.
    fn value(&self, u: f64) -> Option<ParameterValue> {
        let u = if u.is_finite() {
            u.clamp(0.0, 1.0)
        } else {
            0.5
        };
        match self {
            Dimension::Choices(list) => {
                let i = (u * list.len() as f64) as usize;
                list.get(i.min(list.len().saturating_sub(1))).cloned()
            }
            Dimension::Span {
                from,
                to,
                scale,
                integer,
            } => {
                let x = unbend(
                    *scale,
                    bend(*scale, *from) * (1.0 - u) + bend(*scale, *to) * u,
                );
                let x = if *integer { x.round() } else { digits(x, 8) };
                number(x.clamp(*from, *to))
            }
        }
    }

    /// The place of a value, from 0 to 1: of a choice that is not in the list that of the nearest number, else the
    /// first.
    fn share(&self, value: &ParameterValue) -> f64 {
        let x = as_number(value).unwrap_or(f64::NAN);
        match self {
            Dimension::Choices(list) => {
                let far = |other: &ParameterValue| match as_number(other) {
                    _ if other == value => -1.0,
                    Some(y) if x.is_finite() => (y - x).abs(),
                    _ => f64::INFINITY,
                };
                let near = |a: &(usize, &ParameterValue), b: &(usize, &ParameterValue)| {
                    far(a.1).total_cmp(&far(b.1))
                };
                let i = list.iter().enumerate().min_by(near).map_or(0, |(i, _)| i);
                (i as f64 + 0.5) / list.len() as f64
            }
            Dimension::Span {
                from, to, scale, ..
            } => {
                let [a, b] = [*from, *to].map(|x| bend(*scale, x));
                ((bend(*scale, x.clamp(*from, *to)) - a) / (b - a)).clamp(0.0, 1.0)
            }
        }
    }
}

/// A number as a parameter's value; `None` if it is not finite.
fn number(x: f64) -> Option<ParameterValue> {
    Finite::try_from(x).ok().map(ParameterValue::Number)
}

/// A number rounded to a number of significant decimal digits. With 15 or fewer, what is written to a file is what is
/// read back.
pub(crate) fn digits(x: f64, n: usize) -> f64 {
    if !x.is_finite() {
        return x;
    }
    format!("{x:.*e}", n.saturating_sub(1)).parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finite(x: f64) -> Finite {
        Finite::new(x)
    }

    fn range(from: f64, to: f64, scale: Scale, integer: bool) -> Range {
        Range {
            from: Some(finite(from)),
            to: Some(finite(to)),
            scale,
            integer,
            choices: None,
        }
    }

    fn space() -> Space {
        Space::new(&BTreeMap::from([
            ("a".to_owned(), range(-2.0, 6.0, Scale::Linear, false)),
            ("b".to_owned(), range(1e-4, 1.0, Scale::Log, false)),
            ("c".to_owned(), range(0.9, 0.999, Scale::Memory, false)),
            ("d".to_owned(), range(1.0, 4.0, Scale::Linear, true)),
            (
                "e".to_owned(),
                Range {
                    choices: Some(
                        [0.0, 7.0, 9.0]
                            .map(|x| ParameterValue::Number(finite(x)))
                            .to_vec(),
                    ),
                    ..Range::default()
                },
            ),
        ]))
    }

    #[test]
    fn the_middle_of_a_range_is_that_of_its_scale() {
        let values = space().values(&[0.5; 5]);
        let middle = |name: &str| as_number(&values[name]).unwrap();
        assert_eq!(middle("a"), 2.0);
        assert!((middle("b") - 1e-2).abs() < 1e-9); // geometric mean
        assert!((middle("c") - 0.99).abs() < 1e-9); // memories 10 and 1000: 100 between
        assert_eq!(middle("e"), 7.0);
    }

    #[test]
    fn ends_are_reached_and_never_passed() {
        for (u, ends) in [
            (0.0, [-2.0, 1e-4, 0.9, 1.0, 0.0]),
            (1.0, [6.0, 1.0, 0.999, 4.0, 9.0]),
            (-3.0, [-2.0, 1e-4, 0.9, 1.0, 0.0]),
            (f64::INFINITY, [2.0, 1e-2, 0.99, 3.0, 7.0]),
        ] {
            for ((name, x), end) in space().values(&[u; 5]).into_iter().zip(ends) {
                let x = as_number(&x).unwrap();
                assert!((x - end).abs() < 1e-7, "{name} at {u}: {x}");
            }
        }
    }

    #[test]
    fn point_and_values_are_inverse() {
        let space = space();
        for k in 0..50 {
            let point: Vec<f64> = (0..5)
                .map(|i| f64::from((k * 7 + i * 13) % 50) / 49.0)
                .collect();
            let values = space.values(&point);
            assert_eq!(space.values(&space.point(&values)), values);
        }
    }

    /// Words and flags: every one is reached, and found again.
    #[test]
    fn choices_of_words_are_enumerated() {
        let words = ["a", "b", "c"].map(|w| ParameterValue::Choice(w.into()));
        let flags = [true, false].map(ParameterValue::Flag);
        for list in [words.to_vec(), flags.to_vec()] {
            let range = Range {
                choices: Some(list.clone()),
                ..Range::default()
            };
            let space = Space::new(&BTreeMap::from([("x".to_owned(), range)]));
            assert_eq!(space.counts(), [Some(list.len())]);
            for (i, value) in list.iter().enumerate() {
                let place = (i as f64 + 0.5) / list.len() as f64;
                let values = space.values(&[place]);
                assert_eq!(values["x"], *value);
                assert_eq!(space.point(&values), [place]);
            }
        }
    }

    #[test]
    fn fifteen_digits_survive_json() {
        let mut x = 0.1234567890123456_f64;
        for k in 0..2000 {
            x = (x * 3.7 + 0.1).fract() * 10f64.powi(k % 13 - 6);
            let y = digits(x, 12);
            let text = serde_json::to_string(&y).unwrap();
            assert_eq!(serde_json::from_str::<f64>(&text).unwrap(), y, "{text}");
            assert!((y - x).abs() <= 1e-11 * x.abs());
        }
    }
}
