//! Files with one JSON object on each line.

use std::path::Path;

use serde::de::DeserializeOwned;

use crate::error::CliError;
use crate::input::TextLines;

/// A file with one JSON object on each line.
#[derive(Debug)]
pub(crate) struct JsonLines {
    lines: TextLines,
    /// The objects in words, in the plural.
    wanted: &'static str,
    /// The form of a line, for messages.
    form: &'static str,
    /// `true` until an object has been read.
    is_empty: bool,
}

impl JsonLines {
    /// Opens a file, or standard input for `-`.
    pub(crate) fn open(path: &Path, wanted: &'static str, form: &'static str) -> Result<Self, CliError> {
        Ok(Self { lines: TextLines::open(path)?, wanted, form, is_empty: true })
    }

    /// Returns the number of the next line that is neither blank nor a comment, counted from 1, and its
    /// text. Fails at the end of a file without such lines.
    pub(crate) fn next_line(&mut self) -> Result<Option<(u64, String)>, CliError> {
        let line = self.lines.next_filled()?;
        if line.is_none() && self.is_empty {
            let Self { lines, wanted, form, .. } = self;
            return Err(lines.unsuitable(format!("expected {wanted}, got none; {form}")));
        }
        self.is_empty = false;
        Ok(line)
    }

    /// Parses the object on line `number`, whose text is `text`.
    pub(crate) fn parse<T: DeserializeOwned>(&self, number: u64, text: &str) -> Result<T, CliError> {
        self.parse_as(number, text, self.form)
    }

    /// As [`Self::parse`], for a line of this form.
    pub(crate) fn parse_as<T: DeserializeOwned>(
        &self,
        number: u64,
        text: &str,
        form: &str,
    ) -> Result<T, CliError> {
        // An array would be read as the fields of an object in their order.
        if !text.starts_with('{') {
            return Err(self.fault_on(number, format!("expected one object in {{}} on each line; {form}")));
        }
        let fault = |cause: serde_json::Error| match cause.is_eof() {
            true => format!("expected the whole object on one line, got a part of it; {form}"),
            false => format!("{}; {form}", json_fault(&cause)),
        };
        serde_json::from_str(text).map_err(|cause| self.fault_on(number, fault(cause)))
    }

    /// Returns an error about line `number`.
    pub(crate) fn fault_on(&self, number: u64, what: impl Into<String>) -> CliError {
        self.lines.fault_on(number, what)
    }
}

/// Returns the fault in a line of JSON, after its column if that is known.
pub(crate) fn json_fault(cause: &serde_json::Error) -> String {
    let message = cause.to_string();
    let what = message.split(" at line ").next().unwrap_or_default();
    let what = what.replace("expected f64", "expected a number");
    // The parser does not tell what it met.
    let what = if what == "expected value" {
        "expected a value, such as 0.5 (not .5 or +0.5), -2, \"name\" or [1,2,3]".to_owned()
    } else {
        what
    };
    if cause.column() > 0 { format!("column {}: {what}", cause.column()) } else { what }
}
