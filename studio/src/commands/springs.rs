//! `--springs`: whether loose parts swing in avatar.vrm.

use toile_pipeline::Springs;

/// Springs on the command line.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
pub enum SpringsChoice {
    /// Skirts, dresses and coats swing by spring bones
    On,
    /// Everything follows the skeleton
    Off,
}

impl From<SpringsChoice> for Springs {
    fn from(choice: SpringsChoice) -> Self {
        match choice {
            SpringsChoice::On => Self::On,
            SpringsChoice::Off => Self::Off,
        }
    }
}
