"""A layout counts the nodes that it has: what it says of a contact is what counting its nodes gives."""

import math

import numpy as np
import pytest

from nanoslip.solver.contact.closed_forms import smooth_contact
from nanoslip.solver.layout import Layout, Plane, Row
from nanoslip.solver.slab import SCHEMES, Slab

LAYOUTS = [Row(65), Row(65, 0.5), Plane(33)]


def nodes_in(layout: Layout, half_width: float, start: float = 0.0) -> int:
    """Nodes within a half-width of the point `start` spacings from the middle."""
    away = np.hypot(layout.x() - start * layout.spacing, layout.y)
    return int((away <= half_width).sum())


@pytest.mark.parametrize("layout", LAYOUTS, ids=str)
def test_nodes_share_the_surface(layout: Layout) -> None:
    """Each has the area between it and its neighbours; end nodes that have half of it leave just L_x."""
    assert len(layout.x()) == len(layout.y) == len(layout.areas) == layout.nodes == layout.n_x * layout.rows
    assert np.diff(np.unique(layout.x())) == pytest.approx(layout.spacing, rel=1e-12)
    assert layout.areas[1:-1] == pytest.approx(layout.node_area, rel=1e-15)
    assert layout.node_area == pytest.approx(layout.spacing * layout.node_depth, rel=1e-15)
    if layout.end_share == 0.5:
        assert layout.areas.sum() == pytest.approx(1.0, rel=1e-15)


@pytest.mark.parametrize("half_width", [0.051, 0.13, 0.22])
@pytest.mark.parametrize("start", [0.0, 0.3])
def test_a_row_holds_the_nodes_that_are_counted(half_width: float, start: float) -> None:
    row = Row(65)
    assert row.count_nodes(half_width, start=start) == nodes_in(row, half_width, start)
    fewest = min(nodes_in(row, half_width, place) for place in np.linspace(0.0, 1.0, 101))
    assert row.fewest_nodes(half_width, 0.0) == fewest


@pytest.mark.parametrize("half_width", [0.13, 0.22, 0.31])
def test_a_plane_holds_as_many_nodes_as_its_disc_has_area(half_width: float) -> None:
    """To within the nodes of its circumference, over which discs differ by chance (Gauss's circle problem)."""
    plane = Plane(65)
    counted = nodes_in(plane, half_width)
    assert plane.count_nodes(half_width) == pytest.approx(counted, abs=0.25 * plane.edge_nodes(half_width))
    assert plane.contact_width(counted) == pytest.approx(2.0 * half_width, rel=0.02)
    across = 2.0 * half_width / plane.spacing
    assert plane.nodes_of_width(across) * plane.node_area == pytest.approx(plane.contact_area(half_width), rel=1e-12)


@pytest.mark.parametrize("layout", LAYOUTS, ids=str)
def test_rows_follow_each_other_with_a_gap(layout: Layout) -> None:
    """Joined row after row, no two nodes are neighbours that are none on the surface."""
    joined = layout.join_rows(layout.x() + 1.0)
    steps = np.diff(joined)
    assert np.all((np.abs(steps - layout.spacing) < 1e-12) | (joined[1:] == 0.0) | (joined[:-1] == 0.0))
    assert np.count_nonzero(joined) == layout.nodes


@pytest.mark.parametrize("layout", LAYOUTS, ids=str)
def test_a_node_keeps_its_random_number_when_the_grid_goes_on(layout: Layout) -> None:
    """A grid that begins two columns further on has the places of all but the first two columns, in their order."""

    def numbers(first: int) -> list[int]:
        return [begin + place for begin, count in layout.random_stretches(first) for place in range(count)]

    moved = 2 * layout.rows
    assert numbers(moved)[:-moved] == numbers(0)[moved:]
    assert len(set(numbers(0))) == layout.nodes


@pytest.mark.parametrize("name", [name for name, kind in SCHEMES.items() if kind.continuum])
def test_hertz_s_load_has_hertz_s_half_width(name: str) -> None:
    """On any surface; the largest pressure of an ellipse is that many times its mean, 4/π of a line, 3/2 of a point."""
    layout = Slab(17, scheme=name).layout
    contact = smooth_contact(type(layout))
    load = contact.hertz_load(0.1, 20.0, 0.3)
    assert contact.hertz(load, 20.0, 0.3) == pytest.approx(0.1, rel=1e-12)
    mean = 1.0 / layout.contact_area(0.1)
    peaks = {Row: 4.0 / math.pi, Plane: 1.5}
    assert contact.hertz_pressure(0.1) == pytest.approx(peaks[type(layout)] * mean, rel=1e-12)
    # Boussinesq: the middle of a punch bears 2/π of the mean of a line, half of a point contact's.
    middles = {Row: 2.0 / math.pi, Plane: 0.5}
    assert contact.punch_pressure(0.1) == pytest.approx(middles[type(layout)] * mean, rel=1e-12)


@pytest.mark.parametrize("name", [name for name, kind in SCHEMES.items() if kind.IN_PLANE_STRAIN])
def test_a_body_in_plane_strain_has_a_row(name: str) -> None:
    """And so has it without its bottom: the scheme named has the layout that names it."""
    in_plane_strain = SCHEMES[SCHEMES[name].IN_PLANE_STRAIN]
    assert in_plane_strain.LAYOUT is Row
    for kind in (SCHEMES[name], in_plane_strain):
        bottomless = SCHEMES[kind.LAYOUT.BOTTOMLESS]
        assert bottomless.LAYOUT is kind.LAYOUT
        assert bottomless.bottomless
