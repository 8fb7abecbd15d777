"""Are two assets the same within one quantisation step? python -m toile_body.compare A B (exit 1 where not)."""

import sys

from . import asset

SAME = ("triangles", "influences", "regions", "inner")
STEP = {"components": 1, "weights": 1}  # in units of the stored integers
FLOAT = {"mean": 1e-6, "joints": 1e-6, "joint_components": 1e-6, "scales": 1e-9}  # metres


def main():
    (_, a), (_, b) = asset.read(sys.argv[1]), asset.read(sys.argv[2])
    good = True
    for name, x in a.items():
        difference = abs(x.astype(float) - b[name].astype(float)).max() if x.shape == b[name].shape else float("inf")
        allowed = 0 if name in SAME else STEP.get(name, FLOAT.get(name))
        good &= difference <= allowed
        print(f"{name:18s} greatest difference {difference:.3g} (allowed {allowed})")
    raise SystemExit(0 if good else 1)


if __name__ == "__main__":
    main()
