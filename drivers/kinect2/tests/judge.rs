//! libfreenect2's CPU decoder, built outside of the tree, decoded the same packets: its depth is kept in `golden/` as
//! pictures in tenths of millimetres (docs/kinect2.md says how they were made).
#![allow(missing_docs)]

mod common;

use common::scenes::{SCENES, Scene, agreement, calibration, crop};
use toile_driver_kinect2::{DecodeSettings, Decoder};

#[test]
fn our_depth_is_the_judges() {
    for &Scene { name, make, part } in SCENES {
        let (optics, packet) = make();
        let ours = Decoder::new(&calibration(optics).1, DecodeSettings::default()).decode(&packet).unwrap();
        let path = format!("{}/tests/golden/{name}.png", env!("CARGO_MANIFEST_DIR"));
        let theirs: Vec<f32> =
            image::open(path).unwrap().to_luma16().pixels().map(|p| f32::from(p.0[0]) / 10.0).collect();
        let agreement = agreement(&crop(&ours.depth_mm, part), &theirs);
        assert!(agreement.both > 10_000, "{name}: {agreement:?}");
        // Another machine's sine may move a measurement by one step.
        assert!(agreement.mask > 0.9995 && agreement.within_1_mm > 0.9995, "{name}: {agreement:?}");
        assert!(agreement.mean_mm < 0.06, "{name}: {agreement:?}");
    }
}

#[test]
fn what_is_dropped_is_a_setting() {
    let Scene { make, .. } = SCENES[1];
    let (optics, packet) = make();
    let (_, calibration) = calibration(optics);
    let count = |settings: DecodeSettings| {
        let decoded = Decoder::new(&calibration, settings).decode(&packet).unwrap();
        let (min, max) = (1000.0 * settings.min_depth, 1000.0 * settings.max_depth);
        assert!(decoded.depth_mm.iter().all(|&mm| mm == 0.0 || (min..=max).contains(&mm)));
        decoded.depth_mm.iter().filter(|mm| **mm > 0.0).count()
    };
    let all = DecodeSettings::default();
    let near = count(DecodeSettings { max_depth: 2.0, ..all });
    let usual = count(all);
    let with_edges = count(DecodeSettings { drop_edges: false, ..all });
    let far = count(DecodeSettings { max_depth: 9.0, ..all });
    let rough = count(DecodeSettings { smooth: false, ..all });
    assert!(near < usual && usual <= with_edges && usual < far, "{near} {usual} {with_edges} {far}");
    // Only the bilateral filter finds some edges.
    assert!(rough != usual);
}

#[test]
fn packets_of_another_length_are_refused() {
    let Scene { make, .. } = SCENES[1];
    let (optics, packet) = make();
    let mut decoder = Decoder::new(&calibration(optics).1, DecodeSettings::default());
    for length in [0, 704, packet.len() - 1, packet.len() - 704] {
        assert!(decoder.decode(&packet[..length]).is_err());
    }
    assert_eq!(decoder.decode(&packet).unwrap(), decoder.decode(&packet).unwrap());
}
