"""Axes, voxel sizes and orders, against closed forms."""

import numpy as np
import pytest

import bonepd_ct

FE = {"method": "voxel-fe", "fields": "displacement"}


def test_a_block_is_as_stiff_as_its_tissue():
    sizes = (0.02, 0.03, 0.05)
    result = bonepd_ct.solve(np.ones((6, 5, 4), bool), sizes, young_mpa=2000.0, **FE)
    assert result["e_app_mpa"] == pytest.approx(2000.0, rel=1e-6)
    # E A / L: 6 × 5 voxels across, 4 along.
    assert result["stiffness_n_per_mm"] == pytest.approx(2000 * (6 * 0.02) * (5 * 0.03) / (4 * 0.05), rel=1e-6)
    assert result["segment"]["voxels"] == [6, 5, 4]


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_bar_carries_along_its_own_axis_alone(axis):
    bar = np.zeros((7, 8, 9), bool)
    along = "xyz".index(axis)
    bar[tuple(slice(None) if a == along else slice(3, 5) for a in range(3))] = True
    moduli = [bonepd_ct.solve(bar, 0.02, axis=other, **FE)["e_app_mpa"] for other in "xyz"]
    share = 4 * bar.shape[along] / bar.size
    assert moduli[along] == pytest.approx(1000 * share, rel=1e-6)
    assert [m for a, m in enumerate(moduli) if a != along] == [0.0, 0.0]


def test_a_stack_of_slices_is_the_same_body(grey):
    sizes = {"x": 0.02, "y": 0.03, "z": 0.025}
    one = bonepd_ct.solve(grey, (0.02, 0.03, 0.025), lower=300, **FE)
    stack = bonepd_ct.solve(np.ascontiguousarray(grey.T), sizes, order="zyx", lower=300, **FE)
    assert one["e_app_mpa"] == stack["e_app_mpa"]
    assert one["voxel_mm"] == stack["voxel_mm"] == "0.02;0.03;0.025"
    assert np.array_equal(one["mask"], stack["mask"].T)
    for name, field in one["fields"].items():
        assert np.array_equal(field, stack["fields"][name].T), name
    # -1 % between the ends, along z.
    u = one["fields"]["displacement_z_mm"]
    ends = [u[:, :, k][u[:, :, k] != 0.0] for k in (0, -1)]
    moved = np.concatenate(ends)
    # Means over voxels: struts that end in pore turn with their voxels, by up to a percent or so.
    assert np.ptp(moved) == pytest.approx(0.01 * 28 * 0.025, rel=0.03)


def test_sizes_of_a_stack_that_might_be_meant_otherwise_are_said(grey):
    with pytest.warns(bonepd_ct.BonepdWarning, match="0.02 mm along the array's last axis"):
        result = bonepd_ct.segment(grey.T, (0.02, 0.03, 0.025), order="zyx", lower=300)
    assert result["spacing_mm"] == [0.02, 0.03, 0.025]


def test_a_turned_scan_has_its_fields_on_its_own_voxels(grey):
    result = bonepd_ct.solve(grey, 0.02, lower=300, turn="x", fields="sed", method="voxel-fe")
    along_x = bonepd_ct.solve(grey, 0.02, lower=300, axis="x", fields="sed", method="voxel-fe")
    assert np.array_equal(result["mask"], along_x["mask"])
    assert result["fields"]["sed_mpa"].shape == grey.shape
    assert np.allclose(result["fields"]["sed_mpa"], along_x["fields"]["sed_mpa"], rtol=1e-2, atol=1e-3)


def test_memory_order_and_bytes_do_not_matter(grey):
    expected = bonepd_ct.segment(grey, 0.02, lower=300)["mask"]
    for other in (np.asfortranarray(grey), grey.astype(">i4"), grey.astype(float), grey[::-1][::-1], grey.tolist()):
        assert np.array_equal(bonepd_ct.segment(other, 0.02, lower=300)["mask"], expected)


def test_a_volume_of_interest_is_an_array_of_the_same_order(grey):
    voi = np.zeros(grey.shape, bool)
    voi[:, :, :10] = True
    one = bonepd_ct.segment(grey, 0.02, lower=300, voi=voi)
    stack = bonepd_ct.segment(grey.T, 0.02, lower=300, voi=voi.T, order="zyx")
    assert one["tv_mm3"] == stack["tv_mm3"] == pytest.approx(24 * 20 * 10 * 0.02**3)
    assert not one["mask"][:, :, 10:].any() and one["mask"].any()


def test_fields_of_lattices_and_smooth_elements(grey):
    lattice = bonepd_ct.solve(grey, 0.02, lower=300, lp_mm=0.1, fields=["displacement", "sed"])
    assert [sorted(row.get("fields", {})) for row in lattice["rows"]] == [["at_mm", "displacement_mm", "sed_mpa"]] * 2 + [[]]
    own = lattice["rows"][0]["fields"]
    assert own["at_mm"].shape == own["displacement_mm"].shape == (lattice["rows"][0]["sites"], 3)
    assert (own["at_mm"].max(axis=0) <= 0.02 * np.array(grey.shape)).all()
    smooth = bonepd_ct.solve(grey, 0.02, lower=300, method="geometry-fe", element_mm=0.04, fields="displacement")
    fields = smooth["fields"]
    assert fields["elements"].shape[1] == 10 and fields["elements"].max() == len(fields["nodes_mm"]) - 1
    assert fields["displacement_mm"].shape == fields["nodes_mm"].shape
