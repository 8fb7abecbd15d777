//! Shape and pose of the statistical body from a scan, weights onto scans, measurements, posing under clothes.
//!
//! - [`fit_body`]: shape and pose of one scan (Hu et al. 2017, eq. 4), conformation, stature and girths;
//! - [`take_on_bare_skin`]: the body of somebody dressed takes on the skin that is bare;
//! - [`find_upright`]: which way up a scan is;
//! - [`rig_scan`], [`rigged_scan`]: skin weights onto the scan itself;
//! - [`pose_under`]: any skinned mesh posed inside a more dressed scan (eq. 5 and 6);
//! - [`pose_as_worn`]: which of several takes a scan shows again;
//! - [`settle_under`]: the body in that pose, hands turned to the scan, drawn inside it;
//! - [`ShapeSearch`]: a body by its measures, without a scan;
//! - [`measure_table`]: the measurements of ISO 8559-1; [`measure_extremes`]: stature and the girths that bodies are scored by.
//!
//! A fit that should not be trusted is a result with a [`Verdict`]; having no answer is a [`FittingError`].

mod by_measures;
mod conform;
mod error;
mod fit;
mod measure;
mod rig;
mod settings;
mod solve;
mod stance;
mod summary;
mod surface;
mod under;

pub use {
    by_measures::{ALIASES, Conflict, Reached, ShapeSearch, Shaped, Start, Wanted, shape_either},
    conform::ScanLandmark,
    error::FittingError,
    fit::{BodyFit, DistanceStats, FitReport, Mend, PartShown, Verdict, find_upright, fit_body, take_on_bare_skin},
    measure::{
        definition::MeasureKind,
        extremes::{Girth, Measurements, measure_extremes, stature},
        table::{BodyLandmark, MeasureTable, measure_table},
        taken::BodyMeasure,
        uncertainty::{ErrorModel, ErrorModels, sideless},
    },
    rig::{rig_scan, rigged_scan},
    settings::{ConformSettings, FitSettings, HandLandmarks, LandmarkMap, Method, UnderSettings},
    summary::{BodySummary, Theta},
    under::{SettleReport, SettledBody, UnderFit, UnderReport, pose_as_worn, pose_under, settle_under},
};
