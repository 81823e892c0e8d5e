"""A picture has a journal's width in every format, and the same drawing gives the same bytes."""

import pytest
from matplotlib.figure import Figure

from study.figures.shared.canvas import FORMATS, column, image


def drawn() -> Figure:
    with column(2.0) as figure:
        figure.add_subplot().plot([0, 1], [0, 2], label="μ")
    return figure


@pytest.mark.parametrize("form", FORMATS)
def test_the_same_drawing_is_the_same_file(form: str) -> None:
    first = image(drawn(), form)
    assert first == image(drawn(), form)
    assert first.startswith({"pdf": b"%PDF", "svg": b"<?xml", "png": b"\x89PNG"}[form])


def test_a_column_is_85_millimetres() -> None:
    assert drawn().get_figwidth() * 25.4 == pytest.approx(85.0, abs=0.1)
