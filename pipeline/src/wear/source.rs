//! What to put on, as the command line names it.

use std::path::{Path, PathBuf};

use toile_avatar::read_avatar;
use toile_capture::{
    Subject,
    files::{is_there, read_limited},
    subject::{BODY, Layer},
};
use toile_character::{BodyModel, GarmentType, Joint, Pose, Skeleton, SkinnedMesh, skinning};
use toile_garments::{ExtractionReport, Generic, GenericGarment, make_generic};
use toile_geometry::Mesh;

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

/// The largest file of an avatar that is read, bytes.
const MOST_BYTES: u64 = 1 << 30;
/// Arms at rest differ by less between people, radians.
const MOST_TURNED: f64 = 0.35;

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
    if let Some(kind) = given.to_str().filter(|_| !is_there(given)).and_then(|name| name.parse().ok()) {
        return Ok(of_nobody(kind, model));
    }
    if let Some((file, layer)) = in_file(given) {
        return of_file(&file, layer.as_deref(), model);
    }
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

/// The file and the layer's name in `FILE.glb` or `FILE.glb/LAYER`.
fn in_file(given: &Path) -> Option<(PathBuf, Option<String>)> {
    if given.is_file() {
        return Some((given.into(), None));
    }
    let above = given.parent().filter(|above| above.is_file())?;
    Some((above.into(), Some(given.file_name()?.to_string_lossy().into_owned())))
}

/// A layer of an avatar's GLB file, with its node `body`.
fn of_file(path: &Path, layer: Option<&str>, model: &BodyModel) -> Result<Found, PipelineError> {
    let lower = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if lower == "obj" || lower == "ply" {
        let reason =
            "has no skin, so that nobody knows how it hangs on a body; give a GLB file that has one, or SUBJECT/LAYER";
        return Err(PipelineError::refused(path, reason));
    }
    let file = read_avatar(&read_limited(path, MOST_BYTES)?).map_err(|e| PipelineError::stage(path, e))?;
    let garments = || file.layers.keys().filter(|name| *name != BODY);
    let has = || garments().cloned().collect::<Vec<_>>().join(", ");
    let found = match layer {
        Some(layer) => garments().find(|name| is_called(name, layer)),
        None => garments().next().filter(|_| garments().count() == 1),
    };
    let Some(name) = found else {
        let reason = match layer {
            Some(layer) => format!("has no layer `{layer}`; it has {}", has()),
            None if garments().count() == 0 => "has no garment with a skin".into(),
            None => format!("has several garments; name one, such as FILE.glb/LAYER: {}", has()),
        };
        return Err(PipelineError::refused(path, reason));
    };
    let body = file.layers.get(BODY).filter(|body| body.mesh.triangles.len() == model.triangles.len());
    let Some(body) = body.filter(|body| body.mesh.positions.len() == model.vertex_count()) else {
        let reason =
            "has no whole body of Toile's template as its node `body`, so that nobody knows whom the garment fits";
        return Err(PipelineError::refused(path, reason));
    };
    if turned_arms(&file.skeleton, model) > MOST_TURNED {
        let reason =
            "has its skeleton in another rest than Toile's A-pose (a VRM file?); give the subject's avatar.glb";
        return Err(PipelineError::refused(path, reason));
    }
    let rest = skinning::unskin(&body.mesh.positions, &model.weights, &file.pose.skinning_transforms(&file.skeleton));
    let garment = &file.layers[name];
    let mesh = Mesh::new(rest, model.triangles.clone());
    let plain = name.split_once('-').map_or(&**name, |(_, rest)| rest).to_string();
    let stated = garment.garment.as_deref().and_then(|text| text.parse().ok());
    Ok(Found {
        cloth: Cloth {
            mesh: garment.mesh.clone(),
            weights: garment.weights.clone(),
            body: SkinnedMesh::new(mesh, file.skeleton, model.weights.clone())?,
            pose: file.pose,
        },
        source: format!("{}/{name}", path.file_name().unwrap_or_default().to_string_lossy()),
        garment_type: stated.or_else(|| GarmentType::from_layer_name(&plain)).unwrap_or(GarmentType::Other),
        name: plain,
        thickness_mm: None,
    })
}

/// Angle between the left upper arm at rest and that of the model, radians.
fn turned_arms(skeleton: &Skeleton, model: &BodyModel) -> f64 {
    let arm = |s: &Skeleton| s.position(Joint::LeftHand) - s.position(Joint::LeftUpperArm);
    arm(skeleton).angle(&arm(&model.mean_skeleton))
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
            let names: Vec<_> = GenericGarment::ALL.iter().map(|kind| kind.name()).collect();
            let reason = format!(
                "is no garment; give a layer of a processed subject as SUBJECT/LAYER, an avatar's FILE.glb/LAYER, or a generic garment: {}",
                names.join(", ")
            );
            Err(PipelineError::refused(&given, reason))
        }
    }
}

fn is_called(label: &str, name: &str) -> bool {
    label == name || label.split_once('-').is_some_and(|(_, rest)| rest == name)
}

/// A generic garment, on the mean body.
fn of_nobody(kind: GenericGarment, model: &BodyModel) -> Found {
    let Generic { mesh, weights } = make_generic(kind, model);
    Found {
        cloth: Cloth { mesh, weights, body: model.skinned(&[]), pose: Pose::identity() },
        source: format!("the generic {kind}"),
        name: kind.name().into(),
        garment_type: kind.garment_type(),
        thickness_mm: None,
    }
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
