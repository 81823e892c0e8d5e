"""A film has one picture for each moment, all at one scale; a strip has all of them side by side."""

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from nanoslip.solver.outcome import InvalidInput
from nanoslip.study.figures import frames as film
from nanoslip.study.figures.frames import MOST_IN_STRIP, Moments, draw_frame, moments_of, strip
from tests.study.figures.frames.test_moments import CASE


@pytest.fixture(scope="module")
def shown() -> Moments:
    return moments_of(CASE, (0, 10, 20))


def test_a_strip_shows_every_moment_and_where_in_the_record_it_is(shown: Moments) -> None:
    *contacts, record = strip(shown).axes
    assert len(contacts) == 6
    assert [axes.get_title() for axes in contacts[::2]] == ["event 0", "event 10", "event 20"]
    points = record.lines[-1]
    np.testing.assert_array_equal(points.get_xdata(), [moment.displacement for moment in shown.moments])
    assert [text.get_text() for text in record.texts] == ["0", "10", "20"]


def test_subscripts_are_lowered_in_every_text(shown: Moments) -> None:
    film_of_one = Figure()
    draw_frame(film_of_one, shown, shown.moments[0])
    for figure in (strip(shown), film_of_one):
        texts = [text.get_text() for text in figure.findobj(Text)]
        assert any("μ_{i}" in text for text in texts)
        assert [text for text in texts if "_" in re.sub(r"\$[^$]*\$", "", text)] == []


def test_pictures_of_a_film_share_their_scales(shown: Moments) -> None:
    limits = set()
    for moment in shown.moments:
        figure = Figure()
        draw_frame(figure, shown, moment)
        limits.add(tuple((axes.get_xlim(), axes.get_ylim()) for axes in figure.axes))
        pressure = figure.axes[0].lines[0]
        np.testing.assert_array_equal(pressure.get_ydata(), moment.pressure)
    assert len(limits) == 1


def test_a_film_has_a_picture_for_each_moment(tmp_path: Path) -> None:
    film.frames(CASE, "0:20:10", tmp_path / "pin.gif")
    assert [path.name for path in tmp_path.iterdir()] == ["pin.gif"]
    with Image.open(tmp_path / "pin.gif") as found:
        assert found.n_frames == 3
        assert np.ptp(np.asarray(found.convert("L"))) > 100


def test_a_film_in_mp4_needs_ffmpeg(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "pin.mp4"
    if film.FILMS["mp4"].isAvailable():
        film.frames(CASE, (0, 5), path)
        assert path.read_bytes()[4:8] == b"ftyp"
    monkeypatch.setattr(film.FILMS["mp4"], "isAvailable", lambda: False)
    with pytest.raises(InvalidInput, match=r"pin\.mp4: needs the program ffmpeg, .* or take \.gif"):
        film.frames(CASE, (0, 5), path)


def test_what_cannot_be_drawn_is_refused_before_anything_is_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(film, "moments_of", None)
    with pytest.raises(InvalidInput, match=r"pin\.jpg: needs a name that ends in \.pdf, \.svg, \.png, \.gif, \.mp4"):
        film.frames(CASE, (0,), "pin.jpg")
    with pytest.raises(InvalidInput, match=rf"pin\.png: 11 events: a strip holds at most {MOST_IN_STRIP}"):
        film.frames(CASE, range(11), "pin.png")
