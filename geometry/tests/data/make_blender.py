"""Writes the pyramid of this folder with Blender.

    python -m venv env && env/bin/pip install bpy==5.0.1
    env/bin/python make_blender.py
"""

import pathlib

import bpy

HERE = pathlib.Path(__file__).parent
POINTS = [(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1), (0, 3, 0)]
FACES = [(1, 0, 4), (2, 1, 4), (3, 2, 4), (0, 3, 4), (0, 1, 2, 3)]


def main():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("pyramid")
    mesh.from_pydata(POINTS, [], FACES)
    pyramid = bpy.data.objects.new("pyramid", mesh)
    bpy.context.collection.objects.link(pyramid)
    pyramid.select_set(True)
    axes = {"forward_axis": "Y", "up_axis": "Z"}
    bpy.ops.wm.ply_export(filepath=str(HERE / "blender_ascii.ply"), ascii_format=True, export_normals=True, **axes)
    bpy.ops.wm.ply_export(filepath=str(HERE / "blender_binary.ply"), **axes)
    bpy.ops.wm.obj_export(filepath=str(HERE / "blender.obj"), export_materials=False, **axes)


if __name__ == "__main__":
    main()
