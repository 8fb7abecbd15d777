"""Facts of the template's surface: areas, closedness, which vertices no scanner sees, regions, landmarks."""

import numpy as np

REGIONS = ("torso", "leftArm", "rightArm", "leftLeg", "rightLeg", "leftHand", "rightHand", "leftFoot", "rightFoot", "head")
PIXEL = 0.0015  # metres, of the depth maps that find hidden vertices
SLACK = 0.0025  # metres that a vertex may lie behind the nearest surface and still count as seen


def vertex_areas(v, triangles):
    """A third of the area of the triangles around each vertex."""
    a = 0.5 * np.linalg.norm(np.cross(v[triangles[:, 1]] - v[triangles[:, 0]], v[triangles[:, 2]] - v[triangles[:, 0]]), axis=1)
    out = np.zeros(len(v))
    for k in range(3):
        np.add.at(out, triangles[:, k], a / 3)
    return out


def vertex_normals(v, triangles):
    """Area-weighted unit normals."""
    face = np.cross(v[triangles[:, 1]] - v[triangles[:, 0]], v[triangles[:, 2]] - v[triangles[:, 0]])
    out = np.zeros_like(v)
    for k in range(3):
        np.add.at(out, triangles[:, k], face)
    return out / np.linalg.norm(out, axis=1, keepdims=True)


def is_closed(triangles):
    """True when every edge has exactly two triangles that run along it in opposite directions."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    there = {tuple(e) for e in edges}
    return len(there) == len(edges) and all((b, a) in there for a, b in there)


def regions(table, dense):
    """Region of each vertex by the joint that moves it most."""
    def of(name):
        side = "left" if name.startswith("left") else "right"
        if name in ("neck", "head"):
            return "head" if name == "head" else "torso"
        for part, region in (("UpperArm", "Arm"), ("LowerArm", "Arm"), ("UpperLeg", "Leg"), ("LowerLeg", "Leg"),
                             ("Foot", "Foot"), ("Toes", "Foot"), ("Shoulder", None)):
            if name.endswith(part):
                return side + region if region else "torso"
        return side + "Hand" if name.startswith(("left", "right")) else "torso"
    code = np.array([REGIONS.index(of(n)) for n, _, _ in table])
    return code[np.argmax(dense, 1)]


def hidden(v, triangles, eyes_v, eyes_t, among):
    """True for the vertices `among` (mask) that are seen from no direction, with eyeballs in their sockets.

    Depth maps of densely sampled surfaces stand in for rays; a vertex is only seen from its outer side. Views from below
    are left out: there the trunk is in the way.
    """
    normal = vertex_normals(v, triangles)
    index = np.flatnonzero(among)
    near = v[triangles][:, :, 1].min(1) > v[index, 1].min() - 0.05
    points = sample(np.concatenate([v[triangles[near]], eyes_v[eyes_t]]), 0.5 * PIXEL)
    seen = np.zeros(len(index), bool)
    for d in fibonacci(96):
        if d[1] < -0.5:
            continue
        u = np.cross(d, [0.0, 1.0, 0.0] if abs(d[1]) < 0.9 else [1.0, 0.0, 0.0])
        u /= np.linalg.norm(u)
        frame = np.stack([u, np.cross(d, u)])
        p, q = np.floor(points @ frame.T / PIXEL).astype(int), np.floor(v[index] @ frame.T / PIXEL).astype(int)
        low = np.minimum(p.min(0), q.min(0))
        size = np.maximum(p.max(0), q.max(0)) - low + 1
        depth = np.full(size[0] * size[1], -np.inf)
        np.maximum.at(depth, (p - low) @ [size[1], 1], points @ d)
        seen |= (v[index] @ d >= depth[(q - low) @ [size[1], 1]] - SLACK) & (normal[index] @ d > 0)
    out = np.zeros(len(v), bool)
    out[index[~seen]] = True
    return out


def sample(tri, spacing):
    """Points on triangles (count x 3 x 3), no farther apart than `spacing`."""
    longest = np.linalg.norm(tri - np.roll(tri, 1, axis=1), axis=2).max(1)
    steps = np.ceil(longest / spacing).astype(int)
    out = []
    for n in np.unique(steps):
        grid = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]) / n
        out.append(np.einsum("gk,tkc->tgc", grid, tri[steps == n]).reshape(-1, 3))
    return np.concatenate(out)


def fibonacci(count):
    """Directions spread evenly over the sphere."""
    k = np.arange(count) + 0.5
    y, a = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    r = np.sqrt(1 - y * y)
    return np.stack([r * np.cos(a), y, r * np.sin(a)], 1)


def close_mask(mask, triangles, rounds):
    """Removes specks: a vertex keeps the majority of its neighbours' mask for some rounds."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    count = np.bincount(edges[:, 0], minlength=len(mask))
    for _ in range(rounds):
        votes = np.bincount(edges[:, 0], weights=mask[edges[:, 1]], minlength=len(mask))
        mask = votes * 2 > count
    return mask


def landmarks(v, joints, table, region, inner, nipples, navel):
    """Landmark name -> vertex of the mean body in the A-pose, found by its geometry."""
    j = {n: p for (n, _, _), p in zip(table, joints)}
    code = {n: i for i, n in enumerate(REGIONS)}
    skin = ~inner
    middle = skin & (np.abs(v[:, 0]) < 0.004)
    pick = lambda mask, score: int(np.flatnonzero(mask)[np.argmax(score[mask])])
    near = lambda mask, p: pick(mask, -np.linalg.norm(v - p, axis=1))
    x, y, z = v.T
    torso, head = region == code["torso"], region == code["head"]
    out = {"vertex": pick(head & middle, y), "noseTip": pick(head & middle, z), "navel": int(navel)}
    nose = v[out["noseTip"]]
    jaw = head & middle & (y < nose[1] - 0.05) & (z > nose[2] - 0.05)
    out["chin"] = pick(jaw, -y)
    out["glabella"] = pick(head & middle & (y > nose[1] + 0.03) & (y < nose[1] + 0.065), z)
    out["occiput"] = pick(head & middle & (y > nose[1] - 0.03), -z)
    out["crotch"] = pick(torso & middle & (y < j["hips"][1]), -y)
    out["cervicale"] = near(middle & (z < j["neck"][2]), j["neck"] + [0, 0.0, -0.08])
    out["suprasternale"] = near(middle & (z > j["neck"][2]), (j["leftShoulder"] + j["rightShoulder"]) / 2 + [0, 0.01, 0.05])
    out["sacrum"] = near(middle & torso & (z < j["hips"][2]), j["hips"] + [0, 0.03, -0.12])
    for side, s in (("left", 1.0), ("right", -1.0)):
        side_landmarks(out, side, s, v, j, code, region, skin, pick, near)
    out["leftNipple"], out["rightNipple"] = (int(i) for i in nipples)
    return dict(sorted(out.items()))


def side_landmarks(out, side, s, v, j, code, region, skin, pick, near):
    """Landmarks that come in pairs; `s` is +1 on the left."""
    x, y, z = v.T
    of = lambda name: skin & (region == code[side + name])
    foot, arm, leg = of("Foot"), of("Arm"), of("Leg")
    upper = skin & ((region == code["torso"]) | arm)
    down = j[side + "LowerArm"] - j[side + "UpperArm"]
    down /= np.linalg.norm(down)
    across = np.array([s * -down[1], s * down[0], 0.0])  # away from the trunk and up, in the frontal plane
    across *= np.sign(across[1])
    out[side + "Acromion"] = near(upper, j[side + "UpperArm"] + [0.0, 0.06, 0.0])
    out[side + "Heel"] = pick(foot, -z)
    out[side + "ToeTip"] = pick(foot, z)
    out[side + "Axilla"] = near(upper, j[side + "UpperArm"] - 0.07 * across + 0.05 * down)
    out[side + "WristOuter"] = near(arm | of("Hand"), j[side + "Hand"] + 0.035 * across)
    out[side + "WristInner"] = near(arm | of("Hand"), j[side + "Hand"] - 0.035 * across)
    out[side + "WristFront"] = near(arm | of("Hand"), j[side + "Hand"] + [0, 0, 0.035])
    out[side + "WristBack"] = near(arm | of("Hand"), j[side + "Hand"] - [0, 0, 0.035])
    out[side + "Elbow"] = near(arm, j[side + "LowerArm"] - [0, 0, 0.06])
    out[side + "KneeFront"] = near(leg, j[side + "LowerLeg"] + [0, 0, 0.08])
    out[side + "KneeBack"] = near(leg, j[side + "LowerLeg"] - [0, 0, 0.08])
    out[side + "AnkleOuter"] = near(leg | foot, j[side + "Foot"] + [s * 0.05, 0, 0])
    out[side + "AnkleInner"] = near(leg | foot, j[side + "Foot"] - [s * 0.05, 0, 0])
    out[side + "Trochanter"] = near(skin & ((region == code["torso"]) | leg), j[side + "UpperLeg"] + [s * 0.1, 0, 0])
    out[side + "MiddleFingerTip"] = pick(of("Hand"), (v - j[side + "Hand"]) @ down)
    tip = j[side + "ThumbDistal"] + 1.2 * (j[side + "ThumbDistal"] - j[side + "ThumbProximal"])
    out[side + "ThumbTip"] = near(of("Hand"), tip)
    head = skin & (region == code["head"])
    out[side + "Tragion"] = pick(head & (np.abs(y - v[out["noseTip"], 1]) < 0.03), s * x)
    back = skin & ((region == code["torso"]) | leg) & (s * x > 0.03) & (y < j["hips"][1] + 0.05) & (y > j["hips"][1] - 0.15)
    out[side + "Buttock"] = pick(back, -z)
