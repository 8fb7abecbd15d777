//! Each nuisance spoils what it says, and nothing else.

#![allow(clippy::unwrap_used)]

use toile_synthetic::{GarmentKind, GarmentSettings, Nuisances, Pattern, Subject, SyntheticSettings, Take};

fn take(nuisances: Nuisances, noise: bool) -> Take {
    let garments = vec![GarmentSettings { kind: GarmentKind::Trousers, pattern: Pattern::Plain([10, 10, 11]) }];
    let settings =
        SyntheticSettings { seed: 3, garments, cell_m: 0.025, frames: 2, noise, nuisances, ..Default::default() };
    Subject::new(&settings).unwrap().take(1).unwrap()
}

/// Depth of the first frame, units.
fn depth(nuisances: Nuisances, noise: bool) -> Vec<f64> {
    let frame = take(nuisances, noise).frame(0).unwrap();
    frame.depth.unwrap().values.iter().map(|v| f64::from(*v)).collect()
}

/// Differences where both are measured.
fn differences(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).filter(|(a, b)| **a > 0.0 && **b > 0.0).map(|(a, b)| a - b).collect()
}

fn deviation(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn scale_blotches_and_a_lens_are_as_large_as_they_are_set() {
    let clean = depth(Nuisances::default(), false);
    let scaled = depth(Nuisances { depth_scale: 1.02, ..Nuisances::default() }, false);
    assert!(scaled.iter().zip(&clean).all(|(a, b)| (a - 1.02 * b).abs() <= 1.1));
    let blotchy = depth(Nuisances { blotches_m: 0.004, ..Nuisances::default() }, false);
    let near: Vec<f64> =
        differences(&blotchy, &clean).into_iter().zip(&clean).filter(|(_, z)| **z < 2500.0).map(|(d, _)| d).collect();
    assert!((3.0..9.0).contains(&deviation(&near)), "{}", deviation(&near));
    let neighbors: f64 = differences(&blotchy, &clean).windows(2).map(|w| w[0] * w[1]).sum::<f64>();
    let alone: f64 = differences(&blotchy, &clean).iter().map(|d| d * d).sum::<f64>();
    assert!(neighbors > 0.8 * alone, "neighbours in a blotch agree: {}", neighbors / alone);
}

#[test]
fn a_lens_is_told_or_kept_from_the_calibration_and_bends_the_picture_alike() {
    let lens = [0.09, -0.27, 0.0, 0.0, 0.095];
    let told = Nuisances { lens, ..Nuisances::default() };
    let untold = Nuisances { is_lens_untold: true, ..told };
    assert_eq!(take(told, false).rig().sensors[0].depth.distortion, lens);
    assert_eq!(take(untold, false).rig().sensors[0].depth.distortion, [0.0; 5]);
    let bent = depth(told, false);
    assert_eq!(bent, depth(untold, false));
    // Points of the bent picture lie where the same rays see in the ideal one, but for the rims.
    let (clean, camera) = (depth(Nuisances::default(), false), take(told, false).told_camera());
    let (mut compared, mut off) = (0, 0);
    for (i, [x, y]) in camera.rays().into_iter().enumerate().filter(|(i, _)| bent[*i] > 0.0) {
        let [u, v] = [f64::from(x) * camera.fx + camera.cx, f64::from(y) * camera.fy + camera.cy].map(f64::round);
        let at = v as usize * camera.width as usize + u as usize;
        compared += 1;
        off += usize::from((clean.get(at).copied().unwrap_or(0.0) - bent[i]).abs() > 25.0);
    }
    assert!(compared > 50_000 && off * 50 < compared, "{off} of {compared}");
}

#[test]
fn dark_cloth_is_four_times_as_noisy_and_partly_lost() {
    let truth = depth(Nuisances::default(), false);
    let dark = Nuisances { has_dark_cloth: true, ..Nuisances::default() };
    let (plain, spoilt) = (take(dark, false).look(0).0, depth(dark, true));
    let errors = |is_dark: bool| -> Vec<f64> {
        let chosen = (0..truth.len()).filter(|&i| plain.depth[i] > 0.0 && plain.depth[i] < 2.4);
        let chosen = chosen.filter(|&i| (plain.albedo[i] < 0.01) == is_dark && plain.cosine[i] > 0.6);
        chosen.filter(|&i| spoilt[i] > 0.0).map(|i| (spoilt[i] - truth[i]).abs()).filter(|e| *e < 40.0).collect()
    };
    let (black, rest) = (errors(true), errors(false));
    let ratio = deviation(&black) / deviation(&rest);
    assert!(black.len() > 1000 && (2.5..6.0).contains(&ratio), "{} {ratio}", black.len());
    let cloth = (0..truth.len()).filter(|&i| plain.depth[i] > 0.0 && plain.albedo[i] < 0.01 && plain.cosine[i] > 0.6);
    let (lost, all) = cloth.fold((0u32, 0u32), |(lost, all), i| (lost + u32::from(spoilt[i] == 0.0), all + 1));
    assert!((0.1..0.25).contains(&(f64::from(lost) / f64::from(all))), "{lost} of {all}");
}

#[test]
fn what_light_does_moves_depth_where_it_says() {
    let clean = depth(Nuisances::default(), false);
    let changed = |nuisances: Nuisances| {
        let spoilt = depth(nuisances, false);
        let moved: Vec<usize> = (0..clean.len()).filter(|&i| (spoilt[i] - clean[i]).abs() > 2.0).collect();
        let rows: Vec<usize> = moved.iter().map(|i| i / 512).collect();
        let farther = moved.iter().filter(|i| spoilt[**i] > clean[**i]).count();
        (moved.len(), rows.iter().copied().min(), rows.iter().copied().max(), farther)
    };
    let none = Nuisances::default();
    let (count, top, _, farther) = changed(Nuisances { multipath_m: 0.02, ..none });
    assert!(count > 1000 && farther == count && top > Some(300), "multipath: {count} {farther} {top:?}");
    let (count, top, _, farther) = changed(Nuisances { plates_m: 0.025, ..none });
    assert!(count > 100 && farther == 0 && top > Some(300), "plates: {count} {farther} {top:?}");
    let (count, top, bottom, farther) = changed(Nuisances { strings_pixels: 40, ..none });
    assert!(count > 20 && farther < count && top > Some(250), "strings: {count} {top:?} {bottom:?}");
    let (count, _, bottom, _) = changed(Nuisances { brim_pixels: 5, ..none });
    assert!(count > 50 && bottom < Some(180), "brim: {count} {bottom:?}");
    // what turns within an exposure blurs silhouettes; surfaces that face the camera stay
    let (count, ..) = changed(Nuisances { smear_degrees: 3.0, ..none });
    assert!((200..4000).contains(&count), "smear: {count}");
}

#[test]
fn nuisances_out_of_range_are_refused_by_name() {
    for (nuisances, name) in [
        (Nuisances { depth_scale: 2.0, ..Nuisances::default() }, "depth_scale"),
        (Nuisances { blotches_m: f64::NAN, ..Nuisances::default() }, "blotches_m"),
        (Nuisances { lens: [9.0, 0.0, 0.0, 0.0, 0.0], ..Nuisances::default() }, "lens"),
    ] {
        let settings = SyntheticSettings { nuisances, ..SyntheticSettings::default() };
        assert!(settings.validate().unwrap_err().to_string().contains(name), "{name}");
    }
}
