//! How the capture stands, for everybody.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The steps of a capture.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum Step {
    /// No camera is open.
    #[default]
    Idle,
    /// The camera is being opened.
    Opening,
    /// Live pictures, nothing is recorded.
    Preview,
    /// A take is recorded.
    Recording,
    /// The take is being closed.
    Finishing,
    /// The take is whole and waits to be accepted.
    Review,
    /// The camera or the disk has failed; `error` says how.
    Failed,
}

/// How the capture stands.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(example = json!({ "state": "recording", "device": "virtual", "subject": "anna", "layer": 0, "name": "body", "type": null,
    "retake": false, "seconds": 4.2, "frames": 126, "fps": 30.0, "dropped": 0, "degrees": 98.0, "turned": false,
    "unseen": ["back", "right side"], "warnings": [], "error": null, "take_file": null, "disk_free_bytes": 81000000000u64, "job_paused": false }))]
pub struct Now {
    /// Its step.
    pub state: Step,
    /// The camera.
    pub device: Option<String>,
    /// The name of the subject's folder.
    pub subject: Option<String>,
    /// The number that the layer has or will have.
    pub layer: Option<usize>,
    /// The name of the layer.
    pub name: Option<String>,
    /// The type of the garment.
    #[serde(rename = "type")]
    pub garment: Option<String>,
    /// It replaces a take.
    pub retake: bool,
    /// Since the recording began.
    pub seconds: f64,
    /// Frames in the file.
    pub frames: u64,
    /// Frames a second that the camera gives.
    pub fps: f64,
    /// Frames that the camera lost in this take.
    pub dropped: u64,
    /// How far the subject has turned.
    pub degrees: f64,
    /// Once round.
    pub turned: bool,
    /// Sides that were not seen yet.
    pub unseen: Vec<String>,
    /// What is to be known of the recorded take.
    pub warnings: Vec<String>,
    /// What has failed, and what to do.
    pub error: Option<String>,
    /// The recording, as long as it waits to be accepted.
    pub take_file: Option<String>,
    /// Room on the disk.
    pub disk_free_bytes: Option<u64>,
    /// A job waits for the take.
    pub job_paused: bool,
}
