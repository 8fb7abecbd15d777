//! People of other sliders than the model's own (`character/generator`, `toile_body.strangers`), posed and scanned. They are
//! of the same family of shapes as the model, so they are easier to fit than real people.
#![allow(dead_code)] // each user takes a part

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use toile_character::{BodyModel, JOINT_COUNT, Joint, Pose, Skeleton, SkinnedMesh, joint::JOINTS};
use toile_geometry::{Mesh, bvh::Bvh};

use super::Numbers;

/// The bodies of a `strangers` file, in the A-pose. The layout is in `toile_body/strangers.py`.
pub fn read(model: &BodyModel, bytes: &[u8]) -> Vec<SkinnedMesh> {
    let word = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|k| bytes[at + k]));
    let real = |at: usize| f64::from(f32::from_bits(word(at)));
    assert_eq!(&bytes[..8], b"TOILESTR");
    let [people, vertices, components, joints] = [8, 12, 16, 20].map(|at| word(at) as usize);
    assert_eq!((vertices, joints), (model.vertex_count(), JOINT_COUNT));
    let size = 4 * (components + 3 * joints + 1) + 3 * vertices;
    let one = |k: usize| {
        let start = 24 + k * size;
        let beta: Vec<f64> = (0..components).map(|i| real(start + 4 * i)).collect();
        let at = start + 4 * components;
        let joint = |j: usize| Point3::from([0, 1, 2].map(|c| real(at + 12 * j + 4 * c)));
        let skeleton = Skeleton { rest: std::array::from_fn(joint) };
        let (step, rest) = (real(at + 12 * joints) as f32, at + 12 * joints + 4);
        let mut mesh = Mesh::new(model.shape(&beta), model.triangles.clone());
        for (v, p) in mesh.positions.iter_mut().enumerate() {
            *p += Vector3::from([0, 1, 2].map(|c| step * f32::from(bytes[rest + 3 * v + c] as i8)));
        }
        SkinnedMesh { mesh, skeleton, weights: model.weights.clone() }
    };
    (0..people).map(one).collect()
}

/// A pose that somebody may stand in on a turntable, `wild` times as varied as usual: arms between hanging and the
/// T-pose, elbows, knees and head turned, any heading.
pub fn random_pose(body: &SkinnedMesh, numbers: &mut Numbers, wild: f64) -> Pose {
    let mut pose = Pose::identity();
    for joint in JOINTS {
        *pose.rotation_mut(joint) = UnitQuaternion::from_scaled_axis(numbers.vector() * wild * 5f64.to_radians());
    }
    let both = 5.0 + 30.0 * numbers.next();
    for side in [1.0, -1.0] {
        let left = side > 0.0;
        let joint = |l, r| if left { l } else { r };
        let arm = Vector3::new(side, -1.0, 0.0).normalize();
        let mut turn = |joint: Joint, axis: Vector3<f64>, degrees: f64| {
            let rotation = pose.rotation_mut(joint);
            *rotation = UnitQuaternion::from_scaled_axis(axis * wild * degrees.to_radians()) * *rotation;
        };
        turn(joint(Joint::LeftUpperArm, Joint::RightUpperArm), Vector3::z() * side, both + 8.0 * numbers.next());
        turn(joint(Joint::LeftLowerArm, Joint::RightLowerArm), arm.cross(&Vector3::z()), 15.0 + 15.0 * numbers.next());
        turn(joint(Joint::LeftUpperLeg, Joint::RightUpperLeg), Vector3::z() * side, 4.0 * numbers.next());
        turn(joint(Joint::LeftLowerLeg, Joint::RightLowerLeg), Vector3::x(), 6.0 + 6.0 * numbers.next());
    }
    let head = numbers.next() * 20f64.to_radians() * wild;
    *pose.rotation_mut(Joint::Neck) *= UnitQuaternion::from_scaled_axis(Vector3::y() * head);
    let heading = Vector3::y() * numbers.next() * std::f64::consts::PI;
    pose.moved(&Isometry3::new(numbers.vector() * 0.15, heading), &body.skeleton)
}

/// The part of a posed body that a turntable scan shows: no soles, no pockets, patches missing until `missing` of the surface
/// is gone, `noise` metres along the normals.
pub fn scanned(model: &BodyModel, body: &Mesh, missing: f64, noise: f64, numbers: &mut Numbers) -> Mesh {
    scanned_without(body, &model.inner, missing, noise, numbers)
}

/// The same; the vertices `hidden` are never seen.
pub fn scanned_without(body: &Mesh, hidden: &[bool], missing: f64, noise: f64, numbers: &mut Numbers) -> Mesh {
    let floor = body.positions.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
    let sole = |v: usize| body.positions[v].y < floor + 0.02 && body.normals[v].y < -0.4;
    let mut gone: Vec<bool> = (0..body.positions.len()).map(|v| hidden[v] || sole(v)).collect();
    let areas = vertex_areas(body);
    let left = |gone: &[bool]| areas.iter().zip(gone).filter(|a| !a.1).map(|a| a.0).sum::<f64>();
    let whole = left(&gone);
    while left(&gone) > (1.0 - missing) * whole {
        let mut at = (numbers.next() * 0.5 + 0.5) * areas.iter().sum::<f64>();
        let hit = areas.iter().position(|a| {
            at -= a;
            at <= 0.0
        });
        let center = body.positions[hit.unwrap_or(0)];
        let radius = 0.04 + 0.1 * numbers.next().abs() as f32;
        body.positions.iter().zip(&mut gone).for_each(|(p, g)| *g |= (p - center).norm() < radius);
    }
    let (mut scan, _) = body.filter_triangles(|t| body.triangles[t].iter().all(|&v| !gone[v as usize]));
    for (p, n) in scan.positions.iter_mut().zip(&scan.normals) {
        *p += n * (noise * numbers.normal()) as f32;
    }
    scan
}

/// One depth image of a Kinect v2 (512 × 424) at breast height, 2.4 m before the body, as a mesh: noise that grows with
/// distance and slant, no surface at edges and at grazing angles. `front` is the body's heading.
pub fn one_view(body: &Mesh, heading: f64, numbers: &mut Numbers) -> Mesh {
    const FOCAL: f64 = 365.0;
    const SIZE: (usize, usize) = (512, 424);
    const TORN: f64 = 0.03;
    let bvh = Bvh::new(&body.positions, &body.triangles);
    let (low, high) = body.positions.iter().fold((f32::MAX, f32::MIN), |(l, h), p| (l.min(p.y), h.max(p.y)));
    let middle = body.positions.iter().map(|p| p.coords).sum::<Vector3<f32>>() / body.positions.len() as f32;
    let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * heading).cast::<f32>();
    let eye = Point3::new(middle.x, low + 0.52 * (high - low), middle.z) + turn * Vector3::z() * 2.4;
    let mut mesh = Mesh::default();
    let mut at = vec![None; SIZE.0 * SIZE.1];
    for (i, at) in at.iter_mut().enumerate() {
        let (u, v) = ((i % SIZE.0) as f64 - 255.5, (i / SIZE.0) as f64 - 211.5);
        let ray = turn * Vector3::new(u / FOCAL, -v / FOCAL, -1.0).cast::<f32>();
        let Some(hit) = bvh.ray(&eye, &ray, 4.0) else { continue };
        let [a, b, c] = body.corners(hit.triangle as usize);
        let normal = (b - a).cross(&(c - a)).try_normalize(1e-20).unwrap_or_default();
        let cosine = f64::from(-normal.dot(&ray.normalize()));
        if cosine < 0.15 {
            continue;
        }
        let z = f64::from(hit.t);
        let slope = ((1.0 - cosine * cosine) / (cosine * cosine)).min(16.0);
        let spread = 0.0015 * (0.6 + 0.1 * z * z) * (1.0 + 0.08 * slope);
        *at = Some((mesh.positions.len() as u32, z));
        mesh.positions.push(eye + ray * (z + spread * numbers.normal()) as f32);
    }
    for i in 0..at.len() - SIZE.0 - 1 {
        for corners in [[i, i + SIZE.0, i + 1], [i + 1, i + SIZE.0, i + SIZE.0 + 1]] {
            let [Some(a), Some(b), Some(c)] = corners.map(|k| at[k]) else { continue };
            if (a.1 - b.1).abs().max((b.1 - c.1).abs()).max((c.1 - a.1).abs()) < TORN && i % SIZE.0 + 1 < SIZE.0 {
                mesh.triangles.push([a.0, b.0, c.0]);
            }
        }
    }
    mesh.recompute_normals();
    mesh
}

/// Mean distance between two closed surfaces on their outer skin, the larger of both directions, metres.
pub fn surface_distance(model: &BodyModel, a: &Mesh, b: &Mesh) -> f64 {
    one_way(model, a, b).max(one_way(model, b, a))
}

/// Mean distance from the outer skin of one surface to another, metres.
pub fn one_way(model: &BodyModel, from: &Mesh, to: &Mesh) -> f64 {
    let bvh = Bvh::new(&to.positions, &to.triangles);
    let areas = vertex_areas(from);
    let (mut sum, mut total) = (0.0, 0.0);
    for v in (0..from.positions.len()).filter(|&v| !model.inner[v]) {
        let distance = bvh.closest(&from.positions[v], 1.0).map_or(1.0, |h| f64::from(h.distance));
        sum += areas[v] * distance;
        total += areas[v];
    }
    sum / total
}

/// A third of the area of the triangles around each vertex, square metres.
fn vertex_areas(mesh: &Mesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.positions.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(t);
        let third = f64::from((b - a).cross(&(c - a)).norm()) / 6.0;
        triangle.iter().for_each(|&v| areas[v as usize] += third);
    }
    areas
}
