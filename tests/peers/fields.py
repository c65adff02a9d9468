#!/usr/bin/env python3
"""Fields of a solved block, read back by VTK (what ParaView reads with) and nibabel, both from PyPI.

python3 tests/peers/fields.py target/release/bonepd-ct
"""
import json
import pathlib
import subprocess
import sys
import tempfile

try:
    import nibabel
    import numpy
    from vtk.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOLegacy import vtkPolyDataReader
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader
except ImportError as missing:
    print(f"skipped: {missing}; pip install vtk nibabel")
    sys.exit(0)

program = sys.argv[1] if len(sys.argv) > 1 else "target/release/bonepd-ct"
work = pathlib.Path(tempfile.mkdtemp())
affine = numpy.array([[0.02, 0, 0, 3.0], [0, 0.02, 0, -2.0], [0, 0, 0.03, 1.0], [0, 0, 0, 1]])
bone = numpy.ones((70, 60, 80), numpy.uint8)
bone[:20, :, 10:] = 0
nibabel.save(nibabel.Nifti1Image(bone, affine), work / "scan.nii.gz")
out = work / "out"
subprocess.run([program, "segment", work / "scan.nii.gz", "-o", out, "--lower", "1", "--quiet"], check=True)
fields = "displacement,sed,von-mises,fraction,strain,stress,principal-strain,principal-stress,effective-strain,nodal-force"
subprocess.run(
    [program, "solve", out, "--method", "voxel-fe", "--fields", fields, "--quiet"], check=True
)
reader = vtkXMLImageDataReader()
reader.SetFileName(str(out / "fields.vti"))
reader.Update()
image = reader.GetOutput()
assert image.GetDimensions() == (71, 61, 81), image.GetDimensions()
corner = affine[:3, 3] - 0.5 * numpy.diag(affine)[:3]
assert numpy.allclose(image.GetOrigin(), corner, atol=1e-6), image.GetOrigin()
assert numpy.allclose(image.GetSpacing(), [0.02, 0.02, 0.03], atol=1e-7), image.GetSpacing()
cells = {"strain": 6, "stress_mpa": 6, "principal_strain": 3, "principal_stress_mpa": 3}
cells |= {f"principal_{of}_direction_{k}": 3 for of in ("strain", "stress") for k in (1, 2, 3)}
counts = []
for data, size, shift, pores in (
    (image.GetCellData(), (80, 60, 70), 0.0, True),
    (image.GetPointData(), (81, 61, 71), -0.5, False),
):
    names = [data.GetArrayName(i) for i in range(data.GetNumberOfArrays())]
    counts.append(len(names))
    at = affine.copy()
    at[:3, 3] += shift * numpy.diag(affine)[:3]
    for name in names:
        array = data.GetArray(name)
        parts = array.GetNumberOfComponents()
        assert parts == cells.get(name, 1 if pores else 3), (name, parts)
        from_vtk = vtk_to_numpy(array).reshape(*size, parts).transpose(2, 1, 0, 3)
        nifti = nibabel.load(out / f"field-{name.replace('_', '-')}.nii.gz")
        assert numpy.allclose(nifti.affine, at, atol=1e-6), nifti.affine
        values = nifti.get_fdata(dtype=numpy.float32).reshape(*from_vtk.shape)
        assert numpy.array_equal(values, from_vtk), name
        assert not pores or not from_vtk[bone == 0].any(), name
        if parts > 1:
            assert nifti.header.get_intent()[0] == "vector", nifti.header.get_intent()
            assert array.GetComponentName(0) in ("xx", "x", "1"), name
assert counts == [17, 1], counts
load = lambda name: nibabel.load(out / f"field-{name}.nii.gz").get_fdata().squeeze()
sed, strain, stress = load("sed-mpa"), load("strain"), load("stress-mpa")
assert numpy.allclose(0.5 * (strain * stress).sum(-1), sed, rtol=1e-4, atol=1e-7), "sed is half of stress times strain"
tensor = numpy.zeros((*sed.shape, 3, 3))
for i, (p, q) in enumerate([(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]):
    tensor[..., p, q] = tensor[..., q, p] = stress[..., i]
assert numpy.allclose(numpy.linalg.eigvalsh(tensor)[..., ::-1], load("principal-stress-mpa"), atol=1e-4), "principal stresses"
first = load("principal-stress-direction-1")
along = numpy.einsum("...i,...ij,...j", first, tensor, first)
assert numpy.allclose(along, load("principal-stress-mpa")[..., 0], atol=1e-4), "directions"
assert "centre" in nibabel.load(out / "field-sed-mpa.nii.gz").header["descrip"].item().decode()
print(f"{sum(counts)} fields: VTK and nibabel read the same values at the same place")

# A specimen that was turned, rotated or resampled still lies over its scan, in both files.
for flags in (["--turn", "x"], ["--align", "0.3,0.2,1"], ["--resample", "0.025"]):
    again = [program, "segment", work / "scan.nii.gz", "-o", out, "--lower", "0.5", "--quiet", *flags]
    subprocess.run(again, check=True)
    solve = [program, "solve", out, "--method", "voxel-fe", "--fields", "fraction", "--quiet"]
    subprocess.run(solve, check=True)
    nifti = nibabel.load(out / "field-fraction.nii.gz")
    found = numpy.argwhere(nifti.get_fdata() > 0)
    world = found @ nifti.affine[:3, :3].T + nifti.affine[:3, 3]
    in_scan = numpy.linalg.inv(affine) @ numpy.c_[world, numpy.ones(len(world))].T
    index = numpy.clip(numpy.rint(in_scan[:3]).astype(int), 0, numpy.array(bone.shape)[:, None] - 1)
    share = bone[tuple(index)].mean()
    # Voxels at the surface may have their centre on the other side of it.
    assert share > (0.9999 if flags[0] == "--turn" else 0.98), (flags, share)
    reader = vtkXMLImageDataReader()
    reader.SetFileName(str(out / "fields.vti"))
    reader.Update()
    image = reader.GetOutput()
    matrix = image.GetDirectionMatrix()
    axes = numpy.array([[matrix.GetElement(r, c) for c in range(3)] for r in range(3)])
    cells = ((found + 0.5) * image.GetSpacing()) @ axes.T + image.GetOrigin()
    assert numpy.allclose(cells, world, atol=1e-5), (flags, abs(cells - world).max())
    print(f"{' '.join(flags)}: {100 * share:.2f} % of the elements' centres lie in bone of the scan")

# A lattice's fields, by site: energies add up to the modulus, ends are where they were brought to.
subprocess.run([program, "segment", work / "scan.nii.gz", "-o", out, "--lower", "1", "--quiet"], check=True)
flags = ["--lp", "0.1", "--boundary", "floppy", "--fields", "displacement,sed", "--tolerance", "1e-8", "--json", "--quiet"]
done = subprocess.run([program, "solve", out, *flags], check=True, capture_output=True, text=True)
row = json.loads(done.stdout)[-1]
reader = vtkPolyDataReader()
reader.SetFileName(str(out / "fields-sc-floppy-0.1.vtk"))
reader.ReadAllScalarsOn()
reader.ReadAllVectorsOn()
reader.Update()
points = reader.GetOutput()
values = points.GetPointData()
z = vtk_to_numpy(points.GetPoints().GetData())[:, 2]
u = vtk_to_numpy(values.GetArray("displacement_mm"))[:, 2]
sed = vtk_to_numpy(values.GetArray("sed_mpa")).astype(float)
assert len(z) == row["sites"] == points.GetNumberOfVerts(), (len(z), row["sites"])
low, high = u[z == z.min()], u[z == z.max()]
gauge, moved = float(numpy.ptp(z)), float(high[0] - low[0])
assert numpy.ptp(low) == numpy.ptp(high) == 0, "the grips did not stay plane"
assert abs(moved / gauge / row["strain"] - 1) < 1e-5, (gauge, moved)
area = row["tv_mm3"] / (bone.shape[2] * 0.03)
modulus = 2 * sed.sum() * 0.1**3 * gauge / (area * moved**2)
assert abs(modulus / row["e_app_mpa"] - 1) < 1e-5, (modulus, row["e_app_mpa"])
print(f"lattice: the energies of {len(z)} sites that VTK reads make {modulus:.4f} MPa, the row says {row['e_app_mpa']:.4f}")
