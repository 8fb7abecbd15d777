//! Where a subject's files lie.

use std::path::{Path, PathBuf};

use toile_capture::files::is_there;

/// A subject's folder and what is in it.
#[derive(Debug, Clone)]
pub struct Folders {
    /// The subject's folder.
    pub root: PathBuf,
}

impl Folders {
    /// Of the subject at `root`.
    pub fn new(root: &Path) -> Self {
        Self { root: root.to_path_buf() }
    }

    /// Name, date, rig and layers of the subject.
    pub fn subject_toml(&self) -> PathBuf {
        self.root.join("subject.toml")
    }

    /// The recording of a take.
    pub fn take(&self, layer: &str) -> PathBuf {
        self.root.join("takes").join(format!("{layer}.mcap"))
    }

    /// The folder of a take that is a finished scan; `None` where it is a recording.
    pub fn scan_take(&self, layer: &str) -> Option<PathBuf> {
        let folder = self.root.join("takes").join(format!("{layer}.scan"));
        (!is_there(&self.take(layer)) && folder.is_dir()).then_some(folder)
    }

    /// The camera's way in the scan of a take; a finished scan has none.
    pub fn trajectory(&self, layer: &str) -> PathBuf {
        self.layer(layer).join("trajectory.tum")
    }

    /// Everything that can be built again.
    pub fn build(&self) -> PathBuf {
        self.root.join("build")
    }

    /// The results built from one take, such as `01-trousers`.
    pub fn layer(&self, layer: &str) -> PathBuf {
        self.build().join(layer)
    }

    /// The fused scan of a take.
    pub fn scan(&self, layer: &str) -> PathBuf {
        self.layer(layer).join("scan.ply")
    }

    /// The scan of a take with its texture; there is none without colour pictures.
    pub fn textured(&self, layer: &str) -> PathBuf {
        self.layer(layer).join("textured.glb")
    }

    /// What of the texture was seen: 255 where a picture shows it, 128 where it was filled, 0 between charts.
    pub fn texture_seen(&self, layer: &str) -> PathBuf {
        self.layer(layer).join("texture-seen.png")
    }

    /// Pose of the body in a take's scan.
    pub fn pose(&self, layer: &str) -> PathBuf {
        self.layer(layer).join("pose.json")
    }

    /// The body posed inside a take's scan.
    pub fn posed_body(&self, layer: &str) -> PathBuf {
        self.layer(layer).join("body.ply")
    }

    /// Corrections by hand of a layer; there need not be any.
    pub fn edits(&self, layer: &str) -> PathBuf {
        self.root.join("edits").join(format!("{layer}.json"))
    }

    /// The file of the choices that the avatar was made with; there need not be any.
    pub fn avatar_choice(&self) -> PathBuf {
        self.root.join("edits").join("avatar.json")
    }

    /// Motions that were chosen for the avatar.
    pub fn motions(&self) -> PathBuf {
        self.root.join("edits").join("motion")
    }

    /// The garment as it was cut, in the take's own pose and frame.
    pub fn cut(&self, layer: &str) -> PathBuf {
        self.layer(layer).join("cut.ply")
    }

    /// The garment in the common frame before stacking, with its skin weights as vertex attributes.
    pub fn unstacked(&self, layer: &str) -> PathBuf {
        self.layer(layer).join("unstacked.ply")
    }

    /// A generic garment in its shape, before stacking; only where those are asked for.
    pub fn generic(&self, layer: &str) -> PathBuf {
        self.layer(layer).join("generic.ply")
    }

    /// The garment in the common frame, over all layers below.
    pub fn garment(&self, layer: &str) -> PathBuf {
        self.layer(layer).join("garment.ply")
    }

    /// Everything that is worn without having been scanned.
    pub fn all_worn(&self) -> PathBuf {
        self.root.join("worn")
    }

    /// One garment of those.
    pub fn worn(&self, label: &str) -> PathBuf {
        self.all_worn().join(label)
    }

    /// What is noted about it.
    pub fn worn_json(&self, label: &str) -> PathBuf {
        self.worn(label).join("worn.json")
    }

    /// The garment as it is in [`Folders::garment`], with a texture of its own; there is none without colour pictures.
    pub fn garment_layer(&self, layer: &str) -> PathBuf {
        self.layer(layer).join("layer.glb")
    }

    /// The same of the body, on the places that its template has in all textures.
    pub fn body_layer(&self) -> PathBuf {
        self.body().join("layer.glb")
    }

    /// The fitted body.
    pub fn body(&self) -> PathBuf {
        self.build().join("body")
    }

    /// The conformed body in scan 0's pose and frame.
    pub fn body_mesh(&self) -> PathBuf {
        self.body().join("body.ply")
    }

    /// The conformed body at rest.
    pub fn body_rest(&self) -> PathBuf {
        self.body().join("rest.ply")
    }

    /// Measurements, joints, shape and pose of the body.
    pub fn body_json(&self) -> PathBuf {
        self.body().join("body.json")
    }

    /// Measurements by ISO 8559-1.
    pub fn measurements(&self) -> PathBuf {
        self.body().join("measurements.json")
    }

    /// The body standing straight, as it was measured.
    pub fn standing(&self) -> PathBuf {
        self.body().join("standing.ply")
    }

    /// Where the stages over all layers keep their records.
    pub fn layers(&self) -> PathBuf {
        self.build().join("layers")
    }

    /// The body with what crossed a garment moved inwards; only where that is asked for.
    pub fn pressed_body(&self) -> PathBuf {
        self.layers().join("body.ply")
    }

    /// Where writing the deliverables keeps its record.
    pub fn avatar(&self) -> PathBuf {
        self.build().join("avatar")
    }

    /// The avatar with its motion.
    pub fn glb(&self) -> PathBuf {
        self.root.join("avatar.glb")
    }

    /// The avatar in a T-pose.
    pub fn vrm(&self) -> PathBuf {
        self.root.join("avatar.vrm")
    }

    /// The avatar in another format, such as `obj`.
    pub fn avatar_as(&self, extension: &str) -> PathBuf {
        self.root.join(format!("avatar.{extension}"))
    }

    /// A layer of the avatar, alone.
    pub fn avatar_layer(&self, layer: &str) -> PathBuf {
        self.root.join(format!("avatar-{layer}.ply"))
    }

    /// The page for the operator.
    pub fn report(&self) -> PathBuf {
        self.root.join("report.html")
    }
}
