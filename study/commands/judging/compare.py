"""`nanoslip compare`: two datasets beside each other, what differs and whether by more than their uncertainties."""

import math
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.commands.shared.sources import dataset_of
from nanoslip.study.dataset.compare import Verdict
from nanoslip.study.dataset.ragged import shortened
from nanoslip.study.dataset.variables import OUTCOMES
from nanoslip.study.dataset.verify import (
    KINDS,
    STANDARD_DEVIATIONS,
    Matched,
    NotComparableError,
    Observed,
    Pair,
    differing,
    matched,
    meaning,
    observed,
    over_members,
    unjudged,
)
from nanoslip.study.report.console import Table, print_sentences, print_table, say
from nanoslip.study.report.summary import words
from nanoslip.study.run.launch import CRASHED

WORST: Final = 12
"""The most differences that are shown."""
_SEVERITY: Final = (Verdict.DIFFERENT, None, Verdict.WITHIN)
_WORDS: Final = {
    Verdict.IDENTICAL: "identical",
    Verdict.WITHIN: f"within uncertainties ({STANDARD_DEVIATIONS:g} combined standard deviations)",
    Verdict.DIFFERENT: "beyond",
}


def work(first: Path, second: Path) -> None:
    """Print what differs between two datasets, and end the process with the exit code for the worst of it."""
    with refusals(NotComparableError), dataset_of(first) as one, dataset_of(second) as other:
        pair = over_members(one), over_members(other)
        kinds = [kind for kind in KINDS if all(OUTCOMES[kind][0].name in root for root in pair)]
        print_sentences([f"A: {first}, {one.attrs.get('title', '')}", f"B: {second}, {other.attrs.get('title', '')}"])
        _print_facts(pair)
        found = {kind: matched(pair, kind) for kind in kinds}
        if not any(each.rows for each in found.values()):
            raise NotComparableError(f"{first} and {second} share no computed case")
        seen = [each for kind in kinds for each in observed(pair, kind, found[kind])]
        for kind in kinds:
            _print_rows("drives of cases" if kind else "cases", found[kind], unjudged(pair, kind, found[kind]))
    _print_worst(seen)
    counts = Counter(each.verdict for each in seen)
    unknown = f", {counts[None]} of unknown uncertainty" if counts[None] else ""
    say("observables: " + ", ".join(f"{counts[verdict]} {_WORDS[verdict]}" for verdict in Verdict) + unknown)
    sys.exit(CRASHED if counts[Verdict.DIFFERENT] else 0)


def _print_facts(pair: Pair) -> None:
    facts = differing(pair)
    if facts:
        print_table(Table(("differs", "A", "B"), tuple((each.name, *each.values) for each in facts), labels=2))
    else:
        say("same parameters, campaign and software")
    print_sentences(filter(None, [meaning(pair)]))


def _print_rows(what: str, found: Matched, others: tuple[Sequence[str], Sequence[str]]) -> None:
    """Print how many rows both have, the first of those that one has alone, and what states no uncertainty."""
    pending = f", {found.pending} more without a result in one of them" if found.pending else ""
    say(f"{what} in both: {len(found.rows)}{pending}")
    for name, only in zip("AB", found.only, strict=True):
        if only:
            say(f"{what} in {name} alone: {len(only)}, first {words(only[0])}")
    differ, same = others
    if differ:
        more = ", …" if len(differ) > WORST else ""
        say(
            f"not judged, as they state no uncertainty: {len(differ)} of {len(differ) + len(same)} other numbers differ "
            f"({', '.join(differ[:WORST])}{more})"
        )


def _print_worst(seen: Sequence[Observed]) -> None:
    """Print the largest differences, those beyond their uncertainties first."""
    apart = [each for each in seen if each.verdict is not Verdict.IDENTICAL]
    worst = sorted(apart, key=lambda each: (_SEVERITY.index(each.verdict), -each.apart))[:WORST]
    if worst:
        header = ("observable", "A", "B", "verdict", "apart/σ", "case")
        print_table(Table(header, tuple(map(_row, worst)), labels=4, prose=True))
    if len(apart) > len(worst):
        say(f"and {len(apart) - len(worst)} smaller differences")


def _row(each: Observed) -> tuple[str, ...]:
    here, there = (f"{value:.6g}" if isinstance(value, float) else shortened(str(value)) for value in each.values)
    if here == there and isinstance(each.values[0], str):  # what differs is behind the most frequent text
        here, there = each.values
    verdict = {Verdict.DIFFERENT: "beyond", Verdict.WITHIN: "within"}.get(each.verdict, "not known")  # type: ignore[arg-type]
    apart = "–" if math.isnan(each.apart) else f"{each.apart:.2g}"
    return each.name, here, there, verdict, apart, words(each.label)
