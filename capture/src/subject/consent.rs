//! What a person agreed to: fields of `subject.toml` that say whether, and until when, the subject may be processed and kept.

use serde::{Deserialize, Deserializer, Serialize, de::Error};
use toml::Value;

/// The person's word, and dates after which nothing may be done.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(super) struct Consent {
    /// `given` or `withdrawn`; `None` where nobody said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    consent: Option<Word>,
    /// The last day on which the subject may be processed, `YYYY-MM-DD`.
    #[serde(default, deserialize_with = "date", skip_serializing_if = "Option::is_none")]
    consent_until: Option<String>,
    /// The last day on which the subject may be kept.
    #[serde(default, deserialize_with = "date", skip_serializing_if = "Option::is_none")]
    retain_until: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Word {
    Given,
    Withdrawn,
}

impl Consent {
    /// Why the subject may not be processed on the day `today`; `None` where it may.
    pub(super) fn withheld(&self, today: &str) -> Option<String> {
        let past = |until: &Option<String>| until.clone().filter(|until| until.as_str() < today);
        if self.consent == Some(Word::Withdrawn) {
            return Some("consent was withdrawn".into());
        }
        if let Some(until) = past(&self.consent_until) {
            return Some(format!("consent ended with {until}"));
        }
        self.overdue(today).map(|until| format!("it was to be kept until {until}"))
    }

    /// Until when the subject was to be kept, where that is before `today`.
    pub(super) fn overdue(&self, today: &str) -> Option<String> {
        self.retain_until.clone().filter(|until| until.as_str() < today)
    }
}

/// A date as text or as TOML's own.
fn date<'de, D: Deserializer<'de>>(from: D) -> Result<Option<String>, D::Error> {
    let text = match Value::deserialize(from)? {
        Value::String(text) => text,
        Value::Datetime(date) => date.to_string(),
        other => other.to_string(),
    };
    if is_date(&text) {
        Ok(Some(text))
    } else {
        Err(D::Error::custom(format!("`{text}` is not a date such as 2027-05-31")))
    }
}

fn is_date(text: &str) -> bool {
    let parts: Vec<&str> = text.split('-').collect();
    let number = |part: &str, digits: usize| part.len() == digits && part.bytes().all(|b| b.is_ascii_digit());
    let within = |part: &str, most: u32| part.parse().is_ok_and(|n: u32| (1..=most).contains(&n));
    matches!(parts[..], [year, month, day]
        if number(year, 4) && number(month, 2) && number(day, 2) && within(month, 12) && within(day, 31))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Consent, String> {
        toml::from_str(text).map_err(|error| error.message().to_string())
    }

    #[test]
    fn the_last_day_counts_and_the_next_does_not() {
        let consent = parse("consent = \"given\"\nconsent_until = \"2027-05-31\"\nretain_until = 2028-01-01").unwrap();
        assert_eq!(consent.withheld("2027-05-31"), None);
        assert!(consent.withheld("2027-06-01").unwrap().contains("2027-05-31"));
        assert_eq!((consent.overdue("2028-01-01"), consent.overdue("2028-01-02")), (None, Some("2028-01-01".into())));
        assert!(parse("consent = \"withdrawn\"").unwrap().withheld("1990-01-01").is_some());
        assert_eq!(parse("").unwrap().withheld("9999-12-31"), None);
    }

    #[test]
    fn what_is_no_date_is_refused() {
        for text in ["31.5.2027", "2027-13-01", "2027-5-1", "soon", "2027-05-31T10:00:00"] {
            assert!(parse(&format!("retain_until = \"{text}\"")).unwrap_err().contains("not a date"), "{text}");
        }
        assert!(parse("consent = \"maybe\"").is_err() && parse("consent_until = 7").is_err());
    }
}
