"""Pictures of generated people, front and side: python -m toile_body.look SAMPLES.pkl OUT.png [--wide] [--count 20]."""

import argparse
import pickle

import numpy as np
from PIL import Image

HEIGHT, METRES = 420, 2.1  # pixels and metres of a picture's height
LIGHT = np.array([0.3, 0.5, 0.8]) / np.linalg.norm([0.3, 0.5, 0.8])


def main():
    ap = argparse.ArgumentParser()
    ap.add_argument("samples")
    ap.add_argument("out")
    ap.add_argument("--wide", action="store_true", help="people of the wider stratum")
    ap.add_argument("--count", type=int, default=20)
    a = ap.parse_args()
    with open(a.samples, "rb") as f:
        data = pickle.load(f)
    index = np.flatnonzero(data["people"].wide == a.wide)[: a.count]
    side = np.array([[0, 0, -1.0], [0, 1, 0], [1, 0, 0]])
    tiles = []
    for i in index:
        v = data["bodies"][i].astype(float)
        tiles.append(np.hstack([shade(v, data["triangles"], 0.62), shade(v @ side.T, data["triangles"], 0.35)]))
    blank = np.full_like(tiles[0], 255.0)
    tiles += [blank] * (-len(tiles) % 5)
    rows = [np.hstack(tiles[i : i + 5]) for i in range(0, len(tiles), 5)]
    Image.fromarray(np.vstack(rows).astype(np.uint8)).save(a.out)


def shade(v, triangles, aspect):
    """Orthographic picture along -z, nearest surface wins; surfaces are drawn as dense points."""
    width, scale = int(HEIGHT * aspect), HEIGHT / METRES
    corners = v[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-12
    n = 12
    grid = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]) / n
    front = normal[:, 2] > 0
    points = np.einsum("gk,tkc->tgc", grid, corners[front]).reshape(-1, 3)
    gray = np.repeat(40 + 200 * np.clip(normal[front] @ LIGHT, 0, 1), len(grid))
    order = np.argsort(points[:, 2], kind="stable")
    x = np.clip(width / 2 + points[order, 0] * scale, 0, width - 1).astype(int)
    y = np.clip(HEIGHT - 10 - points[order, 1] * scale, 0, HEIGHT - 1).astype(int)
    picture = np.full((HEIGHT, width), 255.0)
    picture[y, x] = gray[order]
    return picture


if __name__ == "__main__":
    main()
