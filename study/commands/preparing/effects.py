"""`nanoslip effects`: what a campaign's numbers lose without each of its effects, and the time that this saves."""

import math
from pathlib import Path

from nanoslip.study.accuracy.effects import Influence, Scenes, influences, scenes_of
from nanoslip.study.commands.shared.plans import counted
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.grids import settled
from nanoslip.study.report.console import Table, print_sentences, print_table, say

_HEADER = ("effect", "number", "change ±", "seconds ×", "setting")


def work(campaign: Path, cases: int, members: int | None) -> None:
    """Compute a few cases with everything and without each effect, and print the changes."""
    with refusals():
        manifest = settled(load_manifest(campaign))
        scenes = scenes_of(manifest, list(expand(manifest)), cases, members)
        print_changes(campaign, scenes)


def print_changes(campaign: Path, scenes: Scenes) -> None:
    """Compute these scenes with everything and without each effect, and print the changes."""
    size = f"{counted(len(scenes.cases), 'case')}, {counted(scenes.ensemble.members, 'member')} each"
    say(f"{campaign}: computing {size}, with everything and without one effect at a time", stderr=True)
    found, failures = influences(scenes)
    print_sentences(f"case {number}: {each.point}" for number, each in enumerate(scenes.cases, start=1))
    print_sentences((f"with everything, {each}" for each in failures), "failed")
    if not found:
        say("nothing to compare: no number of these cases depends on an effect that can be left out")
        return
    rows = tuple(map(_row, found))
    failed = frozenset(place for place, each in enumerate(found) if each.problems)
    print_table(Table(_HEADER, rows, labels=2, asked=2, failed=failed, prose=True))
    say(
        "Below each effect: what leaves it out, and where the change is largest. seconds ×: without it, over everything"
    )


def _row(each: Influence) -> tuple[str, ...]:
    largest, known = each.largest, math.isfinite(each.largest.change)
    change = f"{largest.change:+.2g} ± {largest.uncertainty:.1g}" if largest.change else "0"
    where = f"case {largest.where}"
    named = not known or any(problem.startswith(f"{where}: ") for problem in each.problems[:1])
    sentences = [each.setting, *([] if named else [where]), *each.problems[:1]]
    return (
        each.effect,
        each.variable,
        change if known else "–",
        f"{each.seconds:.2g}" if known else "–",
        "; ".join(sentences),
    )
