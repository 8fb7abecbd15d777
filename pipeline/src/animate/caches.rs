//! The point caches of a motion, written beside each other and put in their place together.

use std::{
    fs::{self, File},
    io::BufWriter,
    path::{Path, PathBuf},
};

use nalgebra::Point3;
use toile_avatar::PointCache;
use toile_capture::files::atomic_write;

use super::AnimationReport;
use crate::{PipelineError, json};

/// The point caches of a motion, while they are written.
pub(super) struct Caches {
    folder: PathBuf,
    layers: Vec<(PathBuf, PathBuf, PointCache<BufWriter<File>>)>,
}

impl Caches {
    /// Begins a cache for each layer (name, vertices) of `frames` frames in `folder`.
    pub fn begin(folder: &Path, layers: &[(&str, usize)], frames: usize) -> Result<Self, PipelineError> {
        fs::create_dir_all(folder).map_err(|e| PipelineError::io(folder, e))?;
        let begin = |&(name, points): &(&str, usize)| {
            let (part, whole) = (folder.join(format!("{name}.pc2.part")), folder.join(format!("{name}.pc2")));
            let wrap = |e| PipelineError::io(&part, e);
            // What an interrupted run left; never through a link to somewhere else.
            match fs::remove_file(&part) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(wrap(e)),
                _ => {}
            }
            let file = File::create_new(&part).map_err(wrap)?;
            let samples = u32::try_from(frames).unwrap_or(u32::MAX);
            let cache = PointCache::begin(BufWriter::new(file), points, samples).map_err(wrap)?;
            Ok((part, whole, cache))
        };
        let layers = layers.iter().map(begin).collect::<Result<_, _>>()?;
        Ok(Self { folder: folder.to_path_buf(), layers })
    }

    /// Adds a frame of all layers.
    pub fn add(&mut self, frame: &[Vec<Point3<f32>>]) -> Result<(), PipelineError> {
        for ((part, _, cache), points) in self.layers.iter_mut().zip(frame) {
            cache.add(points).map_err(|e| PipelineError::io(part, e))?;
        }
        Ok(())
    }

    /// Puts the caches in their place, and the report last.
    pub fn finish(self, report: &AnimationReport) -> Result<(), PipelineError> {
        let report_path = self.folder.join("report.json");
        match fs::remove_file(&report_path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(PipelineError::io(&report_path, e)),
            _ => {}
        }
        for (part, whole, cache) in self.layers {
            let wrap = |e| PipelineError::io(&part, e);
            let out = cache.finish().map_err(wrap)?;
            out.into_inner().map_err(|e| wrap(e.into_error()))?.sync_all().map_err(wrap)?;
            fs::rename(&part, &whole).map_err(wrap)?;
        }
        Ok(atomic_write(&report_path, &json::pretty(report)?)?)
    }
}
