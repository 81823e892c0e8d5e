"""A mean says of how many members it is, where some have no value: in the dataset, tables, the page, figures."""

import math

import numpy as np
import pytest
import xarray as xr

from study.dataset.collection.ensemble import ensemble_name, ensemble_variables, over_members
from study.dataset.collection.members import EXPLAINED, fewer, means_of
from study.figures.sweep.points import points_of
from study.figures.views.answer import view_of
from study.manifest.cases import MEMBER
from study.report.case_table import case_table, ending_lines
from study.report.overview import accuracy
from study.report.summary import scalar_table

DIMS = ("radius", MEMBER)
FOUND = [[0.06, math.nan, 0.062, math.nan], [0.07, 0.072, 0.071, 0.073]]


def campaign() -> xr.Dataset:
    """Two cases of four members; of the first two have no plateau."""
    each = np.ones((2, 4))
    columns = {
        "outcome": np.where(np.isnan(FOUND), "no_plateau", "completed").astype(object),
        "message": np.full((2, 4), "", object),
        "record_spacings": 2.0 * each,
        "events": 1000.0 * each,
        "plateau_mean": np.array(FOUND),
        "plateau_uncertainty": np.where(np.isnan(FOUND), math.nan, 0.001),
    }
    said = {"plateau_mean": {"ancillary_variables": "plateau_uncertainty"}}
    variables = {name: xr.Variable(DIMS, put, said.get(name, {})) for name, put in columns.items()}
    for name, each in variables.items():
        each.attrs.setdefault("long_name", name)
    return xr.Dataset(variables | ensemble_variables(variables), {"radius": [50.0, 100.0], MEMBER: np.arange(4)})


def test_the_dataset_says_how_many_members_have_a_number() -> None:
    found = campaign()
    assert found[ensemble_name("plateau_mean", "members")].values.tolist() == [2, 4]
    assert found[ensemble_name("plateau_mean", "members")].dtype.kind == "i"
    assert found["members_used"].values.tolist() == [4, 4]


def test_every_number_of_joined_members_says_it_too() -> None:
    found = over_members(campaign())
    assert [fewer(found.isel(radius=0), name) for name in ("plateau_mean", "plateau_mean_ensemble_std", "events")] == [
        " (2 of 4)", " (2 of 4)", "",
    ]  # fmt: skip
    assert fewer(found.isel(radius=1), "plateau_mean") == ""


def test_a_table_says_it_behind_the_mean() -> None:
    table = scalar_table(campaign())
    column = table.header.index("plateau F/W")
    first, second = (row[column] for row in table.rows)
    assert first.endswith(" (2 of 4)")
    assert "of" not in second


def test_one_case_says_once_that_its_numbers_are_means_and_where_they_are_of_fewer() -> None:
    case = over_members(campaign().isel(radius=0))
    assert [line for line in ending_lines(case) if "mean" in line] == [
        f"numbers are means of 4 members; (k of n) {EXPLAINED}"
    ]
    table, missing = case_table(case)
    shown = {name: value for name, value, _ in table.rows}
    assert shown["plateau_mean"].endswith(" (2 of 4)")
    assert shown["events"] == "1000"
    assert not [name for name in [*shown, *missing] if name.endswith("_members")]


def test_the_error_of_a_scatter_is_that_between_ensembles() -> None:
    """Of normal members; to first order in 1/n, and 2000 ensembles know a standard deviation to 1.6 %."""
    draw = np.random.default_rng(2).normal(0.3, 0.02, (2000, 8))
    outcomes = np.full(draw.shape, "completed", object)
    columns = {"outcome": outcomes, "record_spacings": draw, "events": draw, "plateau_mean": draw}
    columns["plateau_uncertainty"] = 0.0 * draw
    found = ensemble_variables({name: xr.Variable(DIMS, put) for name, put in columns.items()})
    scatter, stated = (found[ensemble_name("plateau_mean", part)].values for part in ("std", "std_uncertainty"))
    assert np.mean(stated) == pytest.approx(np.std(scatter), rel=0.06)


def test_one_member_alone_is_no_mean() -> None:
    assert means_of(campaign().isel({MEMBER: 0})) == ""
    assert means_of(campaign().drop_vars("members_used")) == ""


def test_a_page_says_of_how_many_members_the_errors_are() -> None:
    (line,) = accuracy(campaign())
    assert line.endswith(", standard error of the mean of 2 to 4 of 4 members.")


def test_a_figure_says_it_in_its_caption_and_its_table() -> None:
    points = points_of(campaign(), "plateau_mean")
    assert points.columns()["members"].tolist() == [2, 4]
    assert points.lacking.tolist() == [True, False]
    assert " Of 1 of 2 points some members have no value; the least have 2." in view_of(points).caption
    assert "some members" not in view_of(points.at(~points.lacking)).caption


def test_of_a_number_that_no_member_has_nothing_is_said_but_that_it_is_missing() -> None:
    found = campaign()
    found["plateau_mean"] = found["plateau_mean"] * math.nan
    found = found.assign(ensemble_variables({str(name): found[name].variable for name in found.data_vars}))
    points = points_of(found, "plateau_mean")
    assert not points.there.any()
    assert not points.lacking.any()
    with pytest.raises(StopIteration):
        next(accuracy(found))


def test_a_cycle_is_counted_over_members_and_what_has_no_mean_is_left_out() -> None:
    """One of 8 members with a cycle of 5 events made 0.625 events of a cycle; chances of different laws have no mean."""
    own = ("cycle_events", "cycle_spacings", "slips_preferred_chance")
    columns = {name: np.array([0.0, 5.0, math.nan, 0.0]) for name in own}
    columns |= {"outcome": np.full(4, "completed", object), "events": np.array([90.0, 91.0, 92.0, 95.0])}
    variables = {name: xr.Variable((MEMBER,), put, {"long_name": name}) for name, put in columns.items()}
    variables["record_spacings"] = xr.Variable((MEMBER,), np.ones(4), {"long_name": "length"})
    found = over_members(xr.Dataset(variables | ensemble_variables(variables), {MEMBER: np.arange(4)}))
    assert found["members_with_cycle"].item() == 1
    assert found["events"].item() == 92.0
    assert not set(own) & set(found.data_vars)
    shown = [name for name, *_ in case_table(found)[0].rows]
    assert "members_with_cycle" in shown
