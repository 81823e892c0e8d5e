"""Expected number of members until an ensemble reaches its target uncertainty, to a factor of two."""

import math
from collections.abc import Iterable
from typing import Final, NamedTuple

from solver.case import Case
from solver.last import of_the_last
from solver.sliding.sampling import expected_of_ensemble
from study.manifest.cases import CampaignCase
from study.manifest.manifest import FIRST_MEMBERS, Ensemble
from study.plan.cost.sliding import expected_displacement, expected_peak_scatter, expected_uncertainty, sampling_over
from study.plan.kinds.ensemble import SHORT, one_event
from study.plan.task import Task

MISSED: Final = 2.0
"""An uncertainty is taken to be out of reach where so many times as much is expected of all members."""


class Expected(NamedTuple):
    """Expected sizes of a campaign's ensembles."""

    fewest: int
    """Members of the ensemble that needs fewest."""
    most: int
    missed: int
    """Ensembles whose uncertainty is out of reach: part of it their members have in common."""
    ensembles: int


def expected_of(cases: Iterable[CampaignCase], ensemble: Ensemble) -> Expected | None:
    """None without a target, or where all cases are refused."""
    first = [case.case for case in cases if case.case and case.values[-1] == 0] if ensemble.uncertainty else []
    if not first:
        return None
    counts = [expected_members(case, ensemble) for case in first]
    missed = sum(
        _uncertainty(case, ensemble, ensemble.members) > MISSED * (ensemble.uncertainty or 0.0) for case in first
    )
    return Expected(min(counts), max(counts), missed, len(first))


def expected_members(case: Case, ensemble: Ensemble) -> int:
    """Of one case, at most all."""
    alone = _member(case)[1] >= SHORT and not one_event(ensemble.observable)
    found = FIRST_MEMBERS if alone else min(2 * FIRST_MEMBERS, ensemble.members)
    while found < ensemble.members and _uncertainty(case, ensemble, found) > (ensemble.uncertainty or 0.0):
        found *= 2
    return found


def likely(task: Task, ensemble: Ensemble) -> bool:
    """Whether a task is expected to be needed."""
    if not task.batch or task.case is None:
        return True
    return FIRST_MEMBERS << (task.batch - 1) < expected_members(task.case, ensemble)


def _uncertainty(case: Case, ensemble: Ensemble, members: int) -> float:
    if one_event(ensemble.observable):
        return expected_peak_scatter(case) / math.sqrt(members)
    stated, spacings, drawn = _member(case)
    return expected_of_ensemble(stated, spacings, members, drawn)


@of_the_last
def _member(case: Case) -> tuple[float, float, float]:
    """What one member's record is expected to state as its relative uncertainty, its length in node spacings, and what of the
    uncertainty is the draw of its nodes' μ_i."""
    spacings = expected_displacement(case) / case.slab.spacing
    return expected_uncertainty(case), spacings, sampling_over(case, spacings).drawn
