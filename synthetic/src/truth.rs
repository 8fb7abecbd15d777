//! Facts about a take and its person, as files (`docs/synthetic.md`).

use std::path::Path;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use serde_json::{Value, json};
use toile_capture::{
    atomic_write,
    trajectory::{self, TimedPose},
};
use toile_character::joint::JOINTS;
use toile_geometry::{Mesh, ply};
use toile_render::{Camera, rasterize};

use crate::{SyntheticError, subject::Subject, surface::Surface, take::Take};

/// A triangle counts as seen when it is no more than this behind the depth of its pixel, metres.
const BEHIND: f32 = 0.004;
/// Smallest cosine between ray and normal of a triangle that counts as seen.
const GRAZING: f32 = 0.08;

/// Frames of a long take that are looked at, evenly spread over it.
const LOOKS: usize = 180;

/// For each triangle of the take's surface, whether a frame of the take sees it. Of a long take, 180 to 359 frames are
/// looked at.
pub fn visible(take: &Take) -> Vec<bool> {
    let mesh = &take.surface.mesh;
    let normals = mesh.triangle_normals();
    let mut seen = vec![false; mesh.triangles.len()];
    for (index, moment) in take.moments.iter().enumerate().step_by((take.moments.len() / LOOKS).max(1)) {
        let bent = Mesh::new(take.bend.apply(&mesh.positions, moment), mesh.triangles.clone());
        let camera_from_world = take.subject_from_camera(index).inverse();
        let camera = Camera { lens: take.camera(), camera_from_world };
        let depth = rasterize(&bent, &camera).depth;
        seen.par_iter_mut().enumerate().filter(|(_, seen)| !**seen).for_each(|(t, seen)| {
            *seen = is_seen(&bent, t, &normals[t], &camera, &depth);
        });
    }
    seen
}

fn is_seen(mesh: &Mesh, t: usize, normal: &Vector3<f32>, camera: &Camera, depth: &[f32]) -> bool {
    let [a, b, c] = mesh.corners(t);
    let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
    let p = camera.camera_from_world * middle.cast::<f64>();
    let ray = camera.camera_from_world.inverse_transform_vector(&p.coords).cast::<f32>();
    if -ray.dot(normal) < GRAZING * ray.norm() {
        return false;
    }
    let Some(pixel) = camera.lens.project(&p) else { return false };
    let (u, v) = (pixel.x.round(), pixel.y.round());
    if u < 0.0 || v < 0.0 || u >= f64::from(camera.lens.width) || v >= f64::from(camera.lens.height) {
        return false;
    }
    let z = depth[v as usize * camera.lens.width as usize + u as usize];
    z > 0.0 && p.z as f32 <= z + BEHIND
}

/// Writes the truth of every take and of the person: `DIR/NN-layer/truth/` and `DIR/subject.json`.
///
/// # Errors
/// [`SyntheticError::Capture`] names the file that could not be written.
pub fn write_subject(subject: &Subject, dir: &Path) -> Result<(), SyntheticError> {
    for n in 0..subject.take_count() {
        write_take(&subject.take(n)?, dir)?;
    }
    write_person(subject, dir)
}

/// Writes what is true of the person: `DIR/subject.json`.
///
/// # Errors
/// [`SyntheticError::Capture`] names the file that could not be written.
pub fn write_person(subject: &Subject, dir: &Path) -> Result<(), SyntheticError> {
    let text = format!("{:#}\n", subject_json(subject));
    Ok(atomic_write(&dir.join("subject.json"), text.as_bytes())?)
}

/// Writes a take's truth into `DIR/NN-layer/truth/`: surface.ply, body.ply, garment_n.ply, poses.txt, pose.json, sway.txt.
///
/// # Errors
/// [`SyntheticError::Capture`] names the file that could not be written.
pub fn write_take(take: &Take, dir: &Path) -> Result<(), SyntheticError> {
    let folder = dir.join(&take.name).join("truth");
    let visible = visible(take);
    let put = |name: &str, bytes: &[u8]| atomic_write(&folder.join(name), bytes);
    put("surface.ply", &encode_surface(&take.surface, &visible, take.index > 0))?;
    put("body.ply", &ply::encode(&take.body))?;
    if let Some(layer) = u8::try_from(take.index).ok().filter(|n| *n > 0) {
        let (garment, triangles) = take.surface.only(layer);
        let seen: Vec<bool> = triangles.iter().map(|&t| visible[t]).collect();
        put(&format!("garment_{layer}.ply"), &encode_surface(&garment, &seen, true))?;
    }
    put("poses.txt", poses_text(take).as_bytes())?;
    put("pose.json", pose_json(take).to_string().as_bytes())?;
    if let Some(rig) = take.rig_truth() {
        put("rig.json", format!("{rig:#}\n").as_bytes())?;
    }
    if take.moments.iter().any(|m| m.pitch != 0.0 || m.breath != 0.0) {
        put("sway.txt", sway_text(take).as_bytes())?;
    }
    Ok(())
}

/// The surface as PLY with colours, the vertices in take 0's pose, and per face layer, region and visibility.
fn encode_surface(surface: &Surface, visible: &[bool], with_take_0: bool) -> Vec<u8> {
    let mesh = &surface.mesh;
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", mesh.positions.len());
    ["x", "y", "z"].iter().for_each(|n| header.push_str(&format!("property float {n}\n")));
    ["red", "green", "blue"].iter().for_each(|n| header.push_str(&format!("property uchar {n}\n")));
    if with_take_0 {
        ["x0", "y0", "z0"].iter().for_each(|n| header.push_str(&format!("property float {n}\n")));
    }
    header.push_str(&format!("element face {}\nproperty list uchar int vertex_indices\n", mesh.triangles.len()));
    ["layer", "region", "visible"].iter().for_each(|n| header.push_str(&format!("property uchar {n}\n")));
    header.push_str("end_header\n");
    let mut out = header.into_bytes();
    for (v, p) in mesh.positions.iter().enumerate() {
        p.iter().for_each(|c| out.extend(c.to_le_bytes()));
        out.extend(mesh.colors[v]);
        if with_take_0 {
            surface.in_take_0[v].iter().for_each(|c| out.extend(c.to_le_bytes()));
        }
    }
    for (t, corners) in mesh.triangles.iter().enumerate() {
        out.push(3);
        corners.iter().for_each(|&v| out.extend((v as i32).to_le_bytes()));
        out.extend([surface.layer[t], surface.region[t], u8::from(visible[t])]);
    }
    out
}

fn poses_text(take: &Take) -> String {
    let mut text = String::from(
        "# timestamp tx ty tz qx qy qz qw = subject_from_camera (metres; subject: y up, origin on the disk's axis at its top)\n",
    );
    let poses: Vec<TimedPose> = take
        .moments
        .iter()
        .enumerate()
        .map(|(index, moment)| TimedPose { time_ns: moment.time_ns, pose: take.subject_from_camera(index) })
        .collect();
    text.push_str(&trajectory::to_text(&poses));
    text
}

fn pose_json(take: &Take) -> Value {
    let joints = take.joint_positions();
    let angles = JOINTS.iter().map(|&j| (j.name().to_string(), json!(take.pose.rotation(j).scaled_axis().as_slice())));
    let height = take.body.bounds().map_or(0.0, |(lo, hi)| hi.y - lo.y);
    json!({
        "take": take.name,
        "joints": by_name(&joints),
        "theta": {
            "translation": take.pose.translation.as_slice(),
            "rotations": angles.collect::<serde_json::Map<String, Value>>(),
        },
        "posed_height_m": height,
    })
}

/// Joint positions by VRM name.
fn by_name(joints: &[Point3<f64>]) -> serde_json::Map<String, Value> {
    JOINTS.iter().map(|j| (j.name().to_string(), json!(joints[j.index()].coords.as_slice()))).collect()
}

fn sway_text(take: &Take) -> String {
    let mut text = String::from("# torso pitch deg, torso roll deg, breathing mm, per frame, about the true surface\n");
    for m in &take.moments {
        let row = format!("{:.5} {:.5} {:.5}\n", m.pitch.to_degrees(), m.roll.to_degrees(), m.breath * 1e3);
        text.push_str(&row);
    }
    text
}

/// Facts about the person: stature, girths, shape, joints at rest, takes, and the settings that it was made from.
pub fn subject_json(subject: &Subject) -> Value {
    let takes: Vec<String> = (0..subject.take_count()).map(|n| subject.settings.take_name(n)).collect();
    let volume = subject.person.body.mesh.signed_volume() * 1e3;
    json!({
        "name": subject.settings.name,
        "seed": subject.settings.seed,
        "sway": subject.settings.sway_degrees > 0.0,
        "takes": takes,
        "stature_m": subject.person.stature_m,
        "volume_l": volume,
        "girths": subject.person.girths,
        "beta": subject.person.beta,
        "rest_joints": by_name(&subject.person.body.skeleton.rest),
        "settings": subject.settings,
    })
}
