"""Voxel elements against CalculiX (Debian: calculix-ccx), C3D8 bricks with full integration, on exported models.

    cargo build --release && python3 tests/peers/calculix.py

Each model is solved here and there; E_app, force or moment from CalculiX's reaction forces must agree to 1e-5.
"""

import csv
import json
import os
import pathlib
import random
import re
import shutil
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "target/release/bonepd-ct"
# CalculiX prints forces to seven digits; moments are sums of them.
LIMIT = 1e-5


def nifti(path, n, spacing, bone):
    """A NIfTI-1 volume of 0 and 1, x fastest."""
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, *n, 1, 1, 1, 1)
    struct.pack_into("<hh", head, 70, 2, 8)
    struct.pack_into("<8f", head, 76, 1, *spacing, 0, 0, 0, 0)
    struct.pack_into("<fff", head, 108, 352, 1, 0)
    head[123] = 2  # mm
    head[344:348] = b"n+1\0"
    voxels = bytes(bone(x, y, z) for z in range(n[2]) for y in range(n[1]) for x in range(n[0]))
    path.write_bytes(bytes(head) + voxels)


def struts(seed, cell, thick, broken):
    """Struts on a grid of cells, some of them broken; plates where the draw says so."""
    draw = random.Random(seed)
    missing = {}

    def bone(x, y, z):
        p = (x, y, z)
        thin = [v % cell < thick for v in p]
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            key = (a, p[a] // cell, p[b] // cell, p[c] // cell)
            if key not in missing:
                missing[key] = draw.random() < broken
            if thin[b] and thin[c] and (thin[a] or not missing[key]):
                return 1
        return 0

    return bone


def waves(x, y, z):
    from math import cos, sin

    k = 0.45
    return int(abs(sin(k * x) * cos(k * y) + sin(k * y) * cos(k * z) + sin(k * z) * cos(k * x)) < 0.45)


SPECIMENS = {
    "struts": ((20, 20, 20), (0.02, 0.02, 0.02), struts(1, 7, 2, 0.3)),
    "struts 1:1:3": ((22, 20, 12), (0.02, 0.02, 0.06), struts(2, 6, 2, 0.2)),
    "plates": ((18, 20, 22), (0.021, 0.02, 0.018), waves),
}
LOADS = [
    [],
    ["--ends", "bonded"],
    ["--load", "confined"],
    ["--axis", "x"],
    ["--grip-mm", "0.08", "--poisson", "0.1"],
    ["--refine", "2", "--ends", "bonded"],
]


# Both ends held in all components, whole decks by their own numbers.
MOVED = [
    ["--load", "shear-x"],
    ["--load", "shear-y", "--grip-mm", "0.04"],
    ["--load", "shear-z", "--axis", "x"],
    ["--load", "bending-x"],
    ["--load", "bending-y", "--angle-deg", "3"],
    ["--load", "torsion"],
    ["--load", "torsion", "--axis", "y", "--angle-deg", "-2"],
]


# Tissue that differs: value 2 in every third voxel, and one modulus per coarsened element.
MIXED = [
    ["--material", "labels:1=800/0.3,2=2500/0.2"],
    ["--material", "linear:300,500", "--axis", "y", "--ends", "bonded"],
    ["--coarsen", "2"],
    ["--coarsen", "2", "--coarsen-by", "fraction", "--bins", "1000"],
]
STACK = pathlib.Path(os.environ.get("BONEPD_STACK", ROOT.parent / "shared/data/lhdl_3155_D_4_bc"))
CROP = ["--spacing", "0.0195", "--gaussian", "1", "--lower", "63", "--crop", "60:96,60:96,80:116"]


def is_missing():
    """Says so where CalculiX is not installed."""
    missing = shutil.which("ccx") is None
    if missing:
        print("skipped: ccx is not installed (Debian: calculix-ccx)")
    return missing


def segmented(temporary, name, n, spacing, bone, words=("--lower", "1"), program=PROGRAM):
    """A folder with the body, segmented."""
    base = pathlib.Path(temporary) / name.replace(" ", "-").replace(":", "-")
    scan = base.with_suffix(".nii")
    nifti(scan, n, spacing, bone)
    subprocess.run([program, "segment", scan, "-o", base, "--quiet", *words], check=True)
    return base


def two_tissues(bone):
    """The same bone in labels 1 and 2."""
    return lambda x, y, z: bone(x, y, z) * (1 + (x + 2 * y + z) % 3 // 2)


def run_calculix(folder, deck="voxel-fe"):
    """What CalculiX prints of the exported model."""
    run = subprocess.run(["ccx", deck], cwd=folder, capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(f"ccx failed: {run.stdout[-2000:]}{run.stderr[-500:]}")
    return (folder / f"{deck}.dat").read_text()


def calculix(folder, deck="voxel-fe"):
    """The force of the moving grip along x, y, z in N, at the end of the load."""
    text = run_calculix(folder, deck)
    found = re.findall(r"total force \(fx,fy,fz\) for set HIGH[^\n]*\n\s*\n([^\n]+)", text)
    return [float(v) for v in found[-1].split()]


def moment(folder, about):
    """The moment of the moving grip in N mm about a point."""
    blocks = (folder / "voxel-fe.inp").read_text().split("*NODE, NSET=ALL\n", 1)[1].split("*", 1)[0]
    places = {}
    for line in blocks.strip().split("\n"):
        node, *place = line.split(",")
        places[int(node)] = [float(v) for v in place]
    total = [0.0, 0.0, 0.0]
    for line in run_calculix(folder).split("\n"):
        words = line.split()
        if len(words) != 4 or not words[0].isdigit():
            continue
        f = [float(v) for v in words[1:]]
        r = [p - q for p, q in zip(places[int(words[0])], about)]
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            total[a] += r[b] * f[c] - r[c] * f[b]
    return total


def compare_moved(folder, name, flags):
    """Shear, bending, torsion: what the upper end bears, from the reactions of both programs."""
    command = [PROGRAM, "solve", folder, "--method", "voxel-fe", "--tolerance", "1e-13", "--export", "inp", "--json"]
    run = subprocess.run([*command, "--force", *flags], capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(f"{name} {flags}: {run.stderr}")
    row = json.loads(run.stdout)[-1]
    with open(folder / "reactions.csv", newline="") as file:
        lines = [line for line in csv.DictReader(file) if line["load"] == row["load"] and line["end"] == "upper"]
    upper = next(line for line in reversed(lines) if line["axis"] == row["axis"])
    about = {"shear": "xyz", "bending": "xyz"}.get(row["load"].split("-")[0])
    axis = "xyz".index(row["load"][-1] if about else row["axis"])
    if row["load"].startswith("shear"):
        ours, theirs, unit = float(upper[f"force_{'xyz'[axis]}_n"]), calculix(folder)[axis], "N"
    else:
        middle = [float(upper[f"about_{a}_mm"]) for a in "xyz"]
        ours, theirs, unit = float(upper[f"moment_{'xyz'[axis]}_nmm"]), moment(folder, middle)[axis], "N mm"
    off = ours / theirs - 1
    print(f"{name:13} {' '.join(flags):34} {row['unknowns']:7} unknowns  {ours:10.5f} {unit}  CalculiX {theirs:10.5f}  {off:+.1e}")
    return abs(off)


def compare(folder, name, flags):
    command = [PROGRAM, "solve", folder, "--method", "voxel-fe", "--tolerance", "1e-8", "--export", "inp", "--json"]
    run = subprocess.run([*command, *flags], capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(f"{name} {flags}: {run.stderr}")
    row = json.loads(run.stdout)[-1]
    axis = "xyz".index(row["axis"])
    head = (folder / "voxel-fe.inp").read_text().split("\n", 1)[0]
    gauge, moved = (float(v) for v in re.search(r"HIGH x (\S+) mm / \(area x (\S+) mm\)", head).groups())
    record = json.loads((folder / "segment.json").read_text())
    n, h = record["results"]["voxels"], record["results"]["spacing_mm"]
    area = row["tv_mm3"] / (n[axis] * h[axis])
    theirs = calculix(folder)[axis] * gauge / (area * moved)
    ours = row["e_app_mpa"]
    off = ours / theirs - 1
    words = " ".join(flags) or "uniaxial, ends free"
    print(f"{name:13} {words:34} {row['unknowns']:7} unknowns  {ours:10.5f} MPa  CalculiX {theirs:10.5f}  {off:+.1e}")
    return abs(off)


def main():
    if is_missing():
        return
    worst = 0.0
    with tempfile.TemporaryDirectory() as temporary:
        for name, (n, spacing, bone) in SPECIMENS.items():
            base = segmented(temporary, name, n, spacing, bone)
            worst = max([worst, *(compare(base, name, flags) for flags in LOADS)])
            worst = max([worst, *(compare_moved(base, name, flags) for flags in MOVED)])
        n, spacing, bone = SPECIMENS["plates"]
        base = segmented(temporary, "mixed", n, spacing, two_tissues(bone), ["--labels", "1,2"])
        worst = max([worst, *(compare(base, "mixed tissue", flags) for flags in MIXED)])
        if STACK.is_dir():
            base = pathlib.Path(temporary) / "stack"
            subprocess.run([PROGRAM, "segment", STACK, "-o", base, "--quiet", *CROP], check=True)
            worst = max([worst, *(compare(base, "real bone", flags) for flags in LOADS[:3])])
        else:
            print(f"skipped: {STACK} is not here")
    print(f"largest difference {worst:.1e}")
    if worst > LIMIT:
        sys.exit(f"more than {LIMIT}")


if __name__ == "__main__":
    main()
