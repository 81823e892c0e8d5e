"""Damage the files of a campaign and write the table of what came of it: `python -m tests.study.results.fuzz`."""

import argparse
import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

from nanoslip.study.run.launch import pin_threads
from tests.study.results.fuzz.finished import finished
from tests.study.results.fuzz.trials import Trials, trials
from tests.study.results.fuzz.verdicts import SOUND, Verdict
from tests.written_tables import put

README = Path(__file__).parents[1] / "README.md"
ALL_BITS = 10_000
CUTS = 100


def table(found: list[Trials]) -> list[str]:
    """The trials, by sort of file and of damage."""
    every = sum((each.verdicts for each in found), Counter[Verdict]())
    defects = sum(count for what, count in every.items() if what not in SOUND)
    shown = [what for what in Verdict if what in SOUND or every[what]]
    said = f"{every.total()} damages, {defects} defects."
    head = f"| file | damage | times | {' | '.join(shown)} |"
    rows = (
        f"| {each.sort} | {each.what} | {each.verdicts.total()} | {' | '.join(str(each.verdicts[what]) for what in shown)} |"
        for each in found
    )
    return [said, "", head, "|---" * (3 + len(shown)) + "|", *rows]


def main() -> None:
    """Do the damages; the table of a whole set of bits is written into the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bits", type=int, default=ALL_BITS, help="single bits of each sort of file")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    pin_threads()
    found = []
    with TemporaryDirectory() as folder:
        for each in trials(finished(Path(folder)), asked.bits, CUTS, asked.seed):
            found.append(each)
            print(each.sort, each.what, dict(each.verdicts), *each.defects[:3], sep="\n", flush=True)
    rows = table(found)
    print("\n".join(rows))
    if asked.bits >= ALL_BITS:
        put(README, "fuzz", rows)
    sys.exit(any(each.defects for each in found))


if __name__ == "__main__":
    main()
