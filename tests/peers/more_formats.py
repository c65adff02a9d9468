"""Further files by independent software for formats.py, which runs these: all number types, masks of other orientations on turned
scans, what SimpleITK's GDCM writes, what archives do to DICOM, Pillow's TIFF.
"""

import itertools
import pathlib
import tempfile

import numpy as np

KINDS = ("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8")


def stored(f, kind):
    """A copy of the values that a type holds, and a threshold that its block of bone lies above."""
    dtype = np.dtype(kind)
    small = dtype.itemsize == 1
    values = f.GREY // 64 if small else f.GREY
    if dtype.kind in "iu":
        limits = np.iinfo(dtype)
        values = values.clip(limits.min, limits.max)
    return values.astype(dtype), 40.5 if small else 2999.5


def simpleitk_kinds(dir, f):
    sitk = f.needs("SimpleITK")
    if not sitk:
        return
    for kind, name in itertools.product(KINDS, ("mha", "nrrd", "nii")):
        values, lower = stored(f, kind)
        image = sitk.GetImageFromArray(values)
        image.SetSpacing(f.SPACING)
        path = dir / f"{kind}.{name}"
        sitk.WriteImage(image, str(path), useCompression=True)
        world = (values > lower).astype(np.uint8)[:, ::-1, ::-1]
        f.check(f"SimpleITK {name} of {np.dtype(kind).name}", path, world, extra=("--lower", lower), grey=values)
    image = sitk.GetImageFromArray(f.GREY)
    image.SetSpacing(f.SPACING)
    own = (f.GREY.T > 2999.5, f.itk_affine(image))
    world = (f.GREY > 2999.5).astype(np.uint8)[:, ::-1, ::-1]
    for name in ("pair.img", "pair.img.gz", "pair2.hdr"):
        sitk.WriteImage(image, str(dir / name))
        f.check(f"SimpleITK {name}", dir / name, world, own=own)
    sitk.WriteImage(image, str(dir / "scan.tif"))
    f.check("SimpleITK tif", dir / "scan.tif", (f.GREY > 2999.5).astype(np.uint8), None, extra=("--spacing", "0.02"), grey=f.GREY)
    gdcm_series(dir, f, sitk, image, world, own)


def gdcm_series(dir, f, sitk, image, world, own):
    """Slices as SimpleITK's documentation has them written, plain and compressed by GDCM."""
    writer = sitk.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    for name, compression in (("plain", None), ("JPEG lossless", "JPEG"), ("JPEG 2000", "JPEG2000")):
        folder = dir / f"gdcm-{name}"
        folder.mkdir()
        for k in range(image.GetDepth()):
            page = image[:, :, k]
            place = image.TransformIndexToPhysicalPoint((0, 0, k))
            for key, value in {
                "0008|0060": "CT",
                "0020|000e": "1.2.826.0.1.3680043.2.1125.1",
                "0020|0032": "\\".join(map(str, place)),
                "0020|0037": "1\\0\\0\\0\\1\\0",
                "0020|0013": str(k + 1),
                "0028|1052": "0",
                "0028|1053": "1",
            }.items():
                page.SetMetaData(key, value)
            if compression:
                writer.SetUseCompression(True)
                writer.SetCompressor(compression)
            writer.SetFileName(str(folder / f"{k:03d}.dcm"))
            try:
                writer.Execute(page)
            except RuntimeError as e:
                print(f"skipped  GDCM {name}: {e}")
                break
        else:
            if name in ("plain", "JPEG lossless"):
                f.check(f"GDCM series, {name}", folder, world, own=own)
            else:
                f.refuse(f"GDCM series, {name}", folder, name, "gdcmconv --raw")


def nibabel_masks(dir, f):
    """A mask in any orientation on a scan in any other: bone is counted where both lie in the world."""
    nib = f.needs("nibabel")
    if not nib:
        return
    inside = np.zeros(f.GREY.shape, np.uint8)
    inside[1:8, 1:5, 2:7] = 1
    expected = int(((f.GREY > 999.5) & (inside > 0)).sum())
    affine = np.diag([*f.SPACING, 1.0])
    affine[:3, 3] = [1.0, -2.0, 3.0]

    def turned(array, codes):
        image = nib.Nifti1Image(array.T, affine)
        image.header.set_xyzt_units("mm")
        turn = nib.orientations.ornt_transform(nib.orientations.axcodes2ornt("RAS"), nib.orientations.axcodes2ornt(codes))
        return image.as_reoriented(turn)

    def bone(name, scan, mask):
        with tempfile.TemporaryDirectory() as out:
            try:
                found = f.ask("segment", scan, "-o", out, "--lower", 999.5, "--keep-all", "--voi", mask)["results"]["bone_voxels"]
            except RuntimeError as e:
                found = e
        same = found == expected
        print(f"{'ok      ' if same else 'FAILED  '} {name}{'' if same else f': {found}, not {expected}'}")
        f.FAILED.extend([] if same else [name])

    orders = ("RAS", "LPS", "SRP", "AIL", "PSR", "IPL")
    for a, b in itertools.product(orders, orders):
        nib.save(turned(f.GREY, tuple(a)), dir / "scan.nii.gz")
        nib.save(turned(inside, tuple(b)), dir / "mask.nii.gz")
        bone(f"nibabel mask {b} on a scan {a}", dir / "scan.nii.gz", dir / "mask.nii.gz")
    for a in orders:
        scan = turned(f.GREY, tuple(a))
        nib.save(scan, dir / "scan.nii.gz")
        np.save(dir / "mask.npy", np.asarray(turned(inside, tuple(a)).dataobj).T)
        bone(f"numpy mask in the order of a scan {a}", dir / "scan.nii.gz", dir / "mask.npy")


def nibabel_kinds(dir, f):
    nib = f.needs("nibabel")
    if not nib:
        return
    for kind, order in itertools.product(KINDS, "<>"):
        values, lower = stored(f, kind)
        header = nib.Nifti1Header(endianness=order)
        header.set_data_dtype(np.dtype(kind).newbyteorder(order))
        image = nib.Nifti1Image(values.T.astype(np.dtype(kind).newbyteorder(order)), None, header=header)
        image.header.set_xyzt_units("mm")
        affine = np.diag([-f.SPACING[0], f.SPACING[1], -f.SPACING[2], 1.0])
        image.set_qform(affine, code=1)
        image.set_sform(None, code=0)
        path = dir / f"{kind}{ord(order)}.nii.gz"
        nib.save(image, path)
        world = (values > lower).astype(np.uint8)[::-1, :, ::-1]
        f.check(f"nibabel {np.dtype(kind).name} {'little' if order == '<' else 'big'}-endian, qform alone", path, world, extra=("--lower", lower), grey=values, own=(values.T > lower, affine))


def pynrrd_kinds(dir, f):
    nrrd = f.needs("nrrd")
    if not nrrd:
        return
    for kind, endian in itertools.product(KINDS, ("little", "big")):
        values, lower = stored(f, kind)
        path = dir / f"{kind}-{endian}.nrrd"
        typed = values.astype(np.dtype(kind).newbyteorder("<" if endian == "little" else ">"))
        nrrd.write(str(path), typed.T, {"spacings": f.SPACING, "units": ["mm"] * 3, "endian": endian})
        back, _ = nrrd.read(str(path))
        assert (back.T == values).all(), f"pynrrd reads {kind} differently"
        f.check(f"pynrrd {np.dtype(kind).name} {endian}-endian", path, (values > lower).astype(np.uint8), extra=("--lower", lower), grey=values)


def pydicom_changes(dir, f):
    """The series of a scanner as archives and exports change it."""
    pydicom = f.needs("pydicom")
    if not pydicom:
        return
    from pydicom.uid import CTImageStorage, ExplicitVRBigEndian, ExplicitVRLittleEndian, generate_uid

    stored_world = (f.GREY > 2999.5).astype(np.uint8)[:, ::-1, ::-1]

    def slices(change=lambda ds, k: None, syntax=ExplicitVRLittleEndian):
        for k in range(len(f.GREY)):
            meta = pydicom.dataset.FileMetaDataset()
            meta.MediaStorageSOPClassUID, meta.TransferSyntaxUID = CTImageStorage, syntax
            meta.MediaStorageSOPInstanceUID = generate_uid()
            ds = pydicom.dataset.FileDataset(None, {}, file_meta=meta, preamble=b"\0" * 128, is_implicit_VR=False, is_little_endian=syntax != ExplicitVRBigEndian)
            ds.SOPClassUID, ds.SOPInstanceUID, ds.Modality, ds.SeriesInstanceUID = CTImageStorage, meta.MediaStorageSOPInstanceUID, "CT", "1.2.3.4"
            ds.Rows, ds.Columns = f.GREY.shape[1:]
            ds.PixelSpacing = [f.SPACING[1], f.SPACING[0]]
            ds.ImagePositionPatient, ds.ImageOrientationPatient = [0.0, 0.0, float(k) * f.SPACING[2]], [1, 0, 0, 0, 1, 0]
            ds.InstanceNumber, ds.SamplesPerPixel, ds.PhotometricInterpretation = k + 1, 1, "MONOCHROME2"
            ds.BitsAllocated = ds.BitsStored = 16
            ds.HighBit, ds.PixelRepresentation = 15, 1
            ds.RescaleSlope, ds.RescaleIntercept = 1, 0
            ds.PixelData = f.GREY[k].tobytes()
            change(ds, k)
            yield ds

    def series(name, change=lambda ds, k: None, world=stored_world, spacing=f.SPACING, also=lambda folder: None, syntax=ExplicitVRLittleEndian, **how):
        folder = dir / name
        folder.mkdir()
        for k, ds in enumerate(slices(change, syntax)):
            ds.save_as(folder / f"IM{k:04d}", enforce_file_format=True)
        also(folder)
        f.check(f"pydicom, {name}", folder, world, spacing, **how)

    def big_endian(ds, k):
        ds.PixelData = f.GREY[k].astype(">i2").tobytes()

    def slopes(ds, k):
        ds.RescaleSlope, ds.RescaleIntercept = k + 1, -100 * k

    def rounded(ds, k):
        ds.ImagePositionPatient = ["0", "0", f"{k * 0.0345:.2f}"]

    def unknown(ds, k):
        inner = pydicom.Dataset()
        inner.add_new((0x0040, 0x0007), "LO", "made")
        # As an archive leaves a private sequence that it does not know: VR UN, its items implicit.
        buffer = pydicom.filebase.DicomBytesIO()
        buffer.is_little_endian, buffer.is_implicit_VR = True, True
        pydicom.filewriter.write_sequence_item(buffer, inner, ["utf8"])
        ds.private_block(0x0009, "made by a scanner", create=True).add_new(1, "UN", buffer.getvalue())

    series("big-endian", big_endian, syntax=ExplicitVRBigEndian)
    scaled = np.stack([page * float(k + 1) - 100 * k for k, page in enumerate(f.GREY)])
    series("slopes of each slice", slopes, (scaled > 2999.5).astype(np.uint8)[:, ::-1, ::-1], grey=scaled)
    series("positions rounded to 0.01 mm", rounded, spacing=None)
    series("a sequence that an archive left as UN", unknown)
    series("no positions, SliceLocation alone", lambda ds, k: (delattr(ds, "ImagePositionPatient"), delattr(ds, "InstanceNumber"), setattr(ds, "SliceLocation", k * f.SPACING[2])))

    def report(folder):
        ds = next(slices())
        for key in ("Rows", "Columns", "PixelData", "PixelSpacing"):
            delattr(ds, key)
        ds.Modality, ds.SOPClassUID = "SR", "1.2.840.10008.5.1.4.1.1.88.11"
        ds.file_meta.MediaStorageSOPClassUID = ds.SOPClassUID
        ds.save_as(folder / "SR0001", enforce_file_format=True)
        from pydicom.fileset import FileSet

        files = FileSet()
        for path in sorted(folder.iterdir()):
            if path.name.startswith("IM"):
                one = pydicom.dcmread(path)
                one.PatientID, one.PatientName, one.StudyDate, one.StudyTime = "1", "a", "20260101", "120000"
                one.StudyInstanceUID, one.StudyID, one.SeriesNumber = "1.2.3", "1", 1
                files.add(one)
        other = dir / "set"
        files.write(other)
        (folder / "DICOMDIR").write_bytes((other / "DICOMDIR").read_bytes())

    series("a report and a DICOMDIR among the slices", also=report)
    padded = f.GREY.copy()
    padded[:, :, 0] = -3024
    measured = padded[:, :, 1:]

    def padding(ds, k):
        ds.PixelData = padded[k].tobytes()
        ds.add_new((0x0028, 0x0120), "SS", -3024)

    bone = (padded > -500.5) & (padded != -3024)
    series("padding", padding, bone.astype(np.uint8)[:, ::-1, ::-1], extra=("--lower=-500.5",), grey=measured)

    def dark(ds, k):
        padding(ds, k)
        ds.add_new((0x0028, 0x0121), "SS", -4000)

    series("a window that takes padding", dark, (padded != -3024).astype(np.uint8)[:, ::-1, ::-1], extra=("--upper", "9000", "--lower=-9000"), grey=measured)
    frames = next(slices())
    frames.NumberOfFrames, frames.PixelData = len(f.GREY), f.GREY.tobytes()
    frames.GridFrameOffsetVector = [-k * f.SPACING[2] for k in range(len(f.GREY))]
    path = dir / "offsets.dcm"
    frames.save_as(path, enforce_file_format=True)
    f.check("pydicom, frames whose offsets fall", path, stored_world[::-1])
    frames.PixelRepresentation, frames.SamplesPerPixel, frames.PhotometricInterpretation, frames.PlanarConfiguration = 0, 3, "RGB", 0
    frames.BitsAllocated = frames.BitsStored = 8
    frames.HighBit = 7
    frames.PixelData = bytes(3 * f.GREY.size)
    frames.save_as(dir / "colour.dcm", enforce_file_format=True)
    f.refuse("pydicom, colours", dir / "colour.dcm", "colour image", "RGB")


def pillow_tiffs(dir, f):
    Image = f.needs("PIL.Image")
    if not Image:
        return
    bone = f.GREY > 2999.5
    wide = (f.GREY.astype(np.int32) + 1000).astype(np.uint16)
    for compression in ("raw", "tiff_lzw", "tiff_deflate", "tiff_adobe_deflate", "packbits", "zstd", "group4"):
        for name, values, lower in (("1 bit", bone, 0.5), ("8 bits", (bone * 200).astype(np.uint8), 100), ("16 bits", wide, 3999.5), ("floats", f.GREY.astype(np.float32), 2999.5)):
            if compression == "group4" and name != "1 bit":
                continue
            path = dir / f"{compression}-{name}.tif"
            pages = [Image.fromarray(page) for page in values]
            try:
                pages[0].save(path, save_all=True, append_images=pages[1:], compression=compression)
            except (OSError, ValueError, RuntimeError) as e:
                print(f"skipped  Pillow {compression}, {name}: {e}")
                continue
            f.check(f"Pillow tif, {compression}, {name}", path, (values.astype(float) > lower).astype(np.uint8), None, extra=("--spacing", "0.02", "--lower", lower), grey=values)
    for kind in ("bmp", "png"):
        folder = dir / f"{kind}1"
        folder.mkdir()
        for k, page in enumerate(bone):
            Image.fromarray(page).save(folder / f"s{k}.{kind}")
        back = np.stack([np.asarray(Image.open(folder / f"s{k}.{kind}").convert("L")) for k in range(len(bone))])
        f.check(f"Pillow {kind} of 1 bit", folder, (back > 0).astype(np.uint8), None, extra=("--spacing", "0.02", "--lower", "0.5"))


GROUPS = (simpleitk_kinds, nibabel_masks, nibabel_kinds, pynrrd_kinds, pydicom_changes, pillow_tiffs)
