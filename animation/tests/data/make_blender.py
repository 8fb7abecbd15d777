"""Reads `bvhio.bvh` into Blender, writes `blender.bvh`, and says where Blender puts the joints.

    python -m venv env && env/bin/pip install bpy==5.0.1
    env/bin/python make_blender.py
"""

import pathlib

import bpy

HERE = pathlib.Path(__file__).parent


def main():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = 25
    bpy.ops.import_anim.bvh(filepath=str(HERE / "bvhio.bvh"), axis_forward="-Z", axis_up="Y", rotate_mode="NATIVE")
    rig = bpy.context.object
    bpy.ops.export_anim.bvh(
        filepath=str(HERE / "blender.bvh"), frame_start=1, frame_end=5, rotate_mode="YXZ", root_transform_only=False
    )
    lines = []
    for frame in range(5):
        bpy.context.scene.frame_set(frame + 1)
        for bone in rig.pose.bones:
            place = (rig.matrix_world @ bone.matrix).translation
            lines.append(f"{frame} {bone.name} " + " ".join(f"{x:.4f}" for x in place))
    (HERE / "blender_positions.txt").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
