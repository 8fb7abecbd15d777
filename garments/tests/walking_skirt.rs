//! A skirt in a walk, moved by its skin weights alone.

#![allow(clippy::unwrap_used)] // all of it is test code

use toile_animation::{RetargetSettings, bvh, retarget, shipped_walk};
use toile_character::Pose;
use toile_garments::{
    DressedTake, ExtractSettings, FREE_PART, Worn, carry_weights, mark_free, posed_report, weights_from_body,
};
use toile_geometry::{Mesh, remesh};
use toile_synthetic::{GarmentKind, GarmentSettings, Subject, SyntheticSettings};

/// One of this many frames of a motion is looked at.
const STRIDE: usize = 6;
/// Limit of the stretch of any triangle.
const MAX_STRETCH: f32 = 3.0;

fn dressed(seed: u64) -> Subject {
    let garments = vec![GarmentSettings::of(GarmentKind::Skirt)];
    Subject::new(&SyntheticSettings { seed, garments, ..SyntheticSettings::default() }).unwrap()
}

/// The skirt in the triangles that an extracted garment has: those of its truth, cut at the hem, are slivers down to
/// 0.01 mm. Marked where it hangs free.
fn skirt_of(subject: &Subject) -> Mesh {
    let mut skirt = remesh::isotropic(&subject.garments[0].worn.mesh, ExtractSettings::default().edge_length);
    let free = mark_free(&subject.person.body.mesh, &skirt);
    free_below(&skirt, &free);
    skirt.attributes.insert(FREE_PART.into(), free);
    skirt
}

/// The shipped walk and, where the private data is, a recorded walk and a jog.
fn motions() -> Vec<toile_animation::Bvh> {
    let recorded = ["bandai_a/dataset-1_walk_normal_001.bvh", "cmu_a/02_03.bvh"];
    let recorded = recorded.iter().filter_map(|name| toile_outside::data(&format!("real/motion/{name}")));
    std::iter::once(shipped_walk().unwrap()).chain(recorded.map(|path| bvh::read(&path).unwrap())).collect()
}

#[test]
fn a_skirt_is_not_torn_between_the_legs() {
    for seed in [5, 7] {
        let subject = dressed(seed);
        let body = &subject.person.body;
        let skirt = &crumpled(skirt_of(&subject));
        let rest = Pose::identity();
        let take = DressedTake {
            scan: skirt,
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
        let mut weights = [weights_from_body(&take, skirt, &ExtractSettings::default())];
        let given = weights[0].clone();
        carry_weights(std::slice::from_ref(skirt), &mut weights, &body.skeleton, &rest).unwrap();
        let poses =
            |motion| retarget(motion, "walk", &body.skeleton, &RetargetSettings::default()).unwrap().motion.poses;
        let poses: Vec<Pose> = motions().iter().flat_map(|motion| poses(motion).into_iter().step_by(STRIDE)).collect();
        let report = |weights| posed_report(&[Worn { mesh: skirt, weights }], &body.skeleton, &rest, &poses).remove(0);
        assert!(report(&given).torn_most > 0, "seed {seed}: a crumple does not tear any more: {:?}", report(&given));
        let report = report(&weights[0]);
        assert!(poses.len() >= 5 && report.stretch_most < MAX_STRETCH, "seed {seed}: {report:?}");
        assert!(report.stretch_most > 1.02, "the skirt does not move: {report:?}");
    }
}

/// The skirt with a crumple behind, between the legs: slivers across which weights change too fast.
fn crumpled(mut skirt: Mesh) -> Mesh {
    let (lo, hi) = skirt.bounds().unwrap();
    let height = lo.y + 0.2 * (hi.y - lo.y);
    for p in skirt.positions.iter_mut().filter(|p| p.z < 0.0 && (p.y - height).abs() < 0.02 && p.x.abs() < 0.02) {
        p.x *= 0.02;
    }
    skirt
}

/// Cloth hangs free at the hem and is close at the waist.
fn free_below(skirt: &Mesh, free: &[f32]) {
    let (lo, hi) = skirt.bounds().unwrap();
    let share = |low: f32, high: f32| {
        let at = |y: f32| (y - lo.y) / (hi.y - lo.y);
        let of: Vec<f32> =
            skirt.positions.iter().zip(free).filter(|(p, _)| (low..high).contains(&at(p.y))).map(|x| *x.1).collect();
        of.iter().sum::<f32>() / of.len() as f32
    };
    assert!(share(0.0, 0.2) > 0.6 && share(0.9, 1.01) < 0.4, "{} {}", share(0.0, 0.2), share(0.9, 1.01));
}
