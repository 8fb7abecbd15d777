//! Small synthetic frames and private data for the tests.
#![allow(dead_code, missing_docs, clippy::unwrap_used)]

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use toile_capture::{
    CaptureError, ClockDomain, ColorImage, DepthImage, DeviceIdentity, Frame, Recorder, RecorderOptions, RgbImage, Rig,
    Sensor, Source,
};
use toile_geometry::{Rigid, camera::PinholeCamera};

pub const WIDTH: u32 = 24;
pub const HEIGHT: u32 = 16;

pub fn rig(sensors: usize) -> Rig {
    let camera = PinholeCamera::ideal(WIDTH, HEIGHT, 20.1 / 3.0, 19.7, 11.5, 7.5);
    let sensor = |i: usize| Sensor {
        name: format!("camera{i}"),
        identity: DeviceIdentity {
            model: "test".into(),
            serial: format!("{i}"),
            firmware: "1.2".into(),
            clock: ClockDomain::HostMonotonic,
            ..DeviceIdentity::default()
        },
        depth: camera,
        depth_scale: 0.001,
        color: Some(camera),
        color_from_depth: Rigid::identity(),
        rig_from_depth: Rigid::translation(0.1 * i as f64, 0.3, 1.0 / 3.0),
        fps: 30.0,
    };
    Rig { sensors: (0..sensors).map(sensor).collect() }
}

/// Frame `i` of a made-up recording: some without colour, one without depth, some lost before it.
pub fn frame(i: u64, sensors: usize) -> Frame {
    let values = (0..WIDTH * HEIGHT)
        .map(|p| if (p + i as u32).is_multiple_of(7) { 0 } else { (900 + p * 3 + i as u32 * 11) as u16 });
    let depth = DepthImage { width: WIDTH, height: HEIGHT, values: values.collect() };
    let pixels = (0..WIDTH * HEIGHT).map(|p| [p as u8, i as u8, 7]).collect();
    let color = match i % 4 {
        0 => Some(ColorImage::Jpeg(vec![0xff, 0xd8, i as u8, 0xff, 0xd9].into())),
        1 => Some(ColorImage::Png(vec![0x89, b'P', i as u8].into())),
        2 => Some(ColorImage::Rgb(Arc::new(RgbImage { width: WIDTH, height: HEIGHT, pixels }))),
        _ => None,
    };
    Frame {
        sensor: i as usize % sensors,
        index: i,
        device_frame: 100 + 2 * i,
        lost_before: u32::from(i > 0),
        device_time_ns: 5_000_000_000 + i as i64 * 33_333_333,
        host_time_ns: 1_700_000_000_000_000_000 + i as i64 * 33_400_000,
        depth: (i != 5).then(|| Arc::new(depth)),
        color: if i == 5 { Some(ColorImage::Jpeg(vec![1, 2, 3].into())) } else { color },
    }
}

pub fn record_frames(path: &Path, count: u64, sensors: usize, chunk_bytes: usize) -> Vec<Frame> {
    let options = RecorderOptions { chunk_bytes, ..RecorderOptions::default() };
    let mut recorder = Recorder::create(path, &rig(sensors), options).unwrap();
    let frames: Vec<Frame> = (0..count).map(|i| frame(i, sensors)).collect();
    frames.iter().for_each(|frame| recorder.write(frame).unwrap());
    recorder.finish().unwrap();
    frames
}

pub fn all_frames(source: &mut dyn Source) -> Result<Vec<Frame>, CaptureError> {
    let mut frames = Vec::new();
    while let Some(frame) = source.next_frame()? {
        frames.push(frame);
    }
    Ok(frames)
}

/// Writes a `toile-folder` of `count` frames; returns its path.
pub fn image_folder(at: &Path, count: u64) -> PathBuf {
    for name in ["depth", "color"] {
        std::fs::create_dir_all(at.join(name)).unwrap();
    }
    for i in 0..count {
        let depth: Vec<u16> = (0..WIDTH * HEIGHT).map(|p| (1000 + i as u32 + p) as u16).collect();
        let depth = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(WIDTH, HEIGHT, depth).unwrap();
        depth.save(at.join(format!("depth/{i:06}.png"))).unwrap();
        let color = image::RgbImage::from_pixel(WIDTH, HEIGHT, image::Rgb([i as u8, 80, 90]));
        color.save(at.join(format!("color/{i:06}.jpg"))).unwrap();
    }
    let camera = format!(
        r#"{{"width": {WIDTH}, "height": {HEIGHT}, "fx": 20.0, "fy": 20.0, "cx": 11.5, "cy": 7.5, "depth_scale": 0.001, "fps": 10}}"#
    );
    std::fs::write(at.join("camera.json"), camera).unwrap();
    let times: Vec<String> = (0..count).map(|i| (1_000_000_000 + i * 100_000_000).to_string()).collect();
    std::fs::write(at.join("timestamps.txt"), times.join("\n") + "\n").unwrap();
    at.to_path_buf()
}
