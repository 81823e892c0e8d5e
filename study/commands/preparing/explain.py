"""`nanoslip explain`: one case before it is computed: its estimated time, the error of its grid, and what half of that costs."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Final

from nanoslip.solver.case import Case
from nanoslip.study.accuracy.effects import scenes_of
from nanoslip.study.commands.preparing.effects import print_changes
from nanoslip.study.commands.shared.choice import assignments, chosen
from nanoslip.study.commands.shared.exits import Refusal
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.cost import compliance_seconds, record_seconds, touch_seconds
from nanoslip.study.plan.grids import Front, load_front, settled
from nanoslip.study.plan.plan import Planning
from nanoslip.study.report.console import print_sentences, say
from nanoslip.study.run.progress import roughly


def work(campaign: Path, parameters: tuple[str, ...], show_effects: bool) -> None:
    """Print the cost, the grid's error and perhaps the effects of the case of a campaign that has these parameters."""
    with refusals():
        manifest = settled(load_manifest(campaign))
        cases = list(expand(manifest))
        case = chosen(cases, assignments(parameters))
        if case.case is None:
            raise Refusal(f"{case.point}: {case.outcome.message}")
        place = cases.index(case)
        planning = Planning(manifest, numbers=range(place, place + 1))
        planning.go_on()
        seconds = sum(task.cost for task in planning.plan().tasks)
        front = load_front(manifest.front, manifest.front_text)
        say(f"case {case.point}")
        grid = _of_grid(case.case, front, "slip" in manifest.stages)
        print_sentences([f"estimated time, to a factor of three: {roughly(seconds)}", grid])
        if show_effects:
            print_changes(campaign, scenes_of(manifest, [case], SHOWN))


SHOWN: Final = 3
"""Drives whose effects are shown: the first, the middle and the last one."""


def _of_grid(case: Case, front: Front, slides: bool) -> str:
    """The error of the grid, and the fastest measured grid that has half of it."""
    error = front.expected_error(case)
    if math.isnan(error):
        return "error of the grid: not measured for such a slab and contact"
    said = f"error of the grid, of contact, approach and stiffness: {error:.2g}"
    contacts = front.comparable(case)
    better = [
        row
        for row in front.like(case.slab)
        if row.slab.scheme.name == case.slab.scheme.name and front.worst_error(row.slab, contacts) <= 0.5 * error
    ]
    if not better:
        return f"{said}; no measured grid of this scheme has half of it"
    best = min(better, key=lambda row: row.seconds)
    times = _seconds(replace(case, slab=best.slab), slides) / _seconds(case, slides)
    grid = f"n_x = {best.slab.n_x}, {best.slab.scheme} (another surface for what slips)"
    return f"{said}; half of it costs {times:.2g} × the time: {grid}"


def _seconds(case: Case, slides: bool) -> float:
    return compliance_seconds(case, slides) + (record_seconds(case) if slides else touch_seconds(case))
