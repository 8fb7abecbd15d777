//! Fits random people: `many_people COUNT [full|patchy|front]`; prints each miss and the distribution of errors.
//!
//! The people are the model's own, bent smoothly by some 3 mm outside its span, in wider poses than a rig asks for,
//! with 2 mm of noise; `patchy` removes about a fifth of the surface in patches, `front` leaves what one camera sees.

use std::time::Instant;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use toile_character::{BodyModel, Joint, Pose, joint::JOINTS};
use toile_fitting::{FitSettings, Verdict, fit_body};
use toile_geometry::{Mesh, bvh::Bvh};

struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
    fn normal(&mut self) -> f64 {
        self.next() + self.next() + self.next()
    }
    fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next())
    }
}

fn person(model: &BodyModel, numbers: &mut Numbers) -> (Mesh, Vec<Point3<f64>>) {
    let beta: Vec<f64> = (0..model.component_count()).map(|_| numbers.normal()).collect();
    let mut pose = Pose::identity();
    for joint in JOINTS {
        let degrees = if joint.is_finger() { 6.0 } else { 5.0 };
        *pose.rotation_mut(joint) = UnitQuaternion::from_scaled_axis(numbers.vector() * f64::to_radians(degrees));
    }
    let arms = (numbers.next() * 0.5 + 0.2) * 0.9; // from 17° above the hanging arm to nearly the T-pose
    for (joint, side) in [(Joint::LeftUpperArm, 1.0), (Joint::RightUpperArm, -1.0)] {
        let rotation = pose.rotation_mut(joint);
        *rotation = UnitQuaternion::from_scaled_axis(Vector3::z() * side * arms) * *rotation;
    }
    let turn = Isometry3::new(numbers.vector() * 0.2, Vector3::y() * numbers.next() * 3.1);
    let skeleton = model.skeleton_at(&beta);
    let pose = pose.moved(&turn, &skeleton);
    let mut mesh = Mesh::new(model.posed(&beta, &pose), model.triangles.clone());
    mesh.recompute_normals();
    let waves: Vec<(Vector3<f64>, f64)> = (0..12).map(|_| (numbers.vector() * 30.0, numbers.next() * 3.1)).collect();
    for (p, n) in mesh.positions.iter_mut().zip(&mesh.normals) {
        let bump: f64 = waves.iter().map(|(k, phase)| (k.dot(&p.coords.cast()) + phase).sin()).sum();
        *p += n * (0.0012 * bump) as f32;
    }
    mesh.recompute_normals();
    (mesh, pose.joint_positions(&skeleton))
}

fn scanned(model: &BodyModel, mesh: &Mesh, what: &str, numbers: &mut Numbers) -> Mesh {
    let mut gone = vec![false; mesh.positions.len()];
    let floor = mesh.positions.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
    for (v, p) in mesh.positions.iter().enumerate() {
        gone[v] = model.inner[v] || (p.y < floor + 0.02 && mesh.normals[v].y < -0.4);
    }
    if what == "patchy" {
        while gone.iter().filter(|g| **g).count() * 10 < gone.len() * 3 {
            let center = mesh.positions[((numbers.next() * 0.5 + 0.5) * (gone.len() - 1) as f64) as usize];
            let radius = 0.05 + 0.1 * numbers.next().abs() as f32;
            mesh.positions.iter().zip(&mut gone).for_each(|(p, g)| *g |= (p - center).norm() < radius);
        }
    }
    if what == "front" {
        let bvh = Bvh::new(&mesh.positions, &mesh.triangles);
        let eye = Point3::new(0.0, 1.1, 2.5);
        for (v, p) in mesh.positions.iter().enumerate() {
            let d = eye - p;
            let from = p + mesh.normals[v] * 0.003;
            gone[v] |= mesh.normals[v].dot(&d.normalize()) < 0.15 || bvh.ray(&from, &d, 1.0).is_some();
        }
    }
    let (mut scan, _) = mesh.filter_triangles(|t| mesh.triangles[t].iter().all(|&v| !gone[v as usize]));
    for (p, n) in scan.positions.iter_mut().zip(&scan.normals) {
        *p += n * (0.002 * numbers.normal()) as f32;
    }
    scan
}

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let count: u64 = arguments.first().map_or(Ok(20), |a| a.parse())?;
    let what = arguments.get(1).map_or("full", String::as_str);
    let model = BodyModel::load_default()?;
    let (mut errors, mut wrong, start) = (Vec::new(), 0, Instant::now());
    for seed in 0..count {
        let mut numbers = Numbers(seed * 7919 + 1);
        let (truth, joints) = person(&model, &mut numbers);
        let scan = scanned(&model, &truth, what, &mut numbers);
        let fit = fit_body(&model, &scan, &FitSettings::default(), &|_| {})?;
        let bvh = Bvh::new(&fit.posed_body().positions, &model.triangles);
        let outer = (0..truth.positions.len()).filter(|&v| !model.inner[v]);
        let distances: Vec<f32> =
            outer.filter_map(|v| bvh.closest(&truth.positions[v], 1.0)).map(|h| h.distance).collect();
        let mean = 1e3 * distances.iter().sum::<f32>() / distances.len() as f32;
        let off = fit.pose.joint_positions(&fit.skeleton);
        let off = 1e3 * joints.iter().zip(&off).take(22).map(|(a, b)| (a - b).norm()).sum::<f64>() / 22.0;
        let trusted = fit.verdict() == Verdict::Trusted;
        wrong += usize::from(trusted != (mean < 4.0));
        if mean > 3.0 || !trusted || off > 12.0 {
            println!("{seed}: {mean:.2} mm, joints {off:.1} mm, {:?} {:?}", fit.verdict(), fit.report.reasons);
        }
        errors.push((mean, off));
    }
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    let at = |q: usize| errors[(errors.len() * q / 100).min(errors.len() - 1)].0;
    let joints = errors.iter().map(|e| e.1).sum::<f64>() / errors.len() as f64;
    println!(
        "mean error by quantile: 50 % {:.2}, 95 % {:.2}, worst {:.2} mm; joints {joints:.1} mm",
        at(50),
        at(95),
        at(100)
    );
    println!("verdict wrong {wrong} times of {count}; {:.2} s a fit", start.elapsed().as_secs_f64() / count as f64);
    Ok(())
}
