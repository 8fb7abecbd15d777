//! The first look at a finished scan: what it holds, how long its unit is, which way it stands.

use std::path::Path;

use toile_capture::printable_path;
use toile_character::BodyModel;
use toile_fitting::{FitSettings, find_upright};
use toile_geometry::Mesh;
use toile_scans::{Kind, Surface, Unit, Up, kind_of, read};

use crate::PipelineError;

/// A finished scan with its unit and its way up, each as somebody said it or as it was found.
pub struct ScanSurvey {
    /// The surface in the file's own units and axes.
    pub surface: Surface,
    /// The unit of its lengths.
    pub unit: Unit,
    /// The axis that points up.
    pub up: Up,
    /// What was guessed, and what could not be read, a sentence each.
    pub sentences: Vec<String>,
}

impl ScanSurvey {
    /// Reads a mesh file. Where nobody says its unit, it is the one in which its longest side is that of a grown person; where
    /// nobody says which axis points up, it is the one by which a body agrees best with it.
    ///
    /// # Errors
    /// [`PipelineError`] where the file is no mesh, has the size of a person in no unit, or nobody is in it.
    pub fn new(path: &Path, unit: Option<Unit>, up: Option<Up>) -> Result<Self, PipelineError> {
        let surface = read(path)?;
        let wrong = |reason: String| PipelineError::format(path, reason);
        let found = match unit {
            Some(unit) => unit,
            None => Unit::find(&surface).map_err(wrong)?,
        };
        let upright = match up {
            Some(up) => up,
            None => Up::of(&find_upright_of(path, &surface, found)?),
        };
        // glTF states metres and +Y up: whoever finds just that has guessed nothing.
        let is_stated = matches!(kind_of(path), Some(Kind::Glb | Kind::Gltf));
        let mut sentences = surface.notices.clone();
        let name = printable_path(Path::new(path.file_name().unwrap_or_default()));
        if unit.is_none() && !(is_stated && found == Unit::Metre) {
            sentences.push(format!(
                "{name}: nobody said its unit; by the size of a person it is in {} (--unit says another)",
                found.plural()
            ));
        }
        if up.is_none() && !(is_stated && upright == Up::Y) {
            sentences.push(format!(
                "{name}: nobody said which axis points up; the person stands along {upright} (--up says another)"
            ));
        }
        Ok(Self { surface, unit: found, up: upright, sentences })
    }
}

/// The rotation that stands a surface upright.
fn find_upright_of(path: &Path, surface: &Surface, unit: Unit) -> Result<nalgebra::UnitQuaternion<f64>, PipelineError> {
    let scale = unit.metres() as f32;
    let mut mesh = Mesh::new(surface.positions.iter().map(|p| *p * scale).collect(), surface.triangles.clone());
    mesh.recompute_normals();
    let model = BodyModel::load_default()?;
    find_upright(&model, &mesh, &FitSettings::default()).map_err(|e| PipelineError::stage(path, e))
}
