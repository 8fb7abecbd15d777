//! The udev rule that lets a logged-in user open the cameras.

mod install;
mod rule;

pub use install::install;
pub use rule::{RULE_FILE, RULES_FOLDER, advice, rules};
