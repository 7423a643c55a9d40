//! Estimator or plant behind the variables of an FMU.

mod estimator;
mod interface;
mod plant;

pub(crate) use interface::{Model, Stepped};

use crate::part::Part;
use crate::variable::Variable;
use std::path::Path;

/// The variables of a part and what stands behind them.
pub(crate) fn of(part: Part, resources: &Path) -> Result<(Vec<Variable>, Box<dyn Model>), String> {
    match part {
        Part::Estimator(part) => estimator::of(*part, resources),
        Part::Plant(part) => plant::of(part, resources),
    }
}
