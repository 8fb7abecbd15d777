//! The stages on disk: from recorded takes to a dressed avatar and its report.
//!
//! No algorithm lives here, and nothing of a command line. The stages' crates take values and return values; this crate
//! reads what they need from a subject's folder, hands it over, and writes what they give back, whole or not at all:
//!
//! - [`process()`]: all stages in their order, up to a [`Goal`];
//! - [`steps`]: the stages, each a [`Step`]: the files it reads and writes, the settings that decide its result, and the one call into the
//!   stage's crate;
//! - [`Record`]: the content of `report.json` for a step; a step is skipped while its record holds;
//! - [`Settings`]: of all stages, from `toile.toml`;
//! - [`Run`]: one run over one subject; [`Folders`]: where its files lie;
//! - [`plan()`]: what a run would have to do, from the [`Ticket`] that the last one left, without reading a take;
//! - [`Observer`]: the receiver of a run's progress; [`Account`]: how far it is by that, and how long it will take.
//!
//! A run can stop anywhere and go on later with the same result.

mod account;
mod animate;
mod asked;
mod avatar_choice;
mod body_edits;
mod body_file;
mod built;
mod error;
mod exchange;
mod folders;
mod formats;
mod garment;
mod hash;
pub mod json;
mod layer_files;
mod levels;
mod look;
mod memory;
mod meshes;
pub mod motion;
mod observer;
mod opened;
mod options;
mod outfit;
mod plan;
mod process;
mod record;
mod report;
mod resume;
mod rigged_scan;
mod run;
mod scan_survey;
mod scan_texture;
mod sculpt;
mod sculpt_file;
pub mod settings;
mod shape;
mod skin_colors;
mod stale;
mod step;
pub mod steps;
mod summary;
mod take_order;
mod template_atlas;
mod ticket;
mod wear;
mod worn;

pub use account::Account;
pub use animate::{AnimateOptions, Animated, AnimationReport, Profile, animate};
pub use asked::Asked;
pub use body_edits::BodyEdits;
pub use body_file::Body;
pub use built::{Built, built, is_up_to_date};
pub use error::{Cause, PipelineError};
pub use folders::Folders;
pub use formats::FileFormat;
pub use hash::{bytes as hash_bytes, file as hash_file};
pub use levels::{FEWEST as FEWEST_TRIANGLES, LEVELS};
pub use meshes::read_mesh;
pub use motion::walk_length;
pub use observer::{Observer, Silent};
pub use opened::Opened;
pub use options::{FusionChoice, Goal, HiddenChoice, MotionChoice, Options, Springs};
pub use plan::{Plan, Standing, plan};
pub use process::process;
pub use record::{Record, steps_in};
pub use resume::run_step;
pub use run::Run;
pub use scan_survey::ScanSurvey;
pub use sculpt::{Sculpted, sculpt};
pub use sculpt_file::{PoseChoice, SculptFile};
pub use settings::Settings;
pub use shape::{SHAPE_FILES, ShapeOptions, ShapedAvatar, shape};
pub use step::{Product, Remarks, Step};
pub use summary::{Decided, Measured, Summary, TakeSummary};
pub use ticket::Ticket;
pub use toile_animation::blend::Blend;
pub use wear::{Dressed, WearOptions, put_on, take_off};
pub use worn::{Place, WornFile, WornGarment, listed as listed_worn};
