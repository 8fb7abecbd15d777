//! Step `fuse`: a take → its scan.
//!
//! Reads a recording (or an importable folder). Writes `scan.ply` and `trajectory.tum`.

use std::{
    io::Read,
    path::{Path, PathBuf},
};

use serde_json::Value;
use toile_capture::{CaptureError, Frame, Rig, Sensor, Source, files::open_regular, import};
use toile_fusion::{FusionReport, FusionSettings, fuse};
use toile_geometry::ply;

use crate::{
    PipelineError, Run, json,
    opened::Opened,
    step::{Product, Remarks, Step},
};

/// What every MCAP file starts with.
const MCAP: &[u8] = b"\x89MCAP0\r\n";

/// Fusing one recording.
pub struct Fuse<'a> {
    /// The run.
    pub run: &'a Run<'a>,
    /// A recording, or an importable folder.
    pub recording: PathBuf,
    /// Folder of the files.
    pub folder: PathBuf,
    /// The name of the take.
    pub name: String,
    /// How it is fused.
    pub settings: &'a FusionSettings,
}

impl<'a> Fuse<'a> {
    /// Fusing a take of the run's subject.
    pub fn of_layer(run: &'a Run<'a>, layer: &str) -> Self {
        let (recording, folder) = (run.folders.take(layer), run.folders.layer(layer));
        Self { run, recording, folder, name: layer.to_string(), settings: &run.settings.fusion }
    }
}

impl Step for Fuse<'_> {
    type Report = FusionReport;
    const NAME: &'static str = "fuse";
    const VERSION: u32 = 6;
    // A turn of 100 frames.
    const SECONDS: f64 = 9.0;

    fn label(&self) -> String {
        self.run.label(&self.name, "fuse")
    }

    fn folder(&self) -> PathBuf {
        self.folder.clone()
    }

    fn inputs(&self) -> Result<Vec<PathBuf>, PipelineError> {
        files_of(&self.recording)
    }

    fn settings(&self) -> Result<Value, PipelineError> {
        json::plain(self.settings)
    }

    fn outputs(&self) -> Vec<PathBuf> {
        vec![self.folder.join("scan.ply"), self.folder.join("trajectory.tum")]
    }

    fn work(&self, progress: &(dyn Fn(f32) + Sync)) -> Result<Product<FusionReport>, PipelineError> {
        let Opened { source, mut lost, dropped } = Opened::new(&self.recording, None)?;
        let wrong = |e| PipelineError::stage(&self.recording, e);
        let mut source = Looked { source, damaged: 0 };
        let scan = fuse(&mut source, self.settings, progress).map_err(wrong)?;
        if source.damaged > 0 {
            lost.push(format!("{}: the colour image of {} frames is damaged", self.name, source.damaged));
        }
        let mut warnings: Vec<String> = scan.report.warnings.iter().map(|w| format!("{}: {w}", self.name)).collect();
        let assumed = source.rig().sensors.iter().take(1).filter_map(Sensor::assumption);
        warnings.extend(assumed.map(|sentence| format!("{}: {sentence}", self.name)));
        if dropped > 0 {
            warnings.push(format!("{}: {dropped} frames never arrived while recording", self.name));
        }
        let contents = [ply::encode(&scan.mesh), scan.trajectory_tum().into_bytes()];
        Ok(Product {
            files: self.outputs().into_iter().zip(contents).collect(),
            timings: json::plain(&scan.timings)?,
            report: scan.report,
            remarks: Remarks { warnings, lost, ..Remarks::default() },
        })
    }
}

/// The files that make a recording: itself, or those of a folder that its layout reads. What a file is, is seen from its
/// first bytes, before all of it is hashed.
pub(super) fn files_of(recording: &Path) -> Result<Vec<PathBuf>, PipelineError> {
    if recording.is_dir() {
        return Ok(import::files(recording)?);
    }
    let mut head = Vec::new();
    let file = open_regular(recording)?;
    file.take(MCAP.len() as u64).read_to_end(&mut head).map_err(|e| PipelineError::io(recording, e))?;
    if head != MCAP {
        return Err(PipelineError::format(recording, "is not a recording: it does not start as an MCAP file does"));
    }
    Ok(vec![recording.to_path_buf()])
}

/// A source that counts the colour images that are damaged.
struct Looked {
    source: Box<dyn Source>,
    damaged: u64,
}

impl Source for Looked {
    fn rig(&self) -> &Rig {
        self.source.rig()
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        let frame = self.source.next_frame()?;
        let color = frame.as_ref().and_then(|frame| frame.color.as_ref());
        self.damaged += u64::from(color.is_some_and(|color| !color.is_sound()));
        Ok(frame)
    }

    fn frame_count(&self) -> Option<u64> {
        self.source.frame_count()
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, os::unix::fs::symlink};

    use super::*;

    #[test]
    fn of_a_folder_only_what_its_layout_reads_is_hashed_and_no_loop_is_followed() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("take");
        fs::create_dir_all(folder.join("depth")).unwrap();
        fs::create_dir_all(folder.join("more/deep")).unwrap();
        symlink(&folder, folder.join("more/loop")).unwrap();
        symlink("..", folder.join("up")).unwrap();
        let camera = r#"{"width": 4, "height": 4, "fx": 4, "fy": 4, "cx": 2, "cy": 2, "depth_scale": 0.001}"#;
        for (name, text) in
            [("depth/0.png", ""), ("more/deep/0.png", ""), ("notes.txt", ""), ("../camera.json", camera)]
        {
            fs::write(folder.join(name), text).unwrap();
        }
        let mut expected = ["depth/0.png", "notes.txt"].map(|name| folder.join(name)).to_vec();
        expected.push(dir.path().join("camera.json"));
        expected.sort();
        assert_eq!(files_of(&folder).unwrap(), expected);
        let huge = dir.path().join("huge.mcap");
        fs::File::create(&huge).unwrap().set_len(1 << 41).unwrap();
        assert!(files_of(&huge).unwrap_err().to_string().contains("is not a recording"));
        assert!(crate::meshes::check_kind(&huge).unwrap_err().to_string().contains("at most"));
    }
}
