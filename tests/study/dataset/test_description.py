"""What is declared is described, on one page that is never behind."""

from dataclasses import fields

import pytest
import xarray as xr

from nanoslip.solver.parameter import measure_label
from nanoslip.solver.sliding.record import EVENT_KINDS, FrictionRecord
from nanoslip.solver.sliding.validity import FLAGS
from nanoslip.study.dataset.collect import collect
from nanoslip.study.dataset.file import flatten_variables, read_groups
from nanoslip.study.dataset.variables import Described, describe, rows
from tests.conftest import SMALL
from tests.study.dataset.campaigns import Build


@pytest.fixture(scope="module")
def dataset(build: Build) -> xr.Dataset:
    """A campaign that has all outputs."""
    outputs = "tractions = true\ntractions_at = [0, 3]\nsubsurface = true"
    text = SMALL.replace("fit = false", outputs).replace("[50.0, 100.0]", "[50.0]").replace("[0.25, 0.5]", "[0.5]")
    return collect(*build(text.replace("members = 1", "members = 2") + "[heterogeneity]\nspread = 0.1\n"))


def row_of(path: str) -> Described:
    """The description of a variable that is in a group, or in the root."""
    group, _, name = path.rpartition("/")
    if not group:
        return describe(name)
    return next(row for row in rows() if row.group == f"group {group}" and row.name == name)


def test_variables_lie_along_what_is_described(dataset: xr.Dataset) -> None:
    cases = set(dataset["plateau_mean"].dims)
    drives = set(dataset["static_friction"].dims)
    known = {"cases": cases, "cases, drive": drives}
    for row in rows():
        if row.name in dataset and not row.group.startswith(("parameters", "group ")):
            assert set(dataset[row.name].dims) == known[row.dims], row.name
    for name, group in read_groups(dataset).items():
        for variable in group.variables:
            assert group[variable].dims == (row_of(f"{name}/{variable}").dims,), variable


def test_words_bits_and_codes_are_named() -> None:
    assert describe("event_kind").values == EVENT_KINDS
    assert describe("validity_flags").values == tuple(flag.name for flag in FLAGS)
    masks = [flag.mask for flag in FLAGS]
    assert masks == sorted({1 << bit for bit in range(16)} & {*masks})  # a bit each, as the attribute flag_masks says
    assert describe("regime").values == ("sticks", "stick_slip", "slides", "micro_slip")


def test_every_number_of_a_record_but_its_settings_is_declared() -> None:
    settings = {"normal_load", "spacing", "node_area", "presliding_length", "outcome"}
    assert {item.name for item in fields(FrictionRecord) if not item.metadata} == settings


def test_every_variable_of_a_dataset_is_described_as_it_describes_itself(dataset: xr.Dataset) -> None:
    for name, variable in flatten_variables(dataset).items():
        row, attributes = row_of(name), variable.attrs
        assert measure_label(row.meaning, row.measure) == attributes["long_name"], name
        beside = attributes.get("ancillary_variables", "").split()
        assert row.uncertainty == next((each for each in beside if each.endswith("_uncertainty")), ""), name
        told = {"units": row.units, "symbol": row.symbol, "comment": row.comment}
        assert told == {key: attributes.get(key, "") for key in told}, name
        assert ("units" in attributes) == (variable.dtype.kind not in "OUTb"), name  # words and switches have none


def test_each_is_described_once_in_short_and_what_it_refers_to_is_described_too() -> None:
    names = [(row.group if row.group.startswith("group ") else "", row.name) for row in rows()]
    assert len(names) == len(set(names)) > 150
    for row in rows():
        assert 0 < len(row.meaning) <= 40, row.name  # fits the label of an axis
        assert row.dims
        if row.uncertainty:
            assert describe(row.uncertainty).units == row.units
            assert describe(f"{row.name}_members").dims == row.dims


@pytest.mark.parametrize(
    ("symbol", "name"), [("ζ", "damping_ratio"), ("μ_k", "kinetic_friction"), ("mu_k", "kinetic_friction")]
)
def test_a_symbol_of_equations_is_the_first_variable_that_has_it(symbol: str, name: str) -> None:
    assert describe(symbol) == describe(name)
