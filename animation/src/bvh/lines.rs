//! The lines of a BVH file, one after the other, and complaints that name them.

use crate::AnimationError;

/// The largest number that is believed, file units or degrees.
const LARGEST: f64 = 1e9;

/// Goes through the lines of a file.
pub(super) struct Lines<'a> {
    lines: std::str::Lines<'a>,
    /// Number of the line that was read last, counted from 1; 0 before the first.
    line: usize,
    name: &'a str,
}

impl<'a> Lines<'a> {
    /// The lines of `text`; `name` stands for the file in errors.
    pub fn new(text: &'a str, name: &'a str) -> Self {
        Self { lines: text.trim_start_matches('\u{feff}').lines(), line: 0, name }
    }

    /// A complaint about the line that was read last.
    pub fn error(&self, reason: impl Into<String>) -> AnimationError {
        AnimationError::Bvh { name: self.name.into(), line: self.line.max(1), reason: reason.into() }
    }

    /// The next line that is not blank, trimmed.
    pub fn next(&mut self) -> Option<&'a str> {
        loop {
            let line = self.lines.next()?.trim();
            self.line += 1;
            if !line.is_empty() {
                return Some(line);
            }
        }
    }

    /// Reads over a line that holds `keyword` alone.
    pub fn expect(&mut self, keyword: &str, reason: &str) -> Result<(), AnimationError> {
        match self.next() {
            Some(line) if line.eq_ignore_ascii_case(keyword) => Ok(()),
            _ => Err(self.error(reason)),
        }
    }

    /// The number on the next line, which must start with `key`.
    pub fn header(&mut self, key: &str) -> Result<f64, AnimationError> {
        let line = self.next().unwrap_or_default();
        match line.get(..key.len()) {
            Some(start) if start.eq_ignore_ascii_case(key) => self.finite(Some(line[key.len()..].trim())),
            _ => Err(self.error(format!("`{key}` is missing"))),
        }
    }

    /// A coordinate or an angle.
    pub fn number(&self, word: Option<&str>) -> Result<f64, AnimationError> {
        let value = self.finite(word)?;
        if value.abs() > LARGEST {
            return Err(self.error(format!("{value:e} is out of range: numbers go up to {LARGEST:e}")));
        }
        Ok(value)
    }

    fn finite(&self, word: Option<&str>) -> Result<f64, AnimationError> {
        let word = word.ok_or_else(|| self.error("a number is missing"))?;
        match word.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.error(format!("`{}` is not a finite number", shortened(word)))),
        }
    }
}

/// The first characters of a word that may be as long as the file.
pub(super) fn shortened(word: &str) -> String {
    const SHOWN: usize = 40;
    let mut short: String = word.chars().take(SHOWN).collect();
    if short.len() < word.len() {
        short.push('…');
    }
    short
}
