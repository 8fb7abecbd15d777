//! Writes the rule where udev reads it.

use std::path::{Path, PathBuf};

use super::rule::{RULE_FILE, rules};
use crate::TransportError;

/// Writes the rule, also for the vendors of cameras that are `plugged` in, into `folder` and returns the file.
///
/// # Errors
/// [`TransportError::Rule`] where the folder cannot be written.
pub fn install(folder: &Path, plugged: &[u16]) -> Result<PathBuf, TransportError> {
    let path = folder.join(RULE_FILE);
    std::fs::write(&path, rules(plugged)).map_err(|source| TransportError::Rule { path: path.clone(), source })?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        udev::{RULES_FOLDER, advice, rule::rule},
        usb::known,
    };

    #[test]
    fn every_vendor_has_a_usb_and_a_video_rule() {
        let text = rules(&[]);
        for vendor in known::vendors() {
            let lines = text.lines().filter(|l| l.contains(&format!("\"{vendor:04x}\""))).count();
            assert_eq!(lines, 2);
        }
    }

    #[test]
    fn the_installed_file_is_the_rule_and_a_refusal_prints_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = install(folder.path(), &[0x32e4]).unwrap();
        assert_eq!(
            (path.file_name().unwrap().to_str(), std::fs::read_to_string(&path).unwrap()),
            (Some(RULE_FILE), rules(&[0x32e4]))
        );
        assert!(rules(&[0x32e4]).contains("32e4") && !rules(&[]).contains("32e4"));
        assert!(advice(0).contains("group") && !advice(0).contains("0000"));
        let device = crate::DeviceInfo {
            vendor: 0x045e,
            product: 0x02ae,
            release: 0,
            address: (1, 7),
            hub: Vec::new(),
            speed: crate::LinkSpeed::High,
        };
        let words = TransportError::NoPermission { device }.to_string();
        assert!(words.contains("no permission") && words.contains("toile devices --install-udev-rules"), "{words}");
        assert!(words.contains(rule(0x045e).trim_end()) && words.contains(RULES_FOLDER), "{words}");
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let error = install(Path::new("no/such/folder"), &[]).unwrap_err().to_string();
        assert!(error.contains("no/such/folder") && error.contains("root"), "{error}");
    }
}
