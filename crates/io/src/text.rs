//! Lines, words and numbers of arbitrary text, and words of error messages.

use std::fmt::Display;
use std::io::{self, ErrorKind};

/// An iterator over the lines of a text, with their numbers. Lines end with LF or CR LF, or with CR
/// alone if the first line does.
#[derive(Clone)]
pub(crate) struct Lines<'a> {
    bytes: &'a [u8],
    offset: usize,
    number: u64,
    end: u8,
}

/// A line without its line end.
#[derive(Clone, Copy)]
pub(crate) struct Line<'a> {
    /// Number of the line, counted from 1.
    pub(crate) number: u64,
    pub(crate) text: &'a [u8],
}

impl<'a> Lines<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        let first = bytes.iter().position(|b| matches!(b, b'\n' | b'\r'));
        let end = match first.map(|i| &bytes[i..]) {
            Some([b'\r', b'\n', ..]) | None => b'\n',
            Some([end, ..]) => *end,
            Some([]) => b'\n',
        };
        Self { bytes, offset: 0, number: 0, end }
    }

    /// Iterates over the next piece of a text. `number` is that of the line before the piece, and
    /// every line ends with the byte `end`.
    pub(crate) fn going_on(bytes: &'a [u8], number: u64, end: u8) -> Self {
        Self { bytes, offset: 0, number, end }
    }

    /// Returns the last byte of line ends.
    pub(crate) fn end(&self) -> u8 {
        self.end
    }

    /// Returns the offset of the next line.
    pub(crate) fn offset(&self) -> usize {
        self.offset
    }

    /// Returns the number of bytes from the next line to the end.
    pub(crate) fn left(&self) -> usize {
        self.bytes.len() - self.offset
    }

    /// Returns the number of the last line returned.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// Returns the next line that is not blank.
    pub(crate) fn next_filled(&mut self) -> Option<Line<'a>> {
        self.find(|line| !line.text.trim_ascii().is_empty())
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        let rest = self.bytes.get(self.offset..).filter(|rest| !rest.is_empty())?;
        let end = self.end;
        let length = rest.iter().position(|&b| b == end).unwrap_or(rest.len());
        self.offset += (length + 1).min(rest.len());
        self.number += 1;
        let text = &rest[..length];
        Some(Line { number: self.number, text: text.strip_suffix(b"\r").unwrap_or(text) })
    }
}

impl<'a> Line<'a> {
    /// Returns the words of the line, separated by white space.
    pub(crate) fn words(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        words(self.text)
    }
}

/// Returns the words of a text, separated by white space.
pub(crate) fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// Returns `true` if the line is neither blank nor a comment.
pub(crate) fn has_values(line: &Line<'_>) -> bool {
    let text = line.text.trim_ascii_start();
    !text.is_empty() && !text.starts_with(b"#") && !text.starts_with(b"//")
}

/// Parses a number, including NaN and infinity in all common spellings.
pub(crate) fn number(word: &[u8]) -> Option<f64> {
    let parsed = std::str::from_utf8(word).ok()?.parse().ok();
    parsed.or_else(|| is_not_finite(word).then_some(f64::NAN))
}

/// Returns `true` for the spellings of C libraries for NaN and infinity, such as `-nan(ind)` and
/// `1.#QNAN`.
fn is_not_finite(word: &[u8]) -> bool {
    let word = word.strip_prefix(b"-").unwrap_or(word);
    let starts_with = |start: &[u8]| word.get(..start.len()).is_some_and(|w| w.eq_ignore_ascii_case(start));
    starts_with(b"nan(") || starts_with(b"1.#")
}

/// Parses a whole number.
pub(crate) fn whole<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Maximum length of a word in a message, in characters.
const SHOWN: usize = 40;

/// Formats a piece of a file for a message: shortened, with control characters escaped.
pub(crate) fn shown(piece: &[u8]) -> Box<str> {
    let start = &piece[..piece.len().min(4 * SHOWN)];
    cut(&String::from_utf8_lossy(start.trim_ascii()), SHOWN).into()
}

/// Formats the message of a decoder, which may quote the file: cut to 200 characters, with control
/// characters escaped.
pub(crate) fn said(cause: &str) -> String {
    cut(cause, 200)
}

/// Returns a number with its noun: "1 entry", "2 entries".
pub(crate) fn counted(count: impl Display, one: &str, many: &str) -> String {
    let count = count.to_string();
    let noun = if count == "1" { one } else { many };
    format!("{count} {noun}")
}

/// Returns a number of bytes with its unit.
pub(crate) fn bytes(count: impl Display) -> String {
    counted(count, "byte", "bytes")
}

/// Returns the message and the remedy for an error of reading a file.
pub(crate) fn io_words(cause: &io::Error) -> String {
    match cause.kind() {
        ErrorKind::NotFound => "no such file; check the path".to_owned(),
        ErrorKind::PermissionDenied => "permission denied; make the file readable".to_owned(),
        ErrorKind::OutOfMemory => {
            "the file exceeds the available memory; close other programs, or read it in parts".to_owned()
        }
        _ => format!("cannot read the file ({}); check the disk and try again", plain(cause)),
    }
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

/// Cuts a text to `most` characters after control characters are escaped.
fn cut(text: &str, most: usize) -> String {
    let (mut shown, mut length) = (String::new(), 0);
    for c in text.chars() {
        let is_quote = matches!(c, '"' | '\'');
        // An escape may have six characters.
        length += if is_quote { 1 } else { c.escape_debug().count() };
        if length > most {
            shown.push('…');
            break;
        }
        if is_quote { shown.push(c) } else { shown.extend(c.escape_debug()) }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_in_three_ways() {
        for text in ["a\n\nb c\n", "a\r\n\r\nb c", "a\r\rb c\r"] {
            let lines: Vec<_> = Lines::new(text.as_bytes()).map(|l| (l.number, l.text)).collect();
            assert_eq!(lines, [(1, &b"a"[..]), (2, b""), (3, b"b c")], "{text:?}");
        }
        assert!(Lines::new(b"").next().is_none(), "no line in no text");
    }

    #[test]
    fn numbers_are_spelled_in_many_ways() {
        for (word, value) in [("-1.5e3", -1500.0), ("+2", 2.0), (".5", 0.5), ("7.", 7.0)] {
            assert_eq!(number(word.as_bytes()), Some(value), "{word}");
        }
        for word in ["nan", "-NaN", "-nan(ind)", "1.#QNAN", "-1.#IND00", "nan(0x8)"] {
            assert!(number(word.as_bytes()).is_some_and(f64::is_nan), "{word}");
        }
        assert_eq!(number(b"-inf"), Some(f64::NEG_INFINITY), "infinity is a number");
        for word in ["", "x", "1,5", "0x10", "1.2.3", "--1", "nano"] {
            assert_eq!(number(word.as_bytes()), None, "{word}");
        }
    }

    #[test]
    fn messages_use_singular_and_plural_and_no_error_numbers() {
        assert_eq!([0, 1, 2].map(bytes), ["0 bytes", "1 byte", "2 bytes"]);
        if cfg!(unix) {
            assert_eq!(plain(&io::Error::from_raw_os_error(13)), "permission denied");
        }
        let denied = io_words(&ErrorKind::PermissionDenied.into());
        assert_eq!(denied, "permission denied; make the file readable");
    }

    #[test]
    fn what_is_shown_is_short_and_printable() {
        assert_eq!(&*shown(b" a\x1b[31mb "), "a\\u{1b}[31mb");
        assert_eq!(shown(&[b'x'; 1000]).chars().count(), SHOWN + 1, "cut with an ellipsis");
        assert_eq!(&*shown("Größe".as_bytes()), "Größe");
        // Found by fuzzing: two escaped words made a message longer than 400 bytes.
        assert_eq!(shown(&[0x1b; 1000]).chars().count(), 6 * 6 + 1, "cut as it is shown");
    }
}
