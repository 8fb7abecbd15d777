//! Reading settings: files that name what is wrong by field and line, and values in their ranges.

use std::{ops::Range, path::Path};

use serde_json::Value;
use toile_capture::files::{is_there, read_text};
use toml::{
    Spanned, Table,
    de::{DeTable, DeValue, Error},
};

use super::{Settings, fields::FIELDS};
use crate::{PipelineError, json};

/// Name of the file in a subject's folder.
pub const FILE_NAME: &str = "toile.toml";

/// The settings for a subject: the defaults, changed by `toile.toml` in its folder, changed by `file`.
///
/// # Errors
/// [`PipelineError::Format`] with file and field (and the line) where a field is unknown, of the wrong kind or out of its
/// range.
pub fn read(subject: Option<&Path>, file: Option<&Path>) -> Result<Settings, PipelineError> {
    let own = subject.map(|folder| folder.join(FILE_NAME)).filter(|path| is_there(path));
    let mut all = Table::new();
    for path in own.as_deref().into_iter().chain(file) {
        let text = read_text(path)?;
        let settings: Settings = toml::from_str(&text).map_err(|e| wrong(path, &text, &e))?;
        check(path, &settings)?;
        check_finite(path, &text)?;
        merge(&mut all, toml::from_str(&text).map_err(|e| wrong(path, &text, &e))?);
    }
    // Each file was read alone before, so this cannot fail on a field of one of them.
    Table::try_into(all).map_err(|e: Error| PipelineError::format(Path::new(FILE_NAME), e.message()))
}

fn merge(into: &mut Table, from: Table) {
    for (key, value) in from {
        match (into.get_mut(&key), value) {
            (Some(toml::Value::Table(old)), toml::Value::Table(new)) => merge(old, new),
            (_, value) => drop(into.insert(key, value)),
        }
    }
}

/// Refuses numbers outside their ranges.
fn check(path: &Path, settings: &Settings) -> Result<(), PipelineError> {
    let settings = json::plain(settings)?;
    for field in FIELDS {
        let Some([least, most]) = field.range else { continue };
        let found = field.key.split('.').fold(&settings, |value, part| &value[part]);
        if found.as_f64().is_some_and(|x| !(least..=most).contains(&x)) {
            let unit = if field.unit.is_empty() { String::new() } else { format!(" {}", field.unit) };
            return Err(PipelineError::field(
                path,
                field.key,
                format!("{found} is not between {least} and {most}{unit}"),
            ));
        }
    }
    Ok(())
}

/// Refuses `nan` and `inf`, which no range holds.
fn check_finite(path: &Path, text: &str) -> Result<(), PipelineError> {
    // What is not TOML was refused before.
    let Ok(table) = DeTable::parse(text) else { return Ok(()) };
    let mut values: Vec<&Spanned<DeValue>> = table.get_ref().values().collect();
    while let Some(value) = values.pop() {
        match value.get_ref() {
            DeValue::Float(float) if float.as_str().parse::<f64>().is_ok_and(|x| !x.is_finite()) => {
                let line = line_at(text, value.span().start);
                let reason = format!("line {line}: {float} is not a number that can be used");
                return Err(PipelineError::field(path, &field_at(text, &value.span()), reason));
            }
            DeValue::Array(list) => values.extend(list.iter()),
            DeValue::Table(table) => values.extend(table.values()),
            _ => {}
        }
    }
    Ok(())
}

fn line_at(text: &str, at: usize) -> usize {
    1 + text[..at.min(text.len())].matches('\n').count()
}

fn wrong(path: &Path, text: &str, error: &Error) -> PipelineError {
    let Some(span) = error.span() else { return PipelineError::format(path, error.message()) };
    let line = line_at(text, span.start);
    let reason = format!("line {line}: {}", error.message().replace('\n', "; "));
    PipelineError::field(path, &field_at(text, &span), reason)
}

/// The field whose key or value lies at `span`: the table above it, and the key of its line.
fn field_at(text: &str, span: &Range<usize>) -> String {
    let start = text[..span.start].rfind('\n').map_or(0, |at| at + 1);
    let line = text[start..].lines().next().unwrap_or_default().trim();
    let table = |line: &str| line.strip_prefix('[').and_then(|l| l.split(']').next()).map(|t| t.trim().to_string());
    let above = text[..start].lines().rev().find_map(|l| table(l.trim()));
    if let Some(own) = table(line) {
        own
    } else {
        let key = line.split('=').next().unwrap_or_default().trim();
        above.into_iter().chain([key.to_string()]).filter(|part| !part.is_empty()).collect::<Vec<_>>().join(".")
    }
}

/// A value of the settings by its key, such as `fusion.voxel_size`.
pub(super) fn value_at<'a>(settings: &'a Value, key: &str) -> Option<&'a Value> {
    key.split('.').try_fold(settings, |value, part| value.get(part))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn read_one(text: &str) -> Result<Settings, PipelineError> {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join(FILE_NAME), text).unwrap();
        read(Some(dir.path()), None)
    }

    #[test]
    fn a_file_for_the_run_wins_over_the_subject_s_own_field_by_field() {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(read(Some(dir.path()), None).unwrap(), Settings::default());
        fs::write(dir.path().join(FILE_NAME), "[fusion]\nvoxel_size = 0.005\nmax_depth = 4\n").unwrap();
        let other = dir.path().join("other.toml");
        fs::write(&other, "[fusion]\nvoxel_size = 0.006\n[fit.conformation]\nrounds = 2\n").unwrap();
        let settings = read(Some(dir.path()), Some(&other)).unwrap();
        assert_eq!((settings.fusion.voxel_size, settings.fusion.max_depth), (0.006, 4.0));
        assert_eq!(settings.fit.conformation.rounds, 2);
        assert_eq!(settings.stack, Settings::default().stack);
    }

    #[test]
    fn what_is_wrong_is_named_by_field_and_line() {
        for (text, field, words) in [
            ("[fusion]\n\nvoxels = 1\n", "fusion.voxels", "line 3: unknown field `voxels`"),
            ("[fusio]\n", "fusio", "line 1: unknown field `fusio`"),
            ("[stack]\ngap = \"wide\"\n", "stack.gap", "line 2: invalid type"),
            ("[fit.conformation]\nreach = true\n", "fit.conformation.reach", "line 2"),
            ("[extract]\nrounds = -1\n", "extract.rounds", "line 2"),
            ("[motion]\nloop = true\n", "motion.loop", "unknown field `loop`"),
            ("[under_clothes]\nheading = 3\n", "under_clothes.heading", "unknown field"),
            ("[fusion]\nvoxel_size = nan\n", "fusion.voxel_size", "line 2: nan is not a number"),
            ("[fusion]\n\nmax_depth = -inf\n", "fusion.max_depth", "line 3: -inf is not a number"),
            ("[fusion]\nvoxel_size = 4\n", "fusion.voxel_size", "4.0 is not between 0.0005 and 0.05 metres"),
        ] {
            let error = read_one(text).unwrap_err();
            assert!(error.file().is_some_and(|f| f.ends_with(FILE_NAME)), "{error}");
            assert_eq!(error.field_name(), Some(field), "{error}");
            assert!(error.to_string().contains(words), "{error}");
        }
        assert!(read_one("[fusion\n").is_err());
        let dir = tempfile::tempdir().unwrap();
        std::os::unix::fs::symlink("gone", dir.path().join(FILE_NAME)).unwrap();
        assert!(read(Some(dir.path()), None).unwrap_err().to_string().contains(FILE_NAME), "a link that leads nowhere");
    }
}
