"""One damage after the other to a copy of a finished campaign's folder."""

import random
import shutil
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from tests.study.results.fuzz.damages import Damage, bits, rough
from tests.study.results.fuzz.finished import Finished
from tests.study.results.fuzz.verdicts import SOUND, Verdict, verdict

THOROUGH: Final = 200
"""The dataset is collected after one of so many damages; after the others the results that make it are compared."""


@dataclass
class Trials:
    """What came of damages of one sort to one sort of file."""

    sort: str
    what: str
    verdicts: Counter[Verdict] = field(default_factory=Counter)
    defects: list[str] = field(default_factory=list)

    def make(self, finished: Finished, damages: Iterable[Damage]) -> None:
        """Do each damage to a copy of its own."""
        path, copy = finished.files[self.sort], finished.out.with_name("copy")
        for number, damage in enumerate(damages):
            shutil.copytree(finished.out, copy)
            damage(copy, path)
            found, more = verdict(finished, copy, path, number % THOROUGH == 0)
            self.verdicts[found] += 1
            if found not in SOUND:
                self.defects.append(f"{self.sort}, {damage}: {found}\n{more}")
            shutil.rmtree(copy)


def trials(finished: Finished, count: int, cuts: int, seed: int) -> Iterable[Trials]:
    """Single bits, so many of each sort of file, and everything else. cuts: places that are cut, overwritten, put into."""
    for sort, path in finished.files.items():
        drawn = random.Random(f"{seed} {sort}")
        single = Trials(sort, "single bits")
        single.make(finished, bits(finished.out / path, count, drawn))
        yield single
        others = [other for other in finished.files.values() if other != path]
        more = Trials(sort, "all else")
        more.make(finished, rough(finished.out / path, others, cuts, drawn))
        yield more
