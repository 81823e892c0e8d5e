"""What of a tolerance can be spent on shorter records and drives: up to which error by their lengths, and what that saves.

Lengths are worth the most time, and what they leave open is known: `length_error` of a case and of a drive is the relative
standard error that a longer one would make smaller. Twice that holds in 95 of 100, as what is expected of left-out effects does.
Effects, record and drive err independently: what they change adds up as squares do, to 95 of 100 again.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from solver.case import Case
from solver.drive import Drive
from study.plan.cost.drive import drive_seconds
from study.plan.cost.seconds import record_seconds, shorter_record_seconds

WHOLE_LENGTH: Final = "whole_length"
"""Name of what a shorter record or drive goes without, among the effects."""
COUNTS: Final = 2.0
"""So many standard errors of a length count as change."""
SHARES: Final = (0.5, 0.4, 0.3, 0.2, 0.14, 0.1, 0.07, 0.05)
"""Errors that are tried, over the tolerance: few, so that cases share tasks and plans are quickly made."""
LOOKING: Final = 3e-3
"""Seconds that go into looking whether a record, or a drive, is long enough: some ten looks of a third of a millisecond."""
TOLD_BY_LENGTH: Final = ("plateau_mean", "kinetic_friction")
"""Observables that say when a record or a drive is long enough."""
HANGS_ON_LENGTH: Final = ("peak_friction", "mean_step", "static_friction")
"""Observables that depend on it and do not say so."""


def errors_within(within: float) -> tuple[float, ...]:
    """Errors by length that a tolerance allows for, the largest first."""
    return tuple(float(f"{share * within:.3g}") for share in SHARES)


def why_records_stay(case: Case, asked_for: Sequence[str]) -> str:
    """Why a record is computed to its whole length; empty where it may be shorter."""
    if case.aimed:
        return "kept by the file"
    hanging = [name for name in HANGS_ON_LENGTH if name in asked_for]
    if hanging:
        return f"{hanging[0]} depends on it"
    return "" if set(TOLD_BY_LENGTH) & set(asked_for) else "nothing that is asked for says when it is enough"


def why_drives_stay(drive: Drive, asked_for: Sequence[str]) -> str:
    """The same of a drive."""
    if drive.uncertainty is not None or drive.length_error is not None or drive.max_slips is not None:
        return "kept by the file"
    if "static_friction" in asked_for:
        return "static_friction depends on it"
    return "" if "kinetic_friction" in asked_for else "nothing that is asked for says when it is enough"


def record_saving(case: Case, error: float) -> float:
    """Seconds that a record saves which ends as soon as its error by its length is so small, less what looking takes."""
    return record_seconds(case) - shorter_record_seconds(case, error) - LOOKING


def drive_saving(drive: Drive, case: Case, within: float, fitted: bool) -> float:
    """Seconds that a drive saves by the largest error of its length within a tolerance; smaller ones hardly cost more."""
    shorter = replace(drive, length_error=errors_within(within)[0])
    return drive_seconds(drive, case, fitted) - drive_seconds(shorter, case, fitted) - LOOKING
