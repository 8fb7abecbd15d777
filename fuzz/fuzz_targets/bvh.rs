//! BVH motions, carried onto a person where their skeleton allows it.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use toile_animation::{RetargetSettings, bvh, retarget};
use toile_character::{BodyModel, Skeleton};

static PERSON: LazyLock<Skeleton> =
    LazyLock::new(|| BodyModel::load_default().expect("the shipped body is whole").mean_skeleton);

fuzz_target!(|bytes: &[u8]| {
    let Ok(motion) = bvh::parse(&String::from_utf8_lossy(bytes), "fuzz") else { return };
    let _ = bvh::write(&motion);
    for looped in [false, true] {
        let settings = RetargetSettings { looped, ..RetargetSettings::default() };
        if let Ok(carried) = retarget(&motion, "fuzz", &PERSON, &settings) {
            let finite = |p: &toile_character::Pose| {
                p.translation.iter().all(|x| (*x as f32).is_finite()) && p.rotations.iter().all(|r| r.w.is_finite())
            };
            assert!(carried.motion.poses.iter().all(finite), "a pose is not finite");
        }
    }
});
