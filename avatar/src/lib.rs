//! The dressed character as files: binary glTF, VRM 1.0, USD, OBJ.
//!
//! - [`Avatar`]: skeleton, the pose that the layers are in, layers with their skin weights, motions;
//! - [`write_glb`]: one mesh node a layer, one skin, one animation a motion; with a single layer, a rigged scan;
//! - [`write_glb_with_helpers`]: the same with joints beside the skeleton's, which show one motion of layers that swing;
//! - [`write_textured`], [`read_textured`]: one mesh with a texture, without bones;
//! - [`write_vrm`]: the same baked to a T-pose, with bones and terms of use named, and with springs where parts hang loose;
//! - [`write_usda`]: layers, skeleton and motions as USD text;
//! - [`write_obj`], [`write_mtl`]: the layers at rest as OBJ;
//! - [`read_avatar`]: layers with their skin, skeleton and pose out of a GLB file.
//!
//! ```
//! use nalgebra::Point3;
//! use toile_avatar::{Avatar, AvatarLayer, write_glb};
//! use toile_character::{JOINT_COUNT, JointNaming, Pose, Skeleton, SkinWeights};
//! use toile_geometry::Mesh;
//!
//! let corners = [[0.0, 1.0, 0.0], [0.1, 1.0, 0.0], [0.0, 1.1, 0.0]].map(Point3::from);
//! let mut weights = SkinWeights::default();
//! corners.iter().for_each(|_| weights.push(&[(0, 1.0)]));
//! let avatar = Avatar {
//!     name: "anna".into(),
//!     skeleton: Skeleton { rest: [Point3::new(0.0, 1.0, 0.0); JOINT_COUNT] },
//!     joint_names: JointNaming::Vrm,
//!     pose0: Pose::identity(),
//!     layers: vec![AvatarLayer {
//!         name: "body".into(),
//!         mesh: Mesh::new(corners.to_vec(), vec![[0, 1, 2]]),
//!         weights,
//!         order: 0,
//!         garment: None,
//!         thickness: None,
//!         texture: None,
//!     }],
//!     motions: Vec::new(),
//! };
//! assert!(write_glb(&avatar)?.starts_with(b"glTF"));
//! # Ok::<(), toile_avatar::AvatarError>(())
//! ```

mod avatar_file;
mod buffer;
mod clip;
mod dressed;
mod error;
mod glb;
mod helpers;
mod layer_mesh;
mod layer_texture;
mod material;
mod motion;
mod obj;
mod picture;
mod point_cache;
mod rig;
mod springs;
mod tangents;
mod textured;
mod usda;
mod vrm;

pub use avatar_file::{AvatarFile, FileLayer, read_avatar};
pub use dressed::{Avatar, AvatarLayer};
pub use error::AvatarError;
pub use glb::write_glb;
pub use helpers::{HelperJoints, write_glb_with_helpers};
pub use layer_texture::LayerTexture;
pub use motion::{FileMotion, MotionJoint, read_motion};
pub use obj::{picture_name, write_mtl, write_obj};
pub use picture::Picture;
pub use point_cache::PointCache;
pub use tangents::tangents;
pub use textured::{read_textured, write_textured};
pub use usda::write_usda;
pub use vrm::{AvatarPermission, CommercialUsage, VrmMeta, vrm_pose, write_vrm};
