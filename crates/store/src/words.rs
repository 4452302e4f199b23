//! Words of error messages: counts with their nouns, and errors of the operating system.

use std::fmt::Display;
use std::io;

/// Returns a number with its noun: "1 byte", "2 bytes".
pub(crate) fn counted(count: impl Display, one: &str, many: &str) -> String {
    let count = count.to_string();
    let noun = if count == "1" { one } else { many };
    format!("{count} {noun}")
}

/// Returns a number of bytes with its unit.
pub(crate) fn bytes(count: impl Display) -> String {
    counted(count, "byte", "bytes")
}

/// Returns the message of an error in lower case, without the operating system's number for it.
pub(crate) fn plain(cause: &io::Error) -> String {
    let message = cause.to_string();
    let message = message.split(" (os error ").next().unwrap_or_default();
    let mut chars = message.chars();
    match (chars.next(), chars.clone().next()) {
        (Some(first), Some(second)) if second.is_lowercase() => first.to_lowercase().chain(chars).collect(),
        _ => message.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_thing_is_singular() {
        assert_eq!([0, 1, 2].map(bytes), ["0 bytes", "1 byte", "2 bytes"]);
    }

    #[test]
    fn system_errors_lose_their_number() {
        if cfg!(unix) {
            assert_eq!(plain(&io::Error::from_raw_os_error(13)), "permission denied");
        }
        assert_eq!(plain(&io::ErrorKind::StorageFull.into()), "no storage space");
        assert_eq!(plain(&io::Error::other("ZIP archive")), "ZIP archive");
    }
}
