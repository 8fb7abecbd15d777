//! The avatar as VRM 1.0 (VRM Consortium, VRMC_vrm-1.0): a GLB that rests in a T-pose and says which bone is which.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use toile_character::{Joint, JointNaming, Pose, Skeleton, SpringBones, dress_pose::t_pose, joint::JOINTS};

use crate::{
    Avatar, AvatarError,
    buffer::Buffer,
    glb::{document, finish},
    rig::Rig,
    springs,
};

/// The licence text that VRM 1.0 files refer to.
const LICENCE_URL: &str = "https://vrm.dev/licenses/1.0/";

/// Who may use an avatar as their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum AvatarPermission {
    /// Only the author.
    OnlyAuthor,
    /// People who have a licence from the author.
    OnlySeparatelyLicensedPerson,
    /// Anyone.
    Everyone,
}

/// Permitted uses of an avatar.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum CommercialUsage {
    /// By persons, without profit.
    PersonalNonProfit,
    /// By persons, also for profit.
    PersonalProfit,
    /// By companies too.
    Corporation,
}

/// Terms of use in a VRM file. By default only the author may use the avatar: it shows a real person.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct VrmMeta {
    /// Name; the avatar's own where empty.
    pub name: String,
    /// Version of the avatar.
    pub version: String,
    /// Authors; at least one.
    pub authors: Vec<String>,
    /// Who may use it as their own avatar.
    pub avatar_permission: AvatarPermission,
    /// Permitted uses.
    pub commercial_usage: CommercialUsage,
    /// Whether it may be redistributed.
    pub allow_redistribution: bool,
    /// Whether it may be changed; with `allow_redistribution`, whether the changed one may be redistributed.
    pub allow_modification: bool,
    /// Whether the authors must be named.
    pub credit_required: bool,
}

impl Default for VrmMeta {
    fn default() -> Self {
        Self {
            name: String::new(),
            version: "1".into(),
            authors: vec!["unknown".into()],
            avatar_permission: AvatarPermission::OnlyAuthor,
            commercial_usage: CommercialUsage::PersonalNonProfit,
            allow_redistribution: false,
            allow_modification: false,
            credit_required: true,
        }
    }
}

/// The pose that [`write_vrm`] bakes the layers into: a T-pose. Check here what a VRM file will show, such as layers
/// that cross.
pub fn vrm_pose(skeleton: &Skeleton) -> Pose {
    t_pose(skeleton)
}

/// The avatar as a VRM 1.0 file.
///
/// All layers are moved to the T-pose by their skin weights (A → T baking) with feet at the height they rest at;
/// bones rest without rotation, facing +Z; all 52 joints are named, among them the 15 that VRM requires. Motions
/// are left out: VRM keeps them in files of their own. With `springs`, found at rest in that T-pose, loose parts swing
/// (VRMC_springBone-1.0).
///
/// # Errors
/// As [`Avatar::validate`]; [`AvatarError::Avatar`] where no author is named; [`AvatarError::Springs`] where the spring bones do not fit the
/// avatar or have no meaning.
pub fn write_vrm(avatar: &Avatar, meta: &VrmMeta, springs: Option<&SpringBones>) -> Result<Vec<u8>, AvatarError> {
    if meta.authors.is_empty() || meta.authors.iter().any(|a| a.trim().is_empty()) {
        return Err(AvatarError::Avatar("a VRM file names at least one author".into()));
    }
    let mut baked = Avatar { joint_names: JointNaming::Vrm, ..avatar.in_pose(&vrm_pose(&avatar.skeleton))? };
    let mut rig = Rig::unturned(&baked.skeleton, &baked.pose0);
    if let Some(springs) = springs {
        springs::hang(&mut baked, springs)?;
        rig = rig.with_springs(springs);
    }
    let mut buffer = Buffer::default();
    let mut document = document(&baked, &rig, &mut buffer);
    let mut extensions = json!({ "VRMC_vrm": extension(&baked, meta, rig.node_count()) });
    if let Some(springs) = springs {
        extensions[springs::EXTENSION] = springs::extension(springs, &baked, rig.top());
    }
    let used: Vec<String> = extensions.as_object().into_iter().flatten().map(|(name, _)| name.clone()).collect();
    document.insert("extensionsUsed".into(), json!(used));
    document.insert("extensions".into(), extensions);
    finish(buffer, document)
}

fn extension(avatar: &Avatar, meta: &VrmMeta, first_mesh_node: usize) -> Value {
    let bones: Map<String, Value> =
        JOINTS.iter().map(|j| (j.name().to_string(), json!({ "node": j.index() }))).collect();
    let annotations: Vec<Value> =
        (0..avatar.layers.len()).map(|i| json!({ "node": first_mesh_node + i, "type": "auto" })).collect();
    json!({
        "specVersion": "1.0",
        "meta": meta_of(avatar, meta),
        "humanoid": { "humanBones": bones },
        "firstPerson": { "meshAnnotations": annotations },
        "lookAt": look_at(avatar),
    })
}

fn meta_of(avatar: &Avatar, meta: &VrmMeta) -> Value {
    let modification = match (meta.allow_modification, meta.allow_redistribution) {
        (false, _) => "prohibited",
        (true, false) => "allowModification",
        (true, true) => "allowModificationRedistribution",
    };
    json!({
        "name": if meta.name.is_empty() { &avatar.name } else { &meta.name },
        "version": meta.version,
        "authors": meta.authors,
        "licenseUrl": LICENCE_URL,
        "avatarPermission": meta.avatar_permission,
        "commercialUsage": meta.commercial_usage,
        "creditNotation": if meta.credit_required { "required" } else { "unnecessary" },
        "allowRedistribution": meta.allow_redistribution,
        "modification": modification,
        "allowExcessivelyViolentUsage": false,
        "allowExcessivelySexualUsage": false,
        "allowPoliticalOrReligiousUsage": false,
        "allowAntisocialOrHateUsage": false,
    })
}

/// Where the eyes are, seen from the head's joint: there are no eye bones to turn.
fn look_at(avatar: &Avatar) -> Value {
    // Eyes lie about as far above the head's joint as the neck is long, and well in front of it.
    let neck = avatar.skeleton.offset(Joint::Head).norm();
    let range = json!({ "inputMaxValue": 90.0, "outputScale": 10.0 });
    json!({
        "type": "bone",
        "offsetFromHeadBone": [0.0, 0.7 * neck, 0.9 * neck],
        "rangeMapHorizontalInner": range,
        "rangeMapHorizontalOuter": range,
        "rangeMapVerticalDown": range,
        "rangeMapVerticalUp": range,
    })
}
