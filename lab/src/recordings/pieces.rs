//! A recording: columns of numbers over time, in pieces without gap.

/// Multiple of the median time step that begins a new piece.
const GAP: f64 = 5.0;
/// Fewest samples of a piece.
const MIN_PIECE: usize = 16;

/// A sample of all columns.
#[derive(Clone, Debug)]
pub struct RecordedRow {
    /// Number of its run, if there are several runs.
    pub run: u32,
    /// Time, s.
    pub t_s: f64,
    /// A value for each column.
    pub values: Vec<f64>,
}

/// Columns of numbers over time.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Names of the columns.
    pub(crate) names: Vec<String>,
    /// SI unit of each; empty if unknown.
    pub(crate) units: Vec<String>,
    /// Pieces without gap.
    pub(crate) pieces: Vec<Piece>,
}

/// Samples without gap.
#[derive(Clone, Debug, Default)]
pub(crate) struct Piece {
    run: u32,
    /// Times, s.
    pub(crate) t_s: Vec<f64>,
    /// Samples, column by column.
    pub(crate) columns: Vec<Vec<f64>>,
}

impl Recording {
    /// Cuts rows into pieces: where the run changes, where the time falls, where there is a gap. `None` if no piece has
    /// 16 samples.
    pub fn cut(columns: Vec<(String, String)>, rows: Vec<RecordedRow>) -> Option<Self> {
        let times = rows.iter().zip(rows.iter().skip(1));
        let mut steps: Vec<f64> = times.map(|(a, b)| b.t_s - a.t_s).collect();
        steps.retain(|dt| *dt > 0.0);
        steps.sort_by(f64::total_cmp);
        let median = steps.get(steps.len() / 2).copied().unwrap_or(f64::INFINITY);
        let mut pieces: Vec<Piece> = Vec::new();
        for RecordedRow { run, t_s, values } in rows {
            let goes_on = pieces.last().is_some_and(|p| {
                let last = p.t_s.last().copied().unwrap_or(t_s);
                p.run == run && t_s > last && t_s - last < GAP * median
            });
            if !goes_on {
                pieces.push(Piece {
                    run,
                    t_s: Vec::new(),
                    columns: vec![Vec::new(); columns.len()],
                });
            }
            if let Some(piece) = pieces.last_mut() {
                piece.t_s.push(t_s);
                for (column, value) in piece.columns.iter_mut().zip(values) {
                    column.push(value);
                }
            }
        }
        pieces.retain(|p| p.t_s.len() >= MIN_PIECE);
        let (names, units) = columns.into_iter().unzip();
        (!pieces.is_empty()).then_some(Self {
            names,
            units,
            pieces,
        })
    }

    /// Mean time between two samples of a piece, s.
    pub(crate) fn period_s(&self) -> f64 {
        let (mut seconds, mut steps) = (0.0, 0);
        for piece in &self.pieces {
            if let (Some(first), Some(last)) = (piece.t_s.first(), piece.t_s.last()) {
                seconds += last - first;
                steps += piece.t_s.len() - 1;
            }
        }
        seconds / steps as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A gap, a time that falls and another run each begin a piece; one of 15 samples is none.
    #[test]
    fn pieces_have_no_gap() {
        let cut = |rows: &[(u32, f64)]| {
            let row = |(run, t_s): &(u32, f64)| RecordedRow {
                run: *run,
                t_s: *t_s,
                values: vec![*t_s],
            };
            let column = ("wy".to_owned(), "rad/s".to_owned());
            Recording::cut(vec![column], rows.iter().map(row).collect())
        };
        let of = |run: u32, from: f64, count: u32| {
            (0..count).map(move |k| (run, from + 0.01 * f64::from(k)))
        };
        for (second, pieces) in [
            (of(0, 0.2, 20), 1),
            (of(0, 7.0, 20), 2),
            (of(0, -3.0, 20), 2),
            (of(1, 0.2, 20), 2),
            (of(1, 0.2, 15), 1),
        ] {
            let rows: Vec<(u32, f64)> = of(0, 0.0, 20).chain(second).collect();
            let found = cut(&rows).unwrap();
            assert_eq!(found.pieces.len(), pieces, "{rows:?}");
            assert!((found.period_s() - 0.01).abs() < 1e-12);
            assert_eq!(found.pieces[0].columns[0], found.pieces[0].t_s);
        }
        assert!(cut(&of(0, 0.0, 15).collect::<Vec<_>>()).is_none());
    }
}
