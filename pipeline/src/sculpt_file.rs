//! Bodies of primitives as files of their own: a new one, changes by hand, other sizes, and their surface in a motion.

use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};
use toile_avatar::{Avatar, AvatarLayer, write_glb};
use toile_capture::files::{atomic_write, read_limited};
use toile_character::{BodyModel, JointNaming, Motion, Pose, SkinnedMesh, transfer::closest_triangle_weights};
use toile_geometry::{Mesh, ply};
use toile_implicit::{
    Edit, Envelope, ImplicitBody, ImplicitError, LEVELS, Scaling,
    fit::{FitSettings, fit},
    format,
};

use crate::{PipelineError, motion, settings::Settings};

/// The largest file of primitives that is read, bytes: a thousand times one of a fitted body.
const LARGEST: u64 = 32 << 20;

/// A body of primitives that is made, changed or looked at.
pub struct SculptFile {
    model: BodyModel,
    body: ImplicitBody,
    /// Where it was read from, for messages.
    path: PathBuf,
}

/// How a motion is looked at.
#[derive(Debug, Clone)]
pub struct PoseChoice {
    /// BVH, GLB or VRMA; without, the pose at rest.
    pub motion: Option<PathBuf>,
    /// The frame of a still surface, from 0.
    pub frame: usize,
    /// Level of detail, 0 (finest) to 3.
    pub level: usize,
}

impl SculptFile {
    /// Primitives of the mean person: a woman, a man, or between the two.
    ///
    /// # Errors
    /// [`PipelineError`] where they cannot be fitted, which no file can cause.
    pub fn default_person(is_woman: Option<bool>) -> Result<Self, PipelineError> {
        let model = BodyModel::load_default()?;
        let mean = match is_woman {
            Some(true) => &model.population.beta_female[..],
            Some(false) => &model.population.beta_male,
            None => &[],
        };
        let beta: Vec<f64> = mean.iter().map(|&b| f64::from(b)).collect();
        let path = PathBuf::from("the default person");
        let wrong = |e| PipelineError::stage(&path, e);
        let poses = [model.t_pose(&beta)];
        let settings = FitSettings::default();
        let fitted = fit(&model, &model.skinned(&beta), &beta, "person", &poses, &settings).map_err(wrong)?;
        Ok(Self { body: fitted.body, model, path })
    }

    /// Reads a file of primitives.
    ///
    /// # Errors
    /// [`PipelineError`] names the line that is not what it should be.
    pub fn read(path: &Path) -> Result<Self, PipelineError> {
        let model = BodyModel::load_default()?;
        let bytes = read_limited(path, LARGEST)?;
        let text = String::from_utf8(bytes).map_err(|_| PipelineError::format(path, "is not text (UTF-8)"))?;
        let body = format::read(&text, &model).map_err(|e| PipelineError::format(path, e))?;
        Ok(Self { model, body, path: path.to_path_buf() })
    }

    /// The primitives.
    pub fn body(&self) -> &ImplicitBody {
        &self.body
    }

    /// Changes primitives, one change after another.
    ///
    /// # Errors
    /// [`PipelineError`] says which change cannot be made.
    pub fn edit(&mut self, edits: &[Edit]) -> Result<(), PipelineError> {
        edits.iter().try_for_each(|edit| edit.apply(&mut self.body)).map_err(|e| self.refused(&e))
    }

    /// Gives the body another size and other proportions.
    ///
    /// # Errors
    /// [`PipelineError`] where nobody has them.
    pub fn scale(&mut self, scaling: &Scaling) -> Result<(), PipelineError> {
        let rest = self.surface(&Pose::identity(), LEVELS.len() - 1)?;
        let crown = rest.positions.iter().map(|p| f64::from(p.y)).fold(0.0, f64::max);
        self.body = scaling.of(&self.body, crown).map_err(|e| self.refused(&e))?;
        Ok(())
    }

    /// Writes the file of primitives; the number of its bytes.
    ///
    /// # Errors
    /// [`PipelineError`] where it cannot be written.
    pub fn write(&self, path: &Path) -> Result<usize, PipelineError> {
        let text = format::write(&self.body);
        // what is written can be read again
        format::read(&text, &self.model).map_err(|e| self.refused(&e))?;
        atomic_write(path, text.as_bytes())?;
        Ok(text.len())
    }

    /// Writes the surface: of one frame of a motion as PLY, muscles included; or as GLB at rest with skeleton, weights and the motion.
    ///
    /// # Errors
    /// [`PipelineError`] where the motion cannot be used, has no such frame, or the file cannot be written.
    pub fn write_surface(&self, path: &Path, choice: &PoseChoice) -> Result<(), PipelineError> {
        let person = self.model.skinned(&self.body.beta);
        let person = SkinnedMesh { skeleton: self.body.skeleton.clone(), ..person };
        let motion = match &choice.motion {
            Some(file) => Some(motion::load(Some(file), &person, &Settings::default().motion)?.motion),
            None => None,
        };
        let is_glb = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb"));
        let bytes = if is_glb { self.glb(choice.level, motion, path)? } else { self.still(choice, motion.as_ref())? };
        Ok(atomic_write(path, &bytes)?)
    }

    /// The surface of one frame as PLY.
    fn still(&self, choice: &PoseChoice, motion: Option<&Motion>) -> Result<Vec<u8>, PipelineError> {
        let pose = match motion {
            None => Pose::identity(),
            Some(motion) => motion.poses.get(choice.frame).cloned().ok_or_else(|| {
                let reason =
                    format!("has no frame {}; its frames are 0 to {}", choice.frame, motion.poses.len().max(1) - 1);
                PipelineError::refused(choice.motion.as_deref().unwrap_or(&self.path), reason)
            })?,
        };
        let mut mesh = self.surface(&pose, choice.level)?;
        mesh.recompute_normals();
        Ok(ply::encode(&mesh))
    }

    /// The surface at rest with skeleton, weights and motion.
    fn glb(&self, level: usize, motion: Option<Motion>, path: &Path) -> Result<Vec<u8>, PipelineError> {
        let mut mesh = self.surface(&Pose::identity(), level)?;
        mesh.recompute_normals();
        let template = Mesh::new(self.template(), self.model.triangles.clone());
        let weights = closest_triangle_weights(&template, &self.model.weights, &mesh.positions);
        let layer =
            AvatarLayer { name: "body".into(), mesh, weights, order: 0, garment: None, thickness: None, texture: None };
        let avatar = Avatar {
            name: self.body.name.clone(),
            skeleton: self.body.skeleton.clone(),
            joint_names: JointNaming::Vrm,
            pose0: Pose::identity(),
            layers: vec![layer],
            motions: motion.into_iter().collect(),
        };
        write_glb(&avatar).map_err(|e| PipelineError::stage(path, e))
    }

    /// The template's vertices at rest on the body's own joints, as large as its head: near enough to the surface for its weights.
    fn template(&self) -> Vec<Point3<f32>> {
        let (own, body) = (self.model.skeleton_at(&self.body.beta), &self.body);
        let of = |(v, p): (usize, &Point3<f32>)| {
            let beside = |(j, w): (u8, f32)| {
                let (from, to) = (own.rest[usize::from(j)], body.skeleton.rest[usize::from(j)]);
                (to.coords + (p.cast::<f64>() - from) * body.scale) * f64::from(w)
            };
            Point3::from(self.model.weights.of(v).map(beside).sum::<Vector3<f64>>()).cast()
        };
        self.model.shape(&body.beta).iter().enumerate().map(of).collect()
    }

    /// The surface that is sampled from the primitives in a pose.
    fn surface(&self, pose: &Pose, level: usize) -> Result<Mesh, PipelineError> {
        let envelope = Envelope::new(&self.model, &self.body, LEVELS[level]).map_err(|e| self.refused(&e))?;
        Ok(envelope.sample(&self.body, pose).mesh)
    }

    fn refused(&self, error: &ImplicitError) -> PipelineError {
        PipelineError::refused(&self.path, error.to_string())
    }
}
