"""Writes the golden GLB file of this folder with trimesh.

    python -m venv env && env/bin/pip install trimesh==5.2.0
    env/bin/python make.py
"""

import pathlib

import numpy as np
import trimesh

POINTS = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1], [0, 3, 0]], dtype=float)
TRIANGLES = np.array([[1, 0, 4], [2, 1, 4], [3, 2, 4], [0, 3, 4], [0, 1, 2], [0, 2, 3]])

if __name__ == "__main__":
    mesh = trimesh.Trimesh(POINTS, TRIANGLES, process=False)
    scene = trimesh.Scene()
    scene.add_geometry(mesh, node_name="pyramid", geom_name="pyramid")
    (pathlib.Path(__file__).parent / "trimesh.glb").write_bytes(trimesh.exchange.gltf.export_glb(scene))
