"""What is left out of a case: of all choices whose expected influences add up to no more than the tolerance, the cheapest."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.case import Case
from solver.drive import Drive
from study.plan.cost.drive import drive_seconds
from study.plan.cost.seconds import compliance_seconds, record_seconds, touch_seconds
from study.plan.influence.omissions import OF_THE_CASE, OF_THE_DRIVE, Omission, measured_like
from study.plan.influence.scene import OBSERVABLES, Scene
from study.plan.influence.table import Influences

LEAST_SAVING: Final = 0.01
"""Share of the time that leaving an effect out has to save."""

Vector = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Tolerance:
    """What may be left out of a campaign's cases."""

    within: float
    """Largest relative change of what is asked for."""
    asked_for: tuple[str, ...]
    """Observables that it holds for."""
    kept: frozenset[str]
    """Effects that nothing is computed without."""
    influences: Influences
    slides: bool
    """Whether there are records, not contacts alone."""
    fitted: bool
    """Whether a closed form is fitted to the motion of drives."""
    cases_on_a_slab: float
    """Among which the time of a compliance is shared."""

    @property
    def columns(self) -> list[int]:
        """Places of what is asked for among the observables."""
        return [OBSERVABLES.index(name) for name in self.asked_for]


class Choice(NamedTuple):
    """What was decided of one effect of a case or drive."""

    effect: str
    left_out: bool
    influence: Vector
    """(OBSERVABLES,): expected relative change without it; 0 of what it cannot change, NaN where that is not known."""
    saves: float
    """Seconds, of the case or drive alone, if nothing else is left out."""
    reason: str
    """Why it is not left out; empty where it is."""


@dataclass(frozen=True, slots=True)
class Decision:
    """What is computed of a case: with what it was asked for, less what does not matter."""

    asked: Case
    """With everything."""
    case: Case
    of_case: tuple[Choice, ...]
    of_drives: Mapping[str, tuple[Choice, ...]]
    seconds: float
    """Estimated for the case and its drives."""
    seconds_of_all: float
    """The same with all that was asked for."""

    def influence(self, drive: str = "") -> Vector:
        """Expected relative change of the observables by all that is left out, (OBSERVABLES,). drive: its label."""
        taken = [each for each in (*self.of_case, *self.of_drives.get(drive, ())) if each.left_out]
        return np.sum([each.influence for each in taken], axis=0) if taken else np.zeros(len(OBSERVABLES))

    def left_out(self, drive: str = "") -> tuple[str, ...]:
        """Names of the effects that are left out of the case, or of a drive."""
        choices = self.of_drives[drive] if drive else self.of_case
        return tuple(each.effect for each in choices if each.left_out)


class _Part(NamedTuple):
    """The case without its drives, or one drive: what could be left out of it, and its time with everything."""

    seconds: float
    choices: tuple[Choice, ...]

    @property
    def possible(self) -> list[Choice]:
        return [each for each in self.choices if not each.reason]

    def subsets(self, columns: Sequence[int], left: Vector) -> Iterator[tuple[float, Vector, tuple[str, ...]]]:
        """Seconds, what is left of the tolerance, and names, of every set of effects that can be left out together."""
        for size in range(len(self.possible) + 1):
            for chosen in itertools.combinations(self.possible, size):
                rest = left - sum((each.influence[columns] for each in chosen), np.zeros(len(left)))
                if (rest >= 0.0).all():
                    share = math.prod(1.0 - each.saves / self.seconds for each in chosen)
                    yield self.seconds * share, rest, tuple(each.effect for each in chosen)


def decide(
    case: Case, drives: Mapping[str, Drive], kept: Mapping[str, frozenset[str]], tolerance: Tolerance
) -> Decision:
    """What to leave out of a case and of each of its drives.

    drives: by label, in the solver's units. kept: label -> effects that a drive is not computed without.
    """
    whole = _part(Scene(case), tolerance)
    driven = {
        label: _part(Scene(case, drive), replace(tolerance, kept=tolerance.kept | kept[label]))
        for label, drive in drives.items()
    }
    best = (math.inf, (), {})  # type: tuple[float, tuple[str, ...], dict[str, tuple[str, ...]]]
    columns = tolerance.columns
    for seconds, rest, names in whole.subsets(columns, np.full(len(columns), tolerance.within)):
        cheapest = {
            label: min(part.subsets(columns, rest), key=lambda found: found[0]) for label, part in driven.items()
        }
        together = seconds + sum(found[0] for found in cheapest.values())
        if together < best[0]:
            best = together, names, {label: found[2] for label, found in cheapest.items()}
    total, names, by_drive = best
    return Decision(
        case,
        _without(case, names),
        _taken(whole.choices, names),
        {label: _taken(part.choices, by_drive[label]) for label, part in driven.items()},
        total,
        whole.seconds + sum(part.seconds for part in driven.values()),
    )


def _part(scene: Scene, tolerance: Tolerance) -> _Part:
    """What could be left out of a case, or of a drive where the scene has one."""
    seconds = _seconds(scene, tolerance)
    there = [each for each in (OF_THE_DRIVE if scene.drive else OF_THE_CASE) if each.there(scene)]
    return _Part(seconds, tuple(_choice(each, scene, seconds, tolerance) for each in there))


def _choice(omission: Omission, scene: Scene, seconds: float, tolerance: Tolerance) -> Choice:
    expected = np.zeros(len(OBSERVABLES))
    unlike = measured_like(scene.case)
    found = np.full(len(omission.observables), math.nan) if unlike else tolerance.influences.expected(omission, scene)
    expected[[OBSERVABLES.index(name) for name in omission.observables]] = found
    saves = seconds - _seconds(omission.left_out(scene), tolerance)
    return Choice(
        omission.name, False, expected, saves, _reason(omission, expected, saves / seconds, unlike, tolerance)
    )


def _reason(omission: Omission, expected: Vector, saved: float, unlike: str, tolerance: Tolerance) -> str:
    """Why an effect cannot be left out, as far as it alone says."""
    of_asked = expected[tolerance.columns]
    if omission.name in tolerance.kept:
        return "kept by the file"
    if np.isnan(of_asked).any():
        return f"influence not known{f' with {unlike}' if unlike else ', no scenes like this one were measured'}"
    if (of_asked > tolerance.within).any():
        return "matters"
    return "" if saved > LEAST_SAVING else "saves nothing"


def _seconds(scene: Scene, tolerance: Tolerance) -> float:
    case = scene.case
    if scene.drive is not None:
        return drive_seconds(scene.drive, case, tolerance.fitted)
    computed = record_seconds(case) if tolerance.slides else touch_seconds(case)
    return compliance_seconds(case, tolerance.slides) / tolerance.cases_on_a_slab + computed


def _taken(choices: tuple[Choice, ...], names: tuple[str, ...]) -> tuple[Choice, ...]:
    found = []
    for each in choices:
        left_out = each.effect in names
        reason = each.reason or ("" if left_out else "others save more within the tolerance")
        found.append(each._replace(left_out=left_out, reason=reason))
    return tuple(found)


def _without(case: Case, names: tuple[str, ...]) -> Case:
    scene = Scene(case)
    for each in OF_THE_CASE:
        if each.name in names:
            scene = each.left_out(scene)
    return scene.case
