"""In vivo loads of the public tibia, from energy fields of ParOSol and Faim: the definition of docs/whole-bones.md by NumPy.

    python tests/peers/in_vivo.py FOLDER        (FOLDER has tibia/load_history_3-*-sed.nii.gz and tibia/labels.npz; skipped without)

The amplitudes that ParOSol's package published for its own fields are 134.721, 31.2135, 33.1796 N.
"""

import sys
from itertools import combinations
from pathlib import Path

LOADS = {"compression_z": 798.408, "shear_zx": 141.099, "shear_zy": 135.698}
PUBLISHED = (134.721, 31.2135, 33.1796)


def fit(columns, target):
    """Non-negative least squares by trying every set of loads, each by QR of the whole field (the program has normal equations)."""
    import numpy as np

    best = None
    for size in range(1, columns.shape[1] + 1):
        for chosen in combinations(range(columns.shape[1]), size):
            part = columns[:, chosen]
            x, *_ = np.linalg.lstsq(part, np.full(len(part), target), rcond=None)
            if (x >= 0).all():
                rest = float(((part @ x - target) ** 2).sum())
                if best is None or rest < best[0]:
                    factors = np.zeros(columns.shape[1])
                    factors[list(chosen)] = x
                    best = (rest, factors)
    return best[1]


def main():
    if len(sys.argv) < 2 or not (Path(sys.argv[1]) / "tibia").is_dir():
        print("skipped: name the folder of the public data")
        return 0
    try:
        import nibabel
        import numpy as np
    except ImportError as missing:
        print(f"skipped: {missing}")
        return 0
    tibia = Path(sys.argv[1]) / "tibia"
    for engine in ("parosol-py", "faim"):
        fields = [nibabel.load(tibia / f"load_history_3-{engine}-{name}-sed.nii.gz").get_fdata() for name in LOADS]
        bone = np.logical_or.reduce([field > 0 for field in fields])
        columns = []
        for field, load in zip(fields, LOADS.values()):
            unit = field[bone] / load**2
            columns.append(np.minimum(unit, np.percentile(unit, 95)))
        columns = np.stack(columns, axis=1)
        factors = fit(columns, 0.02)
        combined = columns @ factors
        combined = np.minimum(combined, np.percentile(combined, 95))
        amplitudes = np.sqrt(factors)
        off = [a / p - 1 for a, p in zip(amplitudes, PUBLISHED)]
        print(engine, "amplitudes (N)", *(f"{a:.3f}" for a in amplitudes), "off", *(f"{100 * o:+.2f} %" for o in off))
        print("   mean and sd of the combined field (MPa)", f"{combined.mean():.6f} {combined.std():.6f}", "voxels", bone.sum())
        strain = np.percentile(np.sqrt(2 * combined / 8748), 98)
        print("   effective strain at 2 %", f"{strain:.8f}", "factor", f"{0.007 / strain:.5f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
