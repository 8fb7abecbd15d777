#!/usr/bin/env python3
"""Writes the MCAP files of this folder with other people's libraries.

    pip install mcap==1.6.0 mcap-protobuf-support==0.6.0 foxglove-schemas-protobuf==0.4.0 pillow==13.0.0
    python3 make_mcap.py [FOLDER]

foxglove-raw.mcap      as a program would that knows nothing of Toile: depth as foxglove.RawImage (16UC1), colour as JPEG some
                       milliseconds later, calibrations, a topic that is none of these; small zstd chunks
foxglove-png.mcap      depth as 16-bit PNG in foxglove.CompressedImage, no colour, no chunks, calibration without a frame_id
toile-recording.mcap   a recording of Toile's own, written from docs/recording.md: two sensors, packed depth, zstd chunks

The frames are formulas (see `depth` and `color`), which tests/golden.rs has too. The files are the same in every run with the
same versions.
"""
import io
import json
import pathlib
import struct
import sys

import zstandard
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.timestamp_pb2 import Timestamp
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import build_file_descriptor_set
from PIL import Image

WIDTH, HEIGHT, FRAMES = 32, 24, 6
START_NS, STEP_NS = 1_700_000_000_100_000_000, 100_000_000
FOCAL, CENTRE = 30.5, (15.5, 11.5)


def depth(i, u, v):
    """Millimetres; every eleventh pixel was not measured."""
    return 0 if (u + v + i) % 11 == 0 else 1000 + 10 * i + 3 * u + 7 * v


def depth_values(i):
    return [depth(i, u, v) for v in range(HEIGHT) for u in range(WIDTH)]


def jpeg(i):
    picture = Image.new("RGB", (WIDTH, HEIGHT), (40 * i, 80, 200))
    out = io.BytesIO()
    picture.save(out, "JPEG", quality=90)
    return out.getvalue()


def png16(i):
    picture = Image.frombytes("I;16", (WIDTH, HEIGHT), struct.pack(f"<{WIDTH * HEIGHT}H", *depth_values(i)))
    out = io.BytesIO()
    picture.save(out, "PNG")
    return out.getvalue()


def time(ns):
    return Timestamp(seconds=ns // 1_000_000_000, nanos=ns % 1_000_000_000)


def calibration(ns, frame_id):
    message = CameraCalibration(timestamp=time(ns), width=WIDTH, height=HEIGHT, frame_id=frame_id)
    message.distortion_model = "plumb_bob"
    message.D.extend([0.01, -0.02, 0.001, 0.002, 0.003])
    message.K.extend([FOCAL, 0, CENTRE[0], 0, FOCAL, CENTRE[1], 0, 0, 1])
    message.R.extend([1, 0, 0, 0, 1, 0, 0, 0, 1])
    message.P.extend([FOCAL, 0, CENTRE[0], 0, 0, FOCAL, CENTRE[1], 0, 0, 0, 1, 0])
    return message


class Topics:
    """Channels of protobuf messages on the library's plain writer."""

    def __init__(self, path, **options):
        self.file = open(path, "wb")
        self.writer = Writer(self.file, **options)
        self.writer.start(profile="", library="make_mcap.py")
        self.channels = {}

    def channel(self, topic, kind, name=None, about=None):
        descriptor = build_file_descriptor_set(kind).SerializeToString()
        schema = self.writer.register_schema(name or kind.DESCRIPTOR.full_name, "protobuf", descriptor)
        self.channels[topic] = self.writer.register_channel(topic, "protobuf", schema, about or {})

    def write(self, topic, data, log_ns, publish_ns, sequence):
        self.writer.add_message(self.channels[topic], log_ns, data, publish_ns, sequence)

    def close(self):
        self.writer.finish()
        self.file.close()


def foxglove_raw(path):
    topics = Topics(path, chunk_size=4000, compression=CompressionType.ZSTD)
    topics.channel("/cam/depth/image_rect", RawImage)
    topics.channel("/cam/depth/camera_info", CameraCalibration)
    topics.channel("/cam/rgb/image/compressed", CompressedImage)
    topics.channel("/cam/rgb/camera_info", CameraCalibration)
    text = topics.writer.register_schema("std_msgs/String", "ros2msg", b"string data")
    topics.channels["/rosout"] = topics.writer.register_channel("/rosout", "cdr", text)
    for i in range(FRAMES):
        at = START_NS + i * STEP_NS
        topics.write("/rosout", b"\x00\x01\x00\x00\x06\x00\x00\x00hello\x00", at, at, i)
        # Colour comes first into the file, although it was taken later; of frame 3 there is none.
        if i != 3:
            message = CompressedImage(timestamp=time(at + 4_000_000), frame_id="optical", format="jpeg", data=jpeg(i))
            topics.write("/cam/rgb/image/compressed", message.SerializeToString(), at + 9_000_000, at + 4_000_000, i)
        raw = struct.pack(f"<{WIDTH * HEIGHT}H", *depth_values(i))
        message = RawImage(timestamp=time(at), frame_id="optical", width=WIDTH, height=HEIGHT, encoding="16UC1",
                           step=2 * WIDTH, data=raw)
        topics.write("/cam/depth/image_rect", message.SerializeToString(), at + 8_000_000, at, i)
        for topic in ("/cam/depth/camera_info", "/cam/rgb/camera_info"):
            topics.write(topic, calibration(at, "optical").SerializeToString(), at + 8_000_000, at, i)
    topics.close()


def foxglove_png(path):
    topics = Topics(path, use_chunking=False)
    topics.channel("/depth", CompressedImage)
    topics.channel("/info", CameraCalibration)
    topics.write("/info", calibration(START_NS, "").SerializeToString(), START_NS, START_NS, 0)
    for i in range(FRAMES):
        at = START_NS + i * STEP_NS
        message = CompressedImage(timestamp=time(at), format="png", data=png16(i))
        topics.write("/depth", message.SerializeToString(), at, at, i)
    topics.close()


def packed(values):
    """docs/recording.md, "Depth packed as toile-depth-1"."""
    codes, above = [], 0
    for v in range(HEIGHT):
        left = above
        above = values[v * WIDTH]
        for u in range(WIDTH):
            value = values[v * WIDTH + u]
            difference = (value - left + 0x8000) % 0x10000 - 0x8000
            codes.append((2 * difference if difference >= 0 else -2 * difference - 1) & 0xFFFF)
            left = value
    planes = bytes(c & 0xFF for c in codes) + bytes(c >> 8 for c in codes)
    return b"TDZ1" + struct.pack("<II", WIDTH, HEIGHT) + zstandard.ZstdCompressor(level=3).compress(planes)


def varint(value):
    out = b""
    while value >= 0x80:
        out += bytes([value & 0x7F | 0x80])
        value >>= 7
    return out + bytes([value])


def stamped(message, index, sensor, device_frame, lost, device_ns, host_ns):
    """A message with docs/recording.md's fields 1001 to 1006 behind its own."""
    fields = [(1001, 1, "<Q", index), (1002, 5, "<I", sensor), (1003, 1, "<Q", device_frame), (1004, 5, "<I", lost),
              (1005, 1, "<q", device_ns), (1006, 1, "<q", host_ns)]
    extra = b"".join(varint(number << 3 | wire) + struct.pack(form, value) for number, wire, form, value in fields)
    return message.SerializeToString() + extra


def camera():
    return {"width": WIDTH, "height": HEIGHT, "fx": FOCAL, "fy": FOCAL, "cx": CENTRE[0], "cy": CENTRE[1],
            "distortion": [0, 0, 0, 0, 0]}


def toile_recording(path):
    pose = lambda x: {"rotation": [0.0, 0.0, 0.0, 1.0], "translation": [x, 0.0, 0.0]}
    sensor = lambda n: {
        "name": f"camera{n}", "depth": camera(), "depth_scale": 0.001, "color": camera(), "fps": 10.0,
        "identity": {"model": "python", "serial": str(n), "firmware": "", "clock": "device"},
        "color_from_depth": pose(0.0), "rig_from_depth": pose(0.5 * n)}
    topics = Topics(path, chunk_size=3000, compression=CompressionType.ZSTD)
    topics.writer.add_metadata("toile.recording", {
        "version": "1", "depth_encoding": "toile-depth-1", "note": "", "rig": json.dumps({"sensors": [sensor(0), sensor(1)]})})
    for n in range(2):
        about = {"toile.sensor": str(n)}
        topics.channel(f"/camera{n}/depth/image", CompressedImage, "toile.CompressedDepth", {**about, "toile.stream": "depth"})
        topics.channel(f"/camera{n}/color/image", CompressedImage, None, {**about, "toile.stream": "color"})
    for i in range(FRAMES):
        n, at = i % 2, START_NS + i * STEP_NS
        numbers = (i, n, 40 + i, 1 if i == 4 else 0, at, at + 5_000_000)
        message = CompressedImage(timestamp=time(at), format="toile-depth-1", data=packed(depth_values(i)))
        topics.write(f"/camera{n}/depth/image", stamped(message, *numbers), at + 5_000_000, at, 40 + i)
        message = CompressedImage(timestamp=time(at), format="jpeg", data=jpeg(i))
        topics.write(f"/camera{n}/color/image", stamped(message, *numbers), at + 5_000_000, at, 40 + i)
    topics.close()


if __name__ == "__main__":
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent)
    foxglove_raw(folder / "foxglove-raw.mcap")
    foxglove_png(folder / "foxglove-png.mcap")
    toile_recording(folder / "toile-recording.mcap")
