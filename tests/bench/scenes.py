#!/usr/bin/env python3
"""Speed against error of two-dimensional scenes over spacing, horizon and calibration: crack-tip field, disc, plate modes, kinks.

    python3 tests/bench/scenes.py [BINARY] [WORK]         # some minutes; rows that are there already are kept
    python3 tests/bench/scenes.py --report

Rows go to reports/scenes.csv, figures (PyPI: matplotlib) to reports/speed-vs-error/scenes-*.png, tables between the markers of
reports/continuum-molecular.md. Time is processor time of the command on one thread, reading and writing included.
"""
import csv, json, os, pathlib, re, resource, subprocess, sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROWS = ROOT / "reports/scenes.csv"
REPORT = ROOT / "reports/continuum-molecular.md"
COLUMNS = ["scene", "points_across", "m", "calibrated", "unknowns", "cpu_s", "error"]
# Bardell, Langley and Dunsdon (1996): w a sqrt(rho (1 - nu^2)/E) of a free square, nu = 0.3, first five modes.
MODES = [2.321, 2.472, 2.472, 2.628, 2.987]
# Maximum hoop stress in silicon at mixities of 20, 50 and 80 degrees (reports/continuum-molecular/kinks.py).
KINKS = {20: -33.1, 50: -54.4, 80: -65.6}
ERRORS = {
    "crack-tip": "relative error of the displacement", "disc": "relative error of the temperature",
    "plate-modes": "mean relative error of five frequencies", "kink": "mean deviation of three kinks (degrees)",
}


def edited(name, edits):
    text = (ROOT / f"pipelines/scene-{name}.toml").read_text()
    for pattern, value in edits:
        text, count = re.subn(pattern, value, text, flags=re.M)
        assert count, f"{name}: {pattern}"
    return text


def crack_tip(n, m, calibrated):
    moduli = r"^moduli = .*"
    text = edited("crack-tip-I", [(r"^spacing = .*", f"spacing = {1 / n!r}"), (r"horizon_ratio = 5", f"horizon_ratio = {m}"),
                                  (r"0\.954", f"{1 - (m + 0.5) / n!r}"), (moduli, rf"\g<0>\ncalibrated = {calibrated}")])
    return text, lambda numbers, last: last["relative_difference_from_known_field"]


def disc(n, m, calibrated):
    text = edited("heat-disc", [(r"^spacing = .*", f"spacing = {1 / n!r}"), (r"horizon_ratio = 5", f"horizon_ratio = {m}"),
                                (r"radius = 1\.02", f"radius = {1 + 2 / n!r}"), (r"0\.95\]", f"{1 - m / n!r}]"),
                                (r"^exponent = 34", rf"exponent = 34\ncalibrated = {calibrated}")])
    return text, lambda numbers, last: last["relative_difference_from_known_field"]


def plate_modes(n, m, calibrated):
    text = edited("plate-modes", [(r"^spacing = .*", f"spacing = {1 / n!r}"), (r"horizon_ratio = \d+", f"horizon_ratio = {m}"),
                                  (r"calibrated = true", f"calibrated = {calibrated}")])

    def error(numbers, last):
        found = [2 * 3.141592653589793 * numbers[f"frequency_{k}"] * (1 - 0.3**2) ** 0.5 for k in range(4, 9)]
        return sum(abs(f / e - 1) for f, e in zip(found, MODES)) / 5
    return text, error


def kink(n, m, calibrated):
    del calibrated
    end = 1 - (m + 0.5) / n
    text = edited("crack-kinking-silicon", [(r"^spacing = .*", f"spacing = {1 / n!r}"), (r"horizon_ratio = 5", f"horizon_ratio = {m}"),
                                            (r"0\.908", f"{end!r}"), (r"^values = .*", f"values = {list(KINKS)}")])
    return text, lambda numbers, last: sum(abs(numbers[f"end_direction_deg_at_{a}"] - k) for a, k in KINKS.items()) / len(KINKS)


CASES = list(
    [("crack-tip", crack_tip, n, m, c) for n in (30, 60, 120) for m in (3, 5) for c in ("false", "true")]
    + [("disc", disc, n, m, c) for n in (25, 50, 100, 200) for m in (3, 5, 8) for c in ("false", "true")]
    + [("plate-modes", plate_modes, n, m, c) for n in (25, 50, 100) for m in (3, 5) for c in ("false", "true")]
    + [("kink", kink, n, m, "false") for n in (20, 30, 40) for m in (3, 5)]
)
# The cheapest first: points times those that each is bonded with.
CASES.sort(key=lambda case: (case[2] * case[3]) ** 2)


def read():
    return list(csv.DictReader(ROWS.open())) if ROWS.exists() else []


def keep(rows):
    temporary = ROWS.with_suffix(".tmp")
    temporary.write_text("\n".join([",".join(COLUMNS)] + [",".join(str(r[c]) for c in COLUMNS) for r in rows]) + "\n")
    os.replace(temporary, ROWS)


def measure(binary, work):
    work.mkdir(parents=True, exist_ok=True)
    rows = read()
    done = {(r["scene"], int(r["points_across"]), int(r["m"]), r["calibrated"]) for r in rows}
    for scene, make, n, m, calibrated in CASES:
        if (scene, n, m, calibrated) in done:
            continue
        text, error = make(n, m, calibrated)
        name = f"{scene}-{n}-{m}-{calibrated}"
        file, out = work / f"{name}.toml", work / name
        file.write_text(text)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        ran = subprocess.run([binary, "scene", file, "-o", out, "--force", "--threads", "1"], capture_output=True, text=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if ran.returncode != 0:
            print(f"left out: {name}: {ran.stderr.strip()}")
            continue
        record = json.loads((out / "scene.json").read_text())
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        found = error(dict(record["numbers"]), record["last"])
        rows.append(dict(zip(COLUMNS, [scene, n, m, calibrated, record["unknowns"], f"{seconds:.2f}", f"{found:.4g}"])))
        keep(rows)


def figures(rows):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    plt.rcParams.update({"font.size": 9, "axes.grid": True, "grid.color": "#cccccc"})
    for scene, label in ERRORS.items():
        own = [r for r in rows if r["scene"] == scene]
        if not own:
            continue
        plt.figure(figsize=(5.2, 3.4))
        hues, marks = {3: "#0072B2", 5: "#D55E00", 8: "#009E73"}, {3: "o", 5: "s", 8: "^"}
        for m, calibrated in sorted({(int(r["m"]), r["calibrated"]) for r in own}):
            line = sorted((float(r["cpu_s"]), float(r["error"]), int(r["points_across"])) for r in own if (int(r["m"]), r["calibrated"]) == (m, calibrated))
            name = f"m = {m}" + (", calibrated" if calibrated == "true" else "")
            full = calibrated == "true"
            plt.plot([t for t, *_ in line], [e for _, e, _ in line], marks[m] + ("-" if full else "--"), color=hues[m], mfc=hues[m] if full else "none", ms=5, lw=1, label=name)
            for t, e, n in line:
                plt.annotate(f"1/{n}", (t, e), fontsize=6, xytext=(3, 3), textcoords="offset points")
        plt.xscale("log")
        if scene != "kink":
            plt.yscale("log")
        else:
            plt.ylim(bottom=0)
        plt.xlabel("processor time (s), one thread")
        plt.ylabel(label)
        plt.legend(fontsize=7)
        plt.tight_layout()
        plt.savefig(ROOT / f"reports/speed-vs-error/scenes-{scene}.png", dpi=110)
        plt.close()


def tables(rows):
    lines = []
    for scene, label in ERRORS.items():
        own = [r for r in rows if r["scene"] == scene]
        if not own:
            continue
        lines += [f"| {scene}: spacing | m | calibrated | unknowns | processor time (s) | {label} |", "|---|---|---|---|---|---|"]
        for r in sorted(own, key=lambda r: (int(r["m"]), r["calibrated"], int(r["points_across"]))):
            lines.append(f"| 1/{r['points_across']} | {r['m']} | {'yes' if r['calibrated'] == 'true' else 'no'} | {r['unknowns']} | {r['cpu_s']} | {r['error']} |")
        lines += ["", f"![{scene}: error against processor time](speed-vs-error/scenes-{scene}.png)", ""]
    return "\n".join(lines)


def report():
    rows = read()
    figures(rows)
    begin, end = "<!-- scenes begin -->", "<!-- scenes end -->"
    head, rest = REPORT.read_text().split(begin)
    REPORT.write_text(f"{head}{begin}\n{tables(rows)}{end}{rest.split(end)[1]}")


if __name__ == "__main__":
    words = [w for w in sys.argv[1:] if w != "--report"]
    if "--report" not in sys.argv:
        measure(str(words[0] if words else ROOT / "target/release/bonepd-ct"), pathlib.Path(words[1] if len(words) > 1 else "/tmp/scenes"))
    report()
