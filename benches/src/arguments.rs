//! A reader of arguments: words, and options with or without a value.

use std::str::FromStr;

use crate::Failure;

/// Arguments that have not been asked for yet.
#[derive(Debug, Clone)]
pub struct Arguments {
    rest: Vec<String>,
}

impl Arguments {
    /// Those of this process.
    #[must_use]
    pub fn of_process() -> Self {
        Self { rest: std::env::args().skip(1).collect() }
    }

    /// Whether `name` is given; takes it out.
    pub fn flag(&mut self, name: &str) -> bool {
        let before = self.rest.len();
        self.rest.retain(|word| word != name);
        self.rest.len() < before
    }

    /// The value after `name`, if that is given; takes both out.
    ///
    /// # Errors
    /// When the value is missing or cannot be read.
    pub fn value<T: FromStr>(&mut self, name: &str) -> Result<Option<T>, Failure> {
        let Some(at) = self.rest.iter().position(|word| word == name) else {
            return Ok(None);
        };
        if at + 1 >= self.rest.len() {
            return Err(format!("{name} needs a value").into());
        }
        let value = self.rest.remove(at + 1);
        self.rest.remove(at);
        value.parse().map(Some).or(Err(format!("{name} cannot be {value:?}").into()))
    }

    /// All values after any `name`.
    ///
    /// # Errors
    /// As [`Arguments::value`].
    pub fn values<T: FromStr>(&mut self, name: &str) -> Result<Vec<T>, Failure> {
        let mut values = Vec::new();
        while let Some(value) = self.value(name)? {
            values.push(value);
        }
        Ok(values)
    }

    /// What is left: words. Ask for options first.
    ///
    /// # Errors
    /// When an option is left that nobody asked for.
    pub fn words(self) -> Result<Vec<String>, Failure> {
        match self.rest.iter().find(|word| word.starts_with("--")) {
            Some(unknown) => Err(format!("unknown option {unknown}").into()),
            None => Ok(self.rest),
        }
    }

    /// That nothing is left. Ask for options first.
    ///
    /// # Errors
    /// When something is.
    pub fn nothing_left(self) -> Result<(), Failure> {
        let words = self.words()?;
        if words.is_empty() { Ok(()) } else { Err(format!("what is {words:?}?").into()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_taken_out_of_words() {
        let given = ["a", "--near", "3", "--fast", "b", "--rival", "x", "--rival", "y"];
        let mut arguments = Arguments { rest: given.map(String::from).to_vec() };
        assert_eq!(arguments.value::<u32>("--near").unwrap(), Some(3));
        assert!(arguments.flag("--fast") && !arguments.flag("--fast"));
        assert_eq!(arguments.values::<String>("--rival").unwrap(), ["x", "y"]);
        assert_eq!(arguments.clone().words().unwrap(), ["a", "b"]);
        arguments.rest.push("--odd".into());
        assert!(arguments.value::<u32>("--odd").is_err(), "no value");
        assert!(arguments.words().is_err(), "nobody asked for it");
    }
}
