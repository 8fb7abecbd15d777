"""Mean, components, joint regressor and their errors on held-out people."""

import numpy as np

from . import mean_value, surface

COMPONENTS = 50
INNER_WEIGHT = 0.05  # of vertices that no scanner sees, against skin of the same area


def build(bodies, joints, shares, held, template, triangles):
    """Mean and spreads come from the ANSUR stratum, each person by its share (balance.py; zero in the wide stratum); the span of the components from everyone but the held-out people.

    Vertices count by their area, so that the dense face and fingers do not use up the components.
    """
    train = ~held
    shares = np.where(held, 0.0, shares)
    shares /= shares.sum()
    mean, mean_joints = np.einsum("n,nvc->vc", shares, bodies), np.einsum("n,njc->jc", shares, joints)
    # The subject frame's origin: on the floor, between the feet of the mean.
    feet = [[n for n, _, _ in template["table"]].index(s + "Foot") for s in ("left", "right")]
    origin = np.array([0.0, 0.0, mean_joints[feet, 2].mean()])
    area = surface.vertex_areas(mean, triangles) * np.where(template["inner"], INNER_WEIGHT, 1.0)
    metric = np.sqrt(np.repeat(area / area.sum(), 3))
    x = (bodies - mean).reshape(len(bodies), -1)
    y = (joints - mean_joints).reshape(len(joints), -1)
    basis, sigma = components(x[train] * metric, (x * metric)[shares > 0], shares[shares > 0])
    columns = basis * sigma[:, None] / metric
    columns *= np.sign(columns[np.arange(COMPONENTS), np.abs(columns).argmax(1)])[:, None]
    scales = np.abs(columns).max(1) / 32767
    quantised = np.round(columns / scales[:, None]).astype(np.int16)
    columns = quantised * scales[:, None]
    beta = project(x, columns, metric)
    regressor = np.linalg.lstsq(beta[train], y[train], rcond=None)[0]
    skin = ~template["inner"]
    male = np.array([i % 2 == 0 for i in range(len(bodies))])
    report = errors(x, y, columns, metric, regressor, beta, held, skin, mean, mean_joints, triangles, area)
    report["quantisation_max_mm"] = float(scales.max() / 2 * 1e3 * 3)
    marks = surface.landmarks(mean, mean_joints, template["table"], template["region"], template["inner"], template["nipples"], template["navel"])
    return {"mean": mean - origin, "joints": mean_joints - origin, "scales": scales, "quantised": quantised, "sigma": sigma,
            "joint_components": regressor.reshape(COMPONENTS, -1, 3), "landmarks": marks, "report": report, "beta": beta,
            "beta_male": 2 * (shares * male) @ beta, "beta_female": 2 * (shares * ~male) @ beta}


def components(everyone, ansur, shares):
    """Orthonormal rows spanning the strongest directions of `everyone`, turned to the principal axes of `ansur`."""
    gram = everyone @ everyone.T
    values, vectors = np.linalg.eigh(gram)
    top = np.argsort(-values)[:COMPONENTS]
    span = (vectors[:, top] / np.sqrt(values[top])).T @ everyone
    coefficients = ansur @ span.T
    values, axes = np.linalg.eigh(coefficients.T @ (coefficients * shares[:, None]))
    turn = np.argsort(-values)
    return axes[:, turn].T @ span, np.sqrt(values[turn])


def project(x, columns, metric):
    """Least-squares coefficients under the area metric."""
    a = columns * metric
    return np.linalg.solve(a @ a.T, a @ (x * metric).T).T


def errors(x, y, columns, metric, regressor, beta, held, skin, mean, mean_joints, triangles, area):
    """Mean vertex and joint errors on the held-out people, millimetres."""
    out = {"held_out": int(held.sum())}
    body = slice(0, 22)
    length = lambda d: np.linalg.norm(d.reshape(len(d), -1, 3), axis=2) * 1e3
    for k in (15, 30, 50):
        b = project(x[held], columns[:k], metric)
        e = length(x[held] - b @ columns[:k])
        r = np.linalg.lstsq(beta[~held, :k], y[~held], rcond=None)[0]
        out[f"k{k}"] = {"vertex_mm": round(float(e[:, skin].mean()), 3), "surface_mm": round(float((e * area).sum(1).mean() / area.sum()), 3),
                        "body_joints_affine_mm": round(float(length(y[held] - b @ r)[:, body].mean()), 3)}
    mvc = mean_value.mean_value_weights(mean_joints, mean, triangles)
    e = length((x[held].reshape(held.sum(), -1, 3).transpose(0, 2, 1) @ mvc.T).transpose(0, 2, 1).reshape(held.sum(), -1) - y[held])
    a = length(y[held] - beta[held] @ regressor)
    out["joints_mvc_mm"] = {"body": round(float(e[:, body].mean()), 3), "fingers": round(float(e[:, 22:].mean()), 3)}
    out["joints_affine_mm"] = {"body": round(float(a[:, body].mean()), 3), "fingers": round(float(a[:, 22:].mean()), 3)}
    return out
