//! Step `generic`: a generic garment in the shape of the one that was cut out of a take, where that is asked for.
//!
//! Reads `unstacked.ply` and the body. Writes `generic.ply`, in the same pose and frame, with its skin weights: the vertices and triangles
//! are those of the generic garment, the same for every subject. Types that have none stay as they were cut.

use std::{fs, path::PathBuf};

use serde_json::{Value, json};
use toile_character::BodyModel;
use toile_garments::{ConformedReport, Person, conform_generic};

use crate::{
    PipelineError, Run,
    body_file::Body,
    garment::Garment,
    meshes::{encode_skinned, read_skinned},
    step::{Product, Step},
};

/// Conforming a generic garment to one that was cut.
pub struct Generic<'a> {
    /// The run.
    pub run: &'a Run<'a>,
    /// The garment that was cut.
    pub garment: &'a Garment,
    /// The subject's body.
    pub body: &'a Body,
    /// The statistical model.
    pub model: &'a BodyModel,
}

impl Step for Generic<'_> {
    /// `None` for a type of garment that has no generic one.
    type Report = Option<ConformedReport>;
    const NAME: &'static str = "generic";
    const VERSION: u32 = 1;
    const SECONDS: f64 = 4.0;

    fn label(&self) -> String {
        self.run.label(&self.garment.layer, "generic")
    }

    fn folder(&self) -> PathBuf {
        self.run.folders.layer(&self.garment.layer)
    }

    fn inputs(&self) -> Result<Vec<PathBuf>, PipelineError> {
        let folders = &self.run.folders;
        let of_body = [folders.body_rest(), folders.body_json(), folders.pose(self.run.first_layer())];
        Ok(of_body.into_iter().chain([folders.unstacked(&self.garment.layer)]).collect())
    }

    fn settings(&self) -> Result<Value, PipelineError> {
        Ok(json!({ "type": self.garment.garment_type }))
    }

    fn outputs(&self) -> Vec<PathBuf> {
        vec![self.run.folders.generic(&self.garment.layer)]
    }

    fn work(&self, _: &(dyn Fn(f32) + Sync)) -> Result<Product<Self::Report>, PipelineError> {
        let (garment, path) = (self.garment, self.run.folders.unstacked(&self.garment.layer));
        let (scanned, _) = read_skinned(&path)?;
        let person = Person { body: &self.body.skinned, pose: &self.body.pose0 };
        let found = conform_generic(&scanned, garment.garment_type, person, self.model)
            .map_err(|e| PipelineError::stage(&path, e))?;
        let (bytes, report, said) = if let Some(found) = found {
            (encode_skinned(&found.mesh, &found.weights), Some(found.report), Vec::new())
        } else {
            let (name, kind) = (&garment.name, garment.garment_type);
            let said = format!("{name}: there is no generic garment of type {kind}; it stays as it was cut");
            (fs::read(&path).map_err(|e| PipelineError::io(&path, e))?, None, vec![said])
        };
        let files = self.outputs().into_iter().map(|path| (path, bytes.clone())).collect();
        Ok(Product::new(files, report, said))
    }
}
