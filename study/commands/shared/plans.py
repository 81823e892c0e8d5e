"""A campaign's plan, and what `plan`, `status` and `run` print of it."""

import shlex
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

from nanoslip.solver.outcome import Outcome
from nanoslip.study.commands.shared.arguments import folder
from nanoslip.study.garbage import all_kept, keep_for_good
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.origin import Origins, census, here
from nanoslip.study.plan.plan import KindCount, Plan, kind_counts, make_plan
from nanoslip.study.plan.task import idle
from nanoslip.study.plan.tasks import Task
from nanoslip.study.report.console import counting, say, whole
from nanoslip.study.results.shard import folders
from nanoslip.study.results.store import Store
from nanoslip.study.run.executor import left
from nanoslip.study.run.journal import measured_in
from nanoslip.study.run.progress import Measured

PLANNED: Final = "{} cases planned"
"""What is shown while a plan is made."""


def planned(campaign: Path) -> Plan:
    """The plan of a campaign file. Raises ManifestError."""
    return planned_from(load_manifest(campaign))


def planned_from(manifest: Manifest) -> Plan:
    """The plan of a campaign. Raises ManifestError."""
    with counting(PLANNED) as heard, all_kept():
        plan = make_plan(manifest, heard)
        keep_for_good()
    return plan


def idle_lines(plan: Plan) -> list[str]:
    """The parameters of a campaign that change nothing in any of its cases, each with the reason; limits of contacts aside."""
    manifest = plan.manifest
    given = {*manifest.axes, *manifest.fixed} - {*manifest.limits}
    cases = [case.case for case in plan.cases if case.case is not None]
    return list(idle(cases, given, manifest.stages == ("contact",)))


@dataclass(frozen=True, slots=True)
class Standing:
    """A campaign's plan and its progress: what is finished, failed and left."""

    campaign: Path
    into: Path
    """Folder of the results."""
    plan: Plan
    stores: tuple[Store, ...]
    """The campaign's own, and those of shards that are not merged."""
    kinds: Mapping[str, KindCount]
    """Kind of task -> count and costs, in the order in which they begin."""
    remaining: tuple[Task, ...]
    """Tasks that the next run would try."""
    given_up: tuple[Task, ...]
    """Tasks that it would not: failed, or in need of one that has."""
    foreign: Mapping[str, Origins]
    """Finished results of other software."""
    measured: Measured
    """What tasks took: `kinds` are scaled by it."""
    outcomes: Mapping[str, Outcome]
    """Key of each task that has ended -> how."""

    def again(self) -> "Standing":
        """How far it is by now; what has not changed is not looked at again."""
        return _standing(self.campaign, self.into, self.plan, self.stores)


def standing(campaign: Path, out: Path | None, measure: Callable[[Plan], Measured] | None = None) -> Standing:
    """How far a campaign is. Raises ManifestError.

    out: folder of the results, None for the campaign's own. measure: what tasks take; None: as the journals there say.
    """
    return _standing(campaign, folder(campaign, out), planned(campaign), (), measure)


def _standing(
    campaign: Path,
    into: Path,
    plan: Plan,
    known: tuple[Store, ...],
    measure: Callable[[Plan], Measured] | None = None,
) -> Standing:
    have = {store.folder.parent: store for store in known}
    stores = tuple(have.get(each) or Store(each, whole=False) for each in (into, *folders(into)))
    metas = {key: meta for store in stores for key, meta in store.metas().items()}
    failures = {key: attempt for store in stores for key, attempt in store.failures().items()}
    work = left(plan, failures, metas)
    foreign = plan.foreign({key: meta.origins for key, meta in metas.items()})
    measured = measure(plan) if measure else measured_in(into, *folders(into))
    kinds = scaled(kind_counts(plan.tasks, work.tasks, work.given_up), measured)
    outcomes = plan.outcomes(
        {key: meta.outcome for key, meta in metas.items()}, {key: each.outcome for key, each in failures.items()}
    )
    return Standing(campaign, into, plan, stores, kinds, work.tasks, work.given_up, foreign, measured, outcomes)


def scaled(kinds: Mapping[str, KindCount], measured: Measured) -> dict[str, KindCount]:
    """Counts with the seconds that are left as finished tasks lead to expect."""
    return {
        kind: replace(count, core_seconds_left=measured.factor(kind) * count.core_seconds_left)
        for kind, count in kinds.items()
    }


def kinds_as_data(kinds: Mapping[str, KindCount]) -> dict[str, Any]:
    """The counts for scripts."""
    return {kind: asdict(count) for kind, count in kinds.items()}


def advised(command: str, campaign: Path, into: Path, *options: str) -> str:
    """A command on a campaign, for advice: as it is to be typed, with the folder of its results where that is not its own."""
    out = () if into == folder(campaign, None) else ("--out", str(into))
    return whole(f"nanoslip {shlex.join([command, str(campaign), *out, *options])}")


def print_foreign(foreign: Mapping[str, Origins], campaign: Path, into: Path, stderr: bool = False) -> None:
    """Print which finished results are by other software, and how to compute them again; nothing where none are."""
    if not foreign:
        return
    parts = "; ".join(f"{count} of {origin}" for origin, count in sorted(census(foreign.values()).items()))
    say(
        f"{len(foreign)} finished results are other software's: {parts}; here is {here()}. They are used as they are; "
        f"{advised('run', campaign, into, '--recompute-foreign')} computes them again",
        stderr=stderr,
    )


def counted(number: int, what: str) -> str:
    """A number of things in words: `1 case`, `2 cases`."""
    return f"{number} {what}{'' if number == 1 else 's'}"
