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
