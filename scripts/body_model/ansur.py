"""What the people of ANSUR II measure, as the package's table: python -m scripts.body_model.ansur MALE.csv FEMALE.csv.

The survey's public files (US Army Natick Soldier Research, Development and Engineering Center 2012, released 2017; 4,082 men and
1,986 women) are works of the United States government and in the public domain; semicolons or commas between columns."""

import csv
import sys
from pathlib import Path

import numpy as np

from vistel.arrays import F64
from vistel.figure.body_model.measures import COLUMNS

FILE = Path("vistel/figure/body_model/data/ansur.toml")
COUNTS = {"male": 4082, "female": 1986}
_HEAD = """# Measures of 4,082 men and 1,986 women: ANSUR II, the 2012 Anthropometric Survey of US Army Personnel (Gordon and others
2014, # Natick/TR-15/007), counted from the survey's public tables, which are in the public domain, by scripts/body_model/ansur.py.
# Metres and kilograms. percentiles: 1st, 5th, 50th, 95th, 99th. by: what a person of a stature and a weight has on average:
# constant, factor of the stature, factor of the cube root of the weight; and the standard deviation of what is left. r: correlation
# with stature.
"""


def read(path: Path, sex: str) -> dict[str, F64]:
    with path.open(encoding="latin1", newline="") as file:
        mark = ";" if ";" in file.readline() else ","
        file.seek(0)
        rows = list(csv.DictReader(file, delimiter=mark))
    if len(rows) != COUNTS[sex]:
        raise SystemExit(f"{path}: {len(rows)} people, expected {COUNTS[sex]}; use ANSUR II's public file")
    # Millimetres, but for the eyes' distance, which is in tenths of them.
    unit = dict.fromkeys(COLUMNS.values(), 1e-3) | {"weightkg": 0.1, "interpupillarybreadth": 1e-4}
    return {name: u * np.array([float(row[name]) for row in rows]) for name, u in unit.items()}


def main() -> None:
    lines = [_HEAD]
    for sex, path in zip(COUNTS, sys.argv[1:3], strict=True):
        table = read(Path(path), sex)
        tall, heavy = table["stature"], table["weightkg"]
        known = {"weight": heavy} | {name: table[column] for name, column in COLUMNS.items()}
        for name, value in known.items():
            on = np.column_stack([np.ones_like(tall), tall, np.cbrt(heavy)])
            by = np.linalg.lstsq(on, value, rcond=None)[0]
            left = float((value - on @ by).std())
            p = ", ".join(f"{x:.4g}" for x in np.percentile(value, (1, 5, 50, 95, 99)))
            r = float(np.corrcoef(value, tall)[0, 1])
            told = ", ".join(f"{x:.5g}" for x in (*by, left))
            lines.append(f'[{sex}."{name}"]\npercentiles = [{p}]\nby = [{told}]\nr = {r:.3f}\n')
    FILE.write_text("\n".join(lines), "utf-8")


if __name__ == "__main__":
    main()
