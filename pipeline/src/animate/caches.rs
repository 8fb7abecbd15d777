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

/// A layer as its cache has it: its vertices, and those of them that stand again behind, as in the avatar's files (on borders of a texture's charts).
#[derive(Debug, Clone, Copy)]
pub(super) struct Cache<'a> {
    pub name: &'a str,
    pub vertices: usize,
    pub again: &'a [u32],
}

impl Cache<'_> {
    /// Points of a sample.
    fn points(&self) -> usize {
        self.vertices + self.again.len()
    }
}

/// The point caches of a motion, while they are written.
pub(super) struct Caches {
    folder: PathBuf,
    layers: Vec<Layer>,
}

/// The point cache of a layer, while it is written.
struct Layer {
    part: PathBuf,
    whole: PathBuf,
    again: Vec<u32>,
    cache: PointCache<BufWriter<File>>,
}

impl Caches {
    /// Begins a cache for each layer of `frames` frames in `folder`.
    pub fn begin(folder: &Path, layers: &[Cache], frames: usize) -> Result<Self, PipelineError> {
        fs::create_dir_all(folder).map_err(|e| PipelineError::io(folder, e))?;
        let begin = |layer: &Cache| {
            let (name, points) = (layer.name, layer.points());
            let (part, whole) = (folder.join(format!("{name}.pc2.part")), folder.join(format!("{name}.pc2")));
            let wrap = |e| PipelineError::io(&part, e);
            // What an interrupted run left; never through a link to somewhere else.
            remove(&part)?;
            let file = File::create_new(&part).map_err(wrap)?;
            let samples = u32::try_from(frames).unwrap_or(u32::MAX);
            let cache = PointCache::begin(BufWriter::new(file), points, samples).map_err(wrap)?;
            Ok::<_, PipelineError>(Layer { part, whole, again: layer.again.to_vec(), cache })
        };
        let layers = layers.iter().map(begin).collect::<Result<_, _>>()?;
        Ok(Self { folder: folder.to_path_buf(), layers })
    }

    /// Goes on with the caches of an interrupted run of the same layers and frames, `done` of which are kept; `None` where they are not there
    /// or shorter.
    pub fn go_on(folder: &Path, layers: &[Cache], frames: usize, done: usize) -> Result<Option<Self>, PipelineError> {
        let mut opened = Vec::with_capacity(layers.len());
        for layer in layers {
            let (name, points) = (layer.name, layer.points());
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
            opened.push(Layer { part, whole, again: layer.again.to_vec(), cache });
        }
        Ok(Some(Self { folder: folder.to_path_buf(), layers: opened }))
    }

    /// Makes sure that all frames so far are on the disk.
    pub fn sync(&mut self) -> Result<(), PipelineError> {
        for Layer { part, cache, .. } in &mut self.layers {
            let wrap = |e| PipelineError::io(part, e);
            cache.out_mut().flush().map_err(wrap)?;
            cache.out_mut().get_ref().sync_data().map_err(wrap)?;
        }
        Ok(())
    }

    /// Adds a frame of all layers.
    pub fn add(&mut self, frame: &[Vec<Point3<f32>>]) -> Result<(), PipelineError> {
        for (Layer { part, again, cache, .. }, points) in self.layers.iter_mut().zip(frame) {
            let repeated = again.iter().map(|&v| points[v as usize]);
            let all: Vec<Point3<f32>> = points.iter().copied().chain(repeated).collect();
            cache.add(&all).map_err(|e| PipelineError::io(part, e))?;
        }
        Ok(())
    }

    /// Ends all caches, so that they can be read.
    pub fn written(self) -> Result<Written, PipelineError> {
        let mut layers = Vec::with_capacity(self.layers.len());
        for Layer { part, whole, cache, .. } in self.layers {
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
    /// The caches of `layers`, to be read.
    pub fn open(&self, layers: &[Cache]) -> Result<Vec<Cached>, PipelineError> {
        let open = |((part, _), layer): (&(PathBuf, PathBuf), &Cache)| {
            let file = File::open(part).map_err(|e| PipelineError::io(part, e))?;
            Ok(Cached { path: part.clone(), file, vertices: layer.vertices, points: layer.points() })
        };
        self.layers.iter().zip(layers).map(open).collect()
    }

    /// Puts the caches and other `files` (name, bytes) in their place, and the report last.
    pub fn finish(self, files: &[(&str, Vec<u8>)], report: &AnimationReport) -> Result<(), PipelineError> {
        let report_path = self.folder.join("report.json");
        remove(&report_path)?;
        // Of an earlier run that compared: it would no longer belong to the rest.
        ["variants.gif", "variants.png"].iter().try_for_each(|name| remove(&self.folder.join(name)))?;
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
    vertices: usize,
    points: usize,
}

impl Cached {
    /// The vertices in frame `f`.
    pub fn frame(&mut self, f: usize) -> Result<Vec<Point3<f32>>, PipelineError> {
        let wrap = |e| PipelineError::io(&self.path, e);
        let mut bytes = vec![0; self.vertices * 12];
        self.file.seek(SeekFrom::Start((HEADER + f * self.points * 12) as u64)).map_err(wrap)?;
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
