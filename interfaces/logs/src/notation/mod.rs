//! The notation of times, units and formulas of columns in logs and map files.

mod expression;
mod time;
mod title;
mod units;

pub(crate) use expression::Expression;
pub(crate) use time::NS;
pub use time::TimeUnit;
pub(crate) use title::{Title, is_one};
pub(crate) use units::UnitName;
pub(crate) use units::{Quantity, STANDARD_GRAVITY_MPS2, Unit};
