//! Tests of the layouts of archives, each a small folder written here from its public description.

use std::{fs, path::Path};

use super::{Format, guess, open};
use crate::Source;

fn depth_png(path: &Path, (width, height): (u32, u32), value: u16) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    image::ImageBuffer::from_pixel(width, height, image::Luma([value])).save(path).unwrap();
}

fn color_png(path: &Path, (width, height): (u32, u32)) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    image::RgbImage::from_pixel(width, height, image::Rgb([7, 8, 9])).save(path).unwrap();
}

/// Device times in milliseconds and the first depth value of all frames.
fn frames(source: &mut dyn Source) -> Vec<(i64, u16, bool)> {
    let mut frames = Vec::new();
    while let Some(frame) = source.next_frame().unwrap() {
        let depth = frame.depth.map_or(0, |depth| depth.values[0]);
        frames.push((frame.device_time_ns / 1_000_000, depth, frame.color.is_some()));
    }
    frames
}

#[test]
fn redwood_names_are_numbers_and_times() {
    let dir = tempfile::tempdir().unwrap();
    for (k, time) in [(1, 0), (2, 33_369), (10, 300_000)] {
        depth_png(&dir.path().join(format!("depth/{k:07}-{time:012}.png")), (640, 480), k);
        color_png(&dir.path().join(format!("rgb/{k:07}-{:012}.png", time + 5000)), (640, 480));
    }
    assert_eq!(guess(dir.path()).unwrap(), Format::Redwood);
    let mut source = open(dir.path(), None).unwrap();
    assert!(source.rig().sensors[0].assumption().is_some() && source.rig().sensors[0].depth_scale == 0.001);
    assert_eq!(frames(source.as_mut()), [(0, 1, true), (33, 2, true), (300, 10, true)]);
}

#[test]
fn associations_in_either_order_and_counted() {
    let dir = tempfile::tempdir().unwrap();
    for k in [0, 1, 10] {
        depth_png(&dir.path().join(format!("depth/{k}.png")), (640, 480), 100 + k);
        color_png(&dir.path().join(format!("rgb/{k}.png")), (640, 480));
    }
    let list = dir.path().join("associations.txt");
    fs::write(&list, "10 depth/10.png 10 rgb/10.png\n0 depth/0.png 0 rgb/0.png\n1 depth/1.png 1 rgb/1.png\n").unwrap();
    assert_eq!(guess(dir.path()).unwrap(), Format::Associated);
    let mut source = open(dir.path(), None).unwrap();
    let sensor = source.rig().sensors[0].clone();
    assert_eq!((sensor.depth.fx, sensor.depth.fy, sensor.depth_scale), (481.2, 480.0, 0.0002));
    assert!(source.remarks()[0].contains("counts frames"));
    assert_eq!(frames(source.as_mut()), [(0, 100, true), (33, 101, true), (333, 110, true)]);
    fs::write(&list, "5.25 rgb/1.png 5.26 depth/1.png\n").unwrap();
    let mut source = open(dir.path(), None).unwrap();
    assert_eq!((source.rig().sensors[0].depth.fx, source.remarks().len()), (525.0, 0));
    assert_eq!(frames(source.as_mut()), [(5260, 101, true)]);
    fs::write(&list, "5.25 rgb/1.png\n").unwrap();
    assert!(open(dir.path(), None).err().unwrap().to_string().contains("line 1"));
}

#[test]
fn stray_scanner_has_a_camera_for_its_video_and_times_by_frame() {
    let dir = tempfile::tempdir().unwrap();
    [0, 1].iter().for_each(|k| depth_png(&dir.path().join(format!("depth/{k:06}.png")), (256, 192), 500 + k));
    fs::write(dir.path().join("camera_matrix.csv"), "1500.0, 0.0, 959.5\n0.0, 1500.0, 719.5\n0.0, 0.0, 1.0\n").unwrap();
    let odometry = "timestamp, frame, x, y, z, qx, qy, qz, qw\n1.5, 000000, 0, 0, 0, 0, 0, 0, 1\n1.75, 000001, 0, 0, 0, 0, 0, 0, 1\n";
    fs::write(dir.path().join("odometry.csv"), odometry).unwrap();
    fs::write(dir.path().join("rgb.mp4"), "video").unwrap();
    assert_eq!(guess(dir.path()).unwrap(), Format::StrayScanner);
    let mut source = open(dir.path(), None).unwrap();
    let camera = source.rig().sensors[0].depth;
    assert!((camera.fx - 200.0).abs() < 1e-9 && (camera.cx - 127.5).abs() < 1e-9 && (camera.cy - 95.5).abs() < 1e-9);
    assert!(source.remarks()[0].contains("rgb.mp4"));
    assert_eq!(frames(source.as_mut()), [(1500, 500, false), (1750, 501, false)]);
    color_png(&dir.path().join("rgb/000000.png"), (960, 720));
    let mut source = open(dir.path(), None).unwrap();
    assert_eq!(source.rig().sensors[0].color.unwrap().width, 960);
    assert_eq!(frames(source.as_mut()), [(1500, 500, true), (1750, 501, false)]);
}

#[test]
fn dumps_of_libfreenect_are_disparities_or_millimetres() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, head: &str, bytes: &[u8]| {
        fs::write(dir.path().join(name), [head.as_bytes(), bytes].concat()).unwrap();
    };
    let depth = |value: u16| [value, 2047].iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    write("INDEX.txt", "", b"d-10.000000-1.pgm\nr-10.010000-1.ppm\n");
    write("d-10.000000-1.pgm", "P5 2 1 65535\n", &depth(800));
    write("r-10.010000-1.ppm", "P6 2 1 255\n", &[1, 2, 3, 4, 5, 6]);
    assert_eq!(guess(dir.path()).unwrap(), Format::Freenect);
    let mut source = open(dir.path(), None).unwrap();
    assert!(source.remarks()[0].contains("disparities") && source.remarks()[1].contains("colour is left out"));
    // 1 / (-0.0030711016 * 800 + 3.3309495161) = 1.1437 m.
    assert_eq!(frames(source.as_mut()), [(10_000, 1144, false)]);
    write("d-10.000000-1.pgm", "P5 2 1 65535\n", &depth(2500));
    let mut source = open(dir.path(), None).unwrap();
    assert_eq!((frames(source.as_mut()), source.remarks().len()), (vec![(10_000, 2500, true)], 0));
}

#[test]
fn files_that_are_not_read_are_named_with_what_to_do() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.zip");
    fs::write(&path, b"PK\x03\x04").unwrap();
    assert!(guess(&path).unwrap_err().to_string().contains("unpack it"));
}
