"""`nanoslip frames`: one case of a campaign at work, event by event, as a strip of pictures or a film."""

from pathlib import Path

from nanoslip.solver.outcome import SolverError
from nanoslip.study.commands.shared.choice import assignments, chosen
from nanoslip.study.commands.shared.plans import counted, planned
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.figures.frames.film import frames
from nanoslip.study.figures.frames.moments import events_of
from nanoslip.study.manifest.checker import ManifestError
from nanoslip.study.report.console import say, whole


def work(campaign: Path, selection: tuple[str, ...], events: str, output: Path) -> None:
    """Compute a case's contact after each of some events, and draw it."""
    with refusals(SolverError):
        wanted = events_of(events)
        case = chosen(planned(campaign).cases, assignments(selection))
        if case.case is None:
            raise ManifestError([f"{case.point}: {case.outcome.message}"])
        shown = frames(case.case, wanted, output)
    if len(shown.moments) < len(wanted):
        ended = shown.outcome if not shown.outcome.ok else shown.record.outcome
        reason = f"{ended.ending}: {ended.message}".rstrip(": ")
        say(f"no event {wanted[len(shown.moments)]}: the record ends before ({reason})", stderr=True)
    last = shown.moments[-1].event
    say(f"{whole(f'written: {output}')} ({case.point}; {counted(len(shown.moments), 'moment')} to event {last})")
