//! Given to every command.

use std::sync::Arc;

use clap::Args;

use crate::progress::Progress;

/// The options of every command.
#[derive(Debug, Clone, Args)]
pub struct Globals {
    /// Processor threads to use (0: as many as the machine has). The result is the same for any number
    #[arg(long, global = true, default_value_t = 0, value_name = "N")]
    pub threads: usize,
    /// Print one JSON document with the results (or the error) instead of text
    #[arg(long, global = true)]
    pub json: bool,
    /// No progress, no warnings on standard error
    #[arg(long, short, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say more (-vv: everything)
    #[arg(long, short, global = true, action = clap::ArgAction::Count)]
    pub verbose: u8,
}

/// Given to every command.
pub struct Session {
    /// The options that every command takes.
    pub globals: Globals,
    /// Where progress is shown.
    pub progress: Arc<Progress>,
}
