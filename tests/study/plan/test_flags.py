"""Flags reach whoever plans, reads the table, opens the dataset or the report, under one name and with one advice."""

import itertools
import math
import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from nanoslip.solver.case import Case, SlipRule
from nanoslip.solver.drive import FEWER_STEPS
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import slide
from nanoslip.solver.sliding.validity import Flag, decode_flags, flag_advice
from nanoslip.study import api
from nanoslip.study.dataset import file
from nanoslip.study.dataset.collect import collect
from nanoslip.study.manifest.reader import load_manifest, parse_manifest
from nanoslip.study.plan.expectations import duration_lines, flag_prediction_lines, out_of_reach, plan_outlook
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.report import page as report_page
from nanoslip.study.report.summary import flag_summary, scalar_table
from nanoslip.study.results.store import Store
from nanoslip.study.tasks.estimates import estimate_displacement
from nanoslip.study.toml_text import as_toml
from tests.conftest import ROOT
from tests.study.dataset.campaigns import compute
from tests.study.plan.running import planned

MAP = """\
stages = ["contact", "slip"]
ensemble.members = 1
[axes]
radius = [20.0, 200.0]
normal_load = [1e-4, 1e-2, 0.3]
[numerics]
n_x = 33
[limits]
events = 30
"""
# Hertz's half-widths, in spacings: 0.9, 9.3 and the whole slab; 2.9, 29 (the whole) and the whole. 0.3 is above G/10.
FOUND = [["few_nodes", "", "whole_slab large_strain"], ["few_nodes", "whole_slab", "whole_slab large_strain"]]


def expected(plan: Plan) -> list[str]:
    """All that is expected but the width of contacts."""
    return [line for line in flag_prediction_lines(plan, plan_outlook(plan)) if not line.startswith("contacts of")]


def computed(folder: Path, text: str) -> xr.Dataset:
    """The dataset of a campaign, given as text, from its file."""
    plan, store = planned(folder, text), Store(folder)
    compute(plan, store)
    file.write_netcdf(collect(plan, store), folder / file.FILE)
    with file.open_dataset(folder / file.FILE) as found:
        return found.load()


@pytest.fixture
def collected(tmp_path):
    return partial(computed, tmp_path)


@pytest.fixture(scope="module")
def mapped(tmp_path_factory):
    """The dataset of the map: not to be changed."""
    return computed(tmp_path_factory.mktemp("map"), MAP)


def names(found: xr.Dataset) -> list[list[str]]:
    """By radius and load, as the attributes say, without this package."""
    variable = found["validity_flags"]
    meanings = list(zip(variable.attrs["flag_masks"], variable.attrs["flag_meanings"].split(), strict=True))
    masks = variable.squeeze().values
    return [[" ".join(name for mask, name in meanings if value & mask) for value in row] for row in masks]


def test_the_dataset_holds_flags_as_cf_has_them_and_the_advice(mapped):
    found = mapped
    assert found["validity_flags"].dtype == np.int32
    assert names(found) == FOUND
    for mask, advice in zip(found["validity_flags"].values.flat, found["advice"].values.flat, strict=True):
        assert advice == flag_advice(decode_flags(int(mask)))
    assert set(found["outcome"].values.flat) <= {"completed", "no_plateau"}  # flags are no failures
    small, *whole = found["contact_half_width"].squeeze().values[1].tolist()
    assert small == pytest.approx(2.9 / 32, abs=0.3 / 32)  # Hertz's, to a third of a spacing
    assert whole == [0.5, 0.5]


def test_contact_alone_and_scalars_alone_have_the_same_flags(collected):
    assert names(collected(MAP.replace('["contact", "slip"]', '["contact"]'))) == FOUND
    assert names(collected(MAP + "[outputs]\nrecords = false\n")) == FOUND


def test_expected_flags_have_the_contacts_width_beside_them_and_cases_in_si(tmp_path):
    """Hertz's half-widths under a ball of 5 mm, 8 MPa, ν = 0.5: (3WR/(4E*))^(1/3) = 0.520 and 0.777 mm; the larger is cut off."""
    text = 'stages = ["contact"]\naxes.normal_load = ["0.4 N", "1.333 N"]\nconstants.radius = "5 mm"\n'
    text += 'constants.poisson = 0.5\nscales.slab_width = "1.2 mm"\nscales.young_modulus = "8 MPa"\n'
    plan = planned(tmp_path, text + 'numerics.scheme = "half_space"\nnumerics.n_x = 33\n')
    *flags, width = flag_prediction_lines(plan, plan_outlook(plan))
    assert any(line.startswith("outgrown: 1 of 2 cases, first normal_load = 1.333 N") for line in flags)
    assert "0.43 to 0.65 L_x (520 to 776.7 μm)" in width


def test_a_pin_too_steep_for_its_friction_is_expected_and_ends_so(collected, tmp_path):
    """Hertz's half-width of 0.065 over a radius of 1 exceeds half of 0.1, and not half of 0.5."""
    text = MAP.replace("[1e-4, 1e-2, 0.3]", "[1e-2]").replace("[20.0, 200.0]", "[1.0]")
    text = text.replace("events = 30", "events = 300").replace("[axes]", "[axes]\nintrinsic_friction = [0.1, 0.5]")
    steep = [line for line in expected(planned(tmp_path, text)) if "steep_pin" in line]
    assert [line.split(":")[:2] for line in steep] == [["steep_pin", " 1 of 2 cases, first intrinsic_friction = 0.1"]]
    assert set(collected(text)["outcome"].values.ravel()[:1]) == {"steep_pin"}
    constant = planned(tmp_path, text + "[effects]\npin_translation = false\n")
    assert not any("steep_pin" in line for line in expected(constant))


def test_a_path_alone_has_no_record_that_could_be_short(tmp_path):
    """A path of a presliding length, and a record as short."""
    text = "axes.radius = [50.0]\nconstants.intrinsic_friction = 0.05\nensemble.members = 1\n"
    text += "numerics.n_x = 65\nlimits.presliding = 1\n"
    record = planned(tmp_path, text + 'stages = ["contact", "slip"]\n')
    path = planned(tmp_path, text + "path.amplitude = 0.1\n")
    assert [decode_flags(mask) for mask in plan_outlook(record).masks] == [(Flag.short_record,)]
    assert plan_outlook(path).masks == [0]


def test_what_is_not_computed_has_no_flags(tmp_path):
    found = collect(planned(tmp_path, MAP), Store(tmp_path))
    assert not found["validity_flags"].values.any()
    assert set(found["advice"].values.flat) == {""}
    assert np.isnan(found["contact_half_width"]).all()
    assert not flag_summary(found)


def test_a_contact_that_was_not_reached_keeps_the_flags_to_be_expected_of_it(collected):
    """Three nodes and a first event given up: few of them is half the story."""
    text = MAP.replace("[1e-4, 1e-2, 0.3]", "[1e-3]").replace("[20.0, 200.0]", "[20.0]") + "[slip]\ncascade_limit = 1\n"
    found = collected(text)
    assert set(found["outcome"].values.flat) == {"cascade_limit"}
    assert np.isnan(found["contact_half_width"]).all()  # the first contact itself slips
    assert set(found["validity_flags"].values.flat) == {Flag.few_nodes.mask}
    assert set(found["advice"].values.flat) == {flag_advice((Flag.few_nodes,))}


def test_the_table_names_a_cases_flags_and_lines_say_what_to_do(mapped):
    found = mapped
    endings = [row[-1] for row in scalar_table(found).rows]
    for flags, ending in zip(itertools.chain(*FOUND), endings, strict=True):
        word = ending.partition(":")[0]
        assert word.partition(" [")[0] in ("completed", "no_plateau")
        assert word.partition(" [")[2] == (f"{flags.replace(' ', ', ')}]" if flags else "")
    whole = "whole_slab: 3 of 6 cases, first R/L_x = 20, W/(G·L_x·L_y) = 0.3: the pin covers the whole slab"
    lines = flag_summary(found)
    assert list(lines) == ["few_nodes", "whole_slab", "large_strain"]
    assert lines["whole_slab"].startswith(whole)
    assert lines["whole_slab"].endswith(f"; {Flag.whole_slab.advice}")


def test_a_list_of_cases_names_its_first(collected):
    lines = flag_summary(collected('design = "zip"\n' + MAP.replace("[20.0, 200.0]", "[20.0, 20.0, 200.0]")))
    assert [line.split(": ")[1] for line in lines.values()] == [
        "1 of 3 cases, first R/L_x = 20, W/(G·L_x·L_y) = 1e-4",
        "1 of 3 cases, first R/L_x = 200, W/(G·L_x·L_y) = 0.3",
        "1 of 3 cases, first R/L_x = 200, W/(G·L_x·L_y) = 0.3",
    ]


def test_a_single_case_needs_no_name(collected):
    one = MAP.replace("[20.0, 200.0]", "[20.0]").replace("[1e-4, 1e-2, 0.3]", "[1e-4]")
    assert flag_summary(collected(one))["few_nodes"].startswith("few_nodes: 1 of 1 cases: ")


@pytest.mark.slow
def test_the_report_shows_flags_with_their_advice(mapped, tmp_path):
    found = mapped
    page = report_page.write_page(found, tmp_path).read_text("utf-8")
    for line in flag_summary(found).values():
        assert f"<li>{line}</li>" in page
    assert "[few_nodes]" in page
    unflagged = found.copy()
    unflagged["validity_flags"] = found["validity_flags"] * 0
    assert "take with care" not in report_page.write_page(unflagged, tmp_path).read_text("utf-8")


def test_a_plan_says_what_is_to_be_expected(tmp_path):
    lines = expected(planned(tmp_path, MAP))
    assert [line.split(": ")[:2] for line in lines] == [
        ["few_nodes", "2 of 6 cases, first radius = 20, normal_load = 0.0001"],
        ["whole_slab", "3 of 6 cases, first radius = 20, normal_load = 0.3"],
        ["large_strain", "2 of 6 cases, first radius = 20, normal_load = 0.3"],
    ]


def test_a_plan_of_contacts_alone_moves_no_pin(tmp_path):
    text = MAP.replace("events = 30", "displacement = 0.3").replace("[1e-4, 1e-2, 0.3]", "[1e-2]")
    assert [line.split(":")[0] for line in expected(planned(tmp_path, text))] == [
        "outgrown", "whole_slab", "beyond_contact",
    ]  # fmt: skip
    only = text.replace('["contact", "slip"]', '["contact"]')
    assert [line.split(":")[0] for line in expected(planned(tmp_path, only))] == ["whole_slab"]


def test_a_plan_expects_nothing_of_what_it_refuses(tmp_path):
    text = MAP.replace("[numerics]\nn_x = 33", "n_x = [17, 33]\n[numerics]\nscheme = 'biquadratic'\nrows = 6")
    plan = planned(tmp_path, text)
    assert [case.case is None for case in plan.cases] == [True, False] * 6
    assert expected(plan)[0].startswith("few_nodes: 2 of 12 cases, first radius = 20, normal_load = 0.0001, n_x = 33:")


@pytest.mark.parametrize(
    ("changes", "low", "high"),
    [
        ({}, 0.4, 2.5),
        ({"max_events": 500}, 0.4, 2.5),
        ({"slip_rule": SlipRule(residual_shear=0.5)}, 0.4, 2.5),
        ({"max_displacement": 1e-4}, 1.0, 1.0),
        ({"max_displacement": 1e-4, "max_events": None}, 1.0, 1.0),
        ({"max_displacement": 1e-4, "slip_rule": SlipRule(residual_shear=1.0)}, 1.0, 1.0),
        ({"max_events": 20, "slip_rule": SlipRule(residual_shear=1.0)}, 0.0, 0.0),  # sliding has no steps to count
    ],
)
def test_a_plan_knows_about_how_far_a_pin_goes(changes, low, high):
    """Its limit, or from the mean step to a factor of two, here a little more; over what the record reaches."""
    case = replace(Case(radius=1000.0, normal_load=2e-4, slab=Slab(33)), **changes)
    record = slide(case, surface_compliance(case.slab))
    assert record.outcome.ok
    assert low <= estimate_displacement(case) / record.final_displacement <= high


def test_a_drive_that_is_too_short_to_slip_is_named_with_what_it_needs():
    """Those that are named never slip; a third more of what is needed is enough, as plateaus are 7 % above it at most."""
    own = {
        "ensemble": {"members": 1},
        "numerics": {"n_x": 65, "scheme": "strip"},
        "constants": {"intrinsic_friction": 0.3},
    }
    drives = [
        {"name": "soft", "spring_stiffness": 2e4},
        {"name": "damped", "damping_ratio": 20.0, "spring_stiffness": 2e4},
    ]

    def lines_of(campaign: dict[str, object]) -> list[str]:
        return list(out_of_reach(make_plan(parse_manifest(Path("mine.toml"), as_toml(campaign), {}))).values())

    def run(**more: object) -> tuple[list[str], xr.Dataset]:
        campaign = {"title": "x", **own, "drives": drives, **more}
        return lines_of(campaign), api.run(campaign, progress=False)

    lines, short = run(drive_axes={"duration": [0.1, 0.2, 0.3]})
    assert lines == [
        "too short to slip: 4 of 6 drives, first soft duration=0.1: reaches F/W = 0.04, slips near 0.15: needs duration ≥ 0.38 s"
    ]
    ended = short["drive_outcome"].squeeze()
    assert (ended == "no_slip").sum() >= 4
    lines, enough = run(drive_axes={"stage_travel": [1.3 * 0.38 * 2e-3]})
    assert (lines, "no_slip" in enough["drive_outcome"].values) == ([], False)
    at_rest = {"title": "x", **own, "drives": drives, "drive_axes": {"stage_velocity": [0.0]}}
    assert lines_of(at_rest)[0].endswith("raise stage_velocity")


def test_a_drive_that_may_end_at_its_step_limit_is_named_with_the_advice_of_its_outcome():
    """The estimate of segments holds to a factor of five."""
    limited = {"name": "a", "step_limit": 10_000}
    campaign = {
        "title": "x",
        "numerics": {"n_x": 33, "scheme": "strip"},
        "ensemble": {"members": 1},
        "drives": [limited],
    }
    ((cause, line),) = out_of_reach(make_plan(parse_manifest(Path("mine.toml"), as_toml(campaign), {}))).items()
    data = api.run(campaign, progress=False).squeeze()
    assert data["drive_outcome"] == cause == "step_limit"
    assert line.endswith(FEWER_STEPS)
    assert data["drive_message"].item().endswith(FEWER_STEPS)
    campaign["drives"] = [{"name": "a"}]
    assert out_of_reach(make_plan(parse_manifest(Path("mine.toml"), as_toml(campaign), {}))) == {}
    needed = float(re.findall(r"about (\S+) segments", line)[0])
    assert 0.2 < needed / float(api.run(campaign, progress=False)["steps"].squeeze()) < 5.0


def test_a_drive_without_a_duration_ends_where_its_numbers_are_known():
    """The plan takes the least friction that the pin may meet: it is 7 % more, and teeth make cycles longer."""
    own = {"ensemble": {"members": 1}, "numerics": {"n_x": 65, "scheme": "strip"}, "title": "x"}
    soft, paper = {"name": "soft", "spring_stiffness": 2e4}, {"name": "paper", "duration": "auto"}
    campaign = {**own, "drives": [soft, paper, {"name": "named", "duration": 0.3}]}
    manifest = parse_manifest(Path("mine.toml"), as_toml(campaign), {})
    (line,) = duration_lines(make_plan(manifest))
    assert line.startswith("duration: auto (drives: 2 of 3)")
    found = re.search(r"about (\S+) to (\S+) s", line)
    assert found
    data = api.run(campaign, progress=False).squeeze()
    for name, least in zip(("paper", "soft"), map(float, found.groups()), strict=True):
        one = data.sel(drive=name)
        assert 0.99 * least <= one["end_time"] <= 2.0 * least
        assert one["drive_outcome"] == "completed"
        assert np.isnan(one["duration"])
    assert data["end_time"].sel(drive="named") == pytest.approx(0.3, rel=1e-12)
    ended = data.sel(drive="soft")
    named = api.run({**own, "drives": [{**soft, "duration": float(ended["end_time"])}]}, progress=False).squeeze()
    for name in ("static_friction", "kinetic_friction"):
        np.testing.assert_allclose(named[name], ended[name], rtol=1e-9)
    # Near the border of stick-slip a drive without a duration has no regime, and so no period, that a longer one might not have.
    period = float(ended["stick_slip_period"])
    regime = ended["regime"].item()
    assert regime in ("", named["regime"].item())
    assert regime or math.isnan(period)
    assert math.isnan(period) or named["stick_slip_period"] == pytest.approx(period, rel=1e-9)


@pytest.mark.parametrize(
    ("given", "advice"),
    [
        ({"stage_travel": 9e-5}, "; raise stage_travel"),
        ({"duration_periods": 4}, "; raise duration_periods"),
        ({"duration": 0.05}, "; raise duration"),
        ({"max_slips": 1, "spring_stiffness": 2e4}, "raise max_slips"),
    ],
)
def test_advice_names_what_ended_a_drive(given: dict[str, float], advice: str):
    own = {"ensemble": {"members": 1}, "numerics": {"n_x": 33, "scheme": "strip"}, "title": "x"}
    data = api.run({**own, "drives": [{"name": "a", **given}]}, progress=False).squeeze()
    assert advice in str(data["drive_message"].item())


def test_the_campaigns_that_come_with_nanoslip_press_pins_well():
    campaigns = list((ROOT / "campaigns").glob("*.toml"))
    assert len(campaigns) >= 3
    for path in campaigns:
        assert expected(make_plan(load_manifest(path))) == [], path
