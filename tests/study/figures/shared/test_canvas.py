"""A picture has a journal's width in every format, and the same drawing gives the same bytes."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from solver.outcome import InvalidInput
from study.figures.shared.canvas import FORMATS, column, format_of, image


def drawn() -> Figure:
    with column(2.0) as figure:
        figure.add_subplot().plot([0, 1], [0, 2], label="μ")
    return figure


@pytest.mark.parametrize("form", FORMATS)
def test_the_same_drawing_is_the_same_file(form: str) -> None:
    first = image(drawn(), form)
    assert first == image(drawn(), form)
    assert first.startswith({"pdf": b"%PDF", "svg": b"<?xml", "png": b"\x89PNG"}[form])


@pytest.mark.parametrize("name", ["a.svg", "a.SVG", "a.b.Svg"])
def test_an_ending_means_a_format_in_large_letters_too(name: str) -> None:
    assert format_of(Path(name)) == "svg"


@pytest.mark.parametrize("name", ["svg", "a.", "a.jpg", "a.svg.gz", ".svg"])
def test_a_name_without_a_format_is_told_which_there_are(name: str) -> None:
    with pytest.raises(InvalidInput, match=r"needs a name that ends in \.pdf, \.svg, \.png"):
        format_of(Path(name))


def test_a_column_is_85_millimetres() -> None:
    assert drawn().get_figwidth() * 25.4 == pytest.approx(85.0, abs=0.1)
