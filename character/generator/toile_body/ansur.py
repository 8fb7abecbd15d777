"""Means and covariances of ANSUR II (US Government work) for the five measures, per sex; no rows are kept.

    python -m toile_body.ansur ansur2_male.csv ansur2_female.csv > ansur2_moments.json
"""

import csv
import json
import sys

import numpy as np

COLUMNS = ("stature", "weightkg", "chestcircumference", "waistcircumference", "buttockcircumference")
UNITS = np.array([1e-3, 0.1, 1e-3, 1e-3, 1e-3])  # millimetres, and weight in 0.1 kg


def moments(path):
    """Mean and covariance of the measures (metres, kg) and of their natural logarithms."""
    with open(path, encoding="latin-1", newline="") as f:
        rows = np.array([[float(r[c]) for c in COLUMNS] for r in csv.DictReader(f)]) * UNITS
    logs = np.log(rows)
    cut = lambda x: np.round(x, 9).tolist()
    return {"people": len(rows), "mean": cut(rows.mean(0)), "covariance": cut(np.cov(rows.T)),
            "log_mean": cut(logs.mean(0)), "log_covariance": cut(np.cov(logs.T))}


def main():
    male, female = sys.argv[1:3]
    out = {"source": "ANSUR II (US Army Anthropometric Survey 2012), public release; US Government work",
           "measures": ["stature_m", "weight_kg", "chest_m", "waist_m", "hip_m"], "male": moments(male), "female": moments(female)}
    json.dump(out, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
