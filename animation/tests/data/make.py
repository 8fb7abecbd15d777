"""Writes the golden motions of this folder with other people's programs, and where those put the joints.

    python -m venv env && env/bin/pip install bvhio==1.5.4
    env/bin/python make.py
"""

import pathlib

import bvhio
import glm

HERE = pathlib.Path(__file__).parent
POSITION = ["Xposition", "Yposition", "Zposition"]
# name, parent, offset (centimetres), order of rotations
JOINTS = [
    ("Hips", None, (0, 90, 0), "ZXY"),
    ("Spine", "Hips", (0, 12, -1), "ZYX"),
    ("LeftArm", "Spine", (18, 30, 2), "XYZ"),
    ("LeftHand", "LeftArm", (25, 0, 0), "YZX"),
    ("RightLeg", "Hips", (-10, -4, 0), "XZY"),
]
FRAMES = 5


def angle(joint, axis, frame):
    """Degrees about an axis (0 to 2): different for every joint, axis and frame."""
    return (37 * joint + 23 * axis + 31 * frame * (axis + 1)) % 160 - 80


def rotation(joint, frame):
    turn = glm.quat()
    for letter in JOINTS[joint][3]:
        axis = "XYZ".index(letter)
        unit = glm.vec3(*[float(k == axis) for k in range(3)])
        turn = turn * glm.angleAxis(glm.radians(angle(joint, axis, frame)), unit)
    return turn


def container():
    made = {}
    for index, (name, parent, offset, order) in enumerate(JOINTS):
        joint = bvhio.BvhJoint(name, glm.vec3(*offset))
        joint.EndSite = glm.vec3(0, 10, 0)
        joint.Channels = (POSITION if parent is None else []) + [f"{letter}rotation" for letter in order]
        for frame in range(FRAMES):
            place = glm.vec3(offset[0] + 2 * frame, offset[1], offset[2] + 5 * frame)
            joint.Keyframes.append(bvhio.Pose(place, rotation(index, frame)))
        made[name] = joint
        if parent:
            made[parent].Children.append(joint)
    return bvhio.BvhContainer(made["Hips"], FRAMES, 1 / 25)


def main():
    path = HERE / "bvhio.bvh"
    bvhio.writeBvh(str(path), container())
    root = bvhio.readAsHierarchy(str(path))
    lines = []
    for frame in range(FRAMES):
        root.loadPose(frame)
        for joint, _, _ in root.layout():
            lines.append(f"{frame} {joint.Name} " + " ".join(f"{x:.4f}" for x in joint.PositionWorld))
    (HERE / "bvhio_positions.txt").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
