"""Curves of reports/continuum-molecular.md from the folders that `bonepd-ct scene` wrote (PyPI: matplotlib, pillow).

    python3 reports/continuum-molecular/figures.py RUNS reports/continuum-molecular

RUNS holds one folder per scene, named as below; what is missing is left out and said.
"""

import csv
import json
import math
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from PIL import Image

RUNS, OUT = map(pathlib.Path, sys.argv[1:3])
# Okabe and Ito's colours; dashes and markers repeat what they say.
HUES = ["#0072B2", "#D55E00", "#000000", "#009E73"]
DASHES = ["-", "--", ":", "-."]
MARKS = ["o", "s", "D", "^"]
plt.rcParams.update({"font.family": "DejaVu Sans", "font.size": 9, "axes.grid": True, "grid.color": "#cccccc"})


def history(name):
    """Columns of a run's history, or None."""
    path = RUNS / name / "history.csv"
    if not path.exists():
        print(f"left out: {path} is missing")
        return None
    rows = list(csv.DictReader(open(path)))
    return {key: [float(row[key]) for row in rows] for key in rows[0]}


def save(name):
    plt.tight_layout()
    plt.savefig(OUT / f"{name}.png", dpi=110)
    plt.close()


def energy_angle():
    plt.figure(figsize=(5.2, 3.2))
    for k, (material, load) in enumerate((m, l) for m in ("square", "anisotropic") for l in ("extension", "shear")):
        h = history(f"energy-angle-{material}-{load}")
        if h is None:
            continue
        bias = [100 * (a / b - 1) for a, b in zip(h["energy_density_inside"], h["energy_density_local"])]
        plt.plot(h["t"], bias, DASHES[k], color=HUES[k], marker=MARKS[k], ms=4, label=f"{material}, {load}")
    plt.xlabel("material angle (degrees)")
    plt.ylabel("discrete over local energy - 1 (%)")
    plt.ylim(bottom=0)
    plt.legend(fontsize=8)
    save("energy-angle")


def plate():
    h = history("notched-plate")
    if h is None:
        return
    plt.figure(figsize=(5.2, 3.2))
    plt.plot(h["t"], [f / 1000 for f in h["load"]], color=HUES[0], lw=1)
    plt.xlabel("displacement of the upper pin (mm)")
    plt.ylabel("load (kN)")
    plt.xlim(left=0)
    plt.ylim(bottom=0)
    save("plate-load")


def compact_tension():
    runs = [(z, history(f"compact-tension-{z}")) for z in (0, 45, 60, 90)]
    runs = [(z, h) for z, h in runs if h]
    plt.figure(figsize=(5.2, 3.2))
    for k, (z, h) in enumerate(runs):
        plt.plot(h["t"], h["load"], DASHES[k], color=HUES[k], lw=1, label=f"{z}°")
    plt.xlabel("opening of the pins (mm)")
    plt.ylabel("load per thickness (N/mm)")
    plt.xlim(left=0)
    plt.ylim(bottom=0)
    plt.legend(title="bone's axis", fontsize=8)
    save("compact-tension-load")
    plt.figure(figsize=(5.2, 3.2))
    for k, (z, h) in enumerate(runs):
        drop = h["potential_drop"]
        # The potential is solved for at accepted steps only: the last state of each value is its own.
        kept = [i for i in range(len(drop)) if i == 0 or drop[i] != drop[i - 1]]
        plt.plot([h["crack_length"][i] for i in kept], [drop[i] / drop[0] for i in kept], DASHES[k], color=HUES[k],
                 marker=MARKS[k], ms=3, label=f"{z}°")
    plt.xlabel("crack extension (mm)")
    plt.ylabel("potential drop over its first value")
    plt.legend(title="bone's axis", fontsize=8)
    save("potential-drop")


def sensed(h):
    """Opening, crack extension, and drop over its first value, at accepted loads."""
    drop = h["potential_drop"]
    kept = [i for i in range(len(drop)) if i == 0 or drop[i] != drop[i - 1]]
    return [(h["t"][i], h["crack_length"][i], drop[i] / drop[0]) for i in kept]


def damage_sensing():
    """The runs of sensing.sh: what strain adds to the drop that the crack makes."""
    figure, axes = plt.subplots(1, 2, figsize=(8.6, 3.4))
    drawn = False
    for k, z in enumerate((0, 45, 60, 90)):
        found = {s: history(f"damage-sensing-{z}-slope{s}") for s in ("0", "-2.4", "-24")}
        found = {s: sensed(h) for s, h in found.items() if h}
        if "0" not in found:
            continue
        drawn = True
        plain = found["0"]
        axes[0].plot([c for _, c, _ in plain], [r for *_, r in plain], DASHES[k], color=HUES[k], marker=MARKS[k], ms=3, label=f"{z}°")
        for slope in ("-2.4", "-24"):
            if slope not in found:
                continue
            added = [(t, c, 100 * (r / p - 1)) for (t, c, r), (u, d, p) in zip(found[slope], plain) if t == u and c == d]
            assert len(added) == min(len(plain), len(found[slope])), "the cracks differ"
            whole = [a for a in added if a[1] == 0]
            most = max(added, key=lambda a: a[2])
            print(f"damage sensing, {z} degrees, slope {slope}: strain adds {whole[-1][2]:.3f} % at an opening of {whole[-1][0]:.3f} mm before the first "
                  f"break, at most {most[2]:.3f} % at {most[0]:.3f} mm and a crack of {most[1]:.1f} mm, {added[-1][2]:.3f} % at the end")
            if slope == "-24":
                axes[1].plot([t for t, *_ in added], [a for *_, a in added], DASHES[k], color=HUES[k], lw=1, label=f"{z}°")
        for wanted in (1, 2.5, 4.5, 6.5, 8.5, 10, 12):
            t, c, r = min(plain, key=lambda p: abs(p[1] - wanted))
            print(f"damage sensing, {z} degrees: crack {c:.1f} mm at {t:.3f} mm, drop {r:.3f}"
                  + "".join(f", slope {s} {next((q for u, _, q in found[s] if u == t), math.nan):.3f}" for s in found if s != "0"))
    if not drawn:
        return plt.close()
    axes[0].set_xlabel("crack extension (mm)")
    axes[0].set_ylabel("potential drop over its first value, Π = 0")
    axes[1].set_xlabel("opening of the pins (mm)")
    axes[1].set_ylabel("added by strain, Π = -24 (%)")
    for axis in axes:
        axis.legend(title="bone's axis", fontsize=7)
    save("damage-sensing")


def slopes():
    """Inclination of each crack of the compact tension runs, by its distance from the slit's end: the principal axis of
    the points that have lost more than 0.4 of their bonds."""
    for z in (0, 45, 60, 90):
        path = RUNS / f"compact-tension-{z}" / "fields_t0.4.csv"
        if not path.exists():
            print(f"left out: {path} is missing")
            continue
        rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(open(path))]
        crack = [(r["x"] - 9.288, r["y"], r["damage"]) for r in rows if r["damage"] > 0.4 and r["x"] > 8.8]
        for near in (0, 3, 6, 9):
            part = [(x, y, d) for x, y, d in crack if near <= math.hypot(x, y) < near + 3]
            if len(part) < 6:
                continue
            weight = sum(d for *_, d in part)
            mx, my = (sum(p[i] * p[2] for p in part) / weight for i in (0, 1))
            xx, yy, xy = (sum(d * a(x - mx, y - my) for x, y, d in part)
                          for a in (lambda x, y: x * x, lambda x, y: y * y, lambda x, y: x * y))
            angle = math.degrees(0.5 * math.atan2(2 * xy, xx - yy))
            print(f"compact tension, {z} degrees, {near} to {near + 3} mm: inclined by {angle:.1f} degrees")


# Of maximum hoop stress and of the largest energy release rate, for mixities of 0, 10, ... 90 degrees, by kinks.py.
HOOP = {
    "silicon": [0, -18.9, -33.1, -42.6, -49.3, -54.4, -58.6, -62.2, -65.6, -68.9],
    "anisotropic": [0, -19.7, -33.8, -43.8, -51.1, -56.8, -61.4, -65.5, -69.2, -72.7],
}
ENERGY = {
    "silicon": HOOP["silicon"],
    "anisotropic": [9.5, -10.5, -28.3, -41.2, -50.2, -56.9, -62.0, -66.1, -69.5, -72.5],
}
TURNS = ["0", "11.25", "22.5", "33.75", "45.001", "56.25", "67.5", "78.75"]


def kinks_on_grids(material):
    """Kinks of turns.sh (rows: turns of the grid, columns: mixities) relative to the crack, or None where a run is missing."""
    rows = []
    for turn in TURNS:
        path = RUNS / f"crack-kinking-{material}-turn-{turn}" / "scene.json"
        if not path.exists():
            print(f"left out: {path} is missing")
            return None
        numbers = dict(json.load(open(path))["numbers"])
        rows.append([numbers[f"end_direction_deg_at_{m}"] - float(turn) for m in range(0, 91, 10)])
    return rows


def deviation(found, criterion):
    return sum(abs(f - c) for f, c in zip(found, criterion)) / len(criterion)


def table(material, rows, mean, scatter):
    """The report's rows: kinks, then the mean deviation from hoop stress and from energy."""
    criteria = [c[material] for c in (HOOP, ENERGY)]
    for name, row in [*zip((f"{float(t):g}°" for t in TURNS), rows), ("mean", mean)]:
        cells = " | ".join(f"{v:.1f}" for v in row)
        print(f"| {material}, {name} | {cells} | {' | '.join(f'{deviation(row, c):.2f}' for c in criteria)} |")
    print(f"| {material}, scatter | {' | '.join(f'{v:.1f}' for v in scatter)} | | |")
    single = [sum(deviation(r, c) for r in rows) / len(rows) for c in criteria]
    largest = [max(abs(m - v) for m, v in zip(mean, c)) for c in criteria]
    print(f"{material}: one grid deviates by {single[0]:.2f} (hoop stress), {single[1]:.2f} (energy) in the mean; the mean of the "
          f"grids at most by {largest[0]:.2f}, {largest[1]:.2f}; mean scatter {sum(scatter) / len(scatter):.2f}")


def kinking():
    """Kinks on eight grids beside the two criteria: each grid as a dot, their mean with its scatter as a bar."""
    figure, axes = plt.subplots(1, 2, figsize=(7.4, 3.4), sharey=True)
    mixities = list(range(0, 91, 10))
    for axis, material in zip(axes, HOOP):
        axis.plot(mixities, [-a for a in HOOP[material]], color=HUES[2], lw=1, label="maximum hoop stress")
        axis.plot(mixities, [-a for a in ENERGY[material]], "--", color=HUES[3], lw=1, label="maximum energy release")
        axis.set_title({"silicon": "silicon <100>", "anisotropic": "fully anisotropic"}[material], fontsize=9)
        axis.set_xlabel("mixity (degrees)")
        rows = kinks_on_grids(material)
        if rows is None:
            continue
        columns = list(zip(*rows))
        mean = [sum(c) / len(c) for c in columns]
        scatter = [math.sqrt(sum((v - m) ** 2 for v in c) / (len(c) - 1)) for c, m in zip(columns, mean)]
        table(material, rows, mean, scatter)
        axis.plot(mixities * len(rows), [-v for row in rows for v in row], ".", color="#999999", ms=3, zorder=0,
                  label="one grid, a/40")
        axis.errorbar(mixities, [-m for m in mean], scatter, fmt=MARKS[0], color=HUES[0], ms=5, lw=1, capsize=3,
                      label="mean of 8 grids")
    axes[0].set_ylabel("kink (degrees)")
    for axis in axes:
        axis.legend(fontsize=8, loc="lower right")
    save("kinking")


def maps(name, files):
    """The program's own maps side by side, in few colours."""
    pictures = [Image.open(RUNS / f).convert("RGB") for f in files if (RUNS / f).exists()]
    if not pictures:
        print(f"left out: {name}, no map of {files}")
        return
    sheet = Image.new("RGB", (sum(p.width for p in pictures), max(p.height for p in pictures)), "white")
    left = 0
    for p in pictures:
        sheet.paste(p, (left, 0))
        left += p.width
    sheet.quantize(96, Image.Quantize.FASTOCTREE).save(OUT / f"{name}.png", optimize=True)


def columns_of(path):
    """Columns of a CSV file of numbers, or None."""
    if not path.exists():
        print(f"left out: {path} is missing")
        return None
    rows = list(csv.DictReader(open(path)))
    return {key: [float(row[key]) for row in rows] for key in rows[0]}


def directions():
    """k_n and k_t, w_c, and the reciprocal fracture energy by direction, as Figures 2, 14 and 16 show them."""
    tip, bone = (columns_of(RUNS / name / "directions.csv") for name in ("crack-tip-I", "compact-tension-0"))
    if tip is None or bone is None:
        return
    figure, axes = plt.subplots(1, 3, figsize=(9.6, 3.4), subplot_kw={"projection": "polar"})
    angle = [math.radians(a) for a in tip["angle_deg"]]
    largest = max(tip["k_n"])
    for k, name in enumerate(("k_n", "k_t")):
        axes[0].plot(angle, [v / largest for v in tip[name]], DASHES[k], color=HUES[k], lw=1.2, label=name)
    axes[0].legend(fontsize=7, loc="lower left")
    axes[0].set_title("crack-tip body: k_n, k_t over the largest k_n", fontsize=8)
    for axis, name, invert in ((axes[1], "w_c", False), (axes[2], "fracture_energy", True)):
        values = [1 / v if invert else v for v in bone[name]]
        axis.plot(angle, [v / max(values) for v in values], color=HUES[0], lw=1.2)
    axes[1].set_title("cortical bone, n = 8: w_c over the largest", fontsize=8)
    axes[2].set_title("its 1/G over the largest", fontsize=8)
    for axis in axes:
        axis.tick_params(labelsize=7)
    save("directions")


def crack_tip_lines():
    """Figures 7 to 9: the stress ahead of the tip, and the opening of the upper face, against their closed forms."""
    fields = columns_of(RUNS / "crack-tip-I" / "fields_t1.csv")
    if fields is None:
        return
    spacing = 1 / 120
    row = [i for i, y in enumerate(fields["y"]) if 0 < y < spacing]
    ahead = sorted((fields["x"][i], i) for i in row if 0 < fields["x"][i] < 0.3)
    figure, axes = plt.subplots(1, 2, figsize=(8.2, 3.3))
    xs = [x for x, _ in ahead]
    axes[0].plot(xs, [1 / math.sqrt(2 * math.pi * x) for x in xs], color=HUES[2], lw=1, label="closed form")
    for k, (name, label) in enumerate((("section_yy", "through the point's own section"), ("stress_yy", "mean over all sections"))):
        axes[0].plot(xs, [fields[name][i] for _, i in ahead], MARKS[k], color=HUES[k], ms=3, label=label)
    axes[0].set_xlabel("ahead of the tip, x/a")
    axes[0].set_ylabel("stress across the line, K_I = 1")
    axes[0].set_ylim(0, 8)
    axes[0].legend(fontsize=7)
    behind = sorted((fields["x"][i], i) for i in row if fields["x"][i] < 0)
    key = next(k for k in fields if k.startswith("displacement") and k.endswith("y"))
    axes[1].plot([x for x, _ in behind], [fields[key][i] for _, i in behind], color=HUES[0], lw=1.2, label="upper face")
    axes[1].plot([x for x, _ in behind], [fields["difference_from_known"][i] for _, i in behind], "--", color=HUES[1], lw=1.2,
                 label="difference from the closed form")
    axes[1].set_xlabel("behind the tip, x/a")
    axes[1].set_ylabel("displacement of the upper face")
    axes[1].legend(fontsize=7)
    save("sections")


maps("heat-disc", ["heat-disc/temperature_t1.png", "heat-disc/flux_size_t1.png"])
maps("differences", ["crack-tip-I/difference_from_known_t1.png"])
directions()
crack_tip_lines()
maps("crack-tip", ["crack-tip-I/stress_yy_t1.png"])
maps("plate", [f"notched-plate/damage_t{t}.png" for t in ("0.4", "0.8", "1.3")])
maps("inclusion", ["square-inclusion/damage_t0.02.png"])
maps("plate-modes", [f"plate-modes/magnitude_t{t}.png" for t in (4, 5, 7, 8)])
maps("tetrachiral", [f"tetrachiral-modes/magnitude_t{t}.png" for t in (4, 5, 7)])
maps("strain-sensing", [f"strain-sensing/potential_t{z}.png" for z in (0, 45, 60, 90)])
maps("compact-tension", [f"compact-tension-{z}/damage_t0.4.png" for z in (0, 45, 60, 90)])
energy_angle()
plate()
compact_tension()
damage_sensing()
slopes()
kinking()
