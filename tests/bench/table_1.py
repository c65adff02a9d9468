#!/usr/bin/env python3
"""A twin of Table 1 and Figure 6 of Zojaji et al. (2024) on a phantom core of 10 mm diameter and 5 mm height.

    python3 tests/bench/table_1.py [BINARY] [WORK]        # minutes; then, from the rows it left, the report's section and figure
    python3 tests/bench/table_1.py --report

Rows go to reports/table-1.csv as they are found (what is there already is kept), the section between the markers of
reports/performance.md, the figure (PyPI: matplotlib) to reports/speed-vs-error/table-1.png. Smooth elements see the grey values. Grips of 0.6 mm and 4200 microstrain, as in the paper. Times: processor time of the
command with its reading and writing, on one thread, which does not depend on what else runs.
"""
import csv, os, pathlib, resource, subprocess, sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROWS = ROOT / "reports/table-1.csv"
REPORT = ROOT / "reports/performance.md"
FIGURE = ROOT / "reports/speed-vs-error/table-1.png"
COLUMNS = ["method", "size_mm", "unknowns", "iterations", "e_app_mpa", "error_mpa", "cpu_s", "peak_mib", "bv_tv"]
PHANTOM = "--size-mm 10,10,5 --spacing-mm 0.02 --bvtv 0.11 --thickness-mm 0.16 --seed 1".split()
LOAD = ["--grip-mm", "0.6", "--strain=-0.0042", "--force", "--threads", "1"]
LPS = [0.12, 0.10, 0.08, 0.06]
# Edges of the cells that smooth elements are made in; the paper's sizes are largest edges, of up to twelve struts' thickness.
ELEMENTS = [0.14, 0.10, 0.07, 0.05]
# The paper's core 16, BV/TV 11.2 %, 14 cores of a Xeon W-2275: seconds of wall time and MPa.
PAPER = {
    ("floppy", 0.06): (1946, None), ("floppy", 0.08): (198, None), ("floppy", 0.10): (21, None), ("floppy", 0.12): (16, None),
    ("firm", 0.06): (2936, None), ("firm", 0.08): (263, None), ("firm", 0.10): (36, None), ("firm", 0.12): (18, None),
    ("ffb", 0.06): (4882, 11.0), ("ffb", 0.08): (461, 9.58), ("ffb", 0.10): (57, 8.76), ("ffb", 0.12): (34, 7.77),
    ("voxel-fe", 0.01): (19414, 10.3), ("voxel-fe", 0.02): (1045, 9.25), ("voxel-fe", 0.05): (39, 9.65), ("voxel-fe", 0.10): (3, 7.14),
    ("geometry-fe", 0.1): (3920, 12.5), ("geometry-fe", 0.5): (1861, 9.34), ("geometry-fe", 1.0): (1392, 10.9), ("geometry-fe", 2.0): (606, 7.53),
}


def run(binary, *words):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([binary, *map(str, words)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def read(path):
    return list(csv.DictReader(path.open())) if path.exists() else []


def key(row):
    return row["method"], float(row["size_mm"])


def keep(rows):
    text = [",".join(COLUMNS)] + [",".join(str(row[c]) for c in COLUMNS) for row in rows]
    temporary = ROWS.with_suffix(".tmp")
    temporary.write_text("\n".join(text) + "\n")
    os.replace(temporary, ROWS)


def solved(binary, folder, method, size, *words):
    seconds = run(binary, "solve", folder, *words, *LOAD)
    lattice = method in ("floppy", "firm")
    found = [r for r in read(folder / "results.csv") if (r["boundary"] if lattice else r["method"]) == method]
    (row,) = [r for r in found if abs(float(r["lp_mm"]) - size) < 1e-6]
    return {
        "method": method, "size_mm": size, "unknowns": row["unknowns"], "iterations": row["iterations"],
        "e_app_mpa": f"{float(row['e_app_mpa']):.5g}", "error_mpa": row["error_mpa"], "cpu_s": f"{seconds:.1f}",
        "peak_mib": row["peak_mib"], "bv_tv": f"{float(row['bv_tv']):.4f}",
    }


def measure(binary, work):
    work.mkdir(parents=True, exist_ok=True)
    scan = work / "core.nii.gz"
    if not scan.exists():
        run(binary, "phantom", "-o", scan, *PHANTOM)
    rows = read(ROWS)
    segment = ["--lower", "200", "--upper", "5600", "--voi", "cylinder:10"]

    def folder(size):
        # A coarser mesh is of the scan averaged to that voxel size and thresholded again.
        again = [] if size == 0.02 else ["--resample", size]
        out = work / f"core-{size}"
        if not (out / "mask.nii.gz").exists():
            run(binary, "segment", scan, "-o", out, *segment, *again)
        return out

    for boundary, lp in [(b, lp) for lp in LPS for b in ("floppy", "firm")]:
        if (boundary, lp) not in map(key, rows):
            rows.append(solved(binary, folder(0.02), boundary, lp, "--structure", "sc", "--lp", lp, "--boundary", boundary))
            keep(rows)
    for size in (0.10, 0.05, 0.02):
        if ("voxel-fe", size) not in map(key, rows):
            rows.append(solved(binary, folder(size), "voxel-fe", size, "--method", "voxel-fe"))
            keep(rows)
    for size in ELEMENTS:
        if ("geometry-fe", size) not in map(key, rows):
            rows.append(solved(binary, folder(0.02), "geometry-fe", size, "--method", "geometry-fe", "--element-mm", size))
            keep(rows)


def with_ffb(rows):
    found = {key(r): r for r in rows}
    for lp in LPS:
        floppy, firm = found.get(("floppy", lp)), found.get(("firm", lp))
        if floppy and firm:
            pair = [float(r["e_app_mpa"]) for r in (floppy, firm)]
            seconds = sum(float(r["cpu_s"]) for r in (floppy, firm))
            found["ffb", lp] = {**floppy, "method": "ffb", "e_app_mpa": f"{sum(pair) / 2:.5g}", "error_mpa": f"{abs(pair[0] - pair[1]) / 2}",
                                "cpu_s": f"{seconds:.1f}", "unknowns": "", "iterations": ""}
    return found


def number(text, digits=1):
    return "" if text in ("", "NA", None) else f"{float(text):.{digits}f}"


def section(found):
    lines = [
        "`python3 tests/bench/table_1.py`: rows in [`table-1.csv`](table-1.csv). Processor seconds of one thread here; wall seconds on 14 cores, and the moduli of another",
        "core of about the same BV/TV (11.2 %), in the paper.", "",
        "| method | size (mm) | unknowns | iterations | E_app (MPa) | processor time (s) | paper: E_app (MPa) | paper: wall time (s) |", "|---|---|---|---|---|---|---|---|",
    ]
    order = ["floppy", "firm", "ffb", "voxel-fe", "geometry-fe"]
    for method, size in sorted(set(found) | set(PAPER), key=lambda k: (order.index(k[0]) if k[0] in order else 9, -k[1])):
        row = found.get((method, size), {})
        wall, modulus = PAPER.get((method, size), (None, None))
        half = f" ± {number(row['error_mpa'], 2)}" if method == "ffb" and row else ""
        lines.append(f"| {method} | {size:g} | {row.get('unknowns', '')} | {row.get('iterations', '')} | {number(row.get('e_app_mpa'), 2)}{half} | "
                     f"{number(row.get('cpu_s'))} | {'' if modulus is None else f'{modulus:g}'} | {'' if wall is None else wall} |")
    return "\n".join(lines)


def figure(found):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    plt.rcParams.update({"font.size": 9, "axes.grid": True, "grid.color": "#cccccc"})
    fig, axes = plt.subplots(1, 2, figsize=(8.2, 3.4))
    styles = {"floppy": ("#0072B2", "o"), "firm": ("#D55E00", "s"), "ffb": ("#000000", "D"), "voxel-fe": ("#009E73", "^"), "geometry-fe": ("#CC79A7", "v")}
    for method, (hue, mark) in styles.items():
        rows = sorted((size, row) for (m, size), row in found.items() if m == method)
        if not rows:
            continue
        moduli = [float(r["e_app_mpa"]) for _, r in rows]
        axes[0].plot([s for s, _ in rows], moduli, mark + "-", color=hue, ms=5, lw=1, label=method)
        axes[1].plot([float(r["cpu_s"]) for _, r in rows], moduli, mark + "-", color=hue, ms=5, lw=1, label=method)
    for method in ("ffb", "voxel-fe"):
        rows = sorted((size, e) for (m, size), (_, e) in PAPER.items() if m == method and e)
        axes[0].plot([s for s, _ in rows], [e for _, e in rows], styles[method][1] + ":", color=styles[method][0], mfc="none", ms=5, lw=1,
                     label=f"{method}, the paper's core")
    axes[0].set_xlabel("lattice parameter or element size (mm)")
    axes[0].set_ylabel("E_app (MPa)")
    axes[1].set_xlabel("processor time (s), one thread")
    axes[1].set_xscale("log")
    for axis in axes:
        axis.set_ylim(bottom=0)
    axes[1].legend(*axes[0].get_legend_handles_labels(), fontsize=6, loc="upper right")
    axes[1].set_ylim(top=28)
    plt.tight_layout()
    plt.savefig(FIGURE, dpi=110)


def report():
    found = with_ffb(read(ROWS))
    begin, end = "<!-- table-1 begin -->", "<!-- table-1 end -->"
    text = REPORT.read_text()
    head, rest = text.split(begin)
    _, tail = rest.split(end)
    REPORT.write_text(f"{head}{begin}\n{section(found)}\n{end}{tail}")
    figure(found)


if __name__ == "__main__":
    words = [w for w in sys.argv[1:] if w != "--report"]
    if "--report" not in sys.argv:
        binary = words[0] if words else ROOT / "target/release/bonepd-ct"
        measure(str(binary), pathlib.Path(words[1] if len(words) > 1 else "/tmp/table-1"))
    report()
