//! The shipped body model: its invariants, its joints, its speed, and that it can express unknown people.
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use toile_character::{
    BodyModel, JOINT_COUNT, Joint, JointRegressor, Pose, Region, joint::JOINTS, mean_value::mean_value_weights,
    skinning,
};
use toile_geometry::{Mesh, topology::Edges};

fn model() -> BodyModel {
    BodyModel::load_default().unwrap()
}

/// β of an unusual but possible person.
fn someone() -> Vec<f64> {
    (0..50).map(|i| (f64::from(i) * 1.7).sin() * 1.5).collect()
}

#[test]
fn the_template_is_the_one_that_the_documents_promise() {
    let m = model();
    assert_eq!((m.vertex_count(), m.triangles.len(), m.component_count()), (13_380, 26_756, 50));
    assert!(Edges::new(&m.triangles).is_closed());
    let mesh = Mesh::new(m.mean.clone(), m.triangles.clone());
    assert!((0.05..0.1).contains(&mesh.signed_volume()), "outward, a person's volume: {}", mesh.signed_volume());
    let hidden = m.inner.iter().filter(|&&i| i).count();
    assert!((500..1600).contains(&hidden), "{hidden}");
    assert!(m.inner.iter().zip(&m.regions).all(|(&i, &r)| !i || r == Region::Head));
    assert!(m.sigma.windows(2).all(|s| s[0] >= s[1]), "components come strongest first");
}

#[test]
fn any_person_stands_on_the_floor() {
    let m = model();
    for beta in [vec![], someone(), m.population.beta_male.iter().map(|&b| f64::from(b)).collect()] {
        let low = m.shape(&beta).iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
        assert!(low.abs() < 0.004, "soles at {low} m");
    }
    let feet = m.mean_skeleton.position(Joint::LeftFoot) + m.mean_skeleton.position(Joint::RightFoot).coords;
    assert!(feet.x.abs() < 0.01 && feet.z.abs() < 0.01, "{feet}");
    let nose = m.mean[m.landmark("noseTip").unwrap() as usize];
    assert!(nose.z > 0.05, "the front is +Z");
    assert!(m.mean_skeleton.position(Joint::LeftHand).x > 0.3, "the left is +X");
}

#[test]
fn weights_sum_to_one_and_mirror() {
    let m = model();
    for v in 0..m.vertex_count() {
        let sum: f32 = m.weights.of(v).map(|i| i.1).sum();
        assert!((sum - 1.0).abs() < 1e-6);
        assert!(m.weights.of(v).all(|i| (i.0 as usize) < JOINT_COUNT));
    }
    let side = |name: &str| {
        let hand = Joint::from_name(name).unwrap().index() as u8;
        m.weights.joints.iter().filter(|j| j[0] == hand).count()
    };
    assert_eq!(side("leftLowerArm"), side("rightLowerArm"));
}

#[test]
fn joints_lie_inside_the_body() {
    let m = model();
    for beta in [vec![], someone()] {
        let positions: Vec<Point3<f64>> = m.shape(&beta).iter().map(|p| p.cast()).collect();
        let affine = m.joints_affine(&beta);
        let mvc = m.joints_mvc(&m.shape(&beta)).unwrap();
        for (name, skeleton) in [("affine", affine), ("mvc", mvc)] {
            let outside: Vec<_> = skeleton
                .iter()
                .filter(|(_, p)| winding_number(p, &positions, &m.triangles) < 0.5)
                .map(|(j, _)| j.name())
                .collect();
            assert!(outside.is_empty(), "{name}: {outside:?}");
        }
    }
}

/// Generalised winding number by summed solid angles: 1 inside, 0 outside.
fn winding_number(p: &Point3<f64>, positions: &[Point3<f64>], triangles: &[[u32; 3]]) -> f64 {
    let solid_angle = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| positions[v as usize] - p);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        2.0 * a.dot(&b.cross(&c)).atan2(below)
    };
    triangles.iter().map(solid_angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

#[test]
fn mean_value_joints_follow_every_affine_map_exactly() {
    let m = model();
    let linear = Matrix3::new(1.2, 0.3, -0.1, 0.2, 0.7, 0.4, -0.3, 0.1, 1.1);
    let map = |p: Point3<f64>| Point3::from(linear * p.coords + Vector3::new(0.5, -1.0, 2.0));
    let moved: Vec<Point3<f32>> = m.mean.iter().map(|p| map(p.cast()).cast()).collect();
    for ((joint, rest), image) in m.mean_skeleton.iter().zip(m.joints_mvc(&moved).unwrap().rest) {
        assert!((map(rest) - image).norm() < 2e-6, "{}: {}", joint.name(), (map(rest) - image).norm());
    }
    assert!(m.joints_mvc(&moved[1..]).is_err());
}

#[test]
fn the_two_joint_regressors_agree_on_the_mean_and_nearly_elsewhere() {
    let m = model();
    let beta: Vec<f64> = someone().iter().map(|b| b * 0.6).collect();
    let (affine, mvc) = (m.joints_affine(&beta), m.joints_mvc(&m.shape(&beta)).unwrap());
    let gap = |a: &toile_character::Skeleton, b: &toile_character::Skeleton| -> f64 {
        JOINTS.iter().map(|&j| (a.position(j) - b.position(j)).norm()).sum::<f64>() / JOINT_COUNT as f64
    };
    assert!(gap(&m.mean_skeleton, &m.joints_mvc(&m.mean).unwrap()) < 1e-6);
    assert_eq!(mvc, m.skeleton_by(&beta, JointRegressor::MeanValue));
    assert_eq!(affine, m.skeleton_at(&beta));
    assert!(gap(&affine, &mvc) < 0.02, "{}", gap(&affine, &mvc));
}

#[test]
fn shape_is_linear_and_shorter_betas_are_prefixes() {
    let m = model();
    let beta = someone();
    let mut padded = beta[..15].to_vec();
    padded.resize(50, 0.0);
    assert_eq!(m.shape(&beta[..15]), m.shape(&padded));
    assert_eq!(m.shape(&[]), m.mean);
    let twice: Vec<f64> = beta.iter().map(|b| 2.0 * b).collect();
    for ((p, q), mean) in m.shape(&beta).iter().zip(m.shape(&twice)).zip(&m.mean) {
        assert!(((q - mean) - (p - mean) * 2.0).norm() < 1e-5);
    }
}

#[test]
fn rigid_poses_move_the_body_rigidly() {
    let m = model();
    let (beta, rest) = (someone(), m.shape(&someone()));
    let identity = m.posed(&beta, &Pose::identity());
    assert!(identity.iter().zip(&rest).all(|(a, b)| (a - b).norm() < 1e-6));
    let a_from_b = Isometry3::new(Vector3::new(0.4, 0.1, -2.0), Vector3::new(0.3, 1.2, -0.2));
    let moved = m.posed(&beta, &Pose::identity().moved(&a_from_b, &m.skeleton_at(&beta)));
    for (a, b) in moved.iter().zip(&rest) {
        assert!((a.cast::<f64>() - a_from_b * b.cast::<f64>()).norm() < 1e-5);
    }
}

#[test]
fn a_bent_elbow_moves_the_forearm_alone() {
    let m = model();
    let mut pose = Pose::identity();
    *pose.rotation_mut(Joint::LeftLowerArm) = UnitQuaternion::from_euler_angles(0.0, -1.0, 0.0);
    let posed = m.posed(&[], &pose);
    for (v, (a, b)) in posed.iter().zip(&m.mean).enumerate() {
        match m.regions[v] {
            Region::LeftHand => assert!((a - b).norm() > 0.1, "vertex {v}"),
            Region::RightArm | Region::LeftLeg | Region::Head => assert!((a - b).norm() < 1e-6, "vertex {v}"),
            _ => {}
        }
    }
}

#[test]
fn landmarks_are_where_their_names_say() {
    let m = model();
    let at = |n: &str| m.mean[m.landmark(n).unwrap() as usize];
    let stature = at("vertex").y;
    let share = |n: &str| at(n).y / stature;
    for (name, low, high) in [
        ("chin", 0.84, 0.90),
        ("suprasternale", 0.79, 0.84),
        ("leftAcromion", 0.79, 0.86),
        ("leftNipple", 0.69, 0.76),
        ("navel", 0.57, 0.63),
        ("crotch", 0.43, 0.50),
        ("leftKneeFront", 0.24, 0.31),
        ("cervicale", 0.82, 0.88),
        ("leftAnkleOuter", 0.02, 0.08),
        ("leftHeel", 0.0, 0.05),
        ("leftTrochanter", 0.47, 0.56),
        ("leftButtock", 0.47, 0.55),
        ("leftAxilla", 0.72, 0.79),
        ("leftTragion", 0.91, 0.96),
    ] {
        assert!((low..high).contains(&share(name)), "{name} at {:.3} of the stature", share(name));
    }
    for (name, _) in &m.landmarks {
        assert!(!m.inner[m.landmark(name).unwrap() as usize], "{name} is skin");
        if let Some(rest) = name.strip_prefix("left") {
            let (a, b) = (at(name), at(&format!("right{rest}")));
            assert!(a.x > 0.0 && (a.x + b.x).abs() < 0.005 && (a.y - b.y).abs() < 0.005, "{name}: {a} {b}");
        }
    }
    assert!(m.landmark("tail").is_none());
}

#[test]
fn the_population_follows_ansur() {
    let report = model().population.report;
    for sex in ["male", "female"] {
        let p = &report["population"][sex];
        let numbers = |k: &str| -> Vec<f64> { p[k].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect() };
        for (have, want) in numbers("mean").iter().zip(numbers("ansur_mean")) {
            assert!((have / want - 1.0).abs() < 0.01, "{sex} mean {have}, ANSUR II {want}");
        }
        for (have, want) in numbers("sd").iter().zip(numbers("ansur_sd")) {
            assert!((have / want - 1.0).abs() < 0.08, "{sex} sd {have}, ANSUR II {want}");
        }
        assert!(p["correlation_max_difference"].as_f64().unwrap() < 0.05);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 8, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn unposing_takes_back_posing(seed in 0u64..1000) {
        let m = model();
        let mut pose = Pose::identity();
        for (i, r) in pose.rotations.iter_mut().enumerate() {
            let t = seed as f64 + i as f64 * 0.7;
            *r = UnitQuaternion::from_euler_angles(0.3 * t.sin(), 0.3 * (1.3 * t).cos(), 0.3 * (2.1 * t).sin());
        }
        let transforms = pose.skinning_transforms(&m.mean_skeleton);
        let back = skinning::unskin(&skinning::skin(&m.mean, &m.weights, &transforms), &m.weights, &transforms);
        prop_assert!(back.iter().zip(&m.mean).all(|(a, b)| (a - b).norm() < 1e-4));
    }
}

#[test]
fn mean_value_weights_match_the_cached_ones() {
    let m = model();
    let positions: Vec<Point3<f64>> = m.mean.iter().map(|p| p.cast()).collect();
    let joint = Joint::LeftLowerArm;
    let direct = mean_value_weights(&m.mean_skeleton.position(joint), &positions, &m.triangles);
    assert_eq!(direct, m.mean_value_weights()[joint.index()]);
}

/// Bodies of the private test data share the template, subdivided once: their first vertices are the template's.
/// Un-posed they must lie within the model's span, up to the smooth detail put on them.
#[test]
fn unknown_people_lie_near_the_models_span() {
    let Some(root) = toile_outside::data("subjects") else { return };
    let list = std::fs::read_dir(&root).unwrap_or_else(|e| panic!("{}: {e}", root.display()));
    let m = model();
    let mut names: Vec<_> = list.flatten().map(|e| e.path()).collect();
    names.sort();
    for subject in names {
        let truth = subject.join("00-body/truth");
        let mesh = toile_geometry::ply::read(&truth.join("body.ply")).unwrap();
        let error = projection_error(&m, &mesh.positions[..m.vertex_count()]);
        println!("{}: mean distance to the span without hands, feet, head {:.2} mm", subject.display(), error * 1e3);
        assert!(error < 0.005, "{error}");
    }
}

/// Mean distance between corresponding vertices (hands, feet, head and pockets left out) of `posed` and the model, after
/// fitting β and a free rigid transform a joint by turns: what the model and its skinning cannot express.
fn projection_error(m: &BodyModel, posed: &[Point3<f32>]) -> f64 {
    let mut beta = vec![0.0; m.component_count()];
    let mut transforms = vec![Isometry3::identity(); JOINT_COUNT];
    for _ in 0..10 {
        transforms = rigid_parts(m, &m.shape(&beta), posed);
        beta = project(m, &skinning::unskin(posed, &m.weights, &transforms));
    }
    let model = skinning::skin(&m.shape(&beta), &m.weights, &transforms);
    let body = |v: &usize| !m.regions[*v].is_extremity() && !m.inner[*v];
    let distances: Vec<f64> = (0..posed.len()).filter(body).map(|v| f64::from((model[v] - posed[v]).norm())).collect();
    distances.iter().sum::<f64>() / distances.len() as f64
}

/// For each joint the rigid transform that best takes its vertices from `rest` to `posed` (Kabsch).
fn rigid_parts(m: &BodyModel, rest: &[Point3<f32>], posed: &[Point3<f32>]) -> Vec<Isometry3<f64>> {
    let part = |joint: usize| {
        let (mut sum, mut a, mut b) = (0.0, Vector3::zeros(), Vector3::zeros());
        let mut pairs = Vec::new();
        for v in 0..rest.len() {
            if let Some((_, w)) = m.weights.of(v).find(|i| usize::from(i.0) == joint) {
                let (w, p, q) = (f64::from(w).powi(2), rest[v].coords.cast::<f64>(), posed[v].coords.cast::<f64>());
                pairs.push((w, p, q));
                (sum, a, b) = (sum + w, a + p * w, b + q * w);
            }
        }
        let (a, b) = (a / sum, b / sum);
        let spread: Matrix3<f64> = pairs.iter().map(|(w, p, q)| (q - b) * (p - a).transpose() * *w).sum();
        let svd = spread.svd(true, true);
        let (u, v_t) = (svd.u.unwrap(), svd.v_t.unwrap());
        let sign = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant()));
        let rotation = UnitQuaternion::from_matrix(&(u * sign * v_t));
        Isometry3::from_parts((b - rotation * a).into(), rotation)
    };
    (0..JOINT_COUNT).map(part).collect()
}

/// Least-squares β of a body in the rest pose.
fn project(m: &BodyModel, rest: &[Point3<f32>]) -> Vec<f64> {
    let k = m.component_count();
    let (mut normal, mut right) = (nalgebra::DMatrix::<f64>::zeros(k, k), nalgebra::DVector::<f64>::zeros(k));
    for v in (0..rest.len()).filter(|&v| !m.inner[v]) {
        let row =
            nalgebra::Matrix3xX::from_columns(&m.components.iter().map(|c| c[v].cast::<f64>()).collect::<Vec<_>>());
        normal += row.transpose() * &row;
        right += row.transpose() * (rest[v] - m.mean[v]).cast::<f64>();
    }
    normal.cholesky().unwrap().solve(&right).as_slice().to_vec()
}
