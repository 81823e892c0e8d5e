"""`nanoslip plan`: tasks, time, disk, effects and expected flags of a campaign, before anything is computed."""

import itertools
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from nanoslip.study.commands.shared.machine import print_json
from nanoslip.study.commands.shared.measuring import measured_here
from nanoslip.study.commands.shared.plans import Standing, counted, idle_lines, kinds_as_data, print_foreign, standing
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.manifest.cases import CampaignCase
from nanoslip.study.manifest.manifest import CampaignDrive
from nanoslip.study.manifest.reader import effects
from nanoslip.study.plan.grids import choice
from nanoslip.study.plan.outlook import expected_lines, outlook_of, shortages, span_line
from nanoslip.study.plan.plan import Plan, disk_of_plan
from nanoslip.study.report.console import Table, print_sentences, print_table, say
from nanoslip.study.run.launch import cores
from nanoslip.study.run.progress import duration, makespan, roughly


def work(campaign: Path, out: Path | None, ranks: int | None, measure: bool, show_effects: bool, as_json: bool) -> None:
    """Print the plan of a campaign, what is left of it, and which tasks do not fit the memory here.

    ranks: number for which the time is estimated beside that of one, None for the cores here. measure: whether tasks are
    measured here.
    """
    with refusals():
        found = standing(campaign, out, measured_here if measure else None)
        if as_json:
            print_json(_data(found, ranks or cores()))
        else:
            _print(found, ranks or cores(), show_effects)


def _print(found: Standing, ranks: int, show_effects: bool) -> None:
    plan = found.plan
    say(plan.manifest.title)
    print_sentences([*_cases(plan), *idle_lines(plan)])
    if show_effects:
        rows = tuple(
            (each.name, each.setting, _unless_on(each.setting, each.without)) for each in effects(plan.manifest)
        )
        print_table(Table(("effect", "here", "left out where off"), rows, 2, prose=True))
    else:
        off = [each.name for each in effects(plan.manifest) if each.setting != "on"]
        print_sentences(
            [f"effects that are off or vary: {', '.join(off) or 'none'} (--effects says what that leaves out)"]
        )
    _print_counts(found)
    outlook = outlook_of(plan)
    print_sentences(
        [*_factors(found), _time(found, ranks), *_ensembles(found), _disk(plan), *filter(None, [span_line(outlook)])]
    )
    print_sentences(f"expected: {line}" for line in expected_lines(plan, outlook))
    print_sentences(f"refused: {line}" for line in _refused(plan))
    print_sentences(f"does not fit here: {line}" for line in shortages(plan, found.remaining))
    print_foreign(found.foreign, found.campaign, found.into)


def _cases(plan: Plan) -> Iterator[str]:
    """How many cases and drives there are, how many of them are refused, and how the grid was chosen."""
    manifest, ensemble = plan.manifest, plan.manifest.ensemble
    likely = str(ensemble.members) if ensemble.within is None else f"{ensemble.likely} to {ensemble.members}"
    of_members = f" of {likely} members" if ensemble.members > 1 else ""
    refused = sum(case.case is None for case in plan.cases)
    yield f"{counted(len(plan.cases), 'case')}{of_members}, {refused} of them refused"
    if manifest.drive_axes and manifest.drives:
        impossible = sum(drive.drive is None for drive in manifest.drives)
        yield f"{len(manifest.drives)} drives of each case, {impossible} of them refused"
    if manifest.accuracy is not None and (grid := choice(manifest)):
        yield f"accuracy = {manifest.accuracy:g}: {grid}"
    if left_out := manifest.drives_left_out:
        yield f'drives left out, as stages leave out "dynamics": {", ".join(left_out)}'


def _print_counts(found: Standing) -> None:
    header = ("tasks", "left", "core time left", "disk, MB", "memory of one, MB", "finished", "all")
    rows = [
        (
            kind,
            str(each.left),
            duration(each.core_seconds_left),
            _mega(each.disk_bytes),
            _mega(each.memory_bytes),
            str(each.finished),
            str(each.all),
        )
        for kind, each in found.kinds.items()
    ]
    print_table(Table(header, tuple(rows)))


def _factors(found: Standing) -> Iterator[str]:
    """What measured tasks took over what they were predicted to."""
    data = found.measured.as_data()
    factors = [f"{kind} {found.measured.factor(kind):.2g} x" for kind in found.kinds if kind in data]
    if factors:
        yield f"measured over predicted seconds: {', '.join(factors)}"


def _time(found: Standing, ranks: int) -> str:
    """The time that is left, on one rank and on several, and how well it is known."""
    tasks = found.remaining
    if not tasks:
        return "time left: none, all tasks are finished"
    alone, together = (roughly(makespan(tasks, number, found.measured.seconds)) for number in (1, ranks))
    several = f", {together} on {ranks} (--ranks for another number)" if ranks > 1 else ""
    count = found.measured.tasks({task.kind for task in tasks})
    known = f"by what {counted(count, 'task')} took" if count else "to a factor of three"
    return f"time left: {alone} on 1 rank{several}, {known}"


def _ensembles(found: Standing) -> Iterator[str]:
    """What the estimate leaves open where a target decides how many members there are."""
    ensemble = found.plan.manifest.ensemble
    if ensemble.within is not None:
        yield (
            f"estimated for {ensemble.likely} members of each case; to know {', '.join(ensemble.of)} within {ensemble.within:g} "
            f"may take up to {ensemble.members}"
        )


def _disk(plan: Plan) -> str:
    results, dataset = disk_of_plan(plan)
    return f"disk: about {_mega(results)} MB of results, {_mega(dataset)} MB of dataset"


def _refused(plan: Plan) -> Iterator[str]:
    """One line for each reason of a refusal: the first case or drive that has it, and how many more."""
    cases: Iterator[tuple[str, CampaignCase | CampaignDrive]]
    cases = ((case.outcome.message, case) for case in plan.cases if case.case is None)
    drives = ((drive.outcome.message, drive) for drive in plan.manifest.drives if drive.drive is None)
    first: dict[str, CampaignCase | CampaignDrive] = {}
    count: Counter[str] = Counter()
    for message, refused in itertools.chain(cases, drives):
        first.setdefault(message, refused)
        count[message] += 1
    for message, refused in first.items():
        where = refused.point if isinstance(refused, CampaignCase) else f"drive {refused.label}"
        yield f"{where}: {message}" + (f" (and {count[message] - 1} more)" if count[message] > 1 else "")


def _data(found: Standing, ranks: int) -> dict[str, Any]:
    """The plan for scripts."""
    plan = found.plan
    results, dataset = disk_of_plan(plan)
    return {
        "title": plan.manifest.title,
        "cases": len(plan.cases),
        "members": plan.manifest.ensemble.members,
        "refused": [
            {"case": each.parameters, "message": each.outcome.message} for each in plan.cases if each.case is None
        ],
        "drives": [
            {"drive": each.label, "refused": each.outcome.message if each.drive is None else ""}
            for each in plan.manifest.drives
        ],
        "effects": {each.name: each.setting for each in effects(plan.manifest)},
        "tasks": kinds_as_data(found.kinds),
        "seconds_left": {
            str(number): makespan(found.remaining, number, found.measured.seconds) for number in sorted({1, ranks})
        },
        "measured": {kind: found.measured.factor(kind) for kind in found.measured.as_data()},
        "disk_bytes": {"results": results, "dataset": dataset},
        "expected": expected_lines(plan, outlook_of(plan)),
        "does_not_fit": list(shortages(plan, found.remaining)),
        "foreign_results": len(found.foreign),
    }


def _unless_on(setting: str, text: str) -> str:
    return "" if setting == "on" else text


def _mega(number: float) -> str:
    return f"{number / 1e6:.2g}" if number < 1e8 else f"{number / 1e6:.0f}"
