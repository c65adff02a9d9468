"""ParOSol finds the modulus of voxel FE on the same model, alone and over four ranks of MPI: export, its solve, and reading back.

    python3 -m venv venv && venv/bin/pip install parosol-py h5py nibabel
    cargo build --release
    venv/bin/python tests/peers/parosol.py

BONEPD_PROGRAM names another binary than that of target/release. The package brings its own mpirun.
"""

import csv
import io
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILT = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release/bonepd-ct"
PROGRAM = pathlib.Path(os.environ.get("BONEPD_PROGRAM", BUILT))
TOOL = ROOT / "pipelines/parosol.py"

try:
    import nibabel
    import numpy
    from parosol_py.runner import build_parosol_command, packaged_executable, run_parosol
except ImportError as e:
    sys.exit(f"skipped: {e}; pip install parosol-py h5py nibabel")


def ours(*words):
    subprocess.run([PROGRAM, *map(str, words), "--quiet"], check=True)


def tool(*words):
    done = subprocess.run([sys.executable, TOOL, *map(str, words)], check=True, capture_output=True, text=True)
    return done.stdout


# Four ranks on fewer cores, and as root in a container: Open MPI does neither unasked.
os.environ.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OMPI_MCA_rmaps_base_oversubscribe="1",
                  OMPI_MCA_mpi_yield_when_idle="1")


def compare(folder, ends, axis, scan="scan", here=(), there=(), ranks=1):
    model = folder / f"{scan}-{ends}-{axis}.h5"
    flags = ["--method", "voxel-fe", "--ends", ends, "--axis", axis, "--strain=-0.004", "--tolerance", "1e-8", "--force"]
    ours("solve", folder / scan, *flags, *here)
    with open(folder / scan / "results.csv") as file:
        row = [row for row in csv.DictReader(file) if (row["ends"], row["axis"]) == (ends, axis)][-1]
    tool("export", folder / scan, model, "--ends", ends, "--axis", axis, "--strain=-0.004", *there)
    command = build_parosol_command(executable=packaged_executable(), input_file=model.name, outputs=(), tolerance=1e-8, mpi_processes=ranks)
    ran = run_parosol(command, cwd=folder)
    if ran.returncode:
        sys.exit(f"FAILED   ParOSol: {ran.stderr[-500:]}")
    back = next(csv.DictReader(io.StringIO(tool("read", folder / scan, model))))
    expected = float(row["e_app_mpa"])
    worst = max(abs(float(back[key]) / expected - 1) for key in ("e_app_mpa", "e_app_reaction_mpa"))
    # ParOSol keeps displacements of the supports in single precision: 6e-8 at best.
    fine = worst < 1e-5
    cores = re.search(r"using cores in x: (\d+), y: (\d+), z: (\d+)", ran.stdout)
    fine = fine and math.prod(map(int, cores.groups())) == ranks
    print(f"{'ok      ' if fine else 'FAILED  '} {scan}, {ends} along {axis}, {ranks} rank{'s' * (ranks > 1)}: here {expected:.6f} MPa, ParOSol "
          f"{float(back['e_app_mpa']):.6f} from the energy, {float(back['e_app_reaction_mpa']):.6f} from the reaction")
    return fine


def labelled(folder):
    """The same bone, every third voxel of another tissue."""
    mask = nibabel.load(folder / "scan/mask.nii.gz")
    bone = numpy.asarray(mask.dataobj)
    x, y, z = numpy.indices(bone.shape)
    labels = (bone * (1 + (x + 2 * y + z) % 3 // 2)).astype(numpy.int16)
    nibabel.save(nibabel.Nifti1Image(labels, mask.affine), folder / "mixed.nii.gz")
    ours("segment", folder / "mixed.nii.gz", "-o", folder / "mixed", "--labels", "1,2")


def refused(folder):
    """Mixed tissue is not taken for one without a word."""
    words = [sys.executable, TOOL, "export", folder / "mixed", folder / "x.h5"]
    plain = subprocess.run(words, capture_output=True, text=True)
    half = subprocess.run([*words, "--labels", "1=800"], capture_output=True, text=True)
    fine = plain.returncode == half.returncode == 1 and "--labels" in plain.stderr and "no modulus for the labels 2" in half.stderr
    print(f"{'ok      ' if fine else 'FAILED  '} mixed tissue without its moduli is refused")
    return fine


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        size = ["--size-mm", "1.0,0.8,1.2", "--spacing-mm", "0.04", "--bvtv", "0.3"]
        ours("phantom", "-o", folder / "scan.nii.gz", *size)
        ours("segment", folder / "scan.nii.gz", "-o", folder / "scan", "--lower", "200")
        fine = [compare(folder, ends, axis) for ends, axis in (("bonded", "z"), ("bonded", "x"), ("free", "z"))]
        fine.append(compare(folder, "bonded", "z", ranks=4))
        labelled(folder)
        table = "1=800,2=2500"
        fine.append(compare(folder, "bonded", "z", "mixed", ["--material", f"labels:{table}"], ["--labels", table]))
        fine.append(refused(folder))
    sys.exit(0 if all(fine) else 1)


main()
