"""Several campaigns' datasets are one: their scalars side by side, every run cut as it was in its own."""

import itertools
from typing import Any

import numpy as np
import pytest
import xarray as xr

from nanoslip.study.api import concat, open as open_dataset, run
from nanoslip.study.dataset.file import read_groups, with_texts
from nanoslip.study.dataset.join import NotJoinableError
from nanoslip.study.results.store import StoreError
from tests.study.dataset.campaigns import FULL

PARTS = FULL | {"outputs": {**FULL["outputs"], "fit": False}}
"""Without fits, a third of the time."""


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """The full campaign in two: the radius is an axis in the one, a constant in the other."""
    made = []
    for name, radii in (("one", [100.0, 25.0]), ("other", [50.0])):
        folder = tmp_path_factory.mktemp(name)
        run(PARTS | {"title": name, "axes": {"intrinsic_friction": [0.5], "radius": radii}}, folder).close()
        made.append(folder)
    return made


@pytest.fixture(scope="module")
def whole():
    return run(PARTS | {"axes": {"intrinsic_friction": [0.5], "radius": [100.0, 25.0, 50.0]}})


@pytest.mark.slow
def test_datasets_paths_and_folders_are_joined_to_what_one_campaign_gives(folders, whole):
    with open_dataset(folders[0]) as first:
        joined = concat([first, folders[1] / "results.nc"])
    xr.testing.assert_identical(joined.drop_attrs(deep=False), whole.drop_attrs(deep=False))
    for radius in (25.0, 50.0):  # of either
        for draw in ("record", "teeth", "contact", "interior"):
            mine, theirs = (getattr(each.nanoslip, draw)(radius=radius) for each in (joined, whole))
            xr.testing.assert_identical(mine, theirs)
        for drive in ("slow", "fast"):
            mine, theirs = (each.nanoslip.trajectory(radius=radius, drive=drive) for each in (joined, whole))
            xr.testing.assert_identical(mine, theirs)
    xr.testing.assert_identical(joined.nanoslip.events(), whole.nanoslip.events())
    assert joined.attrs["title"] == "one; other"
    assert "manifest" not in joined.attrs
    assert [each.split(",")[0] for each in joined.attrs["sources"]] == ["one", "other"]
    assert joined.attrs["sources"] == concat([joined, joined], "outer").attrs["sources"]
    software = read_groups(joined)["software"]
    assert (
        software["software_results"].values.tolist()
        == read_groups(whole)["software"]["software_results"].values.tolist()
    )


@pytest.mark.slow
def test_xarray_itself_joins_the_scalars_of_both(folders, whole):
    """As `xr.open_mfdataset` does, with its own defaults: it opens every file's root, and combines by coordinates that rise."""
    two, one = (xr.open_dataset(folder / "results.nc") for folder in folders)
    parts = [one, two.sel(radius=[25.0])]
    joined = with_texts(xr.combine_by_coords(parts, combine_attrs="override"))
    assert joined["radius"].values.tolist() == [25.0, 50.0]
    for name in ("plateau_mean", "outcome", "static_friction", "record_id", "case_id"):
        xr.testing.assert_equal(joined[name], whole[name].sel(radius=[25.0, 50.0]))
    assert set(joined.dims) == {"intrinsic_friction", "radius", "aspect_ratio", "n_x", "drive"}
    with pytest.raises(ValueError, match=r"nanoslip\.concat"):
        joined.nanoslip.record(radius=50.0, intrinsic_friction=0.5)


BASE: dict[str, Any] = {
    "title": "base",
    "stages": ["contact", "slip"],
    "numerics": {"n_x": 17},
    "limits": {"events": 20},
    "ensemble": {"members": 1},
}
KNOWN: dict[str, xr.Dataset] = {}


def computed(**changes: Any) -> xr.Dataset:
    """The dataset of the base with other tables, computed once: not to be changed."""
    if repr(changes) not in KNOWN:
        KNOWN[repr(changes)] = run(BASE | changes)
    return KNOWN[repr(changes)]


@pytest.mark.slow
def test_lists_of_cases_are_numbered_on():
    joined = concat(computed(design="zip", axes={"radius": radii}) for radii in ([50.0, 60.0], [70.0, 80.0]))
    assert joined["case"].values.tolist() == [0, 1, 2, 3]
    assert joined["radius"].values.tolist() == [50.0, 60.0, 70.0, 80.0]
    assert joined.nanoslip.record(case=3).nanoslip is not None
    np.testing.assert_array_equal(joined.nanoslip.events()["radius"], np.repeat([50.0, 60.0, 70.0, 80.0], 20))


@pytest.mark.slow
def test_a_record_that_both_have_is_there_once():
    """A flat punch ignores the radius."""
    parts = [computed(constants={"pin": "flat_punch", "radius": radius}) for radius in (50.0, 60.0)]
    joined = concat(parts)
    assert read_groups(joined)["record"].sizes["record"] == 1
    assert joined.nanoslip.events().sizes["event"] == 40


REFUSED = {
    "other stages": (
        {},
        {"stages": ["contact"]},
        "dataset 2: approach, .*: there alone: needs the same stages, outputs",
    ),
    "other outputs": ({}, {"outputs": {"records": False}}, "dataset 2: record_id: only in dataset 1"),
    "other scales": (
        {"axes": {"radius": [50.0]}},
        {"axes": {"radius": [70.0]}, "scales": {"slab_width": "2 mm"}},
        "dataset 2: slab_width = 0.002: needs .*0.001",
    ),
    "other members": (
        {"ensemble": {"members": 3}},
        {"ensemble": {"members": 2}},
        r"members .* needs the same \[ensemble\]",
    ),
    "the same cases but for rounding": (
        {"axes": {"intrinsic_friction": [0.3]}, "limits": {"events": 5}},
        {"axes": {"intrinsic_friction": [0.1 + 0.2]}, "limits": {"events": 5}},
        "needs these cases in one of them alone",
    ),
    "a list beside axes": ({}, {"design": "zip", "axes": {"radius": [50.0, 60.0]}}, "needs all of one design"),
    "no full product": (
        {"axes": {"radius": [50.0], "normal_load": [1e-3, 2e-3]}},
        {"axes": {"radius": [70.0], "normal_load": [3e-3]}},
        r"3 of 6 cases of .*radius \(2\).* are there: needs cases that make up a full product",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize(("one", "other", "said"), REFUSED.values(), ids=REFUSED)
def test_what_does_not_fit_is_refused_with_what_differs(one, other, said):
    with pytest.raises(NotJoinableError, match=said):
        concat([computed(**one), computed(**other)])


@pytest.mark.slow
def test_cases_of_an_outer_join_that_nobody_has_are_pending():
    parts = [
        computed(axes={"radius": [radius], "normal_load": loads})
        for radius, loads in ((50.0, [1e-3, 2e-3]), (60.0, [2e-3]))
    ]
    joined = concat(parts, join="outer")
    hole = joined.sel(radius=60.0, normal_load=1e-3).squeeze()
    assert joined["final_displacement"].isnull().sum() == 1
    assert (hole["outcome"].item(), hole["message"].item(), hole["validity_flags"].item()) == ("pending", "", 0)
    assert joined["validity_flags"].dtype == parts[0]["validity_flags"].dtype
    assert joined.nanoslip.events().sizes["event"] == 60
    with pytest.raises(ValueError, match="no record"):
        joined.nanoslip.record(radius=60.0, normal_load=1e-3)
    for part in parts:
        there = joined["final_displacement"].sel(radius=part["radius"], normal_load=part["normal_load"])
        np.testing.assert_array_equal(there.values.ravel(), part["final_displacement"].values.ravel())
    with pytest.raises(ValueError, match="join = 'inner'"):
        concat(parts, join="inner")  # type: ignore[arg-type]


def test_each_dataset_may_have_an_axis_that_the_other_has_not():
    parts = [
        computed(axes={"radius": [50.0], **axis})
        for axis in ({"normal_load": [1e-3, 2e-3]}, {"scheme": ["biquadratic", "strip"]})
    ]
    joined = concat(parts, join="outer")
    assert (joined["outcome"].values != "pending").sum() == 4
    for part in parts:
        for case in part["case_id"].values.ravel():
            mine, theirs = (each["final_displacement"].where(each["case_id"] == case).max() for each in (joined, part))
            assert mine.item() == theirs.item()


@pytest.mark.slow
def test_labels_that_differ_in_rounding_are_one() -> None:
    parts = [
        computed(axes={"intrinsic_friction": [each], "normal_load": [load]})
        for each, load in ((0.3, 1e-3), (0.1 + 0.2, 2e-3))
    ]
    assert concat(parts)["intrinsic_friction"].values.tolist() == [0.3]


@pytest.mark.slow
def test_two_labels_of_one_dataset_stay_two() -> None:
    """Also where each differs from one of another dataset in rounding alone."""
    loads = [[1e-3], [1e-3, 1e-3 * (1.0 + 1e-12)], [1e-3 * (1.0 - 1e-12), 1e-3 * (1.0 + 2e-12)]]
    parts = [computed(stages=["contact"], axes={"normal_load": each}) for each in loads]
    for first, second in itertools.pairwise((0, 1, 2, 0)):  # each is the first once, and the second once
        joined = concat([parts[first], parts[second]], join="outer")
        assert joined["normal_load"].values.tolist() == sorted({*loads[first], *loads[second]})


def test_results_that_contradict_each_other_are_refused():
    one = computed()
    other = one.assign(plateau_mean=one["plateau_mean"] + 0.1, peak_friction=one["peak_friction"] + 0.1)
    with pytest.raises(NotJoinableError, match=r"dataset 2: peak_friction .*dataset 1"):
        concat([one, other])


def test_what_is_no_dataset_is_refused(tmp_path):
    with pytest.raises(StoreError, match="no dataset"):
        concat([tmp_path])
    with pytest.raises(NotJoinableError, match="dataset 1: no dataset"):
        concat([xr.Dataset()])
    with pytest.raises(NotJoinableError, match="no datasets"):
        concat([])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "along", "labels", "checked"),
    [
        (
            [{"axes": {"radius": radii}} for radii in ([50.0, 80.0], [60.0])],
            "radius",
            [50.0, 60.0, 80.0],
            "plateau_mean",
        ),
        ([{"numerics": {"n_x": n}, "limits": {"events": n}} for n in (33, 17)], "n_x", [17, 33], "max_events"),
    ],
    ids=["axes between each other", "what differs with a parameter that each has one value of"],
)
def test_values_lie_where_their_labels_are(changes, along, labels, checked):
    parts = [computed(**each) for each in changes]
    joined = concat(parts)
    assert joined[along].values.tolist() == labels
    for part in parts:
        for label in part[along].values.ravel():
            mine, its = (
                each.isel({along: each[along] == label}) if along in each.dims else each for each in (joined, part)
            )
            np.testing.assert_array_equal(np.ravel(mine[checked]), np.ravel(its[checked]))
            events = int(its["events"].values.ravel()[0])
            assert joined.nanoslip.events(**{along: label}).sizes["event"] == events
