"""What a film or a strip shows of a record: its moments, each at the same scale."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from nanoslip.solver.case import Case, Effects
from nanoslip.solver.drive import Scales
from nanoslip.solver.load_path import LoadPath
from nanoslip.solver.outcome import Ending, InvalidInput
from nanoslip.solver.slab import Slab
from nanoslip.study.figures import frames as film
from nanoslip.study.figures.frames import (
    MOST_FRAMES,
    MOST_IN_STRIP,
    Moments,
    draw_frame,
    event_moments,
    parse_events,
    strip,
    usual_events,
)
from nanoslip.study.measured.units import factor

# What a film shows is what the record knows: forces, limits of shear, and which nodes slip in an event.

CASE = Case(intrinsic_friction=0.5, radius=50.0, slab=Slab(n_x=17), max_events=30)


@pytest.fixture(scope="module")
def shown() -> Moments:
    return event_moments(CASE, range(31))


def test_a_moment_lies_on_the_record(shown: Moments) -> None:
    assert [moment.event for moment in shown.moments] == list(range(31))
    after = shown.record.force_after / CASE.normal_load
    places = [moment.displacement for moment in shown.moments[1:]]
    np.testing.assert_allclose(places, shown.record.displacement, rtol=1e-9)
    np.testing.assert_allclose([moment.friction for moment in shown.moments[1:]], after, atol=1e-9)


def test_shear_stays_within_its_limits(shown: Moments) -> None:
    for moment in shown.moments:
        assert np.all(np.abs(moment.shear) <= moment.limit * (1.0 + 1e-9) + 1e-12)
        np.testing.assert_array_equal(moment.limit, 0.5 * moment.pressure)
        assert moment.pressure.sum() * CASE.slab.spacing == pytest.approx(1.0, rel=1e-9)


def test_marked_nodes_are_those_that_slip_in_the_event(shown: Moments) -> None:
    """Those that touch in the event may slip as well; they are not marked, as they were not there before."""
    marked = np.array([moment.slipped.sum() for moment in shown.moments[1:]])
    whole = (shown.record.touches == 0) & (shown.record.releases == 0)
    assert whole.sum() > 10
    np.testing.assert_array_equal(marked[whole], shown.record.extent[whole])
    assert not shown.moments[0].slipped.any()


def test_a_node_that_cannot_slip_has_no_limit() -> None:
    assert np.isnan(
        event_moments(Case(intrinsic_friction=np.inf, radius=50.0, slab=Slab(n_x=17)), (0,)).moments[0].limit
    ).all()


def test_nothing_to_show_is_refused_with_the_reason() -> None:
    steep = Case(normal_load=1.0, radius=0.1, slab=Slab(n_x=17))
    with pytest.raises(InvalidInput, match=f"no contact after event 0: {Ending.STEEP_PIN}: "):
        event_moments(steep, (0,))
    with pytest.raises(InvalidInput, match="no event 9"):
        event_moments(Case(max_events=5, slab=Slab(n_x=17)), (9,))
    with pytest.raises(InvalidInput, match="friction = false"):
        event_moments(Case(effects=Effects(friction=False), slab=Slab(n_x=17)), (0, 5))


def test_events_are_a_range_or_a_list() -> None:
    assert parse_events("0:20:5") == (0, 5, 10, 15, 20)
    assert parse_events("3:5") == (3, 4, 5)
    assert parse_events("12,0,5") == (0, 5, 12)
    assert len(parse_events(f"1:{MOST_FRAMES}")) == MOST_FRAMES


@pytest.mark.parametrize("text", ["", "a", "5:1", "5:1:-1", "-1", "0:5:0", "0:1:2:3", f"0:{10**9}", "1.5", "1,,2"])
def test_other_events_are_refused(text: str) -> None:
    with pytest.raises(InvalidInput, match=r"^events = .*: needs first:last:step"):
        parse_events(text)


SCALES = Scales(slab_width=2e-3, slab_depth=1e-3, shear_modulus=1e6)


def test_with_scales_every_axis_is_in_si(shown: Moments) -> None:
    """Lengths of 2 mm and mm, the load in N, pressures that carry it."""
    si, load = event_moments(CASE, (0, 30), SCALES), CASE.normal_load * SCALES.force
    last, same = si.moments[-1], shown.moments[30]
    bases = {"friction": "N", "pressure": "Pa", "shear": "Pa", "traction": "Pa"}
    named = {name: unit.label.rpartition("(")[2].rstrip(")") for name, unit in si.units._asdict().items()}
    to_si = {name: factor(unit, bases.get(name, "m")) for name, unit in named.items()}
    np.testing.assert_allclose(last.x * to_si["x"], same.x * SCALES.slab_width)
    np.testing.assert_allclose(last.slip * to_si["slip"], same.slip * SCALES.slab_width)
    assert last.friction * to_si["friction"] == pytest.approx(same.friction * load)
    area = CASE.slab.spacing * SCALES.slab_width * SCALES.slab_depth
    assert last.pressure.sum() * to_si["pressure"] * area == pytest.approx(load)
    assert np.all(np.abs(last.shear) <= last.limit * (1.0 + 1e-9))
    *_, record = strip(si).axes
    line, points = record.lines
    assert line.get_xdata()[-1] == pytest.approx(points.get_xdata()[-1])
    assert named["friction"] in record.get_ylabel()


# A film has one picture for each moment, all at one scale; a strip has all of them side by side.


@pytest.fixture(scope="module")
def film_shown() -> Moments:
    return event_moments(CASE, (0, 10, 20))


def test_a_strip_shows_every_moment_and_where_in_the_record_it_is(film_shown: Moments) -> None:
    *contacts, record = strip(film_shown).axes
    assert len(contacts) == 6
    assert [axes.get_title() for axes in contacts[::2]] == ["event 0", "event 10", "event 20"]
    points = record.lines[-1]
    np.testing.assert_array_equal(points.get_xdata(), [moment.displacement for moment in film_shown.moments])
    assert [text.get_text() for text in record.texts] == ["0", "10", "20"]


def test_pictures_of_a_film_share_their_scales(film_shown: Moments) -> None:
    limits = set()
    for moment in film_shown.moments:
        figure = Figure()
        draw_frame(figure, film_shown, moment)
        limits.add(tuple((axes.get_xlim(), axes.get_ylim()) for axes in figure.axes))
        contact, slips, record = (axes.get_position() for axes in figure.axes)
        assert contact.y0 > slips.y1
        assert contact.x1 < record.x0
        assert (slips.x0, slips.x1) == (contact.x0, contact.x1)
        pressure = figure.axes[0].lines[0]
        np.testing.assert_array_equal(pressure.get_ydata(), moment.pressure)
    assert len(limits) == 1


@pytest.mark.slow
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
    with pytest.raises(InvalidInput, match=r"pin\.mp4: .*ffmpeg, .*\.gif"):
        film.frames(CASE, (0, 5), path)


def test_what_cannot_be_drawn_is_refused_before_anything_is_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(film, "event_moments", None)
    with pytest.raises(InvalidInput, match=r"pin\.jpg: .*\.pdf, \.svg, \.png, \.gif, \.mp4"):
        film.frames(CASE, (0,), "pin.jpg")
    with pytest.raises(InvalidInput, match=rf"pin\.png: 11 events: a strip holds at most {MOST_IN_STRIP}"):
        film.frames(CASE, range(11), "pin.png")


@pytest.mark.slow
def test_a_plane_of_nodes_is_drawn_as_maps(tmp_path: Path) -> None:
    """Pressure, shear and slip of each moment over x and y, nodes that slipped marked; strips and films."""
    case = Case(slab=Slab(9, scheme="half_space"), max_events=40)
    shown = event_moments(case, (0, 20, 40))
    assert shown.planar
    axes = strip(shown).axes
    assert len(axes) == 3 * 3 + 3 + 1  # maps, their colors, the record
    meshes = [each.collections[0] for each in axes[:9]]
    assert {mesh.get_array().shape for mesh in meshes} == {(9, 9)}
    there = shown.moments[1].pressure > 0.0
    assert np.count_nonzero(~np.ma.getmaskarray(meshes[3].get_array())) == there.sum()
    assert len(axes[3].lines[0].get_xdata()) == shown.moments[1].slipped.sum() > 0
    film.frames(case, (0, 20), tmp_path / "film.gif")
    assert (tmp_path / "film.gif").stat().st_size > 1000


def test_moments_of_a_path_are_its_turns() -> None:
    """Both ends of the strokes, with the force that the path has there."""
    case = Case(slab=Slab(n_x=17), path=LoadPath(amplitude=2.0, cycles=1))
    shown = event_moments(case, range(9))
    assert [moment.event for moment in shown.moments] == [0, 1, 2, 3]
    assert usual_events(case) == (0, 1, 2, 3)
    places = [moment.displacement for moment in shown.moments]
    assert places == pytest.approx([0.0, places[1], -places[1], places[1]])
    ends = [leg.direction * leg.final_force / case.normal_load for leg in shown.record.legs]
    assert [moment.friction for moment in shown.moments[1:]] == pytest.approx(ends)
    assert strip(shown).axes[0].get_title().split() == ["turn", "0"]
