"""Draws adults whose stature, weight, chest, waist and hip girths follow ANSUR II jointly, and solves their sliders."""

from dataclasses import dataclass

import numpy as np

from . import sliders as sl
from .measure import NAMES

RACES = ("african", "asian", "caucasian")
LOCAL_SPREAD = 0.12  # of every local slider; 0.22 gives exaggerated bodies
WIDE_SCALE = 2.0  # how much wider than ANSUR II the second stratum spreads along the two strongest axes of its logarithms
WIDE_BMI = (15.5, 45.0)
# Solved sliders: name, spread of its prior, bounds. The first four are macro sliders, the others local ones.
SOLVED = (
    ("height", 0.30, 0.0, 1.0), ("weight", 0.35, 0.0, 1.15), ("soft", 0.40, 0.0, 1.0), ("strong", 0.20, 0.0, 0.8),
    ("torso/measure-bust-circ-decr-incr", 0.30, -0.8, 0.8), ("torso/measure-waist-circ-decr-incr", 0.30, -0.8, 0.8),
    ("torso/measure-hips-circ-decr-incr", 0.30, -0.8, 0.8), ("torso/torso-scale-depth-decr-incr", 0.20, -0.8, 0.8),
    ("torso/torso-scale-horiz-decr-incr", 0.20, -0.8, 0.8), ("hip/hip-scale-depth-decr-incr", 0.20, -0.8, 0.8),
    ("hip/hip-scale-horiz-decr-incr", 0.20, -0.8, 0.8), ("stomach/stomach-tone-decr-incr", 0.25, -0.8, 0.8),
    ("buttocks/buttocks-volume-decr-incr", 0.25, -0.8, 0.8),
)
SOFT_STRONG = (2, 3)  # their places in SOLVED
TOLERANCE = np.array([0.001, 0.006, 0.005, 0.006, 0.005])  # of the logarithm of each measure
MAX_STEP = 0.35  # of a slider's change in a step
REFRESH = 1  # after this step the Jacobian is measured anew; else it is updated
CHUNK = 100


@dataclass
class People:
    """Slider values and goals of a set of people (rows)."""

    macro: dict
    race: np.ndarray
    local: np.ndarray
    goal: np.ndarray  # logarithms of the five measures
    wide: np.ndarray  # True in the wide stratum


def draw(rng, count, wide_share, moments, local_names, spread=LOCAL_SPREAD):
    """Random people: sex alternates, ages 18 to 80, goals from ANSUR II's log-normal, wider in the wide stratum."""
    male = np.arange(count) % 2 == 0
    wide = rng.random(count) < wide_share
    goal = np.array([draw_goal(rng, moments["male" if m else "female"], w) for m, w in zip(male, wide)])
    mixed = rng.uniform(0, 0.15, count)
    clip = lambda x: np.clip(x, 0.0, 1.0)
    macro = {
        "gender": np.where(male, 1 - mixed, mixed),
        "age": sl.age_from_years(rng.uniform(18, 80, count)),
        "soft": clip(rng.normal(0.4, 0.12, count)),
        "strong": clip(np.where(male, 0.35, 0.2) + rng.normal(0, 0.12, count)),
        "weight": clip(rng.normal(0.65, 0.1, count)),
        "height": np.full(count, 0.5),
        "proportions": clip(rng.normal(0.5, 0.15, count)),
        "cup": clip(rng.normal(0.5, 0.17, count)),
        "firm": clip(rng.normal(0.5, 0.17, count)),
    }
    race = rng.dirichlet([0.7] * 3, count)
    local = np.clip(rng.normal(0, spread, (count, len(local_names))), -0.5, 0.5)
    for i, n in enumerate(local_names):
        if n.startswith("head/head-") and not n.endswith(("decr-incr", "down-up", "in-out", "backward-forward")):
            local[:, i] = np.abs(local[:, i])
    return People(macro, race, local, goal, wide)


def draw_goal(rng, m, wide):
    """One person's logarithms of the five measures."""
    mean, cov = np.array(m["log_mean"]), np.array(m["log_covariance"])
    values, axes = np.linalg.eigh(cov)  # the last two: fatness and stature
    axes *= np.sign(axes[np.abs(axes).argmax(0), np.arange(len(mean))])
    scale = np.array([1.0, 1.0, 1.0, WIDE_SCALE, WIDE_SCALE]) if wide else 1.0
    while True:
        x = mean + axes @ (scale * np.sqrt(values) * rng.normal(size=len(mean)))
        bmi = np.exp(x[1] - 2 * x[0])
        if not wide or WIDE_BMI[0] < bmi < WIDE_BMI[1]:
            return x


class Shapes:
    """Bodies and joints from sliders, in chunks, in double precision."""

    def __init__(self, base, sliders, selector):
        n = 13380
        self.sliders = sliders
        self.body = base.targets[:, : 3 * n].toarray()
        targets = base.targets.toarray().reshape(len(base.names), -1, 3)
        self.joints = np.einsum("jv,tvc->tjc", selector, targets).reshape(len(base.names), -1)
        self.body0, self.joints0 = base.vertices[:n].ravel(), (selector @ base.vertices).ravel()

    def weights(self, people, rows):
        """Target weights (rows x targets)."""
        out = []
        for i in rows:
            macro = {k: v[i] for k, v in people.macro.items()}
            out.append(self.sliders.weights(macro, dict(zip(RACES, people.race[i])), people.local[i]))
        return np.array(out)

    def bodies(self, people, rows):
        """Vertices (rows x 13380 x 3) and joints (rows x 52 x 3) in the rest pose."""
        w = self.weights(people, rows)
        return (self.body0 + w @ self.body).reshape(len(rows), -1, 3), (self.joints0 + w @ self.joints).reshape(len(rows), -1, 3)


def solve(shapes, tape, people, steps=6, log=print):
    """Moves the solved sliders to the most likely values that meet each person's goal (Gauss-Newton, Broyden updates)."""
    x0 = get_solved(shapes.sliders, people)
    x = x0.copy()
    f = measure_all(shapes, tape, people)
    jacobian = differences(shapes, tape, people, x, f)
    for step in range(steps):
        new = np.array([gauss_newton(x[i], x0[i], f[i], people.goal[i], jacobian[i]) for i in range(len(x))])
        put_solved(shapes.sliders, people, new)
        g = measure_all(shapes, tape, people)
        rms = np.sqrt(((g - people.goal) ** 2).mean(0)) * 100
        log(f"  step {step}: rms miss in % " + ", ".join(f"{n} {v:.2f}" for n, v in zip(NAMES, rms)))
        s = new - x
        if step == REFRESH:
            jacobian = differences(shapes, tape, people, new, g)
            x, f = new, g
            continue
        miss = (g - f) - np.einsum("imk,ik->im", jacobian, s)
        jacobian += miss[:, :, None] * s[:, None, :] / ((s * s).sum(1) + 1e-6)[:, None, None]
        x, f = new, g
    return f


def gauss_newton(x, x0, f, goal, jacobian):
    """One step of one person; sliders that would leave their range are held at its end and the others solved again."""
    prior, low, high = (np.array([s[k] for s in SOLVED]) for k in (1, 2, 3))
    a, r = jacobian / TOLERANCE[:, None], (goal - f) / TOLERANCE
    free, step = np.ones(len(x), bool), np.zeros(len(x))
    for _ in range(len(x)):
        held = a[:, ~free] @ step[~free]
        h = a[:, free].T @ a[:, free] + np.diag(prior[free] ** -2)
        step[free] = np.linalg.solve(h, a[:, free].T @ (r - held) + ((x0 - x) / prior**2)[free])
        out = free & ((x + step < low) | (x + step > high))
        if not out.any():
            break
        step[out] = (np.clip(x + step, low, high) - x)[out]
        free &= ~out
    return np.clip(x + np.clip(step, -MAX_STEP, MAX_STEP), low, high)


def get_solved(sliders, people):
    """Current values of the solved sliders (people x solved)."""
    return np.stack([people.macro[n] if n in people.macro else people.local[:, sliders.local_names.index(n)] for n, *_ in SOLVED], 1)


def put_solved(sliders, people, x):
    """Writes values of the solved sliders; soft and strong share 1 at most."""
    soft, strong = SOFT_STRONG
    over = np.maximum(x[:, soft] + x[:, strong], 1.0)
    x[:, soft] /= over
    x[:, strong] /= over
    for k, (n, *_) in enumerate(SOLVED):
        if n in people.macro:
            people.macro[n] = x[:, k].copy()
        else:
            people.local[:, sliders.local_names.index(n)] = x[:, k]


def measure_all(shapes, tape, people):
    """Logarithms of the measures of everyone."""
    out = []
    for start in range(0, len(people.goal), CHUNK):
        rows = range(start, min(start + CHUNK, len(people.goal)))
        out += [np.log(tape.measure(v)) for v in shapes.bodies(people, rows)[0]]
    return np.array(out)


def differences(shapes, tape, people, x, f):
    """Jacobian of the log measures by differences towards the middle of each slider's range."""
    out = np.zeros((*f.shape, x.shape[1]))
    for k, (_, _, low, high) in enumerate(SOLVED):
        step = np.where(x[:, k] > 0.5 * (low + high), -0.1, 0.1)
        moved = x.copy()
        moved[:, k] += step
        put_solved(shapes.sliders, people, moved)
        out[:, :, k] = (measure_all(shapes, tape, people) - f) / step[:, None]
    put_solved(shapes.sliders, people, x)
    return out
