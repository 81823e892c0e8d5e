"""Influences on a number beside its starts: the spacing of the nodes that slip, and the stress that a slip drops.

The case is computed again on half and twice the node spacing. Where slips drop no stress, all nodes slide at their
limits, and F is μ_i·W plus the strength's part: that needs no computation.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case
from nanoslip.solver.ensemble import FEWEST, Ensemble
from nanoslip.solver.outcome import Ending, InvalidInput
from nanoslip.solver.parameter import Quantity
from nanoslip.solver.sliding.validity import predict_flags, sliding_friction
from nanoslip.solver.view import with_error
from nanoslip.study.accuracy.effects import Done, compute_tasks, scalar_key, scene_tasks
from nanoslip.study.dataset.variables import DRIVE, alike_starts, factors, mean_in_dataset, variables_by_name
from nanoslip.study.manifest.cases import CampaignCase
from nanoslip.study.manifest.manifest import Manifest, NamedDrive
from nanoslip.study.manifest.parameters import as_written, compact, make_case
from nanoslip.study.results.store import Store, StoreError
from nanoslip.study.run.progress import roughly
from nanoslip.study.tasks.estimates import estimate
from nanoslip.study.tasks.kind import KINDS, result_quantities, uncertain_names
from nanoslip.study.tasks.task import Task, TaskResult

FOLDER: Final = "spacings"
"""Folder beside a dataset with results on other node spacings, separate from the results in the dataset."""
MAIN: Final = ("contact_half_width", "plateau_mean")
"""Main number of a case that does not slide, and of a case that slides."""
OF_FRICTION: Final = ("plateau_mean", "static_friction", "kinetic_friction")
"""Numbers that are μ_i (and what a strength adds) if slips drop no stress, but for what inertia and damper add."""
_WITHOUT_DROP: Final = {"critical_velocity": 0.0}
"""Other numbers if slips drop no stress: a constant friction force does not let a pin stick again."""
SECONDS: Final = 5.0
"""Core seconds that a reader waits for each of both spacings, unless requested otherwise."""


Announce = Callable[[int, float], None]
"""Called before a grid is computed, with its n_x and the estimated core seconds."""
FACTORS: Final = {"finer": (0.5, 2 / 3, 0.8), "coarser": (2.0, 1.5, 1.25)}
"""Side -> node spacings over the case's own, in order of preference: the first of each side that has the number counts."""


@dataclass(frozen=True, slots=True)
class Spacing:
    """A number of a case on another node spacing."""

    factor: float
    """Node spacing over the case's own."""
    n_x: int
    value: float = math.nan
    """Mean over as many members as the case has, or over FEWEST; NaN if unknown."""
    error: float = math.nan
    """Uncertainty by starts."""
    ending: str = ""
    """Outcome of a computation without the number."""
    seconds: float = math.nan
    """Estimated core seconds of a computation that was left out."""

    @property
    def has_value(self) -> bool:
        """True if it has the number."""
        return math.isfinite(self.value)


class Deciding(NamedTuple):
    """Influences on a number of a case beside its starts."""

    variable: str
    spacings: tuple[Spacing, ...]
    """The finer one, then the coarser one; a side without a grid that the scheme takes is not there."""
    without_drop: float
    """The number if slips drop no stress, 0 of a critical velocity; NaN of others, and where that is the case itself."""
    strength: float
    """Share of friction without pressure in `sliding_friction`, of a number of friction; 0 without a strength."""

    @property
    def computed(self) -> list[Spacing]:
        """Spacings whose number is known."""
        return [spacing for spacing in self.spacings if spacing.has_value]


def deciding(
    manifest: Manifest,
    case: CampaignCase,
    variable: str,
    most: float = SECONDS,
    out: Path | None = None,
    drive: NamedDrive | None = None,
    announce: Announce | None = None,
    case_rate: float = math.inf,
) -> Deciding:
    """Compute a number of a case on finer and coarser nodes.

    most: core seconds for each; longer is left out. out: folder of the campaign, where results are kept for the next time.
    drive: the drive of a drive's number; None for the first drive. case_rate: core seconds over estimated ones of the case
    itself, if it has just been computed.
    """
    assert case.case is not None
    if drive is None and variable in uncertain_names(KINDS[DRIVE]):
        drive = next(spacing.drive for spacing in manifest.drives if spacing.drive)
    kept = Store(out / FOLDER) if out else None
    search = _Search(manifest, case, variable, most, drive, kept, announce, case_rate)
    # The cheaper grid shows what the finer one takes.
    coarser = search.best(FACTORS["coarser"])
    spacings = (search.best(FACTORS["finer"]), coarser)
    friction, without_drop = sliding_friction(case.case), math.nan
    # At a residual shear of 1 slips drop no stress anyway: that number is the case's own.
    if case.case.slip_rule.residual_shear < 1.0 and math.isfinite(friction):
        without_drop = friction if variable in OF_FRICTION else _WITHOUT_DROP.get(variable, math.nan)
    strong = variable in OF_FRICTION and case.case.slip_rule.strength > 0.0
    strength = 1.0 - case.case.intrinsic_friction / friction if strong else 0.0
    return Deciding(variable, tuple(spacing for spacing in spacings if spacing), without_drop, strength)


def numbers_of_tasks() -> frozenset[str]:
    """Numbers that can be computed on another node spacing."""
    kinds = ("contact", "record", "path", DRIVE)
    names = (uncertain_names(KINDS[kind]) for kind in kinds)
    return frozenset[str]().union(*names)


@dataclass
class _Search:
    """Computes a number of a case on other node spacings."""

    manifest: Manifest
    case: CampaignCase
    variable: str
    most: float
    drive: NamedDrive | None
    kept: Store | None
    """Results of before."""
    announce: Announce | None
    case_rate: float
    rate: float = 0.0
    """Core seconds over estimated ones, of the last spacing that was computed or of the case itself."""

    def best(self, factors: Iterable[float]) -> Spacing | None:
        """The first of these spacings that has the number, else the first that the scheme takes."""
        first = None
        for other in filter(None, map(self._case_with_spacing, factors)):
            spacing = self._compute_spacing(other)
            if spacing.has_value:
                return spacing
            first = first or spacing
        return first

    def _case_with_spacing(self, factor: float) -> Case | None:
        """The case with nodes this much further apart, about; None where its scheme or settings exclude that, or where the grid
        has a validity flag that the case's own has not: its number would be no measure of the spacing's influence."""
        names = self.case.labels.names
        labels = dict(zip(names, self.case.values, strict=True))
        parameters = dict(self.manifest.fixed)
        # What a case leaves open is as the campaign has it.
        stated = {name: value for name, value in labels.items() if value is not None}
        parameters.update(stated)
        # All schemes take odd numbers of nodes.
        nodes = 2 * round(self._spaces / factor / 2) + 1
        assert self.case.case is not None
        # A scheme may take only some numbers of nodes, and others only below a limit.
        with suppress(InvalidInput):
            other = make_case({**parameters, "n_x": nodes})
            own_doubts = predict_flags(self.case.case)
            doubts = {*predict_flags(other)} - {*own_doubts}
            # Rounding to an odd number may have led back to the case's own grid.
            return other if nodes != self._spaces + 1 and not doubts else None
        return None

    @property
    def _spaces(self) -> int:
        assert self.case.case is not None
        return self.case.case.slab.n_x - 1

    def _compute_spacing(self, other: Case) -> Spacing:
        factor = self._spaces / (other.slab.n_x - 1)
        spacing = Spacing(factor, other.slab.n_x)
        tasks = self._affordable_tasks(other)
        having_number = [task for _, task in tasks if self.variable in uncertain_names(KINDS[task.kind])]
        last = having_number[-1]
        every = [task for _, task in tasks]
        wanted = [task for task in every if task is last or task.kind == "record"]
        stored: list[TaskResult | None] = []
        if self.kept:
            stored = [self.kept.find(task.key) for task in wanted]
        results = [result for result in stored if result]
        if len(results) < len(wanted):
            expected = sum(estimate(task)[0] for _, task in tasks)
            # Before anything has run the estimate alone decides, which is within a factor of ten.
            seconds = (self.rate or 1.0) * expected
            if seconds > self.most:
                return replace(spacing, seconds=seconds)
            if self.announce:
                self.announce(spacing.n_x, seconds)
            # The first computation loads libraries and compiles kernels, which is not to be measured.
            if not self.rate:
                compute_tasks(self._tasks(other, Ensemble()), {})
            done: Done = {}
            compute_tasks(tasks, done)
            rate = sum(seconds for _, seconds in done.values()) / expected
            # What does not grow with the nodes raises both: the lower one holds for finer nodes.
            self.rate = min(rate, self.case_rate)
            results = [done[task.key][0] for task in wanted]
            _keep(results, self.kept)
        return self._with_value(spacing, results)

    def _affordable_tasks(self, other: Case) -> list[tuple[str, Task]]:
        """Tasks of as many members as the case has if they take no longer than allowed, else of FEWEST."""
        ensemble = self.manifest.ensemble
        members = max(ensemble.likely, FEWEST)
        tasks = self._tasks(other, Ensemble(members, places=ensemble.places))
        expected = sum(estimate(task)[0] for _, task in tasks)
        if (self.rate or 1.0) * expected <= self.most:
            return tasks
        return self._tasks(other, Ensemble(FEWEST, places=ensemble.places))

    def _with_value(self, spacing: Spacing, results: Sequence[TaskResult]) -> Spacing:
        """With the mean and its ± as a dataset would have them. results: of the record, if any, and last of the number's task."""
        result = results[-1]
        spacing = replace(spacing, ending=result.outcome.ending.value)
        scalars = _as_row(result)
        key = scalar_key(self.variable, result)
        if key not in scalars:
            return spacing
        number = result_quantities(KINDS[result.kind])[key]
        mean, unit = mean_in_dataset(scalars, key, number), self._unit(number)
        records = [_as_row(stated) for stated in results if stated.kind == "record"]
        # Members whose records are the same are one start, of which no mean has a ±.
        one_start = any(bool(alike_starts(record)[0]) for record in records)
        error = math.nan if one_start else float(mean.uncertainty[0]) * unit
        value = float(mean.mean[0]) * unit
        return replace(spacing, value=value, error=error)

    def _tasks(self, other: Case, ensemble: Ensemble) -> list[tuple[str, Task]]:
        drives = {}
        if self.drive:
            drives[""] = self.drive.dimensionless(self.manifest.scales)
        return scene_tasks(self.manifest, other, drives, ensemble, (self.variable,))

    def _unit(self, number: Quantity) -> float:
        """Factor from the solver's unit of the number to that of the dataset."""
        assert self.case.case is not None
        by_measure = factors(self.case.case, self.manifest.scales, self.drive)
        return by_measure[number.per]


def _as_row(result: TaskResult) -> dict[str, Floats]:
    """Scalars of a result in the shape of a dataset with one case, each (1, members)."""
    return {name: np.array([values], float) for name, values in result.scalars.items()}


def _keep(results: Sequence[TaskResult], kept: Store | None) -> None:
    """Keep results for the next time, unless the folder can only be read."""
    if kept:
        with suppress(StoreError):
            kept.prepare()
            for result in results:
                kept.write(result, shared=True)


def deciding_lines(answer: Deciding, title: str = "") -> Iterator[str]:
    """Each influence in a line: `with half the node spacing: 0.42 ± 0.01`, `with twice the node spacing: 0.48 ± 0.02`.

    title: symbol of the number, where a line is to name it.
    """
    unit = as_written(variables_by_name()[answer.variable].units)
    for spacing in answer.computed:
        value = compact(spacing.value, unit, spacing.error)
        # A pure number takes no prefix.
        if unit == "1":
            value = with_error(spacing.value, spacing.error)
        yield f"{title}with {times(spacing)} the node spacing: {value}"
    yield from (missing_words(spacing) for spacing in answer.spacings if not spacing.has_value)
    if math.isfinite(answer.without_drop):
        value = f"{answer.without_drop:.3g}" if answer.variable in OF_FRICTION else "no stick-slip"
        yield f"{title}if a slipping node keeps its full shear: {value}"


def times(spacing: Spacing) -> str:
    """A node spacing over the case's own, in words: `half`, `twice`, `0.67 times`."""
    words = {"0.5": "half", "2": "twice"}
    return words.get(factor := f"{spacing.factor:.2g}", f"{factor} times")


def missing_words(spacing: Spacing) -> str:
    """Reason why a number is not known on another spacing, in words."""
    if math.isfinite(spacing.seconds):
        return f"{times(spacing)} the node spacing takes {roughly(spacing.seconds)} (n_x = {spacing.n_x})"
    side = "finer" if spacing.factor < 1.0 else "coarser"
    why = _WHY.get(spacing.ending, f"{spacing.ending.replace('_', ' ')}, so not known")
    return f"on {side} nodes {why}"


_WHY: Final = {
    Ending.NO_SLIP.value: "the pin sticks, or follows in micro slips",
    Ending.NO_PLATEAU.value: "friction does not become steady",
    Ending.COMPLETED.value: "not known",
}
"""Ending of a computation without the number -> reason, in words."""
