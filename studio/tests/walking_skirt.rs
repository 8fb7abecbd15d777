//! A skirt in a walk, moved by its skin weights alone.

use std::path::PathBuf;

use toile_animation::{RetargetSettings, bvh, retarget, shipped_walk};
use toile_character::Pose;
use toile_garments::{ExtractSettings, Take, Worn, common_frame, hanging, posed_report};
use toile_geometry::Mesh;
use toile_synthetic::{GarmentKind, GarmentSettings, Subject, SyntheticSettings};

/// Every so many frames of a motion are looked at.
const STRIDE: usize = 6;
/// No triangle may be stretched more.
const MOST_STRETCH: f32 = 3.0;

fn skirt_of(seed: u64) -> Subject {
    let garments = vec![GarmentSettings::of(GarmentKind::Skirt)];
    Subject::new(&SyntheticSettings { seed, garments, ..SyntheticSettings::default() }).unwrap()
}

/// A recorded walk where the private data is, else the shipped one.
fn walk() -> toile_animation::Bvh {
    let data = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/real/motion/bandai_a");
    let path = data.join("dataset-1_walk_normal_001.bvh");
    if path.exists() { bvh::read(&path).unwrap() } else { shipped_walk().unwrap() }
}

#[test]
fn a_skirt_is_not_torn_between_the_legs() {
    for seed in [1, 5] {
        let subject = skirt_of(seed);
        let (body, skirt) = (&subject.person.body, &subject.garments[0].worn.mesh);
        let rest = Pose::identity();
        let take = Take {
            scan: skirt,
            previous: &body.mesh,
            body: &body.mesh,
            weights: &body.weights,
            skeleton: &body.skeleton,
            pose: &rest,
            pose0: &rest,
            garment_type: None,
            edits: None,
        };
        let weights = common_frame::weights(&take, skirt, &ExtractSettings::default());
        let walk = retarget(&walk(), "walk", &body.skeleton, &RetargetSettings::default()).unwrap().motion;
        let poses: Vec<Pose> = walk.poses.iter().step_by(STRIDE).cloned().collect();
        let worn = Worn { mesh: skirt, weights: &weights };
        let report = &posed_report(&[worn], &body.skeleton, &rest, &poses)[0];
        assert!(poses.len() >= 5 && report.stretch_most < MOST_STRETCH, "seed {seed}: {report:?}");
        assert!(report.stretch_most > 1.02, "the skirt does not move: {report:?}");
        free_below(&body.mesh, skirt);
    }
}

/// Cloth hangs free at the hem and is close at the waist.
fn free_below(body: &Mesh, skirt: &Mesh) {
    let free = hanging::mark_free(body, skirt);
    let (lo, hi) = skirt.bounds().unwrap();
    let share = |low: f32, high: f32| {
        let at = |y: f32| (y - lo.y) / (hi.y - lo.y);
        let of: Vec<f32> =
            skirt.positions.iter().zip(&free).filter(|(p, _)| (low..high).contains(&at(p.y))).map(|x| *x.1).collect();
        of.iter().sum::<f32>() / of.len() as f32
    };
    assert!(share(0.0, 0.2) > 0.6 && share(0.9, 1.01) < 0.4, "{} {}", share(0.0, 0.2), share(0.9, 1.01));
}
