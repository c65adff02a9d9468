#!/usr/bin/env python3
"""Lattices against LAMMPS (Debian package `lammps`): at ν = ¼ and small strain the exported lattice, minimised by
LAMMPS, must store the same elastic energy to 0.1 %.

usage: tests/peers/lammps.py [SCAN [SEGMENT FLAGS ...]]      (default: sample_data/trabecular.nii.gz)
Needs nothing but Python and `lmp` on the PATH; skips, with its reason, where LAMMPS is absent.
"""
import csv, pathlib, shutil, subprocess, sys, tempfile, time

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "target/release/bonepd-ct"
STRAIN = 4e-7           # tension, and small enough to be linear: floppy lattices buckle in compression
TOLERANCE = 1e-3

SCRIPT = """\
units lj
atom_style bond
boundary f f f
bond_style harmonic
pair_style none
comm_modify cutoff {cutoff}
read_data {data}
neighbor {cutoff} bin
neigh_modify exclude type 1 1 exclude type 1 2 exclude type 1 3 exclude type 2 2 exclude type 2 3 exclude type 3 3
group low type 2
group high type 3
displace_atoms all ramp z 0.0 {u} z {bottom} {top} units box
fix a low setforce NULL NULL 0.0
fix b high setforce NULL NULL 0.0
thermo 1000
thermo_style custom step pe
thermo_modify norm no format float %.16g
min_style cg
minimize 0.0 {ftol} 20000 200000
minimize 0.0 {ftol} 20000 200000
minimize 0.0 {ftol} 20000 200000
variable e equal pe
print "ENERGY ${{e}}"
"""


def run(*words):
    return subprocess.run([str(w) for w in words], check=True, capture_output=True, text=True)


def planes(data):
    """z of the innermost gripped planes, and the lattice parameter, from the data file."""
    lines = data.read_text().splitlines()
    lp = float(lines[0].split("LP ")[1].split()[0])
    start = lines.index("Atoms # bond") + 2
    low, high = [], []
    for line in lines[start:]:
        if not line:
            break
        _, _, kind, _, _, z = line.split()
        if kind == "2":
            low.append(float(z))
        if kind == "3":
            high.append(float(z))
    return max(low), min(high), lp


def lammps_energy(data, folder):
    bottom, top, lp = planes(data)
    u = STRAIN * (top - bottom)
    script = folder / "in.lattice"
    # Forces are about k u; a residual of 1e-6 of that leaves the energy exact to far below 0.1 %.
    script.write_text(SCRIPT.format(data=data, u=u, bottom=bottom, top=top, cutoff=3 * lp, ftol=1e-6 * 1000 * lp * abs(u)))
    before = time.monotonic()
    out = run("lmp", "-in", script, "-log", folder / "log").stdout
    wall = time.monotonic() - before
    return float(out.split("\nENERGY ")[1].split()[0]), top - bottom, wall


def main():
    if shutil.which("lmp") is None:
        print("skipped: `lmp` is not on the PATH (Debian: apt-get install lammps)")
        return 0
    scan = sys.argv[1] if len(sys.argv) > 1 else ROOT / "sample_data/trabecular.nii.gz"
    flags = sys.argv[2:] or ["--lower", "200", "--upper", "5600"]
    # Moduli by grey value, in more bins than matter: the stiffness of every bond is rounded by 0.05 % at most.
    mixed = ["--material", "linear:0.4,200", "--least-mpa", "100"]
    worst = max(compare(scan, flags, [], []), compare(scan, [*flags, "--keep-grey"], mixed, ["--bins", "4000"]))
    passed = worst <= TOLERANCE
    print(f"{'passed' if passed else 'FAILED'}: largest difference {100 * worst:.4f} % (allowed 0.1 %)")
    return 0 if passed else 1


def compare(scan, flags, tissue, bins):
    """The largest relative difference of energies, over structures and boundaries."""
    worst = 0.0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        run(PROGRAM, "segment", scan, "-o", folder, *flags)
        which = ["--structure", "sc,bcc,fcc", "--lp", "0.08", "--boundary", "firm,floppy"]
        run(PROGRAM, "lattice", folder, *which, "--export", "lammps", *tissue, *bins)
        run(PROGRAM, "solve", folder, "--poisson", "0.25", f"--strain={STRAIN}", "--tolerance", "1e-6", *tissue)
        for row in csv.DictReader((folder / "results.csv").open()):
            if row["boundary"] == "ffb":
                continue
            data = folder / f"lattice-{row['structure']}-{row['boundary']}-{row['lp_mm']}.data"
            theirs, gauge, wall = lammps_energy(data, folder)
            # E_app from the reaction equals that from the energy at the solution: 2 U L / (A u²).
            area = float(row["tv_mm3"]) / float(length_mm(folder))
            ours = 0.5 * float(row["e_app_reaction_mpa"]) * area * (STRAIN * gauge) ** 2 / gauge
            off = ours / theirs - 1
            worst = max(worst, abs(off))
            print(f"{row['structure']} {row['boundary']:7} {row['sites']:>7} sites  energy here {ours:.6e}  "
                  f"LAMMPS {theirs:.6e} N mm  difference {100 * off:+.4f} %  "
                  f"time here {float(row['wall_s']):.3f} s  LAMMPS {wall:.3f} s")
    return worst


def length_mm(folder):
    """Specimen length along z from the mask's header (a NIfTI-1 file: dim[3] at byte 46, pixdim[3] at byte 88)."""
    import gzip, struct
    head = gzip.open(folder / "mask.nii.gz").read(348)
    return struct.unpack_from("<h", head, 46)[0] * struct.unpack_from("<f", head, 88)[0]


if __name__ == "__main__":
    sys.exit(main())
