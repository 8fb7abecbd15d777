//! Shape and pose of the statistical body from a scan, weights onto scans, measurements, posing under clothes.
//!
//! - [`fit_body`]: shape and pose of one scan (Hu et al. 2017, eq. 4), conformation, stature and girths;
//! - [`rig_scan`], [`rigged_scan`]: skin weights onto the scan itself;
//! - [`pose_under`]: any skinned mesh posed inside a more dressed scan (eq. 5 and 6);
//! - [`settle_under`]: the body in that pose, hands turned to the scan, drawn inside it;
//! - [`measure()`]: stature and girths of a body at rest; [`measure_table`]: all measures by ISO 8559-1.
//!
//! A fit that should not be trusted is a result with a [`Verdict`]; having no answer is a [`FittingError`].

mod arms;
mod articulated;
mod body_fit;
mod cloud;
mod conform;
mod contain;
mod correspond;
mod equations;
mod error;
mod fingers;
mod landmarks;
mod level;
mod mapping;
pub mod measure;
mod point_tree;
mod prepare;
mod prior;
mod rig;
mod section;
mod settings;
mod settle;
mod stance;
mod start;
mod summary;
mod tape;
mod thin;
mod uncross;
mod under;
mod under_stage;
mod verdict;

pub use body_fit::{BodyFit, fit_body};
pub use error::FittingError;
pub use landmarks::ScanLandmark;
pub use measure::{Measurements, measure};
pub use prepare::Mend;
pub use rig::{rig_scan, rigged_scan};
pub use settings::{ConformSettings, FitSettings, HandLandmarks, UnderSettings};
pub use settle::{SettleReport, SettledBody, settle_under};
pub use summary::{BodySummary, Theta};
pub use tape::{BodyLandmark, BodyMeasure, MeasureKind, MeasureTable, measure_table};
pub use under::{UnderFit, UnderReport, pose_under};
pub use verdict::{DistanceStats, FitReport, Verdict};
