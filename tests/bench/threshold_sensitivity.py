#!/usr/bin/env python3
"""The threshold sensitivity that one solve states, against finite differences.

    python3 tests/bench/threshold_sensitivity.py target/release/bonepd-ct [--bodies 0,2,4] [--method geometry-fe]

Bodies are those of truth_set.py. Of grey scans the threshold moves so that the bone volume changes by 1 % up and down; of masks the body itself is made
with 2 % more and less volume, which moves its surface by one length. Both ends are segmented and solved again. A line a body and scan: what
finite differences give, what is stated, by how much that is off.
"""

import argparse, json, math, pathlib, tempfile

import truth_set
from truth_set import SCANS, Bench, bodies, number, rms, rows_of, segmented

STEPS = 24


def volume(folder):
    return json.loads((folder / "segment.json").read_text())["results"]["bv_tv"]


def solved(bench, folder, method):
    bench.call("solve", folder, "--method", method, "--tolerance", "0.02%")
    row = rows_of(folder)[-1]
    return float(row["e_app_mpa"]), number(row["threshold_sensitivity"])


def at_threshold(bench, scan, lower):
    words = [*SCANS[scan][1]]
    words[words.index("--lower") + 1] = str(lower)
    folder = bench.fresh()
    bench.call("segment", bench.work / "scan.nii.gz", "-o", folder, *words)
    return folder


def with_volume(bench, scan, wanted, ends):
    """By bisection of the threshold."""
    low, high = ends
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        folder = at_threshold(bench, scan, middle)
        if abs(volume(folder) / wanted - 1) < 5e-4:
            break
        low, high = (middle, high) if volume(folder) > wanted else (low, middle)
    return folder


def differences(bench, body, scan, method):
    base = segmented(bench, body, scan)
    if scan == "mask":
        ends = [segmented(bench, body | {"bvtv": str(float(body["bvtv"]) * k)}, scan) for k in (0.98, 1.02)]
    else:
        ends = [with_volume(bench, scan, k * volume(base), limits) for k, limits in ((0.99, (200, 700)), (1.01, (-300, 200)))]
    _, stated = solved(bench, base, method)
    (low, _), (high, _) = (solved(bench, folder, method) for folder in ends)
    return math.log(high / low) / math.log(volume(ends[1]) / volume(ends[0])), stated


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--bodies", default="0,1,2,3,4,5,6,7,8,9,10,11,12,14,15", help="lines of truth_set.csv from 0")
    parser.add_argument("--method", default="voxel-fe")
    parser.add_argument("--scans", default=",".join(SCANS))
    args = parser.parse_args()
    every, off = bodies(64), {}
    with tempfile.TemporaryDirectory() as work:
        bench = Bench(pathlib.Path(args.program).resolve(), work)
        for body in (every[int(i)] for i in args.bodies.split(",")):
            for scan in args.scans.split(","):
                found, stated = differences(bench, body, scan, args.method)
                off.setdefault((body["half"], scan), []).append(100 * (stated / found - 1))
                print(f"{body['name']:22} {body['half']} {scan:5} differences {found:6.2f} stated {stated:6.2f} off {100 * (stated / found - 1):+6.1f} %", flush=True)
    for (half, scan), values in sorted(off.items()):
        print(f"half {half}, {scan}: RMS {rms(values):.1f} %, worst {max(values, key=abs):+.1f} %, within 25 %: {sum(abs(v) <= 25 for v in values)} of {len(values)}")


if __name__ == "__main__":
    main()
