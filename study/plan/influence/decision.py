"""What is left out of a case, and how long its record and drives are: the cheapest choice that stays within the tolerance.

Expected influences of what is left out add up; twice the errors by lengths are added to them as squares.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from solver.case import Case
from solver.drive import Drive
from solver.outcome import InvalidInput
from study.plan.cost.drive import drive_seconds
from study.plan.cost.seconds import compliance_seconds, record_seconds, touch_seconds
from study.plan.influence.choice import LEAST_SAVING, Asked, Choice, Length, Part, Vector, cheapest
from study.plan.influence.length import (
    TOLD_BY_LENGTH,
    WHOLE_LENGTH,
    drive_saving,
    errors_within,
    record_saving,
    why_drives_stay,
    why_records_stay,
)
from study.plan.influence.omissions import OF_THE_CASE, OF_THE_DRIVE, Omission, measured_like
from study.plan.influence.scene import OBSERVABLES, OF_DRIVES, Scene
from study.plan.influence.table import Influences


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
    lengths_stay: str = ""
    """Why records and drives are computed to their whole lengths; empty where they may be shorter."""

    @property
    def columns(self) -> list[int]:
        """Places of what is asked for among the observables."""
        return [OBSERVABLES.index(name) for name in self.asked_for]

    @property
    def asked(self) -> Asked:
        """The same for a search."""
        told = [name in TOLD_BY_LENGTH for name in self.asked_for]
        of_drives = [one and name in OF_DRIVES for one, name in zip(told, self.asked_for, strict=True)]
        return Asked(self.within, self.columns, told, of_drives)


@dataclass(frozen=True, slots=True)
class Decision:
    """What is computed of a case: with what it was asked for, less what does not matter."""

    asked: Case
    """With everything."""
    case: Case
    of_case: tuple[Choice, ...]
    of_drives: Mapping[str, tuple[Choice, ...]]
    lengths: Mapping[str, Length]
    """Of the record, "", and of the drives, by label; nothing of contacts alone."""
    seconds: float
    """Estimated for the case and its drives."""
    seconds_of_all: float
    """The same with all that was asked for."""

    def influence(self, drive: str = "") -> Vector:
        """Expected relative change of the observables by all that is left out, (OBSERVABLES,). drive: its label."""
        taken = [each for each in (*self.of_case, *self.of_drives.get(drive, ())) if each.left_out]
        return np.sum([each.influence for each in taken], axis=0) if taken else np.zeros(len(OBSERVABLES))

    def of_drive(self, label: str) -> tuple[tuple[str, ...], float | None]:
        """Names of the effects that are left out of a drive, and the error by its length up to which it is computed."""
        return self.left_out(label), self.length_error(label)

    def length_error(self, drive: str = "") -> float | None:
        """Error by its length up to which the record, or a drive, is computed; None: to its whole length."""
        return self.lengths[drive].error if drive in self.lengths else None

    def left_out(self, drive: str = "") -> tuple[str, ...]:
        """Names of the effects that are left out of the case, or of a drive."""
        choices = self.of_drives[drive] if drive else self.of_case
        return tuple(each.effect for each in choices if each.left_out)


def decide(
    case: Case, drives: Mapping[str, Drive], kept: Mapping[str, frozenset[str]], tolerance: Tolerance
) -> Decision:
    """What to leave out of a case and of each of its drives, and how long they are to be.

    drives: by label, in the solver's units. kept: label -> effects that a drive is not computed without.
    """
    unlike = measured_like(case)
    whole = _part(Scene(case), tolerance, unlike)
    driven = {
        label: _part(Scene(case, drive), replace(tolerance, kept=tolerance.kept | kept[label]), unlike)
        for label, drive in drives.items()
    }
    best = cheapest(whole, driven, tolerance.asked)
    without, error = _without(case, best.of_case), best.errors[""]
    parts = {"": whole, **driven} if tolerance.slides else {}
    return Decision(
        case,
        without if error is None else replace(without, target_length_error=error),
        whole.taken(best.of_case),
        {label: part.taken(best.of_drives[label]) for label, part in driven.items()},
        {label: part.length(best.errors[label]) for label, part in parts.items()},
        best.seconds,
        sum([whole.seconds, *(part.seconds for part in driven.values())]),
    )


def _part(scene: Scene, tolerance: Tolerance, unlike: str) -> Part:
    """What could be left out of a case, or of a drive where the scene has one. unlike: why nothing is known of it."""
    seconds = _seconds(scene, tolerance)
    there = [each for each in (OF_THE_DRIVE if scene.drive else OF_THE_CASE) if each.there(scene)]
    choices = tuple(_choice(each, scene, seconds, tolerance, unlike) for each in there)
    stays = _why_it_stays(scene, tolerance, unlike)
    return Part(seconds, choices, {} if stays else _shorter(scene, seconds, tolerance), stays)


def _why_it_stays(scene: Scene, tolerance: Tolerance, unlike: str) -> str:
    """Why the whole length of a record or drive is computed."""
    if not tolerance.slides or WHOLE_LENGTH in tolerance.kept:
        return "kept by the file"
    stays = tolerance.lengths_stay
    if scene.drive is not None:
        stays = stays or why_drives_stay(scene.drive, tolerance.asked_for)
    else:
        stays = stays or why_records_stay(scene.case, tolerance.asked_for)
    return stays or (f"not tried with {unlike}" if unlike else "")


def _shorter(scene: Scene, seconds: float, tolerance: Tolerance) -> dict[float, float]:
    """Errors by its length that a record or drive could end at, and the share of its time that is left then."""
    errors = errors_within(tolerance.within)
    if scene.drive is None:
        saves = {error: record_saving(scene.case, error) for error in errors}
    else:
        of_all = drive_saving(scene.drive, scene.case, tolerance.within, tolerance.fitted)
        saves = dict.fromkeys(errors, of_all)
    return {error: 1.0 - saved / seconds for error, saved in saves.items() if saved > LEAST_SAVING * seconds}


def _choice(omission: Omission, scene: Scene, seconds: float, tolerance: Tolerance, unlike: str) -> Choice:
    expected = np.zeros(len(OBSERVABLES))
    found = np.full(len(omission.observables), math.nan) if unlike else tolerance.influences.expected(omission, scene)
    expected[[OBSERVABLES.index(name) for name in omission.observables]] = found
    saves = _saving(omission, scene, seconds, tolerance)
    return Choice(
        omission.name,
        False,
        expected,
        saves,
        _reason(omission, expected, saves / seconds, unlike, tolerance),
        omission.part_of,
    )


def _saving(omission: Omission, scene: Scene, seconds: float, tolerance: Tolerance) -> float:
    """Seconds that leaving an effect out saves; none where a case without it would be refused."""
    try:
        return seconds - _seconds(omission.left_out(scene), tolerance)
    except InvalidInput:
        return 0.0


def _reason(omission: Omission, expected: Vector, saved: float, unlike: str, tolerance: Tolerance) -> str:
    """Why an effect cannot be left out, as far as it alone says."""
    of_asked = expected[tolerance.columns]
    if {omission.name, omission.part_of} & tolerance.kept:
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


def _without(case: Case, names: tuple[str, ...]) -> Case:
    scene = Scene(case)
    for each in OF_THE_CASE:
        if each.name in names:
            scene = each.left_out(scene)
    return scene.case
