"""Whether a run ends before all is computed, and what it says then."""

from nanoslip.study.commands.shared.exits import Refusal
from nanoslip.study.commands.shared.plans import counted
from nanoslip.study.report.console import say
from nanoslip.study.results.store import Lease
from nanoslip.study.run.dispatch import Tally
from nanoslip.study.run.journal import Journal


def broken_off(journal: Journal, tally: Tally, lease: Lease) -> bool:
    """Whether a run ends before all is computed; says why. Raises Refusal where no task could be finished any more."""
    journal.computed(tally)
    lost = lease.look()
    if tally.halt:
        raise Refusal(f"{tally.halt}; what is finished is kept: run again to continue")
    if tally.interrupted and not lost:
        _print_interrupted(tally)
    return bool(lost) or tally.interrupted


def _print_interrupted(tally: Tally) -> None:
    late = f"{counted(tally.outlasting, 'task')} left would outlast this job; " if tally.outlasting else ""
    say(f"interrupted: {late}what is finished is kept; run again to continue", stderr=True)
