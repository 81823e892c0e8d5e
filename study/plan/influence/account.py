"""What a campaign's tolerance left out, effect by effect, over all its cases and drives."""

from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np

from study.plan.influence.choice import Choice, Length
from study.plan.influence.decision import Decision
from study.plan.influence.length import COUNTS, WHOLE_LENGTH
from study.plan.influence.omissions import OMISSIONS


@dataclass(frozen=True, slots=True)
class Account:
    """One effect in all cases, or drives, that have it."""

    effect: str
    having: int
    """Cases or drives that have it."""
    left_out: int
    """Those that are computed without."""
    influence: float
    """Largest expected change of what is asked for, of those computed without; 0 of none."""
    saves: float
    """Seconds that leaving it out saves by itself, in all of these together."""
    reason: str
    """The most frequent reason why it is not left out; empty where it always is."""


def accounts(decisions: Iterable[Decision], columns: Collection[int]) -> list[Account]:
    """Effects in their order. columns: places of what is asked for among the observables."""
    found: dict[str, list[Choice]] = {name: [] for name in OMISSIONS}
    lengths: list[Length] = []
    for decision in decisions:
        for choice in (*decision.of_case, *(each for of in decision.of_drives.values() for each in of)):
            found[choice.effect].append(choice)
        lengths += decision.lengths.values()
    of_effects = [_account(name, choices, list(columns)) for name, choices in found.items() if choices]
    return [*of_effects, *([_of_lengths(lengths)] if lengths else [])]


def _of_lengths(lengths: list[Length]) -> Account:
    """Whole lengths of records and drives, of which shorter ones go without a part."""
    shorter = [each for each in lengths if each.error is not None]
    reasons = Counter(each.reason for each in lengths if each.error is None)
    return Account(
        WHOLE_LENGTH,
        len(lengths),
        len(shorter),
        COUNTS * max((each.error or 0.0 for each in shorter), default=0.0),
        sum(each.saves for each in shorter),
        reasons.most_common(1)[0][0] if reasons else "",
    )


def _account(name: str, choices: list[Choice], columns: list[int]) -> Account:
    taken = [each for each in choices if each.left_out]
    reasons = Counter(each.reason for each in choices if not each.left_out)
    return Account(
        name,
        len(choices),
        len(taken),
        max((float(np.max(each.influence[columns])) for each in taken), default=0.0),
        sum(each.saves for each in taken),
        reasons.most_common(1)[0][0] if reasons else "",
    )


def times_cheaper(decisions: Collection[Decision]) -> float:
    """Estimated time with all that was asked for, over that without what is left out."""
    return sum(each.seconds_of_all for each in decisions) / sum(each.seconds for each in decisions)
