"""One function a row of the table: frames in, {"ms", "accuracy", "complete"} or {"ms", "drift"} out."""
import json
import shutil
import statistics
import subprocess
import time

import numpy as np
from PIL import Image

import frames
from fusion import TRUNCATION, VOXEL


def median_ms(calls):
    """Median CPU milliseconds of the calls, made one after the other."""
    spent = []
    for call in calls:
        start = time.process_time()
        call()
        spent.append(1e3 * (time.process_time() - start))
    return statistics.median(spent)


def camera_of(o3d, take):
    return o3d.camera.PinholeCameraIntrinsic(take.width, take.height, *take.lens)


def open3d_legacy(take, with_color):
    import open3d as o3d
    if with_color and not take.color:
        raise RuntimeError("the frames have no colour")
    kind = o3d.pipelines.integration.TSDFVolumeColorType
    volume = o3d.pipelines.integration.ScalableTSDFVolume(VOXEL, TRUNCATION, kind.RGB8 if with_color else kind.NoColor)
    grey = np.zeros((take.height, take.width, 3), np.uint8)
    def integrate(i, depth):
        color = take.color[i] if with_color else grey
        image = o3d.geometry.RGBDImage.create_from_color_and_depth(
            o3d.geometry.Image(np.ascontiguousarray(color)), o3d.geometry.Image(depth), 1000.0, 6.0, convert_rgb_to_intensity=False)
        extrinsic = np.linalg.inv(take.poses[i])
        return lambda: volume.integrate(image, camera_of(o3d, take), extrinsic)
    ms = median_ms([integrate(i, d) for i, d in enumerate(take.without_edges())])
    mesh = volume.extract_triangle_mesh()
    return {"ms": ms, **frames.score(take, np.asarray(mesh.vertices), np.asarray(mesh.triangles))}


def open3d_tensor(take):
    import open3d as o3d
    core = o3d.core
    grid = o3d.t.geometry.VoxelBlockGrid(("tsdf", "weight"), (core.float32, core.float32), ((1), (1)), VOXEL, 8, 100_000, core.Device("CPU:0"))
    lens = core.Tensor(camera_of(o3d, take).intrinsic_matrix)
    def integrate(i, depth):
        image, extrinsic = o3d.t.geometry.Image(core.Tensor(depth)), core.Tensor(np.linalg.inv(take.poses[i]))
        def call():
            blocks = grid.compute_unique_block_coordinates(image, lens, extrinsic, 1000.0, 6.0, TRUNCATION / VOXEL)
            grid.integrate(blocks, image, lens, extrinsic, 1000.0, 6.0, TRUNCATION / VOXEL)
        return call
    ms = median_ms([integrate(i, d) for i, d in enumerate(take.without_edges())])
    mesh = grid.extract_triangle_mesh(weight_threshold=1.0).to_legacy()
    return {"ms": ms, **frames.score(take, np.asarray(mesh.vertices), np.asarray(mesh.triangles))}


def small_gicp_tracking(take):
    """Each frame against the Gaussian voxels of all frames so far (VGICP), from a constant-velocity guess."""
    import small_gicp
    model, poses, spent = small_gicp.GaussianVoxelMap(0.02), [], []
    for depth in take.without_edges():
        start = time.process_time()
        cloud, _ = small_gicp.preprocess_points(frames.points(depth, take.lens), 0.01, num_neighbors=10, num_threads=1)
        if poses:
            guess = poses[-1] @ np.linalg.inv(poses[-2]) @ poses[-1] if len(poses) > 1 else poses[-1]
            found = small_gicp.align(model, cloud, guess, max_correspondence_distance=0.05, num_threads=1, max_iterations=30)
            poses.append(found.T_target_source)
        else:
            poses.append(take.poses[0])
        model.insert(cloud, poses[-1])
        spent.append(1e3 * (time.process_time() - start))
    return {"ms": statistics.median(spent), "drift": frames.drift(take, poses)}


def write_folder(take, folder, with_color):
    """The cut frames as a folder that Toile reads, and their poses."""
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "depth").mkdir(parents=True)
    for i, depth in enumerate(take.depth):
        Image.fromarray(depth).save(folder / f"depth/{i:06}.png", compress_level=1)
    if with_color:
        (folder / "color").mkdir()
        for i, color in enumerate(take.color):
            Image.fromarray(color).save(folder / f"color/{i:06}.jpg", quality=92)
    fx, fy, cx, cy = take.lens
    (folder / "camera.json").write_text(json.dumps(dict(width=take.width, height=take.height, fx=fx, fy=fy, cx=cx, cy=cy, depth_scale=0.001)))
    (folder / "timestamps.txt").write_text("".join(f"{t:.9f}\n" for t in take.times))
    lines = (" ".join(f"{x:.9f}" for x in (t, *p[:3, 3], *quaternion(p[:3, :3]))) for t, p in zip(take.times, take.poses))
    (folder.parent / "poses.txt").write_text("\n".join(lines) + "\n")


def quaternion(r):
    """qx qy qz qw of a rotation matrix: the eigenvector of Bar-Itzhack's K (2000, eq. 3)."""
    k = np.array([[r[0, 0] - r[1, 1] - r[2, 2], r[1, 0] + r[0, 1], r[2, 0] + r[0, 2], r[2, 1] - r[1, 2]],
                  [r[1, 0] + r[0, 1], r[1, 1] - r[0, 0] - r[2, 2], r[2, 1] + r[1, 2], r[0, 2] - r[2, 0]],
                  [r[2, 0] + r[0, 2], r[2, 1] + r[1, 2], r[2, 2] - r[0, 0] - r[1, 1], r[1, 0] - r[0, 1]],
                  [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], np.trace(r)]]) / 3
    q = np.linalg.eigh(k)[1][:, 3]
    return q * np.sign(q[3] or 1)


def toile_run(take, toile, out, with_color, words):
    """`toile fuse` on the cut frames with one thread: its answer's folder and its timings."""
    write_folder(take, out / "frames", with_color)
    scan = out / "scan"
    shutil.rmtree(scan, ignore_errors=True)
    done = subprocess.run([toile, "fuse", out / "frames", "--out", scan, "--threads", "1", "--voxel", str(1e3 * VOXEL),
                           "--truncation", str(1e3 * TRUNCATION), *words], capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise RuntimeError((done.stderr.strip() or "toile fuse failed").splitlines()[-1])
    return scan, json.loads((scan / "timings.json").read_text())["fuse"]["steps"]


def toile_known(take, toile, out, with_color, steps):
    """Known poses; `steps`: whose CPU time is counted."""
    import open3d as o3d
    if with_color and not take.color:
        raise RuntimeError("the frames have no colour")
    scan, timings = toile_run(take, toile, out, with_color, ["--poses", str(out / "poses.txt")])
    ms = sum(timings[s]["cpu_median_ms"] for s in steps if s in timings)
    mesh = o3d.t.io.read_triangle_mesh(str(scan / "scan.ply"))
    return {"ms": ms, **frames.score(take, mesh.vertex.positions.numpy().astype(float), mesh.triangle.indices.numpy())}


def toile_tracking(take, toile, out):
    """Unknown poses: every step that a pushed frame goes through, and the drift of the finished trajectory."""
    scan, timings = toile_run(take, toile, out, False, [])
    ms = sum(timings[s]["cpu_median_ms"] for s in PUSHED if s in timings)
    lines = [[float(x) for x in l.split()] for l in (scan / "trajectory.tum").read_text().splitlines() if not l.startswith("#")]
    found = {round(l[0] * 1e4): frames.matrix(l[1:8]) for l in lines}
    return {"ms": ms, "drift": frames.drift(take, [found.get(round(t * 1e4)) for t in take.times])}


PREPARED = ("filter", "cut", "normals", "integrate")
PUSHED = (*PREPARED, "track")
ALL = [
    ("Open3D legacy, depth", lambda take, toile, out: open3d_legacy(take, False)),
    ("Open3D legacy, colour", lambda take, toile, out: open3d_legacy(take, True)),
    ("Open3D tensor, depth", lambda take, toile, out: open3d_tensor(take)),
    ("Toile integrate, depth", lambda take, toile, out: toile_known(take, toile, out, False, ("integrate",))),
    ("Toile all steps, depth", lambda take, toile, out: toile_known(take, toile, out, False, PREPARED)),
    ("Toile integrate, colour", lambda take, toile, out: toile_known(take, toile, out, True, ("integrate with colour",))),
    ("small_gicp tracking", lambda take, toile, out: small_gicp_tracking(take)),
    ("Toile tracking and fusing", lambda take, toile, out: toile_tracking(take, toile, out)),
]
