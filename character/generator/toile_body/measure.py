"""Stature, volume and the three main girths of bodies in the rest pose, measured as ANSUR II measures them."""

import numpy as np

NAMES = ("stature", "weight", "chest", "waist", "hip")  # metres, kilograms
DENSITY = 1000.0  # kg/m3, of a person with air in the lungs
ANGLE = np.linspace(0, 2 * np.pi, 72, endpoint=False)
DIRECTIONS = np.stack([np.cos(ANGLE), np.sin(ANGLE)])


class Tape:
    """Edges of the trunk and the vertices whose heights say where to measure."""

    def __init__(self, triangles, trunk, thigh, nipples, navel, buttocks):
        edges = np.unique(np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), 1), axis=0)
        self.triangles = triangles
        self.trunk = edges[trunk[edges].all(1)]
        self.hips = edges[(trunk | thigh)[edges].all(1)]
        self.nipples, self.navel, self.buttocks = nipples, navel, buttocks

    def measure(self, v):
        """(stature, weight, chest, waist, hip) of one body (vertices x 3)."""
        buttock = v[self.buttocks[np.argmin(v[self.buttocks, 2])], 1]
        return np.array([
            np.ptp(v[:, 1]),
            DENSITY * volume(v, self.triangles),
            girth(v, self.trunk, v[self.nipples, 1].mean()),
            girth(v, self.trunk, v[self.navel, 1]),
            girth(v, self.hips, buttock),
        ])


def volume(v, triangles):
    """Volume of a closed mesh by the divergence theorem."""
    a, b, c = v[triangles[:, 0]], v[triangles[:, 1]], v[triangles[:, 2]]
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0


def girth(v, edges, y):
    """Perimeter of the convex hull of the section at height y, as the mean width times pi (Cauchy)."""
    a, b = v[edges[:, 0]], v[edges[:, 1]]
    cut = (a[:, 1] > y) != (b[:, 1] > y)
    a, b = a[cut], b[cut]
    t = ((y - a[:, 1]) / (b[:, 1] - a[:, 1]))[:, None]
    p = (a + t * (b - a))[:, [0, 2]]
    step = ANGLE[1]
    # Support function sampled at 72 angles; the exact mean over each step of a piecewise cosine is within 0.03 %.
    return float((p @ DIRECTIONS).max(0).sum() * step)
