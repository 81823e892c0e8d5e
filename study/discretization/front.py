"""What each discretization of the slab costs, and how wrong it is: measured by `nanoslip accuracy`, kept as data.

The error of a discretization on a slab under a contact is the largest relative error of the case's deterministic
observables: the compliance energies of elliptic normal and tangential loads, the lateral stiffness K, the approach, and
the half-width and largest pressure of frictionless contact. Linear elasticity makes all of them functions of the contact's
half-width alone, whatever load and radius gave it. Plateaus and friction coefficients are chaotic: their uncertainty is
that of block means, and stands beside them in the dataset.
"""

import hashlib
import itertools
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver.case import Case
from solver.outcome import InvalidInput, SolverError, quoted
from solver.parameter import as_float
from solver.slab import PHYSICS, Slab
from study.manifest import parameters
from study.manifest.problems import ManifestError, path_shown

ALIKE = math.log(1.25)
SHIPPED = "front.json"
"""The front that comes with this package, measured on the developers' machine."""
LONGEST_REASON = 150
"""Characters of why a file is no front."""


@dataclass(frozen=True, slots=True)
class Measured:
    """One discretization of one slab."""

    slab: Slab
    seconds: float
    """Of processor time: the slab's compliance and a record of the reference displacement."""
    errors: tuple[float, ...]
    """The error with each of the front's contacts."""


@dataclass(frozen=True, slots=True)
class Front:
    """All that was measured on one machine."""

    name: str
    """The file."""
    machine: Mapping[str, str]
    """What it was measured with."""
    contacts: tuple[float, ...]
    """Half-widths of the contacts, a/L_x, increasing: Hertz's on a half-plane."""
    rows: tuple[Measured, ...]
    sha256: str = ""
    """Of the file."""
    _row_of: dict[Slab, Measured] = field(init=False, repr=False, compare=False, default_factory=dict)

    def __post_init__(self) -> None:
        self._row_of.update((row.slab, row) for row in self.rows)

    def expected_error(self, case: Case) -> float:
        """The error measured for a case's slab: the largest of all contacts about as wide as its own.

        A contact is made of whole nodes, so errors jump with its width; those of its neighbours say how far. NaN for a flat
        punch (its pressure is singular) and a rough pin, for a discretization or a slab that was not measured, and for a
        contact narrower or wider than all that were, or like none of them.
        """
        row, half_width = self._row_of.get(case.slab), hertz_half_width(case)
        measured = case.pin == "parabola" and not case.heterogeneity.roughness
        if row is None or not measured or not self.contacts[0] <= half_width <= self.contacts[-1]:
            return math.nan
        errors = zip(self.contacts, row.errors, strict=True)
        return max((error for contact, error in errors if alike(contact, half_width)), default=math.nan)

    def like(self, slab: Slab) -> tuple[Measured, ...]:
        """All discretizations of a slab like this one."""
        return tuple(row for row in self.rows if physics(row.slab) == physics(slab))


def alike(one: float, other: float) -> bool:
    """Whether two contacts are about as wide: within a quarter."""
    return abs(math.log(one / other)) <= ALIKE


def hertz_half_width(case: Case) -> float:
    """Half-width of Hertz's contact on a half-plane, a² = 2WR(1-ν)/(πG), in L_x."""
    return math.sqrt(2 * case.normal_load * case.radius * (1 - case.slab.poisson) / math.pi)


def physics(slab: Slab) -> dict[str, Any]:
    """What a slab is, by field name."""
    return {name: getattr(slab, name) for name in PHYSICS}


def discretized(slab: Slab, discretization: Mapping[str, Any]) -> Slab:
    """The slab on another grid, the scheme's own values for what is not given. Raises InvalidInput."""
    return Slab.of({**physics(slab), **discretization})


def settings(slab: Slab) -> dict[str, Any]:
    """How a slab is discretized, by field name."""
    return {name: slab.flat[name] for name in parameters.settings()}


def pareto_front(time: ArrayLike, error: ArrayLike) -> NDArray[np.bool_]:
    """Mask of the points that no other point beats: nothing as fast is more accurate, nothing as accurate is faster.

    Of points that are equal in both the first counts; a point without time or error (NaN) never does.
    """
    times, errors = np.asarray(time, float), np.asarray(error, float)
    on_front = np.zeros(times.shape, dtype=np.bool_)
    best = math.inf
    for index in np.lexsort((errors, times)):
        if errors[index] < best and not math.isnan(times[index]):
            best = float(errors[index])
            on_front[index] = True
    return on_front


def load_front(path: Path | None = None, given: str | None = None) -> Front:
    """The front of a file that `nanoslip accuracy --save` wrote; without one, that of this package.

    given: the file's text, where it was read before. Raises ManifestError.
    """
    where = Path(SHIPPED) if path is None else path
    try:
        file = resources.files("study.discretization") / SHIPPED if path is None else path
        if path is not None and given is None and path.exists() and not path.is_file():
            raise OSError("not a regular file")  # a device may never end
        text = file.read_text("utf-8") if given is None else given
        return _front(SHIPPED if path is None else path.name, text)
    except OSError as error:
        raise ManifestError([f"{path_shown(where)}: cannot be read: {error.strerror or error}"]) from None
    except (ValueError, LookupError, TypeError, RecursionError, SolverError) as error:
        wrong = " ".join(f"{type(error).__name__}: {error}".split())[:LONGEST_REASON]
        raise ManifestError([f"{path_shown(where)}: no front that nanoslip accuracy wrote: {wrong}"]) from None


def _front(name: str, text: str) -> Front:
    """The front that a text says. Raises ValueError, LookupError, TypeError, RecursionError or SolverError."""
    found = json.loads(text)
    contacts = tuple(_measured("contacts", value) for value in found["contacts"])
    if not contacts or any(before >= after for before, after in itertools.pairwise((0.0, *contacts))):
        raise InvalidInput(f"contacts = {quoted(contacts)}: needs half-widths that increase, above 0")
    rows = tuple(_row(dict(zip(found["columns"], values, strict=True))) for values in found["rows"])
    if not all(len(row.errors) == len(contacts) for row in rows):
        raise InvalidInput(f"errors: needs {len(contacts)} of every row, one for each contact")
    machine = dict(found["machine"])
    if not all(isinstance(word, str) for word in machine.values()):
        raise InvalidInput(f"machine = {quoted(machine)}: needs texts")
    return Front(name, machine, contacts, rows, hashlib.sha256(text.encode()).hexdigest())


def _row(values: dict[str, Any]) -> Measured:
    """A row by column; what is neither its time nor its errors is the slab."""
    seconds = _measured("seconds", values.pop("seconds"))
    return Measured(
        errors=tuple(_measured("errors", e) for e in values.pop("errors")), seconds=seconds, slab=Slab.of(values)
    )


def _measured(name: str, value: Any) -> float:
    """A number that can have been measured, or a length. Raises InvalidInput."""
    number = as_float(name, value)
    if not 0.0 <= number < math.inf:
        raise InvalidInput(f"{name} = {number!r}: needs finite numbers from 0 on")
    return number


def as_text(machine: Mapping[str, str], contacts: Iterable[float], rows: Iterable[Measured]) -> str:
    """A front as JSON, one row a line, times and errors with three digits."""
    names = list(Slab().flat)
    lines = [
        json.dumps([*(row.slab.flat[name] for name in names), _short(row.seconds), [_short(e) for e in row.errors]])
        for row in rows
    ]
    head = {"machine": dict(machine), "contacts": list(contacts), "columns": [*names, "seconds", "errors"]}
    return json.dumps(head, ensure_ascii=False).removesuffix("}") + ', "rows": [\n' + ",\n".join(lines) + "\n]}\n"


def _short(value: float) -> float:
    return float(f"{value:.3g}")
