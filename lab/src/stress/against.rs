//! Comparison of a matrix with an earlier matrix.

use crate::stress::{Figures, MatrixCell, StressFile};

/// Largest change of a share that is tolerated.
pub const SHARE_TOLERANCE: f64 = 0.01;

/// Largest change of a recovery that is tolerated, s.
const RECOVERY_S: f64 = 1.0;

/// A changed figure of a cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Condition.
    pub condition: String,
    /// Estimator.
    pub estimator: String,
    /// Quantity and figure, such as `slope misleading`.
    pub figure: String,
    /// Before.
    pub old: Option<f64>,
    /// Now.
    pub new: Option<f64>,
    /// True if the figure became worse.
    pub worse: bool,
}

/// Figures that have changed by more than the tolerance, worse figures first: errors by more than the share
/// `tolerance`, shares by more than [`SHARE_TOLERANCE`]. With them the number of cells that are not in the old matrix
/// and are not compared. The error says why nothing can be compared.
pub fn differences(
    old: &StressFile,
    new: &StressFile,
    tolerance: f64,
) -> Result<(Vec<Difference>, usize), String> {
    if old.scenarios != new.scenarios {
        return Err("it has other scenarios or seeds".to_owned());
    }
    let (mut all, mut alone) = (Vec::new(), 0);
    for now in &new.cells {
        let same =
            |c: &&MatrixCell| (&c.condition, &c.estimator) == (&now.condition, &now.estimator);
        let Some(before) = old.cells.iter().find(same) else {
            alone += 1;
            continue;
        };
        let names = ["mass", "slope", "effective slope"];
        let pairs = before.quantities().into_iter().zip(now.quantities());
        for (name, (a, b)) in names.into_iter().zip(pairs) {
            for (figure, old, new, worse) in changes(a, b, tolerance) {
                all.push(Difference {
                    condition: now.condition.clone(),
                    estimator: now.estimator.clone(),
                    figure: format!("{name} {figure}"),
                    old,
                    new,
                    worse,
                });
            }
        }
        if before.broken != now.broken {
            all.push(Difference {
                condition: now.condition.clone(),
                estimator: now.estimator.clone(),
                figure: "runs that broke down".into(),
                old: Some(before.broken as f64),
                new: Some(now.broken as f64),
                worse: now.broken > before.broken,
            });
        }
    }
    all.sort_by_key(|d| !d.worse);
    match alone == new.cells.len() {
        true => Err("it has no cell with an estimator and a condition of this matrix".to_owned()),
        false => Ok((all, alone)),
    }
}

type FigureChange = (&'static str, Option<f64>, Option<f64>, bool);

fn changes(a: &Figures, b: &Figures, tolerance: f64) -> Vec<FigureChange> {
    let mut all = Vec::new();
    let share = |x: Option<f64>| x.unwrap_or(0.0);
    for (figure, old, new, more_is_worse) in [
        ("misleading", a.misleading, b.misleading, true),
        ("overconfident", a.overconfident, b.overconfident, true),
        // not in older files
        ("beyond", a.beyond.or(b.beyond), b.beyond, true),
        ("valid", a.valid, b.valid, false),
    ] {
        let grown = share(new) - share(old);
        if grown.abs() > SHARE_TOLERANCE {
            all.push((figure, old, new, (grown > 0.0) == more_is_worse));
        }
    }
    // where nothing was valid there is no error to compare: what is valid now counts among the shares
    for (figure, old, new, least) in [
        ("error", a.error, b.error, 0.0),
        ("told sd", a.sd, b.sd, 0.0),
        ("recovery", a.recovery_s, b.recovery_s, RECOVERY_S),
    ] {
        match (old, new) {
            (Some(x), Some(y)) if (y - x).abs() > (tolerance * x).max(least) => {
                all.push((figure, old, new, y > x));
            }
            (Some(_), None) | (None, Some(_)) if figure == "recovery" => {
                all.push((figure, old, new, new.is_none()));
            }
            _ => {}
        }
    }
    all
}
