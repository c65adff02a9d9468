"""The Snakemake workflow gives the results of `bonepd-ct run`, and runs again only what changed.

    python3 -m venv venv && venv/bin/pip install snakemake
    cargo build --release
    venv/bin/python tests/peers/snakemake_cohort.py
"""

import csv
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release/bonepd-ct"
SNAKEMAKE = pathlib.Path(sys.executable).with_name("snakemake")
TIMES = ("wall_s", "peak_mib")

if not SNAKEMAKE.exists():
    sys.exit("skipped: no snakemake beside this python; pip install snakemake")


def rows(path):
    with open(path) as file:
        return [{k: v for k, v in row.items() if k not in TIMES} for row in csv.DictReader(file)]


def workflow(folder, *more):
    command = [
        SNAKEMAKE, "-s", ROOT / "pipelines/Snakefile", "--cores", "2", "--directory", folder, *more,
        "--config", f"program={PROGRAM}", f"recipe={ROOT / 'pipelines/quick.toml'}", "inputs=scans", "out=out",
    ]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    return done.stderr + done.stdout


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "scans").mkdir()
        for name in ("trabecular", "sparse", "dense"):
            shutil.copy(ROOT / f"sample_data/{name}.nii.gz", folder / "scans")
        (folder / "scans/broken.nii.gz").write_bytes(b"no scan")
        workflow(folder)
        assert "broken" in (folder / "out/failed.csv").read_text(), "the broken scan is not named"
        (folder / "scans/broken.nii.gz").unlink()
        workflow(folder)
        plain = [PROGRAM, "run", ROOT / "pipelines/quick.toml", "scans", "-o", "plain", "--quiet"]
        subprocess.run(plain, cwd=folder, check=True)
        same = rows(folder / "out/results.csv") == rows(folder / "plain/results.csv")
        assert same, "the workflow's rows are not those of `bonepd-ct run`"
        assert (folder / "out/report/report.html").is_file()
        assert "Nothing to be done" in workflow(folder), "an unchanged cohort was run again"
        time.sleep(1.1)
        (folder / "scans/sparse.nii.gz").touch()
        shutil.copy(ROOT / "sample_data/trabecular.nii.gz", folder / "scans/sparse.nii.gz")
        again = workflow(folder)
        ran = [line for line in again.splitlines() if line.strip().startswith("wildcards: scan=")]
        assert ran == ["    wildcards: scan=sparse"], f"expected only sparse to be run again: {ran}"
        print(f"ok: {len(rows(folder / 'out/results.csv'))} rows equal, only the changed scan ran again")


main()
