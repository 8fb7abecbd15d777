//! Motions of glTF files: GLB as Blender and Mixamo's converters write them, and VRM animations (`.vrma`).
//!
//! Sources: glTF 2.0, §3.11 (animations); `VRMC_vrm_animation` 1.0, whose human bones name the nodes.

use std::collections::{BTreeMap, BTreeSet};

use gltf::animation::{Interpolation, util::ReadOutputs};
use nalgebra::{Isometry3, Matrix4, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::AvatarError;

/// A joint of a motion file.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionJoint {
    /// The node's name, or the human bone that a VRM animation makes of it.
    pub name: String,
    /// Index of the parent, always lower than the joint's own; `None` for a root.
    pub parent: Option<usize>,
    /// `scene_from_joint` at rest, metres.
    pub rest: Isometry3<f64>,
}

/// The motion of a glTF file, sampled.
#[derive(Debug, Clone, PartialEq)]
pub struct FileMotion {
    /// The joints, parents before children.
    pub joints: Vec<MotionJoint>,
    /// Seconds between two frames.
    pub frame_time: f64,
    /// `scene_from_joint` of every joint in every frame, metres.
    pub frames: Vec<Vec<Isometry3<f64>>>,
    /// What was left out, a sentence each.
    pub warnings: Vec<String>,
}

/// Rates at which a motion is sampled, hertz: that of its keys within these.
const RATES: (f64, f64) = (24.0, 120.0);
/// Longest motion that is read, frames: an hour at 60 Hz.
const MOST_FRAMES: usize = 216_000;

/// Reads the first animation of a GLB, VRM or VRMA file (or of a glTF file whose buffers are in it).
///
/// # Errors
/// [`AvatarError::Motion`] where the bytes are not such a file, hold no animation of nodes, or keep their buffers elsewhere.
pub fn read_motion(bytes: &[u8], name: &str) -> Result<FileMotion, AvatarError> {
    let wrong = |reason: String| AvatarError::Motion { motion: name.into(), reason };
    let gltf::Gltf { document, blob } =
        gltf::Gltf::from_slice(bytes).map_err(|e| wrong(format!("not a glTF file: {e}")))?;
    let buffers = gltf::import_buffers(&document, None, blob)
        .map_err(|e| wrong(format!("its buffers are not in it ({e}): export it as one GLB")))?;
    let Some(animation) = document.animations().next() else {
        return Err(wrong("it has no animation: export it with its animation, or give another file".into()));
    };
    let tracks = tracks(&animation, &buffers);
    if tracks.is_empty() {
        return Err(wrong("its animation moves no node: was it exported with the skeleton's animation?".into()));
    }
    let scene = Scene::new(&document, &tracks);
    let times = sample_times(&tracks).map_err(wrong)?;
    let frames = times.at.iter().map(|&t| scene.placed(|node| node_at(node, &tracks, t))).collect();
    Ok(FileMotion { joints: scene.joints(), frame_time: times.step, frames, warnings: left_out(&document) })
}

fn left_out(document: &gltf::Document) -> Vec<String> {
    let others: Vec<&str> = document.animations().skip(1).map(|a| a.name().unwrap_or("without a name")).collect();
    let mut warnings = Vec::new();
    if !others.is_empty() {
        warnings.push(format!("only the first animation was taken; left out: {}", others.join(", ")));
    }
    warnings
}

/// The keys of one node.
#[derive(Default)]
struct Track {
    rotations: Keys<UnitQuaternion<f64>>,
    translations: Keys<Vector3<f64>>,
}

/// Values over time; of cubic splines the values without their tangents.
struct Keys<T> {
    times: Vec<f64>,
    values: Vec<T>,
    is_step: bool,
}

impl<T> Default for Keys<T> {
    fn default() -> Self {
        Self { times: Vec::new(), values: Vec::new(), is_step: false }
    }
}

impl<T: Copy> Keys<T> {
    fn new(times: &[f64], values: Vec<T>, interpolation: Interpolation) -> Self {
        let values = match interpolation {
            Interpolation::CubicSpline => values.into_iter().skip(1).step_by(3).collect(),
            _ => values,
        };
        let count = times.len().min(values.len());
        let is_step = interpolation == Interpolation::Step;
        Self { times: times[..count].to_vec(), values: values[..count].to_vec(), is_step }
    }

    fn at(&self, time: f64, blend: impl Fn(T, T, f64) -> T) -> Option<T> {
        let next = self.times.partition_point(|&t| t <= time);
        let (Some(&before), Some(&after)) = (self.values.get(next.saturating_sub(1)), self.values.get(next)) else {
            return self.values.last().copied();
        };
        if next == 0 || self.is_step {
            return Some(before);
        }
        let (from, to) = (self.times[next - 1], self.times[next]);
        Some(blend(before, after, ((time - from) / (to - from).max(1e-9)).clamp(0.0, 1.0)))
    }
}

type Tracks = BTreeMap<usize, Track>;

fn tracks(animation: &gltf::Animation, buffers: &[gltf::buffer::Data]) -> Tracks {
    let mut tracks = Tracks::new();
    for channel in animation.channels() {
        let reader = channel.reader(|buffer| buffers.get(buffer.index()).map(|data| data.0.as_slice()));
        let (Some(times), Some(outputs)) = (reader.read_inputs(), reader.read_outputs()) else { continue };
        let times: Vec<f64> = times.map(f64::from).collect();
        if !times.iter().all(|t| t.is_finite()) {
            continue;
        }
        let track = tracks.entry(channel.target().node().index()).or_default();
        let interpolation = channel.sampler().interpolation();
        match outputs {
            ReadOutputs::Rotations(values) => {
                let values = values.into_f32().map(quaternion).collect();
                track.rotations = Keys::new(&times, values, interpolation);
            }
            ReadOutputs::Translations(values) => {
                let values = values.map(|t| Vector3::from(t.map(f64::from))).collect();
                track.translations = Keys::new(&times, values, interpolation);
            }
            _ => {}
        }
    }
    tracks.retain(|_, track| !track.rotations.values.is_empty() || !track.translations.values.is_empty());
    tracks
}

fn quaternion([x, y, z, w]: [f32; 4]) -> UnitQuaternion<f64> {
    let q = Quaternion::new(f64::from(w), f64::from(x), f64::from(y), f64::from(z));
    UnitQuaternion::try_new(q, 1e-9).unwrap_or_default()
}

/// `parent_from_node` at a time: the node's own place where nothing moves it.
fn node_at(node: &gltf::Node, tracks: &Tracks, time: f64) -> Matrix4<f64> {
    let (translation, rotation, scale) = node.transform().decomposed();
    let track = tracks.get(&node.index());
    let slerp = |a: UnitQuaternion<f64>, b: UnitQuaternion<f64>, t: f64| a.try_slerp(&b, t, 1e-9).unwrap_or(b);
    let turned = track.and_then(|t| t.rotations.at(time, slerp)).unwrap_or_else(|| quaternion(rotation));
    let moved = track.and_then(|t| t.translations.at(time, |a, b, t| a.lerp(&b, t)));
    let moved = moved.unwrap_or_else(|| Vector3::from(translation.map(f64::from)));
    Isometry3::from_parts(Translation3::from(moved), turned).to_homogeneous()
        * Matrix4::new_nonuniform_scaling(&Vector3::from(scale.map(f64::from)))
}

/// Times at which a motion is sampled.
struct Times {
    step: f64,
    at: Vec<f64>,
}

/// From the first key to the last, at the rate of the densest track.
fn sample_times(tracks: &Tracks) -> Result<Times, String> {
    let all = || tracks.values().flat_map(|t| [&t.rotations.times, &t.translations.times]).filter(|t| !t.is_empty());
    let first = all().map(|t| t[0]).fold(f64::INFINITY, f64::min);
    let last = all().map(|t| t[t.len() - 1]).fold(f64::NEG_INFINITY, f64::max);
    let keys = all().map(Vec::len).max().unwrap_or(1);
    if last.partial_cmp(&first) != Some(std::cmp::Ordering::Greater) {
        return Err("its animation has a single moment: it is a pose, no motion".into());
    }
    let rate = ((keys as f64 - 1.0) / (last - first)).clamp(RATES.0, RATES.1);
    let count = ((last - first) * rate).round() as usize + 1;
    if count > MOST_FRAMES {
        return Err(format!("its animation lasts {:.0} s; the maximum is {MOST_FRAMES} frames", last - first));
    }
    let step = 1.0 / rate;
    Ok(Times { step, at: (0..count).map(|k| (first + k as f64 * step).min(last)).collect() })
}

/// The nodes that matter, parents first.
struct Scene<'a> {
    nodes: Vec<gltf::Node<'a>>,
    parents: Vec<Option<usize>>,
    names: Vec<String>,
}

impl<'a> Scene<'a> {
    /// Animated nodes, joints of skins and human bones, with all nodes above them.
    fn new(document: &'a gltf::Document, tracks: &Tracks) -> Self {
        let bones = human_bones(document);
        let joints = document.skins().flat_map(|s| s.joints().map(|j| j.index()).collect::<Vec<_>>());
        let wanted: BTreeSet<usize> = tracks.keys().copied().chain(joints).chain(bones.keys().copied()).collect();
        let mut parent_of = BTreeMap::new();
        for node in document.nodes() {
            parent_of.extend(node.children().map(|child| (child.index(), node.index())));
        }
        let mut kept = BTreeSet::new();
        for &node in &wanted {
            let mut at = Some(node);
            while let Some(index) = at.filter(|&index| kept.insert(index)) {
                at = parent_of.get(&index).copied();
            }
        }
        let mut scene = Self { nodes: Vec::new(), parents: Vec::new(), names: Vec::new() };
        for node in document.nodes().filter(|n| !parent_of.contains_key(&n.index())) {
            scene.add(node, &mut kept, &bones);
        }
        scene
    }

    /// Adds a root and the `kept` nodes below it; each node once, whatever a damaged file says.
    fn add(&mut self, root: gltf::Node<'a>, kept: &mut BTreeSet<usize>, bones: &BTreeMap<usize, String>) {
        let mut open = vec![(root, None)];
        while let Some((node, parent)) = open.pop() {
            if !kept.remove(&node.index()) {
                continue;
            }
            let at = self.nodes.len();
            let named = || node.name().map_or_else(|| format!("node {}", node.index()), str::to_string);
            self.names.push(bones.get(&node.index()).cloned().unwrap_or_else(named));
            self.parents.push(parent);
            let children = node.children().filter(|c| kept.contains(&c.index())).map(|c| (c, Some(at)));
            open.extend(children.collect::<Vec<_>>().into_iter().rev());
            self.nodes.push(node);
        }
    }

    /// `scene_from_joint` of all nodes, where `local` gives `parent_from_node`. Scales move joints and are then dropped.
    fn placed(&self, local: impl Fn(&gltf::Node) -> Matrix4<f64>) -> Vec<Isometry3<f64>> {
        let mut world: Vec<Matrix4<f64>> = Vec::with_capacity(self.nodes.len());
        for (node, parent) in self.nodes.iter().zip(&self.parents) {
            let local = local(node);
            world.push(parent.map_or(local, |p| world[p] * local));
        }
        world.iter().map(rigid).collect()
    }

    fn joints(&self) -> Vec<MotionJoint> {
        let none = Tracks::new();
        let rest = self.placed(|node| node_at(node, &none, 0.0));
        let joint = |((name, &parent), rest): ((&String, &Option<usize>), Isometry3<f64>)| MotionJoint {
            name: name.clone(),
            parent,
            rest,
        };
        self.names.iter().zip(&self.parents).zip(rest).map(joint).collect()
    }
}

fn rigid(matrix: &Matrix4<f64>) -> Isometry3<f64> {
    let rotation = Rotation3::from_matrix(&matrix.fixed_view::<3, 3>(0, 0).into_owned());
    let place = matrix.fixed_view::<3, 1>(0, 3).into_owned();
    Isometry3::from_parts(Translation3::from(place), UnitQuaternion::from_rotation_matrix(&rotation))
}

/// Node by human bone, of a VRM animation or a VRM 1.0 avatar.
fn human_bones(document: &gltf::Document) -> BTreeMap<usize, String> {
    let bones = |extension: &str| {
        let humanoid = document.extension_value(extension)?.get("humanoid")?.get("humanBones")?.as_object()?;
        let one = |(name, bone): (&String, &serde_json::Value)| {
            Some((usize::try_from(bone.get("node")?.as_u64()?).ok()?, name.clone()))
        };
        Some(humanoid.iter().filter_map(one).collect())
    };
    bones("VRMC_vrm_animation").or_else(|| bones("VRMC_vrm")).unwrap_or_default()
}
