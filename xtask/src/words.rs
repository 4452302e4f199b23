//! Checks of the language: how documentation starts, and names with two meanings.

use std::collections::BTreeMap;

/// Documentation does not start with these words: a noun phrase or a third-person verb says more.
const BANNED_OPENINGS: [&str; 9] =
    ["What ", "Those ", "That ", "Who ", "Whose ", "Whether ", "So many ", "Of ", "How far "];

/// Returns the lines, counted from 1, on which documentation starts with a banned word, and the word.
pub(crate) fn banned_openings(text: &str) -> Vec<(usize, &'static str)> {
    let documentation = |line: &str| -> Option<String> {
        let line = line.trim_start();
        let rest = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"))?;
        (!rest.starts_with('/')).then(|| rest.trim_start().to_owned())
    };
    let mut faults = Vec::new();
    let mut is_inside = false;
    for (number, line) in text.lines().enumerate() {
        let words = documentation(line);
        if let Some(words) = words.as_ref().filter(|_| !is_inside)
            && let Some(banned) = BANNED_OPENINGS.into_iter().find(|banned| words.starts_with(banned))
        {
            faults.push((number + 1, banned.trim_end()));
        }
        is_inside = words.is_some();
    }
    faults
}

/// The places where each public type is declared, by its name.
#[derive(Debug, Default)]
pub(crate) struct PublicTypes(BTreeMap<String, Vec<String>>);

impl PublicTypes {
    /// Adds the public types of a source file, which is shown as `place`.
    pub(crate) fn add(&mut self, place: &str, text: &str) {
        for line in text.lines() {
            let mut words = line.trim_start().split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
            if words.next() == Some("pub")
                && line.trim_start().starts_with("pub ")
                && matches!(words.next(), Some("struct" | "enum" | "trait" | "type" | "union"))
                && let Some(name) = words.next()
            {
                self.0.entry(name.to_owned()).or_default().push(place.to_owned());
            }
        }
    }

    /// Returns a message for each name that two types share.
    pub(crate) fn doubled(&self) -> impl Iterator<Item = String> {
        self.0.iter().filter(|(_, places)| places.len() > 1).map(|(name, places)| {
            format!(
                "{name}: expected one public type of this name, got {} ({}); rename all but one",
                places.len(),
                places.join(", ")
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn banned_words_count_at_the_start_of_documentation_alone() {
        let text = "/// Whether it is so.\n/// Whether or not.\nfn f() {}\n\n//! The lot.\n//! What else.\nfn g() {}\n    /// Of two.\n// What is no documentation.\n//// Nor this.\n";
        assert_eq!(banned_openings(text), [(1, "Whether"), (8, "Of")]);
        assert!(banned_openings("/// Whatever comes.\n").is_empty());
    }

    #[test]
    fn types_of_one_name_are_found_across_files() {
        let mut types = PublicTypes::default();
        types.add("a.rs", "pub struct Samples;\npub(crate) struct Inner;\n    pub enum Kind<T> {\n");
        types.add(
            "b.rs",
            "pub type Samples<'a> = &'a [f32];\nstruct Inner;\npub fn kind() {}\npub struct Kinds;\n",
        );
        let doubled: Vec<String> = types.doubled().collect();
        assert_eq!(
            doubled,
            ["Samples: expected one public type of this name, got 2 (a.rs, b.rs); rename all but one"]
        );
    }
}
