//! Facts about a garment: its type and the thickness of its cloth.

use std::path::PathBuf;

use serde::Serialize;
use toile_garments::{ExtractionReport, GarmentType, cloth_thickness};

use crate::{Folders, PipelineError, Run};

/// No cloth is taken for thicker, millimetres: stacking looks twice as far for the layers below.
pub const THICKEST_MM: f32 = 10.0;

/// Folder name of a first take that was imported as the body, and the name of the clothes that it turned out to show.
const BODY_TAKE: &str = "00-body";
const CLOTHES: &str = "00-clothes";

/// A garment of the avatar.
#[derive(Debug, Clone, Serialize)]
pub struct Garment {
    /// Number of the take that added it; none where it was put on from elsewhere.
    pub number: Option<usize>,
    /// Its type: as `subject.toml` says, else guessed.
    #[serde(serialize_with = "as_text")]
    pub garment_type: GarmentType,
    /// Thickness of its cloth, metres: as `subject.toml` says (`thickness_mm`), else what is common for its type.
    pub thickness: f32,
    /// Folder name of its take.
    #[serde(skip)]
    pub layer: String,
    /// Its name in the avatar and the report: the folder's, but for the clothes of a first take that is called `body`.
    #[serde(skip)]
    pub name: String,
    /// Whether a generic garment stands for it.
    #[serde(skip)]
    pub is_generic: bool,
}

impl Garment {
    /// The garment that was cut out of take `number` (0 where the first take is dressed).
    ///
    /// # Errors
    /// [`PipelineError`] where `subject.toml` gives a thickness that no cloth has.
    pub fn new(run: &Run, number: usize, cut: &ExtractionReport) -> Result<Self, PipelineError> {
        let garment_type = run.garment_type(number).unwrap_or(cut.garment_type);
        let thickness = given_thickness(run, number)?.unwrap_or_else(|| cloth_thickness(garment_type));
        let layer = run.layers[number].clone();
        let name = if layer == BODY_TAKE { CLOTHES.into() } else { layer.clone() };
        Ok(Self { number: Some(number), garment_type, thickness, layer, name, is_generic: false })
    }
}

impl Garment {
    /// Its mesh before stacking.
    pub fn unstacked(&self, folders: &Folders) -> PathBuf {
        if self.is_generic { folders.generic(&self.layer) } else { folders.unstacked(&self.layer) }
    }
}

/// Thickness of the cloth of take `number`'s garment, as `subject.toml` gives it, metres.
///
/// # Errors
/// [`PipelineError`] where no cloth is that thick.
pub fn given_thickness(run: &Run, number: usize) -> Result<Option<f32>, PipelineError> {
    match run.thickness_mm(number) {
        Some(mm) if !(0.0..=THICKEST_MM).contains(&mm) => {
            let field = format!("layers[{number}].thickness_mm");
            let reason = format!("{mm} is not between 0 and {THICKEST_MM} millimetres ({})", run.layers[number]);
            Err(PipelineError::field(&run.folders.subject_toml(), &field, reason))
        }
        given => Ok(given.map(|mm| mm * 1e-3)),
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes what it serialises by reference")]
fn as_text<S: serde::Serializer>(garment_type: &GarmentType, to: S) -> Result<S::Ok, S::Error> {
    to.collect_str(garment_type)
}
