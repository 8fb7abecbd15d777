//! An outfit in motion: a body in a tube of cloth.
#![allow(clippy::unwrap_used)] // all of it is test code

use nalgebra::{Point3, UnitQuaternion, Vector3};
use toile_animation::blend::{Blend, Outfit, OutfitLayer, Wearer};
use toile_character::{BodyModel, Joint, Pose, Skeleton, SkinWeights, Skinning, skinning};
use toile_cloth::Fabric;
use toile_geometry::Mesh;

/// The mean person in a skirt: a tube around hips and legs from the waist to the knees, that hangs on the hips.
fn outfit() -> (Outfit, Skeleton) {
    let body = BodyModel::load_default().unwrap().skinned(&[]);
    let hips = body.skeleton.position(Joint::Hips).cast::<f32>();
    let knee = body.skeleton.position(Joint::LeftLowerLeg).y as f32;
    let top = hips.y + 0.10;
    let (around, rows) = (72u32, 40u32);
    let at = |v: u32| {
        let angle = std::f32::consts::TAU * (v % around) as f32 / around as f32;
        let down = (v / around) as f32 / (rows - 1) as f32;
        let radius = 0.22 + 0.10 * down;
        Point3::new(hips.x + radius * angle.sin(), top + (knee - top) * down, hips.z + radius * angle.cos())
    };
    let cell = |q: u32| (q, q / around * around + (q + 1) % around);
    let cut = |(a, b): (u32, u32)| [[a, a + around, b], [b, a + around, b + around]];
    let mesh =
        Mesh::new((0..around * rows).map(at).collect(), (0..around * (rows - 1)).map(cell).flat_map(cut).collect());
    let mut weights = SkinWeights::default();
    (0..mesh.positions.len()).for_each(|_| weights.push(&[(Joint::Hips.index() as u8, 1.0)]));
    let fabric = Fabric::named("shirting").unwrap();
    let layers = vec![
        OutfitLayer { name: "body".into(), mesh: body.mesh.clone(), weights: body.weights.clone(), fabric },
        OutfitLayer { name: "01-skirt".into(), mesh, weights, fabric },
    ];
    (Outfit::new(body.skeleton.clone(), Pose::identity(), layers).unwrap(), body.skeleton)
}

fn farthest(a: &[Point3<f32>], b: &[Point3<f32>]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f32::max)
}

#[test]
fn without_cloth_layers_lie_where_their_weights_say() {
    let (outfit, skeleton) = outfit();
    let mut pose = Pose::identity();
    *pose.rotation_mut(Joint::LeftUpperLeg) = UnitQuaternion::from_euler_angles(-0.6, 0.0, 0.0);
    let mut wearer = Wearer::new(&outfit, Blend::Skinning, Skinning::Linear);
    wearer.advance(&pose, 1.0 / 30.0).unwrap();
    let body = &outfit.layers()[0];
    let expected = skinning::skin(&body.mesh.positions, &body.weights, &pose.skinning_transforms(&skeleton));
    assert!(farthest(&wearer.layers()[0], &expected) < 1e-5);
    assert!(farthest(&wearer.layers()[1], outfit.scanned(1)) < 1e-5);
}

#[test]
fn who_stands_still_wears_the_scanned_shape() {
    let (outfit, _) = outfit();
    let mut wearer = Wearer::new(&outfit, Blend::Anchored, Skinning::Linear);
    for _ in 0..20 {
        wearer.advance(&Pose::identity(), 1.0 / 30.0).unwrap();
    }
    let off = farthest(&wearer.layers()[1], outfit.scanned(1));
    assert!(off < 0.005, "{off} m from the scan");
}

#[test]
fn a_skirt_lags_swings_and_comes_to_rest() {
    let (outfit, _) = outfit();
    let mut wearer = Wearer::new(&outfit, Blend::Anchored, Skinning::Linear);
    let mut pose = Pose::identity();
    // A step of 0.3 m aside within 0.3 s, then two seconds of standing.
    let (mut most, mut hem) = (0.0f32, Vec::new());
    for frame in 0..70 {
        pose.translation = Vector3::new(0.3 * (f64::from(frame) / 9.0).min(1.0), 0.0, 0.0);
        wearer.advance(&pose, 1.0 / 30.0).unwrap();
        let carried: Vec<Point3<f32>> = outfit.scanned(1).iter().map(|p| p + pose.translation.cast::<f32>()).collect();
        most = most.max(farthest(&wearer.layers()[1], &carried));
        hem.push(wearer.layers()[1].clone());
        assert!(wearer.layers()[1].iter().all(|p| p.coords.iter().all(|c| c.is_finite())));
    }
    assert!(most > 0.03, "the hem leaves its skinned place by {most} m only");
    let speed = |frame: usize| {
        let ways = hem[frame].iter().zip(&hem[frame - 1]).map(|(a, b)| (a - b).norm());
        30.0 * ways.sum::<f32>() / hem[frame].len() as f32
    };
    println!("{:?}", [12, 20, 30, 40, 50, 60, 69].map(|f| (speed(f), farthest(&hem[f], &hem[f - 1]) * 30.0)));
    assert!(speed(69) < 0.006, "{} m/s on average after two seconds", speed(69));
}

#[test]
fn skin_that_meets_skin_gives_way() {
    let (outfit, skeleton) = outfit();
    // Arms pressed to the sides, and into them.
    let angle = 0.55;
    let mut pose = Pose::identity();
    *pose.rotation_mut(Joint::LeftUpperArm) = UnitQuaternion::from_euler_angles(0.0, 0.0, -angle);
    *pose.rotation_mut(Joint::RightUpperArm) = UnitQuaternion::from_euler_angles(0.0, 0.0, angle);
    let mut wearer = Wearer::new(&outfit, Blend::Anchored, Skinning::Linear);
    wearer.advance(&pose, 1.0 / 30.0).unwrap();
    let body = &outfit.layers()[0];
    let skinned = skinning::skin(&body.mesh.positions, &body.weights, &pose.skinning_transforms(&skeleton));
    let crossings = |positions: &[Point3<f32>]| {
        let mesh = Mesh::new(positions.to_vec(), body.mesh.triangles.clone());
        let bvh = toile_geometry::bvh::Bvh::new(&mesh.positions, &mesh.triangles);
        toile_geometry::intersection::self_crossings(&mesh, &bvh).len()
    };
    let (before, after) = (crossings(&skinned), crossings(&wearer.layers()[0]));
    // Lips and the like touch at rest.
    let rest = crossings(outfit.scanned(0));
    println!("{rest} crossings at rest, {before} by weights, {after} pressed");
    assert!(before > rest + 50 && (after - rest) * 4 < before - rest, "{rest}, {before}, {after}");
}

#[test]
fn the_seed_mixes_skinning_and_physics_by_its_weights() {
    let (outfit, _) = outfit();
    let shares = outfit.physical_shares();
    assert!(shares.len() == 1 && shares[0].len() == 1 && (0.1..=0.5).contains(&shares[0][0]), "{shares:?}");
    let run = |blend| {
        let mut wearer = Wearer::new(&outfit, blend, Skinning::Linear);
        let mut pose = Pose::identity();
        for frame in 0..6 {
            pose.translation.x = 0.04 * f64::from(frame);
            wearer.advance(&pose, 1.0 / 30.0).unwrap();
        }
        wearer.layers().to_vec()
    };
    let [skinned, physical, seed] = [Blend::Skinning, Blend::Physics, Blend::Seed].map(run);
    assert_eq!(seed[0], skinned[0], "the body is only skinned");
    let w = shares[0][0] as f32;
    let expected: Vec<Point3<f32>> = skinned[1].iter().zip(&physical[1]).map(|(l, p)| l + (p - l) * w).collect();
    assert!(farthest(&seed[1], &expected) < 1e-5);
    assert!(farthest(&physical[1], &skinned[1]) > 0.01, "physics is not skinning");
}

#[test]
fn cloth_of_physics_alone_carries_its_weight_and_a_waistband_holds_it() {
    let (outfit, _) = outfit();
    let mut wearer = Wearer::new(&outfit, Blend::Physics, Skinning::Linear);
    for _ in 0..30 {
        wearer.advance(&Pose::identity(), 1.0 / 30.0).unwrap();
    }
    let (now, scanned) = (&wearer.layers()[1], outfit.scanned(1));
    assert!(now.iter().all(|p| p.coords.iter().all(|c| c.is_finite())));
    let around = 72;
    let waist = farthest(&now[..around], &scanned[..around]);
    assert!(waist < 0.005, "the waistband slipped by {waist} m");
    // A cone cannot narrow without folds: under its whole weight it only stretches, and without the waistband it would fall.
    let height = |ring: &[Point3<f32>]| ring.iter().map(|p| p.y).sum::<f32>() / ring.len() as f32;
    let sunk = height(&scanned[scanned.len() - around..]) - height(&now[now.len() - around..]);
    assert!((1e-5..0.01).contains(&sunk), "the hem sank by {sunk} m");
}
