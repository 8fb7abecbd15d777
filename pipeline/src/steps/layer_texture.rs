//! Step `layer-texture`: a layer of the avatar with a texture of its own, carried over from the scan of the take in which it was seen.
//!
//! For a garment reads `cut.ply`, `garment.ply` and the textured scan of its take; for the body `body.ply` and the textured scan of the first
//! take. Writes `layer.glb`, the layer in scan 0's pose and frame, and `layer-seen.png`, which says what was seen and what was filled.

use std::{fs, path::PathBuf};

use serde_json::{Value, json};
use toile_avatar::{Picture, write_textured};
use toile_capture::files::is_there;
use toile_character::BodyModel;
use toile_geometry::{Mesh, bvh::Bvh};
use toile_texture::{Atlas, CarrySettings, Texture, TextureReport, TextureSettings, carry, unwrap};

use crate::{
    PipelineError, Run,
    garment::Garment,
    json,
    meshes::{read_mesh, read_skinned},
    scan_texture::ScanTexture,
    step::{Product, Step},
    template_atlas::{PADDING, template_atlas},
};

/// A cut garment lies on the scan that it was cut out of but for what smoothing its rim moved, metres.
const ON_SCAN: f32 = 0.005;
/// The body lies on the bare scan but where that is closed or smoothed over, as between fingers, metres.
const ON_SKIN: f32 = 0.02;
/// What is nearer to a cut garment than this is its cloth, metres: half of the edges that it was meshed with.
const IS_CLOTH: f32 = 0.003;
/// Share of a texture that charts of a layer cover, about.
const COVERED: f64 = 0.55;
/// Most colours of a picture that is kept as PNG: it is plain, and a JPEG of it would be larger and less exact.
const PLAIN: usize = 64;

/// Giving one layer its texture.
pub struct LayerTexturing<'a> {
    run: &'a Run<'a>,
    model: &'a BodyModel,
    /// Folder name of the take that the layer was seen in.
    take: String,
    is_body: bool,
}

impl<'a> LayerTexturing<'a> {
    /// The body and all garments that were cut out of a take with a texture. What an earlier run made of the others (generic garments, those of
    /// other people) goes; they keep colours of their vertices.
    ///
    /// # Errors
    /// [`PipelineError`] where an old file cannot be removed.
    pub fn of_layers(run: &'a Run<'a>, model: &'a BodyModel, garments: &[Garment]) -> Result<Vec<Self>, PipelineError> {
        let of = |take: &str, is_body| Self { run, model, take: take.to_string(), is_body };
        let body = (of(run.first_layer(), true), true);
        let garments = garments.iter().map(|g| (of(&g.layer, false), g.number.is_some() && !g.is_generic));
        let has_texture =
            |step: &Self| run.settings.texture.size > 0 && ScanTexture::is_there(&run.folders, &step.take);
        let (textured, others): (Vec<_>, Vec<_>) =
            std::iter::once(body).chain(garments).partition(|(step, is_cut)| *is_cut && has_texture(step));
        let [textured, others] =
            [textured, others].map(|steps| steps.into_iter().map(|(step, _)| step).collect::<Vec<Self>>());
        let old: Vec<PathBuf> = others.iter().flat_map(Step::outputs).filter(|path| is_there(path)).collect();
        for path in old {
            fs::remove_file(&path).map_err(|e| PipelineError::io(&path, e))?;
        }
        Ok(textured)
    }

    /// The layer in scan 0's pose and frame; the same where its take saw it; how far both may lie apart.
    fn meshes(&self) -> Result<(Mesh, Mesh, f32), PipelineError> {
        let folders = &self.run.folders;
        if self.is_body {
            let body = read_mesh(&folders.body_mesh())?;
            return Ok((body.clone(), body, ON_SKIN));
        }
        let (path, cut) = (folders.garment(&self.take), read_mesh(&folders.cut(&self.take))?);
        let (garment, _) = read_skinned(&path)?;
        if cut.positions.len() != garment.positions.len() {
            return Err(PipelineError::format(&path, "has other vertices than cut.ply; delete it and run again"));
        }
        let seen = Mesh { positions: cut.positions, ..garment.clone() };
        Ok((garment, seen, ON_SCAN))
    }

    /// The scan with its texture. What it shows of clothes is not the body's.
    fn scan(&self) -> Result<ScanTexture, PipelineError> {
        let mut scan = ScanTexture::read(&self.run.folders, &self.take)?;
        if let Some(path) = self.clothes() {
            let cut = read_mesh(&path)?;
            let bvh = Bvh::new(&cut.positions, &cut.triangles);
            let near: Vec<bool> = scan.mesh.positions.iter().map(|p| bvh.closest(p, IS_CLOTH).is_some()).collect();
            let is_bare = |t: &[u32; 3]| !t.iter().any(|&v| near[v as usize]);
            scan.is_usable = scan.mesh.triangles.iter().map(is_bare).collect();
        }
        Ok(scan)
    }

    /// The clothes that the first take shows on the body, where it is dressed.
    fn clothes(&self) -> Option<PathBuf> {
        let path = self.run.folders.cut(&self.take);
        (self.is_body && self.run.is_first_dressed() && is_there(&path)).then_some(path)
    }

    /// The atlas of a layer, as fine as the scan's texture.
    fn atlas(&self, mesh: &Mesh, texel: f64) -> Result<Atlas, PipelineError> {
        let wrong = |e| PipelineError::stage(&self.folder(), e);
        let most = self.run.settings.texture.size;
        let is_fine = |size: &u32| (mesh.area() / COVERED).sqrt() / f64::from(*size) <= texel;
        let size = TextureSettings::SIZES.into_iter().filter(|s| *s <= most).find(is_fine).unwrap_or(most);
        if self.is_body {
            return template_atlas(self.model, size).map_err(wrong);
        }
        let padding = self.run.settings.texture.padding.max(PADDING);
        let settings = TextureSettings { size, padding, ..self.run.settings.texture.clone() };
        Ok(unwrap(mesh, &settings).map_err(wrong)?.in_order(mesh.positions.len()))
    }
}

impl Step for LayerTexturing<'_> {
    type Report = TextureReport;
    const NAME: &'static str = "layer-texture";
    const VERSION: u32 = 1;
    const SECONDS: f64 = 2.0;

    fn label(&self) -> String {
        self.run.label(if self.is_body { "body" } else { &self.take }, "layer's texture")
    }

    fn folder(&self) -> PathBuf {
        if self.is_body { self.run.folders.body() } else { self.run.folders.layer(&self.take) }
    }

    fn inputs(&self) -> Result<Vec<PathBuf>, PipelineError> {
        let folders = &self.run.folders;
        let scan = [folders.textured(&self.take), folders.texture_seen(&self.take)];
        let own = if self.is_body {
            vec![folders.body_mesh()]
        } else {
            vec![folders.cut(&self.take), folders.garment(&self.take)]
        };
        Ok(scan.into_iter().chain(own).chain(self.clothes()).collect())
    }

    fn settings(&self) -> Result<Value, PipelineError> {
        Ok(json!({ "texture": json::plain(&self.run.settings.texture)?, "is_body": self.is_body }))
    }

    fn outputs(&self) -> Vec<PathBuf> {
        vec![self.folder().join("layer.glb"), self.folder().join("layer-seen.png")]
    }

    fn work(&self, progress: &(dyn Fn(f32) + Sync)) -> Result<Product<TextureReport>, PipelineError> {
        let folder = self.folder();
        let wrong = |e| PipelineError::stage(&folder, e);
        let (mesh, seen, reach) = self.meshes()?;
        let scan = self.scan()?;
        progress(0.2);
        let atlas = self.atlas(&mesh, scan.texel())?;
        progress(0.3);
        let from = scan.painted().ok_or_else(|| PipelineError::format(&folder, "the scan has no texture"))?;
        let texture = carry(&seen, &atlas, &from, &CarrySettings { reach });
        progress(0.7);
        let picture = picture(&texture).map_err(wrong)?;
        progress(0.9);
        let whole = Mesh { normals: mesh.vertex_normals(), ..mesh };
        let shown = whole.gather(&atlas.source, atlas.triangles);
        let name = if self.is_body { "body" } else { &self.take };
        let glb = write_textured(name, &shown, &atlas.uv, &picture).map_err(|e| PipelineError::stage(&folder, e))?;
        let files = self.outputs().into_iter().zip([glb, texture.seen_to_png().map_err(wrong)?]).collect();
        Ok(Product::new(files, texture.report, Vec::new()))
    }
}

/// The picture as PNG where it has few colours, else as JPEG.
fn picture(texture: &Texture) -> Result<Picture, toile_texture::TextureError> {
    let mut colors = std::collections::BTreeSet::new();
    let is_plain = texture.pixels.iter().all(|color| {
        colors.insert(*color);
        colors.len() <= PLAIN
    });
    Ok(if is_plain { Picture::Png(texture.to_png()?) } else { Picture::Jpeg(texture.to_jpeg()?) })
}
