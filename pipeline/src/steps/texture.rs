//! Step `texture`: a take's scan and its colour pictures → the scan with a texture.
//!
//! Reads the recording, `scan.ply` and `trajectory.tum`. Writes `textured.glb` in the scan's frame, and `texture-seen.png`, which says what
//! was seen and what was filled.

use std::{fs, io::Read, path::PathBuf};

use serde_json::Value;
use toile_avatar::{Picture, write_textured};
use toile_capture::{
    Sensor, Source,
    files::{is_there, open_regular, read_text},
    trajectory::{self, TimedPose},
};
use toile_geometry::ply;
use toile_texture::{Atlas, Photo, TextureReport, TextureSettings, bake, fitting_size, unwrap};

use super::fuse::files_of;
use crate::{
    PipelineError, Run, json,
    opened::Opened,
    step::{Product, Step},
};

/// Texturing the scan of one take.
pub struct Texturing<'a> {
    /// The run.
    run: &'a Run<'a>,
    /// Folder name of the take.
    layer: String,
}

impl<'a> Texturing<'a> {
    /// The texture of a take's scan; `None` where none is asked for, or the scan has no colours, because the take has no colour pictures.
    /// Then what an earlier run made goes.
    ///
    /// # Errors
    /// [`PipelineError`] where the scan cannot be read.
    pub fn of_layer(run: &'a Run<'a>, layer: &str) -> Result<Option<Self>, PipelineError> {
        if run.settings.texture.size > 0 && has_colors(&run.folders.scan(layer))? {
            return Ok(Some(Self { run, layer: layer.to_string() }));
        }
        Self::remove(run, layer)?;
        Ok(None)
    }

    /// Removes a take's texture.
    ///
    /// # Errors
    /// [`PipelineError::Io`] where a file cannot be removed.
    pub fn remove(run: &Run, layer: &str) -> Result<(), PipelineError> {
        for path in [run.folders.textured(layer), run.folders.texture_seen(layer)] {
            if is_there(&path) {
                fs::remove_file(&path).map_err(|e| PipelineError::io(&path, e))?;
            }
        }
        Ok(())
    }

    /// Refuses settings that cannot be used, before any work is done.
    ///
    /// # Errors
    /// [`PipelineError`] that says which.
    pub fn check(root: &std::path::Path, settings: &TextureSettings) -> Result<(), PipelineError> {
        if settings.size == 0 { Ok(()) } else { settings.check().map_err(|e| PipelineError::stage(root, e)) }
    }

    /// The pictures of all frames whose place is known.
    fn photos(&self, progress: &(dyn Fn(f32) + Sync)) -> Result<Vec<Photo>, PipelineError> {
        let Opened { mut source, .. } = Opened::new(&self.run.folders.take(&self.layer), None)?;
        let places = self.places(source.as_ref())?;
        let sensors = source.rig().sensors.clone();
        let mut photos = Vec::new();
        let frames = places.iter().map(Vec::len).sum::<usize>().max(1);
        loop {
            progress(0.1 * (photos.len() as f32 / frames as f32).min(1.0));
            let frame = match source.next_frame() {
                Ok(Some(frame)) => frame,
                Ok(None) => return Ok(photos),
                // Fusion has told of frames that cannot be read.
                Err(_) => continue,
            };
            let (Some(sensor), Some(image)) = (sensors.get(frame.sensor), frame.color) else { continue };
            let Ok(at) = places[frame.sensor].binary_search_by_key(&frame.device_time_ns, |p| p.time_ns) else {
                continue;
            };
            photos.extend(photo(sensor, frame.index, &places[frame.sensor][at], image));
        }
    }

    /// The poses of each sensor's frames, in the order of time.
    fn places(&self, source: &dyn Source) -> Result<Vec<Vec<TimedPose>>, PipelineError> {
        let path = self.run.folders.trajectory(&self.layer);
        let text = read_text(&path)?;
        let sensors = &source.rig().sensors;
        let mut places = vec![Vec::new(); sensors.len().max(1)];
        // Of several sensors the lines of each follow a comment that names it.
        for part in text.split("# sensor ") {
            let name = part.lines().next().unwrap_or_default();
            let sensor = sensors.iter().position(|s| s.name == name && text.contains("# sensor ")).unwrap_or(0);
            let lines = if text.contains("# sensor ") { part.split_once('\n').map_or("", |p| p.1) } else { part };
            let poses = trajectory::parse(lines).map_err(|reason| PipelineError::format(&path, reason))?;
            places[sensor].extend(poses);
        }
        places.iter_mut().for_each(|poses: &mut Vec<TimedPose>| poses.sort_by_key(|p| p.time_ns));
        Ok(places)
    }
}

/// A picture and where its camera stood.
fn photo(sensor: &Sensor, frame: u64, place: &TimedPose, image: toile_capture::ColorImage) -> Option<Photo> {
    let rig_from_color = sensor.rig_from_depth * sensor.color_from_depth.inverse();
    Some(Photo {
        frame,
        camera: sensor.color?,
        camera_from_surface: sensor.color_from_depth * place.pose.inverse(),
        room_from_camera: rig_from_color.rotation,
        image,
    })
}

impl Step for Texturing<'_> {
    type Report = TextureReport;
    const NAME: &'static str = "texture";
    const VERSION: u32 = 1;
    // A turn of 100 frames.
    const SECONDS: f64 = 5.0;

    fn label(&self) -> String {
        self.run.label(&self.layer, "texture")
    }

    fn folder(&self) -> PathBuf {
        self.run.folders.layer(&self.layer)
    }

    fn inputs(&self) -> Result<Vec<PathBuf>, PipelineError> {
        let folders = &self.run.folders;
        let own = [folders.scan(&self.layer), folders.trajectory(&self.layer)];
        Ok(files_of(&folders.take(&self.layer))?.into_iter().chain(own).collect())
    }

    fn settings(&self) -> Result<Value, PipelineError> {
        json::plain(&self.run.settings.texture)
    }

    fn outputs(&self) -> Vec<PathBuf> {
        vec![self.run.folders.textured(&self.layer), self.run.folders.texture_seen(&self.layer)]
    }

    fn work(&self, progress: &(dyn Fn(f32) + Sync)) -> Result<Product<TextureReport>, PipelineError> {
        let path = self.run.folders.take(&self.layer);
        let wrong = |e| PipelineError::stage(&path, e);
        let scan = ply::read(&self.run.folders.scan(&self.layer))?;
        let photos = self.photos(progress)?;
        let settings = TextureSettings {
            size: fitting_size(&scan, &photos, &self.run.settings.texture),
            ..self.run.settings.texture.clone()
        };
        progress(0.12);
        let atlas = unwrap(&scan, &settings).map_err(wrong)?;
        progress(0.15);
        let texture = bake(&scan, &atlas, &photos, &settings, &|at| progress(0.15 + 0.75 * at)).map_err(wrong)?;
        let picture = Picture::Jpeg(texture.to_jpeg().map_err(wrong)?);
        let Atlas { source, triangles, uv, .. } = atlas;
        let mut mesh = scan.gather(&source, triangles);
        mesh.attributes.clear();
        let glb = write_textured(&self.layer, &mesh, &uv, &picture).map_err(|e| PipelineError::stage(&path, e))?;
        let files = self.outputs().into_iter().zip([glb, texture.seen_to_png().map_err(wrong)?]).collect();
        Ok(Product::new(files, texture.report, Vec::new()))
    }
}

/// Whether a PLY file has vertex colours, by its header.
fn has_colors(path: &std::path::Path) -> Result<bool, PipelineError> {
    let mut head = Vec::new();
    open_regular(path)?.take(4096).read_to_end(&mut head).map_err(|e| PipelineError::io(path, e))?;
    Ok(String::from_utf8_lossy(&head).split("end_header").next().is_some_and(|header| header.contains(" red\n")))
}
