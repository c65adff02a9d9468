"""Arrays on their way into the program, whose voxels have shape (nz, ny, nx), and back.

NumPy is imported where it is used: the command does without it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ._settings import refused

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

#: From here on single precision does not hold every integer.
MOST_INTEGER = 16_777_216


def check_order(order: str) -> None:
    """Refuses an order that is neither of the two."""
    if order not in ("xyz", "zyx"):
        raise refused("order", f"{order!r} is no order of axes", "give xyz (array[x, y, z]) or zyx (a stack of slices)")


def said_of_spacing(spacing: Any, sizes: list[float], order: str) -> list[str]:
    """Three unequal numbers might be meant in the order of the array."""
    if order == "xyz" or isinstance(spacing, Mapping) or len(set(sizes)) == 1:
        return []
    x, y, z = sizes
    return [
        f"spacing_mm is along x, y, z: voxels are {x} mm along the array's last axis and {z} mm along its first. "
        f'{{"x": {x}, "y": {y}, "z": {z}}} says the same without this warning'
    ]


def said_of_rounding(voxels: NDArray[Any]) -> list[str]:
    """The program keeps values in single precision."""
    if voxels.dtype.kind not in "iu" or max(-int(voxels.min()), int(voxels.max())) < MOST_INTEGER:
        return []
    return [f"integers from {MOST_INTEGER} on are rounded: values are kept in single precision"]


def is_mask(voxels: NDArray[Any]) -> bool:
    """Bool, or integers that are only 0 and 1."""
    is_integer = voxels.dtype.kind in "iu"
    return voxels.dtype.kind == "b" or bool(is_integer and voxels.min() >= 0 and voxels.max() <= 1)


def taken(array: ArrayLike, order: str, what: str = "array") -> NDArray[Any]:
    """Values of shape (nz, ny, nx), as they are."""
    import numpy as np

    if isinstance(array, np.ma.MaskedArray):
        raise refused(what, "some voxels are masked, and have no value", "fill them: array.filled(value)")
    voxels = np.asarray(array)
    if voxels.ndim != 3 or voxels.size == 0:
        raise refused(what, f"has the shape {voxels.shape}", "give an array of three axes, indexed [x, y, z]")
    if voxels.dtype.kind not in "biuf":
        raise refused(what, f"values of type {voxels.dtype} are no voxels", "give bool, integers or floats")
    return in_order(voxels, order)


def in_order(voxels: NDArray[Any], order: str) -> NDArray[Any]:
    """From the program's order to that of the caller, or back."""
    return voxels.transpose(2, 1, 0) if order == "xyz" else voxels


def field(value: Any, order: str) -> Any:
    """A field in the order of the caller's array; of voxels its components come last."""
    import numpy as np

    if not isinstance(value, list):
        return value
    components = [in_order(component, order) for component in value]
    return components[0] if len(components) == 1 else np.stack(components, axis=-1)
