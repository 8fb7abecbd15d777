//! What to put on, as the command line names it.

use std::path::{Path, PathBuf};

use toile_capture::{Subject, files::is_there, subject::Layer};
use toile_character::{BodyModel, GarmentType};
use toile_garments::ExtractionReport;

use crate::{
    PipelineError, Record,
    body_file::Body,
    folders::Folders,
    meshes::read_skinned,
    record,
    step::Step,
    steps::cut::Cut,
    worn::{Cloth, WornGarment, listed},
};

/// A garment that was found.
pub(super) struct Found {
    pub cloth: Cloth,
    /// In words: `alder/03-jacket`.
    pub source: String,
    /// Its name without a number: `jacket`.
    pub name: String,
    pub garment_type: GarmentType,
    pub thickness_mm: Option<f32>,
}

/// Finds the garment that is meant by `given`.
///
/// # Errors
/// [`PipelineError`] says what it is instead, or what it lacks.
pub(super) fn find(given: &Path, model: &BodyModel) -> Result<Found, PipelineError> {
    let (root, layer) = parts(given)?;
    let folders = Folders::new(&root);
    if let Some(worn) = listed(&folders)?.into_iter().find(|w| is_called(&w.label, &layer)) {
        return of_worn(&folders, &worn, model);
    }
    let subject = Subject::open(&root)?;
    if let Some(why) = subject.withheld() {
        return Err(PipelineError::refused(
            &root,
            format!("{why} (subject.toml), so that nothing of it is given away"),
        ));
    }
    let Some(layer) = subject.layers().iter().find(|l| is_called(&l.label(), &layer)) else {
        let has = subject.layers().iter().map(Layer::label).collect::<Vec<_>>().join(", ");
        return Err(PipelineError::NoLayer { path: root, layer, has });
    };
    of_layer(&folders, &subject, layer, model)
}

/// The subject's folder and the layer's name in `SUBJECT/LAYER`, `SUBJECT/build/LAYER` or `SUBJECT/worn/LAYER`.
fn parts(given: &Path) -> Result<(PathBuf, String), PipelineError> {
    // A trailing slash, or one's own folder.
    let given =
        if given.is_dir() { given.canonicalize().map_err(|e| PipelineError::io(given, e))? } else { given.into() };
    let name = given.file_name().map(|name| name.to_string_lossy().into_owned());
    let above = given.parent().filter(|parent| !parent.as_os_str().is_empty());
    let inside = |folder: &Path| folder.file_name().is_some_and(|n| n == "build" || n == "worn");
    let root = above.map(|folder| if inside(folder) { folder.parent().unwrap_or(folder) } else { folder });
    match (root, name) {
        (Some(root), Some(name)) if Subject::exists(root) => Ok((root.into(), name)),
        _ if Subject::exists(&given) => {
            let reason = "is a subject; name the layer that is meant too, such as SUBJECT/jacket";
            Err(PipelineError::refused(&given, reason))
        }
        _ => {
            let reason = "is no garment; give a layer of a processed subject as SUBJECT/LAYER";
            Err(PipelineError::refused(&given, reason))
        }
    }
}

fn is_called(label: &str, name: &str) -> bool {
    label == name || label.split_once('-').is_some_and(|(_, rest)| rest == name)
}

fn of_worn(folders: &Folders, worn: &WornGarment, model: &BodyModel) -> Result<Found, PipelineError> {
    Ok(Found {
        cloth: worn.cloth(folders, model)?,
        source: worn.file.source.clone(),
        name: worn.label.split_once('-').map_or(&*worn.label, |(_, name)| name).to_string(),
        garment_type: worn.file.garment_type,
        thickness_mm: worn.file.thickness_mm,
    })
}

fn of_layer(folders: &Folders, subject: &Subject, layer: &Layer, model: &BodyModel) -> Result<Found, PipelineError> {
    let (root, label) = (&folders.root, layer.label());
    let garment = folders.garment(&label);
    if !is_there(&folders.body_json()) || !is_there(&garment) {
        let name = root.display();
        let is_body = layer.number == 0 && is_there(&folders.body_json());
        let reason = if is_body {
            format!("{label} is the body and no garment; name another layer")
        } else {
            format!("{label} is not there yet as a garment; run `toile process {name}` first")
        };
        return Err(PipelineError::refused(root, reason));
    }
    let first = subject.layers().first().map_or_else(|| "00-body".into(), Layer::label);
    let body = Body::load(folders, &first, model)?;
    let (mesh, weights) = read_skinned(&garment)?;
    let cut: Option<Record<ExtractionReport>> = record::read(&folders.layer(&label), Cut::NAME)?;
    let stated = layer.garment.as_deref().and_then(|text| text.parse().ok());
    let guessed = || cut.map_or(GarmentType::Other, |cut| cut.result.garment_type);
    Ok(Found {
        cloth: Cloth { mesh, weights, body: body.skinned, pose: body.pose0 },
        source: format!("{}/{label}", subject.name()),
        name: layer.name.clone(),
        garment_type: stated.or_else(|| GarmentType::from_layer_name(&layer.name)).unwrap_or_else(guessed),
        thickness_mm: layer.thickness_mm,
    })
}
