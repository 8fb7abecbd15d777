//! A generated person in one garment: the simulated cloth and the avatar with springs.

use nalgebra::{Isometry3, Point3};
use toile_animation::{
    RetargetSettings,
    blend::{Blend, Outfit, OutfitLayer, Wearer},
    retarget, shipped_walk,
    springs::{RestedLayer, Swing, spring_bones},
};
use toile_avatar::{Avatar, AvatarLayer, VrmMeta, vrm_pose, write_vrm};
use toile_character::{FREE_PART, JointNaming, Motion, Pose, Skeleton, Skinning, SpringBones, skinning::skin};
use toile_cloth::Fabric;
use toile_garments::{DressedTake, ExtractSettings, carry_weights, mark_free, weights_from_body};
use toile_geometry::{Mesh, remesh};
use toile_synthetic::{GarmentKind, GarmentSettings, Subject, SyntheticSettings};

/// Frames a second of the simulated cloth.
pub const RATE: usize = 30;
/// Updates a second of the springs, and updates in which they settle in the first pose.
pub const UPDATES: usize = 60;
pub const SETTLE: usize = 60;

/// A body and a garment, the walk, the cloth in it, and springs.
pub struct Scene {
    avatar: Avatar,
    rested: Avatar,
    pub poses: Vec<Pose>,
    /// The garment's vertices in each frame of the simulation.
    pub baked: Vec<Vec<Point3<f32>>>,
    pub springs: SpringBones,
}

impl Scene {
    /// The person of a `seed` in a garment of a `kind`, and so many `frames` of the walk.
    pub fn new(seed: u64, kind: GarmentKind, frames: usize) -> Self {
        let avatar = dressed(seed, kind);
        let walk = retarget(&shipped_walk().unwrap(), "walk", &avatar.skeleton, &RetargetSettings::default()).unwrap();
        let poses: Vec<Pose> = (0..(frames * UPDATES / RATE).max(1)).map(|k| at(&walk.motion, k)).collect();
        let baked: Vec<Pose> = poses.iter().step_by(UPDATES / RATE).cloned().collect();
        let baked = if frames == 0 { Vec::new() } else { bake(&avatar, &baked) };
        let rest = vrm_pose(&avatar.skeleton);
        let rested = avatar.in_pose(&rest).unwrap();
        let layers: Vec<RestedLayer> = rested
            .layers
            .iter()
            .map(|l| RestedLayer { mesh: &l.mesh, weights: &l.weights, may_hang: l.order > 0 })
            .collect();
        let springs = spring_bones(&rest.joint_positions(&avatar.skeleton), &layers).unwrap();
        Self { avatar, poses, baked, springs, rested }
    }

    pub fn body(&self) -> &AvatarLayer {
        &self.avatar.layers[0]
    }

    pub fn skeleton(&self) -> &Skeleton {
        &self.avatar.skeleton
    }

    pub fn garment(&self) -> &AvatarLayer {
        &self.avatar.layers[1]
    }

    pub fn vrm(&self) -> Vec<u8> {
        let meta = VrmMeta { authors: vec!["someone".into()], ..VrmMeta::default() };
        write_vrm(&self.avatar, &meta, Some(&self.springs)).unwrap()
    }

    /// Updates of the springs after which the frames of the simulation come.
    pub fn updates(&self) -> Vec<usize> {
        (0..self.baked.len()).map(|f| f * UPDATES / RATE).collect()
    }

    /// `posed_from_rest` of the skeleton's joints, from the T-pose.
    pub fn moved(&self, pose: &Pose) -> Vec<Isometry3<f64>> {
        pose.transforms_from(&self.rested.pose0, &self.avatar.skeleton)
    }

    /// Body and garment in a frame of the simulation, on their skin alone.
    pub fn skinned(&self, frame: usize) -> [Vec<Point3<f32>>; 2] {
        let moved = self.moved(&self.poses[frame * UPDATES / RATE]);
        [0, 1].map(|k| skin(&self.rested.layers[k].mesh.positions, &self.rested.layers[k].weights, &moved))
    }

    /// The garment on its springs, in each frame of the simulation.
    pub fn played(&self) -> Vec<Vec<Point3<f32>>> {
        let mut swing = Swing::new(&self.springs);
        swing.settle(&self.moved(&self.poses[0]), SETTLE, 1.0 / UPDATES as f64);
        let (wanted, weights) = (self.updates(), self.springs.weights[1].as_ref().unwrap());
        let mut out = Vec::new();
        for (k, pose) in self.poses.iter().enumerate() {
            let mut moved = self.moved(pose);
            swing.update(&moved, 1.0 / UPDATES as f64);
            moved.extend_from_slice(swing.moved());
            if wanted.contains(&k) {
                out.push(skin(&self.rested.layers[1].mesh.positions, weights, &moved));
            }
        }
        out
    }

    /// How far the hem comes away from its skin over the frames: mean over its vertices of the largest less the mean way, metres.
    pub fn own_motion(&self, frames: &[Vec<Point3<f32>>]) -> f64 {
        let hem = crate::measure::hem(&self.garment().mesh);
        let skins: Vec<Vec<Point3<f32>>> = (0..frames.len()).map(|f| self.skinned(f)[1].clone()).collect();
        let of_vertex = |&v: &u32| {
            let v = v as usize;
            let ways: Vec<_> = frames.iter().zip(&skins).map(|(a, b)| a[v] - b[v]).collect();
            let mean = ways.iter().sum::<nalgebra::Vector3<f32>>() / ways.len() as f32;
            ways.iter().map(|w| f64::from((w - mean).norm())).fold(0.0, f64::max)
        };
        hem.iter().map(of_vertex).sum::<f64>() / hem.len() as f64
    }
}

/// The pose of a motion at an update.
fn at(motion: &Motion, update: usize) -> Pose {
    let frame = update as f64 / UPDATES as f64 / motion.frame_time;
    let (before, after) = (frame.floor() as usize, frame.ceil() as usize);
    motion.poses[before].interpolated(&motion.poses[after], frame.fract())
}

/// The cloth in each of the `poses`, after it has settled in the first.
fn bake(avatar: &Avatar, poses: &[Pose]) -> Vec<Vec<Point3<f32>>> {
    let fabric = Fabric::named("shirting").unwrap();
    let layer = |l: &AvatarLayer| OutfitLayer {
        name: l.name.clone(),
        mesh: l.mesh.clone(),
        weights: l.weights.clone(),
        fabric,
    };
    let layers = avatar.layers.iter().map(layer).collect();
    let outfit = Outfit::new(avatar.skeleton.clone(), avatar.pose0.clone(), layers).unwrap();
    let mut wearer = Wearer::new(&outfit, Blend::Anchored, Skinning::Linear);
    for k in 1..=15 {
        wearer.warm_up(&avatar.pose0.interpolated(&poses[0], (f64::from(k) / 10.0).min(1.0)), 0.1).unwrap();
    }
    let step = |pose: &Pose| {
        wearer.advance(pose, 1.0 / RATE as f64).unwrap();
        wearer.layers()[1].clone()
    };
    poses.iter().map(step).collect()
}

/// The person of a `seed` in a garment, as extraction leaves it: even triangles, marked where it hangs free, skin weights of its own.
fn dressed(seed: u64, kind: GarmentKind) -> Avatar {
    let garments = vec![GarmentSettings::of(kind)];
    let subject = Subject::new(&SyntheticSettings { seed, garments, ..SyntheticSettings::default() }).unwrap();
    let body = &subject.person.body;
    let mut worn = remesh::isotropic(&subject.garments[0].worn.mesh, 2.0 * ExtractSettings::default().edge_length);
    if kind != GarmentKind::Coat {
        let free = mark_free(&body.mesh, &worn);
        worn.attributes.insert(FREE_PART.into(), free);
    }
    let rest = Pose::identity();
    let take = DressedTake {
        scan: &worn,
        is_first: false,
        previous: &body.mesh,
        body: &body.mesh,
        weights: &body.weights,
        skeleton: &body.skeleton,
        pose: &rest,
        pose0: &rest,
        garment_type: None,
        edits: None,
    };
    let mut weights = [weights_from_body(&take, &worn, &ExtractSettings::default())];
    carry_weights(std::slice::from_ref(&worn), &mut weights, &body.skeleton, &rest).unwrap();
    let [weights] = weights;
    let layer = |name: &str, mesh: Mesh, weights, order| AvatarLayer {
        name: name.into(),
        mesh,
        weights,
        order,
        garment: None,
        thickness: None,
        texture: None,
    };
    Avatar {
        name: "tester".into(),
        skeleton: body.skeleton.clone(),
        joint_names: JointNaming::Vrm,
        pose0: rest,
        layers: vec![layer("body", body.mesh.clone(), body.weights.clone(), 0), layer("01-garment", worn, weights, 1)],
        motions: Vec::new(),
    }
}
