"""From a μCT scan of trabecular bone to its apparent stiffness, with a stated error.

>>> import bonepd_ct
>>> result = bonepd_ct.solve(scan, 0.0195, lower=200, error=0.10)
>>> result["e_app_mpa"], result["error_mpa"]

Lengths are mm, forces N, moduli MPa, times s; a negative strain is compression. Arrays are indexed [x, y, z], or [z, y, x]
with ``order="zyx"``. The command ``bonepd-ct`` is the same program.
"""

from __future__ import annotations

import json
import os
import tempfile
import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Optional, Union

from . import _native, _voxels
from ._errors import BonepdError, BonepdWarning, FileError, SettingError, SpecimenError
from ._settings import as_json, refused, spacing_xyz

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from typing_extensions import Unpack

    from ._settings import RunSettings, SegmentSettings, SolveSettings, Spacing

    PathLike = Union[str, os.PathLike[str]]

__version__ = _native.__version__

__all__ = [
    "BonepdError",
    "BonepdWarning",
    "FileError",
    "SettingError",
    "SpecimenError",
    "__version__",
    "run",
    "segment",
    "solve",
    "stiffness",
]


def segment(
    array: ArrayLike,
    spacing_mm: Spacing,
    *,
    order: str = "xyz",
    lower: Optional[float] = None,
    name: str = "array",
    threads: Optional[int] = None,
    **settings: Unpack[SegmentSettings],
) -> dict[str, Any]:
    """Find the bone in a scan.

    ``array`` is a mask (bool, or integers that are only 0 and 1), or grey values: these need ``lower`` (with or without
    ``upper``), ``otsu=True`` or ``labels``. ``spacing_mm`` is the voxel size: one number, three along x, y, z, or a dict of x, y, z.
    Further settings are those of ``[segment]`` in a recipe. ``voi`` may be an array, non-zero inside, in the order of ``array``.

    Returns the numbers of ``segment.json`` (``bone_voxels``, ``bv_tv``, ``tv_mm3``, ...) and ``mask``, an array of bool, indexed as
    ``array``: on the grid of its crop, if any.
    """
    values, voi, text, told = _scan(array, spacing_mm, order, lower, settings)
    mask, said = _native.segment(values, voi, name, text, threads)
    found = json.loads(said)
    _warn(told + found["warnings"], depth=3)
    return {**found["record"]["results"], "mask": _mask(mask, order)}


def solve(
    array: ArrayLike,
    spacing_mm: Spacing,
    *,
    order: str = "xyz",
    lower: Optional[float] = None,
    name: str = "array",
    threads: Optional[int] = None,
    progress: bool = True,
    **settings: Unpack[SolveSettings],
) -> dict[str, Any]:
    """Compress a scan and compute its apparent modulus.

    ``array``, ``spacing_mm`` and the settings that find the bone are those of :func:`segment`. Further settings are those of
    ``[lattice]`` and ``[solve]`` in a recipe, and ``error``, the stated error asked for (0.10 or "10%").

    Returns the columns of ``results.csv`` of the row that answers (that of the least stated error), those of ``answer.json`` that
    are not among them (``target``, ``met``, ``element_mm``, ``conditions``, ...), and

    * ``rows``: all rows, as dicts; a row with fields of its own has them as ``fields``
    * ``answer``: the content of ``answer.json``
    * ``segment``: the numbers of ``segment.json``
    * ``mask``: an array of bool, indexed as ``array``
    * ``fields``: what ``fields=[...]`` asks for, by name with the unit (``sed_mpa``); of voxels arrays indexed as ``array`` with
      components last; displacements are ``displacement_x_mm``, ``_y_``, ``_z_``; ``nodal_force_n``, at corners, is one longer along each axis
    * ``details``: forces at both ends, and tables of failure, sections, tissue and the curve, where asked for
    * ``warnings``: what is also raised as :class:`BonepdWarning`

    What is missing is None. A solve that did not converge is no error: ``converged`` is False. Ctrl-C stops the call.
    ``progress`` shows bars on stderr where that is a terminal.
    """
    return _solved(array, spacing_mm, order, lower, name, threads, progress, dict(settings))[0]


def stiffness(
    array: ArrayLike,
    spacing_mm: Spacing,
    *,
    order: str = "xyz",
    lower: Optional[float] = None,
    name: str = "array",
    threads: Optional[int] = None,
    progress: bool = True,
    **settings: Unpack[SolveSettings],
) -> dict[str, Any]:
    """The apparent stiffness: all six unit strains, by voxel elements.

    Settings are those of :func:`solve`; ``conditions`` says what is done to the faces. Returns the content of ``stiffness.json``
    (``stiffness_mpa``, ``algebraic_error_mpa``: arrays of 6 x 6 in ``voigt_order`` 11, 22, 33, 23, 13, 12; ``orthotropic``, ...) with
    what else :func:`solve` returns. Axes are x, y, z, whatever the order of the array.
    """
    import numpy as np

    given: dict[str, Any] = dict(settings)
    for key, only in (("load", "stiffness"), ("method", "voxel-fe")):
        if given.setdefault(key, only) != only:
            raise refused(key, f"expected {only}, found {given[key]}", f"leave {key} out")
    result, matrix = _solved(array, spacing_mm, order, lower, name, threads, progress, given)
    for key in ("stiffness_mpa", "algebraic_error_mpa"):
        matrix[key] = np.array(matrix[key])
    # Of the mask's file, and there is none.
    del matrix["mask_blake3"]
    return {**result, **matrix}


def run(
    recipe: PathLike,
    scans: Union[PathLike, Iterable[PathLike]],
    out: Optional[PathLike] = None,
    *,
    jobs: int = 1,
    force: bool = False,
    progress: bool = True,
    **settings: Unpack[RunSettings],
) -> dict[str, Any]:
    """Take scans on disk through a recipe, as ``bonepd-ct run RECIPE INPUT... -o OUT``.

    ``recipe`` is a file or the name of a recipe in the program (``quick``, ``to-an-error``, ``paper``, ...). ``scans`` are files, folders,
    manifests. ``out`` is the folder for tables and page; without one they are made in a folder that is removed at the end.
    ``settings`` override the recipe's. ``jobs`` is the number of scans at a time; ``force`` redoes what is up to date.

    Returns ``outcome`` (``done``, ``not converged``, ``some failed``), ``scans`` (what became of each scan, with its ``answer``: a line of
    ``answers.csv``), ``rows`` (of ``results.csv``) and ``warnings``. One scan alone that fails raises its error.
    """
    given: dict[str, Any] = dict(settings)
    if given.get("spacing_mm") is not None:
        given["spacing_mm"] = spacing_xyz(given["spacing_mm"])
    text = as_json(given)
    if isinstance(scans, (str, os.PathLike)):
        scans = [scans]
    request: _native.Request = {
        "recipe": os.fspath(recipe),
        "scans": [os.fspath(scan) for scan in scans],
        "out": "" if out is None else os.fspath(out),
        "jobs": jobs,
        "force": force,
        "progress": progress,
    }
    if out is None:
        with tempfile.TemporaryDirectory(prefix="bonepd-ct-") as folder:
            said = _native.run({**request, "out": folder}, text)
    else:
        said = _native.run(request, text)
    found: dict[str, Any] = json.loads(said)
    _warn(found["warnings"], depth=3)
    return found


def _scan(array: ArrayLike, spacing_mm: Spacing, order: str, lower: Optional[float], settings: Any) -> Any:
    """The voxels, the volume of interest where that is an array, the settings as JSON, and warnings."""
    import numpy as np

    _voxels.check_order(order)
    voxels = _voxels.taken(array, order)
    given = {**settings, "lower": lower, "spacing_mm": spacing_xyz(spacing_mm)}
    told = [*_voxels.said_of_spacing(spacing_mm, given["spacing_mm"], order), *_voxels.said_of_rounding(voxels)]
    voi = given.get("voi")
    if voi is not None and not isinstance(voi, (str, dict)):
        inside = _voxels.taken(voi, order, "voi")
        if inside.shape != voxels.shape:
            raise refused("voi", f"has the shape {np.shape(voi)}, the array {np.shape(array)}", "give one on the same voxels")
        voi = np.ascontiguousarray(inside != 0, dtype=np.uint8)
        given["voi"] = {"mask": "voi"}
    else:
        voi = None
    chosen = any(given.get(key) for key in ("otsu", "labels"))
    if not chosen and lower is None and given.get("upper") is None and _voxels.is_mask(voxels):
        given["labels"] = [1]
    return np.ascontiguousarray(voxels, dtype=np.float32), voi, as_json(given), told


def _solved(
    array: ArrayLike,
    spacing_mm: Spacing,
    order: str,
    lower: Optional[float],
    name: str,
    threads: Optional[int],
    progress: bool,
    settings: Any,
) -> tuple[dict[str, Any], dict[str, Any]]:
    """What :func:`solve` returns, and the content of ``stiffness.json``."""
    values, voi, text, told = _scan(array, spacing_mm, order, lower, settings)
    mask, fields, said = _native.solve(values, voi, name, text, threads, progress)
    found = json.loads(said)
    solved = found["solved"]
    rows = solved["rows"]
    told += found["warnings"]
    if any(row["converged"] is False for row in rows):
        told.append("not all converged: see `converged` and `note` of the rows")
    _warn(told, depth=4)
    for index, own in fields:
        if own:
            rows[index]["fields"] = {key: _voxels.field(value, order) for key, value in own.items()}
    answers = solved["answers"]
    with_fields = [row for row in rows if "fields" in row]
    row = rows[answers]
    of_one = with_fields[0]["fields"] if len(with_fields) == 1 else {}
    result = {
        **(solved["answer"] or {}),
        **row,
        "rows": rows,
        "answer": solved["answer"],
        "segment": solved["segment"]["results"],
        "mask": _mask(mask, order),
        "fields": row.get("fields", of_one),
        "details": solved["details"][answers],
        "warnings": told,
    }
    return result, found["stiffness"]


def _mask(mask: Any, order: str) -> Any:
    return _voxels.in_order(mask.view(bool), order)


def _warn(told: Iterable[str], depth: int) -> None:
    """At the line of the caller, so many calls up."""
    for line in told:
        warnings.warn(line, BonepdWarning, stacklevel=depth)
