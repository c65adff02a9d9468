"""What has no meaning, or two, is refused in words."""

import numpy as np
import pytest

import bonepd_ct
from conftest import bonepd_ct_command

MASK = np.ones((4, 4, 4), bool)
FLOATS = MASK.astype(float)


@pytest.mark.parametrize(
    ("array", "settings", "words"),
    [
        (FLOATS, {}, "no threshold given"),
        (2 * MASK.astype(np.uint8), {}, "no threshold given"),
        (-MASK.astype(np.int8), {}, "no threshold given"),
        (FLOATS.astype(complex), {"lower": 1}, "complex128 are no voxels"),
        (np.full((4, 4, 4), "bone"), {"lower": 1}, "are no voxels"),
        (MASK[0], {}, r"has the shape \(4, 4\)"),
        (MASK[:0], {}, r"has the shape \(0, 4, 4\)"),
        (np.ma.masked_array(FLOATS, ~MASK), {"lower": 1}, "fill them"),
        (~MASK, {}, r"no voxel has one of the labels \[1\]"),
        (MASK, {"poison": 0.3}, "did you mean `poisson`"),
        (MASK, {"poisson": 0.5}, "poisson"),
        (MASK, {"poisson": "soft"}, 'poisson = "soft"'),
        (MASK, {"poisson": float("nan")}, "poisson: Out of range"),
        (MASK, {"poisson": object()}, "poisson: "),
        (MASK, {"error": 0.1, "method": "voxel-fe"}, "the error target chooses method"),
        (MASK, {"order": "yxz"}, "no order of axes"),
        (MASK, {"spacing_mm": "small"}, "no voxel size"),
        (MASK, {"spacing_mm": (0.02, 0.02)}, "no voxel size"),
        (MASK, {"spacing_mm": {"x": 0.02}}, "give x, y and z"),
        (MASK, {"spacing_mm": 20.0}, "0.02 mm instead of 20"),
        (MASK, {"spacing_mm": 0.0}, "voxel sizes in mm above 0"),
        (MASK, {"units": "hu"}, "these values are in memory"),
        (MASK, {"voi": MASK[:2]}, r"has the shape \(2, 4, 4\)"),
        (MASK, {"lower": 1, "otsu": True}, "exclude each other"),
        (MASK, {"threads": 10**9}, "threads"),
    ],
)
def test_refused(array, settings, words):
    with pytest.raises(bonepd_ct.BonepdError, match=words) as raised:
        bonepd_ct.solve(array, **{"spacing_mm": 0.02, **settings})
    assert "what to do: " in str(raised.value)
    assert isinstance(raised.value, ValueError)


def test_words_are_those_of_the_command(tmp_path):
    np.save(tmp_path / "a.npy", FLOATS)
    words = ["segment", tmp_path / "a.npy", "-o", tmp_path / "out", "--spacing", "0.02", "--lower", "2"]
    done = bonepd_ct_command(*words)
    with pytest.raises(bonepd_ct.SpecimenError) as raised:
        bonepd_ct.segment(FLOATS, 0.02, lower=2)
    assert done.returncode == 2 and done.stderr.endswith(f"error: {raised.value}\n")


def test_a_missing_file_is_an_error_of_the_system(tmp_path):
    with pytest.raises(OSError, match="what to do") as raised:
        bonepd_ct.run("quick", tmp_path / "gone.nii.gz")
    assert isinstance(raised.value, bonepd_ct.FileError)
    with pytest.raises(bonepd_ct.BonepdError, match="to-an-error"):
        bonepd_ct.run("to-an-eror", tmp_path / "gone.nii.gz")


def test_stiffness_takes_no_other_load_or_method():
    for setting in ({"load": "torsion"}, {"method": "lattice"}):
        with pytest.raises(bonepd_ct.SettingError, match="leave"):
            bonepd_ct.stiffness(MASK, 0.02, **setting)


def test_rounded_integers_are_said():
    labels = np.where(np.arange(64).reshape(4, 4, 4) % 2, 2**24 + 1, 0)
    with pytest.warns(bonepd_ct.BonepdWarning, match="rounded"):
        bonepd_ct.segment(labels, 0.02, lower=1, keep_all=True)


def test_what_is_missed_is_said(grey):
    with pytest.warns(bonepd_ct.BonepdWarning, match="cannot reach the error asked for"):
        result = bonepd_ct.solve(grey >= 300, 0.02, error=1e-3)
    assert result["met"] is False and result["target"] == 1e-3
    assert any("cannot reach" in line for line in result["warnings"])
    with pytest.warns(bonepd_ct.BonepdWarning, match="not all converged"):
        result = bonepd_ct.solve(grey, 0.02, lower=300, method="voxel-fe", max_iterations=1)
    assert result["converged"] is False


def test_a_body_with_a_gap_carries_nothing():
    gap = MASK.copy()
    gap[:, :, 2] = False
    result = bonepd_ct.solve(gap, 0.02, method="voxel-fe", keep_all=True)
    assert result["e_app_mpa"] == 0.0 and "no path of bone" in result["note"]
