"""A segmented scan as input of ParOSol, and ParOSol's answer as an apparent modulus.

For models too large for one machine: ParOSol runs on thousands of cores (https://github.com/reox/parosol-tu-wien;
`pip install parosol-py`). Needs numpy, nibabel and h5py; the program itself needs none of them.

    bonepd-ct segment scan.nii.gz -o out --lower 200
    python3 pipelines/parosol.py export out model.h5 --young-mpa 1000 --poisson 0.3 --strain -0.01
    mpirun -np 512 parosol --tol 1e-6 model.h5                    # adds /Solution to the file
    python3 pipelines/parosol.py read out model.h5                # one line of CSV: E_app from the energy and the reaction

Of a scan segmented by labels, `--labels 100=6829,127=10000` gives each its modulus; ParOSol has one Poisson's ratio.

One cubic element per bone voxel, in ParOSol's layout: arrays z, y, x; moduli in GPa (forces come out in N with lengths in mm);
coordinates of nodes as z, y, x and the direction (0 x, 1 y, 2 z). The faces across the load axis are bonded, or with
`--ends free` may slide: nothing holds the body sideways then, and conjugate gradients leave its rigid motions alone.
"""

import argparse
import json
import pathlib
import sys

import h5py
import nibabel
import numpy

AXES = "xyz"


def specimen(folder):
    """Mask (x, y, z), voxel size in mm, TV in mm³, and whether the scan was segmented by labels."""
    whole = json.loads((folder / "segment.json").read_text())
    record = whole["results"]
    mask = numpy.asarray(nibabel.load(folder / "mask.nii.gz").dataobj) > 0
    spacing = record["spacing_mm"]
    if max(spacing) / min(spacing) - 1 > 1e-3:
        sys.exit(f"{folder}: ParOSol's voxels are cubes, these are {spacing} mm: resample the scan first")
    if max(mask.shape) > 32766:
        sys.exit(f"{folder}: {mask.shape} voxels, ParOSol counts to 32767 a side: crop the scan first")
    return mask, float(numpy.mean(spacing)), record["tv_mm3"], bool(whole["settings"]["labels"])


def moduli(arguments, mask, labelled):
    """Young's modulus in MPa by voxel, 0 in pores."""
    grey = arguments.dir / "grey.nii.gz"
    if arguments.labels is None:
        if labelled and not arguments.one_tissue:
            sys.exit(f"{arguments.dir}: is segmented by labels, so that tissue may differ from voxel to voxel: give --labels VALUE=E,… "
                     "(of other laws ParOSol knows none; `bonepd-ct solve --export inp` writes them), or --one-tissue to take "
                     f"{arguments.young_mpa} MPa everywhere")
        return mask * arguments.young_mpa
    if not labelled or not grey.exists():
        sys.exit(f"{arguments.dir}: holds no labels: run `bonepd-ct segment` with --labels, or leave --labels out here")
    values = numpy.asarray(nibabel.load(grey).dataobj)
    young = numpy.zeros(mask.shape)
    for value, modulus in arguments.labels.items():
        young[mask & (values == value)] = modulus
    strange = numpy.unique(values[mask & (young == 0)])
    if len(strange):
        sys.exit(f"{arguments.dir}: no modulus for the labels {', '.join(f'{v:g}' for v in strange[:5])}: add them to --labels")
    return young


def labels(words):
    """`VALUE=E,…`, moduli above 0 in MPa."""
    try:
        table = {float(value): float(modulus) for value, modulus in (word.split("=") for word in words.split(","))}
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected VALUE=E,… (one Poisson's ratio serves all), found {words}") from None
    if not all(0 < modulus < float("inf") for modulus in table.values()):
        raise argparse.ArgumentTypeError(f"expected moduli above 0 in MPa, found {words}")
    return table


def end_nodes(mask, axis, top):
    """Nodes of the bone on one face, as x, y, z."""
    face = numpy.take(mask, -1 if top else 0, axis=axis)
    nodes = numpy.zeros([n + 1 for n in face.shape], dtype=bool)
    for di in (0, 1):
        for dj in (0, 1):
            nodes[di:di + face.shape[0], dj:dj + face.shape[1]] |= face
    inside = numpy.argwhere(nodes)
    return numpy.insert(inside, axis, mask.shape[axis] if top else 0, axis=1)


def held(mask, axis, ends, displacement):
    """Coordinates (x, y, z, direction) and values of the prescribed displacements."""
    coordinates, values = [], []
    for top in (False, True):
        nodes = end_nodes(mask, axis, top)
        for direction in range(3):
            if direction == axis or ends == "bonded":
                coordinates.append(numpy.insert(nodes, 3, direction, axis=1))
                value = displacement if top and direction == axis else 0.0
                values.append(numpy.full(len(nodes), value))
    return numpy.concatenate(coordinates), numpy.concatenate(values)


def export(arguments):
    mask, h, _, labelled = specimen(arguments.dir)
    young = moduli(arguments, mask, labelled)
    axis = AXES.index(arguments.axis)
    length = mask.shape[axis] * h
    coordinates, values = held(mask, axis, arguments.ends, arguments.strain * length)
    if not len(coordinates):
        sys.exit(f"{arguments.dir}: no bone on the faces across {arguments.axis}: nothing would be loaded")
    with h5py.File(arguments.model, "w") as file:
        group = file.create_group("Image_Data")
        group["Image"] = (young / 1000).astype("float32").swapaxes(0, 2)
        group["Poisons_ratio"] = arguments.poisson
        group["Voxelsize"] = h
        group["Fixed_Displacement_Coordinates"] = coordinates[:, [2, 1, 0, 3]].astype("uint16")
        group["Fixed_Displacement_Values"] = values.astype("float32")
        group["Loaded_Nodes_Coordinates"] = numpy.zeros((0, 4), dtype="uint16")
        group["Loaded_Nodes_Values"] = numpy.zeros(0, dtype="float32")
        model = {"young_mpa": float(young[mask].mean()), "poisson": arguments.poisson, "strain": arguments.strain,
                 "ends": arguments.ends, "axis": arguments.axis}
        file.attrs["bonepd_ct"] = json.dumps(model)
    print(f"{arguments.model}: {int(mask.sum())} elements, {len(values)} prescribed displacements")


def read(arguments):
    mask, h, tv, _ = specimen(arguments.dir)
    with h5py.File(arguments.model) as file:
        if "Solution" not in file:
            sys.exit(f"{arguments.model}: no /Solution: run ParOSol on it first")
        model = json.loads(file.attrs["bonepd_ct"])
        u = file["Solution/disp"][:].astype(float)
        f = file["Solution/force"][:].astype(float)
    axis = AXES.index(model["axis"])
    length = mask.shape[axis] * h
    # Work of the supports over strain²·TV; and, with a known displacement, their pull over strain·area.
    energy = (u * f).sum() / (model["strain"] ** 2 * tv)
    top = numpy.isclose(u[:, axis], model["strain"] * length, rtol=1e-6, atol=0)
    reaction = f[top, axis].sum() / (model["strain"] * tv / length)
    columns = {"scan": arguments.dir.name, "method": "parosol", **model, "voxel_mm": h, "tv_mm3": tv,
               "e_app_mpa": energy, "e_app_reaction_mpa": reaction}
    print(",".join(columns))
    print(",".join(f"{v:.8g}" if isinstance(v, float) else str(v) for v in columns.values()))


def main():
    parser = argparse.ArgumentParser(description="A segmented scan to ParOSol and back")
    verbs = parser.add_subparsers(required=True)
    for verb, run in (("export", export), ("read", read)):
        sub = verbs.add_parser(verb)
        sub.add_argument("dir", type=pathlib.Path, help="folder of a segmented scan")
        sub.add_argument("model", type=pathlib.Path, help="ParOSol's HDF5 file")
        sub.set_defaults(run=run)
        if run is export:
            sub.add_argument("--young-mpa", type=float, default=1000.0)
            tissue = sub.add_mutually_exclusive_group()
            tissue.add_argument("--labels", type=labels, metavar="VALUE=E,…", help="moduli in MPa of a scan segmented by labels")
            tissue.add_argument("--one-tissue", action="store_true", help="one modulus, whatever values the scan has")
            sub.add_argument("--poisson", type=float, default=0.3)
            sub.add_argument("--strain", type=float, default=-0.01, help="negative is compression")
            sub.add_argument("--ends", choices=["bonded", "free"], default="bonded")
            sub.add_argument("--axis", choices=list(AXES), default="z")
    arguments = parser.parse_args()
    arguments.run(arguments)


main()
