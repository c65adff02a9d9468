#!/usr/bin/env python3
"""Speed and error against the programs users have today, on the same masks in the same run.

usage: tests/peers/rivals.py [CASE ...]        (default: small; see CASES below for all)

    small            phantom of 2 mm at 0.05 mm, voxel FE: ParOSol, CalculiX
    thin[=SEED]      thin, hard phantom of about 1 M unknowns (BV/TV 12 %, struts of two voxels): ParOSol
    stack            the real stack coarsened twofold, ends bonded: ParOSol
    lattice=LP       the real stack (else a phantom) as SC floppy and firm lattices at nu = 1/4: LAMMPS
    protocol         bonepd-ct alone: the paper's eight lattices, the real stack (else a phantom) from file to report
    full             bonepd-ct alone: the real stack by voxel FE at full resolution
    batch            bonepd-ct alone: eight phantoms in one run, one, two and four scans at a time: share of the cores in use
    reference        the real stack at full resolution, ends free and bonded, to 1e-7: ParOSol (half an hour)

ParOSol is `parosol-py` (PyPI: pip install parosol-py, in the Python that runs this), CalculiX is `ccx` (Debian:
calculix-ccx), LAMMPS is `lmp` (Debian: lammps). What is missing is skipped with its reason.

Every program is timed whole, from its own input file to its own result, on all cores; LAMMPS only until its energy first
is within 0.1 % of the minimum, which it could not know: its minimisation alone against our solve (finding the sites and
multigrid's set-up included), and from its start against our whole command. CPU seconds stand beside the wall's, since they depend less on
what else the machine does; where it is busy, RANKS=1 keeps ParOSol's ranks from waiting for each other. Errors are those of E_app (LAMMPS: of the energy) against a
solve of the same problem here with the tolerance 1e-8, which ParOSol and CalculiX meet to five digits on `small`.
"""
import csv, gzip, os, pathlib, resource, shutil, struct, subprocess, sys, tempfile, time

import lammps as export

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = pathlib.Path(os.environ.get("BONEPD_CT", ROOT / "target/release/bonepd-ct"))
STACK = pathlib.Path(os.environ.get("BONEPD_STACK", ROOT.parent / "shared/data/lhdl_3155_D_4_bc"))
STACK_FLAGS = ["--spacing", "0.0195", "--gaussian", "1", "--lower", "63"]
CORES = len(os.sched_getaffinity(0))
RANKS = int(os.environ.get("RANKS", CORES))
REPEATS = 3             # of our own runs; the median is reported
YOUNG, POISSON, STRAIN = 1000.0, 0.3, -0.01

try:
    import numpy as np
except ImportError:
    print("skipped: needs numpy (pip install numpy)")
    sys.exit(0)


def ours(*words):
    subprocess.run([str(w) for w in (PROGRAM, *words)], check=True, capture_output=True)


def cpu():
    """CPU seconds of all children so far."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def timed(*words):
    """Wall and CPU seconds."""
    before, used = time.monotonic(), cpu()
    ours(*words)
    return time.monotonic() - before, cpu() - used


def median(times):
    """Of (wall, CPU) pairs, each for itself."""
    return tuple(sorted(t)[len(t) // 2] for t in zip(*times))


def rows(folder):
    return [row for row in csv.DictReader((folder / "results.csv").open()) if row["boundary"] != "ffb"]


def read_mask(folder):
    """The mask that `segment` left: bool array [z, y, x] and the voxel's edge in mm."""
    raw = gzip.open(folder / "mask.nii.gz").read()
    n, h = struct.unpack_from("<3h", raw, 42), struct.unpack_from("<f", raw, 80)[0]
    start = int(struct.unpack_from("<f", raw, 108)[0])
    return np.frombuffer(raw, np.uint8, n[0] * n[1] * n[2], start).reshape(n[::-1]) > 0, round(h, 9)


def write_nifti(path, mask, h):
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, *mask.shape[::-1], 1, 1, 1, 1)
    struct.pack_into("<2h", head, 70, 2, 8)
    struct.pack_into("<8f", head, 76, 1, h, h, h, 1, 1, 1, 1)
    struct.pack_into("<3f", head, 108, 352, 1, 0)
    head[123] = 2           # mm
    head[344:348] = b"n+1\0"
    path.write_bytes(bytes(head) + mask.astype(np.uint8).tobytes())


# --- voxel FE -----------------------------------------------------------------------------------------------------

VOXEL_FE = ["--method", "voxel-fe", "--ends", "bonded", f"--strain={STRAIN}", "--force"]


def voxel_fe(folder):
    """Ours: median wall time of the whole command, its row, and the converged modulus."""
    flags = VOXEL_FE
    walls = [timed("solve", folder, *flags) for _ in range(REPEATS)]
    row = rows(folder)[0]
    ours("solve", folder, *flags, "--tolerance", "1e-8")
    return median(walls), row, float(rows(folder)[0]["e_app_mpa"])


def as_exact(folder, error, exact):
    """Our median time with the first of ever smaller tolerances that leaves an error as small as `error`; the error."""
    for tolerance in ("1e-4", "3e-5", "1e-5", "3e-6", "1e-6", "3e-7", "1e-7", "3e-8", "1e-8"):
        times = timed("solve", folder, *VOXEL_FE, "--tolerance", tolerance)
        row = rows(folder)[0]
        if abs(float(row["e_app_mpa"]) / exact - 1) <= max(abs(error), 3e-8):
            more = [timed("solve", folder, *VOXEL_FE, "--tolerance", tolerance) for _ in range(REPEATS - 1)]
            return median([times, *more]), row, tolerance
    return None


def parosol(mask, h, folder, boundary_conditions=None):
    """Wall time, iterations and E_app (from the work of its own forces), or the reason for skipping."""
    try:
        import h5py
        from parosol_py.api import solve
    except ImportError as e:
        return f"skipped: {e} (pip install parosol-py)"
    result = solve(material=mask * YOUNG, spacing=(h,) * 3, poisson_ratio=POISSON, strain=STRAIN, tolerance=1e-6,
                   mpi_processes=RANKS, work_dir=folder / "parosol", outputs=("sed",), dry_run=True,
                   boundary_conditions=boundary_conditions)
    from parosol_py.runner import run_parosol
    command = [*result.command[:-1], result.input_file.name]
    before, used = time.monotonic(), cpu()
    ran = run_parosol(command, cwd=result.input_file.parent)
    wall = time.monotonic() - before, cpu() - used
    if ran.returncode != 0:
        return f"failed: {ran.stderr[-300:]}"
    with h5py.File(result.input_file) as f:
        work = (f["Solution/disp"][:].astype(float) * f["Solution/force"][:]).sum()
    # The work of the supports' forces is u K u; its residual inside the body is the solver's own tolerance.
    return wall, ran.summary.iterations, modulus(work, mask.shape, h)


def modulus(work, shape, h):
    nz, ny, nx = shape
    return work / (STRAIN ** 2 * nx * ny * nz * h ** 3)


def calculix(mask, h, folder):
    if shutil.which("ccx") is None:
        return "skipped: `ccx` is not on the PATH (Debian: apt-get install calculix-ccx)"
    deck = folder / "voxels.inp"
    write_deck(deck, mask, h)
    before, used = time.monotonic(), cpu()
    run = subprocess.run(["ccx", "-i", deck.stem], cwd=folder, capture_output=True, text=True,
                         env={**os.environ, "OMP_NUM_THREADS": str(CORES)})
    wall = time.monotonic() - before, cpu() - used
    lines = (folder / "voxels.dat").read_text().split("\n") if (folder / "voxels.dat").exists() else []
    totals = [line for line in lines if len(line.split()) == 3 and "E" in line.upper()]
    if run.returncode != 0 or not totals:
        return f"failed: {run.stdout[-300:]}"
    force = float(totals[-1].split()[2])
    return wall, 1, modulus(force * STRAIN * mask.shape[0] * h, mask.shape, h)


def write_deck(path, mask, h):
    """A CalculiX deck: one C3D8 (full integration) per voxel, both ends bonded, the top one moved."""
    nz, ny, nx = mask.shape
    cells = np.argwhere(mask)
    corners = np.array([(0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0), (1, 0, 0), (1, 0, 1), (1, 1, 1), (1, 1, 0)])
    number = lambda k, j, i: (k * (ny + 1) + j) * (nx + 1) + i + 1
    nodes = number(*np.moveaxis(cells[:, None] + corners, -1, 0))
    used = np.unique(nodes)
    with path.open("w") as out:
        out.write("*NODE\n")
        for n in used:
            k, rest = divmod(int(n) - 1, (ny + 1) * (nx + 1))
            j, i = divmod(rest, nx + 1)
            out.write(f"{n},{i * h:.9g},{j * h:.9g},{k * h:.9g}\n")
        out.write("*ELEMENT,TYPE=C3D8,ELSET=BONE\n")
        for e, row in enumerate(nodes):
            out.write(f"{e + 1}," + ",".join(map(str, row)) + "\n")
        plane = (used - 1) // ((ny + 1) * (nx + 1))
        for name, k in (("LOW", 0), ("HIGH", nz)):
            out.write(f"*NSET,NSET={name}\n" + "".join(f"{n},\n" for n in used[plane == k]))
        out.write(f"*MATERIAL,NAME=TISSUE\n*ELASTIC\n{YOUNG},{POISSON}\n*SOLID SECTION,ELSET=BONE,MATERIAL=TISSUE\n"
                  f"*STEP\n*STATIC\n*BOUNDARY\nLOW,1,3,0\nHIGH,1,2,0\nHIGH,3,3,{STRAIN * nz * h:.12g}\n"
                  "*NODE PRINT,NSET=HIGH,TOTALS=ONLY\nRF\n*END STEP\n")


def compare_voxels(title, folder, rivals):
    mask, h = read_mask(folder)
    (wall, used), row, exact = voxel_fe(folder)
    off = lambda e: f"{100 * (e / exact - 1):+.4f} %"
    e_app = float(row["e_app_mpa"])
    print(f"\n{title}: {int(row['sites']):,} hexahedra, {int(row['unknowns']):,} unknowns, E_app {exact:.4f} MPa")
    print(f"  bonepd-ct {wall:9.2f} s  {used:9.2f} CPU s  {row['iterations']:>6} iterations  error {off(e_app)}", flush=True)
    for name, rival in rivals:
        found = rival(mask, h, folder)
        if isinstance(found, str):
            print(f"  {name:9} {found}")
            continue
        (theirs, cpu_s), iterations, e = found
        print(f"  {name:9} {theirs:9.2f} s  {cpu_s:9.2f} CPU s  {iterations or 0:>6} iterations  error {off(e)}  "
              f"{theirs / wall:.1f} times the wall, {cpu_s / used:.1f} times the CPU time of bonepd-ct", flush=True)
        equal = as_exact(folder, e / exact - 1, exact)
        if equal:
            (again, again_cpu), row, tolerance = equal
            print(f"  at as small an error: bonepd-ct --tolerance {tolerance} {again:.2f} s, {again_cpu:.2f} CPU s, {row['iterations']} "
                  f"iterations, error {off(float(row['e_app_mpa']))}: {name} takes {theirs / again:.1f} times the wall, "
                  f"{cpu_s / again_cpu:.1f} times the CPU time", flush=True)


def small(folder, _):
    phantom(folder, "2", "0.05", "0.25", "0.2", 1)
    compare_voxels("small", folder, [("ParOSol", parosol), ("CalculiX", calculix)])


def thin(folder, seed):
    # Struts of two voxels at BV/TV 12 %.
    phantom(folder, THIN_MM, "0.02", "0.12", "0.04", int(seed or 1))
    compare_voxels(f"thin, seed {seed or 1}", folder, [("ParOSol", parosol)])


THIN_MM = "2.3"


def phantom(folder, size, spacing, bvtv, thickness, seed):
    scan = folder / "scan.nii.gz"
    ours("phantom", "-o", scan, "--size-mm", size, "--spacing-mm", spacing, "--bvtv", bvtv, "--thickness-mm", thickness,
         "--seed", seed)
    ours("segment", scan, "-o", folder, "--lower", "200")


def stack(folder, _):
    if not STACK.exists():
        print(f"stack: skipped: {STACK} is not there")
        return
    ours("segment", STACK, "-o", folder, *STACK_FLAGS)
    mask, h = read_mask(folder)
    n = [v // 2 for v in mask.shape]
    fraction = mask[:2 * n[0], :2 * n[1], :2 * n[2]].reshape(n[0], 2, n[1], 2, n[2], 2).mean((1, 3, 5))
    write_nifti(folder / "half.nii", fraction >= 0.5, 2 * h)
    ours("segment", folder / "half.nii", "-o", folder, "--lower", "0.5")
    compare_voxels("stack twofold", folder, [("ParOSol", parosol)])


# --- lattices -----------------------------------------------------------------------------------------------------

LAMMPS_SCRIPT = """\
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
thermo 10
thermo_style custom step elaplong cpu pe
thermo_modify norm no format 3 %.6f format 4 %.16g
min_style cg
minimize 0.0 0.0 {iterations} 1000000
"""
LAMMPS_ITERATIONS = 20000


def lammps_minimum(data, folder, strain, energy):
    """Seconds of LAMMPS's minimisation until its energy is first within 0.1 % of `energy`, iterations, energy, and seconds
    from its start."""
    bottom, top, lp = export.planes(data)
    script = folder / "in.race"
    script.write_text(LAMMPS_SCRIPT.format(data=data, u=strain * (top - bottom), bottom=bottom, top=top, cutoff=3 * lp,
                                           iterations=LAMMPS_ITERATIONS))
    launch = ["mpirun", "--allow-run-as-root", "--oversubscribe", "-np", str(RANKS)] if RANKS > 1 else []
    process = subprocess.Popen([*launch, "lmp", "-in", str(script), "-log", str(folder / "log.race")],
                               stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                               env={**os.environ, "OMP_NUM_THREADS": "1"})
    used, before = cpu(), time.monotonic()
    reached = last = None
    for line in process.stdout:
        words = line.split()
        try:
            step, _, wall_s, pe = int(words[0]), int(words[1]), float(words[2]), float(words[3])
        except (ValueError, IndexError):
            continue
        last = (wall_s, step, pe, time.monotonic() - before)
        if abs(pe / energy - 1) <= 1e-3:
            reached = last
            process.terminate()
            break
    process.wait()
    return reached, last, cpu() - used


def lattice(folder, lp):
    lp = lp or "0.12"
    if shutil.which("lmp") is None:
        print("lattice: skipped: `lmp` is not on the PATH (Debian: apt-get install lammps)")
        return
    if STACK.exists():
        ours("segment", STACK, "-o", folder, *STACK_FLAGS)
    else:
        phantom(folder, "4", "0.02", "0.25", "0.2", 1)
    ours("lattice", folder, "--lp", lp, "--export", "lammps")
    strain = export.STRAIN
    for boundary in ("floppy", "firm"):
        flags = ["--boundary", boundary, "--poisson", "0.25", f"--strain={strain}", "--force"]
        runs = []
        for _ in range(REPEATS):
            whole, used = timed("solve", folder, *flags, "--tolerance", "2e-4")
            row = rows(folder)[0]
            runs.append((float(row["wall_s"]), used, whole))
        wall, used, whole = median(runs)
        ours("solve", folder, *flags, "--tolerance", "1e-7")
        exact = rows(folder)[0]
        data = folder / f"lattice-sc-{boundary}-{exact['lp_mm']}.data"
        bottom, top, _ = export.planes(data)
        gauge = top - bottom
        area = float(exact["tv_mm3"]) / export.length_mm(folder)
        energy = lambda r: 0.5 * float(r["e_app_reaction_mpa"]) * area * strain ** 2 * gauge
        print(f"\nSC {boundary}, LP {exact['lp_mm']} mm: {int(exact['sites']):,} sites, energy {energy(exact):.6e} N mm")
        print(f"  bonepd-ct {wall:9.3f} s (the command {whole:.3f} s)  {used:9.2f} CPU s  {row['iterations']:>6} iterations  error of E_app "
              f"{100 * (float(row['e_app_mpa']) / float(exact['e_app_mpa']) - 1):+.4f} %", flush=True)
        reached, last, cpu_s = lammps_minimum(data, folder, strain, energy(exact))
        if reached:
            wall_s, step, pe, whole_s = reached
            print(f"  LAMMPS    {wall_s:9.3f} s  {cpu_s:9.2f} CPU s  {step:>6} iterations  error "
                  f"{100 * (pe / energy(exact) - 1):+.4f} %  {wall_s / wall:.1f} times the wall (from its start {whole_s / whole:.1f} times the command)"
                  f", {cpu_s / used:.1f} times the CPU time of bonepd-ct", flush=True)
        elif last:
            wall_s, step, pe, whole_s = last
            print(f"  LAMMPS    {wall_s:9.3f} s  {cpu_s:9.2f} CPU s  {step:>6} iterations  error "
                  f"{100 * (pe / energy(exact) - 1):+.4f} %  not within 0.1 %: more than {wall_s / wall:.1f} times the wall "
                  f"(from its start {whole_s / whole:.1f} times the command), {cpu_s / used:.1f} times the CPU time of bonepd-ct", flush=True)
        else:
            print("  LAMMPS    failed: see its log")


# --- alone --------------------------------------------------------------------------------------------------------

def protocol(folder, _):
    recipe = (ROOT / "pipelines/paper.toml").read_text()
    scan, flags = STACK, STACK_FLAGS[:2]
    if STACK.exists():
        for old, new in (("lower = 200.0", "lower = 63.0"), ("upper = 5600.0", ""), ("voxels = 0.0", "voxels = 1.0")):
            recipe = recipe.replace(old, new)
    else:
        scan, flags = folder / "scan.nii.gz", []
        ours("phantom", "-o", scan, "--size-mm", "4", "--spacing-mm", "0.02", "--bvtv", "0.25")
    (folder / "recipe.toml").write_text(recipe)
    walls = []
    for i in range(5):
        walls.append(timed("run", folder / "recipe.toml", scan, "-o", folder / f"out{i}", *flags))
    found = rows(folder / "out0")
    print(f"\nprotocol on {scan.name}: {len(found)} lattices, {sum(int(r['sites']) for r in found):,} sites, file to report "
          f"{median(walls)[0]:.2f} s, {median(walls)[1]:.2f} CPU s (medians of {len(walls)}; the least "
          f"{min(walls)[0]:.2f} s); the solves {sum(float(r['wall_s']) for r in found):.2f} s")
    for r in found:
        print(f"  {r['boundary']:7} LP {r['lp_mm']:5} {int(r['sites']):>8,} sites {r['iterations']:>4} iterations "
              f"{float(r['wall_s']):.3f} s  E_app {float(r['e_app_mpa']):.2f} MPa")


def full(folder, _):
    if not STACK.exists():
        print(f"full: skipped: {STACK} is not there")
        return
    ours("segment", STACK, "-o", folder, *STACK_FLAGS)
    walls = [timed("solve", folder, "--method", "voxel-fe", "--force") for _ in range(REPEATS)]
    row = rows(folder)[0]
    print(f"\nfull: {int(row['sites']):,} hexahedra, {int(row['unknowns']):,} unknowns, {row['iterations']} iterations, "
          f"{median(walls)[0]:.2f} s, {median(walls)[1]:.2f} CPU s, E_app {float(row['e_app_mpa']):.3f} ± "
          f"{float(row['algebraic_error_mpa']):.3f} MPa")


def batch(folder, _):
    scans = []
    for seed in range(1, 9):
        scan = folder / f"phantom-{seed}.nii.gz"
        ours("phantom", "-o", scan, "--size-mm", "3" if seed % 2 else "4", "--spacing-mm", "0.02", "--bvtv", f"{0.1 + 0.03 * seed}",
             "--seed", seed)
        scans.append(scan)
    recipe = (ROOT / "pipelines/paper.toml").read_text()
    (folder / "recipe.toml").write_text(recipe.replace("grip_mm = 0.6", "grip_mm = 0.0"))
    print("\nbatch: eight phantoms of 3 and 4 mm, the paper's eight lattices each")
    one_by_one = [timed("run", folder / "recipe.toml", scan, "-o", folder / f"alone-{scan.stem}") for scan in scans]
    wall, used = (sum(t) for t in zip(*one_by_one))
    print(f"  one run each {wall:7.2f} s  {used:7.2f} CPU s  {100 * used / wall / CORES:.0f} % of {CORES} cores", flush=True)
    for jobs in (1, 2, 4):
        wall, used = timed("run", folder / "recipe.toml", *scans, "-o", folder / f"jobs-{jobs}", "--jobs", jobs)
        print(f"  --jobs {jobs}     {wall:7.2f} s  {used:7.2f} CPU s  {100 * used / wall / CORES:.0f} % of {CORES} cores", flush=True)


def sliding_ends(mask, h):
    """Supports for ParOSol: both ends held along z only, and three values that keep the body from sliding and turning."""
    from parosol_py.core import BoundaryConditionSet
    nz, ny, nx = mask.shape
    held = {}
    for k, face, value in ((0, mask[0], 1e-16), (nz, mask[-1], STRAIN * nz * h)):
        nodes = np.zeros((ny + 1, nx + 1), bool)
        for dj in (0, 1):
            for di in (0, 1):
                nodes[dj:dj + ny, di:di + nx] |= face
        for j, i in np.argwhere(nodes):
            held[int(i), int(j), k, 2] = value
        if k == 0:
            on = np.argwhere(nodes)
            first, far = on[0], on[np.argmax(on[:, 1] - on[0][1])]
    # ParOSol takes a value of exactly 0 for none.
    held[int(first[1]), int(first[0]), 0, 0] = held[int(first[1]), int(first[0]), 0, 1] = 1e-16
    held[int(far[1]), int(far[0]), 0, 1] = 1e-16
    places = sorted(held)
    return BoundaryConditionSet(fixed_coordinates=np.asarray(places, np.uint16),
                                fixed_values=np.asarray([held[p] for p in places], np.float32), node_sets={})


def reference(folder, _):
    if not STACK.exists():
        print(f"reference: skipped: {STACK} is not there")
        return
    ours("segment", STACK, "-o", folder, *STACK_FLAGS)
    mask, h = read_mask(folder)
    for ends in ("free", "bonded"):
        ours("solve", folder, "--method", "voxel-fe", "--ends", ends, "--tolerance", "1e-7", "--force")
        row = rows(folder)[0]
        print(f"\nreference, ends {ends}: {int(row['sites']):,} hexahedra, {int(row['unknowns']):,} unknowns\n"
              f"  bonepd-ct E_app {float(row['e_app_mpa']):.4f} MPa", flush=True)
        try:
            found = parosol(mask, h, folder, sliding_ends(mask, h) if ends == "free" else None)
        except ImportError as e:
            found = f"skipped: {e} (pip install parosol-py)"
        if isinstance(found, str):
            print(f"  ParOSol   {found}")
        else:
            (wall, used), iterations, e = found
            print(f"  ParOSol   E_app {e:.4f} MPa, {iterations} iterations, {wall:.1f} s, {used:.1f} CPU s", flush=True)


CASES = {"reference": reference, "small": small, "thin": thin, "stack": stack, "lattice": lattice, "protocol": protocol, "full": full,
         "batch": batch}


def main():
    if not PROGRAM.exists():
        print(f"{PROGRAM} is not there: cargo build --release")
        return 2
    print(f"{CORES} cores")
    for word in sys.argv[1:] or ["small"]:
        name, _, value = word.partition("=")
        if name not in CASES:
            print(f"no case {name}; there are {', '.join(CASES)}")
            return 2
        with tempfile.TemporaryDirectory() as folder:
            CASES[name](pathlib.Path(folder), value)
    return 0


if __name__ == "__main__":
    sys.exit(main())
