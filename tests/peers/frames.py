"""The frames that all peers get, their true poses, and scoring against the true surface."""
import json
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

EDGE_M = 0.05       # a depth jump of more than this between neighbours is an edge
RADIUS_M = 0.75     # the subject stands within this of the axis
DISK_M = 0.012      # and above this height


@dataclass
class Take:
    """Depth in millimetres with the subject cut out, poses subject_from_camera (4x4) and where the truth lies."""
    depth: list          # uint16 [height, width]
    color: list          # uint8 [height, width, 3], or empty
    poses: list          # 4x4
    times: list          # seconds
    lens: tuple          # fx, fy, cx, cy
    width: int
    height: int
    truth: Path

    def without_edges(self):
        return [drop_edges(d) for d in self.depth]


def synthesize(toile, folder):
    """A clean turn by the synthetic sensor, made once; the folder of its frames."""
    if not (folder / "00-body/truth/poses.txt").exists():
        shutil.rmtree(folder, ignore_errors=True)
        folder.parent.mkdir(parents=True, exist_ok=True)
        words = ["--as", "folders", "--garments", "", "--sensor", "kinect1", "--frames", "120", "--clean", "--quiet"]
        subprocess.run([toile, "synthesize", "--out", folder, *words], check=True, stdout=subprocess.DEVNULL)
    return folder / "00-body"


def first(folder, *names):
    """The first file of these names in the folder or the one above."""
    found = [p / n for p in (folder, folder.parent) for n in names if (p / n).exists()]
    return found[0] if found else None


def load(folder, limit):
    camera_file, pose_file = first(folder, "camera.json", "intrinsics.json"), first(folder, "trajectory.txt", "groundtruth.txt", "truth/poses.txt")
    if not camera_file or not pose_file:
        raise SystemExit(f"{folder}: needs camera.json and poses (trajectory.txt or truth/poses.txt)")
    camera = json.loads(camera_file.read_text())
    lens = tuple(float(camera[k]) for k in ("fx", "fy", "cx", "cy"))
    scale = float(camera.get("depth_scale", 0.001))
    scale = 1 / scale if scale >= 1 else scale
    lines = [l.split() for l in pose_file.read_text().splitlines() if l.strip() and not l.startswith("#")]
    depth_files, color_files = sorted((folder / "depth").glob("*.png")), sorted((folder / "color").glob("*"))
    count = min(len(lines), len(depth_files), limit or len(lines))
    poses = [matrix([float(x) for x in l[1:8]]) for l in lines[:count]]
    depth = [np.array(Image.open(f)) for f in depth_files[:count]]
    depth = [cut((d * (scale / 0.001)).round().astype(np.uint16), p, lens) for d, p in zip(depth, poses)]
    color = [np.array(Image.open(f).convert("RGB")) for f in color_files[:count]] if len(color_files) >= count else []
    truth = first(folder, "gt_mesh.ply", "truth/surface.ply")
    return Take(depth, color, poses, [float(l[0]) for l in lines[:count]], lens, depth[0].shape[1], depth[0].shape[0], truth)


def matrix(numbers):
    """4x4 from tx ty tz qx qy qz qw."""
    x, y, z, w = np.array(numbers[3:]) / np.linalg.norm(numbers[3:])
    m = np.eye(4)
    m[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                 [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                 [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    m[:3, 3] = numbers[:3]
    return m


def points(depth, lens):
    """Camera points of the measured pixels, metres."""
    v, u = np.nonzero(depth)
    z = depth[v, u] * 0.001
    return np.stack([(u - lens[2]) / lens[0] * z, (v - lens[3]) / lens[1] * z, z], 1)


def cut(depth, pose, lens):
    """Depth of the subject's cylinder alone."""
    v, u = np.nonzero(depth)
    p = points(depth, lens) @ pose[:3, :3].T + pose[:3, 3]
    out = (np.hypot(p[:, 0], p[:, 2]) > RADIUS_M) | (p[:, 1] < DISK_M)
    depth = depth.copy()
    depth[v[out], u[out]] = 0
    return depth


def drop_edges(depth):
    """Depth without the pixels beside a jump (3x3)."""
    d = depth.astype(np.int32)
    bad = np.zeros(d.shape, bool)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            n = np.roll(d, (dy, dx), (0, 1))
            bad |= (n > 0) & (abs(n - d) > EDGE_M * 1000)
    return np.where(bad, 0, depth).astype(np.uint16)


def score(take, vertices, triangles):
    """Mean distance to the truth, mm; percent of the truth seen by some frame that lies within 5 mm."""
    import open3d as o3d
    if take.truth is None or len(triangles) == 0:
        return {"accuracy": None, "complete": None}
    truth = o3d.io.read_triangle_mesh(str(take.truth))
    scan = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(triangles))
    o3d.utility.random.seed(1)
    on_scan, on_truth = (np.asarray(m.sample_points_uniformly(200_000).points, np.float32) for m in (scan, truth))
    to_truth, to_scan = scene_of(o3d, truth), scene_of(o3d, scan)
    seen = visible(take, to_truth, on_truth)
    seen &= on_truth[:, 1] > 0.005 + DISK_M   # what stands on the disk was cut away
    accuracy = to_truth.compute_distance(on_scan).numpy()
    complete = to_scan.compute_distance(on_truth[seen]).numpy()
    return {"accuracy": 1e3 * accuracy.mean(), "complete": 100 * (complete < 0.005).mean()}


def scene_of(o3d, mesh):
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
    return scene


def visible(take, scene, samples):
    """Which samples of the truth some frame sees: in the image and nothing before it."""
    seen = np.zeros(len(samples), bool)
    fx, fy, cx, cy = take.lens
    for pose in take.poses[:: max(1, len(take.poses) // 60)]:
        p = (samples - pose[:3, 3]) @ pose[:3, :3]
        u, v = fx * p[:, 0] / p[:, 2] + cx, fy * p[:, 1] / p[:, 2] + cy
        inside = ~seen & (u > 0) & (v > 0) & (u < take.width - 1) & (v < take.height - 1)
        origin = np.broadcast_to(pose[:3, 3].astype(np.float32), (inside.sum(), 3))
        rays = np.concatenate([origin, samples[inside] - origin], 1).astype(np.float32)
        seen[inside] = scene.cast_rays(rays)["t_hit"].numpy() > 0.9995
    return seen


def drift(take, poses):
    """How far the body's centre, as the last frame sees it, lies from the truth when first frames agree, mm."""
    known = [i for i, p in enumerate(poses) if p is not None]
    if len(known) < 2:
        return None
    a, b = known[0], known[-1]
    moved = take.poses[a] @ np.linalg.inv(poses[a]) @ poses[b]
    center = np.array([0, 0.5 * 1.7, 0, 1.0])
    return 1e3 * np.linalg.norm((moved @ np.linalg.inv(take.poses[b]) @ center - center)[:3])
