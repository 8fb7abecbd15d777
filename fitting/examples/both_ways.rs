//! The seed's own way beside the default on generated people of known shape and pose: `both_ways [PEOPLE]` prints the
//! errors of the body (eq. 4), and of the body posed under cloth that stands off (eq. 5 and 6), for each person and their
//! means.

use std::time::Instant;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use toile_character::{BodyModel, Joint, Pose, Region};
use toile_fitting::{FitSettings, UnderSettings, fit_body, pose_under, settle_under};
use toile_geometry::Mesh;

#[path = "../tests/common/mod.rs"]
mod common;
use common::{Person, joint_distance, mean_distance, person, scanned};

/// Trunk and legs under cloth that stands off by 12 mm, less in front than behind.
fn dressed(model: &BodyModel, beta: &[f64], pose: &Pose) -> Mesh {
    let mut mesh = Mesh::new(model.posed(beta, pose), model.triangles.clone());
    mesh.recompute_normals();
    let front = pose.rotation(Joint::Hips).cast::<f32>() * Vector3::z();
    for v in 0..mesh.positions.len() {
        if matches!(model.regions[v], Region::LeftLeg | Region::RightLeg | Region::Torso) {
            let n = mesh.normals[v];
            mesh.positions[v] += n * 0.012 * (1.0 - 0.6 * n.dot(&front));
        }
    }
    mesh.recompute_normals();
    mesh
}

/// The person stepped again: a little turned, arms held a little differently.
fn restepped(model: &BodyModel, truth: &Person) -> Pose {
    let mut next = truth.pose.clone();
    for (joint, angle) in [(Joint::LeftUpperArm, 0.04), (Joint::RightUpperArm, -0.03), (Joint::LeftUpperLeg, 0.02)] {
        let rotation = next.rotation_mut(joint);
        *rotation = UnitQuaternion::from_scaled_axis(Vector3::z() * angle) * *rotation;
    }
    let step = Isometry3::new(Vector3::new(0.012, 0.0, -0.01), Vector3::y() * 0.05);
    next.moved(&step, &model.skeleton_at(&truth.beta))
}

/// Millimetres, seconds and a share: surface and joints of the body, pose under cloth, share outside of it.
type Row = [f64; 6];

fn row(
    model: &BodyModel,
    seed: u64,
    fit: &FitSettings,
    under: &UnderSettings,
) -> Result<Row, Box<dyn std::error::Error>> {
    let truth = person(model, seed, 0.0);
    let scan = scanned(model, &truth, 0.0015, seed);
    let start = Instant::now();
    let found = fit_body(model, &scan, fit, &|_| {})?;
    let fit_seconds = start.elapsed().as_secs_f64();
    let surface = mean_distance(&found.posed_body().positions, &truth.mesh.positions);
    let joints = joint_distance(
        &found.pose.joint_positions(&found.skeleton),
        &truth.pose.joint_positions(&model.skeleton_at(&truth.beta)),
    );
    let body = model.skinned(&truth.beta);
    let next = restepped(model, &truth);
    let scan = dressed(model, &truth.beta, &next);
    let start = Instant::now();
    let posed = pose_under(&body, &[], &truth.pose, &scan, under, &|_| {})?;
    let settled = settle_under(model, &body, &posed.pose, &scan, under)?;
    let under_seconds = start.elapsed().as_secs_f64();
    let skin = mean_distance(&settled.mesh.positions, &body.posed(&next));
    Ok([1e3 * surface, 1e3 * joints, fit_seconds, 1e3 * skin, 100.0 * settled.report.outside, under_seconds])
}

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let people: u64 = std::env::args().nth(1).map_or(Ok(5), |a| a.parse())?;
    let model = BodyModel::load_default()?;
    println!("way    person: body mm, joints mm, s | under cloth mm, outside %, s");
    for (name, fit, under) in [
        ("toile", FitSettings::default(), UnderSettings::default()),
        ("seed ", FitSettings::seed(), UnderSettings::seed()),
    ] {
        let mut sum = [0.0; 6];
        for seed in 1..=people {
            let row = row(&model, seed, &fit, &under)?;
            print(name, &seed.to_string(), &row);
            sum.iter_mut().zip(row).for_each(|(s, r)| *s += r / people as f64);
        }
        print(name, "mean", &sum);
    }
    Ok(())
}

#[allow(clippy::print_stdout)]
fn print(name: &str, who: &str, [surface, joints, fit_s, skin, outside, under_s]: &Row) {
    println!("{name}  {who}: {surface:.2}, {joints:.1}, {fit_s:.1} | {skin:.2}, {outside:.2}, {under_s:.1}");
}
