//! A value in a map file: the name of a column, an expression of columns, or a constant.

use crate::notation::Expression;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A formula of a map file: `fx` (a column, its name taken as it is), `= fx - 2 * fy` (an expression) or `20` (a
/// constant).
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Written")]
pub(crate) struct Formula {
    /// The expression.
    pub expression: Expression,
    written: Written,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "use the name of a column, an expression that begins with `=`, or a number"
)]
enum Written {
    Number(f64),
    Text(String),
}

impl TryFrom<Written> for Formula {
    type Error = String;
    fn try_from(written: Written) -> Result<Self, String> {
        let expression = match &written {
            Written::Number(x) if x.is_finite() => Expression::parse(&format!("{x}"))?,
            Written::Number(x) => return Err(format!("{x} is not finite")),
            Written::Text(text) => match text.trim_start().strip_prefix('=') {
                Some(expression) => Expression::parse(expression)?,
                None if text.trim().is_empty() => {
                    return Err("the name of a column is missing".into());
                }
                None => Expression::column(text),
            },
        };
        Ok(Self {
            expression,
            written,
        })
    }
}

impl From<Formula> for Written {
    fn from(formula: Formula) -> Self {
        formula.written
    }
}

impl JsonSchema for Formula {
    fn schema_name() -> Cow<'static, str> {
        "Formula".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": ["string", "number"],
            "description": "The name of a column, `FILE:COLUMN` of another file under `files`; an expression of columns that begins with `=`, such as `= torque_nm * engine_rpm * 0.104720`; or a constant."
        })
    }
}

impl Formula {
    /// True for `none`: there is no such column.
    pub fn is_none(&self) -> bool {
        matches!(&self.written, Written::Text(text) if text.trim() == "none")
    }

    /// A constant.
    pub fn constant(x: f64) -> Self {
        Self {
            expression: Expression::constant(x),
            written: Written::Number(x),
        }
    }
}

/// An expression that is true or not, such as `engine_rpm / turbine_rpm < 1.1`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub(crate) struct Condition(pub Expression);

impl TryFrom<String> for Condition {
    type Error = String;
    fn try_from(text: String) -> Result<Self, String> {
        Expression::parse(text.trim_start().strip_prefix('=').unwrap_or(&text)).map(Self)
    }
}

impl From<Condition> for String {
    fn from(condition: Condition) -> String {
        condition.0.text
    }
}

impl JsonSchema for Condition {
    fn schema_name() -> Cow<'static, str> {
        "Condition".into()
    }
    fn inline_schema() -> bool {
        true
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string" })
    }
}
