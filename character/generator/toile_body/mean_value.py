"""Mean value coordinates of points in a closed triangle mesh (Ju, Schaefer & Warren 2005; seed eq. 1)."""

import numpy as np


def mean_value_weights(points, v, triangles):
    """Weights (points x vertices), rows sum to 1, for points strictly inside the mesh."""
    out = np.zeros((len(points), len(v)))
    for row, x in zip(out, points):
        u = v - x
        d = np.linalg.norm(u, axis=1)
        u /= d[:, None]
        tri = u[triangles]
        a, b, c = tri[:, 0], tri[:, 1], tri[:, 2]
        edge = np.stack([np.linalg.norm(b - c, axis=1), np.linalg.norm(c - a, axis=1), np.linalg.norm(a - b, axis=1)], 1)
        theta = 2 * np.arcsin(np.clip(edge / 2, 0, 1))
        h = theta.sum(1) / 2
        s = np.sin(theta)
        nxt, prv = [1, 2, 0], [2, 0, 1]
        cos = 2 * np.sin(h)[:, None] * np.sin(h[:, None] - theta) / (s[:, nxt] * s[:, prv]) - 1
        sin = np.sign(np.linalg.det(tri))[:, None] * np.sqrt(np.clip(1 - cos**2, 0, None))
        bad = (np.abs(sin) < 1e-10).any(1)
        with np.errstate(divide="ignore", invalid="ignore"):
            w = (theta - cos[:, nxt] * theta[:, prv] - cos[:, prv] * theta[:, nxt]) / (d[triangles] * s[:, nxt] * sin[:, prv])
        w[bad] = 0
        for k in range(3):
            np.add.at(row, triangles[:, k], w[:, k])
        row /= row.sum()
    return out
