//! A job: one piece of heavy work on one subject.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::error::Refusal;

/// The kinds of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Everything from recorded takes to avatar and report, as `toile process`.
    Process,
    /// A layer again after an edit, with the stack of all layers.
    Rebuild,
    /// The layers through a motion, as `toile animate`.
    Animate,
    /// The avatar's files, as `toile export`.
    Export,
}

/// How a job stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum JobState {
    /// It waits for its turn.
    Queued,
    /// It is at work.
    Running,
    /// It is done.
    Done,
    /// It has failed; `error` says why.
    Failed,
    /// It was cancelled.
    Cancelled,
}

impl JobState {
    /// True once nothing more happens.
    pub fn is_over(self) -> bool {
        matches!(self, Self::Done | Self::Failed | Self::Cancelled)
    }
}

/// Options of a job; each kind knows some of them, and none is needed but `layer` for `rebuild`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct JobOptions {
    /// rebuild: the number of the layer.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1, maximum = 99)]
    pub layer: Option<usize>,
    /// process: the first take shows the person dressed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dressed: Option<bool>,
    /// process, animate: the motion; `walk` is the one that ships with Toile.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionName>,
    /// animate: frames a second, 1 to 480.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1, maximum = 480)]
    pub fps: Option<f64>,
    /// animate: by skin weights alone, or with cloth where it hangs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blend: Option<BlendName>,
    /// export: the names of the joints in `avatar.glb`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint_names: Option<NamesName>,
    /// export: leave out triangles that clothes hide.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cull_hidden: Option<bool>,
}

/// Motions by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum MotionName {
    /// The shipped walk.
    Walk,
}

/// How layers follow the skeleton.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum BlendName {
    /// By skin weights alone.
    Skinning,
    /// With cloth where it hangs.
    Anchored,
}

/// Systems of joint names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum NamesName {
    /// As VRM names its bones.
    Vrm,
    /// By H-Anim.
    Hanim,
    /// As Mixamo does.
    Mixamo,
}

/// What is asked for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "kind": "process", "subject": "anna", "options": {} }))]
pub struct NewJob {
    /// The kind of work.
    pub kind: Kind,
    /// The name of the subject's folder.
    pub subject: String,
    /// How it is to be done.
    #[serde(default)]
    pub options: JobOptions,
}

impl NewJob {
    /// Checks what would fail only later.
    ///
    /// # Errors
    /// 422 with what is missing or out of range.
    pub fn check(&self) -> Result<(), Refusal> {
        let options = &self.options;
        match self.kind {
            Kind::Rebuild if options.layer.is_none_or(|layer| layer == 0) => Err(Refusal::unusable(
                "`options.layer`: the number of a garment's layer, 1 or more, is needed to rebuild it",
            )),
            Kind::Animate if options.fps.is_some_and(|fps| !(1.0..=480.0).contains(&fps)) => {
                Err(Refusal::unusable("`options.fps`: frames a second must be a number from 1 to 480"))
            }
            _ => Ok(()),
        }
    }
}

/// A job as it stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(example = json!({ "id": 7, "kind": "process", "subject": "anna", "state": "running", "progress": 0.4, "step": "anna 01-trousers: fuse",
    "seconds_left": 12.0, "created": 1796000000.0, "started": 1796000001.0, "ended": null, "error": null, "paused": false,
    "warnings": 0, "attempt": 1, "options": {} }))]
pub struct Job {
    /// Its number.
    pub id: i64,
    /// The kind of work.
    pub kind: Kind,
    /// The name of the subject's folder.
    pub subject: String,
    /// How it stands.
    pub state: JobState,
    /// How much of it is done, 0 to 1; `null` before it begins.
    pub progress: Option<f64>,
    /// What it does now, or what it waits for.
    pub step: Option<String>,
    /// Seconds that it will still take, where that can be told.
    pub seconds_left: Option<f64>,
    /// When it was asked for, Unix seconds.
    pub created: f64,
    /// When it began, Unix seconds.
    pub started: Option<f64>,
    /// When it ended, Unix seconds.
    pub ended: Option<f64>,
    /// Why it failed.
    pub error: Option<String>,
    /// True while it waits because a take is being recorded.
    pub paused: bool,
    /// How many warnings, losses and failures there were.
    pub warnings: u64,
    /// How often it was begun.
    pub attempt: u64,
    /// How it is done.
    pub options: JobOptions,
}
