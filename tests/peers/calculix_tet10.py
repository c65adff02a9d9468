"""Smooth elements against CalculiX (Debian: calculix-ccx), C3D10 tetrahedra, on exported models.

    cargo build --release && python3 tests/peers/calculix_tet10.py [PROGRAM]

Each model is solved here and there; the force of the moving grip from CalculiX's reaction forces must agree to 1e-5.
"""

import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import calculix

PROGRAM = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else calculix.PROGRAM
LOADS = [
    [],
    ["--ends", "bonded"],
    ["--load", "confined"],
    ["--axis", "x"],
    ["--grip-mm", "0.07", "--poisson", "0.1"],
    ["--grip-mm", "0.05", "--ends", "bonded"],
    ["--load", "shear-x"],
    ["--load", "shear-y", "--grip-mm", "0.05"],
]
MIXED = [["--material", "labels:1=800/0.3,2=2500/0.3"], ["--material", "labels:1=800/0.3,2=2500/0.3", "--ends", "bonded"]]


def compare(folder, name, flags):
    command = [PROGRAM, "solve", folder, "--method", "geometry-fe", "--tolerance", "1e-9", "--export", "inp", "--json", "--force", "--element-mm", "0.03"]
    run = subprocess.run([*command, *flags], capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(f"{name} {flags}: {run.stderr}")
    row = json.loads(run.stdout)[-1]
    run = subprocess.run(["ccx", "geometry-fe"], cwd=folder, capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(f"ccx failed: {run.stdout[-2000:]}{run.stderr[-500:]}")
    text = (folder / "geometry-fe.dat").read_text()
    found = re.search(r"total force \(fx,fy,fz\) for set HIGH[^\n]*\n\s*\n([^\n]+)", text)
    axis = row["load"][-1] if row["load"].startswith("shear") else row["axis"]
    theirs = abs(float(found.group(1).split()["xyz".index(axis)]))
    ours = row["force_n"]
    off = ours / theirs - 1
    words = " ".join(flags) or "uniaxial, ends free"
    print(f"{name:13} {words:46} {row['unknowns']:7} unknowns  {ours:10.6f} N  CalculiX {theirs:10.6f}  {off:+.1e}")
    return abs(off)


def main():
    if shutil.which("ccx") is None:
        print("skipped: ccx is not installed (Debian: calculix-ccx)")
        return
    worst = 0.0
    with tempfile.TemporaryDirectory() as temporary:
        for name, (n, spacing, bone) in calculix.SPECIMENS.items():
            base = pathlib.Path(temporary) / name.replace(" ", "-").replace(":", "-")
            calculix.nifti(base.with_suffix(".nii"), n, spacing, bone)
            subprocess.run([PROGRAM, "segment", base.with_suffix(".nii"), "-o", base, "--lower", "1", "--quiet"], check=True)
            worst = max([worst, *(compare(base, name, flags) for flags in LOADS)])
        n, spacing, bone = calculix.SPECIMENS["plates"]
        base = pathlib.Path(temporary) / "mixed"
        calculix.nifti(base.with_suffix(".nii"), n, spacing, lambda x, y, z: bone(x, y, z) * (1 + (x + 2 * y + z) % 3 // 2))
        subprocess.run([PROGRAM, "segment", base.with_suffix(".nii"), "-o", base, "--labels", "1,2", "--quiet"], check=True)
        worst = max([worst, *(compare(base, "mixed tissue", flags) for flags in MIXED)])
    print(f"largest difference {worst:.1e}")
    if worst > calculix.LIMIT:
        sys.exit(f"more than {calculix.LIMIT}")


if __name__ == "__main__":
    main()
