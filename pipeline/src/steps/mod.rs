//! The stages, each a step: what it reads and writes, what decides its result, and the one call into the stage's crate.

pub mod cut;
pub mod export;
pub mod fit;
pub mod fuse;
pub mod generic;
pub mod layer_texture;
pub mod page;
pub mod pose;
pub mod read_scan;
pub mod stack;
pub mod texture;
pub mod wear;

use crate::step::Step;

/// Facts about a step that planning needs.
#[derive(Debug, Clone, Copy)]
pub struct StepFacts {
    /// Its name in `report.json`.
    pub name: &'static str,
    /// Its version.
    pub version: u32,
    /// Expected seconds of one run.
    pub seconds: f64,
}

const fn facts<S: Step>() -> StepFacts {
    StepFacts { name: S::NAME, version: S::VERSION, seconds: S::SECONDS }
}

/// All steps of a run in the order in which they work: what a step makes stale comes after it.
pub const STEPS: &[StepFacts] = &[
    facts::<read_scan::ReadScan>(),
    facts::<fuse::Fuse>(),
    facts::<texture::Texturing>(),
    facts::<fit::Fit>(),
    facts::<pose::PoseUnder>(),
    facts::<cut::Cut>(),
    facts::<generic::Generic>(),
    facts::<wear::Wear>(),
    facts::<stack::Stack>(),
    facts::<layer_texture::LayerTexturing>(),
    facts::<export::Export>(),
    facts::<page::Page>(),
];
