//! How a log and its map write times, units and formulas of columns.

mod expression;
mod time;
mod units;

pub(crate) use expression::Expression;
pub(crate) use time::NS;
pub use time::TimeUnit;
pub use units::UnitName;
pub(crate) use units::{Quantity, UNITS, Unit};
