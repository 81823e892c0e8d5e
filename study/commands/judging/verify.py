"""`nanoslip verify`: compute a dataset again from itself alone, and compare."""

import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from nanoslip.study.commands.shared.exits import Refusal
from nanoslip.study.commands.shared.machine import print_json
from nanoslip.study.commands.shared.plans import counted
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.dataset import file
from nanoslip.study.dataset import verify as verification
from nanoslip.study.dataset.compare import Finding, Verdict
from nanoslip.study.plan.tasks import Task
from nanoslip.study.report.console import console, print_sentences, say
from nanoslip.study.report.summary import MOST_ROWS
from nanoslip.study.results.store import Store
from nanoslip.study.run.launch import CRASHED, FAILURES, INTERRUPTED, computing
from nanoslip.study.run.mpi import open_farm
from nanoslip.study.run.progress import open_progress


def work(dataset: Path, sample: int | None, as_json: bool) -> None:
    """Compute a dataset's cases again, print which differ, and end the process with the exit code for the worst."""
    dataset = dataset / file.FILE if dataset.is_dir() else dataset
    with refusals(), TemporaryDirectory() as folder, file.reading(dataset) as found:
        file.check(dataset)  # however large it is
        plan = verification.rebuilt(found, dataset)
        cases = verification.computed(plan, found)
        failed = verification.failed(plan, found)
        pending = len(plan.cases) - len(cases) - failed
        if not cases:
            said = ", ".join(_skipped(pending, failed))
            raise Refusal(f"{dataset}: no case has a result to compute again: {said}")
        chosen = verification.sample(cases, sample)
        say(f"{plan.manifest.title}: {len(chosen)} of {len(plan.cases)} cases to recompute", stderr=True)
        other = verification.other_software(found)
        code = _recompute(verification.tasks_of(plan, chosen, found), Path(folder))
        if not code:
            findings = list(verification.compare(found, plan, chosen, Store(Path(folder))))
            left = _Left(pending, failed, len(cases) - len(chosen))
            if as_json:
                print_json(_data(findings, dataset, left, other))
            else:
                _print_findings(findings, dataset, left, other)
            code = CRASHED if any(each.verdict is Verdict.DIFFERENT for each in findings) else 0
    sys.exit(code)


class _Left(NamedTuple):
    """Cases that were not recomputed."""

    pending: int
    failed: int
    """For want of time or memory, or as a process died: nobody knows whether they would again."""
    not_in_sample: int


def _recompute(tasks: tuple[Task, ...], out: Path) -> int:
    """Compute tasks in this process alone; returns an exit code."""
    Store(out).prepare()
    with open_farm(computing(out), serial=True) as farm, open_progress(tasks, console(stderr=True)) as progress:
        tally = farm.run(tasks, progress)
    if tally.halt:
        raise Refusal(tally.halt)
    if tally.interrupted:
        say("interrupted: nothing is compared", stderr=True)
        return INTERRUPTED
    if tally.crashed:
        say(f"{counted(tally.crashed, 'task')} failed, or needed one that did: nothing is compared", stderr=True)
        return FAILURES
    return 0


def _print_findings(findings: list[Finding], path: Path, left: _Left, other: str) -> None:
    """Print a line for each case that is not bit-identical, those that differ first, and the counts of all."""
    if other:
        say(other)
    for verdict, sort in ((Verdict.DIFFERENT, "failed"), (Verdict.WITHIN, "")):
        found = [f"{verdict}: {each.label}: {each.remark}" for each in findings if each.verdict is verdict]
        print_sentences(found[:MOST_ROWS], sort)
        if len(found) > MOST_ROWS:
            say(f"{verdict}: {len(found) - MOST_ROWS} more")
    parts = [f"{count} {verdict}" for verdict, count in _counts(findings).items()]
    parts += [f"{said}, skipped" for said in _skipped(left.pending, left.failed)]
    parts += [f"{left.not_in_sample} not in the sample"] if left.not_in_sample else []
    say(f"{path}: cases: {', '.join(parts)}; {findings[0].label}: {findings[0].verdict}")


def _skipped(pending: int, failed: int) -> list[str]:
    """Counts of the cases without a result, of each sort that there is."""
    return [f"{count} {sort}" for count, sort in ((pending, "pending"), (failed, "failed")) if count]


def _counts(findings: list[Finding]) -> dict[str, int]:
    counts = Counter(each.verdict for each in findings[1:])  # the first is what all cases share
    return {str(verdict): counts[verdict] for verdict in Verdict}


def _data(findings: list[Finding], path: Path, left: _Left, other: str) -> dict[str, Any]:
    """The comparison for scripts."""
    shared, *cases = (
        {"case": each.label, "verdict": str(each.verdict), "difference": each.remark} for each in findings
    )
    return {
        "dataset": str(path),
        "other_software": other,
        "counts": _counts(findings) | left._asdict(),
        "shared": shared,
        "cases": cases,
    }
