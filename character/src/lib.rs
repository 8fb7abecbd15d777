//! The body asset, skeleton, joint names, poses, skin weights and skinning: the types that fitting, garments, animation and
//! avatar share.
//!
//! - [`joint`]: the 52 VRM humanoid joints and their hierarchy;
//! - [`Skeleton`]: where the joints of one person rest; [`Pose`]: how they are turned; [`joint_limits`]: how far they go;
//! - [`SkinWeights`] and [`skinning`]: linear blend skinning (Hu et al. 2017, eq. 3), its inverse, and blending in log space;
//! - [`BodyModel`]: the statistical body (eq. 1 joints by [`mean_value`], eq. 2 shape) from the committed asset;
//! - [`dress_pose`]: the A- and T-pose of any skeleton;
//! - [`Motion`]: a pose over time; [`interpolation`]: poses between poses;
//! - [`two_bone`], [`feet`], [`soles`]: inverse kinematics of arms and legs, ankles moved by the leg, the skin of the soles;
//! - [`GarmentType`]: the kind of garment that a layer is; [`SpringBones`]: joints on which its loose parts swing.
//!
//! Subject frame: +Y up, +Z the front, +X the subject's left; metres, radians, seconds.
//!
//! ```
//! use toile_character::BodyModel;
//!
//! let model = BodyModel::load_default()?;
//! let beta = [1.0, -0.5]; // taller than most; the other components stay at the mean
//! let rest = model.shape(&beta); // A-pose
//! let avatar_rest = model.posed(&beta, &model.t_pose(&beta));
//! assert_eq!(rest.len(), avatar_rest.len());
//! # Ok::<(), toile_character::CharacterError>(())
//! ```

mod asset;
mod body_model;
pub mod dress_pose;
mod error;
pub mod feet;
mod garment_layer;
mod garment_type;
pub mod interpolation;
pub mod joint;
pub mod limits;
pub mod mean_value;
mod motion;
mod naming;
mod pose;
mod region;
mod skeleton;
pub mod skin;
mod skinned_mesh;
pub mod skinning;
pub mod soles;
mod spring_bones;
pub mod transfer;
pub mod two_bone;

pub use body_model::{BodyModel, JointRegressor, PopulationInfo};
pub use error::CharacterError;
pub use garment_layer::FREE_PART;
pub use garment_type::GarmentType;
pub use joint::{JOINT_COUNT, Joint};
pub use limits::{JointLimit, joint_limits};
pub use motion::Motion;
pub use naming::JointNaming;
pub use pose::Pose;
pub use region::Region;
pub use skeleton::Skeleton;
pub use skin::SkinWeights;
pub use skinned_mesh::SkinnedMesh;
pub use skinning::{PosedSkin, Skinner, Skinning};
pub use spring_bones::{SpringBones, SpringChain, SpringCollider, SpringJoint};
