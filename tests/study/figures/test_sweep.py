"""Figures of a sweep: names are found, points hold every case, axes get roles, and what is drawn is what the points hold."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib import pyplot, rc_context
from matplotlib.figure import Figure

import nanoslip
from nanoslip.study.dataset.units import format_value, label, label_in_symbols, symbol, symbol_and_unit
from nanoslip.study.dataset.variables import describe
from nanoslip.study.figures.answer import make_view, view_named
from nanoslip.study.figures.points import (
    Points,
    UnknownNameError,
    axis_named,
    find_variable,
    points_named,
    read_points,
    typeset,
)
from nanoslip.study.figures.roles import (
    MOST_PANELS,
    assign_roles,
    axis_values,
    begins_with_zero,
    is_logarithmic,
    is_scattered,
    merge_zipped,
    select_points,
)
from nanoslip.study.figures.shared import image
from nanoslip.study.figures.sweep import FAILED_COLOR, SHORTEST, UNSURE, draw_over_axes, draw_scattered
from tests.study.figures.cases import listed, product


def meaning(name: str) -> str:
    """Meaning of a variable, as it is declared."""
    return describe(name).meaning


# Variables are found by their names, their symbols in either alphabet, and the start of a mean; what is unknown is named.

DATA = product(intrinsic_friction=[0.2, 0.4], radius=[50.0, 200.0])


@pytest.mark.parametrize(
    ("word", "name"),
    [("radius", "radius"), ("R/L_x", "radius"), ("μ_i", "intrinsic_friction"), ("mu_i", "intrinsic_friction"),
     ("R", "radius"), ("F", "plateau_mean"), ("plateau", "plateau_mean"), ("F/W", "plateau_mean")],
)  # fmt: skip
def test_a_word_means_a_variable(word: str, name: str) -> None:
    assert find_variable(DATA, word) == name


@pytest.mark.parametrize(
    ("word", "name"),
    [
        ("plateau/mu_i", "plateau_mean/intrinsic_friction"),
        ("R/L_x/plateau", "radius/plateau_mean"),
        ("R/L_x", "radius"),
    ],
)
def test_a_slash_divides_unless_it_is_part_of_a_symbol(word: str, name: str) -> None:
    assert points_named(DATA, word).name == name


def test_unknown_words_are_answered_with_what_there_is() -> None:
    with pytest.raises(UnknownNameError, match=r"^radios: .* radius"):
        find_variable(DATA, "radios")
    for half in ("/", "plateau/", "/plateau", "//"):
        with pytest.raises(UnknownNameError, match=rf"^{half}: needs a variable, or a ratio as plateau/mu_i"):
            points_named(DATA, half)
    with pytest.raises(UnknownNameError, match=r"F/W: .*peak_friction"):
        points_named(DATA.assign(peak_friction=DATA.plateau_mean), "F/W")
    with pytest.raises(
        UnknownNameError,
        match=r"^outcome: .* intrinsic_friction \(μ_i\), radius \(R/L_x\)$",
    ):
        axis_named(read_points(DATA, "plateau_mean"), DATA, "outcome")


def test_an_axis_may_be_drawn_in_si() -> None:
    data = DATA.assign_coords(radius_si=("radius", [0.05, 0.2]))
    view = view_named(data, "plateau", "radius_si", "", {})
    assert sorted({*view.columns()["radius_si"].tolist()}) == [0.05, 0.2]
    assert "radius" not in view.columns()
    with pytest.raises(UnknownNameError, match=r"^R in mm: .* radius_si \(R \(m\)\)$"):
        view_named(data, "plateau", "R in mm", "", {})


def test_an_axis_has_its_symbol_before_any_other_variable() -> None:
    """Alone `a` may be another length, too; of the axes it is one."""
    data = product(lambda intrinsic_friction, half_width: intrinsic_friction + half_width,
                   intrinsic_friction=[0.2, 0.4], half_width=[0.1, 0.2])  # fmt: skip
    data = data.assign(contact_half_width=data.plateau_mean)
    for word in ("a", "a/L_x", "half_width"):
        assert axis_named(read_points(data, "plateau_mean"), data, word) == "half_width"
    with pytest.raises(UnknownNameError, match="a: several variables"):
        find_variable(data, "a")


def test_labels_say_meaning_symbol_and_unit() -> None:
    assert label("radius") == f"{meaning('radius')} R/L_x"
    assert label("stage_velocity") == f"{meaning('stage_velocity')} V_o (m/s)"
    assert label("toy") == "toy"
    assert label("mean_step", "plateau_mean") == f"{meaning('mean_step')} over F/W, in L_x"
    assert label("surface_stiffness", "normal_load") == f"{meaning('surface_stiffness')} K over W/(G·L_x·L_y), in G·L_y"
    assert label("stage_velocity", "spring_stiffness") == f"{meaning('stage_velocity')} V_o (m/s) over k (N/m)"
    assert (symbol_and_unit("stage_velocity"), symbol_and_unit("radius"), symbol_and_unit("slip_order")) == (
        "V_o (m/s)",
        "R/L_x",
        "slip order",
    )
    assert (symbol("n_x"), symbol("stage_travel")) == ("n_x", "stage travel")
    assert typeset("μ_i over R/L_x") == "$μ_{i}$ over R/$L_{x}$"
    assert typeset("support = right_side, slip order = worst_first") == "support = right_side, slip order = worst_first"


def test_values_are_as_short_as_they_can_be() -> None:
    values = (0.25, 200.0, 30000.0, 2.5e-4, 0.001, 1e-10, 12345.6, 65, "bonded", float("inf"))
    assert " ".join(map(format_value, values)) == "0.25 200 3e4 2.5e-4 0.001 1e-10 12345.6 65 bonded inf"
    assert (
        label_in_symbols({"radius": 50.0, "n_x": 33, "spring_stiffness": 1e5}) == "R/L_x = 50, n_x = 33, k = 100 kN/m"
    )


# Points hold every case once, with its axes; a ratio's uncertainty follows from both numbers; members are mean and error.

LOADS = [1e-4, 1e-3]


def test_every_case_is_a_point_beside_its_axes() -> None:
    cases = product(intrinsic_friction=[0.2, 0.4, 0.6], normal_load=LOADS, n_x=[33])
    counts = cases["plateau_mean"].dims, np.arange(3, 9).reshape(3, 2, 1)
    points = read_points(cases.assign(plateau_mean_members=counts, members=counts), "plateau_mean")
    assert points.members.tolist() == [3, 4, 5, 6, 7, 8]
    assert not read_points(cases.drop_vars("validity_flags"), "plateau_mean").flagged.any()
    assert list(points.axes) == ["intrinsic_friction", "normal_load"]  # one n_x is no axis
    np.testing.assert_array_equal(points.values, 0.5 * points.axes["intrinsic_friction"])
    np.testing.assert_allclose(points.errors, 0.01 * points.values, rtol=1e-12)
    assert points.label == meaning("plateau_mean")


def test_a_ratio_has_the_uncertainties_of_both() -> None:
    data = product(intrinsic_friction=[0.2, 0.4], normal_load=LOADS)
    data["peak_friction"] = 2.0 * data.plateau_mean
    exact = read_points(data, "plateau_mean", "intrinsic_friction")
    np.testing.assert_allclose(exact.values, 0.5)
    np.testing.assert_allclose(exact.errors, 0.005)
    data["kinetic_friction"] = data.plateau_mean
    data["kinetic_friction_uncertainty"] = data.plateau_mean_uncertainty
    both = read_points(data, "kinetic_friction", "plateau_mean")
    np.testing.assert_allclose(both.errors, np.sqrt(2.0) * 0.01)
    assert np.isnan(read_points(data, "peak_friction", "intrinsic_friction").errors).all()


def test_a_ratio_of_a_number_to_itself_is_exact() -> None:
    """Of the plateau it was 1 ± 0.0099."""
    same = read_points(product(intrinsic_friction=[0.0, 0.4], normal_load=LOADS), "plateau_mean", "plateau_mean")
    np.testing.assert_array_equal(same.values, [np.nan, np.nan, 1.0, 1.0])
    np.testing.assert_array_equal(same.errors, [np.nan, np.nan, 0.0, 0.0])


def test_of_a_list_of_cases_what_follows_from_its_columns_is_no_axis() -> None:
    columns = {"radius": [50.0, 100.0], "n_x": [33, 65], "bottom_row": [17, 33]}
    data = listed(columns, [0.2, 0.3], manifest='design = "zip"\n[axes]\nradius = [50.0, 100.0]\nn_x = [33, 65]\n')
    assert list(read_points(data, "plateau_mean").axes) == ["radius", "n_x"]
    data.attrs["manifest_table"] = "n_x, radius\n33, 50\n65, 100\n"
    assert list(read_points(data, "plateau_mean").axes) == ["radius", "n_x"]


def test_a_setting_that_some_cases_lack_becomes_words() -> None:
    data = listed({"coupling_stiffness": [np.nan, 10.0]}, [0.2, 0.3])
    assert read_points(data, "plateau_mean").axes["coupling_stiffness"].tolist() == ["–", "10"]
    never = listed({"intrinsic_friction": [np.inf, 0.5]}, [0.2, 0.3])
    assert read_points(never, "plateau_mean").axes["intrinsic_friction"].tolist() == ["inf", "0.5"]


# From Python: the axes of a figure with the numbers and their ±, of the cases that are chosen.


def test_a_figure_of_a_notebook_has_the_numbers_of_chosen_cases_and_their_uncertainties() -> None:
    data = product(intrinsic_friction=[0.2, 0.4, 0.6], radius=[50.0, 200.0], n_x=[17, 33])
    with rc_context({"figure.figsize": (5.0, 3.0)}):
        axes = nanoslip.figure(data, "plateau/mu_i", hue="R", intrinsic_friction=[0.2, 0.6], n_x=33)
    assert pyplot.gcf() is axes.figure
    pyplot.close()
    assert axes.figure.get_size_inches().tolist() == [5.0, 3.0]
    assert [bars.get_label() for bars in axes.containers] == ["50", "200"]
    for bars in axes.containers:
        line, _, (ends,) = bars.lines
        assert [list(values) for values in line.get_data()] == [[0.2, 0.6], [0.5, 0.5]]
        np.testing.assert_allclose([np.ptp(ends[:, 1]) for ends in ends.get_segments()], 2 * 0.005, rtol=1e-12)
    assert len(nanoslip.figure(data, "plateau").figure.axes) == 2  # a third axis makes panels
    pyplot.close()
    with pytest.raises(nanoslip.NanoslipError, match=r"n_x = 65: .* 17, 33"):
        nanoslip.figure(data, "plateau", n_x=65)


# The axis of most values runs along x, the next in colours, the others in panels; what is too much is held, and said.


def over(**axes: list[object]) -> Points:
    return read_points(product(**axes), "plateau_mean")


@pytest.mark.parametrize(
    ("axes", "chosen", "expected"),
    [
        ({"intrinsic_friction": 2, "radius": 4, "n_x": 3}, {}, ("radius", "n_x", ("intrinsic_friction",))),
        ({"support": ["bonded", "right_side", "frictionless"], "radius": 2}, {}, ("radius", "support", ())),
        ({"intrinsic_friction": 2, "radius": 3}, {"x": "intrinsic_friction"}, ("intrinsic_friction", "radius", ())),
        ({"intrinsic_friction": 2, "radius": 3}, {"hue": "radius"}, ("intrinsic_friction", "radius", ())),
    ],
)
def test_roles_go_by_the_number_of_values_words_are_last_and_what_is_chosen_keeps_its_place(
    axes: dict[str, Any], chosen: dict[str, str], expected: tuple[object, ...]
) -> None:
    values = {
        name: each if isinstance(each, list) else np.arange(1.0, each + 1.0).tolist() for name, each in axes.items()
    }
    data = product(
        lambda **grids: np.arange(next(iter(grids.values())).size).reshape(*map(len, values.values())), **values
    )
    roles = assign_roles(read_points(data, "plateau_mean"), **chosen)
    assert (roles.x, roles.hue, roles.panels) == expected
    assert not roles.held


def test_an_axis_has_one_place() -> None:
    with pytest.raises(ValueError, match="radius: the only axis"):
        assign_roles(over(intrinsic_friction=[0.5], radius=[1.0, 2.0]), hue="radius")
    with pytest.raises(ValueError, match=r"radius: .*x and hue"):
        assign_roles(over(intrinsic_friction=[0.5], radius=[1.0, 2.0], n_x=[17, 33]), x="radius", hue="radius")


def test_more_panels_than_a_page_bears_are_held_at_a_value_that_is_there() -> None:
    five = [1.0, 2.0, 3.0, 4.0, 5.0]
    points = over(intrinsic_friction=[*five, 6.0, 7.0], radius=[*five, 6.0], normal_load=five, aspect_ratio=five)
    roles = assign_roles(points)
    assert roles.panels == ("normal_load",)
    assert dict(roles.held) == {"aspect_ratio": 3.0}
    assert len(axis_values(points, "normal_load")) <= MOST_PANELS
    assert len(select_points(points, roles.held).values) == len(points.values) / 5


def test_axes_that_vary_together_are_one_unless_it_cannot_tell_the_cases_apart() -> None:
    def over_list(radius: list[float], n_x: list[int], design: str = "zip") -> Points:
        manifest = f'design = "{design}"\n[axes]\nradius = {radius}\nn_x = {n_x}\n'
        return read_points(listed({"radius": radius, "n_x": n_x}, [0.1, 0.2, 0.3], manifest), "plateau_mean")

    points = over_list([50.0, 100.0, 200.0], [17, 33, 17])
    assert (list(merge_zipped(points)[0].axes), merge_zipped(points)[1]) == (["radius"], "radius")
    for chosen in (("n_x",), ("radius", "n_x")):
        assert merge_zipped(points, chosen) == (points, "")
    neither = over_list([50.0, 50.0, 200.0], [17, 33, 17])
    assert merge_zipped(neither) == (neither, "")
    other = over_list([50.0, 100.0, 200.0], [17, 33, 65], "product")
    assert merge_zipped(other) == (other, "")


def test_a_design_that_fills_little_of_its_product_is_scattered() -> None:
    columns = {"radius": [50.0, 100.0, 200.0], "n_x": [17, 33, 65]}
    assert is_scattered(read_points(listed(columns, [0.1, 0.2, 0.3]), "plateau_mean"))
    assert not is_scattered(over(intrinsic_friction=[0.1, 0.2], radius=[1.0, 2.0, 3.0]))
    assert not is_scattered(read_points(listed({"radius": [50.0, 100.0]}, [0.1, 0.2]), "plateau_mean"))


def test_numbers_that_some_cases_lack_are_in_their_order_and_the_missing_one_is_last() -> None:
    points = read_points(listed({"aspect_ratio": [1.0, float("nan"), 1e4, 1e-4]}, [0.1] * 4), "plateau_mean")
    assert axis_values(points, "aspect_ratio") == ["1e-4", "1", "1e4", "–"]


# What is drawn is what the points hold: every value at its place, crosses where there is none.


def crosses(figure: Figure) -> list[tuple[float, float]]:
    return [
        place
        for axes in figure.axes
        for line in axes.lines
        if line.get_color() == FAILED_COLOR
        for place in zip(*map(list, line.get_data()), strict=True)
    ]


@pytest.mark.parametrize("axes", [("drive", "radius"), ("radius", "drive"), ("drive",)])
def test_names_are_no_formulas(axes: tuple[str, ...]) -> None:
    """What stands between dollars would be one for matplotlib, and this one is wrong."""
    values = {"radius": [1.0, 2.0, 3.0], "drive": ["k=$k_$", "a$b", "$$"]}
    points = read_points(
        product(
            lambda drive, **_: np.arange(float(drive.size)).reshape(drive.shape),
            **{name: values[name] for name in axes},
        ),
        "plateau_mean",
    )
    drawn = image(draw_over_axes(points, assign_roles(points)), "svg").decode()
    assert all(name in drawn for name in values["drive"])


def test_lines_hold_the_values_in_the_order_of_x() -> None:
    points = read_points(product(intrinsic_friction=[0.4, 0.2], radius=[3.0, 1.0, 2.0]), "plateau_mean")
    axes = draw_over_axes(points, assign_roles(points)).axes[0]
    found = {bars.get_label(): bars.lines[0].get_data() for bars in axes.containers}
    assert {label: (list(x), list(y)) for label, (x, y) in found.items()} == {
        "0.2": ([1.0, 2.0, 3.0], [0.1] * 3),
        "0.4": ([1.0, 2.0, 3.0], [0.2] * 3),
    }
    assert crosses(axes.figure) == []
    lines = [bars.lines[0].get_linestyle() for bars in axes.containers]
    points = read_points(product(lambda support: np.arange(2.0), support=["bonded", "frictionless"]), "plateau_mean")
    in_symbols = draw_over_axes(points, assign_roles(points)).axes[0].containers[0].lines[0]
    assert (lines, in_symbols.get_linestyle()) == (["-", "--"], "None")  # which no line joins


def test_a_line_breaks_where_a_value_is_missing_and_a_cross_is_on_the_lower_edge() -> None:
    data = product(lambda radius: np.where(radius == 2.0, np.nan, radius), radius=[4.0, 1.0, 2.0, 3.0])
    points = read_points(data, "plateau_mean")
    figure = draw_over_axes(points, assign_roles(points))
    np.testing.assert_array_equal(figure.axes[0].containers[0].lines[0].get_ydata(), [1.0, np.nan, 3.0, 4.0])
    assert crosses(figure) == [(2.0, pytest.approx(0.02))]


def test_each_value_has_its_tile() -> None:
    data = product(
        lambda radius, n_x: np.where((radius == 2.0) & (n_x == 65), np.nan, radius * n_x),
        radius=[4.0, 1.0, 2.0],
        n_x=[17, 65],
    )
    points = read_points(data, "plateau_mean")
    figure = draw_over_axes(points, replace(assign_roles(points), mapped=True))
    tiles = np.asarray(figure.axes[0].collections[0].get_array()).reshape(2, 3)
    np.testing.assert_array_equal(tiles, [[17.0, 34.0, 68.0], [65.0, np.nan, 260.0]])
    assert crosses(figure) == [(2.0, 65.0)]
    across, up = np.asarray(figure.axes[0].collections[0].get_coordinates()).T
    np.testing.assert_allclose(across[:, 0], [0.5, 1.5, 3.0, 5.0])
    np.testing.assert_allclose(up[0], [17.0 - 24.0, 41.0, 65.0 + 24.0])


@pytest.mark.parametrize("count", [6, 9])
def test_each_word_has_its_own_colour_and_stands_whole_in_the_legend(count: int) -> None:
    """Nine words are more than there are colours of lines."""
    data = product(lambda radius, n_x: radius + n_x, radius=np.arange(1.0, count + 1.0).tolist(), n_x=[17, 33])
    in_symbols = [f"a word of sort {number}, and more" for number in range(count)]
    data["outcome"] = (("radius", "n_x"), np.array([[word, word] for word in in_symbols], dtype=object))
    figure = draw_over_axes(points := read_points(data, "outcome"), assign_roles(points))
    figure.draw_without_rendering()
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == in_symbols
    box = legend.get_window_extent()
    assert 0.0 <= box.x0 < box.x1 <= figure.bbox.width
    mesh = figure.axes[0].collections[0]
    assert len({tuple(color) for color in mesh.to_rgba(np.arange(count)).tolist()}) == count


def test_a_scattered_design_has_a_panel_for_each_coordinate_with_a_short_label() -> None:
    data = listed({"radius": [50.0, 200.0, 100.0], "stage_velocity": [1.0, 3.0, 2.0]}, [0.1, 0.2, 0.3])
    figure = draw_scattered(read_points(data, "plateau_mean"))
    drawn = [list(axes.containers[0].lines[0].get_xdata()) for axes in figure.axes]
    assert drawn == [[50.0, 100.0, 200.0], [1.0, 2.0, 3.0]]
    assert [axes.get_xlabel() for axes in figure.axes] == ["R/$L_{x}$", "$V_{o}$ (m/s)"]


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


def test_a_point_without_a_known_uncertainty_has_a_mark_and_no_bar() -> None:
    """Without a bar alone it would look like the most precise one."""
    data = product(radius=[1.0, 2.0, 4.0], intrinsic_friction=[0.2])
    data["plateau_mean_uncertainty"] = data["plateau_mean_uncertainty"].where(data["radius"] != 2.0)
    points = read_points(data, "plateau_mean")
    axes = draw_over_axes(points, assign_roles(points)).axes[0]
    marks = [list(line.get_xdata()) for line in axes.lines if line.get_marker() == UNSURE]
    assert marks == [[2.0]]
    assert "1 of 3 points" in make_view(points).caption
    exact = read_points(data, "radius", "intrinsic_friction")  # parameters have no uncertainty that could be missing
    assert not exact.unsure.any()


def test_a_bar_of_all_of_a_number_is_an_arrow_on_a_logarithmic_axis() -> None:
    """Such an axis has no 0: the bar would be a line through all decades, to the floor."""
    data = product(lambda radius: radius, radius=[1.0, 10.0, 100.0])
    data["plateau_mean_uncertainty"] = ("radius", np.array([0.1, 10.0, 7.0]))
    points = read_points(data, "plateau_mean")
    axes = draw_over_axes(points, assign_roles(points)).axes[0]
    assert axes.get_yscale() == "log"
    (bars,) = (container.lines[2][0] for container in axes.containers)
    lower = [float(segment[0][1]) for segment in bars.get_segments()]
    assert lower == pytest.approx([0.9, SHORTEST * 10.0, 93.0])
    assert [list(line.get_xdata()) for line in axes.lines if line.get_marker() == "v"] == [[10.0]]
    assert "Arrows" in make_view(points).caption


def test_members_that_differ_have_the_colour_of_what_most_do_and_the_paler_the_fewer() -> None:
    data = product(lambda radius, n_x: radius + n_x, radius=[1.0, 2.0, 4.0], n_x=[17, 33])
    dims, slides, sticks = ("radius", "n_x"), np.array([[16, 12], [7, 0], [0, 0]]), np.array([[0, 4], [9, 8], [1, 11]])
    data["regime"] = (dims, np.where(slides > sticks, "slides", "sticks").astype(object))
    data["regime_slides_members"], data["regime_sticks_members"] = (dims, slides), (dims, sticks)
    points = read_points(data, "regime")
    figure = draw_over_axes(points, assign_roles(points))
    mesh = figure.axes[0].collections[0]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["slides", "sticks"]
    np.testing.assert_array_equal(np.asarray(mesh.get_array()).reshape(2, 3), [[0, 1, 1], [0, 1, 1]])
    np.testing.assert_allclose(np.asarray(mesh.get_alpha()).reshape(2, 3), [[1.0, 9 / 16, 1.0], [0.75, 1.0, 1.0]])
    assert "the paler" in make_view(points).caption


@pytest.mark.parametrize("x", ["spring_stiffness", "stage_velocity"])
def test_a_map_of_regimes_has_the_critical_velocity_where_it_is_computed(x: str) -> None:
    data = product(lambda **_: np.zeros((3, 2)), stage_velocity=[1e-3, 1e-2, 1e-1], spring_stiffness=[1e3, 1e4])
    dims, velocity = ("stage_velocity", "spring_stiffness"), data["stage_velocity"].values[:, None]
    critical = np.broadcast_to([0.05, 0.005], (3, 2))
    data["regime"] = (dims, np.where(velocity < critical, "stick_slip", "slides").astype(object))
    assert "Black line" not in make_view(read_points(data, "regime"), x).caption
    data["critical_velocity"] = (dims, critical)
    view = make_view(read_points(data, "regime"), x)
    line = view.draw().axes[0].lines[0]
    places = line.get_xydata() if x == "spring_stiffness" else line.get_xydata()[:, ::-1]
    np.testing.assert_allclose(places, [[1e3, 0.05], [1e4, 0.005]])
    assert "Black line" in view.caption


def test_a_zero_beside_many_decades_has_a_place_of_its_own_on_the_axis() -> None:
    """On a linear scale it lay on the smallest numbers, label on label."""
    data = product(stage_velocity=[1e3, 0.0, 1e-12, 2e-3], intrinsic_friction=[0.2])
    points = read_points(data, "plateau_mean")
    figure = draw_over_axes(points, assign_roles(points))
    axes = figure.axes[0]
    places = axes.transAxes.inverted().transform(axes.transData.transform([(x, 0.1) for x in axes.get_xticks()]))
    assert [text.get_text() for text in axes.get_xticklabels()] == ["0", "1e-12", "0.002", "1000"]
    assert (np.diff(places[:, 0]) > 0.1).all()
    assert not begins_with_zero(np.array([0.0, 0.3, 3.0]))
