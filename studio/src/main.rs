//! The `toile` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(toile_studio::run(std::env::args_os()) as u8)
}
