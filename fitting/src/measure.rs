//! How large a body is: the measurements of ISO 8559-1, and the extremes by which bodies are scored.
//!
//! - `table`: all measurements by the standard's definitions, on the body standing straight;
//! - `extremes`: stature, and girths that are extremes within shares of the stature;
//! - `standing`: the body standing straight with its landmarks; `parts`: which triangles a tape may touch;
//!   `section`: plane sections and tapes; `levels`: heights that are found on the person's own surface;
//! - `head`, `trunk`, `arm`, `leg`: each measurement beside its definition;
//! - `uncertainty`: how far a value may be off; `plausible`: whether the values go together as they do among people.
//!
//! `docs/measurements.md` has the same definitions for readers, with the deviations from the standard.

mod arm;
pub(crate) mod definition;
pub(crate) mod extremes;
mod head;
mod leg;
mod levels;
mod parts;
mod plausible;
mod section;
mod standing;
pub(crate) mod table;
pub(crate) mod taken;
mod trunk;
pub(crate) mod uncertainty;
