"""Pictures of the model at work: pressure, shear, slip and friction force of a case, event by event."""

import itertools
import os
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.backend_bases import get_registered_canvas_class
from matplotlib.figure import Figure
from numpy.typing import NDArray

from nanoslip.solver.case import Case, Interface
from nanoslip.solver.contact.pin import node_limit
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.drive import Scales
from nanoslip.solver.elasticity.compliance import Compliance, surface_compliance
from nanoslip.solver.load_path import path_extent
from nanoslip.solver.outcome import InvalidInput, Outcome
from nanoslip.solver.sliding.path import Path as LoadingPath, follow
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import find_states, slide
from nanoslip.solver.view import describe_outcome
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import COLORS, FORMATS, column, file_format, image, legend
from nanoslip.study.manifest.parameters import axis_unit
from nanoslip.study.results.store import write_files

# The contact of one case after chosen events, and the record up to there: computed when asked for, kept nowhere.

MOST_FRAMES: Final = 1000
"""Frames that one film may have."""
ROUNDING_OF_SLIPS: Final = 1e-12
"""Share of the largest slip by which a node that sticks may seem to slip."""


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """The contact after one event, or at one turn of a path.

    Arrays are (n,) over the surface nodes; without scales tractions are in W/(L_x·L_y), lengths in L_x.
    """

    event: int
    """Number of the event, or of the turn."""
    x: NDArray[np.float64]
    """Places of the surface nodes."""
    y: NDArray[np.float64]
    """Across the drag; 0 in plane strain."""
    displacement: float
    friction: float
    """F/W, or F in SI."""
    pressure: NDArray[np.float64]
    shear: NDArray[np.float64]
    limit: NDArray[np.float64]
    """μ_i·pressure: the largest shear either way; NaN where μ_i is infinite."""
    slip: NDArray[np.float64]
    """NaN of nodes that are not in contact."""
    slipped: NDArray[np.bool_]
    """Nodes whose slip is another than at the moment before, in contact at both."""


class Unit(NamedTuple):
    """Unit of an axis."""

    factor: float
    """Multiplies numbers of moments and records."""
    label: str


class Units(NamedTuple):
    """Units of axes; the solver's units without scales."""

    x: Unit = Unit(1.0, "x/L_x")
    y: Unit = Unit(1.0, "y/L_x")
    displacement: Unit = Unit(1.0, "pin displacement δ_p/L_x")
    friction: Unit = Unit(1.0, "friction force F/W")
    pressure: Unit = Unit(1.0, "p·L_x·L_y/W")
    shear: Unit = Unit(1.0, "q·L_x·L_y/W")
    traction: Unit = Unit(1.0, "traction·L_x·L_y/W")
    slip: Unit = Unit(1.0, "slip s/L_x")


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """Contents of a case's film."""

    moments: tuple[Moment, ...]
    record: FrictionRecord | LoadingPath
    """Record up to the last of the events, or the whole path."""
    outcome: Outcome
    """Outcome of the last frame, or of the path; if it is not ok, or the record ends early, some requested events are missing."""
    units: Units

    @property
    def planar(self) -> bool:
        """True if the nodes lie on a plane, not in a row."""
        return bool(self.moments[0].y.any())

    @property
    def counted(self) -> str:
        """Name of the numbered moments: event or turn."""
        return "event" if isinstance(self.record, FrictionRecord) else "turn"


def usual_events(case: Case) -> tuple[int, ...]:
    """Events that are drawn if none are given; of a path its first turns."""
    if not case.path:
        return tuple(range(0, 201, 40))
    turns = path_extent(case.path, 1.0)[0]
    return tuple(range(min(turns + 1, MOST_IN_STRIP)))


def parse_events(text: str) -> tuple[int, ...]:
    """Numbers of events from `first:last:step`, both ends included, or from a list as `0,5,12`. Raises InvalidInput."""
    events: Sequence[int] = ()
    with suppress(ValueError, TypeError):
        if ":" in text:
            first, last, *step = map(int, text.split(":"))
            events = range(first, last + 1, *step)
        else:
            events = sorted(set(map(int, text.split(","))))
    # Ends of a range are compared, not its length: `5:0:-1` falls, and is no list of rising events.
    if not events or events[0] < 0 or events[-1] < events[0] or len(events) > MOST_FRAMES:
        allowed = f"first:last:step, as 0:200:10, or a list, as 0,5,12; from 0 on, at most {MOST_FRAMES} of them"
        raise InvalidInput(f"events = {text}: needs {allowed}")
    return tuple(events)


def event_moments(case: Case, events: Sequence[int], scales: Scales | None = None) -> Moments:
    """The contact of a case after each of these events, as far as its record gets; of a case with a path at these turns.

    events: increasing numbers; 0 is initial contact. Of an interface it is the first contact, by itself. scales: for axes in SI.
    Raises InvalidInput for a case without friction, and where there is no contact to begin with.
    """
    case = replace(case, interface=Interface())
    compliance = surface_compliance(case.slab)
    path = None
    if case.path:
        states, path = _contacts_at_turns(case, compliance, events)
        outcome = path.outcome
    else:
        states, outcome = find_states(case, compliance, events)
    if not states and outcome.ok:
        raise InvalidInput(f"no event {events[0]}: the record ends before")
    if not states:
        raise InvalidInput(f"no contact after event {events[0]}: {describe_outcome(outcome)}")
    last = events[len(states) - 1]
    # A record up to the last picture: the rest of it would be computed and not drawn.
    to_last = replace(case, max_events=max(last, 1))
    record = path or slide(to_last, compliance)
    triples = zip(events, [None, *states], states, strict=False)
    moments = [_moment(event, before, state, case) for event, before, state in triples]
    units = _si_units(moments, case.normal_load, scales) if scales else Units()
    scaled = tuple(_scale_moment(moment, units) for moment in moments)
    return Moments(scaled, record, outcome, units)


def _scale_moment(moment: Moment, units: Units) -> Moment:
    """A moment in other units than the solver's."""
    factors = {name: unit.factor for name, unit in units._asdict().items()}
    # The limit is a traction and has no axis of its own; all other units have the names of fields.
    limit = factors.pop("traction") * moment.limit
    sizes = {name: factor * getattr(moment, name) for name, factor in factors.items()}
    return replace(moment, **sizes, limit=limit)


def _si_units(moments: Sequence[Moment], normal_load: float, scales: Scales) -> Units:
    """Units of axes in SI, with prefixes that suit the largest numbers."""
    width, load = scales.slab_width, normal_load * scales.force
    traction = load / (width * scales.slab_depth)
    # Axes end beside the contact: places of nodes far away must not choose the prefix.
    in_contact = [moment.x[moment.pressure > 0.0] for moment in moments]
    place = _si_unit(width, "m", in_contact)
    way = _si_unit(width, "m", [moment.displacement for moment in moments])
    force = _si_unit(load, "N", [moment.friction for moment in moments])
    stress = _si_unit(traction, "Pa", [moment.pressure for moment in moments])
    slip = _si_unit(width, "m", [moment.slip for moment in moments])
    return Units(
        x=_label_unit("x", place),
        y=_label_unit("y", place),
        displacement=_label_unit("pin displacement δ_p", way),
        friction=_label_unit("friction force F", force),
        pressure=_label_unit("pressure p", stress),
        shear=_label_unit("shear q", stress),
        traction=_label_unit("traction", stress),
        slip=_label_unit("slip s", slip),
    )


def _si_unit(scale: float, symbol: str, values: Iterable[Any]) -> Unit:
    """The unit in SI, with its prefix, of numbers in units of `scale`."""
    sizes = [np.abs(numbers) for numbers in values]
    largest = max(float(np.nanmax(size)) for size in sizes)
    factor, prefixed = axis_unit(scale * largest, symbol)
    return Unit(scale * factor, prefixed)


def _label_unit(name: str, unit: Unit) -> Unit:
    """The unit of an axis, labelled with what runs along it."""
    return Unit(unit.factor, f"{name} ({unit.label})")


def _contacts_at_turns(
    case: Case, compliance: Compliance, turns: Sequence[int]
) -> tuple[list[ContactState], LoadingPath]:
    """The contact at each of these turns that the path of a case reaches, and the path."""
    states: list[ContactState] = []
    wanted, numbers = set(turns), itertools.count()

    def keep_event(state: ContactState) -> None:
        # Turn 0 is initial contact, with which every path begins.
        if next(numbers) in wanted:
            states.append(state)

    path = follow(case, compliance, keep_event)
    return states, path


def _moment(event: int, before: ContactState | None, now: ContactState, case: Case) -> Moment:
    share = 1.0 / case.normal_load
    in_contact = node_limit(case, 1.0, now.pressure, now.first_node)
    limit = np.where(now.contact, in_contact, 0.0)
    # An infinite μ_i limits nothing: no band is drawn for it.
    is_unlimited = np.isinf(case.intrinsic_friction)
    finite_limit = np.where(is_unlimited, np.nan, limit)
    slipped = _moving_nodes(before, now) if before else np.zeros_like(now.contact)
    return Moment(
        event=event,
        x=now.x,
        y=now.y,
        displacement=now.displacement,
        friction=share * now.friction_force,
        pressure=share * now.pressure,
        shear=share * now.shear,
        limit=share * finite_limit,
        slip=np.where(now.contact, now.slip, np.nan),
        slipped=slipped,
    )


def _moving_nodes(before: ContactState, now: ContactState) -> NDArray[np.bool_]:
    """Mask of nodes in contact at two moments whose slip is not the same at both."""
    # Where the nodes move along with the pin, arrays begin at another node of the surface.
    ahead = now.first_node - before.first_node
    slip = np.roll(before.slip, -ahead)
    contact = np.roll(before.contact, -ahead)
    largest = max(np.abs(now.slip).max(), now.displacement)
    moved = np.abs(now.slip - slip) > ROUNDING_OF_SLIPS * largest
    return np.asarray(now.contact & contact & moved)


# One moment on axes, and several of them as a strip: pressure within its friction limits, shear, slip, and F/W.

MOST_IN_STRIP: Final = 10
"""Moments side by side, so that each is wide enough to be read."""
PRESSURE, SHEAR, MARK = COLORS[:3]


def strip(shown: Moments) -> Figure:
    """Moments side by side, maps of planes; below them the record, where each of them is a numbered point."""
    count = len(shown.moments)
    ratios: tuple[float, ...] = (1.0, 0.6, 0.8)
    height, beside = 4.2, 0.6
    if shown.planar:
        ratios = (1.0, 1.0, 1.0, 0.9)
        height, beside = 6.0, 0.9
    with column(height, max(3.35, beside + 1.35 * count)) as figure:
        grid = figure.add_gridspec(len(ratios), count, height_ratios=ratios)
        for number, moment in enumerate(shown.moments):
            rows = range(len(ratios) - 1)
            panels = [figure.add_subplot(grid[row, number]) for row in rows]
            maps = _draw_panels(panels, shown, moment)
            if number > 0:
                _hide_labels(panels)
        # One scale beside the last column holds for all columns.
        for axes, (colors, label) in zip(panels, maps, strict=False):
            figure.colorbar(colors, ax=axes, label=label)
        legend(figure)
        below = figure.add_subplot(grid[-1, :])
        _draw_record(below, shown, shown.moments)
    return figure


def _draw_panels(panels: Sequence[Any], shown: Moments, moment: Moment) -> list[tuple[Any, str]]:
    """Draw one moment of a strip. Returns the maps with their labels; a row of nodes has no maps."""
    if not shown.planar:
        upper, lower = panels
        _draw_contact(upper, lower, shown, moment)
        return []
    maps = _draw_maps(panels, shown, moment)
    panels[0].set_title(f"{shown.counted} {moment.event}")
    return maps


def _hide_labels(panels: Iterable[Any]) -> None:
    """Hide the upright labels of panels that have the same axis as their neighbour on the left."""
    for axes in panels:
        axes.set(ylabel="", yticklabels=[])
        axes.yaxis.get_offset_text().set_visible(False)


def draw_frame(figure: Figure, shown: Moments, moment: Moment) -> None:
    """Draw one moment of a film on an empty figure: the contact, and beside it the record with a point that moves."""
    if shown.planar:
        grid = figure.add_gridspec(2, 3)
        maps = [figure.add_subplot(grid[0, place]) for place in range(3)]
        _draw_maps(maps, shown, moment, titles=True)
        below = figure.add_subplot(grid[1, :])
        _draw_record(below, shown, (moment,))
        return
    grid = figure.add_gridspec(2, 2, height_ratios=(1.0, 0.6))
    upper = figure.add_subplot(grid[0, 0])
    lower = figure.add_subplot(grid[1, 0])
    _draw_contact(upper, lower, shown, moment)
    beside = figure.add_subplot(grid[:, 1])
    _draw_record(beside, shown, (moment,))
    legend(figure)


def _draw_maps(maps: Sequence[Any], shown: Moments, moment: Moment, titles: bool = False) -> list[tuple[Any, str]]:
    """Pressure, shear and slip over x and y on three axes; nodes that slipped since the moment before are marked.

    Returns the drawn artists, each with its label.
    """
    meshes = []
    # Nodes come column by column: those with the x of the first one are a column.
    rows = int(np.count_nonzero(moment.x == moment.x[0]))
    units = shown.units
    slipped_x = moment.x[moment.slipped]
    slipped_y = moment.y[moment.slipped]
    in_contact = moment.pressure > 0.0
    along, across = _span(shown), _span(shown, across=True)
    for axes, name in zip(maps, MAPS, strict=True):
        label = typeset(getattr(units, name).label)
        values = np.where(in_contact, getattr(moment, name), np.nan)
        arrays = (moment.x, moment.y, values)
        columns = [array.reshape(-1, rows).T for array in arrays]
        x, y, colors = columns
        # Colours of all pictures mean the same, so their range is that of all moments.
        low, high = _range(getattr(other, name) for other in shown.moments)
        mesh = axes.pcolormesh(x, y, colors, vmin=low, vmax=high, shading="nearest")
        meshes.append((mesh, label))
        axes.plot(slipped_x, slipped_y, ".", color=MARK, markersize=1.5)
        axes.set(aspect="equal", xlim=along, ylim=across)
        lowest = titles or axes is maps[-1]
        x_label = typeset(units.x.label) if lowest else ""
        axes.set(xlabel=x_label, ylabel=typeset(units.y.label))
        if titles:
            axes.set_title(label)
    return meshes


MAPS: Final = ("pressure", "shear", "slip")
"""Fields of a moment that are drawn over x and y."""


def _draw_contact(upper: Any, lower: Any, shown: Moments, moment: Moment) -> None:
    """Tractions with the limits ±μ_i·p of shear, and slips; nodes that slipped since the moment before are marked."""
    x, units = moment.x, shown.units
    limit, slipped = moment.limit, moment.slipped
    line: dict[str, Any] = {"marker": ".", "markersize": 2.0}
    mark: dict[str, Any] = {"color": MARK, "markersize": 2.5, "label": "slipped since the picture before"}
    band: dict[str, Any] = {"color": SHEAR, "alpha": 0.15, "linewidth": 0.0}
    upper.fill_between(x, -limit, limit, label=typeset("±μ_i·p"), **band)
    upper.plot(x, moment.pressure, color=PRESSURE, label="pressure p", **line)
    upper.plot(x, moment.shear, color=SHEAR, label="shear q", **line)
    for axes, values in ((upper, moment.shear), (lower, moment.slip)):
        axes.plot(x[slipped], values[slipped], "v", **mark)
        axes.set_xlim(_span(shown))
    title = f"{shown.counted} {moment.event}"
    traction = typeset(units.traction.label)
    upper.set(title=title, ylabel=traction, xticklabels=[])
    # Axes of all pictures have the same range, so that contacts can be compared by eye.
    tractions: list[NDArray[np.float64]] = []
    for other in shown.moments:
        tractions += [other.pressure, other.shear, other.limit, -other.limit]
    upper.set_ylim(_range(tractions))
    lower.set_ylim(_range(other.slip for other in shown.moments))
    along = typeset(units.x.label)
    upward = typeset(units.slip.label)
    lower.set(xlabel=along, ylabel=upward)
    lower.ticklabel_format(axis="y", scilimits=(-2, 4))


def _draw_record(axes: Any, shown: Moments, marked: tuple[Moment, ...]) -> None:
    moved, friction = shown.units.displacement, shown.units.friction
    # Drawn as the solver draws it in its own units; then converted to these.
    shown.record.plot(axes)
    line = axes.lines[0]
    x = moved.factor * line.get_xdata()
    y = friction.factor * line.get_ydata()
    line.set(xdata=x, ydata=y, color=COLORS[-1])
    axes.relim()
    axes.autoscale_view()
    along, upward = typeset(moved.label), typeset(friction.label)
    axes.set(xlabel=along, ylabel=upward)
    axes.ticklabel_format(axis="x", scilimits=(-2, 4))
    # The limits are fixed before points are drawn: a point moves no axis.
    axes.set(xlim=axes.get_xlim(), ylim=axes.get_ylim())
    displacements = [moment.displacement for moment in marked]
    forces = [moment.friction for moment in marked]
    axes.plot(displacements, forces, "o", color=SHEAR, markersize=3.5)
    if len(marked) > 1:
        _number_moments(axes, marked)


def _number_moments(axes: Any, marked: tuple[Moment, ...]) -> None:
    """Write the numbers of moments below their points, once at each place: a path turns at the same ones."""
    groups: dict[str, list[Moment]] = {}
    for moment in marked:
        # To six digits, as the same turn of a later cycle may differ by rounding.
        groups.setdefault(f"{moment.displacement:.6g}", []).append(moment)
    for moments in groups.values():
        text = ", ".join(str(moment.event) for moment in moments)
        place = moments[0].displacement, moments[0].friction
        # In points, so that the number is clear of its point at any scale.
        below = (3, -8)
        axes.annotate(text, place, below, textcoords="offset points", fontsize=6.0)


def _span(shown: Moments, across: bool = False) -> tuple[float, float]:
    """The part of the surface, along or across the drag, that is ever in contact, and a little on either side."""
    places = [moment.y if across else moment.x for moment in shown.moments]
    masks = [moment.pressure > 0.0 for moment in shown.moments]
    pairs = zip(places, masks, strict=True)
    touching = np.concatenate([place[mask] for place, mask in pairs])
    first, last = touching.min(), touching.max()
    steps = np.diff(np.unique(places[0]))
    spacing = float(steps.min())
    # Two spacings more than a share of the width: a contact of one node has no width.
    margin = 0.1 * (last - first) + 2.0 * spacing
    return float(first - margin), float(last + margin)


def _range(parts: Iterable[NDArray[np.float64]]) -> tuple[float, float]:
    """Room for all of these arrays."""
    values = np.concatenate(list(parts))
    low = float(np.nanmin(values))
    high = float(np.nanmax(values))
    # Without a margin an axis of equal numbers would have no length.
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin


# The contact after several events as a file: a strip (PNG, PDF, SVG) or a film (GIF, MP4), as its suffix says.

FILMS: Final[dict[str, Any]] = {"gif": PillowWriter, "mp4": FFMpegWriter}
"""Suffix of a film -> its writer."""
FRAMES_PER_SECOND: Final = 5
FILM_RESOLUTION: Final = 120
"""Resolution of films, in dots per inch."""


def frames(
    case: Case, events: str | Iterable[int], path: str | os.PathLike[str], scales: Scales | None = None
) -> Moments:
    """Draw a case after each of some events into a file: pressure, shear, slip, and where in the friction record that is.

    events: numbers (0 is initial contact), or text, as `0:200:40` or `0,5,12`; events beyond the record are omitted. Of a case
    with a path they are turns.
    path: .png, .pdf, .svg for a strip; .gif, .mp4 for a film. scales: for axes in SI. Returns the frames.
    Raises InvalidInput for events, a case or a suffix that cannot be drawn, StoreError if the file cannot be written.

    >>> import nanoslip
    >>> nanoslip.frames(nanoslip.Case(), "0:200:40", "strip.png").outcome.ok  # doctest: +SKIP
    True
    """
    numbers = parse_events(events) if isinstance(events, str) else set(events)
    wanted = tuple(sorted(numbers))
    # A wrong suffix is refused before minutes of computation, not after them.
    suffix = _suffix(Path(path), len(wanted))
    shown = event_moments(case, wanted, scales)
    is_film = suffix in FILMS
    content = _film(shown, suffix) if is_film else image(strip(shown), suffix)
    write_files({Path(path): content})
    return shown


def _suffix(path: Path, count: int) -> str:
    """Format of a file with this number of pictures. Raises InvalidInput if there is none, or no writer for it."""
    suffix = file_format(path, (*FORMATS, *FILMS))
    if suffix in FILMS and not FILMS[suffix].isAvailable():
        raise InvalidInput(f"{path}: needs the program ffmpeg, which is not found here; install it, or take .gif")
    if suffix in FORMATS and count > MOST_IN_STRIP:
        raise InvalidInput(f"{path}: {count} events: a strip holds at most {MOST_IN_STRIP}; a .gif or .mp4 holds more")
    return suffix


def _film(shown: Moments, suffix: str) -> bytes:
    """The moments one after the other, on axes with the same limits."""
    writer = FILMS[suffix](fps=FRAMES_PER_SECOND)
    with TemporaryDirectory() as folder, column(3.0, 6.0) as figure:
        # Without a window a figure has no canvas that pictures could be grabbed from.
        get_registered_canvas_class("png")(figure)
        # The writer of MP4 hands a path to ffmpeg: the film is a file first, and only a whole one gets its place.
        film = Path(folder) / f"film.{suffix}"
        with writer.saving(figure, str(film), FILM_RESOLUTION):
            for moment in shown.moments:
                figure.clear()
                draw_frame(figure, shown, moment)
                writer.grab_frame()
        return film.read_bytes()
