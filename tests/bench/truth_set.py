#!/usr/bin/env python3
"""The truth set: bodies of known shape, their moduli, and how near every method comes, at what cost.

    python3 tests/bench/truth_set.py target/release/bonepd-ct            # 16 bodies (about an hour on one core)
    ... --bodies 64         # all bodies (some four hours)
    ... --fourfold          # truths from voxels of 1/2, 1/3 and 1/4 (else 1/2 and 1/3)
    ... --truths            # make reports/references.csv again first
    ... --truths --bodies 32 --from 16      # only truths, of the bodies of lines 16 to 31; those of the others stay
    ... --draw              # only tables and charts, from the CSV files that are there

Every body is analytic (`phantom --body`): triply periodic surfaces, lattices, foams, foams with broken struts, cracks,
inclined plates. It has two truths. `body`: voxel FE on the body itself, sampled at finer and finer voxels, taken to voxel 0
(first order). `image`: the same for the half level of its grey values after the blur and the smoothing, without noise.
Their difference is what imaging does, which no method can undo.

Half A was used to set the constants of stated errors, half B was not looked at. Coverage is the share of bodies whose truth
lies within the stated error. Writes reports/references.csv (truths), reports/truth-set.csv (one row a body and method), and
the tables of reports/speed-vs-error.md; its charts where matplotlib (PyPI) is there. The real stack is read from the folder
that BONEPD_STACK names, and skipped where that is not there. Times are those of the solves as the program writes them
(`wall_s`), one thread.
"""

import argparse, csv, json, math, os, pathlib, re, statistics, subprocess, sys, tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
REPORTS = ROOT / "reports"
PAGE = REPORTS / "speed-vs-error.md"
BODIES = ROOT / "tests" / "bench" / "truth_set.csv"
STACK = pathlib.Path(os.environ.get("BONEPD_STACK", ROOT.parent / "shared/data/lhdl_3155_D_4_bc"))
KNOWN_TO = 0.02  # truths less certain than this are no measure: a strut that grazes an end plane, a crack of half a voxel
BLUR, SMOOTHING, NOISE_HU = 0.7, 0.5, 120  # voxels, voxels, HU of 2400

FE = ["--method", "voxel-fe"]
# Calls in one folder, so that a later one keeps the solves of an earlier one, and the rows to take: name, boundary, elements.
# {t} is the mean thickness of struts. No row: the answer.
CALLS = [
    (["--lp", "{t}"], [("floppy, LP t", "floppy", None), ("firm, LP t", "firm", None), ("FFB, LP t", "ffb", None)]),
    (["--lp", "{t/2}"], [("floppy, LP t/2", "floppy", None), ("firm, LP t/2", "firm", None), ("FFB, LP t/2", "ffb", None)]),
    (["--boundary", "connected", "--lp", "{t}"], [("connected, LP t", "graded", None)]),
    (["--boundary", "connected", "--lp", "{t/2}"], [("connected, LP t/2", "graded", None)]),
    ([*FE, "--coarsen", "2"], [("voxel FE, coarsen 2", "NA", "block-means")]),
    (FE, [("voxel FE", "NA", "voxels")]),
    ([*FE, "--refine", "2"], [("voxel FE, refine 2", "NA", "interpolated-grey")]),
    ([*FE, "--refine", "3"], [("voxel FE, refine 3", "NA", "interpolated-grey")]),
    *((["--error", f"{target}%"], [(f"--error {target}%", None, None)]) for target in (20, 10, 5, 3)),
]
# The same body once more: the scan moved by parts of a voxel, or turned about z. Of the first bodies, by the last calls.
REPEATED, REPEATS = 4, [{"shift-mm": "0.37;0.61;0.23"}, {"shift-mm": "0.71;0.29;0.53"}, {"turn-degrees": "17"}, {"turn-degrees": "41"}]
OF_MASKS = ("--refine", "--error")  # say nothing more of a mask than one element a voxel
SCANS = {
    "clean": ([], ["--lower", "200"]),
    "real": (["--blur", str(BLUR), "--noise-hu", str(NOISE_HU)], ["--lower", "200", "--gaussian", str(SMOOTHING), "--blur-voxels", str(BLUR)]),
    "mask": (None, ["--lower", "1"]),
}


class Bench:
    def __init__(self, program, work):
        self.program, self.work = program, pathlib.Path(work)

    def call(self, *words, fine=(0, 1)):
        """Ends the program where the call fails in another way than a target not met."""
        run = subprocess.run([self.program, *map(str, words), "--quiet", "--threads", "1"], capture_output=True, text=True)
        if run.returncode not in fine:
            sys.exit(f"{' '.join(map(str, words))}\n{run.stderr}")

    def phantom(self, body, out, refine=1, image=(), mask=None):
        """The scan of a body in voxels of 1 mm / refine."""
        words = ["--size-mm", body["voxels"], "--spacing-mm", 1 / refine, "--seed", body["seed"], "--force"]
        for key in ("body", "cell-mm", "bvtv", "fillet", "spread", "broken", "broken-gap", "crack-mm", "crack-share", "tilt-degrees", "turn-degrees"):
            if body.get(key) not in (None, ""):
                words += [f"--{key}", body[key]]
        shift = [float(v) * refine for v in (body.get("shift-mm") or "0;0;0").split(";")]
        if any(shift):
            words.append("--shift-voxels=" + ",".join(map(str, shift)))
        self.call("phantom", "-o", out, *words, *image, *(["--mask", mask] if mask else []))

    def modulus(self, image, segment, solve):
        folder = self.fresh()
        self.call("segment", image, "-o", folder, *segment)
        self.call("solve", folder, *solve)
        return float(rows_of(folder)[-1]["e_app_mpa"])

    def fresh(self):
        return pathlib.Path(tempfile.mkdtemp(dir=self.work))


def rows_of(folder):
    with open(folder / "results.csv") as file:
        return list(csv.DictReader(file))


def bodies(number):
    with open(BODIES) as file:
        return list(csv.DictReader(file))[:number]


def at_voxel_0(sizes, moduli):
    """From three sizes on least squares of E + c h, weights 1/h², uncertain by half the step from the finest or the scatter about
    the line. Of two sizes the finer, uncertain by their difference: there is no trend to follow (measured 0.0 ± 0.6 %)."""
    if len(sizes) < 3:
        return moduli[-1], abs(moduli[-1] - moduli[0])
    w = [1 / h**2 for h in sizes]
    x = sum(a * b for a, b in zip(w, sizes)) / sum(w)
    y = sum(a * b for a, b in zip(w, moduli)) / sum(w)
    slope = sum(a * (h - x) * (e - y) for a, h, e in zip(w, sizes, moduli)) / sum(a * (h - x) ** 2 for a, h in zip(w, sizes))
    limit = y - slope * x
    off = max(abs(e - limit - slope * h) for h, e in zip(sizes, moduli))
    return limit, max(0.5 * abs(moduli[-1] - limit), off)


def truths_of(bench, body, fourfold):
    """Moduli of the body and of its noise-free image, with uncertainties."""
    finer = (2, 3, 4) if fourfold else (2, 3)
    solve = ["--method", "voxel-fe"]
    # Seen by coarse voxels, then blurred and smoothed: variances add, and a voxel's own box has 1/12.
    variance = BLUR**2 + SMOOTHING**2 + 1 / 12
    of_body, of_image = [], []
    for n in finer:
        scan, mask = bench.work / "truth.nii.gz", bench.work / "truth-mask.nii.gz"
        blur = math.sqrt(n * n * variance - 1 / 12)
        bench.phantom(body, scan, n, ["--blur", blur], mask)
        of_body.append(bench.modulus(mask, ["--lower", "1"], solve))
        of_image.append(bench.modulus(scan, ["--lower", "200"], [*solve]))
    sizes = [1 / n for n in finer]
    return (*at_voxel_0(sizes, of_body), *at_voxel_0(sizes, of_image))


def make_truths(bench, number, fourfold, first=0):
    names = ["body", "half", "e_body_mpa", "uncertainty_body_mpa", "e_image_mpa", "uncertainty_image_mpa"]
    chosen = bodies(number)[first:]
    new = {body["name"] for body in chosen}
    kept = [row for row in read(REPORTS / "references.csv", lambda r: r["body"]).values() if row["body"] not in new] if first else []
    with open(REPORTS / "references.csv", "w") as file:
        file.write(",".join(names) + "\n")
        file.writelines(",".join(row[n] for n in names) + "\n" for row in kept)
        for body in chosen:
            values = truths_of(bench, body, fourfold)
            file.write(",".join([body["name"], body["half"], *(f"{v:.5g}" for v in values)]) + "\n")
            file.flush()
            print(body["name"], *(f"{v:.4g}" for v in values), flush=True)


def number(word):
    return math.nan if word in (None, "", "NA") else float(word)


def taken(folder, boundary, elements, length):
    """Modulus, stated error, whether a target was met, seconds: of the last such row, or of the answer."""
    if boundary is None:
        answer = json.loads((folder / "answer.json").read_text())
        return [answer["e_app_mpa"], answer["error_mpa"] or math.nan, answer["met"], answer["wall_s"]]
    fits = lambda row: row["boundary"] == boundary and (elements is None or row["elements"] == elements)
    near = lambda row: length is None or abs(float(row["lp_mm"]) / length - 1) < 0.01
    row = [row for row in rows_of(folder) if fits(row) and near(row)][-1]
    return [float(row["e_app_mpa"]), number(row["error_mpa"]), None, number(row["wall_s"])]


def measured(bench, folder, scan, calls=CALLS):
    """Every method on a segmented scan: name, modulus, stated error, met, seconds."""
    thickness = json.loads((folder / "segment.json").read_text())["results"]["mean_thickness_mm"]
    lengths = {"{t}": thickness, "{t/2}": thickness / 2}
    for call, rows in calls:
        if scan == "mask" and any(word in call for word in OF_MASKS):
            continue
        bench.call("solve", folder, *(f"{lengths[w]:.4f}" if w in lengths else w for w in call))
        length = next((lengths[w] for w in call if w in lengths), None)
        if "--refine" in call:
            length = float(rows_of(folder)[-1]["voxel_mm"].split(";")[0]) / int(call[-1])
        for name, boundary, elements in rows:
            yield name, *taken(folder, boundary, elements, length)


def segmented(bench, body, scan):
    phantom, segment = SCANS[scan]
    image, folder = bench.work / "scan.nii.gz", bench.fresh()
    if phantom is None:
        bench.phantom(body, bench.work / "unused.nii.gz", 1, (), image)
    else:
        bench.phantom(body, image, 1, phantom)
    bench.call("segment", image, "-o", folder, *segment)
    return folder


def make_rows(bench, number, scans):
    with open(REPORTS / "truth-set.csv", "w") as file:
        file.write("body,half,scan,method,e_app_mpa,error_mpa,met,seconds\n")

        def keep(body, half, scan, folder, calls=CALLS):
            for method, e, error, met, seconds in measured(bench, folder, scan, calls):
                file.write(f'{body},{half},{scan},"{method}",{e:.6g},{error:.4g},{met},{seconds:.3f}\n')
                file.flush()

        for body in bodies(number):
            for scan in scans:
                keep(body["name"], body["half"], scan, segmented(bench, body, scan))
            print(body["name"], flush=True)
        few = [call for call in CALLS if call[0] == FE or "10%" in call[0]]
        for body in bodies(min(number, REPEATED)):
            for i, change in enumerate(REPEATS, 1):
                keep(f"{body['name']}@{i}", body["half"], "real", segmented(bench, body | change, "real"), few)
        if STACK.exists():
            folder = bench.fresh()
            bench.call("segment", STACK, "-o", folder, "--spacing", 0.0195, "--gaussian", 1, "--lower", 63)
            keep("stack", "-", "real", folder)
        else:
            print(f"the stack is skipped: {STACK} is not there", file=sys.stderr)


def read(path, key):
    with open(path) as file:
        return {key(row): row for row in csv.DictReader(file)}


def well_known(truth):
    return float(truth["e_body_mpa"]) > 0 and all(float(truth[f"uncertainty_{of}_mpa"]) <= KNOWN_TO * float(truth[f"e_{of}_mpa"]) for of in ("body", "image"))


def load():
    """Truths by body, rows of bodies whose truth is known well, names of the others, rows of the stack."""
    truths = read(REPORTS / "references.csv", lambda r: r["body"])
    with open(REPORTS / "truth-set.csv") as file:
        every = list(csv.DictReader(file))
    of_bodies = [row for row in every if row["body"] in truths]
    rows = [row for row in of_bodies if well_known(truths[row["body"]])]
    left_out = sorted({row["body"] for row in of_bodies} - {row["body"] for row in rows})
    return truths, rows, left_out, [row for row in every if row["body"] not in truths]


def rms(values):
    return math.sqrt(statistics.fmean(v * v for v in values))


def off(row, truths, key="e_body_mpa"):
    return 100 * (float(row["e_app_mpa"]) / float(truths[row["body"]][key]) - 1)


def within(row, truths):
    truth, slack = (float(truths[row["body"]][k]) for k in ("e_body_mpa", "uncertainty_body_mpa"))
    return abs(float(row["e_app_mpa"]) - truth) <= float(row["error_mpa"]) + slack


def line(rows, truths):
    """Bias, scatter about it, RMS and worst against the body, RMS against the image, coverage, stated errors, targets met, seconds."""
    body, image = [off(r, truths) for r in rows], [off(r, truths, "e_image_mpa") for r in rows]
    stating = [r for r in rows if r["error_mpa"] != "nan"]
    stated = [100 * float(r["error_mpa"]) / max(float(r["e_app_mpa"]), 1e-30) for r in stating]
    covered = f"{sum(within(r, truths) for r in stating)} of {len(stating)}" if stating else "not stated"
    met = f"{sum(r['met'] == 'True' for r in rows)} of {len(rows)}" if rows[0]["met"] != "None" else ""
    seconds = statistics.median(float(r["seconds"]) for r in rows)
    return [
        f"{statistics.fmean(body):+.1f}", f"{statistics.pstdev(body):.1f}", f"{rms(body):.1f}", f"{statistics.median(map(abs, body)):.1f}", f"{max(body, key=abs):+.1f}", f"{rms(image):.1f}", covered,
        f"{statistics.median(stated):.1f}" if stated else "", f"{max(stated):.1f}" if stated else "", met, f"{seconds:.2f}",
    ]


HEAD = ["bias %", "scatter %", "RMS %", "median off %", "worst %", "RMS against image %", "within stated", "median stated %", "largest stated %", "met", "s"]


def table(head, lines):
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [head, ["---"] * len(head), *lines])


def points(rows, truths):
    """Median seconds and median error of every method."""
    out = {}
    for method in dict.fromkeys(r["method"] for r in rows):
        own = [r for r in rows if r["method"] == method]
        out[method] = (statistics.median(float(r["seconds"]) for r in own), statistics.median(abs(off(r, truths)) for r in own))
    return out


def front(points):
    """Methods with none both faster and nearer."""
    better = lambda a, b: a[0] <= b[0] and a[1] <= b[1] and a != b
    return sorted((p, m) for m, p in points.items() if not any(better(q, p) for q in points.values()))


def repeats(rows, again):
    """How far moduli of one body scatter over positions and turns of the scan."""
    lines = []
    for body in dict.fromkeys(row["body"].split("@")[0] for row in again):
        for method in dict.fromkeys(row["method"] for row in again):
            own = [r for r in rows + again if r["body"].split("@")[0] == body and (r["scan"], r["method"]) == ("real", method)]
            moduli = [float(r["e_app_mpa"]) for r in own]
            mean = statistics.fmean(moduli)
            stated = statistics.fmean(number(r["error_mpa"]) for r in own)
            lines.append([body, method, str(len(own)), f"{mean:.2f}", f"{100 * statistics.stdev(moduli) / mean:.1f}", f"{100 * stated / mean:.1f}"])
    return table(["body", "method", "scans", "mean MPa", "SD %", "stated %"], lines)


def tables():
    truths, rows, left_out, others = load()
    stack = [row for row in others if row["body"] == "stack"]
    out = {"repeats": repeats(rows, [row for row in others if "@" in row["body"]])}
    for scan in SCANS:
        own = [r for r in rows if r["scan"] == scan]
        if not own:
            continue
        methods = dict.fromkeys(r["method"] for r in own)
        out[scan] = table(["method", *HEAD], [[m, *line([r for r in own if r["method"] == m], truths)] for m in methods])
        halves = [(m, half, [r for r in own if (r["method"], r["half"]) == (m, half)]) for m in methods for half in "AB"]
        stating = [(m, half, some) for m, half, some in halves if some and any(r["error_mpa"] != "nan" for r in some)]
        out[f"{scan}-halves"] = table(["method", "half", *HEAD], [[m, half, *line(some, truths)] for m, half, some in stating])
        found = front(points(own, truths))
        out[f"{scan}-front"] = table(["on the Pareto front", "s", "median off %"], [[m, f"{t:.2f}", f"{e:.1f}"] for (t, e), m in found])
    stated = lambda r: "" if r["error_mpa"] == "nan" else f"{100 * float(r['error_mpa']) / float(r['e_app_mpa']):.1f}"
    out["stack"] = table(["method", "E_app MPa", "stated %", "s"], [[r["method"], f"{float(r['e_app_mpa']):.2f}", stated(r), r["seconds"]] for r in stack])
    names = ["e_body_mpa", "uncertainty_body_mpa", "e_image_mpa", "uncertainty_image_mpa"]
    out["truths"] = table(["body", "half", "body MPa", "±", "image MPa", "±"], [[n, t["half"], *(t[k] for k in names)] for n, t in truths.items()])
    out["left-out"] = f"Left out, their truth is uncertain by more than {100 * KNOWN_TO:.0f} %: {', '.join(left_out) or 'none'}."
    return out


def chart():
    try:
        import matplotlib
    except ImportError:
        print("no charts: matplotlib is not there", file=sys.stderr)
        return
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    truths, rows, _, _ = load()
    for scan, title in (("clean", "partial volumes"), ("real", "blur and noise")):
        own = points([r for r in rows if r["scan"] == scan], truths)
        figure, axes = plt.subplots(figsize=(7.5, 5))
        best = front(own)
        axes.plot([t for (t, _), _ in best], [e for (_, e), _ in best], "--", color="0.6")
        for method, (t, e) in own.items():
            shape, hue = ("s", "tab:blue") if "FE" in method else ("^", "tab:orange") if method.startswith("--") else ("o", "tab:green")
            axes.plot(t, e, shape, color=hue)
            axes.annotate(method, (t, e), xytext=(5, 3), textcoords="offset points", fontsize=8)
        axes.set(xscale="log", yscale="log", xlabel="median time of a solve, s (one core)", ylabel="median error against the body, %", title=f"Bodies seen with {title}")
        axes.margins(x=0.15)
        figure.tight_layout()
        (REPORTS / "speed-vs-error").mkdir(exist_ok=True)
        figure.savefig(REPORTS / "speed-vs-error" / f"{scan}.png", dpi=110)


def draw():
    text = PAGE.read_text()
    for key, words in tables().items():
        print(f"\n{key}\n{words}")
        text = re.sub(rf"(<!-- {key} -->\n).*?(<!-- end -->)", lambda m: m[1] + words + "\n" + m[2], text, flags=re.S)
    PAGE.write_text(text)
    chart()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", nargs="?")
    parser.add_argument("--bodies", type=int, default=16)
    parser.add_argument("--fourfold", action="store_true")
    parser.add_argument("--truths", action="store_true")
    parser.add_argument("--from", type=int, default=0, dest="first")
    parser.add_argument("--draw", action="store_true")
    parser.add_argument("--scans", default=",".join(SCANS))
    args = parser.parse_args()
    if not args.draw:
        if not args.program:
            parser.error("give the built program, or --draw")
        with tempfile.TemporaryDirectory() as work:
            bench = Bench(args.program, work)
            if args.truths or not (REPORTS / "references.csv").exists():
                make_truths(bench, args.bodies, args.fourfold, args.first)
            if args.first:
                return
            make_rows(bench, args.bodies, args.scans.split(","))
    draw()


if __name__ == "__main__":
    main()
