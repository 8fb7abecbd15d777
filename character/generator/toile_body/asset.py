"""Writes the asset: a header, named sections of little-endian numbers, a CRC-32. The reader is `character/src/asset.rs`."""

import json
import struct
import zlib

import numpy as np

MAGIC = b"TOILEBOD"
VERSION = 1


def write(path, sections, meta):
    """`sections`: list of (name, array). All counts follow from the metadata, the sections' lengths must agree with them."""
    blobs = [(name, np.ascontiguousarray(a).astype(a.dtype.newbyteorder("<")).tobytes()) for name, a in sections]
    head = dict(meta, sections=[{"name": n, "bytes": len(b)} for n, b in blobs])
    text = json.dumps(head, indent=1).encode()
    body = MAGIC + struct.pack("<II", VERSION, len(text)) + text + b"".join(b for _, b in blobs)
    with open(path, "wb") as f:
        f.write(body + struct.pack("<I", zlib.crc32(body)))
    return len(body) + 4


TYPES = {"triangles": "<u2", "mean": "<f4", "scales": "<f4", "components": "<i2", "joints": "<f4", "joint_components": "<f4",
         "influences": "u1", "weights": "<u2", "regions": "u1", "inner": "u1"}


def read(path):
    """Metadata and sections (flat arrays by name) of an asset."""
    with open(path, "rb") as f:
        data = f.read()
    if data[:8] != MAGIC or struct.unpack("<I", data[-4:])[0] != zlib.crc32(data[:-4]):
        raise SystemExit(f"{path}: no body asset, or torn")
    at = 16 + struct.unpack("<I", data[12:16])[0]
    meta, out = json.loads(data[16:at]), {}
    for s in meta["sections"]:
        out[s["name"]] = np.frombuffer(data[at : at + s["bytes"]], TYPES[s["name"]])
        at += s["bytes"]
    return meta, out
