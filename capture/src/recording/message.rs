//! Image and calibration messages: frames as the bytes of one MCAP message, and back.

use toile_geometry::camera::PinholeCamera;

use super::{
    protobuf::{Value, Writer, fields},
    schema::{Schema, stamp_field},
};

/// Times and numbers that every image message of ours carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Stamp {
    pub(super) frame_index: u64,
    pub(super) sensor: u32,
    pub(super) device_frame: u64,
    pub(super) lost_before: u32,
    pub(super) device_time_ns: i64,
    pub(super) host_time_ns: i64,
}

/// An image message, borrowed from its bytes.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct ImageMessage<'a> {
    /// `None` in messages of other programs.
    pub(super) stamp: Option<Stamp>,
    /// The message's own time, nanoseconds; `None` where it has none.
    pub(super) time_ns: Option<i64>,
    /// Which camera it is from.
    pub(super) frame_id: &'a str,
    /// `format` of compressed images, `encoding` of raw ones.
    pub(super) format: &'a str,
    /// Columns; 0 for compressed images, which carry their size inside.
    pub(super) width: u32,
    /// Rows; 0 for compressed images.
    pub(super) height: u32,
    /// Bytes a row; 0 for compressed images.
    pub(super) step: u32,
    pub(super) data: &'a [u8],
}

impl<'a> ImageMessage<'a> {
    /// The message's bytes.
    pub(super) fn encode(&self, schema: Schema) -> Vec<u8> {
        let mut writer = Writer { bytes: Vec::with_capacity(self.data.len() + 160) };
        if let Some(stamp) = &self.stamp {
            write_stamp(&mut writer, stamp);
        }
        if let Some(time_ns) = self.time_ns {
            writer.bytes(1, &timestamp(time_ns));
        }
        if schema == Schema::RawImage {
            writer.fixed32(2, self.width).fixed32(3, self.height).string(4, self.format).fixed32(5, self.step);
            writer.bytes(6, self.data).string(7, self.frame_id);
        } else {
            writer.bytes(2, self.data).string(3, self.format).string(4, self.frame_id);
        }
        writer.bytes
    }

    /// Reads a message of `schema`; `None` where the bytes are not an image message.
    pub(super) fn decode(schema: Schema, bytes: &'a [u8]) -> Option<Self> {
        let mut message = Self::default();
        let mut stamp = StampReader::default();
        let raw = schema == Schema::RawImage;
        for field in fields(bytes) {
            let (number, value) = field?;
            match (number, value) {
                (1, Value::Bytes(time)) => message.time_ns = Some(parse_timestamp(time)?),
                (2, Value::Bytes(data)) if !raw => message.data = data,
                (3, Value::Bytes(text)) if !raw => message.format = std::str::from_utf8(text).ok()?,
                (4, Value::Bytes(text)) if !raw => message.frame_id = std::str::from_utf8(text).ok()?,
                (2, Value::Fixed32(x)) if raw => message.width = u32::from_le_bytes(x),
                (3, Value::Fixed32(x)) if raw => message.height = u32::from_le_bytes(x),
                (4, Value::Bytes(text)) if raw => message.format = std::str::from_utf8(text).ok()?,
                (5, Value::Fixed32(x)) if raw => message.step = u32::from_le_bytes(x),
                (6, Value::Bytes(data)) if raw => message.data = data,
                (7, Value::Bytes(text)) if raw => message.frame_id = std::str::from_utf8(text).ok()?,
                _ => stamp.read(number, value),
            }
        }
        message.stamp = stamp.finish();
        (!message.format.is_empty() && !message.data.is_empty()).then_some(message)
    }
}

/// A camera's intrinsics as a `foxglove.CameraCalibration` message.
pub(super) fn encode_calibration(camera: &PinholeCamera, frame_id: &str, time_ns: i64) -> Vec<u8> {
    let k = [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0];
    let r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let p = [camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut writer = Writer::default();
    writer.bytes(1, &timestamp(time_ns)).fixed32(2, camera.width).fixed32(3, camera.height);
    if camera.rational == [0.0; 3] {
        writer.string(4, "plumb_bob").doubles(5, &camera.distortion);
    } else {
        let all: Vec<f64> = camera.distortion.iter().chain(&camera.rational).copied().collect();
        writer.string(4, "rational_polynomial").doubles(5, &all);
    }
    writer.doubles(6, &k).doubles(7, &r).doubles(8, &p).string(9, frame_id);
    writer.bytes
}

/// A camera and its `frame_id` from a `foxglove.CameraCalibration` message; `None` where the bytes are not one, or the
/// camera is not a pinhole camera with the usual five distortion terms, or eight of a rational lens.
pub(super) fn decode_calibration(bytes: &[u8]) -> Option<(PinholeCamera, String)> {
    let (mut width, mut height, mut frame_id) = (0, 0, "");
    let (mut distortion, mut k) = (Vec::new(), Vec::new());
    for field in fields(bytes) {
        match field? {
            (2, Value::Fixed32(x)) => width = u32::from_le_bytes(x),
            (3, Value::Fixed32(x)) => height = u32::from_le_bytes(x),
            (5, value) => push_doubles(&mut distortion, value)?,
            (6, value) => push_doubles(&mut k, value)?,
            (9, Value::Bytes(text)) => frame_id = std::str::from_utf8(text).ok()?,
            _ => {}
        }
    }
    let k: [f64; 9] = k.try_into().ok()?;
    let mut camera = PinholeCamera::ideal(width, height, k[0], k[4], k[2], k[5]);
    match distortion.len() {
        0 => {}
        4 | 5 => camera.distortion[..distortion.len()].copy_from_slice(&distortion),
        8 => {
            camera.distortion.copy_from_slice(&distortion[..5]);
            camera.rational.copy_from_slice(&distortion[5..]);
        }
        _ if distortion.iter().all(|x| *x == 0.0) => {}
        _ => return None,
    }
    camera.is_valid().then(|| (camera, frame_id.to_string()))
}

/// Adds the numbers of a repeated double, packed or not; a camera has at most 32 of them.
fn push_doubles(list: &mut Vec<f64>, value: Value) -> Option<()> {
    match value {
        Value::Fixed64(x) => list.push(f64::from_le_bytes(x)),
        Value::Bytes(bytes) if bytes.len() <= 256 => {
            list.extend(bytes.as_chunks::<8>().0.iter().map(|&x| f64::from_le_bytes(x)));
        }
        _ => return None,
    }
    (list.len() <= 32).then_some(())
}

fn timestamp(time_ns: i64) -> Vec<u8> {
    let mut writer = Writer::default();
    writer.varint(1, time_ns.div_euclid(1_000_000_000) as u64).varint(2, time_ns.rem_euclid(1_000_000_000) as u64);
    writer.bytes
}

/// Nanoseconds of a `google.protobuf.Timestamp`; `None` where they do not fit.
fn parse_timestamp(bytes: &[u8]) -> Option<i64> {
    let (mut seconds, mut nanoseconds) = (0_i64, 0_i64);
    for field in fields(bytes) {
        match field? {
            (1, Value::Varint(x)) => seconds = x as i64,
            (2, Value::Varint(x)) => nanoseconds = x as i64,
            _ => {}
        }
    }
    seconds.checked_mul(1_000_000_000)?.checked_add(nanoseconds)
}

fn write_stamp(writer: &mut Writer, stamp: &Stamp) {
    writer
        .fixed64(stamp_field::FRAME_INDEX, stamp.frame_index.to_le_bytes())
        .fixed32(stamp_field::SENSOR, stamp.sensor)
        .fixed64(stamp_field::DEVICE_FRAME, stamp.device_frame.to_le_bytes())
        .fixed32(stamp_field::LOST_BEFORE, stamp.lost_before)
        .fixed64(stamp_field::DEVICE_TIME_NS, stamp.device_time_ns.to_le_bytes())
        .fixed64(stamp_field::HOST_TIME_NS, stamp.host_time_ns.to_le_bytes());
}

/// Gathers the fields of a stamp.
#[derive(Default)]
struct StampReader {
    stamp: Stamp,
    /// A bit for each field that came.
    seen: u8,
}

impl StampReader {
    fn read(&mut self, number: u32, value: Value) {
        let stamp = &mut self.stamp;
        match (number, value) {
            (stamp_field::FRAME_INDEX, Value::Fixed64(x)) => stamp.frame_index = u64::from_le_bytes(x),
            (stamp_field::SENSOR, Value::Fixed32(x)) => stamp.sensor = u32::from_le_bytes(x),
            (stamp_field::DEVICE_FRAME, Value::Fixed64(x)) => stamp.device_frame = u64::from_le_bytes(x),
            (stamp_field::LOST_BEFORE, Value::Fixed32(x)) => stamp.lost_before = u32::from_le_bytes(x),
            (stamp_field::DEVICE_TIME_NS, Value::Fixed64(x)) => stamp.device_time_ns = i64::from_le_bytes(x),
            (stamp_field::HOST_TIME_NS, Value::Fixed64(x)) => stamp.host_time_ns = i64::from_le_bytes(x),
            _ => return,
        }
        self.seen |= 1 << (number - stamp_field::FRAME_INDEX);
    }

    /// The stamp, where every field came.
    fn finish(self) -> Option<Stamp> {
        (self.seen == 0b11_1111).then_some(self.stamp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_round_trip_and_truncations_are_refused() {
        let stamp = Stamp {
            frame_index: 7,
            sensor: 1,
            device_frame: u64::MAX,
            lost_before: 3,
            device_time_ns: -5,
            host_time_ns: 1_700_000_000_123_456_789,
        };
        for schema in [Schema::CompressedImage, Schema::RawImage, Schema::CompressedDepth] {
            let raw = schema == Schema::RawImage;
            let size = if raw { 2 } else { 0 };
            let message = ImageMessage {
                stamp: Some(stamp),
                time_ns: Some(-5),
                frame_id: "camera",
                format: "jpeg",
                width: size,
                height: size,
                step: size,
                data: b"not an image",
            };
            let bytes = message.encode(schema);
            assert_eq!(ImageMessage::decode(schema, &bytes), Some(message));
            for length in 0..bytes.len() - 8 {
                assert_eq!(ImageMessage::decode(schema, &bytes[..length]), None, "{length} bytes were accepted");
            }
        }
    }

    #[test]
    fn calibrations_round_trip_and_damaged_ones_are_refused() {
        let camera = PinholeCamera {
            distortion: [0.1, -0.2, 0.001, 0.002, 0.05],
            ..PinholeCamera::ideal(64, 48, 60.0, 61.0, 31.5, 23.5)
        };
        let rational = PinholeCamera { rational: [0.3, 0.2, 0.1], ..camera };
        for camera in [camera, rational] {
            let bytes = encode_calibration(&camera, "front", 5);
            assert_eq!(decode_calibration(&bytes), Some((camera, "front".to_string())));
            for length in 0..bytes.len() {
                let found = decode_calibration(&bytes[..length]);
                assert!(found.is_none_or(|(found, _)| found == camera), "{length} bytes are another camera");
            }
        }
    }
}
