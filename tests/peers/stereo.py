#!/usr/bin/env python3
"""Toile's stereo matcher beside OpenCV's StereoSGBM (MODE_SGBM_3WAY), in one run on the same pictures.

    python3 -m venv VENV && VENV/bin/pip install opencv-python-headless numpy
    VENV/bin/python tests/peers/stereo.py            the table of docs/stereo.md
    VENV/bin/python tests/peers/stereo.py --golden   writes stereo/tests/golden/opencv.json again
    VENV/bin/python tests/peers/stereo.py --pictures FOLDER   disparity maps to look at

Pictures come from the private stereo pairs: real/stereo in the folder that TOILE_OUTSIDE_DATA names. Without them it says
"skipped", and fails. One thread each; times
are the user time of the process, so that other work on the machine matters little. "bad 2.0" is the share of the
answered pixels with known truth that are off by more than 2 pixels, "density" the share of the known ones answered.
"""

import argparse, json, os, pathlib, resource, subprocess, sys, tempfile

import cv2
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = pathlib.Path(os.environ.get("TOILE_OUTSIDE_DATA", ROOT / "../shared/data")) / "real/stereo"
MATCHER = ["cargo", "run", "--quiet", "--release", "-p", "toile-stereo", "--example", "disparity", "--"]
REPEATS = 12


def pairs():
    """Name, left, right, true disparity of the left image (0 unknown), number of disparities."""
    cones, aloe = DATA / "middlebury_cones", DATA / "opencv_aloe"
    gray = lambda path: cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    truth = gray(cones / "disp2.pgm").astype(np.float32) / 4
    yield "cones", gray(cones / "im2.ppm"), gray(cones / "im6.ppm"), truth, 64
    left, right, truth = gray(aloe / "aloeL.jpg"), gray(aloe / "aloeR.jpg"), gray(aloe / "aloeGT.png")
    yield "aloe", left, right, truth.astype(np.float32), 256
    size = (truth.shape[1] // 2, truth.shape[0] // 2)
    half = lambda image: cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    truth = cv2.resize(truth, size, interpolation=cv2.INTER_NEAREST).astype(np.float32) / 2
    yield "aloe, half size", half(left), half(right), truth, 128


def opencv(left, right, disparities):
    """Disparities (0 unknown) and CPU seconds of a frame."""
    matcher = cv2.StereoSGBM_create(
        minDisparity=0, numDisparities=disparities, blockSize=3, P1=8 * 9, P2=32 * 9, disp12MaxDiff=1,
        uniquenessRatio=10, speckleWindowSize=100, speckleRange=1, mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY)
    matcher.compute(left, right)
    start = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    for _ in range(REPEATS):
        found = matcher.compute(left, right)
    seconds = (resource.getrusage(resource.RUSAGE_SELF).ru_utime - start) / REPEATS
    return np.maximum(found.astype(np.float32) / 16, 0), seconds


def toile(left, right, disparities):
    """The same of ours: the program's user time with and without the repeats, which leaves out start and files."""
    with tempfile.TemporaryDirectory() as folder:
        names = [os.path.join(folder, name) for name in ("left.png", "right.png", "out.pfm")]
        cv2.imwrite(names[0], left), cv2.imwrite(names[1], right)

        def run(repeats):
            start = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            command = MATCHER + names + ["--disparities", str(disparities), "--repeats", str(repeats)]
            subprocess.run(command, check=True, cwd=ROOT, env=dict(os.environ, RAYON_NUM_THREADS="1"))
            return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - start

        run(1)
        seconds = (run(1 + REPEATS) - run(1)) / REPEATS
        return cv2.imread(names[2], cv2.IMREAD_UNCHANGED), seconds


def table(folder):
    print(f"OpenCV {cv2.__version__}, {cv2.getNumThreads()} thread; Toile, 1 thread; {REPEATS} frames each\n")
    print("| Pair | Matcher | Density | bad 2.0 | bad 1.0 | median error, px | CPU ms / Mpixel·disparity |")
    print("|---|---|---|---|---|---|---|")
    for name, left, right, truth, disparities in pairs():
        for who, method in (("OpenCV SGBM_3WAY", opencv), ("Toile", toile)):
            found, seconds = method(left, right, disparities)
            known = truth > 0
            answered = known & (found > 0)
            error = np.abs(found - truth)[answered]
            cost = seconds * 1e3 / (truth.size * disparities / 1e6)
            print(f"| {name}, {truth.shape[1]}×{truth.shape[0]}×{disparities} | {who} "
                  f"| {100 * answered.sum() / known.sum():.1f} % | {100 * (error > 2).mean():.2f} % "
                  f"| {100 * (error > 1).mean():.2f} % | {np.median(error):.3f} | {cost:.2f} |")
            if folder:
                shown = cv2.applyColorMap((found / disparities * 255).clip(0, 255).astype(np.uint8), cv2.COLORMAP_TURBO)
                shown[found == 0] = 255
                cv2.imwrite(f"{folder}/{name.split(',')[0]}{disparities}-{who.split()[0]}.png", shown)


def write_storage(**matrices):
    """The text that OpenCV itself writes."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "calibration.yml")
        storage = cv2.FileStorage(path, cv2.FILE_STORAGE_WRITE)
        for name, value in matrices.items():
            storage.write(name, value)
        storage.release()
        return pathlib.Path(path).read_text()


def views(m1, d1, m2, d2, r, t, size):
    """What OpenCV rectifies to: the camera, and where a few pixels of either view come from."""
    for alpha in (None, 0.0, 0.5, 1.0):
        r1, r2, p1, p2, _, _, _ = cv2.stereoRectify(
            m1, d1, m2, d2, size, r, t, flags=cv2.CALIB_ZERO_DISPARITY, alpha=-1 if alpha is None else alpha)
        maps = [cv2.initUndistortRectifyMap(m, d, turn, p, size, cv2.CV_32FC1)
                for m, d, turn, p in ((m1, d1, r1, p1), (m2, d2, r2, p2))]
        grid = [(u, v) for v in range(40, size[1], 100) for u in range(40, size[0], 140)]
        points = [[u, v] + [float(axis[v, u]) for pair in maps for axis in pair] for u, v in grid]
        yield {"alpha": alpha, "f": p1[0, 0], "cx": p1[0, 2], "cy": p1[1, 2], "baseline": -p2[0, 3] / p2[0, 0], "points": points}


def invented():
    """A calibration of no real rig: five coefficients on the left, eight on the right."""
    m1 = np.array([[701.3, 0, 322.8], [0, 699.1, 236.4], [0, 0, 1]])
    m2 = np.array([[696.6, 0, 314.2], [0, 697.9, 243.7], [0, 0, 1]])
    d1 = np.array([[-0.171, 0.083, 0.0011, -0.0007, -0.019]])
    d2 = np.array([[0.21, -0.31, -0.0009, 0.0005, 0.04, 0.35, -0.27, 0.06]])
    r, _ = cv2.Rodrigues(np.array([0.011, -0.034, 0.007]))
    return m1, d1, m2, d2, r, np.array([[-0.118], [0.0017], [0.0042]])


def chessboards(intrinsics):
    """Where the right camera of the chessboard pairs stands, by OpenCV, its intrinsics as they are in the file."""
    board, square = (9, 6), 0.025
    corners = np.zeros((54, 3), np.float32)
    corners[:, :2] = np.mgrid[0:9, 0:6].T.reshape(-1, 2) * square
    folder = DATA / "opencv_stereo_chessboard"
    seen = [[], []]
    for left in sorted(folder.glob("left[0-9]*.jpg")):
        for k, path in enumerate((left, folder / left.name.replace("left", "right"))):
            image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
            _, found = cv2.findChessboardCorners(image, board)
            seen[k].append(cv2.cornerSubPix(image, found, (11, 11), (-1, -1), (3, 30, 0.01)))
    m1, d1, m2, d2 = [m.copy() for m in intrinsics]
    out = cv2.stereoCalibrate([corners] * len(seen[0]), *seen, m1, d1, m2, d2, (640, 480), flags=cv2.CALIB_FIX_INTRINSIC)
    return out[5], out[6]


def golden():
    m1, d1, m2, d2, r, t = invented()
    r1, r2, p1, p2, q, _, _ = cv2.stereoRectify(m1, d1, m2, d2, (640, 480), r, t, flags=cv2.CALIB_ZERO_DISPARITY, alpha=0)
    text = write_storage(M1=m1, D1=d1, M2=m2, D2=d2, R=r, T=t)
    cases = [{"name": "invented", "text": text, "views": list(views(m1, d1, m2, d2, r, t, (640, 480)))},
             {"name": "invented, rectified by OpenCV", "text": text + write_storage(R1=r1, R2=r2, P1=p1, P2=p2, Q=q).split("---")[1],
              "views": [v for v in views(m1, d1, m2, d2, r, t, (640, 480)) if v["alpha"] == 0.0]}]
    storage = cv2.FileStorage(str(DATA / "opencv_stereo_chessboard/intrinsics.yml"), cv2.FILE_STORAGE_READ)
    intrinsics = [storage.getNode(name).mat() for name in ("M1", "D1", "M2", "D2")]
    r, t = chessboards(intrinsics)
    cases.append({"name": "chessboard", "intrinsics": "opencv_stereo_chessboard/intrinsics.yml",
                  "text": write_storage(R=r, T=t), "views": list(views(*intrinsics, r, t, (640, 480)))})
    path = ROOT / "stereo/tests/golden/opencv.json"
    path.write_text(json.dumps({"opencv": cv2.__version__, "cases": cases}, indent=1) + "\n")
    print(f"wrote {path.relative_to(ROOT)}")


if __name__ == "__main__":
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--golden", action="store_true")
    arguments.add_argument("--pictures", metavar="FOLDER")
    arguments = arguments.parse_args()
    if not DATA.is_dir():
        sys.exit("skipped: the private stereo pairs are missing; TOILE_OUTSIDE_DATA names the folder that holds real/stereo")
    cv2.setNumThreads(1)
    golden() if arguments.golden else table(arguments.pictures)
