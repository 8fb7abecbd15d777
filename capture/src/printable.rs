//! Names from outside, made safe to print.

use std::{borrow::Cow, fmt::Write, path::Path};

/// `text` with every control character written as an escape such as `\u{1b}`: a name cannot move a terminal's cursor,
/// change its colours, or pretend to be another line. Marks that turn the direction of writing are escaped too.
pub fn printable(text: &str) -> Cow<'_, str> {
    escape(text, |c| c.is_control() || turns_direction(c))
}

/// As [`printable`], for text of several lines: line breaks and tabs stay.
pub fn printable_lines(text: &str) -> Cow<'_, str> {
    escape(text, |c| (c.is_control() && c != '\n' && c != '\t') || turns_direction(c))
}

/// A path for people: what is not Unicode is replaced, control characters are escaped.
pub fn printable_path(path: &Path) -> String {
    printable(&path.to_string_lossy()).into_owned()
}

fn escape(text: &str, is_unsafe: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&is_unsafe) {
        return Cow::Borrowed(text);
    }
    let mut safe = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_unsafe(c) {
            // Writing to a string cannot fail.
            let _ = write!(safe, "{}", c.escape_unicode());
        } else {
            safe.push(c);
        }
    }
    Cow::Owned(safe)
}

/// Unicode's marks that reorder what is written around them.
fn turns_direction(c: char) -> bool {
    matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use std::{ffi::OsStr, os::unix::ffi::OsStrExt};

    use super::*;

    #[test]
    fn escapes_cannot_reach_a_terminal() {
        assert_eq!(printable("plain Müller 身"), "plain Müller 身");
        assert_eq!(printable("a\u{1b}[2Jb\nc\u{9b}d"), "a\\u{1b}[2Jb\\u{a}c\\u{9b}d");
        assert_eq!(printable("gpj.\u{202e}exe"), "gpj.\\u{202e}exe");
        assert_eq!(printable_lines("a\n\tb\r\u{7}"), "a\n\tb\\u{d}\\u{7}");
        assert_eq!(printable_path(Path::new(OsStr::from_bytes(b"M\xfcller\x1b"))), "M\u{fffd}ller\\u{1b}");
    }
}
