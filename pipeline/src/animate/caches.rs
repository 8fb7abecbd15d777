//! The point caches of a motion, written beside each other and put in their place together.

use std::{
    fs::{self, File},
    io::{BufWriter, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use nalgebra::Point3;
use toile_avatar::PointCache;
use toile_capture::files::{atomic_write, is_there};

use super::report::AnimationReport;
use crate::{PipelineError, json};

/// Bytes of a point cache before its first sample.
const HEADER: usize = 32;

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
            remove(&part)?;
            let file = File::create_new(&part).map_err(wrap)?;
            let samples = u32::try_from(frames).unwrap_or(u32::MAX);
            let cache = PointCache::begin(BufWriter::new(file), points, samples).map_err(wrap)?;
            Ok::<_, PipelineError>((part, whole, cache))
        };
        let layers = layers.iter().map(begin).collect::<Result<_, _>>()?;
        Ok(Self { folder: folder.to_path_buf(), layers })
    }

    /// Goes on with the caches of an interrupted run of the same layers and frames, `done` of which are kept; `None` where they are not there
    /// or shorter.
    pub fn go_on(
        folder: &Path,
        layers: &[(&str, usize)],
        frames: usize,
        done: usize,
    ) -> Result<Option<Self>, PipelineError> {
        let mut opened = Vec::with_capacity(layers.len());
        for &(name, points) in layers {
            let (part, whole) = (folder.join(format!("{name}.pc2.part")), folder.join(format!("{name}.pc2")));
            // Killed while whole caches were put in their place.
            if done == frames && !is_there(&part) && is_there(&whole) {
                fs::rename(&whole, &part).map_err(|e| PipelineError::io(&whole, e))?;
            }
            let length = (HEADER + done * points * 12) as u64;
            match fs::symlink_metadata(&part) {
                Ok(found) if found.is_file() && found.len() >= length => {}
                _ => return Ok(None),
            }
            let wrap = |e| PipelineError::io(&part, e);
            let mut file = File::options().read(true).write(true).open(&part).map_err(wrap)?;
            let samples = u32::try_from(frames).unwrap_or(u32::MAX);
            if !begins_as(&mut file, points, samples).map_err(wrap)? {
                return Ok(None);
            }
            file.set_len(length).map_err(wrap)?;
            file.seek(SeekFrom::End(0)).map_err(wrap)?;
            let cache = PointCache::go_on(BufWriter::new(file), points, samples, done as u32).map_err(wrap)?;
            opened.push((part, whole, cache));
        }
        Ok(Some(Self { folder: folder.to_path_buf(), layers: opened }))
    }

    /// Makes sure that all frames so far are on the disk.
    pub fn sync(&mut self) -> Result<(), PipelineError> {
        for (part, _, cache) in &mut self.layers {
            let wrap = |e| PipelineError::io(part, e);
            cache.out_mut().flush().map_err(wrap)?;
            cache.out_mut().get_ref().sync_data().map_err(wrap)?;
        }
        Ok(())
    }

    /// Adds a frame of all layers.
    pub fn add(&mut self, frame: &[Vec<Point3<f32>>]) -> Result<(), PipelineError> {
        for ((part, _, cache), points) in self.layers.iter_mut().zip(frame) {
            cache.add(points).map_err(|e| PipelineError::io(part, e))?;
        }
        Ok(())
    }

    /// Ends all caches, so that they can be read.
    pub fn written(self) -> Result<Written, PipelineError> {
        let mut layers = Vec::with_capacity(self.layers.len());
        for (part, whole, cache) in self.layers {
            let wrap = |e| PipelineError::io(&part, e);
            let file = cache.finish().map_err(wrap)?.into_inner().map_err(|e| wrap(e.into_error()))?;
            file.sync_all().map_err(wrap)?;
            layers.push((part, whole));
        }
        Ok(Written { folder: self.folder, layers })
    }
}

/// Whole caches that are not in their place yet.
pub(super) struct Written {
    folder: PathBuf,
    layers: Vec<(PathBuf, PathBuf)>,
}

impl Written {
    /// The caches, to be read. `points` are the vertices of each layer.
    pub fn open(&self, points: &[usize]) -> Result<Vec<Cached>, PipelineError> {
        let open = |((part, _), &points): (&(PathBuf, PathBuf), &usize)| {
            let file = File::open(part).map_err(|e| PipelineError::io(part, e))?;
            Ok(Cached { path: part.clone(), file, points })
        };
        self.layers.iter().zip(points).map(open).collect()
    }

    /// Puts the caches and other `files` (name, bytes) in their place, and the report last.
    pub fn finish(self, files: &[(&str, Vec<u8>)], report: &AnimationReport) -> Result<(), PipelineError> {
        let report_path = self.folder.join("report.json");
        remove(&report_path)?;
        for (part, whole) in self.layers {
            fs::rename(&part, &whole).map_err(|e| PipelineError::io(&part, e))?;
        }
        for (name, bytes) in files {
            atomic_write(&self.folder.join(name), bytes)?;
        }
        Ok(atomic_write(&report_path, &json::pretty(report)?)?)
    }
}

/// A cache that is read.
pub(super) struct Cached {
    path: PathBuf,
    file: File,
    points: usize,
}

impl Cached {
    /// The vertices in frame `f`.
    pub fn frame(&mut self, f: usize) -> Result<Vec<Point3<f32>>, PipelineError> {
        let wrap = |e| PipelineError::io(&self.path, e);
        let mut bytes = vec![0; self.points * 12];
        self.file.seek(SeekFrom::Start((HEADER + f * bytes.len()) as u64)).map_err(wrap)?;
        self.file.read_exact(&mut bytes).map_err(wrap)?;
        let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        let points = bytes.chunks_exact(12);
        Ok(points.map(|p| Point3::new(number(&p[..4]), number(&p[4..8]), number(&p[8..]))).collect())
    }
}

/// True where the file begins as a cache of so many points and samples does.
fn begins_as(file: &mut File, points: usize, samples: u32) -> std::io::Result<bool> {
    let expected = PointCache::begin(Vec::new(), points, samples)?.out_mut().clone();
    let mut found = vec![0; expected.len()];
    file.read_exact(&mut found)?;
    Ok(found == expected)
}

fn remove(path: &Path) -> Result<(), PipelineError> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(PipelineError::io(path, e)),
        _ => Ok(()),
    }
}
