//! An instrument that a program adds to the instruments of the data sheet.

use super::named_part::{NamedPart, PartKeys};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An instrument that the program adds, with its parameters; its kind is its name in the scenario.
pub(crate) type InstrumentSettings = NamedPart<InstrumentKeys>;

/// Parameters of the instrument by name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct InstrumentKeys {}

impl PartKeys for InstrumentKeys {
    const FORM: &'static str = "a mapping of parameters, such as {} or {range_m: 20}";
}
