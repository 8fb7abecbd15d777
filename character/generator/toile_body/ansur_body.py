"""How the measurements of a body go together in ANSUR II (US Government work): moments only, no rows are kept.

    python -m toile_body.ansur_body ansur2_male.csv ansur2_female.csv > ../../fitting/src/measure/ansur2.json

Both sexes count alike, so that nobody has to tell which one a scan shows. The logarithms' covariance is that of
differences in per cent.
"""

import csv
import json
import sys

import numpy as np

COLUMNS = (
    "stature", "cervicaleheight", "waistheightomphalion", "crotchheight", "kneeheightmidpatella",
    "chestcircumference", "waistcircumference", "buttockcircumference", "thighcircumference", "calfcircumference",
    "anklecircumference", "neckcircumference", "headcircumference", "bicepscircumferenceflexed",
    "forearmcircumferenceflexed", "wristcircumference", "footlength", "handlength",
)


def logs(path):
    """Logarithms of the measures (metres), a row for each person."""
    with open(path, encoding="latin-1", newline="") as f:
        return np.log([[1e-3 * float(r[c]) for c in COLUMNS] for r in csv.DictReader(f)])


def main():
    people = [logs(path) for path in sys.argv[1:3]]
    weights = np.concatenate([np.full(len(rows), 0.5 / len(rows)) for rows in people])
    rows = np.vstack(people)
    mean = weights @ rows
    covariance = (rows - mean).T @ ((rows - mean) * weights[:, None])
    out = {"source": "ANSUR II (US Army Anthropometric Survey 2012), public release; US Government work",
           "people": len(rows), "measures": COLUMNS, "log_mean": np.round(mean, 6).tolist(),
           "log_covariance": np.round(covariance, 9).tolist()}
    json.dump(out, sys.stdout, indent=None)
    print()


if __name__ == "__main__":
    main()
