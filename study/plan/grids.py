"""Time and error of each discretization of the slab, as measured."""

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact import closed_forms
from nanoslip.solver.slab import PHYSICS, Slab
from nanoslip.study.manifest import parameters

# Processor time and error of each discretization of the slab, as `nanoslip accuracy` measured them and a file keeps them.
#
# The error of a discretization on a slab under a contact is the largest relative error of the case's deterministic observables:
# the compliance energies of elliptic normal and tangential loads, the lateral stiffness K, the approach, and the half-width and
# largest pressure of frictionless contact. Linear elasticity makes all of them functions of the contact's half-width alone,
# whatever load and radius gave it. Plateaus and friction coefficients are left out, as they are chaotic. Their uncertainty is
# estimated from block means, and is a variable of the dataset.

ALIKE = math.log(1.25)
SHIPPED: Final = Path(__file__).with_name("front.json")
"""The front that comes with this package, measured on the developers' machine."""


@dataclass(frozen=True, slots=True)
class MeasuredGrid:
    """One discretization of one slab, with its measured time and errors."""

    slab: Slab
    seconds: float
    """Processor time in s of the slab's compliance and of a record up to the reference displacement."""
    errors: tuple[float, ...]
    """Relative error with each of the front's contacts, in their order."""


@dataclass(frozen=True, slots=True)
class Front:
    """Time and error of all discretizations that were measured on one machine."""

    name: str
    """Name of its file, for messages."""
    machine: Mapping[str, str]
    """Processor and software of the measurement."""
    contacts: tuple[float, ...]
    """Half-widths a/L_x of the contacts that errors were measured with, by Hertz's formula for a half-plane; increasing."""
    rows: tuple[MeasuredGrid, ...]
    sha256: str = ""
    """SHA-256 of its file."""
    _row_of: dict[Slab, MeasuredGrid] = field(init=False, repr=False, compare=False, default_factory=dict)

    def __post_init__(self) -> None:
        self._row_of.update((row.slab, row) for row in self.rows)

    def expected_error(self, case: Case) -> float:
        """Relative error to expect of a case: the largest that was measured on its slab with contacts about as wide as its own.

        A contact consists of whole nodes, so the error jumps as its width grows. NaN if nothing comparable was measured: a flat
        punch, a rough pin, another discretization or slab, another width.
        """
        return self.worst_error(case.slab, self.comparable(case))

    def comparable(self, case: Case) -> frozenset[int]:
        """Indices of the measured contacts comparable with a case; none if nothing comparable was measured."""
        half_width = hertz_half_width(case)
        measured = case.pin == "parabola" and not case.heterogeneity.roughness
        if not measured or not self.contacts[0] <= half_width <= self.contacts[-1]:
            return frozenset()
        return _about_as_wide(self.contacts, half_width)

    def worst_error(self, slab: Slab, contacts: Iterable[int]) -> float:
        """The largest relative error of a discretized slab under these contacts; NaN where it was not measured."""
        row = self._row_of.get(slab)
        return math.nan if row is None else max((row.errors[number] for number in contacts), default=math.nan)

    def like(self, slab: Slab) -> tuple[MeasuredGrid, ...]:
        """The measured discretizations of the same body: height, Poisson's ratio and support, ends or none."""
        return tuple(row for row in self.rows if _body(row.slab) == _body(slab))


@lru_cache(maxsize=4096)  # contacts of many cases are equally wide
def _about_as_wide(contacts: tuple[float, ...], half_width: float) -> frozenset[int]:
    """Numbers of the contacts that are about as wide."""
    return frozenset(number for number, contact in enumerate(contacts) if alike(contact, half_width))


def alike(one: float, other: float) -> bool:
    """True if the half-widths of two contacts differ by at most a quarter."""
    return abs(math.log(one / other)) <= ALIKE


def hertz_half_width(case: Case) -> float:
    """Half-width of Hertz's contact of a case on a half-plane, in L_x."""
    return closed_forms.hertz_half_width(case.normal_load, case.radius, case.slab.poisson)


def physics(slab: Slab) -> dict[str, Any]:
    """The physical parameters of a slab by field name: height, Poisson's ratio, support."""
    return {name: getattr(slab, name) for name in PHYSICS}


def _body(slab: Slab) -> tuple[object, ...]:
    """A slab as it is before any grid; a surface without ends is the body of its scheme."""
    return (*physics(slab).values(), slab.scheme.endless and type(slab.scheme))


def discretized(slab: Slab, discretization: Mapping[str, Any]) -> Slab:
    """Change the discretization of a slab, its other settings by default. Raises InvalidInput."""
    return Slab.of({**physics(slab), **discretization})


def settings(slab: Slab) -> dict[str, Any]:
    """The parameters of a slab's discretization by field name; None for the settings of other schemes."""
    return {name: slab.flat[name] for name in parameters.settings()}


def pareto_front(time: ArrayLike, error: ArrayLike) -> NDArray[np.bool_]:
    """Mask of the Pareto-optimal points: no other point is at least as fast and at least as accurate, and better in one.

    time, error: shape (points,). Of equal points only the first is marked. A point without time or error (NaN) is not.
    """
    times, errors = np.asarray(time, float), np.asarray(error, float)
    on_front = np.zeros(times.shape, dtype=np.bool_)
    best = math.inf
    for index in np.lexsort((errors, times)):
        if errors[index] < best and not math.isnan(times[index]):
            best = float(errors[index])
            on_front[index] = True
    return on_front


def load_front(path: Path = SHIPPED) -> Front:
    """Read a front that `nanoslip accuracy --save` wrote; without a path, the one that comes with this package."""
    return _front(path.name, path.read_text("utf-8"))


@lru_cache(maxsize=1)
def _front(name: str, text: str) -> Front:
    """The front written in a text."""
    found = json.loads(text)
    rows = tuple(_row(dict(zip(found["columns"], values, strict=True))) for values in found["rows"])
    return Front(name, found["machine"], tuple(found["contacts"]), rows, hashlib.sha256(text.encode()).hexdigest())


def _row(values: dict[str, Any]) -> MeasuredGrid:
    """One row from its columns: time, errors, and the parameters of its slab."""
    seconds, errors = values.pop("seconds"), tuple(values.pop("errors"))
    return MeasuredGrid(Slab.of(values), seconds, errors)


def as_text(machine: Mapping[str, str], contacts: Iterable[float], rows: Iterable[MeasuredGrid]) -> str:
    """The front as JSON text, one row a line, times and errors with three digits."""
    names = list(Slab().flat)
    lines = [
        json.dumps([*(row.slab.flat[name] for name in names), _short(row.seconds), [_short(e) for e in row.errors]])
        for row in rows
    ]
    head = {"machine": dict(machine), "contacts": list(contacts), "columns": [*names, "seconds", "errors"]}
    return json.dumps(head, ensure_ascii=False).removesuffix("}") + ', "rows": [\n' + ",\n".join(lines) + "\n]}\n"


def _short(value: float) -> float:
    return float(f"{value:.3g}")
