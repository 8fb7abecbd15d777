"""MakeHuman's default rig collapsed to the 52 joints of a VRM 1.0 humanoid: joint positions, weights, the A-pose."""

import numpy as np

INFLUENCES = 4
ARM_DOWN = np.radians(45.0)  # of the straight arm, from the horizontal
LEG_OUT = np.radians(7.0)  # of the straight leg, from the vertical

# VRM joint, its parent, the rig bone whose head is the joint. Sides are written as {s}/{S}.
TRUNK = [("hips", None, "spine05"), ("spine", "hips", "spine04"), ("chest", "spine", "spine02"), ("upperChest", "chest", "spine01"),
         ("neck", "upperChest", "neck01"), ("head", "neck", "head")]
LIMBS = [("Shoulder", "upperChest", "clavicle"), ("UpperArm", "Shoulder", "upperarm01"), ("LowerArm", "UpperArm", "lowerarm01"),
         ("Hand", "LowerArm", "wrist"), ("UpperLeg", "hips", "upperleg01"), ("LowerLeg", "UpperLeg", "lowerleg01"),
         ("Foot", "LowerLeg", "foot"), ("Toes", "Foot", "toe2-1")]
FINGERS = [("Thumb", ("Metacarpal", "Proximal", "Distal")), ("Index", ("Proximal", "Intermediate", "Distal")),
           ("Middle", ("Proximal", "Intermediate", "Distal")), ("Ring", ("Proximal", "Intermediate", "Distal")),
           ("Little", ("Proximal", "Intermediate", "Distal"))]


def joint_table():
    """List of (VRM name, parent index or -1, rig bone), parents before children."""
    rows = list(TRUNK)
    for side, suffix in (("left", ".L"), ("right", ".R")):
        for name, parent, bone in LIMBS:
            rows.append((side + name, parent if parent[0].islower() else side + parent, bone + suffix))
    for side, suffix in (("left", ".L"), ("right", ".R")):
        for number, (finger, parts) in enumerate(FINGERS, 1):
            parent = side + "Hand"
            for k, part in enumerate(parts, 1):
                rows.append((side + finger + part, parent, f"finger{number}-{k}{suffix}"))
                parent = side + finger + part
    index = {r[0]: i for i, r in enumerate(rows)}
    return [(n, -1 if p is None else index[p], b) for n, p, b in rows]


def head_selector(base, table):
    """Matrix (joints x base vertices) that gives each joint as a mean of base vertices."""
    out = np.zeros((len(table), len(base.vertices)))
    for row, (_, _, bone) in zip(out, table):
        head = base.rig[bone]["head"]
        if head["strategy"] == "CUBE":
            index = base.groups[head["cube_name"]]
        elif head["strategy"] == "VERTEX":
            index = [head["vertex_index"]]
        else:
            index = head["vertex_indices"]
        row[index] = 1.0 / len(index)
    return out


def collapse_weights(base, table, count):
    """Dense weights (count x joints): each rig bone goes to its nearest ancestor that is a joint; toes to the toes."""
    joint_of = {bone: i for i, (_, _, bone) in enumerate(table)}
    dense = np.zeros((count, len(table)))
    for bone, pairs in base.rig_weights.items():
        name = "toe2-1" + bone[-2:] if bone.startswith("toe") else bone
        while name not in joint_of:
            name = base.rig[name]["parent"] or "spine05"
        for vertex, weight in pairs:
            if vertex < count:
                dense[vertex, joint_of[name]] += weight
    return dense / dense.sum(1, keepdims=True)


def cut_weights(dense):
    """The four greatest weights a vertex, as (indices, weights) with the weights in 1/65535 that sum to 65535 exactly."""
    order = np.argsort(-dense, axis=1, kind="stable")[:, :INFLUENCES]
    kept = np.take_along_axis(dense, order, 1)
    lost = 1.0 - kept.sum(1).mean()
    kept /= kept.sum(1, keepdims=True)
    units = np.floor(kept * 65535 + 0.5).astype(int)
    units[:, 0] += 65535 - units.sum(1)
    order = np.where(units > 0, order, 0)
    return order, units, lost


def rotation_between(a, b):
    """The smallest rotation that takes direction a to direction b (3 x 3)."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    v, c = np.cross(a, b), a @ b
    k = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + k + k @ k / (1 + c)


def a_pose_rotations(joints, table):
    """World rotations (joints x 3 x 3) that straighten arms and legs of the rest pose into the A-pose; feet stay level."""
    index = {n: i for i, (n, _, _) in enumerate(table)}
    out = np.zeros((len(table), 3, 3))
    for i, (name, parent, _) in enumerate(table):
        out[i] = np.eye(3) if parent < 0 else out[parent]
        side = 1.0 if name.startswith("left") else -1.0
        arm = np.array([side * np.cos(ARM_DOWN), -np.sin(ARM_DOWN), 0.0])
        leg = np.array([side * np.sin(LEG_OUT), -np.cos(LEG_OUT), 0.0])
        goals = {"UpperArm": ("LowerArm", arm), "LowerArm": ("Hand", arm), "UpperLeg": ("LowerLeg", leg), "LowerLeg": ("Foot", leg)}
        for part, (child, goal) in goals.items():
            if name.endswith(part):
                bone = joints[index[name[: -len(part)] + child]] - joints[i]
                out[i] = rotation_between(out[parent] @ bone, goal) @ out[parent]
        if name.endswith("Foot"):
            out[i] = np.eye(3)
    return out


def pose(vertices, joints, rotations, table, order, weights):
    """Linear blend skinning (seed eq. 3) with world rotations. Returns posed vertices and joints."""
    posed = joints.copy()
    for i, (_, parent, _) in enumerate(table):
        if parent >= 0:
            posed[i] = posed[parent] + rotations[parent] @ (joints[i] - joints[parent])
    shift = posed - np.einsum("jab,jb->ja", rotations, joints)
    out = np.zeros_like(vertices)
    for k in range(order.shape[1]):
        j = order[:, k]
        out += weights[:, k, None] * (np.einsum("vab,vb->va", rotations[j], vertices) + shift[j])
    return out, posed


def to_a_pose(vertices, joints, table, order, weights):
    """A sample in the A-pose: soles on y = 0, hips over the origin in x and z."""
    v, j = pose(vertices, joints, a_pose_rotations(joints, table), table, order, weights)
    shift = np.array([j[0, 0], v[:, 1].min(), j[0, 2]])
    return v - shift, j - shift
