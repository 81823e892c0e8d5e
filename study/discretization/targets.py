"""The choice of a discretization for `accuracy = 0.01`: the fastest measured one whose error is at most that in every case."""

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Final

from nanoslip.solver.case import Case
from nanoslip.solver.slab import Slab
from nanoslip.study.discretization.front import Front, discretized, load_front, settings
from nanoslip.study.manifest import parameters
from nanoslip.study.manifest.cases import expanding
from nanoslip.study.manifest.checker import ManifestError
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.parameters import Value

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
    front = load_front(manifest.front, manifest.front_text)
    if manifest.accuracy is None:
        return manifest
    cases = (case.case for case in expanding(manifest) if case.case is not None)
    first = next(cases, None)
    if first is None:  # all are refused, and say why themselves
        return manifest
    try:
        chosen = cheapest(front, itertools.chain([first], cases), manifest.accuracy)
    except UnreachableError as error:
        wrong = f"{manifest.path}: accuracy = {manifest.accuracy!r}: {error}"
        raise ManifestError([wrong + _lacking(front, manifest)]) from None
    return replace(manifest, numerics={**manifest.numerics, **_given(chosen)})


def _lacking(front: Front, manifest: Manifest) -> str:
    """The first case of which the front lacks something, what that is, and how many more there are; empty where there is none."""
    lacks = ((each.point, front.lacks(each.case)) for each in expanding(manifest) if each.case is not None)
    found = [(point, what) for point, what in lacks if what]
    if not found:
        return ""
    point, what = found[0]
    others = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    return f"; it lacks the case {point}{others}: {what}"


def choice(manifest: Manifest) -> str:
    """The chosen discretization as text: `n_x = 129, rows_per_level = 2, ...`, in the words of a manifest."""
    return _in_words(chosen(manifest))


def chosen(manifest: Manifest) -> dict[str, Value]:
    """The chosen discretization of a manifest from `settled`, by field name."""
    return {name: manifest.numerics[name] for name in parameters.settings() if name in manifest.numerics}


class UnreachableError(Exception):
    """No measured discretization is accurate enough. The message says what is needed instead."""


def cheapest(front: Front, cases: Iterable[Case], accuracy: float) -> Slab:
    """The fastest discretization whose expected error is at most `accuracy` in every case.

    Returns the slab of the front's row. Raises UnreachableError where there is none.
    """
    known = [found for found in _expected(front, _comparable(front, cases)) if not math.isnan(found[0])]
    if not known:
        raise UnreachableError(
            f"needs a slab and a contact that {front.name} has (a smooth parabolic pin; its own front is measured by "
            "nanoslip accuracy CAMPAIGN --save FILE, and named by front = FILE), or n_x instead"
        )
    good = [(seconds, error, slab) for error, seconds, slab in known if error <= accuracy]
    if not good:
        error, _, slab = min(known, key=lambda found: found[0])
        best = _in_words(_given(slab))
        raise UnreachableError(f"needs {_above(error)} or more, the best that {front.name} has: {best}")
    return min(good, key=lambda found: found[:2])[2]


def _comparable(front: Front, cases: Iterable[Case]) -> dict[Slab, set[int]]:
    """Slab -> the measured contacts that say what to expect of the cases on it; none where some case has none."""
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


def _in_words(settings: Mapping[str, Value]) -> str:
    return parameters.in_words(", ".join(f"{name} = {value}" for name, value in settings.items()))


def _above(error: float) -> float:
    """An error rounded up to two digits, so that asking for it succeeds."""
    scale = 10.0 ** (math.floor(math.log10(error)) - 1)
    return float(f"{math.ceil(error / scale) * scale:.1e}")
