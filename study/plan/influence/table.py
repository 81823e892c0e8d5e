"""How much effects matter, as `nanoslip effects --measure` found on random scenes and a file keeps it.

The influence of an effect on an observable is the relative change of its mean over an ensemble of starts when the effect is
left out, plus by how much more the starts then differ. A power law of the groups that govern the effect is fitted to all
scenes; what is to be expected in a new one is what the law says there, times the largest factor by which the influence exceeds
the law in the measured scenes that are most like the new one. Of `ALIKE` scenes drawn as the new one is, each is equally likely
to exceed the law the most: the new one does with probability 1/(ALIKE + 1).
"""

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib import resources
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from solver.outcome import InvalidInput
from solver.parameter import as_float
from study.manifest.problems import ManifestError, path_shown
from study.plan.influence.omissions import OMISSIONS, Omission
from study.plan.influence.scene import Scene

SHIPPED: Final = "influences.json"
"""The influences that come with this package."""
ALIKE: Final = 19
"""Measured scenes like the new one that an expectation is taken from."""
LEAST: Final = 1e-3
"""An influence that stands for all smaller ones where a law is fitted."""
LARGEST: Final = 9.99
"""An influence that stands for all larger ones, and for a scene that cannot be computed without the effect."""

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Measured:
    """One effect in scenes that have it."""

    places: Vector
    """(scenes, groups): where the scenes lie along the effect's groups."""
    influences: Vector
    """(scenes, observables): NaN where the scene does not yield the observable."""

    @cached_property
    def laws(self) -> Vector:
        """(1 + groups, observables): logarithm of the influence at a place (1, x, y, …) is the product with these columns."""
        return np.array([_law(self.places, column) for column in self.influences.T]).T

    @cached_property
    def _excess(self) -> Vector:
        """(scenes, observables): the influence over what the law says."""
        return np.asarray(self.influences / self._by_law(self.places))

    @cached_property
    def _range(self) -> tuple[Vector, Vector]:
        """The lowest and the highest place along each group, (groups,)."""
        return self.places.min(axis=0), self.places.max(axis=0)

    @cached_property
    def _scaled(self) -> tuple[Vector, Vector]:
        """The places in shares of the measured range, (scenes, groups), and that range, (groups,)."""
        low, high = self._range
        across = np.maximum(high - low, 1e-12)
        return self.places / across, across

    def _by_law(self, places: Vector) -> Vector:
        """(places, observables)."""
        return np.exp(_design(places) @ self.laws)

    def expected(self, omission: Omission, scene: Scene) -> Vector:
        """Influence to expect on each observable, (observables,); NaN where nothing like the scene was measured."""
        nothing = np.full(self.influences.shape[1], math.nan)
        if not len(self.places):
            return nothing
        low, high = self._range
        place = np.array([group.place(scene) for group in omission.groups])
        for number, group in enumerate(omission.groups):
            if (group.safe < 0 and place[number] < low[number]) or (group.safe > 0 and place[number] > high[number]):
                place[number] = min(max(place[number], low[number]), high[number])
        if not (np.all(place >= low) and np.all(place <= high)):
            return nothing
        scaled, across = self._scaled
        away = scaled - place / across
        distance = np.einsum("sg,sg->s", away, away)
        largest = np.array([_largest(column, distance) for column in self._excess.T])
        return np.asarray(np.minimum(largest * self._by_law(place[None])[0], LARGEST))


def _design(places: Vector) -> Vector:
    return np.hstack((np.ones((len(places), 1)), places))


def _law(places: Vector, influences: Vector) -> Vector:
    """The power law of least squares, (1 + groups,); a constant of too few influences."""
    known = ~np.isnan(influences)
    logs = np.log(np.clip(influences[known], LEAST, 1.0))
    if known.sum() < ALIKE:
        return np.array([0.0] * (1 + places.shape[1]))
    return np.asarray(np.linalg.lstsq(_design(places[known]), logs, rcond=None)[0])


def _largest(values: Vector, distance: Vector) -> float:
    """The largest of the values that are known of the nearest scenes; NaN of too few."""
    known = ~np.isnan(values)
    values, distance = values[known], distance[known]
    if len(values) <= ALIKE:
        return float(values.max()) if len(values) == ALIKE else math.nan
    return float(values[distance.argpartition(ALIKE - 1)[:ALIKE]].max())


@dataclass(frozen=True, slots=True, eq=False)
class Influences:
    """All effects, each in the scenes that have it."""

    name: str
    """Name of its file, for messages."""
    about: Mapping[str, str]
    """How it was measured."""
    effects: Mapping[str, Measured]
    sha256: str = ""
    """SHA-256 of its file."""

    def __str__(self) -> str:
        return f"{self.name}, sha256 {self.sha256}"

    def expected(self, omission: Omission, scene: Scene) -> Vector:
        """Influence to expect of leaving an effect out, on each of its observables; NaN where that is not known."""
        known = self.effects.get(omission.name)
        return known.expected(omission, scene) if known else np.full(len(omission.observables), math.nan)


def load_influences(path: Path | None = None, given: str | None = None) -> Influences:
    """Read the influences in a file that `nanoslip effects --measure` wrote; without a path, those of this package.

    given: the text of the file, where it has been read already. Raises ManifestError.
    """
    if path is None:
        return _shipped()
    try:
        return _influences(path.name, path.read_text("utf-8") if given is None else given)
    except OSError as error:
        raise ManifestError([f"{path_shown(path)}: cannot be read: {error.strerror or error}"]) from None
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError, InvalidInput) as error:
        wrong = " ".join(f"{type(error).__name__}: {error}".split())[:150]
        raise ManifestError([f"{path_shown(path)}: no influences that nanoslip effects wrote: {wrong}"]) from None


@lru_cache(maxsize=1)
def _shipped() -> Influences:
    return _influences(SHIPPED, (resources.files("study.plan.influence") / SHIPPED).read_text("utf-8"))


def _influences(name: str, text: str) -> Influences:
    found = json.loads(text)
    about = dict(found["about"])
    if not all(isinstance(word, str) for word in about.values()):
        raise InvalidInput("about: needs texts")
    effects = {key: _measured(OMISSIONS[key], rows) for key, rows in found["effects"].items()}
    return Influences(name, about, effects, hashlib.sha256(text.encode()).hexdigest())


def _measured(omission: Omission, rows: list[list[Any]]) -> Measured:
    groups, wide = omission.groups, len(omission.groups) + len(omission.observables)
    table = np.array([[math.nan if each is None else as_float(omission.name, each) for each in row] for row in rows])
    table = table.reshape(len(rows), wide)
    places, influences = table[:, : len(groups)], table[:, len(groups) :]
    if not np.isfinite(places).all() or (influences < 0.0).any():
        raise InvalidInput(f"{omission.name}: needs finite groups, and influences from 0 on")
    return Measured(places, influences)


def as_text(about: Mapping[str, str], effects: Mapping[str, Measured]) -> str:
    """The influences as JSON text, one scene a line: its places along the groups, then its influences."""
    parts = []
    for name, measured in effects.items():
        rows = (
            json.dumps([*map(_short, place), *map(_short, influence)])
            for place, influence in zip(measured.places, measured.influences, strict=True)
        )
        parts.append(f"{json.dumps(name)}: [\n" + ",\n".join(rows) + "\n]")
    head = json.dumps({"about": dict(about)}, ensure_ascii=False).removesuffix("}")
    return f'{head}, "effects": {{\n' + ",\n".join(parts) + "\n}}\n"


def _short(value: float) -> float | None:
    return None if math.isnan(value) else float(f"{min(value, LARGEST):.3g}")


def measured_of(rows: Iterable[tuple[Vector, Vector]], omission: Omission) -> Measured:
    """What was measured of an effect, scene by scene: places along its groups and influences."""
    found = list(rows)
    places = np.array([place for place, _ in found]).reshape(len(found), len(omission.groups))
    return Measured(places, np.array([each for _, each in found]).reshape(len(found), len(omission.observables)))
