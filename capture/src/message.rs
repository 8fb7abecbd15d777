//! Image and calibration messages: frames as the bytes of one MCAP message, and back.

use toile_geometry::camera::PinholeCamera;

use crate::{
    protobuf::{Value, Writer, fields},
    schema::{Schema, stamp_field},
};

/// Times and numbers that every image message carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Stamp {
    pub(crate) frame_index: u64,
    pub(crate) sensor: u32,
    pub(crate) device_frame: u64,
    pub(crate) lost_before: u32,
    pub(crate) device_time_ns: i64,
    pub(crate) host_time_ns: i64,
}

/// An image message, borrowed from its bytes.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct ImageMessage<'a> {
    pub(crate) stamp: Stamp,
    /// `format` of compressed images, `encoding` of raw ones.
    pub(crate) format: &'a str,
    /// Columns; 0 for compressed images, which carry their size inside.
    pub(crate) width: u32,
    /// Rows; 0 for compressed images.
    pub(crate) height: u32,
    /// Bytes a row; 0 for compressed images.
    pub(crate) step: u32,
    pub(crate) data: &'a [u8],
}

impl<'a> ImageMessage<'a> {
    /// The message's bytes; `frame_id` names the camera.
    pub(crate) fn encode(&self, schema: Schema, frame_id: &str) -> Vec<u8> {
        let mut writer = Writer { bytes: Vec::with_capacity(self.data.len() + 160) };
        write_stamp(&mut writer, &self.stamp);
        writer.bytes(1, &timestamp(self.stamp.device_time_ns));
        if schema == Schema::RawImage {
            writer.fixed32(2, self.width).fixed32(3, self.height).string(4, self.format).fixed32(5, self.step);
            writer.bytes(6, self.data).string(7, frame_id);
        } else {
            writer.bytes(2, self.data).string(3, self.format).string(4, frame_id);
        }
        writer.bytes
    }

    /// Reads a message of `schema`; `None` where the bytes are none of ours.
    pub(crate) fn decode(schema: Schema, bytes: &'a [u8]) -> Option<Self> {
        let mut message = Self::default();
        let mut stamped = 0;
        let raw = schema == Schema::RawImage;
        for (number, value) in fields(bytes)? {
            match (number, value) {
                (2, Value::Bytes(data)) if !raw => message.data = data,
                (3, Value::Bytes(text)) if !raw => message.format = std::str::from_utf8(text).ok()?,
                (2, Value::Fixed32(x)) if raw => message.width = u32::from_le_bytes(x),
                (3, Value::Fixed32(x)) if raw => message.height = u32::from_le_bytes(x),
                (4, Value::Bytes(text)) if raw => message.format = std::str::from_utf8(text).ok()?,
                (5, Value::Fixed32(x)) if raw => message.step = u32::from_le_bytes(x),
                (6, Value::Bytes(data)) if raw => message.data = data,
                _ => stamped += u32::from(read_stamp(&mut message.stamp, number, value)),
            }
        }
        let whole = stamped == 6 && !message.format.is_empty() && !message.data.is_empty();
        whole.then_some(message)
    }
}

/// A camera's intrinsics as a `foxglove.CameraCalibration` message.
pub(crate) fn encode_calibration(camera: &PinholeCamera, frame_id: &str, time_ns: i64) -> Vec<u8> {
    let k = [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0];
    let r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let p = [camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut writer = Writer::default();
    writer.bytes(1, &timestamp(time_ns)).fixed32(2, camera.width).fixed32(3, camera.height);
    writer.string(4, "plumb_bob").doubles(5, &camera.distortion);
    writer.doubles(6, &k).doubles(7, &r).doubles(8, &p).string(9, frame_id);
    writer.bytes
}

fn timestamp(time_ns: i64) -> Vec<u8> {
    let mut writer = Writer::default();
    writer.varint(1, time_ns.div_euclid(1_000_000_000) as u64).varint(2, time_ns.rem_euclid(1_000_000_000) as u64);
    writer.bytes
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

/// True when the field was one of the stamp's.
fn read_stamp(stamp: &mut Stamp, number: u32, value: Value) -> bool {
    match (number, value) {
        (stamp_field::FRAME_INDEX, Value::Fixed64(x)) => stamp.frame_index = u64::from_le_bytes(x),
        (stamp_field::SENSOR, Value::Fixed32(x)) => stamp.sensor = u32::from_le_bytes(x),
        (stamp_field::DEVICE_FRAME, Value::Fixed64(x)) => stamp.device_frame = u64::from_le_bytes(x),
        (stamp_field::LOST_BEFORE, Value::Fixed32(x)) => stamp.lost_before = u32::from_le_bytes(x),
        (stamp_field::DEVICE_TIME_NS, Value::Fixed64(x)) => stamp.device_time_ns = i64::from_le_bytes(x),
        (stamp_field::HOST_TIME_NS, Value::Fixed64(x)) => stamp.host_time_ns = i64::from_le_bytes(x),
        _ => return false,
    }
    true
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
            let message =
                ImageMessage { stamp, format: "jpeg", width: size, height: size, step: size, data: b"not an image" };
            let bytes = message.encode(schema, "camera");
            assert_eq!(ImageMessage::decode(schema, &bytes), Some(message));
            for length in 0..bytes.len() - 8 {
                assert_eq!(ImageMessage::decode(schema, &bytes[..length]), None, "{length} bytes were accepted");
            }
        }
    }
}
