"""Members of an ensemble are cases like any other; what is made of them is what their values give by hand."""

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.stats
import xarray as xr

from solver.case import Case
from solver.slab import Slab
from solver.sliding.sampling import EVENLY, SHARED
from solver.view import with_error
from study.dataset import file
from study.dataset.collection.collect import collect
from study.dataset.collection.ensemble import ensemble_name, ensemble_variables, observables, over_members
from study.dataset.groups import groups_of
from study.manifest.cases import MEMBER, CampaignCase, expand
from study.manifest.manifest import SEEDS, Ensemble, Manifest
from study.manifest.problems import ManifestError
from study.manifest.reader import load_manifest
from study.plan.plan import Plan, make_plan
from study.report import page as report_page
from study.report.summary import points, scalar_table
from study.results.store import Store
from tests.study.dataset.campaigns import compute

Build = Callable[[str], tuple[Plan, xr.Dataset]]
HEAD = 'title = "x"\nnumerics.n_x = 17\nlimits.events = 150\n'
FOUR = f"{HEAD}ensemble.members = 4\n"
RADII = "axes.radius = [50.0, 100.0]\n"
DRIVES = '[[drives]]\nname = "slow"\nstage_velocity = 1e-3\nsamples = 20\n[[drives]]\nname = "fast"\nsamples = 20\n'
TABLE = "intrinsic_friction,start\n0.25,0.1\n0.5,0.2\n"


def campaign(folder: Path, text: str) -> Manifest:
    (folder / "mine.toml").write_text(text, "utf-8")
    (folder / "cases.csv").write_text(TABLE, "utf-8")
    return load_manifest(folder / "mine.toml")


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Compute a campaign from its text, once for each text."""
    known: dict[str, tuple[Plan, xr.Dataset]] = {}

    def computed(text: str) -> tuple[Plan, xr.Dataset]:
        if text not in known:
            folder = tmp_path_factory.mktemp("campaign")
            plan, store = make_plan(campaign(folder, text)), Store(folder)
            compute(plan, store)
            file.write(collect(plan, store), folder / file.FILE)
            known[text] = plan, file.read(folder / file.FILE)
        return known[text]

    return computed


def starts(cases: tuple[CampaignCase, ...]) -> list[float]:
    return [case.case.start for case in cases if case.case]


def test_members_start_evenly_over_a_spacing_from_the_cases_own_start_on(tmp_path: Path) -> None:
    cases = expand(campaign(tmp_path, FOUR + "axes.start = [0.4]\n"))
    np.testing.assert_allclose(starts(cases), [0.4, 0.65, 0.9, 0.15], rtol=1e-15)
    assert [case.parameters[MEMBER] for case in cases] == [0, 1, 2, 3]


def test_the_first_member_is_the_case_itself(tmp_path: Path) -> None:
    for start in ("0.0", "0.37", "1.0"):
        text = HEAD + f"axes.start = [{start}]\n"
        (alone,) = expand(campaign(tmp_path, text))
        first, *others = expand(campaign(tmp_path, text + "ensemble.members = 3\n"))
        assert (first.case_id, first.case) == (alone.case_id, alone.case)
        assert alone.case_id not in {other.case_id for other in others}


def test_members_are_the_cases_of_an_axis_of_starts_bit_for_bit(build: Build) -> None:
    """Same names, so that neither is computed where the other is stored; same numbers."""
    ensemble, members = build(FOUR + RADII)
    axis, cases = build(HEAD + RADII + "axes.start = [0.0, 0.25, 0.5, 0.75]\n")
    assert [case.case_id for case in ensemble.cases] == [case.case_id for case in axis.cases]
    assert {task.key for task in ensemble.tasks} == {task.key for task in axis.tasks}
    assert members["plateau_mean"].dims == ("intrinsic_friction", "radius", "aspect_ratio", "n_x", MEMBER)
    for name, along in cases.data_vars.items():
        if "start" in along.dims:
            assert np.array_equal(members[name].values, along.values, equal_nan=along.dtype.kind == "f"), name
    assert np.array_equal(*(groups_of(each)["record"]["event_friction_after"].values for each in (members, cases)))
    np.testing.assert_array_equal(members["start"].values.ravel(), [0.0, 0.25, 0.5, 0.75] * 2)


def test_seeds_of_members_differ_where_nodes_are_drawn_and_only_there(tmp_path: Path) -> None:
    plain = [case.case for case in expand(campaign(tmp_path, FOUR)) if case.case]
    assert {case.heterogeneity.seed for case in plain} == {1}
    spread = "heterogeneity.spread = 0.2\naxes.seed = [3, 4]\n"
    drawn = [case.case for case in expand(campaign(tmp_path, FOUR + spread)) if case.case]
    seeds = [case.heterogeneity.seed for case in drawn]
    assert seeds == [seed + number * SEEDS for seed in (3, 4) for number in range(4)]
    assert starts(expand(campaign(tmp_path, FOUR + spread))) == [0.0, 0.25, 0.5, 0.75] * 2


def test_one_member_is_no_ensemble(build: Build, tmp_path: Path) -> None:
    one, plain = (expand(campaign(tmp_path, HEAD + RADII + text)) for text in ("ensemble.members = 1\n", ""))
    assert one == plain
    _, found = build(HEAD + RADII + "ensemble.members = 1\n")
    assert MEMBER not in found.dims
    assert not [name for name in found.data_vars if "ensemble" in str(name)]
    assert over_members(found) is found


@pytest.mark.parametrize(
    ("text", "own"),
    [
        ('design = "zip"\naxes.radius = [50.0, 60.0]\naxes.start = [0.3, 0.1]\n', [0.3, 0.1]),
        ('table = "cases.csv"\n', [0.1, 0.2]),
        ("axes.start = [0.3]\n", [0.3]),
    ],
    ids=["zip", "table", "product"],
)
def test_every_member_says_where_it_started(build: Build, text: str, own: list[float]) -> None:
    """An axis of starts says where the first member of a case does; the others are elsewhere, and the dataset says so."""
    plan, found = build(text + FOUR)
    expected = [[(start + number / 4) % 1.0 for number in range(4)] for start in own]
    np.testing.assert_allclose(np.reshape(starts(plan.cases), (-1, 4)), expected, rtol=1e-14)
    assert found.sizes[MEMBER] == 4
    assert found["start"].dims[-1] == MEMBER
    np.testing.assert_array_equal(found["start"].values.ravel(), starts(plan.cases))
    ids = [case.case_id for case in plan.cases]
    assert found["case_id"].values.ravel().tolist() == ids
    if len(own) > 1:
        assert found["plateau_mean"].dims == ("case", MEMBER)
        assert found["intrinsic_friction"].dims == ("case",)


def by_hand(name: str, values: np.ndarray, weights: np.ndarray, stated: np.ndarray) -> tuple[float, float, float]:
    """Mean, standard error and standard deviation, as solver.sliding.sampling and the ensemble of a dataset say in words."""
    here = np.isfinite(values)
    if not here.any():
        return math.nan, math.nan, math.nan
    mean = float((values[here] * weights[here]).sum() / weights[here].sum())
    if here.sum() < 2:
        return mean, math.nan, math.nan
    student = float(scipy.stats.t.ppf(0.975, here.sum() - 1)) / 2.0
    std = math.sqrt(((values[here] - values[here].mean()) ** 2).sum() / (here.sum() - 1))
    if observables()[name].ensemble == "event":  # each member's own is the scatter itself
        return mean, student * std / math.sqrt(len(values)) if here.all() else math.nan, std
    chance = student * std / math.sqrt(here.sum()) * (EVENLY if here.all() else 1.0)
    known = sorted(stated[np.isfinite(stated)])
    if not known:
        return mean, math.nan, std
    middle = (known[(len(known) - 1) // 2] + known[len(known) // 2]) / 2
    return mean, math.hypot(chance, SHARED[0] * middle), std  # the records here span 0.15 spacings


STATED = {
    "plateau_mean": "plateau_uncertainty",
    "mean_step": "mean_step_uncertainty",
    "mean_drop": "mean_drop_uncertainty",
    "static_friction": "static_friction_uncertainty",
    "kinetic_friction": "kinetic_friction_uncertainty",
}
"""What members state of their own values; of a largest force they state nothing."""


@pytest.mark.parametrize(
    "name", [name for name, each in observables().items() if each.ensemble not in ("independent", "fitted")]
)
def test_reduced_variables_are_those_of_the_members_by_hand(build: Build, name: str) -> None:
    """Means over events count a member by how many it has, the others count members alike. Only sums in another order."""
    _, found = build(FOUR.replace("events = 150", "spacings = 0.15") + RADII + DRIVES)
    members = found[name].transpose(..., MEMBER)
    stated = found[STATED[name]].transpose(..., MEMBER) if name in STATED else 0.0 * members
    dims = members.dims[:-1]
    weights = (
        found["events"].transpose(..., MEMBER) if observables()[name].ensemble == "per_event" else xr.ones_like(members)
    )
    assert found["events"].values.std() > 0.0
    reduced = [found[ensemble_name(name, part)] for part in ("mean", "uncertainty", "std")]
    assert all(each.dims == dims for each in reduced)
    assert ("drive" in dims) == (name in ("static_friction", "kinetic_friction"))
    known = 0
    for place in itertools.product(*(range(found.sizes[dim]) for dim in dims)):
        expected = by_hand(name, members.values[place], weights.values[place], stated.values[place])
        np.testing.assert_allclose([each.values[place] for each in reduced], expected, rtol=1e-12)
        known += math.isfinite(expected[0])
    assert known
    assert all(each.attrs["units"] == found[name].attrs["units"] for each in reduced)


def made_up() -> xr.Dataset:
    """A case of three members and one of three that all ended alike; the last member of the first has no numbers."""
    dims = ("radius", MEMBER)
    few, ends = (1 << number for number in range(2))
    return xr.Dataset(
        {
            "plateau_mean": (
                dims,
                [[0.2, 0.4, np.nan], [0.3, 0.3, 0.3]],
                {"ancillary_variables": "plateau_uncertainty"},
            ),
            "plateau_mean_ensemble_mean": ("radius", [0.3, 0.3]),
            "plateau_mean_ensemble_uncertainty": ("radius", [0.05, 0.01]),
            "plateau_uncertainty": (dims, [[0.01, 0.01, np.nan], [0.01, 0.01, 0.01]]),
            "events": (dims, [[10.0, 20.0, np.nan], [5.0, 5.0, 5.0]]),
            "outcome": (dims, np.array([["completed", "completed", "failed"], ["completed"] * 3], dtype=object)),
            "message": (dims, np.array([["", "", "do this"], [""] * 3], dtype=object)),
            "validity_flags": (dims, np.array([[few, ends, 0], [0, 0, ends]], np.int32), {"flag_masks": [few, ends]}),
            "event_force": ("event", [1.0, 2.0]),
        },
        {"radius": [50.0, 100.0], MEMBER: [0, 1, 2], "start": (dims, [[0.0, 0.3, 0.6]] * 2)},
    )


def test_over_members_counts_texts_joins_flags_and_averages_numbers() -> None:
    found = over_members(made_up())
    assert MEMBER not in found.dims
    assert "start" not in found.coords  # there is no one start of an ensemble
    assert "event_force" not in found  # records are of members
    assert found["outcome"].values.tolist() == ["2 completed; 1 failed", "completed"]
    assert found["message"].values.tolist() == ["1 do this", ""]
    assert found["validity_flags"].values.tolist() == [3, 2]
    assert found["validity_flags"].dtype.kind == "i"
    assert found["events"].values.tolist() == [15.0, 5.0]  # of the members that have any
    assert found["plateau_mean"].values.tolist() == [0.3, 0.3]


def test_what_a_reader_is_shown_of_an_ensemble_is_the_ensembles_uncertainty() -> None:
    table = scalar_table(made_up())
    assert [row[1] for row in table.rows] == ["0.30 ± 0.05", "0.300 ± 0.010"]


def of_members(
    name: str, values: list[float], stated: float, more: Mapping[str, xr.Variable] | None = None
) -> dict[str, xr.Variable]:
    """The ensemble's variables of an observable with these values of its members. more: variables of theirs."""
    each = np.ones(len(values))
    numbers = {"record_spacings": 0.1 * each, "events": 100.0 * each, name: np.array(values)}
    numbers |= {f"{name}_uncertainty": stated * each}
    outcomes = xr.Variable((MEMBER,), np.full(len(values), "completed", object))
    return ensemble_variables(
        {"outcome": outcomes} | {key: xr.Variable((MEMBER,), put) for key, put in numbers.items()} | dict(more or {})
    )


@pytest.mark.parametrize("name", ["static_friction", "kinetic_friction"])
def test_inertia_in_a_coefficient_no_number_of_members_averages_away(name: str) -> None:
    """A heavy pin's driving force can be twice all friction: sixteen members then agreed to 0.03 %."""
    common = {f"{name}_excess": xr.Variable((MEMBER,), np.full(256, 0.1))}
    found = of_members(name, [0.2999, 0.3001] * 128, stated=math.hypot(1e-4, 0.1), more=common)
    assert found[ensemble_name(name, "uncertainty")].item() == pytest.approx(0.1, rel=1e-3)


def test_a_mean_of_those_that_slipped_alone_is_not_known() -> None:
    """A pin that has not slipped would have had a large μ_s."""
    found = of_members("static_friction", [0.3, 0.31, 0.32, math.nan], 1e-3)
    assert math.isnan(found["static_friction_ensemble_uncertainty"].item())


def test_an_exponent_that_a_member_does_not_vouch_for_has_a_mean_of_unknown_uncertainty() -> None:
    """A period of stick-slip, of which one cycle states none, has."""
    for name, known in (("slips_exponent", False), ("stick_slip_period", True)):
        values = {name: [2.0, 2.1, 2.2], f"{name}_uncertainty": [0.1, math.nan, 0.1]}
        values |= {"record_spacings": [1.0] * 3, "events": [100.0] * 3}
        members = {key: xr.Variable((MEMBER,), np.array(column)) for key, column in values.items()}
        members["outcome"] = xr.Variable((MEMBER,), np.full(3, "completed", object))
        found = ensemble_variables(members)
        assert math.isfinite(found[ensemble_name(name, "mean")].item())
        assert math.isfinite(found[ensemble_name(name, "uncertainty")].item()) == known


def test_the_table_has_one_row_for_each_case(build: Build) -> None:
    _, found = build(FOUR + RADII)
    table = scalar_table(found)
    assert [row[0] for row in table.rows] == ["50", "100"]
    assert MEMBER not in table.header
    assert "start" not in table.header
    means, errors = (found[ensemble_name("plateau_mean", each)].values.ravel() for each in ("mean", "uncertainty"))
    column = table.header.index("plateau F/W")
    for row, mean, error in zip(table.rows, means, errors, strict=True):
        assert row[column].split(" (")[0] == ("–" if math.isnan(mean) else with_error(mean, error))


def test_drives_and_members_are_dimensions_side_by_side(build: Build) -> None:
    _, found = build(FOUR.replace("events = 150", "spacings = 0.15") + RADII + DRIVES)
    assert found["static_friction"].dims == ("intrinsic_friction", "radius", "aspect_ratio", "n_x", MEMBER, "drive")
    table = scalar_table(found)
    assert [row[:2] for row in table.rows] == [
        (radius, drive) for radius in ("50", "100") for drive in ("slow", "fast")
    ]
    assert len(list(points(found, "trajectory_id"))) == 2 * 4 * 2


def test_a_member_that_excludes_itself_is_an_outcome(build: Build) -> None:
    _, found = build(FOUR + "axes.residual_shear = [0.0, 1.0]\neffects.pin_translation = false\n")
    ends = over_members(found)["outcome"].values.ravel().tolist()
    assert ends[1] == "invalid"
    assert np.isnan(found[ensemble_name("plateau_mean", "mean")].values.ravel()[1])


def test_cases_whose_members_meet_are_refused(tmp_path: Path) -> None:
    """Starts 0 and 0.5 of two members each are the same two contacts twice."""
    with pytest.raises(ManifestError, match=r"cases 1 and 4 are the same: .*member = 1"):
        expand(campaign(tmp_path, HEAD + "ensemble.members = 2\naxes.start = [0.0, 0.5]\n"))


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ("members = 0", "members = 0"),
        ("members = -3", "members = -3"),
        ("members = 10001", "members = 10001"),
        ("members = 1.5", "members = 1.5"),
        ("members = 4.0", "members = 4.0"),
        ("members = true", "members = true"),
        ('members = "8"', 'members = "8"'),
        ("members = [2]", "members = [2]"),
        ("members = 1" + "0" * 400, "members = 1000"),
    ],
)
def test_a_wrong_number_of_members_is_refused_by_file_key_and_value(tmp_path: Path, given: str, shown: str) -> None:
    with pytest.raises(ManifestError) as error:
        campaign(tmp_path, f"{HEAD}[ensemble]\n{given}\n")
    (line,) = error.value.lines
    assert line.startswith(f"{tmp_path}/mine.toml: ensemble.{shown}")
    assert line.endswith(": needs a whole number from 1 to 10000")
    assert len(line) < 400


def test_an_unknown_key_of_an_ensemble_is_refused_with_advice(tmp_path: Path) -> None:
    with pytest.raises(ManifestError) as error:
        campaign(tmp_path, f"{HEAD}[ensemble]\nmember = 8\nnodes = 3\n")
    assert len(error.value.lines) == 2
    for line, given in zip(error.value.lines, ("member = 8", "nodes = 3"), strict=True):
        assert line.startswith(f"{tmp_path}/mine.toml: ensemble.{given}: ")
    assert "members" in error.value.lines[0]


def test_an_ensemble_is_a_table(tmp_path: Path) -> None:
    with pytest.raises(ManifestError, match=r"ensemble = 8: needs a table \[ensemble\]"):
        campaign(tmp_path, f"ensemble = 8\n{HEAD}")


def test_members_of_a_case_are_known_before_any_is_computed() -> None:
    case = Case(slab=Slab(17), start=0.9)
    varied = [Ensemble(5).varied(case, member) for member in range(5)]
    assert varied[0] == {"start": 0.9}
    assert all(0.0 <= float(str(change["start"])) < 1.0 for change in varied)
    assert len({replace(case, **change) for change in varied}) == 5  # type: ignore[arg-type]


def test_a_report_draws_members_and_tables_cases(build: Build, tmp_path: Path) -> None:
    _, found = build(FOUR + RADII)
    text = report_page.write(found, tmp_path).read_text("utf-8")
    assert text.count("<details>\n<summary>") == 8  # the record of each member of each case
    assert "R/L_x = 50" in text


def test_twins_of_an_observable_state_the_error_of_the_ensemble_too(build: Build) -> None:
    """Over μ_i or in SI the error is the same share of the number."""
    _, found = build(FOUR + RADII)
    reduced = over_members(found)
    share = reduced.plateau_uncertainty / reduced.plateau_mean
    xr.testing.assert_allclose(reduced.plateau_ratio_uncertainty / reduced.plateau_ratio, share, rtol=1e-12)
    xr.testing.assert_allclose(reduced.plateau_ratio * found.intrinsic_friction, reduced.plateau_mean, rtol=1e-12)
    own = found.plateau_mean_ensemble_uncertainty / found.plateau_mean_ensemble_mean
    np.testing.assert_allclose(share.values, own.values, rtol=1e-12)
    assert reduced.mean_step_si.attrs["units"] == "m"
