//! Requirements of tests from outside the project: data that may not be given away, and other people's programs.
//!
//! Where it is missing a test passes, after it has said so on standard error; with `TOILE_REQUIRE_OUTSIDE=1`, which
//! continuous integration sets where everything is at hand, it fails instead. So a test can never turn green on a machine
//! that was meant to run it.
//!
//! ```
//! let Some(shell) = toile_outside::program("sh") else {
//!     return; // said, or failed
//! };
//! ```

use std::{
    env,
    path::{Path, PathBuf},
};

/// Set to `1` where whatever is missing is a failure.
pub const REQUIRE: &str = "TOILE_REQUIRE_OUTSIDE";
/// Names the folder of the test data; without, it is `shared/data` beside the project's folder.
pub const DATA: &str = "TOILE_OUTSIDE_DATA";

/// A file or folder of the test data, such as `subjects/somebody`.
///
/// # Panics
/// Where it is missing, and [`REQUIRE`] is set.
pub fn data(name: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let path = env::var_os(DATA).map_or(beside, PathBuf::from).join(name);
    found(path.exists(), &format!("the test data `{name}` ({})", path.display())).then_some(path)
}

/// A program in the search path.
///
/// # Panics
/// As [`data`].
pub fn program(name: &str) -> Option<PathBuf> {
    let folders = env::var_os("PATH").unwrap_or_default();
    let path = env::split_paths(&folders).map(|folder| folder.join(name)).find(|path| path.is_file());
    found(path.is_some(), &format!("the program `{name}`")).then_some(path).flatten()
}

/// Any other file that a step of `make test` provides.
///
/// # Panics
/// As [`data`].
pub fn file(path: &Path) -> Option<PathBuf> {
    found(path.exists(), &path.display().to_string()).then(|| path.to_path_buf())
}

/// Something that the machine itself may lack, such as USB in its kernel: true where `is_there` holds. Nobody can put it
/// there, so that it is said, but never a failure.
pub fn capability(is_there: bool, what: &str) -> bool {
    if !is_there {
        eprintln!("not tested: this machine lacks {what}");
    }
    is_there
}

/// True where it is there; says or fails where it is not.
fn found(is_there: bool, what: &str) -> bool {
    let is_required = env::var(REQUIRE).is_ok_and(|value| value == "1");
    assert!(is_there || !is_required, "{what} is missing, and {REQUIRE}=1 asks for it");
    if !is_there {
        eprintln!("not tested: {what} is missing (with {REQUIRE}=1 this is a failure)");
    }
    is_there
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_there_is_found() {
        assert!(program("sh").is_some_and(|path| path.ends_with("sh")));
        assert!(file(Path::new(env!("CARGO_MANIFEST_DIR"))).is_some());
    }

    #[test]
    fn what_is_missing_fails_where_it_is_required() {
        let is_required = env::var(REQUIRE).is_ok_and(|value| value == "1");
        let missing = std::panic::catch_unwind(|| data("no/such/data"));
        assert_eq!(missing.is_err(), is_required);
        assert!(missing.is_err() || missing.is_ok_and(|path| path.is_none()));
    }
}
