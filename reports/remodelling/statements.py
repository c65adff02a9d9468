"""Numbers behind the table of statements of reports/remodelling.md, femur by forces (Python alone).

    python3 reports/remodelling/statements.py RUNS

RUNS is the folder of forces.sh. All points weigh alike; the regions are those of the scene files.
"""

import csv
import json
import math
import pathlib
import sys
import tomllib

RUNS = pathlib.Path(sys.argv[1])
HERE = pathlib.Path(__file__).resolve().parents[2] / "pipelines"
HORIZONS = ["0.602", "0.903", "1.204"]
KINDS = ["continuum", *HORIZONS]
# Points that the forces of a load case meet at the head, and the one between them.
HEAD = {"lc1": [(-8.67, 3.66), (-6.23, 3.85), (-10.22, 2.36)], "lc2": [(-8.15, 3.75)]}
TROCHANTER = {"lc1": (1.80, 0.41), "lc2": (2.4, 0.25)}


def change(run, t):
    """Relative density change by point."""
    path = RUNS / run / f"fields_t{t}.csv"
    return {(float(r["x"]), float(r["y"])): float(r["density_change"]) for r in csv.DictReader(open(path))}


def inside(corners, x, y):
    within = False
    for (x0, y0), (x1, y1) in zip(corners, corners[1:] + corners[:1]):
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) / (y1 - y0) * (x1 - x0):
            within = not within
    return within


def regions():
    scene = tomllib.loads((HERE / "femur-lc1-shear-forces.toml").read_text())
    tests = {"whole femur": lambda x, y: True}
    for probe in scene["probe"]:
        (kind, value), = probe["region"].items()
        tests[probe["name"]] = {
            "box": lambda x, y, v=value: v[0] <= x <= v[2] and v[1] <= y <= v[3],
            "disc": lambda x, y, v=value: math.hypot(x - v[0], y - v[1]) <= v[2],
            "polygon": lambda x, y, v=value: inside(v, x, y),
        }[kind]
    return tests


def mean(values):
    values = list(values)
    return sum(values) / len(values) if values else math.nan


def near(points, centre, low, high):
    return [v for (x, y), v in points.items() if low <= math.hypot(x - centre[0], y - centre[1]) < high]


def row(name, values, digits=3):
    print(f"| {name} | " + " | ".join("-" if v is None or v != v else f"{v:.{digits}f}" for v in values) + " |")


def line(points, height):
    """Places and values along the row of points nearest to a height."""
    row = min({y for _, y in points}, key=lambda y: (abs(y - height), y))
    return sorted((x, v) for (x, y), v in points.items() if y == row)


def table(title, columns):
    print(f"\n| {title} | {' | '.join(columns)} |\n|{'---|' * (len(columns) + 1)}")


def means(t, runs):
    table(f"t = {t}", runs)
    fields = {run: change(run, t) for run in runs}
    for name, test in regions().items():
        row(name, [mean(v for (x, y), v in fields[run].items() if test(x, y)) for run in runs])


def band(points, start, end, offset):
    """Mean over a strip 0.8 wide along a line, shifted sideways by `offset`."""
    (x0, y0), (x1, y1) = start, end
    length = math.hypot(x1 - x0, y1 - y0)
    ux, uy = (x1 - x0) / length, (y1 - y0) / length
    at = lambda x, y: ((x - x0) * ux + (y - y0) * uy, (y - y0) * ux - (x - x0) * uy - offset)
    return mean(v for (x, y), v in points.items() if 0 <= at(x, y)[0] <= length and abs(at(x, y)[1]) <= 0.4)


def statements(case):
    local = {t: change(f"{case}-continuum", t) for t in (10, 280)}
    table(f"{case}: difference to the continuum", ["t", "mean", "95 %", "largest", "above 0.1 (%)", "above 0.3 (%)", "of these at head or trochanter (%)"])
    for horizon in HORIZONS:
        for t in (10, 280):
            here = change(f"{case}-{horizon}", t)
            assert here.keys() == local[t].keys()
            size = {p: abs(v - local[t][p]) for p, v in here.items()}
            ordered = sorted(size.values())
            n = len(ordered)
            large = [p for p, v in size.items() if v > 0.3]
            there = [p for p in large if math.hypot(p[0] + 7.182, p[1] - 0.312) < 4 or (p[0] > 0 and p[1] > -4)]
            share = lambda limit: 100 * sum(v > limit for v in ordered) / n
            print(f"| {horizon} | {t} | {mean(ordered):.4f} | {ordered[(n - 1) * 95 // 100]:.4f} | {ordered[-1]:.2f} | {share(0.1):.1f} | {share(0.3):.2f} | "
                  f"{100 * len(there) / len(large) if large else math.nan:.0f} |")
    runs = {kind: change(f"{case}-{kind}", 280) for kind in KINDS}
    early = {kind: change(f"{case}-{kind}", 10) for kind in KINDS}
    table(case, KINDS)
    at_head = {k: {p: v for p, v in f.items() if min(math.dist(p, h) for h in HEAD[case]) < 1.2} for k, f in runs.items()}
    around = {k: [v for p, v in f.items() if 1.2 <= min(math.dist(p, h) for h in HEAD[case]) < 2.4] for k, f in runs.items()}
    row("largest within 1.2 of the head's loads, t = 280", [max(at_head[k].values()) for k in KINDS])
    row("least there", [min(at_head[k].values()) for k in KINDS])
    row("mean between 1.2 and 2.4", [mean(around[k]) for k in KINDS])
    rings = lambda k, centre, low, high: mean(near({p: v - early["continuum"][p] for p, v in early[k].items()}, centre, low * float(k), high * float(k)))
    for name, centre in (("head", HEAD[case][0]), ("trochanter", TROCHANTER[case])):
        row(f"{name}: difference at t = 10, δ/2 to δ", [None, *(rings(k, centre, 0.5, 1) for k in HORIZONS)])
        row(f"{name}: δ to 3δ/2", [None, *(rings(k, centre, 1, 1.5) for k in HORIZONS)])
    row("junction of neck and trochanter, t = 280", [mean(near(runs[k], (-0.6, -0.6), 0, 1.3)) for k in KINDS])
    for name, start, end in (("secondary compressive", (-3.0, -8.5), (2.2, -2.6)), ("secondary tensile", (2.9, -7.5), (-1.6, -3.2))):
        row(f"{name} band less its neighbours", [band(runs[k], start, end, 0) - 0.5 * (band(runs[k], start, end, 0.8) + band(runs[k], start, end, -0.8)) for k in KINDS])
    for height in (-4.05, -5.05):
        inner = [[(v, x) for x, v in line(runs[k], height) if -4.5 < x < 3] for k in KINDS]
        loosest = [min(one)[1] for one in inner]
        row(f"loosest place on y = {height}, x", loosest, 2)
    for k in KINDS:
        print(f"{case}, {k}, y = -18, medial to lateral:", ", ".join(f"{v:.2f}" for _, v in line(runs[k], -18)))


def likeness():
    table("likeness at t = 280", ["correlation", "mean", "largest"])
    for run in sorted(p.parent for p in RUNS.glob("*/difference.csv")):
        last = list(csv.DictReader(open(run / "difference.csv")))[-1]
        other = next(line.split('"')[1] for line in (RUNS / f"{run.name}.toml").read_text().splitlines() if line.startswith("minus"))
        print(f"| {run.name} less {other} | {float(last['correlation']):.3f} | {float(last['mean_abs']):.4f} | {float(last['max_abs']):.3f} |")


def costs():
    table("run", ["points", "unknowns", "steps"])
    for path in sorted(RUNS.glob("*/scene.json")):
        scene = json.load(open(path))
        print(f"| {path.parent.name} | {scene['points']} | {scene['unknowns']} | {scene['steps']} |")


for t in (10, 280):
    means(t, [f"{case}-{kind}" for case in ("lc1", "lc2") for kind in KINDS])
means(280, ["lc1-0.903", "lc2-0.903", "mixture", "in-turn"])
for case in ("lc1", "lc2"):
    statements(case)
likeness()
costs()
