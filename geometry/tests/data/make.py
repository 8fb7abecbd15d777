"""Writes the golden meshes of this folder with other people's programs.

    python -m venv env && env/bin/pip install trimesh==5.2.0 scipy meshio==5.3.5 plyfile==1.1.5 pymeshlab==2025.7.post1
    env/bin/python make.py
"""

import pathlib

import meshio
import numpy as np
import plyfile
import pymeshlab
import trimesh

HERE = pathlib.Path(__file__).parent
# A square pyramid, 2 m wide and 3 m high: five vertices, four triangles and a square base.
POINTS = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1], [0, 3, 0]], dtype=float)
SIDES = np.array([[1, 0, 4], [2, 1, 4], [3, 2, 4], [0, 3, 4]])
BASE = np.array([[0, 1, 2, 3]])
COLORS = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 0], [12, 34, 56]], dtype=np.uint8)
TRIANGLES = np.vstack([SIDES, [[0, 1, 2], [0, 2, 3]]])


def with_trimesh():
    mesh = trimesh.Trimesh(POINTS, TRIANGLES, vertex_colors=COLORS, process=False)
    for name, encoding in [("trimesh_binary.ply", "binary"), ("trimesh_ascii.ply", "ascii")]:
        (HERE / name).write_bytes(trimesh.exchange.ply.export_ply(mesh, encoding=encoding, vertex_normal=True))
    (HERE / "trimesh.obj").write_text(trimesh.exchange.obj.export_obj(mesh))


def with_meshio():
    mesh = meshio.Mesh(POINTS, [("triangle", SIDES), ("quad", BASE)], point_data={"quality": np.arange(5.0)})
    meshio.write(HERE / "meshio_ascii.ply", mesh, binary=False)
    meshio.write(HERE / "meshio_binary.ply", mesh, binary=True)
    meshio.write(HERE / "meshio.obj", mesh)


def with_plyfile():
    kinds = [(n, "f8") for n in "xyz"] + [(n, "u1") for n in ("red", "green", "blue")]
    vertices = np.array([tuple(p) + tuple(c) for p, c in zip(POINTS, COLORS)], dtype=kinds)
    faces = np.array([(t, 7) for t in TRIANGLES.astype("u4")], dtype=[("vertex_indices", "u4", (3,)), ("group", "i2")])
    elements = [plyfile.PlyElement.describe(faces, "face"), plyfile.PlyElement.describe(vertices, "vertex")]
    plyfile.PlyData(elements, byte_order=">", comments=["faces first, big endian"]).write(HERE / "plyfile_big_endian.ply")


def with_meshlab():
    colors = np.hstack([COLORS / 255.0, np.ones((5, 1))])
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(POINTS, TRIANGLES, v_color_matrix=colors))
    meshes.save_current_mesh(str(HERE / "meshlab.ply"), binary=True, save_vertex_quality=True)
    meshes.save_current_mesh(str(HERE / "meshlab.obj"))


if __name__ == "__main__":
    with_trimesh()
    with_meshio()
    with_plyfile()
    with_meshlab()
