//! Matrices and numbers out of the YAML that OpenCV's `FileStorage` writes.
//!
//! Its dialect is small: keys at the line's start, matrices as `!!opencv-matrix` with indented `rows`, `cols`, `dt` and
//! `data` (docs.opencv.org, "File Input and Output using XML / YAML / JSON files"). Whatever else a file holds is skipped.

use std::collections::BTreeMap;

/// A matrix, row by row; every number is finite.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub cols: usize,
    /// `rows * cols` numbers.
    pub data: Vec<f64>,
}

/// The top level of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FileStorage {
    /// Matrices by name.
    pub matrices: BTreeMap<String, Matrix>,
    /// Plain numbers by name.
    pub numbers: BTreeMap<String, f64>,
}

/// The largest count of numbers that a calibration's matrix may have; per-view tables of long calibrations have thousands.
const MAX_NUMBERS: usize = 1_000_000;

/// Reads the text of a file.
///
/// # Errors
/// A sentence with the line's number where a matrix is not whole.
pub fn parse(text: &str) -> Result<FileStorage, String> {
    if text.trim_start().starts_with('<') {
        return Err("this is XML; write the calibration as .yml (cv::FileStorage chooses by the file's name)".into());
    }
    let mut storage = FileStorage::default();
    let mut lines = text.lines().enumerate().peekable();
    while let Some((number, line)) = lines.next() {
        let Some((key, value)) = key_and_value(line).filter(|_| !line.starts_with([' ', '\t', '#', '%', '-'])) else {
            continue;
        };
        if value.starts_with("!!opencv-matrix") {
            let mut body = Vec::new();
            while let Some((_, line)) = lines.next_if(|(_, l)| l.starts_with([' ', '\t']) || l.trim().is_empty()) {
                body.push(line);
            }
            let matrix = matrix(&body).map_err(|e| format!("line {}: matrix {key}: {e}", number + 1))?;
            storage.matrices.insert(key.to_string(), matrix);
        } else if let Ok(value) = value.parse() {
            storage.numbers.insert(key.to_string(), value);
        }
    }
    Ok(storage)
}

fn key_and_value(line: &str) -> Option<(&str, &str)> {
    let (key, value) = line.split_once(':')?;
    let key = key.trim().trim_matches('"');
    (!key.is_empty()).then(|| (key, value.trim()))
}

/// A matrix from the indented lines below its name.
fn matrix(body: &[&str]) -> Result<Matrix, String> {
    let field = |name: &str| {
        let found = body.iter().filter_map(|l| key_and_value(l)).find(|(k, _)| *k == name);
        found.map(|(_, value)| value).ok_or_else(|| format!("`{name}` is missing"))
    };
    let size = |name: &str| field(name)?.parse::<usize>().map_err(|e| format!("`{name}`: {e}"));
    let (rows, cols) = (size("rows")?, size("cols")?);
    let count = rows.checked_mul(cols).filter(|&n| n <= MAX_NUMBERS).ok_or("is too large")?;
    let kind = field("dt")?.trim_matches('"');
    if !["d", "f", "i", "u", "c", "w", "s"].contains(&kind) {
        return Err(format!("`dt` is {kind}, but a matrix of a calibration has one plain number a cell"));
    }
    let data = numbers(&body.join(" "))?;
    if data.len() != count {
        return Err(format!("{rows}x{cols} needs {count} numbers, `data` has {}", data.len()));
    }
    Ok(Matrix { rows, cols, data })
}

/// The numbers of `data: [ ... ]`.
fn numbers(body: &str) -> Result<Vec<f64>, String> {
    let list = body.split_once("data:").map(|(_, rest)| rest.trim_start()).ok_or("`data` is missing")?;
    let list = list.strip_prefix('[').and_then(|l| l.split_once(']')).ok_or("`data` has no [ ... ]")?.0;
    let finite = |word: &str| match word.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("`{}` is not a number", word.chars().take(40).collect::<String>())),
    };
    list.split(',').map(str::trim).filter(|w| !w.is_empty()).map(finite).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const GOOD: &str = "%YAML:1.0\n---\n# made by hand\nflags: 2\nname: \"rig: a\"\nT: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ -1.2e+02, 0.,\n       3.5 ]\nfps: 30.\n";

    #[test]
    fn matrices_and_numbers_are_found_among_other_things() {
        let storage = parse(GOOD).unwrap();
        assert_eq!(storage.matrices["T"], Matrix { rows: 3, cols: 1, data: vec![-120.0, 0.0, 3.5] });
        assert_eq!(storage.numbers, BTreeMap::from([("flags".into(), 2.0), ("fps".into(), 30.0)]));
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        for (from, to, word) in [
            ("rows: 3", "rows: 4", "needs 4 numbers"),
            ("rows: 3", "rows: x", "`rows`"),
            ("rows: 3", "rows: 99999999999", "too large"),
            ("   cols: 1\n", "", "`cols` is missing"),
            ("0.,", "zero,", "`zero`"),
            ("0.,", ".Nan,", "`.Nan`"),
            ("3.5 ]", "3.5", "no [ ... ]"),
            ("dt: d", "dt: \"2d\"", "2d"),
        ] {
            let error = parse(&GOOD.replace(from, to)).unwrap_err();
            assert!(error.contains(word) && error.contains("line 6") && error.contains('T'), "{error}");
        }
        assert!(parse("<?xml version=\"1.0\"?>").unwrap_err().contains("XML"));
    }

    proptest! {
        #[test]
        fn no_text_makes_it_panic(text in any::<String>()) {
            let _ = parse(&text);
        }

        #[test]
        fn no_broken_file_makes_it_panic(cut in 0..GOOD.len(), at in 0..GOOD.len(), put in "[\\[\\]:,!.0-9eé\n -]{0,6}") {
            let mut text = GOOD.to_string();
            text.insert_str(at, &put);
            let cut = (0..=cut).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0);
            if let Ok(storage) = parse(&text[..cut]) {
                prop_assert!(storage.matrices.values().all(|m| m.data.len() == m.rows * m.cols));
            }
        }
    }
}
