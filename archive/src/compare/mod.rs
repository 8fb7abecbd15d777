//! What another version made different over a whole archive, so that somebody dares to roll it out.

mod keep;
mod page;
mod surfaces;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use rayon::prelude::*;
use serde::Serialize;
use serde_json::Value;
use toile_pipeline::{Folders, json};

use crate::{ArchiveError, find::subjects};

pub use keep::keep;
pub use page::write;
pub use surfaces::SurfaceChange;

/// A measure has to differ by more to be listed, metres: half of what two people who measure the same body differ by
/// (ISO 20685-1 allows 4 to 15 mm).
const MEASURE_TOLD: f64 = 0.002;

/// What became different of a subject.
#[derive(Debug, Clone, Serialize)]
pub struct Change {
    /// Its path in the archive.
    pub subject: PathBuf,
    /// The program that made it before, and now.
    pub programs: [String; 2],
    /// The verdict of the fit before, and now.
    pub verdicts: [String; 2],
    /// From the scan to the fitted body before, and now, millimetres: a proxy of accuracy, since nobody knows the truth.
    pub residuals_mm: [Option<f64>; 2],
    /// The surfaces: body and garments.
    pub surfaces: Vec<SurfaceChange>,
    /// Measures that differ by more than 2 mm: name, before, now, metres.
    pub measures: Vec<(String, f64, f64)>,
    /// Takes and layers that are only in one of both, a sentence each.
    pub only: Vec<String>,
}

impl Change {
    /// By how much it changed: the mean distance of the surface that changed most, millimetres; what is only in one of both
    /// counts as a metre.
    pub fn size(&self) -> f64 {
        let most = self.surfaces.iter().map(|surface| surface.mean_mm).fold(0.0, f64::max);
        most + 1000.0 * self.only.len() as f64
    }

    /// True where nothing at all is different.
    pub fn is_none(&self) -> bool {
        let same = self.surfaces.iter().all(|surface| surface.mean_mm == 0.0 && surface.iou >= 1.0);
        same && self.measures.is_empty() && self.only.is_empty() && self.verdicts[0] == self.verdicts[1]
    }
}

/// Compares the results of an archive with those in `old`: a copy of the archive, or what [`keep()`] kept. Subjects in only one of
/// both are passed over. The largest change comes first.
///
/// # Errors
/// [`ArchiveError`] where the archive cannot be listed, or the two have no subject in common.
pub fn compare(archive: &Path, old: &Path) -> Result<Vec<Change>, ArchiveError> {
    let both: Vec<PathBuf> =
        subjects(archive)?.into_iter().filter(|subject| old.join(subject).join("build").is_dir()).collect();
    if both.is_empty() {
        return Err(ArchiveError::refused(
            old,
            "has no results of a subject of this archive; `toile batch --keep DIR` keeps them",
        ));
    }
    let of = |subject: PathBuf| change(&old.join(&subject), &archive.join(&subject), subject);
    let mut changes = both.into_par_iter().map(of).collect::<Result<Vec<_>, ArchiveError>>()?;
    changes.sort_by(|a, b| b.size().total_cmp(&a.size()).then_with(|| a.subject.cmp(&b.subject)));
    Ok(changes)
}

fn change(before: &Path, now: &Path, subject: PathBuf) -> Result<Change, ArchiveError> {
    let folders = [before, now].map(Folders::new);
    let fits = folders.each_ref().map(|f| json::read::<Value>(&f.body().join("report.json")).unwrap_or_default());
    let fit = |at: usize| &fits[at]["stages"]["fit"]["result"];
    let (surfaces, only) = surfaces::compare(&folders[0], &folders[1])?;
    let word = |value: &Value| value.as_str().unwrap_or("-").to_string();
    Ok(Change {
        subject,
        programs: [word(&fits[0]["program"]), word(&fits[1]["program"])],
        verdicts: [word(&fit(0)["verdict"]), word(&fit(1)["verdict"])],
        residuals_mm: [0, 1].map(|at| fit(at)["scan_to_body"]["mean_mm"].as_f64()),
        surfaces,
        measures: measures(&folders),
        only,
    })
}

fn measures(folders: &[Folders; 2]) -> Vec<(String, f64, f64)> {
    let [before, now] = folders.each_ref().map(|folders| {
        let table: Value = json::read(&folders.measurements()).unwrap_or_default();
        let list = table["measures"].as_array().cloned().unwrap_or_default();
        let value = |measure: Value| Some((measure["name"].as_str()?.to_string(), measure["value_m"].as_f64()?));
        list.into_iter().filter_map(value).collect::<BTreeMap<_, _>>()
    });
    let both = before.into_iter().filter_map(|(name, was)| now.get(&name).map(|is| (name, was, *is)));
    both.filter(|(_, was, is)| (was - is).abs() > MEASURE_TOLD).collect()
}
