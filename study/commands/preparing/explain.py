"""`nanoslip explain`: what governs one case, which effects matter in it, what limits its accuracy, and what more would cost."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from study.commands.shared.choice import assignments, chosen
from study.commands.shared.exits import Refusal
from study.commands.shared.refusals import refusals
from study.discretization.front import load_front
from study.discretization.targets import settled
from study.execution.forecast import duration
from study.manifest.cases import CampaignCase, expand
from study.manifest.manifest import Manifest, Tolerated
from study.plan.influence.campaign import Decider, read, tolerance_of
from study.plan.influence.choice import Choice, Length
from study.plan.influence.decision import Decision, Tolerance
from study.plan.influence.length import COUNTS, TOLD_BY_LENGTH, WHOLE_LENGTH
from study.plan.influence.limits import limits_of
from study.plan.influence.omissions import OMISSIONS
from study.plan.influence.scene import GROUPS, GROUPS_OF_DRIVES, OBSERVABLES, Scene
from study.report.columns import Table
from study.report.console import print_sentences, print_table, say

USUAL = 0.01
"""The tolerance that effects are judged by where a campaign names none."""


def work(campaign: Path, parameters: tuple[str, ...]) -> None:
    """Print groups, effects, accuracy and cost of the case of a campaign that has these parameters."""
    with refusals():
        manifest = settled(read(campaign))
        asked = manifest.tolerated is not None
        if not asked:
            manifest = _with_a_tolerance(manifest)
        tolerance = tolerance_of(manifest)
        assert tolerance is not None
        case = chosen(expand(manifest), assignments(parameters))
        if case.case is None:
            raise Refusal(f"{case.point}: {case.outcome.message}")
        decider = Decider(manifest, tolerance)
        decider.decided(case)
        _print(case, decider, decider.decisions[case.case_id], asked)


def _with_a_tolerance(manifest: Manifest) -> Manifest:
    """The manifest with the usual tolerance of what it asks for: an ensemble's observable, else what its stages decide."""
    ensemble = manifest.ensemble
    return replace(manifest, tolerated=Tolerated(USUAL, (ensemble.observable,) if ensemble.uncertainty else ()))


def _print(case: CampaignCase, decider: Decider, decision: Decision, asked: bool) -> None:
    assert case.case is not None
    tolerance = decider.tolerance
    say(f"case {case.point}")
    print_table(_groups(case, decider))
    wanted = f"{tolerance.within:g} of {', '.join(tolerance.asked_for)}"
    say(
        f"left out, as its changes stay within {wanted}"
        if asked
        else f"left out if the campaign had [effects] within = {tolerance.within:g} ({wanted})"
    )
    print_table(_effects(decision, tolerance))
    without, every = duration(decision.seconds), duration(decision.seconds_of_all)
    shorter = f" with every effect, {without} without what is left out" if _anything_left_out(decision) else ""
    say(f"estimated time: {every}{shorter}")
    front = load_front(decider.manifest.front, decider.manifest.front_text)
    limits = limits_of(decision if asked else _whole(decision), tolerance, front)
    rows = tuple((each.what, _number(each.size), each.of, _number(each.costs, " ×"), each.half) for each in limits)
    print_table(Table(("limit", "relative error", "of", "half of it costs", "by"), rows, 1, prose=True))
    known = [each for each in limits if math.isfinite(each.size)]
    if known:
        print_sentences([f"what limits it most: {known[0].what}"])


def _anything_left_out(decision: Decision) -> bool:
    of_drives = (each for choices in decision.of_drives.values() for each in choices)
    shorter = any(each.error is not None for each in decision.lengths.values())
    return shorter or any(each.left_out for each in (*decision.of_case, *of_drives))


def _whole(decision: Decision) -> Decision:
    """The case as a campaign without a tolerance computes it."""
    return replace(decision, case=decision.asked, of_case=(), of_drives={}, lengths={}, seconds=decision.seconds_of_all)


def _groups(case: CampaignCase, decider: Decider) -> Table:
    """The dimensionless groups of the case and of its drives."""
    assert case.case is not None
    scenes = {label: Scene(case.case, drive) for label, drive in decider.drives.items()}
    rows = [(each.symbol, _number(each.of(Scene(case.case))), each.name) for each in GROUPS]
    for label, scene in scenes.items():
        of = f" of {label}" if len(scenes) > 1 else ""
        rows += [(each.symbol, _number(each.of(scene)), f"{each.name}{of}") for each in GROUPS_OF_DRIVES]
    return Table(("group", "here", "meaning"), tuple(row for row in rows if row[1] != "0"), 1, prose=True)


def _effects(decision: Decision, tolerance: Tolerance) -> Table:
    rows = [_effect(each, tolerance, "") for each in decision.of_case]
    for label, choices in decision.of_drives.items():
        rows += [_effect(each, tolerance, f" of {label}" if len(decision.of_drives) > 1 else "") for each in choices]
    several = len(decision.of_drives) > 1
    for label, length in decision.lengths.items():
        of = f" of {label}" if several and label else " of the drive" if label else " of the record"
        rows.append(_length(length, tolerance, of))
    header = ("effect", "here", *tolerance.asked_for, "saves", "why")
    return Table(header, tuple(rows), 2, prose=True)


def _effect(choice: Choice, tolerance: Tolerance, of: str) -> tuple[str, ...]:
    changes = (choice.influence[OBSERVABLES.index(name)] for name in tolerance.asked_for)
    here = "left out" if choice.left_out else "on"
    why = choice.reason or OMISSIONS[choice.effect].without
    return (f"{choice.effect}{of}", here, *map(_number, changes), duration(max(choice.saves, 0.0)), why)


def _length(length: Length, tolerance: Tolerance, of: str) -> tuple[str, ...]:
    here, why = (
        ("on", length.reason) if length.error is None else ("shorter", f"ends at ± {length.error:.2g} by its length")
    )
    spent = COUNTS * length.error if length.error is not None else math.nan
    changes = (spent if name in TOLD_BY_LENGTH else math.nan for name in tolerance.asked_for)
    return (f"{WHOLE_LENGTH}{of}", here, *map(_number, changes), duration(max(length.saves, 0.0)), why)


def _number(value: float, unit: str = "") -> str:
    return "" if np.isnan(value) else f"{value:.2g}{unit}"
