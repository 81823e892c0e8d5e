"""The lines of one case, in text: a record's teeth, a drive's spring force, or its pressure; nothing where there is none."""

import unicodedata

import numpy as np
import pytest
import xarray as xr

import nanoslip
from nanoslip.study.dataset.table import one_case
from nanoslip.study.report.curves import HEIGHT, WIDTH, curves, text_plot
from tests.study.report.test_page import made_up

BLANK = "\u2800"


LABELS = ("place", "height")


def letters(drawn: str) -> list[str]:
    """The rows of the plot without axes."""
    return [line.split("┤")[1] for line in drawn.splitlines() if "┤" in line]


def test_a_plot_has_the_size_that_is_asked_for_and_the_ends_of_its_axes():
    drawn = text_plot([0.0, 2.5], [-1.0, 3.0], LABELS)
    lines = drawn.splitlines()
    assert len(lines) == HEIGHT + 2
    assert {len(row) for row in letters(drawn)} == {WIDTH}
    assert lines[0].strip() == "height"
    assert [lines[1].split()[0], lines[HEIGHT].split()[0]] == ["3", "-1"]
    assert lines[-1].split() == ["0", "place", "2.5"]


@pytest.mark.parametrize(
    ("end", "written"), [(-3.066e-16, "0"), (-0.0, "0"), (-2e-6, "0"), (0.01, "0"), (0.011, "0.011")]
)
def test_an_end_nearer_to_zero_than_half_a_dot_is_written_as_zero(end: float, written: str) -> None:
    """48 dots stand for the range of the numbers."""
    lines = text_plot([0.0, 1.0], [end, 1.0], LABELS).splitlines()
    assert lines[HEIGHT].split()[0] == written


def test_a_rising_line_goes_from_the_bottom_left_to_the_top_right_without_a_gap():
    rows = letters(text_plot([0.0, 1.0], [0.0, 1.0], LABELS, width=8, height=4))
    marked = [[column for column, letter in enumerate(row) if letter != BLANK] for row in rows]
    assert [row[-1] for row in marked] == sorted((row[-1] for row in marked), reverse=True)
    assert (marked[0][-1], marked[-1][0]) == (7, 0)
    assert {column for row in marked for column in row} == set(range(8))
    assert max(map(len, marked)) <= 4  # a quarter of the way, and a dot on either side


def test_a_line_that_turns_is_drawn_as_a_loop():
    """A circle: each column but the outermost has its upper and its lower half, with nothing between."""
    turn = np.linspace(0.0, 2.0 * np.pi, 2001)
    rows = letters(text_plot(np.sin(turn), np.cos(turn), LABELS))
    middle = [row[WIDTH // 2] for row in rows]
    assert middle[0] != BLANK != middle[-1]
    assert set(middle[1:-1]) == {BLANK}
    assert rows[HEIGHT // 2][0] != BLANK != rows[HEIGHT // 2][-1]


def test_a_single_high_tooth_between_many_points_is_seen():
    x = np.linspace(0.0, 1.0, 10_001)
    y = np.where(np.arange(x.size) == 5000, 1.0, 0.0)
    rows = letters(text_plot(x, y, LABELS))
    assert all(row[WIDTH // 2 - 1 : WIDTH // 2 + 1] != 2 * BLANK for row in rows)
    assert rows[0].replace(BLANK, "") != ""
    assert len(rows[0].replace(BLANK, "")) <= 2


@pytest.mark.parametrize(
    ("x", "y", "dots"),
    [([0.0, 0.0, 1.0], [0.0, 1.0, 1.0], ("12347", "1237")), ([0.0, 1.0, 1.0], [1.0, 1.0, 0.0], ("14568", "4568"))],
)
def test_letters_have_the_dots_of_their_names(x, y, dots):
    """A column of dots and a level line from its top; Unicode names a letter by the numbers of its dots."""
    rows = letters(text_plot(x, y, LABELS, width=1, height=2))
    assert [unicodedata.name(row) for row in rows] == [f"BRAILLE PATTERN DOTS-{each}" for each in dots]


@pytest.mark.parametrize(("x", "y"), [([], []), ([1.0], [2.0]), ([1.0, 1.0], [0.0, 1.0]), ([0.0, 1.0], [np.nan, 1.0])])
def test_what_is_no_line_is_no_plot(x, y):
    assert text_plot(x, y, LABELS) == ""


def test_values_that_are_missing_are_left_out():
    given = text_plot([0.0, 0.5, 1.0], [0.0, np.nan, 1.0], LABELS)
    assert given == text_plot([0.0, 1.0], [0.0, 1.0], LABELS)


CONTACT = {"title": "One contact", "stages": ["contact"], "numerics": {"n_x": 17}}


def test_a_case_with_one_drive_has_its_teeth_and_its_spring_force():
    data = made_up()
    data["friction_force"] = ((), 0.0)
    for group, name in (("record", "displacement"), ("trajectory", "time"), ("trajectory", "sample_spring_force")):
        data.encoding["nanoslip_groups"][group][name].attrs["long_name"] = name
    found = list(curves(one_case(data, {"intrinsic_friction": "0.25"})))
    assert [curve.x.tolist() for curve in found] == [[0.0, 0.1, 0.1, 0.3, 0.3, 0.4], [0.0, 0.1]]
    assert [curve.y_label.split(", ")[-1] for curve in found] == ["F/W", "sample_spring_force"]


@pytest.fixture(scope="module")
def contact() -> xr.Dataset:
    return nanoslip.run(CONTACT)


def test_a_contact_is_its_pressure_over_x(contact):
    (found,) = curves(one_case(contact, {}))
    assert found.x.tolist() == np.linspace(-0.5, 0.5, 17).tolist()
    # all forces of the nodes together are the load: trapezia, as pressure is zero at both ends
    assert np.isclose(np.trapezoid(found.y, found.x), 1.0, rtol=1e-9)
    assert found.x_label == "x from the slab's middle, in L_x, x/L_x"
