"""Files written by independent software, read by bonepd-ct: geometry, orientation, units, and a block of bone voxel by voxel of its mask.

    python -m venv /tmp/peers && /tmp/peers/bin/pip install nibabel SimpleITK pydicom pynrrd tifffile imagecodecs Pillow aimio-py scipy numpy
    /tmp/peers/bin/python tests/peers/formats.py target/release/bonepd-ct

A writer that is not installed is skipped with its reason. Exit code 1 if anything differs.
"""

import importlib
import json
import os
import pathlib
import struct
import subprocess
import sys
import tempfile

import more_formats
import numpy as np

PROGRAM = sys.argv[1] if len(sys.argv) > 1 else "target/release/bonepd-ct"
SPACING = (0.02, 0.03, 0.05)
rng = np.random.default_rng(1)
# Array axes (z, y, x); no symmetry, so any turn or flip shows.
GREY = rng.integers(-1000, 3000, (9, 8, 7)).astype(np.int16)
GREY[2:7, 2:6, 1:5] += 4000
FAILED = []


def ask(*words):
    done = subprocess.run([PROGRAM, *map(str, words), "--json"], capture_output=True, encoding="utf-8")
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip())
    return json.loads(done.stdout)


def check(name, path, world, spacing=SPACING, unit=None, extra=(), grey=None, own=None):
    """`world`: the expected mask of the block, canonical axes (z up, y front, x right), from our own mask file; `grey`: all
    values, whose least, greatest and mean must be told; `own`: the mask as stored in the scan (x, y, z) and its affine, which
    our mask file must have, too."""
    import nibabel

    try:
        info = ask("info", path)
        if spacing is not None:
            assert np.allclose(info["spacing_mm"], spacing, rtol=1e-6), info["spacing_mm"]
        assert info["voxels"] == list(world.shape[::-1]), info["voxels"]
        if unit:
            assert info["unit"] == unit, info["unit"]
        if grey is not None:
            grey = np.asarray(grey, dtype=float)
            told = [info[f"grey_{what}"] for what in ("min", "max", "mean")]
            assert np.allclose(told, [grey.min(), grey.max(), grey.mean()], rtol=1e-6), (told, grey.mean())
        with tempfile.TemporaryDirectory() as out:
            lower = () if any(str(word).startswith("--lower") for word in extra) else ("--lower", 2999.5)
            ask("segment", path, "-o", out, *lower, "--keep-all", *extra)
            mask = nibabel.load(pathlib.Path(out) / "mask.nii.gz")
            stored = np.asarray(mask.dataobj)
            found = np.asarray(nibabel.as_closest_canonical(mask).dataobj).T
        if own is not None:
            assert (stored == own[0]).all(), "the mask is not in the order of the scan"
            assert np.allclose(mask.affine, own[1], atol=1e-5), (mask.affine, own[1])
        assert found.shape == world.shape, (found.shape, world.shape)
        assert (found != world).sum() == 0, f"{(found != world).sum()} voxels differ"
        print(f"ok       {name}")
    except Exception as e:
        FAILED.append(name)
        print(f"FAILED   {name}: {e}")


def refuse(name, path, *words):
    """Our refusal of what has no right value, in words that name it."""
    try:
        ask("info", path)
        said = "it was read"
    except RuntimeError as e:
        said = str(e)
    good = all(word in said for word in words)
    print(f"{'ok      ' if good else 'FAILED  '} {name}: refused{'' if good else ' in other words: ' + said}")
    FAILED.extend([] if good else [name])


def refused(name, path, said, write):
    """A file that is no one scan, refused in words that say why."""
    write(path)
    try:
        ask("info", path)
        words = "it was read"
    except RuntimeError as e:
        words = str(e)
    same = said in words
    print(f"{'ok      ' if same else 'FAILED  '} {name}: refused" + ("" if same else f": {words}"))
    FAILED.extend([] if same else [name])


def needs(module):
    try:
        return importlib.import_module(module)
    except ImportError as e:
        print(f"skipped  {module}: {e}")
        return None


def nibabel_files(dir):
    nib = needs("nibabel")
    if not nib:
        return
    data = GREY.T
    expected = (GREY > 2999.5).astype(np.uint8)
    for kind in (np.int16, np.float32, np.int32, np.float64):
        image = nib.Nifti1Image(data.astype(kind), np.diag([*SPACING, 1.0]))
        image.header.set_xyzt_units("mm")
        path = dir / f"n_{np.dtype(kind).name}.nii.gz"
        nib.save(image, path)
        check(f"nibabel {np.dtype(kind).name}", path, expected)
    micro = nib.Nifti1Image(data, np.diag([20.0, 30.0, 50.0, 1.0]))
    micro.header.set_xyzt_units("micron")
    nib.save(micro, dir / "micron.nii")
    check("nibabel micron", dir / "micron.nii", expected)
    scaled = nib.Nifti1Image(data.astype(np.float32), np.diag([*SPACING, 1.0]))
    scaled.header.set_xyzt_units("mm")
    scaled.header.set_data_dtype(np.int16)
    scaled.header.set_slope_inter(2.0, 100.0)
    nib.save(scaled, dir / "scaled.nii.gz")
    back = np.asarray(nib.load(dir / "scaled.nii.gz").dataobj).T
    check("nibabel scl_slope", dir / "scaled.nii.gz", (back > 2999.5).astype(np.uint8))
    big = nib.Nifti1Image(data, np.diag([*SPACING, 1.0]), header=nib.Nifti1Header(endianness=">"))
    big.header.set_xyzt_units("mm")
    nib.save(big, dir / "big.nii")
    check("nibabel big-endian", dir / "big.nii", expected)
    pair = nib.Nifti1Pair(data, np.diag([*SPACING, 1.0]))
    pair.header.set_xyzt_units("mm")
    nib.save(pair, dir / "pair.img")
    check("nibabel hdr/img pair", dir / "pair.hdr", expected)
    image = nib.Nifti1Image(data, np.diag([*SPACING, 1.0]))
    image.header.set_xyzt_units("mm")
    for codes in ("LPS", "SRP", "AIL"):
        turn = nib.orientations.ornt_transform(
            nib.orientations.axcodes2ornt("RAS"), nib.orientations.axcodes2ornt(tuple(codes))
        )
        turned = image.as_reoriented(turn)
        nib.save(turned, dir / f"{codes}.nii.gz")
        own = (np.asarray(turned.dataobj) > 2999.5, turned.affine)
        check(f"nibabel stored as {codes}", dir / f"{codes}.nii.gz", expected, own=own)
    for endian in "<>":
        two = nib.Nifti2Image(data, np.diag([*SPACING, 1.0]), header=nib.Nifti2Header(endianness=endian))
        two.header.set_xyzt_units("mm")
        path = dir / f"two{ord(endian)}.nii.gz"
        nib.save(two, path)
        check(f"nibabel NIfTI-2 {'little' if endian == '<' else 'big'}-endian", path, expected, own=(data > 2999.5, two.affine))
    two = nib.Nifti2Pair(data, np.diag([*SPACING, 1.0]))
    two.header.set_xyzt_units("mm")
    nib.save(two, dir / "a.b.img")
    check("nibabel NIfTI-2 pair, given by its image", dir / "a.b.img", expected)
    # Analyze: its axes are as stored here, which the note says; nibabel mirrors x.
    for kind in (nib.AnalyzeImage, nib.Spm99AnalyzeImage):
        old = kind(data, np.diag([*SPACING, 1.0]))
        path = dir / f"{kind.__name__}.img"
        nib.save(old, path)
        assert (np.asarray(nib.load(path).dataobj) == data).all()
        check(f"nibabel {kind.__name__}", path, expected, grey=GREY)
    damaged = bytearray((dir / "LPS.nii.gz").read_bytes())
    damaged[-6] ^= 1
    (dir / "crc.nii.gz").write_bytes(damaged)
    refuse("gzip with a wrong checksum", dir / "crc.nii.gz", "checksum")
    sheared = np.diag([*SPACING, 1.0])
    sheared[0, 2] = 0.01
    nib.save(nib.Nifti1Image(data, sheared), dir / "sheared.nii")
    refuse("nibabel sheared", dir / "sheared.nii", "sheared", "11.31")


def simpleitk_files(dir):
    sitk = needs("SimpleITK")
    if not sitk:
        return
    image = sitk.GetImageFromArray(GREY)
    image.SetSpacing(SPACING)
    # Identity direction is LPS: to RAS, x and y are reversed.
    world = (GREY > 2999.5).astype(np.uint8)[:, ::-1, ::-1]
    for name, compressed in (("a.mha", False), ("b.mha", True), ("c.mhd", False), ("d.mhd", True), ("a.nrrd", False), ("b.nrrd", True), ("c.nhdr", False), ("i.nii.gz", True)):
        sitk.WriteImage(image, str(dir / name), useCompression=compressed)
        check(f"SimpleITK {name}{' compressed' if compressed else ''}", dir / name, world)
    image.SetDirection((0, 0, 1, 1, 0, 0, 0, 1, 0))
    for name in ("turned.mha", "turned.nrrd", "turned.nii.gz"):
        sitk.WriteImage(image, str(dir / name))
        ras = sitk.DICOMOrient(image, "RAS")
        own = (GREY.T > 2999.5, itk_affine(image))
        check(f"SimpleITK {name}", dir / name, (sitk.GetArrayFromImage(ras) > 2999.5).astype(np.uint8), ras.GetSpacing(), own=own)
    image.SetDirection((1, 0, 0, 0, 1, 0, 0, 0, 1))
    image.SetOrigin((1.5, -2.5, 7.0))
    thin = sitk.JoinSeries([image])
    sitk.WriteImage(thin, str(dir / "four.mha"))
    check("SimpleITK four dimensions", dir / "four.mha", world, own=(GREY.T > 2999.5, itk_affine(image)))
    # MetaImages that SimpleITK reads and does not write: slices in files of their own, skips, text, scales of its own.
    for k, page in enumerate(GREY):
        (dir / f"s{k:03d}.raw").write_bytes(b"sixteen bytes!!!" + page.tobytes())
    head = f"ObjectType = Image\nNDims = 3\nDimSize = 7 8 9\nElementSpacing = {SPACING[0]} {SPACING[1]} {SPACING[2]}\nElementType = MET_SHORT\n"
    names = "\n".join(f"s{k:03d}.raw" for k in range(9))
    for name, rest in {
        "list": f"HeaderSize = 16\nElementDataFile = LIST\n{names}\n",
        "list2d": f"HeaderSize = -1\nElementDataFile = LIST 2D\n{names}\n",
        "pattern": "HeaderSize = 16\nElementDataFile = s%03d.raw 0 8 1\n",
        "text": "BinaryData = False\nElementDataFile = LOCAL\n" + " ".join(map(str, GREY.ravel())) + "\n",
    }.items():
        path = dir / f"{name}.mhd"
        path.write_text(head + rest)
        theirs = sitk.GetArrayFromImage(sitk.ReadImage(str(path)))
        assert (theirs == GREY).all(), f"SimpleITK reads {name} differently"
        check(f"MetaImage {name}, as SimpleITK reads it", path, world, grey=GREY)


def itk_affine(image):
    """Of voxel indices to RAS."""
    affine = np.eye(4)
    affine[:3, :3] = np.reshape(image.GetDirection(), (3, 3)) * image.GetSpacing()
    affine[:3, 3] = image.GetOrigin()
    return np.diag([-1, -1, 1, 1]) @ affine


def pynrrd_files(dir):
    nrrd = needs("nrrd")
    if not nrrd:
        return
    world = (GREY > 2999.5).astype(np.uint8)
    for encoding in ("raw", "gzip", "bzip2", "ascii"):
        for name in ("a.nrrd", "a.nhdr"):
            path = dir / f"{encoding}-{name}"
            header = {"encoding": encoding, "spacings": SPACING, "units": ["mm"] * 3, "endian": "little"}
            nrrd.write(str(path), GREY.T, header)
            check(f"pynrrd {encoding} {name[2:]}", path, world, grey=GREY)
    directions = np.array([[0, 20, 0], [0, 0, -30], [50, 0, 0]])
    header = {"space": "left-anterior-superior", "space directions": directions, "space origin": [1, 2, 3], "space units": ["um"] * 3}
    path = dir / "turned.nrrd"
    nrrd.write(str(path), GREY.T, header)
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = directions.T / 1000, [0.001, 0.002, 0.003]
    affine = np.diag([-1, 1, 1, 1]) @ affine
    turned = GREY.transpose(1, 2, 0)[::-1, :, ::-1] > 2999.5
    check("pynrrd micrometres, turned", path, turned.astype(np.uint8), (0.05, 0.02, 0.03), own=(GREY.T > 2999.5, affine))
    sitk = needs("SimpleITK")
    if not sitk:
        return
    # What SimpleITK reads and neither writes: skips and slices in files of their own.
    head = "NRRD0005\ntype: short\ndimension: 3\nsizes: 7 8 9\nspacings: 0.02 0.03 0.05\nendian: little\n"
    (dir / "lines.raw").write_bytes(b"one\ntwo\n123" + GREY.tobytes())
    for k, page in enumerate(GREY):
        (dir / f"n{k}.raw").write_bytes(page.tobytes())
    names = "\n".join(f"n{k}.raw" for k in range(9))
    for name, rest in {
        "skips": "encoding: raw\nlineskip: 2\nbyteskip: 3\ndata file: lines.raw\n",
        "end": "encoding: raw\nbyte skip: -1\ndata file: lines.raw\n",
        "list": f"encoding: raw\ndata file: LIST\n{names}\n",
        "pattern": "encoding: raw\ndatafile: n%d.raw 0 8 1\n",
    }.items():
        path = dir / f"{name}.nhdr"
        path.write_text(head + rest)
        theirs = sitk.GetArrayFromImage(sitk.ReadImage(str(path)))
        assert (theirs == GREY).all(), f"SimpleITK reads {name} differently"
        check(f"NRRD {name}, as SimpleITK reads it", path, world, grey=GREY)


def pydicom_files(dir):
    if not needs("pydicom"):
        return
    import pydicom
    from pydicom.dataset import FileDataset, FileMetaDataset
    from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, ImplicitVRLittleEndian, generate_uid

    for name, syntax in (("explicit", ExplicitVRLittleEndian), ("implicit", ImplicitVRLittleEndian)):
        folder = dir / f"dicom_{name}"
        folder.mkdir()
        series = generate_uid()
        for k in rng.permutation(len(GREY)):
            meta = FileMetaDataset()
            meta.MediaStorageSOPClassUID = CTImageStorage
            meta.MediaStorageSOPInstanceUID = generate_uid()
            meta.TransferSyntaxUID = syntax
            ds = FileDataset(None, {}, file_meta=meta, preamble=b"\0" * 128)
            ds.SOPClassUID, ds.SOPInstanceUID = CTImageStorage, meta.MediaStorageSOPInstanceUID
            ds.PatientName, ds.Modality, ds.SeriesInstanceUID = "Patient^Jane", "CT", series
            ds.Rows, ds.Columns = GREY.shape[1:]
            ds.PixelSpacing = [SPACING[1], SPACING[0]]
            ds.SliceThickness = 9.0
            ds.ImagePositionPatient = [1.0, 2.0, float(k) * SPACING[2]]
            ds.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
            ds.InstanceNumber = int(len(GREY) - k)
            ds.SamplesPerPixel, ds.PhotometricInterpretation = 1, "MONOCHROME2"
            ds.BitsAllocated = ds.BitsStored = 16
            ds.HighBit, ds.PixelRepresentation = 15, 1
            ds.RescaleSlope, ds.RescaleIntercept = 2, -1000
            ds.PixelData = GREY[k].tobytes()
            ds.save_as(folder / f"IM{rng.integers(1 << 30):09d}", enforce_file_format=True)
        world = (GREY * 2.0 - 1000 > 2999.5).astype(np.uint8)[:, ::-1, ::-1]
        check(f"pydicom series, {name}", folder, world, unit="HU")
        assert "Jane" not in json.dumps(ask("info", folder)), "a patient's name got out"
    pydicom_kinds(dir, pydicom)


def pydicom_kinds(dir, pydicom):
    """The last series above in other codings, each file changed by pydicom and read back by it."""
    from pydicom.uid import DeflatedExplicitVRLittleEndian, RLELossless

    source = sorted((dir / "dicom_explicit").iterdir())
    world = (GREY * 2.0 - 1000 > 2999.5).astype(np.uint8)[:, ::-1, ::-1]
    first = pydicom.dcmread(source[0])
    origin = np.diag([-SPACING[0], -SPACING[1], SPACING[2], 1.0])
    origin[:3, 3] = [-1.0, -2.0, 0.0]
    own = ((GREY * 2.0 - 1000 > 2999.5).T, origin)

    def series(name, change, save=None, unit="HU"):
        folder = dir / name
        folder.mkdir()
        for path in source:
            ds = pydicom.dcmread(path)
            change(ds)
            if save:
                save(ds, folder / path.name)
            else:
                ds.save_as(folder / path.name, enforce_file_format=True)
            back = pydicom.dcmread(folder / path.name, force=True)
            if hasattr(back.file_meta, "TransferSyntaxUID"):
                assert (back.pixel_array == pydicom.dcmread(path).pixel_array).all(), name
        check(f"pydicom {name}", folder, world, unit=unit, own=own)

    def syntax(uid):
        def change(ds):
            ds.file_meta.TransferSyntaxUID = uid
        return change

    def sequence(ds):
        inner = pydicom.Dataset()
        inner.ScheduledProcedureStepDescription = "made"
        ds.RequestAttributesSequence = [inner]
        ds["RequestAttributesSequence"].is_undefined_length = True

    series("RLE", lambda ds: ds.compress(RLELossless))
    series("deflated", syntax(DeflatedExplicitVRLittleEndian))
    series("sequence of undefined length", sequence)
    bare = lambda ds, path: pydicom.dcmwrite(path, pydicom.Dataset({e.tag: e for e in ds}), implicit_vr=True, little_endian=True)
    series("without preamble and meta information", lambda ds: None, save=bare)
    series("MONOCHROME1", lambda ds: setattr(ds, "PhotometricInterpretation", "MONOCHROME1"))

    def density(ds):
        ds.RescaleType = "mgHA/ccm"

    series("rescaled to density", density, unit="mg HA/cm3")
    enhanced(dir, pydicom, first, own, world)
    tilted = dir / "tilted"
    tilted.mkdir()
    for path in source:
        ds = pydicom.dcmread(path)
        x, y, z = ds.ImagePositionPatient
        ds.ImagePositionPatient = [x, y + 0.5 * z, z]
        ds.save_as(tilted / path.name, enforce_file_format=True)
    refuse("pydicom tilted gantry", tilted, "sheared", "26.57")
    for uid, name in (("JPEGLSLossless", "JPEG-LS"), ("JPEG2000Lossless", "JPEG 2000")):
        path = dir / f"{uid}.dcm"
        ds = pydicom.dcmread(source[0])
        try:
            ds.compress(getattr(pydicom.uid, uid))
        except Exception as e:
            print(f"skipped  pydicom {name}: {e}")
            continue
        ds.save_as(path, enforce_file_format=True)
        refuse(f"pydicom {name}", path, name, "gdcmconv --raw")


def enhanced(dir, pydicom, first, own, world):
    """All slices in one file, frames in another order than along the normal, place and scale in functional groups."""
    from pydicom.dataset import Dataset
    from pydicom.uid import EnhancedCTImageStorage

    ds = first
    order = list(rng.permutation(len(GREY)))
    ds.SOPClassUID = ds.file_meta.MediaStorageSOPClassUID = EnhancedCTImageStorage
    ds.NumberOfFrames = len(order)

    def group(name, **values):
        inner, outer = Dataset(), Dataset()
        for key, value in values.items():
            setattr(inner, key, value)
        setattr(outer, name, [inner])
        return outer

    shared = group("PixelMeasuresSequence", PixelSpacing=[SPACING[1], SPACING[0]], SliceThickness=9.0)
    shared.update(group("PlaneOrientationSequence", ImageOrientationPatient=[1, 0, 0, 0, 1, 0]))
    shared.update(group("PixelValueTransformationSequence", RescaleSlope=2, RescaleIntercept=-1000, RescaleType="HU"))
    ds.SharedFunctionalGroupsSequence = [shared]
    ds.PerFrameFunctionalGroupsSequence = [
        group("PlanePositionSequence", ImagePositionPatient=[1.0, 2.0, float(k) * SPACING[2]]) for k in order
    ]
    for key in ("PixelSpacing", "SliceThickness", "ImagePositionPatient", "ImageOrientationPatient", "RescaleSlope", "RescaleIntercept"):
        delattr(ds, key)
    ds.PixelData = GREY[order].tobytes()
    path = dir / "enhanced"
    ds.save_as(path, enforce_file_format=True)
    check("pydicom enhanced, frames shuffled", path, world, unit="HU", own=own)


def tifffile_files(dir):
    tifffile = needs("tifffile")
    if not tifffile:
        return
    # World axes are the stored ones: TIFF has no orientation.
    world = (GREY > 2999.5).astype(np.uint8)
    px = (1 / 0.02, 1 / 0.02)
    iso = (0.02, 0.02, 0.05)
    grey = GREY.clip(0).astype(np.uint16)
    meta = {"spacing": 0.05, "unit": "mm", "axes": "ZYX"}
    tifffile.imwrite(dir / "ij.tif", grey, imagej=True, resolution=px, metadata=meta)
    check("tifffile ImageJ hyperstack", dir / "ij.tif", world, iso)
    tifffile.imwrite(dir / "ij_um.tif", grey, imagej=True, resolution=(1 / 20, 1 / 20), metadata={"spacing": 50, "unit": "um", "axes": "ZYX"})
    check("tifffile ImageJ in um", dir / "ij_um.tif", world, iso)
    # As ImageJ keeps negative values: unsigned, with a line in its notes.
    signed = {**meta, "cf": 0, "c0": -32768.0, "c1": 1.0, "vunit": "HU"}
    tifffile.imwrite(dir / "ij_hu.tif", (GREY.astype(np.int32) + 32768).astype(np.uint16), imagej=True, resolution=px, metadata=signed)
    check("tifffile ImageJ, calibrated", dir / "ij_hu.tif", world, iso, unit="HU", grey=GREY)
    for name, more in {
        "bigtiff": {"bigtiff": True},
        "big-endian": {"byteorder": ">"},
        "deflate": {"compression": "zlib", "predictor": 2},
        "tiled": {"tile": (16, 16)},
    }.items():
        path = dir / f"{name}.tif"
        tifffile.imwrite(path, GREY, photometric="minisblack", **more)
        check(f"tifffile {name}", path, world, None, extra=("--spacing", "0.02,0.02,0.05"))
    for kind in (np.uint8, np.int8, np.uint16, np.int16, np.uint32, np.int32, np.uint64, np.int64, np.float16, np.float32, np.float64):
        limits = np.iinfo(kind) if np.issubdtype(kind, np.integer) else None
        # Small numbers take a coarser copy of the values, so that they fit; the mask is that of the copy.
        small = GREY // 64 if np.dtype(kind).itemsize == 1 else GREY
        stored = (small if limits is None else small.clip(limits.min, limits.max)).astype(kind)
        path = dir / f"{np.dtype(kind).name}.tif"
        tifffile.imwrite(path, stored, photometric="minisblack")
        lower = 40.5 if np.dtype(kind).itemsize == 1 else 2999.5
        check(f"tifffile {np.dtype(kind).name}", path, (stored.astype(float) > lower).astype(np.uint8), None,
              extra=("--spacing", "0.02", "--lower", lower), grey=stored)
    bone = GREY > 2999.5
    # What shows 0 as white holds the values that tifffile reads back.
    for photometric in ("minisblack", "miniswhite"):
        for name, stored in (("1 bit", bone), ("8 bits", bone.astype(np.uint8) * 255), ("16 bits", grey), ("floats", GREY.astype(np.float32))):
            path = dir / f"{photometric}-{name}.tif"
            tifffile.imwrite(path, stored, photometric=photometric)
            back = tifffile.imread(path)
            lower = 0.5 if name == "1 bit" else 200 if name == "8 bits" else 2999.5
            check(f"tifffile {name}, {photometric}", path, (back > lower).astype(np.uint8), None, extra=("--spacing", "0.02", "--lower", lower), grey=back)
    path = dir / "shaped.tif"
    tifffile.imwrite(path, GREY[None, :, None], photometric="minisblack")
    check("tifffile shaped, axes of one", path, world, None, extra=("--spacing", "0.02"), grey=GREY)
    refused("tifffile shaped, four axes", dir / "four.tif", "shape", lambda path: tifffile.imwrite(path, np.stack([GREY, GREY]), photometric="minisblack"))
    for axes, shape, said in (("ZCYX", (2, 3), "2 channels"), ("TZYX", (2, 3), "times")):
        many = np.broadcast_to(GREY[:3, None], (3, 2) + GREY.shape[1:]) if axes == "ZCYX" else np.broadcast_to(GREY[None, :3], (2, 3) + GREY.shape[1:])
        refused(f"tifffile OME {axes}", dir / f"{axes}.ome.tif", said, lambda path: tifffile.imwrite(path, np.ascontiguousarray(many), metadata={"axes": axes}))
    for axes in ("ZCYX", "TZYX"):
        many = np.ascontiguousarray(np.broadcast_to(grey[:3, None] if axes == "ZCYX" else grey[None, :3], (3, 2) + grey.shape[1:] if axes == "ZCYX" else (2, 3) + grey.shape[1:]))
        refused(f"tifffile ImageJ {axes}", dir / f"ij_{axes}.tif", "hyperstack", lambda path: tifffile.imwrite(path, many, imagej=True, metadata={"axes": axes}))
    tifffile.imwrite(dir / "ij_t.tif", grey, imagej=True, resolution=px, metadata={"spacing": 0.05, "unit": "mm", "axes": "TYX"})
    check("tifffile ImageJ, slices as times", dir / "ij_t.tif", world, iso)
    tifffile.imwrite(dir / "ij_1.tif", grey, imagej=True, resolution=px, metadata={"unit": "mm", "axes": "ZYX"})
    check("tifffile ImageJ, depth left out", dir / "ij_1.tif", world, (0.02, 0.02, 1.0))
    for unit, per in (("\\u00B5m", 20), ("micron", 20), ("nm", 20000), ("cm", 0.002)):
        path = dir / "ij_unit.tif"
        tifffile.imwrite(path, grey, imagej=True, resolution=(1 / per, 1 / per), metadata={"spacing": 2.5 * per, "unit": unit, "axes": "ZYX"})
        check(f"tifffile ImageJ in {unit}", path, world, iso)
    ome = {"axes": "ZYX", "PhysicalSizeX": 0.02, "PhysicalSizeXUnit": "mm", "PhysicalSizeY": 20000, "PhysicalSizeYUnit": "nm", "PhysicalSizeZ": 0.005, "PhysicalSizeZUnit": "cm"}
    tifffile.imwrite(dir / "units.ome.tif", GREY, metadata=ome)
    check("tifffile OME, units of its own for each axis", dir / "units.ome.tif", world, iso)
    pyramid = dir / "pyramid.ome.tif"
    with tifffile.TiffWriter(pyramid, ome=True) as out:
        out.write(GREY, subifds=1, metadata={"axes": "ZYX"})
        out.write(GREY[:, ::2, ::2], subfiletype=1, photometric="minisblack")
    check("tifffile OME pyramid", pyramid, world, None, extra=("--spacing", "0.02"), grey=GREY)
    thumbnail = dir / "thumbnail.tif"
    with tifffile.TiffWriter(thumbnail) as out:
        out.write(GREY[0, ::2, ::2], subfiletype=1, photometric="minisblack", metadata=None)
        for page in GREY:
            out.write(page, photometric="minisblack", metadata=None)
    check("tifffile, a page of another resolution first", thumbnail, world, None, extra=("--spacing", "0.02"), grey=GREY)
    path = dir / "palette.tif"
    ramp = (np.arange(256, dtype=np.uint16) * 257)[::-1]
    tifffile.imwrite(path, (GREY // 64).clip(0, 255).astype(np.uint8), photometric="palette", colormap=np.stack([ramp] * 3))
    back = tifffile.imread(path)
    check("tifffile palette that inverts", path, (back > 40).astype(np.uint8), None, extra=("--spacing", "0.02", "--lower", "40.5"), grey=back)
    for dpi in (144, 240, 300, 2400):
        path = dir / "dpi.tif"
        tifffile.imwrite(path, GREY, photometric="minisblack", resolution=(dpi, dpi), resolutionunit=2)
        same = ask("info", path)["spacing_mm"] is None
        print(f"{'ok      ' if same else 'FAILED  '} tifffile {dpi} dpi: no voxel size")
        FAILED.extend([] if same else [f"{dpi} dpi"])
    if needs("imagecodecs"):
        for name in ("lzw", "packbits", "zstd", "deflate"):
            for predictor in (False, True):
                if name == "packbits" and predictor:
                    continue
                for order in "<>":
                    path = dir / f"{name}.tif"
                    tifffile.imwrite(path, GREY, photometric="minisblack", compression=name, predictor=predictor, byteorder=order, tile=(16, 16) if predictor else None)
                    check(f"tifffile {name}, predictor {predictor}, {order}", path, world, None, extra=("--spacing", "0.02"), grey=GREY)
        path = dir / "float-predictor.tif"
        tifffile.imwrite(path, GREY.astype(np.float32), photometric="minisblack", compression="zstd", predictor=3)
        check("tifffile floats with their predictor", path, world, None, extra=("--spacing", "0.02"), grey=GREY)
        for bits in (2, 3, 5, 6, 7, 9, 10, 12, 14, 15):
            small = (GREY.clip(0).astype(np.uint32) >> 3) & ((1 << bits) - 1)
            small = small.astype(np.uint8 if bits <= 8 else np.uint16)
            path = dir / f"{bits}.tif"
            tifffile.imwrite(path, small, photometric="minisblack", bitspersample=bits, rowsperstrip=GREY.shape[1])
            back = tifffile.imread(path)
            assert (back == small).all(), "tifffile reads something else"
            lower = int(back.max()) // 2 + 0.5
            check(f"tifffile {bits} bits", path, (back > lower).astype(np.uint8), None, extra=("--spacing", "0.02", "--lower", lower), grey=back)
        refused("tifffile LZMA", dir / "lzma.tif", "LZMA", lambda path: tifffile.imwrite(path, GREY, photometric="minisblack", compression="lzma"))
    tifffile.imwrite(dir / "float.tif", GREY.astype(np.float32), photometric="minisblack")
    check("tifffile float32", dir / "float.tif", world, None, extra=("--spacing", "0.02"))
    tifffile.imwrite(dir / "ome.ome.tif", GREY, metadata={"axes": "ZYX", "PhysicalSizeX": 20.0, "PhysicalSizeXUnit": "µm", "PhysicalSizeY": 20.0, "PhysicalSizeYUnit": "µm", "PhysicalSizeZ": 50.0, "PhysicalSizeZUnit": "µm"})
    check("tifffile OME", dir / "ome.ome.tif", world, iso)
    folder = dir / "slices"
    folder.mkdir()
    for k, page in enumerate(GREY):
        tifffile.imwrite(folder / f"s{k + 2}.tif", page, photometric="minisblack")
    check("tifffile folder, unpadded numbers", folder, world, None, extra=("--spacing", "0.02"))
    for name in ("s5.tif", "s6.tif"):
        (folder / name).rename(folder / name.upper())
    check("tifffile folder, names of both cases", folder, world, None, extra=("--spacing", "0.02"))
    (folder / "s4.tif").unlink()
    try:
        ask("info", folder)
        FAILED.append("missing slice")
        print("FAILED   tifffile folder, a slice missing: it was read")
    except RuntimeError as e:
        said = "between the numbers 3 and 5" in str(e)
        print(f"{'ok      ' if said else 'FAILED  '} tifffile folder, a slice missing: refused")
        FAILED.extend([] if said else ["missing slice"])
    raw = dir / "one_ifd.tif"
    tifffile.imwrite(raw, grey, imagej=True, resolution=px, metadata=meta, contiguous=True)
    check("tifffile ImageJ, contiguous", raw, world, iso)


def numpy_files(dir):
    world = (GREY > 2999.5).astype(np.uint8)
    np.save(dir / "c.npy", GREY)
    np.save(dir / "f.npy", np.asfortranarray(GREY.astype(">f4")))
    small = (GREY // 64).astype(np.float16)
    np.save(dir / "half.npy", small)
    np.save(dir / "one.npy", GREY[None, ..., None])
    np.savez(dir / "scan.npz", spacing=np.array([0.02] * 3), scan=GREY)
    np.savez_compressed(dir / "packed.npz", scan=np.asfortranarray(GREY))
    for name in ("c.npy", "f.npy", "one.npy", "scan.npz", "packed.npz"):
        check(f"numpy {name}", dir / name, world, None, extra=("--spacing", "0.02"))
    check("numpy half.npy", dir / "half.npy", (small > 46.5).astype(np.uint8), None, extra=("--spacing", "0.02", "--lower", "46.5"), grey=small)
    for order in "<>":
        for kind in ("u1", "i2", "u2", "i4", "f4", "f8"):
            path = dir / "voxels.raw"
            values = (GREY // 64).clip(0) if kind == "u1" else GREY.clip(0)
            path.write_bytes(bytes(64) + values.astype(order + kind).tobytes())
            lower = 46.5 if kind == "u1" else 2999.5
            name = np.dtype(kind).name + ("be" if order == ">" else "")
            contents = ",".join(map(str, GREY.shape[::-1])) + f",{name},64"
            with tempfile.TemporaryDirectory() as out:
                import nibabel

                ask("segment", path, "-o", out, "--raw", contents, "--spacing", "0.02", "--lower", lower, "--keep-all")
                found = np.asarray(nibabel.load(pathlib.Path(out) / "mask.nii.gz").dataobj).T
            same = (found == (values > lower)).all()
            print(f"{'ok      ' if same else 'FAILED  '} voxels without a header, {name}")
            FAILED.extend([] if same else [name])


def pillow_files(dir):
    Image = needs("PIL.Image")
    if not Image:
        return
    for kind in ("png", "bmp"):
        folder = dir / kind
        folder.mkdir()
        bytes_ = (GREY > 2999.5).astype(np.uint8) * 200
        for k, page in enumerate(bytes_):
            Image.fromarray(page).save(folder / f"slice{k}.{kind}")
        (folder / "slice_rec.log").write_text("[Reconstruction]\nPixel Size (um)=20.0\n")
        check(f"Pillow {kind} slices with NRecon's log", folder, bytes_ // 200, (0.02,) * 3, extra=("--lower", 100), grey=bytes_)
    folder = dir / "png16"
    folder.mkdir()
    wide = (GREY.astype(np.int32) + 1000) * 7
    assert wide.max() > 32767
    for k, page in enumerate(wide.astype(np.uint16)):
        Image.fromarray(page).save(folder / f"slice{k}.png")
    lower = (2999.5 + 1000) * 7
    world = (GREY > 2999.5).astype(np.uint8)
    check("Pillow png slices of 16 bits", folder, world, None, extra=("--spacing", "0.02", "--lower", lower), grey=wide)


def aim_files(dir):
    aim = needs("py_aimio")
    if not aim:
        return
    log = (
        "! Mu_Scaling                      8192\n"
        "HU: mu water                      0.24090\n"
        "Density: unit                     mg HA/ccm\n"
        "Density: slope                    1603.51904\n"
        "Density: intercept                -391.209015\n"
    )
    world = (GREY > 2999.5).astype(np.uint8)
    cases = {"short": GREY, "char": (world * 127).astype(np.int8)}
    for name, array in cases.items():
        path = dir / f"{name}.AIM"
        meta = {"dimensions": array.shape[::-1], "element_size": (0.082, 0.082, 0.082), "processing_log": log}
        try:
            aim.write_aim(str(path), array, meta=meta, unit="native")
        except Exception as e:
            print(f"skipped  aimio {name}: it does not write this ({e})")
            continue
        if name == "short":
            check("aimio short", path, world, (0.082,) * 3)
            for unit, key in (("BMD", "mgha"), ("HU", "hu")):
                array, _ = getattr(aim, "read_aim")(str(path), **{{"BMD": "density", "HU": "hu"}[unit]: True}) if True else None
                threshold = float(np.median(array)) + 0.001
                with tempfile.TemporaryDirectory() as out:
                    import nibabel

                    ask("segment", path, "-o", out, "--units", key, "--lower", threshold, "--keep-all")
                    found = np.asarray(nibabel.load(pathlib.Path(out) / "mask.nii.gz").dataobj).T
                same = (found == (array >= threshold)).all()
                print(f"{'ok      ' if same else 'FAILED  '} aimio calibrated to {unit}")
                if not same:
                    FAILED.append(unit)
        else:
            info = ask("info", path)
            total = np.asarray(array, dtype=float).mean()
            same = abs(info["grey_mean"] - total) < 1e-4 and info["voxels"] == list(array.shape[::-1])
            print(f"{'ok      ' if same else 'FAILED  '} aimio {name}")
            if not same:
                FAILED.append(name)
    path = dir / "float.AIM"
    aim.write_aim(str(path), GREY.astype(np.float32) / 16, meta={"dimensions": GREY.shape[::-1], "element_size": (0.082,) * 3}, unit="native")
    check("aimio float", path, world, (0.082,) * 3, extra=("--lower", 2999.5 / 16), grey=GREY / 16)
    # What aimio reads and does not write: the older headers. Both read the same file.
    for version, size in (("1.0", 92), ("1.1", 96)):
        path = dir / f"v{version}.AIM"
        path.write_bytes(aim_v1(size))
        theirs, meta = aim.read_aim(str(path))
        assert (theirs == GREY).all(), f"aimio reads version {version} differently"
        check(f"AIM version {version}, as aimio reads it", path, (theirs > 2999.5).astype(np.uint8), meta["element_size"], grey=theirs)


def aim_v1(size):
    """An AIM of version 1.0 (a header of 92 bytes) or 1.1 (96)."""
    header = bytearray(size)
    struct.pack_into("<i3i3i", header, 16, (2 << 16) + 2, *GREY.shape[::-1], 0, 0, 0)
    # A VAX float: IEEE's bits of four times the number, 16-bit words swapped.
    edge = struct.pack("<f", 4 * 0.082)
    header[68:72] = edge[2:] + edge[:2]
    return struct.pack("<4i", 16, size, 0, GREY.nbytes) + bytes(header) + GREY.tobytes()


def in_own_process(group, more):
    """What failed. A group has a process to itself: libraries that bring their own libtiff or change the locale disturb others."""
    sys.stdout.flush()
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        FAILED.clear()
        with tempfile.TemporaryDirectory() as dir:
            try:
                group(pathlib.Path(dir), *more)
            except Exception as e:
                FAILED.append(group.__name__)
                print(f"FAILED   {group.__name__}: {type(e).__name__}: {e}")
        sys.stdout.flush()
        os.write(writer, json.dumps(FAILED).encode())
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as failed:
        words = failed.read()
    _, status = os.waitpid(child, 0)
    if status != 0:
        print(f"FAILED   {group.__name__}: its process ended by {status}")
        return [group.__name__]
    return json.loads(words)


def main():
    if not needs("nibabel"):
        print("nothing can be checked without nibabel, which reads our masks")
        return 0
    here = sys.modules[__name__]
    own = (nibabel_files, simpleitk_files, pynrrd_files, pydicom_files, tifffile_files, numpy_files, pillow_files, aim_files)
    groups = [(group, ()) for group in own] + [(group, (here,)) for group in more_formats.GROUPS]
    for group, more in groups:
        FAILED.extend(in_own_process(group, more))
    print(f"{len(FAILED)} failed" if FAILED else "all agree")
    return 1 if FAILED else 0


if __name__ == "__main__":
    sys.exit(main())
