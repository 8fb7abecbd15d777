//! The text of the rule, and what to do where a camera may not be opened.

use std::collections::BTreeSet;

use crate::usb::known;

/// Name of the rule file; below 73 so that `uaccess` takes effect.
pub const RULE_FILE: &str = "60-toile.rules";

/// Where rules of the local administrator belong.
pub const RULES_FOLDER: &str = "/etc/udev/rules.d";

/// Text of the rule for every known vendor and those of cameras that are `plugged` in: USB nodes and their video nodes.
pub fn rules(plugged: &[u16]) -> String {
    let mut text = String::from("# Depth cameras that Toile uses; gives the user at the seat access.\n");
    let vendors: BTreeSet<u16> = known::vendors().into_iter().chain(plugged.iter().copied()).collect();
    vendors.into_iter().for_each(|vendor| text.push_str(&rule(vendor)));
    text
}

/// Advice where a vendor's camera may not be opened: the exact rule, and how to install it; for a camera that is not
/// on USB (vendor 0) the group.
pub fn advice(vendor: u16) -> String {
    if vendor == 0 {
        return "It is on no USB device that a rule could name: add yourself to the group of its node \
                (`sudo usermod -aG video $USER`), then log in again."
            .into();
    }
    format!(
        "Run `sudo toile devices --install-udev-rules`, which writes {RULES_FOLDER}/{RULE_FILE}, then plug it in again. \
         The rule:\n{}",
        rule(vendor).trim_end()
    )
}

pub(super) fn rule(vendor: u16) -> String {
    format!(
        "SUBSYSTEM==\"usb\", ATTRS{{idVendor}}==\"{vendor:04x}\", MODE=\"0660\", TAG+=\"uaccess\"\n\
         SUBSYSTEM==\"video4linux\", ATTRS{{idVendor}}==\"{vendor:04x}\", MODE=\"0660\", TAG+=\"uaccess\"\n"
    )
}
