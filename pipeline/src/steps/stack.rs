//! Step `stack`: every garment outside the body and all garments below it.
//!
//! Reads the body and each `unstacked.ply`. Writes each `garment.ply`, in scan 0's pose and frame, with its skin weights
//! as vertex attributes; layers that lie close over one another have like weights.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use toile_character::SkinWeights;
use toile_garments::{FREE_PART, LayerReport, Part, PressReport, carry_weights, press_in, stack};
use toile_geometry::{Mesh, ply};

use crate::{
    PipelineError, Run,
    body_file::Body,
    garment::Garment,
    json,
    meshes::{encode_skinned, read_mesh, read_skinned},
    step::{Product, Step},
};

/// Stacking all garments.
pub struct Stack<'a> {
    /// The run.
    pub run: &'a Run<'a>,
    /// The body.
    pub body: &'a Body,
    /// The garments, inside to outside.
    pub garments: &'a [Garment],
    /// What gives way where a garment is too tight for the body.
    pub part: Part,
}

/// The decisions of stacking, by garment from inside to outside.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Stacked {
    /// How each was moved.
    pub layers: Vec<LayerReport>,
    /// Share of each one's vertices that hang free of the body, where it is a skirt or dress.
    pub free_share: Vec<Option<f32>>,
    /// How the body gave way, where it was to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressed: Option<PressReport>,
}

impl Step for Stack<'_> {
    type Report = Stacked;
    const NAME: &'static str = "stack";
    const VERSION: u32 = 8;
    // A garment.
    const SECONDS: f64 = 1.5;

    fn label(&self) -> String {
        self.run.label("layers", "stack")
    }

    fn folder(&self) -> PathBuf {
        self.run.folders.layers()
    }

    fn inputs(&self) -> Result<Vec<PathBuf>, PipelineError> {
        let folders = &self.run.folders;
        let of_body = [folders.body_mesh(), folders.body_json(), folders.pose(self.run.first_layer())];
        Ok(of_body.into_iter().chain(self.garments.iter().map(|g| g.unstacked(folders))).collect())
    }

    fn settings(&self) -> Result<Value, PipelineError> {
        let mut settings =
            json!({ "stack": json::plain(&self.run.settings.stack)?, "garments": json::plain(&self.garments)? });
        if self.part == Part::Body {
            settings["part"] = json::plain(&self.part)?;
        }
        Ok(settings)
    }

    fn outputs(&self) -> Vec<PathBuf> {
        let pressed = (self.part == Part::Body).then(|| self.run.folders.pressed_body());
        self.garments.iter().map(|g| self.run.folders.garment(&g.layer)).chain(pressed).collect()
    }

    fn seconds(&self) -> f64 {
        Self::SECONDS * self.garments.len() as f64
    }

    fn work(&self, progress: &(dyn Fn(f32) + Sync)) -> Result<Product<Stacked>, PipelineError> {
        let folders = &self.run.folders;
        let mut body_mesh = read_mesh(&folders.body_mesh())?;
        let read = self.garments.iter().map(|g| read_skinned(&g.unstacked(folders)));
        let (mut layers, mut weights): (Vec<Mesh>, Vec<SkinWeights>) =
            read.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        let thickness: Vec<f32> = self.garments.iter().map(|g| g.thickness).collect();
        let wrong = |e| PipelineError::stage(&folders.layers(), e);
        let gap = |thickness: &f32| self.run.settings.stack.gap_of(*thickness);
        let pressed = match self.part {
            Part::Cloth => None,
            Part::Body => Some(press_in(&mut body_mesh, &layers, &thickness.iter().map(gap).collect::<Vec<_>>())),
        };
        let report = stack(&body_mesh, &mut layers, &thickness, &self.run.settings.stack, progress).map_err(wrong)?;
        carry_weights(&layers, &mut weights, &self.body.skinned.skeleton, &self.body.pose0).map_err(wrong)?;
        let encoded = layers.iter().zip(&weights).map(|(mesh, weights)| encode_skinned(mesh, weights));
        let files = self.outputs().into_iter().zip(encoded.chain([ply::encode(&body_mesh)])).collect();
        let said = self.garments.iter().zip(&report.layers).flat_map(|(g, report)| warnings(&g.name, report)).collect();
        let free_share = layers.iter().map(free_share).collect();
        Ok(Product::new(files, Stacked { layers: report.layers, free_share, pressed }, said))
    }
}

/// Share of a skirt's or dress's vertices that hang free of the body.
fn free_share(mesh: &Mesh) -> Option<f32> {
    let free = mesh.attributes.get(FREE_PART)?;
    Some(free.iter().sum::<f32>() / free.len().max(1) as f32)
}

/// Places to look at in the pose of the scans.
fn warnings(layer: &str, report: &LayerReport) -> Vec<String> {
    let (pairs, cut, [before, after]) = (report.crossing_pairs, report.cut_triangles, report.self_crossings);
    let found = [
        (pairs > 0, format!("{pairs} pairs of triangles still cut through a layer below")),
        (cut > 0, format!("{cut} triangles were cut out because they crossed a layer below")),
        (after > before, format!("stacking left {after} pairs of its triangles crossing each other, {before} before")),
    ];
    found.into_iter().filter(|(is_so, _)| *is_so).map(|(_, what)| format!("{layer}: {what}")).collect()
}
