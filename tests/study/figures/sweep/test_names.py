"""Variables are found by their names, their symbols in either alphabet, and the start of a mean; what is unknown is named."""

import pytest

from nanoslip.study.figures.points import (
    UnknownNameError,
    axis_named,
    in_text,
    label,
    points_named,
    points_of,
    short,
    symbol,
    typeset,
    variable_of,
    words,
)
from tests.study.figures.cases import product

DATA = product(intrinsic_friction=[0.2, 0.4], radius=[50.0, 200.0])


@pytest.mark.parametrize(
    ("word", "name"),
    [("radius", "radius"), ("R/L_x", "radius"), ("μ_i", "intrinsic_friction"), ("mu_i", "intrinsic_friction"),
     ("R", "radius"), ("F", "plateau_mean"), ("plateau", "plateau_mean"), ("F/W", "plateau_mean")],
)  # fmt: skip
def test_a_word_means_a_variable(word: str, name: str) -> None:
    assert variable_of(DATA, word) == name


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
    with pytest.raises(UnknownNameError, match=r"^radios: no variable of this dataset; nearest: radius"):
        variable_of(DATA, "radios")
    with pytest.raises(UnknownNameError, match=r"^mu_x: no variable"):
        points_named(DATA, "plateau/mu_x")
    for half in ("/", "plateau/", "/plateau", "//"):
        with pytest.raises(UnknownNameError, match=rf"^{half}: needs a variable, or a ratio of two as plateau/mu_i"):
            points_named(DATA, half)
    with pytest.raises(UnknownNameError, match=r"F/W: several variables are called so: .*peak_friction"):
        points_named(DATA.assign(peak_friction=DATA.plateau_mean), "F/W")
    with pytest.raises(
        UnknownNameError,
        match=r"^outcome: cases do not differ in it; they differ in intrinsic_friction \(μ_i\), radius \(R/L_x\)$",
    ):
        axis_named(points_of(DATA, "plateau_mean"), DATA, "outcome")
    with pytest.raises(
        UnknownNameError, match=r"^Q: no variable of this dataset; they differ in intrinsic_friction \(μ_i\), radius"
    ):
        axis_named(points_of(DATA, "plateau_mean"), DATA, "Q")


def test_an_axis_has_its_symbol_before_any_other_variable() -> None:
    """Alone `a` may be another length, too; of the axes it is one."""
    data = product(lambda intrinsic_friction, half_width: intrinsic_friction + half_width,
                   intrinsic_friction=[0.2, 0.4], half_width=[0.1, 0.2])  # fmt: skip
    data = data.assign(contact_half_width=data.plateau_mean)
    for word in ("a", "a/L_x", "half_width"):
        assert axis_named(points_of(data, "plateau_mean"), data, word) == "half_width"
    with pytest.raises(UnknownNameError, match="a: several variables"):
        variable_of(data, "a")


def test_labels_say_meaning_symbol_and_unit() -> None:
    assert label("radius") == "radius of the pin R/L_x"
    assert label("stage_velocity") == "velocity of the stage V_o (m/s)"
    assert label("toy") == "toy"
    assert (short("stage_velocity"), short("radius"), short("slip_order")) == ("V_o (m/s)", "R/L_x", "slip order")
    assert (symbol("n_x"), symbol("stage_travel")) == ("n_x", "stage travel")
    assert typeset("μ_i over R/L_x") == "$μ_{i}$ over R/$L_{x}$"
    assert typeset("support = right_side, slip order = worst_first") == "support = right_side, slip order = worst_first"


def test_values_are_as_short_as_they_can_be() -> None:
    values = (0.25, 200.0, 30000.0, 2.5e-4, 0.001, 1e-10, 12345.6, 65, "bonded", float("inf"))
    assert list(map(in_text, values)) == [
        "0.25",
        "200",
        "3e4",
        "2.5e-4",
        "0.001",
        "1e-10",
        "12345.6",
        "65",
        "bonded",
        "inf",
    ]
    assert words({"radius": 50.0, "n_x": 33, "spring_stiffness": 1e5}) == "R/L_x = 50, n_x = 33, k = 1e5 N/m"
