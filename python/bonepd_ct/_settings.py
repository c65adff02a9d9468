"""Settings of a call: the keys of a recipe, side by side. ``bonepd-ct recipe paper`` prints each with its meaning and default."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypedDict, Union

from ._errors import SettingError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    #: mm: one number for all axes, three along x, y, z, or a dict of x, y, z.
    Spacing = Union[float, Sequence[float], Mapping[str, float]]

#: Settings that are lists; one value stands for a list of one.
LISTS = ("labels", "structure", "lp_mm", "boundary", "fields", "failure_labels")


class SegmentSettings(TypedDict, total=False):
    """How bone is found. Axes and numbers of voxels are along x, y, z, whatever the order of the array."""

    upper: float
    otsu: bool
    labels: int | Sequence[int]
    gaussian_voxels: float
    voi: str | Mapping[str, Any] | NDArray[Any]
    crop: Sequence[Sequence[int]]
    turn: str
    resample_mm: float | Sequence[float]
    align: str | Mapping[str, Any]
    align_box: str
    plane_cut_mm: float
    keep_all: bool
    keep_grey: bool
    no_grey: bool
    blur_voxels: float
    morphometry: bool


class SolveSettings(SegmentSettings, total=False):
    """The same, and how bone is solved."""

    error: float | str
    structure: str | Sequence[str]
    lp_mm: float | Sequence[float]
    boundary: str | Sequence[str]
    registration_mm: Sequence[float]
    method: str
    young_mpa: float
    poisson: float
    material: Mapping[str, Any]
    plasticity: Mapping[str, Any]
    steps: int
    strain: float | str
    grip_mm: float
    load: str
    angle_deg: float
    ends: str
    conditions: str
    axis: str
    tolerance: float | str
    max_iterations: int
    refine: int
    refine_mask: bool
    smoothed_again: bool
    coarsen: int
    coarsen_by: str
    element_mm: float
    mechanisms: bool
    fields: str | Sequence[str]
    pistoia: Mapping[str, float]
    failure_labels: int | Sequence[int]
    sed: str
    statistics: bool


class RunSettings(SolveSettings, total=False):
    """The same, and how files are read."""

    lower: float
    spacing_mm: Spacing
    units: str
    raw: str


def refused(key: str, found: str, advice: str) -> SettingError:
    """The error of a setting, worded as the program words it."""
    return SettingError(f"{key}: {found}\n  what to do: {advice}")


def spacing_xyz(spacing: Any) -> list[float]:
    """Voxel size along x, y, z in mm."""
    if isinstance(spacing, Mapping):
        if set(spacing) != {"x", "y", "z"}:
            raise refused("spacing_mm", f"has the keys {sorted(map(str, spacing))}", "give x, y and z")
        sizes = [spacing[axis] for axis in "xyz"]
    elif isinstance(spacing, Iterable) and not isinstance(spacing, str):
        sizes = list(spacing)
    else:
        sizes = [spacing] * 3
    try:
        numbers = [float(size) for size in sizes]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != 3:
        raise refused("spacing_mm", f"{spacing!r} is no voxel size", "give one number, or three along x, y, z")
    return numbers


def as_json(settings: Mapping[str, Any]) -> str:
    """The settings that are given (None is not), as JSON."""
    return json.dumps({key: _checked(key, value) for key, value in settings.items() if value is not None})


def _checked(key: str, value: Any) -> Any:
    is_one = isinstance(value, str) or not isinstance(value, Iterable)
    if key in LISTS and is_one:
        value = [value]
    if key == "resample_mm" and is_one:
        value = [value] * 3
    try:
        return json.loads(json.dumps(value, default=_plain, allow_nan=False))
    except (TypeError, ValueError) as error:
        raise refused(key, str(error), "give numbers, words, lists and dicts, as a recipe has them") from None


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays, and paths."""
    if hasattr(value, "tolist"):
        return value.tolist()
    return os.fspath(value)
