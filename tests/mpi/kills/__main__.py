"""Kill runs at random moments and write the table of what came of it: `python -m tests.mpi.kills --trials 100`."""

import argparse
import signal
import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.mpi.kills import trial
from tests.mpi.kills.campaigns import CAMPAIGNS
from tests.mpi.kills.running import undisturbed
from tests.mpi.kills.trial import KINDS, Trial
from tests.written_tables import put

README = Path(__file__).parents[1] / "README.md"
ENOUGH = 3
"""Trials of each kind that make a table."""
HEAD = (
    "| killed | by | trials | results kept by then | exit codes, and how often | all ended after, s | went on in, s | broken |",
    "|---|---|---|---|---|---|---|---|",
)


def table(found: list[Trial]) -> list[str]:
    """The trials, by what was killed and how."""
    rows = [_row(target, sent, found) for target, sent in KINDS]
    late, broken = sum(not each.killed for each in found), sum(bool(each.broken) for each in found)
    said = f"{len(found)} trials, {broken} broken; {late} runs had ended before what was to be killed was there."
    return [said, "", *HEAD, *(row for row in rows if row)]


def _row(target: str, sent: signal.Signals, found: list[Trial]) -> str:
    mine = [each for each in found if (each.target, each.sent) == (target, sent)]
    if not mine:
        return ""
    counted = sorted(Counter(each.code for each in mine).items())
    codes = ", ".join(f"{code} ({times})" for code, times in counted)
    kept = [each.finished for each in mine]
    ended, went_on = max(each.ended_after for each in mine), max(each.went_on_in for each in mine)
    broken = "; ".join(sorted({problem for each in mine for problem in each.broken})) or "none"
    head = f"| {target} | {sent.name} | {len(mine)} | {min(kept)} to {max(kept)} | {codes} "
    return f"{head}| {ended:.1f} | {went_on:.1f} | {broken} |"


def main() -> None:
    """Make the trials that are asked for; a table with enough of each kind is written into the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="number of the first trial: one that broke, again")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--race", action="store_true", help="two launches race in each trial; no table is written")
    asked = parser.parse_args()
    make = trial.race if asked.race else trial.run
    found = []
    with TemporaryDirectory() as folder:
        campaigns = [undisturbed(name, text, Path(folder)) for name, text in CAMPAIGNS.items()]
        for number in range(asked.first, asked.first + asked.trials):
            found.append(make(number, asked.seed, campaigns, Path(folder)))
            print(found[-1], flush=True)
    rows = table(found)
    print("\n".join(rows))
    if not asked.race and asked.trials >= ENOUGH * len(KINDS):
        put(README, "kills", rows)
    sys.exit(any(each.broken for each in found))


if __name__ == "__main__":
    main()
