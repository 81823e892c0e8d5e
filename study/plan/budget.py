"""The best accuracy whose plan fits a budget of time.

Where the pin slides, accuracy is the uncertainty of plateaus, and records are as long as that takes. With initial contact alone
it is the error of the grid.
"""

import bisect
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Final

from study.discretization.front import load_front
from study.discretization.targets import chosen, reachable, settled
from study.manifest.cases import CampaignCase
from study.manifest.manifest import BOUGHT_BY, Manifest
from study.manifest.parameters import Value
from study.manifest.problems import ManifestError, shown
from study.plan.cost.sliding import misses_target
from study.plan.task import Task

STEPS: Final = 10
"""Uncertainties to a decade that are tried."""
COARSEST: Final = 0.1
DECADES: Final = 4

Estimate = Callable[[Manifest], float]
"""Seconds that a manifest without a budget would take on the budget's ranks; infinite where all would miss what it asks for."""


def spent(manifest: Manifest, estimate: Estimate) -> Manifest:
    """The manifest with what its budget buys.

    Raises ManifestError where nothing fits.
    """
    assert manifest.budget is not None
    tries = list(_uncertainties(manifest) if "slip" in manifest.stages else _errors(manifest))
    fits = bisect.bisect_right(tries, manifest.budget.seconds, key=estimate)
    if not fits:
        seconds = estimate(tries[0])
        members = manifest.ensemble.members
        of_all = f" with all {members} members" if members > 1 else ""
        least = f"about {seconds:.2g} s or more, for {said(tries[0])}{of_all}"
        if not math.isfinite(seconds):
            least = f"limits that a record reaches {said(tries[0])} in"
        raise ManifestError([f"{manifest.path}: budget.time = {shown(manifest.budget.time)}: needs {least}"])
    return tries[fits - 1]


def bought(manifest: Manifest) -> dict[str, Value]:
    """What was chosen for a budget or an accuracy, by field name: the manifest is the one of the plan."""
    limit = {BOUGHT_BY: manifest.limits[BOUGHT_BY]} if manifest.budget and "slip" in manifest.stages else {}
    return {**(chosen(manifest) if manifest.accuracy is not None else {}), **limit}


def said(manifest: Manifest) -> str:
    """What a budget bought, in the words of a manifest."""
    if "slip" in manifest.stages:
        return f"uncertainty = {manifest.limits[BOUGHT_BY]:g} of plateaus"
    return f"accuracy = {manifest.accuracy:g}"


def estimated(cases: Iterable[CampaignCase], tasks: Sequence[Task], ranks: int) -> float:
    """Seconds that a plan takes on so many ranks; infinite where every record is expected to miss its uncertainty."""
    computed = [case.case for case in cases if case.case is not None]
    if computed and all(map(misses_target, computed)):
        return math.inf
    return seconds_on(tasks, ranks)


def seconds_on(tasks: Sequence[Task], ranks: int) -> float:
    """Seconds that tasks take on so many ranks, if nothing waits but for what it needs."""
    chains: dict[str, float] = {}
    for task in tasks:  # needs come first
        chains[task.key] = task.cost + max((chains.get(need, 0.0) for need in task.needs), default=0.0)
    return max(sum(task.cost for task in tasks) / ranks, max(chains.values(), default=0.0))


def _uncertainties(manifest: Manifest) -> Sequence[Manifest]:
    """The manifest with ever smaller uncertainties."""
    sizes = [float(f"{COARSEST * 10.0 ** (-number / STEPS):.2g}") for number in range(STEPS * DECADES + 1)]
    return [replace(manifest, limits={**manifest.limits, BOUGHT_BY: size}, budget=None) for size in sizes]


def _errors(manifest: Manifest) -> Sequence[Manifest]:
    """The manifest with ever smaller errors of the grid; any one where all cases are refused.

    Raises ManifestError where no error was measured.
    """
    errors = reachable(load_front(manifest.front, manifest.front_text), manifest)
    if not errors:
        settled(replace(manifest, accuracy=COARSEST))  # says what was not measured
    return [replace(manifest, accuracy=error, budget=None) for error in errors or [COARSEST]]
