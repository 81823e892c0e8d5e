"""What is drawn is what the points hold: every value at its place, crosses where there is none."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from nanoslip.study.figures.points import points_of, roles_of
from nanoslip.study.figures.sweep import (
    FAILED,
    SHORTEST,
    UNSURE,
    begins_with_zero,
    draw_lines,
    draw_scattered,
    draw_tiles,
    is_logarithmic,
    panels_of,
)
from nanoslip.study.figures.view import view_of
from tests.study.figures.cases import listed, product


def crosses(figure: Figure) -> list[tuple[float, float]]:
    return [
        place
        for axes in figure.axes
        for line in axes.lines
        if line.get_color() == FAILED
        for place in zip(*map(list, line.get_data()), strict=True)
    ]


def test_lines_hold_the_values_in_the_order_of_x() -> None:
    points = points_of(product(intrinsic_friction=[0.4, 0.2], radius=[3.0, 1.0, 2.0]), "plateau_mean")
    axes = draw_lines(points, roles_of(points)).axes[0]
    found = {bars.get_label(): bars.lines[0].get_data() for bars in axes.containers}
    assert {label: (list(x), list(y)) for label, (x, y) in found.items()} == {
        "0.2": ([1.0, 2.0, 3.0], [0.1] * 3),
        "0.4": ([1.0, 2.0, 3.0], [0.2] * 3),
    }
    assert crosses(axes.figure) == []


def test_cases_without_a_value_are_crosses_on_the_lower_edge() -> None:
    data = product(lambda radius: np.where(radius == 2.0, np.nan, radius), radius=[1.0, 2.0, 4.0])
    points = points_of(data, "plateau_mean")
    assert crosses(draw_lines(points, roles_of(points))) == [(2.0, pytest.approx(0.02))]


def test_a_line_breaks_where_a_value_is_missing() -> None:
    data = product(lambda radius: np.where(radius == 2.0, np.nan, radius), radius=[4.0, 1.0, 2.0, 3.0])
    points = points_of(data, "plateau_mean")
    line = draw_lines(points, roles_of(points)).axes[0].containers[0].lines[0]
    np.testing.assert_array_equal(line.get_ydata(), [1.0, np.nan, 3.0, 4.0])


def test_each_value_has_its_tile() -> None:
    data = product(
        lambda radius, n_x: np.where((radius == 2.0) & (n_x == 65), np.nan, radius * n_x),
        radius=[4.0, 1.0, 2.0],
        n_x=[17, 65],
    )
    points = points_of(data, "plateau_mean")
    figure = draw_tiles(points, roles_of(points))
    tiles = np.asarray(figure.axes[0].collections[0].get_array()).reshape(2, 3)
    np.testing.assert_array_equal(tiles, [[17.0, 34.0, 68.0], [65.0, np.nan, 260.0]])
    assert crosses(figure) == [(2.0, 65.0)]


def test_words_have_tiles_of_their_own_colour() -> None:
    data = product(
        lambda radius, n_x: np.where(radius * n_x > 40.0, np.nan, radius), radius=[1.0, 2.0, 4.0], n_x=[17, 33]
    )
    points = points_of(data, "outcome")
    figure = draw_tiles(points, roles_of(points))
    tiles = np.asarray(figure.axes[0].collections[0].get_array()).reshape(2, 3)
    np.testing.assert_array_equal(tiles, [[0, 0, 1], [0, 1, 1]])
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["completed", "no-plateau"]


@pytest.mark.parametrize("count", [6, 9])
def test_each_word_has_its_own_colour_and_stands_whole_in_the_legend(count: int) -> None:
    """Nine words are more than there are colours of lines."""
    data = product(lambda radius, n_x: radius + n_x, radius=np.arange(1.0, count + 1.0).tolist(), n_x=[17, 33])
    words = [f"stick_slip of sort {number}; and slides" for number in range(count)]
    data["outcome"] = (("radius", "n_x"), np.array([[word, word] for word in words], dtype=object))
    figure = draw_tiles(points := points_of(data, "outcome"), roles_of(points))
    figure.draw_without_rendering()
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [word.replace("_", "-") for word in words]
    box = legend.get_window_extent()
    assert 0.0 <= box.x0 < box.x1 <= figure.bbox.width
    mesh = figure.axes[0].collections[0]
    assert len({tuple(color) for color in mesh.to_rgba(np.arange(count)).tolist()}) == count


def test_a_scattered_design_has_a_panel_for_each_coordinate() -> None:
    data = listed({"radius": [50.0, 200.0, 100.0], "n_x": [17, 33, 65]}, [0.1, 0.2, 0.3])
    figure = draw_scattered(points_of(data, "plateau_mean"))
    drawn = [list(axes.containers[0].lines[0].get_xdata()) for axes in figure.axes]
    assert drawn == [[50.0, 100.0, 200.0], [17, 33, 65]]


@pytest.mark.parametrize(
    ("values", "logarithmic"),
    [
        ([1.0, 2.0, 4.0, 8.0], True),
        ([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0], False),
        ([0.0, 1.0, 100.0], False),
        ([1.0, 2.0], False),
    ],
)
def test_a_scale_is_logarithmic_where_numbers_are_even_on_it(values: list[float], logarithmic: bool) -> None:
    assert is_logarithmic(np.array(values)) == logarithmic


def test_panels_of_two_coordinates_stand_in_rows_and_columns_of_their_values() -> None:
    data = product(
        radius=[1.0, 2.0, 3.0, 4.0], n_x=[17, 33, 65], intrinsic_friction=[0.1, 0.2, 0.3], aspect_ratio=[1.0, 2.0]
    )
    points = points_of(data, "plateau_mean")
    roles = roles_of(points)
    assert roles.panels == ("intrinsic_friction", "aspect_ratio")
    panels, columns = panels_of(points, roles)
    assert columns == 3
    assert [panel["intrinsic_friction"] for panel in panels] == [0.1, 0.2, 0.3] * 2
    assert [panel["aspect_ratio"] for panel in panels] == [1.0] * 3 + [2.0] * 3


def test_what_stands_below_a_narrow_panel_is_short() -> None:
    data = listed({"radius": [50.0, 200.0, 100.0], "stage_velocity": [1.0, 3.0, 2.0]}, [0.1, 0.2, 0.3])
    figure = draw_scattered(points_of(data, "plateau_mean"))
    assert [axes.get_xlabel() for axes in figure.axes] == ["R/$L_{x}$", "$V_{o}$ (m/s)"]


@pytest.mark.parametrize(("values", "line"), [([1.0, 2.0], "-"), (["bonded", "frictionless"], "None")])
def test_a_line_joins_numbers_and_no_words(values: list[float] | list[str], line: str) -> None:
    data = product(lambda support: np.arange(2.0), support=values)
    points = points_of(data, "plateau_mean")
    axes = draw_lines(points, roles_of(points)).axes[0]
    assert axes.containers[0].lines[0].get_linestyle() == line


def test_a_point_without_a_known_uncertainty_has_a_mark_and_no_bar() -> None:
    """Without a bar alone it would look like the most precise one."""
    data = product(radius=[1.0, 2.0, 4.0], intrinsic_friction=[0.2])
    data["plateau_mean_uncertainty"] = data["plateau_mean_uncertainty"].where(data["radius"] != 2.0)
    points = points_of(data, "plateau_mean")
    axes = draw_lines(points, roles_of(points)).axes[0]
    marks = [list(line.get_xdata()) for line in axes.lines if line.get_marker() == UNSURE]
    assert marks == [[2.0]]
    assert "± not known of 1 of 3 points" in view_of(points).caption
    exact = points_of(data, "radius", "intrinsic_friction")  # parameters have no uncertainty that could be missing
    assert not exact.unsure.any()


def test_a_bar_of_all_of_a_number_is_an_arrow_on_a_logarithmic_axis() -> None:
    """Such an axis has no 0: the bar would be a line through all decades, to the floor."""
    data = product(lambda radius: radius, radius=[1.0, 10.0, 100.0])
    data["plateau_mean_uncertainty"] = ("radius", np.array([0.1, 10.0, 7.0]))
    points = points_of(data, "plateau_mean")
    axes = draw_lines(points, roles_of(points)).axes[0]
    assert axes.get_yscale() == "log"
    (bars,) = (container.lines[2][0] for container in axes.containers)
    lower = [float(segment[0][1]) for segment in bars.get_segments()]
    assert lower == pytest.approx([0.9, SHORTEST * 10.0, 93.0])
    assert [list(line.get_xdata()) for line in axes.lines if line.get_marker() == "v"] == [[10.0]]
    assert "Arrows" in view_of(points).caption


def test_members_that_differ_have_the_colour_of_what_most_do_and_the_paler_the_fewer() -> None:
    data = product(lambda radius, n_x: radius + n_x, radius=[1.0, 2.0, 4.0], n_x=[17, 33])
    words = [["slides", "12 slides; 4 sticks"], ["9 sticks; 7 slides", "8 sticks"], ["sticks", "11 sticks"]]
    data["outcome"] = (("radius", "n_x"), np.array(words, dtype=object))
    points = points_of(data, "outcome")
    figure = draw_tiles(points, roles_of(points))
    mesh = figure.axes[0].collections[0]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["slides", "sticks"]
    np.testing.assert_array_equal(np.asarray(mesh.get_array()).reshape(2, 3), [[0, 1, 1], [0, 1, 1]])
    np.testing.assert_allclose(np.asarray(mesh.get_alpha()).reshape(2, 3), [[1.0, 9 / 16, 1.0], [0.75, 1.0, 1.0]])
    assert "the paler the fewer" in view_of(points).caption


def test_a_zero_beside_many_decades_has_a_place_of_its_own_on_the_axis() -> None:
    """On a linear scale it lay on the smallest numbers, label on label."""
    data = product(stage_velocity=[1e3, 0.0, 1e-12, 2e-3], intrinsic_friction=[0.2])
    points = points_of(data, "plateau_mean")
    figure = draw_lines(points, roles_of(points))
    axes = figure.axes[0]
    places = axes.transAxes.inverted().transform(axes.transData.transform([(x, 0.1) for x in axes.get_xticks()]))
    assert [text.get_text() for text in axes.get_xticklabels()] == ["0", "1e-12", "0.002", "1000"]
    assert (np.diff(places[:, 0]) > 0.1).all()
    assert not begins_with_zero(np.array([0.0, 0.3, 3.0]))
