//! Shared by the black-box tests.

#![allow(dead_code, clippy::unwrap_used)] // each test file uses its own part; all of it is test code

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use image::{ImageBuffer, Luma, Rgb};
use serde_json::Value;

/// The program.
pub fn toile() -> Command {
    Command::new(env!("CARGO_BIN_EXE_toile"))
}

/// Runs a command with `--json` and gives its one document, after checking the exit code.
pub fn exits(code: i32, command: &mut Command) -> Value {
    let has_json = command.get_args().any(|word| word.to_string_lossy().contains("--json"));
    if !has_json {
        command.arg("--json");
    }
    let done = command.output().unwrap();
    let (out, err) = (String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert_eq!(done.status.code(), Some(code), "{command:?}\n{out}\n{err}");
    assert!(!err.contains("panicked"), "{err}");
    serde_json::from_str(&out).unwrap_or_else(|e| panic!("{e}: {out}"))
}

/// A small folder recording, and a subject folder beside it that does not exist yet.
pub struct Recording {
    dir: tempfile::TempDir,
    width: u32,
    height: u32,
}

impl Recording {
    /// `depth` depth and `color` colour images of a slope.
    pub fn new(depth: usize, color: usize) -> Self {
        Self::made([64, 48], depth, color, |_, u, v| (1000 + u + v) as u16)
    }

    /// Frames that do not compress: about 0.6 MB each.
    pub fn with_noise(frames: usize) -> Self {
        Self::made([640, 480], frames, frames, |i, u, v| {
            let mut seed = (i as u32 * 7919 + v * 1009 + u).wrapping_mul(2_654_435_761);
            for shift in [15, 13, 16] {
                seed = (seed ^ (seed >> shift)).wrapping_mul(2_246_822_519);
            }
            (500 + (seed >> 8) % 8000) as u16
        })
    }

    fn made([width, height]: [u32; 2], depth: usize, color: usize, value: impl Fn(usize, u32, u32) -> u16) -> Self {
        let recording = Self { dir: tempfile::tempdir().unwrap(), width, height };
        let folder = recording.folder();
        for name in ["depth", "color"] {
            fs::create_dir_all(folder.join(name)).unwrap();
        }
        for i in 0..depth {
            let image = ImageBuffer::from_fn(width, height, |u, v| Luma([value(i, u, v)]));
            image.save(folder.join(format!("depth/{i:06}.png"))).unwrap();
        }
        for i in 0..color {
            let image = ImageBuffer::from_fn(width, height, |u, v| Rgb([u as u8, v as u8, i as u8]));
            image.save(folder.join(format!("color/{i:06}.png"))).unwrap();
        }
        if depth > 0 {
            let times: String = (0..depth).map(|i| format!("{}\n", 1_000_000_000 + i as u64 * 33_333_333)).collect();
            fs::write(folder.join("timestamps.txt"), times).unwrap();
            recording.write_camera(&recording.camera());
        }
        recording
    }

    fn camera(&self) -> Value {
        serde_json::json!({
            "width": self.width, "height": self.height, "fx": 60.0, "fy": 60.0, "cx": 32.0, "cy": 24.0,
            "depth_scale": 0.001, "fps": 30.0, "distortion": [0, 0, 0, 0, 0]
        })
    }

    fn write_camera(&self, camera: &Value) {
        fs::write(self.folder().join("camera.json"), camera.to_string()).unwrap();
    }

    /// Puts another value (JSON) into a field of camera.json, or takes the field away.
    pub fn set_camera(&self, field: &str, value: Option<&str>) {
        let mut camera = self.camera();
        let fields = camera.as_object_mut().unwrap();
        match value {
            Some(value) => fields.insert(field.into(), serde_json::from_str(value).unwrap()),
            None => fields.remove(field),
        };
        self.write_camera(&camera);
    }

    /// The recorded folder.
    pub fn folder(&self) -> PathBuf {
        self.dir.path().join("recording")
    }

    /// The subject's folder.
    pub fn subject(&self) -> PathBuf {
        self.dir.path().join("anna")
    }

    /// Words of the command that imports the folder as `layer`.
    pub fn import(&self, layer: &str) -> Vec<String> {
        let text = |p: PathBuf| p.to_str().unwrap().to_string();
        let (folder, subject) = (text(self.folder()), text(self.subject()));
        ["import", &folder, "--subject", &subject, "--layer", layer, "--json"].map(String::from).to_vec()
    }

    /// True when there is no take, finished or not, of the subject.
    pub fn nothing_was_written(&self) -> bool {
        let count = |p: &Path| fs::read_dir(p).map_or(0, Iterator::count);
        count(&self.subject().join("takes")) == 0
    }
}

/// A copy of a subject's recordings, without what was built.
pub fn copy_takes(from: &Path, to: &Path) {
    fs::create_dir_all(to.join("takes")).unwrap();
    fs::copy(from.join("subject.toml"), to.join("subject.toml")).unwrap();
    for take in fs::read_dir(from.join("takes")).unwrap().flatten() {
        fs::copy(take.path(), to.join("takes").join(take.file_name())).unwrap();
    }
}

/// Every file below a folder whose name ends so.
pub fn files_ending(folder: &Path, end: &str) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let inside = |path: PathBuf| if path.is_dir() { files_ending(&path, end) } else { vec![path] };
    entries.flatten().flat_map(|e| inside(e.path())).filter(|p| p.to_string_lossy().ends_with(end)).collect()
}
