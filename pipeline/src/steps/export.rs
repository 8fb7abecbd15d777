//! Step `export`: the dressed avatar as files, looked at in the poses that it will be seen in.
//!
//! Reads the body, every garment with its weights, and the motion. Writes `avatar.glb` and `avatar.vrm`, on request
//! without what clothes hide, and in further formats.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use toile_animation::{
    RetargetReport, Retargeted,
    springs::{self, RestedLayer},
};
use toile_avatar::{Avatar, AvatarError, AvatarLayer, LayerTexture, VrmMeta, vrm_pose, write_glb, write_vrm};
use toile_capture::files::is_there;
use toile_character::{JointNaming, SpringBones};
use toile_garments::{CullSettings, GarmentError, GarmentType, Worn, hidden_triangles};
use toile_geometry::Mesh;

use crate::{
    PipelineError, Run,
    avatar_choice::AvatarChoice,
    body_file::Body,
    exchange,
    garment::Garment,
    json,
    layer_files::texture_of,
    levels::{self, Level},
    look,
    look::Look,
    meshes::{read_mesh, read_skinned},
    motion,
    options::Springs,
    step::{Product, Step},
};

/// Name of the body's layer.
const BODY: &str = "body";

/// Writing the avatar's files.
pub struct Export<'a> {
    /// The run.
    pub run: &'a Run<'a>,
    /// The body.
    pub body: &'a Body,
    /// The garments, inside to outside.
    pub garments: &'a [Garment],
    /// The choices that the avatar is made with.
    pub choice: &'a AvatarChoice,
}

/// The decisions of the export.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Exported {
    /// How the motion was carried over.
    pub motion: RetargetReport,
    /// Triangles that were left out because clothes hide them, by layer; empty where every layer is whole.
    pub left_out: BTreeMap<String, LeftOut>,
    /// The spring bones of the VRM file, where something hangs loose and they are wanted.
    pub springs: Option<Hung>,
    /// The levels of detail that were written.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub levels: Vec<Level>,
    /// The layers in the exported motion and in the T-pose of the VRM file.
    pub look: Look,
}

/// Spring bones of the VRM file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Hung {
    /// The layers that hang on them.
    pub layers: Vec<String>,
    /// Chains.
    pub chains: usize,
    /// Joints of all chains.
    pub joints: usize,
    /// Capsules in hips and legs.
    pub colliders: usize,
}

/// Triangles of a layer that were left out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Left out.
    pub triangles: usize,
    /// Of this many.
    pub of: usize,
}

impl Export<'_> {
    fn motion_path(&self) -> Option<PathBuf> {
        self.choice.motion_path(&self.run.folders)
    }

    /// Whether the VRM file has springs: as chosen for this avatar, else as the settings say.
    fn has_springs(&self) -> bool {
        self.choice.springs.unwrap_or(self.run.settings.avatar.springs) == Springs::On
    }

    /// The layers that have textures, and the files that they are in.
    fn textured(&self) -> Vec<(&str, PathBuf)> {
        let folders = &self.run.folders;
        let of_garments = self.garments.iter().map(|g| (g.name.as_str(), folders.garment_layer(&g.layer)));
        std::iter::once((BODY, folders.body_layer())).chain(of_garments).filter(|(_, path)| is_there(path)).collect()
    }

    /// The levels of detail that are asked for, and their files.
    fn levels(&self, avatar: &Avatar) -> Result<(Vec<Level>, Vec<Vec<u8>>), PipelineError> {
        let wrong = |e: String| PipelineError::refused(&self.run.folders.glb(), format!("its levels of detail: {e}"));
        let made = levels::levels(avatar, &self.choice.levels).map_err(wrong)?;
        let file = |(avatar, level): (Avatar, Level)| {
            write_glb(&avatar).map(|glb| (level, glb)).map_err(|e| PipelineError::stage(&self.run.folders.glb(), e))
        };
        Ok(made.into_iter().map(file).collect::<Result<Vec<_>, _>>()?.into_iter().unzip())
    }

    /// Names of the layers, whether or not something of them is left.
    fn layer_names(&self) -> Vec<&str> {
        std::iter::once(BODY).chain(self.garments.iter().map(|g| g.name.as_str())).collect()
    }

    /// The avatar as its files have it: in scan 0's pose, without what is left out.
    ///
    /// # Errors
    /// [`PipelineError`] where a layer cannot be read.
    pub(crate) fn avatar(&self) -> Result<Avatar, PipelineError> {
        let mut avatar = self.dressed()?;
        if let Some(settings) = &self.choice.hidden {
            leave_out_hidden(&mut avatar, settings).map_err(|e| PipelineError::stage(&self.run.folders.glb(), e))?;
        }
        Ok(avatar)
    }

    /// A motion, or the walk, as this `avatar` moves with what it wears.
    ///
    /// # Errors
    /// [`PipelineError`] where the file is no motion.
    pub(crate) fn moved(&self, path: Option<&Path>, avatar: &Avatar) -> Result<Retargeted, PipelineError> {
        let layers: Vec<&Mesh> = avatar.layers.iter().map(|l| &l.mesh).collect();
        motion::load_clothed(path, &self.body.skinned, &self.body.pose0, &layers, &self.run.settings.motion)
    }

    /// The avatar at rest in scan 0's pose: the body and every garment.
    pub(crate) fn dressed(&self) -> Result<Avatar, PipelineError> {
        let (folders, body) = (&self.run.folders, &self.body.skinned);
        let (name, weights) = (BODY.to_string(), body.weights.clone());
        let mesh = read_mesh(&self.choice.body_mesh(folders))?;
        let texture = texture_at(&folders.body_layer(), &mesh)?;
        let mut layers = vec![AvatarLayer { name, mesh, weights, order: 0, garment: None, thickness: None, texture }];
        let mut order = 0;
        for garment in self.garments {
            // Over the layer below, whatever is missing between.
            order = garment.number.map_or(0, |n| n + 1 - self.run.first_garment()).max(order + 1);
            let (mesh, weights) = read_skinned(&folders.garment(&garment.layer))?;
            let texture = texture_at(&folders.garment_layer(&garment.layer), &mesh)?;
            layers.push(AvatarLayer {
                name: garment.name.clone(),
                mesh,
                weights,
                order: order as u32,
                garment: Some(garment.garment_type.to_string()),
                thickness: Some(garment.thickness),
                texture,
            });
        }
        let (skeleton, pose0) = (body.skeleton.clone(), self.body.pose0.clone());
        let (name, joint_names) = (self.run.title().to_string(), JointNaming::Vrm);
        Ok(Avatar { name, skeleton, joint_names, pose0, layers, motions: Vec::new() })
    }
}

impl Step for Export<'_> {
    type Report = Exported;
    const NAME: &'static str = "export";
    const VERSION: u32 = 9;
    const SECONDS: f64 = 1.0;

    fn label(&self) -> String {
        self.run.label("avatar", "export")
    }

    fn folder(&self) -> PathBuf {
        self.run.folders.avatar()
    }

    fn inputs(&self) -> Result<Vec<PathBuf>, PipelineError> {
        let folders = &self.run.folders;
        let of_body = [self.choice.body_mesh(folders), folders.body_json(), folders.pose(self.run.first_layer())];
        let of_garments = self.garments.iter().map(|g| folders.garment(&g.layer));
        let textured = self.textured().into_iter().map(|(_, path)| path);
        Ok(of_body.into_iter().chain(of_garments).chain(textured).chain(self.motion_path()).collect())
    }

    fn settings(&self) -> Result<Value, PipelineError> {
        Ok(json!({
            "name": self.run.title(),
            "garments": json::plain(&self.garments)?,
            "choice": json::plain(self.choice)?,
            "retarget": json::plain(&self.run.settings.motion)?,
            "springs": self.has_springs(),
            "vrm": json::plain(&VrmMeta::default())?,
        }))
    }

    fn outputs(&self) -> Vec<PathBuf> {
        let (folders, formats) = (&self.run.folders, &self.choice.formats);
        let mut files = vec![folders.glb(), folders.vrm()];
        files.extend(exchange::paths(folders, formats, &self.layer_names(), &self.textured()));
        files.extend(self.choice.levels.iter().map(|&n| folders.root.join(levels::file_name(n))));
        files
    }

    fn work(&self, progress: &(dyn Fn(f32) + Sync)) -> Result<Product<Exported>, PipelineError> {
        let glb_path = self.run.folders.glb();
        let wrong = |e: AvatarError| PipelineError::stage(&glb_path, e);
        let mut avatar = self.dressed()?;
        let moved = self.moved(self.motion_path().as_deref(), &avatar)?;
        let pictures = exchange::pictures(&avatar);
        let left_out = match &self.choice.hidden {
            Some(settings) => {
                leave_out_hidden(&mut avatar, settings).map_err(|e| PipelineError::stage(&glb_path, e))?
            }
            None => BTreeMap::new(),
        };
        progress(0.2);
        let look = look::at(&avatar, &moved.motion);
        progress(0.5);
        avatar.motions.push(moved.motion);
        avatar.joint_names = self.choice.joint_names;
        let glb = write_glb(&avatar).map_err(wrong)?;
        progress(0.75);
        let springs = if self.has_springs() { spring_bones(&avatar).map_err(wrong)? } else { None };
        let vrm = write_vrm(&avatar, &VrmMeta::default(), springs.as_ref()).map_err(wrong)?;
        let others =
            exchange::contents(&avatar, &self.choice.formats, &self.layer_names(), &pictures).map_err(wrong)?;
        progress(0.8);
        let (levels, simple) = self.levels(&avatar)?;
        let files = self.outputs().into_iter().zip([glb, vrm].into_iter().chain(others).chain(simple)).collect();
        let of_motion = moved.report.warnings.iter().map(|w| format!("motion {}: {w}", look.motion));
        let warnings = of_motion.chain(look.warnings()).collect();
        let springs = springs.map(|s| Hung::of(&s, &avatar));
        Ok(Product::new(files, Exported { motion: moved.report, left_out, springs, levels, look }, warnings))
    }
}

impl Hung {
    fn of(springs: &SpringBones, avatar: &Avatar) -> Self {
        let hung = avatar.layers.iter().zip(&springs.weights).filter(|(_, w)| w.is_some());
        Self {
            layers: hung.map(|(l, _)| l.name.clone()).collect(),
            chains: springs.chains.len(),
            joints: springs.joint_count(),
            colliders: springs.colliders.len(),
        }
    }
}

/// Spring bones for what hangs loose on the `avatar`, at rest in the T-pose of its VRM file.
fn spring_bones(avatar: &Avatar) -> Result<Option<SpringBones>, AvatarError> {
    let rest = vrm_pose(&avatar.skeleton);
    let rested = avatar.in_pose(&rest)?;
    let of_legs = [GarmentType::Trousers, GarmentType::Hat, GarmentType::Shoes];
    let layer = |l: &'_ AvatarLayer| {
        let named = l.garment.as_deref().and_then(GarmentType::from_layer_name);
        l.order > 0 && !named.is_some_and(|kind| of_legs.contains(&kind))
    };
    let layers: Vec<RestedLayer<'_>> =
        rested.layers.iter().map(|l| RestedLayer { mesh: &l.mesh, weights: &l.weights, may_hang: layer(l) }).collect();
    Ok(springs::spring_bones(&rest.joint_positions(&avatar.skeleton), &layers))
}

/// The texture of a layer, where it has one.
fn texture_at(path: &Path, mesh: &Mesh) -> Result<Option<LayerTexture>, PipelineError> {
    is_there(path).then(|| texture_of(path, mesh)).transpose()
}

/// Takes triangles that clothes hide off every layer, and vertices that none uses any more; a layer without triangles
/// goes as a whole.
fn leave_out_hidden(avatar: &mut Avatar, settings: &CullSettings) -> Result<BTreeMap<String, LeftOut>, GarmentError> {
    let worn: Vec<Worn> = avatar.layers.iter().map(|l| Worn { mesh: &l.mesh, weights: &l.weights }).collect();
    let hidden = hidden_triangles(&worn, settings)?;
    let mut left_out = BTreeMap::new();
    for (layer, hidden) in avatar.layers.iter_mut().zip(&hidden) {
        let (mesh, old_of_new) = layer.mesh.filter_triangles(|t| !hidden[t]);
        let (of, kept) = (hidden.len(), mesh.triangles.len());
        left_out.insert(layer.name.clone(), LeftOut { triangles: of - kept, of });
        layer.texture = layer.texture.as_ref().map(|texture| texture.of_part(|t| !hidden[t], &old_of_new));
        (layer.mesh, layer.weights) = (mesh, layer.weights.gather(&old_of_new));
    }
    avatar.layers.retain(|l| !l.mesh.is_empty());
    Ok(left_out)
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use toile_character::{JOINT_COUNT, Pose, Skeleton, SkinWeights};
    use toile_geometry::Mesh;

    use super::*;

    /// A square sheet over the floor at height `y`, facing up, a vertex every 20 mm.
    fn sheet(name: &str, order: u32, y: f32, cells: u32) -> AvatarLayer {
        let side = cells + 1;
        let at = |i: u32| (i as f32 - cells as f32 / 2.0) * 0.02;
        let positions = (0..side * side).map(|v| Point3::new(at(v % side), y, at(v / side))).collect();
        let corner = |c: u32| c / cells * side + c % cells;
        let cell = |c: u32| {
            let [a, b, c, d] = [corner(c), corner(c) + 1, corner(c) + side, corner(c) + side + 1];
            [[a, c, d], [a, d, b]]
        };
        let mesh = Mesh::new(positions, (0..cells * cells).flat_map(cell).collect());
        let mut weights = SkinWeights::default();
        (0..side * side).for_each(|v| weights.push(&[(0, 1.0 + v as f32), (1, 1.0)]));
        AvatarLayer { name: name.into(), mesh, weights, order, garment: None, thickness: None, texture: None }
    }

    #[test]
    fn hidden_triangles_go_with_their_vertices_and_weights() {
        let (vest, coat) = (sheet("01-vest", 1, 0.002, 4), sheet("02-coat", 2, 0.004, 20));
        let body = sheet("body", 0, 0.0, 30);
        let skeleton = Skeleton { rest: [Point3::origin(); JOINT_COUNT] };
        let layers = vec![body.clone(), vest, coat.clone()];
        let (name, joint_names, pose0) = ("anna".into(), JointNaming::Vrm, Pose::identity());
        let mut avatar = Avatar { name, skeleton, joint_names, pose0, layers, motions: Vec::new() };
        let reported = leave_out_hidden(&mut avatar, &CullSettings { margin: 0.03, reach: 0.1 }).unwrap();
        avatar.validate().unwrap();
        assert_eq!(avatar.layers.iter().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["body", "02-coat"]);
        assert_eq!(reported["01-vest"], LeftOut { triangles: 32, of: 32 });
        assert_eq!(reported["02-coat"], LeftOut { triangles: 0, of: 800 });
        let left = &avatar.layers[0];
        assert_eq!(reported["body"], LeftOut { triangles: 1800 - left.mesh.triangles.len(), of: 1800 });
        assert!((1000..1600).contains(&left.mesh.triangles.len()), "{reported:?}");
        assert!(left.mesh.positions.len() < body.mesh.positions.len());
        for (v, p) in left.mesh.positions.iter().enumerate() {
            let old = body.mesh.positions.iter().position(|q| q == p).unwrap();
            assert_eq!(left.weights.weights[v], body.weights.weights[old]);
        }
    }
}
