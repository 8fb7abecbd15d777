//! The message schemas inside a recording, as Protocol Buffers descriptors made by hand.
//!
//! `foxglove.CompressedImage`, `foxglove.RawImage` and `foxglove.CameraCalibration` are the public Foxglove schemas, with
//! our fields from number 1001 added to the images, so that each message carries its times and numbers itself.
//! `toile.CompressedDepth` is `foxglove.CompressedImage` whose data is packed by [`super::depth_codec`].

use super::protobuf::Writer;

/// Field numbers of [`super::message::Stamp`] in every image message.
pub(super) mod stamp_field {
    pub(in crate::recording) const FRAME_INDEX: u32 = 1001;
    pub(in crate::recording) const SENSOR: u32 = 1002;
    pub(in crate::recording) const DEVICE_FRAME: u32 = 1003;
    pub(in crate::recording) const LOST_BEFORE: u32 = 1004;
    pub(in crate::recording) const DEVICE_TIME_NS: u32 = 1005;
    pub(in crate::recording) const HOST_TIME_NS: u32 = 1006;
}

/// Which schema a channel has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Schema {
    /// JPEG or PNG colour, PNG depth.
    CompressedImage,
    /// Raw pixels: `rgb8` or `16UC1`.
    RawImage,
    /// Depth packed by our codec.
    CompressedDepth,
    /// Intrinsics of one camera.
    CameraCalibration,
}

#[derive(Clone, Copy)]
enum Type {
    Double = 1,
    Int64 = 3,
    Int32 = 5,
    Fixed64 = 6,
    Fixed32 = 7,
    String = 9,
    Message = 11,
    Bytes = 12,
    Sfixed64 = 16,
}

struct Field {
    name: &'static str,
    number: u32,
    kind: Type,
    repeated: bool,
}

const TIMESTAMP: &str = ".google.protobuf.Timestamp";

impl Schema {
    pub(super) const ALL: [Self; 4] =
        [Self::CompressedImage, Self::RawImage, Self::CompressedDepth, Self::CameraCalibration];

    /// The full name, such as `foxglove.RawImage`.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::CompressedImage => "foxglove.CompressedImage",
            Self::RawImage => "foxglove.RawImage",
            Self::CompressedDepth => "toile.CompressedDepth",
            Self::CameraCalibration => "foxglove.CameraCalibration",
        }
    }

    /// The schema of that name.
    pub(super) fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|schema| schema.name() == name)
    }

    /// A serialised `FileDescriptorSet` that describes this schema and what it imports.
    pub(super) fn descriptor(self) -> Vec<u8> {
        let (package, message) = self.name().split_once('.').unwrap_or(("toile", "Message"));
        let mut fields = self.fields();
        if self != Self::CameraCalibration {
            fields.extend(stamp_fields());
        }
        let mut set = Writer::default();
        let timestamp = [field("seconds", 1, Type::Int64), field("nanos", 2, Type::Int32)];
        set.bytes(1, &file("google/protobuf/timestamp.proto", "google.protobuf", "Timestamp", &timestamp));
        set.bytes(1, &file(&format!("{package}/{message}.proto"), package, message, &fields));
        set.bytes
    }

    fn fields(self) -> Vec<Field> {
        let timestamp = field("timestamp", 1, Type::Message);
        let repeated = |name, number| Field { repeated: true, ..field(name, number, Type::Double) };
        match self {
            Self::CompressedImage | Self::CompressedDepth => vec![
                timestamp,
                field("data", 2, Type::Bytes),
                field("format", 3, Type::String),
                field("frame_id", 4, Type::String),
            ],
            Self::RawImage => vec![
                timestamp,
                field("width", 2, Type::Fixed32),
                field("height", 3, Type::Fixed32),
                field("encoding", 4, Type::String),
                field("step", 5, Type::Fixed32),
                field("data", 6, Type::Bytes),
                field("frame_id", 7, Type::String),
            ],
            Self::CameraCalibration => vec![
                timestamp,
                field("width", 2, Type::Fixed32),
                field("height", 3, Type::Fixed32),
                field("distortion_model", 4, Type::String),
                repeated("D", 5),
                repeated("K", 6),
                repeated("R", 7),
                repeated("P", 8),
                field("frame_id", 9, Type::String),
            ],
        }
    }
}

fn field(name: &'static str, number: u32, kind: Type) -> Field {
    Field { name, number, kind, repeated: false }
}

fn stamp_fields() -> [Field; 6] {
    [
        field("toile_frame_index", stamp_field::FRAME_INDEX, Type::Fixed64),
        field("toile_sensor", stamp_field::SENSOR, Type::Fixed32),
        field("toile_device_frame", stamp_field::DEVICE_FRAME, Type::Fixed64),
        field("toile_lost_before", stamp_field::LOST_BEFORE, Type::Fixed32),
        field("toile_device_time_ns", stamp_field::DEVICE_TIME_NS, Type::Sfixed64),
        field("toile_host_time_ns", stamp_field::HOST_TIME_NS, Type::Sfixed64),
    ]
}

/// A serialised `FileDescriptorProto` with one message.
fn file(path: &str, package: &str, message: &str, fields: &[Field]) -> Vec<u8> {
    let mut descriptor = Writer::default();
    descriptor.string(1, message);
    for field in fields {
        let mut one = Writer::default();
        one.string(1, field.name)
            .varint(3, u64::from(field.number))
            .varint(4, if field.repeated { 3 } else { 1 })
            .varint(5, field.kind as u64);
        if matches!(field.kind, Type::Message) {
            one.string(6, TIMESTAMP);
        }
        descriptor.bytes(2, &one.bytes);
    }
    let mut file = Writer::default();
    file.string(1, path).string(2, package);
    if fields.iter().any(|field| matches!(field.kind, Type::Message)) {
        file.string(3, "google/protobuf/timestamp.proto");
    }
    file.bytes(4, &descriptor.bytes).string(12, "proto3");
    file.bytes
}
