"""The program, compiled. Voxels are arrays of shape (nz, ny, nx); settings and numbers are JSON."""

from collections.abc import Sequence
from typing import Any, Optional, TypedDict

import numpy as np
from numpy.typing import NDArray

__version__: str

class Request(TypedDict):
    recipe: str
    scans: Sequence[str]
    out: str
    jobs: int
    force: bool
    progress: bool

def main(words: Sequence[str]) -> int: ...
def segment(
    values: NDArray[np.float32],
    voi: Optional[NDArray[np.uint8]],
    name: str,
    settings: str,
    threads: Optional[int],
) -> tuple[NDArray[np.uint8], str]: ...
def solve(
    values: NDArray[np.float32],
    voi: Optional[NDArray[np.uint8]],
    name: str,
    settings: str,
    threads: Optional[int],
    progress: bool,
) -> tuple[NDArray[np.uint8], list[tuple[int, dict[str, Any]]], str]: ...
def run(request: Request, settings: str) -> str: ...
