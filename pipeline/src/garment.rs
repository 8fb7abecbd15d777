//! What is known of a garment: its type and how thick its cloth is.

use toile_garments::{GarmentType, cloth_thickness};

use crate::{PipelineError, Run, body_file::read_json};

/// No cloth is taken for thicker, millimetres: stacking looks twice as far for the layers below.
const THICKEST_MM: f32 = 10.0;

/// The told type of take `n`'s garment, else the one that the stage `cut` guessed.
pub fn garment_type(run: &Run, n: usize) -> Option<GarmentType> {
    run.garment_type(n).or_else(|| {
        let report: serde_json::Value = read_json(&run.folders.layer(&run.layers[n]).join("report.json")).ok()?;
        report["stages"]["cut"]["result"]["garment_type"].as_str()?.parse().ok()
    })
}

/// Thickness of the cloth of take `n`'s garment, metres: what `subject.toml` says (`thickness_mm`), else what is common
/// for its type.
///
/// # Errors
/// [`PipelineError`] where `subject.toml` tells no thickness of cloth.
pub fn thickness(run: &Run, n: usize) -> Result<f32, PipelineError> {
    let told = told_thickness(run, n)?;
    Ok(told.unwrap_or_else(|| cloth_thickness(garment_type(run, n).unwrap_or(GarmentType::Other))))
}

/// What `subject.toml` says of the thickness of the cloth of take `n`'s garment, metres.
///
/// # Errors
/// As [`thickness`].
pub fn told_thickness(run: &Run, n: usize) -> Result<Option<f32>, PipelineError> {
    match run.thickness_mm(n) {
        Some(mm) if !(0.0..=THICKEST_MM).contains(&mm) => {
            let layer = &run.layers[n];
            let reason = format!("{layer}: thickness_mm = {mm} is not between 0 and {THICKEST_MM}");
            Err(PipelineError::format(&run.folders.root.join("subject.toml"), reason))
        }
        told => Ok(told.map(|mm| mm * 1e-3)),
    }
}
