//! `--prior`: the assumption about the motion between frames.

use toile_fusion::Prior;

/// The assumption about the motion between frames.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
pub enum PriorChoice {
    /// The person turns evenly before a resting camera.
    Turntable,
    /// A camera held by hand.
    None,
}

impl From<PriorChoice> for Prior {
    fn from(choice: PriorChoice) -> Self {
        match choice {
            PriorChoice::Turntable => Self::Turntable,
            PriorChoice::None => Self::None,
        }
    }
}
