//! Names of subjects in an archive: names of folders that cannot lead anywhere else.

use crate::error::Refusal;

/// Longest name of a subject's folder.
const LONGEST: usize = 64;

/// The name of a subject's folder: letters, digits, `.`, `_` and `-`, and no dot at the beginning.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SubjectId(String);

impl SubjectId {
    /// Checks a name.
    ///
    /// # Errors
    /// 404: no subject can be called so.
    pub fn new(name: &str) -> Result<Self, Refusal> {
        if Self::is_valid(name) {
            return Ok(Self(name.to_string()));
        }
        Err(Refusal::missing("there is no such subject; names of subjects have letters, digits, `.`, `_` and `-`"))
    }

    /// True where a folder of that name can be a subject.
    pub fn is_valid(name: &str) -> bool {
        let is_fine = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
        !name.is_empty() && name.len() <= LONGEST && !name.starts_with('.') && name.bytes().all(is_fine)
    }

    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_lead_elsewhere_are_no_subjects() {
        for name in ["anna", "anna-2", "a.b_c", "007"] {
            assert_eq!(SubjectId::new(name).unwrap().as_str(), name);
        }
        let long = "a".repeat(65);
        for name in ["", ".", "..", ".toile", "a/b", "a\\b", "a b", "\u{e4}", "a\0", "%2e%2e", "~", &long] {
            assert!(SubjectId::new(name).is_err(), "{name:?}");
        }
    }
}
