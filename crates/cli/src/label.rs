//! The name and the id of a line of input, which the answer repeats.

use std::fmt;

use serde::Serialize;
use serde_json::Value;

/// The name and the id of a line, of any type; fields that are not given are left out of the answer.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct Label {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) name: Option<Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) id: Option<Value>,
}

/// A name that is text or, without it, an id that is text or a number, after the number of its line.
impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let told = [&self.name, &self.id].into_iter().flatten().find_map(|value| match value {
            Value::String(text) => Some(text.chars().take(40).flat_map(char::escape_debug).collect()),
            Value::Number(number) => Some(number.to_string()),
            _ => None,
        });
        told.map_or(Ok(()), |told: String| write!(f, " ({told})"))
    }
}
