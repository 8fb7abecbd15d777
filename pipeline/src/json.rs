//! JSON as the project reads and writes it: errors name the file and the field, numbers keep their digits.

use std::path::Path;

use serde::{Serialize, de::DeserializeOwned};
use serde_json::Value;
use toile_capture::files::read_limited;

use crate::PipelineError;

/// The largest JSON file that is read, bytes; also of motions, which are text too.
pub(crate) const MAX_BYTES: u64 = 256 << 20;

/// Reads a JSON file.
///
/// # Errors
/// [`PipelineError`] where it is missing, or names the field that is not what it should be.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<T, PipelineError> {
    from_slice(path, &read_limited(path, MAX_BYTES)?)
}

/// The content of the file `path`.
///
/// # Errors
/// [`PipelineError::Format`] with the field that is not what it should be.
pub fn from_slice<T: DeserializeOwned>(path: &Path, bytes: &[u8]) -> Result<T, PipelineError> {
    let mut reader = serde_json::Deserializer::from_slice(bytes);
    let value = serde_path_to_error::deserialize(&mut reader).map_err(|e| named(path, "", &e))?;
    reader.end().map_err(|e| PipelineError::format(path, e))?;
    Ok(value)
}

/// A part of the file `path` that lies under the key `at`.
///
/// # Errors
/// As [`from_slice`].
pub fn from_value<T: DeserializeOwned>(path: &Path, at: &str, value: Value) -> Result<T, PipelineError> {
    serde_path_to_error::deserialize(value).map_err(|e| named(path, at, &e))
}

/// A value as JSON with the shortest digits that give its numbers back (`json!` widens f32 first: 0.10000000149).
///
/// # Errors
/// [`PipelineError::Json`] where a value cannot be written as JSON.
pub fn plain(value: &impl Serialize) -> Result<Value, PipelineError> {
    Ok(serde_json::from_slice(&serde_json::to_vec(value)?)?)
}

/// JSON as the project writes it: indented, keys in a fixed order, a line break at the end.
///
/// # Errors
/// [`PipelineError::Json`] where a value cannot be written as JSON.
pub fn pretty(value: &impl Serialize) -> Result<Vec<u8>, PipelineError> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// The error with the whole way to the field: `at` and then what the reader says.
fn named(path: &Path, at: &str, error: &serde_path_to_error::Error<serde_json::Error>) -> PipelineError {
    let inside = error.path().to_string();
    let way = [at, inside.as_str()].into_iter().filter(|part| !part.is_empty() && *part != ".");
    PipelineError::field(path, &way.collect::<Vec<_>>().join("."), error.inner())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn the_field_that_is_wrong_is_named_with_its_file() {
        let read = |text: &str| from_slice::<BTreeMap<String, Vec<u32>>>(Path::new("a.json"), text.as_bytes());
        let error = read(r#"{"frames": [1, "two"]}"#).unwrap_err();
        assert_eq!((error.file(), error.field_name()), (Some(Path::new("a.json")), Some("frames[1]")));
        assert!(read("{").unwrap_err().to_string().starts_with("a.json: "));
        assert!(read("{} {}").is_err());
        let inside =
            from_value::<Vec<u32>>(Path::new("a.json"), "fit.counts", serde_json::json!([1, "two"])).unwrap_err();
        assert_eq!(inside.field_name(), Some("fit.counts.[1]"));
    }

    #[test]
    fn numbers_keep_their_digits() {
        assert_eq!(plain(&0.1f32).unwrap().to_string(), "0.1");
    }
}
