//! Import: good folders, real ones where they are here, and each kind of bad one.
#![allow(clippy::unwrap_used)]

mod common;

use std::{ffi::OsStr, fs, os::unix::ffi::OsStrExt, path::Path};

use common::{all_frames, image_folder};
use toile_capture::{
    CaptureError, Recorder, RecorderOptions, Replay, Source,
    import::{self, Format, ImportOptions, ImportReport},
};

fn import_to(folder: &Path, out: &Path) -> Result<ImportReport, CaptureError> {
    let mut source = import::open(folder, None)?;
    let recorder = Recorder::create(out, source.rig(), RecorderOptions::default())?;
    import::record(source.as_mut(), recorder, &|_| ())
}

#[test]
fn a_folder_becomes_a_recording_with_the_same_frames() {
    let temp = tempfile::tempdir().unwrap();
    let folder = image_folder(&temp.path().join("take"), 5);
    let out = temp.path().join("take.mcap");
    let report = import_to(&folder, &out).unwrap();
    assert!(report.is_complete() && report.frames == 5, "{report}");
    let from_folder = all_frames(import::open(&folder, None).unwrap().as_mut()).unwrap();
    let mut replay = Replay::open(&out).unwrap();
    assert_eq!(all_frames(&mut replay).unwrap(), from_folder);
    assert_eq!(from_folder[3].device_time_ns, 1_300_000_000);
    assert_eq!(from_folder[3].depth.as_ref().unwrap().at(2, 1), 1003 + 24 + 2);
    let camera = &replay.rig().sensors[0];
    assert_eq!((camera.depth_scale, camera.fps, camera.depth.fx), (0.001, 10.0, 20.0));
    let jpeg = fs::read(folder.join("color/000003.jpg")).unwrap();
    assert_eq!(from_folder[3].color, Some(toile_capture::ColorImage::Jpeg(jpeg.into())), "byte for byte");
}

#[test]
fn missing_frames_are_counted_and_the_rest_is_kept() {
    let temp = tempfile::tempdir().unwrap();
    let folder = image_folder(&temp.path().join("take"), 8);
    fs::remove_file(folder.join("depth/000002.png")).unwrap();
    fs::remove_file(folder.join("color/000004.jpg")).unwrap();
    for file in ["depth/000006.png", "color/000006.jpg"] {
        fs::remove_file(folder.join(file)).unwrap();
    }
    let out = temp.path().join("take.mcap");
    let report = import_to(&folder, &out).unwrap();
    assert_eq!((report.frames, report.lost), (7, 1));
    assert_eq!((&report.without_depth, &report.without_color), (&vec![2], &vec![4]));
    let text = report.to_string();
    assert!(text.contains("without depth: 2") && text.contains("without colour: 4"), "{text}");
    let last = Replay::open(&out).unwrap().frame(6).unwrap();
    assert_eq!((last.device_frame, last.lost_before, last.device_time_ns), (7, 1, 1_700_000_000));
}

#[test]
fn an_unreadable_frame_is_left_out_and_named() {
    let temp = tempfile::tempdir().unwrap();
    let folder = image_folder(&temp.path().join("take"), 4);
    let whole = fs::read(folder.join("depth/000001.png")).unwrap();
    fs::write(folder.join("depth/000001.png"), &whole[..whole.len() / 2]).unwrap();
    let out = temp.path().join("take.mcap");
    let report = import_to(&folder, &out).unwrap();
    assert_eq!(report.frames, 3);
    assert!(report.lost_data() && report.unreadable[0].contains("000001.png"), "{report}");
    assert_eq!(Replay::open(&out).unwrap().frame(1).unwrap().lost_before, 1);
}

#[test]
fn a_colour_image_that_is_damaged_behind_its_header_is_counted_and_kept_as_it_came() {
    let temp = tempfile::tempdir().unwrap();
    let folder = image_folder(&temp.path().join("take"), 4);
    let path = folder.join("color/000002.jpg");
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() - 6]).unwrap();
    let out = temp.path().join("take.mcap");
    let report = import_to(&folder, &out).unwrap();
    assert_eq!((report.frames, &report.damaged_color), (4, &vec![2]));
    assert!(report.lost_data() && !report.is_complete(), "{report}");
    assert!(report.to_string().contains("1 with a damaged colour image: 2"), "{report}");
    let sound: Vec<bool> = all_frames(&mut Replay::open(&out).unwrap())
        .unwrap()
        .iter()
        .map(|f| f.color.as_ref().unwrap().is_sound())
        .collect();
    assert_eq!(sound, [true, true, false, true]);
}

#[test]
fn times_of_frames_that_are_not_there_are_said() {
    let temp = tempfile::tempdir().unwrap();
    let folder = image_folder(&temp.path().join("take"), 3);
    assert!(import::open(&folder, None).unwrap().remarks().is_empty());
    fs::write(folder.join("timestamps.txt"), "1\n2\n3\n4\n5\n").unwrap();
    let said = import::open(&folder, None).unwrap().remarks();
    assert!(
        said.len() == 1
            && said[0].contains("timestamps.txt")
            && said[0].ends_with("of 2 frames there is a time, but no image: 3-4"),
        "{said:?}"
    );
}

#[test]
fn bad_folders_get_one_clear_sentence() {
    type Damage = fn(&Path);
    let cases: [(&str, Damage); 14] = [
        ("camera.json: is missing", |f| fs::remove_file(f.join("camera.json")).unwrap()),
        ("field `fx` is missing", |f| edit(f, "\"fx\"", "\"focal\"")),
        ("field `width` must be a number", |f| edit(f, "24", "\"24\"")),
        ("24 x 16 pixels, but the calibration is for 48 x 16", |f| edit(f, "24", "48")),
        ("there is no depth image", |f| clear(&f.join("depth"))),
        ("its layout of depth images is not known", |f| fs::remove_dir_all(f.join("depth")).unwrap()),
        ("timestamps.txt: has 2 lines, but there are 3 frames", |f| {
            fs::write(f.join("timestamps.txt"), "1\n2\n").unwrap();
        }),
        ("line 2 is not a time", |f| fs::write(f.join("timestamps.txt"), "1\nx\n3\n").unwrap()),
        ("timestamps.txt: line 1: the time -7 ns is before 0", |f| {
            fs::write(f.join("timestamps.txt"), "-7\n5\n9\n").unwrap();
        }),
        ("line 3 is earlier", |f| fs::write(f.join("timestamps.txt"), "1\n5\n4\n").unwrap()),
        ("2 of 3 frames have the same time", |f| fs::write(f.join("timestamps.txt"), "5\n5\n5\n").unwrap()),
        ("must be a 16-bit grey PNG", |f| {
            for i in 0..3 {
                image::GrayImage::new(24, 16).save(f.join(format!("depth/{i:06}.png"))).unwrap();
            }
        }),
        ("has the same number as", |f| {
            fs::copy(f.join("depth/000001.png"), f.join("depth/1.png")).unwrap();
        }),
        ("No such file", |f| fs::remove_dir_all(f).unwrap()),
    ];
    for (expected, damage) in cases {
        let temp = tempfile::tempdir().unwrap();
        let folder = image_folder(&temp.path().join("take"), 3);
        damage(&folder);
        let out = temp.path().join("out.mcap");
        let error = import_to(&folder, &out).expect_err(expected).to_string();
        assert!(error.contains(expected), "said: {error}\nexpected: {expected}");
        assert!(!error.contains('\n') && !out.exists(), "{error}");
    }
}

fn edit(folder: &Path, from: &str, to: &str) {
    let path = folder.join("camera.json");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(path, text.replacen(from, to, 1)).unwrap();
}

fn clear(folder: &Path) {
    fs::remove_dir_all(folder).unwrap();
    fs::create_dir(folder).unwrap();
}

#[test]
fn formats_print_and_parse() {
    for format in Format::ALL {
        assert_eq!(format.to_string().parse::<Format>(), Ok(format));
    }
    assert!("video".parse::<Format>().unwrap_err().contains("seven-scenes"));
}

struct Real {
    path: &'static str,
    format: Format,
    frames: u64,
    size: (u32, u32),
    color: bool,
    poses: usize,
}

#[test]
fn real_folders_are_guessed_and_read() {
    let real = |path, format, frames, size, color, poses| Real { path, format, frames, size, color, poses };
    let cases = [
        real("subjects/alder/01-trousers", Format::ToileFolder, 100, (512, 424), true, 100),
        real("real/rgbd/uva_cv2_person_turn", Format::Uva, 100, (640, 480), true, 100),
        real("real/rgbd/sevenscenes_kitchen_a", Format::SevenScenes, 60, (640, 480), true, 60),
        real("real/rgbd/open3d_rgbd5", Format::ToileFolder, 5, (640, 480), true, 5),
        real("real/rgbd/open3d_rgbd5/tum", Format::Tum, 1, (640, 480), true, 0),
        real("turntable/noisy", Format::ToileFolder, 300, (640, 480), false, 300),
    ];
    for case in cases {
        let Some(path) = toile_outside::data(case.path) else { continue };
        assert_eq!(import::guess(&path).unwrap(), case.format, "{}", case.path);
        let mut source = import::open(&path, None).unwrap();
        assert_eq!(source.frame_count(), Some(case.frames), "{}", case.path);
        let sensor = source.rig().sensors[0].clone();
        assert_eq!(sensor.color.is_some(), case.color);
        if case.format == Format::SevenScenes {
            assert_eq!(sensor.fps, 15.0, "every second frame of a 30 Hz sensor");
        }
        let frame = source.next_frame().unwrap().unwrap();
        let depth = frame.depth.unwrap();
        assert_eq!((depth.width, depth.height), case.size);
        let mut metres: Vec<f64> =
            depth.values.iter().filter(|&&v| v > 0).map(|&v| f64::from(v) * sensor.depth_scale).collect();
        metres.sort_by(f64::total_cmp);
        let median = metres[metres.len() / 2];
        assert!((0.5..4.0).contains(&median), "{}: median depth {median} m", case.path);
        assert!(metres[metres.len() - 1] < 20.0, "{}: 65535 is not a depth", case.path);
        if let Some(color) = frame.color {
            assert_eq!(color.decode(0).unwrap().width, case.size.0);
        }
        let second = source.next_frame().unwrap();
        assert!(second.is_none_or(|frame| frame.lost_before == 0), "{}: a stride is not a loss", case.path);
        let poses = import::reference_poses(&path).unwrap().unwrap_or_default();
        assert_eq!(poses.len(), case.poses, "{}", case.path);
    }
}

#[test]
fn reference_poses_carry_the_frames_device_times() {
    for name in ["subjects/birch/00-body", "real/rgbd/uva_cv2_person_turn", "turntable/clean"] {
        let Some(path) = toile_outside::data(name) else { continue };
        let poses = import::reference_poses(&path).unwrap().unwrap();
        let frames = all_frames(import::open(&path, None).unwrap().as_mut()).unwrap();
        for (pose, frame) in poses.iter().zip(&frames) {
            assert!((pose.time_ns - frame.device_time_ns).abs() < 1000, "{name}: frame {}", frame.index);
        }
    }
}

#[test]
fn a_real_take_survives_recording_bit_by_bit() {
    let Some(path) = toile_outside::data("subjects/alder/00-body") else { return };
    let temp = tempfile::tempdir().unwrap();
    let out = temp.path().join("00-body.mcap");
    let report = import_to(&path, &out).unwrap();
    assert!(report.is_complete(), "{report}");
    let mut replay = Replay::open(&out).unwrap();
    let mut source = import::open(&path, None).unwrap();
    while let Some(frame) = source.next_frame().unwrap() {
        assert_eq!(replay.next_frame().unwrap(), Some(frame));
    }
}

#[test]
fn masks_of_uva_cut_the_background_only_when_asked() {
    let Some(path) = toile_outside::data("real/rgbd/uva_cv2_person_turn") else { return };
    let count = |apply_mask| {
        let mut source = import::open_with(&path, &ImportOptions { format: None, apply_mask }).unwrap();
        let depth = source.next_frame().unwrap().unwrap().depth.unwrap();
        depth.values.iter().filter(|&&v| v > 0).count()
    };
    let (all, person) = (count(false), count(true));
    assert!(person * 10 > all && person < all, "{person} of {all}");
}

#[test]
fn the_turntable_folder_itself_points_to_its_parts() {
    let Some(path) = toile_outside::data("turntable") else { return };
    let error = import::open(&path, None).err().unwrap().to_string();
    assert!(error.contains("clean, noisy"), "{error}");
}

#[test]
fn tum_lists_pair_by_time() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path().join("tum");
    fs::create_dir_all(folder.join("depth")).unwrap();
    fs::create_dir_all(folder.join("rgb")).unwrap();
    let depth = image::ImageBuffer::<image::Luma<u16>, _>::from_pixel(640, 480, image::Luma([5000_u16]));
    depth.save(folder.join("depth/a.png")).unwrap();
    image::RgbImage::new(640, 480).save(folder.join("rgb/b.png")).unwrap();
    fs::write(folder.join("depth.txt"), "# depth maps\n1305031102.160407 depth/a.png\n").unwrap();
    fs::write(folder.join("rgb.txt"), "1305031102.175304 rgb/b.png\n1305031103.5 rgb/b.png\n").unwrap();
    fs::write(folder.join("groundtruth.txt"), "1305031102.1 0 0 0 0 0 0 1\n").unwrap();
    let mut source = import::open(&folder, None).unwrap();
    assert_eq!(source.rig().sensors[0].depth_scale, 0.0002);
    let frames = all_frames(source.as_mut()).unwrap();
    assert_eq!(frames[0].device_time_ns, 1_305_031_102_160_407_000);
    let has = |i: usize| (frames[i].depth.is_some(), frames[i].color.is_some());
    assert_eq!((frames.len(), has(0), has(1)), (2, (true, true), (false, true)));
    assert_eq!(import::reference_poses(&folder).unwrap().unwrap().len(), 1);
    fs::write(folder.join("depth.txt"), "what is this\n").unwrap();
    assert!(import::open(&folder, None).err().unwrap().to_string().contains("line 1"));
}

#[test]
fn twenty_thousand_equal_times_are_no_burden() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path().join("tum");
    fs::create_dir_all(&folder).unwrap();
    let depth = image::ImageBuffer::<image::Luma<u16>, _>::from_pixel(640, 480, image::Luma([5000_u16]));
    depth.save(folder.join("a.png")).unwrap();
    fs::write(folder.join("depth.txt"), "5.0 a.png\n".repeat(20_000)).unwrap();
    fs::write(folder.join("rgb.txt"), "5.0 a.png\n".repeat(20_000)).unwrap();
    let source = import::open(&folder, None).unwrap();
    assert_eq!(source.frame_count(), Some(20_000), "each colour image has a depth image");
}

/// Renames the images of a folder: number to name without extension.
fn rename(folder: &Path, count: u64, name: impl Fn(u64) -> String) {
    for (part, extension) in [("depth", "png"), ("color", "jpg")] {
        for i in 0..count {
            let at = folder.join(part);
            fs::rename(at.join(format!("{i:06}.{extension}")), at.join(format!("{}.{extension}", name(i)))).unwrap();
        }
    }
}

#[test]
fn names_that_are_times_give_order_pairing_and_rate() {
    let names: [fn(u64) -> String; 3] = [
        |i| format!("{}.{:06}", 1_700_000_000 + (900_000 + i * 50_000) / 1_000_000, (900_000 + i * 50_000) % 1_000_000),
        |i| (1_700_000_000_900 + i * 50).to_string(),
        |i| (1_700_000_000_900_000 + i * 50_000).to_string(),
    ];
    for name in names {
        let temp = tempfile::tempdir().unwrap();
        let folder = image_folder(&temp.path().join("take"), 6);
        fs::remove_file(folder.join("timestamps.txt")).unwrap();
        edit(&folder, r#", "fps": 10"#, "");
        rename(&folder, 6, name);
        fs::remove_file(folder.join("color").join(name(4) + ".jpg")).unwrap();
        let mut source = import::open(&folder, None).unwrap();
        assert!((source.rig().sensors[0].fps - 20.0).abs() < 1e-6, "{}", source.rig().sensors[0].fps);
        let frames = all_frames(source.as_mut()).unwrap();
        for (i, frame) in frames.iter().enumerate() {
            assert_eq!(frame.device_time_ns, 1_700_000_000_900_000_000 + i as i64 * 50_000_000);
            assert_eq!(frame.depth.as_ref().unwrap().at(0, 0), 1000 + i as u16, "{}", name(i as u64));
            assert_eq!((frame.color.is_some(), frame.lost_before), (i != 4, 0));
        }
    }
}

#[test]
fn mixed_names_are_asked_about_and_what_is_not_a_number_is_named() {
    let temp = tempfile::tempdir().unwrap();
    let folder = image_folder(&temp.path().join("take"), 3);
    let one = folder.join("depth/000001.png");
    let cases = [
        ("12.5.png", "name all images by times or all by numbers"),
        ("18446744073709551615.png", "12 digits"),
        ("18446744073709551616.png", "12 digits"),
    ];
    for (name, expected) in cases {
        let renamed = folder.join("depth").join(name);
        fs::rename(&one, &renamed).unwrap();
        let error = import::open(&folder, None).err().unwrap().to_string();
        assert!(error.contains(expected) && error.contains(name), "{error}");
        fs::rename(&renamed, &one).unwrap();
    }
    let odd = folder.join("depth").join(OsStr::from_bytes(b"0000\xff1.png"));
    fs::rename(&one, &odd).unwrap();
    let error = import::open(&folder, None).err().unwrap().to_string();
    assert!(error.contains("not valid UTF-8") && error.contains("0000\u{fffd}1.png"), "{error}");
    fs::rename(&odd, &one).unwrap();
    fs::write(folder.join("timestamps.txt"), "\n").unwrap();
    let error = import::open(&folder, None).err().unwrap().to_string();
    assert!(error.contains("has 0 lines, but there are 3 frames"), "{error}");
}

/// As loggers write that stamp a picture twice: the time is that of one frame, and the other alone is left out.
#[test]
fn a_time_that_stands_twice_costs_one_frame_and_is_said() {
    let temp = tempfile::tempdir().unwrap();
    let folder = image_folder(&temp.path().join("take"), 5);
    fs::write(folder.join("timestamps.txt"), "100\n200\n\n200\n400\n500\n").unwrap();
    let out = temp.path().join("out.mcap");
    let report = import_to(&folder, &out).unwrap();
    assert_eq!((report.frames, report.lost, report.lost_data()), (4, 0, true));
    let [said] = &report.unreadable[..] else { panic!("{:?}", report.unreadable) };
    assert!(
        said.contains("timestamps.txt: line 4 has the same time") && said.contains("frame 2 is left out"),
        "{said}"
    );
    let frames = all_frames(&mut Replay::open(&out).unwrap()).unwrap();
    let kept = frames.iter().map(|f| (f.device_time_ns, f.depth.as_ref().unwrap().at(0, 0), f.lost_before));
    assert_eq!(kept.collect::<Vec<_>>(), [(100, 1000, 0), (200, 1001, 0), (400, 1003, 1), (500, 1004, 0)]);
}

#[test]
fn files_that_systems_add_are_passed_over_and_text_may_come_from_windows() {
    let temp = tempfile::tempdir().unwrap();
    let folder = image_folder(&temp.path().join("take"), 3);
    for name in ["depth/._000001.png", "depth/Thumbs.db", "color/.DS_Store", "color/._000002.jpg", "._camera.json"] {
        fs::write(folder.join(name), b"not an image").unwrap();
    }
    for name in ["camera.json", "timestamps.txt"] {
        let text = fs::read_to_string(folder.join(name)).unwrap();
        fs::write(folder.join(name), format!("\u{feff}{}", text.replace('\n', "\r\n"))).unwrap();
    }
    let frames = all_frames(import::open(&folder, None).unwrap().as_mut()).unwrap();
    let depths: Vec<u16> = frames.iter().map(|frame| frame.depth.as_ref().unwrap().at(0, 0)).collect();
    assert_eq!(depths, [1000, 1001, 1002]);
    assert_eq!(frames[2].device_time_ns, 1_200_000_000);
}

#[test]
fn unpadded_pairs_are_in_the_order_of_their_numbers() {
    let temp = tempfile::tempdir().unwrap();
    let folder = image_folder(&temp.path().join("take"), 12);
    let pairs = temp.path().join("pairs");
    fs::create_dir(&pairs).unwrap();
    for i in (0..12).filter(|i| *i != 9) {
        fs::copy(folder.join(format!("depth/{i:06}.png")), pairs.join(format!("depth_{i}.png"))).unwrap();
        fs::copy(folder.join(format!("color/{i:06}.jpg")), pairs.join(format!("color_{i}.jpg"))).unwrap();
    }
    fs::copy(folder.join("camera.json"), pairs.join("camera.json")).unwrap();
    let frames = all_frames(import::open(&pairs, None).unwrap().as_mut()).unwrap();
    let depths: Vec<u16> = frames.iter().map(|frame| frame.depth.as_ref().unwrap().at(0, 0)).collect();
    assert_eq!(depths, [1000, 1001, 1002, 1003, 1004, 1005, 1006, 1007, 1008, 1010, 1011]);
    assert_eq!(frames[9].lost_before, 1, "number 9 is missing");
}
