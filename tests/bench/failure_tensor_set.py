#!/usr/bin/env python3
"""How far failure loads and stiffness tensors of one element a voxel lie from the body, and how often a stated error covers it.

    python3 tests/bench/failure_tensor_set.py target/release/bonepd-ct [--bodies 24] [--voxels 32] [--draw]

Bodies are the first of tests/bench/truth_set.csv, cut to small cubes (--voxels). Truth: the same body in voxels of 1/2 and 1/3, taken to
voxel 0 by the line through both; known to half the step from the finer. Bodies whose truth is less certain than 5 % are left out. Half A
sets the factor, half B reports. Writes reports/failure-tensor-set.csv and prints the table of reports/whole-bones.md.
"""

import argparse, csv, json, math, pathlib, sys, tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import truth_set

OUT = truth_set.REPORTS / "failure-tensor-set.csv"
NAMES = ["body", "half", "error", "e_app", "e_truth", "e_known", "failure", "failure_truth", "failure_known", "tensor_error", "tensor_known"]
KNOWN_TO = 0.05


def numbers(bench, body, refine):
    mask = bench.work / "mask.nii.gz"
    bench.phantom(body, bench.work / "scan.nii.gz", refine, [], mask)
    folder = bench.fresh()
    bench.call("segment", mask, "-o", folder, "--lower", "1")
    bench.call("solve", folder, "--method", "voxel-fe", "--failure")
    row = truth_set.rows_of(folder)[-1]
    bench.call("solve", folder, "--method", "voxel-fe", "--load", "stiffness", "--conditions", "mixed")
    tensor = json.loads((folder / "stiffness.json").read_text())["stiffness_mpa"]
    # Failure strain: the load over the modulus, so that both have no unit of length.
    number = truth_set.number
    area = (float(body["voxels"])) ** 2
    return number(row["e_app_mpa"]), number(row["error_mpa"]), number(row["failure_load_n"]) / area, tensor


def limit(half, third):
    """The line through sizes 1/2 and 1/3 at 0, and half the step from the finer."""
    at_0 = 3 * third - 2 * half
    return at_0, abs(at_0 - third) / 2


def measure(program, count, voxels):
    with tempfile.TemporaryDirectory() as work, open(OUT, "w") as file:
        bench = truth_set.Bench(program, work)
        file.write(",".join(NAMES) + "\n")
        for body in truth_set.bodies(count):
            body = {**body, "voxels": str(voxels)}
            try:
                one, half, third = (numbers(bench, body, n) for n in (1, 2, 3))
            except (SystemExit, KeyError, FileNotFoundError) as left_out:
                print(body["name"], "left out", str(left_out)[:120], flush=True)
                continue
            e_truth, e_known = limit(half[0], third[0])
            f_truth, f_known = limit(half[2], third[2])
            cells = [(i, j) for i in range(6) for j in range(6)]
            truth = {c: limit(half[3][c[0]][c[1]], third[3][c[0]][c[1]]) for c in cells}
            norm = math.sqrt(sum(v[0] ** 2 for v in truth.values()))
            off = math.sqrt(sum((one[3][i][j] - truth[i, j][0]) ** 2 for i, j in cells))
            known = math.sqrt(sum(v[1] ** 2 for v in truth.values()))
            values = [one[1] / one[0] if one[0] else math.nan, one[0], e_truth, e_known, one[2], f_truth, f_known, off / norm if norm else math.nan, known / norm if norm else math.nan]
            file.write(",".join([body["name"], body["half"], *(f"{v:.5g}" for v in values)]) + "\n")
            file.flush()
            print(body["name"], *(f"{v:.4g}" for v in values), flush=True)


def usable(rows, truth, known):
    return [r for r in rows if all(math.isfinite(r[k]) for k in (truth, known, "error")) and r[truth] > 0 and r["error"] > 0 and r[known] < KNOWN_TO * r[truth]]


def draw():
    with open(OUT) as file:
        rows = [{k: v if k in ("body", "half") else float(v) for k, v in r.items()} for r in csv.DictReader(file)]
    kinds = {
        "modulus": (usable(rows, "e_truth", "e_known"), lambda r: abs(r["e_app"] / r["e_truth"] - 1)),
        "failure load": (usable(rows, "failure_truth", "failure_known"), lambda r: abs(r["failure"] / r["failure_truth"] - 1)),
        "tensor (norm)": ([r for r in rows if math.isfinite(r["tensor_error"]) and r["tensor_known"] < KNOWN_TO and r["error"] > 0], lambda r: r["tensor_error"]),
    }
    print("| quantity | half | bodies | median off | 90 % of bodies off by less | off over stated error of E_app: median, largest | covered by the stated error of E_app |")
    print("|---|---|---|---|---|---|---|")
    for name, (chosen, off) in kinds.items():
        for half in "AB":
            own = [r for r in chosen if r["half"] == half]
            if not own:
                continue
            offs = sorted(off(r) for r in own)
            ratios = sorted(off(r) / r["error"] for r in own)
            covered = sum(r <= 1 for r in ratios) / len(ratios)
            print(f"| {name} | {half} | {len(own)} | {100 * offs[len(offs) // 2]:.1f} % | {100 * offs[int(0.9 * (len(offs) - 1))]:.1f} % | {ratios[len(ratios) // 2]:.2f}, {ratios[-1]:.2f} | {100 * covered:.0f} % |")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--bodies", type=int, default=24)
    parser.add_argument("--voxels", type=int, default=32)
    parser.add_argument("--draw", action="store_true")
    args = parser.parse_args()
    if not args.draw:
        measure(args.program, args.bodies, args.voxels)
    draw()
