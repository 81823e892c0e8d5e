"""The axis of most values runs along x, the next in colours, the others in panels; what is too much is held, and said."""

import pytest

from nanoslip.study.figures.points import (
    MOST_PANELS,
    Points,
    held_at,
    points_of,
    roles_of,
    scattered,
    together,
    values_of,
)
from tests.study.figures.cases import listed, product


def over(**axes: list[object]) -> Points:
    return points_of(product(**axes), "plateau_mean")


def test_roles_go_by_the_number_of_values() -> None:
    roles = roles_of(over(intrinsic_friction=[0.1, 0.2], radius=[1.0, 2.0, 3.0, 4.0], n_x=[17, 33, 65]))
    assert (roles.x, roles.hue, roles.panels, dict(roles.held)) == ("radius", "n_x", ("intrinsic_friction",), {})


def test_words_come_after_numbers() -> None:
    roles = roles_of(over(support=["bonded", "right_side", "frictionless"], intrinsic_friction=[0.1, 0.2]))
    assert (roles.x, roles.hue) == ("intrinsic_friction", "support")


def test_what_is_chosen_keeps_its_place() -> None:
    points = over(intrinsic_friction=[0.1, 0.2], radius=[1.0, 2.0, 3.0])
    assert roles_of(points, x="intrinsic_friction").hue == "radius"
    assert roles_of(points, hue="radius").x == "intrinsic_friction"


def test_an_axis_has_one_place() -> None:
    with pytest.raises(ValueError, match="radius: the only axis: needs to be x"):
        roles_of(over(intrinsic_friction=[0.5], radius=[1.0, 2.0]), hue="radius")
    with pytest.raises(ValueError, match="radius: is x and hue"):
        roles_of(over(intrinsic_friction=[0.5], radius=[1.0, 2.0], n_x=[17, 33]), x="radius", hue="radius")


def test_more_panels_than_a_page_bears_are_held_at_a_value_that_is_there() -> None:
    five = [1.0, 2.0, 3.0, 4.0, 5.0]
    points = over(intrinsic_friction=[*five, 6.0, 7.0], radius=[*five, 6.0], normal_load=five, aspect_ratio=five)
    roles = roles_of(points)
    assert roles.panels == ("normal_load",)
    assert dict(roles.held) == {"aspect_ratio": 3.0}
    assert len(values_of(points, "normal_load")) <= MOST_PANELS
    assert len(held_at(points, roles.held).values) == len(points.values) / 5


def test_axes_that_vary_together_are_one_unless_it_cannot_tell_the_cases_apart() -> None:
    def over_list(radius: list[float], n_x: list[int], design: str = "zip") -> Points:
        manifest = f'design = "{design}"\n[axes]\nradius = {radius}\nn_x = {n_x}\n'
        return points_of(listed({"radius": radius, "n_x": n_x}, [0.1, 0.2, 0.3], manifest), "plateau_mean")

    points = over_list([50.0, 100.0, 200.0], [17, 33, 17])
    assert (list(together(points)[0].axes), together(points)[1]) == (["radius"], "radius")
    for chosen in (("n_x",), ("radius", "n_x")):
        assert together(points, chosen) == (points, "")
    neither = over_list([50.0, 50.0, 200.0], [17, 33, 17])
    assert together(neither) == (neither, "")
    other = over_list([50.0, 100.0, 200.0], [17, 33, 65], "product")
    assert together(other) == (other, "")


def test_a_design_that_fills_little_of_its_product_is_scattered() -> None:
    columns = {"radius": [50.0, 100.0, 200.0], "n_x": [17, 33, 65]}
    assert scattered(points_of(listed(columns, [0.1, 0.2, 0.3]), "plateau_mean"))
    assert not scattered(over(intrinsic_friction=[0.1, 0.2], radius=[1.0, 2.0, 3.0]))
    assert not scattered(points_of(listed({"radius": [50.0, 100.0]}, [0.1, 0.2]), "plateau_mean"))


def test_numbers_that_some_cases_lack_are_in_their_order_and_the_missing_one_is_last() -> None:
    points = points_of(listed({"aspect_ratio": [1.0, float("nan"), 1e4, 1e-4]}, [0.1] * 4), "plateau_mean")
    assert values_of(points, "aspect_ratio") == ["1e-4", "1", "1e4", "–"]
