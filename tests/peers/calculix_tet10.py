"""Smooth elements against CalculiX (Debian: calculix-ccx), C3D10 tetrahedra, on exported models.

    cargo build --release && python3 tests/peers/calculix_tet10.py [PROGRAM]

Each model is solved here and there; the force of the moving grip from CalculiX's reaction forces must agree to 1e-5.
"""

import json
import pathlib
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
    axis = row["load"][-1] if row["load"].startswith("shear") else row["axis"]
    theirs = abs(calculix.calculix(folder, "geometry-fe")["xyz".index(axis)])
    ours = row["force_n"]
    off = ours / theirs - 1
    words = " ".join(flags) or "uniaxial, ends free"
    print(f"{name:13} {words:46} {row['unknowns']:7} unknowns  {ours:10.6f} N  CalculiX {theirs:10.6f}  {off:+.1e}")
    return abs(off)


def main():
    if calculix.is_missing():
        return
    worst = 0.0
    with tempfile.TemporaryDirectory() as temporary:
        for name, (n, spacing, bone) in calculix.SPECIMENS.items():
            base = calculix.segmented(temporary, name, n, spacing, bone, program=PROGRAM)
            worst = max([worst, *(compare(base, name, flags) for flags in LOADS)])
        n, spacing, bone = calculix.SPECIMENS["plates"]
        base = calculix.segmented(temporary, "mixed", n, spacing, calculix.two_tissues(bone), ["--labels", "1,2"], PROGRAM)
        worst = max([worst, *(compare(base, "mixed tissue", flags) for flags in MIXED)])
    print(f"largest difference {worst:.1e}")
    if worst > calculix.LIMIT:
        sys.exit(f"more than {calculix.LIMIT}")


if __name__ == "__main__":
    main()
