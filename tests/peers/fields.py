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
fields = "displacement,sed,von-mises,fraction"
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
data = image.GetCellData()
names = [data.GetArrayName(i) for i in range(data.GetNumberOfArrays())]
for name in names:
    from_vtk = vtk_to_numpy(data.GetArray(name)).reshape(80, 60, 70).transpose(2, 1, 0)
    nifti = nibabel.load(out / f"field-{name.replace('_', '-')}.nii.gz")
    assert numpy.allclose(nifti.affine, affine, atol=1e-6), nifti.affine
    assert numpy.array_equal(nifti.get_fdata(dtype=numpy.float32), from_vtk), name
    assert not from_vtk[bone == 0].any(), name
assert len(names) == 6, names
print(f"{len(names)} fields: VTK and nibabel read the same values at the same place")

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
