"""What decides a number beside its starts: another spacing is another campaign, and slips that drop no stress leave μ_i."""

import math
import re
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from nanoslip.solver.outcome import Ending
from nanoslip.solver.view import with_error
from nanoslip.study import api
from nanoslip.study.accuracy.deciding import MAIN, Announce, Deciding, Spacing, deciding, deciding_lines
from nanoslip.study.commands.answering import critical_words
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.parameters import span
from tests.conftest import Main

CASE: dict[str, Any] = {
    "title": "x",
    "stages": ["contact", "slip"],
    "constants": {"radius": 50.0, "intrinsic_friction": 0.25},
    "numerics": {"n_x": 17},
    "limits": {"presliding": 3},
    "ensemble": {"members": 3},
}
CONTACT = {**CASE, "stages": ["contact"], "limits": {}}


CRITICAL = {
    **CASE,
    "stages": ["contact", "slip", "dynamics"],
    "drives": [{"stage_velocity": 2e-2, "spring_stiffness": 2e6}],
    "outputs": {"critical": True, "fit": False},
}


FLAT = {**CASE, "constants": {"radius": 1e8}, "numerics": {"n_x": 33}}
"""Its starts hardly differ, so that their scatter is no ±: all have the same events."""
STROKE = {**CASE, "limits": {}, "path": {"amplitude": 0.5, "cycles": 2}}


def found_in(
    campaign: dict[str, Any],
    most: float = math.inf,
    variable: str = "",
    out: Path | None = None,
    announce: Announce | None = None,
    case_rate: float = math.inf,
) -> Deciding:
    manifest = api.read_campaign(campaign)
    variable = variable or MAIN["slip" in manifest.stages]
    return deciding(manifest, expand(manifest)[0], variable, most, out, announce=announce, case_rate=case_rate)


@pytest.mark.parametrize(
    ("campaign", "variable"),
    [
        (CASE, "plateau_mean"),
        (CONTACT, "contact_half_width"),
        pytest.param(CRITICAL, "critical_velocity", marks=pytest.mark.slow),
        pytest.param({**CRITICAL, "outputs": {"fit": False}}, "static_friction", marks=pytest.mark.slow),
        (STROKE, "loss_per_cycle"),
        (FLAT, "plateau_mean"),
    ],
)
def test_half_and_twice_the_spacing_are_campaigns_of_their_own(campaign: dict[str, Any], variable: str) -> None:
    """Of as many members, with the same ±, to the last bit; the grid's own rows follow n_x."""
    found = found_in(campaign, variable=variable)
    spaces = campaign["numerics"]["n_x"] - 1
    spacings = [(0.5, 2 * spaces + 1), (2.0, spaces // 2 + 1)]
    assert (found.variable, [(each.factor, each.n_x) for each in found.spacings]) == (variable, spacings)
    for each in found.spacings:
        other = api.run({**campaign, "numerics": {"n_x": each.n_x}}, progress=False)
        assert (each.value, f"{each.error}") == (other[variable].item(), f"{other[f'{variable}_uncertainty'].item()}")


def test_slips_that_drop_no_stress_leave_the_intrinsic_friction() -> None:
    """All nodes slide at μ_i times their pressure: no computation is needed for it."""
    assert found_in(CASE).without_drop == 0.25
    sliding = api.run({**CASE, "slip": {"residual_shear": 1.0}, "limits": {"presliding": 20}}, progress=False)
    assert sliding["final_force"].item() == pytest.approx(0.25, rel=1e-9)
    assert math.isnan(found_in({**CASE, "slip": {"residual_shear": 1.0}}).without_drop)
    assert math.isnan(found_in(CONTACT).without_drop)


STRONG = {**CASE, "numerics": {"n_x": 65, "scheme": "half_plane"}, "slip": {"strength": 1e-3}}


def test_a_strength_is_its_share_of_what_classical_sliding_bears() -> None:
    """1 - μ_i over F/W where slips drop no stress, of a contact whose width is known to a node of ten."""
    found = found_in(STRONG, 0.0)
    classical = {
        "slip": {**STRONG["slip"], "residual_shear": 1.0},
        "limits": {"presliding": 2},
        "ensemble": {"members": 1},
    }
    bears = api.run({**STRONG, **classical}, progress=False)["final_force"].item()
    assert bears > 1.5 * 0.25
    assert found.without_drop == pytest.approx(bears, rel=0.05)
    assert found.strength == pytest.approx(1.0 - 0.25 / found.without_drop, rel=1e-12)
    assert (found_in(CASE, 0.0).strength, found_in({**CONTACT, "slip": STRONG["slip"]}, 0.0).strength) == (0.0, 0.0)


def test_a_strength_is_ranked_where_a_case_has_one(main: Main, tmp_path: Path) -> None:
    file, row = tmp_path / "strong.toml", "the strength without pressure"
    file.write_text(
        'title = "x"\nstages = ["contact", "slip"]\nconstants.radius = 60.0\nslip.strength = 1e-3\nnumerics.n_x = 17\n'
        "limits.presliding = 3\nensemble.members = 2\n"
    )
    assert main("run", file, "--out", tmp_path / "out", "--serial")[0] == 0
    text = main("explain", file, "--out", tmp_path / "out")[1]
    (share,) = re.findall(rf"{row} +(\d+\.\d)%", text)
    assert float(share) > 20.0


def test_a_spacing_that_takes_too_long_is_left_out_with_its_time_and_one_that_is_refused_is_not_there() -> None:
    found = found_in(CASE, 0.0, announce=lambda *_: pytest.fail("nothing is computed"))
    assert (found.computed, [each.seconds > 0.0 for each in found.spacings]) == ([], [True, True])
    few = found_in({**CASE, "numerics": {"n_x": 17, "bottom_row": 17}})
    assert [each.factor for each in few.spacings] == [0.5]


def test_a_coarser_grid_with_a_flag_of_its_own_is_no_measure_of_the_spacing() -> None:
    """On 9 nodes the contact over the whole slab has too few, on 17 it has not."""
    found = found_in({**FLAT, "numerics": {"n_x": 17}}, 0.0)
    assert [each.n_x for each in found.spacings] == [33]


STRIP = {**CASE, "numerics": {"n_x": 27, "scheme": "strip"}}


def test_an_odd_number_of_halves_has_the_nearest_coarser_grid() -> None:
    found = found_in(STRIP)
    half, coarser = found.computed
    assert (half.n_x, coarser.n_x % 2, coarser.factor * (coarser.n_x - 1)) == (53, 1, 26.0)


def test_a_spacing_without_the_number_gives_way_to_a_nearer_one_that_has_it() -> None:
    """On 13 nodes the contact is one node; the answer named the ending in place of a number."""
    light = {"n_x": 25, "scheme": "strip"}, {"radius": 50.0, "intrinsic_friction": 0.25, "normal_load": 2e-4}
    found = found_in(STRIP | dict(zip(("numerics", "constants"), light, strict=True)))
    assert [(each.n_x, each.has_value) for each in found.spacings] == [(49, True), (21, True)]


def test_what_is_not_known_on_other_nodes_is_stated_in_words() -> None:
    """Endings and equations of n_x are for tables."""
    late = Spacing(0.5, 33, seconds=20.0)
    for ending in Ending:
        words = list(
            deciding_lines(Deciding("plateau_mean", (late, Spacing(2.0, 9, ending=ending.value)), math.nan, 0.0))
        )
        assert "about 20 s" in words[0]
        assert "_" not in words[1]


def test_a_velocity_on_another_spacing_has_the_unit_of_the_answer() -> None:
    """An answer in mm/s beside another in m/s is read wrong."""
    spacings = (Spacing(0.5, 33, 1.5e-3, 1e-4), Spacing(2.0, 9, 2.85e-3, 2e-4))
    assert list(deciding_lines(Deciding("critical_velocity", spacings, math.nan, 0.0), "V_c ")) == [
        "V_c with half the node spacing: 1.50 ± 0.10 mm/s",
        "V_c with twice the node spacing: 2.9 ± 0.2 mm/s",
    ]


@pytest.mark.slow
def test_a_try_begins_and_ends_with_its_answer_and_what_decides_it(main: Main) -> None:
    code, text, _ = main("try", "n_x=17", "presliding=3", "radius=50", "intrinsic_friction=0.25", "members=3")
    lines = text.splitlines()
    half, twice = (with_error(spacing.value, spacing.error) for spacing in found_in(CASE).spacings)
    deciding = [
        "flagged few_nodes",
        f"with half the node spacing: {half}",
        f"with twice the node spacing: {twice}",
        "if a slipping node keeps its full shear: 0.25",
    ]
    assert code == 0
    assert lines[1:5] == deciding
    assert "by default: W/(G·L_x·L_y) = 0.001" in lines[5]
    assert "μ_i" not in lines[5]
    assert lines[:6] == lines[-6:]
    rows = [line for line in text.partition("──\n")[2].partition("\n\n")[0].splitlines() if line[:1].strip()]
    assert 5 <= len(rows) <= 8
    assert text.count("┤") == 12
    assert main("try", "n_x=17", "presliding=3", "radius=50", "members=3", "--all")[1].count("\n") > 2 * len(rows) + 25


@pytest.mark.slow
def test_a_critical_velocity_has_the_range_of_its_starts(main: Main) -> None:
    """A machine is one start, and the mean over starts hides how far they lie apart."""
    given = (
        "n_x=17",
        "presliding=3",
        "radius=50",
        "intrinsic_friction=0.25",
        "spring_stiffness=2e6",
        "stage_velocity=0.02",
    )
    text = main("try", "--critical", *given, "members=3")[1]
    starts = api.run(CRITICAL, progress=False).nanoslip.tree["drive_ensemble"]["critical_velocity"].values
    assert f"starts: {span(starts, 'm/s')}; " in text
    assert "(at 2 MN/m; " in next(line for line in text.splitlines() if line.startswith("critical_velocity "))
    assert "if a slipping node keeps its full shear: no stick-slip" in text
    assert "± ?: a single start" in main("try", "--critical", *given, "members=1")[1].splitlines()[0]


def test_a_critical_velocity_that_starts_lack_names_what_they_do_instead() -> None:
    words = {f"critical_velocity_search_{word}_members": count for word, count in (("found", 6), ("never_sticks", 1))}
    known = {"critical_velocity": 1.2e-3, "critical_velocity_members": 6.0, "drive_members": 8.0}
    starts = xr.Dataset(
        {
            "critical_velocity": ("member", [1e-3] * 6 + [math.nan] * 2),
            "time_stuck": ("member", [0.5] * 7 + [math.nan]),
            "member_outcome": (
                "member",
                [0] * 6 + [list(Ending).index(each) for each in (Ending.NO_SLIP, Ending.REVERSED)],
            ),
        }
    )
    case = xr.Dataset({**known, **words, "critical_velocity_search": "found"}, {"spring_stiffness": 1e5})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("nanoslip.study.report.single_case.read_groups", lambda _: {"drive_ensemble": starts})
        patch.setattr("nanoslip.study.report.single_case.read_run", lambda *_: (starts, case))
        assert "(6 of 8 starts) (single starts: 1 mm/s; 1 start: never sticks; 1 start: reversed; " in critical_words(
            case
        )


@pytest.mark.slow
def test_explain_ranks_what_decides_and_a_page_begins_with_its_middle_case(main: Main, tmp_path: Path) -> None:
    file, out = tmp_path / "mine.toml", tmp_path / "out"
    file.write_text(
        'title = "x"\nstages = ["contact", "slip"]\naxes.radius = [50.0, 60.0, 70.0]\nnumerics.n_x = 17\n'
        "limits.presliding = 3\nensemble.members = 3\n"
    )
    assert main("run", file, "--out", out, "--serial")[0] == 0
    text = main("explain", file, "radius=60", "--out", out)[1].partition("what decides plateau F/W ")[2]
    shares = [float(each) for each in re.findall(r" (\d+\.\d)% ", text)]
    assert shares == sorted(shares, reverse=True)
    named = ("the node spacing", "starts", "slips that drop no stress", "the third dimension")
    assert all(each in text for each in named)
    assert main("report", file, "--out", out)[0] == 0
    page = (out / "report.html").read_text("utf-8")
    assert "<p>The middle of 3 cases, R/L<sub>x</sub> = 60: plateau F/W " in page
    dataset = (out / "results.nc").stat().st_mtime_ns
    assert main("run", file, "--out", out, "--serial")[0] == 0
    assert (out / "results.nc").stat().st_mtime_ns == dataset


def test_finer_nodes_are_estimated_by_the_lower_of_two_measured_rates() -> None:
    """That of the coarser grid, and of the case itself: what does not grow with the nodes raises both."""
    expected = {}
    for case_rate in (1e-9, 2e-9):
        announced: dict[int, float] = {}
        found_in(CASE, announce=announced.__setitem__, case_rate=case_rate)
        expected[case_rate] = announced[33]
    assert expected[2e-9] == pytest.approx(2.0 * expected[1e-9], rel=1e-12)
    assert expected[2e-9] < 1e-6


def test_what_decides_is_computed_once_in_a_folder_that_can_be_written(tmp_path: Path) -> None:
    kept = tmp_path / "spacings"
    kept.write_text("no folder")
    announced: list[tuple[int, float]] = []
    found = [found_in(CASE, out=tmp_path, announce=lambda *grid: announced.append(grid))]
    assert [(n_x, seconds > 0.0) for n_x, seconds in announced] == [(9, True), (33, True)]
    kept.unlink()
    found.append(found_in(CASE, out=tmp_path))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("nanoslip.study.accuracy.deciding.compute_tasks", None)
        found.append(found_in(CASE, out=tmp_path))
        with pytest.raises(TypeError):
            found_in({**CASE, "limits": {"presliding": 2}}, out=tmp_path)
    assert found == found[:1] * 3


@pytest.mark.slow
def test_means_of_counts_are_whole_or_have_one_digit(main: Main) -> None:
    """Of eight starts 98.375 events were shown, as if they were so exactly known: of three they are 98.333."""
    text = main("try", "n_x=17", "presliding=3", "radius=50", "members=3", "--drive", "--all")[1]
    counted = dict(re.findall(r"^(\w+) +(\S+)  ", text, re.M))
    for name in ("events", "slips", "micro_slips", "macroscopic_slips", "cascade_slips"):
        value = counted[name]
        assert "." not in value or re.fullmatch(r"\d\.\d", value), (name, value)
