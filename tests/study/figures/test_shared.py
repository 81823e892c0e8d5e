"""What all figures share: pictures of a journal's width, and claims beside the paper's numbers."""

import io
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import style
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from paper import Stated, compared

from nanoslip.solver.outcome import InvalidInput
from nanoslip.study.figures import shared as canvas
from nanoslip.study.figures.shared import (
    COLORS,
    FORMATS,
    REGIME_COLORS,
    Claim,
    claim_rows,
    column,
    edges,
    file_format,
    image,
    series_styles,
    start_statistics,
    table,
)
from nanoslip.study.report.page import DARK

# A picture has a journal's width in every format, and the same drawing gives the same bytes.


def drawn() -> Figure:
    with column(2.0) as figure:
        figure.add_subplot().plot([0, 1], [0, 2], label="μ")
    return figure


@pytest.mark.slow
@pytest.mark.everyday(1)
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


@pytest.mark.slow
@pytest.mark.everyday(1)
@pytest.mark.parametrize("form", FORMATS)
def test_a_picture_is_laid_out_as_by_matplotlib_and_drawn_once(form: str) -> None:
    class Counted(Line2D):
        drawn = 0

        def draw(self, renderer: Any) -> None:
            Counted.drawn += 1
            super().draw(renderer)

    theirs, ours = crowded(), crowded()
    dpi = 200 if form == "png" else "figure"
    with mpl.rc_context(canvas.FIGURE_SETTINGS):  # ticks that only come as it is printed
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
    assert file_format(Path(name)) == "svg"


@pytest.mark.parametrize("name", ["svg", "a.", "a.jpg", "a.svg.gz", ".svg"])
def test_a_name_without_a_format_is_told_which_there_are(name: str) -> None:
    with pytest.raises(InvalidInput, match=r"\.pdf, \.svg, \.png"):
        file_format(Path(name))


def lightness(color: str) -> float:
    """L* of CIELAB, 0 to 100, of a colour of sRGB."""
    red, green, blue = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(color))
    return float(116.0 * np.cbrt(0.2126 * red + 0.7152 * green + 0.0722 * blue) - 16.0)


@pytest.mark.parametrize(("colors", "paper"), [(COLORS, "#ffffff"), (DARK, "#16181c")])
def test_series_are_told_apart_in_grey(colors: Sequence[str], paper: str) -> None:
    """Lightness differs by 10 or more of every two, and of each from its page by 20; regimes have the same colours."""
    found = sorted(map(lightness, colors))
    assert len(found) == 6
    assert min(np.diff(found)) >= 10.0
    assert min(abs(each - lightness(paper)) for each in found) >= 20.0
    assert set(REGIME_COLORS.values()) < set(COLORS)
    styles = list(islice(series_styles(), 6))
    assert all(len({str(each[key]) for each in styles}) == 6 for key in ("color", "marker", "linestyle"))


def test_what_the_user_has_set_stays(tmp_path: Path) -> None:
    (tmp_path / "mine.mplstyle").write_text(
        "font.size: 12\naxes.prop_cycle: cycler(color=['ff00ff', '00ffff'])\n", "utf-8"
    )
    with style.context(tmp_path / "mine.mplstyle"), column():
        assert (mpl.rcParams["font.size"], mpl.rcParams["axes.titlesize"]) == (12.0, 8.0)
        assert [each["color"] for each in islice(series_styles(), 3)] == ["#ff00ff", "#00ffff", "#ff00ff"]


@pytest.mark.parametrize(
    ("scale", "ends"), [("linear", [-3.5, 5.5, 55.0, 145.0]), ("log", [10**-0.5, 10**0.5, 10**1.5, 10**2.5])]
)
def test_tiles_meet_halfway_on_the_scale_of_their_axis(scale: str, ends: list[float]) -> None:
    axes = Figure().add_subplot()
    axes.set_xscale(scale)
    np.testing.assert_allclose(edges(np.array([1.0, 10.0, 100.0]), axes.xaxis), ends, rtol=1e-12)


def test_a_column_is_85_millimetres() -> None:
    assert drawn().get_figwidth() * 25.4 == pytest.approx(85.0, abs=0.1)


# A claim says mean, scatter and range of starts, and whether the paper's number is among them.

STATED = Stated("slips", 1952, "3.2.1", 0.5)


def test_over_starts_gives_mean_deviation_and_range_and_leaves_out_what_is_missing() -> None:
    assert start_statistics(np.array([1.0, 3.0, np.nan]), 3) == "2.0 (s.d. 1.4, 1 to 3)"
    assert start_statistics(np.array([2.0, 2.0])) == "2 from every start"
    assert start_statistics(np.array([0.002]), scale=1e3) == "2"
    assert start_statistics(np.array([np.nan])) == "in no start"


def test_a_number_is_within_the_range_or_so_much_off() -> None:
    assert compared(STATED, np.array([1900.0, 1952.4, 1940.0])).remark == "within the range of starts"
    assert compared(STATED, np.array([1900.0, 1902.0])).remark.startswith("the paper's is 2.7 % higher")
    assert compared(STATED, np.array([0.0, 0.0]), "none can").remark == "differs; none can"
    assert compared(STATED, np.array([1952.0])).remark == "agrees"


def test_a_table_is_markdown_whose_bars_are_escaped() -> None:
    lines = table([Claim("|F|", "1 (§1)", "2")]).splitlines()
    assert lines[0] == "|  | paper | found |"  # without the column of remarks, as there is none
    assert lines[2] == "| \\|F\\| | 1 (§1) | 2 |"


def test_what_no_claim_has_is_no_column() -> None:
    """A table that ends at a terminal has none of its width for it."""
    assert claim_rows([Claim("a", "", "2")], ("", "", "found", "")) == [("", "found"), ("a", "2")]
