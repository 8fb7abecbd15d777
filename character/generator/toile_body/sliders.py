"""Slider values -> weights of the morph targets, the way MakeHuman's macro.json combines them."""

import re

import numpy as np

# Pieces of a macro slider: value -> {name: share}. Ages: 0.1875 is a child, 0.5 a 25-year-old, 1.0 a 90-year-old.
LOCAL_FOLDERS = (
    "arms", "breast", "buttocks", "cheek", "chin", "ears", "eyebrows", "eyes", "feet", "forehead", "hands", "head",
    "hip", "legs", "mouth", "neck", "nose", "pelvis", "stomach", "torso",
)
PAIRS = (("decr", "incr"), ("down", "up"), ("in", "out"), ("backward", "forward"), ("concave", "convex"),
         ("compress", "uncompress"), ("square", "round"), ("pointed", "triangle"))
NOT_HUMAN = re.compile(r"pregnant|ear-shape-pointed|ear-wing|nubian")


def split(value, low, middle, high):
    """Shares of three names along a slider 0..1 with its middle at 0.5; beyond 1 it goes on straight."""
    v = float(max(value, 0.0))
    if v < 0.5:
        return {low: 1 - 2 * v, middle: 2 * v}
    return {middle: 2 - 2 * v, high: 2 * v - 1}


def age_shares(value):
    """Shares of child, young and old."""
    v = float(np.clip(value, 0.1875, 1.0))
    if v < 0.5:
        young = (v - 0.1875) / 0.3125
        return {"child": 1 - young, "young": young}
    return {"young": 2 - 2 * v, "old": 2 * v - 1}


def age_from_years(years):
    """Slider of an adult's age: 18 years -> 0.43, 25 -> 0.5, 90 -> 1 (a straight child-to-25 scale would make 18 a child)."""
    return np.where(years < 25, 0.43 + (years - 18) * 0.01, 0.5 + (years - 25) / 130.0)


class Sliders:
    """Names of the macro and local sliders and the map to target weights."""

    def __init__(self, names):
        self.index = {n: i for i, n in enumerate(names)}
        self.local = local_sliders(names)
        self.local_names = sorted(self.local)

    def weights(self, macro, race, local):
        """Dense weights of all targets. `macro`: dict, `race`: dict of shares that sum to 1, `local`: array over local_names."""
        out = np.zeros(len(self.index))
        self.add_macro(out, macro, race)
        for name, value in zip(self.local_names, local):
            minus, plus = self.local[name]
            for i in plus if value > 0 else minus:
                out[i] += abs(value)
        return out

    def add_macro(self, out, m, race):
        """MakeHuman's muscle slider meets only two of its three shapes at a time, and none of its mixtures has the girths of an
        average soldier: `soft` and `strong` are the shares of the least and the most muscular shape, free of each other."""
        sex = {"male": m["gender"], "female": 1 - m["gender"]}
        age = age_shares(m["age"])
        muscle = {"minmuscle": m["soft"], "averagemuscle": 1 - m["soft"] - m["strong"], "maxmuscle": m["strong"]}
        weight = split(m["weight"], "minweight", "averageweight", "maxweight")
        height = split(m["height"], "minheight", None, "maxheight")
        proportions = split(m["proportions"], "uncommonproportions", None, "idealproportions")
        cup = split(m["cup"], "mincup", "averagecup", "maxcup")
        firm = split(m["firm"], "minfirmness", "averagefirmness", "maxfirmness")
        macro = "macrodetails/"
        self.product(out, macro, race, sex, age)
        self.product(out, macro + "universal-", sex, age, muscle, weight)
        self.product(out, macro + "height/", sex, age, muscle, weight, height)
        self.product(out, macro + "proportions/", sex, age, muscle, weight, proportions)
        self.product(out, "breast/", sex, age, muscle, weight, cup, firm)

    def product(self, out, prefix, *factors):
        """Adds the product of all factors' shares to the target named by their names; what has no target is the base itself."""
        stack = [(prefix, 1.0)]
        for f in factors:
            stack = [(p + ("" if p.endswith(("/", "-")) else "-") + n, s * w)
                     for p, s in stack for n, w in f.items() if n is not None and w != 0]
        for name, share in stack:
            i = self.index.get(name)
            if i is not None:
                out[i] += share


def local_sliders(names):
    """Slider name -> (targets of its minus side, of its plus side); left and right move together."""
    have = {}
    for i, n in enumerate(names):
        folder, _, stem = n.partition("/")
        if folder not in LOCAL_FOLDERS or NOT_HUMAN.search(stem) or stem.startswith(("female-", "male-")):
            continue
        stem = re.sub(r"^[lr]-", "", stem)
        have.setdefault(f"{folder}/{stem}", []).append(i)
    out = {}
    for n, plus in have.items():
        for a, b in PAIRS:
            if n.endswith("-" + b) and n[: -len(b)] + a in have:
                out[f"{n[:-len(b)]}{a}-{b}"] = (have[n[: -len(b)] + a], plus)
    for shape in ("oval", "round", "rectangular", "square", "triangular", "invertedtriangular", "diamond"):
        if f"head/head-{shape}" in have:
            out[f"head/head-{shape}"] = ([], have[f"head/head-{shape}"])
    return out
