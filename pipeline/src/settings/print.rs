//! Settings as a file that can be read again: unit, range and default of each beside it.

use serde_json::Value;

use super::{Settings, fields::FIELDS, read::value_at};
use crate::{PipelineError, json};

/// The whole file: a table for each stage, and for each field what it does, its unit, range and default, and the value
/// that `settings` give it.
///
/// # Errors
/// [`PipelineError::Json`] where a value cannot be written.
pub fn print(settings: &Settings) -> Result<String, PipelineError> {
    let (values, defaults) = (json::plain(settings)?, json::plain(&Settings::default())?);
    let mut text = String::from(
        "# Settings of Toile. A subject's own lie in SUBJECT/toile.toml; --settings FILE wins over them.\n\
         # Fields that are left out have their defaults.\n",
    );
    let mut table = "";
    for field in FIELDS {
        let (at, name) = field.key.rsplit_once('.').unwrap_or(("", field.key));
        if at != table {
            text.push_str(&format!("\n[{at}]\n"));
            table = at;
        }
        let (Some(value), Some(default)) = (value_at(&values, field.key), value_at(&defaults, field.key)) else {
            continue;
        };
        text.push_str(&format!("# {}\n# {}\n", field.about, facts(field, default)));
        // What has no value (known poses, landmarks) is set by other means.
        match in_toml(value) {
            Some(value) => text.push_str(&format!("{name} = {value}\n")),
            None => text.push_str(&format!("# {name} =\n")),
        }
    }
    Ok(text)
}

/// Unit, range or choices, and default.
fn facts(field: &super::fields::Field, default: &Value) -> String {
    let unit = (!field.unit.is_empty()).then(|| field.unit.to_string());
    let range = field.range.map(|[least, most]| format!("{least} to {most}"));
    let choices = (!field.choices.is_empty()).then(|| format!("one of {}", field.choices.join(", ")));
    let default = in_toml(default).unwrap_or_else(|| "none".into());
    [unit, range, choices, Some(format!("default {default}"))].into_iter().flatten().collect::<Vec<_>>().join("; ")
}

fn in_toml(value: &Value) -> Option<String> {
    match value {
        Value::Null => None,
        Value::Object(fields) if fields.is_empty() => None,
        other => toml::Value::try_from(other).ok().map(|value| value.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Keys of all values, tables opened.
    fn keys(value: &Value, at: &str) -> Vec<String> {
        match value {
            Value::Object(fields) if !fields.is_empty() => fields
                .iter()
                .flat_map(|(k, v)| keys(v, &if at.is_empty() { k.clone() } else { format!("{at}.{k}") }))
                .collect(),
            _ => vec![at.to_string()],
        }
    }

    #[test]
    fn every_field_is_described_and_every_default_is_in_its_range() {
        let defaults = json::plain(&Settings::default()).unwrap();
        let mut all = keys(&defaults, "");
        let mut described: Vec<String> = FIELDS.iter().map(|f| f.key.to_string()).collect();
        all.sort();
        described.sort();
        assert_eq!(described, all);
        for field in FIELDS {
            let default = value_at(&defaults, field.key).unwrap();
            if let (Some([least, most]), Some(x)) = (field.range, default.as_f64()) {
                assert!((least..=most).contains(&x), "{}: {x}", field.key);
            }
            if let (Some(word), [_, ..]) = (default.as_str(), field.choices) {
                assert!(field.choices.contains(&word), "{}: {word}", field.key);
            }
            assert!(default.as_str().is_none() || !field.choices.is_empty(), "{} has no choices", field.key);
        }
    }

    #[test]
    fn what_is_printed_is_read_back() {
        let mut settings = Settings::default();
        settings.fusion.voxel_size = 0.005;
        let text = print(&settings).unwrap();
        assert!(text.contains("metres; 0.0005 to 0.05; default 0.004\nvoxel_size = 0.005"), "{text}");
        assert_eq!(toml::from_str::<Settings>(&text).unwrap(), settings);
    }
}
