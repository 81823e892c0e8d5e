"""A path of pin displacement and load: strokes, loads to visit or straight legs, as a case prescribes them; and its numbers."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.outcome import ABSENT, InvalidInput
from nanoslip.solver.parameter import (
    ENERGY,
    OVER_LOAD,
    Numbers,
    Quantity,
    Roughness,
    parameter,
    quantity,
    require,
    validate,
)

Point = tuple[float, float]
"""δ_p in L_x, and load in G·L_x·L_y."""

FARTHEST = 1e6
"""Longest way in presliding lengths or L_x, and largest load over W: no slab is as large."""
LEAST_LOAD = 1e-6
"""Smallest load over W: forces are accurate to 1e-12 of the larger load of a leg."""


def _way(meaning: str, **more: Any) -> Any:
    """A parameter that is a length along the path, 0 by default."""
    return parameter(0.0, meaning=meaning, least=0.0, most=FARTHEST, **more)


@dataclass(frozen=True, slots=True)
class LoadPath:
    """Path of pin and load after initial contact; empty by default: a record in one direction at one load.

    First the pin slides by `slid`, then the load visits `visited_loads` while the pin rests, then the pin goes forward and back
    `cycles` times. Or it visits the points `legs` along straight lines.
    """

    TABLE: ClassVar[str] = "path"
    amplitude: float = _way(
        "amplitude",
        comment="of cycles about their middle; one presliding length is μ_i·W/K",
        need='0 to 1e6 presliding lengths; a length as "2 um" is half of a stroke',
        measure="presliding lengths",
    )
    stroke: float = _way(
        "stroke",
        comment="of cycles, end to end: twice their amplitude",
        scale="slab_width",
        note=" (L_x)",
        measure="L_x",
    )
    cycles: int = parameter(6, meaning="cycles forward and back", least=1, most=10**6)
    slid: float = _way(
        "way before cycles", comment="one is μ_i·W/K", note=" (presliding lengths)", measure="presliding lengths"
    )
    visited_loads: Numbers = parameter(
        (),
        word="load",
        meaning="loads visited before the cycles",
        comment="over normal_load, while the pin rests",
        listed=True,
        least=LEAST_LOAD,
        most=FARTHEST,
        need='a list, 1e-6 to 1e6 times normal_load, or as ["80 N"]',
    )
    legs: Roughness = parameter(
        (),
        meaning="points of displacement and load to visit",
        comment="in L_x and over normal_load, or with units in the header",
        columns=("displacement", "load"),
        least=-FARTHEST,
        most=FARTHEST,
        need="displacements up to 1e6 L_x, loads 1e-6 to 1e6 times normal_load",
    )

    def __post_init__(self) -> None:
        validate(self)
        if self.amplitude and self.stroke:
            raise InvalidInput("amplitude", self.amplitude, "one of them", {"stroke": self.stroke})
        ways = ("amplitude", "stroke", "slid", "visited_loads")
        ways_stated = {name: getattr(self, name) for name in ways if getattr(self, name)}
        if self.legs and ways_stated:
            raise InvalidInput("legs", ABSENT, "one or the other", ways_stated)
        require("legs", self.legs, not self.legs or len(self.legs[0]) == 2, "pairs of displacement and load")
        for _, load in self.legs:
            require("legs", load, load >= LEAST_LOAD, f"loads ≥ {LEAST_LOAD:g}, over normal_load")

    def __bool__(self) -> bool:
        return any((self.amplitude, self.stroke, self.slid, self.visited_loads, self.legs))

    @property
    def cyclic(self) -> bool:
        """True if it ends in cycles."""
        return bool(self.amplitude or self.stroke)

    @property
    def presliding(self) -> bool:
        """True if its displacements are in presliding lengths."""
        return bool(self.amplitude or self.slid)

    @property
    def loads_change(self) -> bool:
        """True if the load changes from the case's load."""
        return any(load != 1.0 for load in (*self.visited_loads, *(load for _, load in self.legs)))

    def points(self, normal_load: float, presliding_length: float, cycles: int | None = None) -> Iterator[Point]:
        """The points where legs end, in their order. presliding_length: in L_x, of the contact before it slides.

        cycles: number of them, if not all.
        """
        # Legs stand alone: with them there is neither a way, nor a load, nor a cycle below.
        yield from ((displacement, load * normal_load) for displacement, load in self.legs)
        middle, load = self.slid * presliding_length if self.slid else 0.0, normal_load
        if self.slid:
            yield middle, load
        for load in (share * normal_load for share in self.visited_loads):
            yield middle, load
        if self.cyclic:
            # A stroke is measured from turn to turn, an amplitude from the middle to a turn.
            reach = self.stroke / 2.0 or self.amplitude * presliding_length
            yield middle + reach, load
            for _ in range(self.cycles if cycles is None else cycles):
                yield from ((middle - reach, load), (middle + reach, load))


def path_extent(path: LoadPath, presliding_length: float) -> tuple[int, float, float]:
    """Legs of a path, the way of its pin, and how far it goes from where it came down, both in L_x."""
    shown = min(path.cycles, 1) if path.cyclic else 0
    places = [0.0, *(place for place, _ in path.points(1.0, presliding_length, shown))]
    steps = [abs(then - now) for now, then in itertools.pairwise(places)]
    # Cycles after the first are all alike, two legs each: one is enough to know the way.
    again = path.cycles - shown if path.cyclic else 0
    way = sum(steps) + again * sum(steps[-2:])
    return len(steps) + 2 * again, way, max(map(abs, places))


def _stiffness(meaning: str, comment: str) -> Any:
    """Declare a stiffness of the contact."""
    si = Quantity("", meaning, "N m-1", "stiffness")
    return quantity(meaning, ensemble=True, shared="nodes", comment=comment, si=si, measure="G·L_y")


@dataclass(frozen=True, slots=True)
class Loops:
    """Numbers of the cycles with which a path ends; NaN without any. F/W: over the load of the cycles."""

    cycle_amplitude: float = quantity(
        "amplitude",
        ensemble=True,
        comment="of the cycles, from their middle to either side; one length is μ_i·W/K",
        measure="presliding lengths",
    )
    cycle_stroke: float = quantity(
        "stroke",
        ensemble=True,
        comment="of the cycles, end to end: twice their amplitude",
        si=Quantity("", "stroke", "m", "length"),
        measure="L_x",
    )
    loss_per_cycle: float = quantity(
        "energy lost in a cycle", ensemble=True, comment="mean over the later half of the cycles", **ENERGY
    )
    first_loss: float = quantity("energy lost in the first cycle", ensemble=True, **ENERGY)
    turn_friction: float = quantity(
        "F/W at the turns",
        symbol="F/W",
        ensemble=True,
        comment="half of the difference between both ends of a leg, mean over the later half of the cycles",
    )
    secant_stiffness: float = _stiffness(
        "secant stiffness of a cycle",
        "difference of friction force between both ends of a leg over that of displacement",
    )
    closure: float = quantity(
        "gap of F/W between the last two cycles",
        ensemble=True,
        comment="the largest one, at one displacement; 0 of a loop that closes",
    )
    shaken_down: float = quantity(
        "elastic shakedown of the cycles",
        ensemble=True,
        comment="1 if the last cycle loses less than a millionth of the elastic energy at a turn, else 0",
    )
    equivalent_damping: float = quantity(
        "equivalent damping ratio",
        symbol="ζ_e",
        ensemble=True,
        comment="loss_per_cycle over 4π times the elastic energy at a turn, ½·F·amplitude; NaN where friction there is 0",
    )
    path_stiffness: float = _stiffness("stiffness before the path", "dF/dδ_p of the contact with all nodes stuck")


FORCE: Final = OVER_LOAD | {"comment": "W: normal_load of the case"}
"""A friction force along a path."""


def leg_column(meaning: str, name: str, **more: Any) -> Any:
    """Declare a column over the legs of a path. name: the part after `leg_`."""
    return quantity(meaning, f"leg_{name}", along="turn", **more)


@dataclass(frozen=True, slots=True, eq=False)
class Turns:
    """Numbers of each leg of a path, (legs,), which begins at a turn and ends at the next."""

    direction: NDArray[np.int8] = leg_column(
        "direction of the leg", "direction", dtype=np.int8, comment="1 to the right, -1 to the left"
    )
    begin: Floats = leg_column("displacement at its begin", "begin", symbol="δ_p/L_x", measure="L_x")
    end: Floats = leg_column("displacement at its end", "end", symbol="δ_p/L_x", measure="L_x")
    first_load: Floats = leg_column("load at its begin, over normal_load", "first_load", per="normal_load")
    last_load: Floats = leg_column("load at its end, over normal_load", "last_load", per="normal_load")
    first_force: Floats = leg_column("F/W at its begin", "first_friction", **FORCE)
    last_force: Floats = leg_column("F/W at its end", "last_friction", **FORCE)
    lost: Floats = leg_column("energy lost on the leg", "loss", **ENERGY)
    load_work: Floats = leg_column("work of the load", "load_work", **ENERGY)
    events: NDArray[np.int64] = leg_column("events of the leg", "events", dtype=np.int64)
    slips: NDArray[np.int64] = leg_column("node slips of the leg", "slips", dtype=np.int64)


def line_column(meaning: str, name: str, **more: Any) -> Any:
    """Declare a column over the points of a path's line. name: the part after `path_`."""
    return quantity(meaning, f"path_{name}", along="path_point", **more)


@dataclass(frozen=True, slots=True, eq=False)
class PathLine:
    """Friction force over displacement along all legs, (points,): ends of legs, and before and after each event."""

    displacement: Floats = line_column(
        "pin displacement", "displacement", symbol="δ_p/L_x", coordinate=True, measure="L_x"
    )
    force: Floats = line_column("F/W along the path", "friction", **FORCE)
    load: Floats = line_column("load along the path, over normal_load", "load", per="normal_load")
    leg: NDArray[np.int32] = line_column("leg of the path", "leg", dtype=np.int32, comment="from 0")
