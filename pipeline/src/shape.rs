//! A body by its measures, as files: without a scan, or from a subject, whose garments go along.

use std::{
    fs,
    path::{Path, PathBuf},
};

use nalgebra::{Point3, Translation3};
use serde_json::{Value, json};
use toile_avatar::{Avatar, AvatarLayer, write_glb};
use toile_capture::files::atomic_write_all;
use toile_character::{BodyModel, Joint, JointNaming, Pose, joint::JOINTS};
use toile_fitting::{ShapeSearch, Shaped, Start, Wanted, shape_either};
use toile_garments::{follow, stack};
use toile_geometry::{Mesh, Rigid, ply};

use crate::{
    Goal, Observer, Options, PipelineError, Run, avatar_choice::AvatarChoice, body_file::Body, json, motion, outfit,
    process::process, settings, step::Remarks, steps::export::Export,
};

/// Expected seconds.
const SECONDS: f64 = 5.0;

/// The files that [`shape`] writes: what was asked for and what there is; all measures; the body at rest; the avatar.
pub const SHAPE_FILES: [&str; 5] = ["shape.json", "measurements.json", "measurements.csv", "body.ply", "avatar.glb"];

/// What shape is asked for.
#[derive(Debug, Clone, Default)]
pub struct ShapeOptions {
    /// The measures.
    pub wanted: Vec<Wanted>,
    /// A woman or a man, where it is said.
    pub is_woman: Option<bool>,
    /// The subject to begin with; without, the mean woman or man.
    pub from: Option<PathBuf>,
    /// Settings of the stages.
    pub settings: Option<PathBuf>,
}

/// What was written.
#[derive(Debug)]
pub struct ShapedAvatar {
    /// The files, in the order of [`SHAPE_FILES`].
    pub files: Vec<PathBuf>,
    /// The body.
    pub shaped: Shaped,
    /// Pairs of triangles of each garment that cross a layer below, after it went along; empty without garments.
    pub crossing: Vec<(String, usize)>,
    /// What the operator should know.
    pub remarks: Remarks,
}

/// Shapes a body by measures and writes it into the folder `out`; what the subject lacks is built first.
///
/// # Errors
/// [`PipelineError`] where nobody has the measures, a stage has no answer, or a file cannot be read or written.
pub fn shape(out: &Path, options: &ShapeOptions, observer: &dyn Observer) -> Result<ShapedAvatar, PipelineError> {
    let mut remarks = Remarks::default();
    if let Some(root) = &options.from {
        let building = Options { settings: options.settings.clone(), ..Options::default() };
        let summary = process(root, Goal::Garments, &building, observer)?;
        remarks = summary.remarks;
        remarks.warnings.extend(summary.notes);
    }
    let settings = settings::read(options.from.as_deref(), options.settings.as_deref())?;
    let run = match &options.from {
        Some(root) => Run::open(root, None, settings, observer)?,
        None => Run::single(out, "body", settings, observer),
    };
    observer.begin(&run.label("body", "shape"), SECONDS);
    let model = BodyModel::load_default()?;
    let (shaped, mut avatar, crossing) = match &options.from {
        Some(_) => of_subject(&run, &model, options)?,
        None => of_nobody(&model, options, out)?,
    };
    remarks.warnings.extend(guesses(options, &shaped));
    remarks.warnings.extend(crossing.iter().filter(|(_, pairs)| *pairs > 0).map(|(name, pairs)| {
        format!("{name}: {pairs} pairs of its triangles cut through a layer below after it went along with the body")
    }));
    let moved = motion::load(None, &shaped.body, &run.settings.motion)?;
    avatar.motions.push(moved.motion);
    let glb = write_glb(&avatar).map_err(|e| PipelineError::stage(out, e))?;
    let contents = [
        json::pretty(&record(options, &shaped))?,
        json::pretty(&shaped.table)?,
        shaped.table.csv().into_bytes(),
        ply::encode(&shaped.body.mesh),
        glb,
    ];
    fs::create_dir_all(out).map_err(|e| PipelineError::io(out, e))?;
    let files: Vec<PathBuf> = SHAPE_FILES.iter().map(|name| out.join(name)).collect();
    atomic_write_all(&files.iter().cloned().zip(contents).collect::<Vec<_>>())?;
    observer.end();
    Ok(ShapedAvatar { files, shaped, crossing, remarks })
}

/// A shaped body, the avatar of it, and pairs of triangles of each garment that cross a layer below.
type Worn = (Shaped, Avatar, Vec<(String, usize)>);

/// A body that is nobody's, standing on the floor in the A-pose.
fn of_nobody(model: &BodyModel, options: &ShapeOptions, out: &Path) -> Result<Worn, PipelineError> {
    let search = |start| ShapeSearch::new(model, start);
    let shaped = match options.is_woman {
        Some(is_woman) => {
            search(if is_woman { Start::Woman } else { Start::Man }).and_then(|s| s.shape(&options.wanted))
        }
        None => search(Start::Woman).and_then(|woman| shape_either([&woman, &search(Start::Man)?], &options.wanted)),
    };
    let mut shaped = shaped.map_err(|e| PipelineError::refused(out, e.to_string()))?;
    let soles = shaped.body.mesh.positions.iter().map(|p| p.y).fold(f32::MAX, f32::min);
    shaped.body.mesh.positions.iter_mut().for_each(|p| p.y -= soles);
    shaped.body.skeleton.rest.iter_mut().for_each(|joint| joint.y -= f64::from(soles));
    let avatar = bare(&shaped, "body", Pose::identity());
    Ok((shaped, avatar, Vec::new()))
}

/// A subject's body with its garments, in the pose of the first scan, soles where they were.
fn of_subject(run: &Run, model: &BodyModel, options: &ShapeOptions) -> Result<Worn, PipelineError> {
    let folders = &run.folders;
    let body = Body::load(folders, run.first_layer(), model)?;
    let path = folders.body_json();
    let all: Value = json::read(&path)?;
    let beta: Vec<f64> =
        serde_json::from_value(all["beta"].clone()).map_err(|e| PipelineError::field(&path, "beta", e))?;
    let start = Start::Person { body: &body.skinned, beta: &beta };
    let shaped = ShapeSearch::new(model, start)
        .and_then(|search| search.shape(&options.wanted))
        .map_err(|e| PipelineError::refused(&folders.root, e.to_string()))?;
    let garments = outfit::stacked(run)?;
    let choice = AvatarChoice::read(folders)?;
    let dressed = Export { run, body: &body, garments: &garments, choice: &choice }.dressed()?;
    let before = &dressed.layers[0].mesh;
    let pose0 = on_its_soles(&shaped, &body.pose0, before);
    let mut avatar = bare(&shaped, &dressed.name, pose0);
    avatar.layers[0].mesh.colors.clone_from(&before.colors);
    let mut layers: Vec<Mesh> = dressed.layers[1..].iter().map(|l| l.mesh.clone()).collect();
    let wrong = |e| PipelineError::stage(&folders.root, e);
    follow(before, &avatar.layers[0].mesh.positions, &mut layers).map_err(wrong)?;
    let thickness: Vec<f32> = garments.iter().map(|g| g.thickness).collect();
    let report = stack(&avatar.layers[0].mesh, &mut layers, &thickness, &run.settings.stack, &|_| {}).map_err(wrong)?;
    let names = dressed.layers[1..].iter().map(|l| l.name.clone());
    let crossing = names.zip(report.layers.iter().map(|l| l.crossing_pairs)).collect();
    let worn = dressed.layers.into_iter().skip(1).zip(layers);
    avatar.layers.extend(worn.map(|(layer, mesh)| AvatarLayer { mesh, ..layer }));
    Ok((shaped, avatar, crossing))
}

/// The pose `pose0`, with the soles of the shaped body as low as those of the body `before`.
fn on_its_soles(shaped: &Shaped, pose0: &Pose, before: &Mesh) -> Pose {
    let low = |points: &[Point3<f32>]| points.iter().map(|p| f64::from(p.y)).fold(f64::MAX, f64::min);
    let rise = low(&before.positions) - low(&shaped.body.posed(pose0));
    let up = Rigid::from_parts(Translation3::new(0.0, rise, 0.0), nalgebra::UnitQuaternion::identity());
    pose0.moved(&up, &shaped.body.skeleton)
}

/// The body alone as an avatar in `pose0`.
fn bare(shaped: &Shaped, name: &str, pose0: Pose) -> Avatar {
    let (mesh, weights) = (shaped.body.posed_mesh(&pose0), shaped.body.weights.clone());
    let layer =
        AvatarLayer { name: "body".into(), mesh, weights, order: 0, garment: None, thickness: None, texture: None };
    Avatar {
        name: name.to_string(),
        skeleton: shaped.body.skeleton.clone(),
        joint_names: JointNaming::Vrm,
        pose0,
        layers: vec![layer],
        motions: Vec::new(),
    }
}

/// What was not said, and what could not be met.
fn guesses(options: &ShapeOptions, shaped: &Shaped) -> Vec<String> {
    let mut said = Vec::new();
    if let (None, Some(is_woman)) = (options.is_woman, shaped.is_woman) {
        let (this, that) = if is_woman { ("woman", "man") } else { ("man", "woman") };
        said.push(format!("it was not said whether a woman or a man is meant: a {this}'s body has these measures more commonly than a {that}'s; `--sex` decides"));
    }
    said.extend(shaped.conflict.iter().map(|conflict| conflict.sentence.clone()));
    said
}

/// The content of `shape.json`.
fn record(options: &ShapeOptions, shaped: &Shaped) -> Value {
    let measure = |r: &toile_fitting::Reached| json!({ "name": r.name, "wanted_m": r.wanted_m, "reached_m": r.reached_m, "allowed_m": r.allowed_m, "met": r.is_met() });
    let joint = |j: &Joint| (j.name().to_string(), json!(shaped.body.skeleton.position(*j).coords.as_slice()));
    json!({
        "made_by": "toile shape",
        "from": options.from.as_ref().map(|p| p.to_string_lossy()),
        "sex": shaped.is_woman.map(|is_woman| if is_woman { "woman" } else { "man" }),
        "measures": shaped.reached.iter().map(measure).collect::<Vec<_>>(),
        "conflict": shaped.conflict.as_ref().map(|c| &c.names),
        "deviations_from_start": shaped.distance,
        "beta": shaped.beta,
        "rest_joints": JOINTS.iter().map(joint).collect::<serde_json::Map<_, _>>(),
    })
}
