"""Zooms of Figures 4 and 5 (7 <= t <= 8) from the folders of the square scenes (PyPI: matplotlib).

    python3 reports/remodelling/zooms.py out
"""

import csv
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

RUNS, OUT = pathlib.Path(sys.argv[1]), pathlib.Path(__file__).parent
HUES = ["#0072B2", "#D55E00", "#000000", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"]
DASHES = ["-", "--", ":", "-.", (0, (5, 1)), (0, (1, 1)), (0, (3, 1, 1, 1))]
plt.rcParams.update({"font.size": 9, "axes.grid": True, "grid.color": "#cccccc"})


def change(name):
    """Times and mean relative change of density of a run."""
    rows = list(csv.DictReader(open(RUNS / name / "history.csv")))
    return [float(r["t"]) for r in rows], [float(r["mean"]) for r in rows]


def panel(axis, title, runs):
    for k, (label, name) in enumerate(runs):
        if not (RUNS / name / "scene.json").exists():
            print(f"left out: {name} is missing or not finished")
            continue
        t, v = change(name)
        late = [(a, b) for a, b in zip(t, v) if a >= 6.99]
        axis.plot([a for a, _ in late], [b for _, b in late], linestyle=DASHES[k], color=HUES[k], lw=1.2, label=label)
    axis.set_title(title, fontsize=9)
    axis.set_xlim(7, 8)
    axis.set_xlabel("time t")
    axis.set_ylabel("mean relative change of density")
    axis.legend(fontsize=7, loc="center right")


figure, axes = plt.subplots(1, 2, figsize=(8.4, 3.6))
panel(axes[0], "δ = 0.05025, δ/Δ as named", [(r, f"square-fixed-horizon-{r}") for r in ("2.01", "2.5125", "4.02", "5.025", "8.04", "10.05")])
local = [("continuum", "square-continuum")]
panel(axes[1], "δ/Δ = 3.01, points along an edge as named", [(f"{n}", f"square-fixed-ratio-{n}") for n in (10, 20, 40, 80, 160, 320)] + local)
plt.tight_layout()
plt.savefig(OUT / "zooms.png", dpi=110)
