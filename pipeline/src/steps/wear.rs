//! Step `wear`: a garment that the subject was not scanned in, put on its body.
//!
//! Reads the garment, the body that it was cut from, and the subject's own. Writes `unstacked.ply`: the garment in the pose of the
//! first scan, resized, with its skin weights, as the garments of takes lie there before they are stacked.

use std::path::PathBuf;

use serde_json::{Value, json};
use toile_character::BodyModel;
use toile_garments::{Person, wear};

use crate::{
    PipelineError, Run,
    body_file::Body,
    meshes::encode_skinned,
    step::{Product, Step},
    worn::WornGarment,
};

/// Putting on one garment.
pub struct Wear<'a> {
    /// The run.
    pub run: &'a Run<'a>,
    /// The garment.
    pub worn: &'a WornGarment,
    /// The subject's body.
    pub body: &'a Body,
    /// The statistical model.
    pub model: &'a BodyModel,
}

impl Step for Wear<'_> {
    type Report = Value;
    const NAME: &'static str = "wear";
    const VERSION: u32 = 1;
    const SECONDS: f64 = 2.0;

    fn label(&self) -> String {
        self.run.label(&self.worn.label, "wear")
    }

    fn folder(&self) -> PathBuf {
        self.run.folders.layer(&self.worn.label)
    }

    fn inputs(&self) -> Result<Vec<PathBuf>, PipelineError> {
        let folders = &self.run.folders;
        let of_body = [folders.body_rest(), folders.body_json(), folders.pose(self.run.first_layer())];
        Ok(self.worn.files(folders).into_iter().chain(of_body).collect())
    }

    fn settings(&self) -> Result<Value, PipelineError> {
        Ok(Value::Null)
    }

    fn outputs(&self) -> Vec<PathBuf> {
        vec![self.run.folders.unstacked(&self.worn.label)]
    }

    fn work(&self, _: &(dyn Fn(f32) + Sync)) -> Result<Product<Value>, PipelineError> {
        let folders = &self.run.folders;
        let cloth = self.worn.cloth(folders, self.model)?;
        let from = Person { body: &cloth.body, pose: &cloth.pose };
        let to = Person { body: &self.body.skinned, pose: &self.body.pose0 };
        let mesh = wear(&cloth.mesh, &cloth.weights, self.worn.file.garment_type, from, to)
            .map_err(|e| PipelineError::stage(&folders.worn(&self.worn.label), e))?;
        let area = |mesh: &toile_geometry::Mesh| (mesh.area() * 1e4).round() * 1e-4;
        let report = json!({ "source": self.worn.file.source, "area_m2": [area(&cloth.mesh), area(&mesh)] });
        let files = self.outputs().into_iter().map(|path| (path, encode_skinned(&mesh, &cloth.weights))).collect();
        Ok(Product::new(files, report, Vec::new()))
    }
}
