"""Bodies to solve, and the command to compare with."""

import csv
import gzip
import json
import subprocess
import sys

import numpy as np
import pytest


def gyroid(shape, period=16.0):
    """Grey values of a smooth body that joins all faces, indexed [x, y, z]: uint16, bone from 300 on."""
    x, y, z = (2 * np.pi * np.arange(n) / period for n in shape)
    x, y, z = np.meshgrid(x, y, z, indexing="ij")
    sheet = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    return np.clip(300 + 200 * sheet, 0, 1000).astype(np.uint16)


@pytest.fixture
def grey():
    """Three different lengths: axes that are mixed up show."""
    return gyroid((24, 20, 28))


@pytest.fixture
def command(tmp_path):
    """Segments and solves an array [x, y, z] with the command, and returns what it leaves."""

    def run(array, segment, solve):
        np.save(tmp_path / "array.npy", array.transpose(2, 1, 0))
        out = tmp_path / "out"
        for words in (["segment", tmp_path / "array.npy", "-o", out, *segment], ["solve", out, *solve]):
            done = bonepd_ct_command(*words)
            assert done.returncode in (0, 1), done.stderr
        return Left(out)

    return run


def bonepd_ct_command(*words):
    """The command of the package."""
    all_words = [sys.executable, "-m", "bonepd_ct", *map(str, words)]
    return subprocess.run(all_words, capture_output=True, text=True)


class Left:
    """What the command left in a folder."""

    def __init__(self, folder):
        self.folder = folder

    def rows(self):
        """Of ``results.csv``, as text."""
        with open(self.folder / "results.csv", newline="") as file:
            return list(csv.DictReader(file))

    def json(self, name):
        return json.loads((self.folder / name).read_text())

    def volume(self, name):
        """A NIfTI file of one float or byte a voxel, or of a vector, indexed [x, y, z, component]."""
        data = gzip.decompress((self.folder / name).read_bytes())
        dim = np.frombuffer(data, "<i2", 8, 40)
        kind = {2: "u1", 16: "<f4"}[int(np.frombuffer(data, "<i2", 1, 70)[0])]
        shape = dim[1 : dim[0] + 1]
        start = int(np.frombuffer(data, "<f4", 1, 108)[0])
        values = np.frombuffer(data, kind, int(np.prod(shape)), start)
        return values.reshape(shape, order="F").squeeze()


def as_text(row):
    """A row as ``results.csv`` has it."""

    def cell(value):
        if value is None:
            return "NA"
        return str(value).lower() if isinstance(value, bool) else value

    return {key: cell(value) for key, value in row.items() if key != "fields"}


def same(row, of_command):
    """Whether a row is that of the command, to the last bit; clock and memory aside."""
    own = as_text(row)
    assert own.keys() == of_command.keys()
    for key in own.keys() - {"wall_s", "peak_mib"}:
        expected = of_command[key]
        found = float(expected) if isinstance(own[key], (int, float)) else expected
        assert own[key] == found, key
    return True
