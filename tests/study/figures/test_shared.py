"""What all figures share: pictures of a journal's width, and claims beside the paper's numbers."""

import io
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nanoslip.solver.outcome import InvalidInput
from nanoslip.study.figures import shared as canvas
from nanoslip.study.figures.shared import FORMATS, Claim, Stated, column, compared, format_of, image, over_starts, table

# A picture has a journal's width in every format, and the same drawing gives the same bytes.


def drawn() -> Figure:
    with column(2.0) as figure:
        figure.add_subplot().plot([0, 1], [0, 2], label="μ")
    return figure


@pytest.mark.parametrize("form", FORMATS)
def test_the_same_drawing_is_the_same_file(form: str) -> None:
    first = image(drawn(), form)
    assert first == image(drawn(), form)
    assert first.startswith({"pdf": b"%PDF", "svg": b"<?xml", "png": b"\x89PNG"}[form])


def crowded() -> Figure:
    """A drawing whose layout has all to find room for: long labels, a colour bar, a legend outside, two panels."""
    with column(2.4, 4.0) as figure:
        left, right = figure.subplots(1, 2)
        left.loglog([1, 1e4], [1e-6, 2.0], label="μ")
        left.set_ylabel("a label of some length")
        figure.colorbar(right.pcolormesh(np.arange(6.0).reshape(2, 3)), ax=[left, right])
        figure.legend(loc="outside upper center")
        figure.supxlabel("$L_x$")
    return figure


@pytest.mark.parametrize("form", FORMATS)
def test_a_picture_is_laid_out_as_by_matplotlib_and_drawn_once(form: str) -> None:
    class Counted(Line2D):
        drawn = 0

        def draw(self, renderer: Any) -> None:
            Counted.drawn += 1
            super().draw(renderer)

    theirs, ours = crowded(), crowded()
    dpi = 200 if form == "png" else "figure"
    with mpl.rc_context(canvas._LOOK):  # ticks that only come as it is printed
        theirs.savefig(io.BytesIO(), format=form, dpi=dpi)
    ours.axes[0].add_line(Counted([1, 1e4], [1e-3, 1e-3]))
    engine = ours.get_layout_engine()
    image(ours, form)
    assert Counted.drawn == 1
    assert (ours.get_layout_engine(), ours.dpi) == (engine, theirs.dpi)  # ready for another format
    for mine, its in zip(ours.axes, theirs.axes, strict=True):
        # The same computation; the line in the middle asks for no room.
        np.testing.assert_array_equal(mine.get_position().bounds, its.get_position().bounds)


@pytest.mark.parametrize("name", ["a.svg", "a.SVG", "a.b.Svg"])
def test_an_ending_means_a_format_in_large_letters_too(name: str) -> None:
    assert format_of(Path(name)) == "svg"


@pytest.mark.parametrize("name", ["svg", "a.", "a.jpg", "a.svg.gz", ".svg"])
def test_a_name_without_a_format_is_told_which_there_are(name: str) -> None:
    with pytest.raises(InvalidInput, match=r"needs a name that ends in \.pdf, \.svg, \.png"):
        format_of(Path(name))


def test_a_column_is_85_millimetres() -> None:
    assert drawn().get_figwidth() * 25.4 == pytest.approx(85.0, abs=0.1)


# A claim says mean, scatter and range of starts, and whether the paper's number is among them.

STATED = Stated("slips", 1952, "3.2.1", 0.5)


def test_over_starts_gives_mean_deviation_and_range_and_leaves_out_what_is_missing() -> None:
    assert over_starts(np.array([1.0, 3.0, np.nan]), 3) == "2.0 (s.d. 1.4, 1 to 3)"
    assert over_starts(np.array([2.0, 2.0])) == "2 from every start"
    assert over_starts(np.array([0.002]), scale=1e3) == "2"
    assert over_starts(np.array([np.nan])) == "none"


def test_a_number_is_within_the_range_or_so_many_deviations_off() -> None:
    assert compared(STATED, np.array([1900.0, 1952.4, 1940.0])).remark == "within the range of starts"
    assert compared(STATED, np.array([1900.0, 1902.0])).remark.startswith("36 standard deviations off")
    assert compared(STATED, np.array([0.0, 0.0]), "none can").remark == "differs; none can"
    assert compared(STATED, np.array([1952.0])).remark == "agrees"


def test_a_table_is_markdown_whose_bars_are_escaped() -> None:
    lines = table([Claim("|F|", "1 (§1)", "2")]).splitlines()
    assert lines[0] == "|  | paper | found | remark |"
    assert lines[2] == "| \\|F\\| | 1 (§1) | 2 |  |"
