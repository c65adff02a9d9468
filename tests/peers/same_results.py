#!/usr/bin/env python3
"""Shows that two builds of the program come to the same numbers.

    python3 tests/peers/same_results.py OLD NEW            # two binaries

Runs `pipelines/quick.toml` on sample_data, voxel elements and lattices of every kind on one sample scan, and, where a folder of
slices is given by BONEPD_STACK or lies in ../shared/data/lhdl_3155_D_4_bc, `pipelines/paper.toml` and voxel elements on it.
Compares every cell of results.csv (and the matrix of stiffness.json) as text, except the clock and the memory (wall_s, peak_mib).
Exit 1 where a cell differs.
"""

import csv
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
STACK = Path(os.environ.get("BONEPD_STACK", ROOT / "../shared/data/lhdl_3155_D_4_bc"))
STACK_FLAGS = ["--spacing", "0.0195", "--gaussian", "1", "--lower", "63"]
MEASURED = {"wall_s", "peak_mib"}


def run(binary, *words):
    words = [str(word) for word in words]
    done = subprocess.run([binary, *words], capture_output=True, text=True)
    # 1: a solve did not converge, and its row says so.
    if done.returncode not in (0, 1):
        sys.exit(f"{binary} {' '.join(words)}: exit {done.returncode}\n{done.stderr}")


def quick(binary, out):
    run(binary, "run", ROOT / "pipelines/quick.toml", ROOT / "sample_data", "-o", out)


def sample(binary, out, *words):
    """One sample scan, under the settings that `words` are."""
    scan = ROOT / "sample_data/trabecular.nii.gz"
    run(binary, "segment", scan, "-o", out, "--otsu", "--keep-grey")
    run(binary, "solve", out, "--tolerance", "1%", *words)


def stack(binary, recipe, out, *words):
    recipe = ROOT / "pipelines" / recipe
    run(binary, "run", recipe, STACK, "-o", out, *STACK_FLAGS, *words)


CASES = {
    "quick.toml on sample_data": quick,
    "voxel-fe on a sample scan": lambda b, o: sample(b, o, "--method", "voxel-fe"),
    "voxel-fe, coarser, fields, mean failure load": lambda b, o: sample(
        b, o, "--method", "voxel-fe", "--coarsen", "2", "--fields", "sed,displacement", "--failure"
    ),
    "stiffness, kinematic": lambda b, o: sample(
        b, o, "--method", "voxel-fe", "--coarsen", "3", "--load", "stiffness"
    ),
    "stiffness, mixed": lambda b, o: sample(
        b, o, "--method", "voxel-fe", "--coarsen", "3", "--load", "stiffness", "--conditions", "mixed"
    ),
    "connected and weighted lattices, by the older word": lambda b, o: sample(
        b, o, "--structure", "sc,bcc,fcc", "--boundary", "graded", "--lp", "0.1,0.15,0.2"
    ),
    "confined and bonded lattices": lambda b, o: sample(
        b, o, "--lp", "0.15", "--load", "confined", "--ends", "bonded", "--poisson", "0.25"
    ),
    "mixed tissue, lattices": lambda b, o: sample(
        b, o, "--lp", "0.15", "--structure", "sc,bcc", "--material", "linear:1,0", "--least-mpa", "10"
    ),
    "mixed tissue, voxel-fe": lambda b, o: sample(
        b, o, "--method", "voxel-fe", "--material", "linear:1,0", "--least-mpa", "10"
    ),
    "to an error of 10 %": lambda b, o: sample(b, o, "--error", "10%"),
}
REAL = {
    "paper.toml on the stack": lambda b, o: stack(b, "paper.toml", o),
    "voxel-fe on the stack": lambda b, o: stack(b, "paper.toml", o, "--method", "voxel-fe"),
}


def table(out):
    """Rows as dictionaries without what is measured; the matrices of the folder beside them."""
    with open(out / "results.csv", newline="") as file:
        rows = [{k: v for k, v in row.items() if k not in MEASURED} for row in csv.DictReader(file)]
    matrices = [json.loads(p.read_text())["stiffness_mpa"] for p in sorted(out.rglob("stiffness.json"))]
    return rows, matrices


def differences(old, new):
    (old_rows, old_matrices), (new_rows, new_matrices) = old, new
    if len(old_rows) != len(new_rows):
        yield f"{len(old_rows)} rows, now {len(new_rows)}"
    for number, (a, b) in enumerate(zip(old_rows, new_rows), 1):
        # Columns that a newer program added say nothing of the old ones.
        for column in a:
            if a[column] != b.get(column, "no such column"):
                yield f"row {number}, {column}: {a[column]}, now {b.get(column, 'no such column')}"
    if old_matrices != new_matrices:
        yield "stiffness.json: another matrix"


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    old, new = (str(Path(word).resolve()) for word in sys.argv[1:3])
    wanted = sys.argv[3] if len(sys.argv) > 3 else ""
    cases = {name: case for name, case in {**CASES, **REAL}.items() if wanted in name}
    failed = False
    for name, case in cases.items():
        if name in REAL and not STACK.is_dir():
            print(f"{name}: skipped, no folder {STACK} (BONEPD_STACK names another)")
            continue
        tables = []
        with tempfile.TemporaryDirectory() as folder:
            for tag, binary in (("old", old), ("new", new)):
                case(binary, Path(folder) / tag)
                tables.append(table(Path(folder) / tag))
        found = list(differences(*tables))
        failed |= bool(found)
        print(f"{name}: {len(tables[0][0])} rows, " + ("the same" if not found else "DIFFERENT"))
        added = [c for c in tables[1][0][0] if c not in tables[0][0][0]] if tables[0][0] and tables[1][0] else []
        if added:
            print(f"    columns added: {', '.join(added)}")
        for words in found[:20]:
            print(f"    {words}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
