"""The code in the pages runs."""

import pathlib

import numpy as np
import pytest

from conftest import gyroid

ROOT = pathlib.Path(__file__).parents[2]


def blocks(page):
    """Blocks of Python that use the package."""
    parts = (ROOT / page).read_text().split("```python\n")[1:]
    found = [part.split("```")[0] for part in parts]
    return [block for block in found if "bonepd_ct." in block]


@pytest.mark.parametrize(("page", "number"), [("README.md", 1), ("docs/python.md", 2)])
@pytest.mark.filterwarnings("ignore::bonepd_ct.BonepdWarning")
def test_blocks_run(page, number):
    mask = gyroid((16, 16, 16)) >= 300
    labels = mask * np.where(np.arange(16) < 8, 100, 127)
    names = {"mask": mask, "labels": labels}
    found = blocks(page)
    assert len(found) == number
    for block in found:
        exec(block, names)
    assert names["result"]["e_app_mpa"] > names["result"]["error_mpa"] > 0
