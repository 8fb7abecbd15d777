//! A person in a skirt and a jumper, for tests and benches of an outfit in real time.
#![allow(dead_code, clippy::unwrap_used)] // not every test uses all of it

use nalgebra::{Point3, UnitQuaternion, Vector3};
use toile_animation::blend::{Outfit, OutfitLayer};
use toile_character::{BodyModel, Joint, Pose, SkinWeights};
use toile_cloth::Fabric;
use toile_geometry::Mesh;

/// The mean person in a skirt from the waist to the knees, which hangs on the hips, and in a jumper over the skin of trunk and arms.
pub fn dressed() -> Outfit {
    let body = BodyModel::load_default().unwrap().skinned(&[]);
    let fabric = Fabric::named("shirting").unwrap();
    let layer = |name: &str, mesh: Mesh, weights: SkinWeights| OutfitLayer { name: name.into(), mesh, weights, fabric };
    let skirt =
        skirt(&body.skeleton.position(Joint::Hips).cast(), body.skeleton.position(Joint::LeftLowerLeg).y as f32);
    let mut on_hips = SkinWeights::default();
    (0..skirt.positions.len()).for_each(|_| on_hips.push(&[(Joint::Hips.index() as u8, 1.0)]));
    let (jumper, of_jumper) = jumper(&body.mesh, &body.weights);
    let layers = vec![
        layer("body", body.mesh.clone(), body.weights.clone()),
        layer("01-skirt", skirt, on_hips),
        layer("02-jumper", jumper, of_jumper),
    ];
    Outfit::new(body.skeleton.clone(), Pose::identity(), layers).unwrap()
}

/// A tube around hips and legs.
fn skirt(hips: &Point3<f32>, knee: f32) -> Mesh {
    let (around, rows, top) = (90u32, 50u32, hips.y + 0.08);
    let mut mesh = Mesh::default();
    for row in 0..rows {
        let down = row as f32 / (rows - 1) as f32;
        for column in 0..around {
            let (sine, cosine) = (std::f32::consts::TAU * column as f32 / around as f32).sin_cos();
            let radius = 0.22 + 0.10 * down;
            mesh.positions.push(Point3::new(
                hips.x + radius * sine,
                top + (knee - top) * down,
                hips.z + radius * cosine,
            ));
        }
    }
    for cell in 0..around * (rows - 1) {
        let beside = cell / around * around + (cell + 1) % around;
        mesh.triangles.push([cell, cell + around, beside]);
        mesh.triangles.push([beside, cell + around, beside + around]);
    }
    mesh
}

/// The skin of trunk and arms, 12 mm further out.
fn jumper(body: &Mesh, weights: &SkinWeights) -> (Mesh, SkinWeights) {
    let normals = body.vertex_normals();
    let out: Vec<Point3<f32>> = body.positions.iter().zip(&normals).map(|(p, n)| p + n * 0.012).collect();
    let covers = |v: u32| {
        use Joint::*;
        let joint = Joint::from_index(usize::from(weights.joints[v as usize][0])).unwrap();
        [Spine, Chest, UpperChest, LeftUpperArm, RightUpperArm, LeftLowerArm, RightLowerArm].contains(&joint)
    };
    let whole = Mesh::new(out, body.triangles.clone());
    let (mesh, old) = whole.filter_triangles(|t| body.triangles[t].iter().all(|&v| covers(v)));
    (mesh, weights.gather(&old))
}

/// A step on the spot: the legs swing against each other, the arms too, the person goes ahead at 1 m/s.
pub fn striding(seconds: f64) -> Pose {
    let mut pose = Pose::identity();
    let swing = 0.5 * (std::f64::consts::TAU * seconds).sin();
    let turn = |angle: f64| UnitQuaternion::from_euler_angles(angle, 0.0, 0.0);
    *pose.rotation_mut(Joint::LeftUpperLeg) = turn(swing);
    *pose.rotation_mut(Joint::RightUpperLeg) = turn(-swing);
    *pose.rotation_mut(Joint::LeftUpperArm) = turn(-0.5 * swing);
    *pose.rotation_mut(Joint::RightUpperArm) = turn(0.5 * swing);
    pose.translation = Vector3::new(0.0, 0.0, seconds);
    pose
}
