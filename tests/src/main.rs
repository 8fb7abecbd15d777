//! The same program as `toile`, built with the tests so that they can run it.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(toile_studio::run(std::env::args_os()) as u8)
}
