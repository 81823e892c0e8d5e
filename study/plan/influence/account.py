"""What a campaign's tolerance left out, effect by effect, over all its cases and drives."""

from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np

from study.plan.influence.decision import Choice, Decision
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
    for decision in decisions:
        for choice in (*decision.of_case, *(each for of in decision.of_drives.values() for each in of)):
            found[choice.effect].append(choice)
    return [_account(name, choices, list(columns)) for name, choices in found.items() if choices]


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
