#!/usr/bin/env python3
"""What is off of geometry-based FE: elements, the image's voxels, or the truth. One BCC cell in a box of 24 voxels, blurred, without noise.

    python3 tests/bench/element_error.py target/release/bonepd-ct      # about four minutes of one core

The same blurred body is seen by voxels of 1, 1/2, 1/3 and 1/4. Each image is solved by voxel FE, and the first three by geometry-based FE with elements of
1.5 and 0.75 (0.46 and 0.23 of the thickness `2 BV / BS`). The images of 1/3 and 1/4 are solved once more in voxels of half the size. Writes reports/element-error.csv.
"""

import csv, math, pathlib, sys, tempfile

from truth_set import BLUR, REPORTS, SMOOTHING, Bench, rows_of

BODY = {"voxels": "24", "seed": "3", "body": "bcc", "cell-mm": "24", "bvtv": "0.23", "fillet": "0.5"}
VARIANCE = BLUR**2 + SMOOTHING**2 + 1 / 12  # as in truth_set.truths_of
EXACT = ["--tolerance", "0.02%"]


def main():
    with tempfile.TemporaryDirectory() as work, open(REPORTS / "element-error.csv", "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["voxel", "method", "element_mm", "e_app_mpa", "model_bv_tv", "seconds"])
        bench = Bench(pathlib.Path(sys.argv[1]).resolve(), work)

        def keep(folder, voxel, method, *size, refine=()):
            bench.call("solve", folder, "--method", method, *EXACT, *(["--element-mm", *size] if size else refine))
            row = rows_of(folder)[-1]
            bone = row["model_bv_tv"] if method == "geometry-fe" else row["bv_tv"]
            out.writerow([voxel, method, *(size or ["NA"]), f"{float(row['e_app_mpa']):.5g}", f"{float(bone):.6g}", f"{float(row['wall_s']):.3g}"])
            file.flush()

        for n in (1, 2, 3, 4):
            scan, folder = bench.work / "scan.nii.gz", bench.fresh()
            bench.phantom(BODY, scan, n, ["--blur", math.sqrt(n * n * VARIANCE - 1 / 12)])
            bench.call("segment", scan, "-o", folder, "--lower", 200)
            keep(folder, f"1/{n}", "voxel-fe")
            if n > 2:
                keep(folder, f"1/{n} by --refine 2", "voxel-fe", refine=["--refine", 2])
            for size in (1.5, 0.75) if n < 4 else ():
                keep(folder, f"1/{n}", "geometry-fe", size)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main()
