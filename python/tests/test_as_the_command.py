"""Numbers and stated errors are those of the command on the same data, to the last bit."""

import numpy as np
import pytest

import bonepd_ct
from conftest import same

VOXEL_FE = ["--method", "voxel-fe"]


@pytest.mark.parametrize(
    ("words", "settings"),
    [
        (VOXEL_FE, {"method": "voxel-fe"}),
        (["--lp", "0.1"], {"lp_mm": 0.1}),
        (["--method", "geometry-fe", "--element-mm", "0.04"], {"method": "geometry-fe", "element_mm": 0.04}),
        (["--error", "5%"], {"error": "5%"}),
        (["--error", "90%"], {"error": 0.9}),
        ([*VOXEL_FE, "--load", "torsion", "--axis", "x"], {"method": "voxel-fe", "load": "torsion", "axis": "x"}),
        ([*VOXEL_FE, "--failure"], {"method": "voxel-fe", "pistoia": {}}),
        (
            [*VOXEL_FE, "--plasticity", "von-mises:5", "--steps", "3"],
            {"method": "voxel-fe", "plasticity": {"all": {"von-mises": {"yield_mpa": 5.0}}}, "steps": 3},
        ),
    ],
)
@pytest.mark.filterwarnings("ignore::bonepd_ct.BonepdWarning")
def test_rows_of_grey_values(grey, command, words, settings):
    left = command(grey, ["--spacing", "0.02", "--lower", "300", "--gaussian", "0.8"], words)
    result = bonepd_ct.solve(grey, 0.02, lower=300, gaussian_voxels=0.8, **settings)
    rows = left.rows()
    assert len(result["rows"]) == len(rows) > 0
    assert all(map(same, result["rows"], rows))
    answer = left.json("answer.json")
    assert {**result["answer"], "wall_s": answer["wall_s"]} == answer
    assert result["e_app_mpa"] == answer["e_app_mpa"]


@pytest.mark.parametrize("kind", [bool, np.uint8, np.int64])
def test_rows_of_a_mask(grey, command, kind):
    mask = (grey >= 300).astype(kind)
    left = command(mask.astype(np.uint8), ["--spacing", "0.02", "--labels", "1"], VOXEL_FE)
    result = bonepd_ct.solve(mask, 0.02, method="voxel-fe")
    assert same(result["rows"][0], left.rows()[0])
    assert result["error_mpa"] > result["algebraic_error_mpa"] > 0


def test_fields(grey, command):
    words = [*VOXEL_FE, "--fields", "displacement,sed,strain"]
    left = command(grey, ["--spacing", "0.02", "--lower", "300"], words)
    result = bonepd_ct.solve(grey, 0.02, lower=300, method="voxel-fe", fields=["displacement", "sed", "strain"])
    fields = result["fields"]
    along = [f"displacement_{axis}_mm" for axis in "xyz"]
    assert sorted(fields) == [*along, "sed_mpa", "strain"]
    assert fields["strain"].shape == (*grey.shape, 6)
    assert fields["sed_mpa"].shape == fields[along[0]].shape == grey.shape == result["mask"].shape
    for name in fields:
        file = name.replace("_", "-")
        assert np.array_equal(fields[name], left.volume(f"field-{file}.nii.gz")), name
    assert np.array_equal(result["mask"], left.volume("mask.nii.gz") != 0)
    assert not fields["sed_mpa"][~result["mask"]].any()


def test_stiffness(grey, command):
    left = command(grey, ["--spacing", "0.02", "--lower", "300"], [*VOXEL_FE, "--load", "stiffness"])
    result = bonepd_ct.stiffness(grey, 0.02, lower=300)
    expected = left.json("stiffness.json")
    assert np.array_equal(result["stiffness_mpa"], expected["stiffness_mpa"])
    assert np.array_equal(result["algebraic_error_mpa"], expected["algebraic_error_mpa"])
    assert result["orthotropic"] == expected["orthotropic"]
    assert result["voigt_order"] == ["11", "22", "33", "23", "13", "12"]


def test_segment(grey, command):
    flags = ["--spacing", "0.02", "--otsu", "--crop", "2:24,0:20,4:28", "--morphometry"]
    left = command(grey, flags, VOXEL_FE)
    crop = [[2, 24], [0, 20], [4, 28]]
    result = bonepd_ct.segment(grey, 0.02, otsu=True, crop=crop, morphometry=True)
    mask = result.pop("mask")
    assert result == left.json("segment.json")["results"]
    assert np.array_equal(mask, left.volume("mask.nii.gz") != 0)


def test_run(grey, tmp_path):
    scans = [tmp_path / f"{name}.npy" for name in ("a", "b")]
    for scan, part in zip(scans, (grey, grey[:, :, ::-1])):
        np.save(scan, part.transpose(2, 1, 0))
    settings = {"spacing_mm": 0.02, "lower": 300, "lp_mm": [0.1]}
    found = bonepd_ct.run("quick", scans, tmp_path / "out", **settings)
    assert found["outcome"] == "done"
    assert [scan["scan"] for scan in found["scans"]] == ["a", "b"]
    assert (tmp_path / "out/report/report.html").is_file()
    rows = [row for row in found["rows"] if row["scan"] == "a"]
    alone = bonepd_ct.run("quick", scans[0], **settings)
    assert [row["e_app_mpa"] for row in alone["rows"]] == [row["e_app_mpa"] for row in rows]
    assert alone["scans"][0]["answer"]["e_app_mpa"] == found["scans"][0]["answer"]["e_app_mpa"] > 0
