"""The largest part of each number's error is named: it is the largest, and what makes it less does."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nanoslip.solver.sliding.validity import Flag, decode_flags
from nanoslip.study import api
from nanoslip.study.dataset.table import one_case
from nanoslip.study.report.budget import error_lines, error_parts
from nanoslip.study.toml_text import as_toml
from tests.conftest import Main

SMALL: dict[str, Any] = {
    "title": "x",
    "stages": ["contact", "slip"],
    "numerics": {"n_x": 33, "scheme": "strip"},
    "limits": {"presliding": 4},
    "constants": {"radius": 100.0},
}


def test_starts_are_named_with_the_members_that_halve_their_part() -> None:
    few = {**SMALL, "ensemble": {"members": 4}}
    data = one_case(api.run(few, progress=False), {})
    (error,) = error_parts(data, "plateau_mean", "about 1 s")
    assert error.source == "starts"
    shared, whole = (float(data[f"plateau_mean_{part}"]) for part in ("shared_error", "uncertainty"))
    assert error.share == pytest.approx(math.sqrt(whole**2 - shared**2) / float(data["plateau_mean"]))
    assert error.cure == "[ensemble] members = 16 halves this part: about 1 s"
    (line,) = error_lines(data)
    assert re.match(
        r"plateau_mean 0\.\d+ ± 0\.\d+: largest part of its error: starts \(\d+\.\d%\), \[ensemble\] members = 16 halves this",
        line,
    )
    assert not list(error_lines(data, apart=("plateau_mean",)))


def test_one_start_has_none_and_a_contact_that_of_its_starts() -> None:
    alone = {**SMALL, "ensemble": {"members": 1}}
    data = one_case(api.run(alone, progress=False), {})
    assert "± ?: a single start" in next(error_lines(data))
    contact = {"title": "x", "stages": ["contact"], "numerics": {"n_x": 65}, "ensemble": {"members": 3}}
    data = one_case(api.run(contact, progress=False), {})
    assert [each.source for each in error_parts(data, "contact_half_width")] == ["starts"]


def test_a_number_that_no_member_has_is_not_known() -> None:
    """Of a case that the physics refuses nobody has even counted members."""
    refused = {**SMALL, "slip": {"residual_shear": 1.0}, "effects": {"pin_translation": False}}
    assert next(error_lines(api.run(refused, progress=False))) == "plateau_mean: not known"


def test_explain_measures_what_the_grid_changes(main: Main, tmp_path: Path) -> None:
    own = {**SMALL, "ensemble": {"members": 3}}
    file, out = tmp_path / "mine.toml", tmp_path / "out"
    file.write_text(as_toml(own))
    assert "not computed yet" in main("explain", file, "--out", out)[1]
    coarse = api.run(file, out, progress=False)["plateau_mean"].item()
    finer = api.run({**own, "numerics": {**own["numerics"], "n_x": 65}}, progress=False)["plateau_mean"].item()
    code, text, _ = main("explain", file, "--out", out, "--grid")
    (found,) = re.findall(r"half the spacing \(n_x = 65\): (\S+) ± ", " ".join(text.split()))
    assert code == 0
    change = 100.0 * abs(finer - coarse) / coarse
    np.testing.assert_allclose(float(found), change, atol=0.06)  # a digit behind the point is shown


def test_explain_gives_the_size_of_what_nodes_miss_of_a_rough_pin(main: Main, tmp_path: Path) -> None:
    places = np.linspace(-0.3, 0.3, 601)
    waves = "".join(f"{x},{2e-5 * math.sin(2.0 * math.pi * x / 0.02)}\n" for x in places)
    (tmp_path / "waves.csv").write_text(f"xi,height\n{waves}")
    file, texts = tmp_path / "mine.toml", []
    for n_x in (33, None):
        nodes = n_x or int(re.search(r"n_x = (\d+) resolves it", texts[0])[1])  # type: ignore[index]
        file.write_text(as_toml({**SMALL, "numerics": {"n_x": nodes}, "heterogeneity": {"roughness": "waves.csv"}}))
        texts.append(" ".join(main("explain", file)[1].split()))
    coarse, fine = (int(text.partition(" nodes miss ")[2].partition("%")[0]) for text in texts)
    assert coarse > 90  # of waves of 0.6 node spacings
    assert fine <= 50
    assert "resolves it" not in texts[1]


@pytest.mark.slow
def test_advice_on_a_short_record_is_a_length_that_ends_the_doubt() -> None:
    """What such a record itself shows of the error that all starts share is none: it stays unknown, and in the table."""
    film = {"radius": 100.0, "aspect_ratio": 0.2, "poisson": 0.2, "intrinsic_friction": 0.1}
    short = {**SMALL, "constants": film, "ensemble": {"members": 2}}
    data = one_case(api.run(short, progress=False), {})
    assert decode_flags(int(data["validity_flags"])) == (Flag.short_record,)
    *known, unknown = error_parts(data, "plateau_mean")
    assert [math.isfinite(each.share) for each in (*known, unknown)] == [True, False]
    (row,) = re.findall(r"limits\.spacings = (\S+), in about (\S+) times the time", unknown.cure)
    spacings, times = map(float, row)
    longer = one_case(api.run({**short, "limits": {"spacings": spacings}}, progress=False), {})
    assert float(longer["record_spacings"]) == pytest.approx(times * float(data["record_spacings"]), rel=0.05)
    assert not int(longer["validity_flags"])
    assert all(math.isfinite(each.share) for each in error_parts(longer, "plateau_mean"))


@pytest.mark.parametrize("unknown", ["uncertainty", "shared_error"])
def test_an_unknown_part_of_an_error_is_the_last_one_and_no_line_calls_it_the_largest(unknown: str) -> None:
    data = one_case(api.run({**SMALL, "ensemble": {"members": 3}}, progress=False), {})
    lacking = data.assign({f"plateau_mean_{unknown}": math.nan})
    parts = error_parts(lacking, "plateau_mean")
    assert {each.source for each in parts} == {"starts", "length of the record"}
    assert math.isnan(parts[-1].share)
    assert "nan" not in next(error_lines(lacking))
