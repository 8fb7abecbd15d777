#!/usr/bin/env python3
"""Toile's fusion beside its peers: the very same frames, the same run, one thread each.

    python3 tests/peers/fusion.py [FRAMES] [--frames N] [--toile PROGRAM] [--only NAME ...]

FRAMES is a folder that `toile import` reads: depth/*.png, color/* or none, and in it or the folder above it camera.json (or
intrinsics.json), the poses (TUM lines: trajectory.txt, groundtruth.txt or truth/poses.txt; subject_from_camera, the subject on the
origin, +Y up) and, to score against, the true surface (gt_mesh.ply or truth/surface.ply). Without FRAMES the synthetic sensor
makes a turn: 120 clean frames of 640x480.

Peers come from PyPI into a Python environment in target/peers/: Open3D (its build without CUDA: legacy ScalableTSDFVolume and
tensor VoxelBlockGrid, known poses) and small_gicp (frame to model, poses unknown). Where PyPI or a wheel cannot be had, that is
said ("skipped: why") and the rest runs. Everybody gets the frames with the subject cut out by the true poses; peers also get them
without depth edges (50 mm), as Toile drops edges itself. Voxels 4 mm, truncation 16 mm, everything on one processor.

Printed are: CPU milliseconds a frame (process time, median; reading images, cutting, edge filter and extraction are not in it),
the ratio to Open3D legacy, mean distance of the surface to the truth, and how much of the truth that some frame sees lies within
5 mm of the surface (Toile's is the finished scan with its filled holes; what stands on the disk is not scored). Toile's times
come from its timings.json: `integrate` is the volume update alone, `all steps` adds filter, cut and normals. Tracking rows end with
the drift at the body's centre after the last frame. Files: target/peers/.
"""
import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "target/peers"
# Open3D is held at 0.19: in 0.20.0's wheel ScalableTSDFVolume integrates nothing (no error, an empty mesh).
PACKAGES = ["numpy", "pillow", "open3d-cpu==0.19.0", "small_gicp"]
VOXEL, TRUNCATION, EDGE = 0.004, 0.016, 0.05
ONE_THREAD = {f"{lib}_NUM_THREADS": "1" for lib in ("OMP", "OPENBLAS", "MKL", "TBB", "RAYON")}


def environment():
    """The Python of target/peers/env with whatever of PACKAGES can be installed; says what cannot."""
    python = OUT / "env/bin/python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(OUT / "env")], check=True)
    have = subprocess.run([python, "-m", "pip", "list", "--format", "freeze"], capture_output=True, text=True).stdout.lower()
    for package in PACKAGES:
        if (package if "==" in package else f"{package}==") not in have:
            print(f"installing {package} from PyPI", file=sys.stderr)
            problem = ended(python, "-m", "pip", "install", "-q", "--timeout", "20", "--retries", "1", package)
            if problem:
                print(f"skipped: {package}: {problem}")
    if "libusb" in (ended(python, "-c", "import open3d") or ""):
        # Open3D links it for a camera that nobody has here. Unpacked beside, so that the system stays as it is.
        problem = ended("sh", "-c", "apt-get download -q libusb-1.0-0 && dpkg -x libusb-1.0-0*.deb libusb", cwd=OUT)
        if problem:
            print(f"skipped: libusb-1.0-0, which Open3D loads: {problem}")
    libraries = ":".join(str(p.parent) for p in (OUT / "libusb").glob("**/libusb-1.0.so.0"))
    return python, ":".join(filter(None, (libraries, os.environ.get("LD_LIBRARY_PATH"))))


def ended(*command, cwd=None):
    """The last words of a command where it failed, else None."""
    done = subprocess.run([str(c) for c in command], cwd=cwd, capture_output=True, text=True, timeout=900)
    return None if done.returncode == 0 else ((done.stderr + done.stdout).strip() or "failed").splitlines()[-1]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, metavar="FRAMES")
    parser.add_argument("--frames", type=int, default=0, help="only the first N")
    parser.add_argument("--toile", type=Path, default=ROOT / "target/release/toile")
    parser.add_argument("--only", nargs="*", help="names of rows to run (part of a name is enough)")
    args = parser.parse_args()
    if "PEERS_INSIDE" not in os.environ:
        OUT.mkdir(parents=True, exist_ok=True)
        python, libraries = environment()
        os.environ.update(ONE_THREAD, PEERS_INSIDE="1", LD_LIBRARY_PATH=libraries)
        os.execv(python, [str(python), *sys.argv])
    try:
        import numpy  # noqa: F401
        import PIL  # noqa: F401
    except ImportError as missing:
        sys.exit(f"skipped: {missing}: without numpy and pillow nothing can be compared")
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    sys.path.insert(0, str(Path(__file__).parent))
    import peers
    import frames
    take = frames.load(args.folder or frames.synthesize(args.toile, OUT / "turn"), args.frames)
    rows = []
    for name, run in peers.ALL:
        if args.only and not any(word in name for word in args.only):
            continue
        started = time.time()
        try:
            row = {"name": name, **run(take, args.toile, OUT)}
        except (ImportError, OSError, RuntimeError) as reason:
            row = {"name": name, "skipped": str(reason)}
        rows.append(row)
        print(f"{name}: {time.time() - started:.0f} s", file=sys.stderr)
    print(table(rows, take))
    (OUT / "figures.json").write_text(json.dumps(rows, indent=1, default=float) + "\n")


def table(rows, take):
    """The rows in Markdown, with the ratio of each to Open3D legacy's depth-only integration."""
    base = next((r["ms"] for r in rows if r["name"] == "Open3D legacy, depth" and "ms" in r), None)
    lines = [f"{len(take.depth)} frames of {take.width}x{take.height}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}", "",
             "| | CPU ms a frame | ratio | accuracy mm | complete % | drift mm |", "|---|---|---|---|---|---|"]
    for row in rows:
        if "skipped" in row:
            lines.append(f"| {row['name']} | skipped: {row['skipped']} | | | | |")
            continue
        text = lambda key, digits: f"{row[key]:.{digits}f}" if row.get(key) is not None else ""
        ratio = f"{base / row['ms']:.1f}" if base and "drift" not in row else ""
        lines.append(f"| {row['name']} | {text('ms', 2)} | {ratio} | {text('accuracy', 3)} | {text('complete', 2)} | {text('drift', 2)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
