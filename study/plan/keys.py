"""Keys of tasks: a hash of the whole case, less what is known not to matter.

So a new field of a case changes the keys at once. A field is left out only by a line here that gives the reason.
"""

import itertools
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import fields, is_dataclass
from functools import lru_cache
from typing import Any, NamedTuple

from nanoslip.solver.case import PARTS, Case
from nanoslip.solver.drive import Integrator
from nanoslip.solver.parameter import declared
from nanoslip.solver.slab import Scheme
from nanoslip.study.canonical import Texts, content_hash
from nanoslip.study.manifest.parameters import words

SOLVER_VERSION = "27"
"""Part of every key: raise it whenever a change of the solver changes a result, or what numbers it has."""


class Exclusion(NamedTuple):
    """Fields of a case that do not change a result, in the cases where they do not."""

    names: tuple[str, ...]
    """`radius`, `heterogeneity.seed`; `slip_rule` is all of its fields."""
    reason: str
    where: Callable[[Case], bool] = lambda _: True


def _drags_nothing(case: Case) -> bool:
    return not (case.effects.friction and case.effects.coupling)


OF_ALL = (
    Exclusion(("radius",), "only a parabola has a radius", lambda case: case.pin != "parabola"),
    Exclusion(("half_width",), "only a punch has a half-width", lambda case: case.pin != "flat_punch"),
    Exclusion(
        ("slab.aspect_ratio", "slab.poisson"),
        "a chain has neither height nor Poisson's ratio",
        lambda case: not case.slab.scheme.continuum,
    ),
    Exclusion(
        ("heterogeneity.distribution", "heterogeneity.seed"),
        "without a spread nothing is drawn",
        lambda case: case.heterogeneity.spread == 0.0,
    ),
)
"""What no result depends on."""
OF_CONTACT = (
    *OF_ALL,
    Exclusion(
        ("max_events", "max_presliding", "max_displacement", "max_spacings"),
        "initial contact comes before any limit",
    ),
    Exclusion(("effects.pin_translation",), "at initial contact the pin has not moved"),
    Exclusion(
        (
            "intrinsic_friction",
            "initial_contact",
            "slip_rule",
            "heterogeneity.distribution",
            "heterogeneity.spread",
            "heterogeneity.seed",
        ),
        "a pin that drags nothing slips nowhere",
        _drags_nothing,
    ),
)
"""What initial contact does not depend on."""
OF_RECORD = (
    *OF_ALL,
    Exclusion(("max_displacement", "max_spacings"), "both are in the key as the nearer of them, `farthest`"),
)
"""What a friction record does not depend on."""


def without_effect(case: Case, exclusions: tuple[Exclusion, ...] = OF_ALL) -> frozenset[str]:
    """Names of the parameters of a case that change no result."""
    return _all_parameters(tuple([name for each in exclusions if each.where(case) for name in each.names]))


def idle(cases: Sequence[Case], given: Collection[str], contact_alone: bool) -> Iterator[str]:
    """The given parameters, by field name, that change nothing in any of the cases, as in campaigns, each with the reason.

    contact_alone: whether nothing slides.
    """
    known_as = {name: word for word, name in words().items()}
    for each in OF_CONTACT if contact_alone else OF_ALL:
        names = [name for field in each.names for name in _parameters(field) if name in given]
        if names and cases and all(map(each.where, cases)):
            yield from (f"{known_as[name]} changes nothing here: {each.reason}" for name in names)


@lru_cache(maxsize=256)  # asked for every case of a campaign
def _all_parameters(names: tuple[str, ...]) -> frozenset[str]:
    return frozenset(itertools.chain.from_iterable(_parameters(name) for name in names))


def _parameters(name: str) -> tuple[str, ...]:
    """The parameters that a field of a case stands for: all of a part, or the one."""
    return tuple(declared(PARTS[name])) if name in PARTS else (name.rpartition(".")[2],)


def task_key(kind: str, *content: object) -> str:
    """The key of a task of this kind that this content decides."""
    return content_hash(kind, SOLVER_VERSION, *content)


def of_contact(case: Case) -> tuple[object, ...]:
    """All that decides initial contact."""
    return (_CONTACTS(case),)


def of_record(case: Case) -> tuple[object, ...]:
    """All that decides a friction record."""
    return (_RECORDS(case), case.farthest)


def deciding_texts(exclusions: tuple[Exclusion, ...]) -> Texts:
    """The canonical texts of what decides, of one case after the other; the same as of `deciding`."""
    where = tuple(each.where for each in exclusions)
    return Texts(lambda case: deciding(case, exclusions), lambda case: tuple([holds(case) for holds in where]))


_CONTACTS, _RECORDS = deciding_texts(OF_CONTACT), deciding_texts(OF_RECORD)


def deciding(case: Case, exclusions: tuple[Exclusion, ...]) -> dict[str, object]:
    """Every field of a case and its parts by dotted name, less those that are excluded. Raises KeyError for unknown ones."""
    found = dict(flattened(case))
    apart = {name for each in exclusions if each.where(case) for name in each.names}
    for name in apart:
        under = [field for field in found if field == name or field.startswith(f"{name}.")]
        if not under:
            raise KeyError(f"{name}: no field of a case")
        for field in under:
            del found[field]
    return found


def flattened(value: Any, prefix: str = "") -> Iterator[tuple[str, object]]:
    """Dotted name and value of every field of a dataclass and of those that it holds; of a scheme or integrator its name too."""
    for item in fields(value):
        part = getattr(value, item.name)
        if isinstance(part, Scheme | Integrator):
            yield f"{prefix}{item.name}", part.name
        if is_dataclass(part):
            yield from flattened(part, f"{prefix}{item.name}.")
        else:
            yield f"{prefix}{item.name}", part
