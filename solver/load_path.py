"""A path of pin displacement and load as a case prescribes it: strokes, loads to visit, or straight legs from point to point."""

from collections.abc import Iterator
from dataclasses import dataclass, fields

from nanoslip.solver.outcome import ABSENT, InvalidInput
from nanoslip.solver.parameter import Numbers, Roughness, check, parameter, require

Point = tuple[float, float]
"""δ_p in L_x, and load in G·L_x·L_y."""

FARTHEST = 1e6
"""Longest way in presliding lengths or L_x, and largest load over W: no slab is as large."""
LEAST_LOAD = 1e-6
"""Smallest load over W: forces are accurate to 1e-12 of the larger load of a leg."""


@dataclass(frozen=True, slots=True)
class LoadPath:
    """Path of pin and load after initial contact; empty by default: a record in one direction at one load.

    First the pin slides by `slid`, then the load visits `loads` while the pin rests, then the pin goes forward and back `cycles`
    times. Or it visits the points `legs` along straight lines.
    """

    amplitude: float = parameter(
        0.0,
        meaning="amplitude of cycles, in presliding lengths",
        least=0.0,
        most=FARTHEST,
        note=" (presliding lengths)",
    )
    stroke: float = parameter(
        0.0, meaning="amplitude of cycles, in L_x", least=0.0, most=FARTHEST, scale="slab_width", note=" (L_x)"
    )
    cycles: int = parameter(6, meaning="cycles forward and back", least=1, most=10**6)
    slid: float = parameter(
        0.0,
        meaning="way before the cycles, in presliding lengths",
        least=0.0,
        most=FARTHEST,
        note=" (presliding lengths)",
    )
    loads: Numbers = parameter(
        (),
        meaning="loads to visit before the cycles, over normal_load",
        columns=("load",),
        least=LEAST_LOAD,
        most=FARTHEST,
    )
    legs: Roughness = parameter(
        (),
        meaning="points (δ_p in L_x, load over normal_load) to visit",
        columns=("displacement", "load"),
        least=-FARTHEST,
        most=FARTHEST,
    )

    def __post_init__(self) -> None:
        check(self)
        if self.amplitude and self.stroke:
            raise InvalidInput("amplitude", self.amplitude, "one of them", {"stroke": self.stroke})
        given = {name: getattr(self, name) for name in ("amplitude", "stroke", "slid", "loads") if getattr(self, name)}
        if self.legs and given:
            raise InvalidInput("legs", ABSENT, "one or the other", given)
        for _, load in self.legs:
            require("legs", load, load >= LEAST_LOAD, f"loads ≥ {LEAST_LOAD:g}, over normal_load")

    def __bool__(self) -> bool:
        return any(getattr(self, item.name) for item in fields(self) if item.name != "cycles")

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
        return any(load != 1.0 for load in self.loads) or any(load != 1.0 for _, load in self.legs)

    def points(self, normal_load: float, presliding_length: float) -> Iterator[Point]:
        """The points where legs end, in their order. presliding_length: in L_x, of the contact before it slides."""
        yield from ((displacement, load * normal_load) for displacement, load in self.legs)
        middle, load = self.slid * presliding_length if self.slid else 0.0, normal_load
        if self.slid:
            yield middle, load
        for load in (each * normal_load for each in self.loads):
            yield middle, load
        if self.cyclic:
            reach = self.stroke or self.amplitude * presliding_length
            yield middle + reach, load
            for _ in range(self.cycles):
                yield from ((middle - reach, load), (middle + reach, load))
