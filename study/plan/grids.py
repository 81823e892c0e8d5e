"""Time and error of each discretization of the slab, and the choice of one for a campaign."""

import hashlib
import itertools
import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact import closed_forms
from nanoslip.solver.outcome import InvalidInput, NanoslipError, SolverError
from nanoslip.solver.parameter import as_float
from nanoslip.solver.slab import PHYSICS, Slab
from nanoslip.study.manifest import parameters
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.checker import read_text
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.parameters import Value
from nanoslip.study.manifest.problems import ManifestError, Place, Problem

# Processor time and error of each discretization of the slab, as `nanoslip accuracy` measured them and a file keeps them.
#
# The error of a discretization on a slab under a contact is the largest relative error of the case's deterministic observables:
# the compliance energies of elliptic normal and tangential loads, the lateral stiffness K, the approach, and the half-width and
# largest pressure of frictionless contact. Linear elasticity makes all of them functions of the contact's half-width alone,
# whatever load and radius gave it. Plateaus and friction coefficients are left out, as they are chaotic. Their uncertainty is
# estimated from block means, and is a variable of the dataset.

ALIKE = math.log(1.25)
SHIPPED = "front.json"
"""The front that comes with this package, measured on the developers' machine."""
LONGEST_REASON = 150
"""The most characters that a message shows of the reason why a file is no front."""


@dataclass(frozen=True, slots=True)
class Measured:
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
    rows: tuple[Measured, ...]
    sha256: str = ""
    """SHA-256 of its file."""
    _row_of: dict[Slab, Measured] = field(init=False, repr=False, compare=False, default_factory=dict)

    def __post_init__(self) -> None:
        self._row_of.update((row.slab, row) for row in self.rows)

    def expected_error(self, case: Case) -> float:
        """Relative error to expect of a case: the largest that was measured on its slab with contacts about as wide as its own.

        A contact consists of whole nodes, so the error jumps as its width grows. NaN if nothing comparable was measured: a flat
        punch, a rough pin, another discretization or slab, another width.
        """
        return self.worst_error(case.slab, self.comparable(case))

    def comparable(self, case: Case) -> frozenset[int]:
        """Indices of the measured contacts comparable with a case; none where nothing comparable was measured."""
        half_width = hertz_half_width(case)
        measured = case.pin == "parabola" and not case.heterogeneity.roughness
        if not measured or not self.contacts[0] <= half_width <= self.contacts[-1]:
            return frozenset()
        return _about_as_wide(self.contacts, half_width)

    def lacks(self, case: Case) -> str:
        """Unmeasured part of a case, in words; empty without any."""
        if case.pin != "parabola":
            return f"pin = {case.pin}"
        if case.heterogeneity.roughness:
            return "a rough pin"
        if not self.like(case.slab):
            return parameters.in_words(physics(case.slab))
        if not self.comparable(case):
            least, most = self.contacts[0], self.contacts[-1]
            return f"Hertz's a/L_x = {hertz_half_width(case):.3g}, where those that were measured have {least:.2g} to {most:.2g}"
        return ""

    def worst_error(self, slab: Slab, contacts: Iterable[int]) -> float:
        """The largest relative error of a discretized slab under these contacts; NaN where it was not measured."""
        row = self._row_of.get(slab)
        return math.nan if row is None else max((row.errors[number] for number in contacts), default=math.nan)

    def like(self, slab: Slab) -> tuple[Measured, ...]:
        """The measured discretizations of the same body: height, Poisson's ratio and support, ends or none."""
        return tuple(row for row in self.rows if _body(row.slab) == _body(slab))


@lru_cache(maxsize=4096)  # contacts of many cases are equally wide
def _about_as_wide(contacts: tuple[float, ...], half_width: float) -> frozenset[int]:
    """Numbers of the contacts that are about as wide."""
    return frozenset(number for number, contact in enumerate(contacts) if alike(contact, half_width))


def alike(one: float, other: float) -> bool:
    """Whether the half-widths of two contacts differ by at most a quarter."""
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
    """The same physical slab with another discretization, its other settings by default. Raises InvalidInput."""
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


def load_front(path: Path | None = None, given: str | None = None) -> Front:
    """Read the front in a file that `nanoslip accuracy --save` wrote; without a path, the one that comes with this package.

    given: the text of the file, where it has been read already. Raises ManifestError.
    """
    where = Path(__file__).with_name(SHIPPED) if path is None else path
    text = read_text(where, given)
    try:
        return _front(where.name, text)
    except (ValueError, LookupError, TypeError, RecursionError, SolverError) as error:
        wrong = " ".join(f"{type(error).__name__}: {error}".split())[:LONGEST_REASON]
        raise ManifestError.in_file(where, remark=f"no front that nanoslip accuracy wrote: {wrong}") from None


@lru_cache(maxsize=4)  # planned, chosen and collected with
def _front(name: str, text: str) -> Front:
    """The front written in a text. Raises ValueError, LookupError, TypeError, RecursionError or SolverError."""
    found = json.loads(text)
    contacts = tuple(_measured("contacts", value) for value in found["contacts"])
    if not contacts or any(before >= after for before, after in itertools.pairwise((0.0, *contacts))):
        raise InvalidInput("contacts", contacts, "half-widths that increase, above 0")
    rows = tuple(_row(dict(zip(found["columns"], values, strict=True))) for values in found["rows"])
    if not all(len(row.errors) == len(contacts) for row in rows):
        raise InvalidInput("errors", need=f"{len(contacts)} of every row, one for each contact")
    machine = dict(found["machine"])
    if not all(isinstance(word, str) for word in machine.values()):
        raise InvalidInput("machine", need="texts")
    return Front(name, machine, contacts, rows, hashlib.sha256(text.encode()).hexdigest())


def _row(values: dict[str, Any]) -> Measured:
    """One row from its columns: time, errors, and the parameters of its slab."""
    seconds = _measured("seconds", values.pop("seconds"))
    return Measured(
        errors=tuple(_measured("errors", e) for e in values.pop("errors")), seconds=seconds, slab=Slab.of(values)
    )


def _measured(name: str, value: Any) -> float:
    """A finite number of at least 0, as times, errors and lengths are. Raises InvalidInput."""
    number = as_float(name, value)
    if not 0.0 <= number < math.inf:
        raise InvalidInput(name, number, "finite numbers from 0 on")
    return number


def as_text(machine: Mapping[str, str], contacts: Iterable[float], rows: Iterable[Measured]) -> str:
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


# The choice of a discretization for `accuracy = 0.01`: the fastest measured one whose error is at most that in every case.

SCHEME: Final = "galerkin"
"""The only scheme chosen from, as its errors converge to zero."""


def settled(manifest: Manifest) -> Manifest:
    """The manifest with the discretization chosen for its `accuracy`; unchanged where it has none, or no case to compute.

    All cases get the same discretization, so that their differences are physical. Raises ManifestError where no measured one
    is accurate enough; its message names the best.
    """
    if manifest.accuracy is None and manifest.front is None:
        return manifest
    # A file that is no front is better known now than when all is computed.
    front = load_front(manifest.front, manifest.files.get("front"))
    if manifest.accuracy is None:
        return manifest
    cases = [case.case for case in expand(manifest) if case.case is not None]
    if not cases:  # all are refused, and say why themselves
        return manifest
    try:
        chosen = cheapest(front, cases, manifest.accuracy)
    except UnreachableError as error:
        need = f"{error}{_lacking(front, manifest)}"
        raise ManifestError([Problem(Place(str(manifest.path)), "accuracy", manifest.accuracy, need)]) from None
    return manifest.discretized(_given(chosen))


def _lacking(front: Front, manifest: Manifest) -> str:
    """First case that the front does not cover, the missing part, and the number of further cases; empty without any."""
    lacks = ((each.point, front.lacks(each.case)) for each in expand(manifest) if each.case is not None)
    found = [(point, what) for point, what in lacks if what]
    if not found:
        return ""
    point, what = found[0]
    others = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    return f"; it lacks the case {point}{others}: {what}"


def choice(manifest: Manifest) -> str:
    """The chosen discretization as text: `n_x = 129, rows_per_level = 2, ...`, in the words of a manifest."""
    return parameters.in_words(chosen(manifest))


def chosen(manifest: Manifest) -> dict[str, Value]:
    """The chosen discretization of a manifest from `settled`, by field name."""
    numerics = manifest.tables["numerics"]
    return {name: numerics[name] for name in parameters.settings() if name in numerics}


class UnreachableError(NanoslipError):
    """No measured discretization is accurate enough. The message gives the best one."""


def cheapest(front: Front, cases: Iterable[Case], accuracy: float) -> Slab:
    """The fastest discretization whose expected error is at most `accuracy` in every case.

    Returns the slab of the front's row. Raises UnreachableError where there is none.
    """
    known = [found for found in _expected(front, _comparable(front, cases)) if not math.isnan(found[0])]
    if not known:
        raise UnreachableError(
            f"a slab and a contact that {front.name} has (a smooth parabolic pin; its own front is measured by "
            "nanoslip accuracy CAMPAIGN --save FILE, and named by front = FILE), or n_x instead"
        )
    good = [(seconds, error, slab) for error, seconds, slab in known if error <= accuracy]
    if not good:
        error, _, slab = min(known, key=lambda found: found[0])
        best = parameters.in_words(_given(slab))
        raise UnreachableError(f"{_above(error)} or more, the best that {front.name} has: {best}")
    return min(good, key=lambda found: found[:2])[2]


def _comparable(front: Front, cases: Iterable[Case]) -> dict[Slab, set[int]]:
    """Slab -> measured contacts comparable with its cases; none if a case has none."""
    found: dict[Slab, set[int]] = {}
    unknown: set[Slab] = set()
    for case in cases:
        contacts = front.comparable(case)
        found.setdefault(case.slab, set()).update(contacts)
        if not contacts:
            unknown.add(case.slab)
    return {slab: set() if slab in unknown else contacts for slab, contacts in found.items()}


def _expected(front: Front, contacts: Mapping[Slab, Iterable[int]]) -> Iterator[tuple[float, float, Slab]]:
    """Worst expected error, seconds and slab of every discretization that was measured on the first slab."""
    for row in front.like(next(iter(contacts))) if contacts else ():
        if row.slab.scheme.name == SCHEME:
            same = [(discretized(slab, settings(row.slab)), each) for slab, each in contacts.items()]
            errors = [front.worst_error(slab, each) for slab, each in same]
            yield (math.nan if any(map(math.isnan, errors)) else max(errors)), row.seconds, row.slab


def _given(slab: Slab) -> dict[str, Value]:
    """The parameters of a slab's discretization, without the settings of other schemes."""
    return {name: value for name, value in settings(slab).items() if value is not None}


def _above(error: float) -> float:
    """An error rounded up to two digits, so that asking for it succeeds."""
    scale = 10.0 ** (math.floor(math.log10(error)) - 1)
    return float(f"{math.ceil(error / scale) * scale:.1e}")
