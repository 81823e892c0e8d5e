"""What is declared is described: every variable of a dataset, on one page that is never behind."""

import re
from dataclasses import fields

import pytest
import xarray as xr

from nanoslip.solver.sliding.record import EVENT_KINDS, FrictionRecord
from nanoslip.solver.sliding.sizes import SIZES
from nanoslip.solver.sliding.validity import FLAGS
from nanoslip.study.dataset.collect import collect
from nanoslip.study.dataset.file import flattened, groups_of
from nanoslip.study.dataset.variables import Described, described, page, rows, text_of
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.results.store import Store
from tests.conftest import ROOT, SMALL
from tests.study.dataset.campaigns import compute

ALL = (
    SMALL.replace("members = 1", "members = 2")
    + """
[outputs]
tractions = true
tractions_at = [0, 3]
subsurface = true

[heterogeneity]
spread = 0.1
"""
)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    """A campaign that has all outputs."""
    folder = tmp_path_factory.mktemp("all")
    text = ALL.replace("[50.0, 100.0]", "[50.0]").replace("[0.25, 0.5]", "[0.5]")
    (folder / "campaign.toml").write_text(text)
    plan, store = make_plan(load_manifest(folder / "campaign.toml")), Store(folder)
    compute(plan, store)
    return collect(plan, store)


def row_of(path: str) -> Described:
    """The description of a variable that is in a group, or in the root."""
    group, _, name = path.rpartition("/")
    if not group:
        return described(name)
    return next(row for row in rows() if row.group == f"group {group}" and row.name == name)


def test_every_variable_of_a_dataset_is_described_as_it_describes_itself(dataset: xr.Dataset) -> None:
    for name, variable in flattened(dataset).items():
        row = row_of(name)
        assert row.meaning == variable.attrs["long_name"], name
        assert row.units == variable.attrs.get("units", ""), name
        assert row.symbol == variable.attrs.get("symbol", ""), name
        beside = variable.attrs.get("ancillary_variables", "").split()
        assert row.uncertainty == next((each for each in beside if each.endswith("_uncertainty")), ""), name
        assert row.comment == variable.attrs.get("comment", ""), name


def test_variables_lie_along_what_is_described(dataset: xr.Dataset) -> None:
    cases = set(dataset["plateau_mean"].dims)
    drives = set(dataset["static_friction"].dims)
    known = {"cases": cases, "cases, drive": drives}
    for row in rows():
        if row.name in dataset and not row.group.startswith(("parameters", "group ")):
            assert set(dataset[row.name].dims) == known[row.dims], row.name
    for name, group in groups_of(dataset).items():
        for variable in group.variables:
            assert group[variable].dims == (row_of(f"{name}/{variable}").dims,), variable


def test_each_is_described_once_and_what_it_refers_to_is_described_too() -> None:
    names = [(row.group if row.group.startswith("group ") else "", row.name) for row in rows()]
    assert len(names) == len(set(names)) > 150
    for row in rows():
        if row.uncertainty:
            assert described(row.uncertainty).units == row.units
            assert described(f"{row.name}_members").dims == row.dims
    assert all(row.meaning and row.dims for row in rows())


def test_what_is_said_of_it_in_short_fits_the_label_of_an_axis() -> None:
    for row in rows():
        assert len(row.meaning) <= 40, row.name


def test_words_bits_and_codes_are_named() -> None:
    assert described("event_kind").values == EVENT_KINDS
    assert described("validity_flags").values == tuple(flag.name for flag in FLAGS)
    masks = [flag.mask for flag in FLAGS]
    assert masks == sorted({1 << bit for bit in range(16)} & {*masks})  # a bit each, as the attribute flag_masks says
    assert described("regime").values == ("sticks", "stick_slip", "slides", "micro_slip")


def test_one_variable_in_full_says_all_of_it() -> None:
    text = text_of(described("surface_stiffness_si"))
    assert text.splitlines()[:3] == [
        "surface_stiffness_si", "  meaning: lateral stiffness", "  symbol: K",
    ]  # fmt: skip
    assert "  unit: N m-1" in text
    assert "  uncertainty: surface_stiffness_uncertainty" in text_of(described("surface_stiffness"))
    assert "± of lateral stiffness" in text_of(described("surface_stiffness_uncertainty"))


@pytest.mark.parametrize(
    ("symbol", "names"), [("ζ", ["damping_ratio"]), ("μ_k", ["kinetic_friction", "fitted_kinetic_friction"])]
)
def test_a_symbol_of_equations_is_answered_with_the_variables_that_are_called_so(symbol: str, names: list[str]) -> None:
    with pytest.raises(KeyError, match=f"{symbol}: no variable of a dataset; nearest: {', '.join(names)}'$"):
        described(symbol)


def test_an_unknown_name_is_answered_with_the_nearest_ones() -> None:
    with pytest.raises(KeyError, match="plateau_meen: no variable of a dataset; nearest: plateau_mean"):
        described("plateau_meen")
    with pytest.raises(KeyError, match=r"zzzz: no variable of a dataset'"):
        described("zzzz")


def test_the_page_of_all_variables_is_as_declared() -> None:
    kept = (ROOT / "campaigns" / "variables.md").read_text("utf-8")
    assert kept == page(), "run python -m nanoslip.study.dataset.variables > campaigns/variables.md"


def test_the_page_names_every_variable_by_itself_or_with_those_that_differ_from_it_in_one_word() -> None:
    told = set(re.findall(r"^\| `(\w+)` \|", page(), re.MULTILINE))
    words = {"SIZE": SIZES}
    unfolded = {name.replace(mark, word, 1) for name in told for mark in words for word in words[mark]}
    assert unfolded - {name for name in unfolded if name.startswith(tuple(words))} == {row.name for row in rows()}
    assert {"SIZE_cutoff", "slips_exponent", "drop_step_correlation"} < told
    assert page().count("\n") <= 350


def test_the_table_of_contents_leads_to_every_section() -> None:
    anchors = re.findall(r"\]\(#([\w-]+)\)", page())
    titles = re.findall(r"^## (.+)$", page(), re.MULTILINE)
    assert anchors == [title.lower().replace(" ", "-") for title in titles]


def test_a_cell_of_the_page_ends_where_a_column_does() -> None:
    _, *tables = page().split("\n## ")
    header, *lines = [line for line in "\n".join(tables).splitlines() if line.startswith("|")]
    assert header.count("|") == 8
    assert all(line.replace("\\|", "").count("|") == 8 for line in lines)


def test_every_number_of_a_record_but_its_settings_is_declared() -> None:
    settings = {"normal_load", "spacing", "presliding_length", "outcome"}
    assert {item.name for item in fields(FrictionRecord) if not item.metadata} == settings
