#!/usr/bin/env python3
"""Figures 4 and 11 of Diana (2023): energy against the material's angle over m, and frequencies of the tetrachiral lattice over δ and m.

    python3 reports/continuum-molecular/series.py [BINARY] [WORK]     # a quarter of an hour of one core; rows that are there are kept
    python3 reports/continuum-molecular/series.py --report

Rows go to series.csv next to this file, figures (PyPI: matplotlib) to energy-over-m.png and frequencies.png, tables between the markers of
reports/continuum-molecular.md.
"""
import csv, json, os, pathlib, re, subprocess, sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
ROWS = HERE / "series.csv"
REPORT = ROOT / "reports/continuum-molecular.md"
COLUMNS = ["series", "case", "m", "points_across", "calibrated", "at", "value"]
BODIES = [(material, load) for material in ("square", "anisotropic") for load in ("extension", "shear")]
RATIOS = (3, 4, 5, 6, 8)
# 25 blocks of 20 mm, each in a cell of 20/cos(atan(1/2)) mm.
EDGE = 25 * 20 * 5**0.5 / 2
# Rigid squares on the printed springs, modes 4 to 8, in Hz (`cargo test --release the_continuum_vibrates`).
BLOCKS = [830.08, 1048.15, 1048.15, 1414.45, 1427.04]
# Points across and m. δ = 99.8, 49.9, 25.0, 12.5 mm at m = 5; then the paper's δ = 25 mm, and 50 mm up to m = 15.
DELTAS = [(28, 5), (56, 5), (112, 5), (224, 5)]
FAMILIES = {25: [(67, 3), (89, 4), (112, 5), (134, 6), (179, 8), (224, 10)], 50: [(34, 3), (56, 5), (89, 8), (112, 10), (134, 12), (168, 15)]}
HUES, MARKS = ["#0072B2", "#D55E00", "#000000", "#009E73", "#CC79A7"], ["o", "s", "D", "^", "v"]


def read():
    return list(csv.DictReader(ROWS.open())) if ROWS.exists() else []


def keep(rows):
    temporary = ROWS.with_suffix(".tmp")
    temporary.write_text("\n".join([",".join(COLUMNS)] + [",".join(str(r[c]) for c in COLUMNS) for r in rows]) + "\n")
    os.replace(temporary, ROWS)


def run(binary, work, name, scene, edits):
    text = (ROOT / f"pipelines/scene-{scene}.toml").read_text()
    for pattern, value in edits:
        text, count = re.subn(pattern, value, text, flags=re.M)
        assert count, f"{scene}: {pattern}"
    file, out = work / f"{name}.toml", work / name
    file.write_text(text)
    ran = subprocess.run([binary, "scene", file, "-o", out, "--force", "--threads", "1"], capture_output=True, text=True)
    if ran.returncode != 0:
        print(f"left out: {name}: {ran.stderr.strip()}", flush=True)
        return None
    return out


def measure(binary, work):
    work.mkdir(parents=True, exist_ok=True)
    rows = read()
    done = {(r["series"], r["case"], int(r["m"]), int(r["points_across"]), r["calibrated"]) for r in rows}

    def add(series, case, m, n, calibrated, values):
        rows.extend(dict(zip(COLUMNS, [series, case, m, n, calibrated, at, f"{value:.6g}"])) for at, value in values)
        keep(rows)

    for m in RATIOS:
        for material, load in BODIES:
            case = f"{material}-{load}"
            if ("energy", case, m, 24, "false") in done:
                continue
            out = run(binary, work, f"energy-{case}-{m}", f"energy-angle-{case}", [(r"horizon_ratio = 5", f"horizon_ratio = {m}")])
            if out:
                found = csv.DictReader((out / "history.csv").open())
                add("energy", case, m, 24, "false", [(r["t"], float(r["energy_density_inside"]) / float(r["energy_density_local"])) for r in found])
    grids = sorted(set(DELTAS + FAMILIES[25] + FAMILIES[50]), key=lambda g: (g[0] * g[1], g))
    for n, m in grids:
        for calibrated in ("false", "true"):
            if ("frequency", "tetrachiral", m, n, calibrated) in done:
                continue
            out = run(binary, work, f"tetrachiral-{n}-{m}-{calibrated}", "tetrachiral-modes", [
                (r"^spacing = .*", f"spacing = {EDGE / n!r}"), (r"horizon_ratio = 5", f"horizon_ratio = {m}"), (r"calibrated = true", f"calibrated = {calibrated}")])
            if out:
                numbers = dict(json.loads((out / "scene.json").read_text())["numbers"])
                add("frequency", "tetrachiral", m, n, calibrated, [(k, numbers[f"frequency_{k}"]) for k in range(4, 9)])


def frequencies(rows, n, m, calibrated):
    own = [r for r in rows if r["series"] == "frequency" and (int(r["points_across"]), int(r["m"]), r["calibrated"]) == (n, m, calibrated)]
    return [float(r["value"]) for r in sorted(own, key=lambda r: int(r["at"]))] or None


def energies(rows, material, load, m):
    own = [r for r in rows if r["series"] == "energy" and r["case"] == f"{material}-{load}" and int(r["m"]) == m]
    return [(float(r["at"]), float(r["value"])) for r in own]


def figures(rows):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    plt.rcParams.update({"font.size": 9, "axes.grid": True, "grid.color": "#cccccc"})
    fig, axes = plt.subplots(2, 2, figsize=(8.2, 5.6), sharex=True, sharey=True)
    for axis, (material, load) in zip(axes.flat, BODIES):
        for k, m in enumerate(RATIOS):
            points = energies(rows, material, load, m)
            axis.plot([a for a, _ in points], [100 * (e - 1) for _, e in points], MARKS[k] + "-", color=HUES[k], ms=4, lw=1, label=f"m = {m}")
        axis.set_title(f"{material}, {load}", fontsize=9)
    for axis in axes[1]:
        axis.set_xlabel("material angle (degrees)")
    for axis in axes[:, 0]:
        axis.set_ylabel("discrete over local energy - 1 (%)")
    axes[0, 0].legend(fontsize=7, loc="lower left", ncols=2)
    plt.tight_layout()
    plt.savefig(HERE / "energy-over-m.png", dpi=110)
    plt.close()

    fig, axes = plt.subplots(1, 3, figsize=(9.6, 3.6), sharey=True)
    panels = [("m = 5", "horizon δ (mm)", [(EDGE * m / n, n, m) for n, m in DELTAS])]
    panels += [(f"δ = {delta} mm", "m", [(m, n, m) for n, m in grids]) for delta, grids in FAMILIES.items()]
    for axis, (title, label, grids) in zip(axes, panels):
        for calibrated, style in (("false", "--"), ("true", "-")):
            for k in (0, 1, 3, 4):
                line = [(x, frequencies(rows, n, m, calibrated)) for x, n, m in grids]
                line = [(x, 100 * (f[k] / BLOCKS[k] - 1)) for x, f in line if f]
                full = calibrated == "true"
                name = f"mode {k + 4}" + (" and 6" if k == 1 else "") + (", calibrated" if full else "")
                axis.plot([x for x, _ in line], [v for _, v in line], MARKS[k] + style, color=HUES[k], mfc=HUES[k] if full else "none", ms=4, lw=1, label=name)
        axis.set_title(title, fontsize=9)
        axis.set_xlabel(label)
    axes[0].set_xscale("log")
    axes[0].set_xticks([12.5, 25, 50, 100], ["12.5", "25", "50", "100"])
    axes[0].minorticks_off()
    axes[0].set_ylabel("frequency over that of the blocks - 1 (%)")
    axes[2].legend(fontsize=6)
    plt.tight_layout()
    plt.savefig(HERE / "frequencies.png", dpi=110)
    plt.close()


def energy_table(rows):
    lines = ["| discrete over local energy - 1 (%), least and most over the angle | " + " | ".join(f"m = {m}" for m in RATIOS) + " |", "|---|" + "---|" * len(RATIOS)]
    for material, load in BODIES:
        found = [[100 * (e - 1) for _, e in energies(rows, material, load, m)] for m in RATIOS]
        lines.append(f"| {material}, {load} | " + " | ".join(f"{min(v):+.2f}, {max(v):+.2f}" if v else "" for v in found) + " |")
    return "\n".join(lines + ["", "![energy against angle over m](continuum-molecular/energy-over-m.png)", ""])


def frequency_table(rows):
    lines = ["| δ (mm) | m | points across | calibrated | mode 4 | 5, 6 | 7 | 8 (Hz) | largest difference from the blocks |", "|---|---|---|---|---|---|---|---|---|"]
    seen = []
    for n, m in DELTAS + FAMILIES[25] + FAMILIES[50]:
        for calibrated in ("false", "true"):
            f = frequencies(rows, n, m, calibrated)
            if f and (n, m, calibrated) not in seen:
                seen.append((n, m, calibrated))
                off = max((100 * (a / b - 1) for a, b in zip(f, BLOCKS)), key=abs)
                lines.append(f"| {EDGE * m / n:.1f} | {m} | {n} | {'yes' if calibrated == 'true' else 'no'} | {f[0]:.2f} | {f[1]:.2f} | {f[3]:.2f} | {f[4]:.2f} | {off:+.2f} % |")
    return "\n".join(lines + ["", "![frequencies over horizon and m](continuum-molecular/frequencies.png)", ""])


def report():
    rows = read()
    figures(rows)
    text = REPORT.read_text()
    for name, table in (("energy over m", energy_table(rows)), ("frequencies", frequency_table(rows))):
        begin, end = f"<!-- {name} begin -->", f"<!-- {name} end -->"
        head, rest = text.split(begin)
        text = f"{head}{begin}\n{table}{end}{rest.split(end)[1]}"
    REPORT.write_text(text)


if __name__ == "__main__":
    words = [w for w in sys.argv[1:] if w != "--report"]
    if "--report" not in sys.argv:
        measure(str(words[0] if words else ROOT / "target/release/bonepd-ct"), pathlib.Path(words[1] if len(words) > 1 else "/tmp/series"))
    report()
