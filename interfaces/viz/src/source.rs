//! Sources of the scalars of a line: a channel as it is, scaled, with its band, or as an error against the truth.

/// The way from values of a chunk to scalars of an entity.
#[derive(Clone, Debug, PartialEq)]
pub enum ScalarSource {
    /// `scale` × the channel.
    Value {
        /// Index of the channel.
        channel: usize,
        /// Factor, such as 180/π.
        scale: f64,
        /// Index of the channel that is 1 where the value is valid; without it, it always is.
        valid: Option<usize>,
    },
    /// Two scalars a row: `scale` × (value − 2 sd) and `scale` × (value + 2 sd).
    Band {
        /// Index of the value's channel.
        channel: usize,
        /// Index of its standard deviation's channel.
        sd: usize,
        /// Factor.
        scale: f64,
        /// Column with the mark *valid*.
        valid: Option<usize>,
    },
    /// Estimate less truth.
    Error {
        /// Index of the estimate's channel.
        channel: usize,
        /// Index of the truth's channel.
        truth: usize,
        /// Factor of the difference.
        scale: ErrorScale,
        /// Column with the mark *valid*.
        valid: Option<usize>,
    },
    /// Two scalars a row, round zero: the protection level where the estimator reports one, else two standard
    /// deviations.
    ErrorBand {
        /// Index of the protection level's channel, if there is one.
        level: Option<usize>,
        /// Index of the standard deviation's channel.
        sd: usize,
        /// Index of the truth's channel.
        truth: usize,
        /// Scale of the error.
        scale: ErrorScale,
        /// Column with the mark *valid*.
        valid: Option<usize>,
    },
    /// A limit: the same at the first and the last row of each chunk.
    Limit(f64),
}

/// Factor of an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ErrorScale {
    /// A factor, such as 180/π.
    Factor(f64),
    /// 100 over the truth: per cent of it.
    PercentOfTruth,
}

impl ErrorScale {
    fn of(self, truth: f64) -> f64 {
        match self {
            Self::Factor(factor) => factor,
            Self::PercentOfTruth => 100.0 / truth,
        }
    }
}

impl ScalarSource {
    /// Scalars a row.
    pub fn width(&self) -> usize {
        match self {
            Self::Band { .. } | Self::ErrorBand { .. } => 2,
            _ => 1,
        }
    }

    /// The scalars of all rows, [`ScalarSource::width`] of them a row; not a number where there is none or it is not
    /// valid.
    pub fn scalars(&self, values: &[Vec<f64>], rows: usize) -> Vec<f64> {
        let at = |column: usize, row: usize| -> f64 {
            let value = values.get(column).and_then(|c| c.get(row));
            value.copied().unwrap_or(f64::NAN)
        };
        // 1 where the row is valid, else not a number
        let mask = |valid: &Option<usize>, row: usize| match valid {
            Some(valid) if at(*valid, row) != 1.0 => f64::NAN,
            _ => 1.0,
        };
        let one = |f: &dyn Fn(usize) -> f64| (0..rows).map(f).collect();
        let two = |f: &dyn Fn(usize) -> [f64; 2]| (0..rows).flat_map(f).collect();
        match self {
            Self::Value {
                channel,
                scale,
                valid,
            } => one(&|i| at(*channel, i) * scale * mask(valid, i)),
            Self::Band {
                channel,
                sd,
                scale,
                valid,
            } => two(&|i| {
                let (x, sd) = (at(*channel, i), at(*sd, i));
                let scale = scale * mask(valid, i);
                [(x - 2.0 * sd) * scale, (x + 2.0 * sd) * scale]
            }),
            Self::Error {
                channel,
                truth,
                scale,
                valid,
            } => one(&|i| {
                let truth = at(*truth, i);
                (at(*channel, i) - truth) * scale.of(truth) * mask(valid, i)
            }),
            Self::ErrorBand {
                level,
                sd,
                truth,
                scale,
                valid,
            } => two(&|i| {
                let level = level.map(|level| at(level, i)).filter(|x| x.is_finite());
                let ends = level.unwrap_or(2.0 * at(*sd, i))
                    * scale.of(at(*truth, i)).abs()
                    * mask(valid, i);
                [-ends, ends]
            }),
            Self::Limit(limit) => vec![*limit; rows],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 10 % too much with 2σ of 4 %; nothing where it is not valid.
    #[test]
    fn errors_are_per_cent_of_the_truth_and_only_where_valid() {
        let (truth, estimate, sd, flag) = (0, 1, 2, 3);
        let values = [
            vec![20e3, 20e3],
            vec![22e3, 22e3],
            vec![400.0, 400.0],
            vec![1.0, 0.0],
        ];
        let scale = ErrorScale::PercentOfTruth;
        let valid = Some(flag);
        let error = ScalarSource::Error {
            channel: estimate,
            truth,
            scale,
            valid,
        };
        let drawn = error.scalars(&values, 2);
        assert!((drawn[0] - 10.0).abs() < 1e-12 && drawn[1].is_nan());
        let band = ScalarSource::ErrorBand {
            level: None,
            sd,
            truth,
            scale,
            valid,
        };
        let drawn = band.scalars(&values, 2);
        assert!((drawn[0] + 4.0).abs() < 1e-12 && (drawn[1] - 4.0).abs() < 1e-12);
        assert!(drawn[2].is_nan() && drawn[3].is_nan());
    }
}
