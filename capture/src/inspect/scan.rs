//! What a finished scan holds.

use std::{
    fs,
    path::{Path, PathBuf},
};

use toile_geometry::GeometryError;
use toile_scans::{Unit, Up, kind_of, read};

use super::findings::{ScanInspection, TakeInspection};
use crate::{CaptureError, ScanTake};

/// True where a path is a take that is a finished scan, or a mesh file that could become one.
pub(super) fn is_scan(path: &Path) -> bool {
    ScanTake::is_at(path) || (path.is_file() && kind_of(path).is_some())
}

/// Looks through a finished scan.
///
/// # Errors
/// [`CaptureError`] where it cannot be read.
pub(super) fn inspect_scan(path: &Path) -> Result<TakeInspection, CaptureError> {
    let take = if path.is_dir() { Some(ScanTake::open(path)?) } else { None };
    let mesh = take.as_ref().map_or_else(|| path.to_path_buf(), ScanTake::mesh_path);
    let files = take.as_ref().map_or_else(|| vec![mesh.clone()], ScanTake::files);
    let (unit, up) = take.as_ref().map_or((None, None), |take| (take.unit, take.up));
    let surface = read(&mesh).map_err(|error| CaptureError::format(&mesh, reason_of(&error)))?;
    let found = unit.map_or_else(|| Unit::find(&surface), Ok);
    let size = |file: &PathBuf| fs::metadata(file).map_or(0, |data| data.len());
    let name = |path: &Path| path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let mut problems = surface.notices.clone();
    problems.extend(found.clone().err());
    Ok(TakeInspection {
        name: name(path),
        format: "scan".into(),
        bytes: files.iter().map(size).sum(),
        scan: Some(ScanInspection {
            file: name(&mesh),
            vertices: surface.positions.len() as u64,
            triangles: surface.triangles.len() as u64,
            unit: found.ok().map(|unit| unit.name().to_string()),
            unit_said: unit.is_some(),
            up_said: up.map(|up: Up| up.name().to_string()),
            has_colors: surface.has_colors(),
            pictures: surface.materials.iter().filter(|material| material.picture.is_some()).count() as u64,
        }),
        problems,
        ..TakeInspection::default()
    })
}

/// The reason of an error without the path, which the error around it names.
fn reason_of(error: &GeometryError) -> String {
    match error {
        GeometryError::Io { source, .. } => source.to_string(),
        GeometryError::Format { reason, .. } | GeometryError::Mesh(reason) => reason.clone(),
    }
}
