//! Files written here element by element from the format's public description, by code that shares nothing with the reader.

use std::fs;

use nalgebra::{Point3, Vector2};

use super::*;
use crate::Source;

const SIZE: (u32, u32) = (320, 288);

fn element(id: &[u8], data: &[u8]) -> Vec<u8> {
    let length = (1_u64 << 56 | data.len() as u64).to_be_bytes();
    [id, &length, data].concat()
}

fn number(id: &[u8], value: u64) -> Vec<u8> {
    element(id, &value.to_be_bytes())
}

fn video(number_of: u8, name: &str, letters: &str, (width, height): (u32, u32), more: &[u8]) -> Vec<u8> {
    let header = [vec![0; 16], letters.as_bytes().to_vec(), vec![0; 20]].concat();
    let size = [number(&[0xb0], u64::from(width)), number(&[0xba], u64::from(height))].concat();
    let entry = [
        number(&[0xd7], u64::from(number_of)),
        number(&[0x73, 0xc5], 1000 + u64::from(number_of)),
        number(&[0x83], 1),
        element(&[0x53, 0x6e], name.as_bytes()),
        element(&[0x86], b"V_MS/VFW/FOURCC"),
        element(&[0x63, 0xa2], &header),
        number(&[0x23, 0xe3, 0x83], 33_333_333),
        element(&[0xe0], &size),
        more.to_vec(),
    ];
    element(&[0xae], &entry.concat())
}

fn tag(name: &str, value: &str) -> Vec<u8> {
    let simple = [element(&[0x45, 0xa3], name.as_bytes()), element(&[0x44, 0x87], value.as_bytes())].concat();
    element(&[0x73, 0x73], &[element(&[0x63, 0xc0], &[]), element(&[0x67, 0xc8], &simple)].concat())
}

fn block(track: u8, time: i16, data: &[u8]) -> Vec<u8> {
    let head = [vec![0x80 | track], time.to_be_bytes().to_vec(), vec![0x80]].concat();
    element(&[0xa3], &[&head, data].concat())
}

/// Time in microseconds; a checksum stands first, as k4arecorder writes it.
fn cluster(time_us: u64, blocks: &[Vec<u8>]) -> Vec<u8> {
    let data = [element(&[0xbf], &[0; 4]), number(&[0xe7], time_us), blocks.concat()].concat();
    element(&[0x1f, 0x43, 0xb6, 0x75], &data)
}

/// A calibration in the recorder's form; `model` and the centre of distortion of both lenses.
fn calibration(model: &str, codx: f64) -> String {
    let camera = |purpose: &str, lens: &str, rt: &str, (width, height): (u32, u32)| {
        format!(
            r#"{{"Intrinsics": {{"ModelParameterCount": 14, "ModelParameters": [{lens}, {codx}, 0, 6.5e-5, -5.5e-5],
            "ModelType": "CALIBRATION_LensDistortionModel{model}"}}, "Purpose": "CALIBRATION_CameraPurpose{purpose}",
            "Rt": {rt}, "SensorWidth": {width}, "SensorHeight": {height}}}"#
        )
    };
    let here = r#"{"Rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "Translation": [0, 0, 0]}"#;
    let beside =
        r#"{"Rotation": [1, 0, 0, 0, 0.9949, 0.1009, 0, -0.1009, 0.9949], "Translation": [-0.032, -0.002, 0.004]}"#;
    let depth = camera("Depth", "0.5, 0.51, 0.4925, 0.4926, 6.08, 4.37, 0.236, 6.41, 6.42, 1.22", here, (1024, 1024));
    let color =
        camera("PhotoVideo", "0.5, 0.5, 0.475, 0.635, 0.58, -2.49, 1.36, 0.46, -2.33, 1.3", beside, (4096, 3072));
    format!(r#"{{"CalibrationInformation": {{"Cameras": [{depth}, {color}]}}}}"#) + "\0"
}

fn depth_frame(value: u16) -> Vec<u8> {
    value.to_be_bytes().repeat((SIZE.0 * SIZE.1) as usize)
}

fn jpeg(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let picture = image::RgbImage::from_pixel(width, height, image::Rgb([90, 90, 90]));
    picture.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Jpeg).unwrap();
    bytes
}

/// Everything before the clusters.
fn head(tracks: &[Vec<u8>], calibration: Option<&str>, tags: &[Vec<u8>]) -> Vec<u8> {
    let attached = calibration.map(|text| {
        let fields = [element(&[0x46, 0x6e], b"calibration.json"), element(&[0x46, 0x5c], text.as_bytes())].concat();
        element(&[0x19, 0x41, 0xa4, 0x69], &element(&[0x61, 0xa7], &fields))
    });
    [
        element(&[0x1a, 0x45, 0xdf, 0xa3], &element(&[0x42, 0x82], b"matroska")),
        // The segment's length, which a killed recorder has not written.
        vec![0x18, 0x53, 0x80, 0x67, 0x01, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff],
        element(&[0xec], &[0; 64]),
        element(&[0x15, 0x49, 0xa9, 0x66], &number(&[0x2a, 0xd7, 0xb1], 1000)),
        element(&[0x16, 0x54, 0xae, 0x6b], &tracks.concat()),
        attached.unwrap_or_default(),
        element(&[0x12, 0x54, 0xc3, 0x67], &tags.concat()),
    ]
    .concat()
}

fn usual_tags() -> Vec<Vec<u8>> {
    vec![
        tag("K4A_COLOR_TRACK", "1001"),
        tag("K4A_DEPTH_TRACK", "1002"),
        tag("K4A_DEPTH_MODE", "NFOV_2X2BINNED"),
        tag("K4A_DEPTH_DELAY_NS", "12000000"),
        tag("K4A_START_OFFSET_NS", "5000000000"),
        tag("K4A_DEVICE_SERIAL_NUMBER", "000123"),
        tag("K4A_CALIBRATION_FILE", "calibration.json"),
    ]
}

/// Colour at 0, depth 12 ms later by its tag, infrared with it; of five frames the third and fourth are missing.
fn recording() -> (Vec<u8>, Vec<Vec<u8>>) {
    let tracks = [
        video(1, "COLOR", "MJPG", (1280, 720), &[]),
        video(2, "DEPTH", "b16g", SIZE, &[]),
        video(3, "IR", "b16g", SIZE, &[]),
    ];
    let picture = jpeg(1280, 720);
    let one = |k: u64| {
        let depth = depth_frame(1000 + k as u16);
        let time = 33_333 * k;
        cluster(time, &[block(1, 0, &picture), block(2, 12_000, &depth), block(3, 12_000, &depth[..64])])
    };
    (head(&tracks, Some(&calibration("BrownConrady", 0.0)), &usual_tags()), [0, 1, 4].map(one).to_vec())
}

fn opened(bytes: &[u8]) -> Result<StoredSource, String> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("take.mkv");
    fs::write(&path, bytes).unwrap();
    open(&path).map_err(|error| error.to_string())
}

#[test]
fn a_recording_has_both_cameras_of_its_mode_and_the_devices_times() {
    let (head, clusters) = recording();
    let mut source = opened(&[head, clusters.concat()].concat()).unwrap();
    let sensor = source.rig().sensors[0].clone();
    let (depth, color) = (sensor.depth, sensor.color.unwrap());
    // Half of the sensor's 1024 pixels, its part from (96, 90) on, pixel centres at integers.
    assert!((depth.cx - (256.0 - 96.0 - 0.5)).abs() < 1e-9 && (depth.cy - (0.51 * 512.0 - 90.5)).abs() < 1e-9);
    assert!((depth.fx - 0.4925 * 512.0).abs() < 1e-9 && depth.rational == [6.41, 6.42, 1.22]);
    assert_eq!(depth.distortion, [6.08, 4.37, -5.5e-5, 6.5e-5, 0.236]);
    // 960 rows of which 720 in the middle are in the picture.
    assert!((color.fy - 0.635 * 960.0).abs() < 1e-9 && (color.cy - (480.0 - 120.0 - 0.5)).abs() < 1e-9);
    assert!((sensor.color_from_depth.translation.x + 0.032).abs() < 1e-9);
    let turned = sensor.color_from_depth.rotation * nalgebra::Vector3::z();
    assert!((turned.y - 0.1009).abs() < 1e-3, "row by row: {turned}");
    assert_eq!((sensor.identity.serial.as_str(), sensor.fps.round()), ("000123", 30.0));
    assert!(source.remarks().is_empty(), "infrared is not lost: {:?}", source.remarks());
    let mut found = Vec::new();
    while let Some(frame) = source.next_frame().unwrap() {
        let depth = frame.depth.unwrap().values[SIZE.0 as usize];
        found.push((frame.device_time_ns / 1000, frame.device_frame, frame.lost_before, depth));
        assert_eq!(frame.color.unwrap().decode(0).unwrap().width, 1280, "it pairs across the delay");
    }
    assert_eq!(found, [(5_012_000, 0, 0, 1000), (5_045_333, 1, 0, 1001), (5_145_332, 4, 2, 1004)]);
    let stored = serde_json::to_string(source.rig()).unwrap();
    assert_eq!(&serde_json::from_str::<Rig>(&stored).unwrap(), source.rig(), "also the rational part of its lens");
}

#[test]
fn torn_and_damaged_recordings_are_read_as_far_as_they_go() {
    let (head, clusters) = recording();
    let whole = [head.clone(), clusters.concat()].concat();
    for cut in [20, whole.len() / 8, clusters[2].len() - 40] {
        let source = opened(&whole[..whole.len() - cut]).unwrap();
        assert!(source.remarks()[0].contains("ends in the middle"), "{cut}: {:?}", source.remarks());
        assert!(source.frame_count() >= Some(2), "{cut}: {:?}", source.frame_count());
    }
    let mut damaged = whole.clone();
    // The second cluster's time and first block.
    damaged[head.len() + clusters[0].len() + 12..][..40].fill(0);
    let mut source = opened(&damaged).unwrap();
    assert!(source.remarks()[0].contains("were passed over"), "{:?}", source.remarks());
    source.next_frame().unwrap();
    assert_eq!(source.next_frame().unwrap().unwrap().lost_before, 3);
    for cut in [0, 3, 30, head.len() / 2] {
        let told = opened(&whole[..cut]).unwrap_err();
        assert!(told.contains("cut off") || told.contains("no calibration"), "{cut}: {told}");
    }
    // Live writers leave the lengths of clusters open, too.
    let open_ended: Vec<u8> = clusters.iter().flat_map(|c| [&c[..4], &[0x01], &[0xff; 7], &c[12..]].concat()).collect();
    let source = opened(&[head, open_ended].concat()).unwrap();
    assert_eq!((source.frame_count(), source.remarks().len()), (Some(3), 0));
}

#[test]
fn what_is_missing_or_not_read_is_named() {
    let calibration_text = calibration("BrownConrady", 0.0);
    let one = |tracks: &[Vec<u8>], calibration: Option<&str>| {
        let frames = cluster(0, &[block(2, 0, &depth_frame(7)), block(1, 0, &jpeg(64, 48))]);
        opened(&[head(tracks, calibration, &[]), frames].concat())
    };
    let depth = video(2, "DEPTH", "b16g", SIZE, &[]);
    let told = one(&[video(1, "Film", "MJPG", (64, 48), &[])], None).unwrap_err();
    assert!(told.contains("without a depth track") && told.contains("Film (MJPG)"), "{told}");
    let told = one(std::slice::from_ref(&depth), None).unwrap_err();
    assert!(told.contains("no calibration.json"), "{told}");
    let told = one(&[video(2, "DEPTH", "Y800", SIZE, &[])], Some(&calibration_text)).unwrap_err();
    assert!(told.contains("`Y800`") && told.contains("b16g"), "{told}");
    let told = one(&[video(2, "DEPTH", "b16g", (300, 200), &[])], Some(&calibration_text)).unwrap_err();
    assert!(told.contains("300 x 200") && told.contains("no mode"), "{told}");
    let told = one(std::slice::from_ref(&depth), Some("{}")).unwrap_err();
    assert!(told.contains("calibration.json cannot be used"), "{told}");
    let told = one(std::slice::from_ref(&depth), Some(&calibration("Theta", 0.0))).unwrap_err();
    assert!(told.contains("LensDistortionModelTheta"), "{told}");
    let told = one(std::slice::from_ref(&depth), Some(&calibration("Rational6KT", 0.05))).unwrap_err();
    assert!(told.contains("prototype"), "{told}");
    let source = one(std::slice::from_ref(&depth), Some(&calibration("Rational6KT", 5e-4))).unwrap();
    assert!(source.remarks()[0].contains("left out"), "{:?}", source.remarks());
    let odd = one(&[depth, video(1, "COLOR", "HEVC", (1280, 720), &[])], Some(&calibration_text)).unwrap();
    assert!(odd.remarks()[0].contains("`HEVC`") && odd.rig().sensors[0].color.is_none(), "{:?}", odd.remarks());
}

#[test]
fn raw_colours_and_packed_tracks_are_unpacked() {
    let track = |letters: &str, more: &[u8]| Track::read(&video(1, "COLOR", letters, (4, 2), more)[9..]);
    let red = |image: ColorImage| image.decode(0).unwrap().pixels[5];
    // BT.601 in studio range: red is (81, 90, 240).
    let nv12 = [vec![81; 8], [90, 240].repeat(2)].concat();
    let yuy2 = [81, 90, 81, 240].repeat(4);
    let bgra = [0, 0, 255, 9].repeat(8);
    for (letters, bytes) in [("NV12", nv12), ("YUY2", yuy2), ("BGRA", bgra.clone())] {
        let [r, g, b] = red(track(letters, &[]).color(bytes.clone()).unwrap());
        assert!(r > 250 && g < 5 && b < 5, "{letters}: {r} {g} {b}");
        assert!(track(letters, &[]).color(bytes[1..].to_vec()).is_err(), "{letters} that is too short");
    }
    let compression = |fields: &[u8]| element(&[0x6d, 0x80], &element(&[0x62, 0x40], &element(&[0x50, 0x34], fields)));
    let headless = [number(&[0x42, 0x54], 3), element(&[0x42, 0x55], &bgra[..5])].concat();
    assert_eq!(red(track("BGRA", &compression(&headless)).color(bgra[5..].to_vec()).unwrap()), [255, 0, 0]);
    let packed = miniz_oxide::deflate::compress_to_vec_zlib(&bgra, 6);
    assert_eq!(red(track("BGRA", &compression(&[])).color(packed).unwrap()), [255, 0, 0]);
    let lzo = track("BGRA", &compression(&number(&[0x42, 0x54], 2)));
    assert!(lzo.check(&COLOR_FORMATS).unwrap_err().contains("the way 2"));
}

#[test]
fn the_part_of_the_sensor_sees_what_the_whole_sees() {
    let text = calibration("BrownConrady", 0.0);
    let of = |size| calibration::read(text.as_bytes(), size, None).unwrap().depth;
    let point = Point3::new(0.2, -0.3, 1.5);
    let seen = |camera: toile_geometry::camera::PinholeCamera| camera.project(&point).unwrap();
    let (whole, part, binned) = (seen(of((1024, 1024))), seen(of((640, 576))), seen(of((512, 512))));
    assert!((whole - part - Vector2::new(192.0, 180.0)).norm() < 1e-9);
    // A pixel of 2 by 2 has its centre between theirs.
    assert!((whole.x - (2.0 * binned.x + 0.5)).abs() < 1e-9 && (whole.y - (2.0 * binned.y + 0.5)).abs() < 1e-9);
    for size in [(640, 480), (3840, 2160), (2048, 1536)] {
        let color = calibration::read(text.as_bytes(), (640, 576), Some(size)).unwrap().color.unwrap().0;
        let middle = (f64::from(size.1) - 1.0) / 2.0;
        assert!((color.cy - middle).abs() < 1e-9, "{size:?}: its middle is the sensor's");
    }
}
