"""A campaign's plan, and what `plan`, `status` and `run` print of it."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from solver.outcome import Outcome
from study.commands.shared.arguments import folder
from study.execution.failures import left
from study.manifest.reader import load_manifest
from study.origin import Origins, census, here
from study.plan.plan import Plan, make_plan
from study.plan.tasks import Task
from study.report.console import counting, say, whole
from study.results.attempts import Attempt
from study.results.shard import folders
from study.results.store import Store


def planned(campaign: Path) -> Plan:
    """The plan of a campaign file. Raises ManifestError."""
    with counting("{} cases planned") as heard:
        return make_plan(load_manifest(campaign), heard)


@dataclass(frozen=True, slots=True)
class Standing:
    """A campaign's plan, and how far it is."""

    campaign: Path
    plan: Plan
    stores: tuple[Store, ...]
    """The campaign's own, and those of shards that are not merged."""
    remaining: tuple[Task, ...]
    """Tasks that the next run would try."""
    given_up: tuple[Task, ...]
    """Tasks that have failed, or need one that has: it would not."""
    foreign: Mapping[str, Origins]
    """Finished results of other software."""

    def again(self) -> "Standing":
        """How far it is by now."""
        return _standing(self.campaign, self.plan, self.stores)

    @property
    def outcomes(self) -> dict[str, Outcome]:
        """Key -> how each task has ended: results, what failed, and what needs that."""
        failed = {key: attempt.outcome for key, attempt in _failures(self.stores).items()}
        finished = {key: outcome for store in self.stores for key, outcome in store.outcomes().items()}
        return self.plan.outcomes(finished, failed)


def standing(campaign: Path, out: Path | None) -> Standing:
    """How far a campaign is. Raises ManifestError. out: folder of the results, None for the campaign's own."""
    return _standing(campaign, planned(campaign), (Store(folder(campaign, out)),))


def _standing(campaign: Path, plan: Plan, known: tuple[Store, ...]) -> Standing:
    """known: stores that have been looked at; what has not changed in them is not looked at again."""
    have = {store.folder.parent: store for store in known}
    out = known[0].folder.parent
    stores = tuple(have.get(each) or Store(each) for each in (out, *folders(out)))
    found = {key: origins for store in stores for key, origins in store.inventory().items()}
    work = left(plan, _failures(stores), found)
    return Standing(campaign, plan, stores, work.tasks, work.given_up, plan.foreign(found))


def _failures(stores: Iterable[Store]) -> dict[str, Attempt]:
    return {key: attempt for store in stores for key, attempt in store.failures().items()}


@dataclass(frozen=True, slots=True)
class KindCount:
    """Tasks of one kind: how many, and what they cost."""

    all: int
    finished: int
    left: int
    given_up: int
    core_seconds_left: float
    memory_bytes: float
    """Of the largest one."""
    disk_bytes: float
    """Of all of them."""


def counts(standing: Standing) -> dict[str, KindCount]:
    """Kind of task -> count and costs, in the order in which they begin."""
    lost, left = Counter(task.kind for task in standing.given_up), Counter(task.kind for task in standing.remaining)
    seconds: dict[str, float] = {}
    for task in standing.remaining:
        seconds[task.kind] = seconds.get(task.kind, 0) + task.cost
    kinds: defaultdict[str, list[Task]] = defaultdict(list)
    for task in standing.plan.tasks:
        kinds[task.kind].append(task)
    found = {}
    for kind, every in kinds.items():
        count, memory, disk = len(every), max(task.memory for task in every), sum(task.disk for task in every)
        finished = count - left[kind] - lost[kind]
        found[kind] = KindCount(count, finished, left[kind], lost[kind], seconds.get(kind, 0), memory, disk)
    return found


def counts_as_data(standing: Standing) -> dict[str, Any]:
    """The counts for scripts."""
    return {kind: asdict(count) for kind, count in counts(standing).items()}


def print_foreign(foreign: Mapping[str, Origins], campaign: Path, stderr: bool = False) -> None:
    """Print which finished results are by other software, and how to compute them again; nothing where none are."""
    if not foreign:
        return
    parts = "; ".join(f"{count} of {origin}" for origin, count in sorted(census(foreign.values()).items()))
    say(
        f"{len(foreign)} finished results are other software's: {parts}; here is {here()}. They are used as they are; "
        f"{whole(f'nanoslip run {campaign} --recompute-foreign')} computes them again",
        stderr=stderr,
    )


def counted(number: int, what: str) -> str:
    """A number of things in words: `1 case`, `2 cases`."""
    return f"{number} {what}{'' if number == 1 else 's'}"
