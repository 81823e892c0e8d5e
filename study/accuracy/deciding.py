"""Influences on a number beside its starts: the spacing of the nodes that slip, and the stress that a slip drops.

The case is computed again on half and twice the node spacing. Where slips drop no stress, all nodes slide at μ_i times their
pressure, and F is μ_i·W: that needs no computation.
"""

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.dynamics.regime import CriticalPoint
from nanoslip.solver.ensemble import FEWEST, Ensemble, mean_of
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import quantities
from nanoslip.solver.view import with_error
from nanoslip.study.accuracy.effects import Done, compute, key_of, tasks_of
from nanoslip.study.dataset.variables import factors
from nanoslip.study.manifest.cases import CampaignCase
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.parameters import as_written, compact, make_case
from nanoslip.study.plan.cost import estimate
from nanoslip.study.plan.task import Task, TaskResult
from nanoslip.study.results.store import Store, StoreError
from nanoslip.study.run.progress import roughly

MAIN: Final = ("contact_half_width", "plateau_mean")
"""Main number of a case that does not slide, and of one that does."""
SECONDS: Final = 5.0
"""Core seconds that a reader waits for what decides, for each of both spacings, unless asked for."""
FOLDER: Final = "spacings"
"""Folder beside a dataset with results on other spacings, apart from those that the dataset is made of."""


@dataclass(frozen=True, slots=True)
class Spacing:
    """A number of a case on another node spacing."""

    word: str
    """`half` or `twice` the node spacing."""
    n_x: int
    value: float = math.nan
    """Mean over FEWEST members; NaN if unknown."""
    error: float = math.nan
    """Uncertainty by starts."""
    problem: str = ""
    """Reason if it is unknown."""


class Deciding(NamedTuple):
    """Influences on a number of a case beside its starts."""

    variable: str
    spacings: tuple[Spacing, ...]
    without_drop: float
    """F/W if slips drop no stress; NaN for another number, and where that is the case itself."""

    @property
    def computed(self) -> list[Spacing]:
        """Spacings whose number is known."""
        return [each for each in self.spacings if math.isfinite(each.value)]


def deciding(
    manifest: Manifest, case: CampaignCase, variable: str, most: float = SECONDS, out: Path | None = None
) -> Deciding:
    """Compute a number of a case on half and twice its node spacing. most: core seconds for each; longer is left out.

    out: folder of the campaign, where results are kept for the next time.
    """
    assert case.case is not None
    spaces, own = case.case.slab.n_x - 1, manifest.ensemble
    drive = None if variable in MAIN else next(each.drive for each in manifest.drives if each.drive)
    unit = factors(case.case, manifest.scales, drive)[quantities(CriticalPoint)[variable].per if drive else ""]
    ensemble = Ensemble(FEWEST, places=own.places)
    found, rate, kept = list[Spacing](), 0.0, Store(out / FOLDER) if out else None
    for word, n_x in (
        ("twice", round(spaces / 2) + 1),
        ("half", 2 * spaces + 1),
    ):  # the cheap one tells what the other takes
        try:
            other = _on(manifest, case, n_x)
        except InvalidInput as error:
            found.append(Spacing(word, n_x, problem=str(error)))
            continue
        tasks = _tasks(manifest, other, ensemble, variable)
        last = kept.find(tasks[-1][1].key) if kept else None
        if not last:
            expected = sum(estimate(task)[0] for _, task in tasks)
            if (seconds := (rate or 1.0) * expected) > most:
                found.append(Spacing(word, n_x, problem=f"left out, {roughly(seconds)}"))
                continue
            if not rate:  # loads libraries and compiles kernels
                compute(_tasks(manifest, other, Ensemble(), variable), {})
            done: Done = {}
            compute(tasks, done)
            rate = sum(seconds for _, seconds in done.values()) / expected
            last = done[tasks[-1][1].key][0]
            _keep(last, kept)
        found.append(_spacing(word, n_x, variable, last, unit))
    rule = case.case.slip_rule
    drops = variable == MAIN[True] and rule.residual_shear < 1.0 and math.isfinite(case.case.intrinsic_friction)
    return Deciding(variable, tuple(found[::-1]), case.case.intrinsic_friction if drops else math.nan)


def _keep(result: TaskResult, kept: Store | None) -> None:
    """Keep a result for the next time, unless the folder can only be read."""
    if kept:
        with suppress(StoreError):
            kept.prepare()
            kept.write(result, shared=True)


def _on(manifest: Manifest, case: CampaignCase, n_x: int) -> Case:
    """The case with this number of nodes. Raises InvalidInput."""
    own = zip(case.labels.names, case.values, strict=True)
    return make_case({**manifest.fixed, **{name: value for name, value in own if value is not None}, "n_x": n_x})


def _tasks(manifest: Manifest, case: Case, ensemble: Ensemble, variable: str) -> list[tuple[str, Task]]:
    pulled = [] if variable in MAIN else [each for each in manifest.drives if each.drive]
    drives = {each.label: each.drive.dimensionless(manifest.scales) for each in pulled if each.drive}
    return tasks_of(manifest, case, drives, ensemble, (variable,))


def _spacing(word: str, n_x: int, variable: str, last: TaskResult, unit: float) -> Spacing:
    """The number of a case on another spacing, from the result of its last task."""
    values = last.scalars.get(key_of(variable, last), [math.nan])
    mean = mean_of(np.array(values, float))
    known = math.isfinite(mean.mean)
    problem = "" if known else f"{last.outcome.ending} with n_x = {n_x}"
    return Spacing(word, n_x, float(mean.mean) * unit, float(mean.uncertainty) * unit, problem)


def deciding_words(found: Deciding, title: str = "") -> Iterator[str]:
    """Word influences as parts of a sentence: `0.42 ± 0.01 to 0.48 ± 0.02 with half and twice the node spacing`.

    title: of the number.
    """
    known = found.computed
    unit = "" if found.variable in MAIN else as_written(quantities(CriticalPoint)[found.variable].units)
    values = dict.fromkeys(
        compact(each.value, unit, each.error) if unit else with_error(each.value, each.error)
        for each in sorted(known, key=lambda each: each.value)
    )
    unknown = "".join(f" ({each.word}: {each.problem})" for each in found.spacings if each not in known)
    if known:
        yield f"{title}{' to '.join(values)} with {' and '.join(each.word for each in known)} the node spacing{unknown}"
    elif unknown:
        yield f"other node spacings{unknown}"
    if math.isfinite(found.without_drop):
        yield f"{found.without_drop:.3g} if slips drop no stress"
