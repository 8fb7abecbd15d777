//! Bags written here record by record from the format's public description, by code that shares nothing with the reader.

use std::fs;

use super::*;
use crate::Source;

/// A record: header fields, data.
fn record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let mut header = Vec::new();
    for (name, value) in fields {
        header.extend((name.len() as u32 + 1 + value.len() as u32).to_le_bytes());
        header.extend(name.as_bytes());
        header.push(b'=');
        header.extend(*value);
    }
    let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
    bytes.extend(header);
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(data);
    bytes
}

fn connection(id: u32, topic: &str, kind: &str) -> Vec<u8> {
    let inner = record(&[("type", kind.as_bytes()), ("md5sum", b"*")], b"");
    let length = u32::from_le_bytes([inner[0], inner[1], inner[2], inner[3]]) as usize;
    record(&[("op", &[7]), ("conn", &id.to_le_bytes()), ("topic", topic.as_bytes())], &inner[4..4 + length])
}

fn message(id: u32, seconds: u32, data: &[u8]) -> Vec<u8> {
    let time = [seconds.to_le_bytes(), 0_u32.to_le_bytes()].concat();
    record(&[("op", &[2]), ("conn", &id.to_le_bytes()), ("time", &time)], data)
}

fn text(text: &str) -> Vec<u8> {
    [(text.len() as u32).to_le_bytes().to_vec(), text.as_bytes().to_vec()].concat()
}

fn header(seconds: u32, frame: &str) -> Vec<u8> {
    [vec![0; 4], seconds.to_le_bytes().to_vec(), vec![0; 4], text(frame)].concat()
}

fn image(seconds: u32, frame: &str, encoding: &str, step: u32, data: &[u8]) -> Vec<u8> {
    let size = [2_u32.to_le_bytes(), 4_u32.to_le_bytes()].concat();
    let tail = [step.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
    [header(seconds, frame), size, text(encoding), vec![0], tail, data.to_vec()].concat()
}

/// A camera of 4 × 2 pixels.
fn info(frame: &str, fx: f64, model: &str, distortion: &[f64]) -> Vec<u8> {
    let doubles = |list: &[f64]| list.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let size = [2_u32.to_le_bytes(), 4_u32.to_le_bytes()].concat();
    let count = (distortion.len() as u32).to_le_bytes().to_vec();
    let k = doubles(&[fx, 0.0, 2.0, 0.0, fx, 1.0, 0.0, 0.0, 1.0]);
    [header(0, frame), size, text(model), count, doubles(distortion), k, vec![0; 21 * 8], vec![0; 4 * 6 + 1]].concat()
}

fn tf(parent: &str, child: &str, x: f64) -> Vec<u8> {
    let pose: Vec<u8> = [x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    [1_u32.to_le_bytes().to_vec(), header(0, parent), text(child), pose].concat()
}

fn chunk(packing: &str, records: &[u8]) -> Vec<u8> {
    let packed = match packing {
        "lz4" => {
            let mut writer = lz4_flex::frame::FrameEncoder::new(Vec::new());
            std::io::Write::write_all(&mut writer, records).unwrap();
            writer.finish().unwrap()
        }
        _ => records.to_vec(),
    };
    let size = (records.len() as u32).to_le_bytes();
    record(&[("op", &[5]), ("compression", packing.as_bytes()), ("size", &size)], &packed)
}

fn bag(chunks: &[Vec<u8>]) -> Vec<u8> {
    let head =
        record(&[("op", &[3]), ("index_pos", &[0; 8]), ("conn_count", &[0; 4]), ("chunk_count", &[0; 4])], &[b' '; 60]);
    [b"#ROSBAG V2.0\n".to_vec(), head, chunks.concat()].concat()
}

fn depth_bytes(first: u16) -> Vec<u8> {
    (0..8).flat_map(|k| (first + k).to_le_bytes()).collect()
}

/// Depth and colour of two cameras with `tf` between them: two frames, in two chunks.
fn two_cameras(packing: &str) -> Vec<u8> {
    let first = [
        connection(0, "/cam/depth/image_rect_raw", "sensor_msgs/Image"),
        connection(1, "/cam/depth/camera_info", "sensor_msgs/CameraInfo"),
        connection(2, "/cam/color/image_raw", "sensor_msgs/Image"),
        connection(3, "/cam/color/camera_info", "sensor_msgs/CameraInfo"),
        connection(4, "/tf_static", "tf2_msgs/TFMessage"),
        message(1, 1, &info("depth_optical", 5.0, "plumb_bob", &[])),
        message(3, 1, &info("color_optical", 6.0, "plumb_bob", &[0.1, 0.2, 0.0, 0.0, 0.0])),
        message(4, 1, &tf("link", "depth_optical", 1.0)),
        message(4, 1, &tf("/link", "color_optical", 1.5)),
        message(0, 9, &image(10, "depth_optical", "16UC1", 8, &depth_bytes(1000))),
        message(2, 9, &image(10, "color_optical", "bgr8", 13, &(0..26).collect::<Vec<u8>>())),
    ];
    let second = [message(0, 9, &image(11, "depth_optical", "16UC1", 8, &depth_bytes(2000)))];
    bag(&[chunk(packing, &first.concat()), chunk(packing, &second.concat())])
}

fn opened(bytes: &[u8]) -> Result<StoredSource, String> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("take.bag");
    fs::write(&path, bytes).unwrap();
    open_bag(&path).map_err(|error| error.to_string())
}

#[test]
fn two_cameras_of_a_bag_are_a_sensor_with_its_own_colour_camera() {
    for packing in ["none", "lz4"] {
        let mut source = opened(&two_cameras(packing)).unwrap();
        let sensor = source.rig().sensors[0].clone();
        assert_eq!((sensor.depth.fx, sensor.color.unwrap().fx, sensor.color.unwrap().distortion[1]), (5.0, 6.0, 0.2));
        assert!(
            (sensor.color_from_depth.translation.x + 0.5).abs() < 1e-12,
            "the colour camera stands 0.5 m to the right"
        );
        assert!((sensor.fps - 1.0).abs() < 1e-9 && sensor.depth_scale == 0.001);
        let frame = source.next_frame().unwrap().unwrap();
        assert_eq!((frame.device_time_ns, frame.depth.unwrap().values[7]), (10_000_000_000, 1007));
        let color = frame.color.unwrap().decode(0).unwrap();
        assert_eq!((color.pixels[0], color.pixels[4]), ([2, 1, 0], [15, 14, 13]), "blue first, rows of 13 bytes");
        let frame = source.next_frame().unwrap().unwrap();
        assert_eq!((frame.depth.unwrap().values[0], frame.color.is_none()), (2000, true));
        assert!(source.next_frame().unwrap().is_none());
    }
}

#[test]
fn a_torn_bag_is_read_up_to_its_last_whole_chunk() {
    let whole = two_cameras("none");
    let source = opened(&whole[..whole.len() - 10]).unwrap();
    assert_eq!((source.frame_count(), source.remarks().len()), (Some(1), 1));
    assert!(source.remarks()[0].contains("ends in the middle"));
}

#[test]
fn units_and_metres_and_what_is_missing() {
    let one = |encoding: &str, step, data: &[u8], more: &[Vec<u8>]| {
        let base = [
            connection(0, "/device_0/sensor_0/Depth_0/image/data", "sensor_msgs/Image"),
            connection(1, "/device_0/sensor_0/Depth_0/info/camera_info", "sensor_msgs/CameraInfo"),
            connection(2, "/device_0/sensor_0/option/Depth Units/value", "std_msgs/Float32"),
            message(0, 9, &image(10, "0", encoding, step, data)),
        ];
        bag(&[chunk("none", &[base.concat(), more.concat()].concat())])
    };
    let camera = message(1, 0, &info("0", 5.0, "Brown Conrady", &[0.0; 5]));
    let unit = message(2, 0, &0.0001_f32.to_le_bytes());
    let source = opened(&one("mono16", 8, &depth_bytes(1), &[camera.clone(), unit])).unwrap();
    assert!((source.rig().sensors[0].depth_scale - 0.0001).abs() < 1e-15 && source.remarks().is_empty());
    let source = opened(&one("mono16", 8, &depth_bytes(1), std::slice::from_ref(&camera))).unwrap();
    assert!(source.remarks()[0].contains("millimetres are assumed"), "{:?}", source.remarks());
    let metres: Vec<u8> = (0..8).flat_map(|k| (1.5 + k as f32).to_le_bytes()).collect();
    let mut source = opened(&one("32FC1", 16, &metres, &[camera])).unwrap();
    assert_eq!(source.next_frame().unwrap().unwrap().depth.unwrap().values[1], 2500);
    let told = opened(&one("mono16", 8, &depth_bytes(1), &[])).unwrap_err();
    assert!(told.contains("no calibration") && told.contains("4 x 2"), "{told}");
    let fisheye = message(1, 0, &info("0", 5.0, "kannala_brandt", &[0.1; 4]));
    let told = opened(&one("mono16", 8, &depth_bytes(1), &[fisheye])).unwrap_err();
    assert!(told.contains("kannala_brandt"), "{told}");
    let told = opened(&one("mono8", 4, &[0; 8], &[])).unwrap_err();
    assert!(told.contains("no topic with depth") && told.contains("Depth_0/image/data"), "{told}");
}

#[test]
fn the_first_layout_of_librealsense_is_read() {
    let stream = [text("DEPTH"), 30_u32.to_le_bytes().to_vec(), info("", 7.0, "", &[])].concat();
    let records = [
        connection(0, "/camera/rs_stream_info/0", "realsense_msgs/stream_info"),
        connection(1, "/camera/depth/image_raw/0", "sensor_msgs/Image"),
        message(0, 0, &stream),
        message(1, 3, &image(0, "", "mono16", 8, &depth_bytes(1))),
    ];
    let source = opened(&bag(&[chunk("none", &records.concat())])).unwrap();
    assert_eq!((source.rig().sensors[0].depth.fx, source.rig().sensors[0].color), (7.0, None));
}

/// A message of ROS 2, aligned as CDR asks.
#[derive(Default)]
struct Cdr(Vec<u8>);

impl Cdr {
    fn put<const N: usize>(mut self, bytes: [u8; N]) -> Self {
        self.0.resize(self.0.len().next_multiple_of(N), 0);
        self.0.extend(bytes);
        self
    }

    fn text(self, text: &str) -> Self {
        let mut next = self.put((text.len() as u32 + 1).to_le_bytes());
        next.0.extend(text.bytes().chain([0]));
        next
    }

    fn header(self, seconds: u32, frame: &str) -> Self {
        self.put(seconds.to_le_bytes()).put(0_u32.to_le_bytes()).text(frame)
    }

    fn done(self) -> Vec<u8> {
        [vec![0, 1, 0, 0], self.0].concat()
    }
}

fn cdr_image(seconds: u32, encoding: &str, step: u32, data: &[u8]) -> Vec<u8> {
    let size = Cdr::default().header(seconds, "optical").put(2_u32.to_le_bytes()).put(4_u32.to_le_bytes());
    let mut image = size.text(encoding).put([0]).put(step.to_le_bytes()).put((data.len() as u32).to_le_bytes());
    image.0.extend(data);
    image.done()
}

fn cdr_info() -> Vec<u8> {
    let mut info = Cdr::default().header(0, "optical").put(2_u32.to_le_bytes()).put(4_u32.to_le_bytes());
    info = info.text("plumb_bob").put(0_u32.to_le_bytes());
    for value in [5.0, 0.0, 2.0, 0.0, 5.0, 1.0, 0.0, 0.0, 1.0].into_iter().chain([0.0; 21]) {
        info = info.put(f64::to_le_bytes(value));
    }
    [0; 6].iter().fold(info, |info, word: &u32| info.put(word.to_le_bytes())).put([0]).done()
}

#[test]
fn mcap_of_ros_1_and_ros_2_is_read_and_told_from_other_mcap() {
    let dir = tempfile::tempdir().unwrap();
    let ros1 = [image(10, "optical", "16UC1", 8, &depth_bytes(1000)), info("optical", 5.0, "plumb_bob", &[])];
    let ros2 = [cdr_image(10, "16UC1", 8, &depth_bytes(1000)), cdr_info()];
    for (encoding, infix, [depth, camera]) in [("ros1", "/", ros1), ("cdr", "/msg/", ros2)] {
        let mut writer = ::mcap::Writer::new(std::io::Cursor::new(Vec::new())).unwrap();
        for (k, (topic, kind, data)) in
            [("/cam/depth/camera_info", "CameraInfo", camera), ("/cam/depth/image_raw", "Image", depth)]
                .iter()
                .enumerate()
        {
            let schema = writer.add_schema(&format!("sensor_msgs{infix}{kind}"), "ros2msg", b"x").unwrap();
            let channel_id = writer.add_channel(schema, topic, encoding, &BTreeMap::new()).unwrap();
            let header =
                ::mcap::records::MessageHeader { channel_id, sequence: k as u32, log_time: 7, publish_time: 7 };
            writer.write_to_known_channel(&header, data).unwrap();
        }
        writer.finish().unwrap();
        let path = dir.path().join(format!("{encoding}.mcap"));
        fs::write(&path, writer.into_inner().into_inner()).unwrap();
        assert_eq!(crate::import::guess(&path).unwrap(), crate::import::Format::RosMcap);
        let mut source = open_mcap(&path).unwrap();
        assert_eq!(source.rig().sensors[0].depth.fx, 5.0);
        let frame = source.next_frame().unwrap().unwrap();
        assert_eq!((frame.device_time_ns, frame.depth.unwrap().values[7]), (10_000_000_000, 1007), "{encoding}");
    }
}

#[test]
fn a_real_recording_of_librealsense_is_read() {
    let Some(folder) = toile_outside::data("real/recordings/librealsense_bag") else { return };
    let mut source = open_bag(&folder.join("single_depth_color_640x480.bag")).unwrap();
    let sensor = source.rig().sensors[0].clone();
    assert_eq!((sensor.depth.width, sensor.depth.height, sensor.depth_scale), (640, 480, 0.001));
    // The colour camera of this model stands some 15 mm beside its left depth camera.
    assert!((0.012..0.018).contains(&sensor.color_from_depth.translation.x), "{}", sensor.color_from_depth);
    let mut depths = 0;
    let mut colors = 0;
    while let Some(frame) = source.next_frame().unwrap() {
        if let Some(depth) = frame.depth {
            depths += 1;
            let seen: Vec<u16> = depth.values.iter().copied().filter(|d| *d > 0).collect();
            assert!(seen.len() > 100_000, "{}", seen.len());
        }
        colors += usize::from(frame.color.is_some_and(|color| color.decode(0).unwrap().width == 640));
    }
    assert!(depths > 0 && colors > 0, "{depths} {colors}");
}

/// A file of a ROS 2 bag: topics, and messages as (topic, time, data).
fn db3(path: &Path, messages: &[(i64, i64, Vec<u8>)]) {
    let connection = rusqlite::Connection::open(path).unwrap();
    connection
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
                 serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
             CREATE INDEX timestamp_idx ON messages (timestamp ASC);
             INSERT INTO topics VALUES(1, '/cam/depth/image_raw', 'sensor_msgs/msg/Image', 'cdr', '');
             INSERT INTO topics VALUES(2, '/cam/depth/camera_info', 'sensor_msgs/msg/CameraInfo', 'cdr', '');
             INSERT INTO topics VALUES(3, '/odd', 'x/msg/Y', 'protobuf', '');",
        )
        .unwrap();
    for (topic, time, data) in messages {
        let row = rusqlite::params![topic, time, data];
        connection.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(?1, ?2, ?3)", row).unwrap();
    }
}

fn depth_message(seconds: u32) -> (i64, i64, Vec<u8>) {
    (1, i64::from(seconds), cdr_image(seconds, "16UC1", 8, &depth_bytes(100 * seconds as u16)))
}

fn depths(source: &mut dyn Source) -> Vec<(i64, u16)> {
    let mut found = Vec::new();
    while let Some(frame) = source.next_frame().unwrap() {
        found.push((frame.device_time_ns / 1_000_000_000, frame.depth.unwrap().values[0]));
    }
    found
}

#[test]
fn bags_of_ros_2_are_read_as_folders_and_as_single_files() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("50% of it? #2");
    fs::create_dir(&folder).unwrap();
    let packed = |(topic, time, data): (i64, i64, Vec<u8>)| (topic, time, zstd::encode_all(&data[..], 1).unwrap());
    // Rows are not in the order of time, and a file that is listed is missing.
    db3(&folder.join("take_0.db3"), &[depth_message(12), (3, 0, vec![9]), (2, 5, cdr_info()), depth_message(11)]);
    db3(&folder.join("take_1.db3"), &[packed(depth_message(13))]);
    let list = "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n    - take_0.db3\n    - \"take_1.db3\"\n    - take_2.db3\n  duration:\n";
    fs::write(folder.join("metadata.yaml"), list).unwrap();
    let before = fs::read_dir(&folder).unwrap().count();
    assert_eq!(crate::import::guess(&folder).unwrap(), crate::import::Format::Ros2Bag);
    let mut source = crate::import::open(&folder, None).unwrap();
    assert!(source.remarks()[0].contains("lists take_2.db3, which is not"), "{:?}", source.remarks());
    assert_eq!(depths(source.as_mut()), [(11, 1100), (12, 1200), (13, 1300)]);
    assert_eq!(crate::import::files(&folder).unwrap().len(), 3);
    assert_eq!(fs::read_dir(&folder).unwrap().count(), before, "nothing was created beside them");
    let mut single = crate::import::open(&folder.join("take_0.db3"), None).unwrap();
    assert_eq!((single.rig().sensors[0].depth.fx, depths(single.as_mut()).len()), (5.0, 2));
    fs::remove_file(folder.join("metadata.yaml")).unwrap();
    let mut unlisted = crate::import::open(&folder, None).unwrap();
    assert_eq!((unlisted.remarks().len(), depths(unlisted.as_mut()).len()), (0, 3));
}

#[test]
fn bags_of_ros_2_that_are_packed_torn_or_no_bags_are_told_from_each_other() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("take_0.db3");
    let mut messages = vec![(2, 5, cdr_info())];
    // Rows of about a page each, so that the last ones lie at the file's end.
    messages.extend((10..40).map(|k| (1, i64::from(k), cdr_image(k, "16UC1", 2000, &vec![1; 3010]))));
    db3(&path, &messages);
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() * 3 / 4]).unwrap();
    let told = open_bag2(&path).map(|source| (source.frame_count(), source.remarks()));
    let (frames, remarks) = told.unwrap();
    assert!((10..30).contains(&frames.unwrap()) && remarks[0].contains("damaged"), "{frames:?} {remarks:?}");
    let other = dir.path().join("other.db3");
    rusqlite::Connection::open(&other).unwrap().execute_batch("CREATE TABLE a(b)").unwrap();
    let told = open_bag2(&other).unwrap_err().to_string();
    assert!(told.contains("cannot be read as a ROS 2 bag") && told.contains("topics"), "{told}");
    let folder = dir.path().join("packed");
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("take_0.db3.zstd"), ZSTD_HEAD).unwrap();
    fs::write(folder.join("metadata.yaml"), "  relative_file_paths:\n  - packed/take_0.db3.zstd\n").unwrap();
    let told = crate::import::open(&folder, None).err().unwrap().to_string();
    assert!(told.contains("take_0.db3.zstd") && told.contains("zstd -d"), "{told}");
}

const ZSTD_HEAD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
